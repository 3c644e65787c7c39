"""What a cell of the battery is, and how its outcome is judged."""

from __future__ import annotations

import math
import time
import traceback
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, Generic, Literal, TypeVar

Verdict = Literal["right", "advised", "warned", "refused", "wrong"]
_PACKAGES = ("impact", "seatfem")
EXCUSED: Final = 0.5  # largest error that any advice excuses: beyond it not even the order of magnitude is known
T = TypeVar("T", float, str)


@dataclass(frozen=True)
class Finding:
    """What a cell's check found.

    Attributes:
        error: largest deviation from the oracle, relative to what is compared.
        stated: what the method states, or its theory promises, for this cell.
        advice: warnings that the program itself gave with its answer.
        note: what the error is the error of, where that is not the axis' own quantity.
    """

    error: float
    stated: float
    advice: tuple[str, ...] = ()
    note: str = ""


def worst(*pairs: tuple[float, float]) -> tuple[float, float]:
    """Of several (error, stated), the one that is nearest to its limit, or farthest beyond; not a number beats all."""
    return max(pairs, key=lambda pair: pair[0] / pair[1] if math.isfinite(pair[0]) else math.inf)


@dataclass(frozen=True)
class Cell:
    """One point of the battery: axis values, and the check that knows the answer from elsewhere.

    Attributes:
        axis: name of the axis swept, or "pairwise".
        value: where on the axis; its text is the cell's name together with the axis.
        check: computes the answer and compares it with the oracle.
        end: whether this is an extreme end of its axis.
        decade: log10 of the value, where the axis has decades (orders the map).
    """

    axis: str
    value: str
    check: Callable[[], Finding]
    end: bool = False
    decade: float = math.nan

    @property
    def name(self) -> str:
        """Unique in the battery."""
        return f"{self.axis} = {self.value}"


@dataclass(frozen=True)
class Outcome:
    """How a cell ended.

    ``verdict``: "right" (error <= stated), "advised" (right, and advice came with it), "warned" (off by more, and the
    advice said so), "refused" (no answer but a reason), "wrong" (all else).
    """

    verdict: Verdict
    error: float
    stated: float
    reason: str
    seconds: float


def swept(
    axis: str, values: Sequence[float], check: Callable[[float], Finding], *, form: str = "g"
) -> tuple[Cell, ...]:
    """Cells of a one-at-a-time sweep; the first and the last value are its ends."""
    last = len(values) - 1
    return tuple(
        Cell(axis, format(v, form), _Bound(check, v), i in (0, last), math.log10(v) if v > 0 else -math.inf)
        for i, v in enumerate(values)
    )


def chosen(axis: str, check: Callable[[str], Finding], names: Sequence[str]) -> tuple[Cell, ...]:
    """Cells of an axis without decades; every one is an end."""
    return tuple(Cell(axis, name, _Bound(check, name), True) for name in names)


def carry_out(cell: Cell) -> Outcome:
    """Run the cell; nothing it raises or warns of escapes, except what ends the process."""
    start = time.perf_counter()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            finding = cell.check()
    except ValueError as error:
        if type(error).__module__.partition(".")[0] in _PACKAGES:
            return Outcome("refused", math.nan, math.nan, str(error), time.perf_counter() - start)
        return _broken(error, start)
    except Exception as error:
        return _broken(error, start)
    return judged(finding, time.perf_counter() - start)


def judged(finding: Finding, seconds: float) -> Outcome:
    """The verdict on a finding.

    Advice excuses an error up to `EXCUSED`; one that is not a number is wrong whatever the program said.
    """
    reason = "; ".join(part for part in (finding.note, *finding.advice) if part)
    if not math.isfinite(finding.error):
        return Outcome("wrong", finding.error, finding.stated, f"not finite; {reason}", seconds)
    verdict: Verdict
    if finding.error <= finding.stated:
        verdict = "advised" if finding.advice else "right"
    else:
        verdict = "warned" if finding.advice and finding.error <= EXCUSED else "wrong"
    return Outcome(verdict, finding.error, finding.stated, reason, seconds)


@dataclass(frozen=True)
class _Bound(Generic[T]):
    check: Callable[[T], Finding]
    value: T

    def __call__(self) -> Finding:
        return self.check(self.value)


def _broken(error: Exception, start: float) -> Outcome:
    frame = traceback.extract_tb(error.__traceback__)[-1]
    where = f"{frame.filename.rsplit('/', 1)[-1]}:{frame.lineno}"
    reason = f"{type(error).__name__}: {error} ({where})"
    return Outcome("wrong", math.nan, math.nan, reason, time.perf_counter() - start)
