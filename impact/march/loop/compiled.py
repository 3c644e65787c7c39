"""`numba.njit` for loops that call loops of other files.

By itself numba's cache is renewed when a function's own file changes, not when another one does that it calls into.
Here it is renewed with each of the files that these functions are made of.
"""

from __future__ import annotations

from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import Any, Final

from numba import njit


def stamp(march: Path) -> str:
    """Return a hash of the contents of the loop in this folder, and of the numbers by which laws and films are known to
    it."""
    digest = sha256()
    for file in sorted([*(march / "loop").glob("*.py"), march / "laws.py"]):
        digest.update(file.read_bytes())
    return digest.hexdigest()


STAMP: Final = stamp(Path(__file__).parents[1])


def on_file(made: Any) -> bool:
    """Return whether numba has anything compiled of a function on file, from the sources as they are."""
    cached = getattr(getattr(made, "_cache", None), "_cache_file", None)
    return cached is None or bool(cached._load_index())  # none where nothing is compiled: NUMBA_DISABLE_JIT


def compiled(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return a decorator that compiles with ``options`` of `numba.njit`, cached until one of the files changes."""

    def decorate(function: Callable[..., Any]) -> Any:
        dispatcher = njit(cache=True, **options)(function)
        cached = getattr(getattr(dispatcher, "_cache", None), "_cache_file", None)
        if cached is not None:  # numba's own stamp is of one file, and nothing public sets another
            cached._source_stamp = STAMP
        return dispatcher

    return decorate
