"""A rod in one dimension by line elements: the cheapest body on which finite elements meet the closed form."""

import numpy as np
import skfem

from seatfem.structures.model import Damping, DofMap, ModelError, Port, SecondOrderModel, as_csr


def rod_model(
    *,
    young: float,
    density: float,
    area: float,
    length: float,
    elements: int,
    order: int = 2,
    fixed_end: bool = True,
    damping: tuple[float, float] | None = None,
) -> SecondOrderModel:
    """Return E A u'' = rho A u_tt on 0 < x < length, pushed at x = 0 (port "contact"), fixed or free at x = length.

    Consistent mass. The port's normal points to -x, so b'u = -u(0); its impedance is Z = rho c A = A sqrt(E rho).
    Exact: w_n = (2 n - 1) pi c/(2 length) fixed, w_n = n pi c/length free, c = sqrt(E/rho).

    Args:
        young, density, area, length: [Pa], [kg/m^3], [m^2], [m].
        elements: number of equal elements.
        order: 1 or 2.
        damping: Rayleigh's (alpha [1/s], beta [s]).
    """
    for name, value in (("young", young), ("density", density), ("area", area), ("length", length)):
        if not value > 0:
            raise ModelError(f"rod: {name} = {value} must be positive")
    if elements < 1 or order not in (1, 2):
        raise ModelError(f"rod: {elements} elements of order {order}; give at least 1 element of order 1 or 2")
    mesh = skfem.MeshLine(np.linspace(0.0, length, elements + 1))
    element = skfem.ElementLineP1() if order == 1 else skfem.ElementLineP2()
    basis = skfem.Basis(mesh, element, intorder=2 * order)
    stiffness = as_csr(skfem.asm(skfem.BilinearForm(lambda u, v, _: young * area * u.grad[0] * v.grad[0]), basis))
    mass = as_csr(skfem.asm(skfem.BilinearForm(lambda u, v, _: density * area * u * v), basis))
    points = np.asarray(basis.doflocs)
    free = np.flatnonzero(points[0] < length * (1 - 1e-9)) if fixed_end else np.arange(points.shape[1])
    K, M = stiffness[free][:, free], mass[free][:, free]
    C = None if damping is None else damping[0] * M + damping[1] * K
    vector = -(np.abs(points[0, free]) < 1e-9 * length).astype(float)
    port = Port(vector, area, area * float(np.sqrt(young * density)))
    rayleigh = Damping(0.0, *(damping or (0.0, 0.0)))
    return SecondOrderModel(M, C, K, {"contact": port}, DofMap(points, free, mesh), known=rayleigh)
