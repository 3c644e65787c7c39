"""Green's functions of seats that come from files: matrices, frequency responses."""

from __future__ import annotations

import numpy as np

from impact.greens.base import GreensFunction
from impact.measured.frf import FrequencyResponseError
from impact.measured.pole_fit import fit_poles
from impact.progress import Progress, silent
from seatfem.structures.inspection.imported import model_of, response_of
from seatfem.structures.kinds.imported import FrequencyResponseFile, Matrices
from seatfem.structures.model import ModelError, SecondOrderModel
from seatfem.structures.reduction.greens import reduce_model
from seatfem.structures.reduction.reducer import Reduction


def from_matrices(seat: Matrices, duration: float, progress: Progress = silent) -> tuple[SecondOrderModel, Reduction]:
    """The model in the files, and its Green's function for ``duration`` [s]."""
    model = model_of(seat)
    try:
        reduction = reduce_model(
            model,
            bandwidth=seat.greens.bandwidth,
            duration=duration,
            tolerance=seat.greens.tolerance,
            damping_ratio=seat.damping_ratio,
            method=seat.greens.method,
            max_vectors=seat.greens.max_vectors,
            progress=progress,
        )
    except (ModelError, np.linalg.LinAlgError) as problem:
        raise ModelError(f"{seat.stiffness}, {seat.mass}: {problem}") from problem
    return model, reduction


def from_response(seat: FrequencyResponseFile) -> GreensFunction:
    """Poles through the response. Raises `FrequencyResponseError`."""
    response = response_of(seat)
    try:
        return fit_poles(response, tolerance=seat.tolerance, free=seat.free)
    except FrequencyResponseError as problem:
        raise FrequencyResponseError(f"{seat.file}: {problem}") from problem
    except np.linalg.LinAlgError as problem:
        raise FrequencyResponseError(
            f"{seat.file}: no poles can be fitted ({problem}): some values are beyond all measure; check the units"
        ) from problem
