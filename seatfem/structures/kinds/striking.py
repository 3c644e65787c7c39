"""What a body answers as a striker: how it moves, with what face it touches, and where its theory ends."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from impact.advice import Advice
from impact.bodies.body import Body
from impact.greens.base import Array, GreensFunction, GreensFunctionError
from seatfem.fields import KeyProblem, Table
from seatfem.structures.estimates.surrogate import Face
from seatfem.units import write_quantity

if TYPE_CHECKING:
    from impact.after.stresses import ReedStress

At = float | tuple[float, ...] | None
"""Where a body is touched, from its root [m]: once, or at several places; ``None``: where it is by default."""


class Striking(Table):
    """A body in the role of a striker; what is said here holds for one that is at rest and has no positions."""

    kind: str

    is_solved: ClassVar[bool] = False
    """Whether its Green's function must be computed or read before it strikes."""
    meets_lips: ClassVar[bool] = False
    """Whether it bends under a lip, arc by arc; else it touches with one rigid face."""
    has_weight: ClassVar[bool] = False
    """Whether `weight` is known."""
    has_stress: ClassVar[bool] = False
    """Whether its bending stress is known while it strikes."""
    has_surface_stress: ClassVar[bool] = False
    """Whether stress in its surface is recovered from its elements when the forces are known."""

    def stand_in(self, duration: float, face: Face) -> GreensFunction | None:
        """Return what stands for the Green's function of one that `is_solved` in pre-runs; ``None``: nothing does.

        ``face``: of what it strikes.
        """
        return None

    @property
    def widest_band(self) -> float:
        """Return the highest band up to which its theory holds [Hz]."""
        return math.inf

    @property
    def states_contact(self) -> bool:
        """Return whether its table says with which part of it it touches."""
        return False

    @property
    def is_curved(self) -> bool:
        """Return whether it is not flat without stress."""
        return False

    def heights(self, points: Array) -> Array:
        """Return the (n,) heights of its stress-free shape over the flat one, at points (n, 2) from its contact's
        centre [m]. Raises `KeyProblem`, of a key of its table, of points that it is not known at."""
        return np.zeros(len(points))

    @property
    def face(self) -> Face:
        """Return the face that it touches with."""
        return Face()

    @property
    def reach(self) -> float | None:
        """Return the length along which a contact may lie [m]; ``None`` of a body without positions."""
        return None

    @property
    def motion(self) -> str:
        """Return the key that states how it starts or what drives it; "" of a body at rest."""
        return next((key for key in self.moved_by if getattr(self, key) is not None), "")

    @property
    def moved_by(self) -> tuple[str, ...]:
        """Return the keys that would state it; none of a body that cannot strike."""
        return ()

    @property
    def is_loaded(self) -> bool:
        """Return whether known forces drive it."""
        return False

    @property
    def free_point(self) -> float | None:
        """Return where it is touched unless stated [m]; ``None`` of a body without positions."""
        return None

    def start_at(self, at: float | None) -> float:
        """Return its deflection at a place at the start [m], away from the seat; ``None``: where it is touched."""
        return 0.0

    def check_contact(self, at: float | None, key: str = "contact.at") -> None:
        """Raise `KeyProblem`, of ``key``, for a contact at a place that it does not have."""
        if at is None:
            return
        if self.reach is None:
            raise KeyProblem(key, f"a {self.kind.replace('_', ' ')} has no positions; remove the key")
        if at > self.reach:
            raise KeyProblem(
                key,
                f"{write_quantity(at, 'length')} must lie on the reed, which ends at "
                f"{write_quantity(self.reach, 'length')}",
            )

    def check_place(self, at: float | None, key: str) -> None:
        """Raise `KeyProblem`, of ``key``, for a force at a place that it does not have."""
        self.check_contact(at, key)

    def pushed_at(self, body: Body, at: float | None) -> Array:
        """Return (M,) how a force at a place moves the modes of its ``body`` [1/sqrt(kg)]; ``None``: where it is
        touched.

        Raises `GreensFunctionError` of a body without modes.
        """
        if (modal := body.greens.modal) is None or len(modal.omega) == 0:
            raise GreensFunctionError(f"load: a reed of kind {self.kind!r} has no modes that a load could move")
        return np.asarray(modal.shapes[:, 0])

    def check_points(self, points: Array, key: str) -> None:
        """Raise `KeyProblem`, of ``key``, for points (n, 2), from its contact's centre [m], that it does not have."""
        raise KeyProblem(
            key,
            f"a {self.kind.replace('_', ' ')} has no places across its face; remove the key, or take a plate: a "
            "flapper, sheet, disc or ring_plate",
        )

    @property
    def spring_points(self) -> Array | None:
        """Return (n, 2) places where springs press it by default, from its contact's centre [m]; ``None``: there."""
        return None

    def pushed_at_points(self, body: Body, points: Array | None) -> Array:
        """Return (M, n) how forces at points (n, 2), from its contact's centre [m], move the modes of its ``body``
        [1/sqrt(kg)]; ``None``: where springs press it by default.

        Raises as `pushed_at`."""
        return self.pushed_at(body, None)[:, None]

    def blown(self, body: Body) -> Array:
        """Return (M,) how a pressure on an effective area at the contact moves the modes, per newton [1/sqrt(kg)].

        Raises as `pushed_at`."""
        return self.pushed_at(body, None)

    def weight(self, body: Body) -> tuple[Array, float]:
        """Return (M,) how a force spread like its mass moves the modes [1/sqrt(kg)], and the mass [kg]."""
        raise NotImplementedError

    def check_motion(self) -> None:
        """Raise `KeyProblem` for a motion that it is known not to be capable of."""

    def as_a_beam(self, greens: GreensFunction) -> Body | None:
        """Return the beam that a simpler model would take for it; ``None`` where there is none of the same motion.

        ``greens``: its own Green's function.
        """
        return None

    def stress(
        self, force: Array, dt: float, body: Body, at: At, *, coarsely: bool, since: float | None = None
    ) -> ReedStress | None:
        """Return its largest bending stresses under a contact force (n + 1,) [N], or those at several places, (n + 1,
        p), positive away from the seat, before and after the time ``since`` at which a landing begins, too [s];
        ``None`` where it has none that is known."""
        return None

    def stress_histories(
        self, force: Array, dt: float, body: Body, at: At, also: Collection[float] = (), *, few: bool = False
    ) -> Iterator[tuple[str, Array]]:
        """Yield where it may fail, by name, under contact forces as in `stress`: (n + 1,) stress at a free surface, of
        one axis, > 0 in tension, or (n + 1, 6) tensors, xx, yy, zz, yz, xz, xy [Pa]; none where none is known.
        ``also``: places that must be among them, from its root [m]; ``few``: these alone, its root and the contacts."""
        yield from ()

    def too_thick(self) -> str:
        """Return why its theory does not hold; "" where it can."""
        return ""

    def shear_error(self, at: float | None) -> float:
        """Return the relative error of its compliance for want of shear."""
        return 0.0

    def limits(self) -> tuple[Advice, ...]:
        """Report where it is asked for more than its theory holds."""
        return ()

    def assumed(self) -> tuple[str, ...]:
        """Return the keys that were not given, with the values that stand for them, as far as a reader must know."""
        return ()
