"""A seat of any shape, at the cells of its lands: its lowest modes, and the compliance beyond them, by CalculiX.

gmsh divides the solid into ten-node tetrahedra, ccx assembles stiffness and mass (*FREQUENCY, SOLVER=MATRIXSTORAGE),
scipy finds the modes, and each cell is loaded by a uniform pressure; its mean displacement has the same weights.
Nothing of seatfem is used.
"""

from __future__ import annotations

import math
import os
import subprocess
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import gmsh
import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import LinearOperator, SuperLU, eigsh, splu

from points.gll import Array
from points.plate import Material
from points.regions import Cells

THREADS = ("OMP_NUM_THREADS", "CCX_NPROC_EQUATION_SOLVER", "CCX_NPROC_STIFFNESS")
ORDER = (0, 1, 2, 3, 4, 5, 6, 7, 9, 8)  # of the nodes of a C3D10 in gmsh's tetrahedron
PER_MM = 1e3
AROUND = 24  # points on each circle near which elements are small


@dataclass(frozen=True)
class PointSeat:
    """A seat at points: omega (m,) [rad/s], displacements (points, m) of its modes at unit mass [kg^-1/2], and the
    compliance (points, points) beyond them [m/N]."""

    omega: Array
    shapes: Array
    residual: Array


@dataclass(frozen=True)
class SolidSeat:
    """A solid with lands, solved once for all cells.

    Attributes:
        draw: adds the solid to gmsh's OpenCASCADE model, in mm.
        held: which (n,) of the nodes (n, 3) [mm] are held.
        struck: which (f,) of the triangles at the height of the lands, by their middles (f, 2) [mm], are on the lands.
        top: height of the lands [mm].
        circles: middle (x, y) and radius of circles near which elements are small [mm].
        material: of the solid.
        sizes: of the elements, on the lands and elsewhere [mm].
        count: number of modes, from the lowest on; 0: it yields at once.
    """

    draw: Callable[[Any], None]
    held: Callable[[Array], Array]
    struck: Callable[[Array], Array]
    top: float
    circles: Sequence[tuple[float, float, float]]
    material: Material
    sizes: tuple[float, float]
    count: int = 0

    def __call__(self, cells: Sequence[Cells]) -> PointSeat:
        """Return the seat at the cells of all lands, each a point with the mean displacement of its cell; their places
        are in the coordinates of the solid [m]."""
        nodes, faces, rows, *_ = self._assembled
        omega, modes = self._modes
        places = np.concatenate([each.places.reshape(-1, 2) for each in cells]) * PER_MM
        share = np.zeros((len(rows), len(places)))
        up = rows[:, 1] == 3
        share[up] = _loads(nodes, faces, places)[rows[up, 0] - 1]
        compliance = share.T @ self._factor.solve(share) / PER_MM
        shapes = share.T @ modes / math.sqrt(PER_MM)  # ccx has N, mm and t
        residual = compliance - (shapes / omega**2) @ shapes.T
        return PointSeat(omega, shapes, (residual + residual.T) / 2)

    @cached_property
    def _assembled(self) -> tuple[Array, Array, Array, csc_matrix, csc_matrix]:
        """Return nodes, struck triangles, node and direction of the unknowns, stiffness [N/mm] and mass [t]."""
        nodes, tetrahedra, faces = _mesh(self.draw, self.top, self.circles, self.sizes)
        faces = faces[self.struck(nodes[faces[:, :3], :2].mean(axis=1))]
        return nodes, faces, *_matrices(nodes, tetrahedra, np.flatnonzero(self.held(nodes)), self.material)

    @cached_property
    def _factor(self) -> SuperLU:
        """Return the factor of the stiffness."""
        how = {"SymmetricMode": True}
        return splu(self._assembled[3], permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=how)

    @cached_property
    def _modes(self) -> tuple[Array, Array]:
        """Return omega (m,) [rad/s] and modes (unknowns, m) of unit mass [t^-1/2]."""
        *_, stiffness, mass = self._assembled
        if not self.count:
            return np.empty(0), np.empty((stiffness.shape[0], 0))
        inverse = LinearOperator(stiffness.shape, self._factor.solve)
        squares, modes = eigsh(stiffness, self.count, mass, sigma=0.0, OPinv=inverse)
        return np.sqrt(squares), modes


def _mesh(
    draw: Callable[[Any], None], top: float, circles: Sequence[tuple[float, float, float]], sizes: tuple[float, float]
) -> tuple[Array, Array, Array]:
    """Return nodes (n, 3) [mm], tetrahedra (e, 10) and the triangles (f, 6) at the height of the lands."""
    turns = 2 * np.pi * np.arange(AROUND) / AROUND
    near = [(x + r * math.cos(turn), y + r * math.sin(turn)) for x, y, r in circles for turn in turns]
    gmsh.initialize()
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        draw(gmsh.model.occ)
        gmsh.model.occ.synchronize()
        points = [gmsh.model.occ.addPoint(*place, top) for place in near]
        gmsh.model.occ.synchronize()
        field = gmsh.model.mesh.field
        distance, threshold = field.add("Distance"), field.add("Threshold")
        field.setNumbers(distance, "PointsList", points)
        for name, value in zip(
            ("InField", "SizeMin", "SizeMax", "DistMin", "DistMax"), (distance, *sizes, 1.2, 8.0), strict=True
        ):
            field.setNumber(threshold, name, value)
        field.setAsBackgroundMesh(threshold)
        gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 0)
        gmsh.option.setNumber("Mesh.MeshSizeFromPoints", 0)
        gmsh.model.mesh.generate(3)
        gmsh.model.mesh.setOrder(2)
        gmsh.model.mesh.optimize("HighOrder")  # no curved element may be folded
        tags, flat, _ = gmsh.model.mesh.getNodes()
        number = np.zeros(int(tags.max()) + 1, dtype=int)
        number[tags] = np.arange(len(tags))
        nodes = flat.reshape(-1, 3)
        tetrahedra = number[gmsh.model.mesh.getElementsByType(11)[1].reshape(-1, 10)]
        triangles = number[gmsh.model.mesh.getElementsByType(9)[1].reshape(-1, 6)]
    finally:
        gmsh.finalize()
    used = np.unique(tetrahedra)
    number = np.zeros(len(nodes), dtype=int)
    number[used] = np.arange(len(used))
    at_top = triangles[np.all(np.abs(nodes[triangles, 2] - top) < 1e-6, axis=1)]
    return nodes[used], number[tetrahedra][:, ORDER], number[at_top]


def _matrices(nodes: Array, tetrahedra: Array, held: Array, material: Material) -> tuple[Array, csc_matrix, csc_matrix]:
    """Return node and direction (n, 2), both from 1, of the unknowns, and the stiffness [N/mm] and mass [t] by ccx."""
    lines = ["*NODE, NSET=ALL", *(f"{k},{x:.9g},{y:.9g},{z:.9g}" for k, (x, y, z) in enumerate(nodes, 1))]
    lines += ["*ELEMENT, TYPE=C3D10, ELSET=ALL"]
    lines += [f"{k},{','.join(map(str, row + 1))}" for k, row in enumerate(tetrahedra, 1)]
    lines += ["*NSET, NSET=HELD", *(f"{node + 1}," for node in held), "*BOUNDARY", "HELD,1,3"]
    lines += ["*MATERIAL, NAME=M", "*ELASTIC", f"{material.young / PER_MM**2:.9g},{material.poisson}"]
    lines += ["*DENSITY", f"{material.density * 1e-12:.9g}", "*SOLID SECTION, ELSET=ALL, MATERIAL=M"]
    lines += ["*STEP", "*FREQUENCY, SOLVER=MATRIXSTORAGE", "1", "*END STEP"]
    with tempfile.TemporaryDirectory() as folder:
        deck = Path(folder) / "seat.inp"
        deck.write_text("\n".join(lines) + "\n", encoding="ascii")
        env = os.environ | dict.fromkeys(THREADS, "1")
        subprocess.run(["ccx", "seat"], cwd=folder, env=env, check=True, stdout=subprocess.DEVNULL)
        rows = [[int(x) for x in line.split(".")] for line in deck.with_suffix(".dof").read_text().split()]
        stiffness, mass = (_read_half(deck.with_suffix(suffix), len(rows)) for suffix in (".sti", ".mas"))
    return np.array(rows), stiffness, mass


def _read_half(path: Path, size: int) -> csc_matrix:
    """Return the symmetric matrix of which ccx wrote one half."""
    i, j, values = np.loadtxt(path).T
    i, j = i.astype(int) - 1, j.astype(int) - 1
    half, off = csc_matrix((values, (i, j)), shape=(size, size)), i != j
    return (half + csc_matrix((values[off], (j[off], i[off])), shape=half.shape)).tocsc()


def _loads(nodes: Array, faces: Array, places: Array) -> Array:
    """Return the nodal weights (nodes, points) of unit forces spread over the triangles nearest to each place."""
    corners = nodes[faces[:, :3]]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1) / 2
    middles = corners.mean(axis=1)[:, :2]
    apart = np.linalg.norm(middles[:, None] - places[None], axis=2)
    nearest = apart.argmin(axis=1)
    loads = np.zeros((len(nodes), len(places)))
    reach = np.sort(np.linalg.norm(places[:, None] - places[None], axis=2), axis=1)[:, 1]
    inside = apart[np.arange(len(faces)), nearest] < reach[nearest]
    for face, area, point in zip(faces[inside], areas[inside], nearest[inside], strict=True):
        loads[face[3:], point] += area / 3  # a uniform pressure acts at the middles of the sides
    for point in np.flatnonzero(loads.sum(axis=0) == 0):
        loads[faces[apart[:, point].argmin(), 3:], point] = 1.0
    return loads / loads.sum(axis=0)
