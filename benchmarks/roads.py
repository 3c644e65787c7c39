"""What a Green's function costs by each road, against the number of unknowns: time, memory, exponents, a picture.

Every row runs in a process of its own, so that its peak memory is its own.

Run: python -m benchmarks.roads [largest number of unknowns for Lanczos]
"""

from __future__ import annotations

import multiprocessing
import resource
import sys
from dataclasses import dataclass
from time import perf_counter

import numpy as np
import skfem

from benchmarks.table import RESULTS, Table, publish
from impact.drawing import sheet
from seatfem.elements.assembly import assemble
from seatfem.model import Material, SecondOrderModel
from seatfem.roads.choice import Method
from seatfem.roads.greens import greens_function

STEEL = Material(200e9, 0.3, 7850.0)
BANDWIDTH, DURATION, TOLERANCE = 3e5, 1e-5, 1e-2
CELLS = (7, 10, 16, 24, 34, 48)  # along the longest edge
LIMITS: dict[Method, int] = {"lanczos": 1_200_000, "krylov": 120_000}  # unknowns; modes would be 1500 and more


@dataclass(frozen=True)
class Row:
    """One road on one mesh; times in s, memory in GiB."""

    road: Method
    dof: int
    entries: int
    assembly: float
    seconds: float
    memory: float
    effort: str


def block(cells: int) -> SecondOrderModel:
    """20 x 21 x 8 mm of steel, 27-node hexahedra, nodal (Gauss-Lobatto) mass; a patch of 8 x 8 mm."""
    lengths = ((20e-3, cells), (21e-3, cells), (8e-3, max(2, round(0.4 * cells))))
    mesh = skfem.MeshHex.init_tensor(*(np.linspace(0, a, n + 1) for a, n in lengths))
    boundaries = {
        "contact": lambda x: (x[2] > 8e-3 - 1e-9) & (x[0] < 8.2e-3) & (x[1] < 8.2e-3),
        "fixed": lambda x: x[2] < 1e-9,
    }
    return assemble(mesh.with_boundaries(boundaries), STEEL, order=2, mass="nodal")


def unknowns(cells: int) -> int:
    """Of `block`."""
    return 3 * (2 * cells + 1) ** 2 * 2 * max(2, round(0.4 * cells))


def measure(task: tuple[Method, int]) -> Row:
    """One row."""
    road, cells = task
    start = perf_counter()
    model = block(cells)
    assembled = perf_counter()
    greens = greens_function(model, bandwidth=BANDWIDTH, duration=DURATION, tolerance=TOLERANCE, method=road)
    done = perf_counter()
    effort = next(
        (f"{greens.provenance[k]} {k}" for k in ("products", "vectors", "modes") if k in greens.provenance), ""
    )
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    return Row(road, model.size, model.K.nnz, assembled - start, done - assembled, peak, effort)


def exponent(rows: list[Row]) -> float:
    """Slope of log time over log unknowns, of the larger half."""
    rows = rows[len(rows) // 2 - 1 :]
    return float(np.polyfit(np.log([r.dof for r in rows]), np.log([r.seconds for r in rows]), 1)[0])


def picture(rows: list[Row]) -> None:
    """Time against unknowns."""
    with sheet(RESULTS / "roads.svg", 6.4, 4.2) as figure:
        axes = figure.subplots()
        for road in LIMITS:
            mine = [r for r in rows if r.road == road]
            if mine:
                axes.loglog([r.dof for r in mine], [r.seconds for r in mine], "o-", label=road)
        axes.set(xlabel="unknowns", ylabel="time [s]", title="Green's function to 1 %, after assembly")
        axes.legend()


def report(rows: list[Row]) -> None:
    """Table and picture of the rows so far."""
    roads = {road: [r for r in rows if r.road == road] for road in LIMITS}
    slopes = ", ".join(f"{road} {exponent(mine):.2f}" for road, mine in roads.items() if len(mine) > 2)
    publish(
        "roads",
        Table(
            "Cost of a Green's function against unknowns",
            (
                f"To {TOLERANCE:.0%} in a band of {BANDWIDTH:.0e} Hz over {DURATION:.0e} s, undamped; hexahedra with a "
                "nodal mass. Time without assembly; memory is the peak of the whole process, assembly included.",
                f"Exponents of time over the larger half: {slopes}.",
            ),
            ("road", "unknowns", "entries of K", "assembly [s]", "time [s]", "peak [GiB]", "effort"),
            tuple(cells(row) for row in rows),
        ),
    )
    picture(rows)


def cells(r: Row) -> tuple[str, ...]:
    """One row in words."""
    times = (f"{r.assembly:.1f}", f"{r.seconds:.2f}", f"{r.memory:.1f}")
    return (r.road, f"{r.dof}", f"{r.entries:.2e}", *times, r.effort)


def main(largest: int) -> None:
    """All rows, smallest first; the files are complete after each."""
    limits = {**LIMITS, "lanczos": min(largest, LIMITS["lanczos"])}
    tasks = [(road, cells) for road, limit in limits.items() for cells in CELLS if unknowns(cells) <= limit]
    rows: list[Row] = []
    for task in sorted(tasks, key=lambda task: task[1]):
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            rows.append(pool.apply(measure, (task,)))
        report(rows)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 1_200_000)
