"""Stress in time, by mode acceleration: what each port's static load does, exactly, and each mode's dynamics.

    sigma(t) = sum_k C phi_k q_k(t) + (C K^-1 b - sum_k C phi_k phi_k'b / w_k^2) n(t)

with q_k under the contact force F and n' = rate (F - n), rate = 2 w_max: F as the modes left out follow it. Without the
static part a force's own neighbourhood converges like the modal sum of a point load.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy import sparse

from impact.after.stresses import coordinates, first_touch
from impact.bodies.body import Body
from impact.greens.modal import ModalGreens, Residual
from seatfem.structures.model import Array, ModelError, SecondOrderModel
from seatfem.structures.reduction.factorization import FactorizationError, factorize
from seatfem.structures.reduction.krylov_basis import KrylovBasis

VECTORS: Final = 80  # of the Krylov space, for a body of one port: 0.4 % at most, at a fillet that is struck
MORE: Final = 20  # for each port more
MOST: Final = 400
TIMES_PER_RADIAN: Final = 2  # of the highest frequency retained: when peaks are looked for
LITTLE: Final = 1e-3  # of the largest stress, that may be missing at a point
CHANGE: Final = 10
_BLOCK: Final = 256  # times held at once
_POINTS: Final = 1024


@dataclass(frozen=True)
class StressField:
    """Stress at P points by modal coordinates and port forces.

    Attributes:
        points: (P, d) where [m].
        static: (P, 6, p) of a force at rest on each port [Pa/N].
        modal: (P, 6, M) of each mode [Pa/(m sqrt(kg))].
        body: whose modes these are.
    """

    points: Array
    static: Array
    modal: Array
    body: Body

    @property
    def fields(self) -> Array:
        """(P, 6, M + p) of modes and followed forces."""
        greens = self.body.greens.modal
        assert greens is not None
        left_out = self.static - (self.modal / greens.omega**2) @ greens.shapes
        return np.concatenate([self.modal, left_out], axis=2)

    def at(self, which: NDArray[np.int64] | NDArray[np.bool_]) -> StressField:
        """Of some of its points."""
        return StressField(self.points[which], self.static[which], self.modal[which], self.body)


@dataclass(frozen=True)
class Largest:
    """Of each of P points the largest von Mises and the largest (tensile) principal stress [Pa] and their times [s]."""

    von_mises: Array
    von_mises_time: Array
    principal: Array
    principal_time: Array


@dataclass(frozen=True)
class LargestStress:
    """Before the first touch, and since."""

    initial: Largest
    after_contact: Largest


def recover(
    model: SecondOrderModel,
    functional: sparse.csr_array,
    points: Array,
    *,
    bandwidth: float,
    dt: float,
    damping_ratio: float = 0.0,
    vectors: int | None = None,
) -> StressField:
    """The stress of a body by one static solution a port and a Krylov space of its own.

    Args:
        model: M, K, ports and a damping that does not couple modes.
        functional: (6 P, n) C of its unknowns.
        points: (P, d) of them.
        bandwidth: [Hz] at which the space is right.
        dt: step of the forces [s]; pairs above pi/dt, which a step would step over, are in the static part alone.
        damping_ratio: uniform, added to the model's own.
        vectors: of the space; default `VECTORS`, and `MORE` for each port but the first.

    Raises:
        ModelError: a body that nothing holds, damping that couples modes.
    """
    damping = model.damping.plus(damping_ratio)
    if refusal := damping.refusal:
        raise ModelError(f"stress by modes: {refusal}")
    try:
        rest = factorize(model.K, name="K").solve(model.port_matrix)
    except FactorizationError as error:
        raise ModelError(f"stress of a body that nothing holds is not known: clamp a face of it ({error})") from error
    shift, ports = 2 * math.pi * bandwidth, len(model.ports)
    most = min(MOST, model.size, VECTORS + MORE * (ports - 1) if vectors is None else vectors)
    basis = KrylovBasis(model, factorize(model.K + shift**2 * model.M, name="K + s^2 M"), shift, most)
    basis.grow(most)
    omega, shapes, coefficients = basis.ritz()
    kept = omega * dt < math.pi
    if not kept.any():
        raise ModelError(f"dt = {dt:g} s: no mode of the body is slower than pi/dt; shorten the step")
    modes = basis.V @ coefficients[:, kept]
    zeta = damping.ratios(omega[kept], None if damping.loss is None else damping.losses(modes))
    greens = ModalGreens(omega[kept], zeta, shapes[kept], Residual.none(ports), model.port_names)
    static, modal = (np.asarray(functional @ each).reshape(len(points), 6, -1) for each in (rest, modes))
    return StressField(points, static, modal, Body(greens))


def histories(field: StressField, force: Array, dt: float) -> Array:
    """(P, 6, n + 1) stress at all its points [Pa] under forces (n + 1,) or (n + 1, ports) along the ports' outward
    normals [N]: ``force[m]`` acts over the step that ends at m dt. A contact force presses a seat: give ``-force``."""
    count, fields = len(field.points), field.fields
    flat = fields.reshape(6 * count, fields.shape[2])
    found = [flat @ part.T for part in coordinates(pushes_of(field, force), dt, field.body, 1)]
    return np.concatenate(found, axis=1).reshape(count, 6, sum(part.shape[1] for part in found))


def at_time(field: StressField, force: Array, dt: float, steps: int) -> Array:
    """(P, 6) stress at all its points at the end of step number ``steps`` [Pa]; the force as in `histories`."""
    pushes = pushes_of(field, force)[:, : steps + 1]
    last = [part[-1] for part in coordinates(pushes, dt, field.body, max(1, steps))][-1]
    return np.asarray(field.fields @ last)


def largest(field: StressField, force: Array, dt: float) -> LargestStress:
    """The largest stress at each point, looked for at `TIMES_PER_RADIAN` of the highest frequency retained.

    Blocks of times at which even the sum of every mode's share is below what a point has seen are passed over there.
    """
    greens = field.body.greens.modal
    assert greens is not None
    stride = max(1, int(1.0 / (TIMES_PER_RADIAN * float(greens.omega.max()) * dt)))
    touch, fields = first_touch(force), np.ascontiguousarray(field.fields, dtype=np.float32)
    share = _principal_bound(field.fields)
    found = np.zeros((2, 4, len(field.points)))
    for number, part in _parts(field, force, dt, stride):
        times = number * stride
        for after in (0, 1):
            chosen = np.flatnonzero((times > touch) == bool(after))
            if len(chosen):
                when, radians = dt * times[chosen].astype(np.float64), greens.omega * dt * stride
                _look(part[chosen], when, radians, fields, share, found[after])
    before, since = (Largest(*each) for each in found)
    return LargestStress(before, since)


def _parts(field: StressField, force: Array, dt: float, stride: int) -> Iterator[tuple[NDArray[np.int64], Array]]:
    """Numbers of the times and (m, M + p) coordinates, `_BLOCK` at once."""
    first = 0
    for part in coordinates(pushes_of(field, force), dt, field.body, stride):
        for start in range(0, len(part), _BLOCK):
            some = part[start : start + _BLOCK]
            yield first + start + np.arange(len(some), dtype=np.int64), some
        first += len(part)


def _look(part: Array, times: Array, radians: Array, fields: NDArray[np.float32], share: Array, found: Array) -> None:
    """Into ``found`` (4, P) what these times bring, ``radians`` (M,) of each mode apart.

    Coordinates that add up to less than `LITTLE` of the largest stress so far are left out, and of what then varies
    slowly fewer times are looked at.
    """
    part, times, kept = _thinned(part, times, radians, share.max(axis=0), LITTLE * max(found[0].max(), found[2].max()))
    if not kept.size:
        return
    share = share[:, kept]
    near = np.flatnonzero(share @ np.abs(part).max(axis=0) > np.minimum(found[0] / math.sqrt(3), found[2]))
    if len(kept) < fields.shape[2]:
        fields = fields[:, :, kept]
    coordinates_now = np.ascontiguousarray(part.T, dtype=np.float32)
    for start in range(0, len(near), _POINTS):
        some = near[start : start + _POINTS]
        stress = (fields[some].reshape(6 * len(some), -1) @ coordinates_now).reshape(len(some), 6, -1)
        seen = found[:, some]
        _largest(stress, times, seen)
        found[:, some] = seen


def _thinned(
    part: Array, times: Array, radians: Array, share: Array, little: float
) -> tuple[Array, Array, NDArray[np.int64]]:
    """Fewer times and coordinates, and which of these: what is left out is below ``little`` [Pa] everywhere.

    Between the times that are looked at the followed forces change by `CHANGE` times ``little`` at most.
    """
    weight = share * np.abs(part).max(axis=0)
    order = np.argsort(weight)
    kept = np.sort(order[np.cumsum(weight[order]) >= little]).astype(np.int64)
    modes = len(radians)
    fastest = float(radians[kept[kept < modes]].max(initial=0.0))
    jump = float(share[modes:] @ np.abs(np.diff(part[:, modes:], axis=0)).max(axis=0, initial=0.0))
    apart = min(
        1 / (TIMES_PER_RADIAN * fastest) if fastest else np.inf, CHANGE * little / jump if jump else np.inf, len(part)
    )
    step = max(1, int(apart))
    return part[::step, kept], times[::step], kept


def _principal_bound(fields: Array) -> Array:
    """(P, K) the largest magnitude of each mode's principal stress; von Mises is sqrt(3) times it at most."""
    return np.asarray(np.abs(np.linalg.eigvalsh(_tensors(np.swapaxes(fields, 1, 2)))).max(axis=-1))


def _tensors(stress: Array) -> Array:
    """(..., 3, 3) of (..., 6)."""
    return np.asarray(stress[..., [0, 5, 4, 5, 1, 3, 4, 3, 2]].reshape(*stress.shape[:-1], 3, 3))


def von_mises(stress: Array) -> Array:
    """(...) of (..., 6) [Pa]."""
    deviator = stress[..., :3] - stress[..., :3].mean(axis=-1, keepdims=True)
    return np.asarray(np.sqrt(1.5 * np.sum(deviator**2, axis=-1) + 3 * np.sum(stress[..., 3:] ** 2, axis=-1)))


def principal(stress: Array) -> Array:
    """(..., 3) principal stresses of (..., 6), the largest last [Pa]."""
    return np.asarray(np.linalg.eigvalsh(_tensors(stress)))


def pushes_of(field: StressField, force: Array) -> Array:
    """(p, n + 1) forces on the ports."""
    pushes, ports = np.atleast_2d(np.asarray(force, dtype=float).T), field.static.shape[2]
    if len(pushes) != ports:
        raise ModelError(f"forces of shape {force.shape} on a body of {ports} ports: give one column for each")
    return pushes


@njit(cache=True)
def _largest(stress, times, found):  # type: ignore[no-untyped-def]  # pragma: no cover - compiled
    """Stress (P, 6, m): the largest root of the characteristic cubic is looked for where no bound rules it out."""
    points, _, count = stress.shape
    for p in range(points):
        mises, top = found[0, p] ** 2, found[2, p]
        xx, yy, zz, yz, xz, xy = stress[p]
        for m in range(count):
            mean = (xx[m] + yy[m] + zz[m]) / 3
            a, b, c, d, e, f = xx[m] - mean, yy[m] - mean, zz[m] - mean, yz[m], xz[m], xy[m]
            second = 0.5 * (a * a + b * b + c * c) + d * d + e * e + f * f
            if 3 * second > mises:
                mises = 3 * second
                found[0, p], found[1, p] = np.sqrt(mises), times[m]
            reach = 2 * np.sqrt(second / 3)
            if mean + reach > top:
                third = a * (b * c - d * d) - f * (f * c - d * e) + e * (f * d - b * e)
                size = 0.5 * reach**3
                angle = np.arccos(min(1.0, max(-1.0, 2 * third / size))) / 3 if size > 0 else 0.0
                value = mean + reach * np.cos(angle)
                if value > top:
                    top = value
                    found[2, p], found[3, p] = value, times[m]
