"""Sums of Green's functions on the same ports, and multiples of one."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from impact.greens import Array, ErrorEstimate, GreensFunction, GreensFunctionError, StepKernel
from impact.modal import ModalGreens, Residual


@dataclass(frozen=True)
class SumGreens(GreensFunction):
    """g_ij = sum of the parts' g_ij: the displacements add, as of springs in series. Passive if every part is.

    Attributes:
        parts: at least one, all with the same ports.
    """

    parts: tuple[GreensFunction, ...]

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


@dataclass(frozen=True)
class ScaledGreens(GreensFunction):
    """factor times g_ij: what an error of that relative size does to an impact is a run with it away.

    Attributes:
        part: the function.
        factor: > 0, so that a passive body stays passive.
    """

    part: GreensFunction
    factor: float

    def __post_init__(self) -> None:
        if not (np.isfinite(self.factor) and self.factor > 0):
            raise GreensFunctionError(f"factor = {self.factor} must be positive and finite: the body must stay passive")

    @property
    def ports(self) -> tuple[str, ...]:
        """Names of the ports."""
        return self.part.ports

    @property
    def error_estimate(self) -> ErrorEstimate:
        """The part's: errors are relative."""
        return self.part.error_estimate

    @property
    def provenance(self) -> dict[str, object]:
        """The factor and the part's provenance."""
        return {"kind": "scaled", "factor": self.factor, "part": dict(self.part.provenance)}

    def impulse_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        """g_ij(t) [m/(N s)], without the Dirac pulse of a bare compliance."""
        return self.factor * self.part.impulse_response(t, i, j)

    def step_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        """S_ij(t) [m/N]."""
        return self.factor * self.part.step_response(t, i, j)

    def static_compliance(self) -> Array:
        """(p, p) [m/N]."""
        return self.factor * self.part.static_compliance()

    def initial_value(self) -> Array:
        """(p, p) g(0+) [m/(N s)]."""
        return self.factor * self.part.initial_value()

    def step_kernel(self, dt: float, n_steps: int) -> StepKernel:
        """The part's, with every residue and every weight times the factor."""
        kernel = self.part.step_kernel(dt, n_steps)
        modal = None if kernel.modal is None else _times(kernel.modal, self.factor)
        weights = None if kernel.weights is None else self.factor * kernel.weights
        return StepKernel(modal, weights, kernel.engine)


def _times(modal: ModalGreens, factor: float) -> ModalGreens:
    root, rest = np.sqrt(factor), modal.residual
    residual = Residual(root * rest.shapes, rest.rates, factor * rest.compliance)
    return replace(modal, shapes=root * modal.shapes, residual=residual)


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
    )


def _largest(errors: list[float | None]) -> float | None:
    known = [error for error in errors if error is not None]
    return max(known) if len(known) == len(errors) else None
