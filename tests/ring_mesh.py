"""A seat of revolution: its half section, and the ring or racetrack of curved 27-node hexahedra that it makes."""

import math

import numpy as np
import skfem

INNER, EDGE, OUTER, HEIGHT = 4e-3, 5e-3, 7e-3, 5e-3
"""Radii of the bore, of the lip's outer edge and of the rim, and the height of `meridian`."""


def meridian() -> skfem.MeshQuad:
    """Return the half section in 3 by 4 quadrilaterals; the lip is the innermost third of the upper side."""
    mesh = skfem.MeshQuad.init_tensor(np.linspace(INNER, OUTER, 4), np.linspace(0, HEIGHT, 5))
    return mesh.with_boundaries(
        {"contact": lambda x: np.isclose(x[1], HEIGHT) & (x[0] < EDGE + 1e-9), "fixed": lambda x: np.isclose(x[1], 0.0)}
    )


def around(flat: skfem.MeshQuad, slices: int, straight: int = 0, length: float = 0.0) -> skfem.MeshHex2:
    """Return the meridian ``flat`` turned into so many slices about z; with ``straight`` more on each of two sides
    along x, ``length`` in all, between its halves."""
    total, (r, z) = slices + 2 * straight, flat.p
    angle = np.repeat(2 * math.pi / total * np.arange(total), r.size)
    points = np.stack([np.tile(r, total) * np.cos(angle), np.tile(r, total) * np.sin(angle), np.tile(z, total)])
    here = np.concatenate([flat.t + k * r.size for k in range(total)], axis=1)
    there = np.concatenate([flat.t + (k + 1) % total * r.size for k in range(total)], axis=1)
    # scikit-fem's corner order, found from the reference element's own places
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    reference = np.asarray(skfem.ElementHex1().doflocs)
    order = [int(np.flatnonzero((square == place[:2]).all(axis=1))[0]) + 4 * int(place[2]) for place in reference]
    mesh = skfem.MeshHex2.from_mesh(skfem.MeshHex(points, np.concatenate([here, there])[order]))
    places, step = np.array(mesh.doflocs), 2 * math.pi / total
    slice_of = np.rint(2 * np.arctan2(places[1], places[0]) / step) / 2 % total
    radius = np.hypot(places[0], places[1])
    radius[slice_of % 1 != 0] /= math.cos(step / 2)  # middles of chords onto the circle
    quarter = slices / 4
    ends = np.array([0, quarter, quarter + straight, 3 * quarter + straight, 3 * quarter + 2 * straight, total])
    turn = np.interp(slice_of, ends, np.array([0, 0.5, 0.5, 1.5, 1.5, 2]) * math.pi)
    centre = np.interp(slice_of, ends, np.array([1, 1, -1, -1, 1, 1]) * length / 2)
    places[:2] = centre + radius * np.cos(turn), radius * np.sin(turn)
    return skfem.MeshHex2(places, mesh.t)
