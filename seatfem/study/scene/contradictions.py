"""Contradictions between the tables of a scene, and doubts about their values, stated before anything is computed."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from typing import Annotated, Final, get_args, get_origin

import numpy as np

from impact.bodies.time_series import TimeSeriesError
from seatfem.fields import Contradictions, ReadQuantity, Table, Usual, keys_of, problem_of, within
from seatfem.structures.errors import GeometryError, MeshError, ModelError
from seatfem.structures.kinds import structure
from seatfem.structures.kinds.structure import Structure
from seatfem.structures.mesh.gmsh_process import MeshingError
from seatfem.structures.rings import Division
from seatfem.study.scene.contact import Contact
from seatfem.study.scene.drives import Base, ExternalLoad, Gauge, ValveSpring, Wave
from seatfem.study.scene.lips import ContactGeometry, or_diameter
from seatfem.study.scene.measures import Measure
from seatfem.study.scene.problems import Problem, notes_of, reader_of
from seatfem.study.scene.run import Stress as StressTable
from seatfem.units import DIMENSIONS, ask_for_prefix, write_quantity


def find_role_conflicts(seat: Structure, reed: Structure, *, driven: bool) -> Contradictions:
    """Yield contradictions if the struck body is not at rest, or the striker does not move."""
    if key := structure.motion_key(seat):
        yield f"seat.{key}", "the struck body is at rest; remove the key, or use the body as the reed"
    if not (moved_by := reed.traits.moved_by):
        yield "reed.kind", f"a body of kind {reed.kind!r} cannot move; take a kind that can"
    if not structure.motion_key(reed) and not driven:
        others = f" ({', '.join(moved_by[1:-1])} or {moved_by[-1]} would do, too)"
        words = type(reed).model_fields[moved_by[0]].description or ""
        yield f"reed.{moved_by[0]}", f"required key is missing: {words.partition(';')[0]}{others}"


def find_load_conflicts(
    reed: Structure, loads: Sequence[ExternalLoad], springs: Sequence[ValveSpring], *, based: bool
) -> Contradictions:
    """Yield contradictions for loads and springs at places that the reed does not have, or without its support."""
    for number, load in enumerate(loads):
        reed.check_place(load.at, f"load.{number}.at")
        if load.point is not None:
            reed.check_place(np.array([load.point]), f"load.{number}.point")
        if (keys := load.given_keys("gravity", "base_motion")) and not reed.traits.has_weight:
            words = f"of a reed of kind {reed.kind!r} it is not known how its mass is spread; give a force"
            yield f"load.{number}.{keys[0]}", words
    for number, spring in enumerate(springs):
        with keys_of(f"spring.{number}"):
            spring.check(reed)
    if springs and based:
        words = "the guard that springs stand on is at rest, [[base]] moves the reed's clamp: remove one of the two"
        yield "spring.0.stiffness", f"{words}, or move the seat"


def find_base_conflicts(bodies: Mapping[str, Structure], bases: Sequence[Base]) -> Contradictions:
    for number, base in enumerate(bases):
        key = f"base.{number}.of"
        if base.of not in bodies:
            yield key, "there is no [stopper]; add one, or remove the table"
        if base.of in [each.of for each in bases[:number]]:
            yield key, f"the base of the {base.of} has a table before; keep one"
        if loose := bodies[base.of].loose:
            words = loose.replace("seat.kind", f"{base.of}.kind")
            yield key, f"{words}: it has no base that could move it; remove the table"
        if base.of == "reed" and not bodies["reed"].traits.has_weight:
            words = f"of a reed of kind {bodies['reed'].kind!r} it is not known how its mass is spread"
            yield key, f"{words}; give a beam or a plate"


def find_wave_conflicts(
    bodies: Mapping[str, Structure], every: Sequence[Wave], based: Collection[str]
) -> Contradictions:
    """Yield contradictions for waves in other bodies than endless rods, or in one with another wave or moving base."""
    for number, wave in enumerate(every):
        key, body = f"wave.{number}.of", bodies[wave.of]
        if not (speed := body.wave_speed):
            yield key, f"the {wave.of} is no endless rod without damping; take kind = 'rod' with far_end = 'endless'"
            continue
        if wave.of in based or wave.of in [each.of for each in every[:number]]:
            yield key, f"the {wave.of} has another wave, or a base that moves; keep one"
        with problem_of(f"wave.{number}.start" if wave.strain is None else f"wave.{number}.strain", TimeSeriesError):
            wave.incoming(speed)


def find_gauge_conflicts(bodies: Mapping[str, Structure], gauges: Sequence[Gauge]) -> Contradictions:
    """Yield contradictions for gauges without a place on their body."""
    for number, gauge in enumerate(gauges):
        if gauge.of not in bodies:
            yield f"gauge.{number}.of", "there is no [stopper]; add one, or remove the table"
        elif gauge.name in [each.name for each in gauges[:number]]:
            yield f"gauge.{number}.name", f"{gauge.name!r} is the name of another gauge; give it one of its own"
        else:
            bodies[gauge.of].check_gauge(gauge.at, f"gauge.{number}", gauge.of)


def find_start_conflicts(geometry: ContactGeometry) -> Contradictions:
    """Yield contradictions between stopper and initial position of the reed. Raises `KeyProblem` for a place off it."""
    if (stopper := geometry.stopper) is None:
        return
    reed, contact = geometry.reed, geometry.contact
    reed.check_place(stopper.at, "stopper.at")
    if stopper.parts != Division():
        keys = {"profile": stopper.profile, "arcs": (stopper.arcs or 1) > 1, "tilt": stopper.tilt}
        yield from reed.parts_problems(f"stopper.{next((each for each, value in keys.items() if value), 'rings')}")
    if stopper.profile is not None and stopper.rings > 1:
        yield from reed.parts_problems("stopper.rings")
    key, more = ("gap", 0.0) if stopper.lift is None else ("lift", contact.gap)
    if stopper.profile is not None:
        if not reed.files() and not stopper.profile.own_face:  # of files see `files.check_files`
            yield from overlaps_with_profile(geometry)
        return
    if more > 0 and geometry.has_two_places:
        words = f"with contact.gap = {1e3 * more:g} mm the closed reed is bent, and where it stands at stopper.at"
        yield "stopper.lift", f"{words} depends on what holds it there; give stopper.gap, from the undeformed reed"
    gap, start = geometry.stopper_gap, reed.start_at(stopper.at or geometry.own_place)
    stated = f"{1e3 * (gap + more):.6g} mm"
    if gap < 0:
        words = f"{stated} is less than contact.gap = {1e3 * more:.6g} mm: the undeformed reed would stand inside"
        yield f"stopper.{key}", f"{words} the stopper; make the lift at least {1e3 * more:.6g} mm"
    if start > gap + 1e-9 * abs(start):
        words = f"{stated}: at the start the reed stands {1e3 * start:.6g} mm off its undeformed place there, inside"
        least = f"the stopper (limit: stopper.{key}); make the {key} at least {1e3 * (start + more):.6g} mm"
        yield f"stopper.{key}", f"{words} {least}, or release the reed from a smaller deflection"


ROUND_OFF: Final = 1e-12  # overlap with a retainer at the start that is round-off [m]


def overlaps_with_profile(geometry: ContactGeometry) -> Contradictions:
    """Yield the gap or lift of a stopper with a profile inside which the reed would begin. Raises `KeyProblem` for a
    profile that does not suit the reed."""
    if (stopper := geometry.stopper) is None or (retainer := geometry.retainer) is None:
        return
    if structure.is_curved(geometry.reed):
        yield "reed.curvature", "how a curved reed rolls on a profile is not known; remove one of both"
        return
    with keys_of("stopper.profile"):
        retainer.face(geometry.reed.views_at(geometry.own_place, coarse=True))
    gaps, at = geometry.stopper_gaps(), geometry.contact_at
    places = at[1:] if isinstance(at, tuple) else ()
    starts = [geometry.reed.start_at(place) - gap for place, gap in zip(places, gaps, strict=False)]
    start = geometry.reed.start_at(geometry.own_place) - geometry.stopper_gap_at_contact
    if (inside := max(*starts, start, -float(gaps.min()))) > ROUND_OFF:
        key = "gap" if stopper.lift is None else "lift"
        yield f"stopper.{key}", f"the reed would begin {1e3 * inside:.4g} mm inside the retainer; add that to it"


def find_lip_conflicts(seat: Structure, reed: Structure, contact: Contact) -> Contradictions:
    if (key := contact.lip_key) and (why := seat.lip_face.no_lip):
        yield f"contact.{key}", f"a seat of kind {seat.kind!r}, {why}"
    if structure.is_curved(seat):
        yield "seat.curvature", "only the reed may be curved; remove the key"
    if structure.is_curved(reed) and (why := seat.lip_face.no_lip):
        yield "reed.curvature", f"a seat of kind {seat.kind!r}, {why}"
    if structure.is_curved(reed) and contact.ports == 1:
        yield "contact.ports", "a single contact point has only a mean gap, reed.curvature needs several: remove it"
    yield from reed.contact_problems(contact.at, seat)
    if any(contact.offset):
        yield from reed.parts_problems("contact.offset")


def find_part_conflicts(
    seat: Structure, contact: Contact, stress: StressTable | None, duration: float
) -> Contradictions:
    """Yield contradictions between the seat and its film, its stress, and the rings of its contact face."""
    if contact.film is not None:
        yield from within("contact", contact.film.check(seat.lip_face.ring, seat.kind, contact.rings))
    if stress is not None:
        yield from (("stress", words) for words in seat.field_problems())
        yield from within("stress", stress.check(duration))
    if contact.rings > 1 and not seat.traits.has_rings:
        yield "contact.rings", f"a seat of kind {seat.kind!r} has no contact face that could be divided; remove the key"


def find_measure_conflicts(measure: Measure, reed: Structure, *, is_possible: bool) -> Contradictions:
    """Yield contradictions for a measure that needs an absent table, or of the reed's stress that is not known."""
    if "stress" in measure.data:
        yield from (("accuracy.measures", words) for words in reed.stress_problems(measure.name))
    if not is_possible:
        words = f"there is no {measure.needs}: add {measure.needs}, or remove the measure"
        yield "accuracy.measures", f"{measure.name} is asked, and {words}"


def own_doubts_of(table: Table) -> tuple[Problem, ...]:
    """Return the doubts about the values of a scene, or of another table, and of the tables in it."""
    return tuple(Problem(None, 0, key, words) for key, words in _find_table_doubts(table, ""))


def cover_doubts_of(geometry: ContactGeometry) -> tuple[Problem, ...]:
    """Return the doubts about a reed that covers only a part of the lip that its model presses."""
    with suppress(GeometryError, MeshError, ModelError, MeshingError, OSError):  # of files that are refused elsewhere
        findings = or_diameter(geometry, ContactGeometry.cover_doubts)
        return tuple(Problem(None, 0, ".".join(map(str, path)), words) for path, words in findings)
    return ()


def _find_table_doubts(table: Table, before: str) -> Contradictions:
    """Yield the doubts about a table and the tables in it, by dotted key, which begins with ``before``."""
    for name, field in type(table).model_fields.items():
        if name in table.model_fields_set:
            key = before.removesuffix(".") if name == type(table).inlined else f"{before}{name}"
            yield from _find_value_doubts(
                getattr(table, name), tuple(notes_of(field)), _notes_of_parts(field.annotation), key
            )
    yield from ((f"{before}{key}", words) for key, words in table.doubts())


def _notes_of_parts(annotation: object) -> Sequence[object]:
    """Return the annotations of each element of a list."""
    element = next(iter(get_args(annotation)), None)
    return get_args(element)[1:] if get_origin(element) is Annotated else ()


def _find_value_doubts(value: object, notes: Sequence[object], of_parts: Sequence[object], key: str) -> Contradictions:
    """Yield the doubts about the value of a key; ``notes``, ``of_parts``: annotations of it, and of parts of a list."""
    if isinstance(value, Table):
        yield from _find_table_doubts(value, f"{key}.")
    elif isinstance(value, float) and value and (words := unusual(value, notes)):
        yield key, words
    elif isinstance(value, tuple | Mapping):
        for part, each in value.items() if isinstance(value, Mapping) else enumerate(value):
            yield from _find_value_doubts(each, of_parts, (), f"{key}.{part}")


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
