"""A picture for the README: a reed on a tall sleeve of PEEK, the wave that it sends in, its force beside a spring's.

.venv/bin/python docs/sleeve_picture.py [FILE]
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from impact import measures
from impact.pictures.drawing import BLUE, GREY, ORANGE, sheet, zero_line
from impact.storage.hdf5 import load_results
from seatfem.pictures.moving import LIGHT
from seatfem.pictures.rendering import load_pyvista
from seatfem.study.runs.pipeline import RESULT_FILE, run_scene
from seatfem.study.scene import load_scene

SCENE = Path(__file__).resolve().parent.parent / "examples" / "flapper_on_peek_sleeve.toml"
TARGET = Path(__file__).resolve().parent / "images" / "sleeve.png"
FRAMES = {"stress.frames": 48, "stress.distance": "0.5 mm"}
SHOWN = (3e-6, 9e-6, 18e-6)  # after the first touch [s]
EXAGGERATED = 300.0
MISES = "von Mises [Pa]"
PIXELS = (700, 560)


def main(words: list[str]) -> None:
    target = Path(words[0]) if words else TARGET
    folder = Path(tempfile.mkdtemp())
    scene = load_scene(SCENE, FRAMES)
    run_scene(scene, folder)
    draw(folder, target, scene.reed)


def draw(folder: Path, target: Path, reed: Any) -> None:
    """Of a run with its stress wave in ``folder``."""
    pyvista, runs = load_pyvista(), load_results(folder / RESULT_FILE)
    touch, last = measures.contact_groups(runs["wave"])[0]
    series = pyvista.PVDReader(folder / "seat_stress.pvd")
    times = np.array(series.time_values)
    frames = [int(np.argmin(np.abs(times - touch - after))) for after in SHOWN]
    seats = []
    for frame in frames:
        series.set_active_time_point(frame)
        seats.append(series.read()[0])
    high = max(float(np.nanpercentile(seat[MISES], 98)) for seat in seats)
    with sheet(target, 8.4, 5.2) as figure:
        grid = figure.add_gridspec(2, 3, height_ratios=[1.3, 1.0])
        for column, (frame, seat) in enumerate(zip(frames, seats, strict=True)):
            axes = figure.add_subplot(grid[0, column])
            axes.imshow(rendered(pyvista, seat, high, reed))
            axes.set_axis_off()
            axes.set_title(f"{1e6 * (times[frame] - touch):.0f} µs after the touch", loc="center")
        axes = figure.add_subplot(grid[1, :])
        for name, words, colour, style in (
            ("wave", "on the seat as it is", BLUE, "solid"),
            ("spring", "on a spring of its stiffness", ORANGE, (0, (4, 2))),
        ):
            run = runs[name]
            near = (run.time > touch - 4e-6) & (run.time < last + 8e-6)
            force = measures.filtered_force(run, 1e-6)
            axes.plot(1e6 * (run.time[near] - touch), force[near], color=colour, linestyle=style, label=words)
        zero_line(axes)
        for frame in frames:
            axes.axvline(1e6 * (times[frame] - touch), color=GREY, linewidth=0.8, linestyle=":")
        axes.set(xlabel="time after the touch [µs]", ylabel="contact force, mean over 1 µs [N]")
        axes.set_xlim(-4, 1e6 * (last - touch) + 8)
        axes.legend(loc="upper right")
        colours = figure.colorbar(
            scale(high), ax=figure.axes[:3], shrink=0.7, label=f"von Mises stress [MPa], moved {EXAGGERATED:g} times"
        )
        colours.outline.set_visible(False)


def scale(high: float) -> Any:
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    return ScalarMappable(Normalize(0.0, 1e-6 * high), "viridis")


def rendered(pyvista: ModuleType, seat: Any, high: float, reed: Any) -> np.ndarray:
    """The half of the seat behind the section, and the reed above it, as the camera sees them."""
    moved = seat.copy()
    moved.points = seat.points + EXAGGERATED * seat["displacement [m]"]
    top = float(seat.points[:, 2].max()) + 0.35e-3
    lip = 0.5 * reed.width
    beam = pyvista.Box((lip - reed.length, lip, -0.5 * reed.width, 0.5 * reed.width, top, top + reed.thickness))
    clamp = pyvista.Box(
        (lip - reed.length - 4e-3, lip - reed.length, -0.5 * reed.width, 0.5 * reed.width, top - 1.5e-3, top + 2e-3)
    )
    plotter = pyvista.Plotter(off_screen=True, window_size=PIXELS)
    plotter.set_background("white")
    plotter.enable_anti_aliasing("ssaa")
    plotter.add_mesh(moved, scalars=MISES, clim=(0.0, high), cmap="viridis", show_scalar_bar=False, **LIGHT)
    plotter.add_mesh(beam, color="#c9ced6", specular=0.3)
    plotter.add_mesh(clamp, color="#5f6773")
    plotter.camera_position = [(0.006, -0.05, 0.024), (-0.004, 0.0, 0.0065), (0, 0, 1)]
    plotter.camera.zoom(1.6)
    picture = np.asarray(plotter.screenshot(return_img=True))
    plotter.close()
    return picture


if __name__ == "__main__":
    main(sys.argv[1:])
