"""Packages of others: which are needed, which belong to an extra, and which one fails while it is imported."""

from __future__ import annotations

import re
from contextlib import suppress
from importlib import metadata
from traceback import walk_tb
from typing import Final

from impact.extras import how_to_mend

_NAME: Final = re.compile(r"[A-Za-z0-9._-]+")
_EXTRA: Final = re.compile(r"extra == ['\"]([\w-]+)")
_NO_OTHERS = ("seatfem", "impact", "__main__")


def broken_package(error: Exception) -> str:
    """Return which package of others failed while this one imported it, and what mends it; "" of all other errors."""
    if not (module := _failed_module(error)):
        return ""
    for name in map(str.lower, metadata.packages_distributions().get(module, [module])):
        for extra, packages in requirements().items():
            if name in packages or (extra and any(name in _needs(package) for package in packages)):
                return how_to_mend(name, extra, error)
    return how_to_mend(module, "", error) if isinstance(error, ImportError) else ""


def _failed_module(error: Exception) -> str:
    """Return the package whose import raised the error, the first of a chain: its own code failed, or it is absent."""
    imported = (frame for frame, _ in walk_tb(error.__traceback__) if frame.f_code.co_name == "<module>")
    names = (str(frame.f_globals.get("__name__", "")).partition(".")[0] for frame in imported)
    absent = (getattr(error, "name", None) or "") if isinstance(error, ModuleNotFoundError) else ""
    module = next((name for name in names if name not in _NO_OTHERS), absent.partition(".")[0])
    return "" if module in _NO_OTHERS else module


def installed_version(name: str) -> str | None:
    """Return the version of a distribution; ``None``: it is not installed."""
    with suppress(metadata.PackageNotFoundError):
        return metadata.version(name)
    return None


def requirements(package: str = "seatfem") -> dict[str, tuple[str, ...]]:
    """Return the distributions that each extra needs, the smallest extras first, under "" those needed always and
    everywhere; nothing of a package that is not installed."""
    stated: dict[str, list[str]] = {}
    with suppress(metadata.PackageNotFoundError):
        for words in metadata.requires(package) or []:
            requirement, _, marker = words.partition(";")
            extra = _EXTRA.search(marker)
            name = _NAME.match(requirement)
            if name and name[0].lower() != package and (extra or not marker):
                stated.setdefault(extra[1] if extra else "", []).append(name[0])
    return {
        extra: tuple(stated[extra]) for extra in sorted(stated, key=lambda extra: (extra != "", len(stated[extra])))
    }


def _needs(package: str) -> set[str]:
    """Return the distributions that one requires, if it is installed."""
    return {name.lower() for names in requirements(package).values() for name in names}
