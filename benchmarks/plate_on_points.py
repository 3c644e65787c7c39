"""Tilted landings by a program of its own, whose numbers are the reference of `plate_on_points_product.py`.

    python benchmarks/plate_on_points.py [first [last]]

computes the landings that results/points_reference.csv lacks and appends a line for each: the scene as JSON, its grid,
impulse and largest mean force with their doubts. Number 0 is stated, the others are drawn. Then landing 0 is computed
with less said across the land, results/points_across.csv. Nothing of `impact` or `seatfem` is imported, here or in
`points`.
"""

from __future__ import annotations

import csv
import json
import math
import sys
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
from points.landing import Doubted, Grid, Landing, solve_with_doubt, total_force
from points.march import filtered_peak, impulse
from points.outlines import Flapper, Outline, RingPlate, Sheet
from points.plate import Material
from points.seat import Seat

FILE = Path(__file__).parent / "results" / "points_reference.csv"
ACROSS = FILE.with_name("points_across.csv")
SEED, DRAWN = 906, 12
LONGEST = 300e-6  # s
STEEL_REED = Material(206e9, 0.3, 7800.0)
SEATS = {
    "steel": Material(200e9, 0.3, 7850.0),
    "grey cast iron": Material(110e9, 0.26, 7200.0),
    "PEEK": Material(4e9, 0.4, 1300.0),
}
LAWS = ("spring", "hertz", "signorini")
FIELDS = ("number", "scene", "grid", "duration_s", "impulse_Ns", "impulse_doubt", "peak_N", "peak_doubt")
GRID = Grid(
    around=72, across=3, order=7, size=3e-3, band=600e3, seat_order=4, seat_size=2.5e-3, seat_band=0.0, dt=25e-9
)
WAVES = 0.22e-3  # m: the seat's modes are kept up to the shear speed over four times this length


def stated_landing() -> Landing:
    """Return a sheet that is rolled by 0.15 degrees, over a rigid seat, with a spring as the contact."""
    return Landing(
        Sheet(28e-3, 12e-3, 21e-3), STEEL_REED, 0.35e-3, 3.9e-3, 0.8e-3, None, "spring", 30e6, 2e-6,
        math.radians(0.15), 0.0, 1.5, 200e-6, 3e-6,
    )  # fmt: skip


def draw_landing(number: int) -> Landing:
    """Return landing ``number``, from 1 on: reeds, seats and laws go round, dimensions and motions are drawn."""
    if number == 0:
        return stated_landing()
    rng = np.random.default_rng([SEED, number])
    kind, turn = (number - 1) % 3, (number - 1) // 3
    material = list(SEATS)[(kind + turn) % 3]
    law = LAWS[(turn + 2 * kind + turn // 3) % 3]
    radius, width = _rounded(rng.uniform(3.0, 4.5), rng.uniform(0.6, 1.2))
    inner, outer = radius - width / 2, radius + width / 2
    outlines: tuple[Outline, ...] = (_sheet(rng, outer), _flapper(rng, outer), _ring(rng, inner, outer))
    (thickness,) = _rounded(rng.uniform(0.2, 0.5))
    seat = Seat(inner, width, *_rounded(0.5, 1e3 * outer + rng.uniform(4, 7), rng.uniform(5, 9)), SEATS[material], 0.02)
    tilt = math.radians(round(10 ** rng.uniform(math.log10(0.02), math.log10(0.5)), 3))
    axis = math.radians(float(rng.choice([0.0, 90.0])))
    stiffness = {"spring": 1e6 * round(rng.uniform(20, 100), 1), "hertz": 1e9 * round(10 ** rng.uniform(0.7, 1.7), 2)}
    gap = math.ceil(1e6 * width / 2 * math.tan(tilt) + 0.5) * 1e-6  # all points begin open
    widths = [3.0, 5.0] if material == "PEEK" or law == "signorini" else [1.0, 3.0, 5.0]
    return Landing(
        outlines[kind], STEEL_REED, thickness, radius, width, seat, law, stiffness.get(law, 0.0), gap, tilt, axis,
        round(rng.uniform(0.5, 3.0), 2), LONGEST, 1e-6 * float(rng.choice(widths)),
    )  # fmt: skip


def _rounded(*millimetres: float) -> tuple[float, ...]:
    """Return lengths [m] to the hundredth of a millimetre."""
    return tuple(round(value, 2) * 1e-3 for value in millimetres)


def _sheet(rng: np.random.Generator, outer: float) -> Sheet:
    """Return a sheet that a lip of this outer radius [m] fits on."""
    width, length, rest = _rounded(
        2e3 * outer + 2 * rng.uniform(1.0, 2.5), rng.uniform(22, 30), 1e3 * outer + rng.uniform(1.0, 3.0)
    )
    return Sheet(length, width, length - rest)


def _flapper(rng: np.random.Generator, outer: float) -> Flapper:
    """Return a flapper that a lip of this outer radius [m] fits on."""
    (paddle,) = _rounded(2e3 * outer + 2 * rng.uniform(1.0, 2.5))
    (neck,) = _rounded(1e3 * paddle * rng.uniform(0.35, 0.5))
    root, length = _rounded(1e3 * neck * rng.uniform(1.1, 1.4), 1e3 * paddle * rng.uniform(0.7, 1.2))
    return Flapper(root, 2e-3, neck, length, paddle)


def _ring(rng: np.random.Generator, inner: float, outer: float) -> RingPlate:
    """Return a ring plate that reaches beyond a lip between these radii [m]."""
    return RingPlate(*_rounded(2e3 * outer + 2 * rng.uniform(0.8, 2.0), 2e3 * inner - 2 * rng.uniform(0.6, 1.4)))


def grid_of(landing: Landing) -> Grid:
    """Return the grid of a landing's reference."""
    if landing.seat is None:
        return replace(GRID, around=96)
    across = 4 if landing.law == "signorini" else GRID.across  # its pressure has no limit at edges
    return replace(GRID, across=across, seat_band=round(landing.seat.material.shear_speed / (4 * WAVES) / 5, -4))


def as_text(landing: Landing) -> str:
    """Return a landing as JSON, its reed's kind with it."""
    content = {"reed": type(landing.outline).__name__, **asdict(landing)}
    return json.dumps(content)


def read_references() -> dict[int, tuple[str, Doubted]]:
    """Return scene and numbers of each landing on file, by its number."""
    if not FILE.is_file():
        return {}
    with FILE.open(newline="") as file:
        return {
            int(row["number"]): (row["scene"], Doubted(*(float(row[name]) for name in FIELDS[3:])))
            for row in csv.DictReader(file)
        }


def write_across() -> None:
    """Write impulse [N s] and peak [N] of landing 0 with other points, and with less said across the land."""
    landing, grid = stated_landing(), grid_of(stated_landing())
    variants = {
        "points": grid,
        "other points": replace(grid, around=grid.around // 2, across=5),
        "one opening across": replace(grid, level=True),
        "one contact across": replace(grid, joined=True),
    }
    with ACROSS.open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["variant", "around", "across", "impulse_Ns", "peak_N"])
        for name, each in variants.items():
            force = total_force(landing, each)
            values = impulse(force, each.dt), filtered_peak(force, each.dt, landing.filter_width)
            writer.writerow([name, each.around, each.across, *(f"{value:.6g}" for value in values)])


def read_across() -> dict[str, tuple[float, float]]:
    """Return impulse [N s] and peak [N] of landing 0 by variant."""
    with ACROSS.open(newline="") as file:
        return {row["variant"]: (float(row["impulse_Ns"]), float(row["peak_N"])) for row in csv.DictReader(file)}


def main(first: int = 0, last: int = DRAWN) -> None:
    """Compute what is missing."""
    for number in range(first, last + 1):
        if number in read_references():
            continue
        landing = draw_landing(number)
        grid = grid_of(landing)
        numbers = solve_with_doubt(landing, grid, until_flight=number > 0)
        is_new = not FILE.is_file()
        with FILE.open("a", newline="") as file:
            writer = csv.writer(file, lineterminator="\n")
            if is_new:
                writer.writerow(FIELDS)
            values = (f"{value:.7g}" for value in asdict(numbers).values())
            writer.writerow([number, as_text(landing), json.dumps(asdict(grid)), *values])
    if not ACROSS.is_file():
        write_across()


if __name__ == "__main__":
    main(*map(int, sys.argv[1:]))
