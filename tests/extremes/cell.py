"""What a cell of the battery is, and how its outcome is judged."""

import math
import time
import traceback
import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final, Generic, Literal, TypeVar

from seatfem.structures.mesh.gmsh_process import MeshingError
from seatfem.structures.reduction.modes import ConvergenceError

Verdict = Literal["right", "advised", "barred", "warned", "refused", "slow", "wrong"]
_PACKAGES = ("impact", "seatfem")
_REFUSALS = (ValueError, ArithmeticError, ConvergenceError, MeshingError)
MOST_TIME: Final = 120.0  # s of a processor beyond which a run is called slow; no round is begun after 20 s
MOST_MEMORY: Final = 2e9  # bytes beyond which it is called large: a small computer has four times as many
EXCUSED: Final = 0.5  # largest error that any advice excuses: beyond it not even the order of magnitude is known
T = TypeVar("T", float, str)


@dataclass(frozen=True)
class Standing:
    """How a number of a run stands against what is known of it; all numbers are relative.

    Attributes:
        name: of the number.
        error: its deviation.
        bar: stated with it; 0: it has none; infinite: stated as not known.
        theory: what the known value leaves out.
        target: the accuracy that was asked for.
    """

    name: str
    error: float
    bar: float
    theory: float
    target: float

    @property
    def stated(self) -> float:
        """Return the largest error that is right, or that the bar tells."""
        return self.bar + self.theory

    @property
    def within_target(self) -> bool:
        """Tell whether the error is within the target that was asked for."""
        return self.error <= self.target + self.theory

    @property
    def excess(self) -> float:
        """Return the error over what is stated; where no bar is known, over the target. Not a number is the worst."""
        if not math.isfinite(self.error):
            return math.inf
        return self.error / (self.stated if math.isfinite(self.bar) else self.target + self.theory)


@dataclass(frozen=True)
class Price:
    """What a run cost: processor time [s], resident memory [bytes]."""

    seconds: float
    memory: float


@dataclass(frozen=True)
class Finding:
    """What a cell's check found.

    Attributes:
        error: largest deviation from the oracle, relative to what is compared.
        stated: what the method states, or its theory promises, for this cell.
        advice: warnings that the program itself gave with its answer.
        note: what the error is the error of, where that is not the axis' own quantity.
        standing: of a number with an error bar, or a statement that it has none.
        too_costly: how a run cost more than any of the battery should; empty where it did not.
    """

    error: float
    stated: float
    advice: tuple[str, ...] = ()
    note: str = ""
    standing: Standing | None = None
    too_costly: str = ""


def worst(*pairs: tuple[float, float]) -> tuple[float, float]:
    """Return the pair (error, stated) that is nearest to its limit or farthest beyond; not a number beats all."""
    return max(pairs, key=lambda pair: pair[0] / pair[1] if math.isfinite(pair[0]) else math.inf)


@dataclass(frozen=True)
class Cell:
    """One point of the battery: axis values, and the check that knows the answer from elsewhere.

    Attributes:
        axis: name of the axis swept.
        value: where on the axis; its text is the cell's name together with the axis.
        check: computes the answer and compares it with the oracle.
        end: whether this is an extreme end of its axis.
        decade: log10 of the value, where the axis has decades (orders the map).
        of_scene_file: whether it runs a whole scene file.
    """

    axis: str
    value: str
    check: Callable[[], Finding]
    end: bool = False
    decade: float = math.nan
    of_scene_file: bool = False

    @property
    def name(self) -> str:
        """Return a name that is unique in the battery."""
        return f"{self.axis} = {self.value}"


@dataclass(frozen=True)
class Outcome:
    """How a cell ended.

    ``verdict``: "right" (error <= stated), "advised" (right, and advice came with it), "barred" (off by more than was
    asked for, and the error bar covers it or is not known), "warned" (of a march, which has no bar: off by more than
    stated, and the advice said so), "refused" (no answer but a reason), "slow" (it took more time or memory than any
    of the battery should), "wrong" (all else).

    ``bar`` is nan where there is none, an unknown one is infinite. ``revision``: of the program.
    """

    verdict: Verdict
    error: float
    stated: float
    reason: str
    seconds: float
    bar: float = math.nan
    revision: str = ""


def swept(
    axis: str, values: Sequence[float], check: Callable[[float], Finding], *, form: str = "g"
) -> tuple[Cell, ...]:
    """Return cells of a one-at-a-time sweep; the first and the last value are its ends."""
    last = len(values) - 1
    return tuple(
        Cell(axis, format(v, form), _Bound(check, v), i in (0, last), math.log10(v) if v > 0 else -math.inf)
        for i, v in enumerate(values)
    )


def chosen(axis: str, check: Callable[[str], Finding], names: Sequence[str]) -> tuple[Cell, ...]:
    """Return cells of an axis without decades; every one is an end."""
    return tuple(Cell(axis, name, _Bound(check, name), True) for name in names)


def carry_out(cell: Cell) -> Outcome:
    """Run the cell; nothing it raises or warns of escapes, except what ends the process."""
    start = time.perf_counter()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.simplefilter("ignore", DeprecationWarning)  # of libraries: nothing numerical
            finding = cell.check()
    except Exception as error:
        if is_refusal(error):
            return Outcome("refused", math.nan, math.nan, str(error), time.perf_counter() - start)
        return _broken(error, start)
    return judged(finding, time.perf_counter() - start)


def is_refusal(error: Exception) -> bool:
    """Return whether an error is one of the program's own, which say in words what to change."""
    return isinstance(error, _REFUSALS) and type(error).__module__.partition(".")[0] in _PACKAGES


def judged(finding: Finding, seconds: float) -> Outcome:
    """Return the verdict on a finding.

    Where a number has an error bar, only this excuses an error. Of others advice excuses one up to `EXCUSED`; what is
    not a number is wrong whatever the program said.
    """
    remarks = (finding.note, finding.too_costly, *finding.advice)
    reason = "; ".join(part for part in remarks if part)
    standing = finding.standing
    bar = standing.bar if standing is not None and standing.bar > 0 else math.nan
    if not math.isfinite(finding.error):
        return Outcome("wrong", finding.error, finding.stated, f"not finite; {reason}", seconds, bar)
    verdict = _verdict(finding)
    if finding.too_costly and verdict != "wrong":
        verdict = "slow"
    return Outcome(verdict, finding.error, finding.stated, reason, seconds, bar)


def _verdict(finding: Finding) -> Verdict:
    if finding.standing is not None and finding.error <= finding.stated and not finding.standing.within_target:
        return "barred"
    if finding.error <= finding.stated:
        return "advised" if finding.advice else "right"
    excused = finding.standing is None and finding.advice and finding.error <= EXCUSED
    return "warned" if excused else "wrong"


def judge_price(price: Price) -> str:
    """Return in words how a run cost more than `MOST_TIME` or `MOST_MEMORY`; empty where it did not."""
    remarks = []
    if price.seconds > MOST_TIME:
        remarks.append(f"{price.seconds:.0f} s, above {MOST_TIME:g} s")
    if price.memory > MOST_MEMORY:
        remarks.append(f"{price.memory / 1e9:.1f} GB, above {MOST_MEMORY / 1e9:g} GB")
    return ", ".join(remarks)


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
