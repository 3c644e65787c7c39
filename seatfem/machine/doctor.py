"""Checks of what is installed and what is missing, with the exact command that mends it."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Final

from impact.files.atomic import OutputError, check_writable
from seatfem.machine.code import VARIABLE, cache_folder
from seatfem.machine.libraries import (
    GMSH_LIBRARIES,
    apt_command,
    missing_packages,
    picture_library_gap,
    select_offscreen_window,
)
from seatfem.machine.packages import installed_version, requirements
from seatfem.machine.petsc import petsc_setting
from seatfem.machine.rates import cores

PROBE_TIMEOUT: Final = 60.0
_THREAD_VARIABLES: Final = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


@dataclass(frozen=True)
class Check:
    """One thing looked at. A gap in something that is not `required` costs comfort or speed only."""

    name: str
    ok: bool
    detail: str
    remedy: str = ""
    required: bool = True


@dataclass(frozen=True)
class Probe:
    """Code that is tried in a process of its own, because a missing system library can crash it.

    Attributes:
        name, what: of the check; before what the code prints.
        code: prints what it has found.
        remedy: of code that fails.
        gap: what is missing and how it is mended, where that is known without trying; else ``None``.
    """

    name: str
    what: str
    code: str
    remedy: str
    gap: Callable[[], tuple[str, str] | None]
    required: bool = False

    def check(self) -> Check:
        """Return what is found."""
        if (gap := self.gap()) is not None:
            return Check(self.name, False, *gap, self.required)
        ok, detail = _try(self.code)
        return Check(self.name, ok, f"{self.what} {detail}".strip(), self.remedy, self.required)


def _gmsh_gap() -> tuple[str, str] | None:
    missing = missing_packages(GMSH_LIBRARIES)
    return ("system libraries are missing", apt_command(missing)) if missing else None


def _pardiso_gap() -> tuple[str, str] | None:
    if installed_version("pypardiso") is not None:
        return None
    detail = "PARDISO not installed; METIS + SuperLU take its place, several times slower"
    return detail, "pip install pypardiso (x86-64 only)"


def _picture_gap() -> tuple[str, str] | None:
    if gap := picture_library_gap():
        detail, _, remedy = gap.partition("; ")
        return detail, remedy.partition(": ")[2]
    select_offscreen_window()
    return None


GMSH: Final = Probe(
    "meshing",
    "gmsh",
    "import gmsh; gmsh.initialize(readConfigFiles=False); print(gmsh.__version__); gmsh.finalize()",
    "pip install --force-reinstall gmsh",
    _gmsh_gap,
    required=True,
)
PARDISO: Final = Probe(
    "factorization",
    "PARDISO, pypardiso",
    "import numpy, scipy.sparse, pypardiso; "
    "x = pypardiso.spsolve(scipy.sparse.csr_matrix(2 * numpy.eye(3)), numpy.ones(3)); "
    "assert abs(x - 0.5).max() < 1e-15; print(pypardiso.__version__)",
    "pip install --force-reinstall pypardiso",
    _pardiso_gap,
)
PICTURES: Final = Probe(
    "off-screen rendering",
    "",
    "import pyvista; p = pyvista.Plotter(off_screen=True, window_size=(64, 64)); p.add_mesh(pyvista.Sphere()); "
    "image = p.screenshot(return_img=True); assert image.std() > 1; print(type(p.render_window).__name__)",
    "apt-get install libegl1 libgl1-mesa-dri",
    _picture_gap,
)


def doctor_report() -> tuple[Check, ...]:
    """Look at the interpreter, libraries, extras, processors, cache, gmsh, PARDISO, off-screen rendering and PETSc."""
    with ThreadPoolExecutor(max_workers=2) as pool:
        tried = pool.map(lambda check: check(), (GMSH.check, PARDISO.check, PICTURES.check, check_petsc))
        limits = [f"{name}={os.environ[name]}" for name in _THREAD_VARIABLES if name in os.environ]
        needed = sys.version_info >= (3, 11)
        extras = requirements()
        libraries = {name: installed_version(name) for name in extras.pop("", ())}
        return (
            Check("python", needed, f"{platform.python_version()}, {sys.executable}", "Python >= 3.11"),
            *(Check(name, v is not None, v or "not installed", f"pip install {name}") for name, v in libraries.items()),
            *(_extra(name, packages) for name, packages in extras.items()),
            Check("processors", True, f"{cores()} usable; {', '.join(limits) or 'thread counts not limited'}"),
            _cache(),
            *tried,
        )


def _extra(name: str, packages: tuple[str, ...]) -> Check:
    versions = {package: installed_version(package) for package in packages}
    absent = [package for package, version in versions.items() if version is None]
    installed = ", ".join(f"{package} {version}" for package, version in versions.items())
    detail = f"not installed: {', '.join(absent)}" if absent else installed
    return Check(f"extra {name}", not absent, detail, f"pip install 'seatfem[{name}]'", required=False)


def _cache() -> Check:
    """Return where Green's functions are kept."""
    folder = cache_folder()
    try:
        check_writable(folder / "seat.h5")
    except OutputError as problem:
        reason = str(problem.__cause__ or problem)
        remedy = f"set {VARIABLE} to a folder that can be written to"
        return Check("cache folder", False, f"{reason}: nothing computed is kept", remedy, required=False)
    return Check("cache folder", True, str(folder))


def check_petsc() -> Check:
    """Return the check of PETSc, which seat.greens.backend = "slepc" alone needs."""
    try:
        setting = petsc_setting()
    except ValueError as problem:
        return Check("PETSc, SLEPc, MPI", False, str(problem), "unset it", required=False)
    gap, remedy = setting.gap()
    return Check("PETSc, SLEPc, MPI", not gap, gap or str(setting), remedy, required=False)


def _try(code: str) -> tuple[bool, str]:
    """Run code in another interpreter: (success, its output or what went wrong)."""
    command = [sys.executable, "-P", "-c", code]
    try:
        result = subprocess.run(command, capture_output=True, text=True, timeout=PROBE_TIMEOUT, check=False)
    except subprocess.TimeoutExpired:
        return False, f"no answer within {PROBE_TIMEOUT:g} s"
    if result.returncode < 0:
        return False, f"crashed (signal {-result.returncode})"
    lines = (result.stderr if result.returncode else result.stdout).strip().splitlines()
    return not result.returncode, (lines or [f"exit code {result.returncode}" if result.returncode else ""])[-1]
