"""One port of a body in closed form."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from typing import ClassVar

import numpy as np

from impact.greens.answers import Array, ErrorEstimate, StepKernel, Stored
from impact.greens.base import GreensFunction


def step_weights(greens: GreensFunction, dt: float, n_steps: int) -> Array:
    """(1, 1, n) exact weights W_m = S((m + 1) h) - S(m h) of a body with one port [m/N]."""
    return np.diff(greens.step_response(dt * np.arange(n_steps + 1)))[None, None, :]


class ExactPort(GreensFunction):
    """One port of a body in closed form; a frozen dataclass whose fields are its parameters."""

    kind: ClassVar[str]
    closed_form = True
    memory: ClassVar[str] = "closed form"
    """What the step weights are made of, for people."""

    @property
    def ports(self) -> tuple[str, ...]:
        """The struck point."""
        return ("contact",)

    @property
    def error_estimate(self) -> ErrorEstimate:
        """Exact."""
        return ErrorEstimate(0.0, 0.0)

    @property
    def provenance(self) -> Mapping[str, object]:
        """The kind and its parameters."""
        assert is_dataclass(self)
        return {"kind": self.kind} | {f.name: getattr(self, f.name) for f in fields(self) if f.repr}

    def stored(self) -> Stored:
        """Its provenance alone: the kind and its parameters."""
        return Stored(str(self.provenance.get("kind", "")))

    def step_kernel(self, dt: float, n_steps: int) -> StepKernel:
        """Exact step weights."""
        return StepKernel(None, step_weights(self, dt, n_steps), f"{self.memory}, exact step weights")
