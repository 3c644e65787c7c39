"""Tasks of the gmsh process that describe a geometry: its faces and solids, or the outline of a flat sheet.

The answer holds the faces, the groups that can be selected and the problems of the others, with coarse
triangles on its surface, as far as gmsh can generate them.
"""

import itertools
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from impact.greens.base import Array
from seatfem.structures.lands import axes_along
from seatfem.structures.mesh._gmsh_base import KeptModel, growing, handed_over, rows_of, stage
from seatfem.structures.mesh._gmsh_solid import Imported, import_part, read_solids, recall, regions_of
from seatfem.structures.mesh.spec import COARSE, GROWTH, SIZE_PER_WIDTH
from seatfem.structures.shapes import CadPart, Geometry, GeometryError, cad, decode, encode, loops
from seatfem.structures.shapes.inspect import faces_of, painted, triple, volume_of
from seatfem.structures.shapes.selectors import Face, Frame, Patches, listing, select

FINE: Final = 4.0  # ratio of that coarse element size to the one for pictures
CURVED: Final = 24  # elements per full turn of curved faces in pictures
CHORDS: Final = 96  # straight segments per curved edge of a face; a circle loses 7e-4 of its area
TRIANGLE = 2

Problem = tuple[str, str]
"""Field of the geometry, and the problem with its value."""


def inspect(gmsh: Any, job: dict[str, Any], model: KeptModel) -> dict[str, Any]:
    """Carry out task "inspect": geometry -> its faces, groups and problems (JSON), and the arrays of a coarse mesh."""
    geometry: Geometry = decode(job["geometry"])
    unit = geometry.unit_of_model
    stage("building the geometry", 0.0)
    model.forget()
    gmsh.clear()
    problems: list[Problem] = []
    try:
        faces, imported = _built(gmsh, geometry, unit, problems)
    except GeometryError as error:
        return _json({"faces": [], "problems": [(error.field, str(error))]})
    groups = _groups(faces, geometry.patches, problems)
    flat = [name for name, tags in groups.items() if all(f.kind == "Plane" for f in faces if f.tag in tags)]
    number_of = {tag: number for number, tags in imported.solids.items() for tag in tags}
    answer = {
        "faces": [_described(gmsh, face, unit, number_of) for face in faces],
        "groups": groups,
        "regions": list(imported.regions),
        "solids": list(_solids(gmsh, imported, unit)),
        "in_file": len(imported.names),
        "volume": volume_of(gmsh.model, unit),
        "problems": problems,
        "flat": flat,
    }
    edges = _edges(gmsh, [groups[name] for name in flat], unit)
    return _json(answer) | edges | _coarse_mesh(gmsh, groups.get("contact", []), unit, picture=job["picture"])


def _built(gmsh: Any, geometry: Geometry, unit: float, problems: list[Problem]) -> tuple[list[Face], Imported]:
    if not isinstance(geometry, CadPart):
        geometry.build(gmsh.model.occ)
        gmsh.model.occ.synchronize()
        return faces_of(gmsh.model, unit, painted(gmsh.model)), Imported(regions={"seat": []})
    sound = replace(geometry, regions=_sound_regions(gmsh, geometry, problems))
    gmsh.clear()
    try:
        imported = import_part(gmsh, sound, heal=False, sectors=1, numbered=True)
        marks = recall(gmsh, imported)
    except GeometryError:
        raise
    except Exception as error:  # OpenCASCADE's message about an unreadable file
        raise GeometryError(f"{geometry.path}: cannot be read, export it again: {error}", "path") from error
    gmsh.model.occ.synchronize()
    return faces_of(gmsh.model, unit, marks), imported


def _solids(gmsh: Any, imported: Imported, unit: float) -> Iterator[dict[str, Any]]:
    """Yield number, name, region, volume [m^3] and centre [m] of each solid of a file."""
    for number, tags in imported.solids.items():
        volumes = np.array([gmsh.model.occ.getMass(3, tag) for tag in tags])
        centres = np.array([gmsh.model.occ.getCenterOfMass(3, tag) for tag in tags])
        yield {
            "number": number,
            "name": imported.names[number],
            "region": next(name for name, members in imported.regions.items() if tags[0] in members),
            "volume": unit**3 * float(volumes.sum()),
            "centre": (unit * np.average(centres, axis=0, weights=volumes)).tolist(),
        }


def _sound_regions(gmsh: Any, part: CadPart, problems: list[Problem]) -> tuple[cad.Region, ...]:
    """Return the regions that match solids of the file; append a problem for each of the others."""
    if not part.regions:
        return ()
    try:
        read_solids(gmsh, part)
    except GeometryError:
        raise
    except Exception:
        return ()  # the import in `_built` reports it
    solids = [tag for _, tag in gmsh.model.getEntities(3)]
    sound: list[cad.Region] = []
    for region in part.regions:
        try:
            regions_of(gmsh.model, replace(part, regions=(*sound, region)), solids)
            sound.append(region)
        except GeometryError as error:
            problems.append((error.field, str(error)))
    return tuple(sound)


def _groups(faces: Sequence[Face], patches: Patches, problems: list[Problem]) -> dict[str, list[int]]:
    """Return the tags of the faces of each group that can be selected."""
    groups: dict[str, list[int]] = {}
    for name, selectors in patches.items():
        field = name if name in ("contact", "fixed") else f"groups.{name}"
        selected: set[int] = set()
        for selector in selectors:
            try:
                selected |= {face.tag for face in select(faces, selector, name)}
            except GeometryError as error:
                problems.append((field, str(error)))
        if selected:
            groups[name] = sorted(selected)
    if shared := set(groups.get("contact", ())) & set(groups.get("fixed", ())):
        numbers = sorted({number for face in faces if face.tag in shared for number in face.numbers})
        problems.append(("fixed", f"faces {numbers} are selected both as 'contact' and as 'fixed'"))
    return groups


def _described(gmsh: Any, face: Face, unit: float, number_of: Mapping[int, int]) -> dict[str, Any]:
    """Return the fields of the face as a `seatfem.structures.inspection.cad.FoundFace` has them, and its tag."""
    solids = sorted(number_of.get(int(tag), 1) for tag in gmsh.model.getAdjacencies(2, face.tag)[0])
    names = ("tag", "numbers", "kind", "area", "centre", "normal", "axis", "ends", "colour", "name")
    return {name: encode(getattr(face, name)) for name in names} | {"solids": solids}


def _edges(gmsh: Any, groups: Sequence[list[int]], unit: float) -> dict[str, Any]:
    """Return the outlines of the groups as straight segments: ends (e, 2, 3) [m], and the group's number (e,)."""
    parts, of = [np.empty((0, 2, 3))], [np.empty(0, int)]
    for number, tags in enumerate(groups):
        curves = [abs(c) for tag in tags for _, c in gmsh.model.getBoundary([(2, tag)], oriented=True)]
        for curve in (c for c in curves if curves.count(c) == 1):
            low, high = gmsh.model.getParametrizationBounds(1, curve)
            where = np.linspace(low[0], high[0], 2 if gmsh.model.getType(1, curve) == "Line" else CHORDS + 1)
            points = unit * np.reshape(gmsh.model.getValue(1, curve, where), (-1, 3))
            parts.append(np.stack([points[:-1], points[1:]], axis=1))
            of.append(np.full(len(where) - 1, number))
    return {"edges": np.concatenate(parts), "edges_of": np.concatenate(of)}


def _coarse_mesh(gmsh: Any, struck: list[int], unit: float, *, picture: bool) -> dict[str, Any]:
    """Return points (n, 3) [m] and triangles (m, 3) with their face's tag, as far as gmsh succeeds.

    ``picture``: generate finer triangles on curved faces.
    """
    if picture:
        gmsh.option.setNumber("Mesh.MeshSizeMax", _coarse(gmsh) / FINE)
        gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", CURVED)
    else:
        _set_sizes(gmsh, struck)
    for option in ("Mesh.Optimize", "Mesh.OptimizeNetgen"):
        gmsh.option.setNumber(option, 0)
    stage("meshing coarsely", 0.5)
    with suppress(Exception):  # a run heals such a file first, and reports if it still fails
        gmsh.model.mesh.generate(2)
    tags, points, _ = gmsh.model.mesh.getNodes()
    row = rows_of(tags)
    triangles, faces = [np.empty((0, 3), int)], [np.empty(0, int)]
    for _, tag in gmsh.model.getEntities(2):
        nodes = gmsh.model.mesh.getElementsByType(TRIANGLE, tag)[1]
        triangles.append(row[nodes.astype(int)].reshape(-1, 3))
        faces.append(np.full(len(nodes) // 3, tag))
    return {
        "points": unit * points.reshape(-1, 3),
        "triangles": np.concatenate(triangles),
        "faces": np.concatenate(faces),
    }


def _coarse(gmsh: Any) -> float:
    box = np.array(gmsh.model.getBoundingBox(-1, -1))
    return COARSE * float(np.linalg.norm(box[3:] - box[:3]))


def _set_sizes(gmsh: Any, struck: list[int]) -> None:
    coarse = _coarse(gmsh)
    gmsh.option.setNumber("Mesh.MeshSizeMax", coarse)
    if not struck:
        return
    curves = [tag for _, tag in gmsh.model.getBoundary([(2, tag) for tag in struck], combined=False, oriented=False)]
    area = sum(gmsh.model.occ.getMass(2, tag) for tag in struck)
    around = sum(gmsh.model.occ.getMass(1, abs(tag)) for tag in curves)
    near = min(coarse, SIZE_PER_WIDTH * 2 * area / around) if around > 0 else coarse
    end = near + (coarse - near) / GROWTH + 1e-3 * near
    outlines = [abs(tag) for tag in curves]
    threshold = growing(gmsh, struck, outlines, (near, coarse), (near, end), samples=30)
    gmsh.model.mesh.field.setAsBackgroundMesh(threshold)


def _json(answer: dict[str, Any]) -> dict[str, Any]:
    return {"found": np.array(json.dumps(answer))}


MILLIMETRE: Final = 1e-3  # unit [m] in which gmsh reads the lengths of STEP files
EVEN: Final = 1e-6  # largest relative difference of a plate's two areas, and of its volume from area times thickness
SQUARE: Final = 1e-6  # largest difference of a unit normal from an axis of the file, or of opposite normals
ARCS: Final = 32  # number of circular arcs that approximate a curve which is neither line nor circle
LOST: Final = 1e-4  # largest relative error of the area by that approximation


def outline(gmsh: Any, job: dict[str, Any], model: KeptModel) -> dict[str, Any]:
    """Carry out task "outline": STEP file -> "loop:0" (the outline), "loop:1", ... (n, 3) [m]; "frame" (3, 3), the
    origin and the directions x and y of their coordinates; "normal" (3,), outward; "thickness", 0 of a face.

    With "oblique" the face may be inclined to the axes of the file; x and y then come from `lands.axes_along`.
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
    except Exception as error:  # OpenCASCADE's message about an unreadable file
        raise GeometryError(f"Outlined.file = {path.name}: cannot be read, export it again: {error}") from error
    gmsh.model.occ.synchronize()
    face, thickness = _face(gmsh, path)
    frame = _frame(face, path, oblique=job["oblique"])
    answer = {f"loop:{k}": loop for k, loop in enumerate(_loops(gmsh, face, path, frame))}
    answer |= {"frame": np.array([frame.origin, frame.x, frame.y]), "normal": np.array(face.normal)}
    return answer | {"thickness": np.float64(thickness)}


def _wrong(path: Path, what: str) -> GeometryError:
    return GeometryError(f"Outlined.file = {path.name}: {what}")


def _face(gmsh: Any, path: Path) -> tuple[Face, float]:
    """Return the only face and 0, or one side of the only plate and its thickness [m]."""
    faces = faces_of(gmsh.model, MILLIMETRE, painted(gmsh.model))
    solids = len(gmsh.model.getEntities(3))
    if not faces:
        raise _wrong(path, "it holds no face, only curves or points; export a face or a solid")
    if solids > 1:
        raise _wrong(path, f"it holds {solids} solids; a sheet is one: export it alone")
    if not solids:
        if len(faces) > 1:
            raise _wrong(path, f"it holds {len(faces)} faces without a solid; export one of them, or the solid plate")
        if faces[0].normal is None:
            raise _wrong(path, f"its face is no plane but a {faces[0].kind}; a sheet is flat: export its plane face")
        return faces[0], 0.0
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
    """Return axes in the plane of a face that is normal to an axis of the file; ``oblique``: or inclined. The origin is
    the projection of the file's."""
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
    """Return the outline, then the holes [m], in coordinates of the frame."""
    chains = [_chain(gmsh, tag, frame) for tag in sorted(face.curves)]

    def open_at(point: Array) -> GeometryError:
        return _wrong(path, "its outline is open at ({:.6g}, {:.6g}) mm; close it".format(*(1e3 * point)))

    outlines = loops.outlines(chains, open_at)
    area = abs(loops.area(outlines[0])) - sum(abs(loops.area(hole)) for hole in outlines[1:])
    if not math.isclose(area, face.area, rel_tol=LOST):
        raise _wrong(
            path, f"arcs along its curves enclose {area / face.area - 1:+.1e} more area than the face; redraw them"
        )
    return outlines


def _chain(gmsh: Any, tag: int, frame: Frame) -> Array:
    """Return the (n, 3) corners [m] and bulges of a curve, as circular arcs through three of its points each."""
    low, high = (float(bound[0]) for bound in gmsh.model.getParametrizationBounds(1, tag))
    kind = gmsh.model.getType(1, tag)
    count = {"Line": 1, "Circle": math.ceil((high - low) / math.pi - 1e-9)}.get(kind, ARCS)
    at = np.linspace(low, high, 2 * count + 1)
    points = frame.seen(MILLIMETRE * np.reshape(gmsh.model.getValue(1, tag, at), (-1, 3)))
    chain = loops.arcs_through(points)
    return chain * (1, 1, 0) if kind == "Line" else chain
