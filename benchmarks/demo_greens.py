"""The Green's function of an annular seat by scikit-fem and SciPy alone, by ours on the same mesh, and axisymmetric.

Every attempt of that plain way is a process of its own, in which ours are timed after it. It is appended to
results/demo_greens.jsonl and not run again. 4000 modes and more take hours by ARPACK, all of them 6 GiB by LAPACK.

Run: OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 python benchmarks/demo_greens.py [wall seconds after which none is begun]
"""

from __future__ import annotations

import json
import multiprocessing
import os
import sys
from dataclasses import asdict, dataclass
from time import perf_counter
from typing import Any

import numpy as np
from plain_scikit import assembled, dense_modes, fewer, modal, sparse_modes
from table import RESULTS, Table, publish

from impact.greens.pulse import error_times
from seatfem.structures.elements.assembly import assemble
from seatfem.structures.elements.axisymmetric import assemble_axisymmetric
from seatfem.structures.materials import Material
from seatfem.structures.mesh.meridian import make_meridian
from seatfem.structures.mesh.meshing import make_mesh
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.reduction.greens import greens_function
from seatfem.structures.shapes import AnnularSeat

STEEL, SEAT = Material(200e9, 0.3, 7850.0), AnnularSeat()
COARSE, FULL, FINE = MeshSpec(2.5e-3, 1.25e-3), MeshSpec(1e-3, 0.4e-3), MeshSpec(0.4e-3, 0.05e-3)
BANDWIDTH, ZETA, TOLERANCE = 1e6, 0.1, 1e-2
DURATION = np.log(1e3) / (ZETA * 2 * np.pi * 0.1 * BANDWIDTH)  # a tenth of the band has decayed to 1/1000
TIMES = error_times(DURATION, 1 / BANDWIDTH)
ALL = 0  # modes, by LAPACK
MODES = (250, 500, 1000, ALL, 2000, 4500)
POINTS = RESULTS / "demo_greens.jsonl"


@dataclass(frozen=True)
class Way:
    """One way: unknowns, seconds from the geometry on, and two relative errors of the filtered Green's function.

    ``reduction``: against ours to 1e-4 on the same mesh; ``whole``: against a fine axisymmetric model.
    """

    dof: int
    processor: float
    wall: float
    reduction: float
    whole: float
    effort: str


@dataclass(frozen=True)
class Attempt:
    """The plain way with so many modes and ours beside it; ``enough``: modes that reach the tolerance, or 0."""

    modes: int
    enough: int
    plain: Way
    solid: Way
    section: Way


@dataclass(frozen=True)
class Clock:
    """Seconds of this process and those it has waited for, and by the wall."""

    processor: float
    wall: float

    @staticmethod
    def now() -> Clock:
        """Both."""
        return Clock(sum(os.times()[:4]), perf_counter())

    def plus(self, start: Clock) -> Clock:
        """This many seconds and those since ``start``."""
        end = Clock.now()
        return Clock(self.processor + end.processor - start.processor, self.wall + end.wall - start.wall)


def meshed(spec: MeshSpec) -> tuple[Any, Clock]:
    """Mesh and its seconds."""
    start = Clock.now()
    return make_mesh(SEAT, spec).mesh, Clock(0.0, 0.0).plus(start)


def section(spec: MeshSpec, tolerance: float = TOLERANCE) -> tuple[Any, int, Clock]:
    """Ours on the half section: Green's function, unknowns, seconds."""
    start = Clock.now()
    model = assemble_axisymmetric(make_meridian(SEAT, spec).mesh, STEEL, order=2)
    return ours(model, tolerance), model.size, Clock(0.0, 0.0).plus(start)


def solid(mesh: Any, before: Clock, tolerance: float = TOLERANCE) -> tuple[Any, int, Clock]:
    """Ours in three dimensions on a mesh that is there."""
    start = Clock.now()
    model = assemble(mesh, STEEL, order=2)
    return ours(model, tolerance), model.size, before.plus(start)


def ours(model: Any, tolerance: float) -> Any:
    """Krylov subspace, sized by its own error estimate."""
    return greens_function(
        model, bandwidth=BANDWIDTH, duration=DURATION, tolerance=tolerance, damping_ratio=ZETA, method="krylov"
    )


def filtered(greens: Any) -> Any:
    """g after the pulse of the band: what a tolerance over a band is measured on."""
    return greens.filtered(TIMES, 1 / BANDWIDTH)


def error(greens: Any, reference: Any) -> float:
    """Largest difference relative to the largest value, after the pulse."""
    return float(np.abs(filtered(greens) - reference).max() / np.abs(reference).max())


def attempt(modes: int) -> Attempt:
    """One attempt of that plain way, and ours beside it."""
    section(FULL)  # compiles
    mesh, before = meshed(COARSE)
    solid(mesh, before)
    same, fine = filtered(solid(mesh, before, 1e-4)[0]), filtered(section(FINE, 1e-4)[0])

    start = Clock.now()
    K, M, b = assembled(mesh, STEEL)
    square, shares, static = dense_modes(K, M, b) if modes == ALL else sparse_modes(K, M, b, modes)
    plain, seconds = modal(square, shares, static, ZETA), before.plus(start)
    counts = range(100, len(square) + 1, 50)
    enough = next((n for n, g in fewer(square, shares, static, ZETA, counts) if error(g, same) <= TOLERANCE), 0)

    def way(greens: Any, dof: int, spent: Clock, effort: str) -> Way:
        return Way(dof, spent.processor, spent.wall, error(greens, same), error(greens, fine), effort)

    mine, half = solid(mesh, before), section(FULL)
    effort = f"to {np.sqrt(square[-1]) / (2e6 * np.pi):.2f} MHz"
    vectors = [f"{greens.provenance['vectors']} vectors" for greens in (mine[0], half[0])]
    return Attempt(
        modes, enough, way(plain, K.shape[0], seconds, effort), way(*mine, vectors[0]), way(*half, vectors[1])
    )


def known() -> list[Attempt]:
    """The attempts on file."""
    if not POINTS.exists():
        return []
    lines = (json.loads(line) for line in POINTS.read_text(encoding="utf-8").splitlines())
    return [Attempt(f["modes"], f["enough"], *(Way(**f[key]) for key in ("plain", "solid", "section"))) for f in lines]


def line(a: Attempt) -> tuple[str, ...]:
    """One attempt in words."""
    percent = (f"{100 * e:.2f}" for e in (a.plain.reduction, a.solid.reduction))
    whole = (f"{100 * way.whole:.1f}" for way in (a.plain, a.solid, a.section))
    seconds = (f"{r.processor:.2f} / {r.wall:.2f}" for r in (a.plain, a.solid, a.section))
    ratios = (f"{a.plain.processor / r.processor:.0f} / {a.plain.wall / r.wall:.0f}" for r in (a.solid, a.section))
    modes = f"all {a.plain.dof}, LAPACK" if a.modes == ALL else f"{a.modes}, {a.plain.effort}"
    return modes, *seconds, *ratios, *percent, " / ".join(whole)


def report(attempts: list[Attempt]) -> None:
    """The table of the attempts so far."""
    last = attempts[-1]
    enough = [a.enough for a in attempts if a.enough]
    need = f"It takes {min(enough)} modes." if enough else "No attempt reaches it: every ratio is a lower bound."
    notes = (
        f"Green's function of an annular seat, band {BANDWIDTH:.0e} Hz, damping ratio {ZETA}, to {TOLERANCE:.0%} over "
        f"{DURATION:.1e} s; seconds (processor / wall) from the geometry on, meshing included, one thread, numba "
        "compiled before. Ours are timed after the plain way in the same process.",
        f"Plain: {last.plain.dof} unknowns, skfem.asm, splu of K, eigsh(sigma=0) or LAPACK's eigh, a spring for the "
        f"modes left out. 3-D: ours on the same mesh, {last.solid.effort}. Axisymmetric: at its sizes, "
        f"{last.section.dof} unknowns, {last.section.effort}.",
        f"Error of the reduction: largest difference from ours to 1e-4 on the same mesh, after a Hann pulse of "
        f"{1e6 / BANDWIDTH:.0f} us, relative to the largest value. {need} Whole error (plain / 3-D / axisymmetric): "
        f"against {FINE.contact_size * 1e3:g} mm axisymmetric, mesh included.",
    )
    columns = (
        "modes",
        "plain (s)",
        "3-D (s)",
        "axisymmetric (s)",
        "plain / 3-D",
        "plain / axisymmetric",
        "error plain (%)",
        "error 3-D (%)",
        "whole errors (%)",
    )
    rows = tuple(line(a) for a in sorted(attempts, key=lambda a: a.modes or sys.maxsize))
    publish("demo_greens", Table("Demo seat", notes, columns, rows))


def main(limit: float) -> None:
    """All attempts that are not on file."""
    attempts, end = known(), perf_counter() + limit
    for modes in MODES:
        if modes in {a.modes for a in attempts} or perf_counter() > end:
            continue
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            attempts.append(pool.apply(attempt, (modes,)))
        with POINTS.open("a", encoding="utf-8") as file:
            file.write(json.dumps(asdict(attempts[-1])) + "\n")
        report(attempts)


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else np.inf)
