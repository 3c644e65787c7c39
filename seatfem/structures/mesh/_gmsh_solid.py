"""Meshing of solids by tetrahedra: import or construction, healing and sizes; used in the gmsh process only.

Colours, names and regions of imported CAD are preserved by all operations.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seatfem.structures.mesh._gmsh_base import KeptModel, arrays, handed_over, set_sizes, stage
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.shapes import CadPart, Geometry, GeometryError, NumberedFace, cad, decode
from seatfem.structures.shapes.inspect import (
    Mark,
    area_of,
    colour_of,
    faces_of,
    outline_of,
    painted,
    patch_tags,
    volume_of,
)
from seatfem.structures.shapes.selectors import joined_to, matching
from seatfem.structures.shapes.shape import cut, patches_in

SAME_PLACE = 1e-5  # largest distance of coincident points, over the model's size
OFF_SURFACE = 1e-3  # largest distance of edges from their surface, over the model's size
SAMPLES = 4  # stride between the points of a face's outline that are compared


@dataclass
class Imported:
    """An imported CAD file.

    ``marks``: marks of the faces, while these are unchanged; ``copies``: copies of marked faces, with type and mark, by
    which the faces are recognized after an operation; ``regions``: name -> solids; ``solids``: number in the file ->
    solids; ``names``: number -> name in the file.
    """

    marks: dict[int, Mark] = field(default_factory=dict)
    copies: dict[int, tuple[str, Mark]] = field(default_factory=dict)
    regions: dict[str, list[int]] = field(default_factory=dict)
    solids: dict[int, list[int]] = field(default_factory=dict)
    names: Mapping[int, str] = field(default_factory=dict)


def read_solids(gmsh: Any, part: CadPart) -> None:
    """Read the solids of the part's file into gmsh's model."""
    with handed_over(part.path) as copy:
        replace(part, path=copy).build(gmsh.model.occ)
    gmsh.model.occ.synchronize()


def import_part(gmsh: Any, part: CadPart, heal: bool, sectors: int, numbered: bool = False) -> Imported:
    """Import the part, check its size, keep the solids in question and make them conformal; copies of faces stay in the
    model until `recall`.

    ``numbered``: keep the numbers of all faces, also if none is selected by number.
    """
    numbered = numbered or any(isinstance(s, NumberedFace) for chosen in part.patches.values() for s in chosen)
    model, occ = gmsh.model, gmsh.model.occ
    read_solids(gmsh, part)
    tags = [tag for _, tag in model.getEntities(3)]
    listing = _listed(model, tags)
    solids_in_file = {number: [tag] for number, tag in enumerate(tags, 1)}
    names = {number: name_of(model, tag) for number, tag in enumerate(tags, 1)}
    imported = Imported(_marks(model, part), {}, regions_of(model, part, tags), solids_in_file, names)
    if part.solid:
        _keep(gmsh, imported, [_chosen(part, names, listing)])
    solids, marks = model.getEntities(3), imported.marks
    box = np.array(model.getBoundingBox(-1, -1))
    cad.check_size(part, tuple(part.unit_of_model * (box[3:] - box[:3])))
    if not heal and len(solids) == 1 and sectors == 1:
        return imported
    struck = _struck(model, part, imported) if len(solids) > 1 and part.solid is None else set()
    imported.marks = {}
    marked = [(tag, mark) for tag, mark in marks.items() if numbered or mark.colour or mark.name]
    copied = occ.copy([(2, tag) for tag, _ in marked]) if marked else []
    imported.copies = {
        copy: (model.getType(2, tag), mark) for (_, copy), (tag, mark) in zip(copied, marked, strict=True)
    }
    if heal:
        solids = _heal(occ, imported, solids)
    if len(solids) > 1:
        _, pieces = occ.fragment(solids[:1], solids[1:])
        _replaced(imported, solids, [list(piece) for piece in pieces])
        occ.synchronize()
        if struck:
            _keep(gmsh, imported, _hanging_together(model, part, imported, struck, listing))
    return imported


def _chosen(part: CadPart, names: Mapping[int, str], listing: str) -> int:
    """Return the number of the solid that the part chooses by number or name."""
    numbers = [number for number, name in names.items() if part.solid in (number, name)]
    if len(numbers) == 1:
        return numbers[0]
    words = f"{len(numbers)} solids are called so" if numbers else "no solid is called so"
    raise GeometryError(f"{part.path}: solid = {part.solid!r}: {words}; choose one by its number:\n{listing}", "solid")


def _struck(model: Any, part: CadPart, imported: Imported) -> set[int]:
    """Return the numbers of the solids with struck faces."""
    faces = faces_of(model, part.unit_of_model, imported.marks)
    tags = {face.tag for selector in part.patches["contact"] for face in matching(faces, selector)}
    owners = {int(solid) for tag in tags for solid in model.getAdjacencies(2, tag)[0]}
    return {number for number, solids in imported.solids.items() if owners.intersection(solids)}


def _hanging_together(model: Any, part: CadPart, imported: Imported, struck: set[int], listing: str) -> set[int]:
    """Return the numbers of the solids that hang together with the struck one: they share points.

    Raises:
        GeometryError: several are struck that do not hang together.
    """
    points = {
        number: {
            tag for _, tag in model.getBoundary([(3, t) for t in tags], combined=False, oriented=False, recursive=True)
        }
        for number, tags in imported.solids.items()
    }
    first = min(struck)
    together = joined_to(first, points)
    if struck <= together:
        return together
    raise GeometryError(
        f"{part.path}: the struck faces are on solids {', '.join(map(str, sorted(struck)))}, which do not touch each "
        f"other; choose one, as in solid = {first}:\n{listing}",
        "solid",
    )


def _keep(gmsh: Any, imported: Imported, numbers: Collection[int]) -> None:
    """Remove the solids with other numbers from the model, with what bounds them alone."""
    gone = {tag for number, tags in imported.solids.items() if number not in numbers for tag in tags}
    gmsh.model.occ.remove([(3, tag) for tag in gone], recursive=True)
    gmsh.model.occ.synchronize()
    faces = {tag for _, tag in gmsh.model.getEntities(2)}
    imported.marks = {tag: mark for tag, mark in imported.marks.items() if tag in faces}
    imported.solids = {number: imported.solids[number] for number in numbers}
    remaining = {name: [tag for tag in tags if tag not in gone] for name, tags in imported.regions.items()}
    imported.regions = {name: tags for name, tags in remaining.items() if tags}


def _heal(occ: Any, imported: Imported, solids: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Heal the solids; as this changes the tags, solids and copies are matched by centre and size."""
    before = {entity: _place(occ, entity) for entity in [*solids, *((2, tag) for tag in imported.copies)]}
    occ.healShapes(solids)
    faces, healed = _loose_faces(occ), occ.getEntities(3)
    imported.copies = {_same(occ, faces, before[2, old])[1]: kept for old, kept in imported.copies.items() if faces}
    return _replaced(imported, solids, [[_same(occ, healed, before[old])] for old in solids])


def _place(occ: Any, entity: tuple[int, int]) -> NDArray[np.float64]:
    """Return the centre, and the square or cube root of the entity's area or volume."""
    return np.array([*occ.getCenterOfMass(*entity), occ.getMass(*entity) ** (1 / entity[0])])


def _same(occ: Any, entities: list[tuple[int, int]], place: NDArray[np.float64]) -> tuple[int, int]:
    return min(entities, key=lambda entity: float(np.linalg.norm(_place(occ, entity) - place)))


def _loose_faces(occ: Any) -> list[tuple[int, int]]:
    """Return the faces that bound no solid."""
    bounding = {int(face) for _, solid in occ.getEntities(3) for loop in occ.getSurfaceLoops(solid)[1] for face in loop}
    return [(2, tag) for _, tag in occ.getEntities(2) if tag not in bounding]


def check_faces(model: Any, unit: float) -> None:
    """Raise `RuntimeError`, naming the surface and the place, where a face's edges do not lie on its surface."""
    box = np.array(model.getBoundingBox(-1, -1))
    slack = OFF_SURFACE * float(np.linalg.norm(box[3:] - box[:3]))
    for _, tag in model.getEntities(2):
        curves = [abs(curve) for _, curve in model.getBoundary([(2, tag)], oriented=False)]
        points = outline_of(model, curves, 1.0)[::SAMPLES]
        if not len(points):
            continue
        off = np.linalg.norm(np.reshape(model.getClosestPoint(2, tag, points.ravel())[0], (-1, 3)) - points, axis=1)
        if off.max() > slack:
            x, y, z = 1e3 * unit * points[np.argmax(off)]
            raise RuntimeError(
                f"surface {tag} ({model.getType(2, tag)}): its edges lie up to {1e3 * unit * off.max():.3g} mm off it, "
                f"at ({x:.4g}, {y:.4g}, {z:.4g}) mm; heal it"
            )


def recall(gmsh: Any, imported: Imported) -> dict[int, Mark]:
    """Return the marks of the faces now in the model, by the copies on which they lie, and remove the copies."""
    if not imported.copies:
        occ = gmsh.model.occ
        if loose := _loose_faces(occ):
            occ.remove(loose, recursive=True)
        return imported.marks
    model, occ = gmsh.model, gmsh.model.occ
    occ.synchronize()
    box = np.array(model.getBoundingBox(-1, -1))
    near = SAME_PLACE * float(np.linalg.norm(box[3:] - box[:3]))
    solids = model.getEntities(3)
    faces = {abs(tag) for _, tag in model.getBoundary(solids, combined=False, oriented=False)}
    marks: dict[int, Mark] = {}
    for face in faces:
        curves = [abs(tag) for _, tag in model.getBoundary([(2, face)], oriented=False)]
        points = [occ.addPoint(*point) for point in outline_of(model, curves, 1.0)[::SAMPLES]]
        for copy, (kind, mark) in imported.copies.items():
            same = kind == model.getType(2, face)
            if same and all(occ.getDistance(0, point, 2, copy)[0] < near for point in points):
                before = marks.get(face, Mark())
                numbers = tuple(sorted({*before.numbers, *mark.numbers}))
                marks[face] = Mark(mark.colour or before.colour, mark.name or before.name, numbers)
        occ.remove([(0, point) for point in points])
    occ.remove(_loose_faces(occ), recursive=True)
    return marks


def _marks(model: Any, part: CadPart) -> dict[int, Mark]:
    tags = [tag for _, tag in model.getEntities(2)]
    names = cad.step_face_names(part.path) if part.path.suffix.lower() in cad.STEP_SUFFIXES else []
    kinds_agree = len(names) == len(tags) and all(
        kind == "" or kind == model.getType(2, tag) for (_, kind), tag in zip(names, tags, strict=True)
    )
    known = [name for name, _ in names] if kinds_agree else [""] * len(tags)
    return {
        tag: Mark(colour_of(model, 2, tag), name, (number,))
        for number, (tag, name) in enumerate(zip(tags, known, strict=True), 1)
    }


def regions_of(model: Any, part: CadPart, solids: list[int]) -> dict[str, list[int]]:
    """Return the part's regions; solids outside all of them are "seat", or "solid_1", "solid_2", ..."""
    colours = [colour_of(model, 3, tag) for tag in solids]
    names = [name_of(model, tag) for tag in solids]
    regions: dict[str, list[int]] = {}
    remaining = list(solids)
    for region in part.regions:
        fitting = [
            tag
            for number, (tag, colour, name) in enumerate(zip(solids, colours, names, strict=True), 1)
            if region.matches(number, colour, name)
        ]
        if not fitting:
            raise GeometryError(
                f"{part.path}: no solid for the region {region.name!r} ({region}); there are:\n"
                f"{_listed(model, solids)}",
                f"regions.{region.name}",
            )
        taken = [tag for tag in fitting if tag not in remaining]
        if taken:
            raise GeometryError(
                f"{part.path}: solids {taken} belong to {region.name!r} and to another region: give them to one",
                f"regions.{region.name}",
            )
        regions[region.name] = fitting
        remaining = [tag for tag in remaining if tag not in fitting]
    if remaining and not regions and len(solids) == 1:
        return {"seat": remaining}
    return regions | {f"solid_{solids.index(tag) + 1}": [tag] for tag in remaining}


def name_of(model: Any, tag: int) -> str:
    """Return the name of a solid in the file."""
    return str(model.getEntityName(3, tag)).rpartition("/")[2]


def _listed(model: Any, solids: list[int]) -> str:
    """Return one line for each solid."""
    colours = [colour_of(model, 3, tag) for tag in solids]
    return "\n".join(
        f"  solid {number}: name {name_of(model, tag)!r}, " + (f"colour {colour}" if colour else "no colour")
        for number, (tag, colour) in enumerate(zip(solids, colours, strict=True), 1)
    )


def _replaced(
    imported: Imported, solids: list[tuple[int, int]], pieces: list[list[tuple[int, int]]]
) -> list[tuple[int, int]]:
    """Update regions and solids after an operation, and return the present solids."""
    after = {old[1]: [new[1] for new in piece] for old, piece in zip(solids, pieces, strict=False)}
    everything = [tag for piece in after.values() for tag in piece]
    if len(set(everything)) < len(everything):
        remedy = "cut one out of the other, so that they share faces only, or take one, as in solid = 1"
        raise GeometryError(f"solids of the CAD file overlap: {remedy}", "solid")
    imported.regions = {name: [new for old in tags for new in after[old]] for name, tags in imported.regions.items()}
    imported.solids = {number: [new for old in tags for new in after[old]] for number, tags in imported.solids.items()}
    return [(3, tag) for tag in everything]


MESH_ADAPT, FRONTAL = 1, 4
TETRAHEDRON = {1: 4, 2: 11}  # gmsh element types by order
LEAST_OF_PATCH = 0.25  # smallest element size by curvature, over the size on the contact patch
EQUAL_SECTORS = 1e-6  # largest relative difference of the volumes of sectors
POOR_JACOBIAN = 0.05  # scaled Jacobian below which curved elements are optimised


@dataclass(frozen=True)
class Rung:
    """One attempt to mesh: ``heal``: repair the shapes first; ``curvature``: least elements per full turn; ``options``:
    options of gmsh."""

    name: str
    heal: bool = False
    curvature: int = 0
    options: Mapping[str, float] = field(default_factory=lambda: MappingProxyType({}))


LADDER = (
    Rung("as it is"),
    Rung("shapes healed", heal=True),
    Rung("shapes healed, finer where it curves", heal=True, curvature=16),
    Rung(
        "shapes healed, other meshing algorithms",
        heal=True,
        curvature=16,
        options=MappingProxyType({"Mesh.Algorithm": MESH_ADAPT, "Mesh.Algorithm3D": FRONTAL}),
    ),
)


class LadderError(RuntimeError):
    """Error after all attempts failed; the message states the failure of each, and its place."""


def retry_with_healing(
    what: str, rungs: Sequence[Rung], attempt: Callable[[Rung], None], where: Callable[[], str]
) -> list[str]:
    """Try the rungs in turn until one succeeds; return notes on the failures and on the success after them.

    ``what``: name of the geometry; ``where``: returns the place of the last failure. A `GeometryError` is raised at
    once, as it is no failure to mesh; `LadderError` after the last rung.
    """
    failed: list[str] = []
    for rung in rungs:
        try:
            attempt(rung)
        except GeometryError:
            raise
        except Exception as error:
            place = where()
            failed.append(f"{rung.name}: {error}" + (f" ({place})" if place else ""))
        else:
            return [*(f"not meshed {text}" for text in failed), f"meshed with {rung.name}"] if failed else []
    raise LadderError(f"{what}: cannot be meshed, check and heal it; " + "; ".join(failed))


def build(gmsh: Any, geometry: Geometry, sectors: int, heal: bool) -> dict[str, list[int]]:
    """Build the solids, or one of the equal sectors, add groups and regions to the model as physical groups, and return
    the face tags of the groups."""
    unit = geometry.unit_of_model
    occ = gmsh.model.occ
    imported = import_part(gmsh, geometry, heal, sectors) if isinstance(geometry, CadPart) else Imported()
    if not isinstance(geometry, CadPart):
        geometry.build(occ)
    if sectors > 1:
        whole = sum(occ.getMass(3, tag) for _, tag in occ.getEntities(3))
        cut(occ, 3, sectors)
        part = sum(occ.getMass(3, tag) for _, tag in occ.getEntities(3))
        if abs(sectors * part / whole - 1.0) > EQUAL_SECTORS:
            raise GeometryError(
                f"sector = {sectors}: the part beside y = 0 must be 1/{sectors} of the volume, it is {part / whole:.6g}"
            )
    if isinstance(geometry, CadPart):
        marks = recall(gmsh, imported)
        occ.synchronize()
        check_faces(gmsh.model, unit)
    else:
        occ.synchronize()
        marks = painted(gmsh.model)
    tags = patch_tags(gmsh.model, patches_in(geometry, sectors), unit, marks)
    if shared := set(tags["contact"]) & set(tags.get("fixed", ())):
        raise GeometryError(f"faces {sorted(shared)} must not be both 'contact' and 'fixed'")
    regions = imported.regions or {"seat": [tag for _, tag in gmsh.model.getEntities(3)]}
    for name, solids in regions.items():
        gmsh.model.addPhysicalGroup(3, solids, name=name)
    for name, faces in tags.items():
        gmsh.model.addPhysicalGroup(2, faces, name=name)
    return tags


def generate(gmsh: Any, spec: MeshSpec, unit: float) -> None:
    mesh = gmsh.model.mesh
    stage("meshing surfaces", 0.1)
    mesh.generate(2)
    stage("meshing the volume", 0.3)
    mesh.generate(3)
    if spec.order == 2:
        stage("curving elements", 0.7)
        gmsh.option.setNumber("Mesh.SecondOrderLinear", 0 if spec.curved else 1)
        mesh.setOrder(2)
        untangle(gmsh, unit)


def untangle(gmsh: Any, unit: float) -> None:
    """Optimise the mesh if curving made elements (nearly) inverted; the parent process checks the result.

    This optimiser depends on memory addresses: if it is used, node positions differ slightly between runs.
    """
    elements, _ = gmsh.model.mesh.getElementsByType(TETRAHEDRON[2])
    jacobian = gmsh.model.mesh.getElementQualities(elements, "minSJ")
    poor = np.flatnonzero(jacobian < POOR_JACOBIAN)
    if len(poor):
        worst = elements[np.argmin(jacobian)]
        nodes = gmsh.model.mesh.getElement(worst)[1]
        x, y, z = 1e3 * unit * np.mean([gmsh.model.mesh.getNode(node)[0] for node in nodes], axis=0)
        stage(f"untangling {len(poor)} curved elements, worst near ({x:.3g}, {y:.3g}, {z:.3g}) mm", 0.8)
        gmsh.model.mesh.optimize("HighOrder")


def where_it_failed(gmsh: Any, unit: float) -> str:
    """Return the surfaces and volumes that gmsh could not mesh, and their places."""
    places = []
    for dimension, tag in gmsh.model.mesh.getLastEntityError():
        x, y, z = (1e3 * unit * c for c in gmsh.model.occ.getCenterOfMass(dimension, tag))
        kind = {1: "curve", 2: "surface", 3: "volume"}[dimension]
        places.append(f"{kind} {tag} about ({x:.4g}, {y:.4g}, {z:.4g}) mm")
    return ", ".join(places)


def make(gmsh: Any, job: dict[str, Any], model: KeptModel) -> dict[str, Any]:
    """Carry out task "mesh": geometry and spec -> arrays."""
    geometry: Geometry = decode(job["geometry"])
    spec = MeshSpec(**job["spec"])
    unit = geometry.unit_of_model
    results: list[dict[str, list[int]]] = []

    def attempt(rung: Rung) -> None:
        if rung is not LADDER[0]:
            model.forget()
        for option, value in rung.options.items():
            gmsh.option.setNumber(option, value)
        stage("building the geometry", 0.0)
        tags = model.built(gmsh, job, lambda: build(gmsh, geometry, job["sectors"], rung.heal), rung.heal)
        edges = gmsh.model.getBoundary([(2, tag) for tag in tags["contact"]], combined=False, oriented=False)
        set_sizes(gmsh, spec, tags["contact"], [tag for _, tag in edges], 1.0 / unit)
        gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", rung.curvature)
        gmsh.option.setNumber("Mesh.MeshSizeMin", LEAST_OF_PATCH * spec.patch_size / unit)
        generate(gmsh, spec, unit)
        results.append(tags)

    rungs = LADDER if isinstance(geometry, CadPart) else LADDER[:1]
    notes = retry_with_healing(geometry.source, rungs, attempt, lambda: where_it_failed(gmsh, unit))
    cad = {"volume": volume_of(gmsh.model, unit)} | {
        name: area_of(gmsh.model, faces, unit) for name, faces in results[0].items()
    }
    sizes = {f"cad:{name}": np.float64(value) for name, value in cad.items()}
    return arrays(gmsh, unit) | sizes | {"notes": np.array(notes, dtype=str)}
