"""The gmsh process, started by `seatfem.structures.mesh.gmsh_process` only.

Jobs come as JSON lines on standard input; the process ends when that is closed. Progress and failure are reported as
JSON lines on standard output. Lengths inside gmsh are in the unit of the geometry (millimetres), those exchanged with
the parent in metres.
"""

import json
import os
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from seatfem.jobs.worker import lines_from_parent
from seatfem.machine.libraries import GMSH_LIBRARIES, apt_command, missing_packages
from seatfem.structures.mesh._gmsh_base import KeptModel, arrays, handed_over, send, stage
from seatfem.structures.mesh._gmsh_inspect import inspect, outline
from seatfem.structures.mesh._gmsh_section import mesh_section, plane_arrays
from seatfem.structures.mesh._gmsh_solid import make
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.shapes import Geometry, GeometryError, Turning, decode, revolved
from seatfem.structures.shapes.inspect import area_of
from seatfem.structures.shapes.profile import PER_ARC
from seatfem.structures.shapes.shape import EVERYWHERE, cut

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
    mesh_section(gmsh, spec, drawing.groups["contact"], drawing.arcs, unit)
    return plane_arrays(gmsh, spec, drawing.groups, {}, unit)


def plan(gmsh: Any, job: dict[str, Any], model: KeptModel) -> dict[str, Any]:
    """Carry out task "plan": plan of an extruded solid or a sector of it -> plane arrays and exact areas."""
    geometry: Geometry = decode(job["geometry"])
    spec = MeshSpec(**job["spec"])
    unit = geometry.unit_of_model
    stage("building the plan", 0.0)
    areas = model.built(gmsh, job, lambda: _plan_areas(gmsh, geometry, job["sectors"]))
    assert geometry.plan is not None
    struck = {name for names in geometry.plan.top.values() for name in names}
    faces = [(2, tag) for name, tags in areas.items() if name in struck for tag in tags]
    edges = gmsh.model.getBoundary(faces, combined=False, oriented=False)
    stage("meshing the plan", 0.3)
    arcs = {tag: PER_ARC for _, tag in gmsh.model.getEntities(1) if gmsh.model.getType(1, tag) == "Circle"}
    mesh_section(gmsh, spec, sorted({tag for _, tag in edges}), arcs, unit)
    cad = {name: area_of(gmsh.model, tags, unit) for name, tags in areas.items()}
    cad[EVERYWHERE] = area_of(gmsh.model, [tag for _, tag in gmsh.model.getEntities(2)], unit)
    sizes = {f"cad:{name}": np.float64(value) for name, value in cad.items()}
    return plane_arrays(gmsh, spec, {}, areas, unit) | sizes


def _plan_areas(gmsh: Any, geometry: Geometry, sectors: int) -> dict[str, list[int]]:
    occ = gmsh.model.occ
    areas = geometry.areas(occ)
    if sectors > 1:
        whole = [tag for _, tag in occ.getEntities(2)]
        pieces = dict(zip(whole, cut(occ, 2, sectors), strict=True))
        areas = {name: [piece for tag in tags for _, piece in pieces[tag]] for name, tags in areas.items()}
        areas = {name: tags for name, tags in areas.items() if tags}
    occ.synchronize()
    return areas


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
    np.savez(job["arrays"], gmsh_version=np.array(gmsh.__version__), **result)
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
    # Only messages use the pipe: OpenCASCADE prints to descriptor 1, which is redirected to the log.
    sys.stdout = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    sys.exit(main())
