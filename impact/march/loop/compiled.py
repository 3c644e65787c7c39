"""`numba.njit` for loops whose code is kept on file, and for those that call loops of other files.

By itself numba's cache is renewed when a function's own file changes, not when another one does that it calls into:
that of the march is renewed with each of the files that its functions are made of. And it loads all that numba compiles
with before it looks for code on file: half of what numba takes to start, for nothing where the code is found.
"""

from __future__ import annotations

from collections.abc import Callable
from hashlib import sha256
from pathlib import Path
from typing import Any, Final

from numba import njit
from numba.core.caching import FunctionCache
from numba.core.runtime.nrt import rtsys


def stamp(march: Path) -> str:
    """Return a hash of the contents of the loop in this folder, and of the numbers by which laws and films are known to
    it."""
    digest = sha256()
    for file in sorted([*(march / "loop").glob("*.py"), march / "laws.py"]):
        digest.update(file.read_bytes())
    return digest.hexdigest()


STAMP: Final = stamp(Path(__file__).parents[1])


class CodeOnFile(FunctionCache):
    """numba's cache of a function's code, from where it is loaded without what numba compiles with."""

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the code for these types of arguments; ``None`` where it is not on file."""
        rtsys.initialize(target_context)  # the memory of arrays that the code makes
        with self._guard_against_spurious_io_errors():
            return self._load_overload(sig, target_context)


def compiled(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Return a decorator that compiles with ``options`` of `numba.njit`, its code on file until a source changes."""

    def decorate(function: Callable[..., Any]) -> Any:
        dispatcher = njit(**options)(function)
        if hasattr(dispatcher, "_cache"):  # not where nothing is compiled: NUMBA_DISABLE_JIT
            dispatcher._cache = CodeOnFile(function)  # what `njit(cache=True)` does, with numba's own
            if function.__module__.startswith(__package__):  # numba's stamp is of one file, nothing public sets another
                dispatcher._cache._cache_file._source_stamp = STAMP
        return dispatcher

    return decorate
