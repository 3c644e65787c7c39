"""Which road to g: the cheapest that applies, by a cost model measured once (benchmarks/cost_vs_dof.py)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from seatfem.structures.model import SecondOrderModel
from seatfem.structures.reduction.damping import uniform_loss
from seatfem.structures.reduction.lanczos_recursion import Recursion
from seatfem.structures.reduction.methods import Method

ALL_MODES: Final = 200  # unknowns up to which all modes cost less than a Krylov space
_PRODUCT = 1.2e-9  # s for each entry of K in a product
_ROW = 3e-8  # s for each unknown in a Lanczos step, beside the product
_FACTOR, _FACTOR_ORDER = 2.5e-7, 1.47  # s, of unknowns, P2 tetrahedra by PARDISO on two cores
_VECTOR = 2.6e-6  # s for each unknown and Krylov vector: solve, two products and the orthogonalisation
_VECTORS = 100  # a usual number for one port


@dataclass(frozen=True)
class Costs:
    """Predicted effort of the two large roads on one model.

    Attributes:
        products: K times a vector, over all ports, for Lanczos.
        lanczos, krylov: [s] on the machine of the cost model; only their ratio is used.
    """

    products: int
    lanczos: float
    krylov: float


def predict(model: SecondOrderModel, duration: float) -> Costs:
    """Lanczos: 1.2 T sqrt(theta_max)/4 steps, theta_max by 20 of them; Krylov: a factorization, 100 vectors a port."""
    recursion = Recursion(model)
    recursion.extend(20)
    steps = int(1.2 * duration * np.sqrt(recursion.highest()) / 4) + 30
    ports, n = len(model.ports), model.size
    products = steps * ports
    krylov = _FACTOR * n**_FACTOR_ORDER + _VECTORS * ports * _VECTOR * n
    return Costs(products, products * (_PRODUCT * model.K.nnz + _ROW * n), krylov)


def choose(model: SecondOrderModel, duration: float) -> tuple[Method, str]:
    """(road, why in a sentence with numbers) for method="auto"."""
    n = model.size
    if model.C is not None and model.rayleigh is None:
        return "second_order", f"{n} unknowns, and C is not alpha M + beta K: damping couples the modes"
    if n <= ALL_MODES:
        return "modes", f"{n} unknowns (up to {ALL_MODES}): all modes at once cost less than anything else"
    if model.mass_is_diagonal and uniform_loss(model) is not None:
        costs = predict(model, duration)
        compared = f"about {costs.lanczos:.2g} s against {costs.krylov:.2g} s predicted"
        if costs.lanczos <= costs.krylov:
            return "lanczos", f"diagonal mass, and {costs.products} products with K cover the duration: {compared}"
        return "krylov", f"{n} unknowns, one factorization instead of {costs.products} Lanczos products: {compared}"
    why = "differing loss factors need the modes' shapes" if model.mass_is_diagonal else "the mass is not diagonal"
    return "krylov", f"{n} unknowns and {why}: one factorization, and far fewer vectors than modes in the band"
