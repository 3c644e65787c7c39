"""One scene of a study, carried out in a process of its own: `python -m seatfem.study.sweep.outcome` answers each job,
a line of JSON, with its outcome.

Its numbers are a function of the scene and of what it begins with alone: the plan knows neither what was computed
before nor how fast this computer is, and no time that was measured decides anything.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from numbers import Integral, Real
from pathlib import Path
from typing import Any, Final, Literal, get_args

from seatfem import machine, structures, study
from seatfem.jobs import folders, worker
from seatfem.study import planning, runs
from seatfem.study import sweep as sweeps

State = Literal["done", "missed", "stopped", "failed"]
Changes = Mapping[str, Any]
Scalar = float | int | bool | str | None
NOTES: Final = "notes"
"""Key of summary.json that lists what limits its numbers, a sentence each."""
FAILURES: Final = (ArithmeticError, AssertionError, LookupError, MemoryError, OSError, RuntimeError, ValueError)
"""Errors of a scene that cannot be carried out."""


@dataclass(frozen=True)
class Outcome:
    """Summary of a scene, or why it has none.

    Attributes:
        state: "done"; "missed": done, its target of accuracy missed; "stopped" at the limit of time; "failed".
        message: why.
        wall: seconds of the clock.
        summary: summary.json, as far as its values are single ones, and its notes in one text.
        start: what scenes that follow may begin with (`seatfem.study.sweep.cases`), of one that is asked for it.
    """

    state: State
    message: str = ""
    wall: float = math.nan
    summary: Mapping[str, Scalar] = field(default_factory=dict)
    start: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        known = self.state in get_args(State) and isinstance(self.message, str) and isinstance(self.wall, int | float)
        maps = isinstance(self.summary, Mapping) and isinstance(self.start, Mapping)
        sound = not self.start or isinstance(self.start.get("work"), int | float) if maps else False
        if not (known and sound and all(map(_is_scalar, self.summary.values()))):
            raise TypeError("no outcome of a scene")  # a damaged journal

    @property
    def has_numbers(self) -> bool:
        """Return whether the scene was carried out."""
        return self.state in ("done", "missed")

    @staticmethod
    def of_failure(error: Exception, **others: Any) -> Outcome:
        """Return the outcome of a scene that raised one of `FAILURES`."""
        return Outcome("failed", f"{type(error).__name__}: {error}", **others)


def carry_out(
    path: Path,
    changed: Changes,
    rounds: int,
    start: Mapping[str, Any],
    *,
    leads: bool = False,
    once: bool = False,
    stress: bool = True,
) -> Outcome:
    """Run the scene at ``path`` with some keys changed; files go to a folder that is removed. Whatever fails is the
    outcome.

    Args:
        path, changed, rounds: the scene, and how often it may be refined.
        start: what another scene has left, or nothing; where this one fails or misses its target with it, it is planned
            and carried out again by itself.
        leads: whether its own is asked for.
        once: whether it is carried out by the ``start`` as it is, and not refined.
        stress: whether a reed's largest stresses are looked for where the scene does not ask for them.
    """
    begun = time.perf_counter()

    def tried(rounds: int, start: Mapping[str, Any]) -> Outcome:
        limits = runs.next_round.Limits(rounds, steady=True, stress=stress)
        try:
            return _carried_out(path, changed, limits, start, leads=leads, once=once)
        except FAILURES as error:
            return Outcome.of_failure(error)

    outcome = tried(1 if once and start else rounds, start)
    if start and outcome.state != "done" and not once:
        outcome = tried(rounds, {})
    return replace(outcome, wall=time.perf_counter() - begun)


def _carried_out(
    path: Path, changed: Changes, limits: runs.next_round.Limits, start: Mapping[str, Any], *, leads: bool, once: bool
) -> Outcome:
    # what runs scenes takes long to load
    scene = study.scene.load_scene(path, changed)
    with folders.private_folder("sweep") as folder:
        plan = sweeps.cases.begun(scene, start, as_it_is=once)
        if plan is None:
            scene = study.scene.load_scene(path, {**changed, **start.get("seat", {})})
            plan = planning.planner.plan_scene(
                scene, machine.resources.Machine(), store=structures.store.Store(folder / "no-store")
            )  # never written: no seat is at hand
        result = runs.pipeline.run_scene(scene, folder, limits=limits, pictures=False, plan=plan, histories=False)
    summary = {key: _scalar(value) for key, value in result.summary.items() if _is_scalar(value)}
    notes = result.summary[NOTES]
    summary[NOTES] = " | ".join(map(str, notes)) if isinstance(notes, list) else ""
    assert result.plan is not None
    serves = result.met is True or summary.get("landing_status") == "cut off"  # which no other plan would mend
    next_start = sweeps.cases.start_of(result.plan) if leads and serves else {}
    missed = result.met is False
    return Outcome("missed" if missed else "done", result.messages[0] if missed else "", 0.0, summary, next_start)


def _is_scalar(value: object) -> bool:
    return value is None or isinstance(value, str | Real)


def _scalar(value: object) -> Scalar:
    if value is None or isinstance(value, bool | str):
        return value
    return int(value) if isinstance(value, Integral) else float(value)  # type: ignore[arg-type]


def _reply(line: str) -> str:
    job = json.loads(line)
    path = Path(job.pop("path"))
    if "others" not in job:
        return json.dumps(asdict(carry_out(path, **job)))
    return json.dumps([asdict(each) for each in sweeps.side_by_side.side_by_side(path, **job)])


if __name__ == "__main__":
    worker.answer_lines(_reply)
