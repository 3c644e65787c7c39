"""The gmsh process: `python -m seatfem._gmsh_worker JOB.json`, started by `seatfem.gmsh_process` only.

Lengths inside gmsh are those of the geometry's recipe (millimetres); everything that is read from or written for
the parent is in metres. The parent learns of progress and failure from JSON lines on standard output.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from seatfem._gmsh_arrays import arrays
from seatfem._gmsh_cad import Imported, import_part, recall
from seatfem._gmsh_section import mesh_section, plane_arrays
from seatfem._gmsh_sizes import set_sizes
from seatfem.geometry import (
    CadPart,
    Extruded,
    Geometry,
    GeometryError,
    Revolved,
    decode,
    family_of,
    model_unit,
    revolved,
)
from seatfem.geometry.inspect import area_of, patch_tags, volume_of
from seatfem.geometry.plan import EVERYWHERE
from seatfem.geometry.sectors import cut, patches_in
from seatfem.geometry.step_colours import paint
from seatfem.healing import LADDER, Rung, climb
from seatfem.mesh_spec import MeshSpec

APT_LINE = (
    "apt-get install --no-install-recommends libglu1-mesa libgl1 libxrender1 libxcursor1 libxft2 libxinerama1 libgomp1"
)
TETRAHEDRON = {1: 4, 2: 11}  # gmsh element types by order
LEAST_OF_PATCH = 0.25  # the smallest element that curvature may ask for, over the patch's
EQUAL_SECTORS = 1e-6  # relative, of volumes
POOR_JACOBIAN = 0.05
MILLIMETRE = 1e-3  # in which STEP files are written
OPTIONS = {
    "General.Terminal": 0,
    "General.NumThreads": 1,  # one thread is reproducible, several are not
    "Geometry.OCCImportLabels": 1,  # colours of STEP faces
    "Mesh.OptimizeNetgen": 1,  # removes the slivers on fillets that would invert when curved
    "Mesh.MeshSizeExtendFromBoundary": 0,
    "Mesh.MeshSizeFromPoints": 0,
    "Mesh.MeshSizeFromCurvature": 0,
    "Mesh.MshFileVersion": 4.1,
}


def send(**message: Any) -> None:
    """One JSON line to the parent."""
    sys.stdout.write(json.dumps(message) + "\n")
    sys.stdout.flush()


def stage(what: str, done: float) -> None:
    send(stage=what, done=done)


def build(
    gmsh: Any, geometry: Geometry, sectors: int = 1, heal: bool = False
) -> tuple[dict[str, list[int]], dict[str, list[int]]]:
    """Build the solids, or one of the equal sectors; returns the face tags of the groups and the solids of regions."""
    unit = model_unit(geometry)
    occ = gmsh.model.occ
    imported = import_part(gmsh, geometry, heal, sectors) if isinstance(geometry, CadPart) else Imported()
    if not isinstance(geometry, CadPart):
        family_of(geometry).build(geometry, occ)
    if sectors > 1:
        whole = sum(occ.getMass(3, tag) for _, tag in occ.getEntities(3))
        cut(occ, 3, sectors)
        part = sum(occ.getMass(3, tag) for _, tag in occ.getEntities(3))
        if abs(sectors * part / whole - 1.0) > EQUAL_SECTORS:
            raise GeometryError(f"sector = {sectors}: the part beside y = 0 is {part / whole:.6g} of the volume")
    marks = recall(gmsh, imported) if isinstance(geometry, CadPart) else None
    occ.synchronize()
    tags = patch_tags(gmsh.model, patches_in(geometry, sectors), unit, marks)
    if shared := set(tags["contact"]) & set(tags["fixed"]):
        raise GeometryError(f"faces {sorted(shared)} are selected both as 'contact' and as 'fixed'")
    return tags, imported.regions or {"seat": [tag for _, tag in gmsh.model.getEntities(3)]}


def name_groups(gmsh: Any, tags: dict[str, list[int]], regions: dict[str, list[int]]) -> None:
    for name, solids in regions.items():
        gmsh.model.addPhysicalGroup(3, solids, name=name)
    for name, faces in tags.items():
        gmsh.model.addPhysicalGroup(2, faces, name=name)


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
    """The surfaces and volumes that gmsh could not mesh, and where they are."""
    places = []
    for dimension, tag in gmsh.model.mesh.getLastEntityError():
        x, y, z = (1e3 * unit * c for c in gmsh.model.occ.getCenterOfMass(dimension, tag))
        kind = {1: "curve", 2: "surface", 3: "volume"}[dimension]
        places.append(f"{kind} {tag} about ({x:.4g}, {y:.4g}, {z:.4g}) mm")
    return ", ".join(places)


def write_msh(gmsh: Any, path: str, scale: float) -> None:
    """In metres, so that the file is read back with unit 1."""
    gmsh.option.setNumber("Mesh.ScalingFactor", scale)
    gmsh.write(path)
    gmsh.option.setNumber("Mesh.ScalingFactor", 1.0)


def make(gmsh: Any, job: dict[str, Any]) -> dict[str, Any]:
    """Task "mesh": geometry and spec -> arrays, and a .msh file where asked for."""
    geometry: Geometry = decode(job["geometry"])
    spec = MeshSpec(**job["spec"])
    unit = model_unit(geometry)
    results: list[dict[str, list[int]]] = []

    def attempt(rung: Rung) -> None:
        if rung is not LADDER[0]:
            gmsh.clear()
        for option, value in rung.options.items():
            gmsh.option.setNumber(option, value)
        stage("building the geometry", 0.0)
        tags, regions = build(gmsh, geometry, job["sectors"], rung.heal)
        edges = gmsh.model.getBoundary([(2, tag) for tag in tags["contact"]], combined=False, oriented=False)
        set_sizes(gmsh, spec, tags["contact"], [tag for _, tag in edges], 1.0 / unit)
        gmsh.option.setNumber("Mesh.MeshSizeFromCurvature", max(spec.curvature, rung.curvature))
        gmsh.option.setNumber("Mesh.MeshSizeMin", LEAST_OF_PATCH * spec.patch_size / unit)
        name_groups(gmsh, tags, regions)
        generate(gmsh, spec, unit)
        results.append(tags)

    rungs = LADDER if isinstance(geometry, CadPart) else LADDER[:1]
    notes = climb(rungs, attempt, lambda: where_it_failed(gmsh, unit))
    if job["msh"]:
        write_msh(gmsh, job["msh"], unit)
    cad = {"volume": volume_of(gmsh.model, unit)} | {
        name: area_of(gmsh.model, faces, unit) for name, faces in results[0].items()
    }
    sizes = {f"cad:{name}": np.float64(value) for name, value in cad.items()}
    return arrays(gmsh, unit) | sizes | {"notes": np.array(notes, dtype=str)}


def read(gmsh: Any, job: dict[str, Any]) -> dict[str, Any]:
    """Task "read": a mesh file -> arrays."""
    stage("reading the mesh", 0.0)
    gmsh.open(job["path"])
    return arrays(gmsh, job["unit"])


def export(gmsh: Any, job: dict[str, Any]) -> dict[str, Any]:
    """Task "step": a geometry -> STEP file in millimetres, its groups painted in the given colours."""
    geometry: Geometry = decode(job["geometry"])
    stage("building the geometry", 0.0)
    build(gmsh, geometry)
    gmsh.write(job["step"])
    # The order of faces is the file's, not that of the model it came from: select again in what was written.
    gmsh.clear()
    gmsh.model.occ.importShapes(job["step"])
    gmsh.model.occ.synchronize()
    tags = patch_tags(gmsh.model, geometry.patches, MILLIMETRE)
    colours = {tag: job["colours"][name] for name, faces in tags.items() if name in job["colours"] for tag in faces}
    path = Path(job["step"])
    path.write_text(paint(path.read_text(encoding="ascii"), colours), encoding="ascii")
    return {}


def section(gmsh: Any, job: dict[str, Any]) -> dict[str, Any]:
    """Task "section": the half section of a solid of revolution -> plane arrays."""
    geometry: Revolved = decode(job["geometry"])
    spec = MeshSpec(**job["spec"])
    unit = model_unit(geometry)
    stage("building the section", 0.0)
    lines = revolved.section(geometry, gmsh.model.occ)
    gmsh.model.occ.synchronize()
    stage("meshing the section", 0.3)
    mesh_section(gmsh, spec, lines["contact"], unit)
    return plane_arrays(gmsh, spec, lines, {}, unit)


def plan(gmsh: Any, job: dict[str, Any]) -> dict[str, Any]:
    """Task "plan": the plan of an extruded solid, or of one of its sectors -> plane arrays and areas of the CAD."""
    geometry: Extruded = decode(job["geometry"])
    spec = MeshSpec(**job["spec"])
    unit = model_unit(geometry)
    recipe = family_of(geometry).plan
    assert recipe is not None
    stage("building the plan", 0.0)
    occ = gmsh.model.occ
    areas = recipe(geometry, occ)
    if job["sectors"] > 1:
        whole = [tag for _, tag in occ.getEntities(2)]
        pieces = dict(zip(whole, cut(occ, 2, job["sectors"]), strict=True))
        areas = {name: [piece for tag in tags for _, piece in pieces[tag]] for name, tags in areas.items()}
        areas = {name: tags for name, tags in areas.items() if tags}
    occ.synchronize()
    struck = {name for names in geometry.plan.top.values() for name in names}
    faces = [(2, tag) for name, tags in areas.items() if name in struck for tag in tags]
    edges = gmsh.model.getBoundary(faces, combined=False, oriented=False)
    stage("meshing the plan", 0.3)
    mesh_section(gmsh, spec, sorted({tag for _, tag in edges}), unit)
    cad = {name: area_of(gmsh.model, tags, unit) for name, tags in areas.items()}
    cad[EVERYWHERE] = area_of(gmsh.model, [tag for _, tag in gmsh.model.getEntities(2)], unit)
    sizes = {f"cad:{name}": np.float64(value) for name, value in cad.items()}
    return plane_arrays(gmsh, spec, {}, areas, unit) | sizes


TASKS: dict[str, Callable[[Any, dict[str, Any]], dict[str, Any]]] = {
    "mesh": make,
    "plan": plan,
    "read": read,
    "section": section,
    "step": export,
}


def import_gmsh() -> Any:
    """The gmsh module; on a bare system its shared libraries are missing, which is an OSError."""
    try:
        import gmsh
    except OSError as error:
        raise RuntimeError(f"gmsh cannot load a system library ({error}); mend it with: {APT_LINE}") from error
    except ImportError as error:
        raise RuntimeError(f"gmsh is not installed ({error}); mend it with: pip install gmsh") from error
    return gmsh


def run(job: dict[str, Any]) -> None:
    gmsh = import_gmsh()
    gmsh.initialize([], readConfigFiles=False, interruptible=False)
    for option, value in OPTIONS.items():
        gmsh.option.setNumber(option, value)
    result = TASKS[job["task"]](gmsh, job)
    np.savez(job["arrays"], gmsh_version=np.array(gmsh.__version__), **result)
    stage("reading gmsh's arrays", 0.95)
    gmsh.finalize()


def main(job_path: str) -> int:
    try:
        run(json.loads(Path(job_path).read_text(encoding="utf-8")))
    except GeometryError as error:
        send(error=str(error), kind="geometry")
    except Exception as error:
        send(error=str(error), kind="gmsh")
    else:
        return 0
    return 1


if __name__ == "__main__":
    # Messages keep the pipe to themselves: OpenCASCADE prints to descriptor 1, which now leads to the log.
    sys.stdout = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    sys.exit(main(sys.argv[1]))
