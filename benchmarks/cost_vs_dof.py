"""Time and memory of a Green's function against the number of unknowns.

Two bodies of steel: a block, 20 x 20 x 8 mm with a patch of 8 x 8 mm, in uniform 27-node hexahedra with a nodal mass;
and an annular seat, in tetrahedra of order 2 graded to the lip, consistent mass. Every point runs in a process
of its own; it is appended to results/cost_vs_dof.jsonl and not run again.

Run: OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 python benchmarks/cost_vs_dof.py [wall seconds after which no point is begun]
"""

from __future__ import annotations

import json
import multiprocessing
import resource
import sys
from dataclasses import asdict, dataclass
from pathlib import Path
from time import perf_counter, process_time
from typing import Literal

import numpy as np
from matplotlib.ticker import NullFormatter
from table import RESULTS, Table, publish

from impact.pictures.drawing import BLUE, GREEN, ORANGE, sheet
from seatfem.structures.elements.assembly import assemble
from seatfem.structures.materials import Material
from seatfem.structures.mesh.meshing import make_mesh
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.model import SecondOrderModel
from seatfem.structures.reduction.greens import GreensFunction, reduce_model
from seatfem.structures.shapes import AnnularSeat, Block

STEEL = Material(200e9, 0.3, 7850.0)
DURATION, TOLERANCE, DAMPING = 1e-5, 1e-2, 0.1
PER_WAVE = 3.0  # elements of order 2 per shear wave at the upper end of the band
SIZES = (2.5e-3, 2e-3, 1.5e-3, 1e-3, 0.8e-3, 0.667e-3, 0.5e-3, 0.43e-3)  # of the elements [m]
LIP = 0.4  # size of the elements on the seat's lip, of that in the bulk
POINTS, PICTURE = RESULTS / "cost_vs_dof.jsonl", Path(__file__).parents[1] / "docs" / "images" / "cost_vs_dof.png"


@dataclass(frozen=True)
class Curve:
    """A reduction on a body, for sizes of the elements in a range [m]."""

    body: Literal["block", "seat"]
    method: str
    finest: float
    coarsest: float
    colour: str

    @property
    def label(self) -> str:
        """For the picture."""
        return f"{self.method}, {'uniform block' if self.body == 'block' else 'graded annular seat'}"


CURVES = (
    Curve("block", "lanczos", 0.43e-3, 2e-3, BLUE),
    Curve("block", "krylov", 0.8e-3, 2e-3, ORANGE),
    Curve("seat", "krylov", 0.8e-3, 2.5e-3, GREEN),
)


@dataclass(frozen=True)
class Point:
    """One reduction on one mesh: times in s by the clock and of the processors, memory in GiB."""

    body: str
    method: str
    size: float
    bandwidth: float
    dof: int
    assembly: float
    reduction: float
    processor: float
    memory: float
    effort: str


def assembled(body: str, size: float) -> tuple[SecondOrderModel, float]:
    """Model and the seconds of its assembly."""
    if body == "block":
        mesh = make_mesh(Block(20e-3, 20e-3, 8e-3, 8e-3, 8e-3), MeshSpec(size, shape="hex")).mesh
    else:
        mesh = make_mesh(AnnularSeat(), MeshSpec(size, LIP * size)).mesh
    start = perf_counter()
    model = assemble(mesh, STEEL, order=2, mass="nodal" if body == "block" else "consistent")
    return model, perf_counter() - start


def band(size: float) -> float:
    """Upper end of the band that elements of this size carry [Hz]."""
    return STEEL.c_s / (PER_WAVE * size)


def reduced(model: SecondOrderModel, method: str, size: float) -> GreensFunction:
    """The Green's function over the band."""
    return reduce_model(
        model, bandwidth=band(size), duration=DURATION, tolerance=TOLERANCE, damping_ratio=DAMPING, method=method
    ).greens


def measure(body: str, method: str, size: float) -> Point:
    """Mesh, assemble, reduce; the processor time is that of the reduction, all being loaded and compiled before."""
    reduced(assembled(body, SIZES[0])[0], method, SIZES[0])
    model, assembly = assembled(body, size)
    start, begun = perf_counter(), process_time()
    greens = reduced(model, method, size)
    seconds, processor = perf_counter() - start, process_time() - begun
    origin = greens.provenance
    effort = f"{origin['products']} products" if "products" in origin else f"{origin.get('vectors')} vectors"
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    return Point(body, method, size, band(size), model.size, assembly, seconds, processor, peak, effort)


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


def picture(curves: dict[Curve, list[Point]]) -> None:
    """Time and memory against unknowns, with the fitted exponents."""
    labels = {"time": "processor time of the reduction [s]", "memory": "peak memory of the process [GiB]"}
    with sheet(PICTURE, 7.6, 3.9) as figure:
        for axes, quantity in zip(figure.subplots(1, 2), labels, strict=True):
            for curve, points in curves.items():
                values = columns_of(points)[quantity]
                power = f" $\\sim$ dof$^{{{slope(points, values):.2f}}}$" if len(points) > 2 else ""
                dof = [p.dof for p in points]
                axes.loglog(dof, values, "o-", color=curve.colour, markersize=4, label=curve.label + power)
            axes.set(xlabel="unknowns [-]", ylabel=labels[quantity])
            axes.legend(loc="lower right", fontsize=7)
            if quantity == "memory":
                axes.set_yticks((0.3, 0.5, 1, 2, 4), ("0.3", "0.5", "1", "2", "4"))
                axes.yaxis.set_minor_formatter(NullFormatter())
        figure.suptitle("One Green's function, 1 %, 10 µs, a band of 3 elements per shear wave", fontsize=9.5)


def report(points: list[Point]) -> None:
    """Table and picture of the points so far."""
    mine = {c: [p for p in points if (p.body, p.method) == (c.body, c.method)] for c in CURVES}
    curves = {c: sorted(some, key=lambda p: p.dof) for c, some in mine.items() if some}
    fits = "; ".join(
        f"{curve.label}: {', '.join(f'{quantity} {slope(some, v):.2f}' for quantity, v in columns_of(some).items())}"
        for curve, some in curves.items()
        if len(some) > 2
    )
    notes = (
        "Uniform block of 20 x 20 x 8 mm, hexahedra of order 2, nodal mass; an annular seat, tetrahedra of "
        f"order 2, {LIP:g} times as wide on the lip. {TOLERANCE:.0%} over {DURATION:.0e} s, damping ratio {DAMPING}, a "
        f"band of {PER_WAVE:.0f} elements (of the bulk) per shear wave. Peak memory: of the process, mesh and assembly "
        "included. Assembly: by the clock; reduction: processor seconds, which a busy machine spoils less.",
        "One thread, everything loaded and compiled before. The points of lanczos from 144060 unknowns on are older: "
        "not warmed up, and two threads allowed, of which that reduction uses one.",
        f"Exponents of the upper three points: {fits}.",
    )
    columns = ("body", "method", "dof", "size (mm)", "band (MHz)", "assembly (s)", "reduction (s)")
    rows = tuple(line(p) for some in curves.values() for p in some)
    publish("cost_vs_dof", Table("Cost against unknowns", notes, (*columns, "peak (GiB)", "effort"), rows))
    picture(curves)


def line(p: Point) -> tuple[str, ...]:
    """One point in words."""
    sizes = (f"{p.dof}", f"{1e3 * p.size:.2f}", f"{1e-6 * p.bandwidth:.2f}")
    times = (f"{p.assembly:.1f}", f"{p.processor:.2f}")
    return p.body, p.method, *sizes, *times, f"{p.memory:.2f}", p.effort


def main(limit: float) -> None:
    """All points that are not on file, coarsest first."""
    points, end = known(), perf_counter() + limit
    have = {(p.body, p.method, p.size) for p in points}
    RESULTS.mkdir(exist_ok=True)
    for size in SIZES:
        for curve in (c for c in CURVES if c.finest <= size <= c.coarsest):
            task = curve.body, curve.method, size
            if task in have or perf_counter() > end:
                continue
            with multiprocessing.get_context("spawn").Pool(1) as pool:
                points.append(pool.apply(measure, task))
            with POINTS.open("a", encoding="utf-8") as file:
                file.write(json.dumps(asdict(points[-1])) + "\n")
    report(points)


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else np.inf)
