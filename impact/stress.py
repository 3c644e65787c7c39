"""Stress in the bodies, recovered from the contact force."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import ArrayLike

from impact import oscillator
from impact.beam import Cantilever
from impact.body import Body
from impact.closed_form import DelayRod
from impact.greens import Array
from impact.march import FLOOR
from impact.modal import ModalGreens
from impact.result import ImpactResult

POINTS_PER_WAVE = 8  # of the shortest wave kept: where a peak is looked for along the reed
TIMES_PER_RADIAN = 2  # of the highest frequency kept: when it is looked for
_BLOCK = 1024  # times held at once


class StressError(ValueError):
    """A stress that this record cannot give; the message names number, limit and remedy."""


@dataclass(frozen=True)
class PeakStress:
    """The largest |bending stress| of a reed [Pa], its distance from the clamp [m] and its time [s]."""

    value: float
    at: float
    time: float


def bending_stress(
    force: Array, dt: float, reed: Body, beam: Cantilever, x: ArrayLike, *, contact_at: float | None = None
) -> Array:
    """(X, n + 1) bending stress of a reed under its contact force, in the face towards the seat, > 0 in tension [Pa].

    With the modal coordinates q_k under the contact force N and the moment of a static force at the contact point a,

        sigma(x, t) = (E h/2) [ sum_k w_k''(x) q_k(t) + r(x) n(t) ],
        r(x) = max(a - x, 0)/(E I) - sum_k w_k(a) w_k''(x)/omega_k^2.

    The modal sum of a point load's curvature converges only like 1/n, at the kink of its moment. r is what the sum
    leaves out, known exactly: a force that varies slowly gives the exact stress with any number of modes. n(t) is the
    force as the reed's residual compliance follows it, n' = rate (N - n): the model of the contact itself. What the
    modes left out carry of the release is missing here as it is there, 2/(pi n)^2 of the stress at the clamp.

    Args:
        force: (n + 1,) of `impact.solve` [N]; ``force[m]`` acts over the step that ends at m dt, ``force[0]`` before.
        dt: step [s].
        reed: the striker of that run, made of ``beam``, in contact at one point.
        beam: its geometry and material.
        x: (X,) distances from the clamp [m].
        contact_at: as given to `cantilever_reed`; ``None`` is the tip.

    Raises:
        StressError: forces of several contacts, or a reed with several.
        GreensFunctionError: a position off the reed.

    Source: R. E. Cornwell, R. R. Craig and C. P. Johnson, On the application of the mode-acceleration method to
    structural engineering problems, Earthquake Eng. Struct. Dyn. 11 (1983) 679.
    """
    places = np.atleast_1d(np.asarray(x, dtype=float))
    return np.concatenate(list(_stresses(force, dt, reed, beam, places, contact_at, 1)), axis=1)


def peak_bending_stress(
    force: Array, dt: float, reed: Body, beam: Cantilever, *, contact_at: float | None = None, coarsely: bool = False
) -> PeakStress:
    """The largest |`bending_stress`| along the reed and over the record, the release included.

    It is looked for at `POINTS_PER_WAVE` of the shortest wave kept and at `TIMES_PER_RADIAN` of the highest frequency,
    ``coarsely`` at half as many of each. The other arguments and the errors are those of `bending_stress`.
    """
    omega = _modal(reed).omega
    share = 2 if coarsely else 1
    places = np.linspace(0.0, beam.length, max(1, len(omega) * POINTS_PER_WAVE // (2 * share)) + 1)
    stride = max(1, int(share / (TIMES_PER_RADIAN * float(omega.max()) * dt)))
    peak, first = PeakStress(0.0, 0.0, 0.0), 0
    for block in _stresses(force, dt, reed, beam, places, contact_at, stride):
        if block.size == 0:  # a last block shorter than the stride
            continue
        here = np.abs(block)
        row, column = np.unravel_index(int(here.argmax()), here.shape)
        if here[row, column] > peak.value:
            time = float((first + column) * stride * dt)
            peak = PeakStress(float(here[row, column]), float(places[row]), time)
        first += here.shape[1]
    return peak


def _stresses(
    force: Array, dt: float, reed: Body, beam: Cantilever, x: Array, contact_at: float | None, stride: int
) -> Iterator[Array]:
    """(X, ...) blocks of the stress at every ``stride``-th time, the first at t = 0."""
    greens = _modal(reed)
    if force.ndim != 1 or len(greens.ports) != 1:
        raise StressError(
            f"force {force.shape} and a reed with {len(greens.ports)} contacts: the stress is that of a single one"
        )
    count = len(greens.omega)
    curvature = beam.curvatures(count, x)
    at = beam.length if contact_at is None else contact_at
    scaled = greens.shapes[:, 0] / greens.omega**2
    left_out = np.maximum(at - x, 0.0) / beam.rigidity - scaled @ curvature
    to_stress = beam.young * beam.thickness / 2
    rates = greens.residual.rates
    decay = float(np.exp(-dt * (rates[0] if rates.size else 2 * greens.omega.max())))
    start = reed.modal_start()
    q, v = start.displacement + scaled * force[0], start.velocity.copy()
    transition, gain = oscillator.transition(dt, greens.omega, greens.zeta)
    step = np.array([transition[0, 0], transition[0, 1], transition[1, 0], transition[1, 1], gain[0], gain[1]])
    shapes = np.column_stack([greens.shapes, *(load.shape for load in reed.loads)])
    slow = np.array([force[0]])
    yield to_stress * (q @ curvature + slow[0] * left_out)[:, None]
    for first in range(1, len(force), _BLOCK * stride):
        part = slice(first, min(first + _BLOCK * stride, len(force)))
        middle = np.asarray(dt * (np.arange(part.start, part.stop) - 0.5), dtype=np.float64)
        channels = np.stack([force[part], *(load.amplitude(middle) for load in reed.loads)])
        seen, followed = _advance(step, decay, shapes, channels, q, v, slow, stride)
        yield to_stress * (curvature.T @ seen.T + left_out[:, None] * followed)


def _modal(reed: Body) -> ModalGreens:
    if not isinstance(reed.greens, ModalGreens) or not reed.greens.omega.all() or not reed.greens.omega.size:
        raise StressError(
            f"a reed known by a {type(reed.greens).__name__} has no modes of bending; make it by cantilever_reed"
        )
    return reed.greens


@njit(cache=True)
def _advance(step, decay, shapes, channels, q, v, slow, stride):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Modal coordinates (times, M) and the followed force (times,) after every ``stride``-th step; states go on."""
    a11, a12, a21, a22, b1, b2 = step
    steps = channels.shape[1]
    seen, followed = np.empty((steps // stride, q.size)), np.empty(steps // stride)
    for m in range(steps):
        slow[0] = channels[0, m] + decay * (slow[0] - channels[0, m])
        for k in range(q.size):
            f = 0.0
            for c in range(channels.shape[0]):
                f += shapes[k, c] * channels[c, m]
            x, y = q[k], v[k]
            q[k] = a11[k] * x + a12[k] * y + b1[k] * f + FLOOR
            v[k] = a21[k] * x + a22[k] * y + b2[k] * f + FLOOR
        if (m + 1) % stride == 0:
            seen[(m + 1) // stride - 1] = q
            followed[(m + 1) // stride - 1] = slow[0]
    return seen, followed


def rod_stress(result: ImpactResult, rod: DelayRod, *, area: float, at: float = 1.0) -> Array:
    """(n + 1,) axial stress, > 0 in compression [Pa], of a rod struck by ``result.force``; exact for its steps.

    The contact sends out the wave of particle velocity a(t) = N(t)/Z + R a(t - T); at the distance x it meets the
    wave that returns from the far end:  sigma A = Z (a(t - x/c) - R a(t - T + x/c)).  Like the force,
    ``stress[m]`` holds over the step that ends at ``result.time[m]``.

    Args:
        result: its force acts on the rod's end.
        rod: its Green's function.
        area: of its section [m^2].
        at: x/l, 0 at the contact ... 1 at the far end.

    Raises:
        StressError: a position off the rod, an area that is not positive, or a delay that is no multiple of the step.

    Source: Timoshenko & Goodier, Theory of Elasticity, longitudinal impact of bars.
    """
    if not 0.0 <= at <= 1.0:
        raise StressError(f"at = {at:g} is off the rod, 0 (contact) ... 1 (far end)")
    if not area > 0:
        raise StressError(f"area = {area:g} m^2 must be positive")
    trip = _steps(rod.round_trip, result.dt)
    there = _steps(at * rod.round_trip / 2, result.dt)
    outgoing = result.force / rod.impedance
    for m in range(trip, len(outgoing)):
        outgoing[m] += rod.reflection * outgoing[m - trip]
    force = _delayed(outgoing, there) - rod.reflection * _delayed(outgoing, trip - there)
    return np.asarray(rod.impedance / area * force)


def _delayed(values: Array, steps: int) -> Array:
    return np.concatenate([np.zeros(steps), values])[: len(values)]


def _steps(delay: float, dt: float) -> int:
    count = round(delay / dt)
    if abs(delay / dt - count) > 1e-6:
        raise StressError(
            f"the wave needs {delay:g} s, {delay / dt:.6g} steps of {dt:g} s, not a whole number; "
            f"use dt = {delay / max(count, 1):.17g} s"
        )
    return count
