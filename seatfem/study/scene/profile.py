"""The shape of a stopper's face along a reed, as a table of scenes."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import ClassVar, Final

import numpy as np
from pydantic import Field

from impact.files.csv_table import read_needed_csv
from impact.greens.base import Array
from seatfem.fields import Contradictions, ExistingFile, Gap, KeyProblem, Length, Table, absent, default
from seatfem.units import write_quantity

LENGTHS: Final = {"m": 1.0, "mm": 1e-3, "um": 1e-6, "in": 0.0254}
COLUMNS: Final = {"along": LENGTHS, "height": LENGTHS}
LIKE: Final = "'along [mm],height [mm]'"


class Profile(Table):
    """The shape of the stopper's face along a clamped reed, as of the retainer of a discharge valve.

    At a distance x from the reed's clamp the face lies gap + h(x) beyond the undeformed reed. The reed rolls on it in
    segments of equal areas (arcs), each with its own gap. A spring's stiffness is that of the whole face, spread evenly
    over the segments; the face of a solid is displaced as a whole, by its mean.
    """

    sample: ClassVar[str] = 'radius = "200 mm"'

    radius: Length | None = absent("radius of curvature from start on: h = radius - sqrt(radius^2 - (x - start)^2)")
    file: ExistingFile | None = Field(
        None,
        description="instead of the radius: CSV file with the header `along [mm],height [mm]`: distances x from the "
        "clamp, which rise, and heights h, linear in between",
    )
    own_face: bool = default(
        False,
        "instead of both: whether the heights are those of the struck face of a stopper of kind cad or mesh, seen "
        "along that axis of the part which is nearest to its normal. The end at which it comes nearest to the reed "
        "lies at start",
        strict=True,
    )
    start: Gap | None = absent(
        "distance of its beginning from the reed's clamp; where absent 0 mm, or the first one in the file"
    )
    end: Length | None = absent("distance of its end; where absent that of the reed, or the last one in the file")
    width: Length | None = absent("width across the reed; that of the reed where absent")

    def contradictions(self) -> Contradictions:
        if (self.radius is not None) + (self.file is not None) + self.own_face != 1:
            yield "radius", "give exactly one of radius, file and own_face"
            return
        if self.end is not None and self.end <= (self.start or 0.0):
            words = f"{write_quantity(self.end, 'length')} is not beyond start"
            yield "end", f"{words}; make it larger"
        if self.file is None:
            return
        along, _ = read_heights(self.file)
        for key, place in (("start", self.start), ("end", self.end)):
            if place is not None and not along[0] <= place <= along[-1]:
                ends = " to ".join(write_quantity(float(each), "length") for each in (along[0], along[-1]))
                yield key, f"{write_quantity(place, 'length')} lies beyond the heights of the file, known from {ends}"

    def begins(self) -> float:
        """Return the distance of its beginning from the reed's clamp [m]."""
        if self.start is not None:
            return self.start
        return 0.0 if self.file is None else float(read_heights(self.file)[0][0])


def read_heights(file: Path) -> tuple[Array, Array]:
    """Return places along a reed and heights (n,) in a file [m], cached in the process while it is unchanged. Raises
    `KeyProblem` for a file that cannot be used."""
    try:
        return _read(file, file.stat().st_mtime_ns)
    except (ValueError, OSError) as error:
        raise KeyProblem("file", str(error)) from None


@lru_cache(maxsize=4)
def _read(file: Path, _: int) -> tuple[Array, Array]:
    numbers, factors = read_needed_csv(file, ValueError, LIKE).quantities(COLUMNS)
    along, heights = (numbers * factors).T
    if len(along) < 2 or not np.all(np.diff(along) > 0):
        raise ValueError(f"{file}: its places must rise from row to row, in two rows or more")
    return along, heights
