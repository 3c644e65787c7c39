"""Work tells its caller how far it is, and warns by values; all errors have one base."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final


class SeatfemError(Exception):
    """Base of every error that `impact` and `seatfem` raise about what they were given; the message states the remedy.

    Each error is one of Python's kinds, too, mostly a ValueError.
    """


Progress = Callable[[str, float], None]
"""Called with the name of the stage and the fraction done (0..1)."""
ROUND: Final = "round"
"""Name that is reported, in place of a stage, where a round begins, whose stages take times of their own."""


def silent(stage: str, done: float) -> None:
    """Listen to nothing (the default everywhere)."""


Tell = Callable[[str], None]
"""Called with one sentence that is worth knowing while long work goes on."""


def ignore(sentence: str) -> None:
    """Listen to nothing."""


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
