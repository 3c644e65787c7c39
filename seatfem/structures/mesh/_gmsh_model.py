"""The geometry in gmsh's model, kept for the next job's elements; used in the gmsh process only."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final, TypeVar

Tags = TypeVar("Tags")

GEOMETRY: Final = ("task", "geometry", "sectors")  # what of a job decides the geometry
UNKNOWN: Final = "unknown"


@dataclass
class KeptModel:
    """What gmsh's model holds: ``key`` of the geometry, "" of none; ``tags``: what its recipe returned."""

    key: str = ""
    tags: Any = None

    def forget(self) -> None:
        """Build anew at the next occasion."""
        self.key = UNKNOWN

    def built(self, gmsh: Any, job: Mapping[str, Any], build: Callable[[], Tags], heal: bool = False) -> Tags:
        """The tags of the job's geometry: by ``build``, or of the model as it is, where the job before was of the same.

        A model that serves again has lost its mesh and size fields.
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
