"""The eigensolver against ARPACK on the same factorization and, where it is installed, against CalculiX.

Two meshes of one block: hexahedra, and tetrahedra that CalculiX has too (its program is ccx, Debian's calculix-ccx).

Run: OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 python benchmarks/modes.py
"""

from __future__ import annotations

import os
from collections.abc import Callable
from time import perf_counter
from unittest import mock

import numpy as np
import skfem
from peers import calculix
from scipy.sparse.linalg import LinearOperator, eigsh
from table import Table, publish

from seatfem.structures.elements.assembly import assemble
from seatfem.structures.materials import Material
from seatfem.structures.model import SecondOrderModel
from seatfem.structures.reduction import factorization
from seatfem.structures.reduction.eigen_search import default_shift
from seatfem.structures.reduction.factorization import factorize
from seatfem.structures.reduction.modes import solve_modes

STEEL = Material(200e9, 0.3, 7850.0)
SIDES = (20e-3, 20e-3, 8e-3)
HEXAHEDRA, TETRAHEDRA = (21, 21, 8), (20, 20, 7)
MODES = 60
NAMED = {"contact": lambda x: x[2] > SIDES[2] - 1e-9, "fixed": lambda x: x[2] < 1e-9}
Numbers = np.ndarray[tuple[int, ...], np.dtype[np.float64]]


def grid(cells: tuple[int, int, int], kind: type[skfem.Mesh3D]) -> skfem.Mesh3D:
    """The block, clamped below."""
    mesh = kind.init_tensor(*(np.linspace(0, side, n + 1) for side, n in zip(SIDES, cells, strict=True)))
    return mesh.with_boundaries(NAMED)


def arpack(model: SecondOrderModel) -> Numbers:
    """One right-hand side at a time, a shift below the spectrum, and a second factorization that counts."""
    shift, wanted = default_shift(model), MODES + 4
    factor = factorize(model.K + shift**2 * model.M)
    inverse = LinearOperator((model.size,) * 2, matvec=lambda x: factor.solve(np.ravel(x)), dtype=np.float64)
    start = np.random.default_rng(0).standard_normal(model.size)
    values, _ = eigsh(model.K, wanted, model.M, sigma=-(shift**2), OPinv=inverse, v0=start)
    values = np.sort(values)
    last = MODES - 1 + int(np.argmax(np.diff(values[MODES - 1 :])))
    behind = model.K - (values[last] + values[last + 1]) / 2 * model.M
    counted = factorize(behind, definite=False, tolerance=1e-3).negative_pivots
    if counted != last + 1:
        raise ArithmeticError(f"ARPACK finds {last + 1} of {counted} modes")
    return np.sqrt(values[:MODES]) / (2 * np.pi)


def arpack_as_it_comes(model: SecondOrderModel) -> Numbers:
    """The same with PARDISO's own settings, which refine every solve twice."""
    with mock.patch.object(factorization, "_SETTINGS", {}), mock.patch.object(factorization, "_ROUGH", -1.0):
        return arpack(model)


def ours(model: SecondOrderModel) -> Numbers:
    """The same, complete."""
    found = solve_modes(model, MODES)
    if not found.complete:
        raise ArithmeticError("our modes are not complete")
    return found.frequencies_hz


def theirs(model: SecondOrderModel) -> tuple[Numbers, float, float]:
    """Frequencies, processor and wall seconds of ccx, one thread."""
    start = perf_counter()
    found = calculix.frequencies(model, STEEL, MODES)
    return found.values, found.seconds, perf_counter() - start


def timed(work: Callable[[], Numbers]) -> tuple[Numbers, float, float]:
    """What it gives, processor and wall seconds."""
    before, start = os.times(), perf_counter()
    found = work()
    return found, sum(os.times()[:2]) - sum(before[:2]), perf_counter() - start


def row(
    body: str, size: int, name: str, theirs: tuple[Numbers, float, float], mine: tuple[Numbers, float, float]
) -> tuple[str, ...]:
    """One comparison."""
    apart = float(np.abs(theirs[0] / mine[0] - 1).max())
    seconds = (f"{processor:.1f} / {wall:.1f}" for _, processor, wall in (theirs, mine))
    return body, f"{size}", name, *seconds, f"{theirs[1] / mine[1]:.1f}", f"{theirs[2] / mine[2]:.1f}", f"{apart:.0e}"


def main() -> None:
    """Both meshes."""
    solve_modes(assemble(grid((6, 6, 3), skfem.MeshHex), STEEL, order=2), 10)  # libraries are loaded
    rows = []
    model = assemble(grid(HEXAHEDRA, skfem.MeshHex), STEEL, order=2, mass="nodal")
    mine = timed(lambda: ours(model))
    usual = timed(lambda: arpack_as_it_comes(model))
    rows.append(row("hexahedra", model.size, "ARPACK, PARDISO as it comes", usual, mine))
    rows.append(row("hexahedra", model.size, "ARPACK on our factorization", timed(lambda: arpack(model)), mine))
    if not calculix.absent():
        solid = assemble(grid(TETRAHEDRA, skfem.MeshTet), STEEL, order=2)
        rows.append(row("tetrahedra", solid.size, "CalculiX", theirs(solid), timed(lambda: ours(solid))))
    notes = (
        f"The {MODES} lowest modes of a steel block of 20 x 20 x 8 mm, clamped below: second-order elements, one "
        "thread, processor / wall seconds, each pair one after the other in one run.",
        "ARPACK: one right-hand side at a time, shift below the spectrum, and a second factorization that counts; "
        "ours counts too. PARDISO as it comes refines every solve twice. Aim against that: 4 times.",
        "CalculiX: the whole program, reading the mesh included; its mass is integrated with fewer points, so its "
        "frequencies differ. Aim: 5 times.",
    )
    columns = (
        "mesh",
        "unknowns",
        "against",
        "theirs (s)",
        "ours (s)",
        "ratio, processor",
        "ratio, wall",
        "frequencies apart",
    )
    publish("modes", Table("Natural modes", notes, columns, tuple(rows)))


if __name__ == "__main__":
    main()
