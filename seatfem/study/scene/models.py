"""A scene: its tables, properties that follow from several of them, and [assembly], the relative position of reed and
seat by their CAD files.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from functools import reduce
from pathlib import Path
from typing import Any, ClassVar, Final, Literal

import numpy as np
from pydantic import Field, ValidationError, ValidationInfo, model_validator

from seatfem import fields
from seatfem.structures.kinds import Structure, drawn, kinds_of
from seatfem.structures.kinds.structure import is_curved, is_loaded, motion_key
from seatfem.structures.rings import MOST_RINGS
from seatfem.structures.shapes.cad import STEP_SUFFIXES
from seatfem.study.scene import contradictions, drives, local, measures, parts_as_drawn, problems
from seatfem.study.scene.contact import Contact, Stopper
from seatfem.study.scene.lips import ContactGeometry
from seatfem.study.scene.run import Accuracy, Run, Stress
from seatfem.study.scene.wings import Assessment, Drive, WingTable, tables_of_wings
from seatfem.units import write_quantity

KEY: Final = "assembly.placed"
FOLLOWING: Final = (("contact", ("offset", "tilt", "tilt_axis", "gap")), ("seat", ("along",)), ("reed", ("frame",)))
"""Keys whose values follow from the CAD files."""
SAMPLES: Final = 4096  # instants of a run from which the largest load is taken
SMALLEST: Final = 1e-9  # lengths below this are written as zero [m]


class Assembly(fields.Table):
    """Reed and seat have the positions of their files, which share one coordinate system: a seat of kind "cad", and a
    flat reed of kind "sheet" with a STEP file, in any position. The files determine `reed.frame`, `seat.along`,
    `contact.offset`, `contact.gap` (the smallest opening between the lip and the side of the reed that faces it),
    `contact.tilt` and `contact.tilt_axis`, so none of these may be stated. `reed.contact_at` lies over the centre of
    the lip, unless it is stated in coordinates of the file. `seat.contact` selects the struck face. Select the clamp as
    a face, for example { number = 1 }. If a STEP file has only a face, it is the side of the reed that faces the seat.
    """

    sample: ClassVar[str] = 'placed = "as drawn"'

    placed: Literal["as drawn"] = Field(description="how reed and seat come together")


def with_places(given: Mapping[str, Any], folder: Path, *, unread: bool = False) -> Mapping[str, Any]:
    """Return a scene's tables with the keys that follow from its CAD files, which are not opened if ``unread``.

    Raises:
        KeyProblem: a stated key that follows from the files, bodies of other kinds, or parts that do not fit together.
    """
    seat_table, reed_table, contact = (given.get(name, {}) for name in ("seat", "reed", "contact"))
    if not all(isinstance(each, Mapping) for each in (seat_table, reed_table, contact)):
        return given
    for key in [f"{table}.{key}" for table, keys in FOLLOWING for key in keys if key in given.get(table, {})]:
        raise fields.KeyProblem(key, 'it follows from the files (assembly.placed = "as drawn"); remove it')
    kind, file = _seat_kind(seat_table), _file_of_reed(reed_table, folder)
    if file is None or unread:
        return {**given, "reed": _unplaced(reed_table)}
    try:
        seat = kind.model_validate(seat_table, context={"folder": folder})
    except ValidationError as error:
        problem = problems.explain(error, kind, seat_table, folder, {})[0]
        raise fields.KeyProblem(f"seat.{problem.key}", problem.message) from None
    parts = parts_as_drawn.open_parts(seat, file)
    return {**given, **_keys(parts, seat_table, reed_table, contact)}


def _seat_kind(seat: Mapping[str, Any]) -> type[drawn.Drawn]:
    """Return the kind of the seat. Raises `KeyProblem` unless it has a CAD file."""
    kind = _kind(seat)
    if kind is None or not kind.traits.face_as_drawn or not issubclass(kind, drawn.Drawn):
        names = _names(each for each in kinds_of() if each.traits.face_as_drawn)
        words = f"seat.kind = {seat.get('kind')!r} has no CAD file; take kind = {names}, or remove [assembly]"
        raise fields.KeyProblem(KEY, words)
    return kind


def _file_of_reed(reed: Mapping[str, Any], folder: Path) -> Path | None:
    """Return the reed's STEP file, ``None`` if it does not exist. Raises `KeyProblem` for another kind of reed."""
    table, kind, file = _kind(reed), reed.get("kind"), reed.get("file")
    step = isinstance(file, str) and Path(file).suffix.lower() in STEP_SUFFIXES
    if table is None or not table.traits.reed_as_drawn or not step:
        what = f"reed.kind = {kind!r}" if file is None else f"reed.kind = {kind!r} with reed.file = {file!r}"
        names = _names(each for each in kinds_of() if each.traits.reed_as_drawn)
        words = f"{what} is no flat reed from a STEP file; take kind = {names} with one, or remove [assembly]"
        raise fields.KeyProblem(KEY, words)
    path = (folder / str(file)).resolve()
    return path if path.is_file() else None


def _kind(table: Mapping[str, Any]) -> type[Structure] | None:
    """Return the kind of body of a table."""
    kind = table.get("kind")
    meant = (each for each in kinds_of() if table.keys() & set(each.also.get(str(kind), ())))
    return next(meant, None) or next((each for each in kinds_of() if fields.kind_of(each) == kind), None)


def _names(bodies: Iterable[type[Structure]]) -> str:
    return " or ".join(f'"{fields.kind_of(each)}"' for each in bodies)


def _keys(
    parts: parts_as_drawn.PartsAsDrawn, seat: Mapping[str, Any], reed: Mapping[str, Any], contact: Mapping[str, Any]
) -> dict[str, Any]:
    """Return [seat], [reed] and [contact] with the keys that follow from the files, unless the clamp is invalid."""
    try:
        clamp = parts.clamp(reed.get("clamped"))
    except ValidationError:
        return {"reed": _unplaced(reed)}
    placement = parts.placement(clamp)
    at = parts.contact_at(placement, reed["contact_at"]) if "contact_at" in reed else placement.lip
    rings = contact.get("rings", 1)
    gap = parts.opening(placement, rings if isinstance(rings, int) and 0 < rings <= MOST_RINGS else 1)
    frame, axis = placement.frame, placement.axis
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
            "offset": [_length(lip - own) for lip, own in zip(placement.lip, at, strict=True)],
            "gap": _length(gap),
            "tilt": f"{math.degrees(placement.tilt)!r} deg",
            "tilt_axis": f"{math.degrees(axis)!r} deg",
        },
    }


def _unplaced(reed: Mapping[str, Any]) -> dict[str, Any]:
    """Return [reed] with any place of the contact, so that only errors of its other keys are reported."""
    return {"contact_at": [_length(0.0)] * 2, **reed}


def _length(value: float) -> str:
    """Return a length as text of a scene, rounded to a picometre."""
    return f"{round(value, 12) if abs(value) > SMALLEST else 0.0!r} m"


BODIES: Final = ("seat", "reed")
"""Roles in every scene, whose tables may be of any kind of structure."""
CONTACTS: Final = (*BODIES, "contact", "stopper")
"""The tables of `ContactGeometry`."""


class Scene(fields.Table):
    """One impact: a reed, a seat, and how long to watch. All values are SI floats."""

    title: str = fields.default("", "for reports and pictures")
    # of the kinds that a file names: `load.scene_of`
    seat: Structure = Field(description="what is struck")
    reed: Structure = Field(description="what strikes")
    assembly: Assembly | None = fields.absent("how two parts from CAD come together; by [contact] if absent")
    contact: Contact = fields.default({}, "where and how the two touch")
    stopper: Stopper | None = fields.absent("a second body, which limits the lift")
    load: tuple[drives.ExternalLoad, ...] = fields.default((), "known loads on the reed, a table each: [[load]]")
    spring: tuple[drives.ValveSpring, ...] = fields.default((), "valve springs on the reed, a table each: [[spring]]")
    base: tuple[drives.Base, ...] = fields.default((), "what moves the bases of bodies, a table each: [[base]]")
    wave: tuple[drives.Wave, ...] = fields.default((), "waves that come along endless rods, a table each: [[wave]]")
    gauge: tuple[drives.Gauge, ...] = fields.default((), "strain gauges, a table each: [[gauge]]")
    run: Run = Field(description="what is simulated")
    accuracy: Accuracy = fields.default({}, "the accuracy asked for")
    stress: Stress | None = fields.absent("stress in the seat; not computed where absent")

    @property
    def needs_stress(self) -> bool:
        """Return whether each run needs the reed's stress, for a measure or, in closed form, an assessment."""
        is_cheap = self.reed.traits.stress == "closed form"
        assessed = is_cheap and any(each.needs_reed_stress for each in self.assessments)
        return measures.any_needs(self.accuracy.measures, "stress") or assessed

    @model_validator(mode="before")
    @classmethod
    def _places_as_drawn(cls, given: object, info: ValidationInfo) -> object:
        """Return the scene with the keys that follow from [assembly]; an invalid key is reported by `Assembly`."""
        context = info.context or {}
        if not isinstance(given, Mapping) or given.get("assembly") != {"placed": "as drawn"}:
            return given
        return with_places(given, context.get("folder", Path()), unread=bool(context.get("unread")))

    @model_validator(mode="before")
    @classmethod
    def _keys_by_wings(cls, given: object) -> object:
        """Return the scene with keys that follow from the tables of wings."""
        if not isinstance(given, Mapping):
            return given
        return reduce(lambda tables, wing: wing.complete(tables), tables_of_wings(), given)

    @property
    def wing_tables(self) -> tuple[WingTable, ...]:
        """Return the tables that wings add."""
        tables = (getattr(self, name) for name in type(self).model_fields)
        return tuple(each for each in tables if isinstance(each, WingTable))

    @property
    def driven_by(self) -> tuple[Drive, ...]:
        """Return the tables of wings that load the reed."""
        return tuple(each for each in self.wing_tables if isinstance(each, Drive))

    @property
    def assessments(self) -> tuple[Assessment, ...]:
        """Return the tables of wings that ask for results of the finished run."""
        return tuple(each for each in self.wing_tables if isinstance(each, Assessment))

    @property
    def bodies(self) -> Mapping[str, Structure]:
        """Return the bodies of the scene by the names of their tables."""
        bodies = {"seat": self.seat, "reed": self.reed}
        return bodies if self.stopper is None else {**bodies, "stopper": self.stopper.body}

    @property
    def geometry(self) -> ContactGeometry:
        """Return the geometry of the contacts between reed, seat and stopper."""
        return ContactGeometry(self.seat, self.reed, self.contact, self.stopper)

    def with_geometry(self, geometry: ContactGeometry) -> Scene:
        """Return the scene with other contacts."""
        return self.model_copy(update={name: getattr(geometry, name) for name in CONTACTS})

    def with_target(self, target: float | str) -> Scene:
        """Return the scene with another target of accuracy, written as in a file: 0.02, "2 %". Raises `SceneError`."""
        try:
            stated = Accuracy.model_validate({"target": target}).target
        except ValidationError as error:
            message = problems.explain(error, Accuracy, {"target": target}, Path(), {})[0].message
            raise problems.scene_error("accuracy.target", message) from None
        accuracy = self.accuracy.model_copy(update={"target": stated, "level": None})
        return self.model_copy(update={"accuracy": accuracy})

    @property
    def turn(self) -> float:
        """Return the duration of one turn of the crank [s]; nan without a crank, or for several speeds."""
        courses: list[object] = [each for load in self.load for each in (load.pressure, load.force, load.base_motion)]
        courses += [*self.driven_by, *(getattr(self.reed, key, None) for key in self.reed.traits.moved_by)]
        turns = {60.0 / rpm for course in courses if (rpm := getattr(course, "rpm", None)) is not None}
        return turns.pop() if len(turns) == 1 else math.nan

    @property
    def crank(self) -> tuple[float, float] | None:
        """Return speed [1/min] and initial angle [rad] of the crank, by a wing or the first load with a speed."""
        courses: list[Any] = [*self.driven_by, *(each for load in self.load for each in (load.pressure, load.force))]
        turned = (each for each in courses if getattr(each, "rpm", None) is not None)
        return next(((each.rpm, each.angle or 0.0) for each in turned), None)

    def mount(self, role: str) -> drives.Mount:
        """Return the body in this role with the motion of its base and its incoming wave."""
        base = next((base for base in self.base if base.of == role), None)
        wave = next((wave for wave in self.wave if wave.of == role), None)
        return drives.Mount(role, self.bodies[role], base, wave)

    @property
    def gauged(self) -> tuple[drives.Gauged, ...]:
        """Return the gauges with their bodies."""
        at = self.geometry.contact_at
        return tuple(drives.Gauged(gauge, self.mount(gauge.of), at) for gauge in self.gauge)

    @property
    def is_loaded(self) -> bool:
        """Return whether there are loads, drives, springs, moving bases or incoming waves."""
        return bool(self.load or self.base or self.spring or self.wave or self.driven_by) or is_loaded(self.reed)

    @property
    def is_blown_by_lift(self) -> bool:
        """Return whether any load depends on the opening of the reed."""
        return bool(self.driven_by) or any(load.by_lift for load in self.load)

    def contradictions(self) -> fields.Contradictions:
        seat, reed, stopper, bodies = self.seat, self.reed, self.stopper, self.bodies
        driven = bool(self.load or self.base or self.spring or self.wave or self.driven_by)
        struck = stopper is not None and motion_key(stopper.body) != ""
        yield from contradictions.find_role_conflicts(seat, reed, driven=driven or struck)
        if stopper is None:
            for name, table in (("velocity", reed), ("release.velocity", getattr(reed, "release", None))):
                speed = getattr(table, "velocity", None) or 0.0
                yield from fields.flies_away(speed, f"reed.{name}", ", or add a [stopper] that it meets")
        based = {base.of for base in self.base}
        yield from contradictions.find_load_conflicts(reed, self.load, self.spring, based="reed" in based)
        yield from contradictions.find_base_conflicts(bodies, self.base)
        yield from contradictions.find_wave_conflicts(bodies, self.wave, based)
        yield from contradictions.find_gauge_conflicts(bodies, self.gauge)
        yield from contradictions.find_lip_conflicts(seat, reed, self.contact)
        yield from contradictions.find_start_conflicts(self.geometry)
        yield from local.unknown_shares(self.geometry)
        yield from contradictions.find_part_conflicts(seat, self.contact, self.stress, self.run.duration)
        for measure in (each for name, each in measures.all_measures().items() if name in self.accuracy.measures):
            needed = measure.needs.strip("[]").partition(".")[0]
            is_possible = not needed or bool(getattr(self, needed, None))
            yield from contradictions.find_measure_conflicts(measure, reed, is_possible=is_possible)
        for wing in self.wing_tables:
            yield from fields.within(wing.table, wing.check(self))

    def find_doubts(self) -> tuple[problems.Problem, ...]:
        """Return the doubts about the scene and its tables, by key; `seatfem.study.scene.located` adds file and
        lines."""
        return (*contradictions.own_doubts_of(self), *contradictions.cover_doubts_of(self.geometry))

    def doubts(self) -> fields.Contradictions:
        yield from self._doubts_of_loads()
        yield from self._doubts_of_duration()

    def _doubts_of_loads(self) -> fields.Contradictions:
        """Yield a doubt if the loads push the reed one way during the whole run, as an absolute pressure does.

        Their sum at the closed reed, less the preload of valve springs, is above zero throughout: the valve rests open.
        Or it is below zero throughout, by a file, and the reed starts on its seat: nothing opens it. Scenes are left
        out in which more acts: gravity, a frame, a gas, bases, waves, loads of [reed], a reed bent without stress.
        """
        pushes = [each.pressure or each.force for each in self.load]
        own = any(getattr(self.reed, key, None) is not None for key in ("pressure", "point_force", "force", "gravity"))
        if not pushes or None in pushes or own or self.driven_by or self.base or self.wave or is_curved(self.reed):
            return
        time = np.linspace(0.0, self.run.duration, SAMPLES)
        areas = [1.0 if each.area is None else each.area(0.0) for each in self.load]
        force = sum(area * push.course(time) for area, push in zip(areas, pushes, strict=True) if push)
        low, high = (float(end) - sum(each.preload for each in self.spring) for end in (np.min(force), np.max(force)))
        closed = self.contact.gap == 0 and self.reed.start_at(self.geometry.own_place) <= 0
        if low > 0:
            words = "push the reed off its seat during the whole run: the valve never rests closed"
        elif high < 0 and closed and any(push and push.file for push in pushes):
            words = "press the reed on its seat during the whole run: they never open the valve"
        else:
            return
        ends = " to ".join(dict.fromkeys(write_quantity(end, "force", 3) for end in (low, high)))
        remedy = (
            "A pressure is the difference across the valve: of an absolute one subtract the pressure on the other "
            "side, or add that as a [[load]] of opposite sign"
            if any(each.pressure for each in self.load)
            else "Check their signs"
        )
        key = "force" if self.load[0].pressure is None else "pressure"
        yield f"load.0.{key}", f"the loads ({ends}, positive off the seat) {words}. {remedy}"

    def _doubts_of_duration(self) -> fields.Contradictions:
        """Yield doubts if the run ends before a reed without loads can reach its seat, and if the block of a life is
        less than a turn of the crank."""
        start = self.reed.start_at(self.geometry.own_place)
        flight = 0.0 if self.is_loaded or self.stopper is not None else self.reed.flight_time(self.contact.gap + start)
        if flight > self.run.duration:
            ends, least = (write_quantity(time, "time", 3) for time in (self.run.duration, flight))
            yield "run.duration", f"{ends} ends before the landing: the reed flies {least}; watch longer"
        if self.assessments and self.run.duration < self.turn * (1 - 1e-9):
            ends, least = (write_quantity(time, "time", 3) for time in (self.run.duration, self.turn))
            words = f"{ends} is less than a turn of the crank, {least}, and the run is the block that repeats"
            yield "run.duration", f"{words}: its life lacks what happens in the rest; watch a whole turn"
