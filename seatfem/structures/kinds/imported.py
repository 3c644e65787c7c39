"""Seats known from another program's files or from a test on the bench."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from seatfem.fields import DampingRatio, ExistingFile, Table, Tolerance, default
from seatfem.structures.kinds.parts import GreensSettings


class Matrices(Table):
    """Mass, stiffness and damping matrices of another finite element program (.mtx, .npz, .npy)."""

    kind: Literal["matrices"]
    mass: ExistingFile = Field(description="file of the mass matrix")
    stiffness: ExistingFile = Field(description="file of the stiffness matrix")
    damping: ExistingFile | None = Field(None, description="file of the damping matrix")
    contact: ExistingFile = Field(description="CSV file (dof,weight) of the contact patch")
    system: Literal["SI", "mm-t-s", "mm-kg-ms", "inch-lbf-s"] = Field("SI", description="units of the files")
    first_dof: Literal[0, 1] = Field(1, description="number of the first unknown in the contact file")
    constrained: Literal["refuse", "drop"] = Field("refuse", description="what to do with held unknowns")
    damping_ratio: DampingRatio = Field(0.0, description="modal damping, the same for every mode")
    greens: GreensSettings = default({}, "how the Green's function is computed")


class UniversalModes(Table):
    """Measured or computed modes in a universal file (dataset 55)."""

    kind: Literal["modes"]
    file: ExistingFile = Field(description="the universal file")
    node: int = Field(strict=True, description="number of the contact's node")
    direction: Literal["+x", "-x", "+y", "-y", "+z", "-z"] = Field(description="outward normal of the contact")
    system: Literal["SI", "mm-N-s", "inch-lbf-s"] | None = Field(None, description="units, if the file states none")


class FrequencyResponseFile(Table):
    """A measured frequency response of the contact: poles are fitted to it."""

    kind: Literal["frf"]
    file: ExistingFile = Field(description="CSV file with quantities and units in its header, or a universal file (58)")
    node: int | None = Field(None, strict=True, description="of a universal file: number of the contact's node")
    direction: Literal["+x", "-x", "+y", "-y", "+z", "-z"] = Field(
        "+z", description="of a universal file: outward normal of the contact"
    )
    tolerance: Tolerance = default("1 %", "misfit of the poles")
    free: bool | None = Field(None, description="whether the body is free to move; told from the record if absent")
