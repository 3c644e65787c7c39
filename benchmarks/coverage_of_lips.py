"""Do the error bars of contacts along a lip cover the true errors? Random plates on random lips, tilted and not.

    python benchmarks/coverage_of_lips.py [seed [first [last]]]

appends a line per scene to results/coverage_of_lips.jsonl, leaving out those that are there, then writes
results/coverage_of_lips.csv, a row per scene and measure. The reference is `finer_scenes.finest_reference`.
"""

from __future__ import annotations

import json
from pathlib import Path
from time import perf_counter

import numpy as np
from coverage_of_runs import Verdict, bare_values, chosen, cover, written
from finer_scenes import finest_reference

from impact.progress import silent
from seatfem.machine.stopwatch import Stopwatch
from seatfem.study.planning.planner import plan_scene
from seatfem.study.runs.rounds import Limits, rounds

SEED, SCENES = 406, 32
FILE = Path(__file__).parent / "results" / "coverage_of_lips.jsonl"
MEASURES = ("impulse", "filtered_peak", "contact_duration", "line_force", "line_impulse")
ROUNDS = 2
LONGEST = 150  # s of processor time for a scene and its reference


def draw_scene(index: int, seed: int = SEED) -> str:
    """Scene number ``index`` as TOML: a third of them flat, the others tilted by up to 1.2 degrees about any axis."""
    rng = np.random.default_rng([seed, index])
    bore = rng.uniform(3.0, 6.0)
    width = rng.uniform(0.6, 1.6)
    paddle = 2 * (bore + width + rng.uniform(0.8, 3.0))
    neck = rng.uniform(0.3, 0.6) * paddle
    seat = (
        f'[seat]\nkind = "annular"\nbore_radius = "{bore:.4f} mm"\nlip_width = "{width:.4f} mm"\n'
        f'lip_height = "0.5 mm"\nlip_edge_radius = "{rng.choice([0.0, 0.1])} mm"\n'
        f'outer_radius = "{bore + width + rng.uniform(4, 8):.4f} mm"\nthickness = "{rng.uniform(4, 10):.4f} mm"\n'
        f'material = "{rng.choice(["steel", "aluminium"])}"\ndamping_ratio = {rng.choice([0.0, 0.02])}\n'
    )
    reed = (
        f'[reed]\nkind = "flapper"\nroot_width = "{rng.uniform(1.0, 1.5) * neck:.4f} mm"\ntaper_length = "2 mm"\n'
        f'neck_width = "{neck:.4f} mm"\nneck_length = "{rng.uniform(0.7, 1.3) * paddle:.4f} mm"\n'
        f'paddle_diameter = "{paddle:.4f} mm"\nthickness = "{rng.uniform(0.25, 0.6):.4f} mm"\n'
        f'damping_ratio = {rng.choice([0.0, 0.01])}\nrelease = {{ velocity = "-{rng.uniform(0.5, 4):.4f} m/s" }}\n'
    )
    contact = f'[contact]\ngap = "{rng.uniform(0.5, 5):.4f} um"\n'
    if rng.random() < 2 / 3:
        contact += f'tilt = "{10 ** rng.uniform(-1.3, 0.08):.4f} deg"\ntilt_axis = "{rng.uniform(0, 360):.3f} deg"\n'
    if rng.random() < 0.25:
        contact += f'offset = ["{rng.uniform(-0.5, 0.5):.4f} mm", "{rng.uniform(-0.5, 0.5):.4f} mm"]\n'
    if rng.random() < 0.2:
        heights = rng.uniform(0, 10, 4)
        rows = ", ".join(f'["{90 * k} deg", "{height:.3f} um"]' for k, height in enumerate(heights))
        contact += f"waviness = [{rows}]\n"
    if rng.random() < 0.2:
        contact += f'[stopper]\nkind = "spring"\nstiffness = "20 N/um"\nlift = "{rng.uniform(0.05, 0.3):.4f} mm"\n'
    asked = sorted(rng.choice(MEASURES, size=rng.integers(1, 4), replace=False))
    run = f'[run]\nduration = "{rng.uniform(0.12, 0.25):.4f} ms"\nfilter_width = "{rng.uniform(1, 5):.4f} us"\n'
    target = f"target = {10 ** rng.uniform(-1.5, -0.8):.5f}\n"
    return f"{seat}{reed}{contact}{run}[accuracy]\n{target}measures = {json.dumps(asked)}\n"


def judge(index: int, seed: int) -> Verdict:
    """One scene: run as planned, and its reference."""
    start = perf_counter()
    with written(draw_scene(index, seed)) as (scene, folder):
        limits = Limits(rounds=ROUNDS)
        *_, done = rounds(plan_scene(scene), folder, Stopwatch(), silent, limits=limits)
        exact = finest_reference(done)[1].values
    values = {name: value for name, value in bare_values(done).items() if name not in done.without_bar}
    bars, seconds = {name: done.left.bar(name) for name in values}, perf_counter() - start
    return Verdict.of(done, (seed, index), values, bars, exact, seconds=seconds)


def main() -> None:
    """Run what is missing, write the table, print the shares."""
    cover(FILE, *chosen(SEED, SCENES), judge, LONGEST)


if __name__ == "__main__":
    main()
