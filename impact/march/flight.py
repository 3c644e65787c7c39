"""Free bodies under loads: their flight is carried together with what the contacts give them.

Marched apart and added up, the fall of a mass under its load and the lift of its contacts both grow like t^2 and
cancel: after n steps the gap would be off by eps n^2 load h^2/m. So the translations start anew at the end of every
block, from the sum of both.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from impact.bodies.body import Body, ModalState
from impact.greens.base import Array
from impact.greens.modal import ModalGreens, Residual
from impact.march.motion import Discrete
from impact.march.replay import resting, translate

BLOCK = 512  # steps


@dataclass(frozen=True)
class Flight:
    """The R loaded translations (rigid-body modes) of all bodies that a contact sees.

    ``psi`` (p, R): what each adds to the gaps, per unit of its modal coordinate; these are the march's last R poles.
    ``start`` (2, R): coordinates and rates at t = 0; ``drive`` (R, n): modal forces of the loads, constant over each
    step; ``others`` (n + 1, p): gaps without contact and without these.
    """

    psi: Array
    start: Array
    drive: Array
    others: Array


@dataclass(frozen=True)
class Flying:
    """The same of one body: ``free``, the translations alone, on whose ports the contacts act by ``turn`` (P, p)."""

    free: ModalGreens
    turn: Array
    start: Array
    drive: Array


def parted(bodies: tuple[Discrete, ...], turns: list[Array]) -> tuple[tuple[Discrete, ...], list[Flying]]:
    """Return the bodies without their loaded translations, and these; ``turns``: (P, p) of each body."""
    parts, flying = list(bodies), []
    for number, (discrete, turn) in enumerate(zip(bodies, turns, strict=True)):
        body, g = discrete.body, discrete.body.greens.modal if discrete.body.loads else None
        if g is None or not any(np.any(load.shape[g.omega == 0]) for load in body.loads):
            continue  # no load acts on a translation
        rigid, start = g.omega == 0, body.modal_start()
        held, free = g.of_modes(~rigid), g.of_modes(rigid, Residual.none(len(g.ports)))
        bends = bool(np.any(~rigid))
        state = ModalState(start.displacement[~rigid], start.velocity[~rigid]) if bends else None
        loads = tuple(replace(load, shape=load.shape[~rigid]) for load in body.loads if bends)
        kernel, amplitudes = held.step_kernel(discrete.dt, discrete.loads.shape[1]), discrete.loads[: len(loads)]
        rest_loads, still = np.zeros(len(loads)), Body(held, 0.0, state, loads)
        parts[number] = Discrete(still, kernel, discrete.dt, amplitudes, discrete.rest, rest_loads)
        drive = np.stack([load.shape[rigid] for load in body.loads], axis=1) @ discrete.loads
        if np.any(seen := np.any(free.shapes @ turn != 0, axis=1)):
            now = np.array([start.displacement[rigid], start.velocity[rigid]])
            flying.append(Flying(free.of_modes(seen), turn, now[:, seen], drive[seen]))
    return tuple(parts), flying


class Pilot:
    """Lays the flight of one block after the other into the free gaps of a march.

    Attributes:
        base: (2, R) modal coordinates and rates, contacts included, at the start of the present block.
    """

    def __init__(self, flight: Flight, dt: float, free: Array) -> None:
        self._flight, self._dt, self._free = flight, dt, free
        self.base = flight.start.copy()
        self._end = self._lay(0)

    def resume(self, done: int) -> None:
        """Go on after ``base`` was set anew, that of the block that step ``done`` lies in."""
        self._end = self._lay(done - done % BLOCK)

    def turn(self, done: int, state: tuple[Array, Array], last: Array, folded: bool) -> None:
        """Move, at the end of a block, what the poles ``state`` hold of it into a new base.

        The march gives the last forces ``last`` (p,) to the poles with the next step only; they are moved too, and
        the poles left holding their negative.
        """
        h, psi, count = self._dt, self._flight.psi, self.base.shape[1]
        q, p = (part[-count:] for part in state)
        scale = psi[0] if folded else np.ones(count)  # one contact: the poles hold psi times the coordinate
        push = last @ psi
        self.base = self._end + np.array([q / scale + h * h / 2 * push, p / (scale * h) + h * push])
        q[:], p[:] = -scale * h * h / 2 * push, -scale * h * h * push
        self._end = self._lay(done)

    def _lay(self, first: int) -> Array:
        """Add the flight of the block from step ``first`` to the free gaps; return where it ends, (2, R)."""
        h, drive = self._dt, self._flight.drive[:, first : first + BLOCK]
        if drive.shape[1] == 0:
            return self.base.copy()
        places, rates = np.empty_like(drive), np.empty_like(drive)
        for row in range(len(drive)):
            translate(h, resting(*self.base[:, row]), drive[row], places[row], rates[row])
        self._free[first : first + drive.shape[1]] += (self._flight.psi @ places).T
        return np.array([places[:, -1], rates[:, -1]])
