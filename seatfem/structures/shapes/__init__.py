"""Geometry of seats: frozen specs in SI units, and one gmsh recipe per family.

A new family is one file with a frozen dataclass (its ``patches`` name the faces) and a ``build`` function, and one
line in ``FAMILIES``; a solid of revolution has a ``profile`` instead of a function of its own. Recipes receive the
OpenCASCADE part of a gmsh model, work in millimetres as CAD does, and run only inside the gmsh process: nothing here
imports gmsh.
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import Any

from seatfem.structures.shapes import bar, block, cad, revolved, stopper, valve_plate
from seatfem.structures.shapes.annular import AnnularSeat
from seatfem.structures.shapes.bar import Bar
from seatfem.structures.shapes.block import Block
from seatfem.structures.shapes.cad import CadPart, Group, Region
from seatfem.structures.shapes.checks import GeometryError
from seatfem.structures.shapes.conical import ConicalSeat
from seatfem.structures.shapes.faces import Face
from seatfem.structures.shapes.profile import Edge, Profile
from seatfem.structures.shapes.selectors import (
    CONTACT_COLOUR,
    FIXED_COLOUR,
    SELECTORS,
    ColourFace,
    ConeFace,
    CylinderFace,
    HalfPlaneFace,
    NamedFace,
    NumberedFace,
    PlaneFace,
    PointFace,
    Selector,
    select,
)
from seatfem.structures.shapes.stopper import Stopper
from seatfem.structures.shapes.valve_plate import ValvePlate

__all__ = [
    "CONTACT_COLOUR",
    "FAMILIES",
    "FIXED_COLOUR",
    "AnnularSeat",
    "Bar",
    "Block",
    "CadPart",
    "ColourFace",
    "ConeFace",
    "ConicalSeat",
    "CylinderFace",
    "Edge",
    "Extruded",
    "Face",
    "Family",
    "Geometry",
    "GeometryError",
    "Group",
    "HalfPlaneFace",
    "NamedFace",
    "NumberedFace",
    "PlaneFace",
    "PointFace",
    "Profile",
    "Region",
    "Revolved",
    "Selector",
    "Stopper",
    "ValvePlate",
    "decode",
    "encode",
    "family_of",
    "fingerprint",
    "model_unit",
    "select",
]

Geometry = AnnularSeat | ConicalSeat | Stopper | ValvePlate | Bar | Block | CadPart
Revolved = AnnularSeat | ConicalSeat | Stopper
Extruded = Stopper | ValvePlate | Bar | Block


@dataclass(frozen=True)
class Family:
    """A kind of seat: its spec, and the recipe that builds its solid in a gmsh OpenCASCADE model.

    ``plan``: the recipe for the areas of an extruded solid's plan, by name, where gmsh meshes it.
    """

    spec: type[Geometry]
    build: Callable[[Any, Any], None]
    plan: Callable[[Any, Any], dict[str, list[int]]] | None = None


FAMILIES: dict[str, Family] = {
    "annular": Family(AnnularSeat, revolved.build),
    "conical": Family(ConicalSeat, revolved.build),
    "stopper": Family(Stopper, revolved.build, stopper.plan),
    "valve_plate": Family(ValvePlate, valve_plate.build, valve_plate.plan),
    "bar": Family(Bar, bar.build),
    "block": Family(Block, block.build),
    "cad": Family(CadPart, cad.build),
}


def family_of(geometry: Geometry) -> Family:
    return next(family for family in FAMILIES.values() if isinstance(geometry, family.spec))


def model_unit(geometry: Geometry) -> float:
    """Metres per length unit of the gmsh model that the geometry's recipe builds."""
    return cad.imported_unit(geometry) if isinstance(geometry, CadPart) else 1e-3


def encode(value: Any) -> Any:
    """A spec or selector as plain JSON data: its fields and a "kind"."""
    if is_dataclass(value):
        return {"kind": _kind_of(value)} | {f.name: encode(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, tuple):
        return [encode(item) for item in value]
    return str(value) if isinstance(value, Path) else value


def decode(data: Any) -> Any:
    """The inverse of `encode`."""
    if isinstance(data, dict):
        return _kinds()[data["kind"]](**{key: decode(item) for key, item in data.items() if key != "kind"})
    return tuple(decode(item) for item in data) if isinstance(data, list) else data


def fingerprint(geometry: Geometry) -> dict[str, Any]:
    """What a content hash should see: `encode`, with a CAD file's path replaced by a hash of its content."""
    data: dict[str, Any] = encode(geometry)
    if isinstance(geometry, CadPart):
        with geometry.path.open("rb") as file:
            data["path"] = hashlib.file_digest(file, "sha256").hexdigest()
    return data


def _kinds() -> dict[str, type[Any]]:
    return {name: family.spec for name, family in FAMILIES.items()} | SELECTORS | {"group": Group, "region": Region}


def _kind_of(value: Any) -> str:
    return next(name for name, spec in _kinds().items() if type(value) is spec)
