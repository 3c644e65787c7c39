"""Packages of others: which are needed, which belong to an extra, and which one fails while it is imported."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import metadata
from traceback import walk_tb
from types import MappingProxyType
from typing import Final

from impact.extras import how_to_mend
from seatfem.machine.libraries import PICTURE_PACKAGES

LIBRARIES: Final = (
    "numpy",
    "scipy",
    "numba",
    "h5py",
    "rainflow",
    "threadpoolctl",
    "gmsh",
    "scikit-fem",
    "pymetis",
    "pydantic",
    "meshio",
    "netCDF4",
    "pint",
    "cyclopts",
    "rich",
    "psutil",
)
"""Distributions that are always needed."""

EXTRAS: Final[Mapping[str, tuple[str, ...]]] = MappingProxyType(
    {
        "pictures": PICTURE_PACKAGES,
        "tables": ("pandas", "pyarrow"),
        "report": ("plotly",),
        "cluster": ("distributed",),
        "uff": ("pyuff",),
        "docs": ("sphinx", "docutils", "myst-parser", "sphinx-gallery", "pydata-sphinx-theme"),
        "dev": (
            *("pytest", "pytest-xdist", "hypothesis", "build", "mypy", "ruff", "scipy-stubs", "types-psutil"),
            *("selenium", "nbclient", "ipykernel", "jsonschema", "types-jsonschema"),
        ),
    }
)
"""Distributions of each extra, beside those of other extras that it takes in."""

_NO_OTHERS = ("seatfem", "impact", "__main__")


def broken_package(error: Exception) -> str:
    """Return which package of others failed while this one imported it, and what mends it; "" of all other errors."""
    if not (module := _failed_module(error)):
        return ""
    for name in map(str.lower, metadata.packages_distributions().get(module, [module])):
        if name in LIBRARIES:
            return how_to_mend(name, "", error)
        for extra, packages in EXTRAS.items():
            if name in packages or any(name in _needs(package) for package in packages):
                return how_to_mend(name, extra, error)
    return how_to_mend(module, "", error) if isinstance(error, ImportError) else ""


def _failed_module(error: Exception) -> str:
    """Return the package whose import raised the error, the first of a chain: its own code failed, or it is absent."""
    imported = (frame for frame, _ in walk_tb(error.__traceback__) if frame.f_code.co_name == "<module>")
    names = (str(frame.f_globals.get("__name__", "")).partition(".")[0] for frame in imported)
    absent = (getattr(error, "name", None) or "") if isinstance(error, ModuleNotFoundError) else ""
    module = next((name for name in names if name not in _NO_OTHERS), absent.partition(".")[0])
    return "" if module in _NO_OTHERS else module


def _needs(package: str) -> set[str]:
    """Return the distributions that one requires, if it is installed."""
    try:
        stated = metadata.requires(package) or []
    except metadata.PackageNotFoundError:
        return set()
    return {words.split(";")[0].split("[")[0].rstrip("<>=!~ .0123456789,*()").strip().lower() for words in stated}
