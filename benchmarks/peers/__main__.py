"""Other programs on meshes of ours: modes, and the response of the struck patch; writes docs/peers.md.

Run: OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 NUMBA_NUM_THREADS=1 python -m benchmarks.peers
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TypeVar

import numpy as np

from benchmarks.peers import calculix, same_rule
from benchmarks.table import Table, machine
from impact.files.atomic import write_whole
from seatfem.structures.elements.assembly import assemble
from seatfem.structures.materials import Material
from seatfem.structures.mesh.meshing import make_mesh
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.model import SecondOrderModel
from seatfem.structures.reduction.greens import greens_function
from seatfem.structures.reduction.modes import solve_modes
from seatfem.structures.shapes import AnnularSeat

STEEL = Material(200e9, 0.3, 7850.0)
MODES = 20
WIDTH, DURATION, TOLERANCE = 10e-6, 30e-6, 1e-3  # of the pulse and the response [s]; of the Green's function
STEPS, SUMMED = (20, 40), 100  # steps a pulse; modes of modal dynamics
SMALL, MEDIUM, LARGE = MeshSpec(5e-3, 2.5e-3), MeshSpec(2.5e-3, 1.25e-3), MeshSpec(1.5e-3, 0.75e-3)
START = "import seatfem; seatfem.assemble, seatfem.solve_modes, seatfem.greens_function"
PAGE = Path(__file__).parents[2] / "docs" / "peers.md"
Found = TypeVar("Found")


def timed(work: Callable[[], Found]) -> tuple[Found, float]:
    """What it gives, and the processor seconds of this process and of those it waits for."""
    before = sum(os.times()[:4])
    found = work()
    return found, sum(os.times()[:4]) - before


def model_of(spec: MeshSpec) -> SecondOrderModel:
    """The demo's shape, clamped below, with the lip's flat top as its port."""
    return assemble(make_mesh(AnnularSeat(), spec).mesh, STEEL, order=2)


def with_their_mass(model: SecondOrderModel) -> SecondOrderModel:
    """Ours with the mass of the peer's quadrature."""
    return replace(model, M=calculix.same_mass(model, STEEL), known=model.damping)


def apart(theirs: np.ndarray, ours: np.ndarray) -> str:
    """Largest difference relative to the largest value."""
    return f"{100 * np.abs(theirs - ours).max() / np.abs(ours).max():.2g}"


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

        def ours(mesh: object = mesh) -> tuple[SecondOrderModel, np.ndarray]:
            model = assemble(mesh, STEEL, order=2)
            return model, solve_modes(model, MODES).frequencies_hz

        (model, mine), seconds = timed(ours)
        theirs = calculix.frequencies(model, STEEL, MODES)
        same = solve_modes(with_their_mass(model), MODES).frequencies_hz
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
    same = with_their_mass(model)
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


HEAD = """# Peers

Written by `python -m benchmarks.peers`: another program on the same mesh, by a deck that is written from our own model
(nodes, elements, held components, the patch: `seatfem export --to calculix`). A peer that is not
installed is left out, with the reason. A body of steel of the demo's shape, clamped below, in tetrahedra of ten nodes.

{peer} (Debian's calculix-ccx) and seatfem with {versions}, on {processor}, one thread each. Times are processor seconds
with other programs running beside: read ratios, which are theirs over ours.
"""

LIMITS = """## Who is better at what

- For us: what is timed is what we are made for. A response by direct dynamics is that of one load, and ccx factors
  anew, twice, in every step; our Green's function is computed once and used again for every reed, law and speed of
  impact. Our error is estimated; that of a step or of modes left out is not.
- For CalculiX: it is a whole program, its times hold reading the deck and writing the results. It starts at once,
  we load Python and its libraries for {start:.1f} s of processor time, not counted above: with them, it is
  done first with the modes of the smallest mesh. It needs no band: its steps hold whatever the mesh does.
  It has many more elements, materials that yield, large displacements, heat and flow, of
  which we have nothing.
- Debian's ccx solves by SPOOLES; builds with PARDISO or PaStiX, which its manual calls faster, were not measured.
- Hexahedra are not compared: ours of second order have 27 nodes, CalculiX's C3D20 have 20.
- Left out: the impact itself by CalculiX's own contact. What is compared is what goes into our contact, the body.
"""


def start() -> float:
    """Processor seconds until our functions can be called."""
    return timed(lambda: subprocess.run([sys.executable, "-c", START], check=True))[1]


def main() -> None:
    """All tables of the peers that are here."""
    if reason := calculix.absent():
        raise SystemExit(f"{calculix.NAME} is left out: {reason}; {PAGE.name} stays as it is")
    warm = model_of(SMALL)
    solve_modes(warm, 2)
    greens_function(warm, bandwidth=1e5, duration=1e-5, tolerance=0.1)  # kernels are compiled, libraries loaded
    about = machine()
    versions = f"Python {about['python']}, NumPy {about['numpy']} and Numba {about['numba']}"
    head = HEAD.format(peer=calculix.version(), versions=versions, processor=about["processor"])
    tables = (modes_table().markdown(), response_table().markdown())
    write_whole(PAGE, "\n".join([head, *tables, LIMITS.format(start=start())]).encode())


if __name__ == "__main__":
    main()
