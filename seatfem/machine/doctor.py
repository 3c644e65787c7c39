"""Checks of what is installed and what is missing, with the exact command that mends it."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from importlib import metadata
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
from seatfem.machine.packages import EXTRAS, LIBRARIES
from seatfem.machine.petsc import petsc_setting

PROBE_TIMEOUT: Final = 60.0
_THREAD_VARIABLES: Final = ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")

_GMSH_PROBE: Final = "import gmsh; gmsh.initialize(readConfigFiles=False); print(gmsh.__version__); gmsh.finalize()"
_PARDISO_PROBE: Final = (
    "import numpy, scipy.sparse, pypardiso; "
    "x = pypardiso.spsolve(scipy.sparse.csr_matrix(2 * numpy.eye(3)), numpy.ones(3)); "
    "assert abs(x - 0.5).max() < 1e-15; print(pypardiso.__version__)"
)
_PICTURE_PROBE: Final = (
    "import pyvista; p = pyvista.Plotter(off_screen=True, window_size=(64, 64)); p.add_mesh(pyvista.Sphere()); "
    "image = p.screenshot(return_img=True); assert image.std() > 1; print(type(p.render_window).__name__)"
)


@dataclass(frozen=True)
class Check:
    """One thing looked at. A gap in something that is not `required` costs comfort or speed only."""

    name: str
    ok: bool
    detail: str
    remedy: str = ""
    required: bool = True


def doctor_report() -> tuple[Check, ...]:
    """Look at the interpreter, libraries, extras, processors, cache, gmsh, PARDISO, off-screen rendering and PETSc.

    gmsh, PARDISO and VTK are tried in processes of their own, because a missing system library can crash them.
    """
    probes: tuple[Callable[[], Check], ...] = (_gmsh, _pardiso, _pictures, _petsc)
    with ThreadPoolExecutor(max_workers=2) as pool:
        tried = [pool.submit(probe) for probe in probes]
        quick = (
            _python(),
            *(_library(name) for name in LIBRARIES),
            *(_extra(name, packages) for name, packages in EXTRAS.items()),
            _threads(),
            _cache(),
        )
        return (*quick, *(future.result() for future in tried))


def _python() -> Check:
    return Check(
        "python", sys.version_info >= (3, 11), f"{platform.python_version()}, {sys.executable}", "Python >= 3.11"
    )


def _library(name: str) -> Check:
    version = _version(name)
    return Check(name, version is not None, version or "not installed", f"pip install {name}")


def _extra(name: str, packages: tuple[str, ...]) -> Check:
    versions = {package: _version(package) for package in packages}
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


def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _threads() -> Check:
    usable = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    limits = [f"{name}={os.environ[name]}" for name in _THREAD_VARIABLES if name in os.environ]
    return Check("processors", True, f"{usable} usable; {', '.join(limits) or 'thread counts not limited'}")


def _gmsh() -> Check:
    if missing := missing_packages(GMSH_LIBRARIES):
        return Check("meshing", False, "system libraries are missing", apt_command(missing))
    ok, detail = _try(_GMSH_PROBE)
    return Check("meshing", ok, f"gmsh {detail}", "pip install --force-reinstall gmsh")


def _pardiso() -> Check:
    if _version("pypardiso") is None:
        detail = "PARDISO not installed; METIS + SuperLU take its place, several times slower"
        return Check("factorization", False, detail, "pip install pypardiso (x86-64 only)", required=False)
    ok, detail = _try(_PARDISO_PROBE)
    return Check(
        "factorization", ok, f"PARDISO, pypardiso {detail}", "pip install --force-reinstall pypardiso", required=False
    )


def _pictures() -> Check:
    if gap := picture_library_gap():
        detail, _, remedy = gap.partition("; ")
        return Check("off-screen rendering", False, detail, remedy.partition(": ")[2], required=False)
    select_offscreen_window()
    ok, detail = _try(_PICTURE_PROBE)
    return Check("off-screen rendering", ok, detail, "apt-get install libegl1 libgl1-mesa-dri", required=False)


def _petsc() -> Check:
    """Return the check of PETSc, which seat.greens.backend = "slepc" alone needs."""
    try:
        setting = petsc_setting()
    except ValueError as problem:
        return Check("PETSc, SLEPc, MPI", False, str(problem), "unset it", required=False)
    gap, remedy = setting.gap()
    return Check("PETSc, SLEPc, MPI", not gap, gap or str(setting), remedy, required=False)


def _try(code: str) -> tuple[bool, str]:
    """Run code in another interpreter: (success, its output or what went wrong)."""
    try:
        result = subprocess.run(
            [sys.executable, "-P", "-c", code], capture_output=True, text=True, timeout=PROBE_TIMEOUT, check=False
        )
    except subprocess.TimeoutExpired:
        return False, f"no answer within {PROBE_TIMEOUT:g} s"
    if result.returncode == 0:
        return True, (result.stdout.strip().splitlines() or [""])[-1]
    if result.returncode < 0:
        return False, f"crashed (signal {-result.returncode})"
    return False, (result.stderr.strip().splitlines() or [f"exit code {result.returncode}"])[-1]
