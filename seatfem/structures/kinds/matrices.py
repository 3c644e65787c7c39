"""A body known by the matrices of another finite element program."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from pydantic import Field

from impact.progress import Progress
from seatfem.fields import ExistingFile
from seatfem.machine.stopwatch import Stopwatch
from seatfem.structures.estimates.surrogate import Face, Surrogate, unknown
from seatfem.structures.inspection.opened import FileState, opened, state_of
from seatfem.structures.kinds.reduced import Reduced
from seatfem.structures.kinds.structure import Finding
from seatfem.structures.method import Method
from seatfem.structures.solved import Solved

if TYPE_CHECKING:
    from seatfem.structures.model import SecondOrderModel
    from seatfem.structures.natural_modes import NaturalModes, Wanted

System = Literal["SI", "mm-t-s", "mm-kg-ms", "inch-lbf-s"]
Constrained = Literal["refuse", "drop"]


class Matrices(Reduced):
    """Mass, stiffness and damping matrices of another finite element program (.mtx, .npz, .npy)."""

    group: ClassVar[str] = "imported"
    sample: ClassVar[str] = """
mass = "mass.mtx"
stiffness = "stiffness.mtx"
contact = "contact.csv"
damping_ratio = 0.02
"""

    kind: Literal["matrices"]
    mass: ExistingFile = Field(description="file of the mass matrix")
    stiffness: ExistingFile = Field(description="file of the stiffness matrix")
    damping: ExistingFile | None = Field(None, description="file of the damping matrix")
    contact: ExistingFile = Field(description="CSV file (dof,weight) of the contact face")
    system: System = Field("SI", description="units of the files")
    first_dof: Literal[0, 1] = Field(1, description="number of the first unknown in the contact file")
    constrained: Constrained = Field("refuse", description="what to do with held unknowns")

    def problems(self) -> Iterator[Finding]:
        files = {"mass": self.mass, "damping": self.damping, "contact": self.contact, "stiffness": self.stiffness}
        yield from opened(self.system_of_equations, files)

    @property
    def couples(self) -> bool:
        return self.damping is not None

    def surrogate(self, duration: float, face: Face) -> Surrogate:
        return unknown("matrices do not contain the size of the struck face", face)

    def system_of_equations(self) -> SecondOrderModel:
        """Return the model in the files, read once in a process. Raises `ModelError`, `OSError`."""
        files = (self.mass, self.stiffness, self.damping, self.contact)
        states = tuple(state_of(file) for file in files if file is not None)
        return _read(files, self.system, self.first_dof, self.constrained, states)

    def natural_modes(self, wanted: Wanted, watch: Stopwatch, progress: Progress) -> NaturalModes | None:
        from seatfem.structures.natural_modes import of_one  # of `seatfem modes` only

        model = self.system_of_equations()
        with watch("modes"):
            return of_one(model, None, wanted, progress)

    def solve(
        self, method: Method, duration: float, watch: Stopwatch, progress: Progress, *, mesh_error: bool = True
    ) -> Solved:
        from seatfem.structures.finite_elements import reduced  # plans load no reduction
        from seatfem.structures.model import ModelError

        with watch("reduction"):
            model = self.system_of_equations()
            try:
                reduction = reduced(self, model, method, duration, progress)
            except (ModelError, np.linalg.LinAlgError) as problem:
                raise ModelError(f"{self.stiffness}, {self.mass}: {problem}") from problem
        about = {"seat_model": f"matrices from {self.stiffness.name}", "seat_dof": model.size}
        return Solved(reduction.greens, model=model, modes=reduction.modes, about=about)


@lru_cache(maxsize=2)
def _read(
    files: tuple[Path, Path, Path | None, Path],
    system: System,
    first_dof: Literal[0, 1],
    constrained: Constrained,
    states: tuple[FileState, ...],
) -> SecondOrderModel:
    from seatfem.structures.formats.matrices import read_matrices  # of such bodies only

    del states  # part of the key
    mass, stiffness, damping, contact = files
    return read_matrices(
        mass,
        stiffness,
        damping,
        ports={"contact": contact},
        system=system,
        first_dof=first_dof,
        constrained=constrained,
    )
