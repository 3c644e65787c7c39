"""Time and memory of a Green's function against the number of unknowns.

A block of steel, 20 x 20 x 8 mm with a patch of 8 x 8 mm, in 27-node hexahedra with a nodal mass. Every point runs in a
process of its own; it is appended to results/cost_vs_dof.jsonl and not run again.

Run: OMP_NUM_THREADS=2 python benchmarks/cost_vs_dof.py [wall seconds after which no point is begun]
"""

from __future__ import annotations

import json
import multiprocessing
import resource
import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from time import perf_counter, process_time

import numpy as np
from table import RESULTS, Table, publish

from impact.drawing import BLUE, ORANGE, sheet
from seatfem.elements.assembly import assemble
from seatfem.geometry import Block
from seatfem.materials import Material
from seatfem.mesh.meshing import make_mesh
from seatfem.mesh.spec import MeshSpec
from seatfem.roads.choice import Method
from seatfem.roads.greens import reduce_model

STEEL = Material(200e9, 0.3, 7850.0)
DURATION, TOLERANCE, DAMPING = 1e-5, 1e-2, 0.1
PER_WAVE = 3.0  # elements of order 2 per shear wave at the upper end of the band
SIZES = (2e-3, 1.5e-3, 1e-3, 0.8e-3, 0.667e-3, 0.5e-3, 0.43e-3)  # of the elements [m]
SMALLEST: dict[Method, float] = {"lanczos": 0.0, "krylov": 0.8e-3}  # size down to which a road is run [m]
COLOURS = {"krylov": ORANGE, "lanczos": BLUE}
POINTS, PICTURE = RESULTS / "cost_vs_dof.jsonl", Path(__file__).parents[1] / "docs" / "images" / "cost_vs_dof.png"


@dataclass(frozen=True)
class Point:
    """One road on one mesh: times in s by the clock and of the processors, memory in GiB."""

    road: str
    size: float
    bandwidth: float
    dof: int
    assembly: float
    reduction: float
    processor: float
    memory: float
    effort: str


def measure(road: Method, size: float) -> Point:
    """Mesh, assemble, reduce; the processor time is that of the reduction."""
    mesh = make_mesh(Block(20e-3, 20e-3, 8e-3, 8e-3, 8e-3), MeshSpec(size, shape="hex")).mesh
    start = perf_counter()
    model = assemble(mesh, STEEL, order=2, mass="nodal")
    assembled, begun = perf_counter(), process_time()
    band = STEEL.c_s / (PER_WAVE * size)
    greens = reduce_model(
        model, bandwidth=band, duration=DURATION, tolerance=TOLERANCE, damping_ratio=DAMPING, method=road
    ).greens
    done, processor = perf_counter(), process_time() - begun
    origin = greens.provenance
    effort = f"{origin['products']} products" if "products" in origin else f"{origin.get('vectors')} vectors"
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    return Point(road, size, band, model.size, assembled - start, done - assembled, processor, peak, effort)


def known() -> list[Point]:
    """The points on file."""
    if not POINTS.exists():
        return []
    return [Point(**json.loads(line)) for line in POINTS.read_text(encoding="utf-8").splitlines()]


def slope(points: list[Point], values: list[float]) -> float:
    """Exponent of ``values`` in the unknowns, from the upper three points."""
    return float(np.polyfit(np.log([p.dof for p in points[-3:]]), np.log(values[-3:]), 1)[0])


def columns_of(points: list[Point]) -> dict[str, list[float]]:
    """What is fitted and drawn."""
    return {"time": [p.processor for p in points], "memory": [p.memory for p in points]}


def picture(roads: dict[str, list[Point]]) -> None:
    """Time and memory against unknowns, with the fitted exponents."""
    labels = {"time": "processor time of the reduction [s]", "memory": "peak memory of the process [GiB]"}
    with sheet(PICTURE, 7.6, 3.5) as figure:
        for axes, quantity in zip(figure.subplots(1, 2), labels, strict=True):
            for road, points in roads.items():
                values = columns_of(points)[quantity]
                power = f", ~ dof$^{{{slope(points, values):.2f}}}$" if len(points) > 2 else ""
                dof = [p.dof for p in points]
                axes.loglog(dof, values, "o-", color=COLOURS[road], markersize=4, label=road + power)
            axes.set(xlabel="unknowns [-]", ylabel=labels[quantity])
            axes.legend(loc="upper left")
        figure.suptitle("One Green's function of a block, 1 %, 10 µs", fontsize=9.5)


def report(points: list[Point]) -> None:
    """Table and picture of the points so far."""
    roads = {r: sorted((p for p in points if p.road == r), key=lambda p: p.dof) for r in SMALLEST}
    roads = {road: mine for road, mine in roads.items() if mine}
    fits = [
        f"{road} {quantity} {slope(mine, values):.2f}"
        for road, mine in roads.items()
        if len(mine) > 2
        for quantity, values in columns_of(mine).items()
    ]
    notes = (
        f"Block of 20 x 20 x 8 mm, hexahedra of order 2, nodal mass; {TOLERANCE:.0%} over {DURATION:.0e} s, damping "
        f"ratio {DAMPING}, a band of {PER_WAVE:.0f} elements per shear wave. Peak memory: of the "
        "process, mesh and assembly included; processor: seconds of all threads in the reduction.",
        f"Exponents of the upper three points: {', '.join(fits)}.",
    )
    columns = ("road", "dof", "size (mm)", "band (MHz)", "assembly (s)", "reduction (s)", "processor (s)", "peak (GiB)")
    publish("cost_vs_dof", Table("Cost against unknowns", notes, (*columns, "effort"), tuple(map(line, points))))
    picture(roads)


def line(p: Point) -> tuple[str, ...]:
    """One point in words."""
    sizes = (f"{p.dof}", f"{1e3 * p.size:.2f}", f"{1e-6 * p.bandwidth:.2f}")
    return (
        p.road,
        *sizes,
        f"{p.assembly:.1f}",
        f"{p.reduction:.2f}",
        f"{p.processor:.2f}",
        f"{p.memory:.2f}",
        p.effort,
    )


def main(limit: float) -> None:
    """All points that are not on file, coarsest first."""
    points, end = known(), perf_counter() + limit
    have = {(p.road, p.size) for p in points}
    RESULTS.mkdir(exist_ok=True)
    for size in SIZES:
        for road, smallest in SMALLEST.items():
            if size < smallest or (road, size) in have or perf_counter() > end:
                continue
            with multiprocessing.get_context("spawn").Pool(1) as pool:
                points.append(pool.apply(measure, (road, size)))
            with POINTS.open("a", encoding="utf-8") as file:
                file.write(json.dumps(asdict(points[-1])) + "\n")
    report(points)


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else np.inf)
