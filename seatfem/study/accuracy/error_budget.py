"""The seat, the reed and the level of a scene, each made coarser for the error budget of a run."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final, get_args

import numpy as np

import impact
from impact.after.landings import Landing
from impact.after.stresses import ReedStress
from impact.greens.base import GreensFunction
from impact.greens.modal import Residual
from impact.march.motion import Discrete
from impact.march.problem import ContactProblem
from impact.notices import Progress, silent
from impact.runs.variations import (
    AT_ONCE,
    NARROWER,
    Budget,
    Terms,
    Values,
    Variation,
    budget_of,
    changes,
    narrowed,
    ringing_on,
    times,
    total,
)
from impact.runs.variations import of_g as of_body
from seatfem.machine.compiling import threads
from seatfem.machine.resources import available_memory
from seatfem.structures.estimates.surrogate import on_its_patch
from seatfem.structures.method import with_start
from seatfem.structures.rings import (
    OF_TWICE,
    Division,
    across_behind,
    as_a_whole,
    divided_less,
    left_by,
    parts_behind,
    parts_joined,
    with_fewer_rings,
)
from seatfem.study.accuracy.part_errors import (
    CLOCK,
    LastTouch,
    clock_off,
    of_stopper,
    of_striker,
    other_modes,
    waves_beside,
    with_end,
    without_clock,
)
from seatfem.study.accuracy.prerun import Bench, window_of
from seatfem.study.impacts.contact import (
    STEP_BYTES,
    in_flight,
    problem_of,
    record_of,
    solved_striker,
    stopper_of,
    striker_of,
)
from seatfem.study.impacts.landings import Face, Landings
from seatfem.study.impacts.touches import (
    LIP,
    RECORD,
    SOURCES,
    STOPPER,
    STRIKER,
    RunRecord,
    Touches,
    contact_record_of,
    is_time,
    landing_name,
    stopper_in,
    values_of_record,
)
from seatfem.study.impacts.validity import fit_of
from seatfem.study.method import RunMethod, chooses_one_port
from seatfem.study.safety import (
    FLOOR_OF_SPRING,
    FLOORS,
    OF_DRAWS,
    ONE_PORT_BAR,
    SHEAR_SHARE,
    SHORT,
    WITHIN_PARTS,
)
from seatfem.study.scene import Scene
from seatfem.study.scene.lips import across_of, arcs_behind_rings, lip_of
from seatfem.study.scene.measures import (
    ContactDuration,
    ContactRecord,
    FilteredPeak,
    Impulse,
    all_measures,
    judged_landings,
)

if TYPE_CHECKING:
    from seatfem.structures.method import Solved
    from seatfem.study.impacts.plate_stress import PlateLook

STEPS_A_TRANSIT: Final = 16  # of a rod: 1/16 of a step is left
MOST_STEPS: Final = 1_000_000  # of a run that is compared with

CUT: Final = ("impulse_Ns", "duration_s")
"""Numbers of a landing that its end takes part in."""
KEYS_OF_MEASURES: Final[Mapping[str, tuple[str, ...]]] = {
    FilteredPeak.name: ("filtered_peak_force_N", "excess_peak_force_N"),
    Impulse.name: ("impulse_Ns",),
    ContactDuration.name: ("duration_s",),
}
"""Numbers in the record of a landing that measures of a landing are, too, or follow."""


def error_budget(
    scene: Scene,
    method: RunMethod,
    seat: Solved,
    striker: impact.Body,
    touches: Touches,
    stress: ReedStress | None = None,
    reed: Solved | None = None,
    look: PlateLook | None = None,
    progress: Progress = silent,
) -> Budget:
    """Return what mesh, reduction, step, model and patch, and a computed striker, leave in ``result``'s measures.

    - time_step: see `impact.runs.variations`; also half the step through the impact that is judged, and where waves
      cross a rod within the step, one that they do not: all longer ones agree with each other. The
      runs below take the doubled step, if it resolves the filter, and are compared with that one.
    - mesh: the seat on the coarser mesh, taken as converging with order 1, as clamped corners may; where that is not
      at hand, g made larger by its stated error.
    - reduction: the highest modes of the seat, down to 1.6 below the last, moved into the residual, and g larger by
      the reduction's error. A Krylov space keeps modes far beyond the bandwidth.
    - model: fewer modes of a beam, by 1.4, or half of what half of them change, or, of few, what many change; g
      larger by the error of the level of modelling (a bar as a rod); what a cheap level leaves out, to first order
      (`Structure.beyond`); a thick reed's shear; of a plate on a lip in arcs, `WITHIN_PARTS`.
    - patch: a patch that moves as its mean is softer than under the striker's face. In place of one ring or two, the
      patch in `ENOUGH` of them, on the coarser mesh; of more, what one ring in their place changes, times
      `seatfem.structures.rings.left_by`. Of a lip in arcs, what twice as many arcs change, and what more rings across
      them do, both on both bodies. A rod or spring has no patch, and of a function from a file it is not known.
    - striker: mesh, reduction and level of one that was computed (``reed``), as those of the seat; what is not known of
      them is named beside the bars.
    - lip: of one port that a plan has chosen, what arcs in its place change, on the waves of the seat as a whole over a
      half-space, which tells the arcs from each other.
    - record: of a measured seat, the largest change among the draws of its fit, what lies above the band as modes that
      ring at its end, and g larger by a misfit beyond the noise; its reduction has then no error of its own.
    - stopper: the same of one that is computed, with its patch, and of a beam its modes; twice as many of its arcs.
    A closed-form seat has no error of mesh and reduction. ``stress``: the reed's in ``touches``, if wanted; ``look``:
    at that of a plate in other runs; ``progress``: hears of each run.
    """
    result = touches.seat
    problem, width = problem_of(scene, striker, impact.Body(seat.greens)), scene.run.filter_width
    sources, unknown = sources_of(scene, method, seat, problem, reed)

    known: dict[tuple[int, float], tuple[impact.Body, Discrete]] = {}  # with the body, whose id is not taken again then

    def flight(body: impact.Body, dt: float) -> Discrete:
        if (id(body), dt) not in known:
            known[id(body), dt] = body, in_flight(body, dt, scene.run.duration)
        return known[id(body), dt][1]

    blow = contact_record_of(touches, width, stress, scene.accuracy.landing)
    last, like = LastTouch.from_record(blow), touches.landings
    own = RunRecord(blow, like, touches.stopper_force)

    def values_with_clock(record: RunRecord) -> Values:
        return {**values_of_record(record, like), CLOCK: last.time(record.blow)}

    runs, count = 2 + sum(len(term) for terms in sources.values() for term in terms or ()), 0

    def run(varied: ContactProblem, dt: float) -> Values:
        nonlocal count
        count += 1
        progress("error budget", min(count / runs, 1.0))
        return values_with_clock(record_of(scene, varied, dt, flight, like, look=look))

    finer = _finer_step(scene, problem, touches, look)
    if finer is None:
        finer = times(2.0, changes(values_of_record(own, like), run(problem, result.dt / 2)))
    if shorter := _step_of_waves(problem, result.dt, scene.run.duration):
        apart = changes(values_of_record(own, like), run(problem, shorter))
        finer = {name: max(value, finer.get(name, 0.0)) for name, value in apart.items()}
    at_once = _at_once(len(result.force) * len(problem.contacts))
    values = values_with_clock(own)
    budget = budget_of(run, problem, values, result.dt, sources, filter_width=width, finer=finer, threads=at_once)
    budget = _with_end(scene, problem, budget, result.dt, like)
    names = (*SOURCES, *(name for name in (STRIKER, STOPPER, LIP, RECORD) if name in sources))
    known_parts = {str(s): budget.parts[s] for s in names if s in budget.parts}
    floors = {source: least for source, least in FLOORS.items() if sources.get(source)}
    if method.seat.level == "spring":
        floors["model"] = FLOOR_OF_SPRING
    budget = with_floors(Budget(budget.values, known_parts, (*names, *unknown)), floors)
    if scene.reed.thin_plate is not None and Division.from_greens(seat.greens).arcs > 1:
        budget = with_share(budget, "model", WITHIN_PARTS)  # no number of parts makes it smaller
    return with_cut_landings(with_jumps(budget, blow), like)


def with_cut_landings(left: Budget, landings: Landings | None) -> Budget:
    """Return the budget with nothing known of how long the landings last that the end of the record cuts, nor of their
    whole impulse, nor of the peak of one that has hardly passed it."""
    if landings is None or not left.parts:
        return left
    cut = [
        landing_name(face, number, key)
        for face in get_args(Face)
        for number, landing in enumerate(landings.on(face))
        for key in CUT
        if landing.cut_off
    ]
    for prefix, judged in judged_landings(landings.seat).items():
        if judged.cut_off:
            cut += [prefix + Impulse.name, prefix + ContactDuration.name]
            rises = judged.end - judged.peak_time < judged.duration / 10
            cut += [prefix + FilteredPeak.name] if rises else []
    source = left.dominant("impulse")
    unknown = {name: math.inf for name in cut if name in left.values}
    return replace(left, parts={**left.parts, source: {**left.parts[source], **unknown}})


def with_bars_of_measures(left: Budget, landings: Sequence[Landing]) -> Budget:
    """Return the budget with no smaller parts in the record of a landing than in the measures of the same landing.

    Half the step is marched through the judged landing alone, measures jump, and plans know more of them: the record of
    that landing, which the same forces make, knows its numbers no better.
    """
    pairs = (
        (landing_name("seat", landings.index(landing), key), prefix + measure)
        for prefix, landing in judged_landings(landings).items()
        for measure, keys in KEYS_OF_MEASURES.items()
        for key in keys
    )
    same = {name: measure for name, measure in pairs if name in left.values and measure in left.values}
    parts = {
        source: {**part, **{name: max(part[name], part[measure]) for name, measure in same.items()}}
        for source, part in left.parts.items()
    }
    return replace(left, parts=parts)


def with_floors(left: Budget, floors: Mapping[str, float]) -> Budget:
    """Return the budget with no part of a source below what its model can know, relative to the measure, as
    `seatfem.study.safety` has it; but for the time at which a landing begins, of which a share of the time before it
    says nothing."""
    raised = {
        source: {
            name: value if is_time(name) else max(value, floors.get(source, 0.0) * abs(left.values[name]))
            for name, value in part.items()
        }
        for source, part in left.parts.items()
    }
    return replace(left, parts=raised)


def with_share(left: Budget, source: str, share: float) -> Budget:
    """Return the budget with more of a known source: a ``share`` of each value, but of when landings begin."""
    if source not in left.parts:
        return left
    more = {name: 0.0 if is_time(name) else share * abs(value) for name, value in left.values.items()}
    return replace(left, parts={**left.parts, source: total(left.parts[source], more)})


def _with_end(scene: Scene, problem: ContactProblem, left: Budget, dt: float, like: Landings | None) -> Budget:
    """Return the budget with what the end of the record cuts off; where g is unknown beyond it, of earlier touches."""
    duration, known = scene.run.duration, min(body.greens.valid_for for body in (problem.striker, *problem.targets))
    off = min(clock_off(left), duration / 2)
    if off > 0:
        dt = 2 * dt if 4 * dt <= scene.run.filter_width else dt
        longest = max(duration, min(duration + off, known))
        record = record_of(scene, problem, dt, like=like, duration=longest, stresses=False)
        left = with_end(left, record.blow, duration, off)
    return without_clock(left)


def with_jumps(left: Budget, blow: ContactRecord) -> Budget:
    """Return the budget with what measures may jump by while the impulse is within its bar, in its main source."""
    if not left.parts or not (0 < (share := left.relative("impulse")) < math.inf):
        return left
    source, jumps = left.dominant("impulse"), dict.fromkeys(left.values, 0.0)
    for name, measure in all_measures().items():
        if name in jumps:
            jumps[name] = measure.jump(blow, share)
        for prefix, landing in judged_landings(blow.landings).items():
            if prefix + name in jumps:
                jumps[prefix + name] = measure.jump_of_landing(blow, landing, share)
    lasting = ContactDuration()
    for number, landing in enumerate(blow.landings):
        if (name := landing_name("seat", number, "duration_s")) in jumps:
            jumps[name] = lasting.jump_of_landing(blow, landing, share)
    return replace(left, parts={**left.parts, source: total(left.parts[source], jumps)})


def _at_once(steps: int) -> int:
    """Return how many runs go at once: one a core, if memory holds the histories of so many ``steps``."""
    room = available_memory() / (STEP_BYTES * steps)
    return max(1, int(min(threads(), room)))


def sources_of(
    scene: Scene, method: RunMethod, seat: Solved, problem: ContactProblem, reed: Solved | None = None
) -> tuple[dict[str, Terms | None], tuple[str, ...]]:
    """Return the variations behind `error_budget` by source, and what is not known of striker and stopper; ``problem``:
    what was run."""
    sources: dict[str, Terms | None] = {
        "mesh": _of_mesh(scene, seat, problem),
        "reduction": _of_reduction(scene, seat, problem),
        "model": _of_model(scene, method, seat, problem),
        "patch": _of_patch(scene, method, seat, problem),
    }
    if chooses_one_port(scene, method):
        sources[LIP] = _of_one_port(scene, method, seat, problem)
    if (measured := scene.seat.measured) is not None and (fit := measured.fit()).draws:
        sources["reduction"], sources[RECORD] = (), _of_record(scene, seat, problem, fit.draws)
    beside = {STRIKER: of_striker(scene, reed, problem), STOPPER: of_stopper(scene, method, problem)}
    for name, parts in beside.items():
        if parts is not None:
            sources[name] = [term for terms in parts.values() for term in terms or ()]
    listed = [(name, part, terms) for name, parts in beside.items() for part, terms in (parts or {}).items()]
    return sources, tuple(f"{name}'s {part}" for name, part, terms in listed if terms is None)


def _step_of_waves(problem: ContactProblem, dt: float, duration: float) -> float | None:
    """Return a step that resolves how waves cross the rods of a problem [s], as far as `MOST_STEPS` allow.

    ``None`` where that of the run does.
    """
    crossed = min((body.greens.rod.transit for body in problem.bodies if body.greens.rod is not None), default=math.inf)
    if dt < crossed:
        return None
    shorter = max(crossed / STEPS_A_TRANSIT, duration / MOST_STEPS)
    return shorter if shorter < dt / 2 else None


def _finer_step(
    scene: Scene, problem: ContactProblem, touches: Touches, look: PlateLook | None = None
) -> Values | None:
    """Return twice what half the step changes in the impact of a striker with waves, marched from shortly before it.

    A spike of the force is as wide as a step: whether the filter holds it together with another one, no longer step
    tells. ``None``: the impact takes so much of the run that all of it may be marched.
    """
    striker, seat, result = problem.striker, problem.target.greens, touches.seat
    if striker.greens.highest_rate == 0:
        return {}
    landings = () if touches.landings is None else touches.landings.seat
    window = window_of(scene, striker, result.force[1:], result.dt, touches.stopper_force, landings)
    if not window.touches:
        return {}
    if window.duration > SHORT * scene.run.duration:
        return None
    bench = Bench(scene, seat, window, None, stopper_of(scene), striker, look)
    own, finer = (bench.measures(dt=dt) for dt in (result.dt, result.dt / 2))
    return times(2.0, changes(own, finer))


def _of_mesh(scene: Scene, seat: Solved, problem: ContactProblem) -> Terms | None:
    if seat.coarser is None:
        return of_body(problem, problem.target, seat.greens.error_estimate.mesh)
    return ((_with_seat(scene, problem, seat.coarser, 1 / (seat.refinement - 1)),),)


def _of_reduction(scene: Scene, seat: Solved, problem: ContactProblem) -> Terms | None:
    greens = seat.greens
    stated = of_body(problem, problem.target, greens.error_estimate.reduction)
    modal = greens.modal
    if stated is None or scene.seat.elastic is None or modal is None or len(modal.omega) == 0:
        return stated
    highest = float(modal.frequencies_hz.max())
    return (*stated, (_with_seat(scene, problem, narrowed(modal, highest / NARROWER)),))


def _of_record(scene: Scene, seat: Solved, problem: ContactProblem, draws: tuple[GreensFunction, ...]) -> Terms | None:
    terms = [tuple(_with_seat(scene, problem, draw, OF_DRAWS) for draw in draws)]
    fit = fit_of(seat.greens)
    if fit.highest is not None and (ringing := _ringing_from(seat.greens, 2 * math.pi * fit.highest)) is not None:
        terms.append((_with_seat(scene, problem, ringing),))
    return (*terms, *(of_body(problem, problem.target, fit.unexplained) or ()))


def _ringing_from(greens: GreensFunction, omega: float) -> GreensFunction | None:
    """Return a fit whose bare compliance rings at ``omega`` [rad/s]; ``None`` without one."""
    if (modal := greens.modal) is not None:
        ringing = ringing_on(impact.Body(greens), omega / float(modal.omega.max())) if np.any(modal.omega) else None
        return None if ringing is None else ringing.greens
    if (poles := greens.pole_sum) is None or len(greens.ports) > 1 or not np.any(poles.compliance):
        return None
    above = (1 - AT_ONCE) * float(poles.compliance[0, 0])
    zeta = float(np.median(-poles.poles.real / np.abs(poles.poles))) if len(poles.poles) else AT_ONCE
    mode = impact.ModalGreens(
        np.array([omega]), np.array([zeta]), np.array([[omega * math.sqrt(above)]]), Residual.none(), greens.ports
    )
    return impact.SumGreens((replace(poles, compliance=AT_ONCE * poles.compliance), mode))


def _of_model(scene: Scene, method: RunMethod, seat: Solved, problem: ContactProblem) -> Terms | None:
    level = of_body(problem, problem.target, seat.level_error)
    if level is None:
        return None
    for kind, body, at in ((scene.reed, problem.striker, scene.contact.at), (scene.seat, problem.target, None)):
        if kind.slender is not None and (shear := kind.slender.shear_error(at)) > SHEAR_SHARE * scene.accuracy.target:
            level = (*level, *(of_body(problem, body, shear) or ()))
    better = with_start(seat.greens) or waves_beside(scene, method)
    if better is None and scene.seat.drawn is not None:
        better = scene.seat.drawn.beyond(method.seat.level)
    if better is not None:
        level = (*level, (_with_seat(scene, problem, better),))
    if method.seat.n_modes is not None:
        modes = (
            _with_seat(scene, problem, scene.seat.body(None, number).greens, weight)
            for number, weight in other_modes(method.seat.n_modes)
        )
        level = (*level, tuple(modes))
    if method.reed.n_modes is None:
        return level
    modes = (
        Variation(problem_of(scene, striker_of(scene, number), problem.target, stopper_in(problem)), weight)
        for number, weight in other_modes(method.reed.n_modes)
    )
    return (*level, tuple(modes))


def _of_patch(scene: Scene, method: RunMethod, seat: Solved, problem: ContactProblem) -> Terms | None:
    division, model = Division.from_greens(seat.greens), seat.in_rings
    rings = division.rings
    if division.arcs > 1:
        along, across = _of_arcs(scene, method, seat, problem), of_rings_across(scene, method, seat, problem)
        return None if along is None or across is None else (*along, *across)
    if rings > 2:
        return ((_with_seat(scene, problem, with_fewer_rings(seat.greens, 1), left_by(rings)),),)
    if model is None:
        return () if seat.plane else None
    divided, same = (_with_seat(scene, problem, g).problem for g in (model, with_fewer_rings(model, rings)))
    return ((Variation(divided, 1 + left_by(Division.from_greens(model).rings), same),),)


def _of_arcs(scene: Scene, method: RunMethod, seat: Solved, problem: ContactProblem) -> Terms | None:
    """Return the variation of the lip's arcs: twice as many on both bodies, or half as many where no more can be."""
    division, finer = Division.from_greens(seat.greens), seat.in_rings
    other, weight = parts_behind(division), OF_TWICE
    if finer is None or Division.from_greens(finer) != other:
        return None
    if other == division:
        other, weight = Division(division.arcs // 2, division.rings), OF_TWICE - 1
    striker = _along(scene, method, other) if scene.reed.thin_plate is not None else problem.striker
    stopper, same = stopper_in(problem), impact.Body(divided_less(finer, division))
    as_before = problem_of(scene, problem.striker, same, stopper)
    varied = problem_of(scene, striker, impact.Body(divided_less(finer, other)), stopper)
    return ((Variation(varied, weight, as_before),),)


def of_rings_across(scene: Scene, method: RunMethod, seat: Solved, problem: ContactProblem) -> Terms | None:
    """Return the variation of the rings across the lip's arcs: more on both bodies, each open by its own height.

    On the seat as a whole over a half-space, which tells the parts from each other; the rings hardly depend on the
    arcs, of which half as many serve. A film knows no rings.
    """
    division = Division.from_greens(seat.greens)
    rings, weight = across_behind(division.rings)
    arcs, most = arcs_behind_rings(scene, division), max(rings, division.rings)
    lip, surrogate = lip_of(scene, arcs, most), scene.seat.surrogate(scene.run.duration, scene.reed.face)
    whole = as_a_whole(seat.greens).modal or surrogate.greens.modal
    if scene.contact.film is not None:
        return ()
    if lip is None or whole is None or surrogate.patch is None:
        return None
    many, finest = on_its_patch(whole, lip, surrogate.patch), Division(arcs, most)
    plate = _greens_along(scene, method, finest) if scene.reed.thin_plate is not None else None

    def struck(division: Division) -> ContactProblem:
        striker = problem.striker if plate is None else striker_of(scene, greens=parts_joined(plate, finest, division))
        return problem_of(scene, striker, impact.Body(divided_less(many, division)), stopper_in(problem))

    return ((Variation(struck(Division(arcs, rings)), weight, struck(Division(arcs, division.rings))),),)


def _of_one_port(scene: Scene, method: RunMethod, seat: Solved, problem: ContactProblem) -> Terms | None:
    """Return `ONE_PORT_BAR` times what as many arcs as a scene has by default, each with rings across, change, against
    one port on the same half-space, and as it was run: one change may be small by accident."""
    lip, surrogate = lip_of(scene, None, across_of(scene)), scene.seat.surrogate(scene.run.duration, scene.reed.face)
    whole = as_a_whole(seat.greens).modal or surrogate.greens.modal
    if lip is None or whole is None or surrogate.patch is None:
        return None
    many, stopper = on_its_patch(whole, lip, surrogate.patch), stopper_in(problem)
    one = divided_less(many, Division(1, scene.contact.rings))
    as_before = problem_of(scene, problem.striker, impact.Body(one), stopper)
    varied = problem_of(scene, _along(scene, method, lip.division), impact.Body(many), stopper)
    return ((Variation(varied, ONE_PORT_BAR, as_before), Variation(varied, ONE_PORT_BAR)),)


def _along(scene: Scene, method: RunMethod, parts: Division) -> impact.Body:
    """Return the plate with the lip in these parts."""
    return striker_of(scene, greens=_greens_along(scene, method, parts))


def _greens_along(scene: Scene, method: RunMethod, parts: Division) -> GreensFunction | None:
    """Return the Green's function of the plate with the lip in these parts."""
    along = method.along(scene, parts.arcs, parts.rings)
    solved = solved_striker(scene, method=along.reed, mesh_error=False)
    return None if solved is None else solved.greens


def _with_seat(scene: Scene, problem: ContactProblem, greens: GreensFunction, weight: float = 1.0) -> Variation:
    return Variation(problem_of(scene, problem.striker, impact.Body(greens), stopper_in(problem)), weight)
