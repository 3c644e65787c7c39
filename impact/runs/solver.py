"""Solution of a contact problem, its predictability horizon, and the error budget of an impact between any two bodies.

The horizon is the growth of a small difference from landing to landing. Each contact converts a difference of position
into one of time and velocity, and each flight that into one of position: after n contacts two runs with almost equal
initial states may have nothing in common. The growth is measured by a twin run, whose gaps are wider by `PERTURBATION`
of the largest opening. Unlike a derivative, it includes contacts that appear or vanish; it starts in one direction, but
the direction of fastest growth soon dominates. The perturbation is far above round-off and far below differences that
matter.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import pairwise
from types import MappingProxyType
from typing import Any, Final

import numpy as np

from impact.after import measures as measured
from impact.after import regime
from impact.after.result import EnergyLedger, ImpactResult, RunRows, ledger
from impact.bodies.body import AtRest, Body, as_body
from impact.greens.base import Array, GreensFunction
from impact.greens.passivity import sampling_advice
from impact.march.grid import blocks
from impact.march.history import Engine
from impact.march.ladder import begin_march, finish_march, march
from impact.march.motion import DiscreteBody, Motion, PortForces
from impact.march.prepared import discretise
from impact.march.problem import ContactError, ContactProblem
from impact.march.rows import MarchRun, Replayed, Rows, find_ports
from impact.march.stepper import ContactStepper
from impact.notices import Advice, Progress, silent
from impact.quantities import brief, percent
from impact.runs.variations import (
    NARROWER,
    Budget,
    Terms,
    Values,
    Variation,
    budget_of,
    changes,
    narrow_body,
    times,
    vary_greens,
    with_body,
)

PERTURBATION: Final = 1e-9
"""Widening of the twin's gaps, relative to the largest opening of the run."""
ROUND_OFF: Final = 1e-12
"""Relative difference of identical runs on other machines or with other orders of summation."""
FELT: Final = 0.1
"""Difference over the largest opening above which a history is unknown, and only statistics remain."""
SMALL: Final = 0.01
"""Difference over the largest opening below which its growth is linear."""


@dataclass(frozen=True)
class Horizon:
    """The growth of a small difference over m landings.

    Attributes:
        growth: (m,) difference in the flight before each landing over that at the start.
        perturbation: initial difference of the twin run, relative to the largest opening.
    """

    growth: Array
    perturbation: float = PERTURBATION

    __repr__ = brief

    @property
    def small(self) -> int:
        """Return the number of landings before which the twin's difference is still below `SMALL`."""
        large = np.flatnonzero(~(self.growth * self.perturbation < SMALL))
        return int(large[0]) if large.size else len(self.growth)

    @property
    def rate(self) -> float:
        """Return the growth from one landing to the next, as geometric mean over small differences; 1 for fewer than
        two of them."""
        if (n := self.small) < 2:
            return 1.0
        return float((self.growth[n - 1] / self.growth[0]) ** (1 / (n - 1)))

    def known(self, difference: float = ROUND_OFF) -> int:
        """Return the number of landings that are known in spite of a relative initial ``difference``; beyond the last
        small difference the mean rate is extrapolated."""
        n = self.small
        beyond = np.arange(1, len(self.growth) - n + 1)
        last = self.growth[n - 1] if n else 1.0
        with np.errstate(over="ignore"):
            growth = np.concatenate([self.growth[:n], last * max(self.rate, 1.0) ** beyond])
        unknown = np.flatnonzero(growth * difference >= FELT)
        return int(unknown[0]) if unknown.size else len(self.growth)


def measure_horizon(
    problem: ContactProblem, *, dt: float, duration: float, perturbation: float = PERTURBATION
) -> Horizon:
    """Run a problem and its twin over ``duration`` [s] with the step ``dt`` [s], and compare them landing by landing.

    A landing here is the start of a contact group (`impact.measures.contact_groups`) of any contact. Raises as
    `impact.solve`, and `ContactError` for bodies that never part.
    """
    first = march(problem, dt, duration).rows
    groups = (measured.merged(first.time[measured.closed_steps(each[1:])]) for each in first.solid.T)
    starts = sorted({round(start / dt) for each in groups for start in each[:, 0]})
    twin, shift = make_twin(problem, first.gap, perturbation)
    other = march(twin, dt, duration, like=first).rows
    return Horizon(growth_of_difference(first, other, starts, shift), perturbation)


def make_twin(problem: ContactProblem, gap: Array, perturbation: float) -> tuple[ContactProblem, float]:
    """Return the problem with wider gaps, and the widening [m]; ``gap``: gaps (n + 1, p) of the run [m].

    Raises:
        ContactError: the bodies never part, so that there is no flight to compare.
    """
    largest = float(np.max(gap))
    if not largest > 0 or not math.isfinite(largest):
        raise ContactError("the bodies never part: a history without a flight has no horizon; let them part")
    shift = perturbation * largest
    return widen_gaps(problem, shift), shift


def widen_gaps(problem: ContactProblem, shift: float) -> ContactProblem:
    """Return a problem whose gaps are all wider by ``shift`` [m]."""
    wider = tuple(replace(contact, gap=contact.gap + shift) for contact in problem.contacts)
    return replace(problem, contacts=wider)


def growth_of_difference(first: Rows, second: Rows, starts: Sequence[int], shift: float) -> Array:
    """Return the largest difference of the gaps of two runs between each landing and the one before, over ``shift``
    [m].

    ``starts``: (m,) fine steps at which the landings of the first run begin. Both must be as they were marched: gaps
    that are replayed from the forces have another round-off.
    """
    parts = (second.find_motions(second.gap, first.ends[part]) - first.gap[part] for part in blocks(len(first.gap)))
    difference = np.concatenate([np.abs(part).max(axis=1) for part in parts])
    edges = np.searchsorted(first.ends, [0, *starts]).tolist()
    growth = [np.max(difference[begin : end + 1]) / shift for begin, end in pairwise(edges)]
    return np.array(growth, dtype=np.float64)


LARGE: Final = 8e6  # values of a history, of 64 MB, above which displacements of contacts are replayed, not kept
RESOLUTION_LIMIT = 0.5  # largest w_max h without advice: above, numerical damping affects the highest mode


def solve(
    problem: ContactProblem,
    *,
    dt: float,
    duration: float,
    rule: str = "auto",
    engine: Engine = "auto",
    block: int = 0,
    bodies: tuple[DiscreteBody, ...] = (),
    equal_steps: bool = False,
    progress: Progress = silent,
) -> ImpactResult:
    """March the contact problem over ``duration`` [s] with the step ``dt`` [s].

    ``rule`` is the step rule of `march.laws`: "auto" takes "blended" for laws with a potential, of second order while
    the contact is resolved, else "passive", of first order where the force jumps or the bodies part. Both never gain
    energy; "conserving" loses none in an elastic contact, and rings where the step does not resolve it.

    ``engine`` evaluates the convolution with past forces: "poles" (exact recursion of modal bodies), "fft" (step
    weights of all bodies, in blocks), "direct" (the same weights summed term by term), or "auto", the cheapest mix by a
    measured cost model; ``result.engine`` names it. ``block`` is the number of latest steps that are summed directly
    beside the FFT, 0: chosen. ``bodies``: the bodies of the problem, already discretised, as for `impact.prepare`.

    A long run of bodies that are sums of poles takes longer steps where its motion is smooth (`impact.march.ladder`),
    but not with ``equal_steps``, for histories that are to be compared to the last digits; ``result.rows`` has them.

    Raises:
        ContactError: a step or duration that is not positive; two bodies without any immediate response
            (no residual flexibility and no g(0+)) under a rigid law, whose force would grow like 1/dt; a rule that
            the law cannot follow; an engine that a body cannot be run by; a preload on bodies that nothing holds.
    """
    discretised = discretise(problem, dt, duration, rule, engine, block, bodies)
    return collect(finish_march(begin_march(discretised, equal_steps=equal_steps), progress))


def collect(march: ContactStepper | MarchRun) -> ImpactResult:
    """Return the result of the steps marched so far; raises `ContactError` if a history is not finite."""
    run = march.record_run() if isinstance(march, ContactStepper) else march
    run = replace(run, rows=run.rows.drop_gaps())
    del march  # its gaps are made again from the forces, and a history of many contacts is large
    rows, bodies, problem = run.rows, run.bodies, run.problem
    whole, time, force = rows.force, rows.time, rows.force[1:]
    carried, gap, at_start = problem.find_base_gaps(time), np.zeros_like(whole), list[Array]()
    gap += np.array([c.gap for c in problem.contacts])
    gap += carried
    single = len(run.rest) == 1
    displaced = np.zeros((2, *(gap.shape if single or gap.size <= LARGE else (0, 0))))  # of striker and targets

    def add(body: DiscreteBody, whose: Array) -> Motion:
        """Add the motion of a body to the gaps, and to ``whose`` displacements are kept; return its energies."""
        directions, (contacts, ports) = problem.directions(body.body), find_ports(problem, body.body)
        base = body.body.find_base_displacement(time)[:, None]

        def write(part: slice, moved: Array) -> None:
            gap[part] += moved.T @ directions
            if whose.size:
                whose[part, contacts] = moved[ports].T + base[part]
            if not part.start:
                at_start.append(moved[:, 0])

        return body.motion(PortForces(rows, force.T, directions), write)

    energies = tuple(add(body, displaced[min(number, 1)]) for number, body in enumerate(bodies))
    if np.any(run.rest):  # or the deflection under the preload's contact forces alone, which loads may cancel
        at_start += [body.body.greens.static_compliance() @ body.rest for body in bodies]
    deflection = max(float(np.abs(moved).max()) for moved in at_start)
    film = rows.film if rows.film.size else np.broadcast_to(0.0, whole.shape)
    energy = ledger(problem, energies, force, gap, carried, rows.film[1:])
    solid = rows.solid[1:]
    first = problem.contacts[0]
    each = np.eye(len(run.rest))
    of_striker, of_targets = displaced if displaced.size else (Replayed(run, each, gap), Replayed(run, each, gap[:0]))
    for history in (whole, gap, displaced, energy.stored, energy.dissipated):
        if np.any(bad := ~np.isfinite(history)):
            when = float(time[np.flatnonzero(bad.reshape(len(history), -1).any(axis=1))[0]])
            raise ContactError(
                f"forces, motions or energies leave the range of numbers at {when:.3g} s: some mass, stiffness, "
                "shape or velocity is beyond all measure; check their units"
            )
    return ImpactResult(
        rows=RunRows(
            dt=run.dt,
            ends=rows.ends,
            force=whole[:, 0] if single else whole,
            gap=gap[:, 0] if single else gap,
            striker_displacement=of_striker[:, 0] if single else of_striker,
            target_displacement=of_targets[:, 0] if single else of_targets,
            energy=energy,
            film=film[:, 0] if single else film,
        ),
        striker_mass=problem.striker.greens.mass(first.striker_port),
        target_mass=first.target.greens.mass(first.port),
        striker_velocity=_speed_at_start(problem.striker, first.striker_port, run.dt),
        target_velocity=_speed_at_start(first.target, first.port, run.dt),
        engine=run.engine,
        advice=(
            *regime.unsolved_advice(run.unsolved, len(force)),
            *_advice(run, energy),
            *regime.overlap_advice(problem, solid, gap, run.dt),
            *regime.digits_advice(deflection, force, gap, run.own),
            *regime.gain_advice(problem, solid, gap),
            *regime.table_advice(problem, gap),
            *regime.contact_advice(solid, rows),
            *regime.direction_advice(problem, whole),
        ),
    )


def _speed_at_start(body: Body, port: str | int, dt: float) -> float:
    """Return the initial velocity of a port [m/s] plus the mean velocity of the body's base over the first step."""
    start, end = body.find_base_displacement(np.array([0.0, dt]))
    return body.velocity_of(port) + float(end - start) / dt


def _advice(s: MarchRun, energy: EnergyLedger) -> Iterator[Advice]:
    for number, body in enumerate(s.bodies):
        g = body.body.greens
        name = "striker" if number == 0 else "target"
        yield from sampling_advice(g, s.dt, s.steps, body=name)
        highest = 0.0 if g.modal is None else g.highest_rate
        if highest * s.dt > RESOLUTION_LIMIT:
            lost = float(energy.contact_loss[-1] / max(energy.input[-1], np.finfo(float).tiny))
            yield Advice(
                f"highest {name} frequency times step",
                highest * s.dt,
                RESOLUTION_LIMIT,
                f"the step damps the highest modes; contact and step together took {percent(lost)} of the energy",
                f"use dt <= {RESOLUTION_LIMIT / highest:.2g} s, or fewer modes",
            )


Measure = Callable[[ImpactResult], float]
RATIOS: Final = (NARROWER, 2.5)  # bandwidth ratios of the narrower models; two, as one change may vanish by chance
NOTHING: Final[Mapping[str, Any]] = MappingProxyType({})


@dataclass(frozen=True)
class Coarser:
    """A body of the impact, modelled more coarsely: a coarser mesh, fewer modes, a narrower band.

    Attributes:
        body: the coarser body, or its Green's function, which is given the velocity, state and loads of the run's body.
        ratio: ratio > 1 of element sizes, mode numbers or bandwidths; the remaining error is change/(ratio - 1).
    """

    body: Body | GreensFunction
    ratio: float

    __repr__ = brief

    def __post_init__(self) -> None:
        if not (self.ratio > 1 and math.isfinite(self.ratio)):
            raise ContactError(
                f"Coarser.ratio = {self.ratio:g} must be above 1: by how much the coarser model is coarser"
            )


def error_budget(
    problem: ContactProblem,
    result: ImpactResult | None = None,
    *,
    dt: float = 0.0,
    duration: float = 0.0,
    filter_width: float = 0.0,
    rule: str = "auto",
    measures: Mapping[str, Measure] = NOTHING,
    coarser: Mapping[str, Coarser] = NOTHING,
    others: Mapping[str, ContactProblem] = NOTHING,
) -> Budget:
    """Return the error budget of the measures of an impact: value +- bar, and the error from each source.

    The impact is marched again with one source made coarser at a time; the change of each measure is the error from
    that source, and the bar is 1.7 times the root of the sum of their squares (`impact.Budget`). This includes
    chattering contacts, for which a bound on the error of g does not bound the measures. The sources:

    - "time_step": two and four times the step, and half of it (`impact.runs.variations.budget_of`); of a duration
      at least the step, as these measures count whole steps;
    - "striker reduction", "target reduction": g larger by its ``error_estimate.reduction``, and the highest modes of a
      `ModalGreens`, those above 1/1.6 and 1/2.5 of the highest frequency, moved into its residual (a filter shorter
      than the period of the highest mode is not resolved by the model). A modal body without truncated modes (a lumped
      system) states this by ``error=ErrorEstimate(0, 0)``;
    - "striker mesh", "target mesh": g larger by its ``error_estimate.mesh``;
    - the names in ``others``, the same impact with another model, whose whole change counts.

    A source without an estimate is named in ``unknown`` and counts in no bar. Several targets are "target 0",
    "target 1", ...; with several contacts each measure is given for each contact, "impulse 0", "impulse 1", ...

    Args:
        result: result of `impact.solve` for this problem and step ``rule``.
        dt, duration: step and duration [s] of the run, needed if there is no result.
        filter_width: filter width of the measure "filtered_peak" [s]; 0 omits it; at least twice ``dt``.
        measures: by name, as functions of a result; by default "impulse" [N s], "filtered_peak" [N],
            "contact_duration" (of the first group) [s] and "target_displacement" (largest) [m].
        coarser: coarser models by the name of a mesh or reduction source, used instead of the stated error.

    Raises:
        ContactError: no result and no step or duration; an unknown source in ``coarser``; as `impact.solve`.
        MeasureError: a filter below two steps.
    """
    if result is None:
        if not (dt and duration):
            raise ContactError("error_budget needs the result of a run, or dt and duration to run it")
        result = solve(problem, dt=dt, duration=duration, rule=rule)
    step, length = result.dt, float(result.time[-1])
    if filter_width:
        measured.filtered_peak_force(result, filter_width, contact=0)  # refuses a filter that the step does not resolve
    quantities = measures or _standard(problem, filter_width)

    def values_of(one: ImpactResult) -> Values:
        return {name: float(measure(one)) for name, measure in quantities.items()}

    def run(varied: ContactProblem, varied_step: float) -> Values:
        return values_of(solve(varied, dt=varied_step, duration=length, rule=rule))

    sources = dict(_sources(problem, coarser))
    sources |= {name: ((Variation(other),),) for name, other in others.items()}
    values = values_of(result)
    finer = times(2.0, changes(values, run(problem, step / 2)))
    finer = {name: max(each, step) if "duration" in name and values[name] else each for name, each in finer.items()}
    return budget_of(run, problem, values, step, sources, filter_width=filter_width or math.inf, finer=[finer])


def _standard(problem: ContactProblem, filter_width: float) -> Mapping[str, Measure]:
    """Return the default measures, for each contact of the problem."""
    count = len(problem.contacts)
    measures: dict[str, Measure] = {}
    for c in range(count):
        end = "" if count == 1 else f" {c}"
        measures[f"impulse{end}"] = _at(c, measured.impulse)
        if filter_width:
            measures[f"filtered_peak{end}"] = _at(c, partial(measured.filtered_peak_force, width=filter_width))
        measures[f"contact_duration{end}"] = _at(c, _first_duration)
        measures[f"target_displacement{end}"] = partial(_largest_displacement, contact=c)
    return measures


def _at(contact: int, measure: Measure) -> Measure:
    return lambda result: measure(measured.select_contact(result, contact))


def _largest_displacement(result: ImpactResult, contact: int) -> float:
    return float(np.max(np.abs(result.target_displacement.reshape(len(result.time), -1)[:, contact])))


def _first_duration(one: ImpactResult) -> float:
    groups = measured.contact_groups(one)
    return float(groups[0, 1] - groups[0, 0]) if len(groups) else 0.0


def _sources(problem: ContactProblem, coarser: Mapping[str, Coarser]) -> Iterator[tuple[str, Terms]]:
    """Yield name and variations of the mesh and the reduction of each body."""
    many = len(problem.targets) > 1
    names = ["striker", *(f"target {i}" if many else "target" for i in range(len(problem.targets)))]
    known = [f"{name} {part}" for name in names for part in ("mesh", "reduction")]
    for name in coarser:
        if name not in known:
            raise ContactError(f"coarser: {name!r} is no source of this impact; choose from {', '.join(known)}")
    for name, body in zip(names, problem.bodies, strict=True):
        error = body.greens.error_estimate
        for part, stated in (("mesh", error.mesh), ("reduction", error.reduction)):
            companion = coarser.get(f"{name} {part}")
            if companion is not None:
                other = as_body(companion.body)
                if isinstance(other, AtRest):
                    other = Body(other.greens, body.velocity, body.state, body.loads)
                yield f"{name} {part}", ((Variation(with_body(problem, body, other), 1 / (companion.ratio - 1)),),)
            elif part == "mesh":
                yield f"{name} mesh", vary_greens(problem, body, stated)
            else:
                yield f"{name} reduction", _reduced(problem, body, stated)


def _reduced(problem: ContactProblem, body: Body, stated: float | None) -> Terms:
    """Return the variations by the stated error of g and, if modes can be removed, without the highest modes."""
    terms = vary_greens(problem, body, stated)
    fewer = [] if stated == 0.0 else [(narrow_body(body, ratio), 1 / (ratio - 1)) for ratio in RATIOS]
    variations = tuple(Variation(with_body(problem, body, less), weight) for less, weight in fewer if less is not None)
    return (*filter(None, terms), variations) if variations else terms
