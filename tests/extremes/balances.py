"""What every run must satisfy, whatever its numbers: motion, law and energy, evaluated another way than the march's."""

import math

import numpy as np

from impact import ContactProblem, Hertz, ImpactResult, LinearSpring, ModalGreens, Signorini
from impact.greens import oscillator
from impact.greens.base import Array
from impact.march.laws import Law

EPS = float(np.finfo(float).eps)


def replayed(problem: ContactProblem, force: Array, dt: float) -> tuple[Array, Array]:
    """Return gaps at the last 40 times (k, p) by closed forms, and the sizes of the terms they are the sum of."""
    n, p = len(force) - 1, force.shape[1]
    t = np.asarray(dt * np.arange(n + 1), dtype=np.float64)
    last = np.arange(max(n + 1 - 40, 1), n + 1)
    out = np.tile([c.gap for c in problem.contacts], (len(last), 1))
    size = np.abs(out)
    free, free_size = _free(problem, t[last])
    out, size = out + free, size + free_size
    for i in range(p):
        for j in range(p):
            rise = problem.striker.greens.step_response(t, i, j) + problem.target.greens.step_response(t, i, j)
            rise[0] = 0.0  # before the force: a bare compliance answers at once
            steps = np.diff(rise)
            for row, k in enumerate(last):
                terms = steps[k - 1 :: -1][:k] * force[1 : k + 1, j]
                out[row, i] += math.fsum(terms)
                size[row, i] += np.abs(terms).sum() + np.abs(rise[: k + 1]).max() * np.abs(force[1 : k + 1, j]).max()
    return out, np.maximum(size, np.finfo(float).tiny * 1e30)


def _free(problem: ContactProblem, t: Array) -> tuple[Array, Array]:
    """Return the striker's motion without contact, (k, p): v h(t) + F S(t) of its mode and steady load."""
    body, ones = problem.striker, np.ones((1, len(problem.contacts)))
    g = body.greens
    velocity = body.velocity if body.state is None else float(body.state.velocity[0] * g.shapes[0, 0])
    push = sum(float(load.amplitude(np.zeros(1))[0]) for load in body.loads)
    swing = oscillator.impulse_response(t, g.omega[0], g.zeta[0]) * velocity
    pressed = push * g.step_response(t)
    size = (np.abs(swing) + np.abs(pressed) + EPS * abs(velocity) * t)[:, None]
    return (swing + pressed)[:, None] * ones, np.maximum.accumulate(size) * ones


def law_deviation(problem: ContactProblem, force: Array, gap: Array, limit: float) -> float:
    """Return how far the gap is from where the law's force belongs, over ``limit``."""
    worst = max(0.0, -float(force.min()) / max(float(force.max()), 1e-300) / EPS)
    for c, contact in enumerate(problem.contacts):
        n, pen = force[1:, c], -gap[1:, c]
        needed = _penetration(contact.law, n)
        if needed is None:
            continue
        pressed = n > 0
        worst = max(worst, float(np.max(np.abs(pen - needed)[pressed], initial=0.0)) / limit)
        worst = max(worst, float(np.max(pen[~pressed], initial=0.0)) / limit)
    return worst


def _penetration(law: Law, force: Array) -> Array | None:
    """Return the penetration that belongs to a force, where a law has one."""
    if isinstance(law, Signorini):
        return np.zeros_like(force)
    if isinstance(law, LinearSpring):
        return force / law.stiffness
    if isinstance(law, Hertz):
        return (force / law.stiffness) ** (2 / 3)
    return None


def shaken_energy(problem: ContactProblem, force: Array, gap: Array) -> float:
    """Return the sum over the steps of the law's own force [N], of a rigid contact the force itself: times the
    round-off of a gap it is the energy that this costs."""
    total = 0.0
    for c, contact in enumerate(problem.contacts):
        pen = np.maximum(-gap[:, c], 0.0)
        if isinstance(contact.law, LinearSpring):
            total += float(np.sum(contact.law.stiffness * pen))
        elif isinstance(contact.law, Hertz):
            total += float(np.sum(contact.law.stiffness * pen**1.5))
        elif isinstance(contact.law, Signorini):
            total += float(np.sum(force[:, c]))
    return total


def energy_deviation(result: ImpactResult, shaken: float) -> float:
    """Return energy given by contacts, or unaccounted for, over n eps of the largest term and the gap's round-off."""
    e = result.energy
    largest = max(float(np.max(np.abs(e.striker) + np.abs(e.target) + np.abs(e.contact) + np.abs(e.input))), 1e-300)
    lost = e.contact_loss
    given = float(np.max(np.maximum.accumulate(lost) - lost))
    missing = float(np.max(np.abs(e.input - e.stored - e.dissipated)))
    return max(given, missing) / (largest * EPS * (1e4 + 64 * len(result.time)) + shaken)


def highest_frequency(problem: ContactProblem) -> float:
    """Return the highest frequency of both bodies [rad/s]: over a time t its phase is known to eps w t."""
    frequencies = [float(b.greens.omega.max()) for b in problem.bodies if isinstance(b.greens, ModalGreens)]
    return max(frequencies)
