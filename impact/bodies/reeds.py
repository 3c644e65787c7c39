"""Bodies from beams: contact points, release and loads of a reed."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from impact.beams.euler_bernoulli import BeamModes, Cantilever
from impact.bodies.body import Body, ModalState
from impact.bodies.loads import ReedLoad
from impact.greens.base import Array, ErrorEstimate, GreensFunctionError
from impact.greens.modal import ModalGreens, Residual

_ROUND_OFF = 1e-13  # round-off per mode of the residual compliance, over the static compliance
_OFF = 1e-6  # largest relative excess of a sum of modes over the static compliance; 5e-7 for 1000 by finite elements


class Beam(Protocol):
    """Interface of a beam for `reed`; all positions are distances from its (left) clamp [m]."""

    @property
    def length(self) -> float:
        """Return the length L [m]."""

    @property
    def free_point(self) -> float:
        """Return the default position of contact and measurement: the tip, or the middle [m]."""

    @property
    def description(self) -> Mapping[str, object]:
        """Return the kind and parameters, plain JSON values, for the provenance."""

    def modes(self, n_modes: int) -> BeamModes:
        """Return the lowest modes."""

    def compliance(self, x: float, load: float) -> float:
        """Return the static deflection at ``x`` per unit force at ``load`` [m/N]."""

    def residual(self, compliance: Array, at: tuple[float, ...], damping_ratio: float, highest: float) -> Residual:
        """Return the residual of modes truncated above ``highest`` [rad/s] at the points ``at``, from its static (p, p)
        ``compliance``."""


class Release(Protocol):
    """The start of a reed."""

    def state(self, beam: Beam, modes: BeamModes) -> ModalState:
        """Return the initial modal state."""


@dataclass(frozen=True)
class StaticShape:
    """Release from rest in the static shape under a force at ``at`` that deflects this point by ``deflection`` [m].

    q_k = F w_k(at)/omega_k^2.  ``at=None`` is the tip (the middle of a clamped-clamped reed); > 0 is away from the
    seat. The part of the deflection by truncated modes is neglected, as for loads in `impact.bodies.loads.ReedLoad`.
    """

    deflection: float
    at: float | None = None

    def state(self, beam: Beam, modes: BeamModes) -> ModalState:
        """Return the initial modal state."""
        x = beam.free_point if self.at is None else self.at
        _check_on_reed("release at", x, beam)
        force = _finite("deflection", self.deflection) / beam.compliance(x, x)
        return ModalState(force * modes.deflection(x) / modes.omega**2, np.zeros(len(modes.omega)))


@dataclass(frozen=True)
class ModeShape:
    """Release in mode ``number`` = 1, 2 ..., with the ``deflection`` [m] and ``velocity`` [m/s] of the point ``at``.

    ``at=None`` is the tip (the middle of a clamped-clamped reed); > 0 is away from the seat.
    """

    number: int
    deflection: float = 0.0
    at: float | None = None
    velocity: float = 0.0

    def state(self, beam: Beam, modes: BeamModes) -> ModalState:
        """Return the initial modal state; `GreensFunctionError` if the reed has no such mode, or it has a node at
        ``at``."""
        n = len(modes.omega)
        if not 1 <= self.number <= n:
            raise GreensFunctionError(f"release in mode {self.number}: the reed has modes 1..{n}; raise n_modes")
        x = beam.free_point if self.at is None else self.at
        _check_on_reed("release at", x, beam)
        amplitude = float(modes.deflection(x)[self.number - 1])
        if abs(amplitude) * math.sqrt(modes.line_density * modes.length) < 1e-9:
            raise GreensFunctionError(f"mode {self.number} has a node at {x:g} m: give another point with at=")
        q, v = np.zeros(n), np.zeros(n)
        q[self.number - 1] = _finite("deflection", self.deflection) / amplitude
        v[self.number - 1] = _finite("velocity", self.velocity) / amplitude
        return ModalState(q, v)


@dataclass(frozen=True)
class GivenShape:
    """Release in any shape w(x) and velocity v(x), x (G,) m -> (G,) m and m/s, by default zero.

    Projected on the modes (`BeamModes.project`): the part outside their span is lost, so w should meet the clamp.
    """

    shape: Callable[[Array], ArrayLike] = np.zeros_like
    velocity: Callable[[Array], ArrayLike] = np.zeros_like

    def state(self, beam: Beam, modes: BeamModes) -> ModalState:
        """Return the initial modal state; `GreensFunctionError` if a value is not finite."""
        return ModalState(modes.project(self.shape), modes.project(self.velocity))


def reed(
    beam: Beam,
    *,
    damping_ratio: float = 0.0,
    n_modes: int = 40,
    contact_at: float | tuple[float, ...] | None = None,
    release: Release | None = None,
    loads: Sequence[ReedLoad] = (),
) -> Body:
    """Return a beam as one partner of an impact.

    Its Green's function has the lowest modes, with one damping ratio, and the residual static compliance at the contact
    points.

    Args:
        beam: `Cantilever`, `TipMassCantilever`, `ClampedClamped`, `TimoshenkoCantilever`, or another `Beam`.
        damping_ratio: damping ratio of every mode.
        n_modes: number of modes.
        contact_at: distance of the contact point from the clamp [m], or several; ``None`` is the tip (the middle of a
            clamped-clamped reed). The ports are "contact", or "contact_1", "contact_2", ... in the order given.
        release: `StaticShape`, `ModeShape`, `GivenShape`; ``None`` is straight and at rest.
        loads: loads of `impact.bodies.loads`.

    Raises:
        GreensFunctionError: a contact point off the reed, at a clamp or given twice; no modes; negative damping.
    """
    if n_modes < 1:
        raise GreensFunctionError(f"n_modes = {n_modes} must be at least 1")
    if not (damping_ratio >= 0 and math.isfinite(damping_ratio)):
        raise GreensFunctionError(f"damping_ratio = {damping_ratio:g} must be >= 0")
    at = _contacts(contact_at, beam)
    modes = beam.modes(n_modes)
    shapes = modes.deflection(np.array(at))
    greens = ModalGreens(
        modes.omega,
        np.full(n_modes, damping_ratio),
        shapes,
        beam.residual(_residual(beam, at, shapes / modes.omega[:, None]), at, damping_ratio, float(modes.omega[-1])),
        port_names=("contact",) if len(at) == 1 else tuple(f"contact_{i + 1}" for i in range(len(at))),
        error=ErrorEstimate(mesh=0.0),
        origin={**beam.description, "damping_ratio": damping_ratio, "contact_at": at[0] if len(at) == 1 else list(at)},
    )
    state = None if release is None else release.state(beam, modes)
    return Body(greens, state=state, loads=tuple(part for load in loads for part in load.modal(modes)))


def _contacts(contact_at: float | tuple[float, ...] | None, beam: Beam) -> tuple[float, ...]:
    if contact_at is None:
        return (beam.free_point,)
    at = tuple(contact_at) if isinstance(contact_at, tuple | list) else (contact_at,)
    if not at:
        raise GreensFunctionError("contact_at is empty: give one or several contact points")
    for x in at:
        _check_on_reed("contact_at =", x, beam)
    if len(set(at)) < len(at):
        raise GreensFunctionError(f"contact_at = {', '.join(f'{x:g}' for x in at)} m names a point twice; name it once")
    return at


def _check_on_reed(what: str, x: float, beam: Beam) -> None:
    if not 0 < x <= beam.length * (1 + 1e-12):
        raise GreensFunctionError(f"{what} {x:g} m is off the reed, 0..{beam.length:g} m")
    if beam.compliance(x, x) <= 0:
        raise GreensFunctionError(f"{what} {x:g} m is at a clamp, where nothing moves; choose another point")


def _residual(beam: Beam, at: tuple[float, ...], scaled: Array) -> Array:
    """Return the (p, p) residual static compliance of truncated modes, negative eigenvalues by round-off removed
    [m/N]."""
    total = np.array([[beam.compliance(x, y) for y in at] for x in at])
    kept = np.array([[math.fsum(scaled[:, i] * scaled[:, j]) for j in range(len(at))] for i in range(len(at))])
    values, vectors = np.linalg.eigh(total - kept)
    limit = _ROUND_OFF * float(np.trace(total)) * len(scaled)
    if values[0] < -max(limit, _OFF * float(np.trace(total))):
        raise GreensFunctionError(
            f"the modes yield {-values[0]:g} m/N more than the beam's static compliance {np.trace(total):g} m/N: "
            "its modes and compliance must be those of one beam"
        )
    if values[0] >= 0:
        return np.asarray(total - kept)
    return np.asarray(vectors * np.maximum(values, 0.0) @ vectors.T)


def _finite(name: str, value: float) -> float:
    if not math.isfinite(value):
        raise GreensFunctionError(f"{name} = {value} m must be finite")
    return value


def cantilever_reed(
    *,
    young: float,
    density: float,
    length: float,
    width: float,
    thickness: float,
    damping_ratio: float = 0.0,
    n_modes: int = 40,
    tip_deflection: float = 0.0,
    contact_at: float | tuple[float, ...] | None = None,
    release: Release | None = None,
    loads: Sequence[ReedLoad] = (),
) -> Body:
    """Return a cantilever reed released at t = 0, by default from the static shape under a tip force.

    It is ``reed(Cantilever(...), release=StaticShape(tip_deflection), ...)``; for the residual compliance see
    `EulerBernoulliBeam.residual`.

    Args:
        young, density, length, width, thickness: SI.
        tip_deflection: at release [m]; > 0 is away from the seat.
        release: another release than the static shape; then ``tip_deflection`` stays 0.
        damping_ratio, n_modes, contact_at, loads: as in `reed`.

    Raises:
        GreensFunctionError: a length that is not positive, a contact point off the reed, no modes, two releases.
    """
    beam = Cantilever(young, density, length, width, thickness)
    if release is not None and tip_deflection != 0.0:
        raise GreensFunctionError(f"give tip_deflection = {tip_deflection:g} m or release, not both")
    return reed(
        beam,
        damping_ratio=damping_ratio,
        n_modes=n_modes,
        contact_at=contact_at,
        release=StaticShape(tip_deflection) if release is None else release,
        loads=loads,
    )
