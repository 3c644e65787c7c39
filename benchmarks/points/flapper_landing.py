"""The tilted landing that CalculiX was given (`benchmarks/peers/calculix_landing.py`), by this program at a fidelity.

    cd benchmarks; python -m points.flapper_landing LEVEL

prints its measures as JSON.
"""

from __future__ import annotations

import json
import math
import sys

from points.landing import Grid, Landing, total_force
from points.march import filtered_peak, impulse
from points.outlines import Flapper
from points.plate import Material
from points.seat import Seat

GAP = 2e-6  # m, smallest opening on the lip, at its outer edge
TILT, WIDTH = math.radians(0.2), 1e-3
LANDING = Landing(
    Flapper(8e-3, 2e-3, 6e-3, 15e-3, 16e-3), Material(206e9, 0.3, 7800.0), 0.3e-3, 4.5e-3, WIDTH,
    Seat(4e-3, WIDTH, 0.5e-3, 8e-3, 3e-3, Material(200e9, 0.3, 7850.0), 0.0),
    20e6, GAP + WIDTH / 2 * math.tan(TILT), TILT, 0.0, 2.0, 35e-6, 5e-6,
)  # fmt: skip
GRIDS = (
    Grid(24, 2, 4, 3e-3, 150e3, 2, 2.5e-3, 200e3, 100e-9),
    Grid(36, 2, 5, 3e-3, 250e3, 3, 2.5e-3, 400e3, 50e-9),
    Grid(48, 3, 6, 3e-3, 400e3, 3, 2.5e-3, 600e3, 50e-9),
    Grid(72, 3, 7, 3e-3, 600e3, 4, 2.5e-3, 710e3, 25e-9),
    Grid(96, 4, 8, 3e-3, 900e3, 5, 2.5e-3, 1000e3, 12.5e-9),
)


def main(level: int) -> None:
    """Compute the landing and print its measures."""
    grid = GRIDS[level]
    force = total_force(LANDING, grid)
    peak = filtered_peak(force, grid.dt, LANDING.filter_width)
    print(json.dumps({"impulse_Ns": impulse(force, grid.dt), "filtered_peak_force_N": peak}))  # noqa: T201


if __name__ == "__main__":
    main(int(sys.argv[1]))
