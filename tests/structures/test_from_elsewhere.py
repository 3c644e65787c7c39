"""Shapes, kinds and reductions of one's own: other processes find them, and the cache notices when they change."""

import importlib.util
import os
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest

from seatfem.structures.shapes import GeometryError, decode, encode, fingerprint
from tests.steps import Method, key_of

ROOT = Path(__file__).parents[2]
SHAPE = """
from dataclasses import dataclass
from typing import ClassVar, Literal

from seatfem.fields import Length
from seatfem.structures.kinds.turned import Turned
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.mesh.meshing import make_mesh
from seatfem.structures.reduction.modal import Modal
from seatfem.structures.shapes import Turning
from seatfem.structures.shapes.profile import Profile, polygon
from seatfem.structures.shapes.selectors import PlaneFace
{more}

@dataclass(frozen=True)
class Puck(Turning):
    family: ClassVar[str] = "puck"
    radius: float

    @property
    def patches(self):
        return {{"contact": (PlaneFace((0.0, 0.0, 1.0), HEIGHT),), "fixed": (PlaneFace((0.0, 0.0, -1.0), 0.0),)}}

    @property
    def profile(self):
        corners = [(0.0, 0.0), (self.radius, 0.0), (self.radius, HEIGHT), (0.0, HEIGHT)]
        return Profile(polygon(corners, ["fixed", "", "contact", "axis"]))
"""
RUNS = "print(make_mesh(Puck(5e-3), MeshSpec(size=2e-3)).mesh.nelements)\n"
KIND = """

class Disc(Turned):
    kind: Literal["puck"]
    radius: Length

    def geometry(self):
        return Puck(self.radius)

    def struck_part(self):
        return self.struck_area, self.radius, HEIGHT
"""
REDUCER = """

class Mine(Modal):
    name = "mine"
"""


def run(folder: Path, code: str) -> subprocess.CompletedProcess[str]:
    """Run a script from a folder where another module has its name."""
    script, elsewhere = folder / "mine.py", folder / "elsewhere"
    script.write_text(code)
    elsewhere.mkdir()
    (elsewhere / "mine.py").write_text("raise SystemExit(9)")
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), str(elsewhere)])}
    command = [sys.executable, str(script)]
    return subprocess.run(
        command, cwd=folder, capture_output=True, text=True, env=environment, check=False, timeout=120
    )


@pytest.mark.slow
def test_a_shape_of_the_script_that_runs_is_meshed(tmp_path: Path) -> None:
    """A script's shape is meshed, and its import from beside it works."""
    (tmp_path / "beside.py").write_text("HEIGHT = 3e-3\n")
    done = run(tmp_path, SHAPE.format(more="from beside import HEIGHT") + f'if __name__ == "__main__":\n    {RUNS}')
    assert done.stderr == ""
    assert int(done.stdout) > 50


@pytest.mark.slow
def test_a_script_that_would_start_itself_again_and_again_is_told(tmp_path: Path) -> None:
    done = run(tmp_path, SHAPE.format(more="HEIGHT = 3e-3") + RUNS)
    assert "mine.py is read for its shape Puck" in done.stderr
    assert 'if __name__ == "__main__":' in done.stderr


def module(folder: Path, code: str, name: str) -> ModuleType:
    path = folder / "shapes_of_mine.py"
    path.write_text(code)
    spec = importlib.util.spec_from_file_location(name, path)
    sys.modules[name] = loaded = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(loaded)
    return loaded


def test_a_shape_comes_from_its_file_whatever_else_has_its_name(tmp_path: Path) -> None:
    pucks = module(tmp_path, SHAPE.format(more="HEIGHT = 3e-3"), "colorsys")  # as one of the standard library
    try:
        again = decode(encode(pucks.Puck(5e-3)))
    finally:
        del sys.modules["colorsys"]
    assert type(again).__module__.startswith("seatfem_shapes_of_")
    assert again.radius == 5e-3


def test_a_shape_in_no_file_is_refused(tmp_path: Path) -> None:
    pucks = module(tmp_path, SHAPE.format(more="HEIGHT = 3e-3"), "pucks_lost")
    del sys.modules["pucks_lost"]
    with pytest.raises(GeometryError, match="'Puck' is in no file"):
        encode(pucks.Puck(5e-3))


def test_keys_follow_the_code_from_elsewhere(tmp_path: Path) -> None:
    """A change of the file of a shape, kind or reduction changes the key of what is computed by it."""
    keys, hashes = [], []
    for i, height in enumerate((3e-3, 4e-3)):
        pucks = module(tmp_path, SHAPE.format(more=f"HEIGHT = {height}") + KIND + REDUCER, f"pucks_{i}")
        try:
            disc = pucks.Disc(kind="puck", radius="5 mm", material="steel")
            keys += [key_of(disc, Method("axisymmetric", 1e5, reduction=name)) for name in ("krylov", "mine")]
            hashes.append(fingerprint(disc.geometry()))
            other = pucks.Disc.__mro__[1]
            assert other.__module__ == "seatfem.structures.kinds.turned"
        finally:
            del pucks.Mine.name, pucks.Disc.model_fields["kind"], pucks.Puck.family, sys.modules[f"pucks_{i}"]
    assert len(set(keys)) == 4
    assert hashes[0] != hashes[1]
