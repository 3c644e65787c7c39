"""Processor time of the margins of all points on the surface of the demo's seat, by criteria of both kinds.

python benchmarks/margin_map.py
"""

from __future__ import annotations

import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from seatfem.machine.stopwatch import Stopwatch
from seatfem.study.planning.planner import plan_scene
from seatfem.study.runs.margin_map import margins
from seatfem.study.runs.rounds import rounds
from seatfem.study.runs.seat_stress import by_port, seat_stress
from seatfem.study.scene import load_scene

EXAMPLES = Path(__file__).parents[1] / "examples"
STRENGTH = EXAMPLES / "strengths" / "invented_strength.toml"
TABLES = '\n[stress]\n[life]\nseat_strength = "{strength}"\ncycles = 4.5e9\nmultiaxial = "{criterion}"\n'


def main() -> None:
    demo = (EXAMPLES / "flapper_on_peek_sleeve.toml").read_text(encoding="utf-8")
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "scene.toml"
        file.write_text(demo + TABLES.format(strength=STRENGTH, criterion=""), encoding="utf-8")
        *_, done = rounds(plan_scene(load_scene(file)), Path(folder), Stopwatch(), lambda stage, share: None)
        stress = seat_stress(done)
        assert stress is not None
        force, dt = -by_port(done, done.touches, len(stress.model.ports)), done.result.dt
        sys.stdout.write(f"{len(stress.sites)} points, {len(force) - 1} steps\n")
        for criterion in ("", "crossland", "dang_van"):
            file.write_text(demo + TABLES.format(strength=STRENGTH, criterion=criterion), encoding="utf-8")
            life = load_scene(file).life
            assert life is not None
            demand = life.demand("seat")
            assert demand is not None
            began = time.process_time()
            found = margins(stress.field, force, dt, demand)
            spent = time.process_time() - began
            judged = int(np.isfinite(found).sum())
            name = criterion or "goodman, critical plane"
            sys.stdout.write(
                f"{name:24s} {spent:6.1f} s, {judged} points judged, least margin {np.nanmin(found):.4g}\n"
            )


if __name__ == "__main__":
    main()
