"""A struck lip in arcs, without finite elements: a half-space under it in addition to how it moves as a whole."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Final

import numpy as np

from impact.exact.half_space import square_compliance
from impact.greens.base import Array
from impact.greens.modal import ModalGreens, Residual
from seatfem.structures.estimates.patch import Patch
from seatfem.structures.lip import AnyLip
from seatfem.structures.rings import ring_shares

CELLS: Final = 4  # across each ring; as many along each arc, or more: that those of the narrowest are about square
MOST_CELLS: Final = 64  # along an arc
OF_A_FAR_PART: Final = 4  # cells along the longer side of a part, for parts that lie apart
APART: Final = 2.0  # longer sides of a part between two parts that lie apart: such means of 1/r are right to 2e-3


def arc_compliance(lip: AnyLip, young: float, poisson: float) -> Array:
    """Return the (ports, ports) mean displacement of each part of a lip on a half-space under a load on each [m/N].

    Boussinesq: (1 - nu^2)/(pi E r) between cells, a square's mean on each cell itself; parts that lie apart have few
    cells. On a circle the parts of one arc stand for those of all. Source: Johnson, Contact Mechanics, 3.2.
    """
    narrowest = lip.area / lip.length * float(ring_shares(lip.rings).min())
    along = int(np.clip(round(CELLS * lip.length / (lip.arcs * narrowest)), 1, MOST_CELLS))
    cells, areas = lip.cells(along, CELLS)
    fine = cells.reshape(lip.arcs * lip.rings, -1, 2)
    coarse, reach = _far_parts(lip)
    own = [square_compliance(young=young, poisson=poisson, side=float(np.sqrt(a))) / (along * CELLS) for a in areas]
    compliance = np.empty((len(fine), len(fine)))
    for part in range(lip.rings if lip.is_round else len(fine)):
        away = _between(coarse[part], coarse)
        near = np.flatnonzero(away.min(axis=(0, 2)) < reach)
        compliance[part] = _inverse(away).mean(axis=(0, 2))
        for other in near:
            compliance[part, other] = _inverse(_between(fine[part], fine[other])).mean()
        compliance[part] *= (1 - poisson**2) / (np.pi * young)
        compliance[part, part] += own[part % lip.rings]
    if lip.is_round:
        for arc in range(1, lip.arcs):
            rows = slice(arc * lip.rings, (arc + 1) * lip.rings)
            compliance[rows] = np.roll(compliance[: lip.rings], arc * lip.rings, axis=1)
    return np.asarray((compliance + compliance.T) / 2)


def _far_parts(lip: AnyLip) -> tuple[Array, float]:
    """Return (ports, cells, 2) places of the few cells of each part, and how near [m] two parts need many."""
    length, width = lip.length / lip.arcs, lip.area / lip.length / lip.rings
    longer = max(length, width)
    few = [math.ceil(OF_A_FAR_PART * side / longer) for side in (length, width)]
    return lip.cells(*few)[0].reshape(lip.arcs * lip.rings, -1, 2), APART * longer


def _inverse(distances: Array) -> Array:
    """Return 1/r, and 0 of a cell to itself."""
    return np.divide(1, distances, out=np.zeros_like(distances), where=distances > 0)


def _between(places: Array, others: Array) -> Array:
    """Return the (n, ...) distances of ``n`` places from each of others."""
    x, y = (np.subtract.outer(places[:, axis], others[..., axis]) for axis in (0, 1))
    return np.asarray(np.sqrt(x * x + y * y))


def on_its_patch(whole: ModalGreens, lip: AnyLip, patch: Patch) -> ModalGreens:
    """Return `in_arcs` of the material under a struck ``patch``."""
    squared = (patch.c_p / patch.c_s) ** 2
    poisson = (squared - 2) / (2 * (squared - 1))
    young = 2 * patch.density * patch.c_s**2 * (1 + poisson)
    return in_arcs(whole, lip, young, poisson, patch.impedance)


def in_arcs(whole: ModalGreens, lip: AnyLip, young: float, poisson: float, impedance: float) -> ModalGreens:
    """Return a body whose patch is known as a whole, g_1(t), with a half-space under the parts of the lip:

        g_ij(t) = g_1(t) + h_ij(t),   h the exponential from 1/Z_i of each part to the half-space's compliance

    without what both have in common: a pressure on all of the lip moves it as g_1 says.

    Args:
        whole: of one port.
        lip: in parts.
        young, poisson: of the half-space [Pa].
        impedance: rho c_p A of the lip [N s/m].
    """
    shares = lip.division.shares
    away = np.eye(len(shares)) - np.outer(np.ones(len(shares)), shares)
    local = away @ arc_compliance(lip, young, poisson) @ away.T
    values, vectors = np.linalg.eigh((local + local.T) / 2)
    local = vectors * np.maximum(values, 0.0) @ vectors.T
    alike = whole.combined(np.ones((1, len(shares))), lip.division.names)
    rest = Residual.exponential(local, np.diag(1 / (shares * impedance)))
    return replace(alike, residual=Residual.together([alike.residual, rest]))
