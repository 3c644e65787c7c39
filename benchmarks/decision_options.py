"""What a plan decides, each decision with the option that it took and with cheaper ones, marched finer than planned.

A `Truth` is the same impact finer in every key: mesh, band, tolerance, modes of both bodies, step, segments of a lip
and parts across them. An option of a decision is the truth with that one thing as coarse as the option has it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Final

import numpy as np
from finer_scenes import MOST_PORTS, REFUSALS, Finer, Reference, find_finest, finer_in_every_key, measure, reference_of

from impact.bodies.body import Body, Load
from impact.gas.compressor import Compressor, drop, gas_history
from impact.greens.base import Array, GreensFunction
from impact.runs.variations import Values, narrower
from seatfem.structures.cache import build
from seatfem.structures.estimates.costs import count_elements, seat_seconds
from seatfem.structures.kinds import Structure
from seatfem.structures.kinds.drawn import Drawn
from seatfem.structures.method import Method, at_once, spring_of
from seatfem.structures.rings import ACROSS, FEWEST_ARCS, Division, divided_less, parts_joined
from seatfem.study.impacts.bodies import problem_of, striker_of
from seatfem.study.impacts.gas import gas_of
from seatfem.study.impacts.landings import Landings
from seatfem.study.impacts.validity import BEAM, ONE_PORT, simpler_bodies
from seatfem.study.method import MODEL, MODES, PORTS, REED_BAND, RINGS, STEP, RunMethod, as_stated, is_given
from seatfem.study.planning.plan import Plan
from seatfem.study.prerun.bench import relative_changes
from seatfem.study.prerun.context import RING_NUMBERS
from seatfem.study.prerun.lips import rings_refused
from seatfem.study.scene import Scene

WAVES, WAVES_OF_PARTS = "spring or waves in the seat", "statics or waves, lip in segments"
ROD, WHOLE_BODY = "rod or finite elements", "part of the seat or all of it"
ONE_POINT: Final = "one contact point or segments"
SEGMENTS, ACROSS_LIP, REED_MODES, PLATE_BAND, TIME_STEP = (
    "number of lip segments",
    "parts across the contact face",
    "number of reed modes",
    "band of the plate",
    "time step",
)
BEAM_REED, FILM, GAS = "beam or plate reed", "film in the gap", "gas coupled or prescribed"
DECISIONS: Final = (
    *(WAVES, WAVES_OF_PARTS, ROD, WHOLE_BODY, ONE_POINT, SEGMENTS, ACROSS_LIP, REED_MODES, PLATE_BAND, TIME_STEP),
    *(BEAM_REED, FILM, GAS),
)
LADDERS: Final = {
    SEGMENTS: (PORTS, 1), ACROSS_LIP: (RINGS, 1), REED_MODES: (MODES, 1), PLATE_BAND: (REED_BAND, 1e3),
    TIME_STEP: (STEP, 1e-9),
}  # fmt: skip
"""Decisions among many values, with the key and the unit in which options state it: the plan says that one is enough,
and that the next cheaper one is not."""
BY_USER: Final = (BEAM_REED, FILM, GAS)
"""What the scene states; the plan says of a beam alone whether it would be enough."""
FINER: Final = (
    Finer(band=1.6, stricter=2.0, step=2.0),
    Finer(mesh=1.6, band=1.6, stricter=2.0, step=2.0),
    Finer(mesh=1.6, band=1.6, stricter=2.0, plates=2.5, step=2.0, reduction="modes"),
    Finer(mesh=1.25, band=1.25, stricter=1.5, plates=1.6, step=2.0),
)
"""From the finest on; every key is finer in each of them."""
RATIOS: Final = (1.4, 2.0, 2.8, 4.0)  # between numbers of modes and bands that are looked at below the chosen one
FEWEST_MODES: Final = 5  # of a reed that a plan looks at
FEWEST_LOOKED_AT: Final = 4  # segments of a lip, below the fewest that a plan takes
LONGER: Final = (2, 4, 8)  # steps over the chosen one
SOLID_SECONDS: Final = 4.0  # predicted, up to which all of a seat is computed that the plan takes a part of


class Truth(Reference):
    """The same impact, finer than its plans and its run in every key; seat and striker are in as many parts."""

    @property
    def greens(self) -> GreensFunction:
        """Of the struck body."""
        return self.seat.greens

    @property
    def division(self) -> Division:
        """Of the struck face into parts."""
        return Division.from_greens(self.greens)

    @property
    def step(self) -> float:
        """Of time [s]."""
        assert self.method.time_step is not None
        return self.method.time_step

    def with_other(
        self, *, seat: GreensFunction | None = None, striker: Body | None = None, scene: Scene | None = None,
        step: float | None = None,
    ) -> Values:  # fmt: skip
        """Return the measures with something else in place of what is given, all else as it is."""
        where = scene or self.scene
        problem = problem_of(where, striker or self.striker, Body(seat or self.greens))
        return measure(where, problem, step or self.step, self.landings)

    def in_parts(self, division: Division) -> Values:
        """Return the measures with the contact face of both bodies in fewer parts."""
        striker = replace(self.striker, greens=parts_joined(self.striker.greens, self.division, division))
        return self.with_other(seat=divided_less(self.greens, division), striker=striker)

    def change(self, values: Values) -> tuple[float, str]:
        """Return the largest relative change of the measures asked for, and the name of that measure."""
        judged = [name for name in self.scene.accuracy.judged if name in self.values]
        changes = relative_changes({name: self.values[name] for name in judged}, values)
        name = max(judged, key=lambda each: changes[each])
        return changes[name], name


def find_truth(scene: Scene, methods: Sequence[RunMethod], landings: Landings, first: int) -> tuple[int, Truth]:
    """Return the finest of `FINER`, from the ``first`` on, that can be computed, and its number.

    ``methods``: of plans and of the run, none of which is as fine in any key.
    """
    method = finest_of(methods)
    return find_finest(FINER, first, lambda by: _truth(scene, method, landings, by))


def finest_of(methods: Sequence[RunMethod]) -> RunMethod:
    """Return a method with the finest value of each key; statics and rods give way to waves."""
    first = max(methods, key=lambda method: method.seat.level not in ("spring", "rod"))
    for_reed = {"bandwidth": max, "n_modes": max}
    for_seat = {**for_reed, "tolerance": min, "size": min, "contact_size": min}
    seat = _with_finest(first.seat, [method.seat for method in methods], for_seat)
    reed = _with_finest(first.reed, [method.reed for method in methods], for_reed)
    return replace(_with_finest(first, methods, {"time_step": min}), seat=seat, reed=reed)


def _with_finest(first: Any, others: Sequence[Any], choices: Mapping[str, Callable[..., Any]]) -> Any:
    """Return the first with the largest or the smallest value of each key among those that the others state."""
    stated = {key: [value for each in others if (value := getattr(each, key)) is not None] for key in choices}
    return replace(first, **{key: choose(stated[key], default=None) for key, choose in choices.items()})


def _truth(scene: Scene, method: RunMethod, landings: Landings, by: Finer) -> Truth:
    finer, how = finer_in_every_key(scene, method, replace(by, divides=False))
    if method.ports is not None:
        division = _finer_division(scene, method)
        how = how.along(finer.geometry, division.arcs, division.rings)
    elif scene.seat.elastic is not None:
        rings = method.seat.rings or 1
        how = replace(how, seat=replace(how.seat, rings=2 * rings if rings in RING_NUMBERS[1:] else max(8, 2 * rings)))
    return Truth(**vars(reference_of(as_stated(finer, how), how, landings)))


def _finer_division(scene: Scene, method: RunMethod) -> Division:
    """More segments and more parts across, each a multiple of those of the method."""
    arcs, rings = 2 * max(FEWEST_ARCS, method.ports or 1), method.seat.rings or 1
    if scene.contact.film is None and not rings_refused(scene.seat, scene.life):
        more = 3 * rings if rings == 1 else 2 * rings
        rings = more if arcs * more <= MOST_PORTS else rings
    return Division(arcs, rings)


@dataclass(frozen=True)
class Option:
    """One option of a decision.

    Attributes:
        name: its value in words.
        measure: marches the truth with it.
        settings: by key, what a plan has that takes it; empty where that is not known.
    """

    name: str
    measure: Callable[[], Values]
    settings: Mapping[str, object]


@dataclass(frozen=True)
class Question:
    """One decision of a scene.

    Attributes:
        decision: among `DECISIONS`.
        by_plan: whether the plan decides; else the scene states it.
        chosen: what was taken; ``None`` where that is the dearest, which the truth has.
        cheaper: options below it, the dearest first.
        said_enough: whether the plan says that the first of these would be enough, though it takes another one.
        reason: the plan's.
    """

    decision: str
    by_plan: bool
    chosen: Option | None
    cheaper: tuple[Option, ...]
    said_enough: bool = False
    reason: str = ""


def questions(plan: Plan, truth: Truth) -> Iterator[Question]:
    """Yield what a plan decides of its scene, and what the scene decides for it that can be tried otherwise."""
    yield from _of_waves(plan, truth)
    yield from _of_the_level(plan, truth)
    yield from _of_parts(plan, truth)
    yield from _of_the_reed(plan, truth)
    yield from _of_the_step(plan, truth)
    yield from _of_the_user(plan, truth)


def _reason(plan: Plan, key: str) -> str:
    return next((choice.reason for choice in plan.choices if choice.key == key), "")


def _of_waves(plan: Plan, truth: Truth) -> Iterator[Question]:
    if truth.greens.highest_rate == 0:  # a spring already
        return
    in_arcs, seat = truth.division.arcs > 1, truth.greens
    by_plan = plan.scene.seat.drawn is not None and not is_given(plan.scene, MODEL)
    static = at_once(seat) if in_arcs else spring_of(seat.static_compliance(), 0.0, seat.ports, {})
    option = Option("spring", lambda: truth.with_other(seat=static), {MODEL: "spring"} if by_plan else {})
    question = _either(WAVES_OF_PARTS if in_arcs else WAVES, option, plan.level == "spring", _reason(plan, MODEL))
    yield replace(question, by_plan=by_plan, said_enough="would be enough" in question.reason)


def _either(decision: str, option: Option, taken: bool, reason: str) -> Question:
    """Return a decision between the option and something dearer."""
    return Question(decision, True, option if taken else None, () if taken else (option,), False, reason)


def _of_the_level(plan: Plan, truth: Truth) -> Iterator[Question]:
    seat, how = plan.scene.seat, truth.method.seat
    if not isinstance(seat, Drawn) or is_given(plan.scene, MODEL):
        return
    form = seat.closed_form()
    if form is not None and any(level.level == "rod" and level.applies for level in seat.levels()):
        rod = Option("rod", lambda: truth.with_other(seat=form), {MODEL: "rod"})
        yield _either(ROD, rod, plan.level == "rod", _reason(plan, MODEL))
    body = truth.scene.seat, replace(how, level="3d"), truth.scene.run.duration
    if how.level in ("axisymmetric", "sector") and not how.in_arcs and _is_soon_computed(*body):
        # the truth has the cheaper option here: what all of the body changes is the same number
        option = Option(how.level, lambda: truth.with_other(seat=build(*body, mesh_error=False).greens), {})
        yield _either(WHOLE_BODY, option, True, _reason(plan, MODEL))


def _is_soon_computed(seat: Structure, method: Method, duration: float) -> bool:
    """Whether it is predicted to take less than `SOLID_SECONDS`."""
    try:
        model, _ = count_elements(seat, method, duration)
    except REFUSALS:
        return False
    return model is not None and sum(seat_seconds(model).values()) <= SOLID_SECONDS


def _of_parts(plan: Plan, truth: Truth) -> Iterator[Question]:
    scene, ports, there = plan.scene, plan.method.ports, truth.division
    rings = plan.method.seat.rings or 1
    if ports is not None and not is_given(scene, PORTS) and there.arcs > 1:
        one, reason = _one_point(truth), _reason(plan, PORTS)
        # a line force or a stress under the lip, which no single contact point has
        needs_segments = "asked for" in reason or "needs lip segments" in reason
        if one is not None and not needs_segments:
            yield _either(ONE_POINT, one, ports == 1, reason)
        if ports > 1:
            options = [
                Option(f"{number} segments", partial(truth.in_parts, Division(number, there.rings)), {PORTS: number})
                for number in _halves(ports)
            ]
            yield _ladder(SEGMENTS, options, reason)
    if scene.seat.elastic is None or is_given(scene, RINGS) or ports == 1:
        return
    if there.rings % rings or there.rings <= rings:
        return
    options = [
        Option(f"{number} parts", partial(truth.in_parts, Division(there.arcs, number)), {RINGS: number})
        for number in (RING_NUMBERS if ports is None else ACROSS)[::-1]
        if number <= rings
    ]
    yield _ladder(ACROSS_LIP, options, _reason(plan, RINGS))


def _one_point(truth: Truth) -> Option | None:
    bodies = dict(simpler_bodies(truth.scene, truth.striker, truth.division))
    body = bodies.get(ONE_PORT) or (truth.striker if len(truth.striker.greens.ports) == 1 else None)
    if body is None:
        return None
    whole = divided_less(truth.greens, Division())
    return Option("one point", lambda: truth.with_other(seat=whole, striker=body), {PORTS: 1})


def _halves(number: int) -> Iterator[int]:
    """Yield the chosen number of segments and halves of it."""
    while number >= FEWEST_LOOKED_AT:
        yield number
        if number % 2:
            return
        number //= 2


def _ladder(decision: str, options: Sequence[Option], reason: str) -> Question:
    """The first is the chosen one."""
    return Question(decision, True, options[0], tuple(options[1:]), False, reason)


def _of_the_reed(plan: Plan, truth: Truth) -> Iterator[Question]:
    scene, reed = plan.scene, plan.method.reed
    if reed.n_modes is not None and not is_given(scene, MODES):
        below = [round(reed.n_modes / ratio) for ratio in RATIOS]
        numbers = [reed.n_modes, *(number for number in below if number >= FEWEST_MODES)]
        options = [Option(f"{each} modes", partial(_in_modes, truth, each), {MODES: each}) for each in numbers]
        yield _ladder(REED_MODES, options, _reason(plan, MODES))
    if scene.reed.thin_plate is not None and reed.bandwidth is not None and not is_given(scene, REED_BAND):
        bands = [reed.bandwidth, *(reed.bandwidth / ratio for ratio in RATIOS)]
        options = [option for band in bands if (option := _in_a_band(truth, band)) is not None]
        if options:
            yield _ladder(PLATE_BAND, options, _reason(plan, REED_BAND))


def _in_modes(truth: Truth, number: int) -> Values:
    return truth.with_other(striker=striker_of(truth.scene, number))


def _in_a_band(truth: Truth, band: float) -> Option | None:
    """The plate with the modes that it has for a band [Hz], up to a multiple of it; ``None`` where it has no others."""
    wider = truth.method.reed.bandwidth
    body = None if wider is None else narrower(truth.striker, wider / band)
    if body is None:
        return None
    return Option(f"{band / 1e3:.3g} kHz", lambda: truth.with_other(striker=body), {REED_BAND: band})


def _of_the_step(plan: Plan, truth: Truth) -> Iterator[Question]:
    step = plan.method.time_step
    if step is None or is_given(plan.scene, STEP):
        return
    steps = [step, *(factor * step for factor in LONGER if 2 * factor * step <= plan.scene.run.filter_width)]
    options = [Option(f"{1e9 * each:.3g} ns", partial(truth.with_other, step=each), {STEP: each}) for each in steps]
    yield _ladder(TIME_STEP, options, _reason(plan, STEP))


def _of_the_user(plan: Plan, truth: Truth) -> Iterator[Question]:
    if truth.division.arcs > 1 and BEAM in (bodies := dict(simpler_bodies(truth.scene, truth.striker, truth.division))):
        whole = divided_less(truth.greens, Division())
        beam = Option("beam", lambda: truth.with_other(seat=whole, striker=bodies[BEAM]), {})
        said = any("a beam model of the reed would be enough" in note for note in plan.notes)
        yield Question(BEAM_REED, False, None, (beam,), said)
    if plan.scene.contact.film is not None:
        bare = truth.scene.model_copy(update={"contact": truth.scene.contact.model_copy(update={"film": None})})
        yield Question(FILM, False, None, (Option("no film", lambda: truth.with_other(scene=bare), {}),))
    if plan.scene.gas is not None and plan.scene.gas.crank is not None:
        body = _under_prescribed_gas(truth)
        yield Question(GAS, False, None, (Option("prescribed", lambda: truth.with_other(striker=body), {}),))


def _under_prescribed_gas(truth: Truth) -> Body:
    """The striker under the pressure of a cylinder whose valve, the reed, stays shut."""
    drive = gas_of(truth.scene.gas)
    assert isinstance(drive, Compressor)
    steps = math.ceil(truth.scene.run.duration / truth.step)
    history = gas_history(drive, np.zeros(steps + 1), truth.step)
    over = drop(drive, history.pressure)
    loads = [load for load in truth.striker.loads if load.feedback is None]
    [shape] = [load.shape for load in truth.striker.loads if load.feedback is not None]
    for table, sign in ((drive.valve.force, 1.0), (drive.valve.force_back, -1.0)):
        area = float(table.area[0])

        def pushed(time: Array, sign: float = sign, area: float = area) -> Array:
            dp = np.interp(time, history.time, over)
            return np.asarray(np.where(sign * dp > 0, dp, 0.0) * area)

        def share(opening: float, area: float = area, table: Callable[[float], float] = table) -> float:
            return table(opening) / area

        loads.append(Load(shape, pushed, share))
    return replace(truth.striker, loads=tuple(loads))
