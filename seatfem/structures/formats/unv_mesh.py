"""Meshes in universal files (.unv). gmsh reads them too, but crashes on groups of points and has none of nodes."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from pathlib import Path
from types import MappingProxyType

import numpy as np

from impact.files.input_files import MB, read_text
from seatfem.structures.formats.file_mesh import ABAQUS, Deck, Elements, FileMesh, assembled
from seatfem.structures.mesh.io import MeshError

# By the format's element type: columns of the vertices, then of the nodes on edges in Abaqus' order. Parabolic elements
# list the nodes of a contour as they come, vertices and mid-edge nodes by turns.
SOLIDS: Mapping[int, tuple[int, ...]] = MappingProxyType(
    {
        111: (0, 1, 2, 3),
        118: (0, 2, 4, 9, 1, 3, 5, 6, 7, 8),
        115: tuple(range(8)),
        116: (0, 2, 4, 6, 12, 14, 16, 18, 1, 3, 5, 7, 13, 15, 17, 19, 8, 9, 10, 11),
    }
)
NAMES: Mapping[int, str] = MappingProxyType(
    {111: "tetrahedra", 118: "tetrahedra of 10 nodes", 115: "bricks", 116: "bricks of 20 nodes"}
    | {101: "wedge", 102: "wedge", 112: "wedge", 113: "wedge", 117: "cubic brick", 119: "cubic brick"}
)
"""Of all solids; those that are not among `SOLIDS` cannot be used."""
SKINS: Mapping[int, tuple[int, ...]] = MappingProxyType(
    dict.fromkeys((41, 51, 61, 74, 81, 91), (0, 1, 2))
    | dict.fromkeys((42, 52, 62, 72, 82, 92), (0, 2, 4))
    | dict.fromkeys((44, 54, 64, 71, 84, 94), (0, 1, 2, 3))
    | dict.fromkeys((45, 55, 65, 75, 85, 95), (0, 2, 4, 6))
)
BEAMS = (11, 21, 22, 23, 24)  # one line more
GROUPS = (2435, 2452, 2467, 2477)
NODE, ELEMENT = 7, 8
LIMIT = 512 * MB


def read_unv(path: Path) -> FileMesh:
    """Read datasets 2411 (nodes), 2412 (elements) and 2435, 2452, 2467, 2477 (groups) of a universal file.

    A group's solids are a volume, its shells a surface, its nodes a node set. Raises `MeshError`.
    """
    node_ids: list[int] = []
    points: list[list[float]] = []
    by_type: defaultdict[int, list[list[int]]] = defaultdict(list)
    members: defaultdict[str, list[tuple[int, int]]] = defaultdict(list)
    try:
        for number, lines in _datasets(path):
            if number == 2411:
                for head in lines:
                    node_ids.append(int(head.split()[0]))
                    x, y, z = (float(word.replace("D", "E")) for word in next(lines).split()[:3])
                    points.append([x, y, z])
            elif number == 2412:
                for kind, row in _elements(lines):
                    by_type[kind].append(row)
            elif number in GROUPS:
                for name, codes in _groups(lines):
                    members[name] += codes
    except (ValueError, IndexError, StopIteration, RuntimeError) as error:
        raise MeshError(
            f"{path}: not readable as a universal file ({type(error).__name__}: {error}); export it again"
        ) from error
    groups = {name: np.array(codes, dtype=np.int64).reshape(-1, 2) for name, codes in members.items()}
    elements, nodes = (
        {name: codes[codes[:, 0] == code, 1] for name, codes in groups.items() if code in codes[:, 0]}
        for code in (ELEMENT, NODE)
    )
    solids = [_of_type(kind, rows, SOLIDS) for kind, rows in by_type.items() if kind in NAMES]
    skins = [_of_type(kind, rows, SKINS) for kind, rows in by_type.items() if kind in SKINS]
    ids, places = np.array(node_ids, dtype=np.int64), np.array(points).reshape(-1, 3)
    return assembled(Deck(str(path), ABAQUS, ids, places, solids, skins, elements, nodes)).mesh


def _of_type(kind: int, rows: list[list[int]], columns: Mapping[int, tuple[int, ...]]) -> Elements:
    taken = [0, *(1 + column for column in columns.get(kind, ()))]
    table = np.array([[row[k] for k in taken] for row in rows], dtype=np.int64)
    return Elements(f"{NAMES.get(kind, 'shells')} (type {kind})", table, usable=kind in columns)


def _datasets(path: Path) -> Iterator[tuple[int, Iterator[str]]]:
    """Yield number and lines of every dataset; lines of -1 stand around each."""
    lines = iter(read_text(path, LIMIT, MeshError, "latin-1").splitlines())
    for line in lines:
        if line.strip() == "-1":
            number = int(next(lines))
            body: list[str] = []
            for text in lines:
                if text.strip() == "-1":
                    break
                body.append(text)
            yield number, iter(body)


def _elements(lines: Iterator[str]) -> Iterator[tuple[int, list[int]]]:
    """Yield type, number and nodes of every element."""
    for head in lines:
        label, kind, *_, count = map(int, head.split()[:6])
        if kind in BEAMS:
            next(lines)
        nodes = _numbers(lines, count)
        expected = len(SOLIDS.get(kind, nodes))
        if count != expected:
            raise ValueError(f"element {label} of type {kind} has {count} nodes: must be {expected}")
        yield kind, [label, *nodes]


def _groups(lines: Iterator[str]) -> Iterator[tuple[str, list[tuple[int, int]]]]:
    """Yield name and members, code and number of each, of every group."""
    for head in lines:
        count, name = int(head.split()[7]), next(lines).strip()
        words = _numbers(lines, 4 * count)
        yield name, list(zip(words[0::4], words[1::4], strict=True))


def _numbers(lines: Iterator[str], count: int) -> list[int]:
    """Return the whole numbers of the next lines, ``count`` of them or a little more."""
    numbers: list[int] = []
    while len(numbers) < count:
        numbers += map(int, next(lines).split())
    return numbers
