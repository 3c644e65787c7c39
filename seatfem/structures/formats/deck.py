"""What decks of other programs have in common: nodes, elements and groups under the file's own numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from seatfem.structures.formats.file_mesh import FileMesh, Groups, face_width, one_kind, stacked, to_gmsh
from seatfem.structures.mesh.cell_kinds import Floats, Integers
from seatfem.structures.mesh.io import MeshError


@dataclass(frozen=True, eq=False)
class Elements:
    """Elements of one type, which the file calls so: rows of number and nodes (m, 1 + k); whether they can be used."""

    type: str
    table: Integers
    usable: bool = True

    @property
    def ids(self) -> Integers:
        return self.table[:, 0]

    @property
    def nodes(self) -> Integers:
        return self.table[:, 1:]


@dataclass(frozen=True, eq=False)
class Deck:
    """A mesh in the file's own numbers.

    ``solids``: their nodes in the order ``order`` of `element_orders`; ``skins``: triangles and quadrilaterals, their
    vertices alone; ``element_sets``, ``node_sets``: name -> numbers. ``what``: the file's word for a node.
    """

    source: str
    order: Mapping[int, Groups]
    node_ids: Integers
    points: Floats
    solids: Sequence[Elements]
    skins: Sequence[Elements]
    element_sets: Mapping[str, Integers]
    node_sets: Mapping[str, Integers]
    what: str = "node"

    def rows(self, wanted: Integers) -> Integers:
        """Rows of ``points`` of node numbers; `MeshError` for numbers that are not there."""
        if len(self.node_ids) == 0:
            raise MeshError(f"{self.source}: no {self.what}s")
        order = np.argsort(self.node_ids, kind="stable")
        at = np.minimum(np.searchsorted(self.node_ids, wanted, sorter=order), len(self.node_ids) - 1)
        rows = order[at]
        missing = np.unique(wanted[self.node_ids[rows] != wanted])
        if len(missing):
            raise MeshError(
                f"{self.source}: {self.what} {missing[0]} is used and not defined ({len(missing)} such {self.what}s)"
            )
        return np.asarray(rows)


@dataclass(frozen=True, eq=False)
class Assembled:
    """``mesh``; the numbers of its cells; numbers and faces (rows of its points) of the skins that fit its cells."""

    mesh: FileMesh
    ids: Integers
    skin_ids: Integers
    skin: Integers


def assembled(deck: Deck) -> Assembled:
    """The deck by rows: a set's solids are a volume, its skins a surface, its nodes a node set.

    Raises `MeshError`: solids that are not of one kind, nodes that are used and not defined.
    """
    counts: dict[str, tuple[int, Integers | None]] = {}
    for each in deck.solids:
        count = counts.get(each.type, (0, None))[0] + len(each.table)
        counts[each.type] = (count, each.nodes if each.usable else None)
    one_kind(counts, deck.source)
    cells = to_gmsh(deck.rows(np.concatenate([each.nodes for each in deck.solids])), deck.order)
    ids, width = np.concatenate([each.ids for each in deck.solids]), face_width(cells)
    skins = stacked([each.table for each in deck.skins if each.nodes.shape[1] == width], 1 + width)
    skin_ids, skin = skins[:, 0], deck.rows(skins[:, 1:])
    volumes = {name: np.flatnonzero(np.isin(ids, members)) for name, members in deck.element_sets.items()}
    surfaces = {name: skin[np.isin(skin_ids, members)] for name, members in deck.element_sets.items()}
    mesh = FileMesh(
        deck.points,
        cells,
        {name: faces for name, faces in surfaces.items() if len(faces)},
        {name: rows for name, rows in volumes.items() if len(rows)},
        {name: deck.rows(numbers) for name, numbers in deck.node_sets.items()},
    )
    return Assembled(mesh, ids, skin_ids, skin)
