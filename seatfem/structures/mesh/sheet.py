"""Mid-surfaces of thin plates, of curved quadrilaterals."""

from __future__ import annotations

from dataclasses import asdict
from typing import Final

import numpy as np

from impact.progress import Progress, silent
from seatfem.structures.elements.mindlin import PlateMesh
from seatfem.structures.mesh.gmsh_process import Gmsh, run_gmsh
from seatfem.structures.mesh.io import MeshError
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.shapes import Flat, GeometryError, Shape, encode
from seatfem.structures.shapes.shape import EVERYWHERE

CLAMPED: Final = "clamped"
AREA_TOLERANCE: Final = 0.01  # relative; a circle of eight curved elements is 0.1 % off


def mesh_sheet(shape: Shape, size: float, progress: Progress = silent, gmsh: Gmsh = run_gmsh) -> PlateMesh:
    """The plan of an extruded solid, meshed evenly with quadrilaterals of nine nodes that follow its outline.

    Its line "clamped", of a sheet that is, holds the nodes there.

    Args:
        shape: with a plan.
        size: of the elements [m].
        progress: told of the meshing.
        gmsh: what carries out the job.

    Raises:
        GeometryError: no plan, a size that is not positive. MeshingError: gmsh fails. MeshError: an area that differs
        from the drawing's, a line without nodes. ModelError: elements that are folded.
    """
    if shape.plan is None:
        raise GeometryError(f"{shape.source} has no plan: only a sheet of even thickness is a plate")
    spec = MeshSpec(size, order=2, shape="hex")
    made = gmsh({"task": "plan", "geometry": encode(shape), "spec": asdict(spec), "sectors": 1}, progress)
    used, cells = np.unique(made["cells"], return_inverse=True)
    points, lines = made["points"][used], {}
    if isinstance(shape, Flat) and shape.is_clamped:
        lines[CLAMPED] = np.flatnonzero(shape.clamped(points))
        if not len(lines[CLAMPED]):
            raise MeshError(f"{shape.source}: no node lies where it is clamped")
    mesh, drawn = PlateMesh(points, cells.reshape(made["cells"].shape), lines), float(made[f"cad:{EVERYWHERE}"])
    if abs(mesh.area / drawn - 1) > AREA_TOLERANCE:
        raise MeshError(f"{shape.source}: the mesh has {mesh.area / drawn - 1:+.1%} more area than the drawing")
    return mesh
