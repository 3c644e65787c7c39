"""Element sizes of a mesh."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from impact.quantities import check_numbers
from seatfem.structures.errors import GeometryError
from seatfem.units import write_quantity

COARSE: Final = 1 / 6  # element size for a look, far from the contact faces, over the diagonal of the body's box
SIZE_PER_WIDTH: Final = 2.0  # the same on the contact faces, over their width
GRADING: Final = 0.25  # growth of the element size per unit distance from the contact patch
GROWTH: Final = 0.6  # growth of that size for a look per unit distance from the contact faces


@dataclass(frozen=True)
class MeshSpec:
    """Element sizes [m], and the order of elements.

    ``size``: size in the bulk. ``contact_size``: size on the contact patch (None: that of the bulk). ``order``:
    polynomial order, 1 or 2. ``curved``: whether second-order elements follow curved faces (isoparametric). ``rings``:
    number of rings of the patch in a half section; nodes lie on their borders. ``fillets``: factor on the number of
    elements along each fillet of a half section.
    """

    size: float
    contact_size: float | None = None
    order: int = 2
    curved: bool = True
    rings: int = 1
    fillets: float = 1.0

    def __post_init__(self) -> None:
        for name, value in (("size", self.size), ("contact_size", self.contact_size)):
            check_numbers(GeometryError, **{f"MeshSpec.{name}": 0.0 if value is None else value})
            if value is not None and not (math.isfinite(value) and value > 0.0):
                raise GeometryError(f"MeshSpec.{name} = {value:g}: must be finite and > 0")
        if self.contact_size is not None and self.contact_size > self.size:
            raise GeometryError(
                f"MeshSpec.contact_size = {write_quantity(self.contact_size, 'length')}: must be <= size = "
                f"{write_quantity(self.size, 'length')}"
            )
        if self.order not in (1, 2):
            raise GeometryError(f"MeshSpec.order = {self.order}: must be 1 or 2")
        if self.rings < 1:
            raise GeometryError(f"MeshSpec.rings = {self.rings}: must be >= 1")
        if not (math.isfinite(self.fillets) and self.fillets > 0.0):
            raise GeometryError(f"MeshSpec.fillets = {self.fillets:g}: must be finite and > 0")

    @property
    def patch_size(self) -> float:
        """Return the element size on the contact patch."""
        return self.size if self.contact_size is None else self.contact_size

    @property
    def transition(self) -> float:
        """Return the distance over which the size grows from the patch's to the bulk's."""
        return (self.size - self.patch_size) / GRADING
