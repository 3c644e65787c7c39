"""The roads by name; plans read them without loading any."""

from __future__ import annotations

from typing import Final, Literal

Method = Literal["auto", "krylov", "modes", "transient", "lanczos", "second_order"]
CONVOLVED: Final[tuple[Method, ...]] = ("second_order", "transient")
"""Roads whose g is convolved by step weights; those of the others is a sum of oscillators."""
