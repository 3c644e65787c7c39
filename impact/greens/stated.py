"""Green's functions that were computed or measured."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import is_dataclass, replace
from typing import Self

from impact.greens.base import ErrorEstimate, GreensFunction


class StatedGreens(GreensFunction):
    """What computed and measured functions have in common: names, error, origin and time limit are fields."""

    port_names: tuple[str, ...]
    error: ErrorEstimate
    origin: Mapping[str, object]

    @property
    def ports(self) -> tuple[str, ...]:
        """Names of the ports."""
        return self.port_names

    @property
    def error_estimate(self) -> ErrorEstimate:
        """Estimated error of g."""
        return self.error

    @property
    def provenance(self) -> Mapping[str, object]:
        """Where this function came from."""
        return self.origin

    def with_error(self, error: ErrorEstimate, origin: Mapping[str, object] | None = None) -> Self:
        """The same function with another error estimate (and provenance)."""
        assert is_dataclass(self)
        changed: Self = replace(self, error=error, origin=self.origin if origin is None else origin)
        return changed

    def known_for(self, time: float) -> Self:
        """The same function, known until ``time`` [s]."""
        assert is_dataclass(self)
        changed: Self = replace(self, valid_for=time)
        return changed
