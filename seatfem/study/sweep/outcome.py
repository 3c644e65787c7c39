"""One scene of a study, run in a process of its own: `python -m seatfem.study.sweep.outcome` answers each job, a line
of JSON, with its outcome.

Results depend on the scene and its start only: neither stored results, nor the speed of the computer, nor measured
times affect its plan.
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
"""Key of summary.json with the limitations of its results, a sentence each."""
FAILURES: Final = (ArithmeticError, AssertionError, LookupError, MemoryError, OSError, RuntimeError, ValueError)
"""Errors that count as failure of a scene."""


@dataclass(frozen=True)
class Outcome:
    """Results of a scene, or the reason why it has none.

    Attributes:
        state: "done"; "missed": done, but above the target of accuracy; "stopped" at the time limit; "failed".
        message: reason of another state than "done".
        wall: wall time [s].
        summary: scalar values of summary.json, and its notes as one text.
        start: initial settings for later scenes (`seatfem.study.sweep.cases`), if requested.
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
        """Return whether the scene has results."""
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
    """Run the scene at ``path`` with some keys changed, in a temporary folder; failures are outcomes.

    Args:
        path, changed, rounds: the scene, its changed keys, and the largest number of refinement rounds.
        start: initial settings from another scene, or empty; if the scene fails or misses its target with them, it is
            planned and run again without them.
        leads: whether the outcome is to contain a ``start`` for other scenes.
        once: whether to run once with the settings of ``start``, without refinement.
        stress: whether to compute the reed's largest stresses if the scene does not need them.
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
    scene = study.scene.load_scene(path, changed)
    with folders.private_folder("sweep") as folder:
        plan = sweeps.cases.begun(scene, start, as_it_is=once)
        if plan is None:
            scene = study.scene.load_scene(path, {**changed, **start.get("seat", {})})
            plan = planning.planner.plan_scene(
                scene, machine.resources.Machine(), store=structures.store.Store(folder / "no-store")
            )  # never written: no stored seats are used
        result = runs.pipeline.run_scene(scene, folder, limits=limits, pictures=False, plan=plan, histories=False)
    summary = {key: _scalar(value) for key, value in result.summary.items() if _is_scalar(value)}
    notes = result.summary[NOTES]
    summary[NOTES] = " | ".join(map(str, notes)) if isinstance(notes, list) else ""
    assert result.plan is not None
    serves = result.met is True or summary.get("landing_status") == "cut off"  # another plan would not change this
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
