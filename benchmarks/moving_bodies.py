"""What bodies kept for reports cost: processor time to write and read one, its file, and its share of a report.

    .venv/bin/python benchmarks/moving_bodies.py

A wavy plate of a given number of triangles, as modes or as the frames of a stress wave.
"""

from __future__ import annotations

import itertools
import tempfile
import time
from pathlib import Path

import numpy as np
from table import Table, publish

from seatfem.faces.report.bodies import body_figure
from seatfem.pictures.frames import Frames
from seatfem.pictures.moving import MOST_TRIANGLES, load_moving, save_moving


def wavy(triangles: int, frames: int, *, stress: bool) -> Frames:
    """A square of 20 mm in ``frames`` frames."""
    count = round((triangles / 2) ** 0.5)
    x, y = np.meshgrid(*2 * (np.linspace(0, 0.02, count + 1),))
    points = np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1)
    first = (np.arange(count)[:, None] * (count + 1) + np.arange(count)).ravel()
    corners = np.stack([first, first + 1, first + count + 2, first + count + 1], axis=1)
    cells = np.concatenate([corners[:, [0, 1, 2]], corners[:, [0, 2, 3]]])
    phase = np.linspace(0, 6, frames)[:, None]
    waves = np.sin(300 * points[:, 0] + phase) * np.cos(200 * points[:, 1])
    moved = np.zeros((frames, *points.shape))
    moved[..., 2] = 1e-6 * waves
    labels = tuple(str(k) for k in range(frames))
    if not stress:
        return Frames("", points, cells, moved, labels)
    return Frames("", points, cells, moved, labels, phase[:, 0], 1e6 * waves**2, "von Mises stress", "Pa", 0.0, 1e6)


def main() -> None:
    rows = []
    for triangles in (5_000, 50_000, 200_000):
        for frames, stress in ((12, False), (24, True)):
            made = wavy(triangles, frames, stress=stress)
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / "body.h5"
                times = [time.process_time()]
                save_moving(made, path)
                times.append(time.process_time())
                found = load_moving(path)
                times.append(time.process_time())
                sizes = path.stat().st_size, len(body_figure("body.h5", found))
            what = f"{frames} {'times, with stress' if stress else 'modes'}"
            spent = (f"{b - a:.2g}" for a, b in itertools.pairwise(times))
            rows.append((f"{triangles:,}", what, *spent, *(f"{size / 1e6:.2g}" for size in sizes)))
    note = f"At most {MOST_TRIANGLES:,} triangles are kept. Processor seconds of one thread."
    columns = ("triangles of the surface", "frames", "write [s]", "read [s]", "file [MB]", "in a report [MB]")
    publish("moving_bodies", Table("Bodies kept for reports", (note,), columns, tuple(rows)))


if __name__ == "__main__":
    main()
