"""Imported CAD in gmsh's model: colours, names and regions, kept through operations; used in the gmsh process only."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from seatfem.structures.mesh._gmsh_input import handed_over
from seatfem.structures.shapes import CadPart, GeometryError, NumberedFace, cad
from seatfem.structures.shapes.faces import Colour
from seatfem.structures.shapes.inspect import Mark, colour_of, outline_of

SAME_PLACE = 1e-5  # of the model's size
OFF_SURFACE = 1e-3  # of the model's size
SAMPLES = 4  # every so many points of a face's outline are compared


@dataclass
class Imported:
    """``marks``: of the faces, while they are the imported ones; ``copies``: of the faces that must be found again,
    with their type and mark; ``regions``: name -> solids.
    """

    marks: dict[int, Mark] = field(default_factory=dict)
    copies: dict[int, tuple[str, Mark]] = field(default_factory=dict)
    regions: dict[str, list[int]] = field(default_factory=dict)


def read_solids(gmsh: Any, part: CadPart) -> None:
    """Read the solids of the part's file in gmsh's model."""
    with handed_over(part.path) as copy:
        replace(part, path=copy).build(gmsh.model.occ)
    gmsh.model.occ.synchronize()


def import_part(gmsh: Any, part: CadPart, heal: bool, sectors: int, numbered: bool = False) -> Imported:
    """Import, check the size, and make all solids conformal; copies of faces stay in the model until `recall`.

    ``numbered``: all faces keep their numbers, not only those that have colour or name, or are selected by number.
    """
    numbered = numbered or any(isinstance(s, NumberedFace) for chosen in part.patches.values() for s in chosen)
    model, occ = gmsh.model, gmsh.model.occ
    read_solids(gmsh, part)
    box = np.array(model.getBoundingBox(-1, -1))
    cad.check_size(part, tuple(part.unit_of_model * (box[3:] - box[:3])))
    solids = model.getEntities(3)
    marks = _marks(model, part)
    imported = Imported(marks, regions=regions_of(model, part, [tag for _, tag in solids]))
    if not heal and len(solids) == 1 and sectors == 1:
        return imported
    imported.marks = {}
    marked = [(tag, mark) for tag, mark in marks.items() if numbered or mark.colour is not None or mark.name]
    copied = occ.copy([(2, tag) for tag, _ in marked]) if marked else []
    imported.copies = {
        copy: (model.getType(2, tag), mark) for (_, copy), (tag, mark) in zip(copied, marked, strict=True)
    }
    if heal:
        solids = _heal(occ, imported, solids)
    if len(solids) > 1:
        _, pieces = occ.fragment(solids[:1], solids[1:])
        _replaced(imported, solids, [list(piece) for piece in pieces])
    return imported


def _heal(occ: Any, found: Imported, solids: list[tuple[int, int]]) -> list[tuple[int, int]]:
    """Heal the solids; healing numbers anew, so solids and copies are found again by where they are and how large."""
    before = {entity: _place(occ, entity) for entity in [*solids, *((2, tag) for tag in found.copies)]}
    occ.healShapes(solids)
    faces, healed = _loose_faces(occ), occ.getEntities(3)
    found.copies = {_same(occ, faces, before[2, old])[1]: copied for old, copied in found.copies.items() if faces}
    return _replaced(found, solids, [[_same(occ, healed, before[old])] for old in solids])


def _place(occ: Any, entity: tuple[int, int]) -> NDArray[np.float64]:
    """Return the centre, and length of the same measure as the entity (the square or cube root of its area or
    volume)."""
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


def recall(gmsh: Any, found: Imported) -> dict[int, Mark]:
    """Return colour and name of the faces now in the model, from the copies they lie on; removes the copies."""
    if not found.copies:
        occ = gmsh.model.occ
        if loose := _loose_faces(occ):
            occ.remove(loose, recursive=True)
        return found.marks
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
        for copy, (kind, mark) in found.copies.items():
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
    """Return the part's regions, and for solids that none of them names "seat", or "solid_1", "solid_2", ..."""
    colours: list[Colour | None] = [colour_of(model, 3, tag) for tag in solids]
    names = [model.getEntityName(3, tag).rpartition("/")[2] for tag in solids]
    regions: dict[str, list[int]] = {}
    remaining = list(solids)
    for region in part.regions:
        fitting = [
            tag
            for number, (tag, colour, name) in enumerate(zip(solids, colours, names, strict=True), 1)
            if region.matches(number, colour, name)
        ]
        if not fitting:
            listing = "\n".join(
                f"  solid {number}: name {name!r}, " + ("no colour" if colour is None else f"colour {colour}")
                for number, (colour, name) in enumerate(zip(colours, names, strict=True), 1)
            )
            raise GeometryError(
                f"{part.path}: no solid for the region {region.name!r} ({region}); there are:\n{listing}",
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


def _replaced(
    found: Imported, solids: list[tuple[int, int]], pieces: list[list[tuple[int, int]]]
) -> list[tuple[int, int]]:
    """Follow the regions through an operation; return the solids there are now."""
    after = {old[1]: [new[1] for new in piece] for old, piece in zip(solids, pieces, strict=False)}
    everything = [tag for piece in after.values() for tag in piece]
    if len(set(everything)) < len(everything):
        raise GeometryError("solids of the CAD file overlap: cut one out of the other, so that they share faces only")
    found.regions = {name: [new for old in tags for new in after[old]] for name, tags in found.regions.items()}
    return [(3, tag) for tag in everything]
