"""Abaqus input files (.inp): keyword blocks, sets, included files, and their meshes."""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from impact.files.safe_files import MB, read_bytes, read_text
from seatfem.structures.formats import file_mesh
from seatfem.structures.mesh.io import Floats, Integers, MeshError, distinct

_WHOLE = re.compile(r"[+-]?[0-9]{1,18}")
GENERATORS = ("NGEN", "NFILL", "NCOPY", "NMAP", "ELGEN", "ELCOPY", "SYSTEM", "TRANSFORM SYSTEM")
DEPTH = 8  # largest depth of nested *INCLUDE
MOST_FILES = 200
MOST_BYTES = 512 * MB  # largest size of all files of a deck [bytes]
MOST_MEMBERS = 5_000_000  # largest number of members of all sets of a deck
_INCLUDE = re.compile(r'^\*[ \t]*INCLUDE[ \t]*,\s*INPUT[ \t]*=[ \t]*"?([^",\r\n]+)', re.IGNORECASE | re.MULTILINE)


@dataclass
class Budget:
    """Remaining number and size of files of a deck; each file counts as often as it is included."""

    files: int = MOST_FILES
    size: int = MOST_BYTES

    def text(self, path: Path) -> str:
        """Return the text of a file. Raises `MeshError` if the deck exceeds its limits."""
        if self.files == 0:
            raise MeshError(f"{path}: is included after {MOST_FILES} other files, the most of a deck; write one file")
        data = read_bytes(path, self.size, MeshError)
        self.files -= 1
        self.size -= len(data)
        return data.decode("utf-8", errors="replace")


@dataclass(frozen=True)
class Block:
    """Keyword line with its options, and its data lines split at commas."""

    keyword: str
    options: Mapping[str, str]
    rows: Sequence[list[str]]
    place: str

    def fail(self, why: str) -> MeshError:
        return MeshError(f"{self.place}: *{self.keyword}: {why}")

    def integers(self) -> Integers:
        """Return all numbers of the data lines."""
        try:
            return np.array([int(word) for row in self.rows for word in row if word], dtype=np.int64)
        except ValueError as error:
            raise self.fail(f"whole numbers expected ({error})") from None


def read_blocks(path: Path) -> list[Block]:
    """Return all blocks of a file, with included ones in place; `MeshError` for those that move or generate nodes."""
    blocks = list(_blocks(path, 0, Budget()))
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


def _blocks(path: Path, depth: int, budget: Budget) -> Iterator[Block]:
    head: tuple[str, dict[str, str], str] | None = None
    rows: list[list[str]] = []
    for place, line in _logical_lines(path, budget):
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
            if depth >= DEPTH or not other.exists():
                raise MeshError(
                    f"{place}: INCLUDE: no such file {other}, or files that include each other; write one file"
                )
            yield from _blocks(other, depth + 1, budget)
    if head:
        yield Block(head[0], head[1], rows, head[2])


def _logical_lines(path: Path, budget: Budget) -> Iterator[tuple[str, str]]:
    """Yield place and text of every line with content; a keyword line that ends in a comma is joined with the next."""
    pieces: list[str] = []
    place = ""
    for number, raw in enumerate(budget.text(path).splitlines(), start=1):
        line = raw.strip()
        if not line or line.startswith("**"):
            continue
        place = place if pieces else f"{path}:{number}"
        pieces.append(line)
        if not (pieces[0].startswith("*") and line.endswith(",")):
            yield place, "".join(pieces)
            pieces = []
    if pieces:
        yield place, "".join(pieces)


def _keyword(line: str) -> tuple[str, dict[str, str]]:
    keyword, *words = line[1:].split(",")
    pairs = [word.partition("=") for word in words if word.strip()]
    options = {_squeezed(key).upper(): value.strip().strip('"') for key, _, value in pairs}
    return _squeezed(keyword).upper(), options


def _squeezed(text: str) -> str:
    return re.sub(r"\s+", " ", text.strip())


@dataclass(eq=False)
class Sets:
    """Named sets of node or element numbers; names are not case-sensitive, as in Abaqus."""

    kind: str
    members: dict[str, list[Integers]] = field(default_factory=dict)
    names: dict[str, str] = field(default_factory=dict)
    internal: set[str] = field(default_factory=set)
    count: float = 0

    def used(self, added: float, block: Block) -> None:
        """Count members. Raises `MeshError` if the sets together have too many."""
        self.count += added
        if self.count > MOST_MEMBERS:
            raise block.fail(
                f"{added:.4g} members, {self.count:.4g} with those before; all sets of a deck may have "
                f"{MOST_MEMBERS:.0e} together; check first, last and step"
            )

    def add(self, name: str, numbers: Integers) -> None:
        self.names.setdefault(name.casefold(), name)
        self.members.setdefault(name.casefold(), []).append(numbers)

    def add_block(self, block: Block) -> None:
        """Add the block of *NSET or *ELSET: numbers, names of earlier sets, or ranges under GENERATE."""
        name = block.options.get(self.kind)
        if not name:
            raise block.fail(f"{self.kind}= is missing; add it")
        if "INTERNAL" in block.options:
            self.internal.add(name.casefold())
        self.add(name, self._ranges(block) if "GENERATE" in block.options else self._listed(block))

    def members_of(self, word: str, block: Block) -> Integers:
        """Return the numbers that a word names, itself or the members of a set, and count them."""
        word = word.strip('"').rpartition(".")[2]  # without the instance's name
        if _WHOLE.fullmatch(word):
            return np.array([int(word)], dtype=np.int64)
        if word.casefold() not in self.members:
            listed = ", ".join(map(repr, sorted(self.names.values()))) or "none"
            raise block.fail(f"no {self.kind} {word!r} before this line; there are: {listed}")
        parts = self.members[word.casefold()]
        self.used(sum(map(len, parts)), block)
        return np.concatenate(parts)

    def named(self) -> dict[str, Integers]:
        """Return the sets that were named by a user, without repeated numbers."""
        return {
            self.names[key]: distinct(np.concatenate(parts))
            for key, parts in self.members.items()
            if key not in self.internal
        }

    def _listed(self, block: Block) -> Integers:
        numbers: list[int] = []
        sets: list[Integers] = [np.empty(0, dtype=np.int64)]
        for row in block.rows:
            for word in filter(None, row):
                if _WHOLE.fullmatch(word):
                    numbers.append(int(word))
                else:
                    sets.append(self.members_of(word, block))
        return distinct(np.concatenate([np.array(numbers, dtype=np.int64), *sets]))

    def _ranges(self, block: Block) -> Integers:
        try:
            triples = [[int(word) for word in row if word] for row in block.rows]
            ranges = [range(first, last + 1, *step) for first, last, *step in triples]
        except (TypeError, ValueError) as error:
            raise block.fail(f"GENERATE needs first, last, step ({error})") from None
        for each in ranges:
            self.used(max(0.0, (each.stop - each.start) / each.step), block)
        parts = (np.arange(each.start, each.stop, each.step, dtype=np.int64) for each in ranges)
        return np.concatenate([np.empty(0, dtype=np.int64), *parts])


def with_included(path: Path) -> tuple[Path, ...]:
    """Return ``path`` and, for an Abaqus input file, every file that is included, at any depth.

    Missing files are omitted. `read_nastran` refuses INCLUDE.
    """
    files: dict[Path, None] = {}  # in order
    waiting = [path]
    while waiting and len(files) <= MOST_FILES:  # reading refuses a deck of more files
        file = waiting.pop().resolve()
        if file in files or not file.is_file():
            continue
        files[file] = None
        if path.suffix.lower() == ".inp":
            text = read_text(file, MOST_BYTES, MeshError, errors="replace")
            waiting += [file.parent / name.strip() for name in _INCLUDE.findall(text)[:MOST_FILES]]
    return tuple(files)


SOLID = re.compile(r"[DAQ]?C3D(4|8|10|20|27)[A-Z]*$")
OTHER_SOLID = re.compile(r"[DAQ]?C3D|COH3D|CSS|SC\d|CCL")
SKIN = re.compile(r"(?:S|DS|STRI|SFM3D|M3D|R3D|CPS|CPE)(3|4|6|8|9)5?[A-Z]*\d?$")


def read_abaqus(path: Path) -> file_mesh.FileMesh:
    """Return the mesh of *NODE, *ELEMENT, *NSET, *ELSET and *SURFACE, flat or with one part and one instance.

    Solids are C3D4, C3D10, C3D8, C3D20, C3D27 with any suffix. Surfaces are those of *SURFACE (faces S1.. of elements,
    or TYPE=NODE), element sets of skin elements (S3, S4R, M3D4, ...), and node sets. Element sets of solids are
    volumes; sets that Abaqus/CAE marks internal are omitted. Raises `MeshError` naming file and line.
    """
    deck, node_sets, element_sets, blocks = _collect(path)
    assembly = file_mesh.assembled(deck)
    if len(distinct(assembly.ids)) < len(assembly.ids):
        raise MeshError(f"{path}: an element number is used twice; number them anew")
    surfaces, named_nodes = dict(assembly.mesh.surfaces), dict(assembly.mesh.node_sets)
    file_mesh.check_group_count(len(surfaces) + len(named_nodes) + len(blocks), str(path))
    for block in blocks:
        name = block.options.get("NAME", "")
        if block.options.get("TYPE", "ELEMENT").upper() == "NODE":
            named_nodes[name] = deck.rows(np.concatenate([node_sets.members_of(row[0], block) for row in block.rows]))
        else:
            surfaces[name] = file_mesh.stacked(
                list(_surface(block, assembly, element_sets)), file_mesh.face_width(assembly.mesh.cells)
            )
    return replace(assembly.mesh, surfaces=surfaces, node_sets=named_nodes)


def _collect(path: Path) -> tuple[file_mesh.Deck, Sets, Sets, list[Block]]:
    """Return the deck, its sets including internal ones, and the blocks of *SURFACE."""
    ids: list[Integers] = [np.empty(0, dtype=np.int64)]
    points: list[Floats] = [np.empty((0, 3))]
    solids: list[file_mesh.Elements] = []
    skins: list[file_mesh.Elements] = []
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
    deck = file_mesh.Deck(
        str(path), file_mesh.ABAQUS, np.concatenate(ids), np.concatenate(points), solids, skins, *named
    )
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


def _elements(block: Block) -> file_mesh.Elements | None:
    """Return the elements of a block; ``None`` for beams, springs and masses, which are neither solids nor skins."""
    kind = block.options.get("TYPE", "").upper()
    solid, skin = SOLID.match(kind), SKIN.match(kind)
    match = solid or skin
    if not match:
        if OTHER_SOLID.match(kind):
            first = [[int(row[0])] for row in block.rows if row[0].isdecimal()]
            return file_mesh.Elements(kind, np.array(first, dtype=np.int64).reshape(-1, 1), usable=False)
        return None
    width = 6 if kind.startswith("STRI65") else int(match.group(1))
    numbers = block.integers()
    if len(numbers) % (1 + width):
        raise block.fail(f"TYPE={kind}: {len(numbers)} numbers must be a multiple of {1 + width} (number and nodes)")
    table = numbers.reshape(-1, 1 + width)
    return file_mesh.Elements(kind, table if solid else table[:, : 4 if width in (3, 6) else 5])


def _surface(block: Block, assembly: file_mesh.Assembled, element_sets: Sets) -> Iterator[Integers]:
    """Yield the faces of the lines of *SURFACE, TYPE=ELEMENT: each names a set or an element, and a face of it."""
    cells = assembly.mesh.cells
    faces = np.array(file_mesh.ABAQUS_TET_FACES if file_mesh.face_width(cells) == 3 else file_mesh.ABAQUS_HEX_FACES)
    by_side: dict[str, list[Integers]] = {}
    for row in block.rows:
        side = row[1].upper() if len(row) > 1 else ""
        if side not in ("SPOS", "SNEG", "") and not (re.fullmatch(r"S[1-9]", side) and 1 <= int(side[1]) <= len(faces)):
            raise block.fail(f"{', '.join(row)}: the face must be S1 to S{len(faces)}, SPOS or SNEG")
        by_side.setdefault(side, []).append(element_sets.members_of(row[0], block))
    for side, parts in by_side.items():
        members = np.concatenate(parts)
        if side in ("SPOS", "SNEG", ""):
            yield assembly.skin[np.isin(assembly.skin_ids, members)]
        rows = np.flatnonzero(np.isin(assembly.ids, members))
        if side == "":
            mask = file_mesh.free_face_mask(cells, faces)
            yield cells[:, faces][rows][mask[rows]]
        elif side not in ("SPOS", "SNEG"):
            yield cells[rows][:, faces[int(side[1]) - 1]]
