"""Interface of a body as a striker: initial deflection, contact face, response to loads, strain and stress."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from typing import Final, Literal, Protocol

import numpy as np

from impact import after
from impact.bodies.body import Body
from impact.greens.base import Array, GreensFunctionError
from seatfem.fields import KeyProblem, Table
from seatfem.structures.estimates.surrogate import Face
from seatfem.units import write_quantity

At = float | tuple[float, ...] | None
"""Distances of the contact or contacts from the root of a body [m]; ``None``: the default contact."""


Push = Literal["force", "springs", "pressure"]
"""Origin of a load on a body: a force, springs that press it, or a pressure on an effective area at its contact."""
LOADS: Final = ("force", "pressure", "point_force", "gravity")
"""Keys of the prescribed loads of all kinds."""


class KnownStress(Protocol):
    """The stress of a striker under known contact forces."""

    def largest(self, *, coarsely: bool, since: float | None = None) -> after.stresses.ReedStress:
        """Return the largest stresses of the run, and those before and after the time ``since`` of a landing [s]."""

    def histories(self, also: Collection[float] = (), *, few: bool = False) -> Iterator[tuple[str, Array]]:
        """Yield the name of each place that may fail and its stress over time [Pa]: (n + 1,) uniaxial at a free
        surface, > 0 in tension, or (n + 1, 6) tensors xx, yy, zz, yz, xz, xy.

        ``also``: further places, as distances from the root [m]; ``few``: these, the root and the contacts only.
        """


class Striking(Table):
    """A body as a striker; the defaults are those of a body at rest without positions along it."""

    kind: str

    @property
    def face(self) -> Face:
        """Return the contact face of this body."""
        return Face()

    def start_at(self, at: float | None) -> float:
        """Return the initial deflection away from the seat [m] at the distance ``at`` from the root; ``None``: at the
        contact."""
        return 0.0

    def check_place(self, place: float | Array | None, key: str) -> None:
        """Raise a `KeyProblem` of ``key`` unless a force can act at a place: a distance from the root [m], or points
        (n, 2) relative to the centre of the contact [m]."""
        if isinstance(place, np.ndarray):
            raise KeyProblem(
                key,
                f"a {self.kind.replace('_', ' ')} has no places across its face; remove the key, or take a plate: a "
                "flapper, sheet, disc or ring_plate",
            )
        check_along(self.kind, None, place, key)

    def pushed_at(self, body: Body, place: float | Array | None, by: Push = "force") -> Array:
        """Return the (M, n) modal forces of unit forces on ``body`` [1/sqrt(kg)]: one at a distance from the root [m],
        or those at points (n, 2) relative to the centre of the contact [m]; ``None``: at the contact, or at the default
        places of springs. ``by``: a pressure is scaled to a total force of one.

        Raises `GreensFunctionError` for a body without modes.
        """
        if (modal := body.greens.modal) is None or len(modal.omega) == 0:
            raise GreensFunctionError(f"load: a reed of kind {self.kind!r} has no modes that a load could move")
        return np.asarray(modal.shapes[:, :1])

    @property
    def wave_speed(self) -> float | None:
        """Return the speed [m/s] of incoming waves towards the struck end; ``None`` if the body admits none."""
        return None

    def check_gauge(self, at: float, key: str) -> None:
        """Raise a `KeyProblem` of ``key`` unless the strain is known at the distance ``at`` [m]."""
        raise KeyProblem(
            key, f"of a {self.kind.replace('_', ' ')} no strain is known at places; take a rod or a cantilever"
        )

    def strain_at(self, place: float, force: Array, dt: float, body: Body, at: At = None) -> Array:
        """Return the strain (n + 1,) at a place [m], > 0 in tension, under contact forces as in `stress`; of a seat or
        stopper, under the force (n + 1,) that presses on it."""
        raise NotImplementedError

    def weight(self, body: Body) -> tuple[Array, float]:
        """Return the (M,) modal forces of a unit force distributed like the mass [1/sqrt(kg)], and the mass [kg]."""
        raise NotImplementedError

    def stress(self, force: Array, dt: float, body: Body, at: At) -> KnownStress | None:
        """Return its stress under a contact force (n + 1,) [N], or several forces (n + 1, p), positive away from the
        seat; ``None`` if its stress is not known."""
        return None


def is_loaded(body: Striking) -> bool:
    """Return whether a body has prescribed loads."""
    return any(getattr(body, key, None) is not None for key in LOADS)


def is_curved(body: Striking) -> bool:
    """Return whether a body has a stress-free curvature."""
    return getattr(body, "curvature", None) is not None


def check_along(kind: str, reach: float | None, at: float | None, key: str) -> None:
    """Raise a `KeyProblem` of ``key`` for a distance ``at`` beyond the length ``reach`` of a body [m]."""
    if at is None:
        return
    if reach is None:
        raise KeyProblem(key, f"a {kind.replace('_', ' ')} has no positions; remove the key")
    if at > reach:
        raise KeyProblem(
            key, f"{write_quantity(at, 'length')} must lie on the reed, which ends at {write_quantity(reach, 'length')}"
        )
