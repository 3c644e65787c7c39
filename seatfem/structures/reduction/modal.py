"""Reduction by modal truncation: modes up to a cutoff, and a passive exponential for the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from impact.greens import base, modal
from impact.greens.oscillator import error_times
from impact.notices import Progress, silent
from seatfem.structures.method import Aims
from seatfem.structures.model import Array, Damping, SecondOrderModel
from seatfem.structures.reduction import eigen_search, reducer
from seatfem.structures.reduction.factorization import Backend, factorize, solve_in_blocks
from seatfem.structures.reduction.modes import DENSE, Modes, dense_modes, modes_of
from seatfem.structures.reduction.reducer import USUAL, Cost, Reducer, Reduction, factorized
from seatfem.structures.reduction.spectrum import Spectrum

ALL_MODES: Final = 200  # unknowns up to which all modes cost less than a Krylov space (measured)
_FREE: Final = 0.03  # shift s over the last mode of a free body: an error of 0.1 % in its residual flexibility
MODES_ARE_CHEAP: Final = 3000  # unknowns up to which modes cost little all the same


@dataclass(frozen=True)
class Modal(Reducer):
    """Reduction to all modes up to a cutoff, with the residual flexibility of the others as a passive exponential.

    The cutoff rises until the estimated error is within the tolerance. The error is the sum of that by the
    exponential's lag (against a bare spring) and that by vibration of the truncated modes after the pulse: with x =
    cutoff/bandwidth at most R0 2 bandwidth/(x^2 - 1), all in phase, and usually near the change by dropping the top 30
    % of the modes.

    Attributes:
        most: most modes; if more are needed, `reduce` raises `ConvergenceError`.
    """

    most: int = 1500

    name = "modes"
    any_time = True

    def cost(self, model: SecondOrderModel, aims: Aims) -> Cost:
        """Return zero for a small model, for which any other reduction takes longer; else ten times Krylov's cost."""
        if model.size <= ALL_MODES:
            return Cost(0.0, f"all modes at once (up to {ALL_MODES})")
        return Cost(factorized(model, 10 * USUAL * len(model.ports)), "the modes, ten times as many vectors")

    def advice(self, model: SecondOrderModel) -> str:
        """Return the advice to use Krylov vectors for a large model."""
        if model.size <= MODES_ARE_CHEAP:
            return ""
        return (
            "modes cost far more than the Green's function needs: method='krylov' reaches the same error with one "
            "factorization and a tenth of the vectors"
        )

    def reduce(self, model: SecondOrderModel, damping: Damping, aims: Aims, progress: Progress = silent) -> Reduction:
        """Reduce as `Reducer.reduce`, with all modes up to the cutoff."""
        scale = eigen_search.default_shift(model)
        small = dense_modes(model, scale) if model.size <= DENSE else None
        spectrum = Spectrum(model, backend=aims.backend, progress=progress)
        static: tuple[float, Array, bool] | None = None
        cutoff, count, error = 3.0 * aims.bandwidth, 0, np.inf
        while True:
            square = (2 * np.pi * cutoff) ** 2
            if small is None:
                try:
                    spectrum.below(square, self.most)
                    spectrum.first(1)  # the lowest mode, even if the band is below it
                except eigen_search.CountError as problem:
                    raise eigen_search.CountError(f"{problem}: use method='krylov'") from problem
                except eigen_search.ConvergenceError as problem:
                    raise eigen_search.ConvergenceError(
                        f"{problem}, and {count} leave an error of {error:.1e} (tolerance {aims.tolerance:.1e}): "
                        "use method='krylov'"
                    ) from problem
            modes = modes_of(spectrum, scale) if small is None else small
            count = len(modes.omega)
            if static is None:
                static = _static(model, modes, aims.backend, progress=progress)
            greens, error = _build_from_modes(model, damping, modes, cutoff, aims, static)
            if error <= aims.tolerance or (count == model.size and 2 * np.pi * cutoff > modes.omega[-1]):
                break
            cutoff *= 1.3
        progress("reduction", 1.0)
        return Reduction(_documented(greens, error, count, cutoff), modes)


def with_modes(
    model: SecondOrderModel,
    damping: Damping,
    modes: Modes,
    cutoff: float,
    aims: Aims,
    pushed: Sequence[int],
    progress: Progress = silent,
) -> modal.ModalGreens:
    """Return the Green's function of a model's ports by known ``modes``, all up to ``cutoff`` [Hz]; see `Modal`.

    ``pushed``: numbers of the ports between which its error is estimated.
    """
    static = _static(model, modes, aims.backend, deflated=True, progress=progress)
    greens, error = _build_from_modes(model, damping, modes, cutoff, aims, static, list(pushed))
    return _documented(greens, error, len(modes.omega), cutoff)


def _build_from_modes(
    model: SecondOrderModel,
    damping: Damping,
    modes: Modes,
    cutoff: float,
    aims: Aims,
    static: tuple[float, Array, bool],
    judged: list[int] | slice = modal.ALL,
) -> tuple[modal.ModalGreens, float]:
    """Return the Green's function by modes up to ``cutoff`` and its relative error between the ports ``judged``."""
    shapes = modes.shapes.T @ model.port_matrix
    extra = _residual_compliance(model, modes, shapes, *static)
    zeta = damping.ratios(modes.omega, damping.losses(modes.shapes))
    greens = reducer.truncate(modes.omega, zeta, shapes, 2 * np.pi * cutoff, extra, model, damping)
    return greens, modal_error(greens, error_times(aims.duration, aims.width), aims.bandwidth, cutoff, judged)


def _documented(greens: modal.ModalGreens, error: float, count: int, cutoff: float) -> modal.ModalGreens:
    """Return the Green's function with its error and provenance."""
    checks = {"reciprocity": 0.0, **reducer.passivity(greens)}
    origin = {"modes": count, "cutoff_Hz": cutoff, "counted": True, "checks": checks}
    return greens.with_error(base.ErrorEstimate(reduction=error), origin)


def modal_error(
    greens: modal.ModalGreens, t: Array, bandwidth: float, cutoff: float, judged: list[int] | slice = modal.ALL
) -> float:
    """Return the error of a modal Green's function with modes up to ``cutoff`` [Hz] between some ports; see `Modal`."""
    own = greens.residual
    within = modal.Residual(own.shapes[:, judged], own.rates, own.compliance[judged][:, judged])
    names = tuple(np.array(greens.port_names)[judged])
    greens = replace(greens, shapes=greens.shapes[:, judged], residual=within, port_names=names)
    top = greens.omega > 0.7 * 2 * np.pi * cutoff
    rest = greens.select_modes(np.zeros_like(top), within)
    highest = greens.select_modes(top, modal.Residual.none(len(names)))
    lag, lost = (_distance_from_spring(part, t, 1 / bandwidth) for part in (rest, highest))
    full = float(np.abs(greens.filtered_matrix(t, 1 / bandwidth)).max())
    bound = float(np.abs(within.static()).max()) * 2 * bandwidth / ((cutoff / bandwidth) ** 2 - 1)
    rings = 2 * lost if np.sum(top) >= 10 else bound
    return 1.2 * (lag + float(np.clip(rings, bound / 10, bound))) / full  # ratios scatter


def _distance_from_spring(part: modal.ModalGreens, t: Array, width: float) -> float:
    """Return the largest difference of a part of g from a spring of the same static compliance, after a pulse."""
    spring = modal.Residual.spring(part.static_compliance())
    return float(np.abs(part.filtered_matrix(t, width) - spring.filtered(t, width)).max())


def _static(
    model: SecondOrderModel,
    modes: Modes,
    backend: Backend,
    *,
    deflated: bool = False,
    progress: Progress = silent,
) -> tuple[float, Array, bool]:
    """Return (s^2, B'P'(K + s^2 M)^-1 P B, ``deflated``), s below truncated modes, P = 1 - M R R' with rigid modes R.

    P B are loads balanced by inertia, under which a free body does not move away. ``deflated``: R are all known modes,
    so that the result is the compliance of the truncated ones, without cancellation in a difference.
    """
    loads, last, rigid = model.port_matrix, float(modes.omega[-1]), modes.shapes[:, modes.omega == 0]
    shift = min(eigen_search.default_shift(model), 1e-3 * last)
    if rigid.shape[1]:  # round-off of K moves it by eps max(K/M)/s^2
        shift = _FREE * (last or eigen_search.default_shift(model))
    known = modes.shapes if deflated else rigid
    if known.shape[1]:
        loads = loads - model.M @ (known @ (known.T @ loads))
    progress("factorization", 0.0)
    factor = factorize(model.K + shift**2 * model.M, backend=backend, name="K + s^2 M")
    progress("factorization", 1.0)
    return shift**2, loads.T @ solve_in_blocks(factor, loads, progress), deflated


def _residual_compliance(
    model: SecondOrderModel, modes: Modes, shapes: Array, square: float, static: Array, deflated: bool
) -> Array:
    """Return the (p, p) static compliance of the truncated modes: `_static` less ``modes`` if it includes them."""
    if len(modes.omega) == model.size:
        return np.zeros((shapes.shape[1], shapes.shape[1]))
    elastic = (modes.omega > 0) & (not deflated)
    known = shapes[elastic]
    rest = static - (known / (modes.omega[elastic] ** 2 + square)[:, None]).T @ known
    return reducer.semidefinite(rest, 1e-6 * float(np.abs(static).max()))
