"""The static compliance of a body of finite elements."""

from __future__ import annotations

import numpy as np

from impact.greens.modal import ModalGreens
from seatfem.structures.model import SecondOrderModel
from seatfem.structures.reduction.factorization import factorize
from seatfem.structures.statics import spring_of


def static_greens(model: SecondOrderModel, damping_ratio: float) -> ModalGreens:
    """B' K^-1 B delta(t): the static compliance of the ports alone, by one factorization.

    Raises:
        FactorizationError: a body that can move freely has no static compliance.
    """
    compliance = model.port_matrix.T @ factorize(model.K, name="K").solve(model.port_matrix)
    impedance = sum(port.impedance or np.inf for port in model.ports.values())
    start = model.damping.plus(damping_ratio).first_velocity() / impedance
    return spring_of(compliance, start, model.port_names, {"method": "statics", "dof": model.size})
