"""Scenes that are finer in every key: the references of all scripts that ask whether error bars hold."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, TypeVar

import impact
from impact.runs.variations import Values
from seatfem.structures.cache import build
from seatfem.structures.kinds import Structure
from seatfem.structures.kinds.beam import Beam
from seatfem.structures.kinds.drawn import Drawn
from seatfem.structures.kinds.elastic import Reduced
from seatfem.structures.kinds.thin_plate import ThinPlate
from seatfem.structures.method import Method, Solved
from seatfem.structures.reduction.modes import ConvergenceError
from seatfem.structures.rings import FEWEST_ARCS, MOST_RINGS
from seatfem.study.impacts.bodies import problem_of, solve_body, striker_of
from seatfem.study.impacts.contact import record_of, run_contacts
from seatfem.study.impacts.forces import Strike
from seatfem.study.impacts.landings import Landings
from seatfem.study.impacts.touches import values_of_record
from seatfem.study.ladders.patch import finer_stopper, meshed_for_arcs
from seatfem.study.method import RunMethod
from seatfem.study.plan import Plan
from seatfem.study.runs.reed_stress import plate_stress
from seatfem.study.runs.round import Round
from seatfem.study.runs.seat_stress import seat_stress
from seatfem.study.runs.stresses import REED, SEAT, TENSION, stresses
from seatfem.study.scene import Scene

LEAST_MODES, MOST_MODES = 60, 400  # of a beam in a reference
MOST_STEPS: Final = 1_000_000
MOST_PORTS: Final = 512  # of a lip in a reference: more take longer than they tell
REFUSALS: Final = (ValueError, ArithmeticError, ConvergenceError)
"""What the program ends with in words where it cannot do what is asked."""
Computed = TypeVar("Computed")


@dataclass(frozen=True)
class Finer:
    """By how much a reference is finer than a run.

    Attributes:
        mesh, band, stricter, modes, step: factors of element sizes, bands, tolerances, numbers of modes, and of the
            step.
        plates: factor of the band of a striker or a stopper that is a plate. With 1.6 a reference may stand at a band
            that is off by accident: what one flapper's landing changed from 100 to 160 kHz was twice its error at 100.
        arcs: factor of the arcs of a lip.
        across: more parts of each arc.
        rings: of a patch that is struck as a whole, at least.
        reduction: by name.
        divides: whether a patch and a lip are in more parts than those of the run.
    """

    mesh: float = 1.6**2
    band: float = 2.5
    stricter: float = 5.0
    modes: float = 2.5
    step: float = 4.0
    plates: float = 4.0
    arcs: int = 4
    across: int = 2
    rings: int = 8
    reduction: str = "auto"
    divides: bool = True


FINEST: Final = Finer()
LADDER: Final = (
    FINEST,
    Finer(band=1.6, stricter=2.0, arcs=2),
    Finer(mesh=1.6, band=1.6, stricter=2.0, arcs=2),
    Finer(mesh=1.6, band=1.6, stricter=2.0, plates=2.5, arcs=2, reduction="modes"),
    Finer(mesh=1.6, band=1.25, stricter=1.5, plates=1.6, arcs=2, rings=4),
)
"""From the finest to what dear scenes can be compared with; every key is finer in each of them."""


def finer_in_every_key(scene: Scene, method: RunMethod, by: Finer = FINEST) -> tuple[Scene, RunMethod]:
    """A scene and the method that a run of it had, finer in all that they state or leave open.

    ``method.time_step`` is that of the run [s]. A seat taken for a spring or a rod has finite elements, a single port
    in place of a lip the lip's arcs, and whatever strikes or limits the lift is finer by its own keys.
    """
    scene = Plan(scene, method, ()).as_stated()
    assert method.time_step is not None
    step = max(method.time_step / by.step, scene.run.duration / MOST_STEPS)
    seat, rings = _finer_seat(scene, method.seat, by), scene.contact.rings
    divided = by.divides and (scene.seat.elastic is not None or method.ports is not None)
    arcs = by.arcs * max(FEWEST_ARCS, method.ports) if by.divides and method.ports is not None else method.ports
    if divided:
        rings = max(by.rings, 2 * rings) if arcs is None else rings + by.across
        rings = min(MOST_RINGS, rings)
    if by.divides and arcs is not None:
        while arcs * rings > MOST_PORTS and arcs >= 4 * (method.ports or 1):
            arcs //= 2
        rings = min(rings, max(1, MOST_PORTS // arcs))
    changed: dict[str, object] = {"reed": finer_body(scene.reed, by)}
    changed["contact"] = scene.contact.model_copy(update={"rings": rings})
    changed["run"] = scene.run.model_copy(update={"time_step": step})
    if scene.stopper is not None:
        parts = finer_stopper(scene.geometry, scene.stopper.parts) if by.divides else None
        stopper = scene.stopper.divided(parts or scene.stopper.parts)
        changed["stopper"] = stopper.model_copy(update={"body": finer_body(stopper.body, by)})
    scene = scene.model_copy(update=changed)
    reed = replace(method.reed, n_modes=scene.reed.stated().n_modes, **_band_and_size(scene.reed))
    seat = replace(seat, rings=rings) if divided else seat
    finer = meshed_for_arcs(scene.seat, RunMethod(seat, reed, step).along(scene.geometry, arcs))
    finer = finer.stopped(scene.geometry, None if scene.stopper is None else scene.stopper.parts)
    return Plan(scene, finer, ()).as_stated(), finer


def _finer_seat(scene: Scene, method: Method, by: Finer) -> Method:
    """How the seat of a reference is computed."""
    seat, changed = scene.seat, dict[str, Any]()
    if method.n_modes is not None:
        changed["n_modes"] = _more_modes(method.n_modes, by)
    if isinstance(seat, Reduced):
        assert method.bandwidth is not None
        changed |= {"bandwidth": by.band * method.bandwidth, "tolerance": method.tolerance / by.stricter}
        changed |= {"reduction": by.reduction, "level": "3d"}
    if isinstance(seat, Drawn):
        level = seat.discrete(method.level)
        spec = seat.mesh_spec(replace(method, level=level))
        changed |= {"level": level, "size": spec.size / by.mesh, "contact_size": spec.patch_size / by.mesh}
        changed["order"] = max(2, method.order)
    return replace(method, **changed)


def finer_body(body: Structure, by: Finer) -> Structure:
    """A striker or a stopper with all keys of its own finer; what is exact as it is."""
    changed: dict[str, object] = {}
    if isinstance(body, Beam):
        changed["n_modes"] = _more_modes(body.n_modes, by)
    if isinstance(body, ThinPlate):
        changed["greens"] = body.greens.model_copy(update={"bandwidth": by.plates * body.greens.bandwidth})
        changed["mesh"] = body.mesh.model_copy(update={"size": body.sheet().element_size / by.mesh})
    if isinstance(body, Reduced):
        aims = {"bandwidth": by.band * body.greens.bandwidth, "tolerance": body.greens.tolerance / by.stricter}
        changed["greens"] = body.greens.model_copy(update={**aims, "method": by.reduction})
    if isinstance(body, Drawn):
        how = body.stated()
        level = body.discrete(how.level)
        spec = body.mesh_spec(replace(how, level=level))
        sizes = {"size": spec.size / by.mesh, "contact_size": spec.patch_size / by.mesh, "order": max(2, how.order)}
        changed |= {"model": level, "mesh": body.mesh.model_copy(update=sizes)}
    return body.model_copy(update=changed)


def _more_modes(number: int, by: Finer) -> int:
    return max(number, min(MOST_MODES, max(LEAST_MODES, round(by.modes * number))))


def _band_and_size(body: Structure) -> Mapping[str, Any]:
    """What a plate states of these."""
    how = body.stated()
    return {"bandwidth": how.bandwidth, "size": how.size, "contact_size": how.contact_size, "tolerance": how.tolerance}


@dataclass(frozen=True)
class Reference:
    """A finer scene and its bodies.

    Attributes:
        scene, method: as `finer_in_every_key` has them.
        seat, reed: computed; ``reed`` is ``None`` of a closed form.
        striker: of the scene.
        landings: of the run, each of which is looked for.
        values: the measures.
    """

    scene: Scene
    method: RunMethod
    seat: Solved
    reed: Solved | None
    striker: impact.Body
    landings: Landings | None
    values: Values


def reference_of(scene: Scene, method: RunMethod, landings: Landings | None) -> Reference:
    """The bodies of a scene by a method, and its measures, with each landing above its own quasi-static load."""
    assert method.time_step is not None
    seat = build(scene.seat, method.seat, scene.run.duration, mesh_error=False)
    reed = solve_body("reed", scene.reed, method.reed, scene.run.duration, mesh_error=False)
    striker = striker_of(scene, method.reed.n_modes, None if reed is None else reed.greens)
    like = None if landings is None else replace(landings, static=None)  # type: ignore[arg-type]
    values = measure(scene, problem_of(scene, striker, impact.Body(seat.greens)), method.time_step, like)
    return Reference(scene, method, seat, reed, striker, like, values)


def measure(scene: Scene, problem: impact.ContactProblem, step: float, landings: Landings | None) -> Values:
    """The measures of a march in steps of ``step`` [s], each of the landings looked for."""
    return values_of_record(record_of(scene, problem, step, like=landings), landings)


class NoReference(Exception):
    """A run is there, and none of the references can be computed."""


def describe(problem: Exception | None) -> str:
    """Return a problem on one line."""
    return f"{type(problem).__name__}: {problem}".replace("\n", "; ")


def find_finest(ladder: Sequence[Finer], first: int, compute: Callable[[Finer], Computed]) -> tuple[int, Computed]:
    """The finest rung of a ladder from the ``first`` on that can be computed, and what it gives."""
    problem: Exception | None = None
    for rung, by in enumerate(ladder[first:], first):
        try:
            return rung, compute(by)
        except REFUSALS as refusal:
            problem = refusal
    raise NoReference(describe(problem))


def finest_reference(done: Round, first: int = 0, ladder: Sequence[Finer] = LADDER) -> tuple[int, Reference]:
    """The number of the finest reference of a ladder from the ``first`` on that can be computed, and the reference."""
    scene, method = done.plan.scene, replace(done.plan.method, time_step=done.result.dt)
    landings = done.touches.landings
    return find_finest(ladder, first, lambda by: reference_of(*finer_in_every_key(scene, method, by), landings))


def finer_round(done: Round, reference: Reference) -> Round:
    """The reference as a round, for what is recovered from one, such as stresses in the bodies."""
    scene, step = reference.scene, reference.method.time_step
    assert step is not None
    touches = run_contacts(scene, reference.striker, reference.seat.greens, step)
    stress = Strike(scene.geometry, reference.striker, reference.seat.greens, touches).largest_stress()
    plan = replace(done.plan, scene=scene, method=reference.method)
    bodies = {"seat": reference.seat, "striker": reference.striker, "reed": reference.reed}
    return replace(done, plan=plan, touches=touches, stress=stress, **bodies)  # type: ignore[arg-type]


def largest_stresses(done: Round, *, bare: bool = False) -> tuple[Mapping[str, float], Mapping[str, float]]:
    """Return the largest stresses of a round, by measure, and their error bars [Pa], nan where not known.

    ``bare``: without what the force leaves in the bars, whose runs take longest.
    """
    values, bars = dict[str, float](), dict[str, float]()
    seat, plate = (seat_stress(done), plate_stress(done)) if bare else stresses(done)
    if seat is not None:
        values[SEAT], bars[SEAT] = float(seat.peak.von_mises.max()), seat.bar
        values[TENSION], bars[TENSION] = float(seat.peak.principal.max()), float(seat.bars[1])
    if plate is not None and plate.largest.after_contact.is_known:
        values[REED], bars[REED] = plate.largest.after_contact.value, plate.bar
    elif REED in done.budget.values and done.stress.after_contact.is_known:
        values[REED], bars[REED] = done.stress.after_contact.value, done.budget.bar(REED)
    return values, bars
