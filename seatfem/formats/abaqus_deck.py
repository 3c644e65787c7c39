"""Keyword blocks and sets of an Abaqus input file."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from seatfem.mesh.cell_kinds import Integers
from seatfem.mesh.io import MeshError

GENERATORS = ("NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "SYSTEM", "TRANSFORM SYSTEM")
DEPTH = 8  # of files that include files


@dataclass(frozen=True)
class Block:
    """A keyword line with its options, and its data lines split at commas."""

    keyword: str
    options: Mapping[str, str]
    rows: Sequence[list[str]]
    place: str

    def fail(self, why: str) -> MeshError:
        return MeshError(f"{self.place}: *{self.keyword}: {why}")

    def integers(self) -> Integers:
        """Every number of the data lines."""
        try:
            return np.array([int(word) for row in self.rows for word in row if word], dtype=np.int64)
        except ValueError as error:
            raise self.fail(f"whole numbers expected ({error})") from None


def read_blocks(path: Path) -> list[Block]:
    """All blocks of a file, included files in their place. Raises `MeshError` for what would move or make nodes."""
    blocks = list(_blocks(path, 0))
    for block in blocks:
        if block.keyword in GENERATORS:
            raise block.fail("not supported; write the file with every node and element listed")
        if block.keyword == "INSTANCE" and any(any(row) for row in block.rows):
            raise block.fail("the instance is moved or turned; write a flat input file")
    for keyword in ("PART", "INSTANCE"):
        names = [block.options.get("NAME", "") for block in blocks if block.keyword == keyword]
        if len(names) > 1:
            raise MeshError(f"{path}: {len(names)} blocks *{keyword} ({', '.join(names)}); write a flat input file")
    return blocks


def _blocks(path: Path, depth: int) -> Iterator[Block]:
    head: tuple[str, dict[str, str], str] | None = None
    rows: list[list[str]] = []
    for place, line in _logical_lines(path):
        if not line.startswith("*"):
            rows.append([word.strip() for word in line.split(",")])
            continue
        if head:
            yield Block(head[0], head[1], rows, head[2])
        keyword, options = _keyword(line)
        head, rows = (keyword, options, place), []
        if "INPUT" in options:
            if keyword != "INCLUDE":
                raise MeshError(f"{place}: *{keyword}, INPUT=: not supported; use *INCLUDE")
            other = path.parent / options["INPUT"]
            if depth >= DEPTH or not other.is_file():
                raise MeshError(f"{place}: *INCLUDE: no such file {other}, or files that include each other")
            yield from _blocks(other, depth + 1)
    if head:
        yield Block(head[0], head[1], rows, head[2])


def _logical_lines(path: Path) -> Iterator[tuple[str, str]]:
    """Place and text of every line that says something; keyword lines that end in a comma with what follows."""
    begun, place = "", ""
    for number, raw in enumerate(path.read_text(encoding="utf-8", errors="replace").splitlines(), start=1):
        line = raw.strip()
        if not line or line.startswith("**"):
            continue
        place = place if begun else f"{path}:{number}"
        line = begun + line
        begun = ""
        if line.startswith("*") and line.endswith(","):
            begun = line
        else:
            yield place, line
    if begun:
        yield place, begun


def _keyword(line: str) -> tuple[str, dict[str, str]]:
    keyword, *words = line[1:].split(",")
    pairs = [word.partition("=") for word in words if word.strip()]
    options = {_squeezed(key).upper(): value.strip().strip('"') for key, _, value in pairs}
    return _squeezed(keyword).upper(), options


def _squeezed(text: str) -> str:
    return re.sub(r"\s+", " ", text.strip())


@dataclass(eq=False)
class Sets:
    """Named sets of node or element numbers; names without regard to case, as in Abaqus."""

    kind: str
    members: dict[str, list[Integers]] = field(default_factory=dict)
    names: dict[str, str] = field(default_factory=dict)
    internal: set[str] = field(default_factory=set)

    def add(self, name: str, numbers: Integers) -> None:
        self.names.setdefault(name.casefold(), name)
        self.members.setdefault(name.casefold(), []).append(numbers)

    def add_block(self, block: Block) -> None:
        """*NSET or *ELSET: numbers, names of earlier sets, or ranges under GENERATE."""
        name = block.options.get(self.kind)
        if not name:
            raise block.fail(f"{self.kind}= is missing")
        if "INTERNAL" in block.options:
            self.internal.add(name.casefold())
        self.add(name, self._ranges(block) if "GENERATE" in block.options else self._listed(block))

    def get(self, word: str, block: Block) -> Integers:
        """The numbers a word stands for: itself, or a set's."""
        word = word.strip('"').rpartition(".")[2]  # without the name of the instance
        if word.lstrip("+-").isdigit():
            return np.array([int(word)], dtype=np.int64)
        if word.casefold() not in self.members:
            there = ", ".join(map(repr, sorted(self.names.values()))) or "none"
            raise block.fail(f"no {self.kind} {word!r} before this line; there are: {there}")
        return np.concatenate(self.members[word.casefold()])

    def named(self) -> dict[str, Integers]:
        """The sets a user has named, with every number once."""
        return {
            self.names[key]: np.unique(np.concatenate(parts))
            for key, parts in self.members.items()
            if key not in self.internal
        }

    def _listed(self, block: Block) -> Integers:
        words = [self.get(word, block) for row in block.rows for word in row if word]
        return np.concatenate([np.empty(0, dtype=np.int64), *words])

    def _ranges(self, block: Block) -> Integers:
        try:
            triples = [[int(word) for word in row if word] for row in block.rows]
            ranges = [np.arange(first, last + 1, *step, dtype=np.int64) for first, last, *step in triples]
        except ValueError as error:
            raise block.fail(f"GENERATE takes first, last, step ({error})") from None
        return np.concatenate([np.empty(0, dtype=np.int64), *ranges])
