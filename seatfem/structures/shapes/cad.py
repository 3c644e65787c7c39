"""Geometry of a part in a STEP or BREP file of a CAD program."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar, Final

from impact.files.safe_files import MB, read_text
from seatfem.structures.errors import GeometryError
from seatfem.structures.shapes import selectors, shape
from seatfem.structures.shapes.selectors import Colour

STEP_SUFFIXES = (".step", ".stp")
BREP_SUFFIXES = (".brep",)

OTHER_FILES = ("DOCUMENT_FILE", "EXTERNALLY_DEFINED_ITEM")  # entities of an assembly with parts in files of their own
SI_PREFIX = {"$": 1.0, ".KILO.": 1e3, ".DECI.": 1e-1, ".CENTI.": 1e-2, ".MILLI.": 1e-3, ".MICRO.": 1e-6, ".NANO.": 1e-9}
MOST_CONVERSIONS: Final = 8  # from a unit to one of the SI: more are a loop

SURFACE_KINDS = {"PLANE": "Plane", "CYLINDRICAL_SURFACE": "Cylinder", "CONICAL_SURFACE": "Cone"}
SMALLEST, LARGEST = 1e-4, 10.0  # bounds on the longest side of a part's bounding box [m]

_FACE = re.compile(r"\s*'([^']*)'\s*,\s*\([^)]*\)\s*,\s*(#\d+)")
_SHELL = re.compile(r"\s*'[^']*'\s*,\s*\(([^)]*)\)")
_LENGTH_UNIT = re.compile(r"\bLENGTH_UNIT\s*\(\s*\)")
_LENGTH = re.compile(r"\bLENGTH_UNIT\b|\bLENGTH_MEASURE_WITH_UNIT\b")
_CONTEXT = re.compile(r"\bGLOBAL_UNIT_ASSIGNED_CONTEXT\s*\(\s*\(([^()]*)\)")
_CONVERTED = re.compile(r"\bCONVERSION_BASED_UNIT\s*\(\s*'[^']*'\s*,\s*(#\d+)")
_MEASURE = re.compile(r"LENGTH_MEASURE\s*\(\s*\+?(\d+\.?\d*(?:E[-+]?\d+)?)\s*\)\s*,\s*(#\d+)")
_SI_UNIT = re.compile(r"SI_UNIT\s*\(\s*(\$|\.\w+\.)\s*,\s*\.METRE\.")

Selection = selectors.Selector | tuple[selectors.Selector, ...]

RED_FACES = selectors.ColourFace(selectors.CONTACT_COLOUR)
BLUE_FACES = selectors.ColourFace(selectors.FIXED_COLOUR)
LIMIT: Final = 512 * MB  # largest file
_COMMENT: Final = r"/\*(?:[^*]++|\*(?!/))*+\*/"
_STATEMENT: Final = re.compile(
    rf"(?:\s++|{_COMMENT})*+"
    r"(?:(#\d++)\s*+=\s*+([A-Z][A-Z_0-9]*+)?+\s*+\()?+"
    rf"((?:[^';/]++|'[^']*+'|{_COMMENT}|/)*+);"
)
"""Number, keyword and rest of a statement; possessive quantifiers keep the time linear for any text."""


@dataclass(frozen=True)
class Region:
    """A name for solids of a CAD file, given by exactly one of their ``order`` in the file (from 1), their ``colour``
    or their ``solid`` name. It becomes a subdomain of the mesh, to which a material may be assigned.
    """

    name: str
    order: int = 0
    colour: Colour = ()
    solid: str = ""

    def __post_init__(self) -> None:
        if sum(map(bool, (self.order, self.colour, self.solid))) != 1:
            raise GeometryError(f"Region {self.name!r}: give exactly one of order, colour and solid")

    def matches(self, number: int, colour: Colour, name: str) -> bool:
        if self.colour:
            return bool(colour) and all(abs(a - b) <= 3 for a, b in zip(colour, self.colour, strict=True))
        return name == self.solid if self.solid else number == self.order

    def __str__(self) -> str:
        if self.colour:
            return f"colour {self.colour}"
        return f"name {self.solid!r}" if self.solid else f"number {self.order}"


@dataclass(frozen=True)
class Group:
    """A further surface group of a CAD part, for a support or a symmetry plane."""

    name: str
    faces: Selection


@dataclass(frozen=True)
class CadPart(shape.Shape):
    """The solids of a STEP or BREP file, conformal where they touch.

    ``unit``: metres per length unit of the file. None takes the unit that a STEP file states; a BREP file states
    none, so it needs one. ``overrule``: take ``unit`` although the STEP file states another. ``contact`` and
    ``fixed`` select the faces of the two groups, each by one selector or the union of several; by default the faces
    painted pure red and pure blue; with ``fixed`` = () nothing is clamped. ``groups``: more of them. ``regions``:
    names of solids; those without one are "solid_1", "solid_2", ..., and a single one is "seat". ``solid``: number
    (from 1) or name of the only solid that counts; None: those that hang together with the struck face; 0: all.
    """

    family: ClassVar[str] = "cad"

    path: Path
    unit: float | None = None
    contact: Selection = RED_FACES
    fixed: Selection = BLUE_FACES
    groups: tuple[Group, ...] = ()
    regions: tuple[Region, ...] = ()
    overrule: bool = False
    solid: int | str | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "path", Path(self.path))
        suffix = self.path.suffix.lower()
        if suffix not in STEP_SUFFIXES + BREP_SUFFIXES:
            known = ", ".join(STEP_SUFFIXES + BREP_SUFFIXES)
            raise GeometryError(f"{self.path}: unknown CAD format {suffix!r}; known are {known}", "file")
        if self.unit is None and suffix in BREP_SUFFIXES:
            raise GeometryError(f"{self.path}: a BREP file states no unit; give one (1e-3 for millimetres)")
        if self.unit is not None and not (math.isfinite(self.unit) and self.unit > 0.0):
            raise GeometryError(f"CadPart.unit = {self.unit:g}: must be > 0 (metres per length unit of the file)")
        names = ["contact", "fixed", *(group.name for group in self.groups)]
        if len(set(names)) < len(names):
            raise GeometryError(f"groups: each name must stand once, 'contact' and 'fixed' too; found {names}")

    @property
    def patches(self) -> selectors.Patches:
        groups = {"contact": self.contact, "fixed": self.fixed} | {group.name: group.faces for group in self.groups}
        chosen = {name: faces if isinstance(faces, tuple) else (faces,) for name, faces in groups.items()}
        return chosen if chosen["fixed"] else {name: faces for name, faces in chosen.items() if name != "fixed"}

    @property
    def source(self) -> str:
        return str(self.path)

    @property
    def unit_of_model(self) -> float:
        return imported_unit(self)

    def build(self, occ: Any) -> None:
        """Import the solids (in units of `imported_unit`) into the given gmsh OpenCASCADE model."""
        imported = occ.importShapes(str(self.path), highestDimOnly=True)
        solids = [entity for entity in imported if entity[0] == 3]
        if not solids:
            raise GeometryError(f"{self.path}: holds no solid, only surfaces or curves; close it in the CAD program")


def check_readable(path: Path) -> None:
    """Raise `GeometryError` for a file that is empty, of another kind, cut off, or points to other files."""
    text = cad_text(path).strip()
    if not text:
        raise GeometryError(f"{path}: is empty; export it again")
    if path.suffix.lower() in BREP_SUFFIXES:
        if not re.match(r"(DBRep_DrawableShape\s+)?CASCADE Topology", text):
            raise GeometryError(f"{path}: is no BREP file; it begins with {text[:20]!r}; export it again")
    elif not text.startswith("ISO-10303-21"):
        raise GeometryError(
            f"{path}: is no STEP file; it begins with {text[:20]!r} instead of 'ISO-10303-21;'; export it again"
        )
    elif not text.endswith("END-ISO-10303-21;"):
        raise GeometryError(f"{path}: is cut off; it does not end with 'END-ISO-10303-21;'. Export it again")
    elif other := next((number for number, keyword, _ in entities(text) if keyword in OTHER_FILES), None):
        raise GeometryError(f"{path}: {other} points to another file, which is not read; export the part as one file")


def check_size(part: CadPart, extent: tuple[float, ...]) -> None:
    """Raise `GeometryError` if the sides ``extent`` of the imported bounding box (metres) show a wrong unit."""
    unit = part.unit
    if part.path.suffix.lower() in STEP_SUFFIXES:
        stated = stated_unit(part.path)
        if not unit and not stated:
            raise GeometryError(f'{part.path}: states no length unit; state it: unit = "mm" (--unit mm)', "unit")
        if unit and stated and not part.overrule and not math.isclose(unit, stated, rel_tol=1e-6):
            raise GeometryError(
                f"{part.path}: the file states {stated:g} m per unit, unit says {unit:g}; the part measures "
                f"{_box(extent, stated / unit)} by the file, {_box(extent)} by unit. Leave unit out, or export it anew",
                "unit",
            )
        unit = unit or stated
    assert unit is not None
    if not SMALLEST <= max(extent) <= LARGEST:
        factor = 1e-3 if max(extent) > LARGEST else 1e3
        raise GeometryError(
            f"{part.path}: measures {_box(extent)} at {unit:g} m per unit; a seat is {SMALLEST:g} to {LARGEST:g} m. At "
            f"{factor * unit:g} m per unit it would measure {_box(extent, factor)}; check the unit",
            "unit",
        )


def _box(extent: tuple[float, ...], factor: float = 1.0) -> str:
    return " x ".join(f"{1e3 * factor * side:.4g}" for side in extent) + " mm"


def step_face_names(path: Path) -> list[tuple[str, str]]:
    """Return the name and gmsh's type ("" for an uncommon one) of the faces, shell by shell in the file's order."""
    faces: dict[str, tuple[str, str]] = {}
    kinds: dict[str, str] = {}
    ordered: list[str] = []
    for number, keyword, body in entities(cad_text(path)):
        if keyword in SURFACE_KINDS:
            kinds[number] = SURFACE_KINDS[keyword]
        elif keyword == "ADVANCED_FACE" and (face := _FACE.match(body)):
            faces[number] = (face[1], face[2])
        elif keyword == "CLOSED_SHELL" and (shell := _SHELL.match(body)):
            ordered += re.findall(r"#\d+", shell[1])
    pairs = [faces.get(face, ("", "")) for face in ordered]
    return [(name, kinds.get(surface, "")) for name, surface in pairs]


def imported_unit(part: CadPart) -> float:
    """Return metres per length unit of the imported model.

    OpenCASCADE turns STEP lengths into millimetres by the unit the file states, takes them for millimetres where it
    states none, and leaves BREP numbers as they are.
    """
    if part.unit is None:
        return 1e-3
    stated = stated_unit(part.path) if part.path.suffix.lower() in STEP_SUFFIXES else 1e-3
    return 1e-3 * part.unit / stated if stated else part.unit


def stated_unit(path: Path) -> float:
    """Return metres per length unit by the first context of a STEP file that states one; 0 where none does.

    Source: ISO 10303-41, measure_schema: a conversion based unit is a multiple of another unit.

    Raises:
        GeometryError: a unit is a multiple of nothing that the file holds, or of itself.
    """
    statements, used = _length_units(cad_text(path))
    return _metres(path, statements, used[0])[0] if used else 0.0


def state_directly(path: Path) -> None:
    """Rewrite the multiples in a STEP file that are length units as multiples of a unit of the SI.

    OpenCASCADE takes lengths in multiples of multiples for millimetres.
    """
    text = cad_text(path)
    statements, used = _length_units(text)
    direct: dict[str, str] = {}
    for unit in used:
        if converted := _CONVERTED.search(statements[unit]):
            _, factor, si = _metres(path, statements, unit)
            direct[converted[1]] = f"{converted[1]}=LENGTH_MEASURE_WITH_UNIT(LENGTH_MEASURE({factor:.17E}),{si});"
    if direct:
        text = re.sub(r"(#\d+)\s*=[^;]*;", lambda statement: direct.get(statement[1], statement[0]), text)
        path.write_text(text, "latin-1")


def _length_units(text: str) -> tuple[dict[str, str], list[str]]:
    """Return the statements of lengths and their units by number, and the numbers of the units that contexts assign."""
    statements: dict[str, str] = {}
    assigned: list[str] = []
    for number, keyword, body in entities(text):
        if keyword.endswith("MEASURE_WITH_UNIT") or (not keyword and _LENGTH.search(body)):
            statements[number] = body
        if not keyword and (context := _CONTEXT.search(body)):
            assigned += re.findall(r"#\d+", context[1])
    return statements, [unit for unit in assigned if _LENGTH_UNIT.search(statements.get(unit, ""))]


def _metres(path: Path, statements: Mapping[str, str], unit: str) -> tuple[float, float, str]:
    """Return metres per unit, its multiple of a unit of the SI, and the number of that one."""
    number, factor = unit, 1.0
    for _ in range(MOST_CONVERSIONS):
        body = statements.get(number, "")
        if (si := _SI_UNIT.search(body)) and si[1] in SI_PREFIX and 0.0 < factor < math.inf:
            return factor * SI_PREFIX[si[1]], factor, number
        converted = _CONVERTED.search(body)
        if not converted or not (measure := _MEASURE.search(statements.get(converted[1], ""))):
            break
        factor, number = factor * float(measure[1]), measure[2]
    raise GeometryError(f"{path}: {unit} states no length unit that is known; export it in millimetres")


def cad_text(path: Path) -> str:
    """Return the text of a STEP or BREP file. Raises `GeometryError` if it is no regular file, or too large."""
    return read_text(path, LIMIT, GeometryError, "latin-1")


def entities(text: str) -> Iterator[tuple[str, str, str]]:
    """Yield number, keyword ("" for a complex entity) and the text after the first bracket of every entity."""
    at = 0
    while statement := _STATEMENT.match(text, at):
        at = statement.end()
        if statement[1]:
            yield statement[1], statement[2] or "", statement[3]
