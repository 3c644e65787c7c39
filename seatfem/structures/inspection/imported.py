"""Matrices, modes and frequency responses in files, read once in a process."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import Literal

from impact.greens.base import GreensFunction, GreensFunctionError
from impact.greens.modal import ModalGreens
from impact.measured.frf import FrequencyResponse, FrequencyResponseError, read_frf
from impact.storage.hdf5 import load_greens
from seatfem.structures.formats.matrices import read_matrices
from seatfem.structures.formats.uff import read_frf_uff, read_modes_uff
from seatfem.structures.inspection.opened import FileState, state_of
from seatfem.structures.kinds.imported import FrequencyResponseFile, Matrices, UniversalModes
from seatfem.structures.model import SecondOrderModel
from seatfem.study.scene import GreensFile

UNIVERSAL = (".uff", ".unv")
_System = Literal["SI", "mm-t-s", "mm-kg-ms", "inch-lbf-s"]


def greens_of(seat: GreensFile, duration: float) -> GreensFunction:
    """The function in the file; raises `GreensFunctionError` if it is not known for a run of ``duration`` [s]."""
    greens = load_greens(seat.file)
    if greens.valid_for < duration * (1 - 1e-9):
        raise GreensFunctionError(
            f"seat.file = {seat.file.name}: the run lasts {duration:g} s (run.duration) but g is known up to "
            f"{greens.valid_for:.6g} s only: shorten the run to that, or make the file anew for all of it (seatfem "
            f"greens, with this run.duration): {greens.lengthened}"
        )
    return greens


def model_of(seat: Matrices) -> SecondOrderModel:
    """The model in the files. Raises `ModelError`, `OSError`."""
    files = (seat.mass, seat.stiffness, seat.damping, seat.contact)
    return _model(files, seat.system, seat.first_dof, seat.constrained, _states(files))


@lru_cache(maxsize=1)
def _model(
    files: tuple[Path, Path, Path | None, Path],
    system: _System,
    first_dof: Literal[0, 1],
    constrained: Literal["refuse", "drop"],
    states: tuple[FileState, ...],
) -> SecondOrderModel:
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


def modes_of(seat: UniversalModes) -> ModalGreens:
    """The modes of a universal file. Raises `UffError`, `OSError`."""
    return _modes(seat.file, seat.node, seat.direction, seat.system, _states([seat.file]))


@lru_cache(maxsize=1)
def _modes(
    file: Path,
    node: int,
    direction: Literal["+x", "-x", "+y", "-y", "+z", "-z"],
    system: Literal["SI", "mm-N-s", "inch-lbf-s"] | None,
    states: tuple[FileState, ...],
) -> ModalGreens:
    del states
    return read_modes_uff(file, ports={"contact": (node, direction)}, units=system)


def response_of(seat: FrequencyResponseFile) -> FrequencyResponse:
    """The measured response of the contact.

    Raises:
        FrequencyResponseError: what `read_frf` raises; a universal file without a node.
        UffError, OSError: as the readers.
    """
    return _response(seat.file, seat.node, seat.direction, _states([seat.file]))


@lru_cache(maxsize=1)
def _response(
    file: Path,
    node: int | None,
    direction: Literal["+x", "-x", "+y", "-y", "+z", "-z"],
    states: tuple[FileState, ...],
) -> FrequencyResponse:
    del states
    if file.suffix.lower() not in UNIVERSAL:
        return read_frf(file)
    if node is None:
        raise FrequencyResponseError(f"{file}: a universal file needs seat.node, the contact's node number")
    return read_frf_uff(file, ports={"contact": (node, direction)})


def _states(files: Sequence[Path | None]) -> tuple[FileState, ...]:
    return tuple(state_of(file) for file in files if file is not None)
