"""A user waits for what is imported: each errand loads what it needs, in a process of its own."""

from __future__ import annotations

import json
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

EXAMPLE = Path(__file__).parents[2] / "examples" / "flapper_on_spring.toml"
SCENE = Path(__file__).with_name("mass_on_spring.toml").read_text(encoding="utf-8")
PROGRAM = """
import contextlib, io, json, sys
from seatfem.faces import cli
words = io.StringIO()
with contextlib.redirect_stdout(words), contextlib.redirect_stderr(words):
    code = cli.run_command(sys.argv[1:])
from impact.names import LateModule
print(json.dumps([code, sorted(name for name, module in sys.modules.items() if type(module) is not LateModule)]))
"""
DRAWN = {"gmsh", "pyvista", "vtkmodules", "matplotlib", "plotly", "PIL", "meshio", "pandas", "dask", "pint"}
SOLID = {"skfem", "scipy.spatial", "scipy.sparse", "scipy.linalg", "scipy.optimize", "scipy.special", "pymetis"}
COMPILED = {"numba", "llvmlite"}
NOT_NAMED = {
    f"seatfem.structures.kinds.{name}"
    for name in ("blocks", "drawn", "measured", "plate_loads", "reeds", "stored", "turned")
}
LIFE = {"impact.life.damage", "impact.life.multiaxial", "rainflow", "seatfem.life.lives"}
NUMBERS = {"numpy", "scipy", "h5py", "pydantic"}
ERRANDS = [
    (["--help"], 0, DRAWN | SOLID | COMPILED | NUMBERS | LIFE),
    (["run", "wrong.toml"], 2, DRAWN | SOLID | COMPILED | NOT_NAMED | LIFE | {"h5py", "pypardiso"}),
    (["run", "spring.toml", "--output", "out", "--no-pictures"], 0,
     DRAWN | SOLID | NOT_NAMED | LIFE | {"pypardiso", "numba.np.linalg"}),
    (["plan", str(EXAMPLE)], 0,
     DRAWN | {"skfem", "scipy.sparse", "scipy.special", "scipy.signal", "scipy.optimize", "pymetis", "pypardiso"}),
]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    ("errand", "code", "not_needed"), ERRANDS, ids=["help", "wrong key", "mass on a spring", "closed form"]
)
def test_an_errand_loads_no_more_than_it_needs(
    tmp_path: Path, errand: list[str], code: int, not_needed: set[str]
) -> None:
    assert all(find_spec(name) for name in not_needed if name.startswith(("impact", "seatfem"))), "a module was renamed"
    (tmp_path / "wrong.toml").write_text(SCENE.replace("stiffness", "stifness"), encoding="utf-8")
    (tmp_path / "spring.toml").write_text(SCENE, encoding="utf-8")
    root = str(Path(__file__).parents[2])
    program = f"import sys; sys.path.insert(0, {root!r})\n{PROGRAM}"
    command = [sys.executable, "-c", program, *errand]
    for _ in range(2):  # the first one may compile
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    ended, modules = json.loads(done.stdout)
    assert ended == code
    assert not_needed & set(modules) == set()
