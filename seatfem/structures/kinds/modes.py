"""A body known by its modes, measured or computed elsewhere."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import ClassVar, Literal

from pydantic import Field

from impact.greens.modal import ModalGreens
from impact.progress import Progress
from seatfem.fields import ExistingFile
from seatfem.machine.stopwatch import Stopwatch
from seatfem.structures.estimates.surrogate import Face, Surrogate
from seatfem.structures.inspection.opened import FileState, opened, state_of
from seatfem.structures.kinds.motion import Moving
from seatfem.structures.kinds.structure import Finding
from seatfem.structures.method import Method
from seatfem.structures.solved import Solved

Direction = Literal["+x", "-x", "+y", "-y", "+z", "-z"]
System = Literal["SI", "mm-N-s", "inch-lbf-s"]


class UniversalModes(Moving):
    """Measured or computed modes in a universal file (dataset 55)."""

    group: ClassVar[str] = "imported"
    sample: ClassVar[str] = """
file = "modes.unv"
node = 1
direction = "+z"
"""

    kind: Literal["modes"]
    file: ExistingFile = Field(description="the universal file")
    node: int = Field(strict=True, description="number of the contact's node")
    direction: Direction = Field(description="outward normal of the contact")
    system: System | None = Field(None, description="units, if the file states none")

    def problems(self) -> Iterator[Finding]:
        yield from opened(self.function, {"file": self.file})

    def function(self) -> ModalGreens:
        """Return the modes of the file, read once in a process. Raises `UffError`, `OSError`."""
        return _read(self.file, self.node, self.direction, self.system, state_of(self.file))

    def surrogate(self, duration: float, face: Face) -> Surrogate:
        return Surrogate(self.function(), True, f"the modes in {self.file.name}")

    def solve(
        self, method: Method, duration: float, watch: Stopwatch, progress: Progress, *, mesh_error: bool = True
    ) -> Solved:
        return Solved(self.function(), about={"seat_model": f"modes from {self.file.name}"})


@lru_cache(maxsize=2)
def _read(file: Path, node: int, direction: Direction, system: System | None, state: FileState) -> ModalGreens:
    from seatfem.structures.formats.uff import read_modes_uff  # of such bodies only

    del state  # part of the key
    return read_modes_uff(file, ports={"contact": (node, direction)}, units=system)
