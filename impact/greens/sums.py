"""Sums and multiples of Green's functions."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from impact.greens import answers, base
from impact.greens.modal import ModalGreens, Residual
from impact.greens.sampled import SampledGreens
from impact.quantities import cut


class Combination(base.GreensFunction):
    """Positive factor times a sum of Green's functions on the same ports; each property combines those of the parts.

    The combination is passive if every part is.
    """

    factor: float
    parts: tuple[base.GreensFunction, ...]

    @abstractmethod
    def _with(self, parts: tuple[base.GreensFunction, ...]) -> Self:
        """Return the same factor times the sum of other parts."""

    def _sum(self, values: list[answers.Array]) -> answers.Array:
        return np.asarray(self.factor * sum(values))

    @property
    def ports(self) -> tuple[str, ...]:
        return self.parts[0].ports

    @property
    def error_estimate(self) -> answers.ErrorEstimate:
        """Return the largest error of the parts, each relative to its own largest value; unknown if one is."""
        errors = [part.error_estimate for part in self.parts]
        return answers.ErrorEstimate(_largest([e.reduction for e in errors]), _largest([e.mesh for e in errors]))

    @property
    def valid_for(self) -> float:
        return min(part.valid_for for part in self.parts)

    @property
    def highest_rate(self) -> float:
        return max(part.highest_rate for part in self.parts)

    @property
    def modal(self) -> ModalGreens | None:
        modal_parts = tuple(modal for part in self.parts if (modal := part.modal) is not None)
        return merged(modal_parts, self.factor) if len(modal_parts) == len(self.parts) else None

    @property
    def sampled_parts(self) -> tuple[SampledGreens, ...]:
        samples = [sampled for part in self.parts for sampled in part.sampled_parts]
        return tuple(samples if self.factor == 1.0 else [sampled.scaled(self.factor) for sampled in samples])

    def inverse_mass(self) -> answers.Array:
        return self._sum([part.inverse_mass() for part in self.parts])

    def marched_poles(self, dt: float, n_steps: float) -> int | None:
        counts = [part.marched_poles(dt, n_steps) for part in self.parts]
        numbers = [count for count in counts if count is not None]
        return sum(numbers) if len(numbers) == len(counts) else None

    def forces_only(self) -> Self:
        return self._with(tuple(part.forces_only() for part in self.parts))

    def combined(self, weights: answers.Array, port_names: tuple[str, ...]) -> Self:
        return self._with(tuple(part.combined(weights, port_names) for part in self.parts))

    def transfer(self, s: answers.ComplexArray) -> answers.ComplexArray:
        return np.asarray(self.factor * sum(part.transfer(s) for part in self.parts), dtype=complex)

    def impulse_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> answers.Array:
        return self._sum([part.impulse_response(t, i, j) for part in self.parts])

    def step_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> answers.Array:
        return self._sum([part.step_response(t, i, j) for part in self.parts])

    def static_compliance(self) -> answers.Array:
        return self._sum([part.static_compliance() for part in self.parts])

    def initial_value(self) -> answers.Array:
        return self._sum([part.initial_value() for part in self.parts])

    def step_kernel(self, dt: float, n_steps: int) -> answers.StepKernel:
        """Return all poles in one recursion and all weights in one convolution."""
        kernels = [part.step_kernel(dt, n_steps) for part in self.parts]
        modal = tuple(kernel.modal for kernel in kernels if kernel.modal is not None)
        weights = [kernel.weights for kernel in kernels if kernel.weights is not None]
        return answers.StepKernel(
            merged(modal, self.factor) if modal else None,
            self._sum(weights) if weights else None,
            " + ".join(kernel.engine for kernel in kernels),
        )


@dataclass(frozen=True)
class SumGreens(Combination):
    """g_ij = sum of the parts' g_ij: displacements add, as for springs in series. Passive if every part is.

    Attributes:
        parts: at least one, all with the same ports.

    Raises:
        GreensFunctionError: no parts, or parts with other ports than the first.
    """

    parts: tuple[base.GreensFunction, ...]
    factor: ClassVar[float] = 1.0  # type: ignore[misc]

    __repr__ = base.GreensFunction.__str__

    def __post_init__(self) -> None:
        if not self.parts:
            raise answers.GreensFunctionError("a sum of 0 parts: give at least one part")
        for part in self.parts:
            if part.ports != self.parts[0].ports:
                raise answers.GreensFunctionError(
                    f"the parts of a sum need the same ports; found {self.parts[0].ports} and {part.ports}"
                )

    def _with(self, parts: tuple[base.GreensFunction, ...]) -> SumGreens:
        return SumGreens(parts)

    def _in_words(self) -> tuple[str, ...]:
        shown = [f"+ {cut(line, 160)}" for part in self.parts[:3] for line in str(part).splitlines()[:2]]
        return (*shown, *([f"+ {len(self.parts) - 3} parts more"] if len(self.parts) > 3 else []))

    @property
    def summands(self) -> tuple[base.GreensFunction, ...]:
        return self.parts

    @property
    def provenance(self) -> dict[str, object]:
        return {"kind": "sum", "parts": [dict(part.provenance) for part in self.parts]}

    def stored(self) -> answers.Stored:
        return answers.Stored("sum", parts=self.parts)

    def scaled(self, factor: float) -> SumGreens:
        return SumGreens(tuple(part.scaled(factor) for part in self.parts))

    def with_error(self, error: answers.ErrorEstimate, origin: Mapping[str, object] | None = None) -> SumGreens:
        """Return the parts with this error, relative to each; raises `GreensFunctionError` for an ``origin``."""
        if origin is not None:
            raise answers.GreensFunctionError("a sum has the origins of its parts: state them there")
        return SumGreens(tuple(part.with_error(error) for part in self.parts))


@dataclass(frozen=True)
class ScaledGreens(Combination):
    """Positive factor times any Green's function; those of this package scale into their own kind by ``scaled``.

    Attributes:
        part: the function.
        factor: factor > 0, so that a passive body stays passive.

    Raises:
        GreensFunctionError: a factor that is not positive and finite.
    """

    part: base.GreensFunction
    factor: float

    __repr__ = base.GreensFunction.__str__

    def __post_init__(self) -> None:
        answers.check_factor(self.factor)

    @property
    def parts(self) -> tuple[base.GreensFunction, ...]:  # type: ignore[override]
        """Return the one function."""
        return (self.part,)

    def _with(self, parts: tuple[base.GreensFunction, ...]) -> ScaledGreens:
        return replace(self, part=parts[0])

    def _in_words(self) -> tuple[str, ...]:
        return (f"{self.factor:g} times", *(f"  {line}" for line in str(self.part).splitlines()))

    @property
    def provenance(self) -> dict[str, object]:
        return {"kind": "scaled", "factor": self.factor, "part": dict(self.part.provenance)}

    @property
    def rod(self) -> answers.Rod | None:
        rod = self.part.rod
        return None if rod is None else replace(rod, impedance=rod.impedance / self.factor)

    def stored(self) -> answers.Stored:
        return answers.Stored("scaled", {"factor": self.factor}, parts=(self.part,))

    def scaled(self, factor: float) -> ScaledGreens:
        return ScaledGreens(self.part, self.factor * factor)

    def with_error(self, error: answers.ErrorEstimate, origin: Mapping[str, object] | None = None) -> ScaledGreens:
        return replace(self, part=self.part.with_error(error, origin))


def merged(parts: tuple[ModalGreens, ...], factor: float = 1.0) -> ModalGreens:
    """Return ``factor`` times the sum of modal functions as one function with all their poles."""
    together = SumGreens(parts)
    whole = ModalGreens(
        np.concatenate([part.omega for part in parts]),
        np.concatenate([part.zeta for part in parts]),
        np.concatenate([part.shapes for part in parts]),
        Residual.together([part.residual for part in parts]),
        together.ports,
        together.error_estimate,
        together.provenance,
        together.valid_for,
    )
    return whole.scaled(factor)


def _largest(errors: list[float | None]) -> float | None:
    known = [error for error in errors if error is not None]
    return max(known) if len(known) == len(errors) else None
