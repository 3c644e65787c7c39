"""Several meshes by one gmsh process."""

import shutil
import signal
import subprocess
from pathlib import Path

import numpy as np
import pytest

from seatfem.structures.mesh import gmsh_process
from seatfem.structures.mesh.gmsh_process import gmsh_session
from seatfem.structures.mesh.meshing import SeatMesh, make_mesh
from seatfem.structures.mesh.plane_meshes import MeridianMesh, make_meridian
from tests.solids import AnnularSeat, CadPart, MeshError, MeshSpec, Stopper, read_mesh

pytestmark = [pytest.mark.own_gmsh, pytest.mark.slow]

COARSE = MeshSpec(size=2.5e-3)


def started(monkeypatch) -> list[subprocess.Popen[str]]:
    """Return the gmsh processes that are started from here on."""
    processes: list[subprocess.Popen[str]] = []

    class Watched(subprocess.Popen):
        def __init__(self, *args, **options):
            super().__init__(*args, **options)
            processes.append(self)

    monkeypatch.setattr(subprocess, "Popen", Watched)
    return processes


def assert_same(mesh: SeatMesh | MeridianMesh, expected: SeatMesh | MeridianMesh) -> None:
    """Assert equal elements and groups, and nodes that agree within the tolerance below.

    Optimisers move nodes by iterations whose round-off grows (2e-13 of a coordinate was seen); gmsh itself merges
    points that are nearer than 1e-8 of the model's size, so a hundredth of that is the same node.
    """
    np.testing.assert_array_equal(mesh.mesh.t, expected.mesh.t)
    size = np.ptp(expected.mesh.doflocs, axis=1).max()
    np.testing.assert_allclose(mesh.mesh.doflocs, expected.mesh.doflocs, rtol=0, atol=1e-10 * size)
    assert set(mesh.mesh.boundaries) == set(expected.mesh.boundaries)
    for name, faces in expected.mesh.boundaries.items():
        np.testing.assert_array_equal(np.sort(mesh.mesh.boundaries[name]), np.sort(faces))


@pytest.mark.parametrize(
    ("make", "geometry"), [(make_mesh, Stopper()), (make_meridian, AnnularSeat())], ids=["tetrahedra", "triangles"]
)
def test_a_session_makes_the_meshes_of_single_processes(monkeypatch, make, geometry) -> None:
    """One process meshes fine, coarse and fine again like single ones: no mesh changes the next."""
    size = 2.5e-3 if make is make_mesh else 0.8e-3
    fine = MeshSpec(size=size, contact_size=size / 2)
    coarse = MeshSpec(size=1.6 * size, contact_size=0.8 * size)
    single = {spec: make(geometry, spec) for spec in (fine, coarse)}
    assert single[fine].quality.elements > 1.2 * single[coarse].quality.elements
    processes = started(monkeypatch)
    with gmsh_session():
        for spec in (fine, coarse, fine):
            assert_same(make(geometry, spec), single[spec])
    assert len(processes) == 1
    assert processes[0].returncode is not None


def test_a_silent_step_of_gmsh_can_be_stopped(monkeypatch: pytest.MonkeyPatch) -> None:
    """Progress is reported again and again while gmsh is within one step; whoever listens ends the job and its
    process, and the session goes on."""
    monkeypatch.setattr(gmsh_process, "EVERY", 1e-3)
    processes, reports = started(monkeypatch), list[float]()

    def listen(_: str, done: float) -> None:
        reports.append(done)
        if reports.count(done) > 20:
            raise KeyboardInterrupt

    with gmsh_session():
        with pytest.raises(KeyboardInterrupt):
            make_mesh(Stopper(), MeshSpec(size=5e-4), progress=listen)
        assert [process.poll() for process in processes] == [-signal.SIGKILL]
        assert make_mesh(Stopper(), COARSE).mesh.t.shape[1] > 0


MESHES = Path(__file__).parents[2] / "meshes"
SOUND = MESHES / "annular_seat.msh"
HEAD = b"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"


@pytest.fixture
def spell(tmp_path):
    """Return a script that leaves a mark, and where."""
    mark = tmp_path / "mark"
    return f'SystemCall "touch {mark}";\nPrintf("") > "{mark}";\n'.encode(), mark


@pytest.mark.parametrize(
    ("name", "before"),
    [
        ("a.msh", b""),
        ("a.msh", b"// $MeshFormat\n"),
        ("a.msh", b"$MeshFormat\n1 0 8\n"),
        ("a.msh", b"$NOD\n"),
        ("a.med", b""),
    ],
)
def test_a_mesh_that_is_a_script_is_refused_before_gmsh(tmp_path, spell, name, before):
    text, mark = spell
    path = tmp_path / name
    path.write_bytes(before + text)
    with pytest.raises(MeshError, match=r"\.m\w\w file; .*b'.*Export"):
        read_mesh(path)
    assert not mark.exists()


def test_a_script_behind_a_sound_head_or_mesh_is_not_run(tmp_path, spell):
    text, mark = spell
    path = tmp_path / "a.msh"
    for between in (b"", b"$Comments\n"):
        path.write_bytes(HEAD + between + text)
        with pytest.raises(MeshError, match=r"a\.msh: "):
            read_mesh(path)
    path.write_bytes(SOUND.read_bytes() + text)
    assert read_mesh(path).quality.elements > 0
    assert not mark.exists()


def test_what_lies_beside_a_mesh_or_in_the_home_folder_is_not_run(tmp_path, spell, monkeypatch):
    text, mark = spell
    mesh = tmp_path / "good.msh"
    shutil.copy(SOUND, mesh)
    part = tmp_path / "part.step"
    shutil.copy(MESHES / "stopper.step", part)
    for name in ("good.msh.opt", "good.opt", "good.geo", "part.step.opt", ".gmshrc", ".gmsh-options", "default.geo"):
        (tmp_path / name).write_bytes(text)
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    assert read_mesh(mesh).quality.elements > 0
    assert make_mesh(CadPart(part, fixed=()), MeshSpec(3e-3)).quality.elements > 0
    assert not mark.exists()
