"""The error budget of an impact between any two bodies, in one call."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

import numpy as np

from impact.after import measures as measured
from impact.after.result import ImpactResult
from impact.after.spectrum import largest_average
from impact.bodies.body import AtRest, Body, as_body
from impact.brief import brief
from impact.greens.base import GreensFunction
from impact.march.problem import ContactError, ContactProblem
from impact.runs.budget import Budget, Values, changes, times
from impact.runs.solver import solve
from impact.runs.variations import NARROWER, Terms, Variation, budget_of, narrower, of_g, with_body

Measure = Callable[[ImpactResult], float]
RATIOS: Final = (NARROWER, 2.5)  # of bandwidths: one change may be small by accident
NOTHING: Final[Mapping[str, ContactProblem]] = MappingProxyType({})


@dataclass(frozen=True)
class Coarser:
    """A body of the impact, modelled more coarsely: a coarser mesh, fewer modes, a narrower band.

    Attributes:
        body: that body, or its Green's function, which takes the velocity, state and loads of the run's.
        ratio: of the element sizes, numbers of modes or bandwidths, > 1: of what it changes, 1/(ratio - 1) is left.
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
    dt: float | None = None,
    duration: float | None = None,
    filter_width: float | None = None,
    rule: str = "auto",
    measures: Mapping[str, Measure] | None = None,
    coarser: Mapping[str, Coarser] | None = None,
    others: Mapping[str, ContactProblem] = NOTHING,
) -> Budget:
    """Return what each source of error leaves in the measures of an impact: value +- bar, and what dominates it.

    The impact is marched again with one source made coarser at a time; the change of each measure is that source's
    share of its error, and the bar 1.5 times their sum (`impact.Budget`). That holds for contacts that chatter,
    too, which an error of g alone does not bound. The sources:

    - "time_step": two and four times the step, and half of it (`impact.runs.variations.left_by_step`);
    - "striker reduction", "target reduction": g larger by its ``error_estimate.reduction``, and the highest modes of a
      `ModalGreens`, down to 1.6 and to 2.5 below the last, moved into its residual (a filter shorter
      than the period of the highest mode asks for what the model has not). A modal body whose modes are all there is (a
      lumped system) says so by ``error=ErrorEstimate(0, 0)``;
    - "striker mesh", "target mesh": g larger by its ``error_estimate.mesh``;
    - whatever ``others`` name, the same impact with another model: all that it changes counts.

    A source of which nothing is known is named in ``unknown``, and is in no bar. Several targets are "target 0",
    "target 1", ...; with several contacts each measure stands once for each, "impulse 0", "impulse 1", ...

    Args:
        result: of `impact.solve` with that problem and step ``rule``.
        dt, duration: [s], to solve it here where there is no result.
        filter_width: of the measure "filtered_peak" [s], left out for ``None``; at least twice ``dt``.
        measures: by name, as functions of a result; ``None``: "impulse" [N s], "filtered_peak" [N],
            "contact_duration" (of the first group) [s] and "target_displacement" (largest) [m].
        coarser: by the name of a mesh or reduction source, a coarser companion, in place of the stated error.

    Raises:
        ContactError: no result and no step or duration; a source that is none; what `impact.solve` raises.
        MeasureError: a filter below two steps.
    """
    if result is None:
        if dt is None or duration is None:
            raise ContactError("error_budget needs the result of a run, or dt and duration to run it")
        result = solve(problem, dt=dt, duration=duration, rule=rule)
    step, length = result.dt, float(result.time[-1])
    if filter_width is not None:
        measured.filtered_peak_force(result, filter_width, contact=0)  # refuses a filter that the step does not resolve
    quantities = _standard(problem, filter_width) if measures is None else measures

    def values_of(one: ImpactResult) -> Values:
        return {name: float(measure(one)) for name, measure in quantities.items()}

    def run(varied: ContactProblem, varied_step: float) -> Values:
        return values_of(solve(varied, dt=varied_step, duration=length, rule=rule))

    sources = dict(_sources(problem, {} if coarser is None else coarser))
    sources |= {name: ((Variation(other),),) for name, other in others.items()}
    values = values_of(result)
    finer = times(2.0, changes(values, run(problem, step / 2)))
    return budget_of(run, problem, values, step, sources, filter_width=filter_width, finer=finer)


def _standard(problem: ContactProblem, filter_width: float | None) -> Mapping[str, Measure]:
    """Return the measures of each contact."""
    count = len(problem.contacts)
    measures: dict[str, Measure] = {}
    for c in range(count):
        end = "" if count == 1 else f" {c}"
        measures[f"impulse{end}"] = _at(c, measured.impulse)
        if filter_width is not None:
            measures[f"filtered_peak{end}"] = _at(c, lambda one: largest_average(one.force[1:], one.dt, filter_width))
        measures[f"contact_duration{end}"] = _at(c, _first_duration)
        measures[f"target_displacement{end}"] = _at(c, lambda one: float(np.max(np.abs(one.target_displacement))))
    return measures


def _at(contact: int, measure: Measure) -> Measure:
    return lambda result: measure(measured.of_contact(result, contact))


def _first_duration(one: ImpactResult) -> float:
    groups = measured.contact_groups(one)
    return float(groups[0, 1] - groups[0, 0]) if len(groups) else 0.0


def _sources(problem: ContactProblem, coarser: Mapping[str, Coarser]) -> Iterator[tuple[str, Terms | None]]:
    """Return the mesh and the reduction of each body."""
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
                yield f"{name} mesh", of_g(problem, body, stated)
            else:
                yield f"{name} reduction", _reduced(problem, body, stated)


def _reduced(problem: ContactProblem, body: Body, stated: float | None) -> Terms | None:
    """Return the variations by the stated error and without the highest modes, where there are any to leave out."""
    terms = of_g(problem, body, stated)
    fewer = [] if stated == 0.0 else [(narrower(body, ratio), 1 / (ratio - 1)) for ratio in RATIOS]
    variations = tuple(Variation(with_body(problem, body, less), weight) for less, weight in fewer if less is not None)
    return (*(terms or ()), variations) if variations else terms
