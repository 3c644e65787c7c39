"""Powers of ten at axes in Unicode: matplotlib's own go through a parser of TeX, a quarter of the time of a figure."""

from __future__ import annotations

import re
from functools import cache
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_RAISED: Final = str.maketrans("0123456789-−", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁻")


def label_in_unicode(figure: Figure) -> None:
    """Make what matplotlib itself has chosen to label axes by write powers of ten in Unicode from now on."""
    ours = _formatters()
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            for formatter in (axis.get_major_formatter(), axis.get_minor_formatter()):
                formatter.__class__ = ours.get(type(formatter), type(formatter))  # keeps its settings


def without_tex(told: str) -> str:
    """Return ``"2×10⁻³"`` of ``"$\\mathdefault{2\\times10^{-3}}$"``."""
    raised = re.sub(r"\^\{([-−\d]+)\}", lambda found: found[1].translate(_RAISED), told)
    return re.sub(r"\\mathdefault|[${}]", "", raised.replace(r"\times", "×"))


@cache
def _formatters() -> dict[type, Any]:
    """Return our formatters by matplotlib's: labels of logarithmic axes, and the factor beside linear ones."""
    from matplotlib.ticker import LogFormatterSciNotation, ScalarFormatter

    class Linear(ScalarFormatter):
        def __call__(self, x: float, pos: int | None = None) -> str:
            return without_tex(super().__call__(x, pos))

        def get_offset(self) -> str:
            return without_tex(super().get_offset())

    class Powers(LogFormatterSciNotation):
        def __call__(self, x: float, pos: int | None = None) -> str:
            return without_tex(super().__call__(x, pos))

    return {ScalarFormatter: Linear, LogFormatterSciNotation: Powers}
