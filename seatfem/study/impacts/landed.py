"""Scenes of a study, and points of a trade, that count: those in which the reed lands on its seat within the run.

A scene without a landing, or one that the end of the run cuts off in its landing, has numbers, but no answer: an
impulse of zero, or the part of a peak that there was time for. Beside others they would bend every mean. They count for
what needs no landing on the seat: numbers of the stopper, of the gas, of the static load, and the count of landings.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from typing import Final

STATUS: Final = "landing_status"
LANDED: Final = "landed"
BAR: Final = "error_bar_"
NO_LANDING_NEEDED: Final = ("stopper_", "gas_", "pressed_on_", "landing_count", STATUS)
"""What keys of summary.json begin with that speak of something else than a landing on the seat."""


def has_landed(summary: Mapping[str, object]) -> bool:
    """Return whether the reed landed, and the end of the run did not cut that off; a summary that has no status did."""
    return summary.get(STATUS, LANDED) == LANDED


def needs_landing(key: str) -> bool:
    """Return whether a key of summary.json, or its error bar, speaks of a landing on the seat."""
    return not key.removeprefix(BAR).removeprefix("spring_").startswith(NO_LANDING_NEEDED)


def counts(summary: Mapping[str, object], key: str) -> bool:
    """Return whether a scene with this summary counts for a measure."""
    return has_landed(summary) or not needs_landing(key)


def left_out_in_words(statuses: Iterable[object], what: str = "scenes") -> str:
    """Return how many of the ``what`` with these landing statuses are left out, and why; "" of none."""
    every = list(statuses)
    why = Counter(str(status) for status in every if status != LANDED)
    if not why:
        return ""
    reasons = ", ".join(f"{count} {status}" for status, count in sorted(why.items(), key=lambda each: -each[1]))
    return f"{why.total()} of {len(every)} {what} left out: {reasons}"
