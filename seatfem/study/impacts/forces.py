"""A run of a striker on a seat, and its contact forces: by the parts of the struck patches, and on the ports of the
bodies, which may be divided otherwise."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from impact.after.histories import UNKNOWN_STRESS, ReedStress
from impact.after.loads import without_springs
from impact.bodies.body import Body
from impact.greens.base import Array, GreensFunction
from impact.march.rows import MarchRun
from impact.march.stepper import with_recorded_loads
from seatfem.structures.kinds.structure import KnownStress
from seatfem.structures.rings import Division, ring_borders
from seatfem.study.impacts.landings import seat_contacts
from seatfem.study.impacts.touches import Touches, pushes
from seatfem.study.scene import ContactGeometry
from seatfem.study.scene.lips import STOPPER

WHOLE: Final = Division()


@dataclass(frozen=True)
class PatchForces:
    """Forces (n + 1, parts) on the parts of a patch that a ``division`` makes [N]."""

    parts: Array
    division: Division = WHOLE

    def by(self, wanted: Division) -> Array:
        """Return the (n + 1, parts) forces on the parts of another division, for uniform pressure on each part [N]."""
        own = self.division
        if own == wanted:
            return self.parts
        across = overlaps(ring_borders(own.rings), ring_borders(wanted.rings))
        along = overlaps(np.linspace(0, 1, own.arcs + 1), np.linspace(0, 1, wanted.arcs + 1))
        parts = self.parts.reshape(-1, own.arcs, own.rings)
        return np.asarray(np.einsum("nar,ab,rc->nbc", parts, along, across, optimize=True)).reshape(len(parts), -1)


@dataclass(frozen=True)
class Forces:
    """Contact forces of one run.

    Attributes:
        seat: forces on the parts of the seat's patch.
        stopper: forces on the parts of the stopper's patch; ``None`` without one.
        dt: time step [s].
        opening: (n + 1,) mean gap at the seat, on which loads may depend [m].
        apart: whether seat and stopper meet the striker at different places along it.
    """

    seat: PatchForces
    stopper: PatchForces | None
    dt: float
    opening: Array
    apart: bool = False

    @staticmethod
    def from_march(run: MarchRun) -> Forces:
        """Return the contact forces on a plate in a run."""
        problem, seats = run.problem, seat_contacts(run.problem)
        parts, above = run.force[:, :seats], run.force[:, seats:]
        division = Division.from_greens(problem.target.greens) if parts.shape[1] > 1 else WHOLE
        of_stopper = _behind(problem.striker.greens)
        if of_stopper.count == 1:  # met at one port, in however many parts
            above = above.sum(axis=1, keepdims=True)
        stopper = PatchForces(above, of_stopper) if problem.contacts[seats:] else None
        return Forces(PatchForces(parts, division), stopper, run.dt, run.opening)

    @staticmethod
    def from_touches(geometry: ContactGeometry, seat: GreensFunction, touches: Touches) -> Forces:
        """Return the contact forces in the results of a run; ``seat``: whose ports are the parts of its patch."""
        parts, above, stopper = touches.parts, touches.stopper_parts, None
        if touches.stopper is not None and geometry.stopper is not None:
            whole = PatchForces(touches.stopper.force[:, None])
            stopper = whole if above is None else PatchForces(above.force, geometry.stopper.parts)
        of_seat = PatchForces(touches.seat.force[:, None])
        if parts is not None:
            of_seat = PatchForces(parts.force, Division.from_greens(seat))
        return Forces(of_seat, stopper, touches.seat.dt, touches.opening, geometry.has_two_places)

    def find_striker_forces(self, greens: GreensFunction, division: Division | None = None) -> Array:
        """Return the (n + 1, ports) forces on the ports of a striker, away from the seat [N]; ``division``: of the
        seat's patch there, by default that of the forces."""
        force, division = np.zeros((len(self.seat.parts), len(greens.ports))), division or self.seat.division
        for name, pushed in zip(division.names, self.seat.by(division).T, strict=True):
            force[:, greens.port_index(name) if name in greens.ports else 0] += pushed
        if self.stopper is not None:
            behind = self.stopper.division if self.apart else _behind(greens)
            for k, (name, pushed) in enumerate(zip(behind.names, self.stopper.by(behind).T, strict=True)):
                port, other = STOPPER + name, 1 + k if self.apart else 0
                force[:, greens.port_index(port) if port in greens.ports else other] -= pushed
        return force

    def find_seat_forces(self, greens: GreensFunction) -> Array:
        """Return the (n + 1, ports) forces on the ports of the seat [N]; one on the whole patch is divided over the
        rings by their areas."""
        return -self.seat.by(Division.from_greens(greens))

    def loaded(self, striker: Body, pushes: Array) -> Body:
        """Return the striker in its modes with its loads in the run, under forces (n + 1, ports) on its ports [N]."""
        return without_springs(with_recorded_loads(striker, self.opening, self.dt), pushes, self.dt)


@dataclass(frozen=True)
class Strike:
    """A run of a striker on a seat.

    Attributes:
        geometry: positions and gaps of the bodies.
        striker: the striker at the start.
        seat: Green's function whose ports are the parts of the seat's patch.
        touches: results of the run, on this seat or another in its place.
        stress: the reed's largest stresses in the run, if they are known.
    """

    geometry: ContactGeometry
    striker: Body
    seat: GreensFunction
    touches: Touches
    stress: ReedStress = UNKNOWN_STRESS

    @property
    def forces(self) -> Forces:
        """Return the contact forces."""
        return Forces.from_touches(self.geometry, self.seat, self.touches)

    @property
    def pushes(self) -> Array:
        """Return the (n + 1, ports) forces on the ports of the striker, away from the seat [N]."""
        return self.forces.find_striker_forces(self.striker.greens)

    @property
    def on_seat(self) -> Array:
        """Return the (n + 1, ports) forces on the ports of the seat [N]."""
        return self.forces.find_seat_forces(self.seat)

    @property
    def dt(self) -> float:
        """Return the time step [s]."""
        return self.touches.seat.dt

    @property
    def division(self) -> Division:
        """Return the division of the seat's patch."""
        return Division.from_greens(self.seat)

    @property
    def known_stress(self) -> KnownStress | None:
        """Return the striker's stress, if it is known in closed form."""
        run = self.touches
        return known_stress(self.geometry, self.striker, run.seat.force, run.stopper_forces, run.opening, self.dt)

    def largest_stress(self, *, coarsely: bool = False, since: float = math.nan) -> ReedStress:
        """Return the largest of `known_stress`; ``since``: start of a landing [s], before and after which the largest
        stresses are reported separately, too; nan without one."""
        return UNKNOWN_STRESS if (known := self.known_stress) is None else known.largest(coarsely=coarsely, since=since)


def known_stress(
    geometry: ContactGeometry, striker: Body, force: Array, stopper: Array | None, opening: Array, dt: float
) -> KnownStress | None:
    """Return the stress of a striker under the contact forces of the seat (n + 1,) and of the stopper, or its parts
    (n + 1, parts) [N], if it is known in closed form. ``opening``: (n + 1,) mean gap at the seat, for loads that depend
    on the lift [m]."""
    if geometry.reed.traits.stress != "closed form":
        return None
    forces = pushes(striker, force, stopper)
    body = without_springs(with_recorded_loads(striker, opening, dt), forces, dt)
    return geometry.reed.stress(forces, dt, body, geometry.contact_at)


def _behind(greens: GreensFunction) -> Division:
    """Return the division of the stopper's patch by the ports of a striker; undivided where it has none for it."""
    names = tuple(name.removeprefix(STOPPER) for name in greens.ports if name.startswith(STOPPER))
    return Division.from_names(names or WHOLE.names)


def overlaps(have: Array, wanted: Array) -> Array:
    """Return the (h, w) fraction of each of h intervals that lies in each of w others; edges (h + 1,) and (w + 1,)."""
    low = np.maximum(have[:-1, None], wanted[None, :-1])
    high = np.minimum(have[1:, None], wanted[None, 1:])
    return np.asarray(np.maximum(high - low, 0.0) / np.diff(have)[:, None])
