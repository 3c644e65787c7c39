"""Pairwise covering arrays: few rows in which every pair of levels of every two axes occurs."""

from collections.abc import Collection, Sequence
from itertools import combinations, product

import numpy as np

Pair = tuple[int, int, int, int]  # axis, level, axis, level


def covering_array(
    levels: Sequence[int], *, seed: int, tries: int = 30, excluded: Collection[Pair] = ()
) -> tuple[tuple[int, ...], ...]:
    """Return rows of level numbers, one per axis, that contain all pairs of levels of any two of the axes.

    No row holds an ``excluded`` pair; each axis must keep a level that agrees with whatever the others take.

    Greedy: each row is the best of ``tries`` candidates, each grown from a pair not yet covered, axis by axis in
    random order, by the level that covers most new pairs. About 1.3 to 2 times the product of the two longest axes.

    Source: Cohen, Dalal, Fredman & Patton, IEEE Trans. Software Eng. 23 (1997) 437.
    """
    random = np.random.default_rng(seed)
    open_pairs: set[Pair] = {
        (a, i, b, j)
        for a, b in combinations(range(len(levels)), 2)
        for i, j in product(range(levels[a]), range(levels[b]))
    } - set(excluded)
    rows = []
    while open_pairs:
        ordered = sorted(open_pairs)
        candidates = [_row(levels, ordered, open_pairs, excluded, random) for _ in range(tries)]
        best = max(candidates, key=lambda row: len(open_pairs & pairs_of(row)))
        open_pairs -= pairs_of(best)
        rows.append(best)
    return tuple(rows)


def pairs_of(row: Sequence[int]) -> set[Pair]:
    """Return all pairs of levels in a row."""
    return {(a, row[a], b, row[b]) for a, b in combinations(range(len(row)), 2)}


def _row(
    levels: Sequence[int],
    ordered: Sequence[Pair],
    open_pairs: set[Pair],
    excluded: Collection[Pair],
    random: np.random.Generator,
) -> tuple[int, ...]:
    a, i, b, j = ordered[int(random.integers(len(ordered)))]
    row = {a: i, b: j}
    for axis in random.permutation([k for k in range(len(levels)) if k not in row]):
        pairs = [{_pair(axis, level, k, v) for k, v in row.items()} for level in range(levels[axis])]
        gains = [-1 if any(p in excluded for p in new) else len(new & open_pairs) for new in pairs]
        best = np.flatnonzero(np.array(gains) == max(gains))
        row[int(axis)] = int(random.choice(best))
    return tuple(row[k] for k in range(len(levels)))


def _pair(a: int, i: int, b: int, j: int) -> Pair:
    return (int(a), i, b, j) if a < b else (b, j, int(a), i)
