"""Natural modes and the impact by all peers: tables."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from benchmarks.peers import calculix, calculix_impact, plain_impact, plain_scikit
from benchmarks.peers import impact_scene as scene
from benchmarks.table import Table, timed
from impact import ModalGreens, Residual
from seatfem.structures.elements.assembly import assemble
from seatfem.structures.mesh.meshing import make_mesh
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.model import SecondOrderModel
from seatfem.structures.reduction.modes import solve_modes
from seatfem.structures.shapes import AnnularSeat

STEPS, TOLERANCES = (0.4e-6, 0.2e-6, 0.1e-6), (0.2, 1e-2, 3e-3)
COLUMNS = ("program", "step (ns)", "first (s)", "further (s)", "apart (%)", "peak (%)", "impulse (%)")
COLUMNS += ("duration (%)", "first, ratio", "further, ratio", "apart, same mass (%)")
MODES = 20
Steps = tuple[float, ...]
Measured = tuple[str, float, float, float, scene.Course, str]  # program, step, first, further, force, apart by its mass
SMALL, MEDIUM, LARGE = MeshSpec(5e-3, 2.5e-3), MeshSpec(2.5e-3, 1.25e-3), MeshSpec(1.5e-3, 0.75e-3)
STEP, FINE, AGAIN = 20e-9, 5e-9, 20  # of our runs and of the reference [s]; runs that a time is the mean of


def _modes(mesh: Any) -> tuple[SecondOrderModel, np.ndarray]:
    """Return our model and frequencies, from the mesh on."""
    model = assemble(mesh, scene.STEEL, order=2)
    return model, solve_modes(model, MODES).frequencies_hz


def modes_table() -> Table:
    """Return the table of frequencies of the same meshes."""
    rows = []
    for name, spec in (
        ("curved", SMALL),
        ("straight", replace(SMALL, curved=False)),
        ("straight", replace(MEDIUM, curved=False)),
        ("straight", replace(LARGE, curved=False)),
    ):
        mesh = make_mesh(AnnularSeat(), spec).mesh
        (model, mine), seconds = timed(lambda mesh=mesh: _modes(mesh))
        theirs = calculix.frequencies(model, scene.STEEL, MODES)
        same = solve_modes(calculix.with_its_mass(model, scene.STEEL), MODES).frequencies_hz
        differences = (f"{np.abs(theirs.values / f - 1).max():.0e}" for f in (mine, same))
        times = f"{theirs.seconds:.2f}", f"{seconds:.2f}", f"{theirs.seconds / seconds:.2g}"
        rows.append((name, f"{model.size}", *times, *differences))
    notes = (
        f"The {MODES} lowest natural frequencies; processor seconds from the mesh on. *Apart*: largest relative "
        "difference of a frequency, with the masses of both programs, and with CalculiX's mass in ours.\n\n"
        "CalculiX integrates stiffness and mass of a C3D10 by four points: exact for the stiffness of straight "
        "elements, too few for the mass, whose integrand is of the fourth degree. We integrate both exactly. With its "
        "four points for our mass, the frequencies of straight elements are the same to the digits that it "
        "prints.\n\n"
        "Debian's ccx uses ARPACK and SPOOLES; we use block Lanczos on PARDISO, and check by counts that no mode is "
        "missing.",
    )
    columns = ("elements", "unknowns", "CalculiX (s)", "ours (s)", "ratio", "apart", "apart, same mass")
    return Table("Natural modes", notes, columns, tuple(rows))


def impact_table() -> Table:
    """Return one impact on the whole mesh: first scene, further scene, errors."""
    mesh = scene.mesh()
    model = scene.seat(mesh)
    square, shares, _ = plain_scikit.dense_modes(model.K, model.M, next(iter(model.ports.values())).vector)
    truth = _marched(ModalGreens(np.sqrt(square), 0 * square, shares[:, None], Residual.none()), FINE)
    rows = _compared(mesh, model, truth, STEPS)
    left = f"\n\n{calculix.NAME} is left out: {calculix.absent()}." if calculix.absent() else ""
    notes = (
        f"A rigid mass of {1e3 * scene.MASS:g} g strikes the lip at {scene.SPEED:g} m/s through a linear spring of "
        f"{scene.STIFFNESS:.0e} N/m, about the seat's own stiffness; {model.size} unknowns, no damping, "
        f"{1e6 * scene.DURATION:g} us. The spring moves with the mean displacement of the lip's flat top, over which "
        "its force is spread by the same nodal forces in all programs.\n\n"
        "First scene: processor seconds from the mesh on. Further: another mass, speed or law on the same seat. Ratios "
        "are over those of our first row, the nearest in error. Ours: assembly, Krylov reduction, `solve` with steps "
        f"of {1e9 * STEP:g} ns and its energy ledger.\n\n"
        f"Apart: largest difference of the force, filtered by a Hann window of {1e6 * scene.WIDTH:g} us, over its "
        "peak; then of the filtered peak, of the impulse and of the duration of contact. The reference has all modes "
        f"of the same matrices (LAPACK) and steps of {1e9 * FINE:g} ns. *Same mass*: difference between CalculiX and "
        "ours with its mass of four points, which is the error of its step alone.\n\n"
        "CalculiX: `*DYNAMIC, DIRECT` with its default numerical damping (ALPHA = -0.05), `*CONTACT PAIR` of a node on "
        "a face with a linear penalty; the mass is a rigid brick. scikit-fem and SciPy: forms by `asm`, SuperLU, "
        "Newmark's trapezoidal rule with one scalar equation of contact, forty lines "
        "(`benchmarks/peers/plain_impact.py`)." + left,
    )
    return Table("The impact", notes, COLUMNS, rows)


def _compared(mesh: Any, model: SecondOrderModel, truth: scene.Course, steps: Steps) -> tuple[tuple[str, ...], ...]:
    """Return a row for each tolerance of ours, and each of the others' ``steps`` [s]."""
    rows, first, again = [], 0.0, 0.0
    for tolerance in TOLERANCES:
        greens, whole = timed(lambda aim=tolerance: _ours(mesh, aim))
        mine = _marched(greens, STEP)
        row = _row(f"ours, tolerance {100 * tolerance:g} %", STEP, whole, mine.seconds, scene.apart(mine, truth))
        first, again = (first, again) if rows else (whole, mine.seconds)
        rows.append((*row, "1" if not rows else f"{whole / first:.2g}", f"{mine.seconds / again:.2g}", ""))
    for name, dt, whole, further, course, same in (*_plain(mesh, steps), *_calculix(model, steps)):
        ratios = f"{whole / first:.3g}", f"{further / again:.3g}"
        rows.append((*_row(name, dt, whole, further, scene.apart(course, truth)), *ratios, same))
    return tuple(rows)


def _ours(mesh: Any, tolerance: float) -> ModalGreens:
    """All that a first scene takes."""
    greens = scene.reduced(scene.seat(mesh), tolerance)
    scene.impact_of(greens, STEP)
    return greens


def _marched(greens: ModalGreens, dt: float) -> scene.Course:
    """Our force, and the mean time of a run."""
    scene.impact_of(greens, dt)
    again = 1 if dt == FINE else AGAIN
    found, seconds = timed(lambda: [scene.impact_of(greens, dt) for _ in range(again)][-1])
    return scene.course(found, seconds / again)


def _row(name: str, dt: float, whole: float, further: float, errors: tuple[float, ...]) -> tuple[str, ...]:
    signed = (f"{e:+.2g}" for e in errors[1:])
    return name, f"{1e9 * dt:g}", f"{whole:.2f}", f"{further:.2g}", f"{errors[0]:.2g}", *signed


def _plain(mesh: Any, steps: Steps) -> Iterator[Measured]:
    """Newmark's rule on the mesh."""
    (K, M, b), assembly = timed(lambda: plain_scikit.assembled(mesh, scene.STEEL))
    for dt in steps:
        (factor, pushed), once = timed(lambda dt=dt: plain_impact.stepping(K, M, b, dt))
        force, further = timed(lambda dt=dt, f=factor, p=pushed: plain_impact.newmark(K, b, dt, f, p))
        yield plain_impact.NAME, dt, assembly + once + further, further, scene.of_points(force, dt, further), ""


def _calculix(model: SecondOrderModel, steps: Steps) -> Iterator[Measured]:
    """Its runs, if it is here."""
    if calculix.absent():
        return
    same = calculix.with_its_mass(model, scene.STEEL)
    truth = _marched(scene.reduced(same, 1e-3), FINE)
    for dt in steps:
        theirs, _ = calculix_impact.march(model, dt)
        yield calculix.NAME, dt, theirs.seconds, theirs.seconds, theirs, f"{scene.apart(theirs, truth)[0]:.2g}"
