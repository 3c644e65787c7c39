"""Geometries: frozen specs in SI units, each with its gmsh recipe, one family a file.

Recipes run only inside the gmsh process: nothing here imports gmsh.
"""

from __future__ import annotations

import hashlib
import sys
from dataclasses import fields, is_dataclass
from importlib import import_module
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

from seatfem.structures.shapes.annular import AnnularSeat
from seatfem.structures.shapes.bar import Bar
from seatfem.structures.shapes.block import Block
from seatfem.structures.shapes.cad import CadPart, Group, Region
from seatfem.structures.shapes.checks import GeometryError
from seatfem.structures.shapes.conical import ConicalSeat
from seatfem.structures.shapes.faces import Face
from seatfem.structures.shapes.profile import Edge, Profile
from seatfem.structures.shapes.revolved import Turning
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
from seatfem.structures.shapes.shape import Shape, families
from seatfem.structures.shapes.stopper import Stopper
from seatfem.structures.shapes.valve_plate import ValvePlate

__all__ = [
    "CONTACT_COLOUR",
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
    "Face",
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
    "Selector",
    "Shape",
    "Stopper",
    "Turning",
    "ValvePlate",
    "decode",
    "encode",
    "families",
    "fingerprint",
    "select",
]

Geometry = Shape


def encode(value: Any) -> Any:
    """A spec or selector as plain JSON data: its fields and a "kind"; of a family from elsewhere also its file."""
    if is_dataclass(value):
        kind = _kind_of(value)
        home = {} if type(value).__module__.startswith(__name__) else {"home": _home(type(value))}
        return {"kind": kind} | home | {f.name: encode(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, tuple):
        return [encode(item) for item in value]
    return str(value) if isinstance(value, Path) else value


def decode(data: Any) -> Any:
    """The inverse of `encode`; the module of a family from elsewhere is imported where it is not yet."""
    if isinstance(data, dict):
        if "home" in data and data["kind"] not in _kinds():
            _imported(*data["home"])
        values = {key: decode(item) for key, item in data.items() if key not in ("kind", "home")}
        return _kinds()[data["kind"]](**values)
    return tuple(decode(item) for item in data) if isinstance(data, list) else data


def fingerprint(geometry: Geometry) -> dict[str, Any]:
    """What a content hash should see: `encode`, with a file's path replaced by a hash of its content."""
    data: dict[str, Any] = encode(geometry)
    for key, value in vars(geometry).items():
        if isinstance(value, Path):
            with value.open("rb") as file:
                data[key] = hashlib.file_digest(file, "sha256").hexdigest()
    return data


def _kinds() -> dict[str, type[Any]]:
    return {each.family: each for each in families()} | SELECTORS | {"group": Group, "region": Region}


def _kind_of(value: Any) -> str:
    return next(name for name, spec in _kinds().items() if type(value) is spec)


def _home(spec: type[Any]) -> list[str]:
    """Module and file of a family that the program does not have of its own."""
    return [spec.__module__, str(getattr(sys.modules[spec.__module__], "__file__", ""))]


def _imported(module: str, file: str) -> None:
    """As the parent process has it."""
    try:
        import_module(module)
    except ImportError:
        spec = spec_from_file_location(module, file)
        assert spec is not None
        assert spec.loader is not None
        sys.modules[module] = made = module_from_spec(spec)
        spec.loader.exec_module(made)
