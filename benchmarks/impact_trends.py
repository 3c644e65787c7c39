"""Largest stress in a ring plate against its speed and its inclination, on a narrow seat and on a wide stopper.

Published: impact stress "increased nearly in a direct proportional with the growth of impact speed and inclining
angle", and was larger on the seat than on the limiter (Y. Wang, J. Feng, Y. Wang, X. Peng, Int. Compressor Engineering
Conf., Purdue 2010, paper 2011; abstract). All else here is ours: ring, seat, widths.
"""

from __future__ import annotations

import math
import tempfile
from pathlib import Path

import numpy as np
from table import Table, publish

from impact.pictures.drawing import BLUE, GREEN, ORANGE, sheet
from seatfem.machine.stopwatch import Stopwatch
from seatfem.structures.fields.recovery import largest
from seatfem.study.planning.planner import plan_scene
from seatfem.study.runs.life_curves import again
from seatfem.study.runs.reed_stress import plate_field, plate_pushes, struck_in
from seatfem.study.runs.rounds import Round, rounds
from seatfem.study.scene import load_scene

SCENE = """
[seat]
kind = "annular"
bore_radius = "{bore} mm"
lip_width = "{width} mm"
lip_edge_radius = "0 mm"
outer_radius = "40 mm"
thickness = "15 mm"
material = "steel"
model = "spring"
[reed]
kind = "ring_plate"
outer_diameter = "60 mm"
inner_diameter = "40 mm"
thickness = "2 mm"
material = "steel"
damping_ratio = 0.01
velocity = "-4 m/s"
greens = {{ bandwidth = "60 kHz" }}
[contact]
gap = "1 um"
tilt = "0.2 deg"
ports = 48
[run]
duration = "0.6 ms"
time_step = "0.1 us"
filter_width = "2 us"
[accuracy]
target = 0.9
"""
SEAT, STOPPER = {"bore": 24.5, "width": 1}, {"bore": 23, "width": 4}  # both about a radius of 25 mm
SPEEDS = (1.0, 2.0, 4.0, 8.0)
GROWS = {"speed": (1.0, 4.0), "tilt": (0.05, 0.2)}
"""Where slopes are taken."""
TILTS = (0.0, 0.0125, 0.025, 0.05, 0.1, 0.2, 0.4, 0.8)  # deg


def landed(folder: Path, lip: dict[str, float]) -> Round:
    """The scene on one lip, by its first round."""
    file = folder / "scene.toml"
    file.write_text(SCENE.format(**lip), encoding="utf-8")
    return next(rounds(plan_scene(load_scene(file)), folder, Stopwatch(), lambda *_: None))  # type: ignore[arg-type]


def stresses(done: Round, name: str, values: tuple[float, ...]) -> np.ndarray:
    """(n,) largest von Mises stress in the faces of the ring [Pa], over another speed [m/s] or tilt [deg]."""
    field, found = plate_field(done), []
    for value in values:
        there = again(done, name, math.radians(value) if name == "tilt" else value)
        push = plate_pushes(there, there.touches)
        struck = largest(struck_in(field, there, there.touches), push, there.result.dt).after_contact
        found.append(struck.von_mises.max())
    return np.array(found)


def slope(name: str, values: tuple[float, ...], stress: np.ndarray) -> float:
    """Of log stress over log value, where it grows."""
    at, (low, high) = np.array(values), GROWS[name]
    some = (at >= low) & (at <= high)
    return float(np.polyfit(np.log(at[some]), np.log(stress[some]), 1)[0])


def main() -> None:
    """Two tables in one, and the picture."""
    rows, curves = [], {}
    with tempfile.TemporaryDirectory() as place:
        for what, lip in (("seat", SEAT), ("stopper", STOPPER)):
            done = landed(Path(place), lip)
            curves[what] = stresses(done, "speed", SPEEDS), stresses(done, "tilt", TILTS)
    for name, values, unit, k in (("speed", SPEEDS, "m/s", 0), ("tilt", TILTS, "deg", 1)):
        for j, value in enumerate(values):
            both = [f"{curves[what][k][j] / 1e6:.1f} MPa" for what in ("seat", "stopper")]
            rows.append((f"{name} {value:g} {unit}", *both))
        slopes = (f"{slope(name, values, each[k]):.2f}" for each in curves.values())
        rows.append((f"slope over {name}, {GROWS[name][0]:g} to {GROWS[name][1]:g} {unit}, log-log", *slopes))
    notes = (
        "Largest von Mises stress in a steel ring of 60 x 40 x 2 mm on lips of 1 mm (seat) and 4 mm (stopper) about "
        "25 mm; speeds at 0.2 deg, inclinations at 4 m/s.",
        "Within one thickness of the lip none is told.",
    )
    publish("impact_trends", Table("Trends of impact stress", notes, ("", "seat", "stopper"), tuple(rows)))
    with sheet(Path(__file__).parent.parent / "docs" / "images" / "impact_trends.png", 8.4, 3.8) as figure:
        figure.suptitle("Largest stress in a ring plate that lands inclined")
        panels = (("speed", "impact speed [m/s]", SPEEDS), ("tilt", "inclination [deg]", TILTS))
        for k, (name, label, values) in enumerate(panels):
            axes, some = figure.add_subplot(1, 2, k + 1), np.array(values) > 0
            where, ends = np.array(values)[some], np.array(GROWS[name])
            for (what, each), colour in zip(curves.items(), (BLUE, GREEN), strict=True):
                words = f"{what}, slope {slope(name, values, each[k]):.2f}"
                axes.loglog(where, each[k][some] / 1e6, "o-", color=colour, label=words)
            first = curves["seat"][k][values.index(ends[0])] / 1e6
            axes.loglog(ends, first * ends / ends[0], "--", color=ORANGE, label="proportional")
            axes.set_xticks(where, [f"{x:g}" for x in where], fontsize=7)
            axes.set_yticks(ticks := [50, 100, 200, 500, 1000], [f"{tick}" for tick in ticks])
            axes.minorticks_off()
            axes.set_xlabel(label)
            axes.set_ylabel("von Mises stress [MPa]")
            axes.legend()


if __name__ == "__main__":
    main()
