"""Modules that are executed when something of them is first used, not when they are imported.

Which modules a file needs stands in plain imports at its top; what a user's errand does not use is never executed: a
misspelt key of a scene is refused before a finite element library is loaded. `from package import module` waits,
`from package.module import name` does not.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from functools import cache
from importlib import import_module
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from pkgutil import iter_modules
from threading import RLock
from types import ModuleType
from typing import Any, Final

_LOCK: Final = RLock()
"""One for all modules: two that each need the other's names cannot wait for one another."""


class LateModule(ModuleType):
    """A module that was imported and is executed when a name that it lacks is asked for."""

    def __getattr__(self, name: str) -> Any:
        """Execute the module once and return the name; names of Python's own machinery execute nothing."""
        if name.startswith("__") and name != "__all__":
            raise AttributeError(f"module {self.__name__!r} has no attribute {name!r}")
        _execute(self)
        return ModuleType.__getattribute__(self, name)

    def __setattr__(self, name: str, value: Any) -> None:
        """Execute the module before a name is set from outside, which would be overwritten."""
        if not name.startswith("__"):
            _execute(self)
        ModuleType.__setattr__(self, name, value)

    def __dir__(self) -> list[str]:
        """Return the names of the executed module."""
        _execute(self)
        return list(ModuleType.__dir__(self))


class LateLoader(SourceFileLoader):
    """Python's own loader of source files, whose modules wait until they are used and are plain modules afterwards."""

    executed = False

    def exec_module(self, module: ModuleType) -> None:
        """Let the module wait."""
        module.__class__ = LateModule

    def execute(self, module: ModuleType) -> None:
        """Execute the module; one that fails is executed again when it is next used."""
        self.executed = True
        try:
            super().exec_module(module)
        except BaseException:
            self.executed = False
            raise
        module.__class__ = ModuleType


class LateFinder(MetaPathFinder):
    """Finds the modules of some packages; the packages themselves are executed as they are imported."""

    def __init__(self, package: str) -> None:
        self.prefix = f"{package}."

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return how to load a module of the package; ``None`` for all others."""
        if not fullname.startswith(self.prefix):
            return None
        spec = PathFinder.find_spec(fullname, path, target)
        if spec is not None and type(spec.loader) is SourceFileLoader and spec.submodule_search_locations is None:
            spec.loader = LateLoader(fullname, spec.loader.path)
        return spec


def import_now(name: str) -> ModuleType:
    """Return the executed module of this name: what it registers is there. Raises what importing it raises."""
    module = import_module(name)
    _execute(module)
    return module


@cache
def import_all(package: str) -> tuple[ModuleType, ...]:
    """Return the executed modules of a package, in the order of their names."""
    return tuple(import_now(f"{package}.{each.name}") for each in iter_modules(import_module(package).__path__))


def _execute(module: ModuleType) -> None:
    with _LOCK:
        loader = module.__spec__.loader if module.__spec__ else None
        if isinstance(loader, LateLoader) and not loader.executed:
            loader.execute(module)


def load_late(package: str) -> None:
    """Let the modules of a package be executed when they are first used."""
    if not any(isinstance(finder, LateFinder) and finder.prefix == f"{package}." for finder in sys.meta_path):
        sys.meta_path.insert(0, LateFinder(package))
