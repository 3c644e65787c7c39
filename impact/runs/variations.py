"""The error budget of an impact, from runs with one quantity varied: how far each measure is from its exact value.

Every source of error is made coarser by itself, and the run repeated: the change of a *measure* estimates the source's
error in it. With a refinement ratio r and an order of convergence q the error of the run is the change over r^q - 1;
q = 1 is taken for the time step, and for a mesh whose order is not known, which is on the safe side. Sources are
independent, so that their errors are combined as the root of the sum of their squares. Source:
goal-oriented estimation by coarsening; Becker and Rannacher, Acta Numerica 10 (2001).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import reduce
from typing import Final

import numpy as np
from threadpoolctl import threadpool_limits

from impact.bodies.body import Body
from impact.greens.modal import ModalGreens, Residual
from impact.march.problem import ContactProblem
from impact.quantities import brief

SAFETY: Final = 1.7
"""Safety factor on the combined errors of the sources: each of them is estimated, not bounded. With 1.5 more than
3 % of the measures asked for of drawn scenes were outside their bars."""

Values = Mapping[str, float]
"""Measures by name [SI]."""


@dataclass(frozen=True)
class Budget:
    """The errors of each measure by source.

    Attributes:
        values: the measures [SI].
        parts: error of each measure by source [SI]; a missing source is unknown, an exact one has zeros.
        sources: names of all sources of error, in the order in which they are reported.
        by_key: error of each measure by the key whose neighbours were compared [SI]; those of a source are combined.
    """

    values: Values
    parts: Mapping[str, Values] = field(default_factory=dict)
    sources: tuple[str, ...] = ()
    by_key: Mapping[str, Values] = field(default_factory=dict)

    __repr__ = brief

    def bar(self, measure: str) -> float:
        """Return the half width of the error bar [SI]: `SAFETY` times the combined errors of the sources."""
        return SAFETY * math.hypot(*(part[measure] for part in self.parts.values()))

    def relative(self, measure: str) -> float:
        """Return the bar over the value; infinite for a value of zero with an error."""
        bar, value = self.bar(measure), abs(self.values[measure])
        return bar / value if value > 0 else (np.inf if bar > 0 else 0.0)

    def dominant(self, measure: str) -> str:
        """Return the source that contributes most."""
        return max(self.parts, key=lambda source: self.parts[source][measure], default="nothing known")

    @property
    def unknown(self) -> tuple[str, ...]:
        """Return the sources whose errors are unknown."""
        return tuple(source for source in self.sources if source not in self.parts)

    def __str__(self) -> str:
        rows = [(name, f"{self.values[name]:.5g} +- {self.bar(name):.2g}", self.dominant(name)) for name in self.values]
        width, longest = (max((len(row[i]) for row in rows), default=0) for i in (0, 1))
        lines = [f"{name:{width}}  {value:{longest}}  most of it: {source}" for name, value, source in rows]
        return "\n".join([*lines, f"not known, in no bar: {', '.join(self.unknown) or 'nothing'}"])


def changes(one: Values, other: Values) -> Values:
    """Return |one - other|, measure by measure; infinite where either has no such value, or no finite one."""
    apart = {name: abs(value - other.get(name, math.inf)) for name, value in one.items()}
    return {name: math.inf if math.isnan(value) else value for name, value in apart.items()}


def larger(one: Values, other: Values) -> Values:
    """Return the larger of the two, measure by measure; infinite where the other has no such value."""
    return {name: max(value, other.get(name, math.inf)) for name, value in one.items()}


def times(factor: float, values: Values) -> Values:
    """Return ``factor`` times each value."""
    return {name: factor * value for name, value in values.items()}


def total(one: Values, other: Values) -> Values:
    """Return one + other, measure by measure: of an error, and of one that follows from it."""
    return {name: one[name] + other[name] for name in one}


def combined(one: Values, other: Values) -> Values:
    """Return the root of the sum of the squares of two independent errors, measure by measure."""
    return {name: math.hypot(one[name], other[name]) for name in one}


FINE: Final = 16  # steps in the filter's width, or a wave's travel, that resolve it: longer ones tell their error
NARROWER: Final = 1.6  # ratio of bandwidths whose runs estimate the error by mode truncation
STATIC_SHARE: Final = (
    0.01  # fraction of the residual compliance that stays without inertia; the rest is given a frequency
)
ROUND_OFF: Final = 1e-12  # compliance that counts as round-off, over the largest

Run = Callable[[ContactProblem, float], Values]
"""Function that returns the measures of a problem at a time step [s]."""


@dataclass(frozen=True)
class Variation:
    """A problem with one part made coarser, and the ``weight`` from its change to the error of the run.

    ``against``: problem to compare with, in place of the one that was run.
    """

    problem: ContactProblem
    weight: float = 1.0
    against: ContactProblem | None = None


Terms = Sequence[Sequence[Variation]]
"""The variations of one source: the errors of terms are combined; within a term the largest change counts. The error
is unknown where a term has no variations."""

UNKNOWN: Final[Terms] = ((),)
"""The terms of a source whose error is unknown."""


def budget_of(
    run: Run,
    problem: ContactProblem,
    values: Values,
    dt: float,
    sources: Mapping[str, Terms],
    *,
    filter_width: float = math.inf,
    finer: Sequence[Values] = (),
    threads: int = 1,
) -> Budget:
    """Return the errors by the time step and by the ``sources`` in ``values``, the measures of ``problem`` at the step
    ``dt`` [s].

    The error by the step is the largest that longer and shorter steps tell, as one may be small by accident, and that
    of ``finer`` ones. The sources are compared at the doubled step, if it resolves the filter of ``filter_width`` [s],
    infinite without one; a source with a term of no variations is unknown. ``run`` returns the same measures of a
    problem; a missing measure counts as an infinite error. ``threads``: parallel runs; the compiled time loop holds no
    interpreter lock.
    """
    compared = _compared_steps(dt, filter_width)
    step = 2 * dt if 2 * dt in compared else dt
    variations = [one for terms in sources.values() for term in terms for one in term]
    runs = {(id(problem), each): (problem, each) for each in (step, *compared)}
    runs |= {(id(p), step): (p, step) for v in variations for p in (v.against, v.problem) if p is not None}
    # BLAS with one thread for each run: more would compete for the cores, and the last digits would depend on them
    with threadpool_limits(limits=1, user_api="blas"), ThreadPoolExecutor(threads) as pool:
        each_run = (pool.map if threads > 1 else map)(lambda one: run(*one), runs.values())
        run_values = dict(zip(runs, each_run, strict=True))
    results = {key: {name: one.get(name, math.inf) for name in values} for key, one in run_values.items()}
    base = results[id(problem), step]

    def change(variation: Variation) -> Values:
        known = base if variation.against is None else results[id(variation.against), step]
        return times(variation.weight, changes(known, results[id(variation.problem), step]))

    by_steps = (times(factor, changes(values, results[id(problem), each])) for each, factor in compared.items())
    of_step = reduce(larger, by_steps)
    of_step = {name: max([value, *(each.get(name, 0.0) for each in finer)]) for name, value in of_step.items()}
    parts: dict[str, Values] = {}
    for source, terms in sources.items():
        if not all(terms):
            continue
        parts[source] = nothing = dict.fromkeys(base, 0.0)
        for term in terms:
            parts[source] = combined(parts[source], reduce(larger, map(change, term), nothing))
    return Budget(values, {**parts, "time_step": of_step}, (*sources, "time_step"))


def _compared_steps(dt: float, filter_width: float) -> Mapping[float, float]:
    """Return the steps with which ``dt`` is compared, and the factor from the change by each to the error of the run.

    The integration is of first order where the force jumps, so a step twice as long changes as much as the error, and
    one four times as long three times as much. If the latter hardly resolves the filter, it is replaced by half the
    step, which changes half the error.
    """
    compared = {4 * dt: 1 / 3} if FINE * dt <= filter_width else {dt / 2: 2.0}
    return {**compared, 2 * dt: 1.0} if 4 * dt <= filter_width else compared


def with_body(problem: ContactProblem, old: Body, new: Body) -> ContactProblem:
    """Return the problem with one of its bodies in place of another."""
    contacts = tuple(replace(c, target=new) if c.target is old else c for c in problem.contacts)
    return replace(problem, striker=new if problem.striker is old else problem.striker, contacts=contacts)


def vary_greens(problem: ContactProblem, body: Body, error: float | None) -> Terms:
    """Return the variation with a body's g larger by its relative error, which may be unknown."""
    if error is None:
        return UNKNOWN
    return ((Variation(with_body(problem, body, enlarge_greens(body, 1 + error))),),) if error else ()


def enlarge_greens(body: Body, factor: float) -> Body:
    """Return the body with g multiplied by ``factor``; a modal body keeps its mass and its motion without contact."""
    g = body.greens.modal
    if g is None:
        return replace(body, greens=body.greens.scaled(factor))
    root, rest = np.where(g.omega > 0, np.sqrt(factor), 1.0), g.residual
    residual = Residual(np.sqrt(factor) * rest.shapes, rest.rates, factor * rest.compliance)
    return body.transform_modes(
        replace(g, shapes=root[:, None] * g.shapes, residual=residual), lambda values: values / root
    )


def narrow_body(body: Body, ratio: float = NARROWER) -> Body | None:
    """Return the body with the modes above its highest frequency over ``ratio`` moved to its residual; ``None`` if no
    modes remain."""
    g = body.greens.modal
    if g is None or not np.any(g.omega):
        return None
    highest = float(g.omega.max()) / (2 * np.pi) / ratio
    kept = g.omega <= 2 * np.pi * highest
    return body.transform_modes(narrow_greens(g, highest), lambda values: values[kept]) if np.any(kept) else None


def ringing_on(body: Body, ratio: float = 1.0, band: float = 0.0, octaves: int = 0) -> Body | None:
    """Return the body with its residual flexibility replaced by modes at ``ratio`` times the highest frequency, one for
    each eigenvector of the flexibility.

    The truncated modes, which the residual represents without inertia, vibrate at unknown frequencies above. A fraction
    `STATIC_SHARE` of the residual remains, as rigid contacts need an instantaneous response. ``None`` for a body
    without modes or without residual flexibility. ``band`` [Hz]: in place of the highest frequency if all modes are
    rigid. ``octaves``: number of octaves in the middle of which modes are placed, each with half the compliance of the
    one below: like those of a plate, which are evenly spaced, with compliances that fall with the square of the
    frequency.
    """
    g = body.greens.modal
    if g is None or not len(g.omega) or not (np.any(g.omega) or band):
        return None
    flexible = g.residual.static()
    if not (np.all(np.isfinite(flexible)) and np.any(flexible)):
        return None
    last = int(np.argmax(g.omega))
    values, ways = np.linalg.eigh((1 - STATIC_SHARE) * flexible)
    kept = values > ROUND_OFF * values[-1]
    yielding = (ways[:, kept] * np.sqrt(values[kept])).T
    steps = np.arange(max(octaves, 1))
    parts, highest = 0.5**steps, ratio * (g.omega[last] or 2 * np.pi * band)
    omega = np.repeat(highest * 2.0 ** (steps + (0.5 if octaves else 0.0)), len(yielding))
    shapes = omega[:, None] * np.kron(np.sqrt(parts / parts.sum())[:, None], yielding)
    ringing = replace(
        g,
        omega=np.concatenate([g.omega, omega]),
        zeta=np.concatenate([g.zeta, np.full(len(omega), g.zeta[last])]),
        shapes=np.vstack([g.shapes, shapes]),
        residual=g.residual.scaled(STATIC_SHARE),
    )
    return body.transform_modes(ringing, lambda values: np.concatenate([values, np.zeros(len(omega))]))


def narrow_greens(greens: ModalGreens, bandwidth: float) -> ModalGreens:
    """Return ``greens`` with the modes above ``bandwidth`` [Hz] in the residual: the same statics, the same g(0+)."""
    kept = greens.omega <= 2 * np.pi * bandwidth
    dropped = greens.shapes[~kept] / greens.omega[~kept, None]
    flexible, start = dropped.T @ dropped + greens.residual.static(), greens.initial_value()
    if not np.all(np.isfinite(flexible)):  # a dashpot in the residual is kept
        relaxing = Residual.relaxing(dropped.T @ dropped, 2 * np.pi * bandwidth)
        rest = Residual.together([greens.residual, relaxing])
    elif np.all(np.isfinite(start)) and (sizes := np.linalg.eigvalsh(start))[0] > ROUND_OFF * abs(sizes[-1]):
        rest = Residual.exponential(flexible, start)
    else:
        rest = Residual.spring(flexible)
    return greens.select_modes(kept, rest)
