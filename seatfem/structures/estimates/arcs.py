"""A struck lip in arcs, without finite elements: a half-space under it in addition to how it moves as a whole."""

from __future__ import annotations

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


def arc_compliance(lip: AnyLip, young: float, poisson: float) -> Array:
    """(ports, ports) mean static displacement of each part of a lip on a half-space under a pressure on each [m/N].

    Boussinesq: (1 - nu^2)/(pi E r) between cells, a square's mean on each cell itself. A circle is the same all around:
    one arc tells them all. Source: Johnson, Contact Mechanics, 3.2.
    """
    mean = lip.area / lip.length * float(ring_shares(lip.rings).min())
    along = int(np.clip(round(CELLS * lip.length / (lip.arcs * mean)), 1, MOST_CELLS))
    points, areas = lip.cells(along, CELLS)
    itself = [square_compliance(young=young, poisson=poisson, side=float(np.sqrt(a))) / (along * CELLS) for a in areas]
    force = (1 - poisson**2) / (np.pi * young)
    places = points @ np.array([1, 1j])
    found = np.empty((lip.arcs, lip.rings, lip.arcs, lip.rings))
    for arc in range(1 if lip.is_round else lip.arcs):
        for ring in range(lip.rings):
            away = np.abs(places[arc, ring][:, None] - places.ravel())
            inverse = np.divide(force, away, out=np.zeros_like(away), where=away > 0)
            found[arc, ring] = inverse.reshape(-1, lip.arcs, lip.rings, along * CELLS).mean(axis=(0, 3))
            found[arc, ring, arc, ring] += itself[ring]
    if lip.is_round:
        for arc in range(1, lip.arcs):
            found[arc] = np.roll(found[0], arc, axis=1)
    full = found.reshape(lip.arcs * lip.rings, -1)
    return np.asarray((full + full.T) / 2)


def on_its_patch(whole: ModalGreens, lip: AnyLip, patch: Patch) -> ModalGreens:
    """`in_arcs` of the material under a struck ``patch``."""
    squared = (patch.c_p / patch.c_s) ** 2
    poisson = (squared - 2) / (2 * (squared - 1))
    young = 2 * patch.density * patch.c_s**2 * (1 + poisson)
    return in_arcs(whole, lip, young, poisson, patch.impedance)


def in_arcs(whole: ModalGreens, lip: AnyLip, young: float, poisson: float, impedance: float) -> ModalGreens:
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
