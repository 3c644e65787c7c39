"""The annular seat: a plate with a port and a lip around it."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar, Literal

from pydantic import Field

from seatfem.fields import Gap, Length, default, of_same_names
from seatfem.structures.kinds.drawn import Turned
from seatfem.structures.outlines import BodyViews, length_text
from seatfem.structures.shapes import AnnularSeat


class Annular(Turned):
    """A circular plate with a port bore and a raised, rounded lip around it; the reed strikes the lip's flat top."""

    sample: ClassVar[str] = """
bore_radius = "5 mm"
lip_width = "1 mm"
material = "steel"
damping_ratio = 0.02
"""

    kind: Literal["annular"]
    bore_radius: Length = Field(description="radius of the port")
    lip_width: Length = Field(description="radial width of the lip, its rounded edges included")
    lip_height: Gap = default("0.5 mm", "height of the lip above the plate; 0 mm for a flat seat")
    lip_edge_radius: Gap = default("0.1 mm", "radius of the lip's upper edges; 0 mm for sharp ones")
    lip_fillet: Gap = default(
        "0 mm", "radius of the fillet at the lip's foot; 0 mm for a sharp corner, where elastic stress has no limit"
    )
    outer_radius: Length = default("12 mm", "radius of the plate")
    thickness: Length = default("8 mm", "thickness of the plate")

    def geometry(self) -> AnnularSeat:
        return of_same_names(AnnularSeat, self)

    def views(self, at: float | None = None, *, coarse: bool = False) -> BodyViews:
        """Return the outlines with the width of the lip beside that of its flat top."""
        views, edge = super().views(at), self.lip_edge_radius if self.lip_height else 0.0
        flat = next(size for size in views.sizes if size.text.startswith("contact"))
        text = f"lip {length_text(self.lip_width)} wide"
        lip = replace(flat, low=flat.low - edge, high=flat.high + edge, text=text)
        sizes = (*(size for size in views.sizes if size is not flat), *((flat,) if edge else ()), lip)
        return replace(views, sizes=sizes)

    def struck_part(self) -> tuple[float, float, float]:
        width = self.lip_width - (2 * self.lip_edge_radius if self.lip_height else 0.0)
        return self.struck_area, width, self.thickness + self.lip_height
