"""A seat as a body of revolution, by spectral elements in its meridian and Fourier harmonics around it.

A port of radius ``bore`` runs through a plate that is held at its underside; a lip of rectangular section stands on
its rim. In harmonic m the displacements are u_r cos(m th), u_th sin(m th) and u_z cos(m th), and those turned by a
quarter of a wave. A uniform pressure on a cell of the lip, between two radii and over the angle 2 pi/n, has the
harmonics sin(x)/x, x = m pi/n; the mean displacement of a cell has them again.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.polynomial.legendre import leggauss
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

from points.gll import Array, lagrange_values
from points.mesh import Block, Mesh, mesh_blocks
from points.plate import Material, lowest_modes

EXACT = 16  # harmonics up to this one are computed one by one, those above at steps of a fifth, interpolated in between
STEP = 1.2
HARMONICS = 2.5  # of the statics, per cell around
GROWTH = 1.8  # of elements away from the lip
GAUSS = 10  # points of a part of a cell


@dataclass(frozen=True)
class Seat:
    """Dimensions [m], material and modal damping ratio of an annular seat with a sharp lip."""

    bore: float
    lip_width: float
    lip_height: float
    outer: float
    thickness: float
    material: Material
    damping: float


@dataclass(frozen=True)
class SeatResponse:
    """What points on the lip feel of a seat: modes and the static compliance beyond them.

    Attributes:
        omega: (k,) circular frequencies [rad/s].
        shapes: (points, k) mean displacements of the cells, into the seat, at unit modal mass.
        residual: (points, points) static compliance that the modes leave [m/N].
    """

    omega: Array
    shapes: Array
    residual: Array


@dataclass(frozen=True)
class Meridian:
    """A seat's meridian in spectral elements of an order, the largest of a size [m]."""

    seat: Seat
    order: int
    size: float

    @cached_property
    def mesh(self) -> Mesh:
        """The lip's two columns of elements go through to the underside; the top of the lip lies at z = lip_height."""
        seat = self.seat
        lip = seat.bore + seat.lip_width * np.array([0, 0.5, 1.0])
        radii = np.concatenate([lip, lip[-1] + _graded(seat.outer - lip[-1], seat.lip_width / 2, self.size)])
        depths = -_graded(seat.thickness, seat.lip_width / 2, self.size)[::-1]

        def block(r: Array, z: Array) -> Block:
            return Block(lambda s, t: np.stack([s, t], axis=-1), r, z)

        below = np.concatenate([depths, [0.0]])
        raised = [block(lip, np.array([0.0, seat.lip_height]))] if seat.lip_height > 0 else []
        return mesh_blocks([block(radii, below), *raised], self.order)

    @cached_property
    def _parts(self) -> tuple[csc_matrix, csc_matrix, csc_matrix, Array]:
        """Stiffness K0 + m K1 + m^2 K2 of harmonic m per pi radians, and the diagonal of the mass."""
        mesh, material = self.mesh, self.seat.material
        by_r, by_z, weights = mesh.gradients()
        radius = mesh.points[mesh.elements][:, :, 0]
        eye = np.broadcast_to(np.eye(weights.shape[1]), by_r.shape)
        over_r, none = eye / radius[..., None], np.zeros_like(by_r)
        # strains rr, tt, zz, rt, tz, rz of u_r, u_th, u_z: those without m, and the factors of m
        still = [
            [by_r, none, none], [over_r, none, none], [none, none, by_z],
            [none, by_r - over_r, none], [none, by_z, none], [by_z, none, by_r],
        ]  # fmt: skip
        turned = [
            [none, none, none], [none, over_r, none], [none, none, none],
            [-over_r, none, none], [none, none, -over_r], [none, none, none],
        ]  # fmt: skip
        lame = material.young * material.poisson / ((1 + material.poisson) * (1 - 2 * material.poisson))
        elastic = np.zeros((6, 6))
        elastic[:3, :3] = lame
        elastic += material.shear * np.diag([2, 2, 2, 1, 1, 1])
        volume = weights * radius
        first, second = (np.stack([np.concatenate(row, axis=2) for row in rows]) for rows in (still, turned))

        def integrate(left: Array, right: Array) -> csc_matrix:
            total = 0.0
            for i, j in zip(*np.nonzero(elastic), strict=True):
                total = total + np.swapaxes(left[i], 1, 2) @ ((elastic[i, j] * volume)[..., None] * right[j])
            return self._assembled(np.asarray(total))

        mixed = integrate(first, second)
        lumped = material.density * np.bincount(mesh.elements.ravel(), volume.ravel(), minlength=len(mesh.points))
        return integrate(first, first), mixed + mixed.T, integrate(second, second), np.repeat(lumped, 3)

    def _assembled(self, blocks: Array) -> csc_matrix:
        nodes = self.mesh.elements
        numbers = (3 * nodes[:, None, :] + np.arange(3)[:, None]).reshape(len(nodes), -1)
        rows = np.broadcast_to(numbers[:, :, None], blocks.shape).ravel()
        columns = np.broadcast_to(numbers[:, None, :], blocks.shape).ravel()
        size = 3 * len(self.mesh.points)
        return csc_matrix((blocks.ravel(), (rows, columns)), shape=(size, size))

    @cached_property
    def _free(self) -> NDArray[np.int64]:
        held = np.flatnonzero(self.mesh.points[:, 1] < -self.seat.thickness + 1e-9)
        return np.setdiff1d(np.arange(3 * len(self.mesh.points)), (3 * held[:, None] + np.arange(3)).ravel())

    def stiffness(self, m: int) -> csc_matrix:
        """Return the stiffness of harmonic m with nothing held, unknowns 3 node + 0, 1, 2 of u_r, u_th, u_z."""
        first, second, third, _ = self._parts
        return first + m * second + m**2 * third

    def harmonic(self, m: int) -> tuple[csc_matrix, Array]:
        """Return the stiffness and the diagonal of the mass of one harmonic, underside held."""
        mass = self._parts[-1]
        free = self._free
        if m == 0:  # without the torsion, which nothing here excites
            free = free[free % 3 != 1]
        return csc_matrix(self.stiffness(m)[free][:, free]), mass[free]

    def means(self, borders: Array, m: int) -> Array:
        """Return (free, cells) weights of the nodes' u_z in means over the lip's top between borders (cells + 1,)."""
        mesh, seat = self.mesh, self.seat
        x, gauss = leggauss(GAUSS)
        weights = np.zeros((3 * len(mesh.points), len(borders) - 1))
        for nodes in mesh.elements:
            edge = nodes.reshape(self.order + 1, -1)[:, -1]
            if mesh.points[edge, 1].min() < seat.lip_height - 1e-9:
                continue
            low, high = mesh.points[edge[[0, -1]], 0]
            for cell, (start, end) in enumerate(pairwise(borders)):
                a, b = max(low, start), min(high, end)
                if b > a:
                    radius = (a + b) / 2 + (b - a) / 2 * x
                    shape = lagrange_values(self.order, 2 * (radius - low) / (high - low) - 1)
                    area = (end**2 - start**2) / 2
                    weights[3 * edge + 2, cell] += (gauss * (b - a) / 2 * radius) @ shape / area
        free = self._free
        return weights[free[free % 3 != 1] if m == 0 else free]

    def response(self, borders: Array, around: int, band: float) -> SeatResponse:
        """Return modes up to a band [Hz] and the compliance beyond, of cells around the lip, those across fastest."""
        angles = 2 * np.pi * np.arange(around) / around
        across = len(borders) - 1
        last = math.ceil(HARMONICS * around)
        computed = sorted({*range(min(EXACT, last) + 1), *_geometric(EXACT, last)})
        statics, omegas, shapes = {}, [], []
        searching = band > 0
        for m in computed:
            stiffness, mass = self.harmonic(m)
            means = self.means(borders, m)
            solve = splu(stiffness, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
            statics[m] = means.T @ solve.solve(means)
            if not searching:
                continue
            squares, vectors = modes_below(stiffness, mass, 2 * np.pi * band)
            searching = len(squares) > 0
            seen = _factor(m, around) * (means.T @ vectors)
            for wave in (np.cos, np.sin)[: 1 if m == 0 else 2]:
                omegas.append(np.sqrt(squares))
                shapes.append(np.kron(wave(m * angles)[:, None], seen))
        compliance = _circulant(computed, statics, around, last)
        omega = np.concatenate([np.empty(0), *omegas])
        shape = np.concatenate([np.empty((around * across, 0)), *shapes], axis=1)
        return SeatResponse(omega, shape, compliance - (shape / omega**2) @ shape.T)


def modes_below(stiffness: csc_matrix, mass: Array, omega: float) -> tuple[Array, Array]:
    """Return all eigenvalues of K - x M below omega^2 and vectors of unit modal mass."""
    count = 16
    while True:
        squares, vectors = lowest_modes(stiffness, mass, min(count, len(mass) - 2))
        if squares[-1] > omega**2:
            inside = squares <= omega**2
            return squares[inside], vectors[:, inside]
        count = math.ceil(count * max(1.3, min(3.0, 1.2 * omega**2 / squares[-1])))


def _circulant(computed: list[int], statics: dict[int, Array], around: int, last: int) -> Array:
    """Return (cells, cells) sum over harmonics; between those computed m times the compliance is interpolated."""
    scaled = PchipInterpolator(computed, [max(1, m) * statics[m] for m in computed])
    rows = np.zeros((around, *statics[0].shape))
    turns = 2 * np.pi * np.arange(around) / around
    for m in range(last + 1):
        part = statics[m] if m in statics else scaled(m) / m
        rows += _factor(m, around) ** 2 * np.cos(m * turns)[:, None, None] * part
    cell = np.arange(around)
    blocks = rows[(cell[:, None] - cell) % around]
    size = around * rows.shape[1]
    return np.asarray(blocks.transpose(0, 2, 1, 3).reshape(size, size))


def _factor(m: int, around: int) -> float:
    """Return the root of eps_m/(2 pi) sin(x)^2/x^2, x = m pi/around, eps_0 = 1, else 2."""
    return math.sqrt((1 if m == 0 else 2) / (2 * math.pi)) * float(np.sinc(m / around))


def _geometric(start: int, last: int) -> list[int]:
    """Return numbers that grow by a fifth each, from ``start`` to ``last``."""
    numbers = [min(start, last)]
    while numbers[-1] < last:
        numbers.append(min(last, math.ceil(STEP * numbers[-1])))
    return numbers


def _graded(length: float, first: float, most: float) -> Array:
    """Return ends of parts of a length that grow from ``first`` to ``most``, without 0."""
    if length <= 0:
        return np.empty(0)
    sizes = [min(first, most, length)]
    while sum(sizes) < length:
        sizes.append(min(GROWTH * sizes[-1], most))
    return np.asarray(np.cumsum(sizes) * length / sum(sizes))
