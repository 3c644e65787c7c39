"""One point of the trade: a scene at one fidelity, computed and timed in a process of its own.

`python -m seatfem.study.trade.point` answers each job, a line of JSON, with its outcome.
"""

import json
import math
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final

from impact.march.history import Engine
from seatfem.jobs import processes, worker
from seatfem.machine.resources import Stopwatch, peak_memory
from seatfem.structures.cache import build
from seatfem.structures.rings import Division
from seatfem.study.impacts import contact, landings, validity
from seatfem.study.impacts.bodies import solve_body, stopper_of, striker_of
from seatfem.study.impacts.touches import measured, stress_since
from seatfem.study.method import FIELDS, REED_BAND, has_key, stated_method, written
from seatfem.study.planning.plan import Plan
from seatfem.study.scene import Scene, load_scene
from seatfem.study.sweep.outcome import FAILURES, Outcome

Settings = Mapping[str, object]
"""Values by dotted key, written as in a scene file ("1 mm"); ``None`` removes the key."""

ALL_OPEN: Final[Settings] = dict.fromkeys(key for key in FIELDS if key != REED_BAND)  # keys left to the planner


def stated_choices(plan: Plan) -> Settings:
    """Return all choices of a plan that determine the fidelity, as settings."""
    values = {key: plan.method.value(key) for key in FIELDS if has_key(plan.scene, key)}
    return {key: written(key, value) for key, value in values.items() if value is not None}


PROCESSOR: Final = "processor_s"
COSTS: Final = (PROCESSOR, "memory_bytes", "start_s")
"""Processor seconds of all threads, gmsh included, or the limit if stopped; largest memory of the process; seconds from
the start of the process to that of the computation."""
ABOUT: Final = (landings.STATUS, "seat_model", "seat_dof", "seat_poles", "reduction", "time_step_s", "engine")
REPEATED_BELOW: Final = 4.0  # processor time below which a point is run twice, as the first run loads and compiles [s]


@dataclass(frozen=True)
class Point:
    """A scene at one fidelity.

    Attributes:
        name: unique name.
        family: model of the seat: "spring", "rod", "axisymmetric", "harmonics", "sector", "3d", "as given".
        varied: key that differs from the centre: "diagonal" (mesh and band together), "mesh", "order", "band", ...
        settings: values of keys of the scene.
        engine: convolution engine of the run.
        in_place: name of a simpler model that replaces the contact along a lip: `ONE_PORT`, `BEAM`; "" for none.
        after: name of a coarser point that must have ended before this one is tried.
        least_steps: least number of time steps per filter width, if the scene does not state the step.
        predicted: predicted time [s], 0 if unknown; points predicted to take far too long are not tried.
    """

    name: str
    family: str
    varied: str
    settings: Settings = field(default_factory=dict)
    engine: Engine = "auto"
    in_place: str = ""
    after: str = ""
    least_steps: int = 1
    predicted: float = 0.0


def carry_out(path: Path, point: Point, start: float = math.nan) -> Outcome:
    """Compute the point's seat, contact and measures, without error bars, files and pictures; failures are outcomes.

    The summary has the measures [SI] by name, `ABOUT` and `COSTS`. ``start``: time that the program took to load [s].
    """
    loaded = {"start_s": start}
    try:
        scene = load_scene(path, point.settings)
        contact.check_step(scene)
        wall, processor, summary = _timed(scene, point)
        if processor < REPEATED_BELOW:
            wall, processor, summary = _timed(scene, point)
    except FAILURES as error:
        return Outcome.of_failure(error, summary=loaded)
    costs = {PROCESSOR: processor, "memory_bytes": peak_memory(), **loaded}
    return Outcome("done", "", wall, {**summary, **costs})


def _timed(scene: Scene, point: Point) -> tuple[float, float, dict[str, Any]]:
    """Return wall and processor time [s], and the summary."""
    wall, processor, watch = time.perf_counter(), _processor_time(), Stopwatch()
    method = stated_method(scene)
    if point.in_place:
        method = method.along(scene.geometry, 1)
    duration = scene.run.duration
    seat = build(scene.seat, method.seat, duration, watch=watch, mesh_error=False)
    solved = solve_body("reed", scene.reed, method.reed, duration, mesh_error=False)
    striker = striker_of(scene, method.reed.n_modes, None if solved is None else solved.greens)
    if point.in_place:
        striker = dict(validity.simpler_bodies(scene, striker, Division()))[point.in_place]
    longest = scene.run.filter_width / point.least_steps
    stopper = stopper_of(scene)
    greens = (striker.greens, seat.greens) if stopper is None else (striker.greens, seat.greens, stopper.greens)
    step = method.time_step or min(longest, contact.fallback_step(scene.run, scene.gas, *greens))
    contact.check_length(scene, step, method.seat.division.count)
    with watch("contact"):
        touches = contact.run_contacts(scene, striker, seat.greens, step, engine=point.engine)
    result = touches.seat
    since = stress_since(touches, scene.accuracy.landing)
    stress = contact.stress_in_run(scene.geometry, striker, touches, since=since)
    never = dict.fromkeys(scene.accuracy.judged, 0.0)
    values = {**never, **measured(touches, scene.run.filter_width, stress, scene.accuracy.landing)}
    about = (
        landings.LANDED if touches.landings is None else touches.landings.status,
        seat.about.get("seat_model", ""),
        seat.about.get("seat_dof", 0),
        seat.greens.marched_poles(step, duration / step) or 0,
        seat.greens.provenance.get("method", ""),
        step,
        result.engine,
    )
    stages = {f"stage_{name}_s": round(spent, 4) for name, spent in watch.stages.items()}
    summary = {**values, **dict(zip(ABOUT, about, strict=True)), **stages}
    return time.perf_counter() - wall, _processor_time() - processor, summary


def _processor_time() -> float:
    """Return the processor time of all threads of this process and its child processes (gmsh) [s]."""
    try:
        import resource  # absent on Windows
    except ImportError:
        return time.process_time()
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(u.ru_utime + u.ru_stime for u in used)


def _reply(line: str) -> str:
    """Return the outcome of one job, after limiting the processor time."""
    job: dict[str, Any] = json.loads(line)
    processes.limit_process(seconds=math.ceil(job["limit"]))
    point = Point(**job["point"], settings=job["changed"])
    return json.dumps(asdict(carry_out(Path(job["path"]), point, time.time() - job["begun"])))


if __name__ == "__main__":
    worker.answer_lines(_reply)
