"""Versions of the program by hashes of its sources, which no developer can forget to raise; and the cache folder."""

import os
import sys
from functools import cache
from hashlib import sha256
from importlib import metadata
from importlib.util import find_spec
from pathlib import Path
from typing import Final

NOT_NUMERICS: Final = (
    "seatfem/faces",
    "seatfem/jobs",
    "seatfem/machine",
    "seatfem/pictures",
    "seatfem/study",
    "seatfem/verify.py",
    "seatfem/wings",
)
"""Sources that do not affect the Green's function of a seat; a new one is taken to affect it until it is listed."""
VARIABLE: Final = "SEATFEM_STORE"


@cache
def code_version(without: tuple[str, ...] = ()) -> str:
    """Return a hash of the sources of both packages except those ``without``; of the version if there are none."""
    specs = (find_spec(package) for package in ("impact", "seatfem"))
    return hash_of([Path(spec.origin).parent for spec in specs if spec is not None and spec.origin], without)


def numerics_version() -> str:
    """Return a hash of all sources that affect Green's functions."""
    return code_version(NOT_NUMERICS)


def is_ours(candidate: type) -> bool:
    """Return whether a class belongs to either package."""
    return candidate.__module__.partition(".")[0] in ("impact", "seatfem")


def sources_from_elsewhere(*classes: type) -> list[str]:
    """Return hashes of the files that define classes of other packages, and their base classes.

    Base classes of our own classes do not count, nor do the imports of a file.
    """
    own_bases = {base for one in classes for own in one.__mro__ if is_ours(own) for base in own.__mro__}
    modules = {base.__module__ for one in classes for base in one.__mro__ if base not in own_bases}
    files = {getattr(sys.modules.get(name), "__file__", None) for name in modules}
    return sorted(sha256(Path(file).read_bytes()).hexdigest() for file in files if file)


def hash_of(packages: list[Path], without: tuple[str, ...] = ()) -> str:
    """Return the hash of all Python files in some folders, by their names and contents."""
    digest, has_files = sha256(), False
    for package in packages:
        for folder, inner, files in os.walk(package):
            place = Path(folder).relative_to(package.parent).as_posix()
            inner[:] = sorted(name for name in inner if f"{place}/{name}" not in without)
            for name in sorted(files):
                if name.endswith(".py") and f"{place}/{name}" not in without:
                    digest.update(f"{place}/{name}\n".encode())
                    with open(os.path.join(folder, name), "rb") as file:
                        digest.update(file.read())
                    has_files = True
    if not has_files:
        digest.update(metadata.version("seatfem").encode())
    return digest.hexdigest()[:16]


def cache_folder() -> Path:
    """Return the folder of the environment variable SEATFEM_STORE, or the user's cache (XDG_CACHE_HOME)."""
    if folder := os.environ.get(VARIABLE):
        return Path(folder)
    if cache := os.environ.get("XDG_CACHE_HOME"):
        return Path(cache) / "seatfem" / "greens"
    try:
        return Path.home() / ".cache" / "seatfem" / "greens"
    except RuntimeError:  # a user without a home, as in containers: the folder cannot be written to
        return Path(os.devnull) / "seatfem"
