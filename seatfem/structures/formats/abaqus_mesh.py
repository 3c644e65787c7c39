"""Meshes in Abaqus input files (.inp)."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from seatfem.structures.elements.element_orders import ABAQUS, ABAQUS_HEX_FACES, ABAQUS_TET_FACES, to_gmsh
from seatfem.structures.formats.abaqus_deck import Block, Sets, read_blocks
from seatfem.structures.formats.file_mesh import FileMesh, face_width, free_face_mask, one_kind, rows_of, stacked
from seatfem.structures.mesh.cell_kinds import Floats, Integers
from seatfem.structures.mesh.io import MeshError

SOLID = re.compile(r"[DAQ]?C3D(4|8|10|20|27)[A-Z]*$")
OTHER_SOLID = re.compile(r"[DAQ]?C3D|COH3D|CSS|SC\d|CCL")
SKIN = re.compile(r"(?:S|DS|STRI|SFM3D|M3D|R3D|CPS|CPE)(3|4|6|8|9)5?[A-Z]*\d?$")


@dataclass(frozen=True, eq=False)
class Elements:
    """Numbers and nodes of the elements of one type."""

    type: str
    ids: Integers
    nodes: Integers


@dataclass(frozen=True, eq=False)
class Found:
    """What the deck defines, in its own numbers."""

    node_ids: Integers
    points: Floats
    solids: list[Elements]
    skins: list[Elements]
    node_sets: Sets
    element_sets: Sets
    surfaces: list[Block]


def read_abaqus(path: Path) -> FileMesh:
    """*NODE, *ELEMENT, *NSET, *ELSET and *SURFACE of an input file, flat or with one part and one instance.

    Solids C3D4, C3D10, C3D8, C3D20, C3D27 with any ending. Surfaces are those of *SURFACE (faces S1.. of elements, or
    TYPE=NODE), element sets of skin elements (S3, S4R, M3D4, ...), and node sets. Element sets of solids are volumes;
    sets that Abaqus/CAE marks internal are left out. Raises `MeshError` naming file and line.
    """
    found = _collect(path)
    source = str(path)
    one_kind(_by_type(found), source)
    width = found.solids[0].nodes.shape[1]
    nodes = stacked([solid.nodes for solid in found.solids], width)
    cells = to_gmsh(rows_of(found.node_ids, nodes, "node", source), ABAQUS)
    ids = np.concatenate([solid.ids for solid in found.solids])
    if len(np.unique(ids)) < len(ids):
        raise MeshError(f"{source}: an element number is used twice")
    skin = _skins(found, cells, source)
    volumes = {name: np.flatnonzero(np.isin(ids, members)) for name, members in found.element_sets.named().items()}
    surfaces = {name: faces for name, members in found.element_sets.named().items() if len(faces := _of(skin, members))}
    node_sets = {
        name: rows_of(found.node_ids, members, "node", source) for name, members in found.node_sets.named().items()
    }
    for block in found.surfaces:
        name = block.options.get("NAME", "")
        if block.options.get("TYPE", "ELEMENT").upper() == "NODE":
            numbers = [found.node_sets.get(row[0], block) for row in block.rows]
            node_sets[name] = rows_of(found.node_ids, np.concatenate(numbers), "node", source)
        else:
            surfaces[name] = stacked(list(_surface(block, found, ids, cells, skin)), face_width(cells))
    filled = {name: rows for name, rows in volumes.items() if len(rows)}
    return FileMesh(found.points, cells, surfaces, filled, node_sets)


def _collect(path: Path) -> Found:
    ids: list[Integers] = [np.empty(0, dtype=np.int64)]
    points: list[Floats] = [np.empty((0, 3))]
    solids: list[Elements] = []
    skins: list[Elements] = []
    node_sets, element_sets = Sets("NSET"), Sets("ELSET")
    surfaces: list[Block] = []
    for block in read_blocks(path):
        match block.keyword:
            case "NODE":
                numbers, places = _nodes(block)
                ids.append(numbers)
                points.append(places)
                if "NSET" in block.options:
                    node_sets.add(block.options["NSET"], numbers)
            case "ELEMENT":
                elements = _elements(block)
                if elements is not None:
                    (skins if SKIN.match(elements.type) else solids).append(elements)
                    if "ELSET" in block.options:
                        element_sets.add(block.options["ELSET"], elements.ids)
            case "NSET" if "ELSET" not in block.options:
                node_sets.add_block(block)
            case "NSET":
                raise block.fail("ELSET=: not supported; list the nodes")
            case "ELSET":
                element_sets.add_block(block)
            case "SURFACE":
                surfaces.append(block)
            case _:
                pass
    return Found(np.concatenate(ids), np.concatenate(points), solids, skins, node_sets, element_sets, surfaces)


def _nodes(block: Block) -> tuple[Integers, Floats]:
    if block.options.get("SYSTEM", "R").upper() != "R":
        raise block.fail(f"SYSTEM={block.options['SYSTEM']}: must be rectangular")
    try:
        rows = [[float(word or 0.0) for word in (*row[:4], "", "", "")[:4]] for row in block.rows]
    except ValueError as error:
        raise block.fail(f"number, x, y, z expected ({error})") from None
    table = np.array(rows, dtype=float).reshape(-1, 4)
    return table[:, 0].astype(np.int64), table[:, 1:]


def _elements(block: Block) -> Elements | None:
    """None for elements that are neither solids nor skins: beams, springs, masses."""
    kind = block.options.get("TYPE", "").upper()
    match = SOLID.match(kind) or SKIN.match(kind)
    if not match:
        if OTHER_SOLID.match(kind):
            first = np.array([int(row[0]) for row in block.rows if row[0].isdecimal()], dtype=np.int64)
            return Elements(kind, first, np.empty((len(block.rows), 0), dtype=np.int64))
        return None
    width = 1 + (6 if kind.startswith("STRI65") else int(match.group(1)))
    numbers = block.integers()
    if len(numbers) % width:
        raise block.fail(f"TYPE={kind}: {len(numbers)} numbers are no multiple of {width} (number and nodes)")
    table = numbers.reshape(-1, width)
    return Elements(kind, table[:, 0], table[:, 1:])


def _by_type(found: Found) -> dict[str, tuple[int, Integers | None]]:
    types: dict[str, tuple[int, Integers | None]] = {}
    for solid in found.solids:
        count = types.get(solid.type, (0, None))[0] + len(solid.ids)
        types[solid.type] = (count, solid.nodes if solid.nodes.shape[1] else None)
    return types


def _skins(found: Found, cells: Integers, source: str) -> tuple[Integers, Integers]:
    """Numbers and vertices (rows of points) of the skin elements whose faces have as many vertices as the solids'."""
    width = face_width(cells)
    corners = {3: 3, 6: 3, 4: 4, 8: 4, 9: 4}
    fitting = [skin for skin in found.skins if corners[skin.nodes.shape[1]] == width]
    ids = np.concatenate([np.empty(0, dtype=np.int64), *(skin.ids for skin in fitting)])
    nodes = stacked([skin.nodes[:, :width] for skin in fitting], width)
    return ids, rows_of(found.node_ids, nodes, "node", source)


def _of(skin: tuple[Integers, Integers], members: Integers) -> Integers:
    return skin[1][np.isin(skin[0], members)]


def _surface(
    block: Block, found: Found, ids: Integers, cells: Integers, skin: tuple[Integers, Integers]
) -> Iterator[Integers]:
    """Faces of the lines of *SURFACE, TYPE=ELEMENT: a set or an element, and which of its faces."""
    faces = np.array(ABAQUS_TET_FACES if face_width(cells) == 3 else ABAQUS_HEX_FACES)
    by_side: dict[str, list[Integers]] = {}
    for row in block.rows:
        side = row[1].upper() if len(row) > 1 else ""
        if side not in ("SPOS", "SNEG", "") and not (re.fullmatch(r"S[1-9]", side) and 1 <= int(side[1]) <= len(faces)):
            raise block.fail(f"{', '.join(row)}: the face must be S1 to S{len(faces)}, SPOS or SNEG")
        members = found.element_sets.get(row[0], block)
        found.element_sets.used(len(members), block)
        by_side.setdefault(side, []).append(members)
    for side, parts in by_side.items():
        members = np.concatenate(parts)
        rows = np.flatnonzero(np.isin(ids, members))
        if side in ("SPOS", "SNEG"):
            yield _of(skin, members)
        elif side == "":
            mask = free_face_mask(cells, faces)
            yield cells[:, faces][rows][mask[rows]]
            yield _of(skin, members)
        else:
            yield cells[rows][:, faces[int(side[1]) - 1]]
