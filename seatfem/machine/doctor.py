"""Checks of the installation, with the exact command that repairs each gap."""

import os
import platform
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from dataclasses import dataclass
from importlib import metadata
from traceback import walk_tb
from typing import Final

from impact.files.safe_files import OutputError, check_writable
from impact.names import how_to_mend
from seatfem.machine.code import VARIABLE, cache_folder
from seatfem.machine.libraries import (
    GMSH_LIBRARIES,
    apt_command,
    missing_packages,
    picture_library_gap,
    select_offscreen_window,
)
from seatfem.machine.resources import cores

_NAME: Final = re.compile(r"[A-Za-z0-9._-]+")
_EXTRA: Final = re.compile(r"extra == ['\"]([\w-]+)")
_NO_OTHERS = ("seatfem", "impact", "__main__")


def broken_package(error: Exception) -> str:
    """Return which third-party package failed during its import, with a remedy; "" for all other errors."""
    if not (module := _failed_module(error)):
        return ""
    for name in map(str.lower, metadata.packages_distributions().get(module, [module])):
        for extra, packages in requirements().items():
            if name in packages or (extra and any(name in _needs(package) for package in packages)):
                return how_to_mend(name, extra, error)
    return how_to_mend(module, "", error) if isinstance(error, ImportError) else ""


def _failed_module(error: Exception) -> str:
    """Return the first package in the traceback whose import raised the error, or the absent one; "" without any."""
    imported = (frame for frame, _ in walk_tb(error.__traceback__) if frame.f_code.co_name == "<module>")
    names = (str(frame.f_globals.get("__name__", "")).partition(".")[0] for frame in imported)
    absent = (getattr(error, "name", None) or "") if isinstance(error, ModuleNotFoundError) else ""
    module = next((name for name in names if name not in _NO_OTHERS), absent.partition(".")[0])
    return "" if module in _NO_OTHERS else module


def installed_version(name: str) -> str:
    """Return the version of a distribution; "" if it is not installed."""
    with suppress(metadata.PackageNotFoundError):
        return metadata.version(name)
    return ""


def requirements(package: str = "seatfem") -> dict[str, tuple[str, ...]]:
    """Return the distributions that each extra needs, the smallest extras first, under "" the unconditional ones; empty
    for a package that is not installed."""
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
    """Return the distributions that an installed one requires."""
    return {name.lower() for names in requirements(package).values() for name in names}


PROBE_TIMEOUT: Final = 60.0
_THREAD_VARIABLES: Final = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
GMSH_PROBE: Final = "import gmsh; gmsh.initialize(readConfigFiles=False); print(gmsh.__version__); gmsh.finalize()"
PARDISO_PROBE: Final = (
    "import numpy, scipy.sparse, pypardiso; "
    "x = pypardiso.spsolve(scipy.sparse.csr_matrix(2 * numpy.eye(3)), numpy.ones(3)); "
    "assert abs(x - 0.5).max() < 1e-15; print(pypardiso.__version__)"
)
PICTURE_PROBE: Final = (
    "import pyvista; p = pyvista.Plotter(off_screen=True, window_size=(64, 64)); p.add_mesh(pyvista.Sphere()); "
    "image = p.screenshot(return_img=True); assert image.std() > 1; print(type(p.render_window).__name__)"
)


@dataclass(frozen=True)
class Check:
    """Check of one component. A gap in one that is not `required` costs comfort or speed only."""

    name: str
    ok: bool
    detail: str
    remedy: str = ""
    required: bool = True


def doctor_report() -> tuple[Check, ...]:
    """Check the interpreter, libraries, extras, processors, cache, gmsh, PARDISO and off-screen rendering.

    gmsh, PARDISO and VTK are tested in separate processes, because a missing system library can crash them.
    """
    with ThreadPoolExecutor(max_workers=2) as pool:
        tried = pool.map(lambda check: check(), (check_gmsh, check_pardiso, check_pictures))
        limits = [f"{name}={os.environ[name]}" for name in _THREAD_VARIABLES if name in os.environ]
        needed = sys.version_info >= (3, 11)
        extras = requirements()
        libraries = {name: installed_version(name) for name in extras.pop("", ())}
        return (
            Check("python", needed, f"{platform.python_version()}, {sys.executable}", "Python >= 3.11"),
            *(Check(name, v != "", v or "not installed", f"pip install {name}") for name, v in libraries.items()),
            *(_extra(name, packages) for name, packages in extras.items()),
            Check("processors", True, f"{cores()} usable; {', '.join(limits) or 'thread counts not limited'}"),
            _cache(),
            *tried,
        )


def _extra(name: str, packages: tuple[str, ...]) -> Check:
    versions = {package: installed_version(package) for package in packages}
    absent = [package for package, version in versions.items() if not version]
    installed = ", ".join(f"{package} {version}" for package, version in versions.items())
    detail = f"not installed: {', '.join(absent)}" if absent else installed
    return Check(f"extra {name}", not absent, detail, f"pip install 'seatfem[{name}]'", required=False)


def _cache() -> Check:
    """Return the check of the folder in which Green's functions are stored."""
    folder = cache_folder()
    try:
        check_writable(folder / "seat.h5")
    except OutputError as problem:
        reason = str(problem.__cause__ or problem)
        remedy = f"set {VARIABLE} to a folder that can be written to"
        return Check("cache folder", False, f"{reason}: nothing computed is kept", remedy, required=False)
    return Check("cache folder", True, str(folder))


def check_gmsh() -> Check:
    """Return the check whether gmsh runs."""
    if missing := missing_packages(GMSH_LIBRARIES):
        return Check("meshing", False, "system libraries are missing", apt_command(missing))
    ok, detail = _try(GMSH_PROBE)
    return Check("meshing", ok, f"gmsh {detail}", "pip install --force-reinstall gmsh")


def check_pardiso() -> Check:
    """Return the check whether PARDISO solves."""
    name, detail = "factorization", "PARDISO not installed; METIS + SuperLU take its place, several times slower"
    if not installed_version("pypardiso"):
        return Check(name, False, detail, "pip install pypardiso (x86-64 only)", required=False)
    ok, detail = _try(PARDISO_PROBE)
    remedy = "pip install --force-reinstall pypardiso"
    return Check(name, ok, f"PARDISO, pypardiso {detail}", remedy, required=False)


def check_pictures() -> Check:
    """Return the check whether VTK draws."""
    if gap := picture_library_gap():
        detail, _, remedy = gap.partition("; ")
        return Check("off-screen rendering", False, detail, remedy.partition(": ")[2], required=False)
    select_offscreen_window()
    ok, detail = _try(PICTURE_PROBE)
    return Check("off-screen rendering", ok, detail, "apt-get install libegl1 libgl1-mesa-dri", required=False)


def _try(code: str) -> tuple[bool, str]:
    """Run code in another interpreter; return success, and its output or the reason for the failure."""
    command = [sys.executable, "-P", "-c", code]
    try:
        result = subprocess.run(command, capture_output=True, text=True, timeout=PROBE_TIMEOUT, check=False)
    except subprocess.TimeoutExpired:
        return False, f"no answer within {PROBE_TIMEOUT:g} s"
    if result.returncode < 0:
        return False, f"crashed (signal {-result.returncode})"
    lines = (result.stderr if result.returncode else result.stdout).strip().splitlines()
    return not result.returncode, (lines or [f"exit code {result.returncode}" if result.returncode else ""])[-1]
