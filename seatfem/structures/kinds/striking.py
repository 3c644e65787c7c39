"""What a body answers as a striker: how it moves, with what face it touches, and where its theory ends."""

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
"""Distances from its root [m] at which a body is touched: one, or several; ``None``: the default place."""


Push = Literal["force", "springs", "pressure"]
"""Origin of a load on a body: a force, springs that press it, or a pressure on an effective area at its contact."""
LOADS: Final = ("force", "pressure", "point_force", "gravity")
"""Keys of kinds that hold known forces."""


class KnownStress(Protocol):
    """The stress of a striker under known contact forces."""

    def largest(self, *, coarsely: bool, since: float | None = None) -> after.stresses.ReedStress:
        """Return the largest stresses, before and after the time ``since`` at which a landing begins, too [s]."""

    def histories(self, also: Collection[float] = (), *, few: bool = False) -> Iterator[tuple[str, Array]]:
        """Yield where it may fail, by name: (n + 1,) stress at a free surface, of one axis, > 0 in tension, or
        (n + 1, 6) tensors, xx, yy, zz, yz, xz, xy [Pa].

        ``also``: places that must be among them, from its root [m]; ``few``: these alone, its root and the contacts.
        """


class Striking(Table):
    """A body in the role of a striker; the defaults are those of one at rest without positions."""

    kind: str

    @property
    def face(self) -> Face:
        """Return the face that it touches with."""
        return Face()

    def start_at(self, at: float | None) -> float:
        """Return its deflection at a place at the start [m], away from the seat; ``None``: where it is touched."""
        return 0.0

    def check_place(self, place: float | Array | None, key: str) -> None:
        """Raise `KeyProblem`, of ``key``, for a force at a place that it does not have: at a distance from its root
        [m], or at points (n, 2) from its contact's centre [m]."""
        if isinstance(place, np.ndarray):
            raise KeyProblem(
                key,
                f"a {self.kind.replace('_', ' ')} has no places across its face; remove the key, or take a plate: a "
                "flapper, sheet, disc or ring_plate",
            )
        check_along(self.kind, None, place, key)

    def pushed_at(self, body: Body, place: float | Array | None, by: Push = "force") -> Array:
        """Return (M, n) how forces move the modes of its ``body`` [1/sqrt(kg)]: one at a distance from its root [m], or
        those at points (n, 2) from its contact's centre [m]; ``None``: where it is touched, or springs press it by
        default. ``by``: a pressure counts per newton.

        Raises `GreensFunctionError` of a body without modes.
        """
        if (modal := body.greens.modal) is None or len(modal.omega) == 0:
            raise GreensFunctionError(f"load: a reed of kind {self.kind!r} has no modes that a load could move")
        return np.asarray(modal.shapes[:, :1])

    @property
    def wave_speed(self) -> float | None:
        """Return the speed of waves [m/s] that may come along it to its struck end; ``None`` where none may."""
        return None

    def check_gauge(self, at: float, key: str) -> None:
        """Raise `KeyProblem`, of ``key``, for a strain gauge at a place that it does not have [m]."""
        raise KeyProblem(
            key, f"of a {self.kind.replace('_', ' ')} no strain is known at places; take a rod or a cantilever"
        )

    def strain_at(self, place: float, force: Array, dt: float, body: Body, at: At = None) -> Array:
        """Return the strain (n + 1,) at a place [m], > 0 in tension, under forces as `stress` takes them, of a seat or
        stopper under that (n + 1,) which presses on it."""
        raise NotImplementedError

    def weight(self, body: Body) -> tuple[Array, float]:
        """Return (M,) how a force spread like its mass moves the modes [1/sqrt(kg)], and the mass [kg]."""
        raise NotImplementedError

    def stress(self, force: Array, dt: float, body: Body, at: At) -> KnownStress | None:
        """Return its stress under a contact force (n + 1,) [N], or those at several places, (n + 1, p), positive away
        from the seat; ``None`` where it has none that is known."""
        return None


def is_loaded(body: Striking) -> bool:
    """Return whether known forces drive a body."""
    return any(getattr(body, key, None) is not None for key in LOADS)


def is_curved(body: Striking) -> bool:
    """Return whether a body is not flat without stress."""
    return getattr(body, "curvature", None) is not None


def check_along(kind: str, reach: float | None, at: float | None, key: str) -> None:
    """Raise `KeyProblem`, of ``key``, for a place that a body which reaches so far from its root [m] does not have."""
    if at is None:
        return
    if reach is None:
        raise KeyProblem(key, f"a {kind.replace('_', ' ')} has no positions; remove the key")
    if at > reach:
        raise KeyProblem(
            key, f"{write_quantity(at, 'length')} must lie on the reed, which ends at {write_quantity(reach, 'length')}"
        )
