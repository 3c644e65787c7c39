"""How a body answers its ports, for stress: one static solution a port, and modes or Ritz pairs of a Krylov space."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from impact.greens.modal import ModalGreens, Residual
from seatfem.structures.model import Array, ModelError, SecondOrderModel
from seatfem.structures.reduction.factorization import FactorizationError, factorize
from seatfem.structures.reduction.krylov_basis import KrylovBasis
from seatfem.structures.reduction.modes import solve_modes
from seatfem.units import write_quantity

VECTORS: Final = 80  # of the Krylov space, for a body of one port: 0.4 % at most, at a fillet that is struck
MORE: Final = 20  # for each port more
MOST_PORTS: Final = 8  # of a Krylov space: of more ports so many blocks that all modes in the band are fewer
MOST: Final = 400
MODES: Final = 3.0  # times the band, up to which all modes are kept
EXACT: Final = 1e-10  # relative residual of static solutions
FEWER: Final = 0.75  # of the vectors, for the error bar


@dataclass(frozen=True)
class Pairs:
    """Modes by their coefficients (k, M) in the first k vectors of a space."""

    greens: ModalGreens
    coefficients: Array

    def modes(self, vectors: Array) -> Array:
        """Return the (n, M) shapes of the modes."""
        return np.asarray(vectors[:, : len(self.coefficients)] @ self.coefficients)


@dataclass(frozen=True)
class Response:
    """A body's answers to forces on its ports.

    Attributes:
        rest: (n, p) displacement under a force at rest on each.
        vectors: (n, k) M-orthonormal.
        pairs: modes or Ritz pairs in these.
        fewer: the same of `FEWER` of the vectors.
    """

    rest: Array
    vectors: Array
    pairs: Pairs
    fewer: Pairs

    @staticmethod
    def of(
        model: SecondOrderModel,
        *,
        bandwidth: float,
        dt: float,
        damping_ratio: float = 0.0,
        vectors: int | None = None,
        resting: bool = False,
    ) -> Response:
        """Return the response of a model.

        Args:
            model: M, K, ports and a damping that does not couple modes.
            bandwidth: [Hz] at which the space is right; of more than `MOST_PORTS` ports, all modes up to `MODES` times
                it.
            dt: step of the forces [s]; pairs above pi/dt, which a step would step over, are in the static part alone.
            damping_ratio: uniform, added to the model's own.
            vectors: of the Krylov space; default `VECTORS`, and `MORE` for each port but the first.
            resting: a body without slower pairs than pi/dt follows its forces at once, instead of being refused.

        Raises:
            ModelError: a body that nothing holds, damping that couples modes, a step too long.
        """
        if refusal := model.damping.plus(damping_ratio).refusal:
            raise ModelError(f"stress by modes: {refusal}")
        ports = len(model.ports)
        if ports > MOST_PORTS and (count := len((modes := solve_modes(model, up_to_hz=MODES * bandwidth)).omega)):
            V, shapes = modes.shapes, modes.shapes.T @ model.port_matrix
            ritz = [(modes.omega[:k], shapes[:k], np.eye(k)) for k in (count, max(1, int(FEWER * count)))]
        else:
            most = min(MOST, model.size, VECTORS + MORE * (ports - 1) if vectors is None else vectors)
            shift = 2 * math.pi * bandwidth
            basis = KrylovBasis(model, factorize(model.K + shift**2 * model.M, name="K + s^2 M"), shift, most)
            basis.grow(most)
            V, ritz = basis.V, [basis.ritz(k) for k in (basis.size, max(1, int(FEWER * basis.size)))]
            del basis  # and with it the factor, most of the memory
        pairs, fewer = (_pairs(model, damping_ratio, (dt, resting), V, each) for each in ritz)
        return Response(_at_rest(model, V, *ritz[0]), V, pairs, fewer)


Ritz = tuple[Array, Array, Array]
"""(k,) angular frequencies, (k, p) shapes at the ports, (k, k) coefficients in a space."""


def _at_rest(model: SecondOrderModel, V: Array, omega: Array, shapes: Array, coefficients: Array) -> Array:
    """Return the (n, p) K^-1 B. Galerkin's solution in a Krylov space is that of conjugate gradients after as many
    steps, with few ports exact to round-off; where it is not, a factor of K makes it."""
    if omega.all():
        displacements = np.asarray(V @ (coefficients @ (shapes / omega[:, None] ** 2)))
        B = model.port_matrix
        if np.linalg.norm(model.K @ displacements - B) < EXACT * np.linalg.norm(B):
            return displacements
    try:
        return factorize(model.K, name="K").solve(model.port_matrix)
    except FactorizationError as error:
        raise ModelError(f"stress of a body that nothing holds is not known: clamp a face of it ({error})") from error


def _pairs(model: SecondOrderModel, damping_ratio: float, step: tuple[float, bool], V: Array, ritz: Ritz) -> Pairs:
    """Return those slower than pi/dt, by their coefficients C."""
    (dt, resting), (omega, shapes, C), damping = step, ritz, model.damping.plus(damping_ratio)
    kept = omega * dt < math.pi
    if stiff := not kept.any():
        if not resting:
            raise ModelError(
                f"dt = {write_quantity(dt, 'time')}: no mode of the body is slower than pi/dt; shorten the step"
            )
        kept[0] = True
    loss = None if damping.loss is None else damping.losses(V[:, : len(C)] @ C[:, kept])
    zeta = damping.ratios(omega[kept], loss)
    zeta = np.maximum(zeta, 1.0) if stiff else zeta
    greens = ModalGreens(omega[kept], zeta, shapes[kept], Residual.none(shapes.shape[1]), model.port_names)
    return Pairs(greens, C[:, kept])
