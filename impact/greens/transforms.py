"""Green's functions in other forms: receptance in the frequency domain, and state space for control and simulation
programs.
"""

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

_BLOCK = 1 << 20  # frequencies times modes evaluated at once


def receptance(
    greens: GreensFunction, frequency: ArrayLike, i: int | None = None, j: int | None = None
) -> ComplexArray:
    """Return H_ij(f) = displacement of port i per unit harmonic force on port j [m/N], at ``frequency`` (...,) > 0
    [Hz].

    Shape (..., p, p): frequency, response, reference, the layout of pyFBS and other programs of substructuring; (...,)
    where ``i`` and ``j`` are given. Of oscillators and relaxations

        H = sum_k phi_ki phi_kj/(w_k^2 - w^2 + 2 i zeta_k w_k w) + sum_r a_ri a_rj/(rate_r + i w) + c_ij,  w = 2 pi f,

    the Fourier transform, with exp(i w t), of `impulse_response` (Ewins, Modal Testing, 2000). The way back is
    `impact.FrequencyResponse` and `impact.fit_poles`.

    Raises:
        GreensFunctionError: a representation whose transform is not known in closed form.
    """
    f = np.asarray(frequency, dtype=float)
    s = np.asarray(2j * np.pi * np.ravel(f))
    modes = 0 if greens.modal is None else greens.modal.omega.size
    rows = max(1, _BLOCK // max(1, modes))  # blocks bound the memory
    which = (slice(None), slice(None) if i is None else i, slice(None) if j is None else j)
    blocks = [greens.transfer(s[start : start + rows])[which] for start in range(0, s.size, rows)]
    p = len(greens.ports)
    rest = (*([p] * (i is None)), *([p] * (j is None)))
    return np.concatenate([*blocks, np.zeros((0, *rest), dtype=complex)]).reshape((*f.shape, *rest))


@dataclass(frozen=True, eq=False)
class StateSpace:
    """x' = A x + B F, u = C x + D F, with g(t) = C exp(A t) B + D delta(t); F [N] and u [m] at the ports.

    Attributes:
        A: (s, s). B: (s, p). C: (p, s). D: (p, p), the bare compliance [m/N].
        states: (s,) what each state is, in words with units.
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
    """Return a Green's function of oscillators, relaxations, complex poles and rigid motions, exactly.

    Modal: the states are q_k and q_k' of q'' + 2 zeta w q' + w^2 q = phi' F, then z_r of z' = -rate z + a' F. Complex
    poles s = -d + i w with shapes r: blocks [[-d, -w], [w, -d]] driven by (Re r, Im r), seen by 2 (Re r, -Im r).

    Raises:
        GreensFunctionError: one that is no finite sum of poles, such as a rod with its travelling waves.
    """
    if (modal := greens.modal) is not None:
        return _of_modes(modal)
    if (poles := greens.pole_sum) is not None:
        return _of_poles(poles)
    raise GreensFunctionError(f"{greens}: is no finite sum of poles, and has no state space; fit poles to it first")


def _of_modes(greens: ModalGreens) -> StateSpace:
    rest, m = greens.residual, len(greens.omega)
    zero = np.zeros((m, m))
    damping = np.diag(2 * greens.zeta * greens.omega)
    A = block_diag(np.block([[zero, np.eye(m)], [-np.diag(greens.omega**2), -damping]]), -np.diag(rest.rates))
    still = np.zeros_like(greens.shapes)
    B, C = np.vstack([still, greens.shapes, rest.shapes]), np.vstack([greens.shapes, still, rest.shapes]).T
    names = [f"q_{k} [m sqrt(kg)]" for k in range(m)] + [f"dq_{k}/dt [m sqrt(kg)/s]" for k in range(m)]
    names += [f"z_{r} [sqrt(m N s)]" for r in range(len(rest.rates))]
    return StateSpace(A, B, C, rest.compliance, tuple(names), greens.ports)


def _of_poles(greens: PoleGreens) -> StateSpace:
    blocks = [np.array([[s.real, -s.imag], [s.imag, s.real]]) for s in greens.poles]
    pairs = [np.array([r.real, r.imag]) for r in greens.shapes]
    seen = [2 * np.array([r.real, -r.imag]) for r in greens.shapes]
    doubles = [np.array([[0.0, 1.0], [0.0, 0.0]]) for _ in greens.rigid]
    still = np.zeros(len(greens.ports))
    A = block_diag(*blocks, -np.diag(greens.rates), *doubles)
    B = np.vstack([*pairs, greens.real_shapes, *(row for b in greens.rigid for row in (still, b))])
    C = np.vstack(
        [*seen, greens.signs[:, None] * greens.real_shapes, *(row for b in greens.rigid for row in (b, still))]
    )
    names = [f"{part} x_{k} [sqrt(m N s)]" for k in range(len(blocks)) for part in ("Re", "Im")]
    names += [f"z_{r} [sqrt(m N s)]" for r in range(len(greens.rates))]
    names += [name for n in range(len(doubles)) for name in (f"q_{n} [m sqrt(kg)]", f"dq_{n}/dt [m sqrt(kg)/s]")]
    return StateSpace(A, B, C.T, greens.compliance, tuple(names), greens.ports)
