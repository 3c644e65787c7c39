"""A struck ring in arcs, without finite elements: a half-space under it in addition to how it moves as a whole."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from impact.exact.half_space import square_compliance
from impact.greens.base import Array
from impact.greens.modal import ModalGreens, Residual
from seatfem.structures.lip import Lip
from seatfem.structures.rings import ring_borders, ring_shares

CELLS: Final = 4  # across each ring; as many along each arc, or more: that those of the narrowest are about square
MOST_CELLS: Final = 64  # along an arc


def arc_compliance(lip: Lip, young: float, poisson: float) -> Array:
    """(ports, ports) mean static displacement of each part of a lip on a half-space under a pressure on each [m/N].

    Boussinesq: (1 - nu^2)/(pi E r) between cells, a square's mean on each cell itself; the ring is the same all
    around. Source: Johnson, Contact Mechanics, 3.2.
    """
    narrowest = lip.width * float(ring_shares(lip.rings).min())
    along = int(np.clip(round(CELLS * lip.length / (lip.arcs * narrowest)), 1, MOST_CELLS))
    squares = lip.inner**2 + ring_borders(lip.rings) * (lip.outer**2 - lip.inner**2)
    cells = squares[:-1, None] + np.diff(squares)[:, None] * np.arange(CELLS + 1) / CELLS
    radii = np.sqrt((cells[:, 1:] + cells[:, :-1]) / 2).ravel()  # equal areas in each ring
    areas = np.repeat(np.pi * np.diff(squares) / CELLS, CELLS) / (lip.arcs * along)
    turns = 2 * np.pi * (np.arange(lip.arcs * along) + 0.5) / (lip.arcs * along)
    plane = (1 - poisson**2) / young
    itself = np.array([square_compliance(young=young, poisson=poisson, side=float(np.sqrt(a))) for a in areas])
    count = len(radii)
    by_turn = np.empty((len(turns), count, count))  # of cells on one ray, those on another ray turned by so much
    for k, turn in enumerate(turns - turns[0]):
        away = np.sqrt(np.maximum(radii[:, None] ** 2 + radii**2 - 2 * np.outer(radii, radii) * np.cos(turn), 0.0))
        by_turn[k] = plane / np.pi / np.where(away > 0, away, np.inf)
    by_turn[0] += np.diag(itself)
    of_rings = by_turn.reshape(len(turns), lip.rings, CELLS, lip.rings, CELLS).mean(axis=(2, 4))
    apart = (np.arange(lip.arcs * along)[None, :] - np.arange(along)[:, None]) % len(turns)
    first = of_rings[apart].reshape(along, lip.arcs, along, lip.rings, lip.rings).mean(axis=(0, 2))
    turned = (np.arange(lip.arcs)[None, :] - np.arange(lip.arcs)[:, None]) % lip.arcs
    full = first[turned].transpose(0, 2, 1, 3).reshape(lip.arcs * lip.rings, -1)
    return np.asarray((full + full.T) / 2)


def in_arcs(whole: ModalGreens, lip: Lip, young: float, poisson: float, impedance: float) -> ModalGreens:
    """A body whose patch is known as a whole, g_1(t), with a half-space under the parts of the lip:

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
