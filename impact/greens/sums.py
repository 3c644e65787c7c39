"""Sums of Green's functions on the same ports."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from impact.brief import cut
from impact.greens.base import Array, ErrorEstimate, GreensFunction, GreensFunctionError, ScaledGreens, StepKernel
from impact.greens.modal import ModalGreens, Residual
from impact.greens.sampled import SampledGreens

__all__ = ["ScaledGreens", "SumGreens", "merged"]


@dataclass(frozen=True)
class SumGreens(GreensFunction):
    """g_ij = sum of the parts' g_ij: the displacements add, as of springs in series. Passive if every part is.

    Attributes:
        parts: at least one, all with the same ports.
    """

    parts: tuple[GreensFunction, ...]

    __repr__ = GreensFunction.__str__

    def __post_init__(self) -> None:
        if not self.parts:
            raise GreensFunctionError("a sum needs at least one part")
        for part in self.parts:
            if part.ports != self.parts[0].ports:
                raise GreensFunctionError(
                    f"the parts of a sum need the same ports; found {self.parts[0].ports} and {part.ports}"
                )

    @property
    def ports(self) -> tuple[str, ...]:
        """Names of the ports."""
        return self.parts[0].ports

    @property
    def error_estimate(self) -> ErrorEstimate:
        """The largest of the parts', each relative to its own largest value; unknown if one of them is."""
        return ErrorEstimate(
            _largest([part.error_estimate.reduction for part in self.parts]),
            _largest([part.error_estimate.mesh for part in self.parts]),
        )

    @property
    def provenance(self) -> dict[str, object]:
        """The parts' provenances."""
        return {"kind": "sum", "parts": [dict(part.provenance) for part in self.parts]}

    @property
    def valid_for(self) -> float:
        """The shortest of the parts' [s]."""
        return min(part.valid_for for part in self.parts)

    @property
    def highest_rate(self) -> float:
        """The highest of the parts' [rad/s]."""
        return max(part.highest_rate for part in self.parts)

    @property
    def modal(self) -> ModalGreens | None:
        """All oscillators side by side, if every part is a sum of oscillators."""
        parts = [part.modal for part in self.parts]
        found = tuple(part for part in parts if part is not None)
        return merged(found) if len(found) == len(parts) else None

    @property
    def sampled_parts(self) -> tuple[SampledGreens, ...]:
        """The parts'."""
        return tuple(sampled for part in self.parts for sampled in part.sampled_parts)

    def inverse_mass(self) -> Array:
        """(p, p) sum of the parts' [1/kg]: the velocities add."""
        return np.asarray(sum(part.inverse_mass() for part in self.parts))

    def marched_poles(self, dt: float, n_steps: float) -> int | None:
        """Of all parts; ``None`` if one has step weights."""
        counts = [part.marched_poles(dt, n_steps) for part in self.parts]
        known = [count for count in counts if count is not None]
        return sum(known) if len(known) == len(counts) else None

    def scaled(self, factor: float) -> SumGreens:
        """The sum of the parts, scaled."""
        return SumGreens(tuple(part.scaled(factor) for part in self.parts))

    def forces_only(self) -> SumGreens:
        """The sum of the parts so."""
        return SumGreens(tuple(part.forces_only() for part in self.parts))

    def with_error(self, error: ErrorEstimate, origin: Mapping[str, object] | None = None) -> SumGreens:
        """The parts with this error, relative to each; their origins are their own.

        Raises:
            GreensFunctionError: an ``origin``; a part in closed form.
        """
        if origin is not None:
            raise GreensFunctionError("a sum has the origins of its parts: state them there")
        return SumGreens(tuple(part.with_error(error) for part in self.parts))

    def _in_words(self) -> tuple[str, ...]:
        shown = [f"+ {cut(line, 160)}" for part in self.parts[:3] for line in str(part).splitlines()[:2]]
        return (*shown, *([f"+ {len(self.parts) - 3} parts more"] if len(self.parts) > 3 else []))

    def combined(self, weights: Array, port_names: tuple[str, ...]) -> SumGreens:
        """Every part, combined."""
        return SumGreens(tuple(part.combined(weights, port_names) for part in self.parts))

    def impulse_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        """g_ij(t) [m/(N s)], without the Dirac pulse of a bare compliance."""
        return np.asarray(sum(part.impulse_response(t, i, j) for part in self.parts))

    def step_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        """S_ij(t) [m/N]."""
        return np.asarray(sum(part.step_response(t, i, j) for part in self.parts))

    def static_compliance(self) -> Array:
        """(p, p) [m/N]; ``inf`` where a part can move as a rigid body."""
        return np.asarray(sum(part.static_compliance() for part in self.parts))

    def initial_value(self) -> Array:
        """(p, p) g(0+) [m/(N s)]; ``inf`` where a bare compliance stands."""
        return np.asarray(sum(part.initial_value() for part in self.parts))

    def step_kernel(self, dt: float, n_steps: int) -> StepKernel:
        """All poles in one recursion, all weights in one convolution."""
        kernels = [part.step_kernel(dt, n_steps) for part in self.parts]
        modal = [kernel.modal for kernel in kernels if kernel.modal is not None]
        weights = [kernel.weights for kernel in kernels if kernel.weights is not None]
        return StepKernel(
            merged(tuple(modal)) if modal else None,
            np.asarray(sum(weights)) if weights else None,
            " + ".join(kernel.engine for kernel in kernels),
        )


def merged(parts: tuple[ModalGreens, ...]) -> ModalGreens:
    """The sum of modal functions as one: their poles side by side, their bare compliances added."""
    whole = SumGreens(parts)
    residuals = [part.residual for part in parts]
    return ModalGreens(
        np.concatenate([part.omega for part in parts]),
        np.concatenate([part.zeta for part in parts]),
        np.concatenate([part.shapes for part in parts]),
        Residual(
            np.concatenate([residual.shapes for residual in residuals]),
            np.concatenate([residual.rates for residual in residuals]),
            np.asarray(sum(residual.compliance for residual in residuals)),
        ),
        whole.ports,
        whole.error_estimate,
        whole.provenance,
        whole.valid_for,
    )


def _largest(errors: list[float | None]) -> float | None:
    known = [error for error in errors if error is not None]
    return max(known) if len(known) == len(errors) else None
