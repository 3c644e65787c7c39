"""`GreensFunction`, the base class of all representations, and bases of computed, measured and closed-form ones."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from typing import TYPE_CHECKING, ClassVar, Self, TypeGuard

import numpy as np
from numpy.typing import ArrayLike

from impact.greens.answers import Array, ComplexArray, ErrorEstimate, GreensFunctionError, Rod, StepKernel, Stored
from impact.quantities import as_html, brief_value, some

if TYPE_CHECKING:
    from impact.greens.modal import ModalGreens
    from impact.greens.poles import PoleGreens
    from impact.greens.sampled import SampledGreens


__all__ = [
    "Array",
    "ComplexArray",
    "ErrorEstimate",
    "GreensFunction",
    "GreensFunctionError",
    "Rod",
    "StepKernel",
    "is_greens",
]


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

    def marched_poles(self, dt: float, n_steps: float) -> int | None:
        """Return the number of poles of `step_kernel`; ``None`` if it has step weights to convolve."""
        return None

    def scaled(self, factor: float) -> GreensFunction:
        """Return ``factor`` times g_ij, ``factor`` > 0, for the effect of a relative error ``factor - 1`` of g."""
        from impact.greens.sums import ScaledGreens  # local import: `ScaledGreens` is a subclass of this class

        return ScaledGreens(self, factor)

    def forces_only(self) -> GreensFunction:
        """Return the same function in the form that is fastest in the time loop if energies are not needed."""
        return self

    def with_error(self, error: ErrorEstimate, origin: Mapping[str, object] | None = None) -> GreensFunction:
        """Return the same function with another error (and provenance); raises `GreensFunctionError` of a closed
        form."""
        raise GreensFunctionError(f"the error and the origin of a {type(self).__name__} are known: state neither")

    def stored(self) -> Stored | None:
        """Return the content of a file that restores it; ``None`` for a representation without a file form."""
        return None

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

    def filtered_matrix(self, t: ArrayLike, width: float, columns: Sequence[int] | None = None) -> Array:
        """Return the (p, p, nt) `filtered` for all pairs of ports, or (p, c, nt) under impulses on ``columns`` only."""
        p = len(self.ports)
        pushed = range(p) if columns is None else columns
        return np.array([[self.filtered(t, width, i, j) for j in pushed] for i in range(p)])

    def __str__(self) -> str:
        """Return a description in lines: representation, error, time limit, and origin."""
        names, error = self.ports, vars(self.error_estimate)
        ports = f"port {names[0]}" if len(names) == 1 else f"{len(names)} ports {some(names)}"
        parts = [f"{n} {'unknown' if e is None else f'{e:.2g}'}" for n, e in error.items()]
        limit = "any time" if math.isinf(self.valid_for) else f"{self.valid_for:.4g} s"
        origin = some([f"{key} = {brief_value(value)}" for key, value in self.provenance.items()], most=6)
        quality = (f"error: {', '.join(parts)}; valid for {limit}", f"origin: {origin or 'not stated'}")
        return "\n  ".join([f"{type(self).__name__}, {ports}", *self._in_words(), *quality])

    _repr_html_ = as_html

    def _in_words(self) -> tuple[str, ...]:
        """Return descriptions of the representation, one per line."""
        return ()


def is_greens(thing: object) -> TypeGuard[GreensFunction]:
    """Return whether ``thing`` is a Green's function."""
    return isinstance(thing, GreensFunction)


_BLOCK = 256  # number of times evaluated at once: memory is this times the number of poles


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

    def with_error(self, error: ErrorEstimate, origin: Mapping[str, object] | None = None) -> Self:
        assert is_dataclass(self)
        changed: Self = replace(self, error=error, origin=self.origin if origin is None else origin)
        return changed

    def known_for(self, time: float) -> Self:
        """Return the same function, known until ``time`` [s]."""
        assert is_dataclass(self)
        changed: Self = replace(self, valid_for=time)
        return changed


class PoleSums(StatedGreens):
    """Base of sums of oscillators and of complex poles, each term of which is known in closed form."""

    @abstractmethod
    def _values(self, t: Array, i: int, j: int, integrated: bool) -> Array:
        """Return g_ij, or its integral without bare compliance, at the times ``t`` (n,) >= 0."""

    @abstractmethod
    def _compliance(self, i: int, j: int) -> float:
        """Return the bare compliance [m/N]."""

    @abstractmethod
    def _filtered(self, t: Array, width: float, rows: list[int], columns: list[int]) -> Array:
        """Return g (rows, columns, n) after a unit Hann pulse of ``width`` [s]."""

    def _terms(self, counts: Mapping[str, int], noun: str, hertz: Array, ratios: Array, spring: Array) -> tuple[str]:
        """Return the terms in words: ``counts`` of rigid motions and of real poles, and the oscillations."""
        (rigid, real), span = (f"{n} {name}" if n else "" for name, n in counts.items()), ""
        if hertz.size:
            span = f"{hertz.size} {noun}, {hertz.min():.5g} ... {hertz.max():.5g} Hz, damping ratio "
            span += f"{ratios.min():.3g} ... {ratios.max():.3g}"
        parts = (rigid, span, real, "bare compliance" if np.any(spring) else "")
        return ("; ".join(filter(None, parts)) or "rigid and held",)

    def _sum(self, t: ArrayLike, i: int, j: int, integrated: bool) -> Array:
        t = np.asarray(t, dtype=float)
        flat = np.ravel(t)
        out = np.full(flat.shape, self._compliance(i, j) if integrated else 0.0)
        for start in range(0, flat.size, _BLOCK):
            block = slice(start, start + _BLOCK)
            out[block] += self._values(np.maximum(flat[block], 0.0), i, j, integrated)
        return np.where(flat < 0, 0.0, out).reshape(t.shape)

    def impulse_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        return self._sum(t, i, j, integrated=False)

    def step_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        return self._sum(t, i, j, integrated=True)

    def filtered(self, t: ArrayLike, width: float, i: int = 0, j: int = 0) -> Array:
        t = np.asarray(t, dtype=float)
        return np.asarray(self._filtered(np.ravel(t), width, [i], [j])[0, 0].reshape(t.shape))

    def filtered_matrix(self, t: ArrayLike, width: float, columns: Sequence[int] | None = None) -> Array:
        every = list(range(len(self.ports)))
        pushed = every if columns is None else list(columns)
        return self._filtered(np.asarray(t, dtype=float), width, every, pushed)


def step_weights(greens: GreensFunction, dt: float, n_steps: int) -> Array:
    """Return the (p, p, n) exact weights W_m = S((m + 1) h) - S(m h), S(0-) = 0 [m/N]."""
    t, ports = dt * np.arange(1, n_steps + 1), range(len(greens.ports))
    return np.diff(np.array([[greens.step_response(t, i, j) for j in ports] for i in ports]), axis=2, prepend=0.0)


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
