"""SfePy, a finite element library, in an environment of its own, whose Python the variable SFEPY_PYTHON names."""

from __future__ import annotations

import os
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.peers.calculix import Answer, PeerError, tetrahedra
from seatfem.structures.materials import Material
from seatfem.structures.model import SecondOrderModel

NAME, VARIABLE = "SfePy", "SFEPY_PYTHON"
PROGRAM = Path(__file__).with_name("sfepy_program.py")


def absent() -> str:
    """Why this peer cannot be asked; "" where it can."""
    python = os.environ.get(VARIABLE)
    if python is None:
        return f"the variable {VARIABLE} does not name the Python of an environment that has sfepy"
    asked = subprocess.run([python, "-c", "import sfepy"], capture_output=True, check=False)
    return f"{VARIABLE} = {python} has no sfepy" if asked.returncode else ""


def version() -> str:
    """Its own word."""
    asked = [os.environ[VARIABLE], "-c", "import sfepy; print(sfepy.__version__)"]
    told = subprocess.run(asked, capture_output=True, text=True, check=True).stdout
    return f"{NAME} {told.split()[-1]}"


def frequencies(model: SecondOrderModel, material: Material, count: int) -> Answer:
    """The lowest natural frequencies [Hz] of straight tetrahedra held at z = 0; without its start."""
    dofs = tetrahedra(model).dofs
    assert dofs is not None
    mesh: Any = dofs.mesh
    with tempfile.TemporaryDirectory() as folder:
        asked, answer = Path(folder) / "asked.npz", Path(folder) / "answer.npz"
        solid = [material.young, material.poisson, material.density]
        np.savez(asked, points=mesh.p.T[: mesh.t.max() + 1], cells=mesh.t.T, solid=solid, count=count)
        done = subprocess.run(
            [os.environ[VARIABLE], str(PROGRAM), str(asked), str(answer)],
            capture_output=True,
            text=True,
            timeout=600,
            check=False,
        )
        if done.returncode:
            raise PeerError(f"{NAME} fails with {done.returncode}: {done.stderr[-1000:]}")
        with np.load(answer) as found:
            return Answer(found["frequencies"], float(found["seconds"]))
