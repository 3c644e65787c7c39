"""Faces and measures of the solid in a gmsh model, in metres; ``unit``: metres per length unit of the model."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from seatfem.geometry.faces import Colour, Face, Patches, select

NO_COLOUR = (0, 0, 255, 0)  # what gmsh answers for an entity that was never painted
POINTS_PER_CURVE = 17


def faces_of(model: Any, unit: float) -> list[Face]:
    """Every face of the solid, described."""
    return [_face(model, tag, unit) for _, tag in model.getEntities(2)]


def patch_tags(model: Any, patches: Patches, unit: float) -> dict[str, list[int]]:
    """gmsh tags of the faces of each group. Raises `GeometryError` on an empty or ambiguous selection."""
    faces = faces_of(model, unit)
    return {
        name: sorted({face.tag for selector in selectors for face in select(faces, selector, name)})
        for name, selectors in patches.items()
    }


def volume_of(model: Any, unit: float) -> float:
    """Volume of the CAD solid in cubic metres."""
    return unit**3 * float(sum(model.occ.getMass(3, tag) for _, tag in model.getEntities(3)))


def area_of(model: Any, tags: list[int], unit: float) -> float:
    """Area of CAD faces in square metres."""
    return unit**2 * float(sum(model.occ.getMass(2, tag) for tag in tags))


def _face(model: Any, tag: int, unit: float) -> Face:
    curves = [abs(curve) for _, curve in model.getBoundary([(2, tag)], oriented=False)]
    kind = model.getType(2, tag)
    x, y, z = (unit * c for c in model.occ.getCenterOfMass(2, tag))
    return Face(
        tag=tag,
        kind=kind,
        centre=(x, y, z),
        area=area_of(model, [tag], unit),
        outline=_outline(model, curves, unit),
        curves=frozenset(curves),
        normal=_normal(model, tag) if kind == "Plane" else None,
        colour=_colour(model, tag),
    )


def _outline(model: Any, curves: list[int], unit: float) -> NDArray[np.float64]:
    points = []
    for curve in curves:
        low, high = model.getParametrizationBounds(1, curve)
        where = np.linspace(low[0], high[0], POINTS_PER_CURVE)
        points.append(np.reshape(model.getValue(1, curve, where), (-1, 3)))
    return unit * np.concatenate(points) if points else np.empty((0, 3))


def _normal(model: Any, tag: int) -> tuple[float, float, float]:
    low, high = model.getParametrizationBounds(2, tag)
    x, y, z = model.getNormal(tag, [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2])
    return float(x), float(y), float(z)


def _colour(model: Any, tag: int) -> Colour | None:
    colour = tuple(int(c) for c in model.getColor(2, tag))
    return None if colour == NO_COLOUR else (colour[0], colour[1], colour[2], colour[3])
