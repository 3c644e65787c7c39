"""The runs behind an error budget: the same contact with one part of the model made coarser."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Final, Protocol

import numpy as np

import impact
from impact.greens import GreensFunction
from impact.modal import ModalGreens, Residual
from impact.result import ImpactResult
from impact.sums import ScaledGreens
from seatfem.planning.prerun import Bench, window_of
from seatfem.runs.budget import Budget, Source, Values, changes, larger, measured, times, total
from seatfem.runs.contact import run_for_measures, striker_of
from seatfem.scene import Cantilever, Scene
from seatfem.scene.seats import ElasticSeat
from seatfem.seats.statics import beyond_level

if TYPE_CHECKING:
    from seatfem.seats.seat import SeatAnswer

FINE: Final = 16  # steps per filter width from which on coarser steps tell enough
SHORT: Final = 0.3  # of the run: an impact that is marched again with half the step
NARROWER: Final = 1.6  # ratio of bandwidths behind the reduction's share
HALF: Final = 2.0  # likewise; this change is taken for twice of what is left, and two are seldom small by accident
FEWER: Final = 1.4  # ratio of the reed's numbers of modes behind the model's share
FEW: Final = 10  # reed modes below which leaving some of them out tells little; ...
MANY: Final = 40  # ... then this number does


def error_budget(
    scene: Scene, seat: SeatAnswer, striker: impact.Body, result: ImpactResult, stress: float | None = None
) -> Budget:
    """What mesh, reduction, time step and model leave in the measures of ``result``.

    - time_step: a step twice as long changes as much as is left, the march being of first order where the force jumps,
      and one four times as long three times as much. The larger counts: either may be small by accident. Where these
      hardly resolve the filter, half the step, which changes half of what is left, takes the place of the latter. Half
      the step is also taken through the impact that carries the filtered peak. A contact's duration is known to a
      step at best. The runs below take the doubled step, if it resolves the filter, and are compared with that one.
    - mesh: the seat on the coarser mesh, taken as converging with order 1, as clamped corners may; where that is not
      at hand, g made larger by its stated error.
    - reduction: the highest modes of the seat, down to 1.6 below the last, moved into the residual, and g larger by
      the reduction's error. A Krylov space keeps modes far beyond the bandwidth.
    - model: fewer modes of the reed, by 1.4, or half of what half of them change, or, of few, what many change; g
      larger by the error of the level of modelling (a bar as a rod); what a cheap level leaves out, to first order
      (`seatfem.seats.statics.beyond_level`).
    A closed-form seat has no error of mesh and reduction. ``stress``: the reed's in ``result`` [Pa], if wanted.
    """
    values = measured(result, scene.run.filter_width, stress)
    step = 2 * result.dt if _may_double(result.dt, scene.run.filter_width) else result.dt

    def run(greens: GreensFunction, body: impact.Body = striker, dt: float = step) -> Values:
        return run_for_measures(scene, body, greens, dt)

    base = run(seat.greens)

    def between(dt: float) -> Values:
        return changes(values, base if dt == step else run(seat.greens, dt=dt))

    of_step, finer = left_by_step(result.dt, scene.run.filter_width, between), _finer_step(scene, seat, result)
    of_step = {name: max(value, finer.get(name, 0.0)) for name, value in of_step.items()}
    if values["contact_duration"] > 0:
        of_step = {**of_step, "contact_duration": max(of_step["contact_duration"], result.dt)}
    mesh, reduction = _of_mesh(seat, base, run), _of_reduction(scene, seat, base, run)
    found: Mapping[Source, Values | None] = {
        "mesh": mesh, "reduction": reduction, "time_step": of_step, "model": _of_model(scene, seat, base, run)
    }  # fmt: skip
    return Budget(values, {source: part for source, part in found.items() if part is not None})


def left_by_step(dt: float, filter_width: float, between: Callable[[float], Values]) -> Values:
    """What a step of ``dt`` leaves, see `error_budget`; ``between``: the changes from it to another step [s]."""
    if FINE * dt <= filter_width:
        other = times(1 / 3, between(4 * dt))
    else:
        other = times(2.0, between(dt / 2))
    return larger(between(2 * dt), other) if _may_double(dt, filter_width) else other


def _may_double(dt: float, filter_width: float) -> bool:
    """Whether a step twice as long resolves the filter."""
    return 4 * dt <= filter_width


def _finer_step(scene: Scene, seat: SeatAnswer, result: ImpactResult) -> Values:
    """Twice what half the step changes in the impact of a reed, if that is short beside the run.

    A spike of the force is as wide as a step: whether the filter holds it together with another one, no longer step
    tells.
    """
    if not isinstance(scene.reed, Cantilever):
        return {}
    window = window_of(scene, result.force[1:], result.dt)
    if not window.touches or window.duration > SHORT * scene.run.duration:
        return {}
    bench = Bench(scene, seat.greens, window)
    here, finer = (bench.measures(dt=dt, n_modes=scene.reed.n_modes) for dt in (result.dt, result.dt / 2))
    return times(2.0, changes(here, finer))


class _Run(Protocol):
    """The measures with another seat, or another striker."""

    def __call__(self, greens: GreensFunction, body: impact.Body = ...) -> Values: ...


def _of_mesh(seat: SeatAnswer, base: Values, run: _Run) -> Values | None:
    if seat.coarser is not None:
        change = changes(base, run(seat.coarser))
        return {name: value / (seat.refinement - 1) for name, value in change.items()}
    return _of_g(seat, seat.greens.error_estimate.mesh, base, run)


def _of_reduction(scene: Scene, seat: SeatAnswer, base: Values, run: _Run) -> Values | None:
    part, greens = _of_g(seat, seat.greens.error_estimate.reduction, base, run), seat.greens
    if part is None or not isinstance(scene.seat, ElasticSeat) or not isinstance(greens, ModalGreens):
        return part
    if len(greens.omega) == 0:
        return part
    highest = float(greens.omega.max()) / (2 * np.pi)
    return total(part, changes(base, run(narrowed(greens, highest / NARROWER))))


def _of_model(scene: Scene, seat: SeatAnswer, base: Values, run: _Run) -> Values | None:
    part = _of_g(seat, seat.level_error, base, run)
    if part is not None and (better := beyond_level(scene, seat.greens)) is not None:
        part = total(part, changes(base, run(better)))
    if part is None or not isinstance(scene.reed, Cantilever):
        return part
    left: Values = dict.fromkeys(base, 0.0)
    for number, weight in other_modes(scene.reed.n_modes):
        left = larger(left, times(weight, changes(base, run(seat.greens, striker_of(scene, number)))))
    return total(part, left)


def _of_g(seat: SeatAnswer, error: float | None, base: Values, run: _Run) -> Values | None:
    """What a relative error of g changes; ``None`` where it is unknown."""
    if error is None:
        return None
    return changes(base, run(ScaledGreens(seat.greens, 1 + error))) if error else dict.fromkeys(base, 0.0)


def other_modes(n_modes: int) -> tuple[tuple[int, float], ...]:
    """Numbers of reed modes that a run with ``n_modes`` is compared with, and how much of each change is left in it."""
    less = ((max(1, round(n_modes / FEWER)), 1.0), (max(1, round(n_modes / HALF)), 1 / 2))
    more = ((MANY, 1.0),) if n_modes < FEW else ()
    return tuple((number, weight) for number, weight in less + more if number != n_modes)


def narrowed(greens: ModalGreens, bandwidth: float) -> ModalGreens:
    """``greens`` with the modes above ``bandwidth`` [Hz] moved into the residual: the same statics, the same g(0+)."""
    kept = greens.omega <= 2 * np.pi * bandwidth
    dropped = greens.shapes[~kept] / greens.omega[~kept, None]
    flexible = dropped.T @ dropped + greens.residual.static()
    start = greens.initial_value()
    finite = bool(np.all(np.isfinite(start)) and np.linalg.eigvalsh(start).min() > 0)
    rest = Residual.exponential(flexible, start) if finite else Residual.spring(flexible)
    return replace(greens, omega=greens.omega[kept], zeta=greens.zeta[kept], shapes=greens.shapes[kept], residual=rest)
