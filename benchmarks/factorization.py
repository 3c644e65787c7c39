"""The sparse factorization at its own speed: what a bare call costs, what wrappers add, what several vectors save.

Run: OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 python benchmarks/factorization.py
"""

from __future__ import annotations

import importlib
from collections.abc import Callable
from time import process_time

import numpy as np
import skfem
from scipy import sparse
from table import Table, publish

from seatfem.structures.elements.assembly import assemble
from seatfem.structures.model import Material, SecondOrderModel
from seatfem.structures.reduction.factorization import factorize

STEEL = Material(200e9, 0.3, 7850.0)
SHIFT = 2 * np.pi * 2e5
CELLS = (8, 12, 18)
VECTORS = 16


def block(cells: int) -> SecondOrderModel:
    """20 x 21 x 8 mm of steel, quadratic tetrahedra."""
    mesh = skfem.MeshTet.init_tensor(
        *(np.linspace(0, a, n + 1) for a, n in ((20e-3, cells), (21e-3, cells), (8e-3, cells // 2)))
    )
    boundaries = {"contact": lambda x: x[2] > 8e-3 - 1e-9, "fixed": lambda x: x[2] < 1e-9}
    return assemble(mesh.with_boundaries(boundaries), STEEL, order=2)


def best(work: Callable[[], object], repeats: int) -> float:
    """Least processor seconds of some runs: what a busy machine spoils least."""
    times = []
    for _ in range(repeats):
        start = process_time()
        work()
        times.append(process_time() - start)
    return min(times)


def wrapped(matrix: sparse.csr_matrix, rhs: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> float:
    """Seconds of the wrapper's own solve() on the same upper triangle, factorized before."""
    solver = importlib.import_module("pypardiso").PyPardisoSolver(mtype=2)
    upper = sparse.csr_matrix(sparse.triu(matrix, format="csr"))
    solver.factorize(upper)
    seconds = best(lambda: solver.solve(upper, rhs), 3)
    solver.free_memory(everything=True)
    return seconds


def row(cells: int) -> tuple[str, ...]:
    """One size."""
    pypardiso = importlib.import_module("pypardiso")
    model = block(cells)
    matrix = sparse.csr_matrix(model.K + SHIFT**2 * model.M)
    rng = np.random.default_rng(0)
    one, several = rng.random(model.size), np.asfortranarray(rng.random((model.size, VECTORS)))
    made = best(lambda: factorize(matrix, backend="pardiso"), 2)
    factor = factorize(matrix, backend="pardiso")
    bare, each = best(lambda: factor.solve(one), 3), best(lambda: factor.solve(several), 3) / VECTORS
    theirs_made = best(lambda: pypardiso.spsolve(matrix, one), 1)
    theirs = best(lambda: pypardiso.spsolve(matrix, one), 3)
    own = wrapped(matrix, one)
    pypardiso.ps.free_memory(everything=True)
    return (
        f"{model.size}",
        f"{made:.2f}",
        f"{theirs_made:.2f}",
        f"{theirs_made / (made + bare):.1f}",
        f"{1e3 * bare:.1f}",
        f"{1e3 * theirs:.1f}",
        f"{theirs / bare:.1f}",
        f"{own / bare:.1f}",
        f"{1e3 * each:.1f}",
        f"{theirs / each:.1f}",
    )


def main() -> None:
    """All sizes."""
    factorize(sparse.csr_array(np.eye(3)))  # the library is found and loaded once
    notes = (
        "Ours: upper triangle, Cholesky, phase 33 called directly. `pypardiso.spsolve`: the whole matrix, LU, once "
        "with the factorization and again without; every call compares or hashes the matrix. Its own solve(): on the "
        "same upper triangle, Cholesky. One thread, processor seconds, the least of three runs.",
    )
    columns = (
        "unknowns",
        "factorize, ours (s)",
        "spsolve, first (s)",
        "ratio",
        "solve, ours (ms)",
        "spsolve, again (ms)",
        "ratio",
        "pypardiso's solve() / ours",
        f"ours, {VECTORS} vectors, each (ms)",
        "spsolve / each",
    )
    publish("factorization", Table("Factorization of K + s^2 M, PARDISO", notes, columns, tuple(row(n) for n in CELLS)))


if __name__ == "__main__":
    main()
