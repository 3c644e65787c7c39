"""One point of the trade: a scene at one fidelity, carried out and measured in a process of its own.

`python -m seatfem.study.trade.point` answers each job, a line of JSON, with its outcome.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, Final, Literal

from impact.march.engines import Engine
from seatfem.jobs.limits import limit_process
from seatfem.jobs.worker import answer_lines
from seatfem.machine.memory import peak_memory
from seatfem.machine.stopwatch import Stopwatch
from seatfem.structures.rings import Division
from seatfem.study.impacts.contact import (
    check_length,
    check_step,
    run_contacts,
    seat_of,
    solved_striker,
    stopper_of,
    stress_of,
    striker_of,
    time_step,
)
from seatfem.study.impacts.gas import lift_of
from seatfem.study.impacts.landed import LANDED, STATUS
from seatfem.study.impacts.measures import measured, stress_since
from seatfem.study.impacts.simpler import simpler_bodies
from seatfem.study.method import FIELDS, REED_BAND, RunMethod, has_key, stated_method
from seatfem.study.scene import Scene, load_scene

Settings = Mapping[str, object]
"""Values by dotted key, written as in a scene file ("1 mm"); ``None`` takes the key out of the file."""

UNITS: Final = {
    "seat.mesh.size": "m",
    "seat.mesh.contact_size": "m",
    "seat.greens.bandwidth": "Hz",
    "run.time_step": "s",
    REED_BAND: "Hz",
}
ALL_OPEN: Final[Settings] = dict.fromkeys(key for key in FIELDS if key != REED_BAND)  # of bars none is chosen


def scene_with(path: Path, settings: Settings) -> Scene:
    """Return the scene of a file with ``settings`` stated: a planner obeys them, and chooses what is taken out.

    Raises:
        SceneError: a value that does not belong in a scene.
    """
    return load_scene(path, settings)


def written(key: str, value: object) -> object:
    """Return an SI value of a key as a scene file has it: ``"0.001 m"``."""
    return f"{value!r} {UNITS[key]}" if key in UNITS else value


def stated_choices(scene: Scene, method: RunMethod) -> Settings:
    """Return everything that decides the fidelity of a planned scene, as settings."""
    values = {key: method.value(key) for key in FIELDS if has_key(scene, key)}
    return {key: written(key, value) for key, value in values.items() if value is not None}


REPEATED_BELOW: Final = 4.0  # processor s; less is measured twice and the second counts: the first loads and compiles


@dataclass(frozen=True)
class Point:
    """A scene at one fidelity.

    Attributes:
        name: unique in its ladder.
        family: the model of the seat: "spring", "rod", "axisymmetric", "harmonics", "sector", "3d", "as given".
        varied: what of the centre is changed: "diagonal" (mesh and band together), "mesh", "order", "band", ...
        settings: what the scene is made to say.
        engine: of the history.
        in_place: of the contact along a lip, a simpler model by its name: `ONE_PORT`, `BEAM`.
        after: name of a coarser point without whose end this one is not tried.
        least_steps: in the width of the filter, where the scene leaves the step open.
        predicted: seconds, where they are; what is predicted to take far too long is not tried.
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


@dataclass(frozen=True)
class Outcome:
    """Cost and measures of a point, or why there are none.

    Attributes:
        state: "done"; "stopped" at the time limit; "failed" with the reason.
        wall, processor: seconds of the computation by the clock and of all its threads, mesher included; of a stopped
            one ``processor`` is the limit.
        memory: largest of the process [bytes].
        start: seconds from the start of the process to the beginning of the computation.
        values: measures [SI] by name.
        about: whether it landed, level, unknowns, poles, step and such.
    """

    state: Literal["done", "stopped", "failed"]
    reason: str = ""
    wall: float = math.nan
    processor: float = math.nan
    memory: float = math.nan
    start: float = math.nan
    values: Mapping[str, float] = field(default_factory=dict)
    about: Mapping[str, object] = field(default_factory=dict)


def carry_out(path: Path, point: Point, start: float = math.nan) -> Outcome:
    """Compute the point's seat, contact and measures; no error bars, files, pictures. Whatever fails is the outcome.

    ``start``: seconds that the program took to load.
    """
    try:
        scene = scene_with(path, point.settings)
        check_step(scene)
        wall, processor, values, about = _timed(scene, point)
        if processor < REPEATED_BELOW:
            wall, processor, values, about = _timed(scene, point)
    except (ArithmeticError, AssertionError, LookupError, MemoryError, OSError, RuntimeError, ValueError) as error:
        return Outcome("failed", f"{type(error).__name__}: {error}", start=start)
    return Outcome("done", "", wall, processor, peak_memory(), start, values, about)


def _timed(scene: Scene, point: Point) -> tuple[float, float, Mapping[str, float], dict[str, object]]:
    wall, processor, watch = time.perf_counter(), _processor_time(), Stopwatch()
    method = stated_method(scene)
    if point.in_place:
        method = method.along(scene, 1)
    seat = seat_of(scene, method=method.seat, watch=watch, mesh_error=False)
    solved = solved_striker(scene, method=method.reed, mesh_error=False)
    striker = striker_of(scene, method.reed.n_modes, None if solved is None else solved.greens)
    if point.in_place:
        striker = dict(simpler_bodies(scene, striker, Division()))[point.in_place]
    longest = scene.run.filter_width / point.least_steps
    stopper = stopper_of(scene)
    greens = (striker.greens, seat.greens) if stopper is None else (striker.greens, seat.greens, stopper.greens)
    step = method.time_step or min(longest, time_step(scene, *greens))
    check_length(scene, step, method.seat.division.count)
    with watch("contact"):
        touches = run_contacts(scene, striker, seat.greens, step, engine=point.engine)
    result = touches.seat
    since, met = stress_since(touches, scene.accuracy.landing), touches.stopper_force
    stress = stress_of(scene, striker, result.force, result.dt, lift_of(touches), stopper=met, since=since)
    never = dict.fromkeys(scene.accuracy.judged, 0.0)
    values = {**never, **measured(touches, scene.run.filter_width, stress, scene.accuracy.landing)}
    about: dict[str, object] = {
        STATUS: LANDED if touches.landings is None else touches.landings.status,
        "seat_model": seat.about.get("seat_model", ""),
        "seat_dof": seat.about.get("seat_dof", 0),
        "seat_poles": seat.greens.marched_poles(step, scene.run.duration / step) or 0,
        "reduction": seat.greens.provenance.get("method", ""),
        "time_step_s": step,
        "engine": result.engine,
        "stages_s": {name: round(spent, 4) for name, spent in watch.stages.items()},
    }
    return time.perf_counter() - wall, _processor_time() - processor, values, about


def _processor_time() -> float:
    """Return the processor time of all threads of this process and of those it started (the mesher) [s]."""
    try:
        import resource  # absent on Windows
    except ImportError:
        return time.process_time()
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(u.ru_utime + u.ru_stime for u in used)


def _reply(line: str) -> str:
    """Return the outcome of one job, within its processor time."""
    job: dict[str, Any] = json.loads(line)
    limit_process(seconds=math.ceil(job["limit"]))
    return json.dumps(asdict(carry_out(Path(job["scene"]), Point(**job["point"]), time.time() - job["begun"])))


if __name__ == "__main__":
    answer_lines(_reply)
