"""Powers of ten at axes in Unicode: matplotlib's own go through a parser of TeX, a quarter of the time of a figure.

Loads matplotlib: imported where a figure is made.
"""

from __future__ import annotations

import re
from typing import Any, Final

from matplotlib.figure import Figure
from matplotlib.ticker import LogFormatterSciNotation, ScalarFormatter

_RAISED: Final = str.maketrans("0123456789-−", "⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁻")


def label_in_unicode(figure: Figure) -> None:
    """What matplotlib itself has chosen to label axes by writes powers of ten in Unicode from now on."""
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            for formatter in (axis.get_major_formatter(), axis.get_minor_formatter()):
                formatter.__class__ = _OURS.get(type(formatter), type(formatter))  # keeps its settings


def without_tex(told: str) -> str:
    """``"2×10⁻³"`` of ``"$\\mathdefault{2\\times10^{-3}}$"``."""
    raised = re.sub(r"\^\{([-−\d]+)\}", lambda found: found[1].translate(_RAISED), told)
    return re.sub(r"\\mathdefault|[${}]", "", raised.replace(r"\times", "×"))


class Linear(ScalarFormatter):
    """Labels of linear axes, with their common factor."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        return without_tex(super().__call__(x, pos))

    def get_offset(self) -> str:
        return without_tex(super().get_offset())


class Powers(LogFormatterSciNotation):
    """Labels of logarithmic axes."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        return without_tex(super().__call__(x, pos))


_OURS: Final[dict[type, Any]] = {ScalarFormatter: Linear, LogFormatterSciNotation: Powers}
