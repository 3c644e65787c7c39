"""Powers of ten at axes in Unicode: matplotlib's own go through a parser of TeX, a quarter of the time of a figure."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

from matplotlib.ticker import LogFormatterSciNotation, ScalarFormatter

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_RAISED: Final = str.maketrans("0123456789-", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻")


def label_in_unicode(figure: Figure) -> None:
    """What matplotlib itself has chosen to label axes by writes powers of ten in Unicode from now on."""
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            for formatter in (axis.get_major_formatter(), axis.get_minor_formatter()):
                if type(formatter) is ScalarFormatter:
                    formatter.__class__ = _Linear  # keeps its settings
                elif type(formatter) is LogFormatterSciNotation:
                    formatter.__class__ = _Powers


def _power_of_ten(exponent: int) -> str:
    return f"10{str(exponent).translate(_RAISED)}"


class _Linear(ScalarFormatter):
    """With "×10⁻³" beside the axis."""

    def get_offset(self) -> str:
        """The factor; where a number is to be added, matplotlib's words."""
        told = super().get_offset()
        mantissa, found, exponent = told.partition("e")
        return f"×{_power_of_ten(int(exponent))}" if found and mantissa == "1" else told


class _Powers(LogFormatterSciNotation):
    """10⁻³ at powers of ten; 2×10⁻³ between them, where matplotlib labels these."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        """Of one tick; "" of one without a label."""
        told = str(super().__call__(x, pos))
        if not told or not x > 0:
            return told
        exponent = math.floor(math.log10(x) + 1e-9)
        factor = round(x / 10.0**exponent, 6)
        return _power_of_ten(exponent) if factor == 1 else f"{factor:g}×{_power_of_ten(exponent)}"
