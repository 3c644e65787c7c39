"""Meshes in Abaqus input files (.inp)."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from seatfem.structures.formats.abaqus_deck import Block, Sets, read_blocks
from seatfem.structures.formats.file_mesh import (
    ABAQUS,
    ABAQUS_HEX_FACES,
    ABAQUS_TET_FACES,
    Assembled,
    Deck,
    Elements,
    FileMesh,
    assembled,
    check_group_count,
    face_width,
    free_face_mask,
    stacked,
)
from seatfem.structures.mesh.cell_kinds import Floats, Integers, distinct
from seatfem.structures.mesh.io import MeshError

SOLID = re.compile(r"[DAQ]?C3D(4|8|10|20|27)[A-Z]*$")
OTHER_SOLID = re.compile(r"[DAQ]?C3D|COH3D|CSS|SC\d|CCL")
SKIN = re.compile(r"(?:S|DS|STRI|SFM3D|M3D|R3D|CPS|CPE)(3|4|6|8|9)5?[A-Z]*\d?$")


def read_abaqus(path: Path) -> FileMesh:
    """Read *NODE, *ELEMENT, *NSET, *ELSET and *SURFACE of an input file, flat or with one part and one instance.

    Solids C3D4, C3D10, C3D8, C3D20, C3D27 with any ending. Surfaces are those of *SURFACE (faces S1.. of elements, or
    TYPE=NODE), element sets of skin elements (S3, S4R, M3D4, ...), and node sets. Element sets of solids are volumes;
    sets that Abaqus/CAE marks internal are left out. Raises `MeshError` naming file and line.
    """
    deck, node_sets, element_sets, blocks = _collect(path)
    assembly = assembled(deck)
    if len(distinct(assembly.ids)) < len(assembly.ids):
        raise MeshError(f"{path}: an element number is used twice; number them anew")
    surfaces, held = dict(assembly.mesh.surfaces), dict(assembly.mesh.node_sets)
    check_group_count(len(surfaces) + len(held) + len(blocks), str(path))
    for block in blocks:
        name = block.options.get("NAME", "")
        if block.options.get("TYPE", "ELEMENT").upper() == "NODE":
            held[name] = deck.rows(np.concatenate([node_sets.members_of(row[0], block) for row in block.rows]))
        else:
            surfaces[name] = stacked(list(_surface(block, assembly, element_sets)), face_width(assembly.mesh.cells))
    return replace(assembly.mesh, surfaces=surfaces, node_sets=held)


def _collect(path: Path) -> tuple[Deck, Sets, Sets, list[Block]]:
    """Return the deck, its sets with those that are internal, and the blocks of *SURFACE."""
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
    named = element_sets.named(), node_sets.named()
    deck = Deck(str(path), ABAQUS, np.concatenate(ids), np.concatenate(points), solids, skins, *named)
    return deck, node_sets, element_sets, surfaces


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
    """Return the elements of a block, None for those that are neither solids nor skins: beams, springs, masses."""
    kind = block.options.get("TYPE", "").upper()
    solid, skin = SOLID.match(kind), SKIN.match(kind)
    match = solid or skin
    if not match:
        if OTHER_SOLID.match(kind):
            first = [[int(row[0])] for row in block.rows if row[0].isdecimal()]
            return Elements(kind, np.array(first, dtype=np.int64).reshape(-1, 1), usable=False)
        return None
    width = 6 if kind.startswith("STRI65") else int(match.group(1))
    numbers = block.integers()
    if len(numbers) % (1 + width):
        raise block.fail(f"TYPE={kind}: {len(numbers)} numbers must be a multiple of {1 + width} (number and nodes)")
    table = numbers.reshape(-1, 1 + width)
    return Elements(kind, table if solid else table[:, : 4 if width in (3, 6) else 5])


def _surface(block: Block, found: Assembled, element_sets: Sets) -> Iterator[Integers]:
    """Yield the faces of the lines of *SURFACE, TYPE=ELEMENT: a set or an element, and which of its faces."""
    cells = found.mesh.cells
    faces = np.array(ABAQUS_TET_FACES if face_width(cells) == 3 else ABAQUS_HEX_FACES)
    by_side: dict[str, list[Integers]] = {}
    for row in block.rows:
        side = row[1].upper() if len(row) > 1 else ""
        if side not in ("SPOS", "SNEG", "") and not (re.fullmatch(r"S[1-9]", side) and 1 <= int(side[1]) <= len(faces)):
            raise block.fail(f"{', '.join(row)}: the face must be S1 to S{len(faces)}, SPOS or SNEG")
        by_side.setdefault(side, []).append(element_sets.members_of(row[0], block))
    for side, parts in by_side.items():
        members = np.concatenate(parts)
        if side in ("SPOS", "SNEG", ""):
            yield found.skin[np.isin(found.skin_ids, members)]
        rows = np.flatnonzero(np.isin(found.ids, members))
        if side == "":
            mask = free_face_mask(cells, faces)
            yield cells[:, faces][rows][mask[rows]]
        elif side not in ("SPOS", "SNEG"):
            yield cells[rows][:, faces[int(side[1]) - 1]]
