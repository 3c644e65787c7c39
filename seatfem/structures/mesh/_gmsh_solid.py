"""Solids of tetrahedra: built, healed, sized and meshed in gmsh's model; used in the gmsh process only."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np

from seatfem.structures.mesh._gmsh_arrays import arrays
from seatfem.structures.mesh._gmsh_cad import Imported, check_faces, import_part, recall
from seatfem.structures.mesh._gmsh_messages import stage
from seatfem.structures.mesh._gmsh_model import KeptModel, set_sizes
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.shapes import CadPart, Geometry, GeometryError, decode
from seatfem.structures.shapes.inspect import area_of, patch_tags, volume_of
from seatfem.structures.shapes.shape import cut, patches_in

MESH_ADAPT, FRONTAL = 1, 4
TETRAHEDRON = {1: 4, 2: 11}  # gmsh element types by order
LEAST_OF_PATCH = 0.25  # the smallest element that curvature may ask for, over the patch's
EQUAL_SECTORS = 1e-6  # relative, of volumes
POOR_JACOBIAN = 0.05


@dataclass(frozen=True)
class Rung:
    """``heal``: sew and repair the shapes first; ``curvature``: least elements per full turn; ``options``: gmsh's."""

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
    """Every rung failed; the message says what failed on each, and where."""


def climb(what: str, rungs: Sequence[Rung], attempt: Callable[[Rung], None], where: Callable[[], str]) -> list[str]:
    """Try the rungs in turn until one holds; returns notes on those that failed and on the one that held.

    ``what``: is meshed; ``where``: the place of the last failure. A `GeometryError` is no failure to mesh and ends the
    climb. Raises `LadderError` after the last rung.
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


def build(
    gmsh: Any, geometry: Geometry, sectors: int = 1, heal: bool = False
) -> tuple[dict[str, list[int]], dict[str, list[int]]]:
    """Build the solids, or one of the equal sectors; returns the face tags of the groups and the solids of regions."""
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
    marks = recall(gmsh, imported) if isinstance(geometry, CadPart) else None
    occ.synchronize()
    if isinstance(geometry, CadPart):
        check_faces(gmsh.model, unit)
    tags = patch_tags(gmsh.model, patches_in(geometry, sectors), unit, marks)
    if shared := set(tags["contact"]) & set(tags.get("fixed", ())):
        raise GeometryError(f"faces {sorted(shared)} must not be both 'contact' and 'fixed'")
    return tags, imported.regions or {"seat": [tag for _, tag in gmsh.model.getEntities(3)]}


def build_and_name(gmsh: Any, geometry: Geometry, sectors: int, heal: bool) -> dict[str, list[int]]:
    """Return the face tags of the groups, which the model knows by name from now on."""
    tags, regions = build(gmsh, geometry, sectors, heal)
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
    """Optimise where curving left (nearly) inverted elements; the parent checks what remains.

    This optimiser depends on memory addresses: where it has to act, node positions differ a little from run to run.
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
    """Return the surfaces and volumes that gmsh could not mesh, and where they are."""
    places = []
    for dimension, tag in gmsh.model.mesh.getLastEntityError():
        x, y, z = (1e3 * unit * c for c in gmsh.model.occ.getCenterOfMass(dimension, tag))
        kind = {1: "curve", 2: "surface", 3: "volume"}[dimension]
        places.append(f"{kind} {tag} about ({x:.4g}, {y:.4g}, {z:.4g}) mm")
    return ", ".join(places)


def write_msh(gmsh: Any, path: str, scale: float) -> None:
    """Write the mesh in metres, so that the file is read back with unit 1."""
    gmsh.option.setNumber("Mesh.ScalingFactor", scale)
    gmsh.write(path)
    gmsh.option.setNumber("Mesh.ScalingFactor", 1.0)


def make(gmsh: Any, job: dict[str, Any], model: KeptModel) -> dict[str, Any]:
    """Do task "mesh": geometry and spec -> arrays, and a .msh file where asked for."""
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
        tags = model.built(gmsh, job, lambda: build_and_name(gmsh, geometry, job["sectors"], rung.heal), rung.heal)
        edges = gmsh.model.getBoundary([(2, tag) for tag in tags["contact"]], combined=False, oriented=False)
        set_sizes(gmsh, spec, tags["contact"], [tag for _, tag in edges], 1.0 / unit)
        gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", max(spec.curvature, rung.curvature))
        gmsh.option.setNumber("Mesh.MeshSizeMin", LEAST_OF_PATCH * spec.patch_size / unit)
        generate(gmsh, spec, unit)
        results.append(tags)

    rungs = LADDER if geometry.is_imported else LADDER[:1]
    notes = climb(geometry.source, rungs, attempt, lambda: where_it_failed(gmsh, unit))
    if job["msh"]:
        write_msh(gmsh, job["msh"], unit)
    cad = {"volume": volume_of(gmsh.model, unit)} | {
        name: area_of(gmsh.model, faces, unit) for name, faces in results[0].items()
    }
    sizes = {f"cad:{name}": np.float64(value) for name, value in cad.items()}
    return arrays(gmsh, unit) | sizes | {"notes": np.array(notes, dtype=str)}
