"""Abaqus and CalculiX input files (.inp): keyword blocks, parts and their instances, sets, and their meshes."""

import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import MappingProxyType

import numpy as np
from scipy.spatial.transform import Rotation

from seatfem.structures.errors import MeshError
from seatfem.structures.formats import decks, file_mesh
from seatfem.structures.mesh.io import Floats, Integers, distinct

MOST_MEMBERS = 5_000_000  # largest number of members of all sets of a deck, and of lines of placed parts
SPAN = file_mesh.SPAN
SETS = "GENERATE INTERNAL INSTANCE UNSORTED FREQUENCY INPUT"
READ: Mapping[str, str] = MappingProxyType(
    {"*NODE": "NSET SYSTEM INPUT", "*ELEMENT": "TYPE ELSET INPUT DLOAD PARENT", "*INCLUDE": "INPUT FILE"}
    | {"*NSET": f"NSET {SETS}", "*ELSET": f"ELSET {SETS}", "*PART": "NAME", "*INSTANCE": "NAME PART"}
    | {"*SURFACE": "NAME TYPE INTERNAL TRIM MAXRATIO NOOFFSET NOTHICK SCALETHICK REGIONTYPE PROPERTY"}
)
"""Keywords that are read, and their parameters."""
OUTSIDE = re.compile(
    r"""\*(
    ACO|ADA|ADI|AMP|ANI|ANN|AQU|ASSEMBLY|AXI|BAS|BEA|BIA|BLO|BON|BOU|BRI|BUC|BUL|CAD|CAP|CAS|CAV|CEC|CEN|CFD|CFI|CFL|
    CHA|CLA|CLE|CLO|CO-|COH|COM|CONC|COND|CONN|CONS|CONT|COR|COU|CRA|CRE|CRU|CYC|CZO|DAD|DAM|DAS|DEB|DEC|DEF|DEM|DEN|
    DEP|DES|DET|DFL|DIA|DIE|DIF|DIR|DIS|DLO|DOM|DRA|DRU|DSA|DSE|DSF|DSL|DYN|ELA|ELEC|ELEMENTM|ELEMENTO|ELEMENTP|
    ELEMENTR|ELF|ELP|EMB|EMI|END|ENE|ENR|EOS|EPJ|EQU|EUL|EVE|EXP|EXT|FAB|FAC|FAI|FAS|FEA|FIE|FIL|FIX|FLE|FLO|FLU|FOU|
    FRA|FRE|FRI|GAP|GAS|GEL|GEO|GLO|GRE|HCF|HEA|HOU|HYP|HYS|IMPED|INCI|INCR|INE|INI|INT|ITS|JOI|JOU|KAP|KIN|LAT|LOA|LOW|
    M1|M2|MAG|MAPS|MAS|MAT|MEA|MED|MEM|MOD|MOH|MOI|MOL|MON|MOT|MPC|MUL|NET|NOA|NOC|NODAL|NODEF|NODEO|NODEP|NODER|NON|
    NOR|NOT|OBJ|ORI|ORN|OUT|PARA|PER|PHY|PIE|PIP|PLA|POR|POS|POT|PRE|PRI|PRO|PSD|RAD|RAN|RAT|REA|REB|REFL|REL|RES|RET|
    RIG|ROB|ROTAR|SEC|SEL|SEN|SFI|SFL|SHE|SIM|SLI|SLO|SOF|SOI|SOL|SOR|SPE|SPR|SRA|STA|STE|SUBMO|SUBSTRUCT|SUP|SURFACEB|
    SURFACEF|SURFACEI|SURFACEP|SURFACES|SWE|SYMMETRICR|TAB|TEM|TEN|THE|TIE|TIM|TOR|TRAC|TRANS|TRI|TRS|UEL|UNC|UND|UNIA|
    UNL|USE|VAL|VAR|VIE|VIS|VOI|VOL|WAV|WIN)
    """,
    re.VERBOSE,
)
"""Beginnings of keywords, without blanks, that change no node, element or set: materials, constraints, steps, ..."""
SOLID = re.compile(r"[DAQ]?C3D(4|8|10|20|27)[A-Z]*$")
SKIN = re.compile(r"(?:S|DS|STRI|SFM3D|M3D|R3D|CPS|CPE)(3|4|6|8|9)5?[A-Z]*\d?$")
OTHER = re.compile(
    r"[AD]?C[12]D|[ADEGQCM]*AXA?\d|SAX|RAX|SFM|CPEG|A?CIN|ASI|B[23]|PIPE|ELBOW|FRAME|D?T[23]D|F[23]D|R2D2|RB[23]D|MASS|ROTARYI|"
    r"HEATCAP|SPRING|DASHPOT|D?GAP|CONN|DCOUP|DRAG|JOINT|ITS|LS|FC|PSI|P[CD]3D|KCONN|GK|COH(?!3D)|D$|V?U\d|US"
)
"""Lines, plane and axisymmetric solids, springs, masses, users' own elements."""
_NONE: Integers = np.empty(0, dtype=np.int64)


@dataclass(frozen=True)
class Block(decks.Card):
    """Keyword line with its parameters, its data lines split at commas, and the number of its instance, 0 for none."""

    options: Mapping[str, str]
    rows: list[list[str]]
    instance: int = 0


def _keyword(line: str) -> tuple[str, dict[str, str]]:
    """Return keyword and parameters of a line, without blanks in their names, which may be abbreviated."""
    keyword, *words = line.split(",")
    keyword = re.sub(r"\s", "", keyword).upper()
    known, options = READ.get(keyword, "").split(), {}
    for name, _, value in (word.partition("=") for word in words if word.strip()):
        key = re.sub(r"\s", "", name).upper()
        meant = [full for full in known if full.startswith(key)]
        key = meant[0] if len(meant) == 1 and key not in known else key
        options[key if key not in options else f"{key} twice"] = value.strip().strip('"')
    return keyword, options


def _blocks(path: Path, notes: list[str]) -> Iterator[Block]:
    """Yield the blocks of the keywords that are read, and *STEP and the ends of others."""
    block: Block | None = None
    unknown: Counter[str] = Counter()
    in_step = False
    deck = decks.Deck(
        path,
        content=lambda line: re.sub(r"^\s*\*(\*.*|\s*)$", "", line).strip(),
        goes_on=lambda line: line.startswith("*") and line.endswith(","),
    )
    for place, line in deck.lines():
        if not line.startswith("*"):
            if block is None and line[0] in "0123456789+-.,":
                raise MeshError(f"{place}: data before the first keyword; write the keyword, or ** before a comment")
            if block and block.name in READ:
                block.rows.append([word.strip() for word in line.rstrip(" \t,").split(",")])
            continue
        keyword, options = _keyword(line)
        if keyword == "*INCLUDE" and len(options.keys() & {"INPUT", "FILE"}) == len(options) == 1:
            continue
        if block:
            yield block
        block = Block(place, keyword, options, [])
        in_step = keyword == "*STEP" or (in_step and keyword != "*ENDSTEP")
        known = READ.get(keyword, "").split()
        wrong = [name for name in options if name.startswith("*") or (known and name not in known)]
        if wrong or keyword == "*INCLUDE":
            what = ", ".join(wrong)[:80] or "no file"
            raise block.fail(f"{what}: must be among {', '.join(known) or 'its parameters'}; remove it or its comma")
        if keyword not in READ and not OUTSIDE.match(keyword):
            if not in_step:
                raise block.fail("is not known, and may change the mesh; write out nodes and elements, and remove it")
            unknown[keyword[:80]] += 1
    if block:
        yield block
    if unknown:
        notes.append("not known in its steps, and not read: " + ", ".join(unknown))


Key = tuple[int, str]
"""Number of the instance and name in lower case."""
Instances = dict[str, Key]
"""Number and name of each instance by its name in lower case."""


def spelled(names: Mapping[Key, str], instances: Instances) -> dict[Key, str]:
    """Return the names of sets or surfaces, after that of their instance where others have the same name."""
    count, titles = Counter(name for _, name in names), dict(instances.values())
    return {key: f"{titles[key[0]]}.{name}" if key[0] and count[key[1]] > 1 else name for key, name in names.items()}


@dataclass(eq=False)
class Sets:
    """Named sets of node or element numbers, by instance; names are not case-sensitive, as in Abaqus.

    The numbers of instance k are those of its part + k `SPAN`. ``names``: those that are not internal.
    """

    kind: str
    instances: Instances
    members: dict[Key, list[Integers]] = field(default_factory=dict)
    names: dict[Key, str] = field(default_factory=dict)
    count: float = 0

    def used(self, added: float, block: Block) -> None:
        """Count members. Raises `MeshError` if the sets together have too many."""
        self.count += added
        if self.count > MOST_MEMBERS:
            total = f"{self.count:.4g} with those before, must be at most {MOST_MEMBERS:.0e}"
            raise block.fail(f"{added:.4g} members, {total}; check first, last and step")

    def add(self, numbers: Integers, block: Block) -> None:
        """Add numbers to the set that a block names."""
        if not (name := block.options.get(self.kind)):
            raise block.fail(f"{self.kind}= is missing; add it")
        key = (block.instance, name.casefold())
        self.members.setdefault(key, []).append(numbers)
        if "INTERNAL" not in block.options:
            self.names.setdefault(key, name)

    def add_lines(self, block: Block) -> None:
        """Add the block of *NSET or *ELSET: numbers, names of earlier sets, or ranges under GENERATE."""
        numbers: list[int] = []
        parts = [_NONE]
        shift = self._instance(block) * SPAN
        for row in block.rows:
            if "GENERATE" in block.options:
                bounds = block.integers(row if len(row) > 2 else [*row, "1"])
                if len(bounds) != 3 or bounds[2] == 0 or bounds[1] < bounds[0]:
                    raise block.fail(f"{', '.join(row)[:80]}: GENERATE needs first, last, step")
                first, last, step = bounds
                self.used((last - first) // step + 1, block)
                parts.append(np.arange(first, last + 1, step, dtype=np.int64) + shift)
            else:
                numbers += block.integers([word for word in row if word.isdecimal()])
                parts += [self.members_of(word, block) for word in row if word and not word.isdecimal()]
        self.add(distinct(np.concatenate([np.array(numbers, dtype=np.int64) + shift, *parts])), block)

    def members_of(self, word: str, block: Block) -> Integers:
        """Return the numbers that a word names, itself or the members of a set, and count them."""
        instance, name = self._instance(block), word.strip('"')
        if name.rpartition(".")[0].casefold() in self.instances:
            instance, name = self.instances[name.rpartition(".")[0].casefold()][0], name.rpartition(".")[2]
        if name.isdecimal():
            return np.array(block.integers([name]), dtype=np.int64) + instance * SPAN
        parts = self.members.get((instance, name.casefold()))
        if parts is None:
            listed = ", ".join(map(repr, sorted(self.names.values()))) or "none"
            raise block.fail(f"no {self.kind} {word!r} before this line; there are: {listed}")
        self.used(sum(map(len, parts)), block)
        return np.concatenate(parts)

    def _instance(self, block: Block) -> int:
        name = block.options.get("INSTANCE")
        if name is not None and name.casefold() not in self.instances:
            raise block.fail(f"there is no *INSTANCE {name!r}; correct the name")
        return block.instance if name is None else self.instances[name.casefold()][0]

    def named(self) -> dict[str, Integers]:
        """Return the sets that were named by a user, without repeated numbers."""
        names = spelled(self.names, self.instances)
        return {name: distinct(np.concatenate(self.members[key])) for key, name in names.items()}


def _placed(path: Path, notes: list[str]) -> tuple[list[Block], Instances, list[tuple[Floats, Floats]]]:
    """Return the blocks with those of parts as often as these are placed, the instances by name, and their moves."""
    parts: dict[str, list[Block]] = {}
    instances: Instances = {}
    moves = [(np.eye(3), np.zeros(3))]
    placed: list[Block] = []
    part, lines, opened = placed, 0, ""
    for block in _blocks(path, notes):
        name = block.options.get("NAME", "")
        key, of = name.casefold(), block.options.get("PART", "").casefold()
        if opened and block.name in ("*PART", "*INSTANCE", "*ASSEMBLY", "*ENDASSEMBLY", "*STEP"):
            raise block.fail(f"*END {opened} is missing before it; add it")
        match block.name:
            case "*PART" | "*INSTANCE" if key in (parts if block.name == "*PART" else instances):
                raise block.fail(f"{name!r} is there twice; rename one")
            case "*PART":
                opened, part = "PART", parts.setdefault(key, [])
            case "*INSTANCE" if of not in parts:
                raise block.fail(f"PART={of!r}: must be one of {', '.join(map(repr, parts)) or 'no parts'}")
            case "*INSTANCE":
                opened, instances[key] = "INSTANCE", (len(moves), name)
                placed += [replace(each, instance=len(moves)) for each in parts[of]]
                moves.append(_move(block))
                lines += sum(1 + len(each.rows) for each in parts[of])
                if lines > MOST_MEMBERS:
                    raise block.fail(f"{lines} lines of parts are placed so far; must be at most {MOST_MEMBERS:.0e}")
            case "*ENDPART" | "*ENDINSTANCE" if block.name != f"*END{opened}":
                raise block.fail(f"nothing that it ends is open; remove it, or add *{block.name[4:]}")
            case "*ENDPART" | "*ENDINSTANCE":
                part, opened = placed, ""
            case _:
                part.append(replace(block, instance=len(moves) - 1 if opened == "INSTANCE" else 0))
    if opened or (parts and not instances and len(parts) > 1):
        raise MeshError(f"{path}: {len(parts)} blocks *PART need *INSTANCE and *END {opened or 'PART'}; add it")
    return [*(() if instances else next(iter(parts.values()), ())), *placed], instances, moves


def _move(block: Block) -> tuple[Floats, Floats]:
    """Return rotation (3, 3) and shift of an instance: x -> rotation x + shift."""
    rows = [block.reals(row) for row in block.rows]
    if [len(row) for row in rows] not in ([], [1], [2], [3], [1, 7], [2, 7], [3, 7]):
        raise block.fail("needs a line of translation x, y, z, and one of two points on an axis and degrees, or none")
    shift, turn = np.zeros(3), np.eye(3)
    for row in rows[:1]:
        shift[: len(row)] = row
    for row in rows[1:]:
        start, axis = np.array(row[:3]), np.array(row[3:6]) - row[:3]
        if not np.any(axis):
            raise block.fail("the two points on its axis are one; move one")
        turn = Rotation.from_rotvec(np.deg2rad(row[6]) * axis / np.linalg.norm(axis)).as_matrix()
        shift = start + turn @ (shift - start)
    return turn, shift


def read_abaqus(path: Path) -> file_mesh.FileMesh:
    """Return the mesh of *NODE, *ELEMENT, *NSET, *ELSET and *SURFACE, flat or of parts and their placed instances.

    Solids are C3D4, C3D10, C3D8, C3D20, C3D27 with any suffix. Surfaces are those of *SURFACE (faces S1.. of elements,
    or TYPE=NODE), element sets of skin elements (S3, S4R, M3D4, ...), and node sets. Element sets of solids are
    volumes; sets that Abaqus/CAE marks internal are omitted. Keywords of `OUTSIDE` are passed over, others in steps
    are noted. Raises `MeshError` naming file and line, also for any other keyword.
    """
    ids: list[Integers] = [_NONE]
    points: list[Floats] = [np.empty((0, 3))]
    solids: list[file_mesh.Elements] = []
    skins: list[file_mesh.Elements] = []
    notes: list[str] = []
    blocks, instances, moves = _placed(path, notes)
    node_sets, element_sets = Sets("NSET", instances), Sets("ELSET", instances)
    sides: dict[Key, Block] = {}  # of *SURFACE
    for block in blocks:
        match block.name:
            case "*NODE":
                numbers, places = _nodes(block)
                turn, shift = moves[block.instance]
                ids.append(numbers)
                points.append(places @ turn.T + shift)
                if "NSET" in block.options:
                    node_sets.add(numbers, block)
            case "*ELEMENT":
                elements = _elements(block)
                if elements is not None:
                    (skins if SKIN.match(elements.type) else solids).append(elements)
                if "ELSET" in block.options:
                    element_sets.add(_NONE if elements is None else elements.table[:, 0], block)
            case "*NSET" | "*ELSET":
                (node_sets if block.name == "*NSET" else element_sets).add_lines(block)
            case "*SURFACE":
                key = block.instance, block.options.get("NAME", "").casefold()
                if not key[1] or key in sides:
                    raise block.fail(f"NAME={key[1]!r}: is missing, or there twice; write another one")
                sides[key] = block
    named, source = (element_sets.named(), node_sets.named()), str(path)
    deck = file_mesh.Deck(source, file_mesh.ABAQUS, np.concatenate(ids), np.concatenate(points), solids, skins, *named)
    assembly = file_mesh.assembled(deck)
    surfaces, named_nodes = dict(assembly.mesh.surfaces), dict(assembly.mesh.node_sets)
    file_mesh.check_group_count(len(surfaces) + len(named_nodes) + len(sides), source)
    names = spelled({key: block.options["NAME"] for key, block in sides.items()}, instances)
    for key, block in sides.items():
        match block.options.get("TYPE", "ELEMENT").upper():
            case "NODE":
                if any(len(row) > 2 for row in block.rows):
                    raise block.fail("a line must have a set or node and, if anything, its area")
                members = [node_sets.members_of(row[0], block) for row in block.rows]
                named_nodes[names[key]] = deck.rows(np.concatenate([_NONE, *members]))
            case "ELEMENT":
                faces = list(_surface(block, assembly, element_sets))
                surfaces[names[key]] = file_mesh.stacked(faces, file_mesh.face_width(assembly.mesh.cells))
            case kind if kind not in ("CYLINDER", "REVOLUTION", "SEGMENTS", "CUTTING SURFACE", "USER"):  # rigid ones
                raise block.fail(f"TYPE={kind}: must be ELEMENT or NODE")
    return replace(assembly.mesh, surfaces=surfaces, node_sets=named_nodes, notes=tuple(notes))


def _nodes(block: Block) -> tuple[Integers, Floats]:
    """Return numbers and places (n, 3) of the nodes of a block."""
    if (system := block.options.get("SYSTEM", "R").upper()) != "R":
        raise block.fail(f"SYSTEM={system}: must be R; write rectangular coordinates")
    numbers, places = [], []
    for row in block.rows:
        if len(row) > 4 and len(row) != 7:  # 7: with a normal
            raise block.fail(f"{', '.join(row)[:80]}: must be number, x, y, z")
        numbers += block.integers(row[:1])
        places.append([*block.reals(row[1:]), 0.0, 0.0, 0.0][:3])
    return np.array(numbers, dtype=np.int64) + block.instance * SPAN, np.array(places, dtype=float).reshape(-1, 3)


def _elements(block: Block) -> file_mesh.Elements | None:
    """Return the elements of a block; ``None`` for beams, springs and masses, which are neither solids nor skins."""
    kind = block.options.get("TYPE", "").upper()
    match = SOLID.match(kind) or SKIN.match(kind)
    if match is None:
        if OTHER.match(kind):
            return None
        raise block.fail(f"TYPE={kind[:80]}: is not read; write solids as C3D4, C3D10, C3D8, C3D20, skins as S3, S4")
    width = 6 if kind.startswith("STRI65") else int(match[1])
    numbers: list[int] = []
    for row in block.rows:
        if len(numbers) % (1 + width) + len(row) > 1 + width:
            raise block.fail(f"TYPE={kind}: {', '.join(row)[:80]}: must be number and {width} nodes")
        numbers += block.integers(row)
    if len(numbers) % (1 + width):
        raise block.fail(f"TYPE={kind}: its last element must have {width} nodes")
    table = np.array(numbers, dtype=np.int64).reshape(-1, 1 + width) + block.instance * SPAN
    return file_mesh.Elements(kind, table if match.re is SOLID else table[:, : 4 if width in (3, 6) else 5])


def _surface(block: Block, assembly: file_mesh.Assembled, element_sets: Sets) -> Iterator[Integers]:
    """Yield the faces of the lines of *SURFACE, TYPE=ELEMENT: each names a set or an element, and a face of it."""
    cells = assembly.mesh.cells
    faces = np.array(file_mesh.ABAQUS_TET_FACES if file_mesh.face_width(cells) == 3 else file_mesh.ABAQUS_HEX_FACES)
    sides = {"": -1, "SPOS": -1, "SNEG": -1} | {f"S{k + 1}": k for k in range(len(faces))}
    by_side: dict[str, list[Integers]] = {}
    for row in block.rows:
        name, side = row[0], "".join(row[1:2]).upper()
        if len(row) > 2 or side not in sides:
            raise block.fail(f"{', '.join(row)[:80]}: must be set and face, S1 to S{len(faces)}, SPOS or SNEG")
        by_side.setdefault(side, []).append(element_sets.members_of(name, block))
    for side, parts in by_side.items():
        members = np.concatenate(parts)
        rows = np.flatnonzero(np.isin(assembly.ids, members))
        if sides[side] >= 0:
            yield cells[rows][:, faces[sides[side]]]
        else:
            yield assembly.skin[np.isin(assembly.skin_ids, members)]
        if side == "":
            yield cells[:, faces][rows][file_mesh.free_face_mask(cells, faces)[rows]]
