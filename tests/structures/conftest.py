"""What the tests of meshes share: files that gmsh wrote, and a process that reads them."""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from seatfem.jobs.processes import end_worker, start_worker
from seatfem.structures.formats import mesh_files


@pytest.fixture(scope="session")
def written_meshes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Give a folder with what `write_mesh_files` writes, gmsh in a process of its own."""
    folder = tmp_path_factory.mktemp("files")
    script = Path(__file__).with_name("write_mesh_files.py")
    subprocess.run([sys.executable, str(script), str(folder)], check=True, capture_output=True)
    return folder


@pytest.fixture(scope="session")
def one_meshio(tmp_path_factory: pytest.TempPathFactory) -> Iterator[subprocess.Popen[str]]:
    """Start a process that reads many files: its start takes longer than most of them."""
    log = tmp_path_factory.mktemp("meshio") / "log.txt"
    worker = start_worker("seatfem.structures.formats._meshio_worker", log=log)
    yield worker
    end_worker(worker)


@pytest.fixture
def read_by_one_process(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let one process read all files of tests about what a file says, not about what its reader may take."""
    worker = request.getfixturevalue("one_meshio")
    monkeypatch.setattr(mesh_files, "start_worker", lambda *given, **named: worker)
    monkeypatch.setattr(mesh_files, "end_worker", lambda worker: None)
