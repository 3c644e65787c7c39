"""Bodies of an impact: a Green's function, the motion without contact by initial state and loads, and an incoming
wave."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Final, Protocol

import numpy as np
from numpy.typing import ArrayLike

from impact.bodies.time_series import TimeSeries, TimeSeriesError
from impact.greens.base import Array, ErrorEstimate, GreensFunction, GreensFunctionError, is_greens
from impact.greens.modal import ModalGreens, Residual
from impact.quantities import as_html, brief, check_numbers


@dataclass(frozen=True)
class ModalState:
    """Initial modal coordinates q [m sqrt(kg)] and their rates [m sqrt(kg)/s], both (M,)."""

    displacement: Array
    velocity: Array

    __repr__ = brief


class Feedback(Protocol):
    """A load with a state that is driven by the opening of the contacts, such as gas that flows through a valve.

    The object itself is constant; its state is an array kept by the march.
    """

    def start(self) -> Array:
        """Return its (S,) state at t = 0."""

    def advance(self, state: Array, time: float, span: float, opening: float) -> float:
        """Advance ``state`` in place from ``time`` over ``span`` [s] at a constant mean ``opening`` [m] of the contacts
        with seats; return the mean amplitude of the load over the span [N]."""


@dataclass(frozen=True)
class Load:
    """A prescribed force with a fixed spatial distribution and a given time history: modal forces shape_k amplitude(t).

    Attributes:
        shape: (M,) participation of each mode; the mode shapes at x for a point force [1/sqrt(kg)].
        amplitude: force at given times, (n,) s -> (n,) N; evaluated at the middle of each step.
        by_opening: factor on the amplitude as a function of the mean opening [m] of the contacts with seats (a jet
            deflected by a lifting reed); 1 for ``None``. It is applied in the march, extrapolated over some steps at a
            time; the motion prepared without contact takes 1.
        feedback: source of the amplitude in place of ``amplitude``, evaluated step by step in the march; the motion
            prepared without contact takes ``amplitude``, its value at t = 0.
    """

    shape: Array
    amplitude: Callable[[Array], Array]
    by_opening: Callable[[float], float] | None = None
    feedback: Feedback | None = None

    @property
    def follows(self) -> bool:
        """Return whether the load depends on the opening of the contacts."""
        return self.by_opening is not None or self.feedback is not None

    __repr__ = brief


@dataclass(frozen=True)
class Body:
    """One of the bodies in an impact, at rest and without loads unless stated.

    Attributes:
        greens: its Green's function.
        velocity: initial rigid-body velocity of the first port along the normal [m/s]; nonzero only for a free body.
        state: initial modal state of a modal body (a deflected reed).
        loads: prescribed forces on a modal body (pressure, gravity).
        base: displacement of the base, to which that of the body is relative, (n,) s -> (n,) m, zero at t = 0;
            ``None``: at rest. Its inertia load on the body is one of ``loads`` (`impact.BaseMotion`).

    Raises:
        GreensFunctionError: a velocity of a body that is held; a state or loads that do not fit its modes.
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

    def find_base_displacement(self, time: Array) -> Array:
        """Return the (n,) displacement of the base [m]; raises `GreensFunctionError` unless it is one finite number per
        time."""
        if self.base is None:
            return np.zeros(len(time))
        displacement = np.asarray(self.base(time), dtype=float)
        if displacement.shape != time.shape or not np.all(np.isfinite(displacement)):
            raise GreensFunctionError(
                f"base gave {displacement.shape} values for {time.shape} times: give a finite one for each"
            )
        return displacement

    def load_amplitudes(self, time: Array) -> Array:
        """Return the (L, n) amplitudes of the body's loads [N] at times (n,) [s]."""
        amplitudes = np.zeros((len(self.loads), len(time)))
        for row, load in zip(amplitudes, self.loads, strict=True):
            row[:] = load.amplitude(time)
        return amplitudes

    @property
    def mass(self) -> float:
        """Return the mass of the rigid translation along the normal at the first port [kg]; ``inf`` if held."""
        return self.greens.mass()

    @property
    def is_deflected(self) -> bool:
        """Return whether the body starts with a modal displacement or velocity besides its translation."""
        return self.state is not None and bool(np.any(self.state.displacement) or np.any(self.state.velocity))

    def velocity_of(self, port: str | int) -> float:
        """Return a port's velocity [m/s] in the initial rigid-body motion, caused by an impulse at the first port."""
        if self.velocity == 0.0:
            return 0.0
        i = self.greens.port_index(port)
        return self.velocity if i == 0 else float(self.momentum * self.greens.inverse_mass()[i, 0])

    @property
    def momentum(self) -> float:
        """Return the impulse on the first port that sets the body moving at ``velocity`` [N s]."""
        return self.velocity * self.mass if self.velocity else 0.0

    def transform_modes(self, greens: ModalGreens, turn: Callable[[Array], Array]) -> Body:
        """Return the body in the modes of ``greens``; ``turn`` transforms modal state and load shapes to them."""
        state = self.state and ModalState(turn(self.state.displacement), turn(self.state.velocity))
        loads = tuple(replace(load, shape=turn(load.shape)) for load in self.loads)
        return replace(self, greens=greens, state=state, loads=loads)

    def modal_start(self, modal: ModalGreens | None = None) -> ModalState:
        """Return the initial modal state, the translation included, in the modes ``modal``, by default all modes."""
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
    """A body at rest made from a bare Green's function; the same function always means the same body."""


def rigid_mass(*, mass: float, velocity: float) -> Body:
    """Return a rigid striker of ``mass`` m [kg]: g = t/m; ``velocity`` < 0 approaches the target [m/s].

    Raises:
        GreensFunctionError: a mass that is not positive, or a number that is not finite.
    """
    check_numbers(GreensFunctionError, mass=mass, velocity=velocity)
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


EARLY: Final = 0.01
"""Largest displacement of the end before t = 0, over twice the wave's largest, accepted as noise of a record."""


@dataclass(frozen=True)
class IncomingWave:
    """A strain wave e(t) that arrives at the free end of a semi-infinite rod initially at rest and is reflected there.

    Without contact the end moves outwards at -2 c e(t), twice the particle velocity, and at a distance x from it the
    strain is e(t + x/c) - e(t - x/c), > 0 in tension. The response to contact forces is superposed (d'Alembert).

    Attributes:
        strain: e at times (n,), as recorded by a gauge, > 0 in tension, zero outside the record.
        speed: wave speed c [m/s].
        recorded_at: distance of the gauge from the end [m].

    Raises:
        TimeSeriesError: speed not positive, distance negative, or a wave that moves the end before t = 0.
    """

    strain: TimeSeries
    speed: float
    recorded_at: float = 0.0
    _ramp: Array = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        if not (self.speed > 0 and math.isfinite(self.speed) and 0 <= self.recorded_at < math.inf):
            raise TimeSeriesError(
                f"{self.strain.name}: speed = {self.speed:g} m/s must be positive, the gauge's distance from the end, "
                f"{self.recorded_at:g} m, not negative"
            )
        time, value = self.strain.time, self.strain.value
        ramp = np.concatenate([[0.0], np.cumsum((value[1:] + value[:-1]) / 2 * np.diff(time))])
        object.__setattr__(self, "_ramp", ramp)
        if abs(early := self._moved(0.0)) > EARLY * np.abs(ramp).max() * 2 * self.speed:
            raise TimeSeriesError(
                f"{self.strain.name}: by t = 0 the wave has moved the rod's end by {early:.3g} m already: give "
                "times that count from an earlier instant on"
            )

    def arriving(self, time: Array) -> Array:
        """Return e at the rod's end at times (n,) [s]; at a jump at the ends of the record, half of it."""
        return np.asarray(self.strain(np.asarray(time, dtype=float) - self.recorded_at / self.speed))

    def outwards(self, time: Array) -> Array:
        """Return the (n,) displacement of the free end out of the rod since t = 0 [m], exact for strains linear between
        samples."""
        return self._moved(time) - self._moved(0.0)

    def _moved(self, time: ArrayLike) -> Array:
        at = np.asarray(time, dtype=float) - self.recorded_at / self.speed
        known, value = self.strain.time, self.strain.value
        inside = np.clip(at, known[0], known[-1])
        k = np.clip(np.searchsorted(known, inside, side="right") - 1, 0, len(known) - 2)
        since, slope = inside - known[k], (value[k + 1] - value[k]) / (known[k + 1] - known[k])
        return np.asarray(-2 * self.speed * (self._ramp[k] + since * (value[k] + slope * since / 2)))

    def strain_at(self, time: Array, distance: float) -> Array:
        """Return the (n,) strain without contact at a ``distance`` [m] from the end, > 0 in tension."""
        late = distance / self.speed
        return np.asarray(self.arriving(time + late) - self.arriving(time - late))
