"""The shape of a stopper's face along a reed, as a table, and the face of a retainer under a reed that rolls on it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import ClassVar, Final

import numpy as np
import scipy
from pydantic import Field

from impact.files.csv_table import read_needed_csv
from impact.greens.base import Array
from seatfem.fields import Contradictions, ExistingFile, Gap, KeyProblem, Length, Table, absent, default
from seatfem.structures.errors import GeometryError, MeshError, ModelError
from seatfem.structures.inspection import cad
from seatfem.structures.kinds import Structure
from seatfem.structures.lands import FLAT, FaceLip, Land, axes_along
from seatfem.structures.outlines import BodyViews, length_text
from seatfem.structures.strips import Strip
from seatfem.units import write_quantity

OFF: Final = 1 + 1e-6  # so that no side of the face runs along a side of the reed
WHOLE: Final = 0.99  # share of the length on which the reed lies over the face, with an allowance for its ends
STRAIGHT: Final = 1e-3  # difference in x of a clamp that counts as none, over the length of the reed
CUTS: Final = 300  # cuts across the reed between which its width is taken as linear
BEYOND: Final = 1.01  # half the width of a face that reaches over the sides of the reed, over half of the reed's
SHOWN: Final = 0.05  # thickness in which it is drawn, over its length
ALIKE: Final = 1e-3  # distance along a face that counts as none, over its length


@dataclass(frozen=True)
class Retainer:
    """A stopper's ``body`` with a ``profile``, on which a clamped reed rolls."""

    profile: Profile
    body: Structure

    def _table(self) -> tuple[Array, Array]:
        """Return places and heights (n,) in the file or of the body's face [m]."""
        if self.profile.file is not None:
            return read_heights(self.profile.file)
        along, heights, _ = _profile_of_face(self.body)
        return self.profile.begins() + along, heights

    def heights(self, along: Array) -> Array:
        """Return the heights h of the face [m] at distances from the reed's clamp [m]."""
        if self.profile.own_face:  # a smooth face, known at the corners of triangles
            known, heights = self._table()
            return np.asarray(scipy.interpolate.PchipInterpolator(known, heights)(np.clip(along, known[0], known[-1])))
        if self.profile.radius is None:
            return np.interp(along, *self._table())
        reach = np.maximum(along - self.profile.begins(), 0.0)
        return np.asarray(self.profile.radius - np.sqrt(np.maximum(self.profile.radius**2 - reach**2, 0.0)))

    def face(self, reed: BodyViews) -> FaceLip:
        """Return the part of the face that lies over a reed, undivided, from the reed's contact in the frame of its
        views turned over.

        Raises:
            KeyProblem: a reed without one straight clamp across it, one beside the face, or slotted over it; a radius
                shorter than the face, or over a reed that is held at both ends.
        """
        root, loops = distance_of_clamp(reed), tuple(loop * (1.0, -1.0) for loop in reed.plan)
        far = root + max(float(loop[:, 0].max()) for loop in loops)
        start = self.profile.begins()
        if self.profile.radius is not None and len(reed.clamp) > 1:
            raise KeyProblem("radius", "it rises to one end, and this reed is held at both; state the heights by file")
        end, width = far if self.profile.end is None else min(far, self.profile.end), self.profile.width or math.inf
        if self.profile.radius is None:
            end = min(end, float(self._table()[0][-1]))
        if self.profile.own_face:
            width = min(width, _profile_of_face(self.body)[2])
        if end <= start:
            words = f"the retainer begins {write_quantity(start, 'length')} from the clamp, where the reed has"
            raise KeyProblem("start", f"{words} ended, at {write_quantity(far, 'length')}; make it smaller")
        if self.profile.radius is not None and end - start > self.profile.radius:
            words = f"{write_quantity(self.profile.radius, 'length')} is less than the length of the face on the reed"
            raise KeyProblem("radius", f"{words}, {write_quantity(end - start, 'length')}; state a larger one")
        half = OFF * min(BEYOND * max(float(np.abs(loop[:, 1]).max()) for loop in loops), width / 2)
        land = _land(start - root, end - root, half, tuple(loop.tobytes() for loop in loops))
        if sum(float(np.ptp(strip.middles[:, 0])) for strip in land.strips) < WHOLE * (end - start):
            words = "a reed cannot roll where it is slotted, holed or narrower than 10 % of its width"
            raise KeyProblem("end", f"{words}; let the retainer end before, or state a smaller width")
        return FaceLip(land)

    def views(self, reed: BodyViews) -> BodyViews:
        """Return the outlines of a retainer with this face over a reed, in section and plan as of a seat, from the
        reed's contact. Raises as `face`."""
        face, root = self.face(reed), distance_of_clamp(reed)
        left, right = face.lines_across(2)[0]
        x = np.array([left[0, 0], *left[:, 0], left[-1, 0]])
        below = self.heights(root + x)
        below[[0, -1]] = below.max() + SHOWN * (x[-1] - x[0])
        return BodyViews(
            "retainer" if self.profile.radius is None else f"retainer, R {length_text(self.profile.radius)}",
            section=(np.column_stack([x, -below]),),
            plan=(np.concatenate([left, right[::-1]]),),
        )


def distance_of_clamp(reed: BodyViews) -> float:
    """Return the distance of a reed's contact from its clamp [m]. Raises `KeyProblem` for a reed without a clamp."""
    if not reed.clamp:
        raise KeyProblem("", f"a {reed.name} has no clamp from which it rolls on a retainer; take a beam or a flapper")
    x = reed.clamp[0][:, 0]
    size = float(np.ptp(np.concatenate(reed.plan)[:, 0]))
    if float(np.ptp(x)) > STRAIGHT * size or float(x.max()) >= 0:
        words = "a profile needs a straight clamp square to the reed's x axis, at the smaller x"
        raise KeyProblem("", f"{words}; turn the sheet, or remove the profile")
    return -float(x.min())


def _profile_of_face(body: Structure) -> tuple[Array, Array, float]:
    """Return distances from the end at which the struck face of a solid comes nearest to the reed, its heights there
    (n,), and its width [m]. Raises `KeyProblem` for a body without faces of triangles."""
    try:
        shape = body.part().shape
    except (GeometryError, ModelError, MeshError) as error:
        raise KeyProblem("own_face", f"{error}; or state radius or file") from None
    if body.struck_face not in shape.groups:
        raise KeyProblem("own_face", "stopper.contact selects no face of the file; select one, or state radius or file")
    return _measure_face_profile(shape, body.struck_face, body.own_axis)


@lru_cache(maxsize=4)
def _measure_face_profile(shape: cad.Shape, face: str, axis: tuple[float, ...]) -> tuple[Array, Array, float]:
    rows = shape.groups[face]
    mean = (shape.areas[rows, None] * shape.normals[rows]).sum(axis=0)
    outward = np.sign(mean[np.abs(mean).argmax()]) * np.eye(3)[np.abs(mean).argmax()]
    x, y, z = axes_along(outward, axis)
    points = shape.points[np.unique(shape.triangles[rows])]
    at, up = points @ x, -(points @ z)
    cells = np.round((at - at.min()) / (ALIKE * float(np.ptp(at)))).astype(int)  # points of the same place along it
    _, cell, counts = np.unique(cells, return_inverse=True, return_counts=True)
    along, heights = (np.bincount(cell, values) / counts for values in (at, up))
    off = float(np.abs(up - np.interp(at, along, heights)).max())
    if off > FLAT * float(np.ptp(at)):
        words = f"the heights of the struck face differ by {write_quantity(off, 'length')} across the reed"
        raise KeyProblem("own_face", f"{words}; state the direction of the reed, stopper.along, or a file")
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
    start: Gap | None = absent(
        "distance of its beginning from the reed's clamp; where absent 0 mm, or the first one in the file"
    )
    end: Length | None = absent("distance of its end; where absent that of the reed, or the last one in the file")
    width: Length | None = absent("width across the reed; that of the reed where absent")

    def contradictions(self) -> Contradictions:
        if (self.radius is not None) + (self.file is not None) + self.own_face != 1:
            yield "radius", "give exactly one of radius, file and own_face"
            return
        if self.end is not None and self.end <= (self.start or 0.0):
            words = f"{write_quantity(self.end, 'length')} is not beyond start"
            yield "end", f"{words}; make it larger"
        if self.file is None:
            return
        along, _ = read_heights(self.file)
        for key, place in (("start", self.start), ("end", self.end)):
            if place is not None and not along[0] <= place <= along[-1]:
                ends = " to ".join(write_quantity(float(each), "length") for each in (along[0], along[-1]))
                yield key, f"{write_quantity(place, 'length')} lies beyond the heights of the file, known from {ends}"

    def begins(self) -> float:
        """Return the distance of its beginning from the reed's clamp [m]."""
        if self.start is not None:
            return self.start
        return 0.0 if self.file is None else float(read_heights(self.file)[0][0])


def read_heights(file: Path) -> tuple[Array, Array]:
    """Return places along a reed and heights (n,) in a file [m], cached in the process while it is unchanged. Raises
    `KeyProblem` for a file that cannot be used."""
    try:
        return _read(file, file.stat().st_mtime_ns)
    except (ValueError, OSError) as error:
        raise KeyProblem("file", str(error)) from None


@lru_cache(maxsize=4)
def _read(file: Path, _: int) -> tuple[Array, Array]:
    numbers, factors = read_needed_csv(file, ValueError, LIKE).quantities(COLUMNS)
    along, heights = (numbers * factors).T
    if len(along) < 2 or not np.all(np.diff(along) > 0):
        raise ValueError(f"{file}: its places must rise from row to row, in two rows or more")
    return along, heights
