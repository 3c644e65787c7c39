"""Small bodies, in units that make their exact motion plain, and what is read off every run."""

import numpy as np
from scipy.linalg import expm

from impact import Body, ContactProblem, ImpactResult, ModalGreens, ModalState, Residual, rigid_mass, solve
from impact.bodies.body import Load
from impact.exact.closed_form import DelayRod
from impact.greens.base import Array
from impact.march.history import Engine
from impact.march.laws import Law

FIXED_ROD = DelayRod(1.0, 2.0, -1.0)  # Z = 1, transit l/c = 1, hence stiffness 1 and mass 1
FREE_ROD = DelayRod(1.0, 2.0, 1.0)  # the same, nothing holds its end
FIRST_BLOW = 1.0 + 2.0 * float(np.exp(-1.0 - np.exp(-2.0) / 2))
"""Impulse of a unit mass at unit speed on `FIXED_ROD`: N = exp(-t) up to t = 2, then (2 + exp(-2) - 2 s) exp(-s),
s = t - 2, up to s = 1 + exp(-2)/2 (d'Alembert, by steps of the round trip)."""


def modal_rod(n: int, *, zeta: float = 0.0, rest: str = "exponential") -> ModalGreens:
    """Return `FIXED_ROD` by its ``n`` lowest modes and the residual of a kind ("exponential", "spring", "none")."""
    omega = np.asarray((np.arange(n) + 0.5) * np.pi, dtype=np.float64)
    rest_share = max(1.0 - float(np.sum(2.0 / omega**2)), 0.0)
    residual = {
        "exponential": Residual.exponential(rest_share, 1.0),
        "spring": Residual.spring(rest_share),
        "none": Residual.none(),
    }
    return ModalGreens(
        np.asarray(omega, dtype=np.float64), np.full(n, zeta), np.full((n, 1), np.sqrt(2.0)), residual[rest]
    )


def oscillator(
    omega: float, mass: float = 1.0, *, zeta: float = 0.0, x: float = 0.0, v: float = 0.0, push: float = 0.0
) -> Body:
    """Return one mode of modal ``mass``, released at ``x`` with velocity ``v``, under a steady force ``push``."""
    shape = np.array([[1.0 / np.sqrt(mass)]])
    greens = ModalGreens(np.array([omega]), np.array([zeta]), shape, Residual.none())
    root = np.sqrt(mass)
    state = ModalState(np.array([x * root]), np.array([v * root])) if x or v else None
    return Body(greens, state=state, loads=(steady(shape[0], push),) if push else ())


def pushed_mass(mass: float, velocity: float, push: float) -> Body:
    """Return a rigid mass under a steady force."""
    free = rigid_mass(mass=mass, velocity=velocity)
    return Body(free.greens, velocity=velocity, loads=(steady(np.array([1.0 / np.sqrt(mass)]), push),))


def steady(shape: Array, force: float) -> Load:
    """Return a force that never changes."""
    return Load(shape, lambda t: np.full(np.shape(t), force))


def dashpot(impedance: float) -> Body:
    """Return a semi-infinite rod: g = 1/Z for ever."""
    shape = np.array([[1.0 / np.sqrt(impedance)]])
    none = np.zeros(0)
    return Body(ModalGreens(none, none, np.zeros((0, 1)), Residual(shape, np.zeros(1), np.zeros((1, 1)))))


def rigid_wall() -> Body:
    """Return a body of which nothing moves."""
    none = np.zeros(0)
    return Body(ModalGreens(none, none, np.zeros((0, 1)), Residual.none()))


def run(
    striker: Body,
    target: Body,
    law: Law,
    dt: float,
    steps: int,
    *,
    gap: float = 0.0,
    rule: str = "passive",
    engine: Engine = "auto",
) -> ImpactResult:
    """March one contact over ``steps`` steps."""
    problem = ContactProblem(striker, target, gap=gap, law=law)
    return solve(problem, dt=dt, duration=dt * steps, rule=rule, engine=engine)


def said(result: ImpactResult) -> tuple[str, ...]:
    """Return the advice that came with the result."""
    return tuple(str(advice) for advice in result.advice)


def relative(ours: float, exact: float) -> float:
    """Return |ours/exact - 1|."""
    return abs(ours - exact) / abs(exact)


def clinging_force(greens: ModalGreens, mass: float, t: float) -> float:
    """Return the force at ``t`` of a mass that strikes at unit speed and has not left: matrix exponential, no step.

    With one relaxation a^2 exp(-r t) and states v of the mass, q, q' of the modes and y' = N - r y, the velocities at
    the contact agree:  v = sum phi q' + a^2 (N - r y),  thus N; and m v' = -N.
    """
    m = len(greens.omega)
    start, rate = float(greens.residual.shapes[0, 0] ** 2), float(greens.residual.rates[0])
    phi = greens.shapes[:, 0]
    force = np.concatenate([[1.0], np.zeros(m), -phi, [start * rate]]) / start
    matrix = np.zeros((2 * m + 2, 2 * m + 2))
    matrix[0] = -force / mass
    matrix[1 : m + 1, m + 1 : 2 * m + 1] = np.eye(m)
    matrix[m + 1 : 2 * m + 1] = np.outer(phi, force)
    matrix[m + 1 : 2 * m + 1, 1 : m + 1] -= np.diag(greens.omega**2)
    matrix[m + 1 : 2 * m + 1, m + 1 : 2 * m + 1] -= np.diag(2 * greens.zeta * greens.omega)
    matrix[-1] = force
    matrix[-1, -1] -= rate
    state = np.zeros(2 * m + 2)
    state[0] = 1.0
    return float(force @ expm(matrix * t) @ state)


def sprung_force(greens: ModalGreens, mass: float, dt: float, n: int) -> Array:
    """Return forces at dt, ... n dt of a mass that strikes a body with a bare compliance c at unit speed, and stays.

    With states x, x' of the mass and q, q' of the modes: N = (x - sum phi q)/c, m x'' = -N, powers of one exponential.
    """
    m, phi = len(greens.omega), greens.shapes[:, 0]
    force = np.concatenate([[1.0, 0.0], -phi, np.zeros(m)]) / float(greens.residual.compliance[0, 0])
    matrix = np.zeros((2 * m + 2, 2 * m + 2))
    matrix[0, 1] = 1.0
    matrix[1] = -force / mass
    matrix[2 : m + 2, m + 2 :] = np.eye(m)
    matrix[m + 2 :] = np.outer(phi, force)
    matrix[m + 2 :, 2 : m + 2] -= np.diag(greens.omega**2)
    matrix[m + 2 :, m + 2 :] -= np.diag(2 * greens.zeta * greens.omega)
    step, state, out = expm(matrix * dt), np.zeros(2 * m + 2), np.empty(n)
    state[1] = 1.0
    for k in range(n):
        state = step @ state
        out[k] = force @ state
    return out
