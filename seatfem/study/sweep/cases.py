"""Scenes of a study, all checked before the first one runs, and the plans with which they start.

Most scenes start with the refined plan of an earlier one, so that one round is enough; each estimates its own error,
and is refined if it misses its target. The start depends on the design of the study, not on the order of completion.
"""

from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import product
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np
import scipy
from numpy.typing import NDArray

from impact.notices import Progress, silent
from seatfem.fields import Value
from seatfem.machine import code
from seatfem.structures.cache import content_key
from seatfem.study.impacts.contact import RunError, check_step
from seatfem.study.method import FIELDS, has_key, is_given, stated_keys, value_of, written
from seatfem.study.plan import Plan
from seatfem.study.runs.kept import plan_from_json, plan_to_json
from seatfem.study.safety import MOST_ROUNDS
from seatfem.study.scene import Scene, SceneError, load_scene
from seatfem.study.scene.files import describe_content
from seatfem.study.scene.measures import all_measures
from seatfem.study.scene.problems import Problem
from seatfem.study.sweep.study import Study
from seatfem.study.sweep.variations import Listed
from seatfem.units import number_and_unit

Changes = Mapping[str, Value]
"""Values by dotted key, as in a scene file."""


def changes_of(study: Study) -> Iterator[Changes]:
    """Yield the changed keys of each scene of the study, in order, reproducibly by the seed.

    In grids the last key varies fastest. "sobol_indices" has the two samples A and B of Saltelli (2010), n scenes each,
    then for each key the scenes of A with that key's column from B.
    """
    keys = list(study.vary)
    if not study.is_drawn:
        levels = [each.levels(key) for key, each in study.vary.items()]
        rows = product(*levels) if study.design == "grid" else zip(*levels, strict=True)
        yield from (dict(zip(keys, row, strict=True)) for row in rows)
        return
    for shares in shares_of(study):
        yield {key: study.vary[key].quantile(float(share)) for key, share in zip(keys, shares, strict=True)}


def shares_of(study: Study) -> NDArray[np.float64]:
    """Return the probabilities (scenes, keys) in 0..1 that a design draws."""
    count, keys = study.number, len(study.vary)
    assert count is not None
    rng = np.random.default_rng(study.seed)
    if study.design == "monte_carlo":
        return rng.random((count, keys))
    if study.design == "latin_hypercube":
        return np.asarray(scipy.stats.qmc.LatinHypercube(keys, rng=rng).random(count))
    if study.design == "sobol":
        return np.asarray(scipy.stats.qmc.Sobol(keys, rng=rng).random(count))
    both = np.asarray(scipy.stats.qmc.Sobol(2 * keys, rng=rng).random(count))
    first, second = both[:, :keys], both[:, keys:]
    mixed = [np.where(np.arange(keys) == column, second, first) for column in range(keys)]
    return np.concatenate([first, second, *mixed])


def with_bars(study: Study, changed: Changes) -> Changes:
    """Return the change of accuracy.measures by which every limited result of a study has an error bar: those of the
    scene with ``changed`` keys and the measures that below and above limit; empty if no measure is to be added.

    Errors of this scene are left to those who check all scenes.
    """
    limited = {limit.measure for limit in study.stated_limits}
    names = [name for name, each in all_measures().items() if {each.key, each.landing_key} & limited]
    if not names or any(key.split(".")[0] == "accuracy" for key in study.vary):
        return {}
    try:
        stated = load_scene(study.scene, changed).accuracy.measures
    except SceneError:
        return {}
    return {"accuracy.measures": [*stated, *added]} if (added := [n for n in names if n not in stated]) else {}


PILOTS: Final = 4
"""Number of scenes with a seat that start after the first one has ended. All others start with the second most
expensive plan of these five: one may be an exception, but refinements that two needed will be needed by most."""
Start = Mapping[str, Any]
"""A plan as JSON ("plan"), hash of the scenes for which it may serve ("like"), its counted work ("work"),
and the keys of its seat as in a scene file that the scene does not state ("seat")."""


def start_of(plan: Plan) -> Start:
    """Return the start for later scenes from a ``plan``, without anything measured on this computer."""
    scene, method = plan.scene, plan.method
    open_keys = [key for key in FIELDS if key.startswith("seat.") and has_key(scene, key) and not is_given(scene, key)]
    chosen = {key: method.value(key) for key in open_keys}
    plain = replace(plan, choices=tuple(replace(choice, reason="") for choice in plan.choices))
    return {
        "like": _like(scene, method.given),
        "work": _count_work(plan),
        "seat": {key: written(key, value) for key, value in chosen.items() if value not in (None, "auto")},
        "plan": plan_to_json(plain),
    }


def _count_work(plan: Plan) -> float:
    """Return the number of time steps times contacts and modes, in proportion to which a contact takes time."""
    scene, method = plan.scene, plan.method
    steps = scene.run.duration / (method.time_step or scene.run.filter_width)
    return steps * method.seat.division.count * (method.reed.n_modes or 1)


def begun(scene: Scene, start: Start) -> Plan | None:
    """Return the plan with which ``scene`` starts; ``None`` if it differs too much from that of ``start``."""
    return plan_from_json(scene, start["plan"]) if start.get("like") == _like(scene, stated_keys(scene)) else None


def chosen(starts: Iterable[Start]) -> Start:
    """Return the start of a scene from those of earlier scenes, the second most expensive; empty if there is none."""
    ranked = sorted(starts, key=lambda start: float(start["work"]))
    return ranked[max(0, len(ranked) - 2)] if ranked else {}


def _like(scene: Scene, given: frozenset[str]) -> str:
    """Return a hash that is equal for scenes that may share a plan: by [run], [accuracy], kinds, law, and ``given``
    keys of `FIELDS`, which the file states."""
    stated = {key: value_of(scene, key) for key in FIELDS if key in given}
    tables = scene.model_dump(include={"run", "accuracy"}, exclude_unset=True)
    kinds = {name: body.kind for name, body in scene.bodies.items()}
    return content_key({"tables": tables, "stated": stated, "kinds": kinds, "law": scene.contact.law.kind})[:16]


TOLD_EVERY: Final = 100  # number of scenes between two reports of progress


@dataclass(frozen=True)
class Case:
    """One scene of a study.

    Attributes:
        number: number of the scene, from 1.
        changed: values of its changed keys, as in a scene file.
        key: hash of all on which its results depend: keys, contents of files, code.
        leads: whether later scenes may start with its plan: it is among the first with its seat.
        guides: keys of the scenes with one of whose plans it starts; the first is the first with the same seat.
        way: "refined" by the loop; "sample": run in full with its start, in one round; "beside": integrated in parallel
            with others by that plan; "carried": run by itself with its start, but without error bars.
        needs: histories that "beside" needs in addition to the force.
        stress: whether to compute the reed's largest stresses if the scene does not need them.
    """

    number: int
    changed: Changes
    key: str
    leads: bool = False
    guides: tuple[str, ...] = ()
    way: Literal["refined", "sample", "beside", "carried"] = "refined"
    needs: tuple[str, ...] = ()
    stress: bool = True


@dataclass(frozen=True)
class Cases:
    """Builder of the cases of a study, one after another.

    Attributes:
        study, rounds: the study, and the largest number of refinement rounds.
        first: seat -> keys of the first scenes, whose plans are starts.
        made: hash of a scene's content -> its case.
        files: path -> hash of the file's content.
    """

    study: Study
    rounds: int
    first: dict[str, list[str]] = field(default_factory=dict)
    made: dict[str, Case] = field(default_factory=dict)
    files: dict[Path, object] = field(default_factory=dict)

    def case(self, number: int, changed: Changes) -> Case:
        """Return the case with these values. Raises `SceneError` or `RunError` for errors of its scene."""
        scene = load_scene(self.study.scene, changed)
        check_step(scene)
        content = describe_content(scene, self.files)
        stress = self.study.asks_for_stress
        own = _key(content if stress else [content, "no stress"], self.rounds)
        if own not in self.made:
            first = self.first.setdefault(_key(content["seat"], 0), [])
            leads, guides = len(first) <= PILOTS, tuple(first if len(first) > PILOTS else first[:1])
            key = _key([own, *guides], self.rounds) if guides else own
            self.made[own] = Case(number, changed, key, leads, guides, stress=stress)
            if leads:
                first.append(key)
        return replace(self.made[own], number=number, changed=changed)


def cases_of(
    study: Study,
    rounds: int = MOST_ROUNDS,
    changes: Sequence[Changes] | None = None,
    *,
    numbers: Collection[int] | None = None,
    progress: Progress = silent,
) -> list[Case]:
    """Return all scenes of the study, or those with such ``changes``, or with these ``numbers`` from 1.

    Args:
        rounds: largest number of refinement rounds of each.

    Raises:
        SceneError: errors of the scenes; for each key the first scene that has one.
    """
    cases: list[Case] = []
    problems: dict[str, Problem] = {}
    wrong: Counter[str] = Counter()
    builder = Cases(study, rounds)
    count = study.number_of_scenes if changes is None else len(changes)
    every = changes_of(study) if changes is None else iter(changes)
    bars = with_bars(study, first) if changes is None and (first := next(changes_of(study), None)) else {}
    for number, varied in enumerate(every, start=1):
        if numbers is not None and number not in numbers:
            continue
        if number % TOLD_EVERY == 0:
            progress("checking scenes", number / count)
        changed = {**varied, **bars}
        try:
            cases.append(builder.case(number, changed))
        except (SceneError, RunError) as error:
            whole = (Problem(study.scene, 0, "run.time_step", str(error)),)
            for problem in error.problems if isinstance(error, SceneError) else whole:
                of_study = _name_study_key(problem, varied, f"scene {number} of {count}")
                problems.setdefault(of_study.key, of_study)
                wrong[of_study.key] += 1
    for key, problem in problems.items():
        if others := wrong[key] - 1:
            message = f"{problem.message}; {others} more scene{'s'[: others > 1]} alike"
            problems[key] = replace(problem, message=message)
    if problems:
        raise study.located(SceneError(tuple(problems.values())))
    return cases


def key_of_case(case: Case, *way: str) -> str:
    """Return the key of a case that is run in another way."""
    return content_key({"scene": case.key, "way": list(way)})[:32]


def _key(asked: object, rounds: int) -> str:
    return content_key({"asked": asked, "rounds": rounds, "program": code.code_version()})[:32]


def _name_study_key(problem: Problem, changed: Changes, which: str) -> Problem:
    """Return a problem of a varied key with its value and its key in the study; other problems unchanged."""
    own = f"{problem.key}."
    touching = [key for key in changed if own.startswith(f"{key}.") or f"{key}.".startswith(own)]
    if not touching:
        varied = ", ".join(f"{key} = {value!r}" for key, value in changed.items())
        return replace(problem, message=f"{problem.message} ({which}: {varied})")
    key = touching[0]
    return Problem(None, 0, f"vary.{key}", f"{which}, {key} = {changed[key]!r}: {problem.message}")


def columns_of(cases: list[Case], study: Study) -> Mapping[str, list[object]]:
    """Return the values of each key by scene: numbers in the unit of the key, else as they are."""
    columns: dict[str, list[object]] = {}
    for key, variation in study.vary.items():
        texts = isinstance(variation, Listed) and not variation.quantities()
        values = [case.changed[key] for case in cases]
        name = f"{key} [{variation.unit}]" if variation.unit else key
        columns[name] = [str(value) if texts else number_and_unit(value)[0] for value in values]
    return columns
