"""Green's functions of seats that come from files: matrices, modes, frequency responses."""

from __future__ import annotations

import numpy as np

from impact.greens import GreensFunction
from impact.modal import ModalGreens
from impact.progress import Progress, silent
from seatfem.formats.matrices import read_matrices
from seatfem.formats.uff import read_frf_uff, read_modes_uff
from seatfem.measured.frf import FrequencyResponseError, read_frf
from seatfem.measured.pole_fit import fit_poles
from seatfem.model import ModelError, SecondOrderModel
from seatfem.roads.greens import Reduction, reduce_model
from seatfem.scene.imported import FrequencyResponseFile, Matrices, UniversalModes

UNIVERSAL = (".uff", ".unv")


def from_matrices(seat: Matrices, duration: float, progress: Progress = silent) -> tuple[SecondOrderModel, Reduction]:
    """The model in the files, and its Green's function for ``duration`` [s]."""
    model = read_matrices(
        seat.mass,
        seat.stiffness,
        seat.damping,
        ports={"contact": seat.contact},
        system=seat.system,
        first_dof=seat.first_dof,
        constrained=seat.constrained,
    )
    try:
        reduction = reduce_model(
            model,
            bandwidth=seat.greens.bandwidth,
            duration=duration,
            tolerance=seat.greens.tolerance,
            damping_ratio=seat.damping_ratio,
            method=seat.greens.method,
            progress=progress,
        )
    except (ModelError, np.linalg.LinAlgError) as problem:
        raise ModelError(f"{seat.stiffness}, {seat.mass}: {problem}") from problem
    return model, reduction


def from_modes(seat: UniversalModes) -> ModalGreens:
    """The modes of a universal file."""
    return read_modes_uff(seat.file, ports={"contact": (seat.node, seat.direction)}, units=seat.system)


def from_response(seat: FrequencyResponseFile) -> GreensFunction:
    """Poles through the response; raises `FrequencyResponseError` for a universal file without a node."""
    if seat.file.suffix.lower() not in UNIVERSAL:
        response = read_frf(seat.file)
    elif seat.node is None:
        raise FrequencyResponseError(f"{seat.file}: a universal file needs seat.node, the contact's node number")
    else:
        response = read_frf_uff(seat.file, ports={"contact": (seat.node, seat.direction)})
    try:
        return fit_poles(response, tolerance=seat.tolerance, free=seat.free)
    except FrequencyResponseError as problem:
        raise FrequencyResponseError(f"{seat.file}: {problem}") from problem
    except np.linalg.LinAlgError as problem:
        raise FrequencyResponseError(
            f"{seat.file}: no poles can be fitted ({problem}): some values are beyond all measure; check the units"
        ) from problem
