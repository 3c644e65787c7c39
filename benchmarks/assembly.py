"""Assembly of K and M against scikit-fem's own forms and against the sparsity pattern alone, in one run."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter
from typing import Any

import numpy as np
import skfem
from scipy import sparse
from skfem.helpers import dot
from skfem.models.elasticity import linear_elasticity
from table import Table, publish

from seatfem.structures.elements.assembly import assemble
from seatfem.structures.materials import Material

STEEL = Material(200e9, 0.3, 7850.0)
RUNS = 5
CASES = (("tet", 1, 0.0, 14), ("tet", 2, 0.0, 14), ("tet", 2, 0.1, 14), ("hex", 1, 0.0, 24), ("hex", 2, 0.1, 11))
ELEMENTS = {
    ("tet", 1): skfem.ElementTetP1,
    ("tet", 2): skfem.ElementTetP2,
    ("hex", 1): skfem.ElementHex1,
    ("hex", 2): skfem.ElementHex2,
}


@skfem.BilinearForm
def _mass(u: Any, v: Any, _: Any) -> Any:
    return STEEL.density * dot(u, v)


def block(kind: str, order: int, bend: float, cuts: int) -> Any:
    """A cube of tetrahedra or hexahedra; ``bend`` curves those of order 2."""
    first, second = (skfem.MeshTet, skfem.MeshTet2) if kind == "tet" else (skfem.MeshHex, skfem.MeshHex2)
    mesh = first.init_tensor(*(np.linspace(0, 1, cuts + 1),) * 3)
    mesh = mesh.with_boundaries({"contact": lambda x: x[2] > 1 - 1e-9, "fixed": lambda x: x[2] < 1e-9})
    if order == 1:
        return mesh
    points = np.array(second.from_mesh(mesh).doflocs)
    points[1] += bend * points[0] * np.sin(3 * points[2])
    return second(points, mesh.t).with_boundaries(mesh.boundaries)


def plain(mesh: Any, kind: str, order: int, bend: float) -> None:
    """scikit-fem's own forms with the same quadrature, bases included."""
    element = skfem.ElementVector(ELEMENTS[kind, order]())
    extra = 2 if bend and kind == "tet" else 0
    degrees = (2 * order + 1,) * 2 if kind == "hex" else (max(2 * order - 2 + extra, 1), 2 * order + extra)
    for form, degree in zip((linear_elasticity(*STEEL.lame), _mass), degrees, strict=True):
        skfem.asm(form, skfem.Basis(mesh, element, intorder=degree, disable_doflocs=True))


def pattern(cells: Any) -> Any:
    """Compressed rows of ones by SciPy, for cells (L, m) of unknowns."""
    rows, columns = np.broadcast_arrays(cells.T[:, :, None], cells.T[:, None, :])
    ones = np.ones(rows.size)
    return sparse.coo_array((ones, (rows.ravel(), columns.ravel())), shape=(cells.max() + 1,) * 2).tocsr()


def seconds(work: Callable[[], object]) -> float:
    """Wall time of one call."""
    start = perf_counter()
    work()
    return perf_counter() - start


def row(kind: str, order: int, bend: float, cuts: int) -> tuple[str, ...]:
    """One line of the table: medians of interleaved runs, scikit-fem's once."""
    mesh = block(kind, order, bend, cuts)
    cells = skfem.Basis(mesh, ELEMENTS[kind, order](), intorder=1).element_dofs
    unknowns = (3 * cells[:, None, :] + np.arange(3)[None, :, None]).reshape(-1, cells.shape[1])
    assemble(mesh, STEEL, order=order)  # compiled, or read from numba's cache
    work = (lambda: assemble(mesh, STEEL, order=order), lambda: pattern(cells), lambda: pattern(unknowns))
    times = np.median([[seconds(each) for each in work] for _ in range(RUNS)], axis=0)
    theirs = seconds(lambda: plain(mesh, kind, order, bend))
    ours, scalar, vector = times
    about = f"{kind} P{order}" if kind == "tet" else f"{kind} Q{order}"
    return (
        about + (", curved" if bend else ", straight"),
        str(mesh.nelements),
        str(3 * (int(cells.max()) + 1)),
        f"{ours:.3f}",
        f"{theirs / ours:.0f}",
        f"{ours / vector:.2f}",
        f"{ours / scalar:.1f}",
    )


def main() -> None:
    """The table of all cases."""
    notes = (
        f"Medians of {RUNS} interleaved runs, scikit-fem's once. `assemble` makes K, M, checks, constraints and port.",
        "scikit-fem: two bases and `asm` of linear_elasticity and of the mass, unconstrained. Aim: 15 times its speed.",
        "Pattern: SciPy's coo -> csr of ones from the element table, all unknowns coupled as in K. Aim: at most twice "
        "that. The pattern of the nodes has a ninth of its entries, each of which stands for 3 x 3 of K.",
    )
    columns = (
        "elements",
        "number",
        "dof",
        "assemble (s)",
        "scikit-fem / ours",
        "ours / pattern of K",
        "ours / pattern of nodes",
    )
    publish("assembly", Table("Assembly", notes, columns, tuple(row(*case) for case in CASES)))


if __name__ == "__main__":
    main()
