"""How long work tells how far it is, without knowing who listens."""

from collections.abc import Callable

Progress = Callable[[str, float], None]
"""Called with the name of the stage and the fraction done (0..1)."""


def silent(stage: str, done: float) -> None:
    """Listen to nothing (the default everywhere)."""


Tell = Callable[[str], None]
"""Called with one sentence that is worth knowing while long work goes on."""


def untold(sentence: str) -> None:
    """Listen to nothing."""
