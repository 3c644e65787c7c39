"""Element sizes of a mesh, and plans of rectangular solids as grids of quadrilaterals."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from seatfem.structures.errors import GeometryError
from seatfem.structures.shapes.loops import unshared
from seatfem.structures.shapes.shape import Rectangle
from seatfem.units import write_quantity

COARSE: Final = 1 / 6  # element size for a look, far from the contact faces, over the diagonal of the body's box
SIZE_PER_WIDTH: Final = 2.0  # the same on the contact faces, over their width
GROWTH: Final = 0.6  # growth of that size per unit distance from the contact faces
LEAST_LAYERS = 8  # fewest layers of hexahedra around a full circle


@dataclass(frozen=True)
class MeshSpec:
    """Element sizes [m], and the kind of element.

    ``size``: size in the bulk. ``contact_size``: size on the contact patch (None: that of the bulk). ``grading``:
    growth of the size per unit distance from the patch. ``order``: polynomial order, 1 or 2. ``curved``: whether
    second-order elements follow curved faces (isoparametric). ``shape``: "tet" (triangles in a meridian) or "hex"
    (quadrilaterals). ``layers``: number of layers of hexahedra around the full circle or along the extrusion (None: by
    ``size`` at the outermost radius, or graded from the patch along an extrusion). ``curvature``: elements per full
    turn of curved faces in tetrahedral meshes, down to a quarter of the patch's size; 0: no refinement by curvature.
    ``rings``: number of rings of the patch in a half section; nodes lie on their borders. ``fillets``: factor on the
    number of elements along each fillet of a half section.
    """

    size: float
    contact_size: float | None = None
    grading: float = 0.25
    order: int = 2
    curved: bool = True
    shape: Literal["tet", "hex"] = "tet"
    layers: int | None = None
    curvature: int = 0
    rings: int = 1
    fillets: float = 1.0

    def __post_init__(self) -> None:
        for name, value in (("size", self.size), ("contact_size", self.contact_size), ("grading", self.grading)):
            if value is not None and not (math.isfinite(value) and value > 0.0):
                raise GeometryError(f"MeshSpec.{name} = {value:g}: must be finite and > 0")
        if self.contact_size is not None and self.contact_size > self.size:
            raise GeometryError(
                f"MeshSpec.contact_size = {write_quantity(self.contact_size, 'length')}: must be <= size = "
                f"{write_quantity(self.size, 'length')}"
            )
        if self.order not in (1, 2):
            raise GeometryError(f"MeshSpec.order = {self.order}: must be 1 or 2")
        if self.shape not in ("tet", "hex"):
            raise GeometryError(f"MeshSpec.shape = {self.shape!r}: must be 'tet' or 'hex'")
        if self.layers is not None and self.layers < 1:
            raise GeometryError(f"MeshSpec.layers = {self.layers}: must be >= 1")
        if self.rings < 1:
            raise GeometryError(f"MeshSpec.rings = {self.rings}: must be >= 1")
        if not (math.isfinite(self.fillets) and self.fillets > 0.0):
            raise GeometryError(f"MeshSpec.fillets = {self.fillets:g}: must be finite and > 0")
        if self.curvature < 0:
            raise GeometryError(f"MeshSpec.curvature = {self.curvature}: must be >= 0")

    @property
    def patch_size(self) -> float:
        """Return the element size on the contact patch."""
        return self.size if self.contact_size is None else self.contact_size

    @property
    def transition(self) -> float:
        """Return the distance over which the size grows from the patch's to the bulk's."""
        return (self.size - self.patch_size) / self.grading


Floats = NDArray[np.float64]


def rectangle_plan(rectangle: Rectangle, spec: MeshSpec, sectors: int) -> dict[str, NDArray[Any]]:
    """Return "points" (n, 2), "cells" (m, 4 | 9), and "area:patch", or "line:sides_x" and "_y" without a patch."""
    sides, patch = rectangle.sides, rectangle.patch or rectangle.sides
    x, y = (half_axis(side, edge, spec) for side, edge in zip(sides, patch, strict=True))
    plane = _grid(x if sectors == 4 else _mirrored(x), y if sectors > 1 else _mirrored(y), spec.order)
    corners = plane["points"][plane["cells"][:, :4]]
    if rectangle.patch is None:
        ends = boundary_lines(plane)
        where = np.abs(plane["points"][ends])
        for k, name in enumerate(("sides_x", "sides_y")):
            plane[f"line:{name}"] = ends[np.all(np.isclose(where[:, :, k], sides[k], rtol=1e-9), axis=1)]
    else:
        plane["area:patch"] = np.flatnonzero(np.all(np.abs(corners.mean(axis=1)) < patch, axis=1))
    return plane


def boundary_lines(plane: dict[str, NDArray[Any]]) -> NDArray[np.int64]:
    """Return the ends (k, 2) of the sides of one quadrilateral only, in its orientation."""
    cells = plane["cells"][:, :4]
    ends = np.stack([cells, np.roll(cells, -1, axis=1)], axis=2).reshape(-1, 2)
    return unshared(ends)


def cut_lines(plane: dict[str, NDArray[Any]], sectors: int) -> dict[str, NDArray[Any]]:
    """Return the plane arrays of a sector with its cuts at the azimuths 0 and 2 pi / ``sectors`` as lines."""
    ends = boundary_lines(plane)
    out = dict(plane)
    for name, azimuth in (("symmetry_0", 0.0), ("symmetry_1", 2 * np.pi / sectors)):
        along = plane["points"] @ (np.cos(azimuth), np.sin(azimuth))
        across = plane["points"] @ (-np.sin(azimuth), np.cos(azimuth))
        slack = 1e-9 * np.abs(plane["points"]).max()
        on_ray = (np.abs(across) < slack) & (along > -slack)
        out[f"line:{name}"] = ends[on_ray[ends].all(axis=1)]
    return out


def half_axis(side: float, edge: float, spec: MeshSpec) -> Floats:
    """Return grid lines from 0 to ``side``: equidistant up to the ``edge`` of the patch, coarser beyond."""
    inner = np.linspace(0.0, edge, max(1, int(np.ceil(edge / spec.patch_size - 1e-9))) + 1)
    if edge == side:
        return inner
    return np.concatenate([inner, edge + graded(side - edge, spec.patch_size, spec.size, spec.grading)[1:]])


def _mirrored(half: Floats) -> Floats:
    return np.concatenate([-half[:0:-1], half])


def _grid(x: Floats, y: Floats, order: int) -> dict[str, NDArray[Any]]:
    if order == 2:
        x, y = (np.insert(line, range(1, len(line)), (line[1:] + line[:-1]) / 2) for line in (x, y))
    points = np.column_stack([np.tile(x, len(y)), np.repeat(y, len(x))])
    row, column = np.meshgrid(np.arange(0, len(y) - 1, order), np.arange(0, len(x) - 1, order), indexing="ij")
    first = (row * len(x) + column).ravel()
    across, up = order, order * len(x)
    steps = [0, across, across + up, up]
    if order == 2:
        steps += [1, 2 + len(x), 1 + up, len(x), 1 + len(x)]
    return {"points": points, "cells": first[:, None] + np.array(steps)}


def graded(length: float, fine: float, coarse: float, grading: float) -> Floats:
    """Return places from 0 to ``length``: spacing ``fine`` at 0, growing by ``grading`` up to ``coarse``."""
    places = [0.0]
    while places[-1] < length * (1 - 1e-9):
        places.append(places[-1] + min(coarse, fine + grading * max(0.0, places[-1] - fine)))
    if len(places) > 2 and length - places[-2] < (places[-1] - length):
        places.pop()
    return np.asarray(places) * (length / places[-1])
