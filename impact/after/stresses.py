"""Stress in reeds, recovered from the contact force."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from impact.after.histories import NO_STRESS, PeakStress, ReedStress, Spans, StressError, stress_by_spans
from impact.beams.euler_bernoulli import Cantilever
from impact.bodies.body import Body
from impact.greens.base import Array
from impact.greens.modal import ModalGreens, Residual
from impact.march import grid
from impact.march.replay import BodyAtStart, EqualReplay

POINTS_PER_WAVE = 8  # points along the reed per wavelength of the highest mode, at which the stress is evaluated
ROUND_OFF = 1e-12  # relative round-off of sums over modes
SAME_SHAPE = 1e-9  # largest relative misfit that counts as round-off of a load's modal shape by forces on ports
_BLOCK = 1024  # time steps whose modal coordinates are held in memory at once
_FEW = 16  # stride of the first pass over the steps, whose peak rules out most of the others by their bounds


At = float | tuple[float, ...] | None
"""Contact positions of a reed as distances from its clamp [m]; ``None``: its tip."""


def bending_stress(
    force: Array, dt: float, reed: Body, beam: Cantilever, x: ArrayLike, *, contact_at: At = None
) -> Array:
    """Return the (X, n + 1) bending stress of a reed under its contact force, in the face towards the seat, > 0 in
    tension [Pa].

    With the modal coordinates q_k under the contact force N and the moment of a static force at the contact point a,

        sigma(x, t) = (E h/2) [ sum_k w_k''(x) q_k(t) + r(x) n(t) ],
        r(x) = max(a - x, 0)/(E I) - sum_k w_k(a) w_k''(x)/omega_k^2.

    The modal sum of a point load's curvature converges only like 1/n, at the kink of its moment. r is the exact static
    remainder of that sum: a force that varies slowly gives the exact stress with any number of modes. n(t) is the force
    low-pass filtered by the reed's residual compliance, n' = rate (N - n), as in the contact model itself. The share of
    the truncated modes in the release is missing in both, 2/(pi n)^2 of the stress at the clamp. A reed with several
    contacts has a term r n for each. A load at a contact, such as a pressure on an effective area, adds to n; a
    distributed load acts on the retained modes alone, whose sum then converges like 1/n^2.

    Args:
        force: (n + 1,) of `impact.solve` [N]; ``force[m]`` acts over the step that ends at m dt, ``force[0]`` before:
            where that is not zero the reed starts preloaded, in equilibrium with it and with its loads. Of a reed with
            several ports (n + 1, ports), along the normal: the force of a stopper is negative.
        dt: step [s].
        reed: the striker of that run, made of ``beam``.
        beam: its geometry and material.
        x: (X,) distances from the clamp [m].
        contact_at: as given to `cantilever_reed`; ``None`` is the tip.

    Raises:
        StressError: forces, places and ports of the reed that differ in number.
        GreensFunctionError: a position off the reed.

    Source: R. E. Cornwell, R. R. Craig and C. P. Johnson, On the application of the mode-acceleration method to
    structural engineering problems, Earthquake Eng. Struct. Dyn. 11 (1983) 679.
    """
    pushes = _list_port_forces(force, reed)
    fields = _fields(reed, beam, np.atleast_1d(np.asarray(x, dtype=float)), contact_at)
    return np.concatenate([fields.T @ part.T for part in coordinates(pushes, dt, reed, 1)], axis=1)


def peak_bending_stress(
    force: Array, dt: float, reed: Body, beam: Cantilever, *, contact_at: At = None, coarsely: bool = False
) -> PeakStress:
    """Return the largest |`bending_stress`| [Pa] along the reed in the record, release included: as `reed_stress`."""
    return reed_stress(force, dt, reed, beam, contact_at=contact_at, coarsely=coarsely).largest


def reed_stress(
    force: Array,
    dt: float,
    reed: Body,
    beam: Cantilever,
    *,
    contact_at: At = None,
    coarsely: bool = False,
    since: float = math.nan,
) -> ReedStress:
    """Return the largest |`bending_stress`| [Pa] along the reed at t = 0, before and after the first contact, and
    before and after the time ``since`` at which a landing begins [s], nan without one.

    The stress is evaluated at `POINTS_PER_WAVE` points per shortest retained wave and at every step, with ``coarsely``
    at half as many points and once per radian of the highest mode. Other arguments and errors: as `bending_stress`.

    Steps are skipped where the sum over modes of |q_k| max |stress shape| is below the peak so far, then those where
    the stress in single precision plus its round-off bound is below it.
    """
    pushes, omega = _list_port_forces(force, reed), _modal(reed).omega
    share = 2 if coarsely else 1
    places = np.linspace(0.0, beam.length, max(1, len(omega) * POINTS_PER_WAVE // (2 * share)) + 1)
    stride = max(1, int(1 / (float(omega.max()) * dt))) if coarsely else 1
    fields = _fields(reed, beam, places, contact_at)
    reach = np.abs(fields).max(axis=1)
    shapes = (fields / np.where(reach > 0, reach, 1.0)[:, None]).astype(np.float32)
    doubt = (len(fields) + 4) * float(np.finfo(np.float32).eps)
    spans = Spans.from_forces(force, dt, since)
    peaks, first = [NO_STRESS] * spans.count, 0
    for part in coordinates(pushes, dt, reed, stride):
        times, bound = (first + np.arange(len(part))) * stride, np.abs(part) @ reach
        numbers = spans.find_numbers(times)
        for span in np.unique(numbers):
            least = (1 - ROUND_OFF) * peaks[span].value
            near = np.flatnonzero(numbers == span)
            for every in (_FEW, 1):
                near = near[bound[near] > least]
                some = near[::every]
                if not len(some):
                    break
                unit, off = bound[some].max(), doubt * bound[some]
                about = unit * np.abs((part[some] * (reach / unit)).astype(np.float32) @ shapes).max(axis=1)
                least = max(least, float((about - off).max()))
            if not len(near):
                continue
            near = some[about + off >= least]
            stress = np.abs(part[near] @ fields)
            if stress.max(initial=0.0) > peaks[span].value:
                row, column = np.unravel_index(int(stress.argmax()), stress.shape)
                time = float(times[near[row]] * dt)
                peaks[span] = PeakStress(float(stress[row, column]), float(places[column]), time)
        first += len(part)
    return stress_by_spans(spans, lambda chosen: max(peaks[chosen], key=lambda peak: peak.value, default=NO_STRESS))


def _fields(reed: Body, beam: Cantilever, x: Array, contact_at: At) -> Array:
    """Return the (M + p, X) stress per unit of each of `coordinates`: M mode shapes, then r(x) of each of p ports."""
    greens = _modal(reed)
    curvature = beam.curvatures(len(greens.omega), x)
    places = contact_at if isinstance(contact_at, tuple) else (beam.length if contact_at is None else contact_at,)
    if len(places) != len(greens.ports):
        raise StressError(
            f"contact_at has {len(places)} places, the reed {len(greens.ports)} contacts: give one for each"
        )
    left_out = [
        np.maximum(at - x, 0.0) / beam.rigidity - (shape / greens.omega**2) @ curvature
        for at, shape in zip(places, greens.shapes.T, strict=True)
    ]
    return np.asarray(beam.young * beam.thickness / 2 * np.vstack([curvature, *left_out]))


def _list_port_forces(force: Array, reed: Body) -> Array:
    """Return the (p, n + 1) forces on the ports of the reed."""
    ports, pushes = len(_modal(reed).ports), np.atleast_2d(force.T)
    if len(pushes) != ports:
        raise StressError(
            f"force {force.shape} and a reed with {ports} contacts: give a column for each, in the order of its ports"
        )
    return pushes


def coordinates(pushes: Array, dt: float, reed: Body, stride: int) -> Iterator[Array]:
    """Yield (..., M + p) blocks of modal coordinates and filtered port forces n, at every ``stride``-th step from 0."""
    greens, ports, rates = _modal(reed), len(pushes), _modal(reed).residual.rates
    rate = float(rates[0] if rates.size else 2 * greens.omega.max())  # relaxation rate of n' = rate (N - n) [1/s]
    followed = replace(greens, residual=Residual(rate * np.eye(ports), np.full(ports, rate), np.zeros((ports, ports))))
    start, first, at_ports = reed.modal_start(), pushes[:, 0], _find_equivalent_forces(reed)
    pull = greens.shapes @ first
    if np.any(first):  # a preload: the reed starts in static equilibrium with its loads and the contact force
        held = reed.load_amplitudes(np.zeros(1))[:, 0]
        pull = pull + sum(load.shape * amplitude for load, amplitude in zip(reed.loads, held, strict=True))
        first = first + at_ports @ held
    start = replace(start, displacement=start.displacement + pull / greens.omega**2)
    body = BodyAtStart(followed, start, pushes[:, 0], pushes[:, 0], [load.shape for load in reed.loads], np.eye(ports))
    replay = EqualReplay(body, dt)
    yield np.append(start.displacement, first)[None, :]
    for part in grid.blocks(pushes.shape[1] - 1, _BLOCK * stride):
        middle = np.asarray(dt * (np.arange(part.start, part.stop) + 0.5), dtype=np.float64)
        amplitudes = reed.load_amplitudes(middle)
        block = replay.coordinates(pushes[:, 1:][:, part], amplitudes, stride)
        block[:, -ports:] += (at_ports @ amplitudes[:, stride - 1 :: stride]).T
        yield block


def _find_equivalent_forces(reed: Body) -> Array:
    """Return the (p, L) forces on the ports equivalent to a unit of each load of the reed; zero for a load whose modal
    shape is no combination of those of the ports."""
    shapes, forces = _modal(reed).shapes, np.zeros((len(reed.greens.ports), len(reed.loads)))
    for number, load in enumerate(reed.loads if len(shapes) > len(forces) else ()):  # with M <= p every shape fits
        fitted = np.linalg.lstsq(shapes, load.shape, rcond=None)[0]
        if np.linalg.norm(shapes @ fitted - load.shape) < SAME_SHAPE * np.linalg.norm(load.shape):
            forces[:, number] = fitted
    return forces


def _modal(reed: Body) -> ModalGreens:
    modal = reed.greens.modal
    if modal is None or not modal.omega.all() or not modal.omega.size:
        raise StressError(
            f"a reed known by a {type(reed.greens).__name__} has no modes of bending; make it by cantilever_reed"
        )
    return modal
