"""Predicted costs of a run, time by stage and peak memory, from sizes of its models without meshing them."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

from impact.greens.base import GreensFunction
from impact.march.ladder import is_worthwhile
from seatfem.machine import rates
from seatfem.structures.estimates.costs import SeatModel, count_elements, highest_pole, seat_memory, seat_seconds
from seatfem.structures.kinds import Structure
from seatfem.structures.lip import Lip
from seatfem.structures.method import Method
from seatfem.study.impacts.bodies import striker_of
from seatfem.study.impacts.contact import CONTACT_BYTES, LONG_BYTES, fallback_step
from seatfem.study.impacts.touches import STRIKER
from seatfem.study.ladders.level import method_beside
from seatfem.study.method import RunMethod, stated_method
from seatfem.study.planning.plan import Cost
from seatfem.study.prerun import bench
from seatfem.study.scene import Scene

__all__ = ["Cost", "predict_cost"]


MODE_OF_PLATE: Final = 0.007  # time for each mode of a plate that strikes, on its mesh and a coarser one [s]
BUDGET_OF_PLATE: Final = (0.9, 0.012)  # time of its error budget, and for each mode: other bands, divisions [s]
BUDGET_OF_GAS: Final = 0.7  # further time of the error budget with gas [s]
GAS_BARS: Final = 0.6  # time of the error bars of gas masses [s]
PLACES: Final = 400  # places of a plate at which evaluating every step and mode takes as long as the search for peaks
LIFE_OF_BEAM: Final = 0.2  # time of a beam's life [s]
SITES: Final = 40  # such places of a seat, over the square root of the number of its surface elements
HARMONIC: Final = 0.16  # time for the stress of each harmonic of a lip in arcs, on two meshes [s]
FIRST_BLOCK: Final = 1024  # first instants, at which stress is evaluated at all points; later few exceed the peaks
EVERYWHERE: Final = 2.7e-5  # time per such instant, harmonic and square root of the section's outline elements [s]
LATER: Final = 0.08  # time of a later instant, over that
A_LOOK: Final = 1.2e-6  # time of an error bar for each instant and harmonic [s]
LOOKS: Final = 18  # number of such error bars
SHEETS_OF_PLATE: Final = 4  # further pictures of curves of a plate, with its motion
SHEETS_OF_LIFE: Final = 6  # further pictures of life, in those of curves
SHEETS_OF_STRESS: Final = 12  # further pictures of stress: histories, hot spots, frames of the wave


def further_seconds(
    scene: Scene, method: RunMethod, seat: SeatModel | None, steps: float, modes: float, contact: float
) -> Mapping[str, float]:
    """Return the time [s] that plates, gas, stress, life and their pictures add to each stage of the run's stopwatch.

    Args:
        scene, method: the scene, and how it is computed.
        seat: size of its finite-element model; ``None`` for closed forms.
        steps: number of time steps of the run.
        modes: number of modes of the reed.
        contact: time of the contact [s].
    """
    plate = scene.reed.thin_plate is not None
    parts: dict[str, float] = {}
    pictures = 0
    if plate:
        parts[STRIKER] = MODE_OF_PLATE * modes
        parts["error budget"] = BUDGET_OF_PLATE[0] + BUDGET_OF_PLATE[1] * modes
        pictures += SHEETS_OF_PLATE
    if scene.gas is not None:
        parts["error budget"] = parts.get("error budget", 0.0) + BUDGET_OF_GAS
        parts["gas bars"] = GAS_BARS
    everywhere = PLACES * rates.STRESS * steps * modes if plate else LIFE_OF_BEAM
    if scene.stress is not None and seat is not None:
        side = seat.sizes.surface**0.5
        parts["seat stress"] = rates.STRESS * SITES * side * steps * seat.poles
        if isinstance(lip := method.seat.lip, Lip) and method.seat.in_arcs and seat.section:
            across = lip.width / (method.seat.rings or 1)
            waves = math.pi * lip.radius / min(across, method.seat.contact_size or across)
            first = min(steps, FIRST_BLOCK)
            peaks = EVERYWHERE * side * (first + LATER * (steps - first)) + A_LOOK * LOOKS * steps
            parts["seat stress"] += waves * (HARMONIC + peaks)
        pictures += SHEETS_OF_STRESS
    if plate and scene.needs_stress:
        parts["reed stress"] = everywhere / 2
    if scene.life is not None:
        parts["life"] = everywhere
        pictures += SHEETS_OF_LIFE
        if scene.life.curves is not None:
            parts["life curves"] = sum(scene.life.curves.runs) / 2 * (contact + everywhere / 2)
    parts["pictures"] = pictures * rates.SHEET
    return parts


OF_THE_SEAT: Final[tuple[str, ...]] = ("mesh", "assembly", "reduction", "mesh error")
"""Stages that a reused seat does not need."""
PROGRAM: Final = 190e6  # memory of the program while it solves the seat [bytes]
CURVES: Final = 320e6  # memory of the program once it has drawn curves [bytes]
ELEMENTS: Final = 80e6  # further memory of the finite-element libraries [bytes]
PLAN: Final = 0.15  # time of a plan over that of the program's start
SHEETS: Final = 4  # pictures of curves
FRAMES: Final = 19  # views of modes and of their motion
MESH_VIEWS: Final = 3  # views of the mesh
APART: Final = 0.5  # start of the process that draws bodies, over that of the program
SLICES: Final = 64  # slices of a revolved section in pictures; half of them are drawn
BUDGET_RUNS: Final = 5.0  # runs of the error budget of an elastic seat, at twice the time step
CLOSED_RUNS: Final = 2.0  # those of a closed form, without errors of mesh and reduction
COARSE_STRESS: Final = 0.4  # time of the stress in a run of the budget, over that in the run
ARRAYS: Final = 44  # histories that are in memory at once
SAVED: Final = 22  # histories written to the file
OF_A_PORT: Final = CONTACT_BYTES / 8  # further histories for each port of a lip
LONG_TIME: Final = 0.3  # time of a run in steps of different lengths, over that in equal ones, as benchmarked
PORT: Final = 0.5  # time of a pole's step for each further port, over that for one, measured
WEIGHTS: Final = 30  # poles that take as long as exact step weights, per log2 of the steps


def predict_cost(scene: Scene, method: RunMethod, *, kept: bool = False, planning: float = 0.0) -> Cost:
    """Return the wall time by stage, as the run's own stopwatch names them, and the peak memory.

    Args:
        scene, method: the scene, and how it is computed; an open time step is estimated.
        kept: whether the seat is reused, and costs nothing.
        planning: time that the plan has taken [s], which the run will take again.

    Raises:
        GeometryError: the size of a CAD file cannot be read.
    """
    static, duration = method.seat.static, scene.run.duration
    seat, coarser = count_elements(scene.seat, method.seat, duration)
    parts = {"program start": rates.START, "plan": max(planning, PLAN * rates.START)}
    if scene.seat.drawn is not None and scene.seat.files() and not planning:  # inspected by a gmsh process
        parts["plan"] += rates.MESHING_START
    if seat is not None and not kept:
        parts |= seat_seconds(seat, static=static)
    if coarser is not None and not kept:
        parts["mesh error"] = sum(seat_seconds(coarser, static=static).values())
    reed = striker_elements(scene.reed, method.reed, duration)
    parts |= {} if reed is None else {STRIKER: sum(sum(seat_seconds(model).values()) for model in reed)}
    contact = _contact(scene, method, None if static else seat)
    parts |= contact_seconds(contact)
    parts["error budget"] += _waves_beside(scene.seat, method.seat, duration)
    views = 0.0 if seat is None or seat.runs != 1.0 else _views(seat, modes=not static)
    parts["pictures"] = SHEETS * rates.SHEET + views
    further = further_seconds(scene, method, seat, contact.steps, contact.reed, parts["contact"])
    parts |= {stage: parts.get(stage, 0.0) + seconds for stage, seconds in further.items()}
    memory = max(_memory(seat, contact.memory), _memory(reed[0] if reed else None, contact.memory))
    if (plate := scene.reed.thin_plate) is not None:
        sheet = plate.sheet(method.reed.bandwidth).memory(contact.reed)
        memory = max(memory, CURVES + ELEMENTS + sheet + contact.memory)
    return Cost(sum(parts.values()), memory, parts)


def _waves_beside(seat: Structure, method: Method, duration: float) -> float:
    """Return the time to solve a static seat with its waves, for the error budget [s]; 0 for other seats."""
    dynamic = method_beside(seat, method)
    model = None if dynamic is None else count_elements(seat, dynamic, duration)[0]
    return 0.0 if model is None else sum(seat_seconds(model).values())


def striker_elements(reed: Structure, how: Method, duration: float) -> tuple[SeatModel, ...] | None:
    """Return the sizes of the striker's model and of the coarser one for its mesh error; ``None`` without elements."""
    models = count_elements(reed, how, duration) if reed.traits.is_solved else ()
    return tuple(model for model in models if model is not None) or None


def striker_poles(
    reed: Structure, how: Method, dt: float, duration: float, known: GreensFunction | None
) -> float | None:
    """Return the number of poles of the striker in the recursion; ``None``: it has step weights.

    ``known``: Green's function from `surrogate_striker`.
    """
    if how.n_modes is not None:
        return how.n_modes
    if (elements := striker_elements(reed, how, duration)) is not None:
        return elements[0].poles
    greens = reed.closed_form() if known is None else known
    return 1.0 if greens is None else greens.marched_poles(dt, max(1.0, duration / dt))


def closed_form(seat: Structure, how: Method) -> GreensFunction | None:
    """Return the seat's Green's function in closed form; ``None`` for other seats."""
    return seat.closed_form() if how.exact else None


@dataclass(frozen=True)
class ContactModel:
    """The size of a run's time integration.

    Attributes:
        steps: number of time steps.
        poles, reed: numbers of poles of seat and reed.
        coarse_poles: number of poles of the seat at a step twice as long.
        runs: number of runs of the error budget.
        bends: whether the reed is a beam, whose stress is computed.
        ports: number of contact points along the lip.
        has_long_steps: whether smooth motion may take long steps.
    """

    steps: float
    poles: float
    reed: float
    coarse_poles: float
    runs: float
    bends: bool = True
    ports: int = 1
    has_long_steps: bool = False

    @property
    def values(self) -> float:
        """Return the number of values of further ports that each step keeps."""
        return OF_A_PORT * (self.ports - 1) * (LONG_BYTES if self.has_long_steps else 1.0)

    @property
    def memory(self) -> float:
        """Return the bytes of the histories."""
        return 8 * (ARRAYS + self.values) * self.steps


def _contact(scene: Scene, method: RunMethod, seat: SeatModel | None) -> ContactModel:
    """Return the size of the contact's time integration; ``seat``: its finite-element model, unless it is static."""
    closed, known = closed_form(scene.seat, method.seat), None
    if scene.reed.traits.is_solved:
        stated = stated_method(scene).reed
        known = bench.surrogate_striker(scene.reed, stated, scene.run.duration, scene.seat.face)
    dt = method.time_step or _step(scene, method, known, seat, closed)
    steps = max(1.0, scene.run.duration / dt)
    if seat is not None:
        model = ContactModel(steps, seat.poles, 1.0, seat.poles, BUDGET_RUNS)
        model = replace(model, has_long_steps=not scene.is_blown_by_lift)
    else:
        model = contact_model(steps, dt, closed)
    return with_striker(model, scene.reed, method, dt, scene.run.duration, known)


def contact_model(steps: float, dt: float, closed: GreensFunction | None) -> ContactModel:
    """Return the size for a seat in closed form (without poles if ``None``) that a rigid mass strikes."""
    if closed is None:
        return ContactModel(steps, 0.0, 1.0, 0.0, CLOSED_RUNS)
    poles, coarse = _poles(closed, dt, steps), _poles(closed.forces_only(), 2 * dt, steps / 2)
    return ContactModel(steps, poles, 1.0, coarse, CLOSED_RUNS)


def with_striker(
    model: ContactModel, reed: Structure, method: RunMethod, dt: float, duration: float, known: GreensFunction | None
) -> ContactModel:
    """Return ``model`` with the ``reed`` as striker; ``known``: its Green's function from `surrogate_striker`."""
    poles = striker_poles(reed, method.reed, dt, duration, known)
    weight = _weights(model.steps) if poles is None else float(poles)
    return replace(model, reed=weight, bends=method.reed.n_modes is not None, ports=method.seat.division.count)


def _poles(greens: GreensFunction, dt: float, steps: float) -> float:
    """Return the number of poles in the recursion, or the number that takes as long as exact step weights."""
    marched = greens.marched_poles(dt, steps)
    return _weights(steps) if marched is None else marched


def _weights(steps: float) -> float:
    return WEIGHTS * math.log2(steps + 2)


def _step(
    scene: Scene,
    method: RunMethod,
    known: GreensFunction | None,
    seat: SeatModel | None,
    closed: GreensFunction | None,
) -> float:
    reed = striker_of(scene, method.reed.n_modes, known).greens
    elements = striker_elements(scene.reed, method.reed, scene.run.duration)
    dt = fallback_step(scene.run, scene.gas, reed, reed if closed is None else closed)
    for model, how in ((seat, method.seat), (None if elements is None else elements[0], method.reed)):
        if model is not None and how.bandwidth is not None:
            dt = min(dt, 1 / (4 * 2 * math.pi * highest_pole(model, how.tolerance) * how.bandwidth))
    return dt


def contact_seconds(model: ContactModel) -> Mapping[str, float]:
    """Return the time of each stage from the contact to the files [s]."""
    stress = rates.STRESS * model.reed if model.bends and model.reed > 1 else 0.0

    def run(poles: float) -> float:
        per_pole = rates.POLE * (1 + PORT * (model.ports - 1))
        each = rates.STEP + per_pole * (poles + model.reed + (model.ports if model.ports > 1 else 0))
        is_long = model.has_long_steps and is_worthwhile(model.steps * each, model.steps * model.ports)
        return each * (LONG_TIME if is_long else 1.0)

    n = model.steps
    return {
        "contact": rates.COMPILED + n * run(model.poles),
        "spring baseline": n * run(0.0),
        "reed stress": (2 * rates.COMPILED if stress else 0.0) + 2 * n * stress,
        "error budget": model.runs / 2 * n * (run(model.coarse_poles) + COARSE_STRESS * stress),
        "files": (SAVED + model.values) * n * rates.VALUE,
    }


def _views(seat: SeatModel, *, modes: bool) -> float:
    """Return the time for pictures of the mesh and, with ``modes``, of modes [s], drawn in another process."""
    faces, frames = seat.sizes.surface, FRAMES if modes else 0
    if seat.section:
        faces = 2 * seat.sizes.surface * SLICES + 2 * seat.sizes.elements
        return rates.SHEET + (APART * rates.START if modes else 0.0) + frames * (rates.VIEW + faces * rates.FACE)
    return APART * rates.START + (frames + MESH_VIEWS) * (rates.VIEW + faces * rates.FACE)


def _memory(seat: SeatModel | None, histories: float) -> float:
    """Return the peak memory of the program [bytes], without the process that draws bodies."""
    if seat is None:
        return CURVES + histories
    peak, stays = seat_memory(seat)
    return max(PROGRAM + peak, CURVES + ELEMENTS + stays + histories)
