"""The motion and energy of one body under known forces, and under loads that become known step by step.

Each energy term is integrated separately, never as a difference of others, so that the balance of all terms measures
the error of the solver.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from numpy.typing import NDArray

from impact.bodies.body import Body, ModalState
from impact.exact.closed_form import reflect
from impact.greens import oscillator
from impact.greens.base import Array, GreensFunctionError, Rod, StepKernel, convolve
from impact.greens.modal import ModalGreens
from impact.march import problem
from impact.march.grid import TimeGrid, blocks
from impact.march.loop.compiled import compiled
from impact.march.loop.forces import FLOOR
from impact.march.replay import Block, BodyAtStart, EqualReplay, LeapReplay, Replay, find_loads
from impact.quantities import brief

Write = Callable[[slice, Array], None]
"""Function that receives the displacements (P, m) of the ports in a slice of the rows; row 0 is the start."""
CALM = 64  # least number of steps without any force that are advanced at once
_ROUND_OFF = 1e-13  # relative round-off of a difference of inverse masses


@dataclass(frozen=True)
class Motion:
    """History of one body: (P, n + 1) ``displacement`` of its ports [m], and energies (n + 1,) [J].

    ``stored``: elastic and kinetic energy (with ``by_work``: kinetic energy of its translation at the start plus all
    work received); ``dissipated``: energy lost in its damping so far; ``load_work``: work of its prescribed loads so
    far.
    """

    displacement: Array
    stored: Array
    dissipated: Array
    load_work: Array
    by_work: bool = False

    __repr__ = brief


@dataclass(frozen=True)
class PortForces:
    """Forces (p, N) at contacts, constant over each step of a grid [N], and the signs ``directions`` (P, p) with which
    they act on the ports of a body."""

    grid: TimeGrid
    force: Array
    directions: Array

    __repr__ = brief

    @staticmethod
    def at_ports(force: Array, dt: float) -> PortForces:
        """Return the forces (P, n) on the ports themselves, constant over steps of ``dt`` [s]."""
        return PortForces(TimeGrid.from_equal_steps(dt, force.shape[1]), force, np.eye(len(force)))

    @cached_property
    def _are_turned(self) -> bool:
        return not np.array_equal(self.directions, np.eye(len(self.directions)))

    @cached_property
    def _are_signs(self) -> bool:
        """Return whether contact k acts on port k alone, as the parts of a seat and of a stopper do."""
        return np.array_equal(self.directions, np.diag(np.diagonal(self.directions)))

    def within(self, part: slice) -> Array:
        """Return the (P, m) forces on the ports in a slice of the steps [N]."""
        force = self.force[:, part]
        if not self._are_turned:
            return force
        return np.diagonal(self.directions)[:, None] * force if self._are_signs else self.directions @ force


def find_middle_times(dt: float, n: int) -> Array:
    """Return the (n,) times in the middle of the steps, at which loads are taken [s]."""
    return np.asarray(dt * (np.arange(n) + 0.5), dtype=np.float64)


@dataclass(frozen=True)
class DiscreteBody:
    """A body discretised at a fixed step ``dt`` [s], with its static forces before t = 0.

    Attributes:
        kernel: step kernel of its Green's function.
        loads: (L, n) amplitudes of the body's loads, constant over each step [N].
        rest, rest_loads: (P,) port forces and (L,) load amplitudes of the static preload before t = 0 [N].
        free: function that returns the (P, n + 1) displacement without contact [m], if several runs share it.
    """

    body: Body
    kernel: StepKernel
    dt: float
    loads: Array
    rest: Array
    rest_loads: Array
    free: Callable[[], Array] | None = None

    __repr__ = brief

    @staticmethod
    def from_body(body: Body, dt: float, n: int) -> DiscreteBody:
        """Return ``body`` over ``n`` steps of ``dt``, starting from its initial state."""
        body.greens.check_length(dt, n)
        loads = body.load_amplitudes(find_middle_times(dt, n))
        if not np.all(np.isfinite(loads)):
            raise GreensFunctionError(f"the amplitudes of a load must be finite, {np.sum(~np.isfinite(loads))} are not")
        ports = len(body.greens.ports)
        return DiscreteBody(body, body.greens.step_kernel(dt, n), dt, loads, np.zeros(ports), np.zeros(len(body.loads)))

    def until(self, step: int) -> DiscreteBody:
        """Return the body over the first steps, up to ``step``."""
        weights = self.kernel.weights
        kernel = self.kernel if weights is None else replace(self.kernel, weights=weights[:, :, :step])
        return replace(self, kernel=kernel, loads=self.loads[:, :step], free=None)

    @property
    def moves_by_itself(self) -> bool:
        """Return whether the body moves, or is deflected, without contact."""
        body = self.body
        return body.velocity != 0.0 or body.state is not None or len(body.loads) > 0 or bool(np.any(self.rest))

    def free_motion(self) -> Array:
        """Return the (P, n + 1) displacement [m] without contact, by initial state, loads and preload."""
        if self.free is not None:
            return self.free()
        if not (self.loads.size or np.any(self.rest)) and self.kernel.weights is None and self.kernel.modal is not None:
            return _free_vibration(self, self.kernel.modal)
        force = np.repeat(self.rest[:, None], self.loads.shape[1], axis=1)
        return self.motion(PortForces.at_ports(force, self.dt), energies=False).displacement

    def stored_after(self, forces: PortForces, steps: Sequence[int]) -> Array:
        """Return the energy stored in the body after each of the increasing fine ``steps`` [J]; nan without modes.

        A fine step within a step of the forces' grid has the energy at the end of that step.
        """
        if self.kernel.modal is None or self.kernel.weights is not None:
            return np.full(len(steps), np.nan)
        rows = np.searchsorted(forces.grid.ends, steps).tolist()
        replay, advance = _begin_replay(self, self.kernel.modal, forces, np.zeros((0, len(self.rest))), energies=False)
        stored, now, calm = {0: replay.stored}, 0, np.zeros((0, 2), dtype=np.int64)
        if forces.grid.is_uniform:
            pushed = np.any(forces.force, axis=0) | np.any(self.loads, axis=0)
            calm = np.flatnonzero(np.diff(pushed, prepend=True, append=True)).reshape(-1, 2)
        ends = calm[np.diff(calm, axis=1)[:, 0] >= CALM].ravel()
        for row in sorted({*rows, *ends[ends < max(rows, default=0)].tolist()}):
            if isinstance(replay, EqualReplay) and not np.any(pushed[now:row]):
                replay.coast(row - now)
            else:
                for part in blocks(row - now):
                    advance(slice(now + part.start, now + part.stop))
            now, stored[row] = row, replay.stored
        return np.array([stored[row] for row in rows])

    def motion(self, forces: PortForces, write: Write | None = None, *, energies: bool = True) -> Motion:
        """Return the motion under ``forces``, whose grid is uniform unless the body consists of modes alone.

        ``write``: function that receives the displacements slice by slice, as they may be large; those of the returned
        motion are then empty. Without ``energies`` the energies of modes are not computed.
        """
        modal, every = self.kernel.modal, np.eye(len(self.rest))
        if modal is not None and self.kernel.weights is None:
            return _modal_motion(self, modal, forces, every, energies=energies, write=write)
        force = forces.within(slice(None))
        n = force.shape[1]
        motion = Motion(np.zeros((len(force), n + 1)), np.zeros(n + 1), np.zeros(n + 1), np.zeros(n + 1))
        if modal is not None:
            motion = _modal_motion(self, modal, forces, every)
        if self.kernel.weights is not None:
            motion = _sampled_motion(self, self.kernel.weights, force, motion)
        if write is not None:
            write(slice(n + 1), motion.displacement)
        return motion


def find_mean_displacement(discrete: DiscreteBody, forces: PortForces, shares: Array) -> Array:
    """Return the (n + 1,) mean displacement [m] of the ports under ``forces``, weighted by ``shares``.

    It equals ``shares @ discrete.motion(forces).displacement`` and costs less: energies are not computed, and a body at
    rest needs only the modes with a mean displacement.
    """
    kernel, is_still = discrete.kernel, not discrete.moves_by_itself
    if kernel.weights is not None and not is_still:
        return np.asarray(shares @ discrete.motion(forces).displacement)
    out = np.zeros(forces.force.shape[1] + 1)
    if kernel.modal is not None:
        modal = _with_mean_motion(kernel.modal, shares) if is_still else kernel.modal
        out += _modal_motion(discrete, modal, forces, shares[None], energies=False).displacement[0]
    if kernel.weights is not None:
        pushes = zip(np.einsum("i,ijn->jn", shares, kernel.weights), forces.within(slice(None)), strict=True)
        for weights, push in pushes:
            out[1:] += convolve(weights, push)
    return out


def _with_mean_motion(modal: ModalGreens, shares: Array) -> ModalGreens:
    """Return the modes and relaxations whose mean over the ports exceeds round-off, unlike that of lip harmonics."""

    def have_mean(shapes: Array) -> NDArray[np.bool_]:
        return np.asarray(np.abs(shapes @ shares) > 16 * np.finfo(float).eps * (np.abs(shapes) @ np.abs(shares)))

    residual, relaxing = modal.residual, have_mean(modal.residual.shapes)
    remaining = replace(residual, shapes=residual.shapes[relaxing], rates=residual.rates[relaxing])
    return modal.select_modes(have_mean(modal.shapes), remaining)


def modal_coordinates(body: Body, force: Array, dt: float, stride: int) -> Array:
    """Return the (n // stride + 1, M) modal coordinates q of a body of modes [m sqrt(kg)], at every ``stride``-th step.

    The displacement of any point is u = sum_k phi_k q_k, without the residual flexibility. ``force`` (P, n) [N] acts on
    the ports along the normal, constant over each step ``dt`` [s]; there is no preload. Raises `GreensFunctionError`
    for a body that is no sum of modes, or a load that is not finite.
    """
    if (modal := body.greens.modal) is None:
        raise GreensFunctionError(
            f"a {type(body.greens).__name__} has no modal coordinates: take a body that is a sum of modes"
        )
    discrete = DiscreteBody.from_body(body, dt, force.shape[1])
    start = _start_of(discrete, modal, np.zeros((0, len(force))))
    coordinates = EqualReplay(start, dt).coordinates(force, discrete.loads, stride)
    return np.vstack([start.state.displacement, coordinates[:, : len(modal.omega)]])


def _free_vibration(discrete: DiscreteBody, modal: ModalGreens) -> Array:
    """Return the (P, n + 1) displacement of a body without forces [m].

    Step i B + j of each mode follows from its state at step i B and its free response over j steps; one matrix product
    sums over the modes.
    """
    n, start = discrete.loads.shape[1], find_start(discrete, modal)
    count = math.isqrt(n) + 1
    steps = count * np.arange(n // count + 1), np.arange(count)
    times = (np.asarray(discrete.dt * each, dtype=np.float64) for each in steps)
    spans = [oscillator.free_transition(each[:, None], modal.omega, modal.zeta) for each in times]
    states = np.einsum("abik,bk->iak", spans[0], np.array([start.displacement, start.velocity]))
    responses = spans[1][0].transpose(0, 2, 1).reshape(-1, count)
    rows = [(states * shape).reshape(len(states), -1) @ responses for shape in modal.shapes.T]
    return np.array(rows).reshape(len(rows), -1)[:, : n + 1]


def find_start(discrete: DiscreteBody, modal: ModalGreens) -> ModalState:
    """Return the modal coordinates and rates at t = 0, preload included."""
    pull = modal.shapes @ discrete.rest
    for load, amplitude in zip(discrete.body.loads, discrete.rest_loads, strict=True):
        pull = pull + load.shape * amplitude
    if np.any(pull[modal.omega == 0] != 0):
        raise GreensFunctionError("a body free to move cannot carry a preload: nothing balances it; hold it somewhere")
    q = pull / np.where(modal.omega == 0, 1.0, modal.omega) ** 2
    start = discrete.body.modal_start(modal)
    return ModalState(q + start.displacement, start.velocity)


def _modal_motion(
    discrete: DiscreteBody,
    modal: ModalGreens,
    forces: PortForces,
    seen: Array,
    *,
    energies: bool = True,
    write: Write | None = None,
) -> Motion:
    """Return the motion by modes, as `DiscreteBody.motion` does; ``seen`` as in `Replay`."""
    n = forces.force.shape[1]
    start, relaxed, rest = find_start(discrete, modal), find_relaxations(discrete, modal), modal.residual
    spring = rest.compliance @ discrete.rest
    moved = seen @ (modal.shapes.T @ start.displacement + rest.shapes.T @ relaxed + spring)
    u, stored, lost, work = np.zeros((len(moved), 0 if write else n + 1)), *np.zeros((3, n + 1))
    swinging = start.velocity @ start.velocity + np.sum((modal.omega * start.displacement) ** 2)
    stored[0] = 0.5 * float(swinging + rest.rates @ relaxed**2 + discrete.rest @ spring)
    _, advance = _begin_replay(discrete, modal, forces, seen, energies=energies)
    write = write or partial(_store_displacement, u)
    write(slice(1), moved[:, None])
    for part in blocks(n):
        now = slice(part.start + 1, part.stop + 1)
        block = advance(part)
        write(now, block.displacement)
        if energies:
            stored[now], lost[now], work[now] = block.stored, block.lost, block.load_work
    return Motion(u, stored, np.cumsum(lost), np.cumsum(work))


def _store_displacement(whole: Array, rows: slice, displacement: Array) -> None:
    whole[:, rows] = displacement


def _begin_replay(
    discrete: DiscreteBody, modal: ModalGreens, forces: PortForces, seen: Array, *, energies: bool
) -> tuple[Replay, Callable[[slice], Block]]:
    """Return a replay of the modes, and the function that advances it through a slice of the steps under ``forces``."""
    body, grid = _start_of(discrete, modal, seen), forces.grid
    if grid.is_uniform:
        equal = EqualReplay(body, discrete.dt)
        return equal, lambda part: equal.advance(forces.within(part), discrete.loads[:, part], energies=energies)
    (lengths, levels), (means, rises) = grid.levels, find_loads(discrete.loads, grid.ends)
    leaps = LeapReplay(body, discrete.dt * lengths.astype(np.float64))
    return leaps, lambda part: leaps.advance(
        forces.within(part), means[:, part], levels[part], rises[:, part], energies=energies
    )


def _start_of(discrete: DiscreteBody, modal: ModalGreens, seen: Array) -> BodyAtStart:
    state, relaxed = find_start(discrete, modal), find_relaxations(discrete, modal)
    return BodyAtStart(modal, state, relaxed, discrete.rest, [load.shape for load in discrete.body.loads], seen)


def find_relaxations(discrete: DiscreteBody, modal: ModalGreens) -> Array:
    """Return the (R,) coordinates of the relaxations at t = 0, under the preload."""
    loads, rates = modal.residual.shapes @ discrete.rest, modal.residual.rates
    if np.any(loads[rates == 0] != 0):
        raise GreensFunctionError("a dashpot cannot carry a preload: hold the body somewhere")
    return np.asarray(loads / np.where(rates == 0, 1.0, rates))


def _sampled_motion(discrete: DiscreteBody, weights: Array, force: Array, base: Motion) -> Motion:
    """Return ``base`` plus the motion by step weights, whose energy is that of the waves in a rod, or, of other bodies,
    the work done on them."""
    body, dt = discrete.body, discrete.dt
    ports, n = force.shape
    u = base.displacement.copy()
    for i in range(ports):
        for j in range(ports):
            u[i, 1:] += convolve(weights[i, j], force[j] - discrete.rest[j])
    if np.any(discrete.rest):
        u += (body.greens.static_compliance() @ discrete.rest)[:, None]
    drift, modal = np.zeros(ports), discrete.kernel.modal  # the initial translation, of the part known by weights
    if body.velocity != 0.0:
        whole = body.greens.inverse_mass()[:, 0]
        part = whole if modal is None else whole - modal.inverse_mass()[:, 0]
        drift = body.momentum * np.where(np.abs(part) > _ROUND_OFF * np.abs(whole).max(), part, 0.0)
    u += drift[:, None] * (dt * np.arange(n + 1))
    kinetic = 0.5 * body.momentum * float(drift[0])
    rod = body.greens.rod
    if rod is not None and rod.damping_ratio == 0.0 and not np.any(discrete.rest):
        steps = 2 * rod.transit / dt
        if abs(steps - round(steps)) < 1e-6 and round(steps) > 0:
            stored, lost = _wave_energy(rod, force[0], dt, round(steps))
            momentum = np.concatenate([[0.0], np.cumsum(force[0] * dt)])  # a translating rod: Galilei
            stored = stored + float(drift[0]) * momentum + kinetic
            return Motion(u, base.stored + stored, base.dissipated + lost, base.load_work)
    work = np.concatenate([[0.0], np.cumsum(np.sum(force * np.diff(u - base.displacement, axis=1), axis=0))])
    return Motion(u, base.stored + work + kinetic, base.dissipated, base.load_work, by_work=True)


def _wave_energy(rod: Rod, force: Array, dt: float, steps: int) -> tuple[Array, Array]:
    """Return the (n + 1,) energies stored in a rod and lost at its far end [J].

    The outgoing wave a = f/Z + R a(t - T) has the power Z a^2, of which the far end reflects the fraction R^2.
    """
    n, r = len(force), rod.reflection
    a = reflect(force / rod.impedance, r, steps)
    power = np.concatenate([[0.0], np.cumsum(rod.impedance * a**2 * dt)])
    now = np.arange(n + 1, dtype=np.float64)
    at_far_end, back = (np.interp(now - np.float64(ago), now, power) for ago in (steps / 2, steps))
    return (power - at_far_end) + r**2 * (at_far_end - back), (1 - r**2) * at_far_end


class LiveLoads:
    """Motion of the striker under load amplitudes that become known step by step, superposed on all other motion.

    ``amplitudes`` (L, n): amplitudes so far, in excess of the prepared ones [N]; ``state`` (2, M): modal coordinates
    and rates due to them; ``awake``: whether any amplitude so far is not zero; ``follows``: whether any load depends on
    the opening; ``fed``: amplitude [N] and state of each load with feedback, one after the other.
    """

    def __init__(self, striker: DiscreteBody, directions: Array, steps: int) -> None:
        loads = striker.body.loads
        self._striker = striker
        self.follows = any(load.follows for load in loads)
        starts = [
            (i, load.feedback, load.feedback.start()) for i, load in enumerate(loads) if load.feedback is not None
        ]
        self.fed = np.concatenate([np.zeros(0), *(np.append(0.0, state) for _, _, state in starts)])
        ends = np.cumsum([0, *(len(state) + 1 for _, _, state in starts)])
        self._fed = [(i, how, self.fed[a:b]) for (i, how, _), a, b in zip(starts, ends[:-1], ends[1:], strict=True)]
        self.amplitudes = np.zeros((len(loads), steps))
        self.awake = False
        self.state = np.zeros((2, 0))
        greens = striker.body.greens.modal
        if loads and greens is not None:  # a Body with loads is modal
            self._a, self._b = oscillator.transition(striker.dt, greens.omega, greens.zeta)
            self._shapes = np.stack([load.shape for load in loads])
            self._seen = np.ascontiguousarray((greens.shapes @ directions).T)
            self.state = np.zeros((2, len(greens.omega)))

    def record(self, step: int, amplitudes: Array) -> None:
        """Record the amplitudes of one step; raises `ContactError` unless they are one finite number per load."""
        if np.shape(amplitudes) != (len(self.amplitudes),) or not np.all(np.isfinite(amplitudes)):
            raise problem.ContactError(
                f"{len(self.amplitudes)} finite load amplitudes are needed, one for each of the striker's loads; "
                f"got {amplitudes}"
            )
        self.amplitudes[:, step] = amplitudes
        self.awake = self.awake or bool(np.any(self.amplitudes[:, step]))

    def follow(self, start: int, stop: int, opening: float, block: int) -> None:
        """Add to the amplitudes of the steps ``start`` to ``stop`` the excess of the loads at an ``opening`` [m] over
        the prepared ones.

        The feedback advances by a whole ``block`` of steps if ``start`` is the first step of one.
        """
        own, dt = self._striker.loads, self._striker.dt
        for i, how, fed in self._fed:
            if start % block == 0:
                fed[0] = how.advance(fed[1:], start * dt, block * dt, opening)
            self.amplitudes[i, start:stop] += fed[0] - own[i, start:stop]
            self.awake = True
        for row, own, load in zip(self.amplitudes, self._striker.loads, self._striker.body.loads, strict=True):
            if load.by_opening is not None:
                row[start:stop] += own[start:stop] * (load.by_opening(opening) - 1.0)
                self.awake = self.awake or bool(np.any(row[start:stop]))

    def advance(self, start: int, stop: int) -> Array:
        """Advance over the steps ``start`` to ``stop``; return the (stop - start, p) changes of the gaps at the end of
        each step [m]."""
        changes = np.zeros((stop - start, len(self._seen)))
        _advance(self._a, self._b, self._shapes, self._seen, self.amplitudes, start, self.state, changes)
        return changes


@compiled(fastmath={"reassoc", "contract", "nsz"})
def _advance(a, b, shapes, seen, amplitudes, start, state, out):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Advance oscillators under known amplitudes from step ``start``; write the gap changes to ``out`` (m, p)."""
    steps, contacts = out.shape
    drive = np.empty(state.shape[1])
    for m in range(steps):
        for i in range(shapes.shape[0]):
            for k in range(drive.size):
                drive[k] = shapes[i, k] * amplitudes[i, start + m] + (drive[k] if i else 0.0)
        for k in range(drive.size):
            q, v = state[0, k], state[1, k]
            state[0, k] = a[0, 0, k] * q + a[0, 1, k] * v + b[0, k] * drive[k] + FLOOR
            state[1, k] = a[1, 0, k] * q + a[1, 1, k] * v + b[1, k] * drive[k] + FLOOR
        for c in range(contacts):
            moved = 0.0
            for k in range(drive.size):
                moved += seen[c, k] * state[0, k]
            out[m, c] = moved
