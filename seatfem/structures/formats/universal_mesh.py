"""Meshes in universal files (.unv)."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType
from typing import Final

import numpy as np

from impact.files.safe_files import MB
from seatfem.structures.formats import file_mesh
from seatfem.structures.formats.universal import Dataset, Units, read_datasets, read_units
from seatfem.structures.mesh.io import MeshError

# Columns of the vertices, then of the nodes on edges in Abaqus' order, by the format's element type. Parabolic elements
# list the nodes of a contour in sequence, vertices and mid-edge nodes alternating.
SOLIDS: Final[Mapping[int, tuple[int, ...]]] = MappingProxyType(
    {
        111: (0, 1, 2, 3),
        118: (0, 2, 4, 9, 1, 3, 5, 6, 7, 8),
        115: tuple(range(8)),
        116: (0, 2, 4, 6, 12, 14, 16, 18, 1, 3, 5, 7, 13, 15, 17, 19, 8, 9, 10, 11),
    }
)
NAMES: Final[Mapping[int, str]] = MappingProxyType(
    dict.fromkeys(range(101, 120), "other solids")
    | {111: "tetrahedra", 118: "tetrahedra of 10 nodes", 115: "bricks", 116: "bricks of 20 nodes"}
    | {101: "wedge", 102: "wedge", 112: "wedge", 113: "wedge", 117: "cubic brick", 119: "cubic brick"}
)
"""Names of all solids; those that are not in `SOLIDS` are not supported."""
SKINS: Final[Mapping[int, tuple[int, ...]]] = MappingProxyType(
    dict.fromkeys((41, 51, 61, 74, 81, 91), (0, 1, 2))
    | dict.fromkeys((42, 52, 62, 72, 82, 92), (0, 2, 4))
    | dict.fromkeys((44, 54, 64, 71, 84, 94), (0, 1, 2, 3))
    | dict.fromkeys((45, 55, 65, 75, 85, 95), (0, 2, 4, 6))
)
BEAMS: Final = (11, 21, 22, 23, 24)  # types of beams, whose records have one more line
NO_SOLIDS: Final = frozenset(
    {*BEAMS, 31, 32, 43, 46, 53, 56, 63, 66, 73, 76, 93, 96, 121, 122, 136, 137, 138, 139, 141, 142, 151, 152, 161}
    | {171, 172, 181}
)
"""Types of beams, cubic shells, rigid elements, springs, dampers, gaps, masses, axisymmetric shells."""
GROUPS: Final = MappingProxyType({2417: 2, 2429: 2, 2430: 2, 2432: 2, 2435: 4, 2452: 4, 2467: 4, 2477: 4})
"""Numbers that describe a member of a group, its code and its number first, by dataset."""
NODE, ELEMENT = 7, 8
NOT_READ: Final = MappingProxyType({71: "2412", 752: "2467"})
"""Datasets of the mesh that are not read, and the one to export in place."""
IRRELEVANT: Final = frozenset(
    {55, 56, 57, 58, 82, 151, 152, 153, 154, 755, 757, 758, 772, 776, 778, 782, 783, 788, 789, 790, 791, 792, 1858}
    | {2400, 2401, 2414, 2415, 2416, 2437, 2438, 2448, 2450, 2453, 2458, 2470, *range(1700, 1730)}
)
"""Headers, results, trace lines, properties, materials, loads and supports."""
LIMIT: Final = 512 * MB


@dataclass
class _Content:
    """What the datasets of a file hold, while they are read."""

    units: Units | None = None
    nodes: dict[int, list[float]] = field(default_factory=dict)
    systems: dict[int, int] = field(default_factory=dict)  # a node of each coordinate system
    basic: dict[int, bool] = field(default_factory=dict)  # whether a coordinate system is the basic one
    labels: set[int] = field(default_factory=set)  # of elements
    elements: defaultdict[int, list[list[int]]] = field(default_factory=lambda: defaultdict(list))  # rows by type
    members: defaultdict[str, list[list[int]]] = field(default_factory=lambda: defaultdict(list))
    aside: Counter[str] = field(default_factory=Counter)

    def read(self, dataset: Dataset) -> None:
        """Take what a dataset holds. Raises its error for one of the mesh that is not read."""
        match dataset.number:
            case 164:
                self.units = read_units(dataset, self.units)
            case 15 | 781 | 2411:
                self._read_nodes(dataset)
            case 780 | 2412:
                self._read_elements(dataset)
            case 18:  # an older form of coordinate systems: whatever refers to it is refused
                self.basic[-1] = False
            case 2420:
                self._read_systems(dataset)
            case number if number in GROUPS:
                self._read_groups(dataset)
            case number if number in NOT_READ:
                raise dataset.fail(f"is not read: export dataset {NOT_READ[number]} in its place")
            case number if number not in IRRELEVANT:
                self.aside[f"dataset {number}"] += 1

    def _read_nodes(self, dataset: Dataset) -> None:
        while dataset.has_more:
            if dataset.number == 15:  # on one line
                *head, x, y, z = dataset.reals(7)
                (label, system, _, _), place = map(int, head), [x, y, z]
            else:
                (label, system, _, _), place = dataset.integers(4), dataset.reals(3)
            if label in self.nodes:
                raise dataset.fail(f"node {label} is there twice; remove one")
            self.nodes[label] = place
            self.systems.setdefault(system, label)

    def _read_elements(self, dataset: Dataset) -> None:
        while dataset.has_more:
            label, kind, *_, count = dataset.integers(8 if dataset.number == 780 else 6)
            if label in self.labels:
                raise dataset.fail(f"element {label} is there twice; remove one")
            if kind not in NAMES and kind not in SKINS and kind not in NO_SOLIDS:
                raise dataset.fail(f"element {label} is of type {kind}, which is not known; export the mesh without it")
            if kind in BEAMS:
                dataset.integers(3)
            expected = len(SOLIDS.get(kind, ())) or max(count, len(SKINS.get(kind, ())), 1)
            if count != expected:
                raise dataset.fail(f"element {label} of type {kind} has {count} nodes: must be {expected}")
            if kind in NO_SOLIDS:
                self.aside[f"element of type {kind}"] += 1
            self.labels.add(label)
            self.elements[kind].append([label, *dataset.integers(count)])

    def _read_groups(self, dataset: Dataset) -> None:
        width = GROUPS[dataset.number]
        while dataset.has_more:
            count, name = dataset.integers(8)[7], dataset.text().strip()
            numbers = dataset.integers(width * count)
            self.members[name] += [numbers[k : k + 2] for k in range(0, len(numbers), width)]

    def _read_systems(self, dataset: Dataset) -> None:
        dataset.integers(1)
        dataset.text()  # name of the part
        while dataset.has_more:
            label, kind, _ = dataset.integers(3)
            dataset.text()
            matrix = np.array([dataset.reals(3) for _ in range(4)])
            self.basic[label] = kind == 0 and np.allclose(matrix, np.eye(4, 3), atol=1e-9)


def read_unv(path: Path) -> file_mesh.FileMesh:
    """Return the mesh in datasets 15, 781 and 2411 (nodes), 780 and 2412 (elements), those of `GROUPS`, 164 (units).

    The solids of a group are a volume, its shells a surface, its nodes a node set. Coordinate systems (2420) must be
    the basic one. Raises `MeshError` with line and dataset; other datasets are named in the notes, if they are not
    known to hold no mesh.
    """
    content = _Content()
    for dataset in read_datasets(path, LIMIT, MeshError):
        content.read(dataset)
    for system, node in content.systems.items():
        if system and not content.basic.get(system, system == 1 and not content.basic):
            raise MeshError(
                f"{path}: node {node} is given in coordinate system {system}, which must be the basic one; export the "
                "nodes in it"
            )
    groups = {name: np.array(codes, dtype=np.int64).reshape(-1, 2) for name, codes in content.members.items()}
    elements, nodes = (
        {name: codes[codes[:, 0] == code, 1] for name, codes in groups.items() if code in codes[:, 0]}
        for code in (ELEMENT, NODE)
    )
    deck = file_mesh.Deck(
        source=str(path),
        order=file_mesh.ABAQUS,
        node_ids=np.fromiter(content.nodes, dtype=np.int64),
        points=np.array(list(content.nodes.values()), dtype=float).reshape(-1, 3),
        solids=[_of_type(kind, rows, SOLIDS) for kind, rows in content.elements.items() if kind in NAMES],
        skins=[_of_type(kind, rows, SKINS) for kind, rows in content.elements.items() if kind in SKINS],
        element_sets=elements,
        node_sets=nodes,
    )
    notes = tuple(f"left aside: {what}" + f" ({count} times)" * (count > 1) for what, count in content.aside.items())
    unit = None if content.units is None else content.units.metre
    return replace(file_mesh.assembled(deck).mesh, unit=unit, notes=notes)


def _of_type(kind: int, rows: list[list[int]], columns: Mapping[int, tuple[int, ...]]) -> file_mesh.Elements:
    picked = [0, *(1 + column for column in columns.get(kind, ()))]
    table = np.array([[row[k] for k in picked] for row in rows], dtype=np.int64)
    return file_mesh.Elements(f"{NAMES.get(kind, 'shells')} (type {kind})", table, usable=kind in columns)
