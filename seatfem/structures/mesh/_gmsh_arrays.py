"""The mesh of gmsh's current model as plain arrays; used in the gmsh process only."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from seatfem.structures.shapes import GeometryError

Integers = NDArray[np.int64]

# gmsh's element types
SOLIDS = {4: "tetrahedron", 11: "tetrahedron", 5: "hexahedron", 17: "hexahedron", 12: "hexahedron"}
FACES = {"tetrahedron": (2, 9), "hexahedron": (3, 10, 16)}
CORNERS = {"tetrahedron": 3, "hexahedron": 4}


def arrays(gmsh: Any, scale: float) -> dict[str, Any]:
    """Return the points (metres), cells and named groups as plain arrays, which `mesh_io.from_gmsh` takes.

    ``scale``: metres per model unit. Keys: "points", "cells", and one "volume:NAME", "surface:NAME" or "nodes:NAME" per
    group; groups of one dimension and one name are one. Raises `GeometryError` naming what it found where the volume
    elements are not of one kind: tetrahedra or hexahedra of order 1 or 2.
    """
    mesh = gmsh.model.mesh
    tags, coordinates, _ = mesh.getNodes()
    index = rows_of(tags)
    solid = _solid_type(mesh)
    elements, nodes = mesh.getElementsByType(solid)
    row = rows_of(elements)
    out = {"points": scale * coordinates.reshape(-1, 3), "cells": index[nodes].reshape(len(elements), -1)}
    groups: dict[str, list[Integers]] = {}
    for dimension, tag in gmsh.model.getPhysicalGroups():
        name = gmsh.model.getPhysicalName(dimension, tag).strip() or f"group {tag}"  # .med pads with blanks
        entities = gmsh.model.getEntitiesForPhysicalGroup(dimension, tag)
        if dimension == 3:
            parts = [mesh.getElementsByType(solid, entity)[0] for entity in entities]
            members, kind = row[np.concatenate([[], *parts]).astype(np.int64)], "volume"
        elif dimension == 2:
            members, kind = index[_faces(mesh, SOLIDS[solid], entities)], "surface"
        elif dimension == 0:
            members, kind = index[mesh.getNodesForPhysicalGroup(0, tag)[0].astype(np.int64)], "nodes"
        else:
            continue
        groups.setdefault(f"{kind}:{name}", []).append(members)
    return out | {key: np.concatenate(parts) for key, parts in groups.items()}


def _solid_type(mesh: Any) -> int:
    present = [kind for kind in mesh.getElementTypes() if mesh.getElementProperties(kind)[1] == 3]
    if len(present) != 1 or present[0] not in SOLIDS:
        listed = ", ".join(_described(mesh, kind) for kind in present) or "none"
        raise GeometryError(
            f"volume elements must be tetrahedra or hexahedra, all of one order, 1 or 2; found: {listed}"
        )
    return int(present[0])


def _described(mesh: Any, kind: int) -> str:
    name, _, _, nodes, *_ = mesh.getElementProperties(kind)
    return f"{len(mesh.getElementsByType(kind)[0])} {name} of {nodes} nodes"


def _faces(mesh: Any, shape: str, entities: list[int]) -> Integers:
    """Return vertex tags of the faces on some entities; (f, 3) or (f, 4)."""
    corners = CORNERS[shape]
    parts = [np.empty((0, corners), dtype=np.int64)]
    for kind in FACES[shape]:
        width = mesh.getElementProperties(kind)[3]
        parts += [mesh.getElementsByType(kind, entity)[1].reshape(-1, width)[:, :corners] for entity in entities]
    return np.concatenate(parts).astype(np.int64)


def rows_of(tags: Any) -> Integers:
    """Return the row of each tag, -1 for tags that are not there."""
    index = np.full(int(tags.max(initial=0)) + 1, -1, dtype=np.int64)
    index[tags.astype(np.int64)] = np.arange(len(tags))
    return index
