"""The gmsh process, started by `seatfem.structures.mesh.gmsh_process` only; plane meshes of sections and sheets.

Jobs come as JSON lines on standard input; the process ends when that is closed. Progress and failure are reported as
JSON lines on standard output. Lengths inside gmsh are in the unit of the geometry (millimetres), those exchanged with
the parent in metres.

If both edges of an element at a vertex lie on a smooth boundary, curving them opens the corner to 180 degrees and det J
vanishes. Such an element is merged with neighbours until the union can be divided into triangles that all meet in one
of its vertices, none of them flat.
"""

import json
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seatfem.jobs.processes import answers_to_parent, lines_from_parent
from seatfem.machine.libraries import GMSH_LIBRARIES, apt_command, missing_packages
from seatfem.structures.mesh._gmsh_base import KeptModel, arrays, handed_over, rows_of, send, set_sizes, stage
from seatfem.structures.mesh._gmsh_inspect import inspect, outline
from seatfem.structures.mesh._gmsh_solid import make
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.shapes import Flat, GeometryError, Turning, decode, revolved
from seatfem.structures.shapes.inspect import area_of
from seatfem.structures.shapes.profile import PER_ARC
from seatfem.structures.shapes.shape import cut

TRIANGLES = {1: 2, 2: 9}  # gmsh's element types by order
QUADRILATERALS = {1: 3, 2: 10}
FRONTAL_FOR_QUADS = 8
BLOSSOM = 1
ALL_QUADRILATERALS = 1
PASSES = 4  # most repetitions of the repair of flat corners
HALVING = 2.0  # size of elements before they are divided into quadrilaterals, over the size afterwards
Cell = tuple[int, ...]
FLAT = np.deg2rad(160.0)  # corner angle beyond which an element is repaired
GOOD = np.deg2rad(15.0)  # smallest angle of triangles at which no more neighbours are merged
MOST_MERGED = 4  # most elements of a union


def mesh_plane(
    gmsh: Any, spec: MeshSpec, refined: list[int], arcs: Mapping[int, int], unit: float, *, quadrilaterals: bool
) -> dict[str, NDArray[Any]]:
    """Mesh the model's surfaces by ``spec``, finest at the curves ``refined``; ``arcs``: least number along curves.

    Return "points" (n, 2) [m] and "cells" (m, 3 | 4 | 6 | 9).
    """
    option, mesh = gmsh.option.setNumber, gmsh.model.mesh
    option("Mesh.SecondOrderLinear", 0)
    if quadrilaterals:
        option("Mesh.Algorithm", FRONTAL_FOR_QUADS)
        option("Mesh.RecombineAll", 1)
        option("Mesh.RecombinationAlgorithm", BLOSSOM)
    set_sizes(gmsh, spec, [], refined, (HALVING if quadrilaterals else 1.0) / unit, arcs)
    mesh.generate(2)
    for _ in range(PASSES):  # the new triangles may have flat corners as well
        if not _mend(gmsh):
            break
    if quadrilaterals:
        option("Mesh.SubdivisionAlgorithm", ALL_QUADRILATERALS)
        mesh.refine()
    option("Mesh.SecondOrderLinear", 0 if spec.curved else 1)
    mesh.setOrder(spec.order)
    tags, coordinates, _ = mesh.getNodes()
    kind = (QUADRILATERALS if quadrilaterals else TRIANGLES)[spec.order]
    _, cells = _cells(mesh, kind, -1, mesh.getElementProperties(kind)[3])
    return {"points": unit * coordinates.reshape(-1, 3)[:, :2], "cells": rows_of(tags)[cells]}


def _mend(gmsh: Any) -> bool:
    """Repair flat corners once, by the angles of elements of order 2; return whether anything was changed."""
    mesh = gmsh.model.mesh
    surfaces = [tag for _, tag in gmsh.model.getEntities(2)]
    mesh.setOrder(2)
    points = _points(mesh)
    kinds = ((TRIANGLES[2], 6), (QUADRILATERALS[2], 9))
    angles = [
        [row for kind, width in kinds for row in corner_angles(points, _cells(mesh, kind, tag, width)[1])]
        for tag in surfaces
    ]
    mesh.setOrder(1)
    points = _points(mesh)
    changed = False
    for tag, turned in zip(surfaces, angles, strict=True):
        elements, cells = [], []
        for kind, width in ((TRIANGLES[1], 3), (QUADRILATERALS[1], 4)):
            numbers, rows = _cells(mesh, kind, tag, width)
            elements += numbers.tolist()
            cells += [tuple(row) for row in rows.tolist()]
        removed, added = without_flat_corners(points, dict(zip(cells, turned, strict=True)))
        if removed:
            changed = True
            number = dict(zip(cells, elements, strict=True))
            mesh.removeElements(2, tag, [number[cell] for cell in removed])
            mesh.addElementsByType(tag, TRIANGLES[1], [], [node for cell in added for node in cell])
    return changed


def _points(mesh: Any) -> NDArray[np.float64]:
    tags, coordinates, _ = mesh.getNodes()
    points = np.zeros((int(tags.max()) + 1, 2))
    points[tags.astype(np.int64)] = coordinates.reshape(-1, 3)[:, :2]
    return points


def _cells(mesh: Any, kind: int, tag: int, width: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    elements, nodes = mesh.getElementsByType(kind, tag)
    return elements.astype(np.int64), nodes.reshape(-1, width).astype(np.int64)


def corner_angles(points: NDArray[np.float64], cells: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return (m, c) interior angles at the vertices of curved plane elements of order 2, by their edges' tangents.

    ``cells`` (m, 6 | 8 | 9): vertices counter-clockwise, then the middles of the edges 01, 12, ...
    """
    corners = 3 if cells.shape[1] == 6 else 4
    x = points[cells[:, :corners]]
    middle = points[cells[:, corners : 2 * corners]]
    forth = 4 * middle - 3 * x - np.roll(x, -1, axis=1)
    back = 4 * np.roll(middle, 1, axis=1) - 3 * x - np.roll(x, 1, axis=1)
    cross = forth[..., 0] * back[..., 1] - forth[..., 1] * back[..., 0]
    return np.asarray(np.arctan2(cross, np.sum(forth * back, axis=2)) % (2 * np.pi))


def without_flat_corners(
    points: NDArray[np.float64], angles: Mapping[Cell, NDArray[np.float64]]
) -> tuple[list[Cell], list[Cell]]:
    """Return the cells to be removed and the triangles that replace them, so that no corner is flat.

    ``angles``: triangles and quadrilaterals by their vertices (rows of ``points``) -> their `corner_angles`. No cell is
    removed twice.
    """
    across = {edge: cell for cell in angles for edge in _edges(cell)}
    removed: list[Cell] = []
    added: list[Cell] = []
    for cell in [cell for cell, turns in angles.items() if turns.max() > FLAT]:
        gone, ring = [cell], cell
        while (best := _best(points, ring, _interior(angles, gone, ring)))[0] < GOOD and len(gone) < MOST_MERGED:
            unions = [
                (*_best(points, union, _interior(angles, [*gone, other], union)), other)
                for edge in _edges(ring)
                if (other := across.get((edge[1], edge[0]))) is not None
                and len(set(union := _from(ring, ring.index(edge[1])) + _from(other, other.index(edge[1]))[2:]))
                == len(union)
            ]
            if not unions:
                break
            _, ring, other = max(unions, key=lambda union: union[0])
            gone.append(other)
        if len(gone) + len(cell) > 4 and not set(gone) & set(removed):
            removed += gone
            added += _fan(best[1])
    return removed, added


def _interior(angles: Mapping[Cell, NDArray[np.float64]], cells: list[Cell], ring: Cell) -> dict[int, float]:
    """Return the angle of a union of cells at each vertex of its outline."""
    return {node: sum(float(angles[cell][cell.index(node)]) for cell in cells if node in cell) for node in ring}


def _best(points: NDArray[np.float64], loop: Cell, interior: Mapping[int, float]) -> tuple[float, Cell]:
    """Return the quality of the best triangulation by lines from one vertex, and the polygon from that vertex on.

    The quality is the smallest angle [rad]; at a corner of a single triangle, also pi less the angle of its curved
    edges.
    """

    def score(ring: Cell) -> float:
        straight = min(_smallest_angle(points[list(triangle)]) for triangle in _fan(ring))
        single = (ring[1], ring[-1]) if len(ring) > 3 else ring
        return min(straight, *(np.pi - interior[node] for node in single))

    return max((score(ring), ring) for ring in (_from(loop, k) for k in range(len(loop))))


def _fan(ring: Cell) -> list[Cell]:
    return [(ring[0], ring[k], ring[k + 1]) for k in range(1, len(ring) - 1)]


def _from(ring: Cell, first: int) -> Cell:
    return ring[first:] + ring[:first]


def _smallest_angle(triangle: NDArray[np.float64]) -> float:
    """Return the smallest angle, negative for a clockwise triangle."""
    forth, back = np.roll(triangle, -1, axis=0) - triangle, np.roll(triangle, 1, axis=0) - triangle
    cross = forth[:, 0] * back[:, 1] - forth[:, 1] * back[:, 0]
    return float(np.min(np.arctan2(cross, np.sum(forth * back, axis=1))))


def _edges(cell: Cell) -> list[tuple[int, int]]:
    return [(cell[k - 1], cell[k]) for k in range(len(cell))]


APT_LINE = apt_command(missing_packages(GMSH_LIBRARIES) or tuple(GMSH_LIBRARIES.values()))
OPTIONS = {
    "General.Terminal": 0,
    "General.NumThreads": 1,  # one thread is reproducible, several are not
    "Geometry.OCCImportLabels": 1,  # colours of STEP faces
    "Mesh.OptimizeNetgen": 1,  # removes the slivers on fillets that would invert when curved
    "Mesh.MeshSizeExtendFromBoundary": 0,
    "Mesh.MeshSizeFromPoints": 0,
    "Mesh.MeshSizeFromCurvature": 0,
    "Mesh.MshFileVersion": 4.1,
    # gmsh's defaults of options that the previous job may have changed
    "Mesh.Algorithm": 6,
    "Mesh.Algorithm3D": 1,
    "Mesh.MeshSizeMax": 1e22,
    "Mesh.MeshSizeMin": 0,
    "Mesh.Optimize": 1,
    "Mesh.RecombineAll": 0,
    "Mesh.RecombinationAlgorithm": 1,
    "Mesh.SecondOrderLinear": 0,
    "Mesh.SubdivisionAlgorithm": 0,
}
"""Options of gmsh set before each job."""


def read(gmsh: Any, job: dict[str, Any], model: KeptModel) -> dict[str, Any]:
    """Carry out task "read": mesh file -> arrays."""
    stage("reading the mesh", 0.0)
    with handed_over(Path(job["path"])) as copy:
        model.built(gmsh, job, lambda: gmsh.open(str(copy)))
    model.forget()
    return arrays(gmsh, job["unit"])


def section(gmsh: Any, job: dict[str, Any], model: KeptModel) -> dict[str, Any]:
    """Carry out task "section": half section of a solid of revolution -> plane arrays."""
    geometry: Turning = decode(job["geometry"])
    spec = MeshSpec(**job["spec"])
    unit = geometry.unit_of_model
    stage("building the section", 0.0)

    def built() -> revolved.Drawing:
        drawing = revolved.section(geometry, gmsh.model.occ, spec.rings)
        gmsh.model.occ.synchronize()
        return drawing

    drawing = model.built(gmsh, job, built)
    stage("meshing the section", 0.3)
    section = mesh_plane(gmsh, spec, drawing.groups["contact"], drawing.arcs, unit, quadrilaterals=False)
    mesh = gmsh.model.mesh
    index = rows_of(mesh.getNodes()[0])
    for name, curves in drawing.groups.items():
        ends = [_cells(mesh, {1: 1, 2: 8}[spec.order], tag, spec.order + 1)[1][:, :2] for tag in curves]
        section[f"line:{name}"] = index[np.concatenate(ends)]
    return section


def plan(gmsh: Any, job: dict[str, Any], model: KeptModel) -> dict[str, Any]:
    """Carry out task "plan": a sheet, or the half of one, -> plane arrays and its exact area."""
    geometry: Flat = decode(job["geometry"])
    unit = geometry.unit_of_model
    stage("building the sheet", 0.0)

    def built() -> list[int]:
        whole = geometry.sheet(gmsh.model.occ)
        pieces = cut(gmsh.model.occ, 2, job["sectors"]) if job["sectors"] > 1 else [[(2, whole)]]
        gmsh.model.occ.synchronize()
        return [tag for piece in pieces for _, tag in piece]

    faces = model.built(gmsh, job, built)
    edges = gmsh.model.getBoundary([(2, tag) for tag in faces], combined=False, oriented=False)
    stage("meshing the sheet", 0.3)
    arcs = {tag: PER_ARC for _, tag in gmsh.model.getEntities(1) if gmsh.model.getType(1, tag) == "Circle"}
    refined = sorted({tag for _, tag in edges})
    plane = mesh_plane(gmsh, MeshSpec(**job["spec"]), refined, arcs, unit, quadrilaterals=True)
    return plane | {"area": np.float64(area_of(gmsh.model, faces, unit))}


TASKS: dict[str, Callable[[Any, dict[str, Any], KeptModel], dict[str, Any]]] = {
    "inspect": inspect,
    "mesh": make,
    "outline": outline,
    "plan": plan,
    "read": read,
    "section": section,
}


def import_gmsh() -> Any:
    """Return the gmsh module; without its shared libraries, importing it raises an `OSError`."""
    try:
        import gmsh
    except OSError as error:
        raise RuntimeError(f"gmsh cannot load a system library ({error}); mend it with: {APT_LINE}") from error
    except ImportError as error:
        raise RuntimeError(f"gmsh is not installed ({error}); mend it with: pip install gmsh") from error
    return gmsh


def run(gmsh: Any, job: dict[str, Any], model: KeptModel) -> None:
    tempfile.tempdir = str(Path(job["arrays"]).parent)  # the parent removes this folder in any case
    for option, value in OPTIONS.items():
        gmsh.option.setNumber(option, value)
    result = TASKS[job["task"]](gmsh, job, model)
    np.savez(job["arrays"], **result)
    stage("reading gmsh's arrays", 0.95)
    send(finished=job["task"])


def main() -> int:
    jobs = lines_from_parent()
    try:
        gmsh, model = import_gmsh(), KeptModel()
        gmsh.initialize([], readConfigFiles=False, interruptible=False)
        for line in jobs:
            run(gmsh, json.loads(line), model)
    except GeometryError as error:
        send(error=str(error), kind="geometry", field=error.field)
    except Exception as error:
        send(error=str(error), kind="gmsh")
    return 1


if __name__ == "__main__":
    sys.stdout = answers_to_parent()  # without what OpenCASCADE prints
    sys.exit(main())
