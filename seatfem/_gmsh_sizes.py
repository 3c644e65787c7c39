"""Element sizes in gmsh's model; used in the gmsh process only."""

from __future__ import annotations

from typing import Any

from seatfem.mesh_spec import MeshSpec

SAMPLES_PER_CURVE = 200


def set_sizes(gmsh: Any, spec: MeshSpec, surfaces: list[int], curves: list[int], scale: float) -> None:
    """Background size: constant near the contact patch, then growing linearly to the bulk's.

    ``surfaces``, ``curves``: of the patch and its outline. ``scale``: model units per metre.
    """
    field = gmsh.model.mesh.field
    near, far = scale * spec.patch_size, scale * (spec.patch_size + spec.transition)
    distance = field.add("Distance")
    field.setNumbers(distance, "SurfacesList", surfaces)
    field.setNumbers(distance, "CurvesList", curves)
    field.setNumber(distance, "Sampling", SAMPLES_PER_CURVE)
    threshold = field.add("Threshold")
    field.setNumber(threshold, "InField", distance)
    field.setNumber(threshold, "SizeMin", near)
    field.setNumber(threshold, "SizeMax", scale * spec.size)
    field.setNumber(threshold, "DistMin", near)
    field.setNumber(threshold, "DistMax", max(far, 1.001 * near))
    field.setAsBackgroundMesh(threshold)
