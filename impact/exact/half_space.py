"""Elastic half-space under a uniformly loaded disk: static compliances and the exact Green's function."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from impact.exact.disk_response import DiskResponse
from impact.greens import answers, base, sums
from impact.greens.modal import ModalGreens, Residual


def disk_compliance(*, young: float, poisson: float, radius: float, at: str = "mean") -> float:
    """Return the static displacement per unit force, spread evenly over a disk [m/N], ``at`` its "mean", "centre" or
    "edge".

    (1 - nu^2)/(E a) times 16/(3 pi^2), 2/pi, 4/pi^2. Source: Johnson, Contact Mechanics, 3.4.
    """
    return _unit_compliance(young, poisson, radius) * _place(
        at, {"mean": 16 / (3 * math.pi**2), "centre": 2 / math.pi, "edge": 4 / math.pi**2}
    )


def square_compliance(*, young: float, poisson: float, side: float, at: str = "mean") -> float:
    """Return the static displacement per unit force, spread evenly over a square [m/N], ``at`` its "mean" or "centre".

    (1 - nu^2)/(E b) times (4 (1 - sqrt 2)/3 + 4 asinh 1)/pi, 4 asinh(1)/pi. Source: Love,
    Phil. Trans. A 228 (1929) 377.
    """
    centre = 4 * math.asinh(1) / math.pi
    mean = centre - 4 / 3 * (math.sqrt(2) - 1) / math.pi
    return _unit_compliance(young, poisson, side, "side") * _place(at, {"mean": mean, "centre": centre})


def punch_compliance(*, young: float, poisson: float, radius: float) -> float:
    """Return the static displacement per unit force of a rigid round punch, (1 - nu^2)/(2 E a) [m/N] (Johnson 3.36)."""
    return _unit_compliance(young, poisson, radius) / 2


@dataclass(frozen=True)
class HalfSpacePatch(base.ExactPort):
    """Mean displacement of a disk on an elastic half-space under a load spread evenly over it; exact.

    g(0+) = 1/(rho c_p pi a^2); g falls almost linearly and is exactly zero after 2a/c_R, when S has reached the static
    16 (1 - nu^2)/(3 pi^2 E a). A large body's g is this until its first reflection returns.

    Attributes:
        young: E [Pa].
        poisson: nu in [0, 0.5].
        density: rho [kg/m^3].
        radius: a [m].
        response: the same function without dimensions, it depends on nu only.
    """

    young: float
    poisson: float
    density: float
    radius: float
    response: DiskResponse = field(repr=False, compare=False)

    kind: ClassVar[str] = "half_space_patch"

    @property
    def error_estimate(self) -> answers.ErrorEstimate:
        """Return what the Chebyshev series leave, about 1e-13; no mesh."""
        return answers.ErrorEstimate(self.response.error, 0.0)

    @property
    def highest_rate(self) -> float:
        return 10 / self.crossing_time

    def scaled(self, factor: float) -> HalfSpacePatch:
        """Return the patch on 1/``factor`` the stiffness and the density: the same wave speeds."""
        return replace(self, young=self.young / answers.check_factor(factor), density=self.density / factor)

    @property
    def crossing_time(self) -> float:
        """Return 2a/c_R [s]: the memory of the kernel."""
        return float(self.response.breaks[-1]) * self._unit_time

    @property
    def _unit_time(self) -> float:
        return 2 * self.radius / math.sqrt(self.young / (2 * (1 + self.poisson) * self.density))

    @property
    def _static(self) -> float:
        return disk_compliance(young=self.young, poisson=self.poisson, radius=self.radius)

    def impulse_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> answers.Array:
        time: answers.Array = np.asarray(t, dtype=float)
        scale = self._static / self._unit_time
        values = scale * self.response(np.maximum(time, 0.0) / self._unit_time, integrated=False)
        return np.where(time < 0, 0.0, values)

    def step_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> answers.Array:
        time: answers.Array = np.maximum(np.asarray(t, dtype=float), 0.0)
        return np.asarray(self._static * self.response(time / self._unit_time, integrated=True))

    def static_compliance(self) -> answers.Array:
        """Return 16 (1 - nu^2)/(3 pi^2 E a) [m/N]."""
        return np.array([[self._static]])

    def initial_value(self) -> answers.Array:
        """Return 1/(rho c_p pi a^2) [m/(N s)]; 0 for nu = 0.5, where c_p is infinite."""
        slowness = math.sqrt((1 + self.poisson) * (1 - 2 * self.poisson) / (1 - self.poisson) / self.young)
        return np.array([[slowness / (math.sqrt(self.density) * math.pi * self.radius**2)]])

    def step_kernel(self, dt: float, n_steps: int) -> answers.StepKernel:
        alive = min(n_steps, math.ceil(self.crossing_time / dt))
        weights = np.zeros((1, 1, n_steps))
        weights[:, :, :alive] = base.step_weights(self, dt, alive)
        return answers.StepKernel(None, weights, f"half-space kernel, {alive} exact step weights")


def half_space_patch(*, young: float, poisson: float, density: float, radius: float) -> HalfSpacePatch:
    """Return a disk of ``radius`` on an elastic half-space, SI units.

    Raises:
        GreensFunctionError: a number that is not positive, or a Poisson ratio outside [0, 0.5].

    Sources: as `impact.exact.disk_response`; the average over the disk is by the autocorrelation of its area.
    """
    answers.check_positive(density=density)
    _unit_compliance(young, poisson, radius)
    return HalfSpacePatch(young, poisson, density, radius, DiskResponse.from_poisson(poisson))


def without_patch(greens: base.GreensFunction, patch: HalfSpacePatch, *, band_hz: float) -> base.GreensFunction:
    """Return ``greens`` without the local compliance of ``patch``, for a law that brings its own (Hertz): still
    passive.

    FE-BE split: compliance = (body - half-space under the patch) + contact law. As kernels the difference is not
    passive (it starts at g(0+) - g(0+) = 0 and holds reflections only), so the half-space is taken at its static value
    c = 16 (1 - nu^2)/(3 pi^2 E a), which it reaches after 2a/c_R, out of the terms of g that follow the force
    quasi-statically: bare compliance first, then relaxations a^2 exp(-rate t) (a^2/rate each) and modes (phi^2/w^2
    each) from the fastest down, the last in part. What is left is a part of the same passive sum. The static
    compliance falls by exactly c. The dynamics lost with the terms taken, relative to c and at the frequency f, are of
    order (f/f_low)^2 for modes and f/f_low for relaxations, f_low = ``origin["without_patch"]["lowest_hz"]``.

    Args:
        greens: the seat by modes, with one port; or a `SumGreens` with ``patch`` among its parts (that part is left
            out, exactly); or the patch itself (a rigid surface is left).
        patch: half-space of the body's material under the same disk.
        band_hz: band of the contact force [Hz]; modes and relaxations at or below it stay as they are.

    Raises:
        GreensFunctionError: the terms above ``band_hz`` hold less than c; several ports; another kind of function.

    Source: Johnson, Contact Mechanics, 4.2 and 11.4 for the local law; the split is that of coupled finite element
    and half-space contact models.
    """
    rest = tuple(part for part in greens.summands if part != patch)
    if not rest:
        return ModalGreens(np.zeros(0), np.zeros(0), np.zeros((0, 1)), Residual.none(), origin={"kind": "rigid"})
    if len(rest) < len(greens.summands):
        return rest[0] if len(rest) == 1 else sums.SumGreens(rest)
    modal = greens.modal
    if modal is None or len(greens.ports) != 1:
        raise answers.GreensFunctionError(
            f"cannot take a patch out of a {type(greens).__name__} with {len(greens.ports)} ports: give the modes of "
            "one port, or a SumGreens with the patch as a part"
        )
    return _quasi_static_removed(modal, float(patch.static_compliance()[0, 0]), band_hz)


def _quasi_static_removed(greens: ModalGreens, amount: float, band_hz: float) -> ModalGreens:
    residual = greens.residual
    speed = np.concatenate([[np.inf], residual.rates, greens.omega])
    with np.errstate(divide="ignore", invalid="ignore"):
        relaxed, modal = residual.shapes[:, 0] ** 2 / residual.rates, greens.shapes[:, 0] ** 2 / greens.omega**2
    held = np.where(speed > 2 * np.pi * band_hz, np.concatenate([residual.compliance[0], relaxed, modal]), 0.0)
    if amount > held.sum() * (1 + 1e-12):
        raise answers.GreensFunctionError(
            f"the patch's compliance {amount:.4g} m/N exceeds the {held.sum():.4g} m/N that the residual and the modes "
            f"above {band_hz:g} Hz hold: check the patch's radius and material, add the residual flexibility, refine "
            "the mesh under the patch, or lower band_hz"
        )
    order = np.argsort(-speed, kind="stable")
    before = np.cumsum(held[order]) - held[order]
    taken = np.empty_like(held)
    taken[order] = np.clip(amount - before, 0.0, held[order])
    kept = 1 - np.divide(taken, held, out=np.zeros_like(held), where=held > 0)
    of_relaxed, of_modes = np.split(kept[1:], [len(residual.rates)])
    touched = speed[taken > 0]
    lowest = None if np.all(np.isinf(touched)) else float(touched.min() / (2 * np.pi))
    relaxing = (residual.shapes * np.sqrt(of_relaxed)[:, None])[of_relaxed > 0]
    rest = Residual(relaxing, residual.rates[of_relaxed > 0], residual.compliance * kept[0])
    report = {"compliance": amount, "band_hz": band_hz, "lowest_hz": lowest}
    seen = replace(greens, shapes=greens.shapes * np.sqrt(of_modes)[:, None])
    return replace(seen.of_modes(of_modes > 0, rest), origin={**greens.origin, "without_patch": report})


def _unit_compliance(young: float, poisson: float, size: float, name: str = "radius") -> float:
    """Return (1 - nu^2)/(E size)."""
    answers.check_positive(**{"young": young, name: size})
    if not 0.0 <= poisson <= 0.5:
        raise answers.GreensFunctionError(f"poisson = {poisson:g} is outside [0, 0.5]")
    return (1 - poisson**2) / (young * size)


def _place(at: str, factors: dict[str, float]) -> float:
    if at not in factors:
        raise answers.GreensFunctionError(f"at = {at!r}: known places are {', '.join(factors)}")
    return factors[at]
