"""Checks shared by the geometry specs."""

from __future__ import annotations

import math

from seatfem.structures.errors import GeometryError

__all__ = ["GeometryError", "check_quarters", "require_below", "require_positive"]


def require_positive(spec: object, *fields: str) -> None:
    """Raise `GeometryError` unless every named field of ``spec`` is a finite length > 0 (in metres)."""
    for field in fields:
        value = getattr(spec, field)
        if not (math.isfinite(value) and value > 0.0):
            raise GeometryError(f"{type(spec).__name__}.{field} = {value:g} m: must be a finite length > 0")


def require_below(spec: object, field: str, limit: float, meaning: str, *, inclusive: bool = False) -> None:
    """Raise `GeometryError` unless ``spec.field`` is below ``limit`` (metres), which ``meaning`` explains."""
    value = getattr(spec, field)
    if not (value < limit or (inclusive and value == limit)):
        sign = "<=" if inclusive else "<"
        raise GeometryError(f"{type(spec).__name__}.{field} = {value:g} m: must be {sign} {limit:g} m ({meaning})")


def check_quarters(shape: object, sectors: int) -> None:
    """Raise `GeometryError` of a rectangular solid that is cut into other sectors than halves and quarters."""
    if sectors not in (2, 4):
        name = type(shape).__name__
        raise GeometryError(f"sector = {sectors}: a {name} has 2 or 4 equal sectors between planes of symmetry")
