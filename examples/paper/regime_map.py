"""Where the constant stiffness K = EA/l over-estimates the force on a rod, and where it under-estimates it."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from paper_case import CASES, DENSITY, ROD_DAMPING, YOUNG, Numbers, strike, strike_spring, table_1_reed

import impact
from impact.after.measures import filtered_peak_force
from impact.after.measures import impulse as impulse_of
from impact.after.regime import EQUAL
from impact.after.rods import fixed_rod_modes
from impact.exact.closed_form import DampedFixedRod, DelayRod
from impact.files.csv_table import Row, read_rows, write_csv
from impact.greens.base import Array
from impact.notices import Progress, silent
from impact.pictures.drawing import sheet

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.collections import QuadMesh
    from matplotlib.figure import Figure

REED_STEP = 40e-9  # 0.42 radian of the reed's highest mode, 1/25 of the filter; 10 ns moves errors by 0.02 at most
RIGID_FILTER = 0.02  # of the spring model's contact duration
STEPS_PER_TRANSIT = 100


def rigid_point(alpha: float, reflection: float) -> Row:
    """Errors of K = EA/l under a rigid mass: alpha = rod mass/striker mass, velocity ``reflection`` at the far end.

    In units of the rod (Z = l/c = K = 1): the mass 1/alpha at speed 1. The spring's answer is the half-sine in closed
    form. -1 is a fixed end, 0 an absorbing one, where K is the static stiffness of the same rod held at its end.
    """
    mass, omega = 1 / alpha, math.sqrt(alpha)
    half = math.pi / omega
    width = RIGID_FILTER * half
    dt = 1 / max(STEPS_PER_TRANSIT, math.ceil(4 / width))
    # the fixed rod throws the mass back at once; an absorbing one stops it like exp(-alpha t)
    duration = 1.5 * half + 6 if reflection == -1 else max(1.5 * half + 6, 8 / alpha)
    problem = impact.ContactProblem(
        impact.rigid_mass(mass=mass, velocity=-1.0), impact.Body(DelayRod(1.0, 2.0, reflection))
    )
    result = impact.solve(problem, dt=dt, duration=duration)
    phase = omega * width / 2
    spring_peak = math.sin(phase) / phase / omega
    return {
        "alpha": alpha,
        "reflection": reflection,
        "peak_error": spring_peak / filtered_peak_force(result, width) - 1,
        "impulse_error": 2 * mass / impulse_of(result) - 1,
    }


def reed_point(length: float, area: float) -> Row:
    """Errors of K = EA/l under the reed of Table 1 on a steel rod of ``length`` [m] and ``area`` [m^2], damped by 10 %.

    ``mass_ratio``: rho A l over the reed's effective mass 1/phi_1^2 at the tip; ``trip_ratio``: 2 l/c times its first
    frequency; ``impedance_ratio``: Z over the reed's modal impedance omega_1/phi_1^2. The rod enters by its modes up to
    1/step (160 at least) and the exponential of the rest: 0.1 % of the exact filtered peak.
    """
    rod = impact.fixed_rod(young=YOUNG, density=DENSITY, area=area, length=length, damping_ratio=ROD_DAMPING)
    assert isinstance(rod, DampedFixedRod)
    modes = max(160, math.ceil(rod.transit / (math.pi * REED_STEP)))
    wave = Numbers.of(strike(fixed_rod_modes(rod, modes, residual=True), dt=REED_STEP))
    spring = Numbers.of(strike_spring(YOUNG * area / length, dt=REED_STEP))
    reed = table_1_reed(1).greens
    assert isinstance(reed, impact.ModalGreens)
    mass, omega = 1 / float(reed.shapes[0, 0]) ** 2, float(reed.omega[0])
    return {
        "length_m": length,
        "area_m2": area,
        "mass_ratio": DENSITY * area * length / mass,
        "trip_ratio": 2 * rod.transit * omega / (2 * math.pi),
        "impedance_ratio": rod.impedance / (mass * omega),
        "wave_filtered_peak_N": wave.filtered_peak,
        "spring_filtered_peak_N": spring.filtered_peak,
        "wave_impulse_Ns": wave.impulse,
        "spring_impulse_Ns": spring.impulse,
        "peak_error": spring.filtered_peak / wave.filtered_peak - 1,
        "impulse_error": spring.impulse / wave.impulse - 1,
    }


def rigid_grid(fine: bool) -> list[tuple[float, float]]:
    """(alpha, reflection) of the map."""
    alphas, ends = (25, 11) if fine else (9, 5)
    return [(float(a), float(r)) for a in np.geomspace(1 / 64, 16, alphas) for r in np.linspace(-1, 0, ends)]


def reed_grid(fine: bool) -> list[tuple[float, float]]:
    """(length, area) of the map [m, m^2]."""
    lengths, areas = (17, 13) if fine else (5, 4)
    return [(float(x), float(a)) for x in np.geomspace(1e-3, 0.1, lengths) for a in np.geomspace(4e-9, 4e-6, areas)]


def fill_map(
    path: str | os.PathLike[str],
    compute: Callable[[float, float], Row],
    points: Iterable[tuple[float, float]],
    progress: Progress = silent,
) -> list[Row]:
    """All rows of a map, those already in the CSV at ``path`` taken from there; the file is whole after each point.

    Points are rounded to 6 digits, as the file keeps them in its first two columns; delete it when the model changes.
    """
    todo = [(float(f"{x:.6g}"), float(f"{y:.6g}")) for x, y in points]
    rows = {_point(row): row for row in read_rows(path)} if Path(path).exists() else {}
    for count, point in enumerate(todo, start=1):
        if point not in rows:
            rows[point] = compute(*point)
            write_csv(path, rows[point], (row.values() for row in rows.values()), digits=7)
        progress(Path(path).stem, count / len(todo))
    return [rows[point] for point in todo]


def plot_map(rigid: list[Row], reed: list[Row], path: str | os.PathLike[str]) -> None:
    """Errors of the constant stiffness over both maps; red over-, blue under-estimates, black lines at +-2 %.

    Raises:
        PictureError: matplotlib is missing.
    """
    with sheet(path, 7.2, 6.2) as figure:
        figure.suptitle("Constant stiffness K = EA/l: over-estimates red, under-estimates blue")
        panels = figure.subplots(2, 2)
        draw = partial(_panel, figure)
        for row, name, words, limit in zip(
            panels, ("peak_error", "impulse_error"), ("peak force", "impulse"), (60, (100, 6)), strict=True
        ):
            limits = limit if isinstance(limit, tuple) else (limit, limit)
            left = draw(row[0], rigid, ("alpha", "reflection"), name, limits[0])
            right = draw(row[1], reed, ("length_m", "area_m2"), name, limits[1])
            for axes, mesh in ((row[0], left), (row[1], right)):
                figure.colorbar(mesh, ax=axes, extend="both", label=f"error of the {words} [%]", pad=0.02)
            row[0].set(ylabel="reflection at the far end")
            row[0].set_yticks([-1, -0.5, 0], ["fixed\n−1", "−0.5", "absorbing\n0"])
            row[1].set(yscale="log", ylabel="area of the rod [m²]")
            for case in CASES:
                row[1].plot(case.length, case.area, "o", color="black", markerfacecolor="white", markersize=4)
        panels[0, 0].set_title("Rigid mass on a rod")
        panels[0, 1].set_title("The reed of Table 1 on a steel rod")
        panels[1, 0].set_xlabel("mass ratio α = rod/striker")
        panels[1, 1].set_xlabel("length of the rod [m]")


def _panel(figure: Figure, axes: Axes, rows: list[Row], keys: tuple[str, str], name: str, limit: float) -> QuadMesh:
    x, y = (np.unique([row[key] for row in rows]) for key in keys)
    values = np.full((len(y), len(x)), np.nan)
    for row in rows:
        values[np.searchsorted(y, row[keys[1]]), np.searchsorted(x, row[keys[0]])] = 100 * row[name]
    mesh = axes.pcolormesh(x, y, values, cmap="RdBu_r", vmin=-limit, vmax=limit, shading="nearest")
    axes.contour(x, y, values, levels=[-100 * EQUAL, 100 * EQUAL], colors="black", linewidths=0.8)
    axes.set_xscale("log")
    axes.grid(False)
    return mesh


def _point(row: Row) -> tuple[float, float]:
    first, second = list(row.values())[:2]
    return first, second


def signs(rows: list[Row], name: str) -> tuple[int, int, int]:
    """How many points over-estimate, agree within 2 %, under-estimate."""
    errors: Array = np.array([row[name] for row in rows])
    return int(np.sum(errors > EQUAL)), int(np.sum(np.abs(errors) <= EQUAL)), int(np.sum(errors < -EQUAL))
