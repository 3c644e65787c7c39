"""What long work says to its caller: how far it is, and warnings that are values."""

from collections.abc import Callable
from dataclasses import dataclass

Progress = Callable[[str, float], None]
"""Called with the name of the stage and the fraction done (0..1)."""


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
