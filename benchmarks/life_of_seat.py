"""Fatigue map of the PEEK sleeve's seat: its surface over a block that repeats."""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from pathlib import Path
from time import process_time

import numpy as np
from scenes import SLEEVE
from table import Table, publish

from impact.life.critical_plane import on_planes
from impact.life.curves import basquin
from impact.life.maps import SHARE
from impact.life.mean_stress import Goodman
from impact.life.multiaxial import Crossland
from impact.life.places import Demand, judged
from impact.life.strength import Strength
from impact.progress import silent
from seatfem.machine.stopwatch import Stopwatch
from seatfem.structures.fields.recovery import mises_range, tensor_histories
from seatfem.study.planning.planner import plan_scene
from seatfem.study.runs.rounds import rounds
from seatfem.study.runs.seat_stress import by_port, seat_stress
from seatfem.study.scene import load_scene

INVENTED = Strength("invented for this benchmark", ultimate=1.8e9, curve=basquin(400e6, 1e7, 12.0))


def rows() -> Iterator[tuple[str, ...]]:
    """Cycles on critical planes, and Crossland's criterion, by points."""
    with tempfile.TemporaryDirectory() as place:
        file = Path(place) / "demo.toml"
        file.write_text(f"{SLEEVE.read_text(encoding='utf-8')}\n[stress]\n", encoding="utf-8")
        done = next(rounds(plan_scene(load_scene(file)), Path(place), Stopwatch(), silent))
    start = process_time()
    stress = seat_stress(done)
    assert stress is not None
    force, dt = -by_port(done, done.touches, stress.field.static.shape[2]), done.result.dt
    points, modes = stress.field.modal.shape[0], stress.field.modal.shape[2]
    size = f"{points} points, {modes} modes, {len(force)} steps"
    yield "stress field, largest, error bar", f"{process_time() - start:.1f} s", size
    start = process_time()
    ranges = mises_range(stress.field, force, dt)
    yield "ranges of all points", f"{process_time() - start:.1f} s", "looked at twice a radian"
    demand = Demand(INVENTED, Goodman(1.8e9), 4.5e9, several_axes=Crossland(310e6, 500e6))
    for share in (SHARE, 0.0):
        start, margins, hot = process_time(), [], np.flatnonzero(ranges >= share * ranges.max())
        for tensors in tensor_histories(stress.field.at(hot), force, dt):
            margins.append(judged(on_planes([("", tensors)], tensors=True), demand))
        worst = min(each.life.margin for each in margins if each.life is not None)
        seconds = process_time() - start
        what = f"margins of {len(hot)} points from {share:.0%} of the largest range"
        yield what, f"{seconds:.1f} s", f"{1e3 * seconds / len(hot):.0f} ms a point; least margin {worst:.4g}"


if __name__ == "__main__":
    notes = (
        "The PEEK sleeve's seat, its surface away from singular edges, over its run as one block; one core's time.",
        "Margins on all critical planes, by Goodman, and by Crossland; strength invented. Aim: less than 120 s.",
    )
    publish("life_of_seat", Table("Fatigue map of a seat", notes, ("what", "time", "besides"), tuple(rows())))
