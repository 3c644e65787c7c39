"""Warnings that are values."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Advice:
    """A warning that is a value: what was measured, against which limit [both SI], why it matters, what mends it."""

    name: str
    value: float
    limit: float
    reason: str
    remedy: str

    def __str__(self) -> str:
        return f"{self.name} = {self.value:.3g} (limit {self.limit:.3g}): {self.reason}; {self.remedy}"
