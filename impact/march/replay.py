"""Integration of modal coordinates under known forces, for energies, displacements, bending stress and free flight.

The forces are constant over each step, and every recursion is exact for such forces. It runs block by block, so that
memory does not grow with the run; the caller keeps what it needs of each block.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from impact.bodies.body import ModalState
from impact.greens import oscillator
from impact.greens.base import Array
from impact.greens.modal import ModalGreens
from impact.march.grid import blocks
from impact.march.loop.compiled import compiled
from impact.march.loop.forces import FLOOR, oscillate, padded

CACHED_VALUES, LEAST_TILE = 2**17, 64  # floats of a tile that fit in the cache; fewest steps of a tile


@dataclass(frozen=True)
class Block:
    """The results of m steps of a replay.

    ``displacement`` (P, m) of the ports and ``stored`` energy (m,) at the end of each step [m, J]; ``lost`` in damping
    and ``load_work`` of the loads during each step (m,) [J]. Energies are (0,) if not computed.
    """

    displacement: Array
    stored: Array
    lost: Array
    load_work: Array


class Replay:
    """Oscillators, rigid-body modes, relaxations and bare compliance of one body, advanced under known forces.

    Each energy term is integrated by itself, pole by pole and step by step, none as a difference of others.
    """

    def __init__(
        self, modal: ModalGreens, dt: float, start: ModalState, relaxed: Array, held: Array, loads: Sequence[Array]
    ) -> None:
        """Begin at the modal state ``start``, relaxations ``relaxed`` (R,) and forces ``held`` (P,) before t = 0;
        ``loads``: their (M,) modal shapes."""
        rigid, rest = modal.omega == 0, modal.residual
        shapes = np.vstack([modal.shapes.T, *loads])
        omega, zeta = modal.omega[~rigid], modal.zeta[~rigid]
        a, b = oscillator.transition(dt, omega, zeta)
        self._dt, self._rates, self._ports, self._compliance = dt, (omega, zeta), modal.shapes.shape[1], rest.compliance
        self._shapes, self._rigid = padded(shapes[:, ~rigid]), shapes[:, rigid].T
        self._steps = padded(np.array([a[0, 0], a[0, 1], a[1, 0], a[1, 1], b[0], b[1], omega**2]))
        self._q, self._p = padded(start.displacement[~rigid]), padded(start.velocity[~rigid])
        self._bodies = [resting(q, v) for q, v in zip(start.displacement[rigid], start.velocity[rigid], strict=True)]
        span = -rest.rates * dt
        gains = (dt * oscillator.expm1_over(span), dt * oscillator.expm1_over(2 * span))
        self._relaxing = np.array([[np.exp(span), *gains, rest.rates]])
        self._amplitudes = np.ascontiguousarray(rest.shapes.T)
        self._y, self._last = relaxed.astype(float), held.astype(float)
        self._load_displacement = shapes[self._ports :] @ start.displacement  # (L,), after the last step
        self._tile = max(LEAST_TILE, CACHED_VALUES // (self._q.size + self._y.size + 1))
        self._rooms = [np.empty((self._tile, state.size)) for state in (self._q, self._y)]
        self._levels = np.zeros(self._tile, dtype=np.int64)

    @cached_property
    def _form(self) -> Array:
        """Return the (6, K) quadratic form of the energy that damping takes from each oscillator during a step."""
        form = oscillator.dissipation_form(self._dt, *self._rates)[:3, :3]
        rows = [form[0, 0], 2 * form[0, 1], 2 * form[0, 2], form[1, 1], 2 * form[1, 2], form[2, 2]]
        return padded(np.array(rows))

    @property
    def stored(self) -> float:
        """Return the present elastic and kinetic energy of the body [J]."""
        swinging = float(np.sum(self._p**2) + np.sum(self._steps[6] * self._q**2))
        moving = sum((body[1] + self._dt * (body[2] + body[3])) ** 2 for body in self._bodies)
        resting = float(self._relaxing[0, 3] @ self._y**2 + self._last @ self._compliance @ self._last)
        return 0.5 * (swinging + float(moving) + resting)

    def advance(self, force: Array, loads: Array, *, energies: bool = True) -> Block:
        """Advance through m steps under port forces (P, m) and load amplitudes (L, m); cheaper without ``energies``."""
        ports, m = force.shape
        channels = np.concatenate([force, loads])
        u, stored_and_lost = np.zeros_like(channels), np.zeros((2, m if energies else 0))
        stored, lost = stored_and_lost
        for body, seen in zip(self._bodies, self._rigid, strict=True):
            places, rates = np.empty(m), np.empty(m)
            translate(self._dt, body, seen @ channels, places, rates)
            u += seen[:, None] * places
            if energies:
                stored += 0.5 * rates**2
        if self._q.size:
            for part in blocks(m, self._tile):
                q = _modal_forces(channels[:, part], self._shapes, self._rooms[0])
                self._oscillate(q, stored_and_lost[:, part] if energies else None)
                u[:, part] += self._shapes @ q.T
        work = np.sum(loads * np.diff(u[ports:], axis=1, prepend=self._load_displacement[:, None]), axis=0)
        self._load_displacement = u[ports:, -1].copy()
        if self._y.size and (np.any(self._y) or np.any(force)):
            for part in blocks(m, self._tile):
                y = _modal_forces(force[:, part], self._amplitudes, self._rooms[1])
                relax(self._levels[: len(y)], self._relaxing, self._y, y, stored[part], lost[part])
                u[:ports, part] += self._amplitudes @ y.T
        if np.any(self._compliance):
            yields = self._compliance @ force
            u[:ports] += yields
            if energies:
                jump = np.diff(force, axis=1, prepend=self._last[:, None])  # a spring loaded by a step stores F^2 c/2
                stored += 0.5 * np.sum(force * yields, axis=0)
                lost += 0.5 * np.sum(jump * (self._compliance @ jump), axis=0)
        self._last = force[:, -1].copy()
        return Block(u[:ports], stored, lost, work)

    def coast(self, steps: int) -> None:
        """Advance through ``steps`` without any force at once; the work of loads is not continued afterwards."""
        omega, zeta = self._rates
        state = np.array([self._q[: len(omega)], self._p[: len(omega)]])
        moved = np.einsum("abk,bk->ak", oscillator.free_transition(np.array(steps * self._dt), omega, zeta), state)
        self._q[: len(omega)], self._p[: len(omega)] = moved
        for body in self._bodies:
            translate(self._dt, body, np.zeros(steps), *np.empty((2, steps)))
        self._y *= np.exp(-self._relaxing[0, 3] * self._dt * steps)
        self._last = np.zeros(self._ports)

    def _oscillate(self, pushed: Array, total: Array | None) -> None:
        """Turn modal forces (m, K) into coordinates; add the energies stored and lost to ``total`` (2, m)."""
        form, energies = (None, None) if total is None else (self._form, np.zeros(total.shape))
        oscillate(self._steps, form, self._q, self._p, pushed, energies)
        if total is not None and energies is not None:
            total += energies

    def coordinates(self, force: Array, loads: Array, stride: int) -> Array:
        """Return the (m // stride, K + R) coordinates of oscillators and relaxations at every ``stride``-th step,
        without rigid-body modes."""
        channels, swinging, none = np.concatenate([force, loads]), len(self._rates[0]), np.zeros(0)
        coordinates = np.empty((force.shape[1] // stride, swinging + self._y.size))
        for part in blocks(force.shape[1], self._tile):
            q = _modal_forces(channels[:, part], self._shapes, self._rooms[0])
            y = _modal_forces(force[:, part], self._amplitudes, self._rooms[1])
            self._oscillate(q, None)
            relax(self._levels[: len(y)], self._relaxing, self._y, y, none, none)
            first, rows = -(part.start + 1) % stride, slice(part.start // stride, part.stop // stride)
            coordinates[rows, :swinging], coordinates[rows, swinging:] = q[first::stride, :swinging], y[first::stride]
        return coordinates


def _modal_forces(force: Array, shapes: Array, room: Array) -> Array:
    """Return the (m, M) modal forces of (C, m) forces on shapes (C, M), in ``room``; zero forces cost nothing."""
    active = np.any(force, axis=1)
    if not np.all(active):
        force, shapes = force[active], shapes[active]
    return np.dot(force.T, shapes, out=room[: force.shape[1]])


@compiled(nogil=True, fastmath={"reassoc", "contract", "nsz"})
def relax(levels, relaxing, y, pushed, stored, lost):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Relax Kelvin-Voigt elements f = y' + rate y: each stores rate y^2/2 and loses the integral of y'^2.

    ``levels`` (m,): numbers of the steps in relaxing (J, 4, R), whose rows are decay, gain of y and of the loss, and
    rates. ``pushed`` (m, R): their forces, which become their coordinates after each step; energies for ``lost`` of its
    size.
    """
    for m in range(pushed.shape[0]):
        step, f, lost_now, stored_now = relaxing[levels[m]], pushed[m], 0.0, 0.0
        for r in range(y.size):
            before = y[r]
            lost_now += (f[r] - step[3, r] * before) ** 2 * step[2, r]
            y[r] = f[r] = step[0, r] * before + step[1, r] * f[r] + FLOOR
            stored_now += step[3, r] * y[r] ** 2
        if lost.size:
            lost[m] += lost_now
            stored[m] += 0.5 * stored_now


def resting(place: float, rate: float) -> Array:
    """Return the state of a rigid-body mode for `translate`: position, initial velocity, three sums of zero."""
    return np.array([place, rate, 0.0, 0.0, 0.0])


@compiled()
def translate(dt, state, force, places, rates):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Advance a rigid-body mode; the sums of forces and of displacements carry their round-off (Knuth's two-sum).

    Plain sums drift: a constant force is rounded the same way at every step, with an error of eps n^2 in the position.
    """
    way, rate, push, push_rest, way_rest = state
    speed = rate + dt * (push + push_rest)
    for m in range(force.size):
        step = dt * (speed + 0.5 * dt * force[m])
        total = push + force[m]
        part = total - push
        push_rest += (push - (total - part)) + (force[m] - part)
        push = total
        speed = rate + dt * (push + push_rest)
        total = way + step
        part = total - way
        way_rest += (way - (total - part)) + (step - part)
        way = total
        places[m] = way + way_rest
        rates[m] = speed
    state[0], state[2], state[3], state[4] = way, push, push_rest, way_rest
