"""Green's functions: the interface of all representations, their data, sums and multiples, and the bases of computed,
measured and closed-form ones."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, ClassVar, Final, Self, TypeGuard

import numpy as np
from numpy.typing import ArrayLike, NDArray

from impact.notices import SeatfemError
from impact.quantities import as_html, brief, brief_value, check_numbers, cut, some

if TYPE_CHECKING:
    from impact.greens.modal import ModalGreens
    from impact.greens.poles import PoleGreens
    from impact.greens.sampled import SampledGreens

Array = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]


OWN_ORIGIN: Final[Mapping[str, object]] = MappingProxyType({})
"""The origin that a Green's function has already."""


class GreensFunctionError(SeatfemError, ValueError):
    """A Green's function that cannot be used; the message names number, limit and remedy."""


@dataclass(frozen=True)
class ErrorEstimate:
    """Estimated error of g after a pulse of the stated band, relative to its largest value.

    ``reduction`` is the error by reducing M, C, K to g (modes, Krylov vectors, time step); ``mesh`` is the
    discretisation error of M, C, K themselves. ``None`` means unknown, not zero.

    It is an error of g, not of the result of an impact: where a contact chatters, opening and closing within an impact,
    an error of 1e-3 has changed forces and impulses of single contacts by 1.6 %. `impact.error_budget` measures the
    error of an impact.
    """

    reduction: float | None = None
    mesh: float | None = None

    @property
    def total(self) -> float | None:
        """Return the sum of the known parts; ``None`` if nothing is known."""
        known = [e for e in (self.reduction, self.mesh) if e is not None]
        return sum(known) if known else None

    def __str__(self) -> str:
        reduction, mesh = ("unknown" if e is None else f"{e:.2g}" for e in (self.reduction, self.mesh))
        return (
            f"error of g in its band: reduction {reduction}, mesh {mesh}; "
            "it bounds no contact that chatters, impact.error_budget does"
        )


@dataclass(frozen=True)
class Rod:
    """A uniform rod struck at one end: impedance Z = rho c A [N s/m], transit l/c [s], reflection R at the far end.

    R is of the particle velocity: -1 fixed ... +1 free. ``damping_ratio`` is that of every mode.
    """

    impedance: float
    transit: float
    reflection: float
    damping_ratio: float = 0.0


@dataclass(frozen=True)
class StepKernel:
    """A Green's function at a fixed step h, for forces constant over each step.

    ``modal`` is advanced by its exact recursion; ``weights[i, j, m] = S_ij((m+1) h) - S_ij(m h)``, (p, p, n) [m/N],
    S the step response, is convolved. Either may be ``None``. ``engine``: the history engine in words.
    """

    modal: ModalGreens | None
    weights: Array | None
    engine: str

    __repr__ = brief

    def self_weight(self, dt: float) -> Array:
        """Return W_0 (p, p): displacement at the end of a step per unit force during it [m/N]."""
        parts = []
        if self.modal is not None:
            parts.append(self.modal.step_matrix(dt))
        if self.weights is not None:
            parts.append(self.weights[:, :, 0])
        return np.asarray(sum(parts))


@dataclass(frozen=True)
class Stored:
    """The content of a file from which a Green's function is restored, without its provenance, error and time limit.

    ``kind``: name of the representation in files; ``numbers``: plain values; ``arrays``: datasets, real or complex;
    ``parts``: functions of which it is composed, which have provenance, error and time limit of their own.
    """

    kind: str
    numbers: Mapping[str, float | str] = field(default_factory=dict)
    arrays: Mapping[str, NDArray[Any]] = field(default_factory=dict)
    parts: tuple[GreensFunction, ...] = ()


def check_positive(**values: float) -> None:
    """Raise `GreensFunctionError`, naming it, for a value that is not a positive, finite number."""
    check_numbers(GreensFunctionError, **values)
    for name, value in values.items():
        if not (value > 0 and math.isfinite(value)):
            raise GreensFunctionError(f"{name} = {value:g} must be a positive, finite number")


def check_factor(factor: float) -> float:
    """Return a factor of g that leaves a passive body passive; raises `GreensFunctionError` for any other."""
    if not (np.isfinite(factor) and factor > 0):
        raise GreensFunctionError(f"factor = {factor} must be positive and finite: the body must stay passive")
    return float(factor)


def check_valid_for(time: float) -> None:
    """Raise `GreensFunctionError` for a time limit that is not positive."""
    if not time > 0:
        raise GreensFunctionError(f"valid_for = {time} s must be positive (inf: without limit)")


class GreensFunction(ABC):
    """Displacement of the ports of a linear, passive, time-invariant body after unit impulses on them.

    g_ij(t) [m/(N s)] is the displacement of port i at time t after a unit impulse on port j at time 0;
    g_ij = g_ji (reciprocity). It is zero for t < 0.

    Subclasses override these methods; code outside impact/greens must not test for a subclass.
    """

    closed_form: ClassVar[bool] = False
    """This says whether parameters give g in closed form, so that it is never cached."""
    remedy_too_short: ClassVar[str] = "compute it for the whole run (seatfem.greens_function(..., duration=))"
    """Text of the error message that says how to get a g known for longer than `valid_for`."""
    overhang: ClassVar[float] = 1.0
    """Steps by which a run may exceed `valid_for`: durations are rounded up to whole steps."""

    @property
    @abstractmethod
    def ports(self) -> tuple[str, ...]:
        """Return the names of the ports, in the order of the matrix."""

    @property
    def error_estimate(self) -> ErrorEstimate:
        """Return the estimated error; unknown by default, zero for closed forms."""
        return ErrorEstimate()

    @property
    def provenance(self) -> Mapping[str, object]:
        """Return how the function was made, in plain JSON values."""
        return {}

    @property
    def valid_for(self) -> float:
        """Return the time up to which g is known [s]; ``inf`` without such a limit."""
        return math.inf

    def check_length(self, dt: float, n_steps: int) -> None:
        """Raise `GreensFunctionError` if ``n_steps`` of ``dt`` [s] last longer than g is known."""
        lasts, limit = n_steps * dt, self.valid_for
        if lasts - limit > self.overhang * dt * (1 - 1e-6) + 1e-9 * limit:
            raise GreensFunctionError(
                f"the run lasts {lasts:.6g} s but g is known up to {limit:.6g} s only: shorten the run "
                f"to {int(limit / dt * (1 + 1e-9))} steps, or {self.remedy_too_short}"
            )

    @property
    def highest_rate(self) -> float:
        """Return the highest angular frequency that a step should resolve [rad/s]; 0 where none is known."""
        return 0.0

    @property
    def modal(self) -> ModalGreens | None:
        """Return the same function as a sum of oscillators, to which modal states and loads refer; else ``None``."""
        return None

    @property
    def pole_sum(self) -> PoleGreens | None:
        """Return the same function if it is stored as a sum of complex poles, else ``None``."""
        return None

    @property
    def summands(self) -> tuple[GreensFunction, ...]:
        """Return the functions of which it is the sum; itself if it is no sum."""
        return (self,)

    @property
    def rod(self) -> Rod | None:
        """Return the uniform rod whose Green's function this is; ``None`` for other bodies."""
        return None

    @property
    def sampled_parts(self) -> tuple[SampledGreens, ...]:
        """Return the parts known by samples only."""
        return ()

    def inverse_mass(self) -> Array:
        """Return lim g_ij(t)/t, t -> inf (p, p): final velocity of port i per impulse on port j; 0 if supported [1/kg].

        Raises `GreensFunctionError` for a representation that moves without limit and does not override this method.
        """
        if np.all(np.isfinite(static := self.static_compliance())):
            return np.zeros_like(static)
        raise GreensFunctionError(
            f"{type(self).__name__} yields without limit and does not state its mass: give it inverse_mass()"
        )

    def mass(self, port: str | int = 0) -> float:
        """Return the effective mass of rigid motion at a port [kg]; ``inf`` if the body is supported or infinite."""
        i = self.port_index(port)
        inverse = float(self.inverse_mass()[i, i])
        return 1.0 / inverse if inverse > 0 else math.inf

    def scaled(self, factor: float) -> GreensFunction:
        """Return ``factor`` times g_ij, ``factor`` > 0, for the effect of a relative error ``factor - 1`` of g."""
        return ScaledGreens(self, factor)

    def forces_only(self) -> GreensFunction:
        """Return the same function in the form that is fastest in the time loop if energies are not needed."""
        return self

    def with_error(self, error: ErrorEstimate, origin: Mapping[str, object] = OWN_ORIGIN) -> GreensFunction:
        """Return the same function with another error (and provenance); raises `GreensFunctionError` of a closed
        form."""
        raise GreensFunctionError(f"the error and the origin of a {type(self).__name__} are known: state neither")

    def stored(self) -> Stored:
        """Return the content of a file that restores it; of kind "" for a representation without a file form."""
        return Stored("")

    def transfer(self, s: ComplexArray) -> ComplexArray:
        """Return the (n, p, p) Laplace transform of g at ``s`` (n,) [1/s], bare compliance included [m/N].

        Raises `GreensFunctionError` for a representation whose transform is not known in closed form.
        """
        raise GreensFunctionError(
            f"the transform of a {type(self).__name__} is not known in closed form: take a sum of modes or of poles"
        )

    @abstractmethod
    def impulse_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        """Return g_ij(t) [m/(N s)], shape of ``t`` [s], without the Dirac pulse of a bare compliance."""

    @abstractmethod
    def step_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        """Return S_ij(t) = integral of g_ij from 0 to t, bare compliance included [m/N], shape of ``t`` [s]."""

    def own_step_responses(self, t: Array) -> Array:
        """Return the (n, p) step responses S_ii [m/N] of all ports i to forces on themselves at ``t`` (n,) [s]."""
        return np.column_stack([self.step_response(t, i, i) for i in range(len(self.ports))])

    @abstractmethod
    def static_compliance(self) -> Array:
        """Return (p, p) displacement per unit constant force [m/N]; ``inf`` where a rigid-body motion is possible."""

    @abstractmethod
    def initial_value(self) -> Array:
        """Return the (p, p) g(0+) [m/(N s)], 1/impedance at first contact; ``inf`` with a bare compliance."""

    @abstractmethod
    def step_kernel(self, dt: float, n_steps: int) -> StepKernel:
        """Return the representation used by the contact solver for ``n_steps`` steps of ``dt`` [s]."""

    def combined(self, weights: Array, port_names: tuple[str, ...]) -> GreensFunction:
        """Return W' g W for new ports, whose loads are spread over the old ones by the columns of ``weights`` (p, q).

        If columns sum to 1, displacements are means. Raises `GreensFunctionError` if the ports cannot be combined.
        """
        raise GreensFunctionError(
            f"the ports of a {type(self).__name__} cannot be combined: take a sum of modes or of poles"
        )

    def port_index(self, port: str | int) -> int:
        """Return the index of a port given by name or index; raises `GreensFunctionError` naming all ports."""
        if isinstance(port, int):
            if 0 <= port < len(self.ports):
                return port
        elif port in self.ports:
            return self.ports.index(port)
        raise GreensFunctionError(f"no port {port!r}; choose one of this Green's function, {', '.join(self.ports)}")

    def filtered(self, t: ArrayLike, width: float, i: int = 0, j: int = 0) -> Array:
        """Return g_ij convolved with a unit Hann pulse of total ``width`` [s], from its step response [m/(N s)].

        p(s) = (1 - cos(2 pi s / width)) / width on [0, width]. Band: -6 dB at 1/width, zero at 2/width.
        """
        t = np.asarray(t, dtype=float)
        edges = np.linspace(0.0, width, 257)
        # the integral of p' S over the pulse: one integration by parts moves the derivative off the kernel
        nodes, gauss = np.polynomial.legendre.leggauss(4)
        s = ((edges[1:] + edges[:-1])[:, None] + np.diff(edges)[:, None] * nodes).ravel() / 2
        w = (np.diff(edges)[:, None] * gauss).ravel() / 2
        slope = 2 * np.pi / width**2 * np.sin(2 * np.pi * s / width)
        out = np.zeros(t.shape)
        for node, weight in zip(s, w * slope, strict=True):
            out += weight * np.where(t > node, self.step_response(np.maximum(t - node, 0.0), i, j), 0.0)
        return out

    def filtered_matrix(self, t: ArrayLike, width: float, columns: Sequence[int] = ()) -> Array:
        """Return the (p, c, nt) `filtered` at all ports under impulses on the ``columns``, by default on all."""
        ports = range(len(self.ports))
        return np.array([[self.filtered(t, width, i, j) for j in columns or ports] for i in ports])

    def __str__(self) -> str:
        """Return a description in lines: representation, error, time limit, and origin."""
        names, error = self.ports, vars(self.error_estimate)
        ports = f"port {names[0]}" if len(names) == 1 else f"{len(names)} ports {some(names)}"
        parts = [f"{n} {'unknown' if e is None else f'{e:.2g}'}" for n, e in error.items()]
        limit = "any time" if math.isinf(self.valid_for) else f"{self.valid_for:.4g} s"
        origin = some([f"{key} = {brief_value(value)}" for key, value in self.provenance.items()], most=6)
        quality = (f"error: {', '.join(parts)}; valid for {limit}", f"origin: {origin or 'not stated'}")
        return "\n  ".join([f"{type(self).__name__}, {ports}", *self._describe(), *quality])

    _repr_html_ = as_html

    def _describe(self) -> tuple[str, ...]:
        """Return descriptions of the representation, one per line."""
        return ()


def is_greens(thing: object) -> TypeGuard[GreensFunction]:
    """Return whether ``thing`` is a Green's function."""
    return isinstance(thing, GreensFunction)


class StatedGreens(GreensFunction):
    """Base of computed and measured functions, whose port names, error, origin and time limit are fields."""

    port_names: tuple[str, ...]
    error: ErrorEstimate
    origin: Mapping[str, object]

    @property
    def ports(self) -> tuple[str, ...]:
        return self.port_names

    @property
    def error_estimate(self) -> ErrorEstimate:
        return self.error

    @property
    def provenance(self) -> Mapping[str, object]:
        return self.origin

    def with_error(self, error: ErrorEstimate, origin: Mapping[str, object] = OWN_ORIGIN) -> Self:
        assert is_dataclass(self)
        changed: Self = replace(self, error=error, origin=self.origin if origin is OWN_ORIGIN else origin)
        return changed

    def known_for(self, time: float) -> Self:
        """Return the same function, known until ``time`` [s]."""
        assert is_dataclass(self)
        changed: Self = replace(self, valid_for=time)
        return changed


def step_weights(greens: GreensFunction, dt: float, n_steps: int) -> Array:
    """Return the (p, p, n) exact weights W_m = S((m + 1) h) - S(m h), S(0-) = 0 [m/N]."""
    t, ports = dt * np.arange(1, n_steps + 1), range(len(greens.ports))
    return np.diff(np.array([[greens.step_response(t, i, j) for j in ports] for i in ports]), axis=2, prepend=0.0)


def convolve(weights: Array, force: Array) -> Array:
    """Return u[n] = sum_m weights[n - m] force[m], by FFT."""
    n = len(force)
    size = 1 << (2 * n - 1).bit_length()
    return np.asarray(np.fft.irfft(np.fft.rfft(weights[:n], size) * np.fft.rfft(force, size), size)[:n])


class ExactPort(GreensFunction):
    """One port of a body in closed form: a frozen dataclass whose fields are its parameters."""

    kind: ClassVar[str]
    closed_form = True
    memory: ClassVar[str] = "closed form"
    """Origin of the step weights in words."""

    @property
    def ports(self) -> tuple[str, ...]:
        return ("contact",)

    @property
    def error_estimate(self) -> ErrorEstimate:
        """Return an error of 0, as the function is exact."""
        return ErrorEstimate(0.0, 0.0)

    @property
    def provenance(self) -> Mapping[str, object]:
        assert is_dataclass(self)
        return {"kind": self.kind} | {f.name: getattr(self, f.name) for f in fields(self) if f.repr}

    def stored(self) -> Stored:
        return Stored(str(self.provenance.get("kind", "")))

    def step_kernel(self, dt: float, n_steps: int) -> StepKernel:
        return StepKernel(None, step_weights(self, dt, n_steps), f"{self.memory}, exact step weights")


class Combination(GreensFunction):
    """Positive factor times a sum of Green's functions on the same ports; each property combines those of the parts.

    The combination is passive if every part is.
    """

    factor: float
    parts: tuple[GreensFunction, ...]

    @abstractmethod
    def _with(self, parts: tuple[GreensFunction, ...]) -> Self:
        """Return the same factor times the sum of other parts."""

    def _sum(self, values: list[Array]) -> Array:
        return np.asarray(self.factor * sum(values))

    @property
    def ports(self) -> tuple[str, ...]:
        return self.parts[0].ports

    @property
    def error_estimate(self) -> ErrorEstimate:
        """Return the largest error of the parts, each relative to its own largest value; unknown if one is."""
        errors = [part.error_estimate for part in self.parts]
        return ErrorEstimate(_largest([e.reduction for e in errors]), _largest([e.mesh for e in errors]))

    @property
    def valid_for(self) -> float:
        return min(part.valid_for for part in self.parts)

    @property
    def highest_rate(self) -> float:
        return max(part.highest_rate for part in self.parts)

    @property
    def modal(self) -> ModalGreens | None:
        modal_parts = tuple(modal for part in self.parts if (modal := part.modal) is not None)
        if len(modal_parts) < len(self.parts):
            return None
        return modal_parts[0].merge(modal_parts[1:]).scaled(self.factor)

    @property
    def sampled_parts(self) -> tuple[SampledGreens, ...]:
        samples = [sampled for part in self.parts for sampled in part.sampled_parts]
        return tuple(samples if self.factor == 1.0 else [sampled.scaled(self.factor) for sampled in samples])

    def inverse_mass(self) -> Array:
        return self._sum([part.inverse_mass() for part in self.parts])

    def forces_only(self) -> Self:
        return self._with(tuple(part.forces_only() for part in self.parts))

    def combined(self, weights: Array, port_names: tuple[str, ...]) -> Self:
        return self._with(tuple(part.combined(weights, port_names) for part in self.parts))

    def transfer(self, s: ComplexArray) -> ComplexArray:
        return np.asarray(self.factor * sum(part.transfer(s) for part in self.parts), dtype=complex)

    def impulse_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        return self._sum([part.impulse_response(t, i, j) for part in self.parts])

    def step_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        return self._sum([part.step_response(t, i, j) for part in self.parts])

    def own_step_responses(self, t: Array) -> Array:
        return self._sum([part.own_step_responses(t) for part in self.parts])

    def static_compliance(self) -> Array:
        return self._sum([part.static_compliance() for part in self.parts])

    def initial_value(self) -> Array:
        return self._sum([part.initial_value() for part in self.parts])

    def step_kernel(self, dt: float, n_steps: int) -> StepKernel:
        """Return all poles in one recursion and all weights in one convolution."""
        kernels = [part.step_kernel(dt, n_steps) for part in self.parts]
        modal = tuple(kernel.modal for kernel in kernels if kernel.modal is not None)
        weights = [kernel.weights for kernel in kernels if kernel.weights is not None]
        return StepKernel(
            modal[0].merge(modal[1:]).scaled(self.factor) if modal else None,
            self._sum(weights) if weights else None,
            " + ".join(kernel.engine for kernel in kernels),
        )


@dataclass(frozen=True)
class SumGreens(Combination):
    """g_ij = sum of the parts' g_ij: displacements add, as for springs in series. Passive if every part is.

    Attributes:
        parts: at least one, all with the same ports.

    Raises:
        GreensFunctionError: no parts, or parts with other ports than the first.
    """

    parts: tuple[GreensFunction, ...]
    factor: ClassVar[float] = 1.0  # type: ignore[misc]

    __repr__ = GreensFunction.__str__

    def __post_init__(self) -> None:
        if not self.parts:
            raise GreensFunctionError("a sum of 0 parts: give at least one part")
        for part in self.parts:
            if part.ports != self.parts[0].ports:
                raise GreensFunctionError(
                    f"the parts of a sum need the same ports; found {self.parts[0].ports} and {part.ports}"
                )

    def _with(self, parts: tuple[GreensFunction, ...]) -> SumGreens:
        return SumGreens(parts)

    def _describe(self) -> tuple[str, ...]:
        shown = [f"+ {cut(line, 160)}" for part in self.parts[:3] for line in str(part).splitlines()[:2]]
        return (*shown, *([f"+ {len(self.parts) - 3} parts more"] if len(self.parts) > 3 else []))

    @property
    def summands(self) -> tuple[GreensFunction, ...]:
        return self.parts

    @property
    def provenance(self) -> dict[str, object]:
        return {"kind": "sum", "parts": [dict(part.provenance) for part in self.parts]}

    def stored(self) -> Stored:
        return Stored("sum", parts=self.parts)

    def scaled(self, factor: float) -> SumGreens:
        return SumGreens(tuple(part.scaled(factor) for part in self.parts))

    def with_error(self, error: ErrorEstimate, origin: Mapping[str, object] = OWN_ORIGIN) -> SumGreens:
        """Return the parts with this error, relative to each; raises `GreensFunctionError` for an ``origin``."""
        if origin is not OWN_ORIGIN:
            raise GreensFunctionError("a sum has the origins of its parts: state them there")
        return SumGreens(tuple(part.with_error(error) for part in self.parts))


@dataclass(frozen=True)
class ScaledGreens(Combination):
    """Positive factor times any Green's function; those of this package scale into their own kind by ``scaled``.

    Attributes:
        part: the function.
        factor: factor > 0, so that a passive body stays passive.

    Raises:
        GreensFunctionError: a factor that is not positive and finite.
    """

    part: GreensFunction
    factor: float

    __repr__ = GreensFunction.__str__

    def __post_init__(self) -> None:
        check_factor(self.factor)

    @property
    def parts(self) -> tuple[GreensFunction, ...]:  # type: ignore[override]
        """Return the one function."""
        return (self.part,)

    def _with(self, parts: tuple[GreensFunction, ...]) -> ScaledGreens:
        return replace(self, part=parts[0])

    def _describe(self) -> tuple[str, ...]:
        return (f"{self.factor:g} times", *(f"  {line}" for line in str(self.part).splitlines()))

    @property
    def provenance(self) -> dict[str, object]:
        return {"kind": "scaled", "factor": self.factor, "part": dict(self.part.provenance)}

    @property
    def rod(self) -> Rod | None:
        rod = self.part.rod
        return None if rod is None else replace(rod, impedance=rod.impedance / self.factor)

    def stored(self) -> Stored:
        return Stored("scaled", {"factor": self.factor}, parts=(self.part,))

    def scaled(self, factor: float) -> ScaledGreens:
        return ScaledGreens(self.part, self.factor * factor)

    def with_error(self, error: ErrorEstimate, origin: Mapping[str, object] = OWN_ORIGIN) -> ScaledGreens:
        return replace(self, part=self.part.with_error(error, origin))


def _largest(errors: list[float | None]) -> float | None:
    known = [error for error in errors if error is not None]
    return max(known) if len(known) == len(errors) else None
