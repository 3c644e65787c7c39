"""Do the bars hold of runs whose model along the lip was chosen: one port in place of arcs, statics in place of waves?

    python benchmarks/coverage_of_models.py [seed [first [last]]]

draws flappers on lips, flat or tilted by 0.02 to 0.5 degrees, and judges the first round of each, as it was planned,
against `finer_scenes.finest_reference`, in arcs and with waves; scenes that were planned with arcs and waves at
once are left out, and from the twelfth on those with arcs. It appends a line per scene to
results/coverage_of_models.jsonl, leaving out those that are there, then writes results/coverage_of_models.csv, a row
per scene and measure. What one port and a beam would change by the pre-runs of every scene goes to
results/models_in_place.csv, with the processor time of all rounds, their number and their end, as planned and in arcs,
where one port was chosen.
"""

from __future__ import annotations

import csv
import json
import os
import tempfile
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter

import numpy as np
from coverage_of_runs import Verdict, bare_values, chosen, cover, written
from finer_scenes import finest_reference

from impact.progress import silent
from seatfem.machine.rates import Machine
from seatfem.machine.stopwatch import Stopwatch
from seatfem.structures.store import VARIABLE
from seatfem.study.impacts.simpler import BEAM, ONE_PORT
from seatfem.study.planning.plan import Plan
from seatfem.study.planning.planner import plan_scene
from seatfem.study.planning.seen import Seen
from seatfem.study.runs.rounds import Limits, rounds

SEED, SCENES, ALL = 503, 80, 12
FILE = Path(__file__).parent / "results" / "coverage_of_models.jsonl"
IN_PLACE = FILE.with_name("models_in_place.csv")
MEASURES = ("impulse", "filtered_peak")
COLUMNS = (
    *("seed", "index", "tilt_deg", "filter_us", "target", "ports", "level"),
    *(f"{model}_{name}" for model in (ONE_PORT, BEAM) for name in MEASURES),
    *(f"{what}{where}" for where in ("", "_in_arcs") for what in ("seconds", "rounds", "met")),
)
LONGEST = 600  # s for a scene and its reference


class Several(Exception):
    """Nothing simpler than arcs and waves was chosen."""


def draw_scene(index: int, seed: int = SEED) -> str:
    """Scene number ``index`` as TOML: one in eight tilted, about any axis."""
    rng = np.random.default_rng([seed, index])
    bore, width = rng.uniform(3.0, 6.0), rng.uniform(0.6, 1.6)
    paddle = 2 * (bore + width + rng.uniform(0.8, 3.0))
    neck = rng.uniform(0.3, 0.6) * paddle
    seat = (
        f'[seat]\nkind = "annular"\nbore_radius = "{bore:.4f} mm"\nlip_width = "{width:.4f} mm"\n'
        f'lip_height = "0.5 mm"\nlip_edge_radius = "0 mm"\nouter_radius = "{bore + width + rng.uniform(4, 8):.4f} mm"\n'
        f'thickness = "{rng.uniform(4, 10):.4f} mm"\nmaterial = "{rng.choice(["steel", "aluminium"])}"\n'
    )
    reed = (
        f'[reed]\nkind = "flapper"\nroot_width = "{rng.uniform(1.0, 1.5) * neck:.4f} mm"\ntaper_length = "2 mm"\n'
        f'neck_width = "{neck:.4f} mm"\nneck_length = "{rng.uniform(0.7, 1.3) * paddle:.4f} mm"\n'
        f'paddle_diameter = "{paddle:.4f} mm"\nthickness = "{rng.uniform(0.3, 0.7):.4f} mm"\n'
        f"damping_ratio = {rng.choice([0.0, 0.01])}\n"
        f'release = {{ mode = 1, velocity = "-{rng.uniform(0.5, 4):.4f} m/s" }}\n'
    )
    contact = f'[contact]\ngap = "{rng.uniform(0.5, 5):.4f} um"\n'
    if rng.random() < 0.125:
        contact += f'tilt = "{10 ** rng.uniform(-1.7, -0.3):.4f} deg"\ntilt_axis = "{rng.uniform(0, 360):.3f} deg"\n'
    run = f'[run]\nduration = "{rng.uniform(0.1, 0.2):.4f} ms"\nfilter_width = "{rng.uniform(3, 15):.4f} us"\n'
    asked = MEASURES[: rng.integers(1, 3)]
    target = f"target = {10 ** rng.uniform(-1.1, -0.6):.5f}\n"
    return f"{seat}{reed}{contact}{run}[accuracy]\n{target}measures = {json.dumps(asked)}\n"


def judge(index: int, seed: int) -> Verdict:
    """The first round of one scene, and its reference. Raises `Several` where there is nothing to judge."""
    start = perf_counter()
    with written(draw_scene(index, seed)) as (scene, folder):
        plan = plan_scene(scene)
        ports, level = plan.method.ports or 1, plan.level
        spent = [*_spent(plan), *_spent(plan_scene(scene, without=(ONE_PORT,)))] if ports == 1 else []
        _note(plan, index, seed, spent)
        if ports > 1 and (level != "spring" or index >= ALL):
            raise Several(f"{ports} ports, {level}")
        *_, done = rounds(plan, folder, Stopwatch(), silent, limits=Limits(rounds=1))
        exact = finest_reference(done)[1].values
    values = {name: value for name, value in bare_values(done).items() if name not in done.without_bar}
    bars, seconds = {name: done.left.bar(name) for name in values}, perf_counter() - start
    striker = f"{scene.reed.kind}, {ports} port{'s'[: ports > 1]}"
    return Verdict.of(done, (seed, index), values, bars, exact, striker=striker, seconds=seconds)


def _spent(plan: Plan) -> tuple[float, int, bool]:
    """Processor seconds of all rounds of a plan, mesher included; how many, and whether they met the target. The modes
    of the plate are known, no seat is."""
    with tempfile.TemporaryDirectory() as folder:
        before = sum(os.times()[:4])
        *_, done = rounds(plan, Path(folder), Stopwatch(), silent)
        spent = sum(os.times()[:4]) - before
    for seat in Path(os.environ[VARIABLE]).glob("*.h5"):
        seat.unlink()
    return spent, done.number, done.met


def _note(plan: Plan, index: int, seed: int, spent: Sequence[float | bool]) -> None:
    """A row of `IN_PLACE`."""
    scene = plan.scene
    surrogate = scene.seat.surrogate(scene.run.duration, scene.reed.face)
    simpler = Seen.of(scene, surrogate, Machine.known()).simpler
    numbers = (np.degrees(scene.contact.tilt), 1e6 * scene.run.filter_width, scene.accuracy.target)
    changes = [simpler.get(model, {}).get(name, np.nan) for model in (ONE_PORT, BEAM) for name in MEASURES]
    new = not IN_PLACE.exists()
    with IN_PLACE.open("a", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        if new:
            writer.writerow(COLUMNS)
        row = [seed, index, *numbers, plan.method.ports, plan.level, *changes, *spent]
        writer.writerow(f"{cell:.3g}" if isinstance(cell, float) else cell for cell in row)


def main() -> None:
    """Run what is missing, write the table, print the shares."""
    cover(FILE, *chosen(SEED, SCENES), judge, LONGEST, Several)


if __name__ == "__main__":
    main()
