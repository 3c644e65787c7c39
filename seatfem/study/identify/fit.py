"""Fit of a scene's keys to the records of a record file, with the interval of each key; its report and its picture."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from impact.files.csv_table import without_nan
from impact.greens.base import Array
from impact.notices import Progress, Tell, ignore, silent
from impact.pictures.drawing import BLUE, GREY, ORANGE, sheet, time_axis, try_draw, zero_line
from impact.quantities import enumeration, in_digits, in_time, scaled
from seatfem import units
from seatfem.readings import places_of, rounded
from seatfem.study.identify import intervals
from seatfem.study.identify.intervals import EDGE, WORSE, Counted, Interval, Valley
from seatfem.study.identify.record import DIMENSIONS, Fitted, Identification, load_identification
from seatfem.study.identify.shots import Model
from seatfem.study.impacts.contact import RunError
from seatfem.study.runs.summary import write_json
from seatfem.study.scene.problems import scene_error
from seatfem.units import write_quantity

FILE: Final = "identify.json"
PICTURE: Final = "identify.png"
MOST: Final = 60  # most evaluations of the fit; for profiles see `intervals`
EVALUATIONS: Final = 2  # approximate cost of the profile of a key, in evaluations of the derivatives
FILLS: Final = 0.9  # fraction of its bounds above which an interval counts as undetermined
TOGETHER: Final = 0.95  # correlation above which two keys are reported as determined only together
FINER: Final = (2, 3)  # refinements of the step to estimate its error; one of them may not change a rounded delay
STEPPED: Final = 0.2  # part of half an interval above which the error by the time step is reported
UNMET: Final = 0.25  # rms residual over the record's standard deviation above which a fit has failed
LOST: Final = 1e-6  # change of the residuals over the range of a key below which the key has no influence
SLOW: Final = 30.0  # predicted time of a fit above which it is announced [s]


class IdentifyError(RunError):
    """Error of a fit that cannot be made; the message names the key and the remedy."""


@dataclass(frozen=True)
class Identified:
    """Result of a fit: values, their intervals, and the misfit of each record.

    Attributes:
        model: fitted model.
        shares: fitted values (P,) as positions within the bounds, 0..1.
        intervals: interval of each key.
        correlation: correlation matrix (P, P) of the keys.
        counted: weight of each record.
        spring, spring_misfit: each record with a static seat, and its misfit; nan without one.
        seconds: wall time [s].
    """

    model: Model
    shares: Array
    intervals: tuple[Interval, ...]
    correlation: Array
    counted: tuple[Counted, ...]
    spring: tuple[Array, ...]
    spring_misfit: tuple[float, ...]
    seconds: float

    @property
    def asked(self) -> Identification:
        """Return the record file."""
        return self.model.asked

    def __iter__(self) -> Iterator[tuple[str, Fitted, float, Interval]]:
        """Yield for each key: key, `Fitted`, number, interval."""
        pairs = zip(self.asked.fit.items(), self.shares, self.intervals, strict=True)
        for (key, fitted), share, interval in pairs:
            yield key, fitted, fitted.value(float(share)), interval

    def sentences(self) -> Iterator[str]:
        """Yield values with intervals, then keys that the records do not determine, then the misfit of each record."""
        for key, fitted, value, interval in self:
            yield f"{fitted.name or key} = {_with_ends(fitted, value, interval)}"
        for key, fitted, _, interval in self:
            yield from _not_told(key, fitted, interval)
        for key, fitted, _, interval in self:
            yield from self._warn_of_step(fitted.name or key, fitted, interval)
        keys = list(self.asked.fit)
        for i, j in zip(*np.triu_indices(len(keys), 1), strict=True):
            if abs(rho := float(self.correlation[i, j])) > TOGETHER:
                names = " and ".join(self.asked.fit[keys[k]].name or keys[k] for k in (i, j))
                remedy = "state one of them, or add a shot or a record in which their effects differ"
                yield f"{names} are told only together (correlation {rho:.3f}): {remedy}"
        for each, one, spring in zip(self.asked.record, self.counted, self.spring_misfit, strict=True):
            yield from _met(each.name, one, spring)
        if self.unmet:
            yield f"the fit does not reach {enumeration(self.unmet)}, and tells no key: another start or bounds may"
        yield from self.model.notes

    def _warn_of_step(self, name: str, fitted: Fitted, interval: Interval) -> Iterator[str]:
        if interval.of_step > STEPPED * _filled(interval) / 2:
            width = fitted.value(interval.high) - fitted.value(interval.low)
            unit = f" {fitted.unit}" if fitted.unit else ""
            part, step = width * interval.of_step / _filled(interval), min(self.model.steps.values())
            yield (
                f"of the interval of {name} {in_digits(part, 2)}{unit} to either side may be the step's, "
                f"{write_quantity(step, 'time', 3)}: state a finer run.time_step"
            )

    @property
    def unmet(self) -> tuple[str, ...]:
        """Return the names of records with large residuals beyond the noise."""
        pairs = zip(self.model.samples, self.counted, strict=True)
        met = ((record, one, one.misfit * record.noise <= UNMET * float(np.std(record.value))) for record, one in pairs)
        return tuple(record.record.name for record, one, near in met if one.misfit > WORSE and not near)

    def as_json(self) -> dict[str, Any]:
        """Return all results as JSON; numbers of a key are in the unit of its bounds."""
        keys = [
            {
                "key": key, "name": fitted.name or key, "unit": fitted.unit, "value": value,
                "low": fitted.value(interval.low), "high": fitted.value(interval.high),
                "told": not self.unmet and not (interval.at_low and interval.at_high) and _filled(interval) < FILLS,
                "low_is_bound": interval.at_low, "high_is_bound": interval.at_high,
                "start": fitted.start[0], "from": fitted.low[0], "to": fitted.high[0],
            }
            for key, fitted, value, interval in self
        ]  # fmt: skip
        records = [
            {
                "name": record.name, "samples": each.samples, "effective_samples": each.samples / each.tau,
                "noise": samples.noise, "misfit": each.misfit, "spring_misfit": spring,
            }
            for record, each, samples, spring in zip(
                self.asked.record, self.counted, self.model.samples, self.spring_misfit, strict=True
            )
        ]  # fmt: skip
        numbers = {
            "title": self.asked.heading,
            "scene": self.asked.scene.name,
            "level": intervals.LEVEL,
            "keys": keys,
            "correlation": self.correlation.tolist(),
            "records": records,
            "marches": self.model.marches,
            "notes": list(self.model.notes),
            "wall_time_s": self.seconds,
        }
        return {key: without_nan(value) for key, value in numbers.items()}


def identify(path: Path | str, *, progress: Progress = silent, tell: Tell = ignore) -> Identified:
    """Fit the keys of a record file to its records; ``tell`` takes a sentence in advance if the fit takes long.

    Raises:
        SceneError: all errors in the record file or the scene, by key.
        IdentifyError: a key without influence.
        RunError, ContactError: a scene that cannot be run.
    """
    start_time = time.perf_counter()
    identification, samples = load_identification(path)
    model = Model(identification, samples)
    start = np.array([fitted.share(fitted.start[0]) for fitted in identification.fit.values()])
    first = np.clip(start, EDGE, 1 - EDGE)
    _check_influence(model, first)
    once = time.perf_counter()
    model.jacobian(np.clip(start, 2 * EDGE, 1 - 2 * EDGE))
    price = (time.perf_counter() - once) * (MOST / 3 + EVALUATIONS * len(start))
    if price > SLOW:
        tell(f"about {in_time(price)}, by the time of the first march and its derivatives")
    progress("fitting", 0.0)
    lengths = np.cumsum([len(each.time) for each in samples])[:-1]
    best, words = intervals.search(model.residuals, model.jacobian, first, MOST, lengths, progress)
    model.notes += [words] if words else []
    counted = _counted(model, best, lengths)
    if len(samples) > 1:
        weighted = _Weighted(model, counted)
        best = np.asarray(intervals.fit(weighted.residuals, weighted.jacobian, best, MOST).x)
        counted = _counted(model, best, lengths)
    weighted = _Weighted(model, counted)
    t = intervals.quantile(counted, len(best))
    valley, ends = Valley.around(weighted.residuals, weighted.jacobian, best, t), []
    for key in range(len(best)):
        progress("fitting", (key + 1) / (len(best) + 1))
        ends.append(valley.interval(key))
    ends = [each.widened(float(shift)) for each, shift in zip(ends, _bound_step_shifts(weighted, valley), strict=True)]
    deviation = np.sqrt(np.diag(valley.covariance))
    correlation = valley.covariance / np.outer(deviation, deviation)
    spring, misfits = _spring(model, best)
    progress("fitting", 1.0)
    return Identified(model, best, tuple(ends), correlation, counted, spring, misfits, time.perf_counter() - start_time)


def write(result: Identified, folder: Path, *, pictures: bool = True) -> tuple[tuple[Path, ...], str]:
    """Write identify.json and identify.png; return the files written, and why there is no picture, or ""."""
    folder.mkdir(parents=True, exist_ok=True)
    numbers, picture = folder / FILE, folder / PICTURE
    write_json(numbers, result.as_json())
    gap = try_draw(lambda file: draw(result, file), picture) if pictures else ""
    return (numbers, picture) if pictures and not gap else (numbers,), gap


@dataclass(frozen=True)
class _Weighted:
    """Residuals of a model and their derivatives, multiplied by the weights of their records."""

    model: Model
    counted: tuple[Counted, ...]

    @property
    def weights(self) -> Array:
        return np.repeat([each.weight for each in self.counted], [each.samples for each in self.counted])

    def residuals(self, shares: Array) -> Array:
        return self.weights * self.model.residuals(shares)

    def jacobian(self, shares: Array) -> Array:
        return self.weights[:, None] * self.model.jacobian(shares)


def _bound_step_shifts(weighted: _Weighted, valley: Valley) -> Array:
    """Return an estimated bound of the shift of each key (P,) by the error of the time step, from the changes with
    finer steps; first-order convergence is assumed, which is conservative for the second order of the method."""
    shifts = [np.zeros(len(valley.best))]
    for times in FINER:
        finer = replace(weighted, model=weighted.model.at_finer_step(times))
        changed = finer.residuals(valley.best) - valley.residuals(valley.best)
        shifts.append(times / (times - 1) * np.abs(valley.covariance @ (valley.slope.T @ changed)))
    return np.asarray(np.max(shifts, axis=0))


def _counted(model: Model, shares: Array, lengths: Array) -> tuple[Counted, ...]:
    parts = np.split(model.residuals(shares), lengths)
    total = sum(map(len, parts))
    return tuple(intervals.counted(part, len(shares) * len(part) / total) for part in parts)


def _spring(model: Model, shares: Array) -> tuple[tuple[Array, ...], tuple[float, ...]]:
    """Return the records on the seat's static stiffness, and their misfits; empty and nan for a seat without one."""
    try:
        courses = model.records_at(shares, spring=True)
    except RunError:
        return (), (math.nan,) * len(model.samples)
    pairs = zip(courses, model.samples, strict=True)
    return tuple(courses), tuple(float(np.sqrt(np.mean((one - each.value) ** 2))) / each.noise for one, each in pairs)


def _check_influence(model: Model, shares: Array) -> None:
    """Raise `IdentifyError` for keys without influence, in the terms of the record file."""
    try:
        sizes = np.abs(model.jacobian(shares)).max(axis=0)
    except RunError as error:
        raise scene_error("scene", str(error)) from None
    idle = [key for key, size in zip(model.keys, sizes, strict=True) if not size > LOST]
    if idle:
        raise IdentifyError(
            f"fit: {enumeration(idle)} changes no record at the start by more than {LOST:g} of its noise: the bodies "
            "may not touch, or not part, while it is recorded; take the key out, begin elsewhere, or add a record that "
            "feels it"
        )


def _filled(interval: Interval) -> float:
    return interval.high - interval.low


def _with_ends(fitted: Fitted, value: float, interval: Interval) -> str:
    """Return a number with its interval: "18.3 +- 0.4 um (95 %)", or with both ends if these are asymmetric."""
    low, high = fitted.value(interval.low), fitted.value(interval.high)
    unit = f" {fitted.unit}" if fitted.unit else ""
    half, places = (high - low) / 2, places_of(value, (high - low) / 2)
    if half > 0 and abs((high + low) / 2 - value) < 0.1 * half:
        return f"{rounded(value, places)} +- {rounded(half, places)}{unit} (95 %)"
    return f"{rounded(value, places)}{unit} ({rounded(low, places)} to {rounded(high, places)}, 95 %)"


def _not_told(key: str, fitted: Fitted, interval: Interval) -> Iterator[str]:
    name, unit = fitted.name or key, f" {fitted.unit}" if fitted.unit else ""
    low, high = fitted.low[0], fitted.high[0]
    if (interval.at_low and interval.at_high) or _filled(interval) >= FILLS:
        remedy = "add a record that feels it, or state it"
        if key.startswith("contact.law"):
            remedy = "a harder shot would, or a record of the force"
        elif "damping" in key:
            remedy = "a longer record of the ringing would"
        yield f"the records do not tell {name}: its interval fills the bounds, {low:g} to {high:g}{unit}; {remedy}"
    elif interval.at_low or interval.at_high:
        end, word = (high, "no upper") if interval.at_high else (low, "no lower")
        yield f"the records give {name} {word} limit: its interval ends at the bound, {end:g}{unit}; widen the bounds"


def _met(name: str, one: Counted, spring: float) -> Iterator[str]:
    comparison = "" if math.isnan(spring) else f"; on the seat's static stiffness {in_digits(spring, 3)} times"
    yield f"{name}: what is left is {in_digits(one.misfit, 3)} times the noise{comparison}"
    if one.misfit * math.sqrt(one.tau) > WORSE:
        yield (
            f"{name}: what is left hangs together over {in_digits(one.tau, 2)} samples: the model does not reach the "
            f"record, {one.samples} samples count as {in_digits(one.samples / one.tau, 2)}, and the intervals are "
            "wider by it"
        )


BAND = 1.96  # standard deviations that contain 95 % of the noise


def draw(result: Identified, path: Path) -> None:
    """Draw each record with the fit, and the residuals over the noise below. Raises `PictureError`."""
    samples, fitted = result.model.samples, result.model.records_at(result.shares)
    count = len(samples)
    with sheet(path, 6.4, 0.4 + 3.0 * count) as page:
        page.suptitle(result.asked.heading)
        axes = page.subplots(2 * count, 1, height_ratios=[2.4, 1.0] * count, squeeze=False)[:, 0]
        for number, each in enumerate(samples):
            above, below = axes[2 * number], axes[2 * number + 1]
            dimension = DIMENSIONS[each.record.kind]
            rate, unit = scaled(float(np.abs(each.value).max()), units.DIMENSIONS[dimension or "length"].si)
            if not dimension:  # a strain, as a length over a length
                unit = f"{unit}/m"
            window = (float(each.time[0]), float(each.time[-1]))
            times = time_axis(below, window) * each.time
            above.set(xlim=below.get_xlim(), ylabel=f"{each.record.kind} [{unit}]")
            above.set_title(each.record.name.replace("_", " "))
            above.tick_params(labelbottom=False)
            above.plot(times, rate * each.value, ".", color=GREY, markersize=2.5, label="record")
            if result.spring:
                spring = rate * result.spring[number]
                above.plot(times, spring, "--", color=ORANGE, linewidth=1.0, label="on the seat's static stiffness")
            above.plot(times, rate * fitted[number], color=BLUE, label="fit")
            above.legend(loc="best")
            residuals = (each.value - fitted[number]) / each.noise
            zero_line(below)
            below.axhspan(-BAND, BAND, color=GREY, alpha=0.15, linewidth=0)
            below.plot(times, residuals, color=BLUE, linewidth=0.8)
            below.set(ylabel="over noise")
            below.set_title("record less fit, over the noise, 95 % of which lies in the band")
        page.align_ylabels(axes)
