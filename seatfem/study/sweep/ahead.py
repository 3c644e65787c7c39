"""Prediction of what a study will take, before anything runs."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from impact.quantities import in_time
from seatfem.machine.memory import available_memory
from seatfem.machine.rates import Machine, cores
from seatfem.study.planning.costs import OF_THE_SEAT, PROGRAM
from seatfem.study.planning.plan import Cost
from seatfem.study.planning.planner import plan_scene
from seatfem.study.safety import MEMORY
from seatfem.study.scene import SceneError, load_scene, located
from seatfem.study.sweep.cases import Case, cases_of
from seatfem.study.sweep.study import Study

LOOKED_AT: Final = 1000  # scenes of a larger study that are checked before its price is told
SAMPLED: Final = 3  # scenes that are planned: the first, the middle and the last
LANE: Final = 0.1  # of a scene marched side by side, over the march of one by itself with all energies
NOT_HERE: Final = ("program start", "compilation", "pictures", "files", *OF_THE_SEAT)
"""Stages that scenes of a study do without, or only the first one with a seat has."""


@dataclass(frozen=True)
class Ahead:
    """Predicted from the plans of a few scenes.

    Attributes:
        scenes, seats: how many there are to compute in full, and different seats among them.
        seconds: of one worker in all; ``start``: of that the program's, with what is compiled first.
        each, seat: of one scene without its seat, of a seat that is not there yet [s].
        memory: largest of a worker [bytes].
        beside: how many there are to march side by side; ``lane``: of one of them [s].
        looked_at: by how many all scenes are predicted; 0: by all.
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
        """Return the time by the clock [s]. The seats are waited for by all, the scenes are shared out."""
        shared = self.scenes * self.each + self.beside * self.lane
        return self.start + self.seats * self.seat + shared / max(1, min(workers, self.scenes + self.beside))

    def workers(self) -> int:
        """Return the number of workers: one a core, fewer where the memory that is there would not do."""
        return max(1, min(cores(), int(MEMORY * available_memory() / self.memory)))

    def as_json(self) -> str:
        """Return all of it as JSON, and the time with as many workers as there would be."""
        workers = self.workers()
        return json.dumps({**asdict(self), "workers": workers, "time_s": self.seconds(workers)}, indent=1)

    def in_words(self, workers: int) -> str:
        """Return it in one line."""
        seats = f" with {self.seats} seat{'s'[: self.seats > 1]} to compute" if self.seats else ""
        a_seat = f" {in_time(self.seat)} a seat," if self.seats else ""
        beside = f" and {self.beside} in batches" if self.beside else ""
        counted = f"{self.scenes} scene{'s'[: self.scenes > 1]}{beside}{seats}"
        return (
            f"{counted}: about {in_time(self.seconds(workers))} predicted with {workers} worker{'s'[: workers > 1]} "
            f"({in_time(self.each)} a scene,{a_seat} {self.memory / 1e9:.2g} GB a worker)"
            + (f"; based on {self.looked_at} scenes, drawn at random" if self.looked_at else "")
        )


def ahead_of_many(study: Study, file: Path | None = None) -> Ahead:
    """Return what a study of more than `LOOKED_AT` scenes would take, by so many of them, drawn.

    Raises `SceneError`: what is wrong with one of these; also what `ahead` raises.
    """
    count = study.number_of_scenes
    drawn = np.random.default_rng(study.seed).choice(count, LOOKED_AT, replace=False) + 1
    cases = cases_of(study, file=file, numbers=frozenset(drawn.tolist()))
    sample = ahead(study.scene, cases)
    times = count / len(cases) if 2 * sample.seats > len(cases) else 1.0  # few seats come again and again
    return replace(sample, scenes=count, seats=round(times * sample.seats), looked_at=len(cases))


def ahead(scene: Path, cases: Sequence[Case]) -> Ahead:
    """Return what these cases of the scene at a path will take. Raises what plans raise where none of the sampled
    scenes can be planned; one that cannot is in the table when it has been tried."""
    machine = Machine.known()
    last = len(cases) - 1
    chosen = [cases[place] for place in sorted({round(last * k / (SAMPLED - 1)) for k in range(SAMPLED)})]
    costs: list[Cost] = []
    problems: list[Exception] = []
    for case in chosen:
        try:
            costs.append(plan_scene(load_scene(scene, case.changed), machine).cost)
        except SceneError as error:
            problems.append(located(error, scene))
        except (ArithmeticError, LookupError, MemoryError, OSError, RuntimeError, ValueError) as error:
            problems.append(error)
    if not costs:
        raise problems[0]
    seats = [sum(cost.parts.get(stage, 0.0) for stage in OF_THE_SEAT) for cost in costs]
    each = [sum(spent for stage, spent in cost.parts.items() if stage not in NOT_HERE) for cost in costs]
    different = sum(not case.guides for case in cases) if max(seats) > 0 else 0
    memory = max(PROGRAM, *(cost.memory for cost in costs))
    alone = sum(case.way != "beside" for case in cases)
    march = sum(cost.parts["contact"] for cost in costs) / len(costs)
    start = machine.start + costs[0].parts.get("compilation", 0.0)
    seconds = start, sum(each) / len(each), max(seats)
    return Ahead(alone, different, *seconds, memory, len(cases) - alone, LANE * march)
