"""The static compliance of a seat of finite elements."""

from __future__ import annotations

import numpy as np

from impact.modal import ModalGreens
from seatfem.model import SecondOrderModel
from seatfem.roads.damping import damping_of
from seatfem.roads.factorization import factorize
from seatfem.seats.statics import spring_of


def static_greens(model: SecondOrderModel, damping_ratio: float) -> ModalGreens:
    """b' K^-1 b delta(t): the static compliance of the patch alone, by one factorization.

    Raises:
        FactorizationError: a body that can move freely has no static compliance.
    """
    (port,) = model.ports.values()
    compliance = float(port.vector @ factorize(model.K, name="K").solve(port.vector))
    start = damping_of(model, damping_ratio).first_velocity() / (port.impedance or np.inf)
    return spring_of(compliance, start, model.port_names, {"method": "statics", "dof": model.size})
