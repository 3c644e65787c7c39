"""System libraries that wheels lack, and PETSc, SLEPc and MPI: gaps are reported before they crash a process."""

import ctypes
import importlib.util
import os
import shlex
import shutil
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Final

from seatfem.machine.resources import cores

GMSH_LIBRARIES: Final = {
    "libGLU.so.1": "libglu1-mesa",
    "libGL.so.1": "libgl1",
    "libXrender.so.1": "libxrender1",
    "libXcursor.so.1": "libxcursor1",
    "libXft.so.2": "libxft2",
    "libXinerama.so.1": "libxinerama1",
    "libgomp.so.1": "libgomp1",
}
"""Libraries that gmsh loads, and the Debian or Ubuntu package of each."""

EGL: Final = {"libEGL.so.1": "libegl1"}
_OSMESA: Final = ("libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so")
_OSMESA_WINDOW: Final = "vtkOSOpenGLRenderWindow"
PICTURE_PACKAGES: Final = ("matplotlib", "pyvista")


class MissingLibraryError(RuntimeError):
    """Error of a missing system library; the message names the command that installs it."""


@cache
def has_pardiso() -> bool:
    """Return whether PARDISO is installed, without loading it."""
    return importlib.util.find_spec("pypardiso") is not None


def missing_packages(libraries: Mapping[str, str]) -> tuple[str, ...]:
    """Return the packages (values) whose library (key) cannot be loaded; empty outside Linux, where wheels differ."""
    if sys.platform != "linux":
        return ()
    return tuple(package for library, package in libraries.items() if not _loads(library))


def apt_command(packages: tuple[str, ...]) -> str:
    """Return the command that installs system packages on Debian and Ubuntu."""
    return f"apt-get install --no-install-recommends {' '.join(packages)}"


def require_gmsh_libraries() -> None:
    """Raise `MissingLibraryError` if a system library of gmsh is missing. Does not import gmsh."""
    if missing := missing_packages(GMSH_LIBRARIES):
        raise MissingLibraryError(f"gmsh needs system libraries that are missing; install them: {apt_command(missing)}")


def picture_library_gap() -> str | None:
    """Return why pictures cannot be drawn, and the command that repairs it; ``None`` if they can.

    Call it before importing vtk or pyvista: without libEGL or OSMesa, VTK ends the process instead of raising an error.
    """
    absent = [name for name in PICTURE_PACKAGES if importlib.util.find_spec(name) is None]
    if absent:
        return f"no pictures: {', '.join(absent)} not installed; install with: pip install 'seatfem[pictures]'"
    if missing_packages(EGL) and not _osmesa():
        return f"no pictures: libEGL is missing; install it: {apt_command(tuple(EGL.values()))}"
    return None


def select_offscreen_window() -> None:
    """Select OSMesa for VTK if libEGL is missing. Call it before importing vtk or pyvista."""
    if missing_packages(EGL) and _osmesa():
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", _OSMESA_WINDOW)


def _osmesa() -> bool:
    return any(_loads(library) for library in _OSMESA)


def _loads(library: str) -> bool:
    try:
        ctypes.CDLL(library)
    except OSError:
        return False
    return True


PYTHON: Final = "SEATFEM_PETSC_PYTHON"
MPIEXEC: Final = "SEATFEM_MPIEXEC"
RANKS: Final = "SEATFEM_MPI_RANKS"
SECONDS: Final = "SEATFEM_MPI_SECONDS"
DEBIAN: Final = ("python3-petsc4py", "python3-slepc4py", "openmpi-bin")
SCRIPT: Final = Path(__file__).parents[1] / "structures" / "reduction" / "_slepc_ranks.py"
_PROBE: Final = 60.0  # longest time of the test [s]


@dataclass(frozen=True)
class PetscSetting:
    """Settings of PETSc in the environment.

    Attributes:
        python: SEATFEM_PETSC_PYTHON, an interpreter that has petsc4py and slepc4py [/usr/bin/python3].
        mpiexec: SEATFEM_MPIEXEC, a command with its options [mpiexec beside the interpreter, or in PATH].
        ranks: SEATFEM_MPI_RANKS, number of processes [number of cores].
        seconds: SEATFEM_MPI_SECONDS, longest time of one step of a reduction [a day].
    """

    python: str
    mpiexec: tuple[str, ...]
    ranks: int
    seconds: float

    @property
    def launch(self) -> tuple[str, ...]:
        """Return the words of the command before the interpreter."""
        return (*self.mpiexec, "-n", str(self.ranks))

    @property
    def environment(self) -> Mapping[str, str]:
        """Return the environment of the ranks: one thread each, yielding when idle, more ranks than cores and root
        allowed."""
        root = {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
        return {
            "OMP_NUM_THREADS": "1",
            "OMPI_MCA_rmaps_base_oversubscribe": "1",
            "OMPI_MCA_mpi_yield_when_idle": "1",
            **(root if hasattr(os, "geteuid") and os.geteuid() == 0 else {}),
        }

    def gap(self) -> tuple[str, str]:
        """Return what is missing, or "", and the command that installs it."""
        if shutil.which(self.mpiexec[0]) is None:
            return f"{self.mpiexec[0]} is not there", f"{apt_command(DEBIAN)}, or set {MPIEXEC}"
        ok, output = _tried(self.python)
        return "" if ok else f"{self.python}: {output}", f"{apt_command(DEBIAN)}, or set {PYTHON}"

    def __str__(self) -> str:
        return f"{_tried(self.python)[1]}, {self.python}, {shlex.join(self.launch)}"


def petsc_setting() -> PetscSetting:
    """Return the settings in the environment. Raises `ValueError` for an invalid number of ranks or seconds."""
    python = os.environ.get(PYTHON) or "/usr/bin/python3"
    neighbour = Path(python).with_name("mpiexec")
    mpiexec = os.environ.get(MPIEXEC) or (shlex.quote(str(neighbour)) if neighbour.is_file() else "mpiexec")
    ranks, seconds = _number(RANKS, cores()), _number(SECONDS, 86_400)
    return PetscSetting(python, tuple(shlex.split(mpiexec)), ranks, float(seconds))


def _number(name: str, usual: int) -> int:
    text = os.environ.get(name) or str(usual)
    if not (text.isascii() and text.isdigit() and 0 < int(text) < 10**9):
        raise ValueError(f"{name} = {text!r} must be a positive whole number")
    return int(text)


@cache
def _tried(python: str) -> tuple[bool, str]:
    """Return whether the program of the ranks finds its libraries with this interpreter, and its output."""
    try:
        result = subprocess.run([python, str(SCRIPT)], capture_output=True, text=True, timeout=_PROBE, check=False)
    except (OSError, subprocess.TimeoutExpired) as problem:
        return False, str(problem)
    lines = (result.stdout if result.returncode == 0 else result.stderr).strip().splitlines()
    return result.returncode == 0, (lines or [f"exit code {result.returncode}"])[-1]
