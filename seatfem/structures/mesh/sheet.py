"""Mid-surfaces of thin plates, of curved quadrilaterals."""

from __future__ import annotations

from dataclasses import asdict
from typing import Final

import numpy as np
from numpy.typing import NDArray

from impact.greens.base import Array
from impact.progress import Progress, silent
from impact.quantities import percent
from seatfem.structures.elements.mindlin import PlateMesh
from seatfem.structures.mesh.gmsh_process import Gmsh, run_gmsh
from seatfem.structures.mesh.io import MeshError
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.shapes import Flat, GeometryError, Shape, encode
from seatfem.structures.shapes.shape import EVERYWHERE

CLAMPED: Final = "clamped"
IMAGE: Final = (0, 3, 2, 1, 7, 6, 5, 4, 8)  # nodes of an element's image, anticlockwise again
ON_THE_LINE: Final = 1e-9  # of the size
AREA_TOLERANCE: Final = 0.01  # relative; a circle of eight curved elements is 0.1 % off


def mesh_sheet(shape: Shape, size: float, progress: Progress = silent, gmsh: Gmsh = run_gmsh) -> PlateMesh:
    """Return the plan of an extruded solid, meshed evenly with quadrilaterals of nine nodes that follow its outline.

    Of a sheet that the line y = 0 mirrors one half is meshed, the other is its image: the mesh is as symmetric. Its
    line "clamped", of a sheet that is, holds the nodes there.

    ``size``: of the elements [m].

    Raises:
        GeometryError: no plan, a size that is not positive. MeshingError: gmsh fails. MeshError: an area that differs
        from the drawing's, a line without nodes. ModelError: elements that are folded.
    """
    if shape.plan is None:
        raise GeometryError(f"{shape.source} has no plan: a plate must be a sheet of even thickness")
    spec, parts = MeshSpec(size, order=2, shape="hex"), 2 if isinstance(shape, Flat) and shape.is_mirrored else 1
    arrays = gmsh({"task": "plan", "geometry": encode(shape), "spec": asdict(spec), "sectors": parts}, progress)
    used, rows = np.unique(arrays["cells"], return_inverse=True)
    points, cells, lines = arrays["points"][used], rows.reshape(arrays["cells"].shape), {}
    if parts == 2:
        points, cells = with_image(points, cells)
    if isinstance(shape, Flat) and shape.is_clamped:
        lines[CLAMPED] = np.flatnonzero(shape.clamped(points))
        if not len(lines[CLAMPED]):
            raise MeshError(f"{shape.source}: no node lies where it is clamped; mesh finer")
    mesh, drawn = PlateMesh(points, cells, lines), parts * float(arrays[f"cad:{EVERYWHERE}"])
    if abs(mesh.area / drawn - 1) > AREA_TOLERANCE:
        raise MeshError(
            f"{shape.source}: the mesh has {percent(mesh.area / drawn - 1, sign=True)} more area than the drawing"
        )
    return mesh


def with_image(points: Array, cells: NDArray[np.int64]) -> tuple[Array, NDArray[np.int64]]:
    """Return points (n, 2) and cells (m, 9) of the half beside y = 0, and their image; nodes on it stay one."""
    off = np.abs(points[:, 1]) > ON_THE_LINE * np.ptp(points)
    half = points * np.column_stack([np.ones(len(points)), off])
    image = np.where(off, len(points) + np.cumsum(off) - 1, np.arange(len(points)))
    return np.vstack([half, half[off] * (1, -1)]), np.vstack([cells, image[cells][:, IMAGE]])
