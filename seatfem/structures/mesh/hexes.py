"""Meshes of hexahedra: revolved half sections and extruded plans."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impact.progress import Progress, silent
from seatfem.structures.mesh.gmsh_process import Gmsh, run_gmsh
from seatfem.structures.mesh.io import MeshArrays, groups
from seatfem.structures.mesh.plan_grid import cut_lines, graded, rectangle_plan
from seatfem.structures.mesh.spec import LEAST_LAYERS, MeshSpec
from seatfem.structures.mesh.swept import extrude, revolve
from seatfem.structures.shapes import Geometry, GeometryError, Profile, encode
from seatfem.structures.shapes.shape import EVERYWHERE, Plan


@dataclass(frozen=True, eq=False)
class Hexes:
    """Arrays of a mesh of hexahedra; ``cad_volume`` and ``cad_areas`` of the part are exact."""

    arrays: MeshArrays
    gmsh_version: str
    cad_volume: float | None
    cad_areas: Mapping[str, float]


def make_hexes(
    geometry: Geometry, spec: MeshSpec, sectors: int, progress: Progress = silent, gmsh: Gmsh = run_gmsh
) -> Hexes:
    """Return the hexahedra of a solid of revolution or of an extruded one, or of one of its equal sectors.

    Raises `GeometryError` for a geometry that is neither.
    """
    if geometry.plan is not None:
        return _extruded(geometry, geometry.plan, spec, sectors, progress, gmsh)
    if geometry.profile is not None:
        return _revolved(geometry, geometry.profile, spec, sectors, progress, gmsh)
    what = "a CAD part is" if geometry.is_imported else "what is neither turned nor extruded is"
    raise GeometryError(f"{geometry.source}: {what} meshed by tetrahedra; set shape = 'tet'")


def _revolved(
    geometry: Geometry, profile: Profile, spec: MeshSpec, sectors: int, progress: Progress, gmsh: Gmsh
) -> Hexes:
    job = {"task": "section", "geometry": encode(geometry), "spec": asdict(spec)}
    section = gmsh(job, progress)
    around = spec.layers or max(LEAST_LAYERS, math.ceil(2 * math.pi * profile.outer_radius / spec.size))
    layers = math.ceil(around / sectors)
    arrays = revolve(section, layers, sectors, spec.curved, type(geometry).__name__)
    areas = {name: profile.area(name) / sectors for name in profile.names}
    return Hexes(arrays, str(section["gmsh_version"]), profile.volume / sectors, areas)


def _extruded(geometry: Geometry, plan: Plan, spec: MeshSpec, sectors: int, progress: Progress, gmsh: Gmsh) -> Hexes:
    plane, version, cad = _plane(geometry, spec, sectors, progress, gmsh)
    if sectors > 1:
        plane = cut_lines(plane, sectors)
    fractions = (
        np.linspace(0.0, 1.0, spec.layers + 1)
        if spec.layers
        else 1.0 - graded(plan.height, spec.patch_size, spec.size, spec.grading)[::-1] / plan.height
    )
    arrays = extrude(plane, plan, fractions, geometry.dome, type(geometry).__name__)
    areas = {
        name: sum(cad[area] for area in names if area in cad)
        for groups in (plan.top, plan.bottom)
        for name, names in groups.items()
        if any(area in cad for area in names)
    }
    if (profile := geometry.profile) is not None:
        volume = profile.volume / sectors
        areas = {name: profile.area(name) / sectors for name in areas}
    else:
        volume = cad[EVERYWHERE] * plan.height
    return Hexes(arrays, version, volume, areas)


def _plane(
    geometry: Geometry, spec: MeshSpec, sectors: int, progress: Progress, gmsh: Gmsh
) -> tuple[dict[str, NDArray[Any]], str, dict[str, float]]:
    """Return plane arrays of the plan, the version of gmsh ("" where it was not needed), and exact areas by name."""
    if (rectangle := geometry.rectangle) is not None:
        cad = {EVERYWHERE: 4 * math.prod(rectangle.sides) / sectors}
        if rectangle.patch is not None:
            cad["patch"] = 4 * math.prod(rectangle.patch) / sectors
        return rectangle_plan(rectangle, spec, sectors), "", cad
    job = {"task": "plan", "geometry": encode(geometry), "spec": asdict(spec), "sectors": sectors}
    plane = gmsh(job, progress)
    cad = {name: float(value) for name, value in groups(plane, "cad").items()}
    return plane, str(plane["gmsh_version"]), cad
