"""Meshes in Nastran bulk data (.bdf, .nas, .dat, .fem)."""

import re
from collections import defaultdict
from collections.abc import Iterator, Mapping, Set
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from seatfem.structures.errors import MeshError
from seatfem.structures.formats import decks, file_mesh
from seatfem.structures.mesh.io import Floats, Integers

SMALL, LARGE = 8, 4  # data fields per line with small and large fields
SOLIDS = {"CTETRA": (4, 10), "CHEXA": (8, 20)}
SKINS = {"CTRIA3": 3, "CTRIA6": 3, "CTRIAR": 3, "CQUAD4": 4, "CQUAD8": 4, "CQUADR": 4, "CQUAD": 4}
READ = frozenset(("GRID", "GRDSET", "CORD2R", "CORD2C", "CORD2S", *SOLIDS, *SKINS, "SPC", "SPC1", "PLOAD4"))
OUTSIDE = re.compile(
    r"""
    ABI|ABS|AC|ADA|ADU|AEC|AED|AEF|AEL|AEP|AER|AES|ALO|AML|APP|ASE|ATT|ATV|AXI|AXS|BAR|BC|BDY|BEA|BED|BFR|BGA|BGP|BGS|
    BLS|BND|BOD|BOL|BOU|BSE|BSU|CAA|CAE|CAM|CAX|CBA|CBE|CBF|CBU|CCO|CCR|CDA|CDU|CEL|CEM|CFA|CFF|CFL|CGA|CHA|CHB|CIN|CIS|
    CLO|CMA|CMF|CNG|COH|COM|CON|CORD1|CPL|CQD|CQUAD1|CQUAD2|CQUADX|CRA|CRE|CRI|CRO|CSE|CSH|CSL|CSP|CSS|CTO|CTRA|CTRB|
    CTRIA1|CTRIA2|CTRIAA|CTRIARG|CTRIAX|CTRM|CTRP|CTRS|CTU|CTW|CVI|CWEL|CYA|CYJ|CYS|DAM|DAR|DCO|DDV|DEA|DEB|DEF|DEL|DEQ|
    DES|DIV|DLI|DLO|DMI|DMN|DMR|DOP|DPH|DRA|DRE|DSC|DSH|DSI|DTA|DTI|DTP|DV|DYP|ECH|EIG|ELI|ENDDY|EOS|EPO|ERP|EXT|FAC|
    FAI|FAT|FBA|FBO|FLF|FLS|FLU|FOR|FRE|FRF|FSL|FTG|GEN|GMB|GMCON|GML|GMQ|GMSP|GRA|GRO|GUS|HAD|HEA|HGS|HYB|HYD|INI|IPS|
    IST|ITE|JOI|LEA|LOA|LOR|LSE|MAC|MAR|MAT|MAU|MBO|MDB|MDE|MDL|MDMIA|MFL|MIC|MKA|MODT|MOM|MON|MPC|MPR|MT8|MTC|MTH|NHR|
    NLA|NLC|NLF|NLH|NLO|NLP|NLR|NLS|NOL|NSM|NTH|OMI|OUT|PAA|PAC|PAE|PAF|PAN|PAR|PBA|PBC|PBD|PBE|PBF|PBL|PBM|PBO|PBR|PBS|
    PBU|PCO|PDA|PDI|PDU|PEL|PEN|PFA|PGA|PGP|PHB|PIH|PIN|PLC|PLF|PLI|PLOAD(?!4)|PLOT|PLP|PLS|PLT|PLY|PMA|PMI|PMR|PPL|PQD|
    PQU|PRA|PRE|PRI|PRO|PSE|PSH|PSL|PSO|PSP|PTO|PTR|PTS|PTU|PTW|PVA|PVI|PWE|PWS|QBD|QHB|QSE|QVE|QVO|RAD|RAN|RBA|RBE|RBJ|
    RCO|RCR|REL|RES|RFO|RGY|RIG|RIN|RJO|RLO|ROT|RRO|RSP|RSS|RTR|RVD|SBP|SEBN|SEBS|SEC|SED|SEE|SELA|SELOA|SEN|SEQ|SES|
    SET|SEU|SLB|SLO|SNO|SPB|SPCA|SPCD|SPCG|SPCO|SPCR|SPL|SPO|SPR|STA|STO|STR|SUP|SUR|SWL|TAB|TEM|TER|TF|THP|TIC|TIM|TLO|
    TMP|TOM|TOP|TRI|TRM|TST|TTE|UNB|UNG|USE|UXV|VAR|VAT|VCC|VIE|VUB|WAL|WET|XFL|YPA
    """,
    re.VERBOSE,
)
"""Beginnings of names of entries that change no node, solid, skin or set: lines, properties, materials, loads, ..."""
MOST_HELD = 5_000_000  # largest number of nodes in all SPC1 sets of a deck
_INCLUDE = re.compile(r"\s*INCLUDE\b", re.IGNORECASE)
_RANGE = re.compile(r"([0-9]{1,9})(?: THRU ([0-9]{1,9}))?(?: |$)")


@dataclass(frozen=True)
class Card(decks.Card):
    """Card with the ``fields`` after its name, blank ones as ""; continuation lines are appended without markers."""

    fields: list[str]

    def field(self, at: int) -> str:
        return self.fields[at] if at < len(self.fields) else ""

    def integer(self, at: int, default: str = "") -> int:
        return self.integers([self.field(at) or default])[0]

    def degrees(self, at: int) -> str:
        """Return the degrees of freedom in a field."""
        if not re.fullmatch("[0-6 ]+", self.field(at)):
            raise self.fail(f"field {at + 2} is {self.field(at)[:80]!r}: must be digits from 1 to 6")
        return self.field(at)


def read_cards(path: Path) -> Iterator[Card]:
    """Yield the entries of the bulk data up to ENDDATA. Raises `MeshError` for those that are not known."""
    card, label = Card(str(path), "", []), ""
    for place, line in _bulk(path):
        head, data, mark = _split(line, place)
        passed_over = card.name and card.name not in READ
        if head[:1] in ("", "+", "*") or (passed_over and head[:1].isdigit()):
            if not passed_over and head.lstrip("+* ") not in ("", label):
                raise MeshError(f"{place}: {head}: continues another line than the one before; put it after its own")
            card.fields.extend([""] * (-len(card.fields) % len(data)) + data)
        else:
            if card.name:
                yield card
            card = Card(place, head.rstrip("* "), data)
            if card.name not in READ and not OUTSIDE.match(card.name):
                raise card.fail("is not read, and may change the mesh; write out GRID, CTETRA, CHEXA, and remove it")
        label = mark
    if card.name:
        yield card


def _bulk(path: Path) -> list[tuple[str, str]]:
    """Return place and text of the lines from BEGIN BULK, if present, to ENDDATA; the lines of an INCLUDE as one."""

    def goes_on(line: str) -> bool:
        return _INCLUDE.match(line) is not None and line.count("'") + line.count('"') == 1

    lines: list[tuple[str, str]] = []
    begun = False
    for place, line in decks.Deck(path, lambda line: line.partition("$")[0].rstrip(), goes_on).lines():
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
    may stand in systems of CORD2R, CORD2C and CORD2S. Entries of `OUTSIDE`, and what precedes BEGIN BULK, are passed
    over. Raises `MeshError` naming file and line, also for any other entry.
    """
    grids: dict[int, tuple[float, ...]] = {}  # coordinates and number of the system
    systems: dict[int, Card] = {}
    solids: dict[int, tuple[str, list[int]]] = {}  # name and nodes
    shells: list[int] = []
    skins: list[list[int]] = []  # by the numbers -1, -2, ..., as their own may be those of solids
    properties: defaultdict[str, list[int]] = defaultdict(list)
    held: defaultdict[str, list[Card]] = defaultdict(list)
    loads: defaultdict[str, list[Card]] = defaultdict(list)
    for card in read_cards(path):
        match card.name:
            case "GRID":
                place = card.reals([card.field(at) for at in (2, 3, 4)])
                number, grid = card.integer(0), (*place, card.integer(1, "0"))
                if len(card.fields) < SMALL or any(card.fields[SMALL:]) or grids.setdefault(number, grid) != grid:
                    raise card.fail(f"node {number} must be there once, in 8 small fields or twice 4 large; mend it")
                card.integers([word for word in (card.field(5), card.field(7)) if word not in ("", "-1")])
                if card.field(6):
                    card.degrees(6)
            case "GRDSET" if any(word not in ("", "0") for word in (*card.fields[:5], *card.fields[SMALL:])):
                raise card.fail("its coordinate system is not read; write it into field 3 of each GRID")
            case "CORD2R" | "CORD2C" | "CORD2S":
                if card.integer(0) == 0 or systems.setdefault(card.integer(0), card).fields != card.fields:
                    raise card.fail(f"coordinate system {card.field(0)} is there twice, or 0; remove one")
            case name if name in SOLIDS:
                properties[f"PID {card.integer(1)}"].append(card.integer(0))
                if solids.setdefault(card.integer(0), solid := (name, _solid_nodes(card))) is not solid:
                    raise card.fail(f"element {card.field(0)} is there twice; remove one")
            case name if name in SKINS:
                shells.append(card.integer(0))
                skins.append([-len(shells), *card.integers(card.fields[2 : 2 + SKINS[name]])])
                properties[f"PID {card.integer(1)}"].append(-len(shells))
            case "SPC" | "SPC1":
                held[f"SPC {card.integer(0)}"].append(card)
            case "PLOAD4":
                loads[f"PLOAD4 {card.integer(0)}"].append(card)
            case "DTI" if card.field(0).upper() == "UNITS":
                raise card.fail("UNITS is not read; remove it, and state the unit of the file")
    by_type: defaultdict[str, list[list[int]]] = defaultdict(list)
    for number, (name, corners) in solids.items():
        by_type[f"{name} of {len(corners)} nodes"].append([number, *corners])
    elements = [file_mesh.Elements(name, np.array(rows)) for name, rows in by_type.items()]
    by_width = [[row for row in skins if len(row) == 1 + width] for width in (3, 4)]
    sides = [file_mesh.Elements("shells", np.array(rows)) for rows in by_width if rows]
    sets = {name: np.array(properties[name]) for name in sorted(properties)}
    ids, places = np.fromiter(grids, dtype=np.int64), _places(grids, systems, path)
    node_sets = _held_nodes(held, np.sort(ids))
    deck = file_mesh.Deck(str(path), file_mesh.NASTRAN, ids, places, elements, sides, sets, node_sets, what="GRID")
    mesh = file_mesh.assembled(deck).mesh
    surfaces, known = dict(mesh.surfaces), frozenset(shells)
    for name, cards in loads.items():
        if faces := [face for card in cards for face in _loaded_faces(card, solids, known)]:
            surfaces[name] = deck.rows(np.array(faces))
    return replace(mesh, surfaces=surfaces)


def _places(grids: Mapping[int, tuple[float, ...]], systems: Mapping[int, Card], path: Path) -> Floats:
    """Return the places of nodes in the basic coordinate system (n, 3)."""
    table = np.array(list(grids.values()), dtype=float).reshape(-1, 4)
    within: defaultdict[int, list[Card]] = defaultdict(list)  # by the number of the system in which they stand
    for card in systems.values():
        within[card.integer(1, "0")].append(card)
    axes: dict[int, Floats] = {}
    ordered = within[0]
    for card in ordered:  # each after the one in which it stands
        outer, number = card.integer(1, "0"), card.integer(0)
        points = np.reshape(card.reals((card.fields + [""] * 11)[2:11]), (3, 3))
        axes[number] = _axes(card, _in_basic(points, systems[outer].name, axes[outer]) if outer else points)
        ordered += within[number]
    for number in map(int, np.unique(table[:, 3])):
        if number and number not in axes:
            why = "is no CORD2R, CORD2C or CORD2S, or stands in itself or in none of these; write it as CORD2R"
            raise MeshError(f"{path}: GRID: coordinate system {number} {why}")
        rows = table[:, 3] == number
        if number:
            table[rows, :3] = _in_basic(table[rows, :3], systems[number].name, axes[number])
    return table[:, :3]


def _axes(card: Card, points: Floats) -> Floats:
    """Return origin and unit vectors (4, 3) of a system from its origin, a point on z, and one in the plane xz."""
    z, toward = points[1:] - points[0]
    y = np.cross(z, toward)
    axes = np.array([np.cross(y, z), y, z])
    if any(card.fields[11:]) or not np.all(np.any(axes, axis=1)):
        raise card.fail("must have three points that are not on a line; move one")
    return np.vstack([points[:1], axes / np.linalg.norm(axes, axis=1, keepdims=True)])


def _in_basic(places: Floats, kind: str, axes: Floats) -> Floats:
    """Return places (n, 3) in the basic system, of those in a rectangular, cylindrical or spherical one [degrees]."""
    radius, angle, third = places[:, 0], np.deg2rad(places[:, 1]), places[:, 2]
    if kind == "CORD2S":
        radius, angle, third = radius * np.sin(angle), np.deg2rad(third), radius * np.cos(angle)
    if kind != "CORD2R":
        places = np.c_[radius * np.cos(angle), radius * np.sin(angle), third]
    return np.asarray(axes[0] + places @ axes[1:])


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
            for first, last in _RANGE.findall(text):
                known = ids[np.searchsorted(ids, int(first)) : np.searchsorted(ids, int(last or 0) + 1)]
                parts.append(known if last else np.array([int(first)]))
                members += len(parts[-1])
            if members > MOST_HELD:
                raise card.fail(f"has {members:.4g} nodes with those before; {MOST_HELD:.0e} are the most; check THRU")
        sets[name] = np.concatenate(parts)
    return sets


def _solid_nodes(card: Card) -> list[int]:
    last = max((at for at, word in enumerate(card.fields) if word not in ("", "0")), default=1)
    nodes = card.integers(card.fields[2 : last + 1])
    if len(nodes) not in SOLIDS[card.name]:
        raise card.fail(f"element {card.field(0)} has {len(nodes)} nodes: must be one of {SOLIDS[card.name]}")
    return nodes


def _loaded_faces(card: Card, solids: Mapping[int, tuple[str, list[int]]], shells: Set[int]) -> list[list[int]]:
    """Return the face that PLOAD4 names by a vertex and the opposite one (for CTETRA the vertex off the face)."""
    element = card.integer(1)
    if element not in solids:
        if element not in shells:
            raise card.fail(f"element {element} is not defined; add it")
        return []
    nodes, tet = solids[element][1], solids[element][0] == "CTETRA"
    corner, other = card.integer(6), card.integer(7, "0")
    columns = file_mesh.ABAQUS_TET_FACES if tet else file_mesh.ABAQUS_HEX_FACES
    faces = [face for face in ([nodes[k] for k in face] for face in columns) if corner in face]
    chosen = [face for face in faces if (other not in face if tet else face[face.index(corner) - 2] == other)]
    if len(chosen) != 1:
        raise card.fail(f"nodes {corner} and {other} must name a face of element {element}")
    return chosen
