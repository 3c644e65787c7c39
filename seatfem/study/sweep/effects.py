"""Statistics of the table of a study: main effects, Sobol's indices, percentiles, a Pareto front."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import scipy
from numpy.typing import NDArray

from seatfem.readings import BAR
from seatfem.study.sweep.table import Columns, StudyTable, find_stated_unit

Array = NDArray[np.float64]
MOST_LEVELS: Final = 12  # most values of a key with a group each; more are divided into groups of equal size
PERCENTILES: Final = (5.0, 50.0, 95.0)
ENOUGH: Final = 20  # fewest scenes for percentiles
CONFIDENCE: Final = 0.95
RESAMPLES: Final = 999


def varying(table: StudyTable) -> list[str]:
    """Return the parameters with several values."""
    return [name for name in table.parameters if len(set(table.columns[name])) > 1]


def varying_measures(table: StudyTable) -> list[str]:
    """Return the measures with several values."""
    values = {name: table.values(name) for name in table.measures}
    return [name for name, each in values.items() if len(set(each[np.isfinite(each)].tolist())) > 1]


@dataclass(frozen=True)
class Effect:
    """Mean of a measure over groups of scenes with about equal values of a parameter.

    Attributes:
        at: mean of the parameter in each group, or its names.
        mean: mean of the measure in each group.
        error: standard error of that mean; nan for one scene.
        bar: mean error bar of the scenes in each group, which that of their mean does not exceed; nan if not known.
        count: number of scenes in each group.
    """

    parameter: str
    measure: str
    at: Sequence[float | str]
    mean: Array
    error: Array
    bar: Array
    count: NDArray[np.int64]


def main_effect(table: StudyTable, parameter: str, measure: str) -> Effect:
    """Return the effect for each value of the parameter, or, for many values, for groups of neighbouring values."""
    y = table.values(measure)
    finite = np.isfinite(y)
    y, bars = y[finite], table.values(BAR + measure)[finite]
    column = [value for value, counts in zip(table.columns[parameter], finite, strict=True) if counts]
    text = table.is_text(parameter)
    values = np.array(column, dtype=object if text else float)
    levels = list(dict.fromkeys(column)) if text else sorted(set(column))  # type: ignore[type-var]
    if text or len(levels) <= MOST_LEVELS:
        groups = [np.flatnonzero(values == level) for level in levels]
    else:
        order = np.argsort(values, kind="stable")
        groups = np.array_split(order, int(min(MOST_LEVELS, max(3, round(len(y) ** 0.5)))))
    at = list(map(str, levels)) if text else [float(np.mean(values[group])) for group in groups]
    mean = np.array([np.mean(y[group]) for group in groups])
    count = np.array([len(group) for group in groups])
    spread = [np.std(y[group], ddof=1) if len(group) > 1 else np.nan for group in groups]
    bar = np.array([np.mean(bars[group]) for group in groups])
    return Effect(parameter, measure, at, mean, np.array(spread) / np.sqrt(count), bar, count)


def main_effects(table: StudyTable) -> list[Effect]:
    """Return every parameter's effect on every measure; none for a zip of several keys, which are confounded."""
    if table.study.design == "zip" and len(table.parameters) > 1:
        return []
    pairs = itertools.product(varying_measures(table), varying(table))
    return [main_effect(table, parameter, measure) for measure, parameter in pairs]


def effects_columns(table: StudyTable, effects: Sequence[Effect]) -> Columns:
    """Return the effects as a table, results in the units that the study states."""
    rows: list[tuple[object, ...]] = []
    for each in effects:
        factor, head = find_stated_unit(table.study, each.measure)
        numbers = (factor * values for values in (each.mean, each.error, each.bar))
        of_groups = zip(each.at, *map(np.ndarray.tolist, numbers), each.count.tolist(), strict=True)
        rows += [(each.parameter, head, *group) for group in of_groups]
    names = ("parameter", "measure", "value", "mean", "standard_error", "error_bar", "scenes")
    return dict(zip(names, map(list, zip(*rows, strict=True)), strict=True))


@dataclass(frozen=True)
class Indices:
    """Sobol's indices of one measure, fractions of its variance (keys,), with confidence intervals (2, keys).

    Attributes:
        first: first-order indices, by each key alone.
        total: total indices, with all interactions of the key.
        blocks: number of complete rows of the two samples, in which every scene has results.
    """

    measure: str
    first: Array
    total: Array
    first_interval: Array
    total_interval: Array
    blocks: int


def sobol_indices(table: StudyTable) -> list[Indices]:
    """Return the indices of every measure, without blocks in which a scene has no result; none for other designs."""
    count, keys = table.study.number, len(table.parameters)
    if table.study.design != "sobol_indices" or count is None:
        return []
    indices = []
    for measure in varying_measures(table):
        blocks = table.values(measure).reshape(keys + 2, count)
        whole = np.isfinite(blocks).all(axis=0)
        if whole.sum() > 2:
            indices.append(saltelli(blocks[0, whole], blocks[1, whole], blocks[2:, whole], measure, table.study.seed))
    return indices


def saltelli(first: Array, second: Array, mixed: Array, measure: str = "", seed: int = 0) -> Indices:
    """Return the indices by a measure in two samples (n,), and in the first sample with each key in turn taken from the
    second (keys, n).

        S_i = mean(f_B (f_ABi - f_A))/V,  ST_i = mean((f_A - f_ABi)^2)/(2 V),

    f minus its mean, V the variance over both samples (Saltelli and others, Computer Physics Communications 181, 2010);
    intervals by bootstrap of the blocks (percentiles, `CONFIDENCE`).
    """
    samples = np.array([first, second, *mixed]) - np.mean([first, second])

    def indices(blocks: NDArray[np.int64], axis: int = -1) -> Array:
        """Return the indices (2 keys, ...) of resampled blocks (..., n)."""
        a, b, *others = samples[:, blocks]
        variance = np.var(np.concatenate([a, b], axis=-1), axis=-1)
        first_order = [np.mean(b * (ab - a), axis=-1) / variance for ab in others]
        total = [0.5 * np.mean((a - ab) ** 2, axis=-1) / variance for ab in others]
        return np.array([*first_order, *total])

    numbers, keys = np.arange(samples.shape[1]), len(mixed)
    values = indices(numbers)
    spread = scipy.stats.bootstrap(
        (numbers,), indices, n_resamples=RESAMPLES, confidence_level=CONFIDENCE, method="percentile",
        rng=np.random.default_rng(seed), vectorized=True,
    ).confidence_interval  # fmt: skip
    ends = np.array([spread.low, spread.high])
    return Indices(measure, values[:keys], values[keys:], ends[:, :keys], ends[:, keys:], len(numbers))


def indices_columns(table: StudyTable, indices: Sequence[Indices]) -> Columns:
    """Return the indices as a table."""
    names = ("first_order", "first_order_low", "first_order_high", "total", "total_low", "total_high")
    values = [(each.first, *each.first_interval, each.total, *each.total_interval) for each in indices]
    return {
        "measure": [each.measure for each in indices for _ in table.parameters],
        "parameter": [parameter for _ in indices for parameter in table.parameters],
        **{name: np.concatenate(each).tolist() for name, each in zip(names, zip(*values, strict=True), strict=True)},
        "blocks": [each.blocks for each in indices for _ in table.parameters],
    }


def drawn_rows(table: StudyTable) -> NDArray[np.bool_]:
    """Return (scenes,) flags of scenes drawn from the distributions; for "sobol_indices" the first two samples."""
    rows = np.full(len(table), table.study.is_drawn)
    if table.study.design == "sobol_indices" and table.study.number is not None:
        rows[2 * table.study.number :] = False
    return rows


@dataclass(frozen=True)
class Band:
    """Percentiles of a measure over the drawn scenes.

    Attributes:
        sample: sorted values of the measure.
        at: values at `PERCENTILES`.
        interval: (2, percentiles) confidence intervals by order statistics for independent scenes; nan for other
            designs, and for too few scenes.
        bar: largest numerical error bar of the scenes; nan if not known.
    """

    measure: str
    sample: Array
    at: Array
    interval: Array
    bar: float


def tolerance_bands(table: StudyTable) -> list[Band]:
    """Return the percentiles of every measure with at least `ENOUGH` drawn scenes."""
    bands = []
    for measure in varying_measures(table):
        values = table.values(measure)
        rows = drawn_rows(table) & np.isfinite(values)
        sample = np.sort(values[rows])
        if len(sample) < ENOUGH:
            continue
        interval = np.full((2, len(PERCENTILES)), np.nan)
        if table.study.design == "monte_carlo":
            tests: list[Any] = [scipy.stats.quantile_test(sample, p=share / 100) for share in PERCENTILES]
            interval = np.array([test.confidence_interval(CONFIDENCE) for test in tests], dtype=float).T
        bars = table.numbers(BAR + measure)[rows]
        bar = float(np.max(bars)) if np.isfinite(bars).all() else float("nan")
        bands.append(Band(measure, sample, np.percentile(sample, PERCENTILES), interval, bar))
    return bands


def bands_columns(table: StudyTable, bands: Sequence[Band]) -> Columns:
    """Return the bands as a table, results in the units that the study states."""
    factors, heads = zip(*(find_stated_unit(table.study, band.measure) for band in bands), strict=True)
    columns: dict[str, list[object]] = {"measure": list(heads), "scenes": [len(band.sample) for band in bands]}
    pairs = list(zip(factors, bands, strict=True))
    for k, share in enumerate(PERCENTILES):
        columns[f"p{share:g}"] = [factor * float(band.at[k]) for factor, band in pairs]
        columns[f"p{share:g}_low"] = [factor * float(band.interval[0, k]) for factor, band in pairs]
        columns[f"p{share:g}_high"] = [factor * float(band.interval[1, k]) for factor, band in pairs]
    return columns | {"largest_error_bar": [factor * band.bar for factor, band in pairs]}


def front(table: StudyTable) -> list[int]:
    """Return the rows on the Pareto front of outputs.pareto, sorted by its first measure; none if it is not stated."""
    if table.study.outputs.pareto is None:
        return []
    costs = [-table.values(name) if more else table.values(name) for name, more in objectives(table)]
    return list(pareto_front(costs[0].tolist(), costs[1].tolist()))


def pareto_front(costs: Sequence[float], errors: Sequence[float]) -> tuple[int, ...]:
    """Return the indices of the points that no other one dominates, by increasing cost.

    A point dominates another if it is at least as good in cost and error, and better in one of them; of equal points
    the first is returned. Points whose cost or error is not finite are ignored.
    """
    finite = [i for i in range(len(costs)) if math.isfinite(costs[i]) and math.isfinite(errors[i])]
    front: list[int] = []
    for i in sorted(finite, key=lambda i: (costs[i], errors[i], i)):
        if not front or errors[i] < errors[front[-1]]:
            front.append(i)
    return tuple(front)


def objectives(table: StudyTable) -> list[tuple[str, bool]]:
    """Return the measures of outputs.pareto, each with whether more is better."""
    return [(text.split()[-1], text.startswith("max ")) for text in table.study.outputs.pareto or ()]
