"""The README's first picture: the demo's valve as it is drawn, its lift over the crank angle, the force of its landing.

.venv/bin/python docs/valve_picture.py FOLDER [FILE]

where FOLDER is what `seatfem demo` has written.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np

from impact import measures
from impact.gas import angles
from impact.pictures.drawing import BLUE, ORANGE, PURPLE, sheet, zero_line
from impact.storage.hdf5 import load_results
from seatfem.faces.cli import demo_scene
from seatfem.readings import reading
from seatfem.study.runs.pipeline import RESULT_FILE
from seatfem.study.scene import load_scene

TARGET = Path(__file__).resolve().parent / "images" / "first.png"


def draw(folder: Path, target: Path = TARGET) -> None:
    """Draw the picture from what a run of the demo has written."""
    from matplotlib.image import imread

    scene, runs = load_scene(demo_scene()), load_results(folder / RESULT_FILE)
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    seat, spring, width = runs["wave"], runs["spring"], scene.run.filter_width
    rpm, start = scene.crank or (0.0, 0.0)
    landings = [record for record in summary["landings"] if record["body"] == "seat"]
    hardest = max(landings, key=lambda record: record["excess_peak_force_N"])
    with sheet(target, 10.4, 5.4) as figure:
        grid = figure.add_gridspec(2, 2, width_ratios=[1.0, 1.15])
        shown = figure.add_subplot(grid[:, 0])
        shown.imshow(imread(folder / "drawing.png"))
        shown.set_axis_off()
        lift = figure.add_subplot(grid[0, 1])
        angle, touched = angles(seat.time, rpm, start), float(angles(np.array([hardest["time_s"]]), rpm, start)[0])
        lift.plot(angle, 1e3 * seat.striker_displacement, color=BLUE)
        lift.plot(touched, 0.0, "v", color=PURPLE, markersize=7)
        speed, peak, stress = (
            reading(summary, key, unit)
            for key, unit in (
                ("landing_closing_speed_m_per_s", "m/s"),
                ("landing_filtered_peak_force_N", "N"),
                ("peak_reed_stress_after_contact_Pa", "Pa"),
            )
        )
        lift.annotate(
            f"lands at {speed}",
            (touched, 0.0),
            (12, 26),
            textcoords="offset points",
            color=PURPLE,
        )
        zero_line(lift)
        lift.set(xlabel="crank angle [deg]", ylabel="lift at the port [mm]", xlim=(angle[0], angle[-1]))
        force = figure.add_subplot(grid[1, 1])
        first, last = hardest["time_s"], hardest["time_s"] + hardest["duration_s"]
        for run, colour, style, name in (
            (seat, BLUE, "solid", "on its seat"),
            (spring, ORANGE, (0, (4, 2)), "on a spring of its stiffness"),
        ):
            near = (run.time > first - 10e-6) & (run.time < last + 20e-6)
            mean = measures.filtered_force(run, width)
            force.plot(1e6 * (run.time[near] - first), mean[near], color=colour, linestyle=style, label=name)
        zero_line(force)
        force.set(xlabel="time after the touch [µs]", ylabel=f"contact force, mean over {1e6 * width:g} µs [N]")
        force.set_title(f"{peak} on the seat; {stress} at the root of the reed; margin {summary['life_margin']:.2f}")
        force.legend(loc="upper right")


if __name__ == "__main__":
    draw(Path(sys.argv[1]), *map(Path, sys.argv[2:3]))
