"""What the error budget costs on top of the plain run, stage by stage of the same run."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from table import Table, publish

import impact
from impact.progress import silent
from impact.storage.hdf5 import save_results
from seatfem.machine.stopwatch import Stopwatch
from seatfem.structures.store import VARIABLE
from seatfem.study.impacts.contact import run_contacts, stress_of
from seatfem.study.planning.planner import plan_scene
from seatfem.study.runs.rounds import rounds
from seatfem.study.scene import Scene, load_scene

SCENES = (
    "flapper_on_annular_seat", "flapper_on_stopper", "flapper_on_spring", "paper_table1_30mm_area",
    "paper_table1_3mm_strip",
)  # fmt: skip
TARGET = 0.01  # the level "standard"
ROUNDS = 2
BUDGET = ("error budget", "mesh error")


def main() -> None:
    """Every scene, its seat computed anew each time; the shortest time of each stage."""
    rows = []
    for name in SCENES:
        scene = load_scene(Path(__file__).parents[1] / "examples" / f"{name}.toml")
        best: dict[str, float] = {}
        for _ in range(ROUNDS):
            for stage, seconds in _stages(with_target(scene, TARGET)).items():
                best[stage] = min(best.get(stage, seconds), seconds)
        budget = sum(best.get(stage, 0.0) for stage in BUDGET)
        plain = sum(seconds for stage, seconds in best.items() if stage not in BUDGET)
        mesh = best.get("mesh error", 0.0)
        rows.append((name, *(f"{t:.2f}" for t in (plain, mesh, budget - mesh)), f"{budget / plain:.0%}"))
    notes = (
        "Seconds; the plain run is seat, contact, spring baseline, the reed's stress and the files, no pictures.",
        f"The shortest of {ROUNDS} runs of each stage, at the level `standard`. Aim: the budget costs at most 60 %.",
    )
    columns = ("scene", "plain run", "coarser mesh", "bare runs", "budget over plain run")
    publish("budget_cost", Table("Cost of the error budget", notes, columns, tuple(rows)))


def with_target(scene: Scene, target: float) -> Scene:
    """The same asked for more or less exactly."""
    return scene.model_copy(update={"accuracy": scene.accuracy.model_copy(update={"target": target})})


def _stages(scene: Scene) -> Mapping[str, float]:
    """Of one round, with an empty store."""
    watch = Stopwatch()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        os.environ[VARIABLE] = f"{name}/store"
        plan = plan_scene(scene)
        undemanding = replace(plan, scene=with_target(plan.scene, 0.99))  # no second round
        *_, done = rounds(undemanding, folder, watch, silent)
        spring = impact.spring(stiffness=1.0 / float(done.seat.greens.static_compliance()[0, 0]))
        with watch("spring baseline"):
            baseline = run_contacts(done.plan.scene, done.striker, spring, done.result.dt).seat
        with watch("reed stress"):
            stress_of(done.plan.scene, done.striker, baseline.force, baseline.dt, baseline.gap)
        with watch("files"):
            save_results(folder / "result.h5", {"wave": done.result, "spring": baseline}, {})
    return watch.stages


if __name__ == "__main__":
    main()
