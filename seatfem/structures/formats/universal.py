"""Universal files: datasets between lines of -1, their numbers in turn, units (dataset 164), and meshes (.unv)."""

from __future__ import annotations

import math
import os
import re
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import islice
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from impact.files.csv_table import real
from impact.files.safe_files import MB, opened_file
from seatfem.structures.errors import MeshError
from seatfem.structures.formats import file_mesh

Number = TypeVar("Number", int, float)
_BINARY: Final = re.compile(r"\s*58b\s+([12])\s+2\s", re.IGNORECASE)  # with the order of bytes, in IEEE format
_HEAD_OF_58: Final = 11  # lines of text before the values of dataset 58
_COUNTS: Final = re.compile(r"\s*([2456])\s+(\d{1,12})\s+([01])\s")  # its line 7: data type, count and even spacing
SIZES: Final[Mapping[int, tuple[int, int]]] = MappingProxyType({2: (4, 1), 4: (8, 1), 5: (4, 2), 6: (8, 2)})
"""Bytes of a number and numbers of a value, by the ordinate data type of dataset 58."""


@dataclass
class Dataset:
    """Dataset of a file, by its number and the number of its first line, read line by line; each error names the line.
    ``binary``: values of dataset 58b."""

    path: Path
    error: type[Exception]
    number: int
    line: int
    lines: list[str] = field(default_factory=list, repr=False)
    binary: NDArray[Any] | None = field(default=None, repr=False)
    at: int = 0

    def fail(self, why: str) -> Exception:
        """Return the error of the line that was read last."""
        return self.error(f"{self.path}:{self.line + max(self.at - 1, 0)}: dataset {self.number}: {why}")

    @property
    def has_more(self) -> bool:
        return self.at < len(self.lines)

    def text(self) -> str:
        """Return the next line."""
        if not self.has_more:
            raise self.fail("a line is missing at its end; export the file again")
        self.at += 1
        return self.lines[self.at - 1]

    def integers(self, count: int) -> list[int]:
        """Return the next ``count`` whole numbers, which end with a line."""
        return self._numbers(int, count)

    def reals(self, count: int) -> list[float]:
        """Return the next ``count`` finite numbers, which end with a line; exponents may have the letter D."""
        return self._numbers(real, count)

    def _numbers(self, read: Callable[[str], Number], count: int) -> list[Number]:
        numbers: list[Number] = []
        while len(numbers) < count:
            words = self.text().split()
            try:
                numbers += map(read, words)
            except ValueError:
                words = []
            if not words or len(numbers) > count:
                line = self.lines[self.at - 1].strip()[:80]
                raise self.fail(f"{line!r} must be one of the lines of {count} numbers; export the file again")
        return numbers


def read_datasets(path: Path, most: int, error: type[Exception]) -> Iterator[Dataset]:
    """Yield the datasets of a file of at most ``most`` bytes. Raises ``error`` for lines outside of datasets, a dataset
    without number or end, and binary values that are not of IEEE format or of another size than stated."""
    with opened_file(path, most, error) as file:
        lines = ((number, raw.decode("latin-1").rstrip("\r\n")) for number, raw in enumerate(file, start=1))
        for number, opening in lines:
            if not opening.strip():
                continue
            _, head = next(lines, (0, ""))
            binary = _BINARY.match(head)
            kind = "58" if binary else head.strip()
            if opening.strip() != "-1" or not re.fullmatch("[0-9]{1,6}", kind):
                raise error(
                    f"{path}:{number}: {opening.strip()[:80]!r} and {head.strip()[:80]!r} must be a line of -1 and the "
                    "number of a dataset, 58b in IEEE format; export the universal file again"
                )
            dataset = Dataset(path, error, int(kind), number + 2)
            if binary:
                dataset.lines += [text for _, text in islice(lines, _HEAD_OF_58)]
                counts = _COUNTS.match("".join(dataset.lines[6:7]))
                if counts is None:
                    raise dataset.fail("line 7 must begin with data type, count and spacing; export it again")
                form, count, even = map(int, counts.groups())
                size, parts = SIZES[form]
                values = file.read(min(count * size * (parts + 1 - even), os.fstat(file.fileno()).st_size))
                order = "<" if binary[1] == "1" else ">"
                dataset.binary = np.frombuffer(values[: len(values) // size * size], f"{order}f{size}")
            for _, text in lines:
                if text.rstrip() == "    -1" if binary else text.strip() == "-1":
                    break
                dataset.lines += [text] if text or not binary else []
            else:
                raise dataset.fail("has no end, a line of -1; export the universal file again")
            yield dataset


@dataclass(frozen=True)
class Units:
    """Metres and newtons per unit of a file."""

    metre: float
    newton: float


FOOT, INCH, POUND, POUNDAL, KILOGRAM = 0.3048, 0.0254, 4.4482216152605, 0.138254954376, 9.80665  # [m], [N]
SYSTEMS: Final[Mapping[int, Units]] = MappingProxyType(
    {1: Units(1.0, 1.0), 2: Units(FOOT, POUND), 3: Units(1.0, KILOGRAM), 4: Units(FOOT, POUNDAL), 5: Units(1e-3, 1e-3)}
    | {6: Units(1e-2, 1e-2), 7: Units(INCH, POUND), 8: Units(1e-3, KILOGRAM), 10: Units(1e-3, 1.0)}
)
"""Units by the code of dataset 164; code 9 stands for others."""
USER_DEFINED: Final = 9


UNSTATED: Final = Units(0.0, 0.0)


def read_units(dataset: Dataset, before: Units) -> Units:
    """Return the units of dataset 164: code, words and temperature mode, then factors from SI of length, force and
    temperature. Raises the dataset's error for factors that are not positive or contradict the code, and for other
    units than those of a dataset ``before``."""
    head = dataset.text()[:10].strip()
    code = int(head) if head.isdecimal() else 0
    factors = [*dataset.reals(3), *(dataset.reals(1) if dataset.has_more else ())]  # the last: offset of temperatures
    if dataset.has_more or (code != USER_DEFINED and code not in SYSTEMS):
        raise dataset.fail(f"the code of units is {head!r}, must be 1 to 10, with four factors; export the file again")
    known = SYSTEMS.get(code, Units(math.inf, math.inf))
    of_code = 1 / known.metre, 1 / known.newton
    for what, factor, per_si in zip(("length", "force"), factors, of_code, strict=False):
        if not factor > 0 or (per_si and not math.isclose(factor, per_si, rel_tol=1e-3)):
            meant = f"{per_si:g} by its code of units, {code}" if per_si else "positive"
            raise dataset.fail(f"the factor of {what} is {factor:g}, must be {meant}: correct code or factor")
    units = Units(1 / factors[0], 1 / factors[1])
    if before not in (UNSTATED, units):
        raise dataset.fail("states other units than the one before; remove one")
    return units


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
NAMES: Final = MappingProxyType(
    dict.fromkeys(range(101, 120), "wedges, cubic bricks or others")
    | {111: "tetrahedra", 118: "tetrahedra of 10 nodes", 115: "bricks", 116: "bricks of 20 nodes"}
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
    """Nodes, elements, groups and units of a file, which its datasets fill while they are read."""

    units: Units = UNSTATED
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
                if any(each % 1 for each in head):
                    raise dataset.fail("the numbers of a node must be whole; export the mesh again")
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
        solids=[_pick_elements(kind, rows, SOLIDS) for kind, rows in content.elements.items() if kind in NAMES],
        skins=[_pick_elements(kind, rows, SKINS) for kind, rows in content.elements.items() if kind in SKINS],
        element_sets=elements,
        node_sets=nodes,
    )
    notes = tuple(f"left aside: {what}" + f" ({count} times)" * (count > 1) for what, count in content.aside.items())
    return replace(file_mesh.assembled(deck).mesh, unit=content.units.metre, notes=notes)


def _pick_elements(kind: int, rows: list[list[int]], columns: Mapping[int, tuple[int, ...]]) -> file_mesh.Elements:
    picked = [0, *(1 + column for column in columns.get(kind, ()))]
    table = np.array([[row[k] for k in picked] for row in rows], dtype=np.int64)
    return file_mesh.Elements(f"{NAMES.get(kind, 'shells')} (type {kind})", table, usable=kind in columns)
