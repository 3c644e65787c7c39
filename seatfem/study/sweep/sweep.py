"""Runs of a study with a forecast, checks and a table of results, and optimisation over its scenes.

An optimisation searches at a loose accuracy, and confirms the best points at the scene's own.
"""

from __future__ import annotations

import json
import re
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from contextlib import nullcontext
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from pydantic import ValidationError

from impact.files.safe_files import write_whole
from impact.notices import Progress, Tell, ignore, silent
from impact.quantities import brief_value, in_time
from seatfem.jobs.folders import private_folder
from seatfem.machine import libraries, resources
from seatfem.machine.libraries import require_gmsh_libraries
from seatfem.results import LANDING_TIME, all_results, result_of
from seatfem.study.runs.forecast import Look, look_at
from seatfem.study.runs.pipeline import summarise_round
from seatfem.study.runs.round import Round
from seatfem.study.safety import MOST_ROUNDS
from seatfem.study.scene import Scene, SceneError, load_scene, located
from seatfem.study.scene.problems import explain, scene_error
from seatfem.study.scene.tables import path_from
from seatfem.study.scene.wings import assessments
from seatfem.study.sweep.best import Optimum, SearchStage, changes_at, goal_of, rank, search_best, violation
from seatfem.study.sweep.cases import Case, Cases, Changes, cases_of, with_bars
from seatfem.study.sweep.effort import USUAL, Effort
from seatfem.study.sweep.runner import STAGE, Outcome, Runner, StudyError, check_effort, crew_of, folder_of_ours
from seatfem.study.sweep.study import CONFIRMED, Study, load_study
from seatfem.study.sweep.table import (
    StudyTable,
    as_frame,
    assign_ways,
    check_measures,
    check_outcome,
    check_sampled,
    find_common_changes,
    in_stated_units,
    is_usable,
    measures_of,
    table_of,
    write_columns,
    write_parquet,
)

OF_SEARCH: Final = ("optimum.json", "optimum.csv", "search.csv")
"""Files of a search: the optimum, the confirmed points, all points."""


def run_optimum(
    study: Study,
    folder: Path,
    effort: Effort = USUAL,
    *,
    progress: Progress = silent,
    tell: Tell = ignore,
) -> Optimum:
    """Find the scene with the least or greatest measure within limits; write optimum.json, optimum.csv, search.csv.

    A third of the evaluations is a Latin hypercube, run in parallel; COBYQA starts from its best point. The optimum is
    run again at the scene's own target, the measures of the search are shifted by the differences, and the search
    continues, so that limits are met at the target, not at the loose accuracy. A stopped search is continued like
    `run_study`: it runs through the same scenes, with results from the journal; with ``effort.retry`` failed ones are
    computed again.

    Raises:
        SceneError, StudyError, OutputError, ClusterError: as in `run_study`; StudyError also if no scene has results.
    """
    workers, rounds = check_effort(effort), effort.rounds
    goal = goal_of(study)
    expected = ahead_of(study, rounds)
    centre = changes_at(study, (0.5,) * len(study.vary))
    scene = load_scene(study.scene, centre)
    if any(body.traits.needs_gmsh for body in scene.bodies.values()):
        require_gmsh_libraries()
    workers = workers or expected.workers()
    with folder_of_ours(folder) as journal, crew_of(workers, effort.cluster) as ask:
        tell(expected.in_words(workers))

        runner = Runner(study, journal, effort, partial(check_outcome, study))

        def carry_out(cases: Sequence[Case]) -> Mapping[str, Outcome]:
            outcomes = runner.carry_out(cases, ask)
            progress(STAGE, min(1.0, (len(search.found) + len(target.found) + 1) / (goal.most + CONFIRMED)))
            return outcomes

        search = SearchStage(study, Cases(study, rounds), _coarse(study), carry_out)
        target = SearchStage(study, Cases(study, rounds), with_bars(study, centre), carry_out)
        search_best(search, target, goal)
    confirmed = sorted(target.found.values(), key=lambda each: (violation(each, goal), rank(each, goal, {})[1]))
    optimum = Optimum(study, tuple(search.found.values()), tuple(confirmed))
    for name, points in zip(OF_SEARCH[1:], (optimum.confirmed, optimum.searched), strict=True):
        write_columns(folder / name, in_stated_units(study, optimum.table(points).columns))
    write_whole(folder / OF_SEARCH[0], (json.dumps(optimum.as_json(), indent=1) + "\n").encode("utf-8"))
    return optimum


def optimise(
    study: Path | str,
    folder: Path | str | None = None,
    *,
    workers: int = 1,
    rounds: int = MOST_ROUNDS,
    cluster: str = "",
) -> Optimum:
    """Find the best scene of a study file with a table [optimise] (docs/studies.md).

        found = seatfem.optimise("study.toml"); found.in_words(); found.as_json()["keys"]

    ``folder``: folder of the journal, from which a stopped search continues, and of the tables; by default temporary.
    ``cluster``: address of a dask scheduler (docs/cluster.md), in place of ``workers``. Raises like `run_optimum`.
    """
    with private_folder("study") if folder is None else nullcontext(Path(folder)) as place:
        effort = Effort(None if cluster else workers, rounds, cluster=cluster)
        return run_optimum(load_study(study), place, effort)


@dataclass(frozen=True)
class SearchAhead:
    """Expected time of the search and of the confirmation of an optimisation."""

    search: Ahead
    target: Ahead

    def workers(self) -> int:
        """Return the number of workers that both can use."""
        return min(self.search.workers(), self.target.workers())

    def as_json(self) -> str:
        """Return both as JSON, with the total time for one worker, as scenes depend on previous ones."""
        parts = {"search": json.loads(self.search.as_json()), "confirmation": json.loads(self.target.as_json())}
        return json.dumps({**parts, "time_s": self.search.seconds() + self.target.seconds()}, indent=1)

    def in_words(self, workers: int) -> str:
        """Return the forecast in one line."""
        return f"search: at most {self.search.in_words(1)}; then at the target: {self.target.in_words(1)}"


def ahead_of(study: Study, rounds: int = MOST_ROUNDS) -> SearchAhead:
    """Return the forecast for a study with [optimise], by looks at its lowest, middle and highest values. Raises
    `SceneError`."""
    goal = goal_of(study)
    points = [(share,) * len(study.vary) for share in (0.0, 0.5, 1.0)]

    def price(accuracy: Changes, scenes: int) -> Ahead:
        cases = cases_of(study, rounds, [{**changes_at(study, point), **accuracy} for point in points])
        forecast = ahead(study, cases)
        return replace(forecast, scenes=scenes, seats=scenes if forecast.seats > 1 else forecast.seats)

    centre = changes_at(study, points[1])
    target = price(with_bars(study, centre), CONFIRMED)  # first, as its messages are about the scene itself
    finest = load_scene(study.scene, centre).accuracy.target
    if goal.coarse < finest:
        words = f"{goal.coarse:g} is finer than the scene's accuracy.target, {finest:g}; raise one or lower the other"
        raise study.located(scene_error("optimise.coarse", words))
    return SearchAhead(price(_coarse(study), goal.most), target)


def _coarse(study: Study) -> Changes:
    centre = changes_at(study, (0.5,) * len(study.vary))
    scene = load_scene(study.scene, {**centre, **with_bars(study, centre)})
    return {"accuracy": {"target": goal_of(study).coarse, "measures": list(scene.accuracy.measures)}}


LOOKED_AT: Final = 1000  # number of scenes of a larger study that are checked before its time is foretold
SAMPLED: Final = 3  # number of scenes that are looked at: the first, the last and the middle
LOOK: Final = 1.0  # wall time of a look at one of them [s]
START: Final = 2.0  # start of the program, from the command to the first stage [s]
MEMORY: Final = 0.8  # fraction of the available memory that workers use, as their need is measured on few scenes
LANE: Final = 0.02  # time of a scene integrated in parallel with others, over that of a single one with its error bars
CARRIED: Final = 0.3  # the same of a scene run by itself without error bars
LOOKED_LONG: Final = 5.0  # wall time after which no further one of them is looked at [s]


@dataclass(frozen=True)
class Ahead:
    """Time and memory of a study, expected from a look at a few scenes.

    Attributes:
        scenes, seats: number of scenes to run in full, and of different seats among them.
        start: start of the program [s].
        each, seat: time of one scene without its seat, and of a new seat [s].
        memory: largest memory of a worker [bytes].
        beside: number of scenes without error bars of their own; ``lane``: time of one of them [s].
        looked_at: number of scenes from which all are extrapolated; 0: all were checked.
    """

    scenes: int
    seats: int
    start: float
    each: float
    seat: float
    memory: float
    beside: int = 0
    lane: float = 0.0
    looked_at: int = 0

    def seconds(self, workers: int = 1) -> float:
        """Return the wall time [s]: seats are computed one after the other, scenes are divided among the workers."""
        shared = self.scenes * self.each + self.beside * self.lane
        return self.start + self.seats * self.seat + shared / max(1, min(workers, self.scenes + self.beside))

    def workers(self) -> int:
        """Return the number of workers: one per core, or fewer if the available memory is not sufficient."""
        return max(1, min(resources.cores(), int(MEMORY * resources.available_memory() / self.memory)))

    def as_json(self) -> str:
        """Return the forecast as JSON, with the number of workers and the wall time."""
        workers = self.workers()
        return json.dumps({**asdict(self), "workers": workers, "time_s": self.seconds(workers)}, indent=1)

    def in_words(self, workers: int) -> str:
        """Return the forecast in one line."""
        seats = f" with {self.seats} seat{'s'[: self.seats > 1]} to compute" if self.seats else ""
        a_seat = f" {in_time(self.seat)} a seat," if self.seats else ""
        beside = f" and {self.beside} with the error bars of these" if self.beside else ""
        counted = f"{self.scenes} scene{'s'[: self.scenes > 1]}{beside}{seats}"
        return (
            f"{counted}: about {in_time(self.seconds(workers))} expected with {workers} worker{'s'[: workers > 1]} "
            f"({in_time(self.each)} a scene,{a_seat} {self.memory / 1e9:.2g} GB a worker)"
            + (f"; based on {self.looked_at} scenes, drawn at random" if self.looked_at else "")
        )


def ahead_of_many(study: Study) -> Ahead:
    """Return the forecast for a study of more than `LOOKED_AT` scenes, from a random sample of that size.

    Raises `SceneError` for errors of the sampled scenes, and the errors of `ahead`.
    """
    count = study.number_of_scenes
    drawn = np.random.default_rng(study.seed).choice(count, LOOKED_AT, replace=False) + 1
    cases = cases_of(study, numbers=frozenset(drawn.tolist()))
    sample = ahead(study, cases)
    times = count / len(cases) if 2 * sample.seats > len(cases) else 1.0  # if few, all seats are in the sample
    return replace(sample, scenes=count, seats=round(times * sample.seats), looked_at=len(cases))


def ahead(study: Study, cases: Sequence[Case]) -> Ahead:
    """Return the forecast for these cases of a study. If none of the sampled scenes can be run, raises the error of the
    first; errors of single scenes are reported in the table. Raises `StudyError` for a measure that summary.json will
    not have."""
    start, last = time.perf_counter(), len(cases) - 1
    looks: list[Look] = []
    problems: list[Exception] = []
    for place in sorted({0, last, last // 2}, key=(0, last, last // 2).index)[:SAMPLED]:
        if looks and time.perf_counter() - start > LOOKED_LONG:
            break
        try:
            looks.append(look_at(load_scene(study.scene, cases[place].changed), LOOK))
        except SceneError as error:
            problems.append(located(error, study.scene))
        except (ArithmeticError, LookupError, MemoryError, OSError, RuntimeError, ValueError) as error:
            problems.append(error)
    if not looks:
        raise problems[0]
    _check_asked(study, [look.done for look in looks])
    seat = max(look.left.seat for look in looks)
    each = sum(look.left.contact for look in looks) / len(looks)
    different = sum(not case.guides for case in cases) if seat > 0 else 0
    ways = Counter(case.way for case in cases)
    lighter = ways["beside"] + ways["carried"]
    light = (LANE * ways["beside"] + CARRIED * ways["carried"]) / max(1, lighter)
    memory = max(look.done.memory for look in looks)
    return Ahead(len(cases) - lighter, different, START, each, seat, memory, lighter, light * each)


OF_A_LANDING: Final = re.compile("(error_|first_landing_|known_|growth_per_landing|peak_reed_stress_over_)")
"""Beginnings of keys that only a scene with a landing has."""
AFTERWARDS: Final = ("gauge", "peak_gauge", "peak_seat", "peak_reed")
"""Beginnings of keys that stress and gauges add after the last round."""


def _check_asked(study: Study, looks: Sequence[Round]) -> None:
    """Raise `StudyError` for a measure that no result is called, and that the summary of the first look with a landing
    does not have either."""
    if not study.asked:
        return
    landed = (each for each in looks if each.touches.landings.seat)
    done = next(landed, looks[0])
    numbers, scene = summarise_round(done)[0], done.plan.scene
    more = any((scene.assessments, scene.stress, scene.gauge))
    beginnings = "|".join([*AFTERWARDS, *(each.table for each in assessments())])
    afterwards = re.compile(f"(spring_|error_bar_)?(landing_)?({beginnings})_")
    assessed = {row.key for each in assessments() for row in each.rows}

    def may_come(name: str) -> bool:
        shown = name in all_results() and name not in assessed and result_of(name).group != "seat"
        later = (more, afterwards), (numbers.get(LANDING_TIME) is None, OF_A_LANDING)
        return shown or any(may and names.match(name) for may, names in later)

    check_measures(study, numbers, may_come)


TABLE: Final = "study.csv"
PARQUET: Final = "study.parquet"
Measures = tuple[str, ...]


def run_study(
    study: Study,
    folder: Path,
    effort: Effort = USUAL,
    *,
    progress: Progress = silent,
    tell: Tell = ignore,
) -> StudyTable:
    """Run every scene of a study, and write its table to study.csv (and study.parquet with pyarrow).

    Each outcome is appended to a journal in ``folder`` and reused from there, so that a stopped study continues with
    the same results. Scenes that fail are in the table with their message.

    Args:
        effort: number of workers, and limits of each scene.
        tell: function that receives the number of scenes and the forecast as text.

    Raises:
        SceneError: errors of the scenes, before anything runs.
        StudyError: measures that no summary has, another sweep in the folder, options out of range, an installed
            optional package for tables that cannot be imported.
        OutputError: ``folder`` cannot be written to. Also the errors of plans.
        ClusterError: errors of the cluster.
    """
    workers = check_effort(effort)
    is_usable("pyarrow")  # fail now rather than after the last scene
    if study.optimise is not None:
        words = "this study asks for one best scene; run it by seatfem optimise, or remove the table"
        raise StudyError(f"optimise: {words}")
    if study.number_of_scenes > LOOKED_AT and study.error_bars == "every":
        expected = ahead_of_many(study)
        tell(expected.in_words(workers or expected.workers()))
    cases, scene, measures = scenes_of(study, effort.rounds, progress)
    if any(body.traits.needs_gmsh for body in scene.bodies.values()):
        libraries.require_gmsh_libraries()
    with folder_of_ours(folder) as journal:
        runner = Runner(study, journal, effort, partial(check_outcome, study))
        if pending := runner.pending(cases):
            expected = ahead(study, pending)
            workers = workers or expected.workers()
            tell(expected.in_words(workers))
        if any(case.key in runner.known for case in cases):
            tell(f"{len(cases) - len(pending)} of {len(cases)} scenes are in {journal} already")
        with crew_of(workers or 1, effort.cluster) as ask:
            outcomes = runner.carry_out(cases, ask, progress)
        table = table_of(study, cases, outcomes, measures)
        write_columns(folder / TABLE, in_stated_units(study, table.columns))
        write_parquet(folder / PARQUET, in_stated_units(study, table.columns))
    return table


def scenes_of(
    study: Study, rounds: int = MOST_ROUNDS, progress: Progress = silent
) -> tuple[list[Case], Scene, Measures]:
    """Return the cases of a study as they will be run, the first scene, and the measures.

    Raises `SceneError` for errors of the scenes.
    """
    cases = cases_of(study, rounds, progress=progress)
    scene = load_scene(study.scene, cases[0].changed)
    measures = measures_of(study, scene.accuracy.judged)
    if study.error_bars == "every":
        return cases, scene, measures
    try:
        in_parallel = check_sampled(study, scene, measures)
        changes = [{**each.changed, **find_common_changes(scene, in_parallel=in_parallel)} for each in cases]
        cases = cases_of(study, rounds, changes)
    except SceneError as error:
        raise study.located(error) from None
    return assign_ways(study, cases, measures, in_parallel=in_parallel), scene, measures


def sweep(
    scene: Path | str,
    vary: Mapping[str, object],
    *,
    design: str = "grid",
    number: int | None = None,
    seed: int = 1,
    limit: int = 10_000,
    measures: Sequence[str] | str = (),
    below: Mapping[str, str | float] = MappingProxyType({}),
    above: Mapping[str, str | float] = MappingProxyType({}),
    units: Mapping[str, str] = MappingProxyType({}),
    error_bars: str = "every",
    folder: Path | str | None = None,
    workers: int = 1,
    rounds: int = MOST_ROUNDS,
    cluster: str = "",
    progress: Progress = silent,
) -> Any:
    """Run a study; return its table as a pandas DataFrame or, without pandas, as lists by name of the column.

        seatfem.sweep("scene.toml", {"contact.gap": ["0 mm", "0.1 mm"], "reed.n_modes": [10, 20]})

    Args:
        scene: scene file.
        vary: dotted key -> list of values as in a scene file, or a table as in [vary] (docs/studies.md).
        design: "grid", "zip", "latin_hypercube", "sobol", "monte_carlo" or "sobol_indices".
        number, seed: number of scenes to draw, and seed.
        limit: largest number of scenes allowed.
        measures: keys of summary.json; by default those of the scene's accuracy.measures.
        below, above: largest and smallest value allowed by key, "350 MPa"; then the column "verdict" says of each scene
            whether it holds, does not hold, or is undecided within the error bar.
        units: unit by key, "MPa", of its column, which is then called by it: "landing_peak_reed_stress [MPa]".
        error_bars: "every", or "sampled" for scenes that differ in contact data only.
        folder: folder of the journal, from which a stopped study continues, and of study.csv; by default temporary.
        workers: number of processes.
        rounds: largest number of refinement rounds of each scene.
        cluster: address of a dask scheduler (docs/cluster.md), in place of ``workers``.

    Returns:
        One row per scene: "scene" (its number), varied keys, the measures [SI] and their error bars, "landing_status"
        (landed, no landing, cut off, never opened), "status" (done, missed, stopped, failed), "wall_time_s", "message",
        "notes" (of the run, divided by " | ").

    Raises `SceneError`, `StudyError`, `OutputError` as `run_study`.
    """
    if not isinstance(vary, Mapping):
        words = "must map dotted keys to lists of values: write {'reed.thickness': ['0.2 mm', '0.3 mm']}"
        raise scene_error("vary", f"{brief_value(vary)} {words}")
    values = {key: each.tolist() if isinstance(each, np.ndarray) else each for key, each in vary.items()}
    content = {"scene": str(path_from(scene)), "vary": values, "design": design, "seed": seed, "limit": limit}
    content |= {"below": dict(below), "above": dict(above), "units": dict(units), "error_bars": error_bars}
    content |= {"outputs": {"measures": [measures] if isinstance(measures, str) else list(measures)}}
    content |= {} if number is None else {"number": number}
    try:
        study = Study.model_validate(content, context={"folder": Path()})
    except ValidationError as error:
        raise SceneError(explain(error, Study, content, Path(scene), {})) from None
    for package in ("pyarrow", "pandas"):  # pandas imports pyarrow
        is_usable(package)
    with private_folder("study") if folder is None else nullcontext(Path(folder)) as place:
        effort = Effort(None if cluster else workers, rounds, cluster=cluster)
        table = run_study(study, place, effort, progress=progress)
        return as_frame(in_stated_units(study, table.columns))
