"""The sparse factorization at its own speed: what a bare call costs, what a wrapper adds, what several vectors save.

Run: python -m benchmarks.factorization
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from time import perf_counter

import numpy as np
import skfem
from scipy import sparse

from benchmarks.table import Table, publish
from seatfem.elements.assembly import assemble
from seatfem.model import Material, SecondOrderModel
from seatfem.roads.factorization import factorize

STEEL = Material(200e9, 0.3, 7850.0)
SHIFT = 2 * np.pi * 2e5
CELLS = (8, 12, 18, 24)


def block(cells: int) -> SecondOrderModel:
    """20 x 21 x 8 mm of steel, quadratic tetrahedra."""
    mesh = skfem.MeshTet.init_tensor(
        *(np.linspace(0, a, n + 1) for a, n in ((20e-3, cells), (21e-3, cells), (8e-3, cells // 2)))
    )
    boundaries = {"contact": lambda x: x[2] > 8e-3 - 1e-9, "fixed": lambda x: x[2] < 1e-9}
    return assemble(mesh.with_boundaries(boundaries), STEEL, order=2)


def best(call: Callable[[], object], repeats: int = 3) -> float:
    """Shortest of a few runs [s]."""
    times = []
    for _ in range(repeats):
        start = perf_counter()
        call()
        times.append(perf_counter() - start)
    return min(times)


def row(cells: int) -> tuple[str, ...]:
    """One size."""
    model = block(cells)
    matrix = model.K + SHIFT**2 * model.M
    start = perf_counter()
    factor = factorize(matrix, backend="pardiso")
    made = perf_counter() - start
    rng = np.random.default_rng(0)
    one, sixteen = rng.random(model.size), np.asfortranarray(rng.random((model.size, 16)))
    bare, block_of_16 = best(lambda: factor.solve(one)), best(lambda: factor.solve(sixteen)) / 16
    wrapper = importlib.import_module("pypardiso").PyPardisoSolver(mtype=2)
    upper = sparse.csr_matrix(sparse.triu(matrix, format="csr"))
    wrapper.factorize(upper)
    wrapped = best(lambda: wrapper.solve(upper, one))
    wrapper.free_memory(everything=True)
    return (
        f"{model.size}",
        f"{made:.2f}",
        f"{1e3 * bare:.1f}",
        f"{1e3 * wrapped:.1f}",
        f"{wrapped / bare:.2f}",
        f"{1e3 * block_of_16:.1f}",
        f"{bare / block_of_16:.1f}",
    )


def main() -> None:
    """All sizes."""
    importlib.import_module("pypardiso")
    factorize(sparse.csr_array(np.eye(3)))  # the library is found and loaded once
    publish(
        "factorization",
        Table(
            "Factorization of K + s^2 M, PARDISO",
            (
                "Upper triangle, Cholesky. 'bare': phase 33 called directly; 'wrapped': pypardiso's own solve() on the "
                "same upper triangle, which compares or hashes the matrix in every call. Times of one run on a shared "
                "machine: read ratios.",
            ),
            ("unknowns", "factorize [s]", "bare [ms]", "wrapped [ms]", "ratio", "of 16, each [ms]", "gain"),
            tuple(row(cells) for cells in CELLS),
        ),
    )


if __name__ == "__main__":
    main()
