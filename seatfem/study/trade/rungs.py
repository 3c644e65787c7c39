"""Points of a scene in the measured trade, on the ladders of `seatfem.study.ladders.table`, and the run of one point.

The points are the states from the first values of a run to its converged ones, all keys a rung finer from state to
state; the converged state with one key at its first value, or a rung finer; and all keys a rung finer, and two.
"""

import json
import math
import os
import time
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Final

from seatfem.jobs import processes
from seatfem.jobs.folders import private_folder
from seatfem.machine.code import VARIABLE
from seatfem.machine.resources import Stopwatch, peak_memory
from seatfem.study.impacts import contact, landings
from seatfem.study.impacts.touches import measured
from seatfem.study.impacts.validity import ONE_PORT
from seatfem.study.ladders.table import LADDERS, described
from seatfem.study.method import FIELDS, MODEL, MODES, PORTS, RunMethod, has_key, stated_method
from seatfem.study.plan import Plan
from seatfem.study.runs.converge import LEAST
from seatfem.study.runs.rounds import solve
from seatfem.study.scene import Scene, load_scene
from seatfem.study.sweep.runner import FAILURES, Outcome

ALL_OPEN: Final[Mapping[str, object]] = dict.fromkeys(
    key for key in FIELDS if not key.startswith("reed.") or key == MODES
)
"""Keys that a trade takes out of the scene: those that a run chooses."""
PROCESSOR, MEMORY = "processor_s", "memory_bytes"
"""Keys of the costs: processor time of all threads, mesher included, or the limit if stopped [s]; peak memory of the
process [B]."""
OWN_CHOICE: Final = "the run's own choice"
AS_FILED: Final = "as the file says"


@dataclass(frozen=True)
class Point:
    """A scene at one fidelity.

    Attributes:
        name: name, unique among the points of a trade.
        varied: the key that differs from the converged state, or "all keys".
        values: values of `FIELDS` [SI].
        settings: keys that are replaced in the scene, or taken out of it (``None``).
    """

    name: str
    varied: str
    values: Mapping[str, Any] = field(default_factory=dict)
    settings: Mapping[str, object] = field(default_factory=lambda: ALL_OPEN)


def finer_in_all(scene: Scene, method: RunMethod) -> RunMethod:
    """Return a method with every key one rung finer, which divides its error by `LEAST`, as far as there are rungs."""
    method = replace(method, given=frozenset())
    for ladder in LADDERS:
        method = ladder.refine(scene, method, LEAST)
    return method


def states(scene: Scene, start: RunMethod, end: RunMethod) -> list[RunMethod]:
    """Return methods from a first one to an ``end``: of each, the keys are a rung finer, as far as those of the end."""

    def is_between(first: Any, value: Any, last: Any) -> bool:
        numbers = all(isinstance(each, int | float) for each in (first, value, last))
        return numbers and (first < value < last or first > value > last)

    ascending = [start]
    while ascending[-1].values != end.values:
        finer, before = finer_in_all(scene, ascending[-1]).values, ascending[-1].values
        values = {k: finer[k] if is_between(before[k], finer[k], last) else last for k, last in end.values.items()}
        ascending.append(end if values == before else end.with_values(scene.geometry, values))
    return ascending


def around(scene: Scene, start: RunMethod, end: RunMethod) -> Iterator[Point]:
    """Yield the converged state with one key at its first value or one rung finer, and with other levels of the seat's
    model."""
    free, first = replace(end, given=frozenset()), start.values
    together = {key for ladder in LADDERS for key in ladder.also}
    for ladder in LADDERS:
        if ladder.key in together or (ladder.key in FIELDS and not has_key(scene, ladder.key)):
            continue
        keys = [key for key in (ladder.key, *ladder.also) if key in FIELDS]
        coarser = end.with_values(scene.geometry, {key: first[key] for key in keys})
        for method in (coarser, ladder.refine(scene, free, LEAST)):
            if method.values != end.values:
                yield _varied(PORTS if ladder.key == ONE_PORT else ladder.key, method)
    if end.ports is None:  # a lip needs its own level
        for other in scene.seat.levels():
            if other.applies and other.level not in (first[MODEL], end.value(MODEL)):
                yield _varied(MODEL, end.replaced({MODEL: other.level}))


def _varied(key: str, method: RunMethod) -> Point:
    return Point(f"{key} {described(key, method.value(key)) if key in FIELDS else 'finer'}", key, method.values)


def carry_out(path: Path, point: Point, limit: float = math.inf) -> Outcome:
    """Compute seat, contact and measures of a point without error bars, files or pictures; a failure is an `Outcome`.

    It is computed twice where the ``limit`` of processor time allows [s], as the first time loads and compiles. The
    summary has the measures [SI] by name, the status of the landing, unknowns, step and costs.
    """
    try:
        scene = load_scene(path, point.settings)
        contact.check_step(scene)
        plan = Plan(scene, stated_method(scene).with_values(scene.geometry, point.values), ())
        wall, processor, summary = _timed(plan)
        if _processor_time() + processor < limit:
            wall, processor, summary = _timed(plan)
    except FAILURES as error:
        return Outcome.of_failure(error)
    return Outcome("done", "", wall, {**summary, PROCESSOR: processor, MEMORY: peak_memory()})


def _timed(plan: Plan) -> tuple[float, float, dict[str, Any]]:
    """Compute a plan once; return wall time and processor time [s], and the summary."""
    wall, processor, scene = time.perf_counter(), _processor_time(), plan.scene
    done = solve(plan, Stopwatch(), mesh_error=False)
    touches = done.touches
    values = measured(touches, scene.run.filter_width, done.stress, scene.accuracy.landing)
    summary = {
        **dict.fromkeys(scene.accuracy.judged, 0.0),  # of a run without contact
        **values,
        landings.STATUS: landings.LANDED if touches.landings is None else touches.landings.status,
        "seat_dof": done.seat.about.get("seat_dof", 0),
        "time_step_s": done.result.dt,
    }
    return time.perf_counter() - wall, _processor_time() - processor, summary


def _processor_time() -> float:
    """Return the processor time of all threads of this process and of those it started (the mesher) [s]."""
    times = os.times()
    return time.process_time() + times.children_user + times.children_system


def reply(text: str) -> str:
    """Return the outcome of one job, within its processor time and in a folder without caches."""
    job: dict[str, Any] = json.loads(text)
    point = Point(**job["point"], settings=job["changed"])
    processes.limit_process(seconds=math.ceil(job["limit"]))
    with private_folder("point") as folder:
        os.environ[VARIABLE] = str(folder)
        return json.dumps(asdict(carry_out(Path(job["path"]), point, job["limit"])))
