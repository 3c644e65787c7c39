"""Do the error bars of stress cover the true errors? Random beams and plates on random seats, [stress] asked for.

    python benchmarks/coverage_of_stress.py [seed [first [last]]]

appends a line per scene to results/coverage_of_stress.jsonl, leaving out those that are there, then writes
results/coverage_of_stress.csv, a row per scene and measure. The reference is `finer_scenes.finest_reference`, finer in
every key but one: the struck patch has as many parts as in the run, for how a face spreads its force is model. Its
stress is recovered on its own meshes from its own force.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np
from coverage_of_runs import Verdict, chosen, cover, written
from coverage_of_seats import annular, bar, block, conical
from finer_scenes import LADDER, finer_round, finest_reference

from impact.progress import silent
from seatfem.machine.stopwatch import Stopwatch
from seatfem.study.planning.planner import plan_scene
from seatfem.study.runs.reed_stress import plate_reed_stress
from seatfem.study.runs.rounds import Limits, Round, rounds
from seatfem.study.runs.seat_stress import seat_stress
from seatfem.study.runs.stresses import REED, SEAT, TENSION, stresses

SEED, SCENES = 602, 30
FILE = Path(__file__).parent / "results" / "coverage_of_stress.jsonl"
SEATS = ("annular", "conical", "annular", "rod", "bar", "conical", "annular", "block")
DRAW = {"annular": annular, "conical": conical, "bar": bar, "block": block}
SOLIDS = ("bar", "block")
SAME_PATCH = tuple(replace(by, divides=False) for by in LADDER)
LONGEST = 240  # s for a scene and its reference


def draw_scene(index: int, seed: int = SEED) -> str:
    """Scene number ``index`` as TOML: seats by turns, all else at random; every other one is struck by a plate."""
    rng = np.random.default_rng([seed, index])
    kind = SEATS[index % len(SEATS)]
    target = f"target = {10 ** rng.uniform(-1.5, -0.8):.5f}\n"
    plate = bool(rng.random() < 0.45) and kind != "rod"
    strikes = _flapper(rng) if plate else _cantilever(rng)
    own = "" if plate else 'measures = ["impulse", "filtered_peak", "stress"]\n'
    asked = "" if kind == "rod" else '[stress]\ndistance = "0.3 mm"\n'
    return f"{_seat(kind, rng)}{strikes}[accuracy]\n{target}{own}{asked}"


def _seat(kind: str, rng: np.random.Generator) -> str:
    damping = f"damping_ratio = {rng.uniform(0.005, 0.1):.5f}\n"
    young, density = rng.uniform(70, 220), rng.uniform(2600, 8000)
    material = f'young = "{young:.4f} GPa", density = "{density:.4f} kg/m^3"'
    if kind == "rod":
        size = f'length = "{rng.uniform(5, 30):.4f} mm"\narea = "{rng.uniform(1, 20):.4f} mm^2"\n'
        material = material.replace(", ", "\n")
        return f'[seat]\nkind = "rod"\n{size}{damping}{material}\n'
    shape, length = DRAW[kind](rng)
    level = "sector" if kind in SOLIDS else "axisymmetric"
    mesh = ""
    if kind in SOLIDS:
        size = length / rng.uniform(2, 3)
        mesh = f'mesh = {{ size = "{size:.4f} mm", contact_size = "{size * rng.uniform(0.4, 0.8):.4f} mm" }}\n'
        mesh += f'greens = {{ bandwidth = "{rng.uniform(100, 200):.3f} kHz", tolerance = 0.02 }}\n'
    material = f"material = {{ {material}, poisson = {rng.uniform(0.2, 0.35):.4f} }}\n"
    return f'[seat]\nkind = "{kind}"\nmodel = "{level}"\n{shape}{damping}{mesh}{material}'


def _run(rng: np.random.Generator) -> str:
    gap, law = rng.uniform(0.5, 3), ""
    if rng.random() < 0.7:
        law = f'law = {{ kind = "hertz", stiffness = "{10 ** rng.uniform(9, 10.5):.4g} N/m^1.5" }}\n'
    run = f'[run]\nduration = "{rng.uniform(0.08, 0.16):.5f} ms"\nfilter_width = "{rng.uniform(2, 6):.4f} us"\n'
    return f'[contact]\ngap = "{gap:.4f} um"\n{law}{run}'


def _cantilever(rng: np.random.Generator) -> str:
    return f"""[reed]
kind = "cantilever"
length = "{rng.uniform(15, 30):.4f} mm"
width = "{rng.uniform(5, 12):.4f} mm"
thickness = "{rng.uniform(0.2, 0.6):.4f} mm"
damping_ratio = {rng.uniform(0.005, 0.05):.5f}
release = {{ mode = 1, velocity = "-{rng.uniform(0.5, 4):.4f} m/s" }}
{_run(rng)}"""


def _flapper(rng: np.random.Generator) -> str:
    """It touches with a disc or a ring of its own."""
    paddle = rng.uniform(10, 16)
    neck = rng.uniform(0.35, 0.6) * paddle
    touches = f'contact_radius = "{rng.uniform(0.15, 0.35) * paddle:.4f} mm"\n'
    if rng.random() < 0.6:
        touches += f'contact_width = "{rng.uniform(0.05, 0.12) * paddle:.4f} mm"\n'
    return f"""[reed]
kind = "flapper"
root_width = "{rng.uniform(1.0, 1.5) * neck:.4f} mm"
taper_length = "2 mm"
neck_width = "{neck:.4f} mm"
neck_length = "{rng.uniform(0.8, 1.4) * paddle:.4f} mm"
paddle_diameter = "{paddle:.4f} mm"
thickness = "{rng.uniform(0.25, 0.6):.4f} mm"
damping_ratio = {rng.uniform(0.005, 0.03):.5f}
{touches}greens = {{ bandwidth = "{rng.uniform(30, 80):.3f} kHz" }}
release = {{ velocity = "-{rng.uniform(0.5, 4):.4f} m/s" }}
{_run(rng)}"""


def judge(index: int, seed: int) -> Verdict:
    """One scene: run as planned, and its reference."""
    start = perf_counter()
    with written(draw_scene(index, seed)) as (scene, folder):
        *_, done = rounds(plan_scene(scene), folder, Stopwatch(), silent, limits=Limits(rounds=1))
        _, reference = finest_reference(done, ladder=SAME_PATCH)
        (values, bars), (exact, _) = told(done), told(finer_round(done, reference), bare=True)
    stated, seconds = scene.seat.kind in SOLIDS, perf_counter() - start
    return Verdict.of(done, (seed, index), values, bars, exact, stated=stated, seconds=seconds)


def told(done: Round, *, bare: bool = False) -> tuple[Mapping[str, float], Mapping[str, float]]:
    """By measure, the largest stresses of a round that have error bars, and these [Pa]; ``bare``: without what the
    force leaves in them, whose runs take longest."""
    values, bars = {}, {}
    seat, plate = (seat_stress(done), plate_reed_stress(done)) if bare else stresses(done)
    if seat is not None:
        values[SEAT], bars[SEAT] = float(seat.peak.von_mises.max()), seat.bar
        values[TENSION], bars[TENSION] = float(seat.peak.principal.max()), seat.tension_bar
    if plate is not None and plate.found.after_contact is not None:
        values[REED], bars[REED] = plate.found.after_contact.value, plate.bar
    elif REED in done.left.values and done.stress is not None and done.stress.after_contact is not None:
        values[REED], bars[REED] = done.stress.after_contact.value, done.left.bar(REED)
    return {name: value for name, value in values.items() if not math.isnan(bars[name])}, bars


def main() -> None:
    """Run what is missing, write the table, print the shares."""
    cover(FILE, *chosen(SEED, SCENES), judge, LONGEST)


if __name__ == "__main__":
    main()
