"""CalculiX, a general finite element program (its solver is ccx, Debian's calculix-ccx), on a model of ours.

The deck is what `seatfem export --to calculix` writes: its nodes, its ten-node tetrahedra (C3D10), the components that
are held and the nodal forces of its port, so that both programs solve the same mesh under the same supports and load.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from skfem import Basis, BilinearForm, ElementTetP2

from benchmarks.table import timed
from seatfem.structures.formats.calculix_deck import calculix_body
from seatfem.structures.materials import Material
from seatfem.structures.model import ModelError, SecondOrderModel

NAME, PROGRAM = "CalculiX", "ccx"
_THREADS = ("OMP_NUM_THREADS", "CCX_NPROC_EQUATION_SOLVER", "CCX_NPROC_STIFFNESS", "CCX_NPROC_RESULTS")
Array = NDArray[np.float64]


class PeerError(RuntimeError):
    """A peer that does not do what it was asked for."""


@dataclass(frozen=True)
class Answer:
    """What a peer gives: its values, and its processor seconds."""

    values: Array
    seconds: float


def absent() -> str:
    """Why this peer cannot be asked; "" where it can."""
    return "" if shutil.which(PROGRAM) else f"{PROGRAM} is not on the path (Debian: apt-get install calculix-ccx)"


def version() -> str:
    """Its own word."""
    told = subprocess.run([PROGRAM, "-v"], capture_output=True, text=True, check=False).stdout
    return f"{NAME} {' '.join(re.findall(r'[0-9]+[.][0-9]+', told)[:1])}"


def frequencies(model: SecondOrderModel, material: Material, count: int) -> Answer:
    """The lowest natural frequencies [Hz], by ARPACK (*FREQUENCY)."""
    deck = calculix_body(tetrahedra(model), material)
    text, seconds = run([*deck.lines, *deck.frequency(count)])
    return Answer(frequencies_in(text, count), seconds)


def frequencies_in(text: str, count: int) -> Array:
    """(count,) the first of a .dat file [Hz]. Raises `PeerError` where there are fewer."""
    rows = (line.split() for line in text.split("P A R T I C I P A T I O N")[0].splitlines())
    found = [float(row[3]) for row in rows if len(row) == 5 and row[0].isdigit()]
    if len(found) < count:
        raise PeerError(f"{NAME} finds {len(found)} of {count} modes")
    return np.array(found[:count])


def course_in(text: str, quantity: str, node: str) -> tuple[Array, Array]:
    """Times (n,) [s] and components (n, 3) of the one node of a set in a .dat file: its displacements or velocities."""
    at, found = [], []
    for block in re.split(rf"^ *{quantity} .* for set {node} and time *", text, flags=re.MULTILINE)[1:]:
        first, *rows = block.strip().splitlines()
        at.append(float(first))
        found.append([float(x) for x in next(row for row in rows if row.strip()).split()[1:]])
    return np.array(at), np.array(found)


def contact_force_in(text: str) -> tuple[Array, Array]:
    """Times (n,) [s] and forces (n,) that press on a patch from above [N] in a .dat file (*CONTACT PRINT, CF)."""
    told = r"^ statistics for slave set .* and time +(\S+)\n\n.*\n\n +\S+ +\S+ +(\S+)"
    found = np.array(re.findall(told, text, flags=re.MULTILINE), dtype=float).reshape(-1, 2)
    return found[:, 0], -found[:, 1]


def same_mass(model: SecondOrderModel, material: Material) -> Any:
    """The model's mass by the four points by which CalculiX integrates a C3D10, exact for its stiffness alone."""

    @BilinearForm
    def inertia(u: Any, v: Any, _: Any) -> Any:
        return material.density * u * v

    dofs = tetrahedra(model).dofs
    assert dofs is not None
    mesh: Any = dofs.mesh
    whole = inertia.assemble(Basis(mesh, ElementTetP2(), intorder=2))
    free = dofs.free
    return sparse.csr_array(sparse.kron(whole, np.eye(3), format="csr")[free][:, free])


def with_its_mass(model: SecondOrderModel, material: Material) -> SecondOrderModel:
    """The model with `same_mass`."""
    return replace(model, M=same_mass(model, material), known=model.damping)


def tetrahedra(model: SecondOrderModel) -> SecondOrderModel:
    """Itself, if it is made of tetrahedra of second order."""
    mesh: Any = None if model.dofs is None else model.dofs.mesh
    if mesh is None or mesh.elem.refdom.__name__ != "RefTet":
        raise ModelError(f"{NAME} has no element quite like ours but C3D10: use tetrahedra of order 2")
    return model


def run(lines: Sequence[str]) -> tuple[str, float]:
    """The .dat file and the processor seconds of the whole program, on one thread."""
    with tempfile.TemporaryDirectory() as folder:
        deck = Path(folder) / "deck.inp"
        deck.write_text("\n".join(lines) + "\n", encoding="ascii")
        how = {"cwd": folder, "env": os.environ | dict.fromkeys(_THREADS, "1"), "capture_output": True, "text": True}
        done, seconds = timed(lambda: subprocess.run([PROGRAM, "deck"], **how))
        if done.returncode or "*ERROR" in done.stdout:
            raise PeerError(f"{NAME} fails with {done.returncode}: {done.stdout[-1000:]}{done.stderr[-1000:]}")
        text = deck.with_suffix(".dat").read_text(encoding="ascii")
    return text, seconds
