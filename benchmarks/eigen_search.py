"""SciPy's eigsh (ARPACK) beside the own search of natural modes, with the same factorizations and inertia counts.

    python benchmarks/eigen_search.py [ROUNDS]

In each round both compute each body's modes in turn; the table has the least processor time of each. eigsh iterates
about a shift below the spectrum: shifts inside it took longer. A factorization at a gap behind the last mode counts
those that are missing.
"""

from __future__ import annotations

import sys

import numpy as np
import skfem
from scipy.sparse.linalg import LinearOperator, eigsh
from speed import block
from table import Table, publish, timed

from seatfem.structures.elements.assembly import assemble
from seatfem.structures.materials import Material
from seatfem.structures.model import SecondOrderModel
from seatfem.structures.reduction.eigen_search import counting_shift, default_shift
from seatfem.structures.reduction.factorization import factorize
from seatfem.structures.reduction.modes import solve_modes
from seatfem.structures.reduction.spectrum import TOLERANCE
from seatfem.structures.shapes import Disc
from seatfem.structures.sheets import Sheet, model_of

STEEL = Material(206e9, 0.3, 7800.0)


def free_box(kind: type[skfem.Mesh], *cells: tuple[float, int]) -> SecondOrderModel:
    """Return a free box of quadratic elements with ``cells`` along each length [m]."""
    mesh = kind.init_tensor(*(np.linspace(0, length, count + 1) for length, count in cells))
    return assemble(mesh, STEEL, fixed=(), ports={}, order=2)


def bodies() -> dict[str, tuple[SecondOrderModel, int]]:
    """Return the model and the number of modes of each case."""
    return {
        "200 modes of a free disc (plate), in pairs": (model_of(Sheet(Disc(20e-3, 0.2e-3), STEEL, 250e3), ()), 200),
        "60 modes of a held block (solid)": (block(19), 60),
        "40 modes of a free block": (free_box(skfem.MeshTet, (20e-3, 9), (21e-3, 9), (8e-3, 4)), 40),
        "60 modes of a free cube, in twos and threes": (free_box(skfem.MeshHex, *3 * ((10e-3, 9),)), 60),
    }


def missing_of_eigsh(model: SecondOrderModel, n: int, tolerance: float) -> int:
    """Return how many of at least the ``n`` lowest modes eigsh leaves out, by inertia."""
    square = default_shift(model) ** 2
    factor = factorize(model.K + square * model.M, name="K + s^2 M")
    inverse = LinearOperator(model.K.shape, matvec=factor.solve, dtype=float)
    start = np.random.default_rng(0).standard_normal(model.size)
    more = n + max(4, n // 20)  # the count is made at a gap among these
    found = eigsh(model.K, more, model.M, sigma=-square, OPinv=inverse, v0=start, tol=tolerance)[0]
    values = np.sort(found)[n - 1 :]
    last = int(np.argmax(np.diff(values) / values[:-1]))
    return counting_shift(model, (values[last] + values[last + 1]) / 2, "auto").count - (n + last)


def main(rounds: int) -> None:
    """Measure and publish the table."""
    rows = []
    for name, (model, n) in bodies().items():
        best, missing = [np.inf] * 3, ["0", "", ""]
        for _ in range(rounds):
            modes, spent = timed(lambda model=model, n=n: solve_modes(model, n))
            assert modes.complete
            best[0] = min(best[0], spent)
            for i, tolerance in enumerate((TOLERANCE, 0.0), 1):
                count, spent = timed(lambda model=model, n=n, limit=tolerance: missing_of_eigsh(model, n, limit))
                best[i], missing[i] = min(best[i], spent), str(count)
        times = (f"{best[0]:.1f} s", *(f"{spent / best[0]:.2f} times" for spent in best[1:]))
        rows.append((name, f"{model.size:,}", times[0], times[1], missing[1], times[2], missing[2]))
    notes = (
        f"Processor time of one thread, the least of {rounds} rounds in turn, with all factorizations and counts.",
        "Aim of a replacement: none missing within 1.5 times in each case.",
    )
    columns = ("case", "unknowns", "own search", f"eigsh, tolerance {TOLERANCE:.0e}", "missing", "eigsh, 0", "missing")
    publish("eigen_search", Table("Natural modes: eigsh beside the own search", notes, columns, tuple(rows)))


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 3)
