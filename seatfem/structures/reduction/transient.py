"""Reduction by time integration of the full model, for any damping matrix.

A constant unit force acts on the port from t = 0 on; the port's displacement is the step response S, its velocity g.
Newmark's average acceleration with step h needs one factorization,

    (M + h/2 C + h^2/4 K) v_{n+1} = M v_n - h/2 C v_n - h K (u_n + h/4 v_n) + h F,   u_{n+1} = u_n + h/2 (v_n + v_{n+1})

and u is the integral of the piecewise linear v, so the samples of v are a `SampledGreens` whose step response is
exactly the integrator's. The first step consists of two backward Euler steps of h/2, with the same matrix, which damp
the frequencies that h does not resolve; the order remains two. Source: Rannacher, Numer. Math. 43 (1984).
"""

import math
from dataclasses import dataclass

import numpy as np

from impact.greens import base, oscillator
from impact.greens.sampled import SampledGreens
from impact.notices import Progress, silent
from seatfem.structures.method import Aims
from seatfem.structures.model import Array, Damping, ModelError, SecondOrderModel, as_csr
from seatfem.structures.reduction import eigen_search, modes
from seatfem.structures.reduction.factorization import Backend, FactorizationError, factorize, static_compliance
from seatfem.structures.reduction.reducer import Cost, Reducer, Reduction, feeding, reciprocity


def march(
    model: SecondOrderModel, dt: float, n_steps: int, *, backend: Backend = "auto", progress: Progress = silent
) -> Array:
    """Return the (p, p, n_steps + 1) velocities of the ports under unit step forces, samples of g [m/(N s)], symmetric
    to round-off."""
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


@dataclass(frozen=True)
class Transient(Reducer):
    """Reduction to samples of g by time stepping, accurate to the tolerance after the Hann pulse of the bandwidth.

    The runs with h and 2 h differ by three times the error of h (second order). Half of the difference is stated as the
    error, as 2 h is coarse; h is halved until it is within the tolerance. The first h has a phase error w T (w h)^2/12
    at the bandwidth equal to the tolerance.

    Attributes:
        most: most steps; if more are needed, `reduce` raises `ConvergenceError`.
    """

    most: int = 100_000

    name = "transient"
    oscillators = False

    def refusal(self, model: SecondOrderModel, damping: Damping, aims: Aims) -> str:
        """Return why it cannot be used: damping is to be a matrix C that adds no energy, no function of frequency."""
        if model.loss is not None and model.loss.nnz:
            return (
                "loss factors (structural damping) are defined by the frequency and cannot be stepped in time; use "
                "method='krylov', or 'second_order' if there are dashpots too"
            )
        if damping.ratio > 0:
            return (
                f"damping_ratio = {damping.ratio:g} cannot be stepped in time: uniform modal damping is a function of "
                "M^-1 K and has no sparse C; use method='krylov' or 'modes', or give the model a C"
            )
        return feeding(model, damping)

    def cost(self, model: SecondOrderModel, aims: Aims) -> Cost:
        """Return an infinite cost, as a last resort: samples end with the duration and are slow in the solver."""
        return Cost(math.inf, "time steps")

    def reduce(self, model: SecondOrderModel, damping: Damping, aims: Aims, progress: Progress = silent) -> Reduction:
        """Reduce as `Reducer.reduce`; the damping is the model's C."""
        duration, width, tolerance = aims.duration, aims.width, aims.tolerance
        h = min(np.sqrt(12 * tolerance / (aims.band**3 * duration)), width / 20)
        n = 2 * int(np.ceil(duration / h / 2))
        t = oscillator.error_times(duration, width)
        if n > self.most:
            raise modes.ConvergenceError(
                f"{n} steps would be needed (limit {self.most}): lower the bandwidth or duration, or use "
                "method='krylov'"
            )
        coarse = _run(model, duration, n // 2, aims.backend, silent)
        while True:
            fine = _run(model, duration, n, aims.backend, progress)
            after, before = fine.filtered_matrix(t, width), coarse.filtered_matrix(t, width)
            error = float(np.abs(after - before).max()) / 2 / float(np.abs(after).max())
            if error <= tolerance:
                break
            n, coarse = 2 * n, fine
            if n > self.most:
                raise modes.ConvergenceError(
                    f"{n // 2} steps leave an error of {error:.1e} (tolerance {tolerance:.1e}), over {self.most} "
                    "would be needed: lower the bandwidth or the duration, or use method='krylov'"
                )
        progress("stepping", 1.0)
        static, known = _static(model, aims.backend), base.ErrorEstimate(reduction=error)
        origin = {"steps": n, "step_s": duration / n, **fine.origin}
        return Reduction(SampledGreens(fine.values, fine.dt, "forbid", model.port_names, static, known, origin))


def _run(model: SecondOrderModel, duration: float, n: int, backend: Backend, progress: Progress) -> SampledGreens:
    dt = duration / n
    g = march(model, dt, n, backend=backend, progress=progress)
    origin = {"checks": {"reciprocity": reciprocity(g)}}
    return SampledGreens((g + g.transpose(1, 0, 2)) / 2, dt, port_names=model.port_names, origin=origin)


def _refuse_indefinite(model: SecondOrderModel, backend: Backend) -> None:
    """Raise `ModelError` for an indefinite K; for a free body K + s^2 M is positive definite."""
    try:
        factorize(model.K + 1e-6 * eigen_search.default_shift(model) ** 2 * model.M, backend=backend, name="K + s^2 M")
    except FactorizationError as error:
        raise ModelError("K is indefinite, the body would gain energy; check its constraints") from error


def _static(model: SecondOrderModel, backend: Backend) -> Array:
    """Return the (p, p) B' K^-1 B [m/N]; (0, 0) if the body can move freely."""
    try:
        return static_compliance(model, backend)
    except FactorizationError:
        _refuse_indefinite(model, backend)
        return np.zeros((0, 0))
