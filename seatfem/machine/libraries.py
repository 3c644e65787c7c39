"""System libraries that wheels lack: gaps are reported before they crash a process."""

import ctypes
import importlib.util
import os
import sys
from collections.abc import Mapping
from functools import cache
from typing import Final

from impact.notices import SeatfemError

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


class MissingLibraryError(SeatfemError, RuntimeError):
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


def picture_library_gap() -> str:
    """Return why pictures cannot be drawn, and the command that repairs it; "" if they can.

    Call it before importing vtk or pyvista: without libEGL or OSMesa, VTK ends the process instead of raising an error.
    """
    absent = [name for name in PICTURE_PACKAGES if importlib.util.find_spec(name) is None]
    if absent:
        return f"no pictures: {', '.join(absent)} not installed; install with: pip install 'seatfem[pictures]'"
    if missing_packages(EGL) and not _osmesa():
        return f"no pictures: libEGL is missing; install it: {apt_command(tuple(EGL.values()))}"
    return ""


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
