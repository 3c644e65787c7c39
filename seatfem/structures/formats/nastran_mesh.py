"""Meshes in Nastran bulk data (.bdf, .nas, .dat, .fem)."""

import re
from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from seatfem.structures.formats import decks, file_mesh
from seatfem.structures.mesh.io import Floats, Integers, MeshError

SMALL, LARGE = 8, 4  # data fields per line with small and large fields
SOLIDS = {"CTETRA": (4, 10), "CHEXA": (8, 20)}
OTHER_SOLIDS = (
    "CPENTA",
    "CPYRAM",
    "CPYRA",
    "CHEX8",
    "CHEX20",
    "CHEXA1",
    "CHEXA2",
    "CWEDGE",
    "CIHEX1",
    "CIHEX2",
    "CIHEX3",
)
SKINS = {"CTRIA3": 3, "CTRIA6": 3, "CTRIAR": 3, "CQUAD4": 4, "CQUAD8": 4, "CQUADR": 4, "CQUAD": 4}
SYSTEMS = ("CORD1R", "CORD1C", "CORD1S", "CORD2R", "CORD2C", "CORD2S")
OUTSIDE = re.compile(
    r"""
    ABINFL|ABS|AC|ADAPT|ADUM|AECOMP|AEDW|AEF|AEL|AEP|AER|AES|ALOAD|AMLREG|APPLY|ASET|ATTACH|ATVFS|AXI|AXSLOT|BAR|BC|BDY|
    BEADVAR|BEAMOR|BEDGE|BFRIC|BGADD|BGPARM|BGSET|BLSEG|BNDF|BNDGRID|BODY|BOLT|BOUTPUT|BSET|BSURF|CAABSF|CAERO|CAMPBLL|
    CAXIF|CBAR|CBEAM|CBEND|CBFAST|CBUSH|CBUTT|CCONEAX|CCRSFIL|CDAMP|CDUM|CELAS|CELBOW|CELLBOX|CELLWNG|CEMLOOP|CFAST|
    CFFREE|CFLUID|CGAP|CHACAB|CHACBR|CHBDY|CINTC|CIS2D|CLOAD|CMASS|CMFREE|CNGRNT|COHESIV|COMBWLD|CONCTL|CONM|CONROD|
    CONT|CONV|CPLST|CQDM|CQDP|CQDX|CQUAD1|CQUAD2|CQUADX|CRAC|CREEP|CRIGD|CROD|CSEAM|CSET|CSHEAR|CSLOT|CSPOT|CSSCHD|
    CSSET|CTORDRG|CTRAPAX|CTRAPRG|CTRBSC|CTRIA1|CTRIA2|CTRIAAX|CTRIARG|CTRIAX|CTRM|CTRPLT|CTRSHL|CTUBE|CTWIST|CVISC|
    CWELD|CYAX|CYJOIN|CYSUP|CYSYM|DAMP|DAREA|DCON|DDVAL|DEACTEL|DEBUG|DEFORM|DEFUSET|DELAY|DEQATN|DESVAR|DIVERG|DLINK|
    DLOAD|DMI|DMNCON|DMRLAW|DOPTPRM|DPHASE|DRAN|DRESP|DSCREEN|DSHAPE|DSIZE|DTABLE|DTI|DTPG|DTPL|DV|DYPARAM|ECHO|EIG|
    ELIST|ENDDYNA|EOS|EPOINT|ERPPNL|EXTFILE|EXTRN|FACET|FAIL|FATIGUE|FBALOAD|FBODY|FLFACT|FLSYM|FLUTTER|FORCE|FREEPT|
    FREQ|FRF|FSLIST|FTG|GENEL|GENGAF|GMBC|GMBND|GMCONV|GMLOAD|GMQVOL|GMSPC|GRAV|GROUP|GUST|HADA|HEATLOS|HGSUPPR|HYBDAMP|
    HYDROS|INIT|IPSTRAIN|ISTRSS|ITER|JOINT|LEAKAGE|LOAD|LORENZI|LSEQ|MACREEP|MARC|MARPRN|MAT|MAUXCMD|MBOLT|MDB|MDELAM|
    MDLPRM|MDMIAUX|MFLUID|MICPNT|MKAERO|MODTRAK|MOMAX|MOMENT|MONCNCM|MOND|MONGRP|MONPNT|MONSUM|MPC|MPROCS|MT8AD|MTCREEP|
    MTHERM|NHRMPRM|NLA|NLC|NLF|NLH|NLO|NLP|NLR|NLS|NOLIN|NSM|NTHICK|OMIT|OUTPUT|OUTRCV|PAABSF|PAC|PAERO|PAFOIL|PANEL|
    PANLST|PARAM|PBAR|PBCOMP|PBDISCR|PBE|PBFAST|PBLD|PBMS|PBODY|PBRSECT|PBSPOT|PBUS|PCO|PDAMP|PDISTB|PDUM|PELAS|PENTA|
    PFAST|PGAP|PGPLSN|PHBDY|PIHEX|PINT|PLCOMP|PLFACT|PLIMIT|PLOAD(?!4)|PLOT|PLPLANE|PLSOLID|PLT|PLY|PMASS|PMIC|PMREBA|
    PPLANE|PQDM|PQDP|PQUAD|PRAC|PRESAX|PRESPT|PRESTRS|PRIM|PROD|PSEAM|PSHE|PSHLN|PSLDN|PSOLID|PSPOT|PSPRMAT|PTORDRG|PTR|
    PTSHELL|PTUBE|PTWIST|PVAL|PVISC|PWELD|PWSEAM|QBDY|QHBDY|QSET|QVECT|QVOL|RAD|RAND|RBAR|RBAX|RBE|RBJ|RCONN|RCROSS|
    RELEASE|RESTART|RFORCE|RGYRO|RIGID|RINGFL|RJOINT|RLOAD|ROTHYBD|ROTOR|ROTPARM|RROD|RSPIN|RSPLINE|RSSCON|RTRPLT|RVDOF|
    SBPRET|SEBNDRY|SEBSET|SECONCT|SECSET|SEDLINK|SEDRSP|SEELT|SEEXCLD|SELABEL|SELOAD|SENQSET|SEQGP|SEQSEP|SEQSET|SESET|
    SESUP|SET1|SET2|SET3|SETREE|SEUSET|SLBDY|SLOAD|SNORM|SPBLND|SPCADD|SPCAX|SPCD|SPCG|SPCOFF|SPCR|SPLINE|SPOINT|
    SPRELAX|STACK|STOCHAS|STREAML|SUPAX|SUPORT|SURFINI|SWLDPRM|TABDMP|TABFAT|TABL|TABR|TEMP|TERMIN|TF|THPAD|TIC|TIM|
    TLOAD|TMPSET|TOMVAR|TOPVAR|TRIM|TRMCPL|TSTEP|TTEMP|UNBALNC|UNGLUE|USET|UXVEC|VARIAN|VATVFS|VCCT|VIEW|VUBAR|VUBEAM|
    WALL|WETLOAD|WETSURF|XFLOW|YPARAM
    """,
    re.VERBOSE,
)
"""Beginnings of names of entries that change no node, solid, skin or set: lines, properties, materials, loads, ..."""
KNOWN = frozenset(("GRID", "GRDSET", *SYSTEMS, *SOLIDS, *OTHER_SOLIDS, *SKINS, "SPC", "SPC1", "PLOAD4"))
MOST_HELD = 5_000_000  # largest number of nodes in all SPC1 sets of a deck
DEEPEST = 100  # largest number of coordinate systems that stand in each other
_INCLUDE = re.compile(r"\s*INCLUDE\s*[ '\"]", re.IGNORECASE)

Solids = Mapping[int, tuple[str, list[int]]]
"""Name and nodes of each solid, by its number."""


@dataclass(frozen=True)
class Card:
    """Card with the ``fields`` after its name, blank ones as ""; continuation lines are appended without markers."""

    name: str
    fields: list[str]
    place: str

    def fail(self, why: str) -> MeshError:
        return MeshError(f"{self.place}: {self.name}: {why}")

    def field(self, at: int) -> str:
        return self.fields[at] if at < len(self.fields) else ""

    def integer(self, at: int, default: int | None = None) -> int:
        text = self.field(at)
        if text.isdecimal() and text.isascii() and len(text) <= 9:
            return int(text)
        if text or default is None:
            raise self.fail(f"field {at + 2} is {text[:80]!r}: must be a whole number of up to nine digits")
        return default

    def reals(self, start: int, stop: int) -> list[float]:
        try:
            return [decks.number(self.field(at)) for at in range(start, stop)]
        except ValueError as error:
            raise self.fail(f"fields {start + 2} to {stop + 1}: {error}") from None

    def degrees(self, at: int) -> str:
        """Return the degrees of freedom in a field."""
        if not re.fullmatch("[0-6 ]+", self.field(at)):
            raise self.fail(f"field {at + 2} is {self.field(at)[:80]!r}: must be digits from 1 to 6")
        return self.field(at)


def read_cards(path: Path) -> Iterator[Card]:
    """Yield the entries of the bulk data up to ENDDATA. Raises `MeshError` for those that are not known."""
    card, label = Card("", [], str(path)), ""
    for place, line in _bulk(path):
        head, data, mark = _split(line, place)
        passed_over = card.name and card.name not in KNOWN
        if head[:1] in ("", "+", "*") or (passed_over and head[:1].isdigit()):
            if not passed_over and head.lstrip("+* ") not in ("", label):
                raise MeshError(f"{place}: {head}: continues another line than the one before; put it after its own")
            card.fields.extend([""] * (-len(card.fields) % len(data)) + data)
        else:
            if card.name:
                yield card
            card = Card(head.rstrip("* "), data, place)
            if card.name not in KNOWN and not OUTSIDE.match(card.name):
                raise card.fail("is not known, and may change the mesh; write out what it stands for, and remove it")
        label = mark
    if card.name:
        yield card


def _lines(path: Path) -> Iterator[tuple[str, str]]:
    """Yield place and text of every line without comments; the lines of an INCLUDE as one."""

    def goes_on(line: str) -> bool:
        return _INCLUDE.match(line) is not None and line.count("'") + line.count('"') == 1

    def included(line: str) -> str | None:
        match = _INCLUDE.match(line)
        return line[match.end() :].strip(" '\"") if match else None

    return decks.Deck(path, lambda line: line.partition("$")[0].rstrip(), goes_on, included).lines()


def _bulk(path: Path) -> list[tuple[str, str]]:
    """Return the lines from BEGIN BULK, if present, to ENDDATA. Raises `MeshError` for several such sections."""
    lines: list[tuple[str, str]] = []
    begun = False
    for place, line in _lines(path):
        word = line[:80].strip().upper()
        if word.startswith("BEGIN"):
            if begun or word.split() not in (["BEGIN", "BULK"], ["BEGIN"]):
                raise MeshError(f"{place}: {word}: one section BEGIN BULK is read; write the parts as one")
            begun, lines = True, []
        elif word.startswith("ENDDATA"):
            break
        elif not _INCLUDE.match(line):
            lines.append((place, line))
    return lines


def _split(line: str, place: str) -> tuple[str, list[str], str]:
    """Return name or continuation marker, the data fields padded to a complete line, and the marker at its end."""
    if "," not in line[:10]:
        line = line.expandtabs(8)
        head = line[:8].strip().upper()
        width = LARGE if "*" in head else SMALL
        data = [line[at : at + 64 // width].strip() for at in range(8, 72, 64 // width)]
        return head, data, line[73:80].strip().upper()
    head, *data = (word.strip() for word in line.split(","))
    width = LARGE if "*" in head else SMALL
    if any(data[width + 1 :]) or "".join(data[width:])[:1] not in ("", "+", "*"):
        raise MeshError(f"{place}: {head[:80]}: more than {width} fields; write the rest on a line that begins with +")
    return head.upper(), [*data[:width], *[""] * (width - len(data))], "".join(data[width:]).lstrip("+* ").upper()


def read_nastran(path: Path) -> file_mesh.FileMesh:
    """Return the mesh of GRID, CTETRA and CHEXA of bulk data; groups are named by numbers, as the file has no names.

    Volumes: "PID 3", the solids of property 3. Surfaces: "PID 3", the shells (CTRIA3, CQUAD4, ...) of property 3;
    "PLOAD4 5", the faces loaded by set 5; "SPC 2", the faces all of whose vertices are in set 2 of SPC and SPC1. Nodes
    may stand in systems of CORD1R ... CORD2S. Entries of `OUTSIDE`, and what precedes BEGIN BULK, are passed over.
    Raises `MeshError` naming file and line, also for any other entry.
    """
    deck, solids, loads = _collect(path)
    mesh = file_mesh.assembled(deck).mesh
    faces = {name: [face for card in cards for face in _loaded_faces(card, solids)] for name, cards in loads.items()}
    loaded_faces = {name: deck.rows(np.array(loaded, dtype=np.int64)) for name, loaded in faces.items() if loaded}
    return replace(mesh, surfaces={**mesh.surfaces, **loaded_faces})


@dataclass
class Places:
    """Coordinates of nodes and the systems in which they stand, -1 for ``default``; systems by number."""

    grids: dict[int, tuple[float, float, float, int]] = field(default_factory=dict)
    systems: dict[int, tuple[Card, int]] = field(default_factory=dict)
    axes: dict[int, Floats] = field(default_factory=dict)
    default: int = 0

    def add_grid(self, card: Card) -> None:
        number, (x, y, z) = card.integer(0), card.reals(2, 5)
        grid = (x, y, z, card.integer(1, -1))
        if len(card.fields) < SMALL or any(card.fields[SMALL:]) or self.grids.setdefault(number, grid) != grid:
            raise card.fail(f"node {number} must be there once, in 8 small fields or twice 4 large ones; mend it")
        for at in (at for at in (5, 7) if card.field(at) != "-1"):
            card.integer(at, 0)
        if card.field(6):
            card.degrees(6)

    def add_system(self, card: Card) -> None:
        for at in (0, 4) if card.name[4] == "1" and card.field(4) else (0,):
            before, _ = self.systems.setdefault(card.integer(at), (card, at))
            if before.fields != card.fields:
                raise card.fail(f"coordinate system {card.field(at)} is there twice; remove one")

    def all(self, source: Path) -> Floats:
        """Return the places of all nodes in the basic system (n, 3)."""
        table = np.array(list(self.grids.values()), dtype=float).reshape(-1, 4)
        for number in np.unique(table[:, 3]):
            rows = table[:, 3] == number
            table[rows, :3] = self.basic(int(number), table[rows, :3], Card("GRID", [], str(source)), 0)
        return table[:, :3]

    def basic(self, number: int, places: Floats, user: Card, depth: int) -> Floats:
        """Return places (n, 3) in the basic system, of those in a system that a card names."""
        number = self.default if number < 0 else number
        if number == 0:
            return places
        if number not in self.systems or depth > DEEPEST:
            raise user.fail(f"coordinate system {number} is missing, or stands in itself; write it as CORD2R")
        card, at = self.systems[number]
        if number not in self.axes:
            self.axes[number] = self._axes(card, at, depth + 1)
        radius, angle, third = places[:, 0], np.deg2rad(places[:, 1]), places[:, 2]
        if card.name[-1] == "S":
            radius, angle, third = radius * np.sin(angle), np.deg2rad(third), radius * np.cos(angle)
        if card.name[-1] != "R":
            places = np.c_[radius * np.cos(angle), radius * np.sin(angle), third]
        return np.asarray(self.axes[number][0] + places @ self.axes[number][1:])

    def _axes(self, card: Card, at: int, depth: int) -> Floats:
        """Return origin and unit vectors (4, 3) of a system in the basic one, of an origin, a point on z, one in xz."""
        if card.name[4] == "1":
            grids = [self.grids.get(card.integer(at + k)) for k in (1, 2, 3)]
            if None in grids:
                raise card.fail("a node of it is not defined; add its GRID")
            points = np.vstack([self.basic(grid[3], np.array([grid[:3]]), card, depth) for grid in grids if grid])
        elif any(card.fields[8:11]) and not any(card.fields[11:]):
            points = self.basic(card.integer(1, 0), np.reshape(card.reals(2, 11), (3, 3)), card, depth)
        else:
            raise card.fail("must have the three coordinates of three points; check its lines")
        z, toward = points[1:] - points[0]
        y = np.cross(z, toward)
        axes = np.array([np.cross(y, z), y, z])
        if not np.all(np.any(axes, axis=1)):
            raise card.fail("its three points are on a line; move one")
        return np.vstack([points[:1], axes / np.linalg.norm(axes, axis=1, keepdims=True)])


def _collect(path: Path) -> tuple[file_mesh.Deck, Solids, Mapping[str, list[Card]]]:
    """Return the deck, its solids by number, and the PLOAD4 cards by set. Shells, whose numbers may be those of solids,
    are numbered -1, -2, ..."""
    places = Places()
    solids: dict[int, tuple[str, list[int]]] = {}
    shells: list[int] = []
    skins: list[list[int]] = []
    properties: defaultdict[str, list[int]] = defaultdict(list)
    held: defaultdict[str, list[Card]] = defaultdict(list)
    loads: defaultdict[str, list[Card]] = defaultdict(list)
    for card in read_cards(path):
        match card.name:
            case "GRID":
                places.add_grid(card)
            case "GRDSET":
                if places.default or any(card.fields[at] for at in (0, 2, 3, 4)) or any(card.fields[8:]):
                    raise card.fail("must be there once, with no more than CP, CD, PS and SEID; check its commas")
                places.default = card.integer(1, 0)
            case name if name in SYSTEMS:
                places.add_system(card)
            case name if name in SOLIDS or name in OTHER_SOLIDS:
                number = card.integer(0)
                if number in solids:
                    raise card.fail(f"element {number} is there twice; remove one")
                solids[number] = (name, _solid_nodes(card))
                properties[f"PID {card.integer(1)}"].append(number)
            case name if name in SKINS:
                shells.append(card.integer(0))
                skins.append([-len(shells), *(card.integer(2 + k) for k in range(SKINS[name]))])
                properties[f"PID {card.integer(1)}"].append(-len(shells))
            case "SPC" | "SPC1":
                held[f"SPC {card.integer(0)}"].append(card)
            case "PLOAD4":
                loads[f"PLOAD4 {card.integer(0)}"].append(card)
            case "DTI" if card.field(0).upper() == "UNITS":
                raise card.fail("UNITS is not read; remove it, and state the unit of the file")
            case _:
                pass
    known = {*solids, *shells}
    for card in (card for cards in loads.values() for card in cards):
        if card.integer(1) not in known:
            raise card.fail(f"element {card.integer(1)} is not defined; add it")
    by_type: defaultdict[str, list[list[int]]] = defaultdict(list)
    for number, (name, corners) in solids.items():
        by_type[f"{name} of {len(corners)} nodes"].append([number, *corners])
    sides = [[row for row in skins if len(row) == 1 + width] for width in (3, 4)]
    ids = np.fromiter(places.grids, dtype=np.int64)
    deck = file_mesh.Deck(
        source=str(path),
        order=file_mesh.NASTRAN,
        node_ids=ids,
        points=places.all(path),
        solids=[
            file_mesh.Elements(name, np.array(rows), name.partition(" ")[0] in SOLIDS) for name, rows in by_type.items()
        ],
        skins=[file_mesh.Elements("shells", np.array(rows)) for rows in sides if rows],
        element_sets={name: np.array(properties[name]) for name in sorted(properties)},
        node_sets=_held_nodes(held, np.sort(ids)),
        what="GRID",
    )
    return deck, solids, loads


_RANGE = re.compile(r"([0-9]{1,9})(?: THRU ([0-9]{1,9}))?(?: |$)")


def _held_nodes(held: Mapping[str, list[Card]], ids: Integers) -> dict[str, Integers]:
    """Return the nodes of the sets of SPC and SPC1; of a range, those that are among the sorted ``ids``."""
    sets: dict[str, Integers] = {}
    members = 0
    for name, cards in held.items():
        parts = [np.empty(0, dtype=np.int64)]
        for card in cards:
            if card.name == "SPC1":
                card.degrees(1)
                text = " ".join(filter(None, card.fields[2:])).upper()
            else:
                pairs = [at for at in (1, 4) if any(card.fields[at : at + 3])]
                text = " ".join(str(card.integer(at)) for at in pairs if card.degrees(at + 1))
            if _RANGE.sub("", text):
                raise card.fail(f"{text[:80]!r}: must be whole numbers, or two with THRU between")
            ends = [(int(first), int(last or 0)) for first, last in _RANGE.findall(text)]
            parts.append(np.array([first for first, last in ends if not last], dtype=np.int64))
            for first, last in (each for each in ends if each[1]):
                parts.append(ids[np.searchsorted(ids, first) : np.searchsorted(ids, last + 1)])
                members += len(parts[-1])
            if members > MOST_HELD:
                raise card.fail(f"ranges have {members:.4g} nodes, may have {MOST_HELD:.0e} together; check THRU")
        sets[name] = np.concatenate(parts)
    return sets


def _solid_nodes(card: Card) -> list[int]:
    if card.name not in SOLIDS:
        return [int(word) for word in card.fields[2:] if word.isdecimal()]
    last = max((at for at, word in enumerate(card.fields) if word not in ("", "0")), default=1)
    nodes = [card.integer(at) for at in range(2, last + 1)]
    if len(nodes) not in SOLIDS[card.name]:
        few, many = SOLIDS[card.name]
        raise card.fail(f"element {card.field(0)} has {len(nodes)} nodes: must be {few} or {many}")
    return nodes


def _loaded_faces(card: Card, solids: Solids) -> list[list[int]]:
    """Return the face that PLOAD4 names by a vertex and the opposite one (for CTETRA the vertex off the face)."""
    element = card.integer(1)
    if element not in solids:
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
