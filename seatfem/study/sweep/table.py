"""Table of a study, one row per scene, and error bars of scenes that are computed without a full run.

The first scenes determine the method for all, at a target of `TIGHTER` times the scene's own. A sample runs in full
with this method, in one round: the extremes of every key, the scenes nearest to the corners of the design, and others
at equal distances in its order. The sample is chosen by the values of the keys only. For each measure, the largest
relative error bar of the sample times `SAFETY` is that of the other scenes. For a random sample of n scenes, another
scene has a larger error bar than all of them with the probability 1/(n + 1); `SAFETY` allows for a sample that is not
random.
"""

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from importlib import import_module
from importlib.util import find_spec
from itertools import islice, product
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from impact.files import csv_table, safe_files
from impact.names import how_to_mend
from impact.quantities import brief
from seatfem import readings, results
from seatfem.readings import BAR
from seatfem.study.impacts.landings import LANDED, STATUS, has_landed, left_out_in_words, needs_landing
from seatfem.study.impacts.touches import OF_A_LANDING
from seatfem.study.method import PORTS, RINGS, is_given
from seatfem.study.scene import Scene
from seatfem.study.scene.measures import PREFIXES, Measure, Restitution, all_measures, key_of
from seatfem.study.scene.problems import scene_error
from seatfem.study.sweep.cases import Case, Changes, columns_of, key_of_case
from seatfem.study.sweep.limits import VERDICT, Constraint, nearest, verdict_of
from seatfem.study.sweep.runner import NOTES, Outcome, StudyError
from seatfem.study.sweep.study import CONTACT_DATA, Study
from seatfem.study.sweep.variations import Listed

Columns = Mapping[str, Sequence[object]]
MODULES: Final[Mapping[str, str]] = {"pandas": "pandas", "pyarrow": "pyarrow.parquet"}
"""Module by which each optional package for tables is tested for import."""


@dataclass(frozen=True)
class StudyTable:
    """Table of the results of a study.

    Attributes:
        study: the study.
        parameters: names of columns of varied keys, as "reed.thickness [mm]", in the order of the study.
        measures: names of columns of measures [SI]; their error bars, if any, are columns "error_bar_" + name.
        columns: all columns by name, one value per scene; ``None`` for no value.

    Means and all other evaluations of the table refer to `counted` scenes.
    """

    study: Study
    parameters: tuple[str, ...]
    measures: tuple[str, ...]
    columns: Columns

    __repr__ = brief

    def __len__(self) -> int:
        return len(self.columns["scene"])

    def numbers(self, name: str) -> NDArray[np.float64]:
        """Return a column as numbers (scenes,); nan for other values."""
        values = self.columns.get(name, [None] * len(self))
        return np.array([float(v) if isinstance(v, int | float) else np.nan for v in values])

    def counted(self, name: str) -> NDArray[np.bool_]:
        """Return (scenes,) flags of scenes that count for a measure: with results, and a landing if it needs one."""
        return self.has_numbers & self.has_landed if needs_landing(name) else self.has_numbers

    def values(self, name: str) -> NDArray[np.float64]:
        """Return the values of a measure (scenes,); nan for scenes that do not count."""
        return np.where(self.counted(name), self.numbers(name), np.nan)

    def is_text(self, name: str) -> bool:
        """Return whether a column contains names."""
        return any(isinstance(value, str) for value in self.columns[name])

    @cached_property
    def has_numbers(self) -> NDArray[np.bool_]:
        """Return (scenes,) flags of scenes with results."""
        return np.array([state in ("done", "missed") for state in self.columns["status"]])

    @cached_property
    def has_landed(self) -> NDArray[np.bool_]:
        """Return (scenes,) flags of scenes with a landing on the seat that is complete within the run."""
        return np.array([status in (None, LANDED) for status in self.columns.get(STATUS, [None] * len(self))])

    @property
    def left_out(self) -> NDArray[np.bool_]:
        """Return (scenes,) flags of scenes with results that do not count for some measure of the study."""
        return self.has_numbers & ~self.has_landed & any(map(needs_landing, self.measures))

    def left_out_in_words(self) -> str:
        """Return as text how many scenes are ignored because they did not land or were cut off; "" if none."""
        if not self.left_out.any():
            return ""
        statuses = zip(self.columns[STATUS], self.left_out, strict=True)
        return left_out_in_words(status if is_left_out else LANDED for status, is_left_out in statuses)

    @cached_property
    def standings(self) -> list[str]:
        """Return for each scene the status of its landing, or, of a scene without numbers, its state."""
        statuses = self.columns.get(STATUS, [LANDED] * len(self))
        rows = zip(self.columns["status"], self.has_numbers, statuses, strict=True)
        return [str(status or LANDED) if has_numbers else str(state) for state, has_numbers, status in rows]

    def unanswered(self) -> tuple[str, ...]:
        """Return the measures that are empty in all scenes that count for them."""
        return tuple(name for name in self.measures if self.has_numbers.any() and not self._has_value(name).any())

    def empty_in_words(self) -> list[str]:
        """Return lines on the measures that are missing, and in how many of the scenes that count for them."""
        lines = []
        for name in self.measures:
            counted = self.counted(name)
            empty, count = int((counted & ~self._has_value(name)).sum()), int(counted.sum())
            if name in self.unanswered():
                lines.append(f"{name}: no scene has it" + (f", of {count} that landed" if count else ": none landed"))
            elif empty:
                lines.append(f"{name}: empty in {empty} of {count} scenes that count for it")
        return lines

    def _has_value(self, name: str) -> NDArray[np.bool_]:
        """Return (scenes,) flags of scenes that count for a measure and have a value of it."""
        has_value = np.array([value is not None for value in self.columns[name]], dtype=np.bool_)
        return np.asarray(self.counted(name) & has_value)

    def failures(self) -> list[str]:
        """Return a line on each scene without numbers, with the reason."""
        rows = zip(*(self.columns[name] for name in ("scene", "status", "message", *self.parameters)), strict=True)
        return [
            f"scene {number} ({', '.join(f'{key} = {v}' for key, v in zip(self.parameters, row, strict=True))}): "
            f"{state}: {message}"
            for number, state, message, *row in rows
            if state not in ("done", "missed")
        ]


def measures_of(study: Study, judged: Sequence[str]) -> tuple[str, ...]:
    """Return the keys of summary.json in the study's outputs and limits; if it states no outputs, those of the measures
    ``judged`` in the first scene take their place."""
    usual = () if study.outputs.measures else tuple(map(key_of, judged))
    limited = (each.measure for each in study.stated_limits)
    return tuple(dict.fromkeys((*usual, *study.outputs.asked(), *limited)))


def check_outcome(study: Study, outcome: Outcome) -> None:
    """Raise `StudyError` for a measure that a scene's summary lacks, unless the scene did not land."""
    if outcome.has_numbers and has_landed(outcome.summary):
        check_measures(study, outcome.summary)


TABLES: Final = {"life": "[life]", "seat": "[stress]"}
"""Tables of a scene by the group of the results that they add."""


def check_measures(
    study: Study, numbers: Mapping[str, object], may_come: Callable[[str], bool] = lambda name: False
) -> None:
    """Raise `StudyError` for a measure of the study that the ``numbers`` of a scene lack, unless a later stage of the
    run adds it, as ``may_come`` returns."""
    for key, name in study.asked:
        no_number = list | dict if key.startswith("outputs.") else list | dict | str
        if (name not in numbers or isinstance(numbers[name], no_number)) and not may_come(name):
            close = [f"state {' or '.join(map(repr, keys))}" for keys in [nearest(name, numbers)] if keys]
            table = TABLES.get(results.result_of(name).group, "") if name in results.all_results() else ""
            remedy = f"add {table} to the scene" if table else (close or ["state a key of summary.json of a run"])[0]
            raise StudyError(f"{key}: summary.json of these scenes has no single value {name!r}; {remedy}")


def table_of(study: Study, cases: list[Case], outcomes: Mapping[str, Outcome], measures: Sequence[str]) -> StudyTable:
    """Return the table, one row for each case."""
    if study.error_bars == "sampled":
        outcomes = add_sampled_bars(cases, outcomes, measures)
    results = [outcomes[case.key] for case in cases]
    parameters = columns_of(cases, study)
    columns: dict[str, list[object]] = {"scene": [case.number for case in cases], **parameters}
    for name in measures:
        columns[name] = [outcome.summary.get(name) for outcome in results]
        bars: list[object] = [outcome.summary.get(BAR + name) for outcome in results]
        if any(bar is not None for bar in bars):
            columns[BAR + name] = bars
    columns |= _verdicts(study.limits, results)
    if study.error_bars == "sampled":
        columns["error_bars"] = ["own" if has_full_run(outcome) else "sampled" for outcome in results]
    if any(STATUS in outcome.summary for outcome in results):
        columns[STATUS] = [outcome.summary.get(STATUS) for outcome in results]
    columns["status"] = [outcome.state for outcome in results]
    columns["wall_time_s"] = [outcome.wall for outcome in results]
    columns["message"] = [" ".join(outcome.message.split()) for outcome in results]
    columns[NOTES] = [" ".join(str(outcome.summary.get(NOTES) or "").split()) for outcome in results]
    return StudyTable(study, tuple(parameters), tuple(measures), columns)


def _verdicts(limits: Sequence[Constraint], outcomes: Sequence[Outcome]) -> dict[str, list[object]]:
    """Return the column `VERDICT`, whether each scene is within all limits, and a column for each of several limits."""
    on_each = {
        f"{VERDICT}: {limit}": [
            limit.verdict(outcome.summary) if outcome.has_numbers else outcome.state for outcome in outcomes
        ]
        for limit in limits
    }
    columns: dict[str, list[object]] = {VERDICT: list(map(verdict_of, zip(*on_each.values(), strict=True)))}
    return {} if not limits else columns if len(limits) == 1 else columns | {k: [*v] for k, v in on_each.items()}


def find_stated_unit(study: Study, name: str) -> tuple[float, str]:
    """Return the factor to the unit that the study states for a column, and the column's head with this unit, such as
    "landing_impulse [mN s]"; without a stated unit, 1 and the name."""
    if (scale := study.scale(name)) is None:
        return 1.0, name
    return scale[0], f"{name.removesuffix(readings.ending_of(name))} [{scale[1]}]"


def in_stated_units(study: Study, columns: Columns) -> Columns:
    """Return the columns with results in the units that the study states, as they are written to files."""
    heads = {name: find_stated_unit(study, name) for name in columns}
    return {
        head: values if factor == 1.0 else [factor * v if isinstance(v, int | float) else v for v in values]
        for (factor, head), values in zip(heads.values(), columns.values(), strict=True)
    }


def write_columns(path: Path, columns: Columns) -> None:
    """Write columns as CSV, with all digits of every number and empty fields for ``None``; no partial file remains."""
    csv_table.write_csv(path, columns, zip(*columns.values(), strict=True))


def is_usable(package: str) -> bool:
    """Return whether a package of the extra "tables" is installed.

    Raises `StudyError` if it is installed but cannot be imported; studies check this before their first scene.
    """
    if find_spec(package) is None:
        return False
    try:
        import_module(MODULES[package])
    except Exception as error:  # a broken package may raise any error
        remedy = f"{how_to_mend(package, 'tables', error)}, or go without: pip uninstall {package}"
        raise StudyError(f"tables of studies: {remedy}") from error
    return True


def write_parquet(path: Path, columns: Columns) -> bool:
    """Write the columns as a complete Parquet file if pyarrow is installed; return whether it is."""
    if not is_usable("pyarrow"):
        return False
    import pyarrow
    import pyarrow.parquet

    with safe_files.whole_file(path) as temporary:
        pyarrow.parquet.write_table(pyarrow.table({name: list(column) for name, column in columns.items()}), temporary)
    return True


def as_frame(columns: Columns) -> Any:
    """Return a pandas DataFrame if pandas is installed, else the columns."""
    if not is_usable("pandas"):
        return columns
    import pandas

    return pandas.DataFrame(columns)


SAFETY: Final = 1.25  # error bar of the other scenes over the largest of the sample
TIGHTER: Final = 0.6  # target of the sample over accuracy.target, so that SAFETY times its bars meet accuracy.target
LEAST: Final = 24  # least number of scenes of the sample that are evenly spaced in the design
TENTH: Final = 10  # scenes of the study for each of these, if the others are not integrated in parallel
CORNERS: Final = 32  # largest number of scenes of the sample that are nearest to corners
STRESSES: Final = ("peak_reed_stress", "peak_reed_stress_after_contact", "initial_reed_stress")
STRESS: Final = (
    *(f"{name}_{what}" for name in STRESSES for what in ("Pa", "at_m", "time_s")),
    results.REED_STRESS_AT_START,
    results.REED_STRESS_BEFORE_LANDING,
)
OTHERS: Final = (results.RAW_PEAK, results.FIRST_CONTACT, results.CONTACTS)
OF_LANDINGS: Final = (STATUS, *(f"landing_{key}" for key in (*OF_A_LANDING.values(), results.STATIC, "count")))
PRESSED_ON: Final = ("pressed_on_time_s", "pressed_on_largest_load_N")


def find_common_changes(scene: Scene, *, in_parallel: bool) -> Changes:
    """Return the changes of all scenes of a study with sampled error bars: a stricter target, and one port if scenes
    are integrated in parallel."""
    one_port = {RINGS: scene.seat.elastic is not None, PORTS: scene.geometry.lip() is not None} if in_parallel else {}
    ports = {key: 1 for key, applies in one_port.items() if applies and not is_given(scene, key)}
    return {"accuracy.target": TIGHTER * scene.accuracy.target, **ports}


def assign_ways(study: Study, cases: list[Case], measures: Sequence[str], *, in_parallel: bool) -> list[Case]:
    """Return the cases with the way in which each is computed (`Case.way`): the first ones refined by the loop, the
    sample in one round, the others integrated in parallel or run one by one without error bars."""
    sample = _choose_sample(study, cases, LEAST if in_parallel else max(LEAST, -(-len(cases) // TENTH)))
    needs = _find_needed_histories(measures) if in_parallel else ()

    def assign_way(place: int, case: Case) -> Case:
        if case.leads:
            return case
        if place in sample:
            return replace(case, key=key_of_case(case, "sample"), way="sample")
        if in_parallel:
            return replace(case, key=key_of_case(case, "beside", *needs), way="beside", needs=needs)
        return replace(case, key=key_of_case(case, "carried"), way="carried")

    return [assign_way(place, case) for place, case in enumerate(cases)]


def _find_needed_histories(measures: Sequence[str]) -> tuple[str, ...]:
    """Return the names of the histories that these keys of summary.json need in addition to the force."""
    needs: dict[str, set[str]] = {"displacement": set(), "stress": {*STRESS}}
    for name, keys in needs.items():
        keys |= {key for each in all_measures().values() if name in each.data for key in _find_keys(each)}
    return tuple(name for name, keys in needs.items() if keys & set(measures))


def _find_keys(measure: Measure) -> tuple[str, ...]:
    """Return the keys of a measure in summary.json: of the run, of the hardest and of the first landing."""
    return tuple(key_of(prefix + measure.name) for prefix in PREFIXES.values() if not prefix or measure.landing_key)


def _choose_sample(study: Study, cases: list[Case], even: int) -> set[int]:
    """Return the indices of the scenes of the sample; ``even``: number of those that are evenly spaced."""
    columns = columns_of(cases, study).values()
    numbers = [
        np.unique(np.array(column, dtype=str), return_inverse=True)[1].astype(float)
        if isinstance(column[0], str)
        else np.array(column, float)
        for column in columns
    ]
    unit = np.array([(n - n.min()) / np.ptp(n) for n in numbers if np.ptp(n) > 0]).reshape(-1, len(cases))
    places = {int(place) for place in np.linspace(0, len(cases) - 1, even).round()}
    for key in unit:
        places |= {int(key.argmin()), int(key.argmax())}
    corners = islice(product((0.0, 1.0), repeat=len(unit)), CORNERS)
    return places | {int(np.abs(unit.T - corner).max(axis=1).argmin()) for corner in corners if corner}


def has_full_run(outcome: Outcome) -> bool:
    """Return whether a scene was run in full, or has no numbers."""
    return "accuracy_met" in outcome.summary or not outcome.has_numbers


def add_sampled_bars(
    cases: Sequence[Case], outcomes: Mapping[str, Outcome], measures: Sequence[str]
) -> dict[str, Outcome]:
    """Return the outcomes, with error bars by the sample for scenes that were not run in full, and with their states by
    the scene's target.

    A measure that is zero, and a scene without a complete landing, have no error bar and no target, as the sample has
    none like them. If a scene of the sample failed or has no error bar, the other scenes have none and miss the target.
    """
    full = [outcomes[case.key].summary for case in cases if has_full_run(outcomes[case.key])]
    sample = [each for case in cases if case.way == "sample" and has_landed(each := outcomes[case.key].summary)]
    first = next((summary for summary in full if "accuracy_target" in summary), {})
    keys = str(first.get("accuracy_judged_keys", "")).split(", ")
    target = float(first.get("accuracy_target") or math.inf) / TIGHTER
    shares = {name: [_share(each, name) for each in sample if each.get(name)] for name in {*measures, *keys}}
    lost = [case.number for case in cases if case.way == "sample" and not outcomes[case.key].has_numbers]
    largest = {name: SAFETY * max(r) for name, r in shares.items() if not lost and r and max(r) < math.inf}

    def add_bars(outcome: Outcome) -> Outcome:
        summary = dict(outcome.summary)
        if not outcome.has_numbers or not (has_full_run(outcome) or has_landed(summary)):
            return outcome
        if not has_full_run(outcome):
            values = {name: summary.get(name) for name in largest}
            summary |= {BAR + k: largest[k] * abs(v) for k, v in values.items() if isinstance(v, int | float) and v}
        above = {name: share for name in keys if target < (share := _share(summary, name)) < math.inf}
        unknown = [name for name in keys if summary.get(name) and summary.get(BAR + name) is None]
        if unknown:
            which = f"scene {lost[0]} of the sample was not carried out" if lost else "one of the sample has none"
            why = f"{unknown[0]} has no error bar, as {which}; leave error_bars out"
            return replace(outcome, state="missed", message=why, summary=summary)
        if not above:
            message = outcome.message if outcome.state == "done" else ""
            return replace(outcome, state="done", message=message, summary=summary)
        name = max(above, key=lambda each: above[each])
        why = f"{name} has an error bar of {above[name]:.2g}, above accuracy.target = {target:g}; leave error_bars out"
        return replace(outcome, state="missed", message=why, summary=summary)

    return {case.key: add_bars(outcomes[case.key]) for case in cases}


def _share(summary: Mapping[str, object], name: str) -> float:
    """Return the relative error bar of a value; infinite if it is not known."""
    value, bar = summary.get(name), summary.get(BAR + name)
    known = isinstance(value, int | float) and isinstance(bar, int | float)
    return abs(float(bar) / float(value)) if known and value else math.inf  # type: ignore[arg-type]


FULL: Final = re.compile(
    "(error_bar_)?((first_)?landing_)?(spring_|regime_|life_|peak_seat_|peak_gauge|error_|accuracy_|plan_|greens_|known_|"
    "ensemble_|growth_|without_film_|one_port_|beam_|seat_)"
)
"""Pattern of the beginnings of keys that only a full run has."""


def check_sampled(study: Study, scene: Scene, measures: Sequence[str]) -> bool:
    """Return whether scenes of a study can be integrated in parallel, that is, whether they differ in contact data only
    and their contact is a single point; otherwise they are run one by one. Raises `SceneError` for measures that need a
    full run."""
    for name in filter(FULL.match, measures):
        text = f"{name!r} takes a run in full: leave error_bars out, or ask for other measures"
        raise scene_error("outputs.measures", text)
    varied = {key for key, each in study.vary.items() if not (isinstance(each, Listed) and len(each.values) == 1)}
    forbidden = (
        varied - {*CONTACT_DATA},
        scene.driven_by,
        scene.spring,
        scene.stopper is not None,
        scene.contact.film is not None,
        scene.contact.preload,
        is_given(scene, RINGS) and scene.contact.rings not in (None, 1),
        is_given(scene, PORTS) and scene.contact.ports not in (None, 1),
    )
    keys = {key for each in all_measures().values() if "line" not in each.data for key in _find_keys(each)}
    keys = (keys | {*STRESS, *OTHERS, *OF_LANDINGS, *PRESSED_ON}) - {Restitution.key}  # needs all energies
    return not any(forbidden) and keys.issuperset(measures)
