"""The second-order model M u'' + C u' + K u + (structural damping) = sum_p b_p F_p, its ports and its damping."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import InitVar, dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from impact.quantities import brief, brief_value
from seatfem.structures.errors import ModelError as ModelError
from seatfem.structures.materials import Material as Material

Array = NDArray[np.float64]
_SAME = 1e-9  # relative difference of matrices that count as equal


@dataclass(frozen=True)
class Damping:
    """Parts of damping that add; with none of them, the model is undamped.

    The mode (w, phi), mass-normalised, has the ratio zeta = ratio + alpha/(2 w) + beta w/2 + phi' H phi/(2 w^2):
    uniform modal damping, Rayleigh's C = alpha M + beta K, and the modal strain energy of a loss matrix H = sum of
    eta_m K_m over regions m, whose special case H = eta K is the uniform ratio eta/2. Source: Johnson and Kienholz,
    AIAA Journal 20 (1982) 1284 (modal strain energy); Clough and Penzien, Dynamics of Structures (Rayleigh).

    Attributes:
        ratio, alpha, beta: uniform part [-], [1/s], [s].
        loss: (n, n) H where it is not eta K, else ``None``.
        coupling: whether the model's C is not alpha M + beta K: then it couples the modes, and alpha and beta are 0.
    """

    ratio: float = 0.0
    alpha: float = 0.0
    beta: float = 0.0
    loss: sparse.csr_array | None = field(default=None, repr=False, compare=False)
    coupling: bool = False

    @staticmethod
    def found(
        M: sparse.csr_array, C: sparse.csr_array | None, K: sparse.csr_array, loss: sparse.csr_array | None
    ) -> Damping:
        """Return the damping that the matrices have: C is fitted by alpha M + beta K and H by eta K, each to 1e-9 of
        its Frobenius norm."""
        rayleigh, eta = _fitted(C, M, K), _fitted(loss, K)
        alpha, beta = rayleigh or (0.0, 0.0)
        ratio, rest = (0.0, loss) if eta is None else (eta[0] / 2, None)
        return Damping(ratio, alpha, beta, rest, rayleigh is None)

    @staticmethod
    def from_regions(
        rayleigh: Array, eta: Array, loss: sparse.csr_array | None, *, springs: bool, dashpots: bool
    ) -> Damping:
        """Return the damping of a body of several regions.

        Args:
            rayleigh: (m, 2) alpha [1/s] and beta [s] of each region.
            eta: (m,) loss factor of each.
            loss: (n, n) H = sum of eta_m K_m, or ``None``.
            springs: whether K holds supports beside the regions, which neither beta nor eta damps.
            dashpots: whether C holds more than the regions'.
        """
        alpha, beta = rayleigh[0].tolist()
        uneven = bool(np.ptp(rayleigh, axis=0).any()) or (springs and beta != 0)
        whole = not np.ptp(eta) and not springs
        if uneven or dashpots:
            alpha = beta = 0.0
        ratio, rest = (float(eta[0]) / 2, None) if whole else (0.0, loss)
        return Damping(ratio, alpha, beta, rest, uneven or dashpots)

    def plus(self, ratio: float) -> Damping:
        """Return the damping with uniform modal damping of ``ratio`` added."""
        return replace(self, ratio=self.ratio + ratio)

    @property
    def refusal(self) -> str:
        """Return why modes cannot represent the damping, in words; "" where they can."""
        if self.coupling:
            return "C is not alpha M + beta K, so the modes are coupled by damping: use method='second_order'"
        if self.alpha < 0 or self.beta < 0:
            return f"C = {self.alpha:g} M + {self.beta:g} K would feed energy: both coefficients must be >= 0"
        return ""

    def ratios(self, omega: Array, loss: Array | float = 0.0) -> Array:
        """Return the (m,) damping ratio of each mode of ``omega`` (m,) [rad/s], ``loss`` (m,) its phi' H phi [1/s^2].

        Raises:
            ModelError: mass-proportional damping of a rigid-body mode (w = 0).
        """
        if self.alpha > 0 and np.any(omega == 0):
            raise ModelError(
                f"alpha = {self.alpha:g} 1/s damps the rigid motion of a free body: use alpha = 0 or fix it"
            )
        safe = np.where(omega > 0, omega, np.inf)
        lost = np.maximum(loss, 0.0) / (2 * safe**2)
        return np.asarray(self.ratio + self.alpha / (2 * safe) + self.beta * omega / 2 + lost)

    def losses(self, shapes: Array) -> Array | float:
        """Return the (m,) phi' H phi of the columns of ``shapes`` (n, m) [1/s^2]; 0 without a loss matrix."""
        return 0.0 if self.loss is None else np.asarray(np.einsum("nm,nm->m", shapes, self.loss @ shapes))

    def first_velocity(self) -> float:
        """Return g(0+) relative to the undamped 1/Z.

        Where g(0+) is finite the modes' participation per unit frequency is constant at high w, and the sum over
        modes at t -> 0 is the integral of exp(-zeta w t) sin(wd t)/w dw: pi/2 undamped, acos(zeta)/sqrt(1 - zeta^2)
        damped, with acosh and sqrt(zeta^2 - 1) beyond critical damping.
        """
        z = self.ratio
        if abs(z - 1) < 1e-9:
            return 2 / np.pi
        arc = np.arccos(z) / np.sqrt(1 - z**2) if z < 1 else np.arccosh(z) / np.sqrt(z**2 - 1)
        return float(2 / np.pi * arc)


def _fitted(matrix: sparse.csr_array | None, *basis: sparse.csr_array) -> tuple[float, ...] | None:
    """Return the coefficients of ``matrix`` as a sum of the ``basis``, by least squares; ``None`` where it is no such
    sum."""
    if matrix is None or matrix.nnz == 0:
        return (0.0,) * len(basis)
    scale = [sparse.linalg.norm(a) for a in basis]
    units = [a / s for a, s in zip(basis, scale, strict=True)]
    gram = np.array([[a.multiply(b).sum() for b in units] for a in units])
    x = np.linalg.solve(gram, [a.multiply(matrix).sum() for a in units])
    rest = matrix
    for factor, unit in zip(x, units, strict=True):
        rest = rest - factor * unit
    if sparse.linalg.norm(rest) > _SAME * sparse.linalg.norm(matrix):
        return None
    small = 1e-12 * np.abs(x).max()
    return tuple(0.0 if abs(v) < small else float(v / s) for v, s in zip(x, scale, strict=True))


@dataclass(frozen=True)
class Port:
    """A patch through which a body is pushed and at which it is observed.

    Attributes:
        vector: (n_free,) b, so that b'u is the patch's area-averaged displacement along its outward normal [m] and
            b F the nodal forces of a uniform normal load of F newton on it.
        area: A [m^2].
        impedance: Z = force per velocity of the patch at the very first instant [N s/m]: rho c_p A for a solid; inf
            where it is not known, as the area is nan.
    """

    vector: Array
    area: float = math.nan
    impedance: float = math.inf

    __repr__ = brief

    def __post_init__(self) -> None:
        try:
            object.__setattr__(self, "vector", np.asarray(self.vector, dtype=float))
        except (TypeError, ValueError):
            raise ModelError(f"port: {brief_value(self.vector)} is no vector; give (n,) weights of unknowns") from None
        for key in ("area", "impedance"):
            if (value := getattr(self, key)) <= 0:
                raise ModelError(f"port: {key} = {value} must be positive; leave it out if it is not known")


@dataclass(frozen=True)
class DofMap:
    """The places of the unknowns: unknown i is component ``free[i] % dim`` at node ``free[i] // dim``.

    Nodes on an oblique sliding plane have components along axes of their own, those of a plate a deflection and two
    rotations: then ``turned`` takes the unknowns to Cartesian displacements.

    Attributes:
        points: (dim, n_nodes) node coordinates [m].
        free: (n_free,) indices of the unknowns among all dim * n_nodes.
        mesh: the scikit-fem mesh.
        turned: (dim * n_nodes, n_free) displacements of the unknowns, or ``None`` where all are Cartesian.
        rigid: (n_free, r) the body's rigid motions in its unknowns, where rotations are among these.
    """

    points: Array
    free: NDArray[np.int64]
    mesh: object = None
    turned: sparse.csr_array | None = field(default=None, repr=False)
    rigid: Array | None = field(default=None, repr=False)

    def expand(self, vector: Array) -> Array:
        """Return the (dim, n_nodes) nodal displacements of a vector of unknowns, zero where fixed."""
        full = np.zeros(self.points.size)
        if self.turned is None:
            full[self.free] = vector
        else:
            full[:] = self.turned @ vector
        return full.reshape(-1, len(self.points)).T


@dataclass(frozen=True)
class SecondOrderModel:
    """M u'' + C u' + K u = sum_p b_p F_p, in SI units.

    Attributes:
        M, K: (n, n) symmetric mass (positive) and stiffness (positive semidefinite); any scipy sparse or dense matrix.
        C: the same for viscous damping, or ``None``.
        ports: port vectors by name, as `Port` or bare (n,) array.
        dofs: where the unknowns live, if known.
        loss: H, structural (hysteretic) damping: K becomes K + i H in the frequency domain; ``None`` without.
        damping: what C and loss are, in parts. Whoever makes the matrices states it, as ``known``; else it is found in
            them, once.

    Raises:
        ModelError: wrong shape, values not finite, not symmetric, a mass or stiffness diagonal that is not positive.
    """

    M: sparse.csr_array
    C: sparse.csr_array | None
    K: sparse.csr_array
    ports: Mapping[str, Port]
    dofs: DofMap | None = field(default=None, repr=False)
    loss: sparse.csr_array | None = None
    known: InitVar[Damping | None] = None
    damping: Damping = field(init=False, repr=False, compare=False)

    __repr__ = brief

    def __str__(self) -> str:
        damping = [name for name, matrix in (("C", self.C), ("loss matrix", self.loss)) if matrix is not None]
        ports = ", ".join(self.ports) or "none"
        return f"SecondOrderModel, {self.size} unknowns, ports: {ports}; damping: {', '.join(damping) or 'none'}"

    def __post_init__(self, known: Damping | None) -> None:
        for name in ("M", "C", "K", "loss"):
            value = getattr(self, name)
            if value is not None or name in ("M", "K"):
                object.__setattr__(self, name, _matrix(value, name))
        n = self.size
        for name, matrix in (("C", self.C), ("K", self.K), ("loss", self.loss)):
            if matrix is not None and matrix.shape != (n, n):
                raise ModelError(f"{name} is {matrix.shape[0]} x {matrix.shape[1]}, must be {n} x {n} as M")
        if (worst := self.M.diagonal().min(initial=1.0)) <= 0:
            raise ModelError(f"M has a diagonal value {worst:g}: the mass must be positive")
        if (worst := self.K.diagonal().min(initial=1.0)) < 0:
            raise ModelError(f"K has a diagonal value {worst:g}: it must not be negative, or the body gains energy")
        if not isinstance(self.ports, Mapping):
            raise ModelError(f"ports = {brief_value(self.ports)} must map names to vectors; give {{'contact': vector}}")
        ports = {name: port if isinstance(port, Port) else Port(port) for name, port in self.ports.items()}
        for name, port in ports.items():
            if port.vector.shape != (n,):
                raise ModelError(f"port {name!r} has shape {port.vector.shape}, the matrices need ({n},)")
            if not np.all(np.isfinite(port.vector)) or not np.any(port.vector):
                raise ModelError(f"port {name!r} must be finite and touch at least one unknown that is free to move")
        object.__setattr__(self, "ports", ports)
        stated = Damping.found(self.M, self.C, self.K, self.loss) if known is None else known
        object.__setattr__(self, "damping", stated)

    @property
    def size(self) -> int:
        """Return the number of unknowns."""
        return int(self.M.shape[0])

    @property
    def port_names(self) -> tuple[str, ...]:
        """Return the names of the ports, in order."""
        return tuple(self.ports)

    @cached_property
    def port_matrix(self) -> Array:
        """Return the (n, p) port vectors side by side."""
        return np.stack([port.vector for port in self.ports.values()], axis=1)

    @property
    def rayleigh(self) -> tuple[float, float] | None:
        """Return (alpha [1/s], beta [s]) of C = alpha M + beta K, ``None`` where C is no such sum; (0, 0) without C."""
        return None if self.damping.coupling else (self.damping.alpha, self.damping.beta)

    def with_ports(self, names: Sequence[str]) -> SecondOrderModel:
        """Return the body with these of its ports alone.

        Raises:
            ModelError: a name that none of its ports has.
        """
        names = (names,) if isinstance(names, str) else names
        unknown = [name for name in names if name not in self.ports]
        if unknown:
            raise ModelError(f"no port {', '.join(map(repr, unknown))}; the model has {', '.join(self.ports)}")
        return replace(self, ports={name: self.ports[name] for name in names}, known=self.damping)

    def expand(self, vector: Array) -> Array:
        """Return the (dim, n_nodes) nodal displacements of a vector of unknowns, zero where fixed."""
        if self.dofs is None:
            raise ModelError("bare matrices do not tell where their unknowns live; construct the model with dofs=")
        return self.dofs.expand(vector)


def check_model(model: object) -> None:
    """Raise `ModelError` for anything but a `SecondOrderModel`."""
    if not isinstance(model, SecondOrderModel):
        raise ModelError(f"{type(model).__name__} is no model; give a seatfem.SecondOrderModel(M=, C=, K=, ports=)")


def as_csr(matrix: Any) -> sparse.csr_array:
    """Return any scipy sparse or dense matrix as compressed rows of float64."""
    return sparse.csr_array(matrix, dtype=np.float64)


def _matrix(value: Any, name: str) -> sparse.csr_array:
    """Return a matrix of a model. Raises `ModelError` for what is no matrix of real numbers."""
    data: Any = value if sparse.issparse(value) else np.asarray(value)
    if data.ndim != 2 or data.dtype.kind not in "fiu":
        what = f"of shape {data.shape} and type {data.dtype}"
        remedy = "; give K.real, and K.imag as loss" if data.dtype.kind == "c" else ""
        raise ModelError(f"{name} is {what}: it must be a matrix (n, n) of real numbers{remedy}")
    return _checked(as_csr(data), name)


def _checked(matrix: sparse.csr_array, name: str) -> sparse.csr_array:
    """Return ``matrix`` if square, finite and symmetric within round-off."""
    if matrix.shape[0] != matrix.shape[1]:
        raise ModelError(f"{name} is {matrix.shape[0]} x {matrix.shape[1]}: it must be square")
    bad = int(np.sum(~np.isfinite(matrix.data)))
    if bad:
        raise ModelError(f"{name} must be finite, {bad} values are not")
    x = np.random.default_rng(0).uniform(0.5, 1.5, matrix.shape[0])  # A x = A'x for no skew matrix, and cheap
    largest = np.abs(matrix.data).max(initial=0.0)
    if np.abs(matrix @ x - matrix.T @ x).max(initial=0.0) > 1e-12 * largest:
        skew = abs(matrix - matrix.T).max() / largest
        if skew > 1e-10:
            raise ModelError(f"{name} must be symmetric: |{name}-{name}'|/|{name}| = {skew:.1e}")
    return matrix
