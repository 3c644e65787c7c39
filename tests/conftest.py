"""Every test has a store of its own: what one test computed is not another's answer."""

import math
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import nullcontext
from pathlib import Path

import pytest

from seatfem.faces import cli
from seatfem.structures.cache import VARIABLE
from seatfem.structures.mesh import gmsh_process
from tests import refusals
from tests.gallery import Gallery

pytest.raises, cli.placed = refusals.raises, refusals.placed

BEGUN = time.monotonic()
MOST_MESHES = 200  # kept in memory, of some hundred kB each

# A shell's background job ignores Ctrl-C, and so would the programs under test.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Take the mark off parameters of a slow test: off those whose id begins with ``slow(but="...")``, or with none of
    ``slow(only=("...", ...))``."""
    for item in items:
        mark, parameters = item.get_closest_marker("slow"), item.name.partition("[")[2]
        if mark is not None and (
            ("but" in mark.kwargs and parameters.startswith(mark.kwargs["but"]))
            or ("only" in mark.kwargs and not parameters.startswith(mark.kwargs["only"]))
        ):
            item.own_markers = [each for each in item.own_markers if each.name != "slow"]


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--within", type=float, default=math.inf, help="minutes after which no further test begins")


def pytest_runtest_setup(item: pytest.Item) -> None:
    """Skip tests that would begin after the time of ``--within``: an integration server has a limit."""
    if time.monotonic() - BEGUN > 60 * item.config.getoption("--within"):
        pytest.skip("the minutes of --within are over")


def pytest_configure(config: pytest.Config) -> None:
    """Let one process compile what each worker would, before several workers start."""
    if not hasattr(config, "workerinput") and getattr(config.option, "numprocesses", None):
        subprocess.run([sys.executable, str(Path(__file__).with_name("compile_kernels.py"))], check=False)


@pytest.fixture(scope="session", autouse=True)
def store_of_the_session(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Give fixtures that live longer than a test a store of the session's own."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(VARIABLE, str(tmp_path_factory.mktemp("store")))
        yield


@pytest.fixture(scope="session")
def shared_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of this run of pytest, which all workers share."""
    base = tmp_path_factory.getbasetemp()
    return base.parent if base.name.startswith("popen-") else base


@pytest.fixture(scope="session")
def plates_of_the_session(shared_folder: Path) -> Path:
    """Share the folder of the modes of plates, which are found by all that they depend on, among workers."""
    folder = shared_folder / "plates"
    folder.mkdir(exist_ok=True)
    return folder


@pytest.fixture(scope="session")
def gallery(shared_folder: Path) -> Gallery:
    """Give runs of scene files, made once for all workers."""
    return Gallery(shared_folder / "gallery")


@pytest.fixture(autouse=True)
def store_of_the_test(
    tmp_path_factory: pytest.TempPathFactory, plates_of_the_session: Path, monkeypatch: pytest.MonkeyPatch
) -> Path:
    """Give a folder that is empty but for the plates of other tests."""
    folder = tmp_path_factory.mktemp("store")
    if sys.platform != "win32":
        (folder / "plates").symlink_to(plates_of_the_session)
    monkeypatch.setenv(VARIABLE, str(folder))
    return folder


@pytest.fixture(scope="session")
def one_gmsh() -> Iterator[gmsh_process.GmshSession]:
    """Start a process that makes the meshes of many tests: its start takes longer than most of them."""
    with gmsh_process.GmshSession(MOST_MESHES) as session:
        yield session


@pytest.fixture(autouse=True)
def meshes_by_one_process(
    request: pytest.FixtureRequest, one_gmsh: gmsh_process.GmshSession, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Let all meshing use that process, but in tests of what the process itself may do (marked ``own_gmsh``)."""
    if request.node.get_closest_marker("own_gmsh") is None:
        monkeypatch.setattr(gmsh_process, "GmshSession", lambda meshes=0: nullcontext(one_gmsh))
