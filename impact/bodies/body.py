"""A body: its Green's function, initial conditions and loads, which give its motion without contact."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from impact.greens.base import Array, ErrorEstimate, GreensFunction, GreensFunctionError, is_greens
from impact.greens.modal import ModalGreens, Residual
from impact.quantities import as_html, brief


@dataclass(frozen=True)
class ModalState:
    """Initial modal coordinates q [m sqrt(kg)] and their rates [m sqrt(kg)/s], both (M,)."""

    displacement: Array
    velocity: Array

    __repr__ = brief


class Feedback(Protocol):
    """A load with its own state equations, driven by the opening of the contacts, such as gas flow through a valve.

    The object is constant; its state is an array that the time integration keeps.
    """

    def start(self) -> Array:
        """Return the (S,) state at t = 0."""

    def advance(self, state: Array, time: float, span: float, opening: float) -> float:
        """Advance ``state`` in place from ``time`` by ``span`` [s] at a constant mean ``opening`` [m] of the contacts
        with seats; return the mean amplitude of the load over the span [N]."""


@dataclass(frozen=True)
class Load:
    """A force with fixed spatial distribution and prescribed history: modal forces shape_k * amplitude(t).

    Attributes:
        shape: (M,) participation of each mode; the mode shapes at x for a point force [1/sqrt(kg)].
        amplitude: force at times, (n,) s -> (n,) N; evaluated at the middle of each step.
        by_opening: factor on the amplitude as a function of the mean opening of the contacts with seats [m], as for a
            jet that a lifting reed deflects; ``None``: 1. It is evaluated during the run, for some steps at a time;
            before the run it is 1.
        feedback: state equations that give the amplitude during the run; before the run it is ``amplitude``, the value
            at t = 0.
    """

    shape: Array
    amplitude: Callable[[Array], Array]
    by_opening: Callable[[float], float] | None = None
    feedback: Feedback | None = None

    @property
    def follows(self) -> bool:
        """Return whether it depends on the opening of the contacts."""
        return self.by_opening is not None or self.feedback is not None

    __repr__ = brief


@dataclass(frozen=True)
class Body:
    """One of the bodies in an impact, at rest and without loads unless stated.

    Attributes:
        greens: its Green's function.
        velocity: initial velocity of the first port in rigid-body motion along the normal [m/s]; only for a body free
            to move.
        state: initial modal state of a modal body (a deflected reed).
        loads: prescribed forces on a modal body (pressure, gravity).
        base: displacement of its base, (n,) s -> (n,) m, zero at t = 0; ``None``: at rest. Displacements of the body
            are relative to it, and its inertia load is one of ``loads`` (`impact.BaseMotion`).

    Raises:
        GreensFunctionError: a velocity of a supported body; a state or loads that do not fit its modes.
    """

    greens: GreensFunction
    velocity: float = 0.0
    state: ModalState | None = None
    loads: tuple[Load, ...] = ()
    base: Callable[[Array], Array] | None = None

    def __post_init__(self) -> None:
        if not math.isfinite(self.velocity):
            raise GreensFunctionError(f"velocity = {self.velocity} must be finite")
        if self.velocity != 0.0 and math.isinf(self.mass):
            raise GreensFunctionError(
                f"a body that is held cannot translate: velocity = {self.velocity:g} m/s must be 0"
            )
        modal = self.greens.modal if self.state is not None or self.loads else None
        modes = 0 if modal is None else len(modal.omega)
        if self.state is not None:
            for name, values in (("displacement", self.state.displacement), ("velocity", self.state.velocity)):
                _modal_values(f"state.{name}", values, modes)
        for number, load in enumerate(self.loads):
            _modal_values(f"loads[{number}].shape", load.shape, modes)

    def __str__(self) -> str:
        moving = [f"moving at {self.velocity:g} m/s"] if self.velocity else []
        moving += ["in an initial state"] if self.state is not None else []
        moving += [f"under {len(self.loads)} loads"] if self.loads else []
        moving += ["on a moving base"] if self.base is not None else []
        mass = "held" if math.isinf(self.mass) else f"mass {self.mass:.6g} kg"
        return f"Body, {mass}, {', '.join(moving) or 'at rest'}\n  {self.greens}"

    __repr__ = __str__
    _repr_html_ = as_html

    def carried(self, time: Array) -> Array:
        """Return the (n,) displacement of its base [m]. Raises `GreensFunctionError` unless it is finite, of shape
        (n,)."""
        if self.base is None:
            return np.zeros(len(time))
        displacement = np.asarray(self.base(time), dtype=float)
        if displacement.shape != time.shape or not np.all(np.isfinite(displacement)):
            raise GreensFunctionError(
                f"base gave {displacement.shape} values for {time.shape} times: give a finite one for each"
            )
        return displacement

    def load_amplitudes(self, time: Array) -> Array:
        """Return the (L, n) amplitudes of its loads [N] at times (n,) [s]."""
        amplitudes = np.zeros((len(self.loads), len(time)))
        for row, load in zip(amplitudes, self.loads, strict=True):
            row[:] = load.amplitude(time)
        return amplitudes

    @property
    def mass(self) -> float:
        """Return the mass of the rigid translation along the normal at the first port [kg]; ``inf`` if supported."""
        return self.greens.mass()

    @property
    def is_deflected(self) -> bool:
        """Return whether it has an initial modal displacement or velocity in addition to the translation."""
        return self.state is not None and bool(np.any(self.state.displacement) or np.any(self.state.velocity))

    def velocity_of(self, port: str | int) -> float:
        """Return the initial velocity of a port in rigid-body motion by an impulse on the first port [m/s]."""
        if self.velocity == 0.0:
            return 0.0
        i = self.greens.port_index(port)
        return self.velocity if i == 0 else float(self.momentum * self.greens.inverse_mass()[i, 0])

    @property
    def momentum(self) -> float:
        """Return the impulse on the first port that causes the initial ``velocity`` [N s]."""
        return self.velocity * self.mass if self.velocity else 0.0

    def in_modes(self, greens: ModalGreens, turn: Callable[[Array], Array]) -> Body:
        """Return the body in other modal coordinates; ``turn`` transforms its state and the shapes of its loads."""
        state = self.state and ModalState(turn(self.state.displacement), turn(self.state.velocity))
        loads = tuple(replace(load, shape=turn(load.shape)) for load in self.loads)
        return replace(self, greens=greens, state=state, loads=loads)

    def modal_start(self, modal: ModalGreens | None = None) -> ModalState:
        """Return the initial modal state, the translation included; ``modal``: modal part of the Green's function, by
        default all of it."""
        g = self.greens.modal if modal is None else modal
        if g is None:
            raise GreensFunctionError(
                f"a {type(self.greens).__name__} has no modes to start in: give one that is a sum of modes"
            )
        zero = np.zeros(len(g.omega))
        start = self.state or ModalState(zero, zero)
        if self.velocity == 0.0:
            return start
        rigid = np.where(g.omega == 0, g.shapes[:, 0], 0.0)
        return ModalState(start.displacement, start.velocity + self.momentum * rigid)


def as_body(partner: Body | GreensFunction) -> Body:
    """Return a body; a Green's function becomes a body at rest. Raises `GreensFunctionError` for anything else."""
    if isinstance(partner, Body):
        return partner
    if is_greens(partner):
        return AtRest(partner)
    raise GreensFunctionError(
        f"a {type(partner).__name__} is no body: give an impact.Body, or a Green's function for a body at rest"
    )


class AtRest(Body):
    """A body at rest, made from a Green's function; equal functions are the same body."""


def rigid_mass(*, mass: float, velocity: float) -> Body:
    """Return a rigid striker of ``mass`` m [kg]: g = t/m; ``velocity`` < 0 approaches the target [m/s].

    Raises:
        GreensFunctionError: a mass that is not positive, or a number that is not finite.
    """
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
