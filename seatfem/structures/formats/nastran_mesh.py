"""Meshes in Nastran bulk data files (.bdf, .nas, .dat)."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from seatfem.structures.elements.element_orders import ABAQUS_HEX_FACES, ABAQUS_TET_FACES, NASTRAN, to_gmsh
from seatfem.structures.formats.file_mesh import FileMesh, face_width, one_kind, rows_of, stacked
from seatfem.structures.formats.nastran_cards import Card, read_cards
from seatfem.structures.mesh.cell_kinds import Integers

SOLIDS = {"CTETRA": (4, 10), "CHEXA": (8, 20)}
OTHER_SOLIDS = ("CPENTA", "CPYRAM", "CPYRA", "CHEX8", "CHEX20")
SKINS = {"CTRIA3": 3, "CTRIA6": 3, "CTRIAR": 3, "CQUAD4": 4, "CQUAD8": 4, "CQUADR": 4, "CQUAD": 4}

MOST_HELD = 2_000_000  # nodes of a set of SPC1


@dataclass(frozen=True, eq=False)
class Deck:
    """What the cards define, in the file's own numbers."""

    nodes: dict[int, tuple[float, float, float]] = field(default_factory=dict)
    solids: dict[int, tuple[str, int, list[int]]] = field(default_factory=dict)
    skins: list[tuple[int, list[int]]] = field(default_factory=list)
    held: defaultdict[str, list[int]] = field(default_factory=lambda: defaultdict(list))
    loads: list[tuple[str, Card]] = field(default_factory=list)


def read_nastran(path: Path) -> FileMesh:
    """GRID, CTETRA and CHEXA of bulk data; groups are called by their numbers, for the file has no names.

    Volumes: "PID 3", the solids of property 3. Surfaces: "PID 3", the shells (CTRIA3, CQUAD4, ...) of property 3;
    "PLOAD4 5", the faces loaded by set 5; "SPC 2", the faces whose vertices are all held by set 2 of SPC and SPC1.
    Raises `MeshError` naming file and line.
    """
    source = str(path)
    deck = _collect(path)
    one_kind(_by_type(deck), source)
    node_ids = np.fromiter(deck.nodes, dtype=np.int64)
    listed = np.array([nodes for _, _, nodes in deck.solids.values()], dtype=np.int64)
    cells = to_gmsh(rows_of(node_ids, listed, "GRID", source), NASTRAN)
    properties = np.array([pid for _, pid, _ in deck.solids.values()])
    width = face_width(cells)
    surfaces: dict[str, Integers] = {}
    for pid in sorted({pid for pid, nodes in deck.skins if len(nodes) == width}):
        faces = [nodes for found, nodes in deck.skins if found == pid and len(nodes) == width]
        surfaces[f"PID {pid}"] = rows_of(node_ids, np.array(faces, dtype=np.int64), "GRID", source)
    loaded: defaultdict[str, list[list[int]]] = defaultdict(list)
    for name, card in deck.loads:
        loaded[name] += _loaded_faces(card, deck)
    surfaces |= {
        name: rows_of(node_ids, stacked([np.array([face]) for face in faces], width), "GRID", source)
        for name, faces in loaded.items()
        if faces
    }
    return FileMesh(
        points=np.array(list(deck.nodes.values()), dtype=float).reshape(-1, 3),
        cells=cells,
        surfaces=surfaces,
        volumes={f"PID {pid}": np.flatnonzero(properties == pid) for pid in np.unique(properties)},
        node_sets={name: rows_of(node_ids, np.array(ids), "GRID", source) for name, ids in deck.held.items()},
    )


def _collect(path: Path) -> Deck:
    deck = Deck()
    for card in read_cards(path):
        match card.name:
            case "GRID":
                if card.integer(1, 0):
                    raise card.fail(f"coordinate system {card.field(1)}: must be the basic one, 0")
                deck.nodes[card.integer(0)] = (card.real(2), card.real(3), card.real(4))
            case name if name in SOLIDS or name in OTHER_SOLIDS:
                number = card.integer(0)
                if number in deck.solids:
                    raise card.fail(f"element {number} is there twice")
                deck.solids[number] = (name, card.integer(1), _solid_nodes(card))
            case name if name in SKINS:
                deck.skins.append((card.integer(1), [card.integer(2 + k) for k in range(SKINS[name])]))
            case "SPC1":
                held = deck.held[f"SPC {card.integer(0)}"]
                held += card.integers(2)
                if len(held) > MOST_HELD:
                    raise card.fail(f"set {card.integer(0)} holds {len(held):.4g} nodes: at most {MOST_HELD:.0e}")
            case "SPC":
                deck.held[f"SPC {card.integer(0)}"] += [card.integer(k) for k in (1, 4) if card.field(k)]
            case "PLOAD4":
                deck.loads.append((f"PLOAD4 {card.integer(0)}", card))
            case _:
                pass
    return deck


def _solid_nodes(card: Card) -> list[int]:
    nodes = [int(word) for word in card.fields[2:] if word.isdecimal() and word != "0"]
    if card.name in SOLIDS and len(nodes) not in SOLIDS[card.name]:
        few, many = SOLIDS[card.name]
        raise card.fail(f"element {card.field(0)} has {len(nodes)} nodes: must be {few} or {many}")
    return nodes


def _by_type(deck: Deck) -> dict[str, tuple[int, Integers | None]]:
    """Counts by name and number of nodes."""
    counts: defaultdict[tuple[str, int], int] = defaultdict(int)
    for name, _, nodes in deck.solids.values():
        counts[name, len(nodes)] += 1
    return {
        f"{name} of {nodes} nodes": (count, np.empty((0, nodes), dtype=np.int64) if name in SOLIDS else None)
        for (name, nodes), count in counts.items()
    }


def _loaded_faces(card: Card, deck: Deck) -> list[list[int]]:
    """The face of a solid that PLOAD4 names by a vertex and the one opposite it (CTETRA: the one off the face)."""
    element = card.integer(1)
    if element not in deck.solids or not card.field(6):
        return []  # loads a shell
    name, _, nodes = deck.solids[element]
    on, other = card.integer(6), card.integer(7, 0)
    if name == "CTETRA":
        faces = [[nodes[k] for k in face] for face in ABAQUS_TET_FACES]
        chosen = [face for face in faces if on in face and other not in face]
    else:
        faces = [[nodes[k] for k in face] for face in ABAQUS_HEX_FACES]
        chosen = [face for face in faces if on in face and face[(face.index(on) + 2) % 4] == other]
    if len(chosen) != 1:
        raise card.fail(f"nodes {on} and {other} name no face of element {element}")
    return chosen
