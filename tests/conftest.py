"""Every test has a store of its own: what one test computed is not another's answer."""

import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import nullcontext
from pathlib import Path

import pytest

from seatfem.structures.mesh import gmsh_process
from seatfem.structures.store import VARIABLE

# A shell's background job ignores Ctrl-C, and so would the programs under test.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


def pytest_configure(config: pytest.Config) -> None:
    """Before several workers start, one process compiles what each of them would."""
    if not hasattr(config, "workerinput") and getattr(config.option, "numprocesses", None):
        subprocess.run([sys.executable, str(Path(__file__).with_name("compile_kernels.py"))], check=False)


@pytest.fixture(scope="session", autouse=True)
def store_of_the_session(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """For fixtures that live longer than a test."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(VARIABLE, str(tmp_path_factory.mktemp("store")))
        yield


@pytest.fixture(autouse=True)
def store_of_the_test(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder."""
    folder = tmp_path_factory.mktemp("store")
    monkeypatch.setenv(VARIABLE, str(folder))
    return folder


@pytest.fixture(scope="session")
def one_gmsh() -> Iterator[gmsh_process.GmshSession]:
    """A process that makes the meshes of many tests: its start takes longer than most of them."""
    with gmsh_process.GmshSession() as session:
        yield session


@pytest.fixture(autouse=True)
def meshes_by_one_process(
    request: pytest.FixtureRequest, one_gmsh: gmsh_process.GmshSession, monkeypatch: pytest.MonkeyPatch
) -> None:
    """`run_gmsh` takes that process, but in tests of what the process itself may do (marked ``own_gmsh``)."""
    if request.node.get_closest_marker("own_gmsh") is None:
        monkeypatch.setattr(gmsh_process, "GmshSession", lambda: nullcontext(one_gmsh))
