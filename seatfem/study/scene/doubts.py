"""Doubts about a scene, told before anything is computed: unusual values, loads of one sign, a run too short."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Annotated, Final, get_args, get_origin

import numpy as np

from seatfem.fields import ReadQuantity, Table, Usual
from seatfem.structures.errors import GeometryError, MeshError, ModelError
from seatfem.structures.kinds.structure import is_curved
from seatfem.structures.mesh.gmsh_process import MeshingError
from seatfem.study.scene.lips import ContactGeometry, or_diameter
from seatfem.study.scene.problems import KeyPath, Problem, notes_of, reader_of
from seatfem.units import DIMENSIONS, ask_for_prefix, write_quantity

if TYPE_CHECKING:
    from seatfem.study.scene.models import Scene

SAMPLES: Final = 4096  # instants of a run from which the largest load is taken
Doubt = tuple[KeyPath, str]
"""Path of a key, and what is doubtful about its value."""


def doubts_of(scene: Scene) -> tuple[Problem, ...]:
    """Return the doubts about a scene, by key; `seatfem.study.scene.located` adds file and lines."""
    return (*own_doubts_of(scene), *cover_doubts_of(scene))


def own_doubts_of(scene: Scene) -> tuple[Problem, ...]:
    """Return the doubts about the values of a scene, its loads and its duration."""
    every = *_of_table(scene, ()), *_of_loads(scene), *_of_duration(scene)
    return tuple(map(_problem, every))


def cover_doubts_of(scene: Scene) -> tuple[Problem, ...]:
    """Return the doubts about a scene whose reed covers only a part of the lip that its model presses."""
    with suppress(GeometryError, MeshError, ModelError, MeshingError, OSError):  # of files that are refused elsewhere
        return tuple(map(_problem, or_diameter(scene.geometry, ContactGeometry.cover_doubts)))
    return ()


def _problem(doubt: Doubt) -> Problem:
    path, words = doubt
    return Problem(None, 0, ".".join(map(str, path)), words, path)


def _of_table(table: Table, path: KeyPath) -> Iterator[Doubt]:
    """Yield the doubts about a table and the tables in it; ``path``: its key."""
    for name, field in type(table).model_fields.items():
        if name in table.model_fields_set:
            place = path if name == type(table).inlined else (*path, name)
            yield from _of_value(getattr(table, name), tuple(notes_of(field)), _notes_of_parts(field.annotation), place)
    yield from (((*path, *key.split(".")), words) for key, words in table.doubts())


def _notes_of_parts(annotation: object) -> Sequence[object]:
    """Return the annotations of each element of a list."""
    element = next(iter(get_args(annotation)), None)
    return get_args(element)[1:] if get_origin(element) is Annotated else ()


def _of_value(value: object, notes: Sequence[object], of_parts: Sequence[object], path: KeyPath) -> Iterator[Doubt]:
    """Yield the doubts about a value; ``notes``, ``of_parts``: annotations of its key, and of the parts of a list."""
    if isinstance(value, Table):
        yield from _of_table(value, path)
    elif isinstance(value, float) and value and (words := unusual(value, notes)):
        yield path, words
    elif isinstance(value, tuple | Mapping):
        for key, each in value.items() if isinstance(value, Mapping) else enumerate(value):
            yield from _of_value(each, of_parts, (), (*path, key))


def unusual(value: float, notes: Sequence[object]) -> str:
    """Return why a value [SI] is doubtful: it is out of the usual range of its key or dimension, by the ``notes`` of
    the key's annotation; "" if it is in it, or none is known."""
    reader = reader_of(notes)
    dimension = reader.dimension if isinstance(reader, ReadQuantity) else ""
    own = next((note for note in notes if isinstance(note, Usual)), None)
    if own is None and not dimension:
        return ""
    least, most = DIMENSIONS[dimension].usual_range if own is None else (own.least, own.most)
    if least <= abs(value) <= most:
        return ""
    written, low, high = (write_quantity(each, dimension, 4) for each in (value, least, most))
    limit = f"small (usual: {low} or more)" if abs(value) < least else f"large (usual: {high} or less)"
    meant = ask_for_prefix(value, dimension, (least, most)) if dimension else ""
    return f"{written} is unusually {limit}{f'{meant} If not, leave it' if meant else '; check it'}"


def _of_loads(scene: Scene) -> Iterator[Doubt]:
    """Yield a doubt if the loads push the reed one way during the whole run, as an absolute pressure does.

    Their sum at the closed reed, less the preload of valve springs, is above zero throughout: the valve rests open. Or
    it is below zero throughout, by a file, and the reed starts on its seat: nothing opens it. Scenes are left out in
    which more acts: gravity, a frame, a gas, bases, waves, loads of [reed], a reed bent without stress.
    """
    pushes = [each.pressure or each.force for each in scene.load]
    own = any(getattr(scene.reed, key, None) is not None for key in ("pressure", "point_force", "force", "gravity"))
    if not pushes or None in pushes or own or scene.driven_by or scene.base or scene.wave or is_curved(scene.reed):
        return
    time = np.linspace(0.0, scene.run.duration, SAMPLES)
    areas = [1.0 if each.area is None else each.area(0.0) for each in scene.load]
    force = sum(area * push.course(time) for area, push in zip(areas, pushes, strict=True) if push)
    low, high = (float(end) - sum(each.preload for each in scene.spring) for end in (np.min(force), np.max(force)))
    closed = scene.contact.gap == 0 and scene.reed.start_at(scene.geometry.own_place or 0.0) <= 0
    if low > 0:
        words = "push the reed off its seat during the whole run: the valve never rests closed"
    elif high < 0 and closed and any(push and push.file for push in pushes):
        words = "press the reed on its seat during the whole run: they never open the valve"
    else:
        return
    ends = " to ".join(dict.fromkeys(write_quantity(end, "force", 3) for end in (low, high)))
    remedy = (
        "A pressure is the difference across the valve: of an absolute one subtract the pressure on the other side, or "
        "add that as a [[load]] of opposite sign"
        if any(each.pressure for each in scene.load)
        else "Check their signs"
    )
    key = "force" if scene.load[0].pressure is None else "pressure"
    yield ("load", 0, key), f"the loads ({ends}, positive off the seat) {words}. {remedy}"


def _of_duration(scene: Scene) -> Iterator[Doubt]:
    """Yield doubts if the run ends before a reed without loads can reach its seat, and if the block of a life is less
    than a turn of the crank."""
    start = scene.reed.start_at(scene.geometry.own_place or 0.0)
    flight = 0.0 if scene.is_loaded or scene.stopper is not None else scene.reed.flight_time(scene.contact.gap + start)
    if flight > scene.run.duration:
        ends, least = (write_quantity(time, "time", 3) for time in (scene.run.duration, flight))
        yield ("run", "duration"), f"{ends} ends before the landing: the reed flies {least}; watch longer"
    if scene.assessments and scene.turn is not None and scene.run.duration < scene.turn * (1 - 1e-9):
        ends, least = (write_quantity(time, "time", 3) for time in (scene.run.duration, scene.turn))
        words = f"{ends} is less than a turn of the crank, {least}, and the run is the block that repeats"
        yield ("run", "duration"), f"{words}: its life lacks what happens in the rest; watch a whole turn"
