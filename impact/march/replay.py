"""Integration of modal coordinates under known forces, for energies, displacements, bending stress and free flight.

The contact forces are constant over each step, and each load is a mean and a straight rise: every recursion is exact
for such forces, and so are the energies. It runs block by block, so that memory does not grow with the run; the caller
keeps what it needs of each block.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from impact.bodies.body import ModalState
from impact.greens import oscillator
from impact.greens.base import Array
from impact.greens.modal import ModalGreens
from impact.march.grid import blocks
from impact.march.loop.compiled import compiled
from impact.march.loop.forces import FLOOR, oscillate, pad_columns

CACHED_VALUES, LEAST_TILE = 2**17, 64  # floats of a tile that fit in the cache; fewest steps of a tile
_FORM = ((0, 0), (0, 1), (0, 2), (0, 3), (1, 1), (1, 2), (1, 3), (2, 2), (2, 3), (3, 3))


FIRST: Final[NDArray[np.int64]] = np.zeros(0, dtype=np.int64)
"""Levels of steps that all have the first length."""
NO_RISES: Final[Array] = np.zeros((0, 0))
"""Rises of loads that are constant over each step."""


def find_loads(amplitudes: Array, ends: NDArray[np.int64]) -> tuple[Array, Array]:
    """Return the means and the rises (L, N) over steps with the ``ends`` (N + 1,) of loads with ``amplitudes`` (L, n),
    which are constant over each fine step [N]."""
    lengths, begins, finish = np.diff(ends), amplitudes[:, ends[:-1]], amplitudes[:, ends[1:] - 1]
    sums = np.concatenate([np.zeros((len(amplitudes), 1)), np.cumsum(amplitudes, axis=1)], axis=1)
    means = np.where(lengths > 1, (sums[:, ends[1:]] - sums[:, ends[:-1]]) / lengths, begins)
    return means, (finish - begins) * lengths / np.maximum(lengths - 1, 1)


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


@dataclass(frozen=True)
class BodyAtStart:
    """A body of modes at t = 0: its modal ``state``, relaxations ``relaxed`` (R,) and forces ``held`` (P,) before, and
    the (M,) modal shapes of its ``loads``. ``seen`` (o, P): weights of the sums over ports that a replay returns."""

    modal: ModalGreens
    state: ModalState
    relaxed: Array
    held: Array
    loads: Sequence[Array]
    seen: Array


class Replay(ABC):
    """Modes, relaxations and bare compliance of one body, advanced under known forces.

    Each energy term is integrated by itself, pole by pole and step by step, none as a difference of others.
    """

    def __init__(self, body: BodyAtStart, spans: Array) -> None:
        """Begin at t = 0; ``spans`` (J,): lengths of the steps [s]."""
        modal, start, relaxed, held, loads = body.modal, body.state, body.relaxed, body.held, body.loads
        rest, self._ports = modal.residual, modal.shapes.shape[1]
        self._seen = body.seen
        self._spans, self._rates = spans, (modal.omega, modal.zeta)
        self._shapes = np.vstack([modal.shapes.T, *loads])
        self._out = np.vstack([self._seen @ modal.shapes.T, *loads])
        reach = -rest.rates * spans[:, None]
        gains = spans[:, None] * oscillator.expm1_over(reach), spans[:, None] * oscillator.expm1_over(2 * reach)
        self._relaxing = np.stack([np.exp(reach), *gains, np.tile(rest.rates, (len(spans), 1))], axis=1)
        self._amplitudes, self._compliance = np.ascontiguousarray(rest.shapes.T), rest.compliance
        self._y, self._last = relaxed.astype(float), held.astype(float)
        self._load_displacement = self._shapes[self._ports :] @ start.displacement  # (L,), after the last step
        self._tile = max(LEAST_TILE, CACHED_VALUES // (len(modal.omega) + self._y.size + 1))
        self._buffers = [np.empty((self._tile, size)) for size in (len(modal.omega), self._y.size)]

    @property
    @abstractmethod
    def modal_energy(self) -> float:
        """Return the present elastic and kinetic energy of the modes [J]."""

    @abstractmethod
    def _move_modes(self, channels: Array, levels: NDArray[np.int64], rises: Array, u: Array, energies: Array) -> Array:
        """Advance the modes under port forces and means of loads ``channels`` (P + L, m) and ``rises`` (L, m); add
        their displacements to ``u`` (o + L, m), the energies stored and lost to ``energies`` (2, m); return the (L, m)
        mean displacements at loads that rise."""

    @property
    def stored(self) -> float:
        """Return the present elastic and kinetic energy of the body [J]."""
        residual_energy = self._relaxing[0, 3] @ self._y**2 + self._last @ self._compliance @ self._last
        return self.modal_energy + 0.5 * float(residual_energy)

    def advance(
        self,
        force: Array,
        means: Array,
        levels: NDArray[np.int64] = FIRST,
        rises: Array = NO_RISES,
        *,
        energies: bool = True,
    ) -> Block:
        """Advance through m steps under port forces (P, m) and loads of ``means`` and ``rises`` (L, m); cheaper without
        ``energies``. ``levels`` (m,): numbers of the steps' lengths among the spans, by default the first."""
        m, seen = force.shape[1], len(self._seen)
        levels = levels if levels.size else np.zeros(m, dtype=np.int64)
        rises = rises if np.any(rises) else NO_RISES
        u, energy = np.zeros((len(self._out), m)), np.zeros((2, m if energies else 0))
        between = self._move_modes(np.concatenate([force, means]), levels, rises, u, energy)
        stored, lost = energy
        relaxes = self._y.size > 0 and bool(np.any(self._y) or np.any(force))
        for part in blocks(m, self._tile) if relaxes else ():
            y = _modal_forces(force[:, part], self._amplitudes, self._buffers[1])
            relax(levels[part], self._relaxing, self._y, y, stored[part], lost[part])
            u[:seen, part] += self._seen @ self._amplitudes @ y.T
        if np.any(self._compliance):
            yielded = self._compliance @ force
            u[:seen] += self._seen @ yielded
            if energies:  # a spring loaded by a step stores F^2 c/2
                jump = np.diff(force, axis=1, prepend=self._last[:, None])
                stored += 0.5 * np.sum(force * yielded, axis=0)
                lost += 0.5 * np.sum(jump * (self._compliance @ jump), axis=0)
        before = np.concatenate([self._load_displacement[:, None], u[seen:, :-1]], axis=1)
        work = np.sum(means * (u[seen:] - before), axis=0)
        if rises.size:
            work += np.sum(rises * ((u[seen:] + before) / 2 - between), axis=0)
        self._load_displacement, self._last = u[seen:, -1].copy(), force[:, -1].copy()
        return Block(u[:seen], stored, lost, work)


class EqualReplay(Replay):
    """A replay in equal steps: oscillators side by side in registers, rigid-body modes with the round-off of their
    sums."""

    def __init__(self, body: BodyAtStart, dt: float) -> None:
        """Begin as `Replay` does, with steps of ``dt`` [s]."""
        super().__init__(body, np.array([dt]))
        modal, start = body.modal, body.state
        rigid, self._dt = modal.omega == 0, dt
        omega, zeta = self._rates = modal.omega[~rigid], modal.zeta[~rigid]
        a, b = oscillator.transition(dt, omega, zeta)
        self._is_rigid, self._rigid, self._moved = rigid, self._shapes[:, rigid].T, self._out[:, rigid].T
        self._shapes, self._out = pad_columns(self._shapes[:, ~rigid]), pad_columns(self._out[:, ~rigid])
        self._steps = pad_columns(np.array([a[0, 0], a[0, 1], a[1, 0], a[1, 1], b[0], b[1], omega**2]))
        self._q, self._p = pad_columns(start.displacement[~rigid]), pad_columns(start.velocity[~rigid])
        states = zip(start.displacement[rigid], start.velocity[rigid], strict=True)
        self._bodies = [rigid_state(q, v) for q, v in states]
        self._buffers[0] = np.empty((self._tile, self._q.size))

    @cached_property
    def _form(self) -> Array:
        """Return the (6, K) quadratic form of the energy that damping takes from each oscillator during a step."""
        form = oscillator.dissipation_form(self._dt, *self._rates)[:3, :3]
        rows = [form[0, 0], 2 * form[0, 1], 2 * form[0, 2], form[1, 1], 2 * form[1, 2], form[2, 2]]
        return pad_columns(np.array(rows))

    @property
    def modal_energy(self) -> float:
        swinging = float(np.sum(self._p**2) + np.sum(self._steps[6] * self._q**2))
        return 0.5 * (swinging + float(sum((body[1] + self._dt * (body[2] + body[3])) ** 2 for body in self._bodies)))

    def _move_modes(self, channels: Array, levels: NDArray[np.int64], rises: Array, u: Array, energies: Array) -> Array:
        for body, seen, moved in zip(self._bodies, self._rigid, self._moved, strict=True):
            places, rates = np.empty((2, channels.shape[1]))
            translate(self._dt, body, seen @ channels, places, rates)
            u += moved[:, None] * places
            if energies.size:
                energies[0] += 0.5 * rates**2
        for part in blocks(channels.shape[1], self._tile) if self._q.size else ():
            q = _modal_forces(channels[:, part], self._shapes, self._buffers[0])
            self._oscillate(q, energies[:, part])
            u[:, part] += self._out @ q.T
        return u[len(self._seen) :]

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

    def _oscillate(self, pushed: Array, total: Array) -> None:
        """Turn modal forces (m, K) into coordinates; add energies stored and lost to ``total`` (2, m) or (2, 0)."""
        form, energies = (self._form, np.zeros(total.shape)) if total.size else (None, None)
        oscillate(self._steps, form, self._q, self._p, pushed, energies)
        if energies is not None:
            total += energies

    def coordinates(self, force: Array, loads: Array, stride: int) -> Array:
        """Return the (m // stride, M + R) coordinates of modes and relaxations at every ``stride``-th step."""
        channels, modes, none = np.concatenate([force, loads]), len(self._is_rigid), np.zeros(0)
        swinging, coordinates = len(self._rates[0]), np.empty((force.shape[1] // stride, modes + self._y.size))
        for k, body, seen in zip(np.flatnonzero(self._is_rigid), self._bodies, self._rigid, strict=True):
            places, rates = np.empty((2, force.shape[1]))
            translate(self._dt, body, seen @ channels, places, rates)
            coordinates[:, k] = places[stride - 1 :: stride][: len(coordinates)]
        for part in blocks(force.shape[1], self._tile):
            q = _modal_forces(channels[:, part], self._shapes, self._buffers[0])
            y = _modal_forces(force[:, part], self._amplitudes, self._buffers[1])
            self._oscillate(q, np.zeros((2, 0)))
            relax(np.zeros(len(y), dtype=np.int64), self._relaxing, self._y, y, none, none)
            first, rows = -(part.start + 1) % stride, slice(part.start // stride, part.stop // stride)
            coordinates[rows, np.flatnonzero(~self._is_rigid)] = q[first::stride, :swinging]
            coordinates[rows, modes:] = y[first::stride]
        return coordinates


class LeapReplay(Replay):
    """A replay in steps of several lengths, as `impact.march.ladder` takes them."""

    def __init__(self, body: BodyAtStart, spans: Array) -> None:
        """Begin as `Replay` does."""
        super().__init__(body, spans)
        start = body.state
        self._steps = np.array([_find_step(float(span), *self._rates) for span in spans])
        self._q, self._v = start.displacement.astype(float), start.velocity.astype(float)

    @cached_property
    def _form(self) -> Array:
        """Return the (J, 10, K) quadratic forms of the energy that damping takes from each oscillator during a step."""
        forms = (oscillator.dissipation_form(float(span), *self._rates) for span in self._spans)
        return np.array([[(1 + (i != j)) * form[i, j] for i, j in _FORM] for form in forms])

    @property
    def modal_energy(self) -> float:
        return 0.5 * float(np.sum(self._v**2) + np.sum((self._rates[0] * self._q) ** 2))

    def _move_modes(self, channels: Array, levels: NDArray[np.int64], rises: Array, u: Array, energies: Array) -> Array:
        between = np.zeros((len(channels) - self._ports, channels.shape[1]))
        form = self._form if energies.size else None
        stored, lost = energies if energies.size else np.zeros((2, channels.shape[1]))
        for part in blocks(channels.shape[1], self._tile):
            q = _modal_forces(channels[:, part], self._shapes, self._buffers[0])
            f = np.ascontiguousarray(rises[:, part].T @ self._shapes[self._ports :]) if rises.size else None
            _swing(levels[part], self._steps, form, self._q, self._v, q, f, stored[part], lost[part])
            u[:, part] = self._out @ q.T
            if f is not None:
                between[:, part] = self._shapes[self._ports :] @ f.T
        return between


def _find_step(span: float, omega: Array, zeta: Array) -> Array:
    """Return (13, K): transition of (q, q'), effects of a unit force and of a unit rise about 0, means of q by q, q',
    force and rise, and w^2, over one ``span`` [s]."""
    ((a11, a12), (a21, a22)), (b1, b2) = oscillator.transition(span, omega, zeta)
    full = np.full(omega.shape, span)
    ramped, far = oscillator.ramp_response(full, omega, zeta), oscillator.ramp_integral(full, omega, zeta)
    effects = b1, b2, ramped / span - b1 / 2, b1 / span - b2 / 2
    means = 1 - omega**2 * ramped / span, b1 / span, ramped / span, far / span**2 - ramped / (2 * span)
    return np.array([a11, a12, a21, a22, *effects, *means, omega**2])


@compiled(nogil=True, fastmath={"reassoc", "contract", "nsz"})
def _swing(levels, steps, form, q, v, pushed, rises, stored, lost):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Advance oscillators under modal forces ``pushed`` (m, K), which become their coordinates after each step.

    steps (J, 13, K): of `_find_step`; rises (m, K), which become the means of the coordinates, or None; form (J, 10,
    K): of the energy that damping takes, or None for no energies.
    """
    for m in range(pushed.shape[0]):
        step, f, stored_now, lost_now = steps[levels[m]], pushed[m], 0.0, 0.0
        if form is not None:
            d = form[levels[m]]
        for k in range(q.size):
            x, y, a, b = q[k], v[k], f[k], 0.0
            r = step[0, k] * x + step[1, k] * y + step[4, k] * a
            s = step[2, k] * x + step[3, k] * y + step[5, k] * a + FLOOR
            if rises is not None:
                b = rises[m, k]
                r += step[6, k] * b
                s += step[7, k] * b
                rises[m, k] = step[8, k] * x + step[9, k] * y + step[10, k] * a + step[11, k] * b
            if form is not None:
                lost_now += x * (d[0, k] * x + d[1, k] * y + d[2, k] * a)
                lost_now += y * (d[4, k] * y + d[5, k] * a) + d[7, k] * a * a
                if rises is not None:
                    lost_now += b * (d[3, k] * x + d[6, k] * y + d[8, k] * a + d[9, k] * b)
                stored_now += s * s + step[12, k] * r * r
            q[k], v[k], f[k] = r, s, r
        if form is not None:
            stored[m] += 0.5 * stored_now
            lost[m] += lost_now


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


def rigid_state(place: float, rate: float) -> Array:
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
