"""Natural modes and the impact by all peers: tables, and the chart of error against processor time."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np

from benchmarks.peers import calculix, calculix_impact, plain_impact, plain_scikit, siconos_impact, switching
from benchmarks.peers import impact_scene as scene
from benchmarks.table import Table, timed
from impact import ModalGreens, Residual
from seatfem.structures.elements.assembly import assemble
from seatfem.structures.mesh.meshing import make_mesh
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.model import SecondOrderModel
from seatfem.structures.reduction.modes import solve_modes
from seatfem.structures.shapes import AnnularSeat

PICTURE = Path(__file__).parents[2] / "docs" / "images" / "peers.png"
CALCULIX_STEPS, PLAIN_STEPS, KEPT = (0.4e-6, 0.2e-6, 0.1e-6), (0.4e-6, 0.2e-6, 0.1e-6), (50, 200)
MODES = 20
SMALL, MEDIUM, LARGE = MeshSpec(5e-3, 2.5e-3), MeshSpec(2.5e-3, 1.25e-3), MeshSpec(1.5e-3, 0.75e-3)
REDUCED_STEPS = (0.4e-6, 0.1e-6, 0.025e-6)
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
        "difference of a frequency, as both programs come, and ours with CalculiX's mass.\n\n"
        "CalculiX integrates stiffness and mass of a C3D10 by four points: exact for the stiffness of straight "
        "elements, too few for the mass, whose integrand is of the fourth degree. We integrate both exactly. With its "
        "four points for our mass, the frequencies of straight elements are the same to the digits that it "
        "prints.\n\n"
        "ccx of Debian takes ARPACK and SPOOLES; we take a block Lanczos search on PARDISO, and count that no mode is "
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
    rows, first, again = [], 0.0, 0.0
    for tolerance in (1e-2, 3e-3):
        greens, whole = timed(lambda aim=tolerance: _ours(mesh, aim))
        mine = _marched(greens, STEP)
        row = _row(f"ours, tolerance {100 * tolerance:g} %", STEP, whole, mine.seconds, scene.apart(mine, truth))
        first, again = (first, again) if rows else (whole, mine.seconds)
        rows.append((*row, "1" if not rows else f"{whole / first:.2g}", f"{mine.seconds / again:.2g}", ""))
    for name, dt, whole, further, course, same in (*_plain(mesh), *_calculix(model)):
        ratios = f"{whole / first:.2g}", f"{further / again:.2g}"
        rows.append((*_row(name, dt, whole, further, scene.apart(course, truth)), *ratios, same))
    left = f"\n\n{calculix.NAME} is left out: {calculix.absent()}." if calculix.absent() else ""
    notes = (
        f"A rigid mass of {1e3 * scene.MASS:g} g strikes the lip at {scene.SPEED:g} m/s through a linear spring of "
        f"{scene.STIFFNESS:.0e} N/m, about the seat's own stiffness; {model.size} unknowns, no damping, "
        f"{1e6 * scene.DURATION:g} us. The spring moves with the mean displacement of the lip's flat top, over which "
        "its force is spread by the same nodal forces in all programs.\n\n"
        "First scene: processor seconds from the mesh on. Further: another mass, speed or law on the same seat. Ratios "
        f"are over those of our first row. Ours: assembly, Krylov reduction, `solve` with steps of {1e9 * STEP:g} ns "
        "and its energy ledger.\n\n"
        f"Apart: largest difference of the force, filtered by a Hann window of {1e6 * scene.WIDTH:g} us, over its "
        "peak; then of the filtered peak, of the impulse and of the duration of contact. From all modes of the same "
        f"matrices (LAPACK) and steps of {1e9 * FINE:g} ns. *Same mass*: CalculiX from ours with its mass of four "
        "points, that is the error of its step alone.\n\n"
        "CalculiX: `*DYNAMIC, DIRECT` with its default numerical damping (ALPHA = -0.05), `*CONTACT PAIR` of a node on "
        "a face with a linear penalty; the mass is a rigid brick. scikit-fem and SciPy: forms by `asm`, SuperLU, "
        "Newmark's trapezoidal rule with one scalar equation of contact, forty lines "
        "(`benchmarks/peers/plain_impact.py`); or the lowest modes by `eigsh`, steps of 20 ns, without what the others "
        "add." + left,
    )
    columns = ("program", "step (ns)", "first (s)", "further (s)", "apart (%)", "peak (%)", "impulse (%)")
    columns += ("duration (%)", "first, ratio", "further, ratio", "apart, same mass (%)")
    return Table("The impact", notes, columns, tuple(rows))


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
    return (
        name,
        f"{1e9 * dt:g}",
        f"{whole:.2f}",
        f"{further:.2g}",
        f"{errors[0]:.2g}",
        *(f"{e:+.2g}" for e in errors[1:]),
    )


def _plain(mesh: Any) -> Iterator[tuple[str, float, float, float, scene.Course, str]]:
    """Newmark's rule on the mesh, and on the lowest modes."""
    (K, M, b), assembly = timed(lambda: plain_scikit.assembled(mesh, scene.STEEL))
    for dt in PLAIN_STEPS:
        (factor, pushed), once = timed(lambda dt=dt: plain_impact.stepping(K, M, b, dt))
        force, further = timed(lambda dt=dt, f=factor, p=pushed: plain_impact.newmark(K, b, dt, f, p))
        yield plain_impact.NAME, dt, assembly + once + further, further, scene.of_points(force, dt, further), ""
    for count in KEPT:
        (squares, shares, _), once = timed(lambda n=count: plain_scikit.sparse_modes(K, M, b, n))
        force, further = timed(lambda s=squares, p=shares: plain_impact.by_modes(s, p, STEP))
        name = f"{plain_impact.NAME}, {count} modes"
        yield name, STEP, assembly + once + further, further, scene.of_points(force, STEP, further), ""


def _calculix(model: SecondOrderModel) -> Iterator[tuple[str, float, float, float, scene.Course, str]]:
    """Its runs, if it is here."""
    if calculix.absent():
        return
    same = calculix.with_its_mass(model, scene.STEEL)
    truth = _marched(scene.reduced(same, 1e-3), FINE)
    for dt in CALCULIX_STEPS:
        theirs, _ = calculix_impact.march(model, dt)
        yield calculix.NAME, dt, theirs.seconds, theirs.seconds, theirs, f"{scene.apart(theirs, truth)[0]:.2g}"


def siconos_table() -> Table:
    """The same impact on one reduced system: error and time of each step; draws the chart."""
    greens = replace(scene.reduced(scene.seat(scene.mesh()), 1e-2), residual=Residual.none())
    omega, shares = greens.omega, greens.shapes[:, 0]
    truth = switching.march(omega, shares, 5e-9)
    found = {"seatfem": [_marched(greens, dt) for dt in REDUCED_STEPS]}
    reason = siconos_impact.absent()
    if not reason:
        theirs = siconos_impact.march(omega, shares, REDUCED_STEPS)
        found |= {siconos_impact.RULES[rule]: courses for rule, courses in theirs.items()}
    rows, curves = [], {}
    for name, courses in found.items():
        errors = [scene.apart(course, truth) for course in courses]
        curves[name] = [c.seconds for c in courses], [e[0] for e in errors]
        rows += [
            (name, f"{1e9 * c.dt:g}", f"{1e3 * c.seconds:.3g}", f"{e[0]:.2g}", *(f"{x:+.2g}" for x in e[1:]))
            for c, e in zip(courses, errors, strict=True)
        ]
    _draw(curves)
    left = f"\n\n{siconos_impact.NAME} is left out: {reason}." if reason else ""
    notes = (
        f"The same impact on {len(omega)} undamped modes of our reduction (what it adds to them left out), as diagonal "
        "matrices. Apart: as above, from the motion that is exact between the changes of contact, whose times are "
        "searched for (`benchmarks/peers/switching.py`). Processor time of one scene, building its system included.\n\n"
        "Theta rule: `FirstOrderLinearTIDS`, `EulerMoreauOSI` (theta = gamma = 1/2, for the relation too), the spring "
        "as a complementarity condition: the same system. Moreau-Jean: `LagrangianLinearTIDS`, `MoreauJeanOSI` "
        "(theta = 1/2), `NewtonImpactNSL(0)`: contact without compliance, so that the spring ends in a foot of "
        f"{1e6 * siconos_impact.FOOT * scene.MASS:g} mg, which sticks as it meets the seat." + left,
    )
    columns = ("program", "step (ns)", "time (ms)", "apart (%)", "peak (%)", "impulse (%)", "duration (%)")
    return Table("One reduced system", notes, columns, tuple(rows))


def _draw(curves: dict[str, tuple[list[float], list[float]]]) -> None:
    """Error against processor time, each mark a step."""
    figure, axes = plt.subplots(figsize=(6.4, 4.2), layout="constrained")
    for (name, (seconds, errors)), mark in zip(curves.items(), "os^", strict=False):
        axes.loglog([1e3 * s for s in seconds], errors, marker=mark, label=name)
    axes.set_xlabel("processor time of a scene (ms)")
    axes.set_ylabel("largest error of the filtered force (% of its peak)")
    axes.set_title("One impact on one reduced seat; each mark a time step")
    axes.grid(visible=True, which="both", alpha=0.3)
    axes.legend()
    figure.savefig(PICTURE, dpi=150)
    plt.close(figure)
