"""Green's function of contacts on a body of revolution that are off the axis or several, by Fourier harmonics.

G_ij(t) = sum over n of s_ni s_nj cos n(th_i - th_j) g_n(t)

with g_n the ring's response in harmonic n. A uniform pressure of a force F on an arc of width w about th_i of a ring of
area A is F/A times

    1 + 2 sum_n s_n cos n(th - th_i),      s_n = sin(n w/2)/(n w/2)

and the mean of cos n(th - th_i) over the same arc is s_n, too: each harmonic is reciprocal. Harmonics with natural
frequencies in the band are reduced like any model. The others are quasi-static: a few of their static compliances,
close to C/n, are computed, the rest interpolated, and a passive exponential has their sum and the part of g(0+) that
the patches still lack.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import sparse

from impact.greens import base, modal, oscillator
from impact.notices import Progress, silent
from seatfem.structures.elements.axisymmetric import assemble_axisymmetric
from seatfem.structures.elements.supports import Support
from seatfem.structures.materials import Solid
from seatfem.structures.method import AUTO, Aims
from seatfem.structures.model import Array, Damping, ModelError, SecondOrderModel
from seatfem.structures.reduction import factorization, reducer
from seatfem.structures.reduction.greens import reduced
from seatfem.structures.reduction.modes import ConvergenceError
from seatfem.structures.rings import ring_names

NARROWEST: Final = 1e-4
"""Least width of a patch [rad]: its static compliance is a sum over 200/width harmonics, in several arrays."""


@dataclass(frozen=True)
class RingPatch:
    """An arc of a ring-shaped face, under uniform pressure and with its mean displacement.

    Attributes:
        angle: angle of its middle [rad].
        width: its width [rad], `NARROWEST` <= width <= 2 pi.
        boundary: name of the ring, a boundary of the meridian mesh.

    Raises:
        ModelError: the width is outside its range (a line has no finite compliance), or a value is not finite.
    """

    angle: float
    width: float
    boundary: str = "contact"

    def __post_init__(self) -> None:
        if not (NARROWEST <= self.width <= 2 * math.pi * (1 + 1e-12)):
            raise ModelError(f"ring patch: width = {self.width} rad must be at least {NARROWEST:g} and at most 2 pi")
        if not math.isfinite(self.angle):
            raise ModelError(f"ring patch: angle = {self.angle} rad must be finite")

    def coefficients(self, harmonics: ArrayLike) -> Array:
        """Return s_n of each harmonic n; s_0 = 1."""
        return np.asarray(np.sinc(np.asarray(harmonics) * min(self.width / (2 * math.pi), 1.0)))


def check_patches(patches: Mapping[str, RingPatch]) -> None:
    """Raise `ModelError` if there are none, or two of one ring overlap."""
    if not patches:
        raise ModelError("no ring patch: give at least one")
    for (one, a), (other, b) in itertools.combinations(patches.items(), 2):
        apart = abs(math.remainder(a.angle - b.angle, 2 * math.pi))
        if a.boundary == b.boundary and apart < (a.width + b.width) / 2 - 1e-9:
            raise ModelError(
                f"ring patches {one!r} and {other!r} overlap: their middles are {apart:.4g} rad apart, must be "
                f"at least half the sum of their widths {a.width:.4g} and {b.width:.4g} rad"
            )


def mixing(patches: Mapping[str, RingPatch], rings: list[str], harmonic: int) -> list[Array]:
    """Return the (p, rings) matrices X from harmonic amplitudes of the rings, one for cos n th and one for sin n th, to
    the patches: g_ij is a sum of X g_n X'. Matrices of zeros are omitted."""
    waves = np.moveaxis(mixing_of(patches, rings, harmonic), 2, 0)
    return [weight for wave in waves if np.any(weight := np.where(np.abs(wave) > 1e-12, wave, 0.0))]


def mixing_of(patches: Mapping[str, RingPatch], rings: list[str], harmonic: int) -> Array:
    """Return the (p, rings, 2) amplitudes of cos n th and sin n th on the rings of a unit force on each patch."""
    out = np.zeros((len(patches), len(rings), 2))
    for i, patch in enumerate(patches.values()):
        turn = harmonic * patch.angle
        wave = np.array([np.cos(turn), np.sin(turn)])
        out[i, rings.index(patch.boundary)] = patch.coefficients(harmonic) * wave
    return out


def summed(patches: Mapping[str, RingPatch], harmonics: NDArray[np.int64], law: Array, places: list[int]) -> Array:
    """Return the (p, p) sums over n of s_ni s_nj cos n(th_i - th_j) law_n, with ``places`` (p,) the ring of each patch
    and ``law`` (rings, rings, n); cos n(th_i - th_j) is a product of cosines plus one of sines."""
    each = np.stack([patch.coefficients(harmonics) for patch in patches.values()])
    turns = np.array([patch.angle for patch in patches.values()])[:, None] * harmonics
    out, of = np.zeros((len(each), len(each))), np.array(places)
    for wave in (each * np.cos(turns), each * np.sin(turns)):
        for one, other in itertools.product(range(len(law)), repeat=2):
            rows, columns = of == one, of == other
            out[np.ix_(rows, columns)] += (wave[rows] * law[one, other]) @ wave[columns].T
    return out


def first_velocities_beyond(patches: Mapping[str, RingPatch], ring_impedance: Mapping[str, float], last: int) -> Array:
    """Return the (p, p) g(0+) of all harmonics above ``last`` together [m/(N s)].

    By Parseval's identity all harmonics sum to 1/Z_i for each patch, Z_i = rho c_p A_i, and to 0 between disjoint ones.
    """
    listed = list(patches.values())
    rings = list(dict.fromkeys(patch.boundary for patch in listed))
    places = [rings.index(patch.boundary) for patch in listed]
    same = np.equal.outer(places, places).astype(float)
    whole = np.diag([2 * math.pi / patch.width for patch in listed])
    each = np.broadcast_to(np.eye(len(rings))[:, :, None], (len(rings), len(rings), last))
    below = summed(patches, np.arange(1, last + 1), each, places)
    root = np.array([ring_impedance[patch.boundary] for patch in listed]) ** -0.5
    return np.asarray((whole - same * (1 + 2 * below)) * root[:, None] * root)


_STEP = 1.3  # ratio of successive harmonics whose static compliance is computed


class Tail:
    """Static compliances R_n of the harmonics above ``reduced``, close to C/n."""

    def __init__(self, patches: Mapping[str, RingPatch], rings: list[str], reduced: int) -> None:
        self.patches, self.reduced, self.last = patches, reduced, reduced
        self._places = [rings.index(patch.boundary) for patch in patches.values()]
        self._numbers: list[int] = []
        self._scaled: list[Array] = []  # n R_n, (rings, rings)
        narrowest = min(patch.width for patch in patches.values())
        self._far = int(200 / narrowest) + 20  # beyond this, s_n^2/n sums to less than 1e-4 of the total

    @property
    def next(self) -> int:
        """Return the next harmonic whose compliance is to be computed."""
        return self.last + max(1, int((_STEP - 1) * self.last))

    def add(self, model: SecondOrderModel, backend: factorization.Backend) -> None:
        """Compute the compliance of the harmonic `next` from its model."""
        self.last = self.next
        self._numbers.append(self.last)
        self._scaled.append(self.last * factorization.static_compliance(model, backend))

    def compliance(self) -> Array:
        """Return the (p, p) sum over all harmonics above ``reduced`` of s_ni s_nj cos n(th_i - th_j) R_n [m/N].

        n R_n is interpolated linearly in log n, which keeps it positive semidefinite, and constant beyond the last.
        """
        harmonics = np.arange(self.reduced + 1, max(self._far, 20 * self.last))
        return summed(self.patches, harmonics, self._law(harmonics), self._places)

    def diagonal(self) -> Array:
        """Return the (p,) diagonal of `compliance`, its largest values, at little cost."""
        return self._diagonal(self.reduced + 1)

    def doubt(self) -> float:
        """Return half of the largest extrapolated compliance [m/N], as its error; ``inf`` before two are computed."""
        return math.inf if len(self._numbers) < 2 else float(self._diagonal(self.last + 1).max()) / 2

    def _diagonal(self, first: int) -> Array:
        """Return the (p,) sums of s_ni^2 R_n over harmonics from ``first`` on, equal for equal widths on one ring."""
        harmonics = np.arange(first, max(self._far, 20 * self.last))
        law, known = self._law(harmonics), dict[tuple[float, int], float]()
        for patch, place in zip(self.patches.values(), self._places, strict=True):
            if (patch.width, place) not in known:
                known[patch.width, place] = float(patch.coefficients(harmonics) ** 2 @ law[place, place])
        return np.array(
            [known[patch.width, place] for patch, place in zip(self.patches.values(), self._places, strict=True)]
        )

    def _law(self, harmonics: NDArray[np.int64]) -> Array:
        """Return the (rings, rings, n) interpolated compliances R_n."""
        known, scaled = np.log(self._numbers), np.array(self._scaled)
        at, rings = np.log(harmonics), range(scaled.shape[1])
        return np.array([[np.interp(at, known, scaled[:, i, j]) / harmonics for j in rings] for i in rings])


def static_lag(greens: modal.ModalGreens, start: Array, damping: Damping, t: Array, width: float) -> float:
    """Return the largest difference, after the pulse, between a harmonic and the relaxation with its static compliance
    [m/(N s)]."""
    if np.any(greens.omega == 0):
        return math.inf
    instant = reducer.relaxation(greens.static_compliance(), start, damping.beta).filtered(t, width)
    return float(np.abs(greens.filtered_matrix(t, width) - instant).max())


ASSEMBLED: Final = (2, 8, 32)  # harmonics whose matrices tell all others: far apart, so that no digits are lost at 1000


def every_harmonic(build: Callable[[int], SecondOrderModel]) -> Callable[[int], SecondOrderModel]:
    """Return ``build``, the function to the model of a harmonic n, without assembling more than five of them.

    From n = 2 on all unknowns, constraints, masses and ports are the same, and strains are linear in n, so that
    K_n = K + n K' + n^2 K'', and C_n and H_n likewise. Three harmonics (`ASSEMBLED`) determine them, by Lagrange's
    formula.
    """
    known: dict[int, SecondOrderModel] = {}

    def assembled(harmonic: int) -> SecondOrderModel:
        if harmonic not in known:
            known[harmonic] = build(harmonic)
        return known[harmonic]

    def model_of(harmonic: int) -> SecondOrderModel:
        if harmonic < ASSEMBLED[0] or harmonic in ASSEMBLED:
            return assembled(harmonic)
        models = [assembled(each) for each in ASSEMBLED]
        shares = [
            math.prod((harmonic - other) / (each - other) for other in ASSEMBLED if other != each) for each in ASSEMBLED
        ]

        def summed_up(matrices: Sequence[sparse.csr_array]) -> sparse.csr_array:
            parts = [share * each for share, each in zip(shares, matrices, strict=True)]
            return sparse.csr_array(sum(parts[1:], parts[0]))

        def where_any(matrices: Sequence[sparse.csr_array | None]) -> sparse.csr_array | None:
            stated = [each for each in matrices if each is not None]
            return summed_up(stated) if stated else None

        K, C, H = (
            summed_up([each.K for each in models]),
            where_any([each.C for each in models]),
            where_any([each.loss for each in models]),
        )
        damping = models[0].damping
        if damping.loss is not None:
            damping = replace(damping, loss=H)
        return replace(models[0], K=K, C=C, loss=H, known=damping)

    return model_of


_FEWEST = 4  # fewest harmonics that are reduced: the lowest frequency first falls, then rises with n


def ring_greens(
    mesh: Any,
    material: Solid | Mapping[str, Any],
    patches: Mapping[str, RingPatch],
    *,
    bandwidth: float,
    duration: float,
    tolerance: float,
    damping_ratio: float = 0.0,
    fixed: str | Sequence[str] = "fixed",
    sliding: str | Sequence[str] = (),
    order: int = 0,
    rayleigh: tuple[float, float] = (0.0, 0.0),
    supports: Sequence[Support] = (),
    method: str = AUTO,
    max_vectors: int | None = None,
    backend: factorization.Backend = "auto",
    rings: int = 1,
    max_harmonic: int = 1000,
    progress: Progress = silent,
) -> modal.ModalGreens:
    """Return the Green's function of ``patches``, one port each, on a solid of revolution meshed in its meridian.

    Arguments as `assemble_axisymmetric` and `reduce_model`; see `combine_harmonics`. With ``rings`` > 1 every patch
    has so many ports, NAME_1, NAME_2, ...
    """
    faces = {patch.boundary: patch.boundary for patch in patches.values()}
    patches = {
        name: replace(patch, boundary=face)
        for port, patch in patches.items()
        for name, face in zip(ring_names(port, rings), ring_names(patch.boundary, rings), strict=True)
    }

    def build(harmonic: int) -> SecondOrderModel:
        return assemble_axisymmetric(
            mesh,
            material,
            harmonic=harmonic,
            fixed=fixed,
            sliding=sliding,
            ports=faces,
            order=order,
            rayleigh=rayleigh,
            supports=supports,
            rings=rings,
        )

    aims = Aims(bandwidth, duration, tolerance, max_vectors, backend)
    return combine_harmonics(
        every_harmonic(build), patches, aims, damping_ratio, method, max_harmonic=max_harmonic, progress=progress
    )


def combine_harmonics(
    build: Callable[[int], SecondOrderModel],
    patches: Mapping[str, RingPatch],
    aims: Aims,
    damping_ratio: float = 0.0,
    method: str = AUTO,
    *,
    max_harmonic: int = 1000,
    progress: Progress = silent,
) -> modal.ModalGreens:
    """Return one Green's function of all patches from the models ``build(n)``, whose ports are the rings by boundary
    name.

    Each mode of a harmonic n > 0 occurs twice, with cos n th and with sin n th. ``error.reduction``, as that of
    `reduce_model`, is the weighted sum of the errors of the harmonics and of the static tail.

    Raises:
        ModelError: patches overlap, or damping couples the modes.
        ConvergenceError: ``max_harmonic`` is reached before the tolerance.
    """
    check_patches(patches)
    rings = list(dict.fromkeys(patch.boundary for patch in patches.values()))
    total = _Sum(patches, rings, oscillator.error_times(aims.duration, aims.width), aims.width)
    harmonic, lags, limit = 0, [math.inf], math.inf
    while total.touches_from(harmonic):
        if harmonic > max_harmonic:
            raise ConvergenceError(f"{max_harmonic} harmonics still have waves in the band: raise max_harmonic")
        model = build(harmonic)
        greens = reduced(model, replace(aims, tolerance=aims.tolerance / 3), damping_ratio, method).greens.modal
        if greens is None:
            raise ModelError("harmonics combine modes: use damping that does not couple them (ratio, Rayleigh, loss)")
        damping = model.damping.plus(damping_ratio)
        start = damping.first_velocity() / np.array([port.impedance for port in model.ports.values()])
        total.add(harmonic, greens)
        limit = min(limit, greens.valid_for)
        lags.append(total.beyond(harmonic, static_lag(greens, np.diag(start), damping, total.t, total.width)))
        harmonic += 1
        progress("harmonics", harmonic / (harmonic + 12))
        if harmonic > _FEWEST and max(lags[-2:]) <= aims.tolerance / 6:
            break
    wave_harmonics = last = harmonic - 1
    if total.touches_from(harmonic):
        tail, doubt = _static_tail(build, total, wave_harmonics, aims, max_harmonic)
        impedances = {name: 2 * port.impedance for name, port in model.ports.items()}
        lacking = damping.first_velocity() * first_velocities_beyond(patches, impedances, wave_harmonics)
        total.close(reducer.relaxation(tail.compliance(), lacking, damping.beta), max(lags[-2:]) + doubt)
        last = tail.last
    progress("harmonics", 1.0)
    return total.greens(
        {
            "method": "harmonics",
            "reason": f"{wave_harmonics + 1} harmonics with waves in the band, static compliances up to n = {last}",
            "harmonics": wave_harmonics,
            "static_harmonics": last,
            "bandwidth_Hz": aims.bandwidth,
            "duration_s": aims.duration,
            "tolerance": aims.tolerance,
            "damping_ratio": damping_ratio,
            "patches": {k: {"angle": v.angle, "width": v.width, "boundary": v.boundary} for k, v in patches.items()},
            "dof": model.size,
        },
        limit,
    )


def _static_tail(
    build: Callable[[int], SecondOrderModel],
    total: _Sum,
    done: int,
    aims: Aims,
    max_harmonic: int,
) -> tuple[Tail, float]:
    """Return static harmonics above ``done``, and their error over the response: a pulse's peak is 2/width."""
    tail = Tail(total.patches, total.rings, done)
    while (doubt := total.relative(tail.doubt() * 2 * aims.bandwidth)) > aims.tolerance / 6:
        if tail.last >= max_harmonic:
            raise ConvergenceError(
                f"{tail.last} harmonics leave an estimated error of {doubt:.1e} (tolerance {aims.tolerance:.1e}): "
                "make the patches wider or raise max_harmonic"
            )
        tail.add(build(tail.next), aims.backend)
    return tail, doubt


@dataclass
class _Sum:
    """The sum of the harmonics reduced so far, at the patches."""

    patches: Mapping[str, RingPatch]
    rings: list[str]
    t: Array
    width: float
    parts: list[modal.ModalGreens] = field(default_factory=list)
    """Harmonics at the patches; ``response``: (p, columns, nt) their sum after the pulse."""
    response: Array | float = 0.0
    error: float = 0.0

    @property
    def columns(self) -> list[int]:
        """Return the patches under whose impulse the error is estimated: of equal arcs all around, those of one arc."""
        listed = list(self.patches.values())
        equal = len({patch.width for patch in listed}) == 1 and len(listed) * listed[0].width > 1.999 * math.pi * len(
            self.rings
        )
        return [k for k, patch in enumerate(listed) if not equal or patch.angle == listed[0].angle]

    def touches_from(self, harmonic: int) -> bool:
        """Return whether any harmonic from this one on moves a patch: whole rings respond to n = 0 only."""
        return harmonic == 0 or any(patch.width < 2 * math.pi * (1 - 1e-12) for patch in self.patches.values())

    def add(self, harmonic: int, greens: modal.ModalGreens) -> None:
        """Add a harmonic of the rings to the sum at the patches."""
        parts = [greens.combined(x.T, tuple(self.patches)) for x in mixing(self.patches, self.rings, harmonic)]
        if parts:
            felt = sum(self._append(part) for part in parts)
            self.error += (greens.error.reduction or 0.0) * float(np.abs(felt).max())

    def _append(self, part: modal.ModalGreens) -> Array:
        response = part.filtered_matrix(self.t, self.width, self.columns)
        self.response = self.response + response
        self.parts.append(part)
        return response

    def beyond(self, harmonic: int, error: float) -> float:
        """Return the error, relative to the response, of all harmonics from this one on, if their ``error`` falls like
        1/n^2: with the patches' coefficients, at most 2/(n w) or 1, terms fall like 1/n^4 and sum to n/3 of the
        first."""
        narrowest = min(patch.width for patch in self.patches.values())
        envelope = min(1.0, 2 / (max(harmonic, 1) * narrowest))
        return self.relative(error * envelope**2 * max(1.0, harmonic / 3))

    def relative(self, error: float) -> float:
        """Return an error of the response, relative to its largest value."""
        return error / float(np.abs(self.response).max())

    def close(self, rest: modal.Residual, error: float) -> None:
        """Add the relaxation of the harmonics that are not reduced; ``error`` is relative to the response."""
        p = len(self.patches)
        part = modal.ModalGreens(np.zeros(0), np.zeros(0), np.zeros((0, p)), rest, tuple(self.patches))
        self._append(part)
        self.error += error * float(np.abs(self.response).max())

    def greens(self, origin: Mapping[str, object], valid_for: float) -> modal.ModalGreens:
        """Return the Green's function of the sum, without modes and relaxations that move no patch."""
        modes = np.concatenate([part.shapes for part in self.parts])
        relaxing = np.concatenate([part.residual.shapes for part in self.parts])
        seen, felt = modes.any(axis=1), relaxing.any(axis=1)
        rest = modal.Residual(
            relaxing[felt],
            np.concatenate([part.residual.rates for part in self.parts])[felt],
            np.sum([part.residual.compliance for part in self.parts], axis=0),
        )
        return modal.ModalGreens(
            np.concatenate([part.omega for part in self.parts])[seen],
            np.concatenate([part.zeta for part in self.parts])[seen],
            modes[seen],
            rest,
            tuple(self.patches),
            base.ErrorEstimate(reduction=self.relative(self.error)),
            origin,
            valid_for,
        )
