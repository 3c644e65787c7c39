"""Parts drawn in a CAD program: STEP and BREP files."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from seatfem.geometry.checks import GeometryError
from seatfem.geometry.selectors import CONTACT_COLOUR, FIXED_COLOUR, ColourFace, Patches, Selector

STEP_SUFFIXES = (".step", ".stp")
BREP_SUFFIXES = (".brep",)

SI_PREFIX = {"$": 1.0, ".KILO.": 1e3, ".DECI.": 1e-1, ".CENTI.": 1e-2, ".MILLI.": 1e-3, ".MICRO.": 1e-6}
NAMED_UNIT = {"INCH": 0.0254, "FOOT": 0.3048}

RED_FACES = ColourFace(CONTACT_COLOUR)
BLUE_FACES = ColourFace(FIXED_COLOUR)


@dataclass(frozen=True)
class CadPart:
    """One solid from a STEP or BREP file.

    ``unit``: metres per length unit of the file. None takes the unit that a STEP file states; a BREP file states
    none, so it needs one. ``contact`` and ``fixed`` select the faces of the two groups; by default the faces
    painted pure red and pure blue.
    """

    path: Path
    unit: float | None = None
    contact: Selector = RED_FACES
    fixed: Selector = BLUE_FACES

    def __post_init__(self) -> None:
        object.__setattr__(self, "path", Path(self.path))
        suffix = self.path.suffix.lower()
        if suffix not in STEP_SUFFIXES + BREP_SUFFIXES:
            known = ", ".join(STEP_SUFFIXES + BREP_SUFFIXES)
            raise GeometryError(f"{self.path}: unknown CAD format {suffix!r}; known are {known}")
        if self.unit is None and suffix in BREP_SUFFIXES:
            raise GeometryError(f"{self.path}: a BREP file states no unit; give one (1e-3 for millimetres)")
        if self.unit is not None and not (math.isfinite(self.unit) and self.unit > 0.0):
            raise GeometryError(f"CadPart.unit = {self.unit:g}: must be > 0 (metres per length unit of the file)")

    @property
    def patches(self) -> Patches:
        return {"contact": (self.contact,), "fixed": (self.fixed,)}


def build(part: CadPart, occ: Any) -> None:
    """Import the solid (in units of `imported_unit`) into the given gmsh OpenCASCADE model."""
    imported = occ.importShapes(str(part.path), highestDimOnly=True)
    solids = [entity for entity in imported if entity[0] == 3]
    if len(solids) != 1:
        raise GeometryError(f"{part.path}: holds {len(solids)} solids; exactly one is needed")


def imported_unit(part: CadPart) -> float:
    """Metres per length unit of the imported model.

    OpenCASCADE turns STEP lengths into millimetres by the unit the file states, and leaves BREP numbers as they are.
    """
    if part.unit is None:
        return 1e-3
    return 1e-3 * part.unit / stated_unit(part.path) if part.path.suffix.lower() in STEP_SUFFIXES else part.unit


def stated_unit(path: Path) -> float:
    """Metres per length unit, as the STEP file states it. Raises `GeometryError` where it states none."""
    text = path.read_text(encoding="latin-1")
    units = " ".join(re.findall(r"=\s*\(([^;]*\bLENGTH_UNIT\s*\(\s*\)[^;]*)\)\s*;", text))
    if named := re.search(r"CONVERSION_BASED_UNIT\s*\(\s*'(\w+)'", units):
        scale = NAMED_UNIT.get(named[1].upper())
    else:
        si = re.search(r"SI_UNIT\s*\(\s*(\$|\.\w+\.)\s*,\s*\.METRE\.", units)
        scale = SI_PREFIX.get(si[1]) if si else None
    if scale is None:
        raise GeometryError(f"{path}: states no length unit that is known")
    return scale
