"""Stress tensors on planes, for criteria of one axis: the plane with the least margin is the critical one."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from functools import cache
from typing import Final

import numpy as np

from impact.greens.base import Array
from impact.life.curves import LifeError
from impact.life.maps import SHARE

APART: Final = 10.0
"""Degrees between normals: one half of that off loses 1 - cos^2 = 0.8 % of the stress; along the axes nothing."""
_HELD: Final = 16  # planes at once


def normal_stresses(name: str, stress: Array) -> Iterator[tuple[str, Array]]:
    """Yield a place with the (n,) normal stress n' sigma n in time on each plane that may be critical, > 0 in tension
    [Pa].

    The normals are spread over half the sphere, from the principal axes of the stress that is furthest from the mean:
    proportional stress is judged along its own axes, exactly. Planes are passed over on which neither the range nor
    twice the largest tension reaches `SHARE` of the largest of all planes. ``stress``: (n, 6) of one block, xx, yy, zz,
    yz, xz, xy [Pa]; raises `LifeError` for another shape and for values that are not finite.
    """
    if stress.ndim != 2 or stress.shape[1] != 6 or not len(stress):
        raise LifeError(f"{name}: a history of stress tensors must be (n, 6), not {stress.shape}")
    if not np.isfinite(stress).all():
        raise LifeError(f"{name}: the stress history must be finite, {np.sum(~np.isfinite(stress))} values are not")
    turns = stress - stress.mean(axis=0)
    furthest = turns[int(np.argmax((turns**2) @ (1, 1, 1, 2, 2, 2)))]
    axes = np.linalg.eigh(furthest[[[0, 5, 4], [5, 1, 3], [4, 3, 2]]])[1]
    x, y, z = (_normals() @ axes.T).T
    across = np.stack([x * x, y * y, z * z, 2 * y * z, 2 * x * z, 2 * x * y])
    parts = [np.arange(first, min(first + _HELD, len(x))) for first in range(0, len(x), _HELD)]
    tops, spans = [], []
    for part in parts:
        projected = stress @ across[:, part]
        tops.append(projected.max(axis=0))
        spans.append(tops[-1] - projected.min(axis=0))
    reach = np.stack([np.concatenate(spans), np.maximum(2 * np.concatenate(tops), 0.0)])  # range, twice the tension
    near = (reach >= SHARE * reach.max(axis=1, keepdims=True)).any(axis=0)
    for plane in np.flatnonzero(near):
        yield name, stress @ across[:, plane]


def on_planes(histories: Iterable[tuple[str, Array]], *, tensors: bool = False) -> Iterator[tuple[str, Array]]:
    """Yield named histories of one axis as they are, and in place of tensors, or beside them, their
    `normal_stresses`."""
    for name, history in histories:
        if history.ndim == 1:
            yield name, history
        else:
            yield from normal_stresses(name, history)
            yield from [(name, history)] if tensors else []


@cache
def _normals() -> Array:
    """Return the (N, 3) normals over half the sphere, the three axes among them; opposite normals are one plane."""
    normals = [(0.0, 0.0, 1.0)]
    for polar in np.radians(np.arange(APART, 90.0 + APART / 2, APART)):
        turn = math.tau if polar < math.pi / 2 - 1e-9 else math.pi
        count = 2 * math.ceil(turn / 2 * math.sin(polar) / math.radians(APART) - 1e-9)
        for angle in turn * np.arange(count) / count:
            normals.append((math.sin(polar) * math.cos(angle), math.sin(polar) * math.sin(angle), math.cos(polar)))
    return np.array(normals)
