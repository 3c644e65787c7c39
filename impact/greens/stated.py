"""What Green's functions have in common that were computed or measured, and those in closed form at one port."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from impact.greens.answers import Array, ErrorEstimate, StepKernel, Stored
from impact.greens.base import GreensFunction

_BLOCK = 256  # times at once: bounds the memory to that times the number of poles


class StatedGreens(GreensFunction):
    """Base of computed and measured functions: names, error, origin and time limit are fields."""

    port_names: tuple[str, ...]
    error: ErrorEstimate
    origin: Mapping[str, object]

    @property
    def ports(self) -> tuple[str, ...]:
        return self.port_names

    @property
    def error_estimate(self) -> ErrorEstimate:
        return self.error

    @property
    def provenance(self) -> Mapping[str, object]:
        return self.origin

    def with_error(self, error: ErrorEstimate, origin: Mapping[str, object] | None = None) -> Self:
        assert is_dataclass(self)
        changed: Self = replace(self, error=error, origin=self.origin if origin is None else origin)
        return changed

    def known_for(self, time: float) -> Self:
        """Return the same function, known until ``time`` [s]."""
        assert is_dataclass(self)
        changed: Self = replace(self, valid_for=time)
        return changed


class PoleSums(StatedGreens):
    """Base of sums of oscillators and of complex poles: all is known in closed form, term by term."""

    @abstractmethod
    def _values(self, t: Array, i: int, j: int, integrated: bool) -> Array:
        """Return g_ij, or its integral without bare compliance, at the times ``t`` (n,) >= 0."""

    @abstractmethod
    def _compliance(self, i: int, j: int) -> float:
        """Return the bare compliance [m/N]."""

    @abstractmethod
    def _filtered(self, t: Array, width: float, rows: list[int], columns: list[int]) -> Array:
        """Return the (rows, columns, n) g after a unit Hann pulse of ``width`` [s]."""

    def _terms(self, counts: Mapping[str, int], noun: str, hertz: Array, ratios: Array, spring: Array) -> tuple[str]:
        """Return the terms in words: ``counts`` of rigid motions and of real poles, and the oscillations between."""
        (rigid, real), span = (f"{n} {name}" if n else "" for name, n in counts.items()), ""
        if hertz.size:
            span = f"{hertz.size} {noun}, {hertz.min():.5g} ... {hertz.max():.5g} Hz, damping ratio "
            span += f"{ratios.min():.3g} ... {ratios.max():.3g}"
        parts = (rigid, span, real, "bare compliance" if np.any(spring) else "")
        return ("; ".join(filter(None, parts)) or "rigid and held",)

    def _sum(self, t: ArrayLike, i: int, j: int, integrated: bool) -> Array:
        t = np.asarray(t, dtype=float)
        flat = np.ravel(t)
        out = np.full(flat.shape, self._compliance(i, j) if integrated else 0.0)
        for start in range(0, flat.size, _BLOCK):
            block = slice(start, start + _BLOCK)
            out[block] += self._values(np.maximum(flat[block], 0.0), i, j, integrated)
        return np.where(flat < 0, 0.0, out).reshape(t.shape)

    def impulse_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        return self._sum(t, i, j, integrated=False)

    def step_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        return self._sum(t, i, j, integrated=True)

    def filtered(self, t: ArrayLike, width: float, i: int = 0, j: int = 0) -> Array:
        t = np.asarray(t, dtype=float)
        return np.asarray(self._filtered(np.ravel(t), width, [i], [j])[0, 0].reshape(t.shape))

    def filtered_matrix(self, t: ArrayLike, width: float, columns: Sequence[int] | None = None) -> Array:
        every = list(range(len(self.ports)))
        pushed = every if columns is None else list(columns)
        return self._filtered(np.asarray(t, dtype=float), width, every, pushed)


def step_weights(greens: GreensFunction, dt: float, n_steps: int) -> Array:
    """Return the (p, p, n) exact weights W_m = S((m + 1) h) - S(m h), S(0-) = 0 [m/N]."""
    t, ports = dt * np.arange(1, n_steps + 1), range(len(greens.ports))
    return np.diff(np.array([[greens.step_response(t, i, j) for j in ports] for i in ports]), axis=2, prepend=0.0)


class ExactPort(GreensFunction):
    """One port of a body in closed form; a frozen dataclass whose fields are its parameters."""

    kind: ClassVar[str]
    closed_form = True
    memory: ClassVar[str] = "closed form"
    """What the step weights are made of, for people."""

    @property
    def ports(self) -> tuple[str, ...]:
        return ("contact",)

    @property
    def error_estimate(self) -> ErrorEstimate:
        """Return 0: it is exact."""
        return ErrorEstimate(0.0, 0.0)

    @property
    def provenance(self) -> Mapping[str, object]:
        assert is_dataclass(self)
        return {"kind": self.kind} | {f.name: getattr(self, f.name) for f in fields(self) if f.repr}

    def stored(self) -> Stored:
        return Stored(str(self.provenance.get("kind", "")))

    def step_kernel(self, dt: float, n_steps: int) -> StepKernel:
        return StepKernel(None, step_weights(self, dt, n_steps), f"{self.memory}, exact step weights")
