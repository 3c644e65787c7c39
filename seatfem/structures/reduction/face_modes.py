"""A lip struck in many arcs, on a body of any shape: its modes in the band, counted, and its statics.

    G_ij(t) = sum over k of phi_ki phi_kj sin(w_k t)/w_k  +  an exponential

of modes up to a cutoff, whose number does not grow with that of the arcs; as `lip_modes`, of one model whose ports are
the arcs. All statics take one factorization. Krylov vectors of so many ports would be as many pairs, which every arc
feels.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from impact.greens.base import ErrorEstimate
from impact.greens.modal import ModalGreens
from seatfem.structures.errors import ModelError
from seatfem.structures.method import BEYOND, MOST_MODES, Aims
from seatfem.structures.model import SecondOrderModel
from seatfem.structures.reduction.eigen_search import CrowdedError, counting_shift
from seatfem.structures.reduction.factorization import factorize
from seatfem.structures.reduction.modal import with_modes
from seatfem.structures.reduction.modes import ConvergenceError, Modes, solve_modes
from seatfem.structures.reduction.residual import residual
from seatfem.units import write_quantity

PUSHED: Final = 8  # ports under whose impulses the error is judged, all around the lip


def face_greens(
    model: SecondOrderModel, aims: Aims, damping_ratio: float = 0.0, *, static: bool = False
) -> tuple[ModalGreens, Modes | None]:
    """Return the Green's function of all ports of a model, and the modes that it is made of.

    Args:
        model: its ports are the parts of the lip.
        aims: the band, in which the error is judged; the tolerance is not asked for.
        damping_ratio: of every mode, beside the model's own.
        static: without modes: the exponential from 1/Z_i on each part to the static compliance.

    Raises:
        ModelError: damping that couples the modes. FactorizationError: a body that is free to move, where no modes are
        asked for. ConvergenceError: more than `MOST_MODES` modes, or some that are not found.
    """
    damping = model.damping.plus(damping_ratio)
    if damping.refusal and not static:
        raise ModelError(f"contact.ports: lip segments need modes of the seat: {damping.refusal}")
    origin = {"bandwidth_Hz": aims.bandwidth, "damping_ratio": damping_ratio, "dof": model.size}
    modes = None if static else _modes(model, aims)
    if modes is None or not len(modes.omega):
        compliance = model.port_matrix.T @ factorize(model.K, backend=aims.backend, name="K").solve(model.port_matrix)
        none = np.zeros(0)
        rest = residual(compliance, model, damping)
        greens = ModalGreens(none, none, np.zeros((0, len(model.ports))), rest, model.port_names)
        return greens.with_error(ErrorEstimate(reduction=0.0), {"method": "statics", **origin}), modes
    pushed = range(0, len(model.ports), max(1, len(model.ports) // PUSHED))
    greens = with_modes(model, damping, modes, BEYOND * aims.bandwidth, aims, pushed)
    return greens.with_error(greens.error, {**greens.origin, "method": "modes", **origin}), modes


def _modes(model: SecondOrderModel, aims: Aims) -> Modes:
    """Return all up to `BEYOND` times the band; `ConvergenceError` of too many names a band with few enough."""
    try:
        return solve_modes(model, up_to_hz=BEYOND * aims.bandwidth, limit=MOST_MODES, backend=aims.backend)
    except CrowdedError as crowded:
        count, lower = crowded.count, aims.bandwidth
        while count > MOST_MODES:
            lower *= 0.95 * (MOST_MODES / count) ** (1 / 3)
            count = counting_shift(model, (2 * np.pi * BEYOND * lower) ** 2, aims.backend).count
        raise ConvergenceError(
            f"contact.ports: the seat has {crowded.count} modes below {BEYOND:g} times seat.greens.bandwidth = "
            f"{write_quantity(aims.bandwidth, 'frequency', 3)} (limit {MOST_MODES}): lower it to "
            f"{write_quantity(lower, 'frequency', 3)}"
        ) from None
