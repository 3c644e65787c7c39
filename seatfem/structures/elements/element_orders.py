"""How other programs number the nodes and faces of an element.

Abaqus, Nastran and VTK agree on the vertices; they differ in the nodes on edges and faces.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

import numpy as np

from seatfem.structures.mesh.cell_kinds import HEX_EDGES, HEX_FACES, TET_EDGES, Integers

Groups = tuple[tuple[int, ...], ...]

TET_RING: Groups = ((0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3))
BOTTOM: Groups = ((0, 1), (1, 2), (2, 3), (3, 0))
TOP: Groups = ((4, 5), (5, 6), (6, 7), (7, 4))
UPRIGHT: Groups = ((0, 4), (1, 5), (2, 6), (3, 7))
CENTRE: Groups = (tuple(range(8)),)
ABAQUS_HEX_FACES: Groups = ((0, 1, 2, 3), (4, 7, 6, 5), (0, 4, 5, 1), (1, 5, 6, 2), (2, 6, 7, 3), (3, 7, 4, 0))
ABAQUS_TET_FACES: Groups = ((0, 1, 2), (0, 3, 1), (1, 3, 2), (2, 3, 0))
VTK_HEX_FACES: Groups = ((0, 3, 7, 4), (1, 2, 6, 5), (0, 1, 5, 4), (3, 2, 6, 7), (0, 1, 2, 3), (4, 5, 6, 7))

# Nodes after the vertices, each by the vertices it lies between.
GMSH: Mapping[int, Groups] = MappingProxyType(
    {4: (), 8: (), 10: TET_EDGES, 20: HEX_EDGES, 27: HEX_EDGES + HEX_FACES + CENTRE}
)
ABAQUS: Mapping[int, Groups] = MappingProxyType(
    {
        4: (),
        8: (),
        10: TET_RING,
        20: BOTTOM + TOP + UPRIGHT,
        27: BOTTOM + TOP + UPRIGHT + CENTRE + ABAQUS_HEX_FACES,
    }
)
NASTRAN: Mapping[int, Groups] = MappingProxyType({4: (), 8: (), 10: TET_RING, 20: BOTTOM + UPRIGHT + TOP})
VTK: Mapping[int, Groups] = MappingProxyType(
    {4: (), 8: (), 10: TET_RING, 20: BOTTOM + TOP + UPRIGHT, 27: BOTTOM + TOP + UPRIGHT + VTK_HEX_FACES + CENTRE}
)


def to_gmsh(cells: Integers, order: Mapping[int, Groups]) -> Integers:
    """Columns of ``cells`` (m, k) from another program's order into gmsh's."""
    nodes = cells.shape[1]
    corners = 4 if nodes in (4, 10) else 8
    there = {frozenset(group): corners + k for k, group in enumerate(order[nodes])}
    columns = [*range(corners), *(there[frozenset(group)] for group in GMSH[nodes])]
    return np.ascontiguousarray(cells[:, columns])
