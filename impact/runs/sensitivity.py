"""Derivatives of a run by its parameters, from the linearised discrete time integration, for any Green's function.

With W the step weights of all bodies, each step solves, contact by contact,

    gap_n+1 = free_n+1 + sum_(m<=n) W_(n-m) F_m,   F_n = law(-gap_n+1, -gap_n, the deepest closure so far),

so that the derivative is a time integration with the same weights and a linear law:

    dF_n = a dpen_n+1 + b dpen_n + c ddeepest + s,   dgap_n+1 = f_n+1 + sum_(m<=n) W_(n-m) dF_m.

f is the derivative of the gaps at constant forces, by gaps, motion without contact, loads and the Green's functions
(dg/dp * F); s that of the law at constant penetrations. Both are central differences of data that are smooth in the
parameter; the time integration, which is not, is differentiated analytically. Open steps have no derivative: a step
that closes or opens between p and p + dp is not taken into account.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from impact.greens.base import Array, convolve
from impact.march import history, laws
from impact.march.loop.joints import forces_along
from impact.march.prepared import Prepared
from impact.march.stepper import ContactStepper, march_numbers
from impact.quantities import brief

STEP: Final = 1e-5
"""Half width of central differences of a law, over the penetration; errors are its square, and eps over it."""
LEVEL: Final = 1e-9
"""Relative distance from the deepest closure within which a joint is on its loading branch."""
SOLVED: Final = 1e-6
"""Largest difference of a step's force from the law's, over the largest force, at which the run counts as solved."""


@dataclass(frozen=True)
class Neighbours:
    """The prepared problem at a slightly lower (``below``) and higher value of one parameter, ``width`` apart."""

    below: Prepared
    above: Prepared
    width: float

    __repr__ = brief


def why_no_derivative(stepper: ContactStepper) -> str:
    """Return in words why a run has no derivative; "" if it has."""
    problem = stepper.prepared.problem
    if any(contact.film for contact in problem.contacts):
        return "a film in the gap"
    if problem.preload:
        return "a preload"
    if stepper.live.follows:
        return "a load that follows the motion"
    if any(contact.law.code == laws.USER for contact in problem.contacts):
        return "a law of one's own"
    known = _Law(stepper)
    off = np.abs(known.forces(stepper.prepared) - stepper.force)[:, ~known.rigid]
    if off.size and off.max() > SOLVED * np.abs(stepper.force).max():
        return f"forces that were not found to {SOLVED:g}"
    return ""


def touches(force: Array) -> int:
    """Return the number of times that any contact closes, from the forces (n, p) of the steps."""
    closed = np.vstack([np.zeros((1, force.shape[1]), dtype=bool), force != 0])
    return int(np.count_nonzero(closed[1:] & ~closed[:-1]))


def force_sensitivities(stepper: ContactStepper, neighbours: Sequence[Neighbours]) -> Array:
    """Return the derivatives (P, n, p) of the forces of each step by P parameters [N over the unit of the parameter].

    Args:
        stepper: a finished run for which `why_no_derivative` is "".
        neighbours: one for each parameter; those that share the run's discretised bodies need no convolution.
    """
    s, law = stepper.prepared, _Law(stepper)
    n, p = stepper.force.shape
    weights = step_weights(s)
    moved, pushed = np.zeros((len(neighbours), n + 1, p)), np.zeros((len(neighbours), n, p))
    openings = np.array([contact.gap for contact in s.problem.contacts])
    for number, pair in enumerate(neighbours):
        sides = []
        for other in (pair.below, pair.above):
            if all(one is another for one, another in zip(other.bodies, s.bodies, strict=True)):
                gaps = s.free + (np.array([contact.gap for contact in other.problem.contacts]) - openings)
            else:
                gaps, own = other.free.copy(), step_weights(other)
                for c, d in np.ndindex(p, p):
                    gaps[1:, c] += convolve(own[c, d], stepper.force[:, d])
            sides.append((gaps, law.forces(other)))
        moved[number] = (sides[1][0] - sides[0][0]) / pair.width
        pushed[number] = (sides[1][1] - sides[0][1]) / pair.width
    return _tangent(weights, law, moved, pushed)


def step_weights(prepared: Prepared) -> Array:
    """Return the (p, p, n) step weights of all bodies, those advanced by poles included."""
    total = prepared.weights.copy() if prepared.weights.size else np.zeros((*prepared.own.shape, prepared.steps))
    if prepared.poles.psi.shape[1]:
        total += prepared.poles.weights(np.zeros_like(prepared.own), prepared.steps)
    total[:, :, 0] = prepared.own
    return total


class _Law:
    """The law of each contact along a run: forces of its steps as functions of penetrations, and their derivatives.

    Attributes:
        closed: (n, p) mask of the steps with a force.
        rigid: (p,) mask of rigid contacts.
        by_end, by_start, by_deepest: (n, p) derivatives of the force by the penetration at the end and at the start of
            the step and by the deepest closure [N/m]; if a step starts at the deepest closure, ``by_start`` has both.
        deepest: (n, p) deepest closures before each step, for laws with a memory; 0 if the step starts and ends there.
        further: (n, p) mask of the steps that end at a new deepest closure.
    """

    def __init__(self, stepper: ContactStepper) -> None:
        contacts, gap = stepper.prepared.problem.contacts, stepper.gap
        self.end, self.start = -gap[1:], -gap[:-1]
        self.closed = stepper.force != 0
        self.rigid = np.array([contact.law.code == laws.SIGNORINI for contact in contacts])
        self.remembers = np.array([contact.law.code >= laws.ROUGH for contact in contacts])
        self.deepest = np.zeros_like(self.end)
        deepest = np.maximum(self.start[0], 0.0) * self.remembers
        for step, end in enumerate(self.end):
            self.deepest[step] = deepest
            deepest = np.where(end > 0, np.maximum(deepest, end), 0.0) * self.remembers
        bound = self.deepest * (1 - LEVEL)
        self.further, joined = self.end >= bound, (self.start >= bound) & (self.deepest > 0)
        self.deepest[self.further & joined] = 0.0  # the force of such a step does not depend on it
        remembered = self.deepest > 0
        s, none = stepper.prepared, np.zeros_like(self.end)
        size = np.maximum(np.abs(self.end), np.abs(self.start))
        room = np.where(remembered, np.abs(self.end - self.deepest) / 2, np.inf)
        room = np.where(remembered & ~joined, np.minimum(room, np.abs(self.start - self.deepest) / 2), room)
        at_end, at_start, at_deepest = (
            np.minimum(STEP * np.where(of > 0, of, size), room)
            for of in (np.abs(self.end), np.abs(self.start), self.deepest)
        )
        self.by_end = self._slope(s, at_end, none, none)
        self.by_start = self._slope(s, none, at_start, np.where(joined & remembered, at_start, 0.0))
        self.by_deepest = self._slope(s, none, none, np.where(remembered & ~joined, at_deepest, 0.0))

    def forces(self, prepared: Prepared) -> Array:
        """Return the (n, p) forces of the laws and weights of a problem at the penetrations of the run."""
        return self._forces_at(prepared, self.end, self.start, self.deepest)

    def _forces_at(self, prepared: Prepared, end: Array, start: Array, deepest: Array) -> Array:
        """Return the same at other penetrations; zero in open steps and for rigid contacts."""
        contacts, out = prepared.problem.contacts, np.zeros_like(self.end)
        numbers, together = march_numbers([c.law.parameters for c in contacts]), np.abs(prepared.own).sum(axis=1)
        for c in np.flatnonzero(~self.rigid):
            rows = np.flatnonzero(self.closed[:, c])
            out[rows, c] = forces_along(
                contacts[c].law.code, prepared.rules[c], numbers, c, end[rows, c], start[rows, c], deepest[rows, c],
                together[c], prepared.dt,
            )  # fmt: skip
        return out

    def _slope(self, s: Prepared, end: Array, start: Array, deepest: Array) -> Array:
        """Return the derivative of the forces along these small changes of penetrations, over the largest of them."""
        above = self._forces_at(s, self.end + end, self.start + start, self.deepest + deepest)
        below = self._forces_at(s, self.end - end, self.start - start, self.deepest - deepest)
        size = np.maximum(np.maximum(end, start), deepest)
        return np.asarray(np.divide(above - below, 2 * size, out=np.zeros_like(size), where=size > 0))


def _tangent(weights: Array, law: _Law, moved: Array, pushed: Array) -> Array:
    """Integrate the derivatives; ``moved`` (P, n + 1, p) is f, ``pushed`` (P, n, p) is s."""
    count, n, p = pushed.shape
    out, gaps, deepest = np.zeros_like(pushed), np.zeros((count, p)), np.zeros((count, p))
    block = min(history.BLOCK, n)
    pasts = [history.BlockedSum(weights, block) for _ in range(count)]
    backwards = np.ascontiguousarray(weights[:, :, block::-1] if block < n else weights[:, :, ::-1])
    rest, any_closed = np.zeros(p), law.closed.any(axis=1)
    gaps[:] = moved[:, 0]
    deepest[:] = np.where(law.start[0] > 0, -gaps, 0.0)
    for step in range(n):
        first = step - step % block
        follows = any_closed[step] or (step + 1 < n and any_closed[step + 1])
        if follows:
            free = moved[:, step + 1] + np.array([past.memory[:, step] for past in pasts])
            if first < step and any_closed[first:step].any():
                lags = backwards[:, :, backwards.shape[2] - 1 - (step - first) : -1]
                free += np.einsum("cdm,amd->ac", lags, out[:, first:step], optimize=False)
        if any_closed[step]:
            own, slope = weights[:, :, 0], np.where(law.rigid, 1.0, law.by_end[step])
            known = -slope * free - law.by_start[step] * gaps + law.by_deepest[step] * deepest + pushed[:, step]
            system = np.diag(np.where(law.rigid, 0.0, 1.0)) + slope[:, None] * own
            active = np.flatnonzero(law.closed[step])
            if p == 1:
                out[:, step] = known / system
            else:
                out[:, step, active] = np.linalg.solve(system[np.ix_(active, active)], known[:, active].T).T
            free += out[:, step] @ own.T
        if follows:
            gaps = free
        deepest = np.where(law.end[step] <= 0, 0.0, np.where(law.further[step], -gaps, deepest))
        if (step + 1) % block == 0:
            for past, forces in zip(pasts, out, strict=True):
                past.fold(np.ascontiguousarray(forces.T), rest, (step + 1) // block)
    return out
