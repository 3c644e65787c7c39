"""Marks of scenes in the charts of a study, which tell how each stands, with or without a landing."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from impact.pictures.drawing import BLUE, GREEN, GREY, ORANGE, PURPLE
from seatfem.study.sweep.limits import (
    CUT_OFF,
    FAILED,
    FAILS,
    HOLDS,
    NEVER_OPENED,
    NO_LANDING,
    NO_VALUE,
    STOPPED,
    UNDECIDED,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MARKS: Final[dict[str, tuple[str, str, bool]]] = {
    HOLDS: ("o", GREEN, True),
    UNDECIDED: ("D", BLUE, False),
    FAILS: ("X", ORANGE, True),
    CUT_OFF: ("s", PURPLE, False),
    NO_LANDING: ("v", GREY, False),
    NEVER_OPENED: ("^", GREY, False),
    NO_VALUE: ("d", GREY, False),
    STOPPED: ("_", "black", True),
    FAILED: ("x", "black", True),
}
"""Mark of each verdict, its colour, and whether it is filled; scenes without a landing have hollow ones."""
SIGNS: Final[dict[str, str]] = {
    HOLDS: "●", UNDECIDED: "◇", FAILS: "✖", CUT_OFF: "□", NO_LANDING: "▽", NEVER_OPENED: "△", STOPPED: "–", FAILED: "×",
}  # fmt: skip
"""The same marks in text."""
NAMES: Final[dict[str, str]] = {
    CUT_OFF: "square", NO_LANDING: "triangle", NEVER_OPENED: "upright triangle", STOPPED: "dash", FAILED: "cross",
}  # fmt: skip
"""Words for the marks of scenes without a complete landing."""
FOOT: Final = 0.04  # height of the marks of scenes without a value, over that of the panel


def look_of(verdict: str, size: float) -> dict[str, Any]:
    """Return how the mark of a verdict is drawn."""
    marker, colour, is_filled = MARKS[verdict]
    face = colour if is_filled else "white"
    return {
        "linestyle": "", "marker": marker, "color": colour, "markersize": size, "zorder": 3, "markerfacecolor": face,
    }  # fmt: skip


def mark_foot(axes: Axes, x: np.ndarray, verdict: str, size: float = 6) -> None:
    """Mark scenes at their abscissae at the foot of a panel, as they have no value."""
    axes.plot(x, np.full(len(x), FOOT), transform=axes.get_xaxis_transform(), **look_of(verdict, size))
