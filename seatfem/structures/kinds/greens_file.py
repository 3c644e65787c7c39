"""A Green's function on file."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import ClassVar, Literal

from pydantic import Field

from impact.greens.base import GreensFunction, GreensFunctionError
from impact.progress import Progress
from seatfem.fields import ExistingFile
from seatfem.machine.stopwatch import Stopwatch
from seatfem.structures.estimates.surrogate import Face, Surrogate
from seatfem.structures.inspection.opened import opened
from seatfem.structures.kinds.motion import Moving
from seatfem.structures.kinds.structure import Finding, Traits
from seatfem.structures.method import Method
from seatfem.structures.rings import with_fewer_rings
from seatfem.structures.solved import Solved
from seatfem.units import write_quantity


class GreensFile(Moving):
    """A Green's function computed or measured before."""

    group: ClassVar[str] = "imported"
    traits: ClassVar[Traits] = replace(Moving.traits, has_rings=True)

    sample: ClassVar[str] = """
file = "seat.h5"
"""

    kind: Literal["greens"]
    file: ExistingFile = Field(description="the Green's function file, relative to the scene's folder")

    def problems(self) -> Iterator[Finding]:
        yield from opened(self._read, {"file": self.file})

    def _read(self) -> GreensFunction:
        from impact.storage.hdf5 import load_greens  # h5py takes long to load

        return load_greens(self.file)

    def function(self, duration: float) -> GreensFunction:
        """Return the function in the file; raises `GreensFunctionError` if it is not known for a run of ``duration``
        [s]."""
        greens = self._read()
        if greens.valid_for < duration * (1 - 1e-9):
            raise GreensFunctionError(
                f"seat.file = {self.file.name}: the run lasts {write_quantity(duration, 'time')} (run.duration) but "
                f"g is known up to "
                f"{write_quantity(greens.valid_for, 'time', 6)} only: shorten the run to that, or make the file "
                f"anew for all of it (seatfem "
                f"greens, with this run.duration): {greens.lengthened}"
            )
        return greens

    def surrogate(self, duration: float, face: Face) -> Surrogate:
        return Surrogate(self.function(duration), True, f"the function in {self.file.name}")

    def solve(
        self, method: Method, duration: float, watch: Stopwatch, progress: Progress, *, mesh_error: bool = True
    ) -> Solved:
        greens = self.function(duration)
        combined = greens if method.rings is None else with_fewer_rings(greens, method.rings)
        return Solved(combined, about={"seat_model": f"Green's function from {self.file.name}"})
