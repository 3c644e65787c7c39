"""Does the planner decide rightly? Drawn scenes with cheaper options, everything else finer than planned.

    python benchmarks/decisions.py [--seed N] [--scenes N] [--first N] [--seconds S] [--file JSONL]
    python benchmarks/decisions.py --short
    python benchmarks/decisions.py --prices | --summary | --document

appends a line for each scene to results/decisions.jsonl; scenes that are in it are not run again, and ``--seconds``
begins no further scene after so long. ``--short`` judges at least 20 decisions of fixed scenes anew, in at most a
quarter of an hour, and ends with 1 where the planner was wrong in courage. ``--prices`` measures prices above what is
allowed anew and judges nothing. ``--document`` writes results/decisions.csv and the tables of docs/decisions.md.

An option is enough where it changes no asked measure by more than the target (`decision_options.Truth`). Wrong courage:
the plan's option was not enough. Wrong caution: a cheaper one was, at the price of the time of both.
"""

from __future__ import annotations

import json
import math
import sys
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Final

from coverage_of_scenes import LONGEST, Head, TooLong, carry_out, limited, parser_of, stored
from decision_options import DECISIONS, LADDERS, ONE_POINT, Question, Truth, find_truth, questions
from decisions_page import costs_more, document, is_caution, is_courage, price, summary
from drawn_scenes import DrawnScene, draw_scene
from finer_scenes import REFUSALS
from fronts import Front, front_of
from table import RESULTS, forget, spent

from impact.notices import silent
from seatfem.machine.resources import Stopwatch
from seatfem.study.impacts.validity import ONE_PORT
from seatfem.study.method import MODEL, PORTS, RINGS, RunMethod
from seatfem.study.planning.plan import Plan
from seatfem.study.planning.planner import plan_scene
from seatfem.study.runs.rounds import Limits, Round, rounds
from seatfem.study.scene import Scene, load_scene

SEED, SCENES = 90210, 200
SHORT_SCENES: Final[tuple[int, ...]] = (2, 7, 14, 15, 19, 20, 43)
WARM: Final = (7,)  # scenes that begin a run and are not kept
FILE: Final = RESULTS / "decisions.jsonl"
PAGE: Final = Path(__file__).parents[1] / "docs" / "decisions.md"
RUN_SECONDS: Final = 30.0  # for the rounds of a run
QUICK = 1.0  # s of it that a run has taken, up to which its truth is the finest
FRONTS: Final = 12  # of so many scenes one has its front measured
FRONT_SECONDS: Final = 60.0  # for it


@dataclass(frozen=True)
class Judged:
    """One decision of a scene, as it was said and as it is.

    Attributes:
        decision, by_plan, said_enough, reason: as of a `Question`.
        chosen, chosen_change: the option taken and what it changes, relative; "" and 0 of the dearest.
        measure: asked for, that changes most by it, or by the cheaper one where the dearest is taken.
        cheaper, cheaper_change: the cheapest that is enough, or the next one, which is not; "" and nan of none.
        enough: whether that one is.
        seconds, cheaper_seconds: of processor time, of plan and first round with either, where the cheaper is enough.
        final, final_change: of a chosen one that is not enough, what the run ended with, which checks its own errors.
    """

    decision: str
    by_plan: bool
    said_enough: bool
    reason: str
    chosen: str
    chosen_change: float
    measure: str
    cheaper: str
    cheaper_change: float
    enough: bool
    seconds: float = math.nan
    cheaper_seconds: float = math.nan
    final: str = ""
    final_change: float = math.nan


@dataclass(frozen=True)
class Record(Head):
    """One scene.

    Attributes:
        level, target, measures, rounds, rung: of plan, run and truth.
        promised: whether the plan predicts that the target is met; met: whether the run says that it is.
        planning_seconds, run_seconds: of processor time, of the plan alone, and with all rounds and their error bars.
        seconds: of it, of everything.
        decisions: what was judged.
        front: the plan against a grid of options, where that was measured.
    """

    level: str = ""
    target: float = math.nan
    measures: tuple[str, ...] = ()
    rounds: int = 0
    promised: bool = True
    met: bool | None = None
    rung: int = -1
    planning_seconds: float = math.nan
    run_seconds: float = math.nan
    seconds: float = math.nan
    decisions: tuple[Judged, ...] = ()
    front: Front | None = None


@dataclass
class _Carried:
    """A run as the user waits for it: its first plan, its last round, and seconds of processor time.

    Of a second run of the same scene, which has the program loaded but nothing computed: the first one also loads what
    the runs with other options then have for nothing.
    """

    plan: Plan
    last: Round
    first_seconds: float
    all_seconds: float
    planning: float

    @cached_property
    def again_seconds(self) -> float:
        """Of the first round once more, with nothing left over from its plan: as rounds with other options have it."""
        return _round_seconds(self, self.plan.method)


def judge(
    drawn: DrawnScene, index: int, seed: int, longest: float = LONGEST, *, front: bool = False,
    only: Sequence[str] = DECISIONS,
) -> Record:  # fmt: skip
    """Return what a plan decides of one scene, and what is true; ``only`` of these decisions."""
    head = Record(seed, index, drawn.seat, drawn.reed, drawn.about, drawn.stated, "judged")
    [record] = carry_out(head, lambda folder: [_judged(head, drawn, folder, only, front)], longest)
    return record


def _front(carried: _Carried, truth: Truth) -> Front | None:
    """Return the plan against a grid of options, in a time of its own; ``None`` where that is not enough."""
    try:
        with stored() as folder, limited(FRONT_SECONDS):
            return front_of(carried.plan, truth, carried.all_seconds, folder)
    except TooLong:
        return None


def _judged(head: Record, drawn: DrawnScene, folder: Path, only: Sequence[str], front: bool) -> Record:
    scene = load_scene(drawn.write(folder))
    carried = _carry_out(scene, folder)
    plan, last = carried.plan, carried.last
    head = replace(
        head,
        level=plan.level,
        target=scene.accuracy.target,
        measures=tuple(scene.accuracy.judged),
        rounds=last.number,
        promised=plan.meets_target,
        met=last.met,
        planning_seconds=carried.planning,
        run_seconds=carried.all_seconds,
    )
    if not last.landed or last.touches.landings is None:
        status = "no landing" if last.touches.landings is None else last.touches.landings.status
        return replace(head, outcome=status, reason="there is nothing to judge")
    if not last.judged:
        return replace(head, outcome="no value", reason="no measure that is asked for has a value")
    methods = [replace(last.plan.method, time_step=last.result.dt), plan.method, *_with_waves(plan)]
    rung, truth = find_truth(scene, methods, last.touches.landings, 0 if carried.all_seconds <= QUICK else 1)
    asked = (question for question in questions(plan, truth) if question.decision in only)
    decisions = tuple(_answer(question, truth, carried) for question in asked)
    if last.number > 1:
        decisions = tuple(_at_the_end(each, list(questions(last.plan, truth)), truth) for each in decisions)
    return replace(head, rung=rung, decisions=decisions, front=_front(carried, truth) if front else None)


def _at_the_end(judged: Judged, after: Sequence[Question], truth: Truth) -> Judged:
    """With what the last round had, where the plan's option is not enough."""
    if judged.chosen_change <= truth.scene.accuracy.target:
        return judged
    for question in after:
        if question.decision == judged.decision:
            if question.chosen is None:
                return replace(judged, final="dearest", final_change=0.0)
            return replace(judged, final=question.chosen.name, final_change=truth.change(question.chosen.measure())[0])
    return judged


def _with_waves(plan: Plan) -> Iterator[RunMethod]:
    """Yield the method of a plan that may take no spring, no rod and no single contact point, where this one does."""
    if plan.level in ("spring", "rod") or plan.method.ports == 1:
        yield plan_scene(plan.scene, without=("spring", "rod", ONE_PORT)).method


def _carry_out(scene: Scene, folder: Path) -> _Carried:
    with stored() as another:
        next(rounds(plan_scene(scene), another, Stopwatch(), silent, limits=Limits(rounds=1)))
    forget()
    start = spent()
    plan = plan_scene(scene)
    planning = spent() - start
    going = rounds(plan, folder, Stopwatch(), silent, limits=Limits(seconds=RUN_SECONDS))
    last, first = next(going), spent() - start
    for further in going:
        last = further
    return _Carried(plan, last, first, spent() - start, planning)


def _answer(question: Question, truth: Truth, carried: _Carried) -> Judged:
    target, chosen = truth.scene.accuracy.target, question.chosen
    change, measure = (0.0, "") if chosen is None else truth.change(chosen.measure())
    statement = question.decision, question.by_plan, question.said_enough, question.reason
    name, settings = "" if chosen is None else chosen.name, {}
    judged = Judged(*statement, name, change, measure, "", math.nan, False)
    for option in question.cheaper:
        change, measure = truth.change(option.measure())
        enough = change <= target
        if enough or not judged.cheaper:
            answer = {"cheaper": option.name, "cheaper_change": change, "enough": enough}
            judged = replace(judged, measure=judged.measure or measure, **answer)
        if not enough:
            break
        settings = option.settings
    for key, value in settings.items():
        judged = _priced(judged, carried, key, value)
    return judged


def _priced(judged: Judged, carried: _Carried, key: str, value: Any) -> Judged:
    """Return a decision with the seconds of plan and first round as chosen, and with another value of a key."""
    if key == MODEL or (key == PORTS and value == 1):
        return replace(judged, seconds=carried.first_seconds, cheaper_seconds=_seconds_planned(key, value, carried))
    cheaper = carried.planning + _round_seconds(carried, _with_setting(carried.plan, key, value))
    return replace(judged, seconds=carried.planning + carried.again_seconds, cheaper_seconds=cheaper)


def price_again(record: Record) -> Record:
    """Return a record whose prices above what is allowed are measured anew; what is enough stays as it was judged."""
    dear = [each for each in record.decisions if each.by_plan and is_caution(record, each) and costs_more(each)]
    if not dear:
        return record
    with stored() as folder:
        carried = _carry_out(load_scene(draw_scene(record.index, record.seed).write(folder)), folder)
        anew = {each: _priced(each, carried, *_setting(each)) for each in dear}
    return replace(record, decisions=tuple(anew.get(each, each) for each in record.decisions))


def _setting(judged: Judged) -> tuple[str, Any]:
    """Return the key and value of a cheaper option, of which the record has the name."""
    if judged.decision in LADDERS:
        key, unit = LADDERS[judged.decision]
        return key, unit * type(unit)(judged.cheaper.partition(" ")[0])
    return (PORTS, 1) if judged.decision == ONE_POINT else (MODEL, judged.cheaper)


def _seconds_planned(key: str, value: Any, carried: _Carried) -> float:
    """Return the seconds of a plan that has to take a spring, a rod or a single contact point, which ask for another
    mesh and step, and of its first round; nan where it is refused."""
    table, _, name = key.rpartition(".")
    scene = carried.plan.scene
    stated = scene.model_copy(update={table: getattr(scene, table).model_copy(update={name: value})})
    forget()
    with stored():
        start = spent()
        try:
            plan = plan_scene(stated)
        except REFUSALS:
            return math.nan
        planning = spent() - start
    return planning + _round_seconds(replace(carried, plan=plan), plan.method)


def _round_seconds(carried: _Carried, method: RunMethod) -> float:
    """Return the seconds of a first round by another method than the plan's; nan where it is refused."""
    forget()
    with stored() as folder:
        start = spent()
        try:
            next(rounds(replace(carried.plan, method=method), folder, Stopwatch(), silent, limits=Limits(rounds=1)))
        except REFUSALS:
            return math.nan
        return spent() - start


def _with_setting(plan: Plan, key: str, value: Any) -> RunMethod:
    method = plan.method
    if method.ports is not None and key in (PORTS, RINGS):
        division = method.seat.division
        arcs, rings = (value, division.rings) if key == PORTS else (division.arcs, value)
        return method.along(plan.scene.geometry, arcs, rings)
    return method.replaced({key: value})


def read_records(path: Path = FILE) -> list[Record]:
    """Return the records so far, by scene."""
    if not path.exists():
        return []
    records = [_record(json.loads(line)) for line in path.read_text(encoding="utf-8").splitlines()]
    return sorted(records, key=lambda record: (record.seed, record.index))


def _record(values: Mapping[str, Any]) -> Record:
    decisions = tuple(Judged(**each) for each in values["decisions"])
    front = None if values["front"] is None else Front(**values["front"])
    return Record(**{**values, "decisions": decisions, "front": front, "measures": tuple(values["measures"])})


def line(record: Record) -> str:
    """Return a scene for the log."""
    head = f"{record.index:3d} {record.seat}/{record.level} {record.reed} ({record.about}) "
    if record.outcome != "judged":
        return f"{head}{record.outcome}: {record.reason}; {record.seconds:.0f} s"
    parts = []
    for each in record.decisions:
        mark = " COURAGE" if is_courage(record, each) else " caution" if each.enough else ""
        cost = f" x{price(each):.2f}" if each.cheaper_seconds > 0 else ""
        parts.append(
            f"{each.decision}: {each.chosen or 'dearest'} {each.chosen_change:.1e}, "
            f"{each.cheaper} {each.cheaper_change:.1e}{mark}{cost}"
        )
    tail = "" if record.front is None else f"; front {record.front.ratio:.2f}, bare {record.front.bare_ratio:.2f}"
    return f"{head}target {record.target:.2g}, rung {record.rung}: {'; '.join(parts)}{tail}; {record.seconds:.0f} s"


def run(seed: int, indices: Sequence[int], path: Path | None, seconds: float, longest: float) -> list[Record]:
    """Judge the scenes that are not on file, and return them."""
    there = set() if path is None else {(record.seed, record.index) for record in read_records(path)}
    begun, found = time.perf_counter(), list[Record]()
    for warm in WARM if path is not None else ():  # what is imported and compiled first costs no scene its time
        judge(draw_scene(warm, SEED), warm, SEED, longest)
    for index in indices:
        if time.perf_counter() - begun > seconds:
            break
        if (seed, index) in there:
            continue
        front = path is not None and index % FRONTS == 0
        record = judge(draw_scene(index, seed), index, seed, longest, front=front)
        found.append(record)
        if path is not None:
            with path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(asdict(record)) + "\n")
        print(line(record), flush=True)  # noqa: T201
    return found


def main() -> int:
    """Run what is missing of a seed, and tell what the file holds."""
    parser = parser_of(SEED, SCENES, FILE)
    parser.add_argument("--seconds", type=float, default=math.inf, help="after which no further scene is begun")
    parser.add_argument("--short", action="store_true", help="at least 20 decisions of fixed scenes, not kept")
    parser.add_argument("--prices", action="store_true", help="measure those above what is allowed anew, judge nothing")
    asked = parser.parse_args()
    if asked.short:
        records = run(SEED, SHORT_SCENES, None, asked.seconds, asked.longest)
        print(summary(records))  # noqa: T201
        wrong = [is_courage(record, each) for record in records for each in record.decisions if each.by_plan]
        return 1 if any(wrong) else 0
    if asked.prices:
        lines = (json.dumps(asdict(price_again(record))) + "\n" for record in read_records(asked.file))
        asked.file.write_text("".join(lines), encoding="utf-8")
    elif not (asked.summary or asked.document):
        indices = range(asked.first, asked.first + asked.scenes)
        run(asked.seed, indices, asked.file, asked.seconds, asked.longest)
    records = read_records(asked.file)
    print(summary(records))  # noqa: T201
    if asked.document:
        document(records, asked.file.with_suffix(".csv"), PAGE)
    return 0


if __name__ == "__main__":
    sys.exit(main())
