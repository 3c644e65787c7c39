"""What is checked of every Green's function before it is handed out, and written into its provenance."""

from __future__ import annotations

import numpy as np

from impact.greens.modal import ModalGreens
from impact.greens.poles import PoleGreens
from impact.measured.pole_passivity import pole_passivity
from seatfem.structures.damping import Damping
from seatfem.structures.model import Array, SecondOrderModel


def reciprocity(matrix: Array) -> float:
    """Return max |G - G'| / max |G| of (p, p) or (p, p, n) values: 0 for a symmetric function."""
    largest = float(np.abs(matrix).max())
    return float(np.abs(matrix - np.swapaxes(matrix, 0, 1)).max()) / largest if largest else 0.0


def passivity(greens: ModalGreens) -> dict[str, object]:
    """Return whether it is passive, and by what margin.

    Modes with zeta >= 0 beside relaxations with positive rates and a positive semidefinite compliance cannot gain
    energy.
    """
    compliance = float(np.linalg.eigvalsh(greens.residual.compliance)[0])
    least = float(greens.zeta.min(initial=np.inf))
    return {
        "passive": bool(least >= 0 and compliance >= 0 and np.all(greens.residual.rates >= 0)),
        "least_damping_ratio": least if np.isfinite(least) else None,
        "least_residual_compliance": compliance,
    }


def passivity_of_poles(greens: PoleGreens) -> dict[str, object]:
    """Return the same of complex poles: the mobility's real part is searched over all frequencies."""
    verdict = pole_passivity(greens)
    return {"passive": verdict.passive, "margin": verdict.margin, "margin_at_Hz": verdict.frequency}


def feeding(model: SecondOrderModel, damping: Damping) -> str:
    """Say how the model's C would feed energy; "" where it does not, as far as its diagonal shows."""
    least = 0.0 if model.C is None else float(model.C.diagonal().min(initial=0.0))
    if least < 0:
        return f"C has a diagonal value {least:g}: it must not be negative and feed energy"
    return "" if damping.coupling else damping.refusal
