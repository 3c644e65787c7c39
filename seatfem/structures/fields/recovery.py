"""Stress in time, by mode acceleration: a modal sum and the exact static response to the force on each port.

sigma(t) = sum_k C phi_k q_k(t) + (C K^-1 b - sum_k C phi_k phi_k'b / w_k^2) n(t)

with modal coordinates q_k under the contact force F, and n' = rate (F - n), rate = 2 w_max: the force as the truncated
modes follow it. Without the static part, stress near a force would converge as slowly as the modal sum of a point load.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from impact.after.stresses import coordinates
from impact.bodies.body import Body
from impact.greens.modal import ModalGreens, Residual
from seatfem.structures.fields.peaks import Field, Integers, norms
from seatfem.structures.fields.peaks import Largest as Largest
from seatfem.structures.fields.peaks import LargestStress as LargestStress
from seatfem.structures.fields.peaks import largest as largest
from seatfem.structures.fields.peaks import principal as principal
from seatfem.structures.fields.peaks import von_mises as von_mises
from seatfem.structures.model import Array, ModelError, SecondOrderModel
from seatfem.structures.reduction.factorization import FactorizationError, factorize
from seatfem.structures.reduction.krylov import KrylovBasis
from seatfem.structures.reduction.modes import solve_modes
from seatfem.units import write_quantity

VECTORS: Final = 80  # Krylov vectors for a body of one port: stress error at most 0.4 %, at a fillet that is struck
MORE: Final = 20  # Krylov vectors for each further port
MOST_PORTS: Final = 8  # most ports of a Krylov space: with more ports all modes in the band are fewer vectors
MOST: Final = 400  # most Krylov vectors
MODES: Final = 3.0  # frequency up to which all modes are kept, over the bandwidth
EXACT: Final = 1e-10  # largest relative residual of static solutions
FEWER: Final = 0.75  # fraction of the vectors in the smaller space, whose stress gives the error bar


@dataclass(frozen=True)
class Pairs:
    """Modes or Ritz pairs of a space.

    Attributes:
        omega: (M,) angular frequencies [rad/s].
        zeta: (M,) damping ratios.
        shapes: (M, p) mode shapes at the ports [1/sqrt(kg)].
        coefficients: (k, M) coefficients of the modes in the first k vectors of the space.
    """

    omega: Array
    zeta: Array
    shapes: Array
    coefficients: Array

    def slower(self, dt: float, *, resting: bool) -> Pairs:
        """Return the pairs below the Nyquist frequency pi/dt of a step ``dt`` [s].

        If there is none, a ``resting`` body keeps its slowest pair, critically damped, so that it follows its forces;
        other bodies raise `ModelError`.
        """
        below = self.omega * dt < math.pi
        if none_below := not below.any():
            if not resting:
                raise ModelError(
                    f"dt = {write_quantity(dt, 'time')}: no mode of the body is slower than pi/dt; shorten the step"
                )
            below[0] = True
        zeta = np.maximum(self.zeta[below], 1.0) if none_below else self.zeta[below]
        return Pairs(self.omega[below], zeta, self.shapes[below], self.coefficients[:, below])


@dataclass(frozen=True)
class Response:
    """A body's static and modal response to forces on its ports, for any time step.

    Attributes:
        rest: (n, p) static displacement under a unit force on each port.
        vectors: (n, k) M-orthonormal basis.
        pairs: modes or Ritz pairs in this basis.
        fewer: modes or Ritz pairs in `FEWER` of the basis, for the error bar.
        ports: names of the ports.
        resting: a body without pairs below pi/dt follows its forces quasi-statically, instead of being refused.
    """

    rest: Array
    vectors: Array
    pairs: Pairs
    fewer: Pairs
    ports: tuple[str, ...]
    resting: bool = False

    @staticmethod
    def from_model(
        model: SecondOrderModel,
        *,
        bandwidth: float,
        damping_ratio: float = 0.0,
        vectors: int = 0,
        resting: bool = False,
    ) -> Response:
        """Return the response of a model.

        Args:
            model: M, K, ports and a damping that does not couple modes.
            bandwidth: frequency [Hz] at which the Krylov space is built; a model of more than `MOST_PORTS` ports
                takes all modes up to `MODES` times it.
            damping_ratio: uniform modal damping, added to the model's own.
            vectors: size of the Krylov space; 0: `VECTORS`, and `MORE` for each port but the first.
            resting: as the attribute.

        Raises:
            ModelError: the body is unsupported, or its damping couples modes.
        """
        damping = model.damping.plus(damping_ratio)
        if refusal := damping.refusal:
            raise ModelError(f"stress by modes: {refusal}")
        ports = len(model.ports)
        if ports > MOST_PORTS and (count := len((modes := solve_modes(model, up_to_hz=MODES * bandwidth)).omega)):
            V, shapes = modes.shapes, modes.shapes.T @ model.port_matrix
            ritz = [(modes.omega[:k], shapes[:k], np.eye(k)) for k in (count, max(1, int(FEWER * count)))]
        else:
            most = min(MOST, model.size, vectors or VECTORS + MORE * (ports - 1))
            shift = 2 * math.pi * bandwidth
            factor = factorize(model.K + shift**2 * model.M, name="K + s^2 M")
            basis = KrylovBasis(model, factor, shift, most, np.zeros((model.size, 0)))
            basis.grow(most)
            V, ritz = basis.V, [basis.ritz(k) for k in (basis.size, max(1, int(FEWER * basis.size)))]
            del basis, factor  # frees the factorisation, most of the memory
        losses = [0.0 if damping.loss is None else damping.losses(V[:, : len(C)] @ C) for *_, C in ritz]
        pairs, fewer = (
            Pairs(omega, damping.ratios(omega, loss), at_ports, C)
            for (omega, at_ports, C), loss in zip(ritz, losses, strict=True)
        )
        return Response(_solve_statically(model, V, *ritz[0]), V, pairs, fewer, model.port_names, resting)

    def stress(self, functional: Any, points: Array) -> StressSpace:
        """Return the stress at points (P, d) from ``functional``, the (6 P, n) stress C per unknown."""
        columns = functional @ np.hstack([self.rest, self.vectors])
        static, spanned = np.split(np.asarray(columns).reshape(len(points), 6, -1), [self.rest.shape[1]], axis=2)
        return StressSpace(
            points, static, np.ascontiguousarray(spanned), self.pairs, self.fewer, self.ports, self.resting
        )


def _solve_statically(model: SecondOrderModel, V: Array, omega: Array, shapes: Array, coefficients: Array) -> Array:
    """Return the (n, p) static displacements K^-1 B. The Galerkin solution in the Krylov space is often exact to
    round-off, like conjugate gradients after as many steps; otherwise K is factorised."""
    if omega.all():
        displacements = np.asarray(V @ (coefficients @ (shapes / omega[:, None] ** 2)))
        B = model.port_matrix
        if np.linalg.norm(model.K @ displacements - B) < EXACT * np.linalg.norm(B):
            return displacements
    try:
        return factorize(model.K, name="K").solve(model.port_matrix)
    except FactorizationError as error:
        raise ModelError(f"stress of a body that nothing holds is not known: clamp a face of it ({error})") from error


@dataclass(frozen=True)
class StressSpace:
    """Stress at P points of a body as a function of its `Response`, for any time step.

    Attributes:
        points: (P, d) coordinates [m].
        static: (P, 6, p) stress under a static unit force on each port [Pa/N].
        spanned: (P, 6, k) stress of each basis vector of the response [Pa/(m sqrt(kg))].
        pairs, fewer, ports, resting: as in `Response`.
    """

    points: Array
    static: Array
    spanned: Array
    pairs: Pairs
    fewer: Pairs
    ports: tuple[str, ...]
    resting: bool = False

    def select_points(self, which: NDArray[np.int64] | NDArray[np.bool_]) -> StressSpace:
        """Return the stress at the points ``which``, by their numbers or a mask (P,)."""
        return replace(self, points=self.points[which], static=self.static[which], spanned=self.spanned[which])

    def field(self, dt: float, *, fewer: bool = False) -> StressField:
        """Return the field for a step ``dt`` [s], or that of ``fewer`` vectors. Raises as `Pairs.slower`."""
        pairs = (self.fewer if fewer else self.pairs).slower(dt, resting=self.resting)
        spanned = self.spanned.reshape(6 * len(self.points), self.spanned.shape[2])[:, : len(pairs.coefficients)]
        modal = (spanned @ pairs.coefficients).reshape(len(self.points), 6, len(pairs.omega))
        greens = ModalGreens(pairs.omega, pairs.zeta, pairs.shapes, Residual.none(len(self.ports)), self.ports)
        return StressField(self.points, self.static, modal, Body(greens))


@dataclass(frozen=True)
class StressField:
    """Stress at P points as a sum over modal coordinates and port forces.

    Attributes:
        points: (P, d) coordinates [m].
        static: (P, 6, p) stress under a static unit force on each port [Pa/N].
        modal: (P, 6, M) stress of each mode shape [Pa/(m sqrt(kg))].
        body: the body with these modes.
    """

    points: Array
    static: Array
    modal: Array
    body: Body

    @property
    def greens(self) -> ModalGreens:
        """Return the body's modal Green's function."""
        greens = self.body.greens.modal
        assert greens is not None
        return greens

    @cached_property
    def left_out(self) -> Array:
        """Return the (P, 6, p) residual static stress: the static response less that of the retained modes."""
        return np.asarray(self.static - (self.modal / self.greens.omega**2) @ self.greens.shapes)

    @property
    def fields(self) -> Array:
        """Return the (P, 6, M + p) stress of each mode and residual stress of each port force."""
        return np.concatenate([self.modal, self.left_out], axis=2)

    @property
    def radians(self) -> Array:
        return np.append(self.greens.omega, np.zeros(self.static.shape[2]))

    @property
    def bounds(self) -> Array:
        return np.concatenate([_norms(self.modal), _norms(self.left_out)], axis=1)

    def at(self, which: NDArray[np.int64] | NDArray[np.bool_]) -> StressField:
        """Return the field at the points ``which``."""
        return StressField(self.points[which], self.static[which], self.modal[which], self.body)

    def coordinates(self, force: Array, dt: float, stride: int) -> Iterator[Array]:
        pushes, ports = np.atleast_2d(np.asarray(force, dtype=float).T), self.static.shape[2]
        if len(pushes) != ports:
            raise ModelError(f"forces of shape {force.shape} on a body of {ports} ports: give one column for each")
        return coordinates(pushes, dt, self.body, stride)

    @cached_property
    def _columns(self) -> tuple[Integers, Array]:
        """Return the numbers of the components that have any stress, and their stress (M + p, P, c) per coordinate."""
        acting = np.flatnonzero(np.any(self.static, axis=(0, 2)) | np.any(self.modal, axis=(0, 2)))
        return acting, np.ascontiguousarray(self.fields[:, acting].transpose(2, 0, 1))

    def stress(self, which: Integers, values: Array, kept: Integers) -> Iterator[Array]:
        acting, columns = self._columns
        stress = columns[kept[:, None], which].reshape(len(kept), -1).T @ values
        if len(acting) == 6:
            yield stress.reshape(len(which), 1, 6, -1)
            return
        every = np.zeros((len(which), 1, 6, values.shape[1]))
        every[:, 0, acting] = stress.reshape(len(which), len(acting), -1)
        yield every


def recover(
    model: SecondOrderModel,
    functional: Any,
    points: Array,
    *,
    bandwidth: float,
    dt: float,
    damping_ratio: float = 0.0,
    vectors: int = 0,
) -> StressField:
    """Return the stress of a body, with a Krylov space or modes made for it.

    Args:
        functional: (6 P, n) stress C per unknown of the model.
        points: (P, d) coordinates [m].
        dt: time step of the force [s].
        model, bandwidth, damping_ratio, vectors: as in `Response.from_model`, whose errors are raised.
    """
    response = Response.from_model(model, bandwidth=bandwidth, damping_ratio=damping_ratio, vectors=vectors)
    return response.stress(functional, points).field(dt)


def histories(field: Field, force: Array, dt: float, stride: int = 1) -> Array:
    """Return the (P, 6, n + 1) stress at all points of a field [Pa], or at every ``stride``-th step, under forces (n +
    1,) or (n + 1, ports) along the ports' outward normals [N]: ``force[m]`` acts over the step that ends at m dt. A
    contact force presses on a seat: its sign is negative here."""
    stress, first = np.empty((len(field.points), 6, 1 + (len(force) - 1) // stride)), 0
    for part in field.coordinates(force, dt, stride):
        _fill(stress[:, :, first : first + len(part)], field, part)
        first += len(part)
    return stress


def at_time(field: Field, force: Array, dt: float, steps: int) -> Array:
    """Return the (P, 6) stress at all points of a field after ``steps`` steps [Pa]; the force is as in `histories`."""
    *_, last = field.coordinates(force[: steps + 1], dt, max(1, steps))
    return np.asarray(_all(field, last[-1:])[:, :, 0])


def at_own_times(field: Field, force: Array, dt: float, steps: Integers) -> Array:
    """Return the (P, 6) stress of each point at the end of its own step (P,) [Pa]; the force is as in `histories`."""
    stress, first = np.zeros((len(steps), 6)), 0
    for part in field.coordinates(force, dt, 1):
        for k in np.flatnonzero((steps >= first) & (steps < first + len(part))):
            stress[k] = _all(field.at(np.array([k])), part[steps[k] - first][None])[0, :, 0]
        first += len(part)
    return stress


def _all(field: Field, part: Array) -> Array:
    """Return the (P, 6, m) stress at all points from coordinates (m, K)."""
    stress = np.empty((len(field.points), 6, len(part)))
    _fill(stress, field, part)
    return stress


def _fill(stress: Array, field: Field, part: Array) -> None:
    """Write the (P, 6, m) stress at all points, from coordinates (m, K), into ``stress``."""
    places, kept, first = np.arange(len(field.bounds)), np.arange(len(field.radians)), 0
    for each in field.stress(places, np.ascontiguousarray(part.T), kept):
        some = each.reshape(-1, 6, len(part))
        stress[first : first + len(some)] = some
        first += len(some)


def _norms(fields: Array) -> Array:
    """Return the (P, K) Frobenius norms of stress fields (P, 6, K)."""
    return norms(np.swapaxes(fields, 1, 2))


def find_frames(field: StressField, force: Array, dt: float, steps: range) -> Array:
    """Return the (F, P, 6) stress at all points [Pa] at F frames, the ends of the time steps in ``steps``.

    Args:
        field, force, dt: as in `seatfem.structures.fields.recovery.histories`.
        steps: step numbers of the frames; the first is a multiple of the range's step.
    """
    assert steps.start % steps.step == 0
    frames: list[Array] = []
    first = 0
    for part in field.coordinates(force[: steps[-1] + 1], dt, steps.step):
        frames.append(part[max(0, steps.start // steps.step - first) :])
        first += len(part)
    return np.asarray(np.tensordot(np.concatenate(frames), field.fields, axes=(1, 2)))


def response_in_frames(response: Response, force: Array, dt: float, steps: range) -> Array:
    """Return the (F, n) displacement unknowns of a body at F frames, by mode acceleration as `find_frames`: the
    operator of `solid_stress` times them is the stress of the frames."""
    size = len(response.rest)
    rows = -(-size // 6)  # a field has six components a point: the unknowns are read as stress by an identity
    identity = sparse.eye_array(6 * rows, size, format="csr")
    field = response.stress(sparse.csr_array(identity), np.zeros((rows, 1))).field(dt)
    return find_frames(field, force, dt, steps).reshape(len(steps), -1)[:, :size]


_HELD: Final = 16  # points whose whole histories are held at once


def tensor_histories(field: Field, force: Array, dt: float) -> Iterator[Array]:
    """Yield the (n + 1, 6) stress of each point of a field in turn; at most `_HELD` are in memory."""
    for first in range(0, len(field.points), _HELD):
        some = np.arange(first, min(first + _HELD, len(field.points)))
        yield from np.swapaxes(histories(field.at(some), force, dt), 1, 2)
