"""gmsh takes what it does not know for a script: no file of a user's may get that far."""

import shutil
from pathlib import Path

import pytest

from seatfem.structures.errors import MeshError
from seatfem.structures.formats.mesh_files import read_mesh
from seatfem.structures.mesh.meshing import make_mesh
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.shapes import CadPart, GeometryError

pytestmark = pytest.mark.own_gmsh

MESHES = Path(__file__).parents[2] / "meshes"
SOUND = MESHES / "annular_seat.msh"
HEAD = b"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n"


@pytest.fixture
def spell(tmp_path):
    """Return a script that leaves a mark, and where."""
    mark = tmp_path / "mark"
    return f'SystemCall "touch {mark}";\nPrintf("") > "{mark}";\n'.encode(), mark


@pytest.mark.slow
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


@pytest.mark.slow
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


@pytest.mark.slow
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


@pytest.mark.parametrize("suffix", [".step", ".brep"])
def test_a_part_that_is_a_script(tmp_path, spell, suffix):
    text, mark = spell
    path = tmp_path / f"a{suffix}"
    path.write_bytes(text)
    with pytest.raises(GeometryError, match=r"is no (STEP|BREP) file"):
        make_mesh(CadPart(path, unit=1e-3), MeshSpec(1e-3))
    assert not mark.exists()
