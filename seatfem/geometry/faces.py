"""Faces of a solid and the selectors that pick them: add a new way of selecting here, and to ``SELECTORS``."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from seatfem.geometry.checks import GeometryError

LENGTH_TOLERANCE = 1e-6  # metres; what CAD exchange files keep
ANGLE_TOLERANCE = 1e-3  # radians

Vector = tuple[float, float, float]
Colour = tuple[int, int, int, int]

CONTACT_COLOUR: Colour = (255, 0, 0, 255)
FIXED_COLOUR: Colour = (0, 0, 255, 255)


@dataclass(frozen=True, eq=False)
class Face:
    """One face of a solid, in metres. ``normal`` points out of the solid; it is None where the face is curved."""

    tag: int
    kind: str
    centre: Vector
    area: float
    outline: NDArray[np.float64]  # points on the boundary curves, shape (n, 3)
    curves: frozenset[int]
    normal: Vector | None = None
    colour: Colour | None = None

    def __str__(self) -> str:
        x, y, z = (f"{1e3 * c:.4g}" for c in np.round(self.centre, 12) + 0.0)
        text = f"face {self.tag}: {self.kind}, centre ({x}, {y}, {z}) mm, area {1e6 * self.area:.4g} mm^2"
        if self.normal is not None:
            text += ", normal ({:.3g}, {:.3g}, {:.3g})".format(*(np.round(self.normal, 6) + 0.0))
        return text + (", no colour" if self.colour is None else f", colour {self.colour}")


@dataclass(frozen=True)
class PlaneFace:
    """The flat face with outward ``normal`` n in the plane n.x = ``offset`` (metres).

    ``radius_min`` and ``radius_max`` keep only faces whose boundary curves lie between these distances from the
    axis along n through ``axis_point``. ``several``: accept faces that do not touch each other.
    """

    normal: Vector
    offset: float
    radius_min: float = 0.0
    radius_max: float = math.inf
    axis_point: Vector = (0.0, 0.0, 0.0)
    several: bool = False

    def __post_init__(self) -> None:
        if not np.linalg.norm(self.normal) > 0.0:
            raise GeometryError(f"PlaneFace.normal = {self.normal}: must not be zero")

    def matches(self, face: Face) -> bool:
        if face.normal is None:
            return False
        n = np.asarray(self.normal) / np.linalg.norm(self.normal)
        aligned = np.linalg.norm(n - face.normal) < ANGLE_TOLERANCE
        in_plane = abs(n @ face.centre - self.offset) < LENGTH_TOLERANCE
        arm = face.outline - self.axis_point
        radius = np.linalg.norm(arm - np.outer(arm @ n, n), axis=1)
        low, high = self.radius_min - LENGTH_TOLERANCE, self.radius_max + LENGTH_TOLERANCE
        return bool(aligned and in_plane and np.all((radius > low) & (radius < high)))

    def __str__(self) -> str:
        text = f"plane face with normal {self.normal}, offset {1e3 * self.offset:g} mm"
        if self.radius_min > 0.0 or math.isfinite(self.radius_max):
            text += f", radius {1e3 * self.radius_min:g} to {1e3 * self.radius_max:g} mm"
        return text


@dataclass(frozen=True)
class ColourFace:
    """The faces painted in one colour (red, green, blue, alpha: 0-255); ``tolerance`` is per channel."""

    colour: Colour
    tolerance: int = 3
    several: bool = True

    def __post_init__(self) -> None:
        if len(self.colour) != 4 or not all(0 <= c <= 255 for c in self.colour):
            raise GeometryError(f"ColourFace.colour = {self.colour}: must be four numbers from 0 to 255")

    def matches(self, face: Face) -> bool:
        if face.colour is None:
            return False
        return all(abs(a - b) <= self.tolerance for a, b in zip(self.colour, face.colour, strict=True))

    def __str__(self) -> str:
        return f"faces of colour {self.colour}"


Selector = PlaneFace | ColourFace
Patches = dict[str, tuple[Selector, ...]]
"""Surface groups by name, each the union of what its selectors pick."""

SELECTORS: dict[str, type[Selector]] = {"plane": PlaneFace, "colour": ColourFace}


def select(faces: Sequence[Face], selector: Selector, name: str) -> list[Face]:
    """The faces for the group ``name``.

    Raises `GeometryError`, listing the faces there are, where none matches or where the matching faces do not
    touch each other although the selector asks for one patch.
    """
    found = [face for face in faces if selector.matches(face)]
    if not found:
        raise GeometryError(f"no face for {name!r} ({selector}); the solid has:\n{listing(faces)}")
    if not selector.several and not connected(found):
        raise GeometryError(
            f"ambiguous selection for {name!r} ({selector}): {len(found)} separate faces match; "
            f"narrow it by a radius range, or set several=True. They are:\n{listing(found)}"
        )
    return found


def connected(faces: Sequence[Face]) -> bool:
    """Whether the faces form one patch, each sharing a curve with another."""
    reached, waiting = set(faces[0].curves), list(faces[1:])
    while touching := [face for face in waiting if face.curves & reached]:
        reached.update(*(face.curves for face in touching))
        waiting = [face for face in waiting if face not in touching]
    return not waiting


def listing(faces: Sequence[Face]) -> str:
    """One line per face, for error messages."""
    return "\n".join(f"  {face}" for face in faces)
