"""March of a run in steps of different lengths: fine where bodies touch and ring, long where the motion is smooth.

Every body is a sum of poles, whose state contains all of its motion. The step of level j is `RISE`^j fine steps. With
the passive, conserving and blended rules no step gains energy, whatever its length (`impact.march.laws`), and the state
passes from one length to another unchanged: neither does the run.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from impact.greens import oscillator
from impact.greens.base import Array
from impact.greens.modal import ModalGreens
from impact.march import history, laws, motion
from impact.march.grid import TimeGrid
from impact.march.loop import ladder as loop
from impact.march.prepared import MOST_STEPS, Discretised, discretise, find_free_motion
from impact.march.problem import ContactProblem
from impact.march.rows import MarchRun, Rows
from impact.march.stepper import ContactStepper, LoopLaws
from impact.notices import Progress, silent
from impact.quantities import brief

SHARE: Final = 3e-5
"""Largest deviation of the contact forces from a line through the last two in a long step, over the largest so far."""
BEND: Final = 1e-3
"""Largest deviation of an open gap from the line between the ends of a step, over the widest gap on its side so far."""
WORTHWHILE: Final = 1.0  # predicted time of equal steps [s] from which on the loop for long ones repays its compilation
LARGE: Final = 1e6  # steps x contacts of equal steps, of 8 MB a history, from which on it repays it whatever the time
HIGHEST: Final = 6  # longest step: RISE^6 = 4096 fine ones
FEWEST: Final = 16  # fewest steps of a length that fit into a run
CHUNK: Final = loop.RISE**HIGHEST * 16  # fine steps whose loads are known at once
ROOM: Final = 8192  # rows by which the histories grow
NO_STEPS: Final = TimeGrid(0.0, np.zeros(0, dtype=np.int64))
"""Grid of a march that follows the steps of no other one."""


@dataclass(frozen=True)
class Levels:
    """Poles of all bodies at the steps of the ladder.

    Attributes:
        lengths: (J,) fine steps of each level.
        poles: their recursion over fine steps.
        scale: (K,) a12 of a fine step: the recursion keeps a12 q' for each rate q' [s].
        moves: (J, 4, K) transitions of (q, q').
        gains, ramps: (J, 2, K) effects on (q, q') of a unit force, and of one that rises by a unit about zero.
        strays: (J, 2, K) largest deviation from a line over the amplitude, and per unit of force for rigid-body modes.
        rest: (3, K) displacement per unit of static force, and u, v of the amplitude (`march_ladder`).
        own: (J, p, p) displacement by a unit force at the end of its own step [m/N].
        start: (2, K) coordinates and rates at t = 0.
        drive: (L, S) modal forces per unit of each load, on the first S poles: those of the striker.
    """

    lengths: NDArray[np.int64]
    poles: history.Poles
    scale: Array
    moves: Array
    gains: Array
    ramps: Array
    strays: Array
    rest: Array
    own: Array
    start: Array
    drive: Array

    __repr__ = brief


def has_levels(discretised: Discretised) -> bool:
    """Return whether all bodies are marched by poles, and all loads act on the striker whatever the opening."""
    by_poles = all(discretised.plan.by_poles) and all(body.kernel.weights is None for body in discretised.bodies)
    follows = any(load.follows for load in discretised.problem.striker.loads)
    return by_poles and not follows and not any(body.loads.size for body in discretised.bodies[1:])


def prepare_levels(discretised: Discretised) -> Levels:
    """Return the levels of a problem that `has_levels`."""
    problem, bodies, steps = discretised.problem, discretised.bodies, discretised.steps
    modal = [body.kernel.modal for body in bodies if body.kernel.modal is not None]
    dt, contacts, turns = discretised.dt, len(discretised.rest), [problem.directions(b.body) for b in bodies]
    lengths = np.array([loop.RISE**j for j in range(HIGHEST + 1) if j == 0 or loop.RISE**j * FEWEST <= steps])
    poles = history.Poles.from_modes(list(zip(modal, turns, strict=True)), dt, contacts)
    own = np.array([discretised.find_own(int(length)) for length in lengths])
    each_body = [_find_poles(body, greens, turn) for body, greens, turn in zip(bodies, modal, turns, strict=True)]
    seen, starts = [poles_of[:3] for poles_of in each_body], [poles_of[3] for poles_of in each_body]
    each_level = [[_level(*one, dt * int(length)) for one in seen] for length in lengths]
    moves, gains, ramps, strays = (
        np.array([np.concatenate([part[i] for part in level], axis=1) for level in each_level]) for i in range(4)
    )
    rest = np.concatenate([_equilibrium(*one) for one in seen], axis=1)
    start, drive = np.concatenate(starts, axis=1), each_body[0][4]
    if contacts == 1:  # the poles hold psi times each coordinate, the gap is their sum
        psi, square = poles.psi[0], poles.psi[0] ** 2
        start, drive, gains, ramps = start * psi, drive / psi[: drive.shape[1]], gains * square, ramps * square
        rest[0], strays[:, 1] = rest[0] * square, strays[:, 1] * square
        poles = history.Poles(poles.folded(), np.ones_like(poles.psi))
    return Levels(lengths, poles, moves[0, 1].copy(), moves, gains, ramps, strays, rest, own, start, drive)


def _find_poles(
    body: motion.DiscreteBody, greens: ModalGreens, turn: Array
) -> tuple[Array, Array, Array, Array, Array]:
    """Return frequencies, damping ratios and rates of the poles that move a contact, their state (2, K) at t = 0,
    and the (L, S) shapes of the body's loads: all in the order of `history.Poles.from_modes`."""
    modes, relaxations = (np.any(shapes @ turn != 0, axis=1) for shapes in (greens.shapes, greens.residual.shapes))
    state, rates = motion.find_start(body, greens), greens.residual.rates[relaxations]
    places = np.concatenate([state.displacement[modes], motion.find_relaxations(body, greens)[relaxations]])
    start = np.array([places, np.concatenate([state.velocity[modes], np.zeros(len(rates))])])
    drive = np.array([load.shape[modes] for load in body.body.loads]).reshape(len(body.body.loads), int(modes.sum()))
    return greens.omega[modes], greens.zeta[modes], rates, start, drive


def _level(omega: Array, zeta: Array, rates: Array, step: float) -> tuple[Array, Array, Array, Array]:
    """Return transitions (4, K), gains, ramps and strays (2, K) of oscillators and relaxations over a ``step`` [s]."""
    ((a11, a12), (a21, a22)), (b1, b2) = oscillator.transition(step, omega, zeta)
    decay, none = np.exp(-rates * step), np.zeros(len(rates))
    eased = step * oscillator.expm1_over(-rates * step)
    bends = np.where(zeta < 1, np.minimum(2.0, (omega * step) ** 2 / 8), np.sqrt(8.0))
    ramped = oscillator.ramp_response(np.full(omega.shape, step), omega, zeta) / step - b1 / 2
    parts = (
        ([a11, a12, a21, a22], [decay, none, none, none]),
        ([b1, b2], [eased, none]),
        ([ramped, b1 / step - b2 / 2], [none, none]),  # loads act on modes alone
        ([np.where(omega > 0, bends, 0.0), np.where(omega > 0, 0.0, step**2 / 8)], [1 - decay, none]),
    )
    moves, gains, ramps, strays = (np.concatenate(pair, axis=1) for pair in parts)
    return moves, gains, ramps, strays


def _equilibrium(omega: Array, zeta: Array, rates: Array) -> Array:
    """Return (3, K): the displacement of each pole per unit of static force, and u, v of its amplitude.

    A^2 = x^2 + (u x + v q')^2 about its equilibrium; of two real poles no less than the root of 1/2 of the largest |x|.
    """
    turns = (omega > 0) & (zeta < 1)
    damped = omega * np.sqrt(np.abs(1 - zeta**2))
    v = np.where(turns, 1 / np.where(turns, damped, 1.0), 1 / np.where(omega > 0, omega, np.inf))
    soft = 1 / np.where(omega > 0, omega, np.inf) ** 2
    none = np.zeros(len(rates))
    eased = 1 / np.where(rates > 0, rates, np.inf)
    return np.concatenate([[soft, np.where(turns, zeta * omega * v, 0.0), v], [eased, none, none]], axis=1)


def march(
    problem: ContactProblem,
    dt: float,
    duration: float,
    *,
    bodies: tuple[motion.DiscreteBody, ...] = (),
    equal_steps: bool = False,
    like: TimeGrid = NO_STEPS,
) -> MarchRun:
    """March a problem over a ``duration`` [s] for its forces and gaps, far cheaper than a run with energies.

    ``dt``: fine step [s]; ``equal_steps``, ``like``: as in `begin_march`. ``bodies`` and errors as in `impact.prepare`.
    """
    discretised = discretise(problem, dt, duration, bodies=bodies)
    return finish_march(begin_march(discretised, equal_steps=equal_steps, like=like))


def finish_march(run: ContactStepper | LadderMarch, progress: Progress = silent) -> MarchRun:
    """March to the end; return the whole run."""
    while run.done < run.steps:
        run.advance_far()
        progress("stepping", run.done / run.steps)
    return run.record_run()


def begin_march(
    discretised: Discretised, *, equal_steps: bool = False, like: TimeGrid = NO_STEPS
) -> ContactStepper | LadderMarch:
    """Return the march of a problem at its start.

    Where equal steps would take long, all bodies are sums of poles and no load depends on the opening, smooth parts of
    the motion take longer ones, unless ``equal_steps`` are asked for. ``like``: steps of a neighbouring run, which are
    taken as far as contacts neither open nor close in them: a difference of the two far below `SHARE` is then one of
    the problems alone.
    """
    is_worth_it = is_worthwhile(discretised.plan.seconds, discretised.steps * len(discretised.rest))
    if is_worth_it and not equal_steps and has_levels(discretised):
        return LadderMarch(discretised, prepare_levels(discretised), like=like)
    return ContactStepper(find_free_motion(discretised))


def is_worthwhile(seconds: float, values: float) -> bool:
    """Return whether a run takes long steps where it can, if equal ones take ``seconds`` and write ``values`` forces:
    those of each step and contact."""
    return seconds > WORTHWHILE or values > LARGE


class LadderMarch:
    """A march in fine steps, and in long ones where these are as good: its state, and the rows it has written."""

    def __init__(
        self, discretised: Discretised, levels: Levels, share: float = SHARE, like: TimeGrid = NO_STEPS
    ) -> None:
        """Begin at t = 0; ``share``: see `SHARE`; ``like``: as in `begin_march`."""
        problem, rest = discretised.problem, discretised.rest
        self._of, self._levels, p = discretised, levels, len(rest)
        self._largest = np.zeros(len(discretised.bodies[0].loads))
        rows, (q, v) = history.streams(levels.poles.steps)
        q[:], v[:] = levels.start[0], levels.start[1] * levels.scale
        self._rows, self._state, self._along = rows, (q, v), levels.poles.along()
        seen = levels.drive.shape[1]
        self._lifts = (levels.gains[0, 0, :seen] * levels.drive) @ levels.poles.psi[:, :seen].T
        self._laws = LoopLaws.from_contacts(problem.contacts, discretised.rules)
        each = [self._laws.shift(own) for own in levels.own]
        self._shifted = None if any(one is None for one in each) else np.array(each)
        self._opened = np.array([c.gap for c in problem.contacts])
        self._control = np.zeros(9, dtype=np.int64)
        self._followed = like.ends
        self._sides = np.array([3 if c.side > 0 else 4 for c in problem.contacts])
        start = self._opened + levels.poles.psi @ levels.start[0] + discretised.find_own(0) @ rest
        start = start + problem.find_base_gaps(np.zeros(1))[0]
        self._laws.numbers[:, laws.DEEPEST] = np.maximum(-start, 0.0)
        widest = [float(np.max(start[self._sides == side], initial=0.0)) for side in (3, 4)]
        self._share = np.array([share, float(np.abs(rest).sum()), BEND, *widest])
        films = 0 if self._laws.films is None else p
        self._room = np.zeros(ROOM, dtype=np.int64), np.zeros((ROOM, p)), np.zeros((ROOM, p)), np.zeros((ROOM, films))
        self._room[1][0], self._room[2][0] = rest, start
        self._first, self._chunk = 0, (np.zeros((0, 1)), np.zeros((0, 1)), np.zeros((0, p)))
        self._load_chunk(0)

    @property
    def done(self) -> int:
        """Return the fine steps done."""
        return int(self._control[loop.STEP])

    @property
    def steps(self) -> int:
        """Return the fine steps of the whole run."""
        return self._of.steps

    @property
    def level(self) -> int:
        """The level of the next step, which is lowered where a step is taken back."""
        return int(self._control[loop.LEVEL])

    @level.setter
    def level(self, level: int) -> None:
        self._control[loop.LEVEL] = level
        self._control[loop.SINCE] = self._control[loop.CALM] = 0

    def find_state(self) -> tuple[Array, Array]:
        """Return coordinates and rates (K,) of all poles at the present step, and forces (p,) with them [N]."""
        q, v = (part.copy() for part in self._state)
        levels, force = self._levels, self._room[1][self._control[loop.ROW]]
        if (pending := int(self._control[loop.PENDING])) >= 0:
            loop.restore_rates(q, v, levels.scale, levels.gains[0], force @ levels.poles.psi * (pending > 0))
        return np.array([q, v]), force.copy()

    def _resize(self, rows: int) -> None:
        """Give the histories room for so many rows, in place: a longer copy would take twice their memory."""
        for part in self._room:
            part.resize((rows, *part.shape[1:]), refcheck=False)

    def _load_chunk(self, first: int) -> None:
        """Put the loads and the moving bases of the next fine steps where the loop finds them."""
        stop = min(first + CHUNK, self._of.steps)
        amplitudes = np.ascontiguousarray(self._of.bodies[0].loads[:, first:stop])
        sums = np.concatenate([np.zeros((len(amplitudes), 1)), np.cumsum(amplitudes, axis=1)], axis=1)
        time = np.asarray(self._of.dt * np.arange(first, stop + 1), dtype=np.float64)
        self._first, problem = first, self._of.problem
        self._chunk = amplitudes, sums, problem.find_base_gaps(time if problem.has_moving_base else time[:0]).copy()

    def advance_far(self, until: int = MOST_STEPS) -> None:
        """March to step ``until`` at most; less far if the known loads or the room for rows end.

        Raises `ContactError` where a law of the user's own fails.
        """
        control, n = self._control, self.done
        if n >= self._first + CHUNK:
            self._load_chunk(n)
        stop = min(self._first + CHUNK, self._of.steps, until)
        amplitudes, sums, carried = self._chunk
        levels, known, first = self._levels, self._laws, np.int64(self._first)
        single = len(known.codes) == 1 or None
        swept = (self._shifted is None and single is None) or None
        loop.march_ladder(
            stop, control, self._share, levels.lengths, self._of.dt, (self._rows, levels.scale, self._along),
            (levels.moves, levels.gains, levels.ramps, levels.strays, levels.poles.psi, levels.rest), self._state,
            (levels.drive, self._lifts, amplitudes, sums, self._largest, first), (self._opened, carried, self._sides),
            (known.codes, known.rules, known.numbers, known.user), known.rough, known.films, levels.own, self._shifted,
            swept, single, self._followed, self._room,
        )  # fmt: skip
        known.check()
        row = int(control[loop.ROW])
        if self.done == self._of.steps:
            self._resize(row + 1)
        elif row + 1 == len(self._room[0]):
            self._resize(row + 1 + ROOM)

    def record_run(self) -> MarchRun:
        """Return the whole run, with the histories of this march."""
        ends, force, gap, film = self._room
        return MarchRun(
            problem=self._of.problem,
            bodies=self._of.bodies,
            own=self._levels.own[0],
            rows=Rows(self._of.dt, ends, force, gap, film),
            engine=self._of.plan.words,
            unsolved=int(self._control[loop.UNSOLVED]),
        )
