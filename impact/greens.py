"""What every Green's function offers, whatever it is made of."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from typing import TYPE_CHECKING, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from impact.modal import ModalGreens

Array = NDArray[np.float64]


class GreensFunctionError(ValueError):
    """A Green's function that cannot be used; the message names number, limit and remedy."""


@dataclass(frozen=True)
class ErrorEstimate:
    """Estimated error of g after a pulse of the stated band, relative to its largest value.

    ``reduction`` is what the road from M, C, K to g left out (modes, Krylov vectors, time step); ``mesh`` is the
    discretisation error of M, C, K themselves. ``None`` means unknown, not zero.
    """

    reduction: float | None = None
    mesh: float | None = None

    @property
    def total(self) -> float | None:
        """Sum of the known parts; ``None`` if nothing is known."""
        known = [e for e in (self.reduction, self.mesh) if e is not None]
        return sum(known) if known else None


@dataclass(frozen=True)
class StepKernel:
    """A Green's function at a fixed step h, for forces constant over each step.

    ``modal`` is advanced by its exact recursion; ``weights[i, j, m] = S_ij((m+1) h) - S_ij(m h)`` (m/N per step, S the
    step response) is convolved. Either may be ``None``. ``engine`` says in words what remembers the past.
    """

    modal: ModalGreens | None
    weights: Array | None
    engine: str

    def self_weight(self, dt: float) -> Array:
        """W_0 (p, p): displacement at the end of a step per unit force during it [m/N]."""
        parts = []
        if self.modal is not None:
            parts.append(self.modal.step_matrix(dt))
        if self.weights is not None:
            parts.append(self.weights[:, :, 0])
        return np.asarray(sum(parts))


class GreensFunction(ABC):
    """Displacement of the ports of a linear, passive, time-invariant body after unit impulses on them.

    g_ij(t) [m/(N s)] is the displacement of port i at time t after a unit impulse on port j at time 0;
    g_ij = g_ji (reciprocity). It is zero for t < 0.
    """

    @property
    @abstractmethod
    def ports(self) -> tuple[str, ...]:
        """Names of the ports, in the order of the matrix."""

    @property
    def error_estimate(self) -> ErrorEstimate:
        """Estimated error; unknown by default, zero for closed forms."""
        return ErrorEstimate()

    @property
    def provenance(self) -> Mapping[str, object]:
        """Where this function came from, in plain JSON values."""
        return {}

    @abstractmethod
    def impulse_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        """g_ij(t) [m/(N s)], shape of ``t`` [s]; a bare compliance (a Dirac pulse at t = 0) is not part of it."""

    @abstractmethod
    def step_response(self, t: ArrayLike, i: int = 0, j: int = 0) -> Array:
        """S_ij(t) = integral of g_ij from 0 to t, bare compliance included [m/N], shape of ``t`` [s]."""

    @abstractmethod
    def static_compliance(self) -> Array:
        """(p, p) displacement per unit constant force [m/N]; ``inf`` where a rigid-body motion is possible."""

    @abstractmethod
    def initial_value(self) -> Array:
        """(p, p) g(0+) [m/(N s)] = 1/impedance at first contact; ``inf`` where a bare compliance stands."""

    @abstractmethod
    def step_kernel(self, dt: float, n_steps: int) -> StepKernel:
        """The representation used by the contact solver for ``n_steps`` steps of ``dt`` [s]."""

    def port_index(self, port: str | int) -> int:
        """Index of a port given by name or index; raises `GreensFunctionError` listing what there is."""
        if isinstance(port, int):
            if 0 <= port < len(self.ports):
                return port
        elif port in self.ports:
            return self.ports.index(port)
        raise GreensFunctionError(f"no port {port!r}; this Green's function has the ports {', '.join(self.ports)}")

    def filtered(self, t: ArrayLike, width: float, i: int = 0, j: int = 0) -> Array:
        """g_ij convolved with a unit Hann pulse of total ``width`` [s], from its step response [m/(N s)].

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

    def filtered_matrix(self, t: ArrayLike, width: float) -> Array:
        """(p, p, nt) `filtered` for every pair of ports."""
        p = len(self.ports)
        return np.array([[self.filtered(t, width, i, j) for j in range(p)] for i in range(p)])


def step_weights(greens: GreensFunction, dt: float, n_steps: int) -> Array:
    """(1, 1, n) exact weights W_m = S((m + 1) h) - S(m h) of a body with one port [m/N]."""
    return np.diff(greens.step_response(dt * np.arange(n_steps + 1)))[None, None, :]


class ExactPort(GreensFunction):
    """One port of a body in closed form; a frozen dataclass whose fields are its parameters."""

    kind: ClassVar[str]

    @property
    def ports(self) -> tuple[str, ...]:
        """The struck point."""
        return ("contact",)

    @property
    def error_estimate(self) -> ErrorEstimate:
        """Exact."""
        return ErrorEstimate(0.0, 0.0)

    @property
    def provenance(self) -> dict[str, object]:
        """The kind and its parameters."""
        assert is_dataclass(self)
        return {"kind": self.kind} | {f.name: getattr(self, f.name) for f in fields(self)}
