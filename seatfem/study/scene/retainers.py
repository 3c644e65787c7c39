"""The shape of a retainer along a reed that rolls on it, and its face under the reed."""

from __future__ import annotations

import math
from functools import lru_cache
from pathlib import Path
from typing import ClassVar, Final

import numpy as np
from pydantic import Field
from scipy.interpolate import PchipInterpolator

from impact.files.csv_table import read_needed_csv
from impact.greens.base import Array
from seatfem.fields import Contradictions, ExistingFile, Gap, KeyProblem, Length, Table, absent, default
from seatfem.structures.errors import GeometryError
from seatfem.structures.inspection.cad import Shape
from seatfem.structures.kinds import Structure
from seatfem.structures.lands import FaceLip, Land, axes_along
from seatfem.structures.outlines import BodyViews, length_text
from seatfem.structures.strips import Strip
from seatfem.units import write_quantity

CUTS: Final = 300  # cuts across the reed between which its width is taken as linear
BEYOND: Final = 1.01  # half the width of a face that reaches over the sides of the reed, over half of the reed's
SHOWN: Final = 0.05  # thickness in which it is drawn, over its length
LENGTHS: Final = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "in": 0.0254}
COLUMNS: Final = {"along": LENGTHS, "height": LENGTHS}
LIKE: Final = "'along [mm],height [mm]'"


class Profile(Table):
    """The shape of the stopper's face along a clamped reed, as of the retainer of a discharge valve.

    At a distance x from the reed's clamp the face lies gap + h(x) beyond the undeformed reed. The reed rolls on it in
    segments of equal areas (arcs), each with its own gap. A spring's stiffness is that of the whole face, spread evenly
    over the segments; the face of a solid is displaced as a whole, by its mean.
    """

    sample: ClassVar[str] = 'radius = "200 mm"'

    radius: Length | None = absent("radius of curvature from start on: h = radius - sqrt(radius^2 - (x - start)^2)")
    file: ExistingFile | None = Field(
        None,
        description="instead of the radius: CSV file with the header `along [mm],height [mm]`: distances x from the "
        "clamp, which rise, and heights h, linear in between",
    )
    own_face: bool = default(
        False,
        "instead of both: whether the heights are those of the struck face of a stopper of kind cad or mesh, seen "
        "along that axis of the part which is nearest to its normal. The end at which it comes nearest to the reed "
        "lies at start",
        strict=True,
    )
    start: Gap = default("0 mm", "distance of its beginning from the reed's clamp")
    end: Length | None = absent("distance of its end; where absent that of the reed, or the last one in the file")
    width: Length | None = absent("width across the reed; that of the reed where absent")

    def contradictions(self) -> Contradictions:
        if (self.radius is not None) + (self.file is not None) + self.own_face != 1:
            yield "radius", "give exactly one of radius, file and own_face"
            return
        if self.end is not None and self.end <= self.start:
            words = f"{write_quantity(self.end, 'length')} is not beyond start, {write_quantity(self.start, 'length')}"
            yield "end", f"{words}; make it larger"
        if self.file is None:
            return
        along, _ = self._read(self.file)
        for key, place in (("start", self.start), ("end", self.end)):
            if place is not None and not along[0] <= place <= along[-1]:
                ends = " to ".join(write_quantity(float(each), "length") for each in (along[0], along[-1]))
                yield key, f"{write_quantity(place, 'length')} lies beyond the heights of the file, known from {ends}"

    @staticmethod
    def _read(file: Path) -> tuple[Array, Array]:
        """Return places and heights (n,) in a file [m]. Raises `KeyProblem` for places that do not rise."""
        try:
            numbers, factors = read_needed_csv(file, ValueError, LIKE).quantities(COLUMNS, {}, {})
        except ValueError as error:
            raise KeyProblem("file", str(error)) from None
        along, heights = (numbers * factors).T
        if len(along) < 2 or not np.all(np.diff(along) > 0):
            raise KeyProblem("file", f"{file}: its places must rise from row to row, in two rows or more")
        return along, heights

    def _table(self, body: Structure) -> tuple[Array, Array]:
        """Return places and heights (n,) in the file or of the body's face [m]."""
        if self.file is not None:
            return self._read(self.file)
        along, heights, _ = _profile_of_face(body)
        return self.start + along, heights

    def heights(self, along: Array, body: Structure) -> Array:
        """Return the heights h of the face of the stopper's ``body`` [m] at distances from the reed's clamp [m]."""
        if self.own_face:  # a smooth face, known at the corners of triangles
            return np.asarray(PchipInterpolator(*self._table(body))(along))
        if self.radius is None:
            return np.interp(along, *self._table(body))
        reach = np.maximum(along - self.start, 0.0)
        return np.asarray(self.radius - np.sqrt(np.maximum(self.radius**2 - reach**2, 0.0)))

    def face(self, reed: BodyViews, body: Structure) -> FaceLip:
        """Return the part of the face of the stopper's ``body`` that lies over a reed, undivided, from the reed's
        contact in the frame of its views turned over.

        Raises:
            KeyProblem: a reed without a clamp, or one beside the face; a radius shorter than the face.
        """
        root, loops = distance_of_clamp(reed), tuple(loop * (1.0, -1.0) for loop in reed.plan)
        far = root + max(float(loop[:, 0].max()) for loop in loops)
        end, width = far if self.end is None else min(far, self.end), self.width or math.inf
        if self.radius is None:
            end = min(end, float(self._table(body)[0][-1]))
        if self.own_face:
            width = min(width, _profile_of_face(body)[2])
        if end <= self.start:
            words = f"the retainer begins {write_quantity(self.start, 'length')} from the clamp, where the reed has"
            raise KeyProblem("start", f"{words} ended, at {write_quantity(far, 'length')}; make it smaller")
        if self.radius is not None and end - self.start > self.radius:
            words = f"{write_quantity(self.radius, 'length')} is less than the length of the face on the reed"
            raise KeyProblem("radius", f"{words}, {write_quantity(end - self.start, 'length')}; state a larger one")
        half = min(BEYOND * max(float(np.abs(loop[:, 1]).max()) for loop in loops), width / 2)
        return FaceLip(_land(self.start - root, end - root, half, tuple(loop.tobytes() for loop in loops)))

    def views(self, reed: BodyViews, body: Structure) -> BodyViews:
        """Return the outlines of a retainer with this face over a reed, in section and plan as of a seat, from the
        reed's contact. Raises as `face`."""
        face, root = self.face(reed, body), distance_of_clamp(reed)
        left, right = face.lines_across(2)[0]
        x = np.array([left[0, 0], *left[:, 0], left[-1, 0]])
        below = self.heights(root + x, body)
        below[[0, -1]] = below.max() + SHOWN * (x[-1] - x[0])
        return BodyViews(
            "retainer" if self.radius is None else f"retainer, R {length_text(self.radius)}",
            section=(np.column_stack([x, -below]),),
            plan=(np.concatenate([left, right[::-1]]),),
        )


def distance_of_clamp(reed: BodyViews) -> float:
    """Return the distance of a reed's contact from its clamp [m]. Raises `KeyProblem` for a reed without a clamp."""
    if not reed.clamp:
        raise KeyProblem("", f"a {reed.name} has no clamp from which it rolls on a retainer; take a beam or a flapper")
    return -min(float(line[:, 0].min()) for line in reed.clamp)


def _profile_of_face(body: Structure) -> tuple[Array, Array, float]:
    """Return distances from the end at which the struck face of a solid comes nearest to the reed, its heights there
    (n,), and its width [m]. Raises `KeyProblem` for a body without faces of triangles."""
    try:
        return _along_the_part(body.part().shape, body.struck_face)
    except GeometryError as error:
        raise KeyProblem("own_face", f"{error}; or state radius or file") from None


@lru_cache(maxsize=4)
def _along_the_part(shape: Shape, face: str) -> tuple[Array, Array, float]:
    rows = shape.groups[face]
    mean = (shape.areas[rows, None] * shape.normals[rows]).sum(axis=0)
    outward = np.sign(mean[np.abs(mean).argmax()]) * np.eye(3)[np.abs(mean).argmax()]
    x, y, z = axes_along(outward)
    points = shape.points[np.unique(shape.triangles[rows])]
    along, first = np.unique(np.round(points @ x, 9), return_inverse=True)
    heights = -np.bincount(first, points @ z) / np.bincount(first)
    heights -= heights.min()
    if heights[-1] < heights[0]:
        along, heights = -along[::-1], heights[::-1]
    return along - along[0], heights, float(np.ptp(points @ y))


@lru_cache(maxsize=8)
def _land(start: float, end: float, half: float, outline: tuple[bytes, ...]) -> Land:
    """Return what of a rectangle along the x axis lies within an outline, loops (n, 2) of float64 [m]."""
    x = np.linspace(start, end, CUTS + 1)
    left, right = (np.column_stack([x, np.full(len(x), side * half)]) for side in (1.0, -1.0))
    loops = tuple(np.frombuffer(loop).reshape(-1, 2) for loop in outline)
    return Land((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), Strip(left, right, closed=False).within(loops))


@lru_cache(maxsize=32)
def middles(face: FaceLip) -> tuple[float, ...]:
    """Return the mean distances of the segments of a face from the reed's contact, along the reed [m]."""
    return tuple(face.lines()[..., 0].mean(axis=(1, 2)).tolist())
