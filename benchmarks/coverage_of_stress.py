"""Do the error bars of stress cover the true errors? Random beams and plates on random seats, [stress] asked for.

    python benchmarks/coverage_of_stress.py [seed [first [last]]]

appends the rows of each scene to results/coverage_of_stress.csv, leaving out scenes that are there. The reference is
`finer_scenes.finest_reference`, finer in every key but one: the struck patch has as many parts as in the run, for how a
face spreads its force is model. Its stress in the seat is that under its own force at the places that the run states,
on a mesh of elements half as large as those of the run's stress; that in a reed is the largest on its own mesh.
"""

from __future__ import annotations

import re
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from coverage_of_scenes import RUN_SECONDS, Row, carry_out, compare, cover
from drawn_seats import GEOMETRY
from finer_scenes import LADDER, finer_round, finest_reference, largest_stresses
from scenes_summary import summary
from table import RESULTS

from impact.notices import silent
from seatfem.machine.resources import Stopwatch
from seatfem.study.plan import Plan
from seatfem.study.runs.converge import begin_plan
from seatfem.study.runs.next_round import Limits
from seatfem.study.runs.round import Round
from seatfem.study.runs.rounds import rounds
from seatfem.study.runs.seat_fields import SeatMesh
from seatfem.study.runs.seat_stress import places_of, seat_stress, stress_on
from seatfem.study.runs.stresses import SEAT, TENSION
from seatfem.study.scene import load_scene

SEED, SCENES = 4603, 15
FILE = RESULTS / "coverage_of_stress.csv"
SEATS = ("annular", "conical", "annular", "rod", "bar", "conical", "annular", "block")
SOLIDS = ("bar", "block")
HERTZ = re.compile(r'kind = "hertz", stiffness = "([^ ]+) N/m\^1.5"')
SAME_PATCH = tuple(replace(by, divides=False) for by in LADDER[2:])
HALF = 2.0  # element size of the stress, over that of its reference
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
    if kind not in ("rod", "bar"):  # patches of solids bring the local compliance that Hertz's law holds, too
        strikes = HERTZ.sub(lambda law: f'kind = "spring", stiffness = "{1e-3 * float(law[1]):.4g} N/m"', strikes)
    return f"{_seat(kind, rng)}{strikes}[accuracy]\n{target}{own}{asked}"


def _seat(kind: str, rng: np.random.Generator) -> str:
    damping = f"damping_ratio = {rng.uniform(0.005, 0.1):.5f}\n"
    young, density = rng.uniform(70, 220), rng.uniform(2600, 8000)
    material = f'young = "{young:.4f} GPa", density = "{density:.4f} kg/m^3"'
    if kind == "rod":
        size = f'length = "{rng.uniform(5, 30):.4f} mm"\narea = "{rng.uniform(1, 20):.4f} mm^2"\n'
        material = material.replace(", ", "\n")
        return f'[seat]\nkind = "rod"\n{size}{damping}{material}\n'
    shape, length = GEOMETRY[kind](rng)
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


def judge(index: int, seed: int = SEED) -> list[Row]:
    """Return the rows of one scene, run by the loop, against its reference."""
    text = draw_scene(index, seed)
    tables = tomllib.loads(text)
    seat, reed = tables["seat"]["kind"], tables["reed"]["kind"]
    head = Row(seed, index, seat, reed, "", stated=seat in SOLIDS, outcome="judged")
    return carry_out(head, lambda folder: _judged(head, text, folder), LONGEST)


def _judged(head: Row, text: str, folder: Path) -> Iterator[Row]:
    path = folder / "scene.toml"
    path.write_text(text, encoding="utf-8")
    limits = Limits(seconds=RUN_SECONDS)
    *_, done = rounds(begin_plan(load_scene(path)), folder, Stopwatch(), silent, limits=limits)
    rung, reference = finest_reference(done, ladder=SAME_PATCH)
    values, bars = largest_stresses(done)
    finest = finer_round(done, reference)
    exact, _ = largest_stresses(replace(finest, plan=without_seat_stress(finest.plan)), bare=True)
    exact = {**exact, **seat_at_the_same_places(done, finest)}
    target = done.plan.scene.accuracy.target
    head = replace(head, level=done.plan.level, target=target, met=str(done.met), rounds=done.number, rung=rung)
    for name, value in values.items():
        yield compare(replace(head, measure=name, asked="table"), value, bars[name], exact[name])


def without_seat_stress(plan: Plan) -> Plan:
    """Return the plan of a scene that does not ask for stress in the seat."""
    return replace(plan, scene=plan.scene.model_copy(update={"stress": None}))


def seat_at_the_same_places(done: Round, finest: Round) -> dict[str, float]:
    """The stresses in the seat under the forces of a finer round, where the run has its largest, on a finer mesh."""
    body, method, stress = done.plan.scene.seat.elastic, done.plan.method.seat, seat_stress(done)
    if stress is None or body is None or body.drawn is None:
        return {}
    spec, finer = body.drawn.mesh_spec(method), HALF * stress.meshes.finer
    method = replace(method, size=spec.size / finer, contact_size=spec.patch_size / finer)
    mesh = SeatMesh(finest.plan, body.meshes(method, silent)[0])
    force, dt = finest.strike.on_seat, finest.result.dt
    found, _ = stress_on(mesh, stress, places_of(stress.peak), force, dt)
    return {SEAT: float(found.von_mises[0]), TENSION: float(found.principal[1])}


def main() -> None:
    """Run what is missing, and print the shares."""
    seed, first, last = (*map(int, sys.argv[1:]), *(SEED, 0, SCENES)[len(sys.argv) - 1 :])
    print(summary(cover(FILE, seed, range(first, last), lambda index: judge(index, seed))))  # noqa: T201


if __name__ == "__main__":
    main()
