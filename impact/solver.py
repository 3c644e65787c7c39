"""Unilateral contact between two bodies known by their Green's functions.

At the end of each step   gap = gap0 + free_striker - free_target + (g_s + g_t) * N,   N = law(-gap) >= 0,

with N constant over the step and the convolutions exact for such N. With the law taken at the end of the step the
energy of the two bodies and the contact never grows, whatever the step (convexity of the law's potential).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from impact import history
from impact.body import Body
from impact.energy import EnergyLedger, body_energy
from impact.greens import Array, StepKernel
from impact.laws import Law, Signorini
from impact.modal import ModalGreens
from impact.progress import Progress, silent
from impact.result import Advice, ImpactResult

RESOLUTION_LIMIT = 0.5  # w_max h: above it the step's own damping is felt in the highest retained mode


class ContactError(ValueError):
    """A contact problem that cannot be solved as posed; the message says what to change."""


@dataclass(frozen=True)
class ContactProblem:
    """Striker against target along one normal.

    Attributes:
        striker, target: the bodies.
        gap: opening of the undeformed bodies [m].
        law: contact law.
        striker_port, target_port: which port of each body touches (name or index).
    """

    striker: Body
    target: Body
    gap: float = 0.0
    law: Law = field(default_factory=Signorini)
    striker_port: str | int = 0
    target_port: str | int = 0

    def __post_init__(self) -> None:
        if not math.isfinite(self.gap):
            raise ContactError(f"gap = {self.gap} m must be finite")
        self.striker.greens.port_index(self.striker_port)
        self.target.greens.port_index(self.target_port)


@dataclass(frozen=True)
class _Side:
    """One body at one step: its kernel, poles, and motion without contact."""

    body: Body
    port: int
    kernel: StepKernel
    recursion: history.Recursion
    free: Array
    pole_weight: float

    @staticmethod
    def of(body: Body, port: str | int, dt: float, n: int) -> _Side:
        i = body.greens.port_index(port)
        kernel = body.greens.step_kernel(dt, n)
        free = np.zeros(n + 1)
        recursion, weight = history.Recursion.empty(), 0.0
        if kernel.modal is not None:
            modal = kernel.modal
            zero = np.zeros(len(modal.omega))
            q, p = zero, zero
            if isinstance(body.greens, ModalGreens):
                start = body.modal_start()
                q, p = start.displacement, start.velocity
            free[0] = float(modal.shapes[:, i] @ q)
            recursion = history.Recursion.of(modal, i, dt, q, p)
            weight = float(modal.step_matrix(dt)[i, i])
        if not isinstance(body.greens, ModalGreens) and body.velocity != 0.0:
            free = _times(n, dt) * np.float64(body.velocity)
        return _Side(body, i, kernel, recursion, free, weight)

    @property
    def weights(self) -> Array:
        """Step weights at the port, empty for a modal body."""
        return np.zeros(0) if self.kernel.weights is None else self.kernel.weights[self.port, self.port]

    def displacement(self, from_poles: Array, force: Array) -> Array:
        """(n + 1,) displacement of the contact point under ``force`` along the normal."""
        out = self.free.copy()
        if self.kernel.modal is not None:
            out[1:] += from_poles
        if self.weights.size:
            out[1:] += history.convolve(self.weights, force)
        return out


def solve(
    problem: ContactProblem, *, dt: float, duration: float, block: int = history.BLOCK, progress: Progress = silent
) -> ImpactResult:
    """March the contact problem over ``duration`` [s] with the step ``dt`` [s].

    Passive and first order at force jumps and separation, second order between them. ``block`` is the length in steps
    over which step weights are summed directly (at least the number of steps: the direct sum throughout).

    Raises:
        ContactError: a step or duration that is not positive; two bodies without any immediate response
            (no residual flexibility and no g(0+)) under a rigid law, whose force would grow like 1/dt.
    """
    n = _steps(dt, duration)
    striker = _Side.of(problem.striker, problem.striker_port, dt, n)
    target = _Side.of(problem.target, problem.target_port, dt, n)
    _refuse_ill_posed(problem)
    weights = _combined(striker.weights, target.weights)
    own_weight = striker.pole_weight + target.pole_weight + (float(weights[0]) if weights.size else 0.0)
    # motion without contact that the march does not produce itself
    free = problem.gap + np.where(striker.kernel.modal is None, striker.free, 0.0)
    free = free - np.where(target.kernel.modal is None, target.free, 0.0)
    force, u_s, u_t, memory = np.zeros(n), np.zeros(n), np.zeros(n), np.zeros(n if weights.size else 0)
    own = (own_weight, striker.pole_weight, target.pole_weight)
    law = (problem.law.code, problem.law.parameters[0])
    chunk = block if weights.size else max(block, -(-n // 50))
    for done, first in enumerate(range(0, n, chunk), start=1):
        last = min(first + chunk, n)
        history.march(
            first, last, _arrays(striker), _arrays(target), free[1:], memory, weights, own, law, force, u_s, u_t
        )
        if weights.size:
            history.fold_block(memory, force, weights, done, chunk)
        progress("stepping", last / n)
    return _collect(problem, striker, target, dt, force, u_s, u_t)


def _arrays(side: _Side) -> tuple[Array, Array, Array, Array, Array, Array]:
    r = side.recursion
    return (r.coefficients, r.q, r.p, r.decay, r.gain, r.y)


def _collect(
    problem: ContactProblem, striker: _Side, target: _Side, dt: float, force: Array, u_s: Array, u_t: Array
) -> ImpactResult:
    us, ut = striker.displacement(u_s, force), target.displacement(u_t, -force)
    gap = problem.gap + us - ut
    energy = _ledger(problem, striker, target, dt, force, us, ut, gap)
    return ImpactResult(
        time=_times(len(force), dt),
        force=np.concatenate([[0.0], force]),
        gap=gap,
        striker_displacement=us,
        target_displacement=ut,
        energy=energy,
        dt=dt,
        striker_mass=problem.striker.mass,
        target_mass=problem.target.mass,
        striker_velocity=problem.striker.velocity,
        target_velocity=problem.target.velocity,
        engine=f"striker: {striker.kernel.engine}; target: {target.kernel.engine}",
        advice=_advice(problem, dt, energy),
    )


def _ledger(
    problem: ContactProblem, striker: _Side, target: _Side, dt: float, force: Array, us: Array, ut: Array, gap: Array
) -> EnergyLedger:
    parts = [
        body_energy(side.body, side.kernel, sign * force, u, dt, side.port)
        for side, sign, u in ((striker, 1.0, us), (target, -1.0, ut))
    ]
    potential = problem.law.potential(-gap)
    loss = np.concatenate([[0.0], np.cumsum(-force * np.diff(gap) - np.diff(potential))])
    start = parts[0].stored[0] + parts[1].stored[0] + potential[0]
    return EnergyLedger(
        input=np.full(len(gap), start),
        striker=parts[0].stored,
        target=parts[1].stored,
        contact=potential,
        dissipated=parts[0].dissipated + parts[1].dissipated + loss,
        contact_loss=loss,
        by_work=tuple(name for name, part in zip(("striker", "target"), parts, strict=True) if part.by_work),
    )


def _advice(problem: ContactProblem, dt: float, energy: EnergyLedger) -> tuple[Advice, ...]:
    found = []
    for name, body in (("striker", problem.striker), ("target", problem.target)):
        g = body.greens
        highest = float(g.omega.max()) if isinstance(g, ModalGreens) and len(g.omega) else 0.0
        if highest * dt > RESOLUTION_LIMIT:
            lost = float(energy.contact_loss[-1] / max(energy.input[-1], np.finfo(float).tiny))
            found.append(
                Advice(
                    f"highest {name} frequency times step",
                    highest * dt,
                    RESOLUTION_LIMIT,
                    f"the step damps the highest modes; contact and step together took {lost:.1%} of the energy",
                    f"use dt <= {RESOLUTION_LIMIT / highest:.2g} s, or fewer modes",
                )
            )
    return tuple(found)


def _steps(dt: float, duration: float) -> int:
    for name, value in (("dt", dt), ("duration", duration)):
        if not (value > 0 and math.isfinite(value)):
            raise ContactError(f"{name} = {value} s must be positive and finite")
    if duration < dt * (1 - 1e-9):
        raise ContactError(f"duration = {duration:g} s is shorter than one step, dt = {dt:g} s")
    return math.ceil(duration / dt * (1 - 1e-12))


def _refuse_ill_posed(problem: ContactProblem) -> None:
    if not isinstance(problem.law, Signorini):
        return
    starts = [
        float(b.greens.initial_value()[b.greens.port_index(port), b.greens.port_index(port)])
        for b, port in ((problem.striker, problem.striker_port), (problem.target, problem.target_port))
    ]
    from_power = any(not isinstance(b.greens, ModalGreens) for b in (problem.striker, problem.target))
    if max(starts) <= 0 and not from_power:
        raise ContactError(
            "neither body yields at once (no residual flexibility, g(0+) = 0) and the law is rigid: the force would "
            "grow like 1/dt; add a residual (impact.Residual) or use a compliant law (impact.Hertz, ...)"
        )


def _times(n: int, dt: float) -> Array:
    return np.asarray(dt * np.arange(n + 1), dtype=np.float64)


def _combined(a: Array, b: Array) -> Array:
    if a.size and b.size:
        return a + b
    return a if a.size else b
