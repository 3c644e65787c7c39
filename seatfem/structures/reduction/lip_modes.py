"""The Green's function of a lip in many arcs, by all modes in the band and a residual.

For a body of revolution (`lip_greens`)

G_ij(t) = sum over n, k of s_ni s_nj cos n(th_i - th_j) phi_nk^2 sin(w_nk t)/w_nk  +  an exponential

and for a body of any shape (`face_greens`), by one model whose ports are the arcs and one factorization,

G_ij(t) = sum over k of phi_ki phi_kj sin(w_k t)/w_k  +  an exponential

with modes up to a cutoff, whose number does not grow with that of the arcs. The exponential has g(0+) = 1/Z_i on each
arc and the residual static compliance. Krylov spaces (`harmonics`) are closer to g above the band, but have thousands
of pairs, all of which move every arc.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Final

import numpy as np

from impact.greens import base, oscillator
from impact.greens.modal import ModalGreens
from impact.notices import Progress, silent
from seatfem.structures.errors import ModelError
from seatfem.structures.method import ARC_ERROR, BEYOND, MOST_MODES, Aims
from seatfem.structures.model import Array, SecondOrderModel
from seatfem.structures.reduction import eigen_search, harmonics, modal
from seatfem.structures.reduction.factorization import Backend, static_compliance
from seatfem.structures.reduction.modes import ConvergenceError, Modes, modes_near, solve_modes
from seatfem.structures.reduction.reducer import relaxation, residual, semidefinite
from seatfem.units import write_quantity

FEWEST: Final = 4  # fewest harmonics whose modes are computed: the lowest frequency first falls, then rises with n
MOST: Final = 1000  # most harmonics of the static compliance


def lip_greens(
    build: Callable[[int], SecondOrderModel],
    patches: Mapping[str, harmonics.RingPatch],
    aims: Aims,
    damping_ratio: float = 0.0,
    *,
    static: bool = False,
    progress: Progress = silent,
) -> ModalGreens:
    """Return one Green's function of all patches from the models ``build(n)``, whose ports are the rings by boundary
    name.

    Args:
        build: function that returns the model of a harmonic.
        patches: patches on the rings, by port.
        aims: bandwidth and duration for which the error is estimated; the tolerance is not used.
        damping_ratio: damping ratio of every mode.
        static: whether to omit modes.
        progress: receives the progress over the harmonics.

    Raises:
        ModelError: patches overlap. FactorizationError: the body is free to move. ConvergenceError: arcs are so narrow
        that `MOST` harmonics do not represent their compliance.
    """
    harmonics.check_patches(patches)
    rings = list(dict.fromkeys(patch.boundary for patch in patches.values()))
    first = build(0)
    damping = first.damping.plus(damping_ratio)
    compliance, last, doubt = _statics(build, first, patches, rings, aims, progress)
    parts, harmonic, earlier = [(np.zeros(0), np.zeros(0), np.zeros((0, len(patches))))], 0, list[Array]()
    while not static:
        model = first if harmonic == 0 else build(harmonic)
        omega, moved = _modes_of(model, earlier, BEYOND * aims.bandwidth, aims.backend)
        if harmonic > FEWEST and not len(omega):
            break
        earlier = [*earlier, moved][-2:]
        own = model.damping.plus(damping_ratio)
        zeta = own.ratios(omega, own.losses(moved))
        of_rings = moved.T @ np.stack([model.ports[ring].vector for ring in rings], axis=1)
        for wave in harmonics.mixing(patches, rings, harmonic):
            shapes = of_rings @ wave.T
            seen = shapes.any(axis=1)
            parts.append((omega[seen], np.broadcast_to(zeta, omega.shape)[seen], shapes[seen]))
        harmonic += 1
        progress("harmonics", harmonic / (harmonic + 8))
    widths = np.array([patch.width for patch in patches.values()])
    impedance = np.array([first.ports[patch.boundary].impedance for patch in patches.values()])
    start = np.diag(damping.first_velocity() * 2 * math.pi / (widths * impedance))
    omegas, zetas, all_shapes = (np.concatenate(each) for each in zip(*parts, strict=True))
    rest = relaxation(_residual_compliance(compliance, omegas, all_shapes), start, damping.beta)
    greens = ModalGreens(omegas, zetas, all_shapes, rest, tuple(patches))
    cutoff, t = BEYOND * aims.bandwidth, oscillator.error_times(aims.duration, aims.width)
    error = modal.modal_error(greens, t, aims.bandwidth, cutoff, [0]) if len(greens.omega) else 0.0
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
    return greens.with_error(base.ErrorEstimate(reduction=error + doubt / float(np.abs(compliance).max())), origin)


def _modes_of(
    model: SecondOrderModel, earlier: Sequence[Array], up_to_hz: float, backend: Backend
) -> tuple[Array, Array]:
    """Return w [rad/s] and shapes of all modes of a harmonic up to a frequency, found from those of the two harmonics
    before where they have the same unknowns."""
    if len(earlier) > 1 and all(len(each) == model.size for each in earlier):
        close = modes_near(model, np.concatenate(earlier, axis=1), up_to_hz, backend)
        if close is not None:
            return close
    modes = solve_modes(model, up_to_hz=up_to_hz, backend=backend)
    return modes.omega, modes.shapes


def _statics(
    build: Callable[[int], SecondOrderModel],
    first: SecondOrderModel,
    patches: Mapping[str, harmonics.RingPatch],
    rings: list[str],
    aims: Aims,
    progress: Progress,
) -> tuple[Array, int, float]:
    """Return the static compliance (p, p) [m/N], the last harmonic computed, and the error by those extrapolated."""
    places = [first.port_names.index(patch.boundary) for patch in patches.values()]
    whole = static_compliance(first, aims.backend)[np.ix_(places, places)]
    tail, largest = harmonics.Tail(patches, rings, 0), 0.0
    while (doubt := tail.doubt()) > ARC_ERROR * largest:
        if tail.last >= MOST:
            raise ConvergenceError(
                f"{tail.last} harmonics cannot represent the compliance of the lip segments: take fewer"
            )
        tail.add(build(tail.next), aims.backend)
        largest = float((np.diag(whole) + tail.diagonal()).max())
        progress("harmonics", 0.5 * tail.last / (tail.last + 40))
    return whole + tail.compliance(), tail.last, doubt


def _residual_compliance(compliance: Array, omega: Array, shapes: Array) -> Array:
    """Return the (p, p) residual compliance: a static compliance less that of the modes."""
    bent = shapes / omega[:, None]
    return semidefinite(compliance - bent.T @ bent, 1e-3 * float(np.abs(compliance).max()))


class BandError(ConvergenceError):
    """More modes than are computed lie in a band; ``band`` is the widest that has few enough [Hz]."""

    def __init__(self, text: str, band: float) -> None:
        super().__init__(text)
        self.band = band


PUSHED: Final = 8  # ports around the lip under whose impulses the error is estimated


def face_greens(
    model: SecondOrderModel,
    aims: Aims,
    damping_ratio: float = 0.0,
    *,
    static: bool = False,
    progress: Progress = silent,
) -> tuple[ModalGreens, Modes | None]:
    """Return the Green's function of all ports of a model, and its modes.

    Args:
        model: model whose ports are the parts of the lip.
        aims: bandwidth and duration for which the error is estimated; the tolerance is not used.
        damping_ratio: damping ratio of every mode, added to the model's own damping.
        static: without modes: the exponential from 1/Z_i on each part to the static compliance.
        progress: receives the progress of modes and static solves.

    Raises:
        ModelError: damping couples the modes. FactorizationError: the body is free to move, with ``static``.
        BandError: more than `MOST_MODES` modes. ConvergenceError: modes that are not found.
    """
    damping = model.damping.plus(damping_ratio)
    if damping.refusal and not static:
        raise ModelError(f"contact.ports: lip segments need modes of the seat: {damping.refusal}")
    origin = {"bandwidth_Hz": aims.bandwidth, "damping_ratio": damping_ratio, "dof": model.size}
    modes = None if static else _modes(model, aims, progress)
    if modes is None or not len(modes.omega):
        compliance = static_compliance(model, aims.backend, progress)
        none = np.zeros(0)
        rest = residual(compliance, model, damping)
        greens = ModalGreens(none, none, np.zeros((0, len(model.ports))), rest, model.port_names)
        return greens.with_error(base.ErrorEstimate(reduction=0.0), {"method": "statics", **origin}), modes
    pushed = range(0, len(model.ports), max(1, len(model.ports) // PUSHED))
    greens = modal.with_modes(model, damping, modes, BEYOND * aims.bandwidth, aims, pushed, progress)
    return greens.with_error(greens.error, {**greens.origin, "method": "modes", **origin}), modes


def _modes(model: SecondOrderModel, aims: Aims, progress: Progress) -> Modes:
    """Return all modes up to `BEYOND` times the band; the `BandError` for too many names a lower band."""
    try:
        highest = BEYOND * aims.bandwidth
        return solve_modes(model, up_to_hz=highest, limit=MOST_MODES, backend=aims.backend, progress=progress)
    except eigen_search.CrowdedError as crowded:
        count, lower = crowded.count, aims.bandwidth
        while count > MOST_MODES:
            lower *= 0.95 * (MOST_MODES / count) ** (1 / 3)
            count = eigen_search.counting_shift(model, (2 * np.pi * BEYOND * lower) ** 2, aims.backend).count
        raise BandError(
            f"contact.ports: the seat has {crowded.count} modes below {BEYOND:g} times seat.greens.bandwidth = "
            f"{write_quantity(aims.bandwidth, 'frequency', 3)} (limit {MOST_MODES}): lower it to "
            f"{write_quantity(lower, 'frequency', 3)}",
            lower,
        ) from None
