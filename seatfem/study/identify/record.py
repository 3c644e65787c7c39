"""Record files: a scene, records of one or several shots, and the keys that are fitted to them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import numpy as np
from pydantic import BeforeValidator, Field

from impact.bodies.time_series import TimeSeriesError, read_time_series
from impact.greens.base import Array
from seatfem import fields
from seatfem.study.scene.load import load_scene
from seatfem.study.scene.problems import Problem, SceneError, scene_error
from seatfem.study.scene.tables import WholeKey, dotted, load_table, located
from seatfem.units import UnitError, number_and_unit, parse_fraction, parse_quantity

MOST_SAMPLES: Final = 20_000  # largest number of compared samples of a record
MOST_RECORDS: Final = 20
MOST_KEYS: Final = 12
LOG: Final = 10.0  # ratio of positive bounds above which a key is fitted by its logarithm
NOTHING: Final = 2e-5
"""Fraction of the range below which a value near zero is zero: a scene refuses lengths below a nanometre."""
QUIET: Final = 10  # fewest samples of a quiet part: ten give the noise to a quarter
OWN: Final = ("gain", "delay")  # keys of records that may be fitted: `gain` of all of them, `gain.NAME` of one
DIMENSIONS: Final = {"force": "force", "strain": "", "displacement": "length", "velocity": "velocity"}

Kind = Literal["force", "strain", "displacement", "velocity"]
Instant = Annotated[float, BeforeValidator(fields.ReadQuantity("time"))]


def _no_text(value: object) -> object:
    """Return a value that begins with a number; raises `ValueError` for a text, such as a kind."""
    try:
        if isinstance(value, str):
            number_and_unit(value)
    except UnitError as error:
        raise ValueError(f"{error}: a key that holds a text is not fitted; state it in the scene") from None
    return value


class Fitted(fields.Table):
    """Fitted key: start of the search, and bounds."""

    start: Annotated[fields.WrittenQuantity, BeforeValidator(_no_text)] = Field(description="where the search begins")
    low: fields.WrittenQuantity = Field(alias="from", description="least value")
    high: fields.WrittenQuantity = Field(alias="to", description="greatest value")
    name: str = fields.default("", "in results; the key where absent", pattern=r"^[\w .-]{0,40}$")

    def contradictions(self) -> fields.Contradictions:
        for key, (_, unit) in (("from", self.low), ("to", self.high)):
            if unit != self.unit:
                yield key, f"is in {unit or 'no unit'}, start in {self.unit or 'none'}: give all in one unit"
        low, high = self.low[0], self.high[0]
        if not low < high:
            yield "to", f"{high:g} must be above from = {low:g}"
        if not low <= self.start[0] <= high:
            yield "start", f"{self.start[0]:g} lies outside of from = {low:g}, to = {high:g}: move it, or the bounds"

    @property
    def unit(self) -> str:
        """Return the unit of all its numbers in the file."""
        return self.start[1]

    @property
    def by_logarithm(self) -> bool:
        """Return whether its logarithm is fitted."""
        return self.low[0] > 0 and self.high[0] > LOG * self.low[0]

    def value(self, share: float) -> float:
        """Return the number at a position ``share``, 0..1, between the bounds."""
        low, high = self.low[0], self.high[0]
        if share in (0.0, 1.0):
            return high if share else low
        if self.by_logarithm:
            return low * float((high / low) ** share)
        value = low + (high - low) * share
        return 0.0 if abs(value) < NOTHING * (high - low) else value

    def share(self, value: float) -> float:
        """Return the position between the bounds, 0..1, of a number."""
        low, high = self.low[0], self.high[0]
        return math.log(value / low) / math.log(high / low) if self.by_logarithm else (value - low) / (high - low)

    def written(self, value: float) -> fields.Value:
        """Return a number as text for a scene file."""
        return f"{value!r} {self.unit}" if self.unit else value


class Record(fields.Table):
    """A record of a shot: contact force, strain at a gauge of the scene, or motion of a body at the contact."""

    name: str = Field(pattern=r"^[a-z][a-z0-9_]{0,30}$", description="in results: small letters, digits and _")
    file: fields.ExistingFile = Field(description="CSV file with heads as in `time [us],force [N]`")
    kind: Kind = Field(description="what was recorded: force of the contact, strain, displacement or velocity")
    column: str = fields.default("", "head of its column; the kind where absent", max_length=200)
    of: str = fields.default("", "gauge of a strain; of a motion `seat` or `reed`", pattern=r"^[a-z0-9_]*$")
    noise: str | float | None = fields.absent("standard deviation of the noise, with its unit; of a strain a number")
    quiet: tuple[Instant, Instant] | None = fields.absent(
        "or from when to when nothing happens: noise is the scatter there, and its mean is taken off"
    )
    start: Instant | None = fields.absent("from when it is compared", alias="from")
    end: Instant | None = fields.absent("until when it is compared", alias="to")
    gain: float = fields.default(1.0, "by which the record is larger than what it records", gt=-1e9, lt=1e9)
    delay: Instant = fields.default("0 s", "by which it is later")
    set: Annotated[dict[WholeKey, Any], dotted({"kind"})] = fields.default(
        {}, "values of the scene's keys in this shot, by dotted key"
    )

    def contradictions(self) -> fields.Contradictions:
        self.check_one_of(("noise", "quiet"), "nothing says how far the record is off by its noise")
        if self.noise is not None:
            try:
                sigma = self._noise()
            except UnitError as error:
                yield "noise", str(error)
            else:
                if not sigma > 0:
                    yield "noise", f"{self.noise!r} must be positive"
        if self.kind == "strain" and not self.of:
            yield "of", "required key is missing: the name of a [[gauge]] of the scene"
        if self.kind in ("displacement", "velocity") and self.of not in ("seat", "reed"):
            yield "of", f"{self.of!r} must be 'seat' or 'reed': whose motion at the contact"
        if self.kind == "force" and self.of:
            yield "of", "a force is that of the contact with the seat; remove the key"
        for name, span in (("quiet", self.quiet), ("to", (self.start, self.end))):
            if span is not None and None not in span and not span[0] < span[1]:  # type: ignore[operator]
                yield name, f"ends at {span[1]:g} s, before it begins, at {span[0]:g} s"

    def _noise(self) -> float:
        dimension, text = DIMENSIONS[self.kind], str(self.noise)
        return parse_quantity(text, dimension) if dimension else parse_fraction(text)

    def samples(self) -> Samples:
        """Return the samples that are compared. Raises `KeyProblem` for an invalid key."""
        with fields.problem_of("file", TimeSeriesError):
            columns: dict[str, str] = {self.kind: self.column} if self.column else {}
            series = read_time_series(self.file, self.kind, columns=columns)
        time, value = series.time, series.value
        if self.noise is not None:
            sigma = self._noise()
        else:
            assert self.quiet is not None
            calm = value[(time >= self.quiet[0]) & (time <= self.quiet[1])]
            if len(calm) < QUIET:
                raise fields.KeyProblem("quiet", f"holds {len(calm)} samples, at least {QUIET} are needed: widen it")
            sigma, value = float(calm.std(ddof=1)), value - calm.mean()
            if not sigma > 0:
                raise fields.KeyProblem("quiet", "all samples are equal there: state noise")
        first, last = (-math.inf if self.start is None else self.start), (math.inf if self.end is None else self.end)
        compared = (time >= first) & (time <= last)
        count = int(np.count_nonzero(compared))
        if count < 2:
            raise fields.KeyProblem("from", f"{count} samples lie between from and to, at least 2 are needed")
        if count > MOST_SAMPLES:
            words = f"{count} samples are compared, at most {MOST_SAMPLES}: narrow from and to, or thin the record"
            raise fields.KeyProblem("file", words)
        return Samples(self, time[compared], value[compared], sigma)


@dataclass(frozen=True)
class Samples:
    """Samples of a ``record`` that are compared: times [s], values and the noise's standard deviation [SI]."""

    record: Record
    time: Array
    value: Array
    noise: float


class Identification(fields.Table):
    """Record file: the records, and the keys of the scene that are fitted to them."""

    title: str = fields.default("", "for pictures")
    scene: fields.ExistingFile = Field(description="the scene's file")
    record: tuple[Record, ...] = Field(min_length=1, max_length=MOST_RECORDS, description="the records")
    fit: Annotated[dict[WholeKey, Fitted], dotted({"start", "from", "to"})] = Field(
        min_length=1, max_length=MOST_KEYS, description="by dotted key of the scene, or gain and delay of records"
    )

    @property
    def heading(self) -> str:
        """Return the heading for reports."""
        return self.title or self.scene.stem.replace("_", " ")

    def contradictions(self) -> fields.Contradictions:
        names = [each.name for each in self.record]
        for number, name in enumerate(names):
            if name in names[:number]:
                yield f"record.{number}.name", f"{name!r} is the name of two records: give each its own"
        for key, fitted in self.fit.items():
            own, _, of = key.partition(".")
            if own in OWN and of and of not in names:
                yield f"fit.{key}", f"there is no record {of!r}; there are {', '.join(names)}"
            if own == "delay":
                try:
                    parse_quantity(str(fitted.written(fitted.start[0])), "time")
                except UnitError as error:
                    yield f"fit.{key}.start", str(error)
            if own == "gain" and fitted.unit:
                yield f"fit.{key}.start", f"a gain has no unit, this is in {fitted.unit}"
            if clash := next((each.name for each in self.record if key in each.set), ""):
                yield f"fit.{key}", f"record {clash!r} sets it: fit it, or set it"


def load_identification(path: Path | str) -> tuple[Identification, tuple[Samples, ...]]:
    """Read a record file (TOML, up to 1 MB) and its records; paths are relative to its folder.

    Raises `SceneError` with all its errors.
    """
    identification = load_table(path, Identification)
    read, problems = [], []
    for number, each in enumerate(identification.record):
        try:
            read.append(each.samples())
        except fields.KeyProblem as problem:
            problems.append(Problem(None, 0, f"record.{number}.{problem.key}", f"{each.name}: {problem}"))
    total = sum(len(each.time) for each in read)
    if not problems and total <= len(identification.fit):
        words = f"{len(identification.fit)} keys and {total} samples: fit fewer keys, or compare more samples"
        problems.append(Problem(None, 0, "fit", words))
    if problems:
        raise located(SceneError(tuple(problems)), Path(path))
    _check_keys(identification, Path(path))
    return identification, tuple(read)


def _check_keys(identification: Identification, path: Path) -> None:
    """Raise `SceneError` for values that are invalid in the scene, with their lines in the record file."""
    fit = {key: fitted.written(fitted.start[0]) for key, fitted in identification.fit.items() if not is_own(key)}
    for record in identification.record:
        try:
            load_scene(identification.scene, {**record.set, **fit})
        except SceneError as error:
            in_record_file = {each: scene_error(f"fit.{each.key}", each.message).problems[0] for each in error.problems}
            problems = tuple(in_record_file[each] if each.key in fit else each for each in error.problems)
            raise located(SceneError(problems), path) from None


def is_own(key: str) -> bool:
    """Return whether a fitted key belongs to a record, not to the scene."""
    return key.partition(".")[0] in OWN


def number_of(value: fields.Value) -> float:
    """Return the number of a value in the file, in seconds for a delay."""
    number, unit = number_and_unit(value)
    return parse_quantity(str(value), "time") if unit else number
