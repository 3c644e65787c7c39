"""Modules, public names of packages, those that went elsewhere and optional packages are loaded on first use.

Which modules a file needs stands in plain imports at its top; what a user's errand does not use is never executed: a
misspelt key of a scene is refused before a finite element library is loaded. `from package import module` waits,
`from package.module import name` does not.
"""

from __future__ import annotations

import ast
import sys
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec, PathFinder, SourceFileLoader
from pathlib import Path
from pkgutil import iter_modules
from threading import RLock
from types import MappingProxyType, ModuleType
from typing import TYPE_CHECKING, Any, Final

from impact.notices import SeatfemError

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


if TYPE_CHECKING:
    import pandas


NOTHING: Final[Mapping[str, str]] = MappingProxyType({})


def lazy_names(
    package: str, places: Mapping[str, str] = NOTHING, former: Mapping[str, str] = NOTHING
) -> Callable[[str], Any]:
    """Return the ``__getattr__`` of a package, which imports what a name stands for when it is asked for.

    A module of the package is an attribute of it, too, without an import of its own.
    ``places``: further names by the module that holds them, apart by blanks; a name that is the module's own is the
    module. ``former``: what was there once, and where it is now: the full name of a module, or "module:name" of a name.
    """
    homes = {name: module for module, names in places.items() for name in names.split()}
    moved = {f"{package}.{name}": place for name, place in former.items()}
    if modules := {name: place for name, place in moved.items() if ":" not in place}:
        sys.meta_path.append(FormerModules(modules))

    def load_name(name: str) -> Any:
        if place := moved.get(f"{package}.{name}"):
            _warn(f"{package}.{name}", place)
            module, _, held = place.partition(":")
            return getattr(import_module(module), held) if held else import_module(module)
        if name not in homes:
            try:
                return import_module(f"{package}.{name}")
            except ModuleNotFoundError as missing:
                if missing.name not in (package, f"{package}.{name}"):
                    raise
                raise AttributeError(f"module {package!r} has no attribute {name!r}") from None
        home = import_module(homes[name])
        if hasattr(home, name):
            return getattr(home, name)
        return home if homes[name].endswith(f".{name}") else import_module(f"{homes[name]}.{name}")

    return load_name


def public_names(
    package: str, file: str, former: Mapping[str, str] = NOTHING
) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """Return ``__getattr__``, ``__dir__`` and ``__all__`` of a package, whose names are the imports of its stub.

    The stub, `__init__.pyi` beside ``file``, is what type checkers read too, as SPEC 1 of Scientific Python has it;
    the modules that it imports from the package itself are not among the names, nor are those of a module that was
    removed. ``former`` is that of `lazy_names`.
    """
    stub = [
        n for n in ast.parse(Path(file).with_suffix(".pyi").read_text("utf-8")).body if isinstance(n, ast.ImportFrom)
    ]
    root = Path(file).parents[package.count(".") + 1]
    places = {
        n.module: [each.name for each in n.names] for n in stub if n.module and n.module != package
        if any((root / f"{n.module.replace('.', '/')}{end}").is_file() for end in (".py", "/__init__.py"))
    }  # fmt: skip
    names = sorted(name for names in places.values() for name in names)
    load = lazy_names(package, {module: " ".join(held) for module, held in places.items()}, former)
    return load, names.copy, names


@dataclass(frozen=True)
class FormerModules(MetaPathFinder, Loader):
    """Finds modules under names that they had once: ``places`` has the former full name and the present one."""

    places: Mapping[str, str]

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return how to load a former name; ``None`` of all others."""
        return ModuleSpec(fullname, self) if fullname in self.places else None

    def create_module(self, spec: ModuleSpec) -> None:
        """Leave it to Python."""

    def exec_module(self, module: ModuleType) -> None:
        """Warn, and fill the module with what the present one holds."""
        place = self.places[module.__name__]
        _warn(module.__name__, place)
        held = vars(import_now(place)).items()
        vars(module).update({name: value for name, value in held if not name.startswith("__")})


def _warn(name: str, place: str) -> None:
    words = f"{name} is {place.replace(':', '.')} now, and leaves with the next version: import it from there"
    warnings.warn(words, DeprecationWarning, stacklevel=3)


def how_to_mend(package: str, extra: str, error: Exception) -> str:
    """Return what is wrong with a package, and the command: an absent one is installed, a broken one anew.

    ``package``: its distribution, which begins with the name of its module; ``extra``: of seatfem, "" of what is always
    needed; ``error``: that importing it raised.
    """
    of_extra = f"seatfem[{extra}]" if extra else package
    module = (getattr(error, "name", None) or "").partition(".")[0]
    if isinstance(error, ModuleNotFoundError) and module in ("", package, package.replace("-", "_")):
        return f"{package} is not installed; install it with: pip install '{of_extra}'"
    whose = f"{package} (extra {extra!r})" if extra else package
    reason = " ".join(str(error).split()) or type(error).__name__
    command = f"pip install --force-reinstall {package}"
    return f"{whose} is installed but cannot be imported ({reason}); install it anew: {command}"


class FrameError(SeatfemError, ImportError):
    """pandas is missing; the message names the command that installs it."""


def frame_of(columns: Mapping[str, Any], index: str = "") -> pandas.DataFrame:
    """Return the ``columns`` as a `pandas.DataFrame`, with that named ``index`` as its index.

    Arrays (n, p) become p columns, "name[0]" to "name[p - 1]". Raises `FrameError` without pandas.
    """
    try:
        import pandas
    except Exception as missing:  # a broken one raises anything
        raise FrameError(f"a data frame needs pandas: {how_to_mend('pandas', 'tables', missing)}") from missing
    flat: dict[str, Any] = {}
    for name, values in columns.items():
        several = getattr(values, "ndim", 1) == 2
        flat |= {f"{name}[{k}]": values[:, k] for k in range(values.shape[1])} if several else {name: values}
    frame = pandas.DataFrame(flat)
    return frame.set_index(index) if index else frame
