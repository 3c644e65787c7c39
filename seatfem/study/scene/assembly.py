"""[assembly] of a scene: reed and seat lie as their CAD files have them, in one coordinate system."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Final, Literal

from pydantic import Field, ValidationError

from seatfem.fields import KeyProblem, Table
from seatfem.structures.kinds.cad import Cad
from seatfem.structures.rings import MOST_RINGS
from seatfem.structures.shapes.cad import STEP_SUFFIXES

if TYPE_CHECKING:
    from seatfem.study.scene.parts_as_drawn import PartsAsDrawn

KEY: Final = "assembly.placed"
FOLLOWING: Final = (("contact", ("offset", "tilt", "tilt_axis", "gap")), ("seat", ("along",)), ("reed", ("frame",)))
"""Keys that follow from the files."""
UNREADABLE: Final = {"kind": "rigid_mass", "mass": "1 g", "velocity": "-1 m/s"}
"""In place of a reed that cannot be placed because its seat cannot be read: what is wrong with the seat is told."""
SMALLEST: Final = 1e-9  # [m], [rad]; less is written as nothing


class Assembly(Table):
    """Reed and seat lie as they are drawn, in the one coordinate system of both files: a seat of kind "cad", and a flat
    reed of kind "sheet" with a STEP file, in any position.

    From the files follow `reed.frame`, `seat.along`, `contact.offset`, `contact.gap` (the smallest opening between the
    lip and the side of the reed that faces it), `contact.tilt` and `contact.tilt_axis`, so that none of them may be
    stated. `reed.contact_at` is over the centre of the lip, unless it is stated in coordinates of the file. The struck
    face is the one that `seat.contact` selects. What is clamped is best selected as a face, as in { number = 1 }. A
    STEP file with a face alone holds the side of the reed that faces the seat.
    """

    sample: ClassVar[str] = 'placed = "as drawn"'

    placed: Literal["as drawn"] = Field(description="how reed and seat come together")


def with_places(given: Mapping[str, Any], folder: Path) -> Mapping[str, Any]:
    """Return a scene's tables with the keys that follow from its files.

    Raises:
        KeyProblem: a key that is stated although it follows, bodies of other kinds, parts that do not fit together.
    """
    seat_table, reed_table, contact = (given.get(name, {}) for name in ("seat", "reed", "contact"))
    if not all(isinstance(each, Mapping) for each in (seat_table, reed_table, contact)):
        return given
    for table, keys in FOLLOWING:
        for key in keys:
            if key in given.get(table, {}):
                raise KeyProblem(
                    f"{table}.{key}", 'it follows from the files (assembly.placed = "as drawn"); remove it'
                )
    file = _file_of_reed(seat_table, reed_table, folder)
    if file is None:
        return {**given, "reed": _unplaced(reed_table)}
    try:
        seat = Cad.model_validate(seat_table, context={"folder": folder})
    except ValidationError:
        return {**given, "reed": UNREADABLE}
    from seatfem.study.scene.parts_as_drawn import open_parts  # of scenes with this table only

    parts = open_parts(seat, file)
    return {**given, **_keys(parts, seat_table, reed_table, contact)}


def _file_of_reed(seat: Mapping[str, Any], reed: Mapping[str, Any], folder: Path) -> Path | None:
    """Return the reed's STEP file, ``None`` of one that is not there. Raises `KeyProblem` of other kinds of bodies."""
    if (kind := seat.get("kind")) != "cad":
        raise KeyProblem(KEY, f'seat.kind = {kind!r} has no CAD file; take kind = "cad", or remove [assembly]')
    kind, file = reed.get("kind"), reed.get("file")
    if kind not in ("sheet", "plate") or not isinstance(file, str) or Path(file).suffix.lower() not in STEP_SUFFIXES:
        what = f"reed.kind = {kind!r}" if file is None else f"reed.kind = {kind!r} with reed.file = {file!r}"
        raise KeyProblem(
            KEY, f'{what} is no flat reed from a STEP file; take kind = "sheet" with one, or remove [assembly]'
        )
    path = (folder / file).resolve()
    return path if path.is_file() else None


def _keys(
    parts: PartsAsDrawn, seat: Mapping[str, Any], reed: Mapping[str, Any], contact: Mapping[str, Any]
) -> dict[str, Any]:
    """Return [seat], [reed] and [contact] with what follows; a reed whose clamp cannot be read stays as it is."""
    try:
        clamp = parts.clamp(reed.get("clamped"))
    except ValidationError:
        return {"reed": _unplaced(reed)}
    found = parts.placement(clamp)
    at = parts.contact_at(found, reed["contact_at"]) if "contact_at" in reed else found.lip
    rings = contact.get("rings", 1)
    gap = parts.opening(found, rings if isinstance(rings, int) and 0 < rings <= MOST_RINGS else 1)
    frame, axis = found.frame, found.axis
    return {
        "seat": {**seat, "along": frame.x},
        "reed": {
            **reed,
            "frame": {
                "origin": [_length(each) for each in frame.origin],
                "along": frame.x,
                "normal": tuple(frame.normal),
            },
            "contact_at": [_length(each) for each in at],
            "clamped": clamp.seen_in(frame),
        },
        "contact": {
            **contact,
            "offset": [_length(lip - own) for lip, own in zip(found.lip, at, strict=True)],
            "gap": _length(gap),
            "tilt": f"{math.degrees(found.tilt)!r} deg",
            "tilt_axis": f"{math.degrees(axis)!r} deg",
        },
    }


def _unplaced(reed: Mapping[str, Any]) -> dict[str, Any]:
    """Return [reed] with a contact, so that only what is wrong with its other keys is told."""
    return {"contact_at": [_length(0.0)] * 2, **reed}


def _length(value: float) -> str:
    """Return a length as scenes have it, to a picometre."""
    return f"{round(value, 12) if abs(value) > SMALLEST else 0.0!r} m"
