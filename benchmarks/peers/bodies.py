"""The seat itself by other programs: its natural modes, and the response of the struck patch to a given pulse."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from time import process_time
from typing import Any, TypeVar

import numpy as np

from benchmarks.peers import calculix, same_rule, sfepy_modes
from benchmarks.peers.impact_scene import STEEL
from benchmarks.table import Table
from seatfem.structures.elements.assembly import assemble
from seatfem.structures.mesh.meshing import make_mesh
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.model import SecondOrderModel
from seatfem.structures.reduction.greens import greens_function
from seatfem.structures.reduction.modes import solve_modes
from seatfem.structures.shapes import AnnularSeat

MODES = 20
WIDTH, DURATION, TOLERANCE = 10e-6, 30e-6, 1e-3  # of the pulse and the response [s]; of the Green's function
STEPS, SUMMED = (20, 40), 100  # steps a pulse; modes of modal dynamics
SMALL, MEDIUM, LARGE = MeshSpec(5e-3, 2.5e-3), MeshSpec(2.5e-3, 1.25e-3), MeshSpec(1.5e-3, 0.75e-3)
Found = TypeVar("Found")


def timed(work: Callable[[], Found]) -> tuple[Found, float]:
    """What it gives, and the processor seconds of this process and of those it waits for."""
    before = process_time() + sum(os.times()[2:4])
    found = work()
    return found, process_time() + sum(os.times()[2:4]) - before


def model_of(spec: MeshSpec) -> SecondOrderModel:
    """The demo's shape, clamped below, with the lip's flat top as its port."""
    return assemble(make_mesh(AnnularSeat(), spec).mesh, STEEL, order=2)


def apart(theirs: np.ndarray, ours: np.ndarray) -> str:
    """Largest difference relative to the largest value."""
    return f"{100 * np.abs(theirs - ours).max() / np.abs(ours).max():.2g}"


def _modes(mesh: Any) -> tuple[SecondOrderModel, np.ndarray]:
    """Ours, from the mesh on."""
    model = assemble(mesh, STEEL, order=2)
    return model, solve_modes(model, MODES).frequencies_hz


def modes_table() -> Table:
    """Frequencies of the same meshes."""
    rows = []
    for name, spec in (
        ("curved", SMALL),
        ("straight", replace(SMALL, curved=False)),
        ("straight", replace(MEDIUM, curved=False)),
        ("straight", replace(LARGE, curved=False)),
    ):
        mesh = make_mesh(AnnularSeat(), spec).mesh
        (model, mine), seconds = timed(lambda mesh=mesh: _modes(mesh))
        theirs = calculix.frequencies(model, STEEL, MODES)
        same = solve_modes(calculix.with_its_mass(model, STEEL), MODES).frequencies_hz
        differences = (f"{np.abs(theirs.values / f - 1).max():.0e}" for f in (mine, same))
        times = f"{theirs.seconds:.2f}", f"{seconds:.2f}", f"{theirs.seconds / seconds:.2g}"
        rows.append((name, f"{model.size}", *times, *differences))
    notes = (
        f"The {MODES} lowest natural frequencies; processor seconds from the mesh on. *Apart*: largest relative "
        "difference of a frequency, as both programs come, and ours with CalculiX's mass.\n\n"
        "CalculiX integrates stiffness and mass of a C3D10 by four points: exact for the stiffness "
        "of straight elements, "
        "too few for the mass, whose integrand is of the fourth degree. We integrate both exactly. "
        "With its four points "
        "for our mass, the frequencies of straight elements are the same to the digits that it prints; what is left on "
        "curved elements is its stiffness, which four points do not integrate exactly there.\n\n"
        "ccx of Debian takes ARPACK and SPOOLES; we take a block Lanczos search on PARDISO, and "
        "count that no mode is missing.",
    )
    columns = ("elements", "unknowns", "CalculiX (s)", "ours (s)", "ratio", "apart", "apart, same mass")
    return Table("Natural modes", notes, columns, tuple(rows))


def sfepy_table() -> Table:
    """Frequencies of the straight meshes by SfePy."""
    rows = []
    for spec in (replace(SMALL, curved=False), replace(MEDIUM, curved=False)):
        mesh = make_mesh(AnnularSeat(), spec).mesh
        (model, mine), seconds = timed(lambda mesh=mesh: _modes(mesh))
        theirs = sfepy_modes.frequencies(model, STEEL, MODES)
        times = f"{theirs.seconds:.2f}", f"{seconds:.2f}", f"{theirs.seconds / seconds:.2g}"
        rows.append((f"{model.size}", *times, f"{np.abs(theirs.values / mine - 1).max():.0e}"))
    notes = (
        f"The {MODES} lowest natural frequencies of straight elements, both programs with exact quadrature: SfePy's "
        "terms `dw_lin_elastic` and `dw_dot`, then SciPy's `eigsh` about zero with SuperLU; its own solver "
        "`eig.scipy` did not end within minutes. Processor seconds from the mesh on, its start not counted.",
    )
    return Table("Natural modes by SfePy", notes, ("unknowns", "SfePy (s)", "ours (s)", "ratio", "apart"), tuple(rows))


def response_table() -> Table:
    """The struck patch under the pulse."""
    spec = replace(SMALL, curved=False)
    mesh = make_mesh(AnnularSeat(), spec).mesh
    aims = {"bandwidth": 1 / WIDTH, "duration": 1.2 * DURATION}

    def ours() -> tuple[SecondOrderModel, object]:
        model = assemble(mesh, STEEL, order=2)
        greens = greens_function(model, **aims, tolerance=TOLERANCE)
        greens.filtered(np.linspace(0, DURATION, 200), WIDTH)
        return model, greens

    (model, greens), seconds = timed(ours)
    same = calculix.with_its_mass(model, STEEL)
    rows = []
    for name, steps, modes in (*(("direct", n, None) for n in STEPS), (f"{SUMMED} modes", STEPS[1], SUMMED)):
        theirs = calculix.response(model, STEEL, width=WIDTH, duration=DURATION, steps_per_width=steps, modes=modes)
        times = f"{theirs.seconds:.1f}", f"{seconds:.2f}", f"{theirs.seconds / seconds:.2g}"
        if modes is None:
            alike = same_rule.trapezoidal(same, WIDTH / steps, len(theirs.values), WIDTH)
        else:
            alike = same_rule.modal(same, modes, theirs.times, WIDTH)
        differences = (apart(theirs.values, values) for values in (greens.filtered(theirs.times, WIDTH), alike))
        rows.append((name, f"{steps}", *times, *differences))
    notes = (
        f"Mean displacement of the lip's top under a unit Hann pulse of {1e6 * WIDTH:g} us, spread over it by the same "
        f"consistent nodal forces, until {1e6 * DURATION:g} us; {model.size} unknowns, no damping. *Apart*: largest "
        "difference over the largest value.\n\n"
        "Direct: `*DYNAMIC, DIRECT, ALPHA=0`, the trapezoidal rule without numerical damping. "
        "Modes: `*MODAL DYNAMIC` with "
        f"{SUMMED} modes, and no correction for those left out. *Apart, same way*: from the "
        f"trapezoidal rule with the same "
        "step, or from the sum of as many modes, by our matrices with CalculiX's mass. So what "
        "stands before it is the error "
        "of that step, or of the modes left out, with what the mass adds.\n\n"
        f"Ours: assembly, one factorization, a Krylov space to a tolerance of {100 * TOLERANCE:g} % "
        f"of the response, and 200 "
        "values of the response.",
    )
    columns = ("CalculiX", "steps a pulse", "CalculiX (s)", "ours (s)", "ratio", "apart (%)", "apart, same way (%)")
    return Table("Response of the struck patch", notes, columns, tuple(rows))
