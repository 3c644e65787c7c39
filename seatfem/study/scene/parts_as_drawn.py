"""Relative position of seat and reed of [assembly] by their files, and checks whether they fit together."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np
from pydantic import TypeAdapter, ValidationError

from impact.greens.base import Array
from seatfem.fields import KeyProblem, problem_of
from seatfem.structures import errors, lands
from seatfem.structures.inspection import outline
from seatfem.structures.inspection.cad import FoundFace, Part, inspect_geometry
from seatfem.structures.inspection.outline import opening
from seatfem.structures.kinds.drawn import Drawn
from seatfem.structures.kinds.sheet import AnyClamp, Clamp, Place
from seatfem.structures.mesh.gmsh_process import MeshingError
from seatfem.structures.shapes import CadPart, Geometry, cad, loops
from seatfem.structures.shapes.selectors import Frame, Vector
from seatfem.study.scene.contact import STEEPEST

KEY: Final = "assembly.placed"
LARGEST: Final = 8.0  # largest plausible ratio of a reed's size to that of its seat
LEAST: Final = 0.03  # smallest plausible ratio of these sizes
NEAREST: Final = 3  # number of faces that a message suggests
SQUARE: Final = 1e-6  # largest distance of a unit normal from an axis of the file
UNITS: Final = {1e-3: "mm", 1.0: "m", 1e-2: "cm", 1e-6: "um", 0.0254: "inch", 0.3048: "ft"}
FACTORS: Final = (1000.0, 25.4, 10.0, 0.1, 1 / 25.4, 1e-3)
"""Factors on the size of a reed whose file, or that of its seat, has another unit than it states."""
USUAL: Final = 0.5  # usual ratio of a reed's size to that of its seat
WITHIN: Final = 8.0  # largest factor from the usual ratio after correction of a unit, if that is to be the reason


@dataclass(frozen=True)
class DrawnClamp:
    """Clamp of a drawn reed: its table, two points on the line [m], and the direction towards the clamped part."""

    table: Any
    ends: tuple[Vector, Vector]
    beyond: Vector | None = None

    def seen_in(self, frame: Frame) -> object:
        """Return the value of the key in coordinates of another frame; a selected face does not change."""
        if not isinstance(self.table, Clamp):
            return self.table
        places = frame.seen(np.array(self.ends))
        if self.beyond is None:
            return [[f"{float(each)!r} m" if abs(each) > 1e-9 else "0 m" for each in place] for place in places]
        normal = frame.axes @ np.array(self.beyond)
        offset = float(normal @ places[0])
        return {"normal": tuple(normal.tolist()), "offset": f"{offset if abs(offset) > 1e-9 else 0.0!r} m"}


@dataclass(frozen=True, eq=False)
class PartsAsDrawn:
    """Reed and seat in the positions of their files.

    Attributes:
        seat, file: the seat's table and the reed's file.
        found: inspected geometry of the seat.
        reed: outline of the reed.
    """

    seat: Drawn
    file: Path
    found: Part
    reed: outline.DrawnOutline

    @cached_property
    def land(self) -> lands.Land:
        """Return the contact face of the seat. Raises `KeyProblem` if it is no lip."""
        try:
            return self.found.land(self.seat.struck_face)
        except errors.ModelError as error:
            raise KeyProblem("seat.contact", f"{self._name}: {error}") from None

    @property
    def frame(self) -> Frame:
        """Return the frame of the reed in its file."""
        assert self.reed.frame is not None
        return self.reed.frame

    def clamp(self, given: object) -> DrawnClamp:
        """Return the clamp from the value of reed.clamped: a line and the side beyond it.

        Raises:
            ValidationError: an invalid value.
            KeyProblem: a face that is no straight side, or coordinates although the reed is oblique in its file.
        """
        table: Any = TypeAdapter(AnyClamp).validate_python(given)
        if not isinstance(table, Clamp):
            with problem_of("reed.clamped", errors.GeometryError, drop="Outlined.clamped = "):
                ends = outline.held_edge(self.file, table.selectors(), self.frame)
            _check_side(len(ends) > 1)
            return DrawnClamp(table, _points(self.frame, ends))
        _check_side(table.hole is None)
        self._check_square("reed.clamped", "select the clamped side as a face, as in { number = 1 }")
        if table.segment is not None:
            if table.segment[0] == table.segment[1]:
                raise KeyProblem("reed.clamped", "both ends are the same place; give both ends of a straight part")
            return DrawnClamp(table, _points(self.frame, table.segment))
        normal = np.array(table.normal) / np.linalg.norm(table.normal)  # type: ignore[arg-type]
        along, (lip,) = np.array([-normal[1], normal[0]]), self.frame.seen(np.array([self.land.centre]))
        foot = (table.offset or 0.0) / float(np.linalg.norm(table.normal)) * normal + (lip @ along) * along  # type: ignore[arg-type]
        x, y, z = (normal @ self.frame.axes).tolist()
        span = self._size * along
        return DrawnClamp(table, _points(self.frame, (foot - span, foot + span)), (x, y, z))

    def placement(self, clamp: DrawnClamp) -> outline.Placement:
        """Return the position of the reed over the lip. Raises `KeyProblem` if the parts do not fit together."""
        side = outline.facing_side(self.reed, self._normal)
        place, name, contact = outline.placed(self.land, side, np.array(clamp.ends)), self._name, self._contact_words
        self._check_sizes(float(np.ptp(self.found.edges[self.seat.struck_face].reshape(-1, 3), axis=0).max()))
        corners = loops.polygon(self._outline(place)[0])[0]
        if not loops.holds(corners, place.lip):
            away = loops.nearest(self._outline(place)[0], np.array(place.lip))
            where = f"the centre of {contact}, {_at(self.land.centre)} in {name}, lies beside the reed in"
            words = f"{where} {self.file.name}, in plan {1e3 * away:.4g} mm from its edge ({self._units})"
            raise KeyProblem(KEY, f"{words}: draw both parts in one coordinate system, or strike another face")
        return place

    def opening(self, placement: outline.Placement, rings: int) -> float:
        """Return the smallest opening between lip and reed [m]. Raises `KeyProblem` if the parts overlap."""
        land = self.found.land(self.seat.struck_face, placement.frame.x)
        gap, below = opening(lands.face_lip(land, 1, rings), placement)
        if gap < -outline.ROUND_OFF:
            words = f"the reed in {self.file.name} cuts into {self._contact_words} of {self._name}"
            limit = f"by {-1e3 * gap:.4g} mm (limit {1e3 * outline.ROUND_OFF:g} mm; {self._units})"
            remedy = "move one of the parts in the CAD program, or select the face under the reed in seat.contact"
            raise KeyProblem(KEY, f"{words} {limit}: {remedy}")
        if (point := outline.cut_by(self.found.shape, self._outline(placement), placement, below)) is not None:
            words = f"{self._name} rises through the reed in {self.file.name} at {_at(point)}"
            raise KeyProblem(KEY, f"{words}: the parts overlap; move one of them in the CAD program")
        return max(gap, 0.0)

    def contact_at(self, placement: outline.Placement, stated: object) -> tuple[float, float]:
        """Return the stated reed.contact_at in the frame of a placement [m], or the lip's centre if it is invalid."""
        try:
            at = TypeAdapter(Place).validate_python(stated)
        except ValidationError:
            return placement.lip
        self._check_square("reed.contact_at", "remove the key, the contact lies over the centre of the lip then")
        ((x, y),) = placement.frame.seen(self.frame.points(np.array([at]))).tolist()
        return x, y

    @property
    def _name(self) -> str:
        """Return the name of the seat's file."""
        return self.seat.files()[0].name

    @property
    def _normal(self) -> Vector:
        """Return the outward normal of the contact face. Raises `KeyProblem` if it is curved."""
        normals = [face.normal for face in self.found.faces if self.seat.struck_face in face.groups]
        if (normal := normals[0]) is None:
            raise KeyProblem("seat.contact", f"{self._name}: {self._contact_words} is not flat; {self._facing()}")
        return normal

    @property
    def _contact_words(self) -> str:
        numbers = [_number(face) for face in self.found.faces if self.seat.struck_face in face.groups]
        return f"the contact face {numbers[0]}" if len(numbers) == 1 else f"the contact faces {', '.join(numbers)}"

    def _outline(self, placement: outline.Placement) -> list[Array]:
        seen = self.reed.seen_in(placement.frame)
        return [loops.as_loop(loop) for loop in (seen.outline, *seen.holes)]

    @property
    def _corners(self) -> Array:
        return self.frame.points(loops.polygon(loops.as_loop(self.reed.outline))[0])

    @property
    def _size(self) -> float:
        return float(np.ptp(self._corners, axis=0).max())

    def _check_square(self, key: str, remedy: str) -> None:
        """Raise `KeyProblem` of ``key`` if the reed is oblique in its file and has no coordinates there."""
        if abs(np.abs(self.frame.normal).max() - 1) > SQUARE:
            raise KeyProblem(key, f"the reed in {self.file.name} is square to no axis of the file; {remedy}")

    def check_facing(self) -> None:
        """Raise `KeyProblem` for implausible sizes, or a contact face that does not face the reed."""
        self._check_sizes(LEAST * float(self.found.shape.extent.max()))
        point, up = (np.array(each) for each in outline.facing_side(self.reed, self._normal))
        struck = next(face for face in self.found.faces if self.seat.struck_face in face.groups)
        height = float((point - np.array(struck.centre)) @ up)
        inclined = math.acos(min(1.0, float(up @ np.array(self._normal))))
        reed = f"the reed in {self.file.name}"
        if inclined > STEEPEST:
            angle, most = math.degrees(inclined), math.degrees(STEEPEST)
            words = f"is inclined by {angle:.4g} deg to {reed} (limit {most:g} deg)"
        elif (away := height + self.reed.thickness) < outline.ROUND_OFF:
            words = f"looks away from {reed}, which lies {-1e3 * away:.4g} mm behind it"
        else:
            return
        raise KeyProblem("seat.contact", f"{self._name}: {self._contact_words} {words}; {self._facing()}")

    def _check_sizes(self, least: float) -> None:
        """Raise `KeyProblem` if the reed is smaller than ``least`` [m], or far larger than the seat."""
        seat, reed = float(self.found.shape.extent.max()), self._size
        if least <= reed <= LARGEST * seat:
            return
        factor = min(FACTORS, key=lambda each: abs(math.log(each * reed / seat / USUAL)))
        words = "one of both is drawn in other lengths"
        if 1 / WITHIN < factor * reed / seat / USUAL < WITHIN and factor * reed > least:
            times = f"{factor:g} times larger" if factor > 1 else f"{1 / factor:g} times smaller"
            words = f"{times}, the reed would fit"
        thick = self.reed.thickness * self.frame.normal
        sides = np.ptp(np.concatenate([self._corners, self._corners + thick]), axis=0)
        sizes = f"{self._name} measures {_box(self.found.shape.extent)}, the reed in {self.file.name} {_box(sides)}"
        remedy = f"{words} ({self._units}): export both files in the same unit"
        raise KeyProblem(KEY, f"the parts do not fit together in size: {sizes}; {remedy}")

    @property
    def _units(self) -> str:
        """Return the units of both files as text."""
        return f"{self._name} is in {_unit(self.seat.geometry())}, {self.file.name} in {_unit(CadPart(self.file))}"

    def _facing(self) -> str:
        """Return a remedy that suggests the nearest flat faces of the seat that face the reed."""
        faces = []
        for face in self.found.faces:
            if face.normal is not None and self.seat.struck_face not in face.groups:
                point, up = outline.facing_side(self.reed, face.normal)
                away = float((np.array(point) - np.array(face.centre)) @ np.array(face.normal))
                if np.dot(up, face.normal) >= math.cos(STEEPEST) and away > -outline.ROUND_OFF:
                    centre = ", ".join(f"{1e3 * c:.4g}" for c in np.round(face.centre, 12) + 0.0)
                    faces.append((away, f"{_number(face)} (centre ({centre}) mm, {1e3 * away:.4g} mm from the reed)"))
        if not faces:
            return "draw both parts in one coordinate system, no flat face of the seat looks towards the reed"
        nearest = sorted(faces, key=lambda each: each[0])[:NEAREST]
        return f"select a face that looks towards the reed, the nearest are {', '.join(words for _, words in nearest)}"


def open_parts(seat: Drawn, file: Path) -> PartsAsDrawn:
    """Read both parts.

    Raises:
        KeyProblem: an unreadable part, implausible sizes, or a contact face that does not face the reed.
    """
    for path, finding in seat.problems():
        raise KeyProblem(".".join(("seat", *map(str, path))), finding)
    with problem_of("reed.file", errors.GeometryError, drop="Outlined.file = "):
        drawn = outline.outline_in(file, oblique=True)
    try:
        parts = PartsAsDrawn(seat, file, inspect_geometry(seat.geometry()), drawn)
    except (MeshingError, OSError) as error:
        raise KeyProblem("seat.file", f"{seat.files()[0].name}: {error}") from None
    parts.check_facing()
    return parts


def _check_side(straight: bool) -> None:
    if not straight:
        words = "an assembly places its reed by a straight one; give that, or remove [assembly]"
        raise KeyProblem("reed.clamped", f"the clamped side is the edge of a hole: {words}")


def _points(frame: Frame, places: Any) -> tuple[Vector, Vector]:
    (a, b, c), (d, e, f) = frame.points(np.array(places)).tolist()
    return (a, b, c), (d, e, f)


def _number(face: FoundFace) -> str:
    return " = ".join(map(str, face.numbers))


def _at(point: Any) -> str:
    """Return a point [m] as text."""
    return f"({', '.join(f'{each:.4g}' for each in np.round(1e3 * np.array(point), 6) + 0.0)}) mm"


def _box(sides: Array) -> str:
    return " x ".join(f"{1e3 * side:.4g}" for side in sides) + " mm"


def _unit(part: Geometry) -> str:
    """Return the name of a CAD part's length unit."""
    assert isinstance(part, CadPart)
    unit = part.unit or cad.stated_unit(part.path) or 1.0
    return next((name for size, name in UNITS.items() if math.isclose(size, unit, rel_tol=1e-6)), f"{unit:g} m")
