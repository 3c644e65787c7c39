"""A lip struck in many arcs, on a body of revolution: its modes in the band, harmonic by harmonic, and its statics.

    G_ij(t) = sum over n, k of s_ni s_nj cos n(th_i - th_j) phi_nk^2 sin(w_nk t)/w_nk  +  an exponential

of modes up to a cutoff, whose number does not grow with that of the arcs. The exponential begins with 1/Z_i on each
arc and has the static compliance that the modes leave out. `harmonics` keeps Krylov vectors of each harmonic instead:
closer to g above the band, but thousands of pairs, which every arc feels.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Final

import numpy as np

from impact.greens.base import ErrorEstimate
from impact.greens.modal import ModalGreens
from impact.greens.pulse import error_times
from impact.progress import Progress, silent
from seatfem.structures.method import BEYOND, Aims
from seatfem.structures.model import Array, SecondOrderModel
from seatfem.structures.reduction.factorization import factorize
from seatfem.structures.reduction.harmonic_tail import Tail
from seatfem.structures.reduction.modal import modal_error
from seatfem.structures.reduction.modes import ConvergenceError, solve_modes
from seatfem.structures.reduction.residual import relaxation, semidefinite
from seatfem.structures.reduction.ring_patches import RingPatch, check_patches, mixing

FEWEST: Final = 4  # harmonics whose modes are looked for: the lowest frequency first falls, then rises with n
MOST: Final = 1000  # harmonics
DOUBT: Final = 0.002  # of the compliance of an arc, that the harmonics not computed may leave


def lip_greens(
    build: Callable[[int], SecondOrderModel],
    patches: Mapping[str, RingPatch],
    aims: Aims,
    damping_ratio: float = 0.0,
    *,
    static: bool = False,
    progress: Progress = silent,
) -> ModalGreens:
    """Return one Green's function of all patches from the models ``build(n)``, whose ports are the rings by boundary
    name.

    Args:
        build: the model of a harmonic.
        patches: on the rings, by port.
        aims: the band, in which the error is judged; the tolerance is not asked for.
        damping_ratio: of every mode.
        static: without modes.
        progress: informed of the harmonics.

    Raises:
        ModelError: overlapping patches. FactorizationError: a body that is free to move. ConvergenceError: arcs so
        narrow that `MOST` harmonics do not sum up to their compliance.
    """
    check_patches(patches)
    rings = list(dict.fromkeys(patch.boundary for patch in patches.values()))
    first = build(0)
    damping = first.damping.plus(damping_ratio)
    compliance, last, doubt = _statics(build, first, patches, rings, aims, progress)
    parts, harmonic = [(np.zeros(0), np.zeros(0), np.zeros((0, len(patches))))], 0
    while not static:
        model = first if harmonic == 0 else build(harmonic)
        modes = solve_modes(model, up_to_hz=BEYOND * aims.bandwidth, backend=aims.backend)
        if harmonic > FEWEST and not len(modes.omega):
            break
        own = model.damping.plus(damping_ratio)
        zeta = own.ratios(modes.omega, own.losses(modes.shapes))
        of_rings = modes.shapes.T @ np.stack([model.ports[ring].vector for ring in rings], axis=1)
        for wave in mixing(patches, rings, harmonic):
            shapes = of_rings @ wave.T
            seen = shapes.any(axis=1)
            parts.append((modes.omega[seen], np.broadcast_to(zeta, modes.omega.shape)[seen], shapes[seen]))
        harmonic += 1
        progress("harmonics", harmonic / (harmonic + 8))
    widths = np.array([patch.width for patch in patches.values()])
    impedance = np.array([first.ports[patch.boundary].impedance or math.inf for patch in patches.values()], dtype=float)
    start = np.diag(damping.first_velocity() * 2 * math.pi / (widths * impedance))
    omega, zetas, all_shapes = (np.concatenate(each) for each in zip(*parts, strict=True))
    rest = relaxation(_left_of(compliance, omega, all_shapes), start, damping.beta)
    greens = ModalGreens(omega, zetas, all_shapes, rest, tuple(patches))
    cutoff, t = BEYOND * aims.bandwidth, error_times(aims.duration, aims.width)
    error = modal_error(greens, t, aims.bandwidth, cutoff, [0]) if len(greens.omega) else 0.0
    origin = {
        "method": "statics" if static else "modes",
        "harmonics": max(0, harmonic - 1),
        "static_harmonics": last,
        "cutoff_Hz": 0.0 if static else cutoff,
        "bandwidth_Hz": aims.bandwidth,
        "damping_ratio": damping_ratio,
        "dof": first.size,
    }
    progress("harmonics", 1.0)
    return greens.with_error(ErrorEstimate(reduction=error + doubt / float(np.abs(compliance).max())), origin)


def _statics(
    build: Callable[[int], SecondOrderModel],
    first: SecondOrderModel,
    patches: Mapping[str, RingPatch],
    rings: list[str],
    aims: Aims,
    progress: Progress,
) -> tuple[Array, int, float]:
    """Return the static compliance (p, p) [m/N], the last harmonic computed, and what those beyond it may leave."""
    of_rings = first.port_matrix.T @ factorize(first.K, backend=aims.backend, name="K").solve(first.port_matrix)
    places = [first.port_names.index(patch.boundary) for patch in patches.values()]
    whole = (of_rings + of_rings.T)[np.ix_(places, places)] / 2
    tail, largest = Tail(patches, rings, 0), 0.0
    while (doubt := tail.doubt()) > DOUBT * largest:
        if tail.last >= MOST:
            raise ConvergenceError(
                f"{tail.last} harmonics cannot represent the compliance of the lip segments: take fewer"
            )
        tail.add(build(tail.next), aims.backend)
        largest = float((np.diag(whole) + tail.diagonal()).max())
        progress("harmonics", 0.5 * tail.last / (tail.last + 40))
    return whole + tail.compliance(), tail.last, doubt


def _left_of(compliance: Array, omega: Array, shapes: Array) -> Array:
    """Return the (p, p) part of a static compliance that modes do not have."""
    bent = shapes / omega[:, None]
    return semidefinite(compliance - bent.T @ bent, 1e-3 * float(np.abs(compliance).max()))
