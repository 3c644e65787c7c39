"""Files with one line changed: removed, doubled, with a comma at its end; each means the same, or is refused."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

MUTATIONS: dict[str, Callable[[str], list[str]]] = {
    "removed": lambda line: [],
    "doubled": lambda line: [line, line],
    "comma": lambda line: [f"{line},"],
}


def mutants(text: str) -> Iterator[tuple[str, str]]:
    """Yield what was done to which line, and the text."""
    lines = text.splitlines()
    for k, line in enumerate(lines):
        for name, change in MUTATIONS.items():
            yield f"line {k + 1} {name}: {line!r}", "\n".join([*lines[:k], *change(line), *lines[k + 1 :]]) + "\n"


def is_same(one: Any, other: Any) -> bool:
    """Return whether two readings are equal: nested tuples and mappings of arrays, numbers and texts."""
    if isinstance(one, dict):
        return one.keys() == other.keys() and all(is_same(one[key], other[key]) for key in one)
    if isinstance(one, tuple):
        return len(one) == len(other) and all(map(is_same, one, other))
    if isinstance(one, np.ndarray):
        return one.shape == other.shape and np.allclose(one, other, rtol=1e-9, atol=0)
    return bool(one == other)


def check_mutants(
    path: Path,
    text: str,
    read: Callable[[Path], Any],
    refusals: tuple[type[Exception], ...],
    may_be: Callable[[Any, Any], bool] = lambda before, after: False,
) -> tuple[int, int]:
    """Return how many mutants mean the same and how many are refused; assert that there are no others.

    ``may_be``: whether the second reading is what the first becomes by the rules of the format.
    """
    path.write_text(text, encoding="utf-8")
    before, same, refused = read(path), 0, 0
    for what, mutant in mutants(text):
        path.write_text(mutant, encoding="utf-8")
        try:
            after = read(path)
        except refusals:
            refused += 1
            continue
        assert is_same(before, after) or may_be(before, after), what
        same += 1
    return same, refused
