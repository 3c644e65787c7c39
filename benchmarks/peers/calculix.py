"""CalculiX, a general finite element program (its solver is ccx, Debian's calculix-ccx), on a model of ours.

The deck is written from the model itself: its nodes, its ten-node tetrahedra (C3D10), the components that are held and
the nodal forces of its port, so that both programs solve the same mesh under the same supports and the same load.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from skfem import Basis, BilinearForm, ElementTetP2
from skfem.assembly import Dofs

from impact.greens.pulse import hann
from seatfem.structures.materials import Material
from seatfem.structures.model import ModelError, SecondOrderModel

NAME, PROGRAM = "CalculiX", "ccx"
_MIRRORED = (1, 0, 2, 3, 4, 6, 5, 8, 7, 9)  # of ElementTetP2 and C3D10 alike: edges 12, 23, 13, 14, 24, 34
_THREADS = ("OMP_NUM_THREADS", "CCX_NPROC_EQUATION_SOLVER", "CCX_NPROC_STIFFNESS", "CCX_NPROC_RESULTS")
Array = NDArray[np.float64]


class PeerError(RuntimeError):
    """A peer that does not do what it was asked for."""


@dataclass(frozen=True)
class Answer:
    """What a peer gives: ``values``, at ``times`` [s] where it is a course, and its processor seconds."""

    values: Array
    seconds: float
    times: Array | None = None


def absent() -> str:
    """Why this peer cannot be asked; "" where it can."""
    return "" if shutil.which(PROGRAM) else f"{PROGRAM} is not on the path (Debian: apt-get install calculix-ccx)"


def version() -> str:
    """Its own word."""
    told = subprocess.run([PROGRAM, "-v"], capture_output=True, text=True, check=False).stdout
    return f"{NAME} {' '.join(re.findall(r'[0-9]+[.][0-9]+', told)[:1])}"


def frequencies(model: SecondOrderModel, material: Material, count: int) -> Answer:
    """The lowest natural frequencies [Hz], by ARPACK (*FREQUENCY)."""
    text, seconds = run(body_lines(model, material), ["*FREQUENCY", f"{count}"])
    rows = (line.split() for line in text.split("P A R T I C I P A T I O N")[0].splitlines())
    found = [float(row[3]) for row in rows if len(row) == 5 and row[0].isdigit()]
    if len(found) < count:
        raise PeerError(f"{NAME} finds {len(found)} of {count} modes")
    return Answer(np.array(found[:count]), seconds)


def response(
    model: SecondOrderModel,
    material: Material,
    *,
    width: float,
    duration: float,
    steps_per_width: int,
    modes: int | None = None,
) -> Answer:
    """Mean displacement [m/(N s)] of the model's one port under the unit Hann pulse of ``width`` [s] on it.

    Direct dynamics, implicit, without numerical damping (*DYNAMIC, DIRECT, ALPHA=0: Newmark's trapezoidal rule), or the
    sum of the lowest ``modes``, each exact under a force that is linear from step to step (*MODAL DYNAMIC).
    """
    dt = width / steps_per_width
    count = int(np.ceil(duration / dt))
    times = dt * np.arange(count + 2)
    [port] = model.ports.values()
    loads = unknowns(model).expand(port.vector)
    pushed = np.argwhere(loads.T)
    pairs = np.stack([times, hann(times, width)], axis=1).ravel()
    pulse = [",".join(f"{x:.12e}" for x in pairs[k : k + 8]) for k in range(0, len(pairs), 8)]
    body = [*body_lines(model, material), "*AMPLITUDE, NAME=HANN", *pulse, *node_set("PATCH", np.unique(pushed[:, 0]))]
    before = [] if modes is None else ["*STEP", "*FREQUENCY, STORAGE=YES", f"{modes}", "*END STEP"]
    step = ["*DYNAMIC, DIRECT, ALPHA=0." if modes is None else "*MODAL DYNAMIC", f"{dt:.12e},{dt * count:.12e}"]
    step += ["*CLOAD, AMPLITUDE=HANN"]
    step += [f"{node + 1},{axis + 1},{loads[axis, node]:.12e}" for node, axis in pushed]
    step += ["*NODE PRINT, NSET=PATCH, FREQUENCY=1", "U"]
    text, seconds = run([*body, *before], step, f", INC={count + 1}")
    at, moved = [], []
    for block in re.split(r"^ *displacements.*time *", text, flags=re.MULTILINE)[1:]:
        first, *rows = block.strip().splitlines()
        found = np.array([row.split() for row in rows if row.strip()], dtype=float)
        at.append(float(first))
        moved.append(np.sum(loads[:, found[:, 0].astype(int) - 1].T * found[:, 1:]))
    if len(at) < count:
        raise PeerError(f"{NAME} ends after {len(at)} of {count} steps")
    return Answer(np.array(moved), seconds, np.array(at))


def same_mass(model: SecondOrderModel, material: Material) -> Any:
    """The model's mass by the four points by which CalculiX integrates a C3D10, exact for its stiffness alone."""

    @BilinearForm
    def inertia(u: Any, v: Any, _: Any) -> Any:
        return material.density * u * v

    whole = inertia.assemble(Basis(unknowns(model).mesh, ElementTetP2(), intorder=2))
    free = unknowns(model).free
    return sparse.csr_array(sparse.kron(whole, np.eye(3), format="csr")[free][:, free])


def with_its_mass(model: SecondOrderModel, material: Material) -> SecondOrderModel:
    """The model with `same_mass`."""
    return replace(model, M=same_mass(model, material), known=model.damping)


def unknowns(model: SecondOrderModel) -> Any:
    """Where its unknowns live, which must be Cartesian components at the nodes of second-order tetrahedra."""
    dofs = model.dofs
    if dofs is None or dofs.turned is not None or getattr(dofs.mesh, "elem", None) is None:
        raise ModelError(f"a deck for {NAME} needs a model whose unknowns are Cartesian displacements of a mesh")
    if dofs.mesh.elem.refdom.__name__ != "RefTet" or dofs.points.shape[1] <= dofs.mesh.t.max() + 1:
        raise ModelError(f"{NAME} has no element of ours but C3D10: use tetrahedra of order 2")
    return dofs


def body_lines(model: SecondOrderModel, material: Material) -> list[str]:
    """Nodes, elements, material, and what is held: the components that are no unknowns."""
    dofs = unknowns(model)
    cells, points = Dofs(dofs.mesh, ElementTetP2()).element_dofs.copy(), dofs.points
    a, b, c, d = (points[:, cells[k]].T for k in range(4))
    mirrored = np.einsum("ei,ei->e", np.cross(b - a, c - a), d - a) < 0
    cells[:, mirrored] = cells[np.ix_(_MIRRORED, np.flatnonzero(mirrored))]
    held = np.ones(points.size, bool)
    held[dofs.free] = False
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{k},{x:.12g},{y:.12g},{z:.12g}" for k, (x, y, z) in enumerate(points.T, start=1)]
    lines += ["*ELEMENT, TYPE=C3D10, ELSET=BODY"]
    lines += [",".join(map(str, [k, *(cell + 1)])) for k, cell in enumerate(cells.T, start=1)]
    lines += ["*MATERIAL, NAME=SOLID", "*ELASTIC", f"{material.young:.12g},{material.poisson:.12g}"]
    lines += ["*DENSITY", f"{material.density:.12g}", "*SOLID SECTION, ELSET=BODY, MATERIAL=SOLID"]
    for axis, of_axis in enumerate(held.reshape(-1, 3).T, start=1):
        if of_axis.any():
            lines += [*node_set(f"HELD{axis}", np.flatnonzero(of_axis)), "*BOUNDARY", f"HELD{axis},{axis}"]
    return lines


def node_set(name: str, nodes: NDArray[np.int64]) -> Iterator[str]:
    yield f"*NSET, NSET={name}"
    yield from (f"{node + 1}," for node in nodes)


def run(body: Sequence[str], step: Sequence[str], of_step: str = "") -> tuple[str, float]:
    """The .dat file and the processor seconds of the whole program, on one thread."""
    with tempfile.TemporaryDirectory() as folder:
        deck = Path(folder) / "deck.inp"
        deck.write_text("\n".join([*body, f"*STEP{of_step}", *step, "*END STEP"]) + "\n", encoding="ascii")
        before = os.times()
        done = subprocess.run(
            [PROGRAM, "deck"],
            cwd=folder,
            env={**os.environ, **dict.fromkeys(_THREADS, "1")},
            capture_output=True,
            text=True,
        )
        after = os.times()
        if done.returncode or "*ERROR" in done.stdout:
            raise PeerError(f"{NAME} fails with {done.returncode}: {done.stdout[-1000:]}{done.stderr[-1000:]}")
        text = deck.with_suffix(".dat").read_text(encoding="ascii")
    return text, sum(after[2:4]) - sum(before[2:4])
