"""Materials by name: a short list of generic values at room temperature, each from a source; SI.

Alloys of one name differ by a few percent in the modulus, castings by more: state what you have measured.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final


@dataclass(frozen=True)
class NamedMaterial:
    """An isotropic material's constants and where they are from.

    Attributes:
        young: Young's modulus [Pa].
        poisson: Poisson's ratio.
        density: [kg/m^3].
        source: of the three.
    """

    young: float
    poisson: float
    density: float
    source: str


NAMED_MATERIALS: Final[Mapping[str, NamedMaterial]] = MappingProxyType(
    {
        "steel": NamedMaterial(
            200e9, 0.3, 7850.0, "ANSI/AISC 360: E = 200 GPa, G = 77.2 GPa; AISC Manual, weights: 490 lb/ft^3"
        ),
        "stainless valve steel": NamedMaterial(
            215e9, 0.3, 7700.0, "EN 10088-1, annex E, martensitic 1.4031 (strip like 7C27Mo2); EN 1993-1-4"
        ),
        "stainless steel": NamedMaterial(
            200e9, 0.3, 7900.0, "EN 10088-1, annex E, austenitic 1.4301; EN 1993-1-4, 2.1.3"
        ),
        "grey cast iron": NamedMaterial(
            110e9, 0.26, 7200.0, "EN 1561, annex A, EN-GJL-250: E = 103 to 118 GPa, nu = 0.26, 7.20 g/cm^3"
        ),
        "ductile cast iron": NamedMaterial(
            169e9, 0.275, 7100.0, "EN 1563, EN-GJS-400-15: E = 169 GPa, nu = 0.275, 7.1 g/cm^3"
        ),
        "aluminium": NamedMaterial(70e9, 0.3, 2700.0, "EN 1999-1-1, 3.2.5: design values of wrought alloys"),
        "titanium": NamedMaterial(
            113.8e9, 0.342, 4430.0, "Ti-6Al-4V, annealed; Materials Properties Handbook: Titanium Alloys, ASM (1994)"
        ),
        "PEEK": NamedMaterial(
            4.0e9, 0.4, 1300.0, "unfilled; Victrex 450G data sheet (ISO 527, ISO 1183); nu of the maker's guide"
        ),
    }
)
"""By the name that a scene may write."""

ALIASES: Final[Mapping[str, str]] = MappingProxyType({"cast iron": "grey cast iron", "aluminum": "aluminium"})


def named_material(name: str) -> NamedMaterial | None:
    """Return the material of that name, whatever its case; ``None`` where the list has none."""
    wanted = " ".join(name.casefold().replace("_", " ").replace("-", " ").split())
    wanted = ALIASES.get(wanted, wanted)
    return next((material for known, material in NAMED_MATERIALS.items() if known.casefold() == wanted), None)
