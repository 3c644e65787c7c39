"""Stress in reeds and rods, recovered from the contact force; displacement and axial force of rods at any x."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from impact.after.histories import Spans
from impact.after.result import ImpactResult
from impact.beams.euler_bernoulli import Cantilever
from impact.bodies.body import Body
from impact.exact.closed_form import ExactRod, on_rod
from impact.greens.base import Array, ErrorEstimate, GreensFunction, GreensFunctionError
from impact.greens.modal import ModalGreens, Residual
from impact.march import grid, history, motion
from impact.march.replay import BodyAtStart, EqualReplay

POINTS_PER_WAVE = 8  # points along the reed per wavelength of the highest mode, at which the stress is evaluated
ROUND_OFF = 1e-12  # relative round-off of sums over modes
SAME = 1e-9  # largest relative misfit of a load's modal shape, fitted by forces on ports, that counts as round-off
_BLOCK = 1024  # time steps whose modal coordinates are held in memory at once
_FEW = 16  # stride of the first pass over the steps, whose peak rules out most of the others by their bounds


At = float | tuple[float, ...] | None
"""Contact positions of a reed as distances from its clamp [m]; ``None``: its tip."""


class StressError(ValueError):
    """A stress that this record cannot give; the message names number, limit and remedy."""


@dataclass(frozen=True)
class PeakStress:
    """The largest |bending stress| of a reed [Pa], its distance from the clamp [m] and its time [s]."""

    value: float
    at: float
    time: float


NO_STRESS = PeakStress(0.0, 0.0, 0.0)


@dataclass(frozen=True)
class ReedStress:
    """The largest |bending stress| of a reed in parts of a run.

    Attributes:
        initial: peak from the release until the first contact; zero under a preload, where contact begins at t = 0.
        after_contact: peak since the first contact began; ``None`` without contact.
        at_start: peak at t = 0, due to the release, the preload and the loads in equilibrium at the start.
        before_landing: peak until the landing begins, t = 0 included; ``None`` where no landing time is given.
        after_landing: peak since the landing began; ``None`` where no landing time is given.
    """

    initial: PeakStress
    after_contact: PeakStress | None
    at_start: PeakStress
    before_landing: PeakStress | None = None
    after_landing: PeakStress | None = None

    @property
    def largest(self) -> PeakStress:
        """Return the peak of the whole record."""
        after = self.after_contact
        return self.initial if after is None or after.value < self.initial.value else after


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
    pushes = _by_port(force, reed)
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
    since: float | None = None,
) -> ReedStress:
    """Return the largest |`bending_stress`| [Pa] along the reed at t = 0, before and after the first contact, and
    before and after the time ``since`` at which a landing begins [s].

    The stress is evaluated at `POINTS_PER_WAVE` points per shortest retained wave and at every step, with ``coarsely``
    at half as many points and once per radian of the highest mode. Other arguments and errors: as `bending_stress`.

    Steps are skipped where the sum over modes of |q_k| max |stress shape| is below the peak so far, then those where
    the stress in single precision plus its round-off bound is below it.
    """
    pushes, omega = _by_port(force, reed), _modal(reed).omega
    share = 2 if coarsely else 1
    places = np.linspace(0.0, beam.length, max(1, len(omega) * POINTS_PER_WAVE // (2 * share)) + 1)
    stride = max(1, int(1 / (float(omega.max()) * dt))) if coarsely else 1
    fields = _fields(reed, beam, places, contact_at)
    reach = np.abs(fields).max(axis=1)
    shapes = (fields / np.where(reach > 0, reach, 1.0)[:, None]).astype(np.float32)
    doubt = (len(fields) + 4) * float(np.finfo(np.float32).eps)
    spans = Spans.of_run(force, dt, since)
    peaks, first = [NO_STRESS] * spans.count, 0
    for part in coordinates(pushes, dt, reed, stride):
        times, bound = (first + np.arange(len(part))) * stride, np.abs(part) @ reach
        numbers = spans.of_times(times)
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


def stress_by_spans(spans: Spans, largest: Callable[[slice], PeakStress]) -> ReedStress:
    """Return the `ReedStress` of a run whose peak in a slice of ``spans`` is ``largest(slice)``."""
    return ReedStress(
        largest(spans.until(spans.touch)),
        largest(spans.after(spans.touch)) if np.isfinite(spans.touch) else None,
        largest(spans.start),
        largest(spans.until(spans.landing)) if np.isfinite(spans.landing) else None,
        largest(spans.after(spans.landing)) if np.isfinite(spans.landing) else None,
    )


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


def _by_port(force: Array, reed: Body) -> Array:
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
    start, first, at_ports = reed.modal_start(), pushes[:, 0], _at_ports(reed)
    pull = greens.shapes @ first
    if np.any(first):  # a preload: the reed starts in static equilibrium with its loads and the contact force
        held = reed.load_amplitudes(np.zeros(1))[:, 0]
        pull = pull + sum(load.shape * amplitude for load, amplitude in zip(reed.loads, held, strict=True))
        first = first + at_ports @ held
    start = replace(start, displacement=start.displacement + pull / greens.omega**2)
    body = BodyAtStart(followed, start, pushes[:, 0], pushes[:, 0], [load.shape for load in reed.loads])
    replay = EqualReplay(body, dt)
    yield np.append(start.displacement, first)[None, :]
    for part in grid.blocks(pushes.shape[1] - 1, _BLOCK * stride):
        middle = np.asarray(dt * (np.arange(part.start, part.stop) + 0.5), dtype=np.float64)
        amplitudes = reed.load_amplitudes(middle)
        block = replay.coordinates(pushes[:, 1:][:, part], amplitudes, stride)
        block[:, -ports:] += (at_ports @ amplitudes[:, stride - 1 :: stride]).T
        yield block


def _at_ports(reed: Body) -> Array:
    """Return the (p, L) forces on the ports equivalent to a unit of each load of the reed; zero for a load whose modal
    shape is no combination of those of the ports."""
    shapes, forces = _modal(reed).shapes, np.zeros((len(reed.greens.ports), len(reed.loads)))
    for number, load in enumerate(reed.loads if len(shapes) > len(forces) else ()):  # with M <= p every shape fits
        fitted = np.linalg.lstsq(shapes, load.shape, rcond=None)[0]
        if np.linalg.norm(shapes @ fitted - load.shape) < SAME * np.linalg.norm(load.shape):
            forces[:, number] = fitted
    return forces


def _modal(reed: Body) -> ModalGreens:
    modal = reed.greens.modal
    if modal is None or not modal.omega.all() or not modal.omega.size:
        raise StressError(
            f"a reed known by a {type(reed.greens).__name__} has no modes of bending; make it by cantilever_reed"
        )
    return modal


def rod_stress(result: ImpactResult, rod: GreensFunction, *, area: float, at: float = 1.0) -> Array:
    """Return the (n + 1,) axial stress, > 0 in compression [Pa], of a rod struck by ``result.force``; exact for its
    steps.

    The contact sends out the wave of particle velocity a(t) = N(t)/Z + R a(t - T); at the distance x it meets the
    wave that returns from the far end:  sigma A = Z (a(t - x/c) - R a(t - T + x/c)).  Like the force,
    ``stress[m]`` holds over the step that ends at ``result.time[m]``.

    Args:
        result: its force acts on the rod's end.
        rod: its Green's function, of an undamped uniform rod.
        area: of its section [m^2].
        at: x/l, 0 at the contact ... 1 at the far end.

    Raises:
        StressError: a body that is no undamped rod, a position off it, an area that is not positive, or a delay that is
            no multiple of the step.

    Source: Timoshenko & Goodier, Theory of Elasticity, longitudinal impact of bars.
    """
    if not 0.0 <= at <= 1.0:
        raise StressError(f"at = {at:g} is off the rod, 0 (contact) ... 1 (far end)")
    if not area > 0:
        raise StressError(f"area = {area:g} m^2 must be positive")
    uniform = rod.rod
    if uniform is None or uniform.damping_ratio != 0.0:
        raise StressError(
            f"a {type(rod).__name__} is no undamped uniform rod, in which waves keep their shape; make it by fixed_rod"
        )
    trip = _steps(2 * uniform.transit, result.dt)
    delay = _steps(at * uniform.transit, result.dt)
    outgoing = motion.reflected(result.force / uniform.impedance, uniform.reflection, trip)
    away, back = (np.concatenate([np.zeros(steps), outgoing])[: len(outgoing)] for steps in (delay, trip - delay))
    force = away - uniform.reflection * back
    return np.asarray(uniform.impedance / area * force)


def _steps(delay: float, dt: float) -> int:
    count = round(delay / dt)
    if abs(delay / dt - count) > 1e-6:
        raise StressError(
            f"the wave needs {delay:g} s, {delay / dt:.6g} steps of {dt:g} s, not a whole number; "
            f"use dt = {delay / max(count, 1):.17g} s"
        )
    return count


def displacement_response(rod: ExactRod, t: ArrayLike, *, at: float) -> Array:
    """Return S(x, t) [m/N]: displacement at ``at`` = x/l (0 contact ... 1 far end) after a unit force set on at t = 0.

    Undamped, the wavefronts and their images behind both ends (T = 2 l/c, R of the particle velocity at the far end):

        S = (1/Z) sum_k R^k [<t - x/c - kT> + R <t + x/c - (k+1)T>],   <s> = max(s, 0).

    With uniform modal damping zeta, q = exp(lambda t), theta = pi x/(2l), chi_2 Legendre's function:

        S = (l - x)/(EA) + 2/(pi Z sqrt(1 - zeta^2)) Im [(chi_2(q e^(i theta)) + chi_2(q e^(-i theta)))/lambda].

    Raises:
        GreensFunctionError: a position off the rod.

    Source: d'Alembert's solution, e.g. Graff, Wave Motion in Elastic Solids, ch. 2; the damped form is derived from the
    modal sum as `DampedFixedRod` is.
    """
    return rod.displacement_at(np.maximum(np.asarray(t, dtype=float), 0.0), on_rod(at))


def force_response(rod: ExactRod, t: ArrayLike, *, at: float) -> Array:
    """Return E(x, t), (n,), the ratio of the axial force -EA du/dx at ``at`` = x/l to a force set on at ``t`` = 0.

    It is > 0 in compression. Undamped: E = sum_k R^k [H(t - x/c - kT) - R H(t + x/c - (k+1)T)]; right-continuous.
    Damped: minus the derivative of `displacement_response` along x, in closed form; its limit from the right at t = 0.
    Raises `GreensFunctionError` off the rod.
    """
    return rod.force_at(np.maximum(np.asarray(t, dtype=float), 0.0), on_rod(at))


def rod_displacement(rod: ExactRod, force: Array, dt: float, *, at: float) -> Array:
    """Return the (n + 1,) displacement [m] at ``at`` = x/l under ``force`` (n + 1,) [N] on the rod's end; exact.

    ``force[m]`` is constant over the step that ends at m ``dt`` and pushes into the rod, as in `ImpactResult`; > 0 is
    the direction of the force, so `ImpactResult.target_displacement` is minus this at ``at`` = 0.

    Raises:
        GreensFunctionError: a position off the rod.
    """
    steps = displacement_response(rod, dt * np.arange(len(force)), at=at)
    return _superposed(np.diff(steps), force)


def rod_axial_force(rod: ExactRod, force: Array, dt: float, *, at: float) -> Array:
    """Return the (n + 1,) axial force [N] at ``at`` = x/l, > 0 in compression, under ``force`` as in
    `rod_displacement`.

    The value at the middle of the step that ends at m ``dt``; where the delays x/c and 2l/c are whole numbers of steps
    it holds over the whole step and is `impact.rod_stress` times the area. Raises `GreensFunctionError` off the rod.
    """
    return axial_force(force, dt, lambda time: force_response(rod, time, at=at))


def axial_force(force: Array, dt: float, response: Callable[[Array], Array]) -> Array:
    """Return the (n + 1,) axial force [N] of `rod_axial_force`, the sum of (N_m - N_(m - 1)) E(t - (m - 1) dt).

    ``response`` is E at times (n,) >= 0 [s], the axial force at x per unit of a step force on the end; for an infinite
    rod H(t - x/c).
    """
    middle = dt * (np.arange(len(force)) - 0.5)
    steps = np.where(middle < 0, 0.0, response(np.maximum(middle, 0.0)))
    return _superposed(np.diff(steps), force)


def fixed_rod_modes(rod: ExactRod, n_modes: int, *, at: tuple[float, ...] = (), residual: bool = False) -> ModalGreens:
    """Return a fixed rod by its lowest modes; ports: the contact, then the positions ``at`` (x/l).

    phi_n(x) = sqrt(2/(rho A l)) cos(omega_n x/c), omega_n = (2n - 1) pi c/(2l), all with the rod's damping ratio.
    S_x0(t), the displacement at x after a unit force at the contact, converges like 1/n. ``residual`` adds, at
    the contact only, the exponential that restores the static compliance and g(0+).

    Raises:
        GreensFunctionError: a rod that is not fixed, no modes, a position off the rod, ``residual`` with positions.
    """
    uniform = rod.rod
    if uniform.reflection != -1.0:
        raise GreensFunctionError(
            f"reflection = {uniform.reflection:g} at the far end must be -1: only a fixed rod has these modes"
        )
    if n_modes < 1:
        raise GreensFunctionError(f"n_modes = {n_modes} must be at least 1")
    if residual and at:
        raise GreensFunctionError("a residual with g(0+) is known at the contact only: leave out at, or the residual")
    transit, places = uniform.transit, np.array([0.0, *map(on_rod, at)])
    omega = np.asarray((2.0 * np.arange(1, n_modes + 1) - 1.0) * math.pi / (2 * transit), dtype=np.float64)
    shapes = math.sqrt(2 / (uniform.impedance * transit)) * np.cos(omega[:, None] * transit * places)
    compliance = transit / uniform.impedance - math.fsum((shapes[:, 0] / omega) ** 2)
    rest = Residual.exponential(compliance, rod.initial_value()) if residual else Residual.none(len(places))
    return ModalGreens(
        omega,
        np.full(n_modes, uniform.damping_ratio),
        np.asarray(shapes),
        rest,
        port_names=("contact", *(f"x/l = {x:g}" for x in at)),
        error=ErrorEstimate(),
        origin={"kind": "fixed_rod_modes", "n_modes": n_modes, "rod": dict(rod.provenance)},
    )


def modal_displacement(greens: GreensFunction, force: Array, dt: float, *, port: str | int = 0) -> Array:
    """Return the (n + 1,) displacement [m] of ``port`` under ``force`` (n + 1,) [N] on the first port; exact for its
    steps."""
    steps = greens.step_response(dt * np.arange(len(force)), greens.port_index(port), 0)
    return _superposed(np.diff(steps), force)


def _superposed(weights: Array, force: Array) -> Array:
    return np.concatenate([[0.0], history.convolve(weights, force[1:])])
