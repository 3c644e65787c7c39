"""What is checked of every Green's function before it is handed out, and written into its provenance."""

from __future__ import annotations

import numpy as np

from impact.greens.base import GreensFunction
from impact.measured.pole_passivity import pole_passivity
from seatfem.structures.model import Array


def reciprocity(matrix: Array) -> float:
    """max |G - G'| / max |G| of (p, p) or (p, p, n) values: 0 for a symmetric function."""
    largest = float(np.abs(matrix).max())
    return float(np.abs(matrix - np.swapaxes(matrix, 0, 1)).max()) / largest if largest else 0.0


def passivity(greens: GreensFunction) -> dict[str, object]:
    """Passive or not, and by what margin.

    Modes with zeta >= 0 beside relaxations with positive rates and a positive semidefinite compliance cannot gain
    energy; of complex poles the mobility's real part is searched over all frequencies.
    """
    if (modal := greens.modal) is not None:
        compliance = float(np.linalg.eigvalsh(modal.residual.compliance)[0])
        least = float(modal.zeta.min(initial=np.inf))
        return {
            "passive": bool(least >= 0 and compliance >= 0 and np.all(modal.residual.rates >= 0)),
            "least_damping_ratio": least if np.isfinite(least) else None,
            "least_residual_compliance": compliance,
        }
    if (poles := greens.pole_sum) is not None:
        verdict = pole_passivity(poles)
        return {"passive": verdict.passive, "margin": verdict.margin, "margin_at_Hz": verdict.frequency}
    return {}
