"""Errors that a computed striker and a stopper leave in the measures of a run, and those by the end of the record.

Each bounce is delayed by what the step, the mesh and all else take of the one before. A record that ends in a touch, or
shortly before or after one, has more or less of it than the truth, and coarser runs, whose touch lies beyond the end
altogether, cannot tell.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from impact.after.histories import largest_average
from impact.after.landings import Landing
from impact.after.measures import closed_steps
from impact.bodies.body import Body
from impact.greens.base import Array, GreensFunction
from impact.march.problem import ContactProblem
from impact.runs.variations import (
    NARROWER,
    SAFETY,
    Budget,
    Terms,
    Values,
    Variation,
    changes,
    larger,
    narrower,
    of_g,
    ringing_on,
    total,
    with_body,
)
from seatfem.structures.estimates.surrogate import Patch
from seatfem.structures.method import Method, bed
from seatfem.structures.rings import OF_TWICE, Division, divided_less, face_compliance, left_by, parts_behind
from seatfem.study.impacts.contact import problem_of, seat_beside, solved_stopper, solved_striker, striker_of
from seatfem.study.impacts.touches import stopper_in
from seatfem.study.method import RunMethod
from seatfem.study.safety import BEYOND, FEW, FEWER, FIRST_WAVE, HALF, MANY, OF_MODES, UNEVEN
from seatfem.study.scene import Scene
from seatfem.study.scene.lips import behind_the_reed
from seatfem.study.scene.measures import ContactRecord, values_of

if TYPE_CHECKING:
    from seatfem.structures.method import Solved


Parts = Mapping[str, Terms | None]
"""By name, what is not known to be exact in a body; ``None``: it is unknown."""


def of_striker(scene: Scene, reed: Solved | None, problem: ContactProblem) -> Parts | None:
    """Return the errors that a computed striker leaves; ``None`` for others."""
    if reed is None:
        return None
    modes = scene.reed.thin_plate is not None
    return _of_solved(problem, problem.striker, reed, lambda greens: striker_of(scene, greens=greens), modes=modes)


def of_stopper(scene: Scene, method: RunMethod, problem: ContactProblem) -> Parts | None:
    """Return the errors of a computed stopper, of a beam's modes, and of its arcs; ``None`` for what is exact."""
    body = stopper_in(problem)
    if scene.stopper is None or body is None:
        return None
    if (solved := solved_stopper(scene)) is not None:
        modes = scene.stopper.body.elastic is not None
        known = _of_solved(problem, body, solved, lambda greens: replace(body, greens=greens), modes=modes)
        return {**known, "patch": _of_parts(scene, method, problem, body, solved)}
    if scene.stopper.parts != Division():
        return {"patch": _of_parts(scene, method, problem, body, None)}
    if (number := scene.stopper.body.stated().n_modes) is None:
        return None
    less = ((scene.stopper.body.body(None, other).greens, weight) for other, weight in other_modes(number))
    return {"modes": (tuple(Variation(with_body(problem, body, replace(body, greens=g)), w) for g, w in less),)}


def _of_parts(
    scene: Scene, method: RunMethod, problem: ContactProblem, body: Body, solved: Solved | None
) -> Terms | None:
    """Return the variation of the parts in which a stopper is met: `_beside` names those that they are compared with;
    ``None`` where the body is not known in these."""
    assert scene.stopper is not None
    division = scene.stopper.parts
    other, weight = _beside(division)
    if solved is None:  # springs side by side, or a body that moves as a whole
        springs = len(body.greens.ports) > 1
        own, other_greens = body.greens, bed(other, 1 / face_compliance(body.greens)) if springs else body.greens
    else:
        models = [each for each in (solved.in_rings, solved.greens) if each is not None]
        model = next((each for each in models if _holds(each, division) and _holds(each, other)), None)
        if model is None:
            return () if solved.plane else None
        own, other_greens = divided_less(model, division), divided_less(model, other)
    stopper = scene.stopper.model_copy(update={"arcs": other.arcs, "rings": other.rings})
    changed, striker = scene.model_copy(update={"stopper": stopper}), problem.striker
    if scene.reed.thin_plate is not None and (lip := behind_the_reed(scene)) is not None:
        how = replace(method.reed, behind=replace(lip, arcs=other.arcs, rings=other.rings))  # type: ignore[type-var]
        reed = solved_striker(changed, method=how, mesh_error=False)
        striker = striker_of(changed, greens=None if reed is None else reed.greens)
    same = problem if own is body.greens else with_body(problem, body, replace(body, greens=own))
    varied = problem_of(changed, striker, problem.target, replace(body, greens=other_greens))
    return ((Variation(varied, weight, same),),)


def _beside(division: Division) -> tuple[Division, float]:
    """Return the parts that others are compared with, and the share of what they change that is left: twice as many
    arcs, half as many where no more can be; several rings in place of one or two, one in place of more."""
    other = parts_behind(division)
    if division.arcs == 1:
        return (Division(), left_by(division.rings)) if division.rings > 2 else (other, 1 + left_by(other.rings))
    return (Division(division.arcs // 2, division.rings), OF_TWICE - 1) if other == division else (other, OF_TWICE)


def _holds(greens: GreensFunction, division: Division) -> bool:
    """Return whether the parts of a patch make those of a coarser division."""
    known = Division.from_greens(greens)
    return known.arcs % division.arcs == 0 and known.rings % division.rings == 0


def _of_solved(
    problem: ContactProblem, body: Body, solved: Solved, with_greens: Callable[[GreensFunction], Body], *, modes: bool
) -> Parts:
    """Return the errors of mesh, reduction and level; ``modes``: the highest are left out, too."""
    stated = solved.greens.error_estimate
    mesh = of_g(problem, body, stated.mesh)
    if solved.coarser is not None:
        coarser = with_body(problem, body, with_greens(solved.coarser))
        mesh = ((Variation(coarser, 1 / (solved.refinement - 1)),),)
    reduction = of_g(problem, body, stated.reduction)
    if reduction is not None and modes:
        others = (Variation(with_body(problem, body, each), share) for each, share in with_other_modes(body))
        reduction = (*reduction, tuple(others))
    return {"mesh": mesh, "reduction": reduction, "level": of_g(problem, body, solved.level_error)}


def with_other_modes(body: Body) -> Iterator[tuple[Body, float]]:
    """Yield a plate with other modes than its own, and the share of what each changes that is left in a run.

    First without its highest modes, as `OF_MODES` says. These tell how the next ones go on if the modes that the
    contact feels lie evenly. A ring all around feels few, those that are alike there: where it yields more beyond the
    last mode than by the highest ones, over `UNEVEN`, all that lies beyond may be one mode, at each of `BEYOND`; where
    none can be left out, this alone tells, and counts twice.
    """
    modal = body.greens.modal
    beyond, with_highest = (0.0 if modal is None else float(np.trace(modal.residual.static()))), 0.0
    for ratio, share in OF_MODES:
        if (fewer := narrower(body, ratio)) is not None and fewer.greens.modal is not None:
            with_highest = float(np.trace(fewer.greens.modal.residual.static()))
            yield fewer, share
    if beyond > UNEVEN * (with_highest - beyond):
        for ratio in BEYOND:
            if (ringing := ringing_on(body, ratio)) is not None:
                yield ringing, 1.0 if with_highest else 2.0


def other_modes(n_modes: int) -> tuple[tuple[int, float], ...]:
    """Return the numbers of reed modes to compare ``n_modes`` with, and how much of each change is left in it."""
    less = ((max(1, round(n_modes / FEWER)), 1.0), (max(1, round(n_modes / HALF)), 1 / 2))
    more = ((MANY, 1.0),) if n_modes < FEW else ()
    return tuple((number, weight) for number, weight in less + more if number != n_modes)


CLOCK: Final = "last touch"
"""Stands among the measures of the runs behind a budget: when they are half through the last whole touch [s]."""

FAINT: Final = 0.2  # of the largest impulse of a touch


@dataclass(frozen=True)
class LastTouch:
    """The last touch of a record that the end does not cut, or the one that it does where there is no other.

    One that bears less than `FAINT` of the hardest is none: what bodies give each other before it may differ by more.

    Attributes:
        impulse: up to its middle [N s]; 0 without any touch.
    """

    impulse: float

    @staticmethod
    def from_record(blow: ContactRecord) -> LastTouch:
        """Return the last touch of a run."""
        force, running = _touching(blow), _impulse(blow)
        touches = closed_steps(force)
        borne = np.diff(running[touches.astype(np.int64)])[:, 0] if len(touches) else np.zeros(0)
        touches = touches[borne > FAINT * borne.max(initial=0.0)]
        whole = touches[touches[:, 1] < len(force)]
        ends = (whole if len(whole) else touches)[-1:]
        return LastTouch(float(running[ends].mean()) if len(ends) else 0.0)

    def time(self, blow: ContactRecord) -> float:
        """Return when another run has had as much impulse [s]; its end, where it never has."""
        running = _impulse(blow)
        after = int(np.searchsorted(running, self.impulse))
        if after == 0 or after == len(running):
            return 0.0 if after == 0 else blow.dt * (len(running) - 1)
        before, then = running[after - 1 : after + 1]
        return blow.dt * (after - 1 + float((self.impulse - before) / (then - before)))


def clock_off(left: Budget) -> float:
    """Return by how much the runs behind a budget disagree when the last touch is, as a bar of it [s]."""
    return SAFETY * sum(part.get(CLOCK, 0.0) for part in left.parts.values())


def with_end(left: Budget, beyond: ContactRecord, duration: float, off: float) -> Budget:
    """Return the budget with what changes if the record ends ``off`` [s] earlier or later than ``duration`` [s].

    It counts to the source that moves the last touch most. ``beyond``: the same run, longer by ``off``.
    """
    if not any(CLOCK in part for part in left.parts.values()):
        return left
    as_it_ends = _until(beyond, duration)
    values, like = values_of(as_it_ends), as_it_ends.landings
    others = (values_of(_until(beyond, duration + by), like) for by in (-off, off))
    cut: Values = dict.fromkeys(left.values, 0.0)
    for other in others:
        cut = larger(cut, {**cut, **changes(values, other)})
    source = max(left.parts, key=lambda name: left.parts[name].get(CLOCK, 0.0))
    return replace(left, parts={**left.parts, source: total(left.parts[source], {**cut, CLOCK: 0.0})})


def without_clock(left: Budget) -> Budget:
    """Return the budget of the measures alone."""
    parts = {source: _without_clock(part) for source, part in left.parts.items()}
    return replace(left, values=_without_clock(left.values), parts=parts)


def _without_clock(values: Values) -> Mapping[str, float]:
    return {name: value for name, value in values.items() if name != CLOCK}


def _touching(blow: ContactRecord) -> Array:
    """Return the force (n,) of the bodies themselves [N]."""
    return (blow.force if blow.film is None else blow.force - blow.film)[1:]


def _impulse(blow: ContactRecord) -> Array:
    """Return the impulse (n + 1,) of the bodies' own force up to every step [N s]."""
    return np.concatenate([[0.0], blow.dt * np.cumsum(_touching(blow))])


def _until(blow: ContactRecord, time: float) -> ContactRecord:
    """Return the run up to a time [s], without stresses."""
    steps = min(len(blow.force) - 1, max(1, round(time / blow.dt)))
    kept = slice(steps + 1)
    line, film, moved = blow.line, blow.film, blow.displacement
    if line is not None:
        of_film = None if line.film is None else line.film[kept]
        line = replace(line, force=line.force[kept], film=of_film)
    film, moved = (None if values is None else values[kept] for values in (film, moved))
    landings = tuple(_landing_until(blow, landing, time) for landing in blow.landings if landing.start < time)
    force = blow.force[kept]
    return replace(blow, force=force, displacement=moved, film=film, line=line, stress=None, landings=landings)


def _landing_until(blow: ContactRecord, landing: Landing, time: float) -> Landing:
    """Return a landing as far as it is over at a time [s]."""
    if landing.end <= time:
        return landing
    first, last, end = (round(at / blow.dt) for at in (landing.start, time, landing.end))
    later = blow.dt * float(np.sum(blow.force[last + 1 : end + 1]))
    peak = landing.filtered_peak
    if landing.peak_time > time:
        peak = largest_average(blow.force[first + 1 : last + 1], blow.dt, blow.filter_width)
    return replace(
        landing, end=time, impulse=landing.impulse - later, filtered_peak=peak, pressed_on=False, cut_off=True
    )


CHEAP: Final = "harmonics"  # modes of half sections, of a few hundred unknowns each


def lowest_band(patch: Patch) -> float:
    """Return the narrowest band that describes a body [Hz]: its first resonance, a plate's in bending, and more."""
    bends = patch.bending_frequency / (2 * math.pi)
    return NARROWER * (bends or patch.c_p / (FIRST_WAVE * patch.depth))


def tells_waves(scene: Scene, method: RunMethod) -> bool:
    """Return whether a run on the statics of a seat measures what its waves change: of a body of revolution in arcs."""
    body, seat = scene.seat.drawn, method.seat
    return seat.static and seat.in_arcs and body is not None and body.elements_of(seat) == CHEAP


def method_beside(scene: Scene, method: RunMethod) -> Method | None:
    """Return how the seat with its waves is computed: on the mesh of its statics, in no wider a band than its first
    resonances need; ``None`` where it has them already, or they are expensive."""
    body, seat = scene.seat.drawn, method.seat
    if not tells_waves(scene, method) or body is None or (patch := body.patch()) is None:
        return None
    assert seat.bandwidth is not None
    spec, band = body.mesh_spec(seat), min(seat.bandwidth, lowest_band(patch))
    level = body.level(0.0).level
    return replace(seat, level=level, bandwidth=band, size=spec.size, contact_size=spec.patch_size)


def waves_beside(scene: Scene, method: RunMethod) -> GreensFunction | None:
    """Return the seat with its waves, as `method_beside` says.

    Statics end after the first velocity and lose what waves bring back, in one scene of seed 403 4.3 % of the impulse.
    A surrogate knows neither the seat's section nor its harmonics.
    """
    how = method_beside(scene, method)
    return None if how is None else seat_beside(scene, how).greens
