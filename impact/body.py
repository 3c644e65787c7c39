"""A body: a Green's function and the motion it would have without contact."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from impact.closed_form import DelayRod
from impact.damped_rods import DampedFreeRod
from impact.greens import Array, ErrorEstimate, GreensFunction, GreensFunctionError
from impact.modal import ModalGreens, Residual
from impact.poles import PoleGreens


@dataclass(frozen=True)
class ModalState:
    """Initial modal coordinates q [m sqrt(kg)] and their rates [m sqrt(kg)/s], both (M,)."""

    displacement: Array
    velocity: Array


@dataclass(frozen=True)
class Load:
    """A prescribed force with a fixed place and a given course in time: modal forces shape_k * amplitude(t).

    Attributes:
        shape: (M,) participation of each mode; the mode shapes at x for a point force [1/sqrt(kg)].
        amplitude: force at the times given, (n,) s -> (n,) N; taken at the middle of each step.
    """

    shape: Array
    amplitude: Callable[[Array], Array]


@dataclass(frozen=True)
class Body:
    """One of the partners of an impact, at rest and without loads unless stated.

    Attributes:
        greens: its Green's function.
        velocity: uniform translation along the normal before contact [m/s]; only for a body free to move.
        state: initial modal state of a modal body (a deflected reed).
        loads: prescribed forces on a modal body (pressure, gravity).
    """

    greens: GreensFunction
    velocity: float = 0.0
    state: ModalState | None = None
    loads: tuple[Load, ...] = ()

    def __post_init__(self) -> None:
        if not math.isfinite(self.velocity):
            raise GreensFunctionError(f"velocity = {self.velocity} must be finite")
        if self.velocity != 0.0 and math.isinf(self.mass):
            raise GreensFunctionError(f"a body that is held cannot translate at {self.velocity:g} m/s")
        modes = len(self.greens.omega) if isinstance(self.greens, ModalGreens) else 0
        if self.state is not None:
            for name, values in (("displacement", self.state.displacement), ("velocity", self.state.velocity)):
                _modal_values(f"state.{name}", values, modes)
        for number, load in enumerate(self.loads):
            _modal_values(f"loads[{number}].shape", load.shape, modes)

    @property
    def mass(self) -> float:
        """Mass of the rigid translation along the normal at the first port [kg]; ``inf`` if the body is held."""
        g = self.greens
        if isinstance(g, DelayRod):
            return g.mass if g.reflection == 1.0 else math.inf
        if isinstance(g, DampedFreeRod):
            return g.mass
        if isinstance(g, ModalGreens | PoleGreens):
            shapes = g.rigid if isinstance(g, PoleGreens) else g.shapes[g.omega == 0]
            rigid = float(np.sum(shapes[:, 0] ** 2))
            return 1.0 / rigid if rigid > 0 else math.inf
        return math.inf

    def modal_start(self) -> ModalState:
        """Initial modal state of a modal body, its translation included."""
        assert isinstance(self.greens, ModalGreens)
        g = self.greens
        zero = np.zeros(len(g.omega))
        start = self.state or ModalState(zero, zero)
        if self.velocity == 0.0:
            return start
        rigid = np.where(g.omega == 0, g.shapes[:, 0], 0.0)
        return ModalState(start.displacement, start.velocity + self.velocity * self.mass * rigid)


def rigid_mass(*, mass: float, velocity: float) -> Body:
    """Rigid striker: g = t/m; ``velocity`` < 0 approaches the target [kg, m/s]."""
    if not (mass > 0 and math.isfinite(mass)):
        raise GreensFunctionError(f"mass = {mass:g} kg must be positive and finite")
    shape = np.array([[1.0 / math.sqrt(mass)]])
    origin = {"kind": "rigid_mass", "mass": mass}
    zero = np.zeros(1)
    return Body(
        ModalGreens(zero, zero, shape, Residual.none(), error=ErrorEstimate(0.0, 0.0), origin=origin), velocity=velocity
    )


def _modal_values(name: str, values: Array, modes: int) -> None:
    if modes == 0 or values.shape != (modes,) or not np.all(np.isfinite(values)):
        raise GreensFunctionError(f"{name} must be {modes} finite modal values, got shape {values.shape}")
