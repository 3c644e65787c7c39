"""Designs: which values the scenes of a study take."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import product

import numpy as np
from numpy.typing import NDArray

from seatfem.study.sweep.study import Study
from seatfem.study.sweep.variations import Value

Changes = Mapping[str, Value]
"""Values by dotted key, as a scene file has them."""


def changes_of(study: Study) -> Iterator[Changes]:
    """Yield what each scene of the study changes, in their order. The same seed gives the same values.

    Grids count the last key fastest. "sobol_indices" has the two samples A and B of Saltelli (2010), n scenes each,
    then for each key the scenes of A with that key's column from B.
    """
    keys = list(study.vary)
    if not study.is_drawn:
        levels = [each.levels(key) for key, each in study.vary.items()]
        rows = product(*levels) if study.design == "grid" else zip(*levels, strict=True)
        yield from (dict(zip(keys, row, strict=True)) for row in rows)
        return
    for shares in shares_of(study):
        yield {key: study.vary[key].quantile(float(share)) for key, share in zip(keys, shares, strict=True)}


def shares_of(study: Study) -> NDArray[np.float64]:
    """Return shares (scenes, keys) of the distributions, in 0..1, that a design draws."""
    from scipy.stats import qmc  # takes long to load

    count, keys = study.number, len(study.vary)
    assert count is not None
    rng = np.random.default_rng(study.seed)
    if study.design == "monte_carlo":
        return rng.random((count, keys))
    if study.design == "latin_hypercube":
        return np.asarray(qmc.LatinHypercube(keys, rng=rng).random(count))
    if study.design == "sobol":
        return np.asarray(qmc.Sobol(keys, rng=rng).random(count))
    both = np.asarray(qmc.Sobol(2 * keys, rng=rng).random(count))
    first, second = both[:, :keys], both[:, keys:]
    mixed = [np.where(np.arange(keys) == column, second, first) for column in range(keys)]
    return np.concatenate([first, second, *mixed])
