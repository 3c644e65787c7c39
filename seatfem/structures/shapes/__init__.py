"""Geometries: frozen dataclasses in SI units, each with the function that builds it in gmsh.

These functions run in the gmsh process only: nothing here imports gmsh.
"""

from __future__ import annotations

import hashlib
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any

from seatfem.machine.code import is_ours, sources_from_elsewhere
from seatfem.structures.errors import GeometryError
from seatfem.structures.shapes.blocks import Bar, Block, ValvePlate
from seatfem.structures.shapes.cad import CadPart, Group, Region
from seatfem.structures.shapes.flat import Disc, Flapper, HeldDisc, RingPlate
from seatfem.structures.shapes.flat import Flat as Flat
from seatfem.structures.shapes.outlined import Outlined
from seatfem.structures.shapes.profile import Edge as Edge
from seatfem.structures.shapes.profile import Profile as Profile
from seatfem.structures.shapes.revolved import AnnularSeat, Ball, ConicalSeat, Stopper
from seatfem.structures.shapes.revolved import Turning as Turning
from seatfem.structures.shapes.selectors import CONTACT_COLOUR as CONTACT_COLOUR
from seatfem.structures.shapes.selectors import FIXED_COLOUR as FIXED_COLOUR
from seatfem.structures.shapes.selectors import (
    SELECTORS,
    Axis,
    ColourFace,
    ConeFace,
    CylinderFace,
    NamedFace,
    NumberedFace,
    PlaneFace,
    PointFace,
    select,
)
from seatfem.structures.shapes.selectors import Face as Face
from seatfem.structures.shapes.selectors import HalfPlaneFace as HalfPlaneFace
from seatfem.structures.shapes.selectors import Selector as Selector
from seatfem.structures.shapes.shape import Shape as Shape
from seatfem.structures.shapes.shape import families as families
from seatfem.structures.shapes.shape import home_of, load_from_home

__all__ = [
    "AnnularSeat",
    "Ball",
    "Bar",
    "Block",
    "CadPart",
    "ColourFace",
    "ConeFace",
    "ConicalSeat",
    "CylinderFace",
    "Disc",
    "Flapper",
    "GeometryError",
    "Group",
    "HeldDisc",
    "NamedFace",
    "NumberedFace",
    "Outlined",
    "PlaneFace",
    "PointFace",
    "Region",
    "RingPlate",
    "Stopper",
    "ValvePlate",
    "select",
]

Geometry = Shape


def encode(value: Any) -> Any:
    """Return a spec or selector as plain JSON data: its fields and a "kind"; of a family from elsewhere also its
    "home"."""
    if is_dataclass(value):
        named = next((name for name, spec in SELECTORS.items() if type(value) is spec), type(value).__name__.lower())
        kind = {"kind": value.family if isinstance(value, Shape) else named} | (
            {} if is_ours(type(value)) else {"home": home_of(type(value))}
        )
        return kind | {f.name: encode(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, tuple):
        return [encode(item) for item in value]
    return str(value) if isinstance(value, Path) else value


def decode(data: Any) -> Any:
    """Return the inverse of `encode`; the file of a family from elsewhere is run where it was not yet."""
    if isinstance(data, dict):
        spec = load_from_home(*data["home"]) if "home" in data else _kinds()[data["kind"]]
        return spec(**{key: decode(item) for key, item in data.items() if key not in ("kind", "home")})
    return tuple(decode(item) for item in data) if isinstance(data, list) else data


def fingerprint(geometry: Geometry) -> dict[str, Any]:
    """Return what a content hash should see: `encode`, with the path of a file, and a home, replaced by hashes of
    contents."""
    data: dict[str, Any] = encode(geometry)
    if "home" in data:
        data["home"] = sources_from_elsewhere(type(geometry))
    for key, value in vars(geometry).items():
        if isinstance(value, Path):
            with value.open("rb") as file:
                data[key] = hashlib.file_digest(file, "sha256").hexdigest()
    return data


def _kinds() -> dict[str, type[Any]]:
    return {each.family: each for each in families()} | SELECTORS | {"group": Group, "region": Region, "axis": Axis}
