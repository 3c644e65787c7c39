"""The third road to a Green's function: a time integrator that knows nothing of modes.

A unit force is switched on at the port at t = 0 and held; the port's displacement is the step response S, its
velocity is g. Newmark's average acceleration with step h needs one factorization,

    (M + h/2 C + h^2/4 K) v_{n+1} = M v_n - h/2 C v_n - h K (u_n + h/4 v_n) + h F,   u_{n+1} = u_n + h/2 (v_n + v_{n+1})

and keeps u equal to the integral of the piecewise-linear v, so the samples of v are a `SampledGreens` whose
step response is exactly the integrator's. The first step is made of two backward Euler halves, which have the same
matrix: they quench the frequencies that h cannot resolve and the order stays two. Source: Rannacher,
Numer. Math. 43 (1984).
"""

from __future__ import annotations

import numpy as np

from impact.greens.base import ErrorEstimate
from impact.greens.pulse import error_times
from impact.greens.sampled import SampledGreens
from impact.progress import Progress, silent
from seatfem.structures.model import Array, ModelError, SecondOrderModel, as_csr
from seatfem.structures.reduction.checks import reciprocity
from seatfem.structures.reduction.factorization import Backend, FactorizationError, factorize
from seatfem.structures.reduction.modes import ConvergenceError
from seatfem.structures.reduction.rigid import default_shift


def march(
    model: SecondOrderModel, dt: float, n_steps: int, *, backend: Backend = "auto", progress: Progress = silent
) -> Array:
    """(p, p, n_steps + 1) velocities of the ports under unit step forces at t = 0, dt, ...: samples of g [m/(N s)].

    Symmetric to the round-off of the solves.
    """
    M, K, B = model.M, model.K, model.port_matrix
    C = as_csr((model.size, model.size)) if model.C is None else model.C
    factor = factorize(M + dt / 2 * C + dt**2 / 4 * K, backend=backend, name="M + h/2 C + h^2/4 K")
    u, v, g = np.zeros(B.shape), np.zeros(B.shape), np.zeros((B.shape[1], B.shape[1], n_steps + 1))
    for half in range(2):  # backward Euler
        v = factor.solve(M @ v + dt / 2 * (B - K @ u))
        u = u + dt / 2 * v
        g[:, :, half] = B.T @ v  # at 0: the constant that gives the same displacement over the first half
    for n in range(1, n_steps):
        new = factor.solve(M @ v - dt / 2 * (C @ v) - dt * (K @ (u + dt / 4 * v)) + dt * B)
        u, v = u + dt / 2 * (v + new), new
        g[:, :, n + 1] = B.T @ v
        if n % 50 == 0:
            progress("stepping", n / n_steps)
    return g


def transient_greens(
    model: SecondOrderModel,
    *,
    bandwidth: float,
    duration: float,
    tolerance: float,
    backend: Backend = "auto",
    max_steps: int = 100_000,
    progress: Progress = silent,
) -> SampledGreens:
    """Samples of g by time stepping, accurate to the tolerance after the Hann pulse of ``bandwidth``.

    The runs with h and 2 h differ by three times the error of h (second order). Half of the difference is stated, as
    2 h is coarse; h is halved until that is within the tolerance. The first h is the one whose phase error
    w T (w h)^2/12 at the bandwidth is the tolerance.
    Damping is the model's C, of any kind; uniform modal damping has no sparse C and cannot be stepped.

    Raises:
        ModelError: C feeds energy.
        ConvergenceError: more than ``max_steps`` steps would be needed.
    """
    if model.C is not None and model.C.diagonal().min() < 0:
        raise ModelError(f"C has a diagonal value {model.C.diagonal().min():g}: it would feed energy")
    w, width = 2 * np.pi * bandwidth, 1 / bandwidth
    h = min(np.sqrt(12 * tolerance / (w**3 * duration)), width / 20)
    n = 2 * int(np.ceil(duration / h / 2))
    t = error_times(duration, width)
    if n > max_steps:
        raise ConvergenceError(
            f"{n} steps would be needed (limit {max_steps}): lower the bandwidth or duration, or use method='krylov'"
        )
    coarse = _run(model, duration, n // 2, backend, silent)
    while True:
        fine = _run(model, duration, n, backend, progress)
        pairs = np.ndindex(*fine.values.shape[:2])
        after = [(fine.filtered(t, width, i, j), coarse.filtered(t, width, i, j)) for i, j in pairs]
        scale = max(float(np.abs(a).max()) for a, _ in after)
        error = max(float(np.abs(a - b).max()) for a, b in after) / 2 / scale
        if error <= tolerance:
            progress("stepping", 1.0)
            origin = {"steps": n, "step_s": duration / n, **fine.origin}
            known = ErrorEstimate(reduction=error)
            return SampledGreens(
                fine.values, fine.dt, "forbid", model.port_names, _static(model, backend), known, origin
            )
        n, coarse = 2 * n, fine
        if n > max_steps:
            raise ConvergenceError(
                f"{n // 2} steps leave an error of {error:.1e} (tolerance {tolerance:.1e}), over {max_steps} would "
                "be needed: lower the bandwidth or the duration, or use method='krylov'"
            )


def _run(model: SecondOrderModel, duration: float, n: int, backend: Backend, progress: Progress) -> SampledGreens:
    dt = duration / n
    g = march(model, dt, n, backend=backend, progress=progress)
    origin = {"checks": {"reciprocity": reciprocity(g)}}
    return SampledGreens((g + g.transpose(1, 0, 2)) / 2, dt, port_names=model.port_names, origin=origin)


def _refuse_indefinite(model: SecondOrderModel, backend: Backend) -> None:
    """A body that is merely free to move has a positive definite K + s^2 M for any s > 0, however small."""
    try:
        factorize(model.K + 1e-6 * default_shift(model) ** 2 * model.M, backend=backend, name="K + s^2 M")
    except FactorizationError as error:
        raise ModelError("K is indefinite: the body would gain energy") from error


def _static(model: SecondOrderModel, backend: Backend) -> Array | None:
    """(p, p) B' K^-1 B [m/N]; ``None`` if the body can move freely."""
    try:
        compliance = model.port_matrix.T @ factorize(model.K, backend=backend, name="K").solve(model.port_matrix)
    except FactorizationError:
        _refuse_indefinite(model, backend)
        return None
    return (compliance + compliance.T) / 2
