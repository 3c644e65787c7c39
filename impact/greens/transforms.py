"""Green's functions in other forms: receptance in the frequency domain, and state space for control and simulation
programs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import block_diag

from impact.greens.answers import Array, ComplexArray, GreensFunctionError
from impact.greens.base import GreensFunction
from impact.greens.modal import ModalGreens
from impact.greens.poles import PoleGreens
from impact.quantities import brief

_BLOCK = 1 << 20  # number of frequencies times modes evaluated at once


def receptance(
    greens: GreensFunction, frequency: ArrayLike, i: int | None = None, j: int | None = None
) -> ComplexArray:
    """Return H_ij(f) = displacement of port i per unit harmonic force on port j [m/N], at ``frequency`` (...,) > 0
    [Hz].

    The shape is (..., p, p): frequency, response, reference, as in pyFBS and other programs of substructuring; (...,)
    if ``i`` and ``j`` are given. For oscillators and relaxations

        H = sum_k phi_ki phi_kj/(w_k^2 - w^2 + 2 i zeta_k w_k w) + sum_r a_ri a_rj/(rate_r + i w) + c_ij,  w = 2 pi f,

    the Fourier transform, with exp(i w t), of `impulse_response` (Ewins, Modal Testing, 2000). Its inverse is
    `impact.FrequencyResponse` with `impact.fit_poles`.

    Raises:
        GreensFunctionError: a representation whose transform is not known in closed form.
    """
    f = np.asarray(frequency, dtype=float)
    s = np.asarray(2j * np.pi * np.ravel(f))
    modes = 0 if greens.modal is None else greens.modal.omega.size
    rows = max(1, _BLOCK // max(1, modes))  # blocks limit the memory
    chosen = (slice(None), slice(None) if i is None else i, slice(None) if j is None else j)
    blocks = [greens.transfer(s[start : start + rows])[chosen] for start in range(0, s.size, rows)]
    p = len(greens.ports)
    ports = (*([p] * (i is None)), *([p] * (j is None)))
    return np.concatenate([*blocks, np.zeros((0, *ports), dtype=complex)]).reshape((*f.shape, *ports))


@dataclass(frozen=True, eq=False)
class StateSpace:
    """x' = A x + B F, u = C x + D F, with g(t) = C exp(A t) B + D delta(t); F [N] and u [m] at the ports.

    Attributes:
        A, B, C, D: matrices (s, s), (s, p), (p, s) and (p, p); D is the bare compliance [m/N].
        states: meaning and unit of each state (s,), in words.
        ports: p names.
    """

    A: Array
    B: Array
    C: Array
    D: Array
    states: tuple[str, ...]
    ports: tuple[str, ...]

    __repr__ = brief


def state_space(greens: GreensFunction) -> StateSpace:
    """Return the exact state space of a function of oscillators, relaxations, complex poles and rigid motions.

    Modal: the states are q_k and q_k' of q'' + 2 zeta w q' + w^2 q = phi' F, then z_r of z' = -rate z + a' F. Complex
    poles s = -d + i w with shapes r: blocks [[-d, -w], [w, -d]] with inputs (Re r, Im r), outputs 2 (Re r, -Im r).

    Raises:
        GreensFunctionError: a function that is no finite sum of poles, such as a rod with travelling waves.
    """
    if (modal := greens.modal) is not None:
        return _of_modes(modal)
    if (poles := greens.pole_sum) is not None:
        return _of_poles(poles)
    raise GreensFunctionError(f"{greens}: is no finite sum of poles, and has no state space; fit poles to it first")


def _of_modes(greens: ModalGreens) -> StateSpace:
    residual, m = greens.residual, len(greens.omega)
    zero = np.zeros((m, m))
    damping = np.diag(2 * greens.zeta * greens.omega)
    A = block_diag(np.block([[zero, np.eye(m)], [-np.diag(greens.omega**2), -damping]]), -np.diag(residual.rates))
    still = np.zeros_like(greens.shapes)
    B, C = np.vstack([still, greens.shapes, residual.shapes]), np.vstack([greens.shapes, still, residual.shapes]).T
    names = [f"q_{k} [m sqrt(kg)]" for k in range(m)] + [f"dq_{k}/dt [m sqrt(kg)/s]" for k in range(m)]
    names += [f"z_{r} [sqrt(m N s)]" for r in range(len(residual.rates))]
    return StateSpace(A, B, C, residual.compliance, tuple(names), greens.ports)


def _of_poles(greens: PoleGreens) -> StateSpace:
    blocks = [np.array([[s.real, -s.imag], [s.imag, s.real]]) for s in greens.poles]
    pairs = [np.array([r.real, r.imag]) for r in greens.shapes]
    outputs = [2 * np.array([r.real, -r.imag]) for r in greens.shapes]
    doubles = [np.array([[0.0, 1.0], [0.0, 0.0]]) for _ in greens.rigid]
    still = np.zeros(len(greens.ports))
    A = block_diag(*blocks, -np.diag(greens.rates), *doubles)
    B = np.vstack([*pairs, greens.real_shapes, *(row for b in greens.rigid for row in (still, b))])
    C = np.vstack(
        [*outputs, greens.signs[:, None] * greens.real_shapes, *(row for b in greens.rigid for row in (b, still))]
    )
    names = [f"{part} x_{k} [sqrt(m N s)]" for k in range(len(blocks)) for part in ("Re", "Im")]
    names += [f"z_{r} [sqrt(m N s)]" for r in range(len(greens.rates))]
    names += [name for n in range(len(doubles)) for name in (f"q_{n} [m sqrt(kg)]", f"dq_{n}/dt [m sqrt(kg)/s]")]
    return StateSpace(A, B, C.T, greens.compliance, tuple(names), greens.ports)
