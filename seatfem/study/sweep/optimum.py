"""The best scene of a study: sought at a loose accuracy, confirmed at the scene's own."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import cached_property, partial
from pathlib import Path
from typing import Any, Final

from impact.brief import brief
from impact.files.atomic import write_whole
from impact.pictures.drawing import gap_of
from impact.progress import Progress, Tell, silent, untold
from seatfem.jobs.folders import private_folder
from seatfem.machine.libraries import require_gmsh_libraries
from seatfem.study.safety import MOST_ROUNDS
from seatfem.study.scene import SceneError, load_scene, located
from seatfem.study.scene.problems import Problem
from seatfem.study.sweep.ahead import Ahead, ahead
from seatfem.study.sweep.cases import Case, Cases, cases_of
from seatfem.study.sweep.charts import draw_history
from seatfem.study.sweep.design import Changes
from seatfem.study.sweep.goal import CONFIRMED, Optimise
from seatfem.study.sweep.outcome import Outcome
from seatfem.study.sweep.runner import STAGE, StudyError, check_effort, crew_of, folder_of_ours, read_journal, run_cases
from seatfem.study.sweep.search import NEAREST, Found, Level, Shift, changes_at, first_points, improve, rank
from seatfem.study.sweep.study import Study, load_study
from seatfem.study.sweep.sweep import LIMIT
from seatfem.study.sweep.table import BAR, StudyTable, check_measures, table_of, write_csv

RADIUS: Final = 0.2  # of the ranges, of the first trust region
AGAIN: Final = 0.05  # and of that about a point that was confirmed


@dataclass(frozen=True)
class Optimum:
    """What a search has found.

    Attributes:
        study: what was asked.
        searched: points of the search, in their order.
        confirmed: points carried out at the scene's own target, the best first.
    """

    study: Study
    searched: tuple[Found, ...]
    confirmed: tuple[Found, ...]

    __repr__ = brief

    @property
    def goal(self) -> Optimise:
        """What was sought."""
        return _goal(self.study)

    @property
    def best(self) -> Found:
        """At the scene's own target."""
        return self.confirmed[0]

    @property
    def has_numbers(self) -> bool:
        """Whether the best was carried out."""
        return math.isfinite(self.best.value(self.goal.measure))

    @property
    def is_met(self) -> bool:
        """Whether the best keeps all limits, up to their error bars."""
        return self.has_numbers and _violation(self.best, self.goal) == 0

    @cached_property
    def is_told_apart(self) -> bool:
        """Whether the best two, both within all limits, differ by more than their error bars."""
        met = [each for each in self.confirmed if _violation(each, self.goal) == 0]
        if len(met) < 2:
            return True
        values, bars = zip(
            *((each.value(self.goal.measure), _bar(each, self.goal.measure)) for each in met), strict=True
        )
        return not abs(values[0] - values[1]) <= sum(bar for bar in bars[:2] if math.isfinite(bar))

    def table(self, of: Sequence[Found]) -> StudyTable:
        """A row for each point: values, measures, error bars, the margin of each limit, what became of it."""
        measures = tuple(dict.fromkeys((*self.goal.measures, *self.study.outputs.asked())))
        found = table_of(self.study, [each.case for each in of], {each.case.key: each.outcome for each in of}, measures)
        margins = {
            f"margin of {each}": [None if math.isnan(m := each.margin(one.value(each.measure))) else m for one in of]
            for each in self.goal.constraints
        }
        return replace(found, columns={**found.columns, **margins})

    def as_json(self) -> dict[str, Any]:
        """The best point, how it stands to the limits, and how it was found."""
        limits = [
            {
                "constraint": str(each),
                "margin": _known(margin := each.margin(self.best.value(each.measure))),
                "error_bar": _known(bar := _bar(self.best, each.measure)),
                "holds": bool(each.holds(margin, bar)),
            }
            for each in self.goal.constraints
        ]
        return {
            "words": self.in_words(),
            "met": self.is_met,
            "keys": changes_at(self.study, self.best.point),
            "measures": {
                name: {"value": _known(self.best.value(name)), "error_bar": _known(_bar(self.best, name))}
                for name in self.goal.measures
            },
            "constraints": limits,
            "told_apart": self.is_told_apart,
            "searched": len(self.searched),
            "failed": sum(not each.outcome.has_numbers for each in self.searched),
            "confirmed": len(self.confirmed),
        }

    def in_words(self) -> str:
        """One sentence, and what has to be known with it."""
        if not self.has_numbers:
            return f"no optimum: the best points could not be confirmed: {self.best.outcome.message}"
        goal, best = self.goal, self.best
        where = ", ".join(f"{key} = {_short(value)}" for key, value in changes_at(self.study, best.point).items())
        limits = [f"{name} = {_with_bar(best, name)} ({each})" for each in goal.constraints for name in (each.measure,)]
        words = (
            f"{'least' if goal.minimise else 'greatest'} {goal.measure} = {_with_bar(best, goal.measure)} at {where}"
        )
        words += f", with {', '.join(limits)}" if limits else ""
        if not self.is_met:
            words = f"no point within all limits was found; the nearest has {words.split(' ', 1)[1]}"
        elif any(each.margin(best.value(each.measure)) < 0 for each in goal.constraints):
            words += "; a limit is kept up to the error bar only"
        if not self.is_told_apart:
            words += "; the second best is no further from it than their error bars"
        return words


def run_optimum(
    study: Study,
    folder: Path,
    *,
    file: Path | None = None,
    workers: int | None = None,
    rounds: int = MOST_ROUNDS,
    limit: float = LIMIT,
    progress: Progress = silent,
    tell: Tell = untold,
) -> Optimum:
    """The scene whose measure is least or greatest within limits; optimum.json, optimum.csv, search.csv in ``folder``.

    A third of the evaluations is a Latin hypercube, in all workers; from its best point COBYQA goes on. What it finds
    is carried out at the scene's own target; by what the measures differ there those of the search are shifted, and it
    goes on from there, so that a limit is met at the target, not at the loose accuracy. Stopped and continued as
    `run_study`: the search asks for the same scenes again, and finds them in the journal.

    Raises:
        SceneError, StudyError, OutputError: as `run_study`; StudyError, too, where no scene has numbers.
    """
    check_effort(workers, rounds, limit)
    goal = _goal(study)
    predicted = ahead_of(study, rounds, file)
    scene = load_scene(study.scene, changes_at(study, (0.5,) * len(study.vary)))
    if any(body.needs_gmsh for body in scene.bodies.values()):
        require_gmsh_libraries()
    workers = workers or predicted.workers()
    with folder_of_ours(folder) as journal, crew_of(workers) as ask:
        known, about = read_journal(journal), study.model_dump(mode="json", by_alias=True)
        tell(predicted.in_words(workers))

        def heard(outcome: Outcome) -> None:
            check_measures(goal.measures, outcome, "optimise")
            check_measures(study.outputs.asked(), outcome)

        def carry_out(cases: Sequence[Case]) -> Mapping[str, Outcome]:
            for outcome in [known[case.key] for case in cases if case.key in known][:1]:
                heard(outcome)
            found = run_cases(
                study.scene, cases, journal, known, about=about, rounds=rounds, ask=ask, limit=limit, heard=heard
            )
            known.update(found)
            about.clear()
            progress(STAGE, min(1.0, (len(search.found) + len(target.found) + 1) / (goal.most + CONFIRMED)))
            return found

        search = Level(study, Cases(study, rounds), _coarse(study), carry_out)
        target = Level(study, Cases(study, rounds), {}, carry_out)
        _search(search, target, goal)
    confirmed = sorted(target.found.values(), key=lambda each: (_violation(each, goal), rank(each, goal, {})[1]))
    found = Optimum(study, tuple(search.found.values()), tuple(confirmed))
    write_csv(folder / "search.csv", found.table(found.searched).columns)
    write_csv(folder / "optimum.csv", found.table(found.confirmed).columns)
    write_whole(folder / "optimum.json", (json.dumps(found.as_json(), indent=1) + "\n").encode("utf-8"))
    return found


def _search(search: Level, target: Level, goal: Optimise) -> None:
    keys = len(search.study.vary)
    model = 2 * keys + 1  # points of a first quadratic model
    search.at(first_points(keys, max(1, min(goal.most // 3, goal.most - model)), search.study.seed))
    shift: Shift = {}
    for left in range(CONFIRMED, 0, -1):
        spare = goal.most - len(search.found)
        part = max(model, 2 * spare // 3 if left == CONFIRMED else spare // left)
        if spare >= model:
            improve(search, goal, shift, RADIUS if left == CONFIRMED else AGAIN, len(search.found) + min(part, spare))
        ranked = sorted(search.found.values(), key=lambda each: rank(each, goal, shift))
        if math.isinf(rank(ranked[0], goal, shift)[0]):
            first = ranked[0].outcome
            told = first.message or f"{', '.join(goal.measures)}: not known of these scenes"
            raise StudyError(
                f"optimise: none of {len(ranked)} scenes has the numbers that are asked for; the first: {told}"
            )
        for each in ranked:
            if math.isfinite(rank(each, goal, shift)[0]) and all(
                _apart(each, other) for other in target.found.values()
            ):
                [fine] = target.at([each.point])
                moved = {name: fine.value(name) - each.value(name) for name in goal.measures}
                shift = moved if all(map(math.isfinite, moved.values())) else shift
                break


def _apart(one: Found, other: Found) -> bool:
    return max(abs(a - b) for a, b in zip(one.point, other.point, strict=True)) >= NEAREST


def draw_search(found: Optimum, path: Path) -> str:
    """The best so far over the evaluations; in words what kept it from being drawn, "" if nothing did."""
    goal = found.goal
    numbers = {each.point: each.case.number for each in found.searched}
    confirmed = [(numbers[each.point], each.value(goal.measure), _bar(each, goal.measure)) for each in found.confirmed]
    within = [rank(each, goal, {})[0] == 0 for each in found.searched]
    return gap_of(partial(draw_history, found.table(found.searched), goal, within, confirmed), path)


def optimise(
    study: Path | str, folder: Path | str | None = None, *, workers: int = 1, rounds: int = MOST_ROUNDS
) -> Optimum:
    """The best scene of a study file with a table [optimise] (docs/studies.md).

        found = seatfem.optimise("study.toml"); found.in_words(); found.as_json()["keys"]

    ``folder``: of the journal, by which a stopped search goes on, and of the tables; none is kept where absent.
    Raises as `run_optimum`.
    """
    with ExitStack() as ours:
        place = ours.enter_context(private_folder("study")) if folder is None else Path(folder)
        return run_optimum(load_study(study), place, file=Path(study), workers=workers, rounds=rounds)


@dataclass(frozen=True)
class SearchAhead:
    """What an optimisation would take: its search, and the scenes that confirm it."""

    search: Ahead
    target: Ahead

    def workers(self) -> int:
        """As many as either could use."""
        return min(self.search.workers(), self.target.workers())

    def as_json(self) -> str:
        """Both, and the time of all with one worker: one scene follows from the other."""
        parts = {"search": json.loads(self.search.as_json()), "confirmation": json.loads(self.target.as_json())}
        return json.dumps({**parts, "time_s": self.search.seconds() + self.target.seconds()}, indent=1)

    def in_words(self, workers: int) -> str:
        """One line."""
        return f"search: at most {self.search.in_words(1)}; then at the target: {self.target.in_words(1)}"


def ahead_of(study: Study, rounds: int = MOST_ROUNDS, file: Path | None = None) -> SearchAhead:
    """Of a study with [optimise], by its lowest, middle and highest values. Raises `SceneError` of what is wrong."""
    goal = _goal(study)
    points = [(share,) * len(study.vary) for share in (0.0, 0.5, 1.0)]

    def price(accuracy: Changes, scenes: int) -> Ahead:
        cases = cases_of(study, rounds, file, [{**changes_at(study, point), **accuracy} for point in points])
        found = ahead(study.scene, cases)
        return replace(found, scenes=scenes, seats=scenes if found.seats > 1 else found.seats)

    target = price({}, CONFIRMED)  # first: its messages are of the scene as it is
    asked = load_scene(study.scene, changes_at(study, points[1])).accuracy.target
    if goal.coarse < asked:
        words = f"{goal.coarse:g} is finer than the scene's accuracy.target, {asked:g}; raise one or lower the other"
        wrong = SceneError((Problem(None, 0, "optimise.coarse", words, ("optimise", "coarse")),))
        raise wrong if file is None else located(wrong, file)
    return SearchAhead(price(_coarse(study), goal.most), target)


def _goal(study: Study) -> Optimise:
    if study.optimise is None:
        raise StudyError(
            "optimise: required table is missing: minimise or maximise = a key of summary.json, subject_to"
        )
    return study.optimise


def _coarse(study: Study) -> Changes:
    scene = load_scene(study.scene, changes_at(study, (0.5,) * len(study.vary)))
    return {"accuracy": {"target": _goal(study).coarse, "measures": list(scene.accuracy.measures)}}


def _violation(found: Found, goal: Optimise) -> float:
    """Relative, of the limits that are not kept up to the error bars; infinite of a scene without numbers."""
    total = 0.0
    for each in goal.constraints:
        margin = each.margin(found.value(each.measure))
        if not each.holds(margin, _bar(found, each.measure)):
            total += math.inf if math.isnan(margin) else -margin / (abs(each.limit) or 1.0)
    return total if math.isfinite(found.value(goal.measure)) else math.inf


def _bar(found: Found, measure: str) -> float:
    return found.value(BAR + measure)


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _with_bar(found: Found, measure: str) -> str:
    bar = _bar(found, measure)
    return f"{found.value(measure):.5g}" + (f" ± {bar:.2g}" if math.isfinite(bar) else "")


def _short(value: object) -> str:
    number, space, unit = str(value).partition(" ")
    return f"{float(number):.6g}{space}{unit}"
