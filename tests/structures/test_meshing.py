"""gmsh in its own process: meshes of every family, STEP and .msh files, and what happens when gmsh fails."""

import os
import time
from pathlib import Path

import numpy as np
import pytest

from seatfem.structures.mesh.gmsh_process import MeshingError
from seatfem.structures.mesh.meshing import content_hash, make_mesh
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.shapes import AnnularSeat, CadPart, GeometryError

DEMO_SPEC = MeshSpec(size=1.6e-3, contact_size=0.6e-3)  # that of meshes/make_meshes.py
COARSE = MeshSpec(size=3e-3)


@pytest.fixture(scope="module")
def demo():
    return make_mesh(AnnularSeat(), DEMO_SPEC)


@pytest.mark.slow
def test_demo_mesh_is_sound(demo):
    assert demo.order == 2
    assert set(demo.mesh.boundaries) == {"contact", "fixed"}
    assert len(demo.mesh.subdomains["seat"]) == demo.mesh.nelements
    # Measured at this size: 5e-6 (fourth order); straight elements would be off by 1e-3.
    assert demo.quality.volume == pytest.approx(demo.quality.cad_volume, rel=2e-5)
    assert demo.quality.areas == pytest.approx(demo.quality.cad_areas, rel=2e-5)
    assert demo.quality.min_scaled_jacobian > 0.2


@pytest.mark.slow
def test_meshing_is_reproducible_and_hashed(demo):
    first, second = demo, make_mesh(AnnularSeat(), DEMO_SPEC)
    assert np.array_equal(first.mesh.doflocs, second.mesh.doflocs)
    assert np.array_equal(first.mesh.t, second.mesh.t)
    assert first.provenance == second.provenance
    assert first.provenance.content_hash == content_hash(AnnularSeat(), DEMO_SPEC)
    assert first.provenance.content_hash != content_hash(AnnularSeat(thickness=7e-3), DEMO_SPEC)
    assert first.provenance.content_hash != content_hash(AnnularSeat(), MeshSpec(2e-3))


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"size": 0.0}, r"MeshSpec.size = 0"),
        ({"size": 1e-3, "contact_size": 2e-3}, r"contact_size = 2 mm:.*<= size = 1 mm"),
        ({"size": 1e-3, "order": 3}, r"order = 3: must be 1 or 2"),
    ],
)
def test_bad_specs(values, message):
    with pytest.raises(GeometryError, match=message):
        MeshSpec(**values)


def test_missing_or_broken_cad_file(tmp_path):
    with pytest.raises(FileNotFoundError, match=r"none.step: no such CAD file"):
        make_mesh(CadPart(tmp_path / "none.step"), COARSE)
    broken = tmp_path / "broken.step"
    broken.write_text("ISO-10303-21;\nnothing\n")
    with pytest.raises(GeometryError, match=r"broken\.step: is cut off"):
        make_mesh(CadPart(broken), COARSE)


FAKE_GMSH = """
import os, signal, time
def initialize(*args, **options): {act}
class option:
    setNumber = staticmethod(lambda name, value: None)
"""


def use_fake_gmsh(monkeypatch, folder: Path, source: str) -> None:
    (folder / "gmsh.py").write_text(source)
    monkeypatch.setenv("PYTHONPATH", str(folder))


@pytest.mark.slow
@pytest.mark.own_gmsh
def test_missing_system_library_names_the_mend(monkeypatch, tmp_path):
    use_fake_gmsh(monkeypatch, tmp_path, "raise OSError('libGLU.so.1: cannot open shared object file')")
    with pytest.raises(MeshingError, match=r"libGLU.so.1.*apt-get.*--no-install-recommends libglu1-mesa"):
        make_mesh(AnnularSeat(), COARSE)


@pytest.mark.slow
@pytest.mark.own_gmsh
def test_crash_is_an_error(monkeypatch, tmp_path):
    use_fake_gmsh(monkeypatch, tmp_path, FAKE_GMSH.format(act="os.kill(os.getpid(), signal.SIGSEGV)"))
    with pytest.raises(MeshingError, match=r"\(SIGSEGV\).*element size"):
        make_mesh(AnnularSeat(), COARSE)


@pytest.mark.slow
@pytest.mark.own_gmsh
def test_interrupt_kills_gmsh(monkeypatch, tmp_path):
    pid_file = tmp_path / "pid"
    source = FAKE_GMSH.format(act=f"open({str(pid_file)!r}, 'w').write(str(os.getpid()))")
    source += "class _Model:\n    @property\n    def occ(self): time.sleep(60)\nmodel = _Model()\n"
    use_fake_gmsh(monkeypatch, tmp_path, source)

    start = time.monotonic()

    def interrupt(stage: str, done: float) -> None:
        while not pid_file.exists() and time.monotonic() - start < 20:  # a busy machine starts it late
            time.sleep(0.01)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        make_mesh(AnnularSeat(), COARSE, interrupt)
    assert time.monotonic() - start < 30
    with pytest.raises(ProcessLookupError):
        os.kill(int(pid_file.read_text()), 0)
