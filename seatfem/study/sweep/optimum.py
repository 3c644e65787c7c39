"""Optimisation over the scenes of a study: search at a loose accuracy, confirmation at the scene's own."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from impact.files.safe_files import write_whole
from impact.notices import Progress, Tell, ignore, silent
from seatfem.jobs.folders import private_folder
from seatfem.machine.libraries import require_gmsh_libraries
from seatfem.study.impacts.landings import LANDED, STATUS, left_out_in_words
from seatfem.study.safety import MOST_ROUNDS, USUAL, Effort
from seatfem.study.scene import load_scene, located
from seatfem.study.scene.problems import scene_error
from seatfem.study.sweep import sweep, table
from seatfem.study.sweep.best import (
    NEAREST,
    Optimum,
    SearchStage,
    Shift,
    changes_at,
    first_points,
    goal_of,
    improve,
    rank,
    violation,
)
from seatfem.study.sweep.cases import Case, Cases, Changes, cases_of
from seatfem.study.sweep.runner import STAGE, Outcome, Runner, StudyError, check_effort, crew_of, folder_of_ours
from seatfem.study.sweep.study import CONFIRMED, Optimise, Study, load_study

RADIUS: Final = 0.2  # radius of the first trust region, as a fraction of the ranges
AGAIN: Final = 0.05  # initial radius of later trust regions, as a fraction of the ranges


def run_optimum(
    study: Study,
    folder: Path,
    effort: Effort = USUAL,
    *,
    file: Path | None = None,
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
    predicted = ahead_of(study, rounds, file)
    scene = load_scene(study.scene, changes_at(study, (0.5,) * len(study.vary)))
    if any(body.traits.needs_gmsh for body in scene.bodies.values()):
        require_gmsh_libraries()
    workers = workers or predicted.workers()
    with folder_of_ours(folder) as journal, crew_of(workers, effort.cluster) as ask:
        tell(predicted.in_words(workers))

        def heard(outcome: Outcome) -> None:
            table.check_measures(goal.measures, outcome, "optimise")
            table.check_measures(study.outputs.asked(), outcome)

        runner = Runner(study, journal, effort, heard)

        def carry_out(cases: Sequence[Case]) -> Mapping[str, Outcome]:
            outcomes = runner.carry_out(cases, ask)
            progress(STAGE, min(1.0, (len(search.found) + len(target.found) + 1) / (goal.most + CONFIRMED)))
            return outcomes

        search = SearchStage(study, Cases(study, rounds), _coarse(study), carry_out)
        target = SearchStage(study, Cases(study, rounds), {}, carry_out)
        _search(search, target, goal)
    confirmed = sorted(target.found.values(), key=lambda each: (violation(each, goal), rank(each, goal, {})[1]))
    optimum = Optimum(study, tuple(search.found.values()), tuple(confirmed))
    table.write_columns(folder / "search.csv", optimum.table(optimum.searched).columns)
    table.write_columns(folder / "optimum.csv", optimum.table(optimum.confirmed).columns)
    write_whole(folder / "optimum.json", (json.dumps(optimum.as_json(), indent=1) + "\n").encode("utf-8"))
    return optimum


def _search(search: SearchStage, target: SearchStage, goal: Optimise) -> None:
    keys = len(search.study.vary)
    model = 2 * keys + 1  # points of a first quadratic model
    search.evaluate(first_points(keys, max(1, min(goal.most // 3, goal.most - model)), search.study.seed))
    shift: Shift = {}
    for turns in range(CONFIRMED, 0, -1):
        spare = goal.most - len(search.found)
        part = max(model, 2 * spare // 3 if turns == CONFIRMED else spare // turns)
        if spare >= model:
            improve(search, goal, shift, RADIUS if turns == CONFIRMED else AGAIN, len(search.found) + min(part, spare))
        ranked = sorted(search.found.values(), key=lambda each: rank(each, goal, shift))
        if math.isinf(rank(ranked[0], goal, shift)[0]):
            first = ranked[0].outcome
            statuses = [each.outcome.summary.get(STATUS, LANDED) for each in search.found.values()]
            message = first.message or left_out_in_words(statuses) or f"{', '.join(goal.measures)}: not known"
            words = f"none of {len(ranked)} scenes has the numbers that are asked for; the first: {message}"
            raise StudyError(f"optimise: {words}")
        others = [np.array(other.point) for other in target.found.values()]
        apart = (each for each in ranked if all(np.abs(other - each.point).max() >= NEAREST for other in others))
        if (best := next(apart, None)) is not None and math.isfinite(rank(best, goal, shift)[0]):
            [fine] = target.evaluate([best.point])
            moved = {name: fine.value(name) - best.value(name) for name in goal.measures}
            shift = moved if all(map(math.isfinite, moved.values())) else shift


def optimise(
    study: Path | str,
    folder: Path | str | None = None,
    *,
    workers: int = 1,
    rounds: int = MOST_ROUNDS,
    cluster: str | None = None,
) -> Optimum:
    """Find the best scene of a study file with a table [optimise] (docs/studies.md).

        found = seatfem.optimise("study.toml"); found.in_words(); found.as_json()["keys"]

    ``folder``: folder of the journal, from which a stopped search continues, and of the tables; by default temporary.
    ``cluster``: address of a dask scheduler (docs/cluster.md), in place of ``workers``. Raises like `run_optimum`.
    """
    with ExitStack() as ours:
        place = ours.enter_context(private_folder("study")) if folder is None else Path(folder)
        effort = Effort(None if cluster else workers, rounds, cluster=cluster)
        return run_optimum(load_study(study), place, effort, file=Path(study))


@dataclass(frozen=True)
class SearchAhead:
    """Predicted time of the search and of the confirmation of an optimisation."""

    search: sweep.Ahead
    target: sweep.Ahead

    def workers(self) -> int:
        """Return the number of workers that both can use."""
        return min(self.search.workers(), self.target.workers())

    def as_json(self) -> str:
        """Return both as JSON, with the total time for one worker, as scenes depend on previous ones."""
        parts = {"search": json.loads(self.search.as_json()), "confirmation": json.loads(self.target.as_json())}
        return json.dumps({**parts, "time_s": self.search.seconds() + self.target.seconds()}, indent=1)

    def in_words(self, workers: int) -> str:
        """Return the prediction in one line."""
        return f"search: at most {self.search.in_words(1)}; then at the target: {self.target.in_words(1)}"


def ahead_of(study: Study, rounds: int = MOST_ROUNDS, file: Path | None = None) -> SearchAhead:
    """Return the prediction for a study with [optimise], by plans at its lowest, middle and highest values. Raises
    `SceneError`."""
    goal = goal_of(study)
    points = [(share,) * len(study.vary) for share in (0.0, 0.5, 1.0)]

    def price(accuracy: Changes, scenes: int) -> sweep.Ahead:
        cases = cases_of(study, rounds, file, [{**changes_at(study, point), **accuracy} for point in points])
        prediction = sweep.ahead(study.scene, cases)
        return replace(prediction, scenes=scenes, seats=scenes if prediction.seats > 1 else prediction.seats)

    target = price({}, CONFIRMED)  # first, as its messages are about the scene itself
    finest = load_scene(study.scene, changes_at(study, points[1])).accuracy.target
    if goal.coarse < finest:
        words = f"{goal.coarse:g} is finer than the scene's accuracy.target, {finest:g}; raise one or lower the other"
        raise located(scene_error("optimise.coarse", words), file)
    return SearchAhead(price(_coarse(study), goal.most), target)


def _coarse(study: Study) -> Changes:
    scene = load_scene(study.scene, changes_at(study, (0.5,) * len(study.vary)))
    return {"accuracy": {"target": goal_of(study).coarse, "measures": list(scene.accuracy.measures)}}
