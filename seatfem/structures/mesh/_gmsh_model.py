"""The geometry in gmsh's model, kept for the next job's elements, and their sizes; used in the gmsh process only."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final, TypeVar

from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.shapes.profile import PER_ARC

Tags = TypeVar("Tags")

GEOMETRY: Final = ("task", "geometry", "sectors")  # what of a job decides the geometry
UNKNOWN: Final = "unknown"
SAMPLES_PER_CURVE = 200
GROWTH_FROM_ARC = 1.0  # of the size per unit distance


@dataclass
class KeptModel:
    """The content of gmsh's model: ``key`` of the geometry, "" of none; ``tags``: what its recipe returned."""

    key: str = ""
    tags: Any = None

    def forget(self) -> None:
        """Build anew at the next occasion."""
        self.key = UNKNOWN

    def built(self, gmsh: Any, job: Mapping[str, Any], build: Callable[[], Tags], heal: bool = False) -> Tags:
        """Return the tags of the job's geometry: by ``build``, or of the model as it is, where the job before was of
        the same.

        A model that is used again has lost its mesh and size fields.
        """
        rings = job.get("spec", {}).get("rings")  # corners of a half section
        key = json.dumps([heal, rings, *(job.get(name) for name in GEOMETRY)], sort_keys=True)
        if key == self.key:
            gmsh.model.mesh.clear()
            for field in gmsh.model.mesh.field.list():
                gmsh.model.mesh.field.remove(field)
            tags: Tags = self.tags
            return tags
        if self.key:
            gmsh.clear()
        self.forget()
        self.tags = build()
        self.key = key
        return self.tags  # type: ignore[no-any-return]


def set_sizes(
    gmsh: Any,
    spec: MeshSpec,
    surfaces: list[int],
    curves: list[int],
    scale: float,
    arcs: Mapping[int, int] | None = None,
) -> None:
    """Set the background size: constant near the contact patch, then growing linearly to the bulk's.

    ``surfaces``, ``curves``: of the patch and its outline. ``scale``: model units per metre. ``arcs``: curves with
    so many elements along them at least.
    """
    near, far = scale * spec.patch_size, scale * spec.size
    fields = [_growing(gmsh, surfaces, curves, near, far, spec.grading, start=near)]
    for arc, elements in (arcs or {}).items():
        if (size := gmsh.model.occ.getMass(1, arc) / max(PER_ARC, spec.fillets * elements)) < far:
            fields.append(_growing(gmsh, [], [arc], size, far, GROWTH_FROM_ARC, start=0.0))
    least = gmsh.model.mesh.field.add("Min")
    gmsh.model.mesh.field.setNumbers(least, "FieldsList", fields)
    gmsh.model.mesh.field.setAsBackgroundMesh(least)


def _growing(
    gmsh: Any, surfaces: list[int], curves: list[int], near: float, far: float, growth: float, *, start: float
) -> int:
    """Return the size ``near`` up to the distance ``start``, then growing to ``far``."""
    field = gmsh.model.mesh.field
    distance = field.add("Distance")
    field.setNumbers(distance, "SurfacesList", surfaces)
    field.setNumbers(distance, "CurvesList", curves)
    field.setNumber(distance, "Sampling", SAMPLES_PER_CURVE)
    threshold = field.add("Threshold")
    field.setNumber(threshold, "InField", distance)
    field.setNumber(threshold, "SizeMin", near)
    field.setNumber(threshold, "SizeMax", far)
    field.setNumber(threshold, "DistMin", start)
    field.setNumber(threshold, "DistMax", max(near + (far - near) / growth, start + 1e-3 * near))
    return int(threshold)
