"""How finely a geometry is meshed."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

from seatfem.structures.errors import GeometryError
from seatfem.units import write_quantity

LEAST_LAYERS = 8  # of hexahedra around a full circle


@dataclass(frozen=True)
class MeshSpec:
    """Element sizes [m], and the kind of element.

    ``size``: in the bulk. ``contact_size``: on the contact patch (None: the bulk's). ``grading``: growth of the
    size per unit distance from the patch. ``order``: of the elements, 1 or 2. ``curved``: second-order elements
    follow curved faces (isoparametric). ``shape``: "tet" (a meridian: triangles) or "hex" (quadrilaterals).
    ``layers``: of hexahedra around the full circle or along the extrusion (None: as many as ``size`` makes at the
    outermost radius; graded from the patch along an extrusion). ``curvature``: elements per full turn of a curved
    face or edge of tetrahedral meshes, down to a quarter of the patch's size; 0 leaves curvature out of account.
    ``rings``: of the patch of a half section, at whose borders nodes lie. ``fillets``: factor on the elements along
    fillets of a half section, which ask for a number of their own.
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
        """Return the size on the contact patch."""
        return self.size if self.contact_size is None else self.contact_size

    @property
    def transition(self) -> float:
        """Return the distance over which the size grows from the patch's to the bulk's."""
        return (self.size - self.patch_size) / self.grading
