"""Checks that the tables of a scene agree with each other: what one of them asks of another."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Final

import numpy as np

from seatfem.fields import KeyProblem
from seatfem.structures.kinds.striking import check_along
from seatfem.structures.rings import Division
from seatfem.study.scene.measures import LifeMargin, Stress, any_needs_stress
from seatfem.units import write_quantity

if TYPE_CHECKING:
    from seatfem.study.scene.models import Scene


def check_agreement(scene: Scene) -> None:
    """Raise the first `KeyProblem`."""
    for check in _CHECKS:
        check(scene)


def _gas_of_the_run(scene: Scene) -> None:
    if (gas := scene.gas) is None:
        return
    if gas.cycles is not None and not math.isclose(gas.cycles * gas.turn, scene.run.duration, rel_tol=1e-6):
        raise KeyProblem(
            "gas.cycles",
            f"{gas.cycles:g} turns take {write_quantity(gas.cycles * gas.turn, 'time')}, run.duration is "
            f"{write_quantity(scene.run.duration, 'time')}: keep "
            "one of the two",
        )
    if gas.cylinder_pressure is not None:
        time, slack = gas.course.time, 1e-9 * scene.run.duration
        if not gas.course.period and (time[0] > slack or time[-1] < scene.run.duration - slack):
            raise KeyProblem(
                "gas.cylinder_pressure",
                f"the record covers {write_quantity(time[0], 'time')} to {write_quantity(time[-1], 'time')}, the run "
                f"takes {write_quantity(scene.run.duration, 'time')}: give a "
                "longer record, or shorten run.duration",
            )


def _in_their_roles(scene: Scene) -> None:
    """Check that what is struck is at rest, and what strikes moves."""
    if scene.seat.motion:
        raise KeyProblem(
            f"seat.{scene.seat.motion}", "the struck body is at rest; remove the key, or use the body as the reed"
        )
    reed, moved_by = scene.reed, scene.reed.moved_by
    if not moved_by:
        raise KeyProblem("reed.kind", f"a body of kind {reed.kind!r} cannot move; take a kind that can")
    if not reed.motion and not (scene.load or scene.base or scene.spring) and scene.gas is None:
        others = f" ({', '.join(moved_by[1:-1])} or {moved_by[-1]} would do, too)"
        words = type(reed).model_fields[moved_by[0]].description or ""
        raise KeyProblem(f"reed.{moved_by[0]}", f"required key is missing: {words.partition(';')[0]}{others}")
    try:
        reed.check_motion()
    except KeyProblem as problem:
        raise KeyProblem(f"reed.{problem.key}", str(problem)) from None


def _loads_on_the_reed(scene: Scene) -> None:
    for number, load in enumerate(scene.load):
        scene.reed.check_place(load.at, f"load.{number}.at")
        if load.point is not None:
            scene.reed.check_place(np.array([load.point]), f"load.{number}.point")
        if load.needs_weight and not scene.reed.traits.has_weight:
            raise KeyProblem(
                f"load.{number}.{'gravity' if load.gravity is not None else 'base_motion'}",
                f"of a reed of kind {scene.reed.kind!r} it is not known how its mass is spread; give a force",
            )


def _springs_on_the_reed(scene: Scene) -> None:
    for number, spring in enumerate(scene.spring):
        try:
            spring.check(scene.reed)
        except KeyProblem as problem:
            raise KeyProblem(f"spring.{number}.{problem.key}", str(problem)) from None
    if scene.spring and scene.base_of("reed") is not None:
        raise KeyProblem(
            "spring.0.stiffness",
            "the guard that springs stand on is at rest, [[base]] moves the reed's clamp: remove one of the two, or "
            "move the seat",
        )


def _bases_of_what_is_held(scene: Scene) -> None:
    for number, base in enumerate(scene.base):
        if base.of not in scene.bodies:
            raise KeyProblem(f"base.{number}.of", "there is no [stopper]; add one, or remove the table")
        if base is not scene.base_of(base.of):
            raise KeyProblem(f"base.{number}.of", f"the base of the {base.of} has a table before; keep one")
        if loose := scene.bodies[base.of].loose:
            words = loose.replace("seat.kind", f"{base.of}.kind")
            raise KeyProblem(f"base.{number}.of", f"{words}: it has no base that could move it; remove the table")
    if scene.base_of("reed") is not None and not scene.reed.traits.has_weight:
        raise KeyProblem(
            f"base.{[base.of for base in scene.base].index('reed')}.of",
            f"of a reed of kind {scene.reed.kind!r} it is not known how its mass is spread; give a beam or a plate",
        )


def _contact_on_the_reed(scene: Scene) -> None:
    reed, ring = scene.reed, scene.seat.struck_ring
    check_along(reed.kind, reed.reach, scene.contact.at, "contact.at")
    if ring is None or reed.reach is None or scene.contact.at is None:
        return
    outer = ring[0] + ring[1] / 2
    if scene.contact.at < outer * (1 - 1e-9):
        raise KeyProblem(
            "contact.at",
            f"the lip's middle is {write_quantity(scene.contact.at, 'length')} from the clamp, and the lip reaches "
            f"{write_quantity(outer, 'length', 4)} from its middle, behind the clamp; make contact.at at least that, "
            "or the lip smaller",
        )


def check_start(scene: Scene) -> None:
    """Check that the stopper meets the reed where it has a place, and not before the start; raises `KeyProblem`."""
    if (stopper := scene.stopper) is None:
        return
    check_along(scene.reed.kind, scene.reed.reach, stopper.at, "stopper.at")
    if stopper.parts != Division() and scene.reed.thin_plate is None:
        key = "arcs" if (stopper.arcs or 1) > 1 else "tilt" if stopper.tilt else "rings"
        words = f"a reed of kind {scene.reed.kind!r} touches with one rigid face; remove the key, or take a plate"
        raise KeyProblem(f"stopper.{key}", words)
    by_lift = stopper.lift is not None
    if by_lift and scene.has_two_places and scene.contact.gap > 0:
        raise KeyProblem(
            "stopper.lift",
            f"with contact.gap = {1e3 * scene.contact.gap:g} mm the closed reed is bent, and where it stands at "
            "stopper.at depends on what holds it there; give stopper.gap, from the undeformed reed",
        )
    gap, start = scene.stopper_gap, scene.reed.start_at(scene.contact.at if stopper.at is None else stopper.at)
    key = "stopper.lift" if by_lift else "stopper.gap"
    more = scene.contact.gap if by_lift else 0.0
    if gap < 0:
        raise KeyProblem(
            key,
            f"{1e3 * (gap + more):.6g} mm is less than contact.gap = {1e3 * more:.6g} mm: the undeformed reed "
            f"would stand inside the stopper; make the lift at least {1e3 * more:.6g} mm",
        )
    if start > gap + 1e-9 * abs(start):
        raise KeyProblem(
            key,
            f"{1e3 * (gap + more):.6g} mm: at the start the reed stands {1e3 * start:.6g} mm off its undeformed "
            f"place there, inside the stopper (limit: {key}); make the {key.removeprefix('stopper.')} at least "
            f"{1e3 * (start + more):.6g} mm, or release the reed from a smaller deflection",
        )


def _lip_of_a_seat(scene: Scene) -> None:
    if (key := scene.contact.along_a_lip) and (why := scene.seat.no_lip):
        raise KeyProblem(f"contact.{key}", f"a seat of kind {scene.seat.kind!r}, {why}")
    if scene.seat.is_curved:
        raise KeyProblem("seat.curvature", "only the reed may be curved; remove the key")
    if scene.reed.is_curved and (why := scene.seat.no_lip):
        raise KeyProblem("reed.curvature", f"a seat of kind {scene.seat.kind!r}, {why}")
    if scene.reed.is_curved and scene.contact.ports == 1:
        raise KeyProblem(
            "contact.ports", "a single contact point has only a mean gap, reed.curvature needs several: remove it"
        )
    if any(scene.contact.offset) and scene.reed.thin_plate is None:
        raise KeyProblem(
            "contact.offset", f"a body of kind {scene.reed.kind!r} touches with one rigid face; remove the key"
        )


def _film_of_a_strip(scene: Scene) -> None:
    if (film := scene.contact.film) is not None:
        try:
            film.check(scene.seat.struck_ring, scene.seat.kind, scene.contact.rings)
        except KeyProblem as problem:
            raise KeyProblem(f"contact.{problem.key}", str(problem)) from None


def _stress_of_finite_elements(scene: Scene) -> None:
    if scene.stress is not None and scene.seat.elastic is None:
        raise KeyProblem("stress", f"a seat of kind {scene.seat.kind!r} has no finite elements; remove the table")
    if scene.stress is not None:
        try:
            scene.stress.check(scene.run.duration)
        except KeyProblem as problem:
            raise KeyProblem(f"stress.{problem.key}", str(problem)) from None


def _rings_of_a_patch(scene: Scene) -> None:
    if scene.contact.rings > 1 and not scene.seat.traits.has_rings:
        raise KeyProblem(
            "contact.rings",
            f"a seat of kind {scene.seat.kind!r} has no contact face that could be divided; remove the key",
        )


def _stress_of_what_bends(scene: Scene) -> None:
    wanted = scene.accuracy.measures
    name = LifeMargin.name if LifeMargin.name in wanted else Stress.name
    if any_needs_stress(wanted) and not (scene.reed.traits.has_stress or scene.reed.thin_plate is not None):
        bends = "has no bending stress that is known" if scene.reed.reach else "does not bend, it has no stress"
        words = f"{name} is asked of a body of kind {scene.reed.kind!r}, which {bends}: remove it, or use a cantilever"
        raise KeyProblem("accuracy.measures", f"{words} or a plate")
    if LifeMargin.name in wanted and (scene.life is None or scene.life.demand() is None):
        raise KeyProblem(
            "accuracy.measures",
            f"{name} is asked, and no strength of the reed is stated: add life.strength, or remove the measure",
        )


def _life_of_what_bends(scene: Scene) -> None:
    if scene.life is not None:
        try:
            scene.life.check(scene)
        except KeyProblem as problem:
            raise KeyProblem(f"life.{problem.key}", str(problem)) from None


_CHECKS: Final[tuple[Callable[[Scene], None], ...]] = (
    _gas_of_the_run,
    _in_their_roles,
    _loads_on_the_reed,
    _springs_on_the_reed,
    _bases_of_what_is_held,
    _contact_on_the_reed,
    check_start,
    _lip_of_a_seat,
    _film_of_a_strip,
    _stress_of_finite_elements,
    _rings_of_a_patch,
    _stress_of_what_bends,
    _life_of_what_bends,
)
