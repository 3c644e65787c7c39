"""Base class of all reductions, Krylov spaces with Ritz pairs and error estimates, and the residual of truncated modes.

The residual is passive; further checks are of reciprocity and passivity of a Green's function.
"""

from __future__ import annotations

import inspect
import math
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import ClassVar, Final, Generic, TypeVar

import numpy as np

from impact.greens import modal, oscillator, poles
from impact.greens.base import GreensFunction, StatedGreens
from impact.greens.passivity import pole_passivity
from impact.notices import Progress, silent
from impact.quantities import brief
from seatfem.structures.method import Aims
from seatfem.structures.model import Array, Damping, SecondOrderModel
from seatfem.structures.reduction.modes import ConvergenceError, Modes

USUAL: Final = 100  # usual number of Krylov vectors for one port
_FACTOR, _FACTOR_ORDER = 2.5e-7, 1.47  # time [s] of a factorisation and its power of the unknowns; PARDISO, two cores
_VECTOR = 8e-7  # time [s] per unknown and Krylov vector: solve, two products and the orthogonalisation


@dataclass(frozen=True)
class Reduction:
    """A Green's function, and the modes of the body, if the reduction computes any (krylov and modes)."""

    greens: StatedGreens
    modes: Modes | None = None

    __repr__ = brief


@dataclass(frozen=True)
class Cost:
    """Predicted effort of a reduction.

    Attributes:
        seconds: time on a reference machine; only ratios are used.
        effort: the main operations, in a few words.
    """

    seconds: float
    effort: str


class Reducer(ABC):
    """A reduction: a method to compute the Green's function g of a model's ports.

    Defining a concrete subclass with a ``name`` registers it for ``method=name``, for a scene's ``seat.greens.method``
    and for the choice of "auto".

    Attributes:
        name: name of the reduction.
        oscillators: whether its g is a sum of oscillators; others are convolved by step weights.
        any_time: whether its g is valid beyond the duration it was computed for, like modes of the body.
        bears_rounding: whether its vectors may be rounded, by factors in single precision or iterations on two grids.
    """

    name: ClassVar[str]
    oscillators: ClassVar[bool] = True
    any_time: ClassVar[bool] = False
    bears_rounding: ClassVar[bool] = False

    def refusal(self, model: SecondOrderModel, damping: Damping, aims: Aims) -> str:
        """Return why it cannot be used, with a remedy, or "" if it can; by default damping that couples modes."""
        return damping.refusal

    @abstractmethod
    def cost(self, model: SecondOrderModel, aims: Aims) -> Cost:
        """Return the predicted effort for a model that it can reduce; infinite: a last resort."""

    @abstractmethod
    def reduce(self, model: SecondOrderModel, damping: Damping, aims: Aims, progress: Progress = silent) -> Reduction:
        """Return g of all ports with ``error_estimate.reduction``, and details of the computation in ``origin``.

        ``damping``: the model's damping and the ratio added to it.

        Raises:
            ConvergenceError: the tolerance is not reached.
        """

    def advice(self, model: SecondOrderModel) -> str:
        """Return advice on a better choice, for a reduction that was chosen by name; "" for none."""
        return ""


def defined(base: type[Reducer] = Reducer) -> Iterator[type[Reducer]]:
    """Yield all reductions that are imported so far: concrete direct and indirect subclasses with their own name."""
    for kind in base.__subclasses__():
        if not inspect.isabstract(kind) and "name" in vars(kind):
            yield kind
        yield from defined(kind)


def factorized(model: SecondOrderModel, vectors: int) -> float:
    """Return the predicted time of one factorization and a number of Krylov vectors [s]."""
    return float(_FACTOR * model.size**_FACTOR_ORDER + vectors * _VECTOR * model.size)


_SINCE: Final = 1.4  # error estimate over the change since two thirds of the vectors


@dataclass
class History:
    """Changes of g after the pulse from one check to the next, and the error extrapolated from them."""

    tolerance: float
    last: Array | None = None
    changes: list[float] = field(default_factory=list)
    first_error: float = np.inf
    seen: list[tuple[int, Array]] = field(default_factory=list)

    def add(self, response: Array, size: int = 0) -> float:
        """Return the estimated error of ``response``, of ``size`` Krylov vectors, relative to its maximum.

        With d the last change (or half the median of three: changes are uneven) and r the mean ratio of the last
        changes, the changes to come sum to d r/(1 - r). Twice that is stated, and at least 2 d. On rods and blocks the
        true error stayed below, damped or not, mostly within a factor of five; only undamped meshes coarser than the
        waves of the band, which converge slowly to the end, exceeded it (threefold).

        Undamped seats that converge slowly have r near 1, and the sum overestimates ten times. With ``size``, twice
        the sum or 1.4 times the change since two thirds of the vectors is stated, whichever is less; the latter holds
        where the error falls to 0.58 or less over that. Where either ended the growth of 108 reductions to 2, 0.5 and
        0.1 % (nine blocks, plates and bars against all their modes; three bands and durations, two dampings, two
        shifts), the true error was at most 0.98 of it; the sum alone was exceeded twofold there.
        """
        before, self.last = self.last, response
        earlier = None
        if size:  # the response with at most two thirds of the vectors; older ones are dropped
            older = [k for k, (n, _) in enumerate(self.seen) if 3 * n <= 2 * size]
            self.seen = [*self.seen[older[-1] if older else 0 :], (size, response)]
            earlier = self.seen[0][1] if older else None
        if before is None:
            return np.inf
        self.changes.append(_apart(response, before))
        recent = self.changes[-4:]
        if len(recent) < 2:
            return np.inf
        ratio = float(np.clip((recent[-1] / max(recent[0], 1e-300)) ** (1 / (len(recent) - 1)), 0.0, 0.9))
        summed = 2 * max(recent[-1], float(np.median(recent[-3:])) / 2) * max(1.0, ratio / (1 - ratio))
        if not size:
            return summed
        return min(2 * summed, np.inf if earlier is None else _SINCE * _apart(response, earlier))

    def fraction(self, error: float) -> float:
        """Return the progress on a logarithmic scale, as convergence is geometric."""
        if not np.isfinite(error):
            return 0.0
        self.first_error = min(self.first_error, max(error, 2 * self.tolerance))
        share = np.log(self.first_error / max(error, self.tolerance)) / np.log(self.first_error / self.tolerance)
        return float(np.clip(share, 0.0, 0.99))


def _apart(response: Array, other: Array) -> float:
    """Return the largest difference, relative to the largest value of the first."""
    return float(np.abs(response - other).max() / np.abs(response).max())


G = TypeVar("G", bound=GreensFunction)
Grown = tuple[Array, bool, bool, int]
"""State after growth: (p, p, nt) g after the pulse [m/(N s)]; whether the space is complete; whether no further vector
is allowed; the number of vectors if it measures the progress of the space (`History.add`), else 0."""


class Space(ABC, Generic[G]):
    """A space of vectors, and the Green's function g in it, whose error is that after the Hann pulse of the band.

    Attributes:
        model, damping: the model and its damping.
        aims: bandwidth, duration and tolerance of g.
        history: changes of g so far.
        t: (nt,) times at which g is compared [s].
        omega: (k,) angular frequencies of the undamped pairs in the space [rad/s], once it has grown.
        step: ratio of successive cutoffs that are tried.
    """

    step: ClassVar[float] = 1.25
    omega: Array

    def __init__(self, model: SecondOrderModel, damping: Damping, aims: Aims) -> None:
        self.model, self.damping, self.aims = model, damping, aims
        self.history = History(aims.tolerance)
        self.t = oscillator.error_times(aims.duration, aims.width)

    @abstractmethod
    def grow(self) -> Grown:
        """Add vectors; return the new state of g as `Grown`."""

    @abstractmethod
    def truncated(self, above: float) -> tuple[G, float]:
        """Return g with the pairs up to ``above`` [rad/s] and a residual for the others, and its relative error."""

    @abstractmethod
    def shortfall(self, error: float) -> str:
        """Return the message for a full space whose error is still ``error``."""

    def converge(self, progress: Progress) -> tuple[G, float]:
        """Return g and its estimated error: that by missing vectors (`History`) plus that by truncation.

        Raises:
            ConvergenceError: the space is full before the tolerance is reached.
        """
        tolerance = self.aims.tolerance
        while True:
            response, complete, full, size = self.grow()
            error = 0.0 if complete else self.history.add(response, size)
            if error <= tolerance / 2:
                greens, cut = self._cut(tolerance / 2)
                if complete and cut > tolerance / 2:
                    greens, cut = self.truncated(np.inf)  # the space is complete: all pairs are exact
                error += cut
                if error <= tolerance or complete:
                    progress("reduction", 1.0)
                    return greens, error
            progress("reduction", self.history.fraction(error))
            if full:
                raise ConvergenceError(self.shortfall(error))

    def _cut(self, allowed: float) -> tuple[G, float]:
        """Return `truncated` at the lowest cutoff with an error below ``allowed``, else that with the least error."""
        above = 2 * self.aims.band
        best, lowest = self.truncated(above)
        while lowest > allowed and np.any(self.omega > above * self.step):
            above *= self.step
            greens, error = self.truncated(above)
            if error < lowest:
                best, lowest = greens, error
        return best, lowest


class RitzSpace(Space[modal.ModalGreens]):
    """A space whose Ritz pairs are not coupled by damping."""

    def see(self, omega: Array, shapes: Array, *, loss: Array | float = 0.0) -> Array:
        """Set the pairs of the space; return their (p, p, nt) response after the pulse.

        Args:
            omega, shapes: (k,) and (k, p), mass-normalised.
            loss: (k,) phi' H phi of each pair [1/s^2], for a loss matrix that is not eta K.
        """
        self.omega, self._shapes = omega, shapes
        self._zeta = self.damping.ratios(omega, loss)
        self._each = oscillator.mode_responses(omega, self._zeta, self.t, self.aims.width)
        self._response = oscillator.combine(shapes, self._each, shapes)
        return self._response

    def truncated(self, above: float) -> tuple[modal.ModalGreens, float]:
        """Truncate as `Space.truncated`: the highest pairs are no modes of the body, and would ring in the contact."""
        none = np.zeros((self._shapes.shape[1],) * 2)
        greens = truncate(self.omega, self._zeta, self._shapes, above, none, self.model, self.damping)
        dropped = self.omega > above
        stand_in = greens.residual.filtered(self.t, self.aims.width)
        gone = self._shapes[dropped]
        lost = stand_in - oscillator.combine(gone, self._each[dropped], gone)
        return greens, float(np.abs(lost).max()) / float(np.abs(self._response).max())


def reciprocity(matrix: Array) -> float:
    """Return max |G - G'| / max |G| for (p, p) or (p, p, n) values: 0 for a reciprocal Green's function."""
    largest = float(np.abs(matrix).max())
    return float(np.abs(matrix - np.swapaxes(matrix, 0, 1)).max()) / largest if largest else 0.0


def passivity(greens: modal.ModalGreens) -> dict[str, object]:
    """Return whether a modal Green's function is passive, and the margins: modes with zeta >= 0, relaxations with
    positive rates and a positive semidefinite residual compliance cannot gain energy."""
    compliance = float(np.linalg.eigvalsh(greens.residual.compliance)[0])
    least = float(greens.zeta.min(initial=np.inf))
    return {
        "passive": bool(least >= 0 and compliance >= 0 and np.all(greens.residual.rates >= 0)),
        "least_damping_ratio": least if np.isfinite(least) else None,
        "least_residual_compliance": compliance,
    }


def passivity_of_poles(greens: poles.PoleGreens) -> dict[str, object]:
    """Return whether a Green's function of complex poles is passive, by its mobility's real part at all frequencies."""
    verdict = pole_passivity(greens)
    return {"passive": verdict.passive, "margin": verdict.margin, "margin_at_Hz": verdict.frequency}


def feeding(model: SecondOrderModel, damping: Damping) -> str:
    """Return in words how the model's damping would add energy; "" if it does not, by the diagonal of C."""
    least = 0.0 if model.C is None else float(model.C.diagonal().min(initial=0.0))
    if least < 0:
        return f"C has a diagonal value {least:g}: it must not be negative and feed energy"
    return "" if damping.coupling else damping.refusal


_LEAST = 1e-9  # least initial velocity over the largest, to exclude round-off


def residual(left_out: Array, model: SecondOrderModel, damping: Damping) -> modal.Residual:
    """Return a passive replacement for modes above the band, of static compliance R0 = ``left_out`` (p, p) [m/N].

    It is the `relaxation` with g(0+) of the continuum, 1/Z times `Damping.first_velocity`, or a bare spring if the
    impedance of a port is unknown.
    """
    impedances = [port.impedance for port in model.ports.values()]
    if math.inf in impedances:
        if damping.beta == 0:
            return modal.Residual.spring(left_out)
        impedances = [1e-9 * damping.beta / max(r, 1e-300) for r in np.diag(left_out)]
    start = np.diag(damping.first_velocity() / np.array(impedances))
    return relaxation((left_out + left_out.T) / 2, start, damping.beta)


def semidefinite(rest: Array, allowed: float) -> Array:
    """Return a compliance (p, p) without negative eigenvalues; raises `ConvergenceError` if they exceed ``allowed``."""
    values, vectors = np.linalg.eigh((rest + rest.T) / 2)
    if len(values) and values[0] < -allowed:
        raise ConvergenceError(
            f"the modes exceed the static compliance by {-values[0]:.2e} m/N: not converged; check the units, or use "
            "method='krylov'"
        )
    return np.asarray(vectors * np.maximum(values, 0.0) @ vectors.T)


def relaxation(compliance: Array, start: Array, beta: float) -> modal.Residual:
    """Return the exponential with integral R0 = ``compliance`` (p, p) [m/N] and g(0+) = ``start`` (p, p) [m/(N s)].

    tau = R0/g(0+) for one port. Stiffness-proportional damping changes it to tau + ``beta``: modes far above 2/beta are
    overdamped and creep as exp(-t/beta), like a spring parallel to a dashpot of ratio beta [s].
    """
    scale, vectors = np.linalg.eigh(start)
    scale = np.sqrt(np.maximum(scale, _LEAST * scale[-1]))
    root, back = vectors * scale @ vectors.T, vectors / scale @ vectors.T
    taus, turn = np.linalg.eigh(back @ compliance @ back)
    taus = np.maximum(taus, 0.0)  # round-off
    slowed = np.where(taus > 0, taus / (np.where(taus > 0, taus, 1.0) + beta), 1.0)
    return modal.Residual.exponential(root @ (turn * taus) @ turn.T @ root, root @ (turn * slowed) @ turn.T @ root)


def truncate(
    omega: Array, zeta: Array, shapes: Array, above: float, extra: Array, model: SecondOrderModel, damping: Damping
) -> modal.ModalGreens:
    """Return modes up to the angular frequency ``above``; the others' compliance, plus ``extra``, as residual.

    Args:
        omega, zeta, shapes: (m,), (m,) and (m, p) mass-normalised modes.
        above: highest retained angular frequency [rad/s].
        extra: (p, p) static compliance known to be in no mode at all [m/N].
    """
    kept = omega <= above
    dropped = shapes[~kept] / omega[~kept, None]
    tail = damping
    if damping.loss is not None:  # mean loss of the dropped modes, weighted by their compliance
        elastic = omega > 0 if kept.all() else ~kept
        share = np.sum((shapes[elastic] / omega[elastic, None]) ** 2, axis=1)
        lost = (zeta - damping.ratios(omega))[elastic]
        tail = damping.plus(float(share @ lost / share.sum()))
    rest = residual(dropped.T @ dropped + extra, model, tail)
    return modal.ModalGreens(omega[kept], zeta[kept], shapes[kept], rest, model.port_names)
