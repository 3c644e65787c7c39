"""Time and memory of large seats, from exponents measured on small ones: python benchmarks/large_seats.py [--write]

A clamped steel cube struck on its upper face, quadratic tetrahedra (factorizations) or hexahedra with a nodal mass
(Lanczos), of the same numbers of unknowns. Power laws are fitted to four sizes and checked at two others, one of them
beyond. Without --write the measurements on file are used again. Processor time on one core; PETSc on one rank, which
does not spin while it waits.
"""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path

import matplotlib as mpl
import numpy as np
import psutil
import skfem

from seatfem.machine.petsc import RANKS
from seatfem.structures.elements.assembly import assemble
from seatfem.structures.model import SecondOrderModel
from seatfem.structures.reduction.krylov_basis import Here
from seatfem.structures.reduction.lanczos_recursion import Recursion
from seatfem.structures.reduction.slepc import on_ranks

ROOT = Path(__file__).parents[1]
RESULTS, PAGE = ROOT / "benchmarks" / "results" / "large_seats.json", ROOT / "docs" / "large_seats.md"
SIDE, BAND, WINDOW, VECTORS = 20e-3, 1e6, 20e-6, 100  # m, Hz, s; Krylov vectors of one port
STEEL = {"young": 200e9, "poisson": 0.3, "density": 7850.0}
FITTED, CHECKED = (7, 9, 11, 13), (10, 16)
SIZES = (1e4, 1e5, 1e6, 1e7, 1e8)
NAMES = {
    "factor": "factor, built-in",
    "vector": "vector, built-in",
    "mumps_factor": "factor, slepc",
    "mumps_vector": "vector, slepc",
    "entries": "factor's entries",
    "files": "start and files, slepc",
    "lanczos": "Lanczos, all steps",
}
BEGIN, END = "<!-- measured -->", "<!-- end -->"


def cube(cells: int, kind: type, mass: str) -> SecondOrderModel:
    """``cells`` on each side."""
    x = np.linspace(0, SIDE, cells + 1)
    faces = {"fixed": lambda p: p[2] < 1e-9, "contact": lambda p: p[2] > SIDE - 1e-9}
    mesh = kind.init_tensor(x, x, x).with_boundaries(faces)
    return assemble(mesh, STEEL, ports={"contact": "contact"}, order=2, mass=mass)


def spent(pid: int | None = None) -> float:
    """Processor time of a process and what it has started [s]."""
    process = psutil.Process(pid)
    own = process.cpu_times()
    children = [child.cpu_times() for child in process.children(recursive=True)] if pid else []
    return sum(each.user + each.system for each in (own, *children))


def measured(cells: int) -> dict[str, float]:
    """One row, by the keys of `NAMES`, in seconds, with the numbers of unknowns."""
    model, shift, row = cube(cells, skfem.MeshTet, "consistent"), 2 * np.pi * BAND, {}
    begun = time.process_time()
    basis = Here(model, "auto").basis(shift, 40)
    row["factor"] = time.process_time() - begun
    begun = time.process_time()
    basis.grow(20)
    row["vector"] = (time.process_time() - begun) / 20
    del basis
    begun = spent()
    with on_ranks(model) as ranks:
        there = ranks.worker._process.pid
        row["files"] = spent() - begun + spent(there)
        begun = spent(there)
        answer = ranks.ask("factorize", square=shift**2)
        row["mumps_factor"], row["entries"] = spent(there) - begun, answer["entries"]
        ranks.ask("start", limit=40)
        begun = spent(there)
        ranks.ask("grow", size=20)
        row["mumps_vector"] = (spent(there) - begun) / 20
    hexes = cube(cells, skfem.MeshHex, "nodal")
    recursion = Recursion(hexes)
    recursion.extend(25)
    begun = time.process_time()
    recursion.extend(45)
    each = (time.process_time() - begun) / 20
    row["steps"] = WINDOW * float(np.sqrt(recursion.highest())) / 4
    return {"dof": model.size, "nnz": model.K.nnz, "hex_nnz": hexes.K.nnz, "lanczos": each * row["steps"], **row}


def law(rows: list[dict[str, float]], key: str) -> tuple[float, float, float]:
    """(a, b, c) of a + b n^c: c = 1 of start and files, a = 0 of the others."""
    n, y = (np.array([row[name] for row in rows]) for name in ("dof", key))
    if key == "files":
        slope, start = np.polyfit(n, y, 1)
        return float(start), max(float(slope), 0.0), 1.0
    exponent, constant = np.polyfit(np.log(n), np.log(y), 1)
    return 0.0, float(np.exp(constant)), float(exponent)


def value(fitted: tuple[float, float, float], n: np.ndarray | float) -> np.ndarray | float:
    """Of a law at n unknowns."""
    start, factor, exponent = fitted
    return start + factor * n**exponent


def told(number: float, units: tuple[tuple[float, str], ...]) -> str:
    """With the largest unit that fits."""
    size, unit = next(((size, unit) for size, unit in units if number >= size), units[-1])
    return f"{float(f'{number / size:.2g}'):g} {unit}"


TIME = ((31_557_600.0, "years"), (86_400.0, "d"), (3600.0, "h"), (60.0, "min"), (1.0, "s"))
BYTES = ((1e15, "PB"), (1e12, "TB"), (1e9, "GB"), (1e6, "MB"))


def tables(fitted: list[dict[str, float]], checked: list[dict[str, float]]) -> str:
    """The exponents and their check, and what follows."""
    laws = {key: law(fitted, key) for key in NAMES}
    per_row, hex_row = (float(np.mean([row[key] / row["dof"] for row in fitted])) for key in ("nnz", "hex_nnz"))

    def at(key: str, n: float) -> float:
        return float(value(laws[key], n))

    others = [row["dof"] for row in checked]
    lines = [
        "| quantity | exponent of n | " + " | ".join(f"measured over fitted, {n:,.0f}" for n in others) + " |",
        f"| --- | --- |{' --- |' * len(checked)}",
    ]
    for key, name in NAMES.items():
        off = " | ".join(f"{row[key] / at(key, row['dof']):.2f}" for row in checked)
        lines.append(f"| {name} | {laws[key][2]:.2f} | {off} |")
    lines += [
        "",
        "| unknowns | factor, memory | K and M | basis | built-in | slepc, one rank | of it start and files | "
        "Lanczos | Lanczos, memory |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for n in SIZES:
        direct = at("factor", n) + VECTORS * at("vector", n)
        ranks = at("files", n) + at("mumps_factor", n) + VECTORS * at("mumps_vector", n)
        memory = (8 * at("entries", n), 16 * per_row * n, 8 * VECTORS * n, (12 * hex_row + 96) * n)
        factor, matrices, basis, products = (told(each, BYTES) for each in memory)
        times = " | ".join(told(each, TIME) for each in (direct, ranks, at("files", n), at("lanczos", n)))
        lines.append(f"| {n:.0e} | {factor} | {matrices} | {basis} | {times} | {products} |")
    return "\n".join(lines)


def draw(fitted: list[dict[str, float]], checked: list[dict[str, float]]) -> None:
    """Processor time against unknowns."""
    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(figsize=(6.4, 4.2), layout="constrained")
    sums = {
        "built-in (PARDISO), 100 Krylov vectors": lambda get: get("factor") + VECTORS * get("vector"),
        "slepc (MUMPS), 100 Krylov vectors, one rank": lambda get: (
            get("files") + get("mumps_factor") + VECTORS * get("mumps_vector")
        ),
        "Lanczos, nodal mass, 20 µs": lambda get: get("lanczos"),
    }
    n = np.logspace(3.3, 8, 60)
    laws = {key: law(fitted, key) for key in NAMES}
    for (name, total), colour in zip(sums.items(), ("#0072B2", "#D55E00", "#009E73"), strict=True):
        axes.loglog(n, total(lambda key: value(laws[key], n)), color=colour, label=name)
        for rows, face in ((fitted, colour), (checked, "white")):
            points = [total(row.__getitem__) for row in rows]
            axes.loglog([row["dof"] for row in rows], points, "o", color=colour, mfc=face, ms=5)
    axes.set(xlabel="unknowns", ylabel="processor time [s]", title="A steel cube of 20 mm, band 1 MHz")
    axes.plot([], [], "o", color="black", label="fitted")
    axes.plot([], [], "o", color="black", mfc="white", label="not fitted")
    axes.legend(frameon=False, fontsize=8)
    axes.grid(alpha=0.3)
    figure.savefig(ROOT / "docs" / "images" / "large_seats.png", dpi=130)


def main() -> None:
    """Measures, or reads what was; writes tables and chart."""
    os.environ[RANKS] = "1"
    if "--write" in sys.argv:
        measured(3)  # loads what is compiled
        rows = {cells: measured(cells) for cells in sorted((*FITTED, *CHECKED))}
        RESULTS.write_text(json.dumps(rows, indent=1) + "\n", encoding="utf-8")
    rows = {int(cells): row for cells, row in json.loads(RESULTS.read_text(encoding="utf-8")).items()}
    fitted, checked = ([rows[cells] for cells in which] for which in (FITTED, CHECKED))
    found = tables(fitted, checked)
    if PAGE.exists():
        before, rest = PAGE.read_text(encoding="utf-8").split(BEGIN)
        PAGE.write_text(f"{before}{BEGIN}\n{found}\n{END}{rest.split(END)[1]}", encoding="utf-8")
    draw(fitted, checked)
    sys.stdout.write(found + "\n")


if __name__ == "__main__":
    main()
