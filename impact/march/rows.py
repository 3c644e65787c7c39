"""Histories of a run without energies: a row a step, and the same at fine steps."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from impact.bodies.body import Body
from impact.greens.base import Array
from impact.march.grid import AtEqualSteps, TimeGrid
from impact.march.motion import DiscreteBody, PortForces, find_mean_displacement
from impact.march.problem import ContactProblem
from impact.quantities import brief


@dataclass(frozen=True)
class Rows(TimeGrid):
    """Contact forces and gaps of p contacts, a row a step of the march; the first row is the start.

    Attributes:
        force: (N + 1, p) force during the step that ends there [N]; first the preload.
        gap: (N + 1, p) gap at the end of each step [m].
        film: (N + 1, p) part of the force by films [N]; (N + 1, 0) without films.
    """

    force: Array
    gap: Array
    film: Array

    __repr__ = brief

    @property
    def solid(self) -> Array:
        """Return the (N + 1, p) force of solid contact [N], without films."""
        return self.force - self.film if self.film.size else self.force

    def drop_gaps(self) -> Rows:
        """Return the rows without gaps, as those of many contacts are large."""
        return replace(self, gap=np.zeros((0, self.gap.shape[1])))

    def until(self, step: int) -> Rows:
        """Return the rows up to a fine ``step``, which cuts the step that contains it."""
        ends = super().until(step).ends
        own, gap = slice(len(ends)), self.find_motions(self.gap, ends[-1:])
        return Rows(self.dt, ends, self.force[own], np.concatenate([self.gap[own][:-1], gap]), self.film[own])

    def drop_forces(self) -> Rows:
        """Return the rows without forces."""
        return replace(self, force=np.zeros((0, self.gap.shape[1])), film=np.zeros((0, 0)))


@dataclass(frozen=True)
class MarchRun(AtEqualSteps):
    """A run without energies: its forces and gaps, and what they act on.

    Attributes:
        problem: the contact problem.
        bodies: its discretised bodies, striker first, with the amplitudes of all loads as they were.
        own: (p, p) displacement by a unit force at the end of its own fine step [m/N].
        rows: forces and gaps.
        engine: the history engines in words.
        unsolved: number of steps whose coupled forces were not found to 1e-12.
    """

    problem: ContactProblem
    bodies: tuple[DiscreteBody, ...]
    own: Array
    rows: Rows
    engine: str
    unsolved: int = 0

    __repr__ = brief

    @property
    def steps(self) -> int:
        """Return the number of fine steps."""
        return int(self.rows.ends[-1])

    @property
    def rest(self) -> Array:
        """Return the (p,) contact forces of the preload [N]."""
        return np.asarray(self.rows.force[0])

    def until(self, step: int) -> MarchRun:
        """Return the run as if it had ended after a fine ``step``."""
        return replace(self, rows=self.rows.until(step), bodies=tuple(body.until(step) for body in self.bodies))

    @cached_property
    def opening(self) -> Array:
        """Return the (n + 1,) mean gap of the seats at fine steps [m]."""
        return self.rows.spread_motions(self.rows.gap @ find_seats(self.problem))

    def force_on(self, contacts: slice) -> Array:
        """Return the (n + 1,) sum of the forces of some contacts at fine steps [N]."""
        return self.rows.spread_forces(self.rows.force[:, contacts].sum(axis=1))


def find_seats(problem: ContactProblem) -> Array:
    """Return (p,) weights by which the gaps of the contacts with seats, or with all where there is none, are
    averaged."""
    seats = np.array([contact.side > 0 for contact in problem.contacts])
    seats = seats if np.any(seats) else ~seats
    return np.asarray(seats / np.count_nonzero(seats))


def find_ports(problem: ContactProblem, body: Body) -> tuple[list[int], list[int]]:
    """Return the contacts of a body, and its port at each."""
    striker, greens = body is problem.striker, body.greens
    each = [(c, one.striker_port if striker else one.port) for c, one in enumerate(problem.contacts)]
    own = [(c, port) for c, port in each if striker or problem.contacts[c].target is body]
    return [c for c, _ in own], [greens.port_index(port) for _, port in own]


def _add(moved: Array, seen: Array, part: slice, displacement: Array) -> None:
    moved[part] += displacement.T @ seen


@dataclass(frozen=True)
class Replayed:
    """Displacements of targets, or of the striker, at contacts of a run, made from its forces when they are asked for.

    They stand for an array (N + 1, k), or (N + 1,): the displacements (N + 1, p) at all contacts times ``weights``.

    Attributes:
        run: the run, without gaps.
        weights: (p, k) or (p,).
        gap: (N + 1, p) gaps [m], by which the striker is above the targets; (0, p): those of the targets are meant.
    """

    run: MarchRun
    weights: Array
    gap: Array

    __repr__ = brief

    def __getitem__(self, place: tuple[slice, int | slice]) -> Replayed:
        """Return those at some contacts, by ``[:, which]``."""
        return replace(self, weights=self.weights[place])

    def __matmul__(self, weights: Array) -> Array:
        return np.asarray(replace(self, weights=self.weights @ weights))

    def __array__(self, dtype: None = None, copy: bool | None = None) -> Array:
        run, problem, time = self.run, self.run.problem, self.run.rows.time
        weights = self.weights.reshape(len(self.weights), -1)
        moved = np.zeros((len(time), weights.shape[1]))
        for body in run.bodies[1:]:
            contacts, ports = find_ports(problem, body.body)
            if not np.any(weights[contacts]):
                continue
            seen = np.zeros((len(body.rest), weights.shape[1]))
            np.add.at(seen, ports, weights[contacts])
            forces = PortForces(run.rows, run.rows.force[1:].T, problem.directions(body.body))
            if weights.shape[1] == 1:
                moved[:, 0] += find_mean_displacement(body, forces, seen[:, 0])
            else:
                body.motion(forces, partial(_add, moved, seen), energies=False)
            moved += body.body.find_base_displacement(time)[:, None] * weights[contacts].sum(axis=0)
        if len(self.gap):
            sides = np.array([contact.side for contact in problem.contacts])
            moved += self.gap @ (sides[:, None] * weights)
            moved -= np.array([contact.gap for contact in problem.contacts]) * sides @ weights
        return moved.reshape(len(time), *self.weights.shape[1:])
