"""Limits on results of a study, and whether a scene meets them, in view of the error bars of its results."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from difflib import SequenceMatcher
from typing import Final

from impact.quantities import in_digits
from seatfem.fields import read_number
from seatfem.readings import Summary, as_number, bar_of
from seatfem.results import all_results, label_of, result_of
from seatfem.study.impacts.landings import LANDED, STATUS, counts
from seatfem.units import UnitError, parse_in

LOOSE: Final = 1e-3  # relative violation of a limit that a search allows for a measure without error bar
HOLDS, FAILS, UNDECIDED, NO_VALUE = "holds", "does not hold", "undecided", "no value"
NO_LANDING, CUT_OFF, NEVER_OPENED, FAILED, STOPPED = "no landing", "cut off", "never opened", "failed", "stopped"
VERDICTS: Final = (HOLDS, UNDECIDED, FAILS, CUT_OFF, NO_LANDING, NEVER_OPENED, NO_VALUE, STOPPED, FAILED)
"""Everything that a scene may be with respect to limits, in the order in which words, legends and lists name it."""
VERDICT: Final = "verdict"
"""Column of a study's table with one of them for each scene."""
_CONSTRAINT: Final = re.compile(r"\s*(\w+)\s*(<=|>=)\s*(\S.*?)\s*")


@dataclass(frozen=True)
class Constraint:
    """A measure of summary.json and its limit [SI]; ``sign`` is 1 for a lower limit, -1 for an upper one."""

    measure: str
    sign: float
    limit: float

    def __str__(self) -> str:
        return f"{self.measure} {'>=' if self.sign > 0 else '<='} {self.limit:g}"

    def in_words(self, factor: float, unit: str) -> str:
        """Return the limit as text in a ``unit``, of which the SI unit is ``factor``."""
        side = "above" if self.sign > 0 else "below"
        return f"{label_of(self.measure)} {side} {in_digits(factor * self.limit, 6)} {unit}".rstrip()

    def margin(self, value: float) -> float:
        """Return the distance from the limit in the unit of the measure, negative if it is violated."""
        return self.sign * (value - self.limit)

    def holds(self, margin: float, bar: float) -> bool:
        """Return whether the limit is met within the measure's error bar, or within `LOOSE` of it if that is nan."""
        return margin >= -(bar if math.isfinite(bar) else LOOSE * abs(self.limit))

    def verdict(self, summary: Summary) -> str:
        """Return whether a scene meets the limit, of `VERDICTS`: undecided if the limit is within the error bar of the
        value, or the bar is not known. A value without any bar, such as a count, counts as exact."""
        if not counts(summary, self.measure):
            return str(summary.get(STATUS) or LANDED)
        value, bar = as_number(summary.get(self.measure)), bar_of(summary, self.measure)
        if value is None:
            return NO_VALUE
        margin, width = self.margin(value), 0.0 if bar is None else bar
        return HOLDS if margin >= width else FAILS if margin < -width else UNDECIDED


def verdict_of(verdicts: Iterable[str]) -> str:
    """Return the verdict on all limits together from those on each: the worst of them, a limit that does not hold
    before a landing that is missing."""
    order = (STOPPED, FAILED, FAILS, NEVER_OPENED, NO_LANDING, CUT_OFF, NO_VALUE, UNDECIDED, HOLDS)
    return min(verdicts, key=order.index)


def read_limit(key: str, written: object) -> float:
    """Return a limit on a result [SI] from a quantity, "350 MPa", or a number in the unit of the key.

    Raises `UnitError` for another dimension, for a limit that is no finite number, and for a quantity with a unit under
    a name that is no result.
    """
    if unit := result_of(key).unit:
        return read_number(written, lambda text: parse_in(text, unit), f"'2 {unit}'")
    try:
        return read_number(written)
    except UnitError:
        if key in all_results() or not (close := nearest(key, {})):
            raise
    raise UnitError(f"{key!r} is no result of a run; state {' or '.join(map(repr, close))}")


def read_unit(key: str, written: str) -> float:
    """Return one of the unit ``written`` in the unit of a key [SI]. Raises `UnitError`."""
    if written[:1] in "+-.0123456789":
        raise UnitError(f"{written!r} must be a unit alone; write one, such as 'MPa'")
    return read_limit(key, f"1 {written}")


def read_constraint(text: object) -> Constraint:
    """Return the limit of a text such as "life_margin >= 1.2". Raises `ValueError`."""
    parts = _CONSTRAINT.fullmatch(text) if isinstance(text, str) else None
    try:
        if parts is not None:
            key = full_key(parts[1])
            number = _plain_number(parts[3])
            limit = read_limit(key, parts[3]) if number is None else number
            if math.isfinite(limit):
                return Constraint(key, 1.0 if parts[2] == ">=" else -1.0, limit)
        reason = ""
    except ValueError as error:
        reason = f" ({error})"
    raise ValueError(
        f"{str(text)[:80]!r} cannot be read{reason}; write a key of summary.json, <= or >=, and a number with "
        "its unit, or in SI units, as in 'life_margin >= 1.2' or 'landing_peak_reed_stress_Pa <= 350 MPa'"
    )


def _plain_number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def full_key(name: str) -> str:
    """Return the key of a result that a study names: "reed_stress" and "seat_stress" stand for their peaks."""
    peak, declared = re.sub("(reed|seat)_stress", r"peak_\1_stress", name), all_results()
    return peak if name not in declared and peak in declared else name


def nearest(name: str, numbers: Mapping[str, object]) -> list[str]:
    """Return the keys of results that resemble a ``name`` most: by the words they share, then by their letters."""
    keys = {key for key, value in numbers.items() if as_number(value) is not None} | all_results().keys()
    words = {*name.lower().split("_")}

    def likeness(key: str) -> float:
        of_key = {*key.lower().split("_")}
        return len(words & of_key) / len(words | of_key) + SequenceMatcher(None, name, key).ratio()

    own = name.split("_")[0] if name.startswith(("spring_", "error_", "plan_")) else ""
    near = [key for key in keys if key.startswith(("spring_", "error_", "plan_", "regime_")) <= bool(own)]
    return sorted((key for key in near if likeness(key) > 0.6), key=lambda key: (-likeness(key), key))[:3]
