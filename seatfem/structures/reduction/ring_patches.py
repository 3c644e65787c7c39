"""Patches on a ring, and the Fourier series of a uniform pressure on them.

The pressure of a force F on an arc of width w about th_i of a ring of area A is F/A times

    1 + 2 sum_n s_n cos n(th - th_i),      s_n = sin(n w/2)/(n w/2)

and the mean of cos n(th - th_i) over the same arc is s_n, too: each harmonic is reciprocal.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from seatfem.structures.model import Array, ModelError

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
