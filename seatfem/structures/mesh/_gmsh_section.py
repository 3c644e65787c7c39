"""Plane meshes of triangles or quadrilaterals: half sections and plans; used in the gmsh process only."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from seatfem.structures.mesh._gmsh_sizes import set_sizes
from seatfem.structures.mesh.flat_corners import corner_angles, without_flat_corners
from seatfem.structures.mesh.spec import MeshSpec

TRIANGLES = {1: 2, 2: 9}  # gmsh's element types by order
QUADRILATERALS = {1: 3, 2: 10}
FRONTAL_FOR_QUADS = 8
BLOSSOM = 1
ALL_QUADRILATERALS = 1
PASSES = 4
HALVING = 2.0  # quadrilaterals come from elements twice as large, each cut into three or four


def mesh_section(gmsh: Any, spec: MeshSpec, refined: list[int], unit: float) -> None:
    """Mesh the model's surfaces as ``spec`` says, finest at the curves ``refined``."""
    option, mesh = gmsh.option.setNumber, gmsh.model.mesh
    quadrilaterals = spec.shape == "hex"
    option("Mesh.SecondOrderLinear", 0)
    if quadrilaterals:
        option("Mesh.Algorithm", FRONTAL_FOR_QUADS)
        option("Mesh.RecombineAll", 1)
        option("Mesh.RecombinationAlgorithm", BLOSSOM)
    arcs = [tag for _, tag in gmsh.model.getEntities(1) if gmsh.model.getType(1, tag) == "Circle"]
    set_sizes(gmsh, spec, [], refined, (HALVING if quadrilaterals else 1.0) / unit, arcs)
    mesh.generate(2)
    mend_flat_corners(gmsh)
    if quadrilaterals:
        option("Mesh.SubdivisionAlgorithm", ALL_QUADRILATERALS)
        mesh.refine()
    option("Mesh.SecondOrderLinear", 0 if spec.curved else 1)
    mesh.setOrder(spec.order)


def mend_flat_corners(gmsh: Any) -> None:
    """On the mesh of order 1, in a few passes: what replaces one flat corner may have another."""
    for _ in range(PASSES):
        if not _mend(gmsh):
            return


def _mend(gmsh: Any) -> bool:
    """One pass; whether anything was changed. The angles are those of order 2, which gmsh numbers anew."""
    mesh = gmsh.model.mesh
    surfaces = [tag for _, tag in gmsh.model.getEntities(2)]
    mesh.setOrder(2)
    points = _points(mesh)
    angles = [_angles(mesh, tag, points) for tag in surfaces]
    mesh.setOrder(1)
    points = _points(mesh)
    changed = False
    for tag, turned in zip(surfaces, angles, strict=True):
        elements, cells = [], []
        for kind, width in ((TRIANGLES[1], 3), (QUADRILATERALS[1], 4)):
            numbers, rows = _cells(mesh, kind, tag, width)
            elements += numbers.tolist()
            cells += [tuple(row) for row in rows.tolist()]
        removed, added = without_flat_corners(points, dict(zip(cells, turned, strict=True)))
        if removed:
            changed = True
            number = dict(zip(cells, elements, strict=True))
            mesh.removeElements(2, tag, [number[cell] for cell in removed])
            mesh.addElementsByType(tag, TRIANGLES[1], [], [node for cell in added for node in cell])
    return changed


def _points(mesh: Any) -> NDArray[np.float64]:
    tags, coordinates, _ = mesh.getNodes()
    points = np.zeros((int(tags.max()) + 1, 2))
    points[tags.astype(np.int64)] = coordinates.reshape(-1, 3)[:, :2]
    return points


def _angles(mesh: Any, tag: int, points: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """At the corners of each triangle, then of each quadrilateral, of a surface."""
    kinds = ((TRIANGLES[2], 6), (QUADRILATERALS[2], 9))
    return [row for kind, width in kinds for row in corner_angles(points, _cells(mesh, kind, tag, width)[1])]


def _cells(mesh: Any, kind: int, tag: int, width: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    elements, nodes = mesh.getElementsByType(kind, tag)
    return elements.astype(np.int64), nodes.reshape(-1, width).astype(np.int64)


def plane_arrays(
    gmsh: Any, spec: MeshSpec, lines: dict[str, list[int]], areas: dict[str, list[int]], unit: float
) -> dict[str, NDArray[Any]]:
    """The plane mesh in metres: "points" (n, 2), "cells" (m, 3 | 4 | 6 | 9), "line:NAME" (k, 2), "area:NAME" (k,)."""
    mesh = gmsh.model.mesh
    tags, coordinates, _ = mesh.getNodes()
    index = np.full(int(tags.max()) + 1, -1, dtype=np.int64)
    index[tags.astype(np.int64)] = np.arange(len(tags))
    kind = (QUADRILATERALS if spec.shape == "hex" else TRIANGLES)[spec.order]
    width = mesh.getElementProperties(kind)[3]
    elements, cells = _cells(mesh, kind, -1, width)
    row = {int(element): k for k, element in enumerate(elements)}
    out: dict[str, NDArray[Any]] = {"points": unit * coordinates.reshape(-1, 3)[:, :2], "cells": index[cells]}
    for name, curves in lines.items():
        ends = [_cells(mesh, {1: 1, 2: 8}[spec.order], tag, spec.order + 1)[1][:, :2] for tag in curves]
        out[f"line:{name}"] = index[np.concatenate(ends)]
    for name, surfaces in areas.items():
        members = [int(element) for tag in surfaces for element in _cells(mesh, kind, tag, width)[0]]
        out[f"area:{name}"] = np.array([row[element] for element in members], dtype=np.int64)
    return out
