"""The doctor finds what is missing, and says how to mend it."""

import re
import tomllib
from pathlib import Path

import pytest

from seatfem.machine import doctor, petsc
from seatfem.machine import libraries as system
from seatfem.machine.doctor import doctor_report

ROOT = Path(__file__).parents[2]


@pytest.fixture
def no_library(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(system, "_loads", lambda library: False)


def test_here_everything_that_is_required_works() -> None:
    gaps = [found for found in doctor_report() if found.required and not found.ok]
    assert gaps == []


def test_the_libraries_are_those_of_the_package() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]

    def names(requirements: list[str]) -> set[str]:
        return {re.split(r"[<>=;\[ ]", requirement)[0] for requirement in requirements}

    assert set(doctor.LIBRARIES) == names(project["dependencies"]) - {"pypardiso"}
    assert set(system.PICTURE_PACKAGES) == names(project["optional-dependencies"]["pictures"])
    assert set(doctor.UNIVERSAL_FILES) == names(project["optional-dependencies"]["uff"])


def test_a_missing_reader_of_universal_files_is_a_gap_with_its_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    known = doctor._version
    monkeypatch.setattr(doctor, "_try", lambda code: (True, ""))
    monkeypatch.setattr(doctor, "_version", lambda name: None if name == "pyuff" else known(name))
    (found,) = (check for check in doctor_report() if check.name == "pyuff")
    assert (found.ok, found.required, found.remedy) == (False, False, "pip install 'seatfem[uff]'")


def test_the_system_packages_are_those_that_ci_installs() -> None:
    needed, _, _ = (ROOT / ".ci" / "apt.txt").read_text(encoding="utf-8").partition("# for tests alone\n")
    lines = needed.splitlines()
    listed = {line for line in lines if line and not line.startswith("#")}
    assert listed == {*system.GMSH_LIBRARIES.values(), *system.EGL.values()}


def test_without_petsc_a_gap_costs_one_backend_and_names_the_packages(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(petsc.PYTHON, "/no/python")
    monkeypatch.setenv(petsc.MPIEXEC, "/no/mpiexec")
    found = doctor._petsc()
    assert (found.ok, found.required) == (False, False)
    packages = "python3-petsc4py python3-slepc4py openmpi-bin"
    assert found.remedy == f"apt-get install --no-install-recommends {packages}, or set {petsc.MPIEXEC}"
    assert set(packages.split()) <= set((ROOT / ".ci" / "apt.txt").read_text(encoding="utf-8").split())
    monkeypatch.setenv(petsc.RANKS, "-1")
    assert "SEATFEM_MPI_RANKS = '-1'" in doctor._petsc().detail


@pytest.mark.usefixtures("no_library")
def test_missing_system_libraries_end_in_one_command() -> None:
    with pytest.raises(system.MissingLibraryError) as caught:
        system.require_gmsh_libraries()
    packages = "libglu1-mesa libgl1 libxrender1 libxcursor1 libxft2 libxinerama1 libgomp1"
    assert f"apt-get install --no-install-recommends {packages}" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.usefixtures("no_library")
def test_the_doctor_sees_missing_system_libraries() -> None:
    meshing, rendering = doctor._gmsh(), doctor._pictures()
    assert (meshing.ok, meshing.required) == (False, True)
    assert meshing.remedy.startswith("apt-get install --no-install-recommends libglu1-mesa")
    assert (rendering.ok, rendering.required) == (False, False)
    assert rendering.remedy == "apt-get install --no-install-recommends libegl1"


def test_only_what_is_missing_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(system, "_loads", lambda library: library != "libGLU.so.1")
    assert system.missing_packages(system.GMSH_LIBRARIES) == ("libglu1-mesa",)


def test_pictures_without_egl_need_osmesa(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("VTK_DEFAULT_OPENGL_WINDOW", raising=False)
    monkeypatch.setattr(system, "_loads", lambda library: False)
    assert "libegl1" in str(system.picture_library_gap())
    monkeypatch.setattr(system, "_loads", lambda library: library.startswith("libOSMesa"))
    assert system.picture_library_gap() is None
    monkeypatch.setenv("VTK_DEFAULT_OPENGL_WINDOW", "")
    monkeypatch.delenv("VTK_DEFAULT_OPENGL_WINDOW")
    system.select_offscreen_window()
    assert system.os.environ["VTK_DEFAULT_OPENGL_WINDOW"] == "vtkOSOpenGLRenderWindow"


def test_pictures_without_their_packages(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(system, "PICTURE_PACKAGES", ("matplotlib", "no_such_package"))
    gap = system.picture_library_gap()
    assert gap == "no pictures: no_such_package not installed; install with: pip install 'seatfem[pictures]'"


@pytest.mark.parametrize(
    ("code", "detail"),
    [
        ("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", "crashed (signal 11)"),
        ("raise ValueError('no')", "ValueError: no"),
        ("raise SystemExit(3)", "exit code 3"),
    ],
)
def test_a_crash_in_a_probe_is_a_finding(monkeypatch: pytest.MonkeyPatch, code: str, detail: str) -> None:
    monkeypatch.setattr(doctor, "_GMSH_PROBE", code)
    found = doctor._gmsh()
    assert (found.ok, found.detail) == (False, f"gmsh {detail}")


def test_a_probe_that_hangs_is_a_finding(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "PROBE_TIMEOUT", 0.2)
    monkeypatch.setattr(doctor, "_PICTURE_PROBE", "import time; time.sleep(30)")
    assert "no answer within 0.2 s" in doctor._pictures().detail
