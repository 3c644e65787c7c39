"""Mid-surfaces of thin plates, of curved quadrilaterals."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Final

import numpy as np
from numpy.typing import NDArray

from impact.progress import Progress, silent
from seatfem.structures.elements.mindlin import PlateMesh
from seatfem.structures.mesh.gmsh_process import Gmsh, run_gmsh
from seatfem.structures.mesh.io import MeshError
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.shapes import Flapper, GeometryError, Shape, encode
from seatfem.structures.shapes.shape import EVERYWHERE

Line = Callable[[NDArray[np.float64]], NDArray[np.bool_]]

ROOT: Final = "root"
AREA_TOLERANCE: Final = 0.01  # relative; a circle of eight curved elements is 0.1 % off


def mesh_sheet(
    shape: Shape, lines: Mapping[str, Line], size: float, progress: Progress = silent, gmsh: Gmsh = run_gmsh
) -> PlateMesh:
    """The plan of an extruded solid, meshed evenly with quadrilaterals of nine nodes that follow its outline.

    Args:
        shape: with a plan.
        lines: by name, which of (n, 2) nodes lie on them [m].
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
    points = made["points"][used]
    on = {name: np.flatnonzero(line(points)) for name, line in lines.items()}
    if empty := [name for name, nodes in on.items() if not len(nodes)]:
        raise MeshError(f"{shape.source}: no node lies on the line {', '.join(empty)}")
    mesh, drawn = PlateMesh(points, cells.reshape(made["cells"].shape), on), float(made[f"cad:{EVERYWHERE}"])
    if abs(mesh.area / drawn - 1) > AREA_TOLERANCE:
        raise MeshError(f"{shape.source}: the mesh has {mesh.area / drawn - 1:+.1%} more area than the drawing")
    return mesh


def mesh_flapper(shape: Flapper, size: float, progress: Progress = silent, gmsh: Gmsh = run_gmsh) -> PlateMesh:
    """As `mesh_sheet`; its line is "root", where it is clamped."""
    at_root: dict[str, Line] = {ROOT: lambda points: np.abs(points[:, 0]) < 1e-6 * shape.length}
    return mesh_sheet(shape, at_root, size, progress, gmsh)
