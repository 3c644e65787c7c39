"""The runs behind an error budget: the same contact with one part of the model made coarser."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Final

import numpy as np

import impact
from impact.greens import GreensFunction
from impact.modal import ModalGreens, Residual
from impact.result import ImpactResult
from impact.sums import ScaledGreens
from seatfem.runs.budget import Budget, Source, Values, changes, measured, total
from seatfem.runs.contact import run_contact, striker_of
from seatfem.scene import Cantilever, Scene
from seatfem.scene.seats import ElasticSeat
from seatfem.seats.seat import COARSENING, SeatAnswer

NARROWER: Final = 1.6  # ratio of bandwidths behind the reduction's share
FEWER: Final = 1.4  # ratio of the reed's numbers of modes behind the model's share


def error_budget(scene: Scene, seat: SeatAnswer, striker: impact.Body, result: ImpactResult) -> Budget:
    """What mesh, reduction, time step and model leave in the measures of ``result``.

    - mesh: the seat on the coarser mesh, taken as converging with order 1, as clamped corners may; where that is not
      at hand, g made larger by its stated error.
    - reduction: the seat's modes above bandwidth/1.6 moved into the residual, and g larger by the reduction's error.
    - time_step: a step twice as long, or half as long.
    - model: fewer modes of the reed, by 1.4; g larger by the error of the level of modelling (a bar as a rod).
    A closed-form seat has no error of mesh and reduction.
    """
    width, dt = scene.run.filter_width, result.dt
    values = measured(result, width)

    def run(greens: GreensFunction, body: impact.Body = striker, step: float = dt) -> Values:
        return measured(run_contact(scene, body, greens, step), width)

    nothing = dict.fromkeys(values, 0.0)
    parts: dict[Source, Values] = {}
    error = seat.greens.error_estimate
    if seat.coarser is not None:
        change = changes(values, run(seat.coarser))
        parts["mesh"] = {name: value / (COARSENING - 1) for name, value in change.items()}
    elif error.mesh is not None:
        parts["mesh"] = changes(values, run(ScaledGreens(seat.greens, 1 + error.mesh))) if error.mesh else nothing
    if error.reduction is not None:
        off = 1 + error.reduction
        parts["reduction"] = changes(values, run(ScaledGreens(seat.greens, off))) if error.reduction else nothing
        if isinstance(scene.seat, ElasticSeat) and isinstance(seat.greens, ModalGreens) and len(seat.greens.omega) > 1:
            narrow = run(narrowed(seat.greens, scene.seat.greens.bandwidth / NARROWER))
            parts["reduction"] = total(parts["reduction"], changes(values, narrow))
    parts["time_step"] = _of_step(values, dt, width, lambda step: run(seat.greens, step=step))
    parts["model"] = (
        changes(values, run(ScaledGreens(seat.greens, 1 + seat.level_error))) if seat.level_error else nothing
    )
    if isinstance(scene.reed, Cantilever):
        fewer = striker_of(scene, max(1, round(scene.reed.n_modes / FEWER)))
        parts["model"] = total(parts["model"], changes(values, run(seat.greens, fewer)))
    return Budget(values, parts)


def narrowed(greens: ModalGreens, bandwidth: float) -> ModalGreens:
    """``greens`` with the modes above ``bandwidth`` [Hz] moved into the residual: the same statics, the same g(0+)."""
    kept = greens.omega <= 2 * np.pi * bandwidth
    dropped = greens.shapes[~kept] / greens.omega[~kept, None]
    flexible = dropped.T @ dropped + greens.residual.static()
    start = greens.initial_value()
    finite = bool(np.all(np.isfinite(start)) and np.linalg.eigvalsh(start).min() > 0)
    rest = Residual.exponential(flexible, start) if finite else Residual.spring(flexible)
    return replace(greens, omega=greens.omega[kept], zeta=greens.zeta[kept], shapes=greens.shapes[kept], residual=rest)


def _of_step(values: Values, dt: float, width: float, run: Callable[[float], Values]) -> Values:
    """The march is of first order where the force jumps: a step of 2 dt changes what is left at dt.

    Where 2 dt no longer resolves the filter, dt/2 takes its place: it changes half of it.
    """
    if 4 * dt <= width:
        return changes(values, run(2 * dt))
    return {name: 2 * change for name, change in changes(values, run(dt / 2)).items()}
