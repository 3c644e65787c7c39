"""Meshes in Nastran bulk data (.bdf, .nas, .dat, .fem)."""

import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from impact.files.safe_files import MB, read_text
from seatfem.structures.formats import file_mesh
from seatfem.structures.mesh.io import MeshError

SMALL, LARGE = 8, 4  # data fields per line with small and large fields
LIMIT = 512 * MB
SOLIDS = {"CTETRA": (4, 10), "CHEXA": (8, 20)}
OTHER_SOLIDS = ("CPENTA", "CPYRAM", "CPYRA", "CHEX8", "CHEX20")
SKINS = {"CTRIA3": 3, "CTRIA6": 3, "CTRIAR": 3, "CQUAD4": 4, "CQUAD8": 4, "CQUADR": 4, "CQUAD": 4}
MOST_HELD = 5_000_000  # largest number of nodes in all SPC1 sets of a deck


Solids = Mapping[int, tuple[str, list[int]]]
"""Name and nodes of each solid, by its number."""


@dataclass(frozen=True)
class Card:
    """Card with the ``fields`` after its name, blank ones as ""; continuation lines are appended without markers."""

    name: str
    fields: Sequence[str]
    place: str

    def fail(self, why: str) -> MeshError:
        return MeshError(f"{self.place}: {self.name}: {why}")

    def field(self, at: int) -> str:
        return self.fields[at] if at < len(self.fields) else ""

    def integer(self, at: int, default: int | None = None) -> int:
        text = self.field(at)
        if not text and default is not None:
            return default
        try:
            return int(text)
        except ValueError:
            raise self.fail(f"field {at + 2} is {text!r}: must be a whole number") from None

    def real(self, at: int) -> float:
        """Return a number in Nastran's notation: 1.5, 1.5E-3, 1.5D-3, 1.5-3; blank is 0."""
        text = self.field(at).upper().replace("D", "E")
        try:
            return float(re.sub(r"(?<=[0-9.])([+-])", r"E\1", text) or 0.0)
        except ValueError:
            raise self.fail(f"field {at + 2} is {self.field(at)!r}: must be a number") from None

    def ranges(self, start: int) -> list[range]:
        """Return the whole numbers from a field on, each number and each "a THRU b" as a range."""
        words = [word for word in self.fields[start:] if word]
        ranges: list[range] = []
        for at, word in enumerate(words):
            if word.upper() == "THRU":
                ends = words[at - 1 : at] + words[at + 1 : at + 2]
                if len(ends) < 2 or not all(end.isdecimal() for end in ends):
                    raise self.fail("THRU must stand between two whole numbers")
                ranges.append(range(int(ends[0]) + 1, int(ends[1])))
            elif word.isdecimal():
                ranges.append(range(int(word), int(word) + 1))
            else:
                raise self.fail(f"{word!r}: must be a whole number or THRU")
        return ranges


def read_cards(path: Path) -> Iterator[Card]:
    """Yield the cards of the bulk data up to ENDDATA. Raises `MeshError` for INCLUDE."""
    name, fields, place = "", [""], ""
    for number, raw in _bulk(path):
        head, data = _split(raw)
        if head == "" or head[0] in "+*":
            fields.extend(data)
            continue
        if name:
            yield Card(name, fields, place)
        name, fields, place = head.rstrip("*").upper(), data, f"{path}:{number}"
        if name.startswith("INCLUDE"):
            raise MeshError(f"{place}: INCLUDE: not supported; write one file")
    if name:
        yield Card(name, fields, place)


def _bulk(path: Path) -> list[tuple[int, str]]:
    """Return numbered lines from BEGIN BULK, if present, to ENDDATA, without comments and blank lines."""
    lines: list[tuple[int, str]] = []
    for number, raw in enumerate(read_text(path, LIMIT, MeshError, errors="replace").splitlines(), start=1):
        line = raw.partition("$")[0].rstrip()
        word = line.strip().upper()
        if word.startswith("BEGIN") and "BULK" in word:
            lines = []
        elif word.startswith("ENDDATA"):
            return lines
        elif word:
            lines.append((number, line))
    return lines


def _split(line: str) -> tuple[str, list[str]]:
    """Return the name or continuation marker, and the data fields padded to a complete line."""
    if "," in line:
        head, *data = (word.strip() for word in line.split(","))
        width = LARGE if "*" in head else SMALL
    else:
        line = line.expandtabs(8)
        head = line[:8].strip()
        width = LARGE if "*" in head else SMALL
        size = 64 // width
        data = [line[8 + size * k : 8 + size * (k + 1)].strip() for k in range(width)]
    return head, [*data[:width], *[""] * (width - len(data))]


def read_nastran(path: Path) -> file_mesh.FileMesh:
    """Return the mesh of GRID, CTETRA and CHEXA of bulk data; groups are named by numbers, as the file has no names.

    Volumes: "PID 3", the solids of property 3. Surfaces: "PID 3", the shells (CTRIA3, CQUAD4, ...) of property 3;
    "PLOAD4 5", the faces loaded by set 5; "SPC 2", the faces all of whose vertices are in set 2 of SPC and SPC1. Raises
    `MeshError` naming file and line.
    """
    deck, solids, loads = _collect(path)
    mesh = file_mesh.assembled(deck).mesh
    faces = {name: [face for card in cards for face in _loaded_faces(card, solids)] for name, cards in loads.items()}
    loaded_faces = {name: deck.rows(np.array(loaded, dtype=np.int64)) for name, loaded in faces.items() if loaded}
    return replace(mesh, surfaces={**mesh.surfaces, **loaded_faces})


def _collect(path: Path) -> tuple[file_mesh.Deck, Solids, Mapping[str, list[Card]]]:
    """Return the deck, its solids by number, and the PLOAD4 cards by set. Shells, whose numbers may be those of solids,
    are numbered -1, -2, ..."""
    nodes: dict[int, tuple[float, float, float]] = {}
    solids: dict[int, tuple[str, list[int]]] = {}
    skins: list[list[int]] = []
    properties: defaultdict[str, list[int]] = defaultdict(list)
    spcs: defaultdict[str, list[range]] = defaultdict(list)
    loads: defaultdict[str, list[Card]] = defaultdict(list)
    members = 0
    for card in read_cards(path):
        match card.name:
            case "GRID":
                if card.integer(1, 0):
                    raise card.fail(f"coordinate system {card.field(1)}: must be the basic one, 0")
                nodes[card.integer(0)] = (card.real(2), card.real(3), card.real(4))
            case name if name in SOLIDS or name in OTHER_SOLIDS:
                number = card.integer(0)
                if number in solids:
                    raise card.fail(f"element {number} is there twice; remove one")
                solids[number] = (name, _solid_nodes(card))
                properties[f"PID {card.integer(1)}"].append(number)
            case name if name in SKINS:
                skins.append([-1 - len(skins), *(card.integer(2 + k) for k in range(SKINS[name]))])
                properties[f"PID {card.integer(1)}"].append(skins[-1][0])
            case "SPC1":
                node_ranges = card.ranges(2)
                added = sum(max(0, each.stop - each.start) for each in node_ranges)
                members += added
                if members > MOST_HELD:
                    raise card.fail(
                        f"{added:.4g} nodes, {members:.4g} with those before; all sets of a deck may have "
                        f"{MOST_HELD:.0e} together; check the numbers around THRU"
                    )
                spcs[f"SPC {card.integer(0)}"] += node_ranges
            case "SPC":
                numbers = [card.integer(k) for k in (1, 4) if card.field(k)]
                spcs[f"SPC {card.integer(0)}"] += [range(number, number + 1) for number in numbers]
            case "PLOAD4":
                loads[f"PLOAD4 {card.integer(0)}"].append(card)
            case _:
                pass
    by_type: defaultdict[str, list[list[int]]] = defaultdict(list)
    for number, (name, corners) in solids.items():
        by_type[f"{name} of {len(corners)} nodes"].append([number, *corners])
    shells = [[row for row in skins if len(row) == 1 + width] for width in (3, 4)]
    deck = file_mesh.Deck(
        source=str(path),
        order=file_mesh.NASTRAN,
        node_ids=np.fromiter(nodes, dtype=np.int64),
        points=np.array(list(nodes.values()), dtype=float).reshape(-1, 3),
        solids=[
            file_mesh.Elements(name, np.array(rows), name.partition(" ")[0] in SOLIDS) for name, rows in by_type.items()
        ],
        skins=[file_mesh.Elements("shells", np.array(rows)) for rows in shells if rows],
        element_sets={name: np.array(properties[name]) for name in sorted(properties)},
        node_sets={name: np.concatenate([np.arange(r.start, r.stop) for r in ranges]) for name, ranges in spcs.items()},
        what="GRID",
    )
    return deck, solids, loads


def _solid_nodes(card: Card) -> list[int]:
    nodes = [int(word) for word in card.fields[2:] if word.isdecimal() and word != "0"]
    if card.name in SOLIDS and len(nodes) not in SOLIDS[card.name]:
        few, many = SOLIDS[card.name]
        raise card.fail(f"element {card.field(0)} has {len(nodes)} nodes: must be {few} or {many}")
    return nodes


def _loaded_faces(card: Card, solids: Solids) -> list[list[int]]:
    """Return the face that PLOAD4 names by a vertex and the opposite one (for CTETRA the vertex off the face)."""
    element = card.integer(1)
    if element not in solids or not card.field(6):
        return []  # loads a shell
    name, nodes = solids[element]
    corner, other = card.integer(6), card.integer(7, 0)
    if name == "CTETRA":
        faces = [[nodes[k] for k in face] for face in file_mesh.ABAQUS_TET_FACES]
        chosen = [face for face in faces if corner in face and other not in face]
    else:
        faces = [[nodes[k] for k in face] for face in file_mesh.ABAQUS_HEX_FACES]
        chosen = [face for face in faces if corner in face and face[(face.index(corner) + 2) % 4] == other]
    if len(chosen) != 1:
        raise card.fail(f"nodes {corner} and {other} must name a face of element {element}")
    return chosen
