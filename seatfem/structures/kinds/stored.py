"""Bodies from files: Green's functions, modes and matrices."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
from pydantic import Field

from impact.greens import base, modal
from impact.storage import hdf5
from seatfem.fields import ExistingFile
from seatfem.structures import finite_elements, rings
from seatfem.structures import model as models
from seatfem.structures.formats import matrices
from seatfem.structures.formats.uff import Direction, System, read_modes_uff
from seatfem.structures.inspection.cad import opened, read_once
from seatfem.structures.kinds import elastic, structure
from seatfem.structures.kinds.motion import Moving
from seatfem.structures.method import Solved, Task
from seatfem.units import write_quantity


class GreensFile(Moving):
    """A Green's function computed or measured before."""

    group: ClassVar[str] = "imported"
    traits: ClassVar[structure.Traits] = replace(Moving.traits, has_rings=True)

    sample: ClassVar[str] = """
file = "seat.h5"
"""

    kind: Literal["greens"]
    file: ExistingFile = Field(description="the Green's function file, relative to the scene's folder")

    def problems(self) -> Iterator[structure.Finding]:
        yield from opened(self._read, {"file": self.file})

    def _read(self) -> base.GreensFunction:
        return hdf5.load_greens(self.file)

    def function(self, duration: float) -> base.GreensFunction:
        """Return the function in the file; raises `GreensFunctionError` if it ends before ``duration`` [s]."""
        greens = self._read()
        if greens.valid_for < duration * (1 - 1e-9):
            lasts, known = write_quantity(duration, "time"), write_quantity(greens.valid_for, "time", 6)
            raise base.GreensFunctionError(
                f"seat.file = {self.file.name}: the run lasts {lasts} (run.duration) but g is known up to {known}; "
                "shorten the run to that, or make the file anew for all of it (seatfem greens, with this "
                "run.duration), or from a longer record"
            )
        return greens

    def solve(self, task: Task) -> Solved:
        greens = self.function(task.duration)
        combined = greens if (number := task.method.rings) is None else rings.with_fewer_rings(greens, number)
        return Solved(combined, about={"seat_model": f"Green's function from {self.file.name}"})


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
    system: System | None = Field(None, description="units of the file, in place of those that it states")
    modal_mass: float | None = Field(
        None,
        gt=0,
        strict=True,
        description="modal mass of all modes in the file's unit of mass, in place of those in the file: 1 for "
        "mass-normalised shapes",
    )

    def problems(self) -> Iterator[structure.Finding]:
        yield from opened(self.function, {"file": self.file})

    def function(self) -> modal.ModalGreens:
        """Return the modes in the file, cached in the process. Raises `UffError`, `OSError`."""
        return read_once(_modes, (self.file, self.node, self.direction, self.system, self.modal_mass))

    def solve(self, task: Task) -> Solved:
        return Solved(self.function(), about={"seat_model": f"modes from {self.file.name}"})


class Matrices(elastic.Reduced):
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
    system: Literal["SI", "mm-t-s", "mm-kg-ms", "inch-lbf-s"] = Field("SI", description="units of the files")
    first_dof: Literal[0, 1] = Field(1, description="number of the first unknown in the contact file")
    constrained: Literal["refuse", "drop"] = Field("refuse", description="what to do with held unknowns")

    def problems(self) -> Iterator[structure.Finding]:
        files = {"mass": self.mass, "damping": self.damping, "contact": self.contact, "stiffness": self.stiffness}
        yield from opened(self.system_of_equations, files)

    @property
    def couples(self) -> bool:
        return self.damping is not None

    def system_of_equations(self) -> models.SecondOrderModel:
        """Return the model in the files, cached in the process. Raises `ModelError`, `OSError`."""
        files = (self.mass, self.stiffness, self.damping, self.contact)
        return read_once(_matrices, (*files, self.system, self.first_dof, self.constrained))

    def solve(self, task: Task) -> Solved:
        with task.watch("reduction"):
            model = self.system_of_equations()
            try:
                reduction = finite_elements.reduced(self, model, task)
            except (models.ModelError, np.linalg.LinAlgError) as problem:
                raise models.ModelError(f"{self.stiffness}, {self.mass}: {problem}") from problem
        about = {"seat_model": f"matrices from {self.stiffness.name}", "seat_dof": model.size}
        return Solved(reduction.greens, model=model, modes=reduction.modes, about=about)


def _modes(file: Path, node: int, direction: Direction, system: Any, modal_mass: float | None) -> modal.ModalGreens:
    return read_modes_uff(file, ports={"contact": (node, direction)}, system=system, modal_mass=modal_mass or 0.0)


def _matrices(
    mass: Path, stiffness: Path, damping: Path | None, contact: Path, system: Any, first_dof: Any, constrained: Any
) -> models.SecondOrderModel:
    options = {"system": system, "first_dof": first_dof, "constrained": constrained}
    return matrices.read_matrices(mass, stiffness, damping, ports={"contact": contact}, **options)
