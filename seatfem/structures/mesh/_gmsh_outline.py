"""The outline of a flat sheet in a STEP file, of a plane face or of a thin plate; used in the gmsh process only."""

from __future__ import annotations

import itertools
import math
from pathlib import Path
from typing import Any, Final

import numpy as np

from impact.greens.base import Array
from seatfem.structures.lands import axes_along
from seatfem.structures.mesh._gmsh_input import handed_over
from seatfem.structures.mesh._gmsh_messages import stage
from seatfem.structures.mesh._gmsh_model import KeptModel
from seatfem.structures.shapes import GeometryError, loops
from seatfem.structures.shapes.faces import Face, Frame, listing
from seatfem.structures.shapes.inspect import faces_of, triple, volume_of

MILLIMETRE: Final = 1e-3  # to which STEP lengths are turned
EVEN: Final = 1e-6  # relative, of the areas of a plate's two faces, and of its volume
SQUARE: Final = 1e-6  # of a unit normal, to one of the file's axes
ARCS: Final = 32  # that stand for a curve which is neither line nor circle
LOST: Final = 1e-4  # of the area, by these arcs, at most


def outline(gmsh: Any, job: dict[str, Any], model: KeptModel) -> dict[str, Any]:
    """Do task "outline": a STEP file -> "loop:0" (the outline), "loop:1", ... (n, 3) [m]; "frame" (3, 3), the origin
    and the directions x and y in which it is seen; "normal" (3,), out of the solid; "thickness", of a solid.

    With "oblique" a face may lie square to no axis of the file; it is seen as lands are.
    """
    path = Path(job["path"])
    stage("building the geometry", 0.0)
    model.forget()
    gmsh.clear()
    try:
        with handed_over(path) as copy:
            gmsh.model.occ.importShapes(str(copy))
    except GeometryError:
        raise
    except Exception as error:  # what OpenCASCADE says of a file that it cannot read
        raise GeometryError(f"Outlined.file = {path.name}: cannot be read, export it again: {error}") from error
    gmsh.model.occ.synchronize()
    face, thickness = _face(gmsh, path)
    frame = _frame(face, path, oblique=job["oblique"])
    answer = {f"loop:{k}": loop for k, loop in enumerate(_loops(gmsh, face, path, frame))}
    answer |= {"frame": np.array([frame.origin, frame.x, frame.y]), "normal": np.array(face.normal)}
    return answer | ({} if thickness is None else {"thickness": np.float64(thickness)})


def _wrong(path: Path, what: str) -> GeometryError:
    return GeometryError(f"Outlined.file = {path.name}: {what}")


def _face(gmsh: Any, path: Path) -> tuple[Face, float | None]:
    """Return the one face, or one side of the one plate with its thickness [m]."""
    faces, solids = faces_of(gmsh.model, MILLIMETRE), len(gmsh.model.getEntities(3))
    if not faces:
        raise _wrong(path, "it holds no face, only curves or points; export a face or a solid")
    if solids > 1:
        raise _wrong(path, f"it holds {solids} solids; a sheet is one: export it alone")
    if not solids:
        if len(faces) > 1:
            raise _wrong(path, f"it holds {len(faces)} faces without a solid; export one of them, or the solid plate")
        if faces[0].normal is None:
            raise _wrong(path, f"its face is no plane but a {faces[0].kind}; a sheet is flat: export its plane face")
        return faces[0], None
    flat = sorted((face for face in faces if face.normal is not None), key=lambda face: -face.area)
    for top, under in itertools.pairwise(flat):
        thickness = abs(float(np.subtract(top.centre, under.centre) @ np.array(top.normal)))
        parallel = np.allclose(np.add(top.normal, under.normal), 0.0, atol=SQUARE)  # type: ignore[arg-type]
        even = math.isclose(top.area, under.area, rel_tol=EVEN)
        if parallel and even and math.isclose(thickness * top.area, volume_of(gmsh.model, MILLIMETRE), rel_tol=EVEN):
            return max(top, under, key=lambda face: face.centre), thickness
    raise _wrong(
        path,
        "its solid is no plate of even thickness: two parallel faces of equal area, times their distance, are not its "
        f"volume. Export one plane face; the largest are\n{listing(flat[:3] or faces[:3])}",
    )


def _frame(face: Face, path: Path, *, oblique: bool) -> Frame:
    """Return the plane of a face: seen against the axis of the file that it is square to, from the foot of its
    origin."""
    normal = np.array(face.normal or ())
    axis = int(np.argmax(np.abs(normal)))
    if abs(abs(normal[axis]) - 1) > SQUARE:
        if not oblique:
            words = "({:.4g}, {:.4g}, {:.4g})".format(*normal)
            raise _wrong(path, f"its face, normal {words}, is square to no axis of the file; turn the part")
        x, y, _ = axes_along(normal)
        return Frame(triple((normal @ np.array(face.centre)) * normal), triple(x), triple(y))
    x, y, up = np.roll(np.eye(3), -1 - axis, axis=0)
    return Frame(triple(face.centre[axis] * up), triple(x), triple(y))


def _loops(gmsh: Any, face: Face, path: Path, frame: Frame) -> list[Array]:
    """Return the outline, then the holes [m], as seen in the frame."""
    chains = [_chain(gmsh, tag, frame) for tag in sorted(face.curves)]
    size = float(np.ptp(np.concatenate(chains)[:, :2], axis=0).max())

    def open_at(point: Array) -> GeometryError:
        return _wrong(path, "its outline is open at ({:.6g}, {:.6g}) mm; close it".format(*(1e3 * point)))

    outlines = sorted(loops.closed(chains, 1e-6 * size, open_at), key=lambda loop: -abs(loops.area(loop)))
    area = abs(loops.area(outlines[0])) - sum(abs(loops.area(hole)) for hole in outlines[1:])
    if not math.isclose(area, face.area, rel_tol=LOST):
        raise _wrong(
            path,
            f"arcs along its curves enclose {area / face.area - 1:+.1e} more area than the face; redraw them",
        )
    return outlines


def _chain(gmsh: Any, tag: int, frame: Frame) -> Array:
    """Return the (n, 3) corners and bulges of a curve [m]: arcs through three points of it each."""
    low, high = (float(bound[0]) for bound in gmsh.model.getParametrizationBounds(1, tag))
    kind = gmsh.model.getType(1, tag)
    count = {"Line": 1, "Circle": math.ceil((high - low) / math.pi - 1e-9)}.get(kind, ARCS)
    at = np.linspace(low, high, 2 * count + 1)
    points = frame.seen(MILLIMETRE * np.reshape(gmsh.model.getValue(1, tag, at), (-1, 3)))
    start, middle, end = points[:-1:2], points[1::2], points[2::2]
    first, second = middle - start, end - middle
    halves = np.arctan2(loops.cross(first, second), (first * second).sum(axis=1))  # of the angle that the arc turns
    bulges = np.zeros(count) if kind == "Line" else np.tan(halves / 2)
    return np.column_stack([points[::2], np.append(bulges, 0.0)])
