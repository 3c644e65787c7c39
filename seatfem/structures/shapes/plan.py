"""Solids that are extruded: a plan in the plane (x, y), and which of its areas are struck and held."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

EVERYWHERE = ""
"""The area that is the whole plan."""


@dataclass(frozen=True)
class Plan:
    """``height``: of the solid above z = 0 (metres). ``top``, ``bottom``: group -> names of areas of the plan."""

    height: float
    top: Mapping[str, tuple[str, ...]]
    bottom: Mapping[str, tuple[str, ...]]

    @property
    def areas(self) -> tuple[str, ...]:
        """Names of all areas but the whole."""
        groups = (*self.top.values(), *self.bottom.values())
        return tuple(dict.fromkeys(area for names in groups for area in names if area != EVERYWHERE))


@dataclass(frozen=True)
class Rectangle:
    """A plan centred on the origin: half its sides along x and y, and those of the patch; ``None``: all is struck."""

    sides: tuple[float, float]
    patch: tuple[float, float] | None = None
