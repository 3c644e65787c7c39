"""CAD files of several solids: which of them count; a look and a mesh see, and refuse, the same."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from seatfem.faces.cli import BAD_INPUT, run_command
from seatfem.structures.inspection.cad import inspect_geometry
from seatfem.structures.mesh.meshing import make_mesh
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.shapes import CadPart, GeometryError, NumberedFace, PlaneFace

DRAW = """
import gmsh, sys
gmsh.initialize([], readConfigFiles=False)
gmsh.option.setNumber("General.Terminal", 0)
for box in ((0, 0, 0, 10, 8, 4), (30, 0, 0, 6, 6, 6), (0, 0, 4, 10, 8, 2)):
    gmsh.model.occ.addBox(*box)
gmsh.model.occ.synchronize()
gmsh.write(sys.argv[1])
"""
VOLUMES = {1: 320e-9, 2: 216e-9, 3: 160e-9}  # m^3; the third box stands on the first, the second is apart
TOP, BOTTOM, APART, INSIDE = (NumberedFace((number,)) for number in (18, 5, 12, 6))
UP, DOWN = (0.0, 0.0, 1.0), (0.0, 0.0, -1.0)


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    file = tmp_path_factory.mktemp("solids") / "three.step"
    subprocess.run([sys.executable, "-c", DRAW, str(file)], check=True, stdout=subprocess.DEVNULL, timeout=100)
    return file


@pytest.mark.parametrize(
    ("keys", "solids"),
    [
        ({"contact": TOP, "fixed": BOTTOM}, (1, 3)),
        ({"contact": APART, "fixed": PlaneFace(DOWN, 0.0)}, (2,)),
        ({"contact": INSIDE, "fixed": BOTTOM, "solid": 1}, (1,)),
        ({"contact": PlaneFace(UP, 6e-3), "fixed": PlaneFace(DOWN, 0.0), "solid": 2}, (2,)),
    ],
)
def test_the_solids_that_count(path: Path, keys: dict[str, Any], solids: tuple[int, ...]) -> None:
    """A look and a mesh have the solid that is stated, or those that hang together with the struck face, alone."""
    part = CadPart(path, **keys)
    inspected = inspect_geometry(part)
    assert [(each.number, each.region) for each in inspected.solids] == [(n, f"solid_{n}") for n in solids]
    assert inspected.in_file == len(VOLUMES)
    assert {number for face in inspected.faces for number in face.solids} == set(solids)
    volume = sum(VOLUMES[number] for number in solids)
    seat = make_mesh(part, MeshSpec(4e-3))
    assert (inspected.shape.volume, seat.quality.volume) == pytest.approx((volume, volume), rel=1e-9)
    assert {name for name in seat.mesh.subdomains or {} if name != "seat"} == {f"solid_{n}" for n in solids}


@pytest.mark.parametrize(
    ("keys", "field", "message"),
    [
        ({"contact": PlaneFace(UP, 6e-3), "fixed": BOTTOM}, "solid", r"solids 2, 3, .*solid = 2:\n  solid 1: name '"),
        ({"contact": TOP, "fixed": APART}, "fixed", r"no face for 'fixed' \(number 12\).*"),
        ({"contact": TOP, "fixed": BOTTOM, "solid": 4}, "solid", r"solid = 4: no solid.*choose one"),
        ({"contact": TOP, "fixed": BOTTOM, "solid": "x"}, "solid", r"solid = 'x': no solid.*choose one"),
        ({"contact": TOP, "fixed": BOTTOM, "solid": 2}, "contact", r"no face for 'contact' \(number 18\)"),
    ],
)
def test_what_is_refused(path: Path, keys: dict[str, Any], field: str, message: str) -> None:
    """A look refuses what a mesh refuses, in the same words, and names the key."""
    part = CadPart(path, **keys)
    problems = dict(inspect_geometry(part).problems)
    with pytest.raises(GeometryError, match=message) as caught:
        make_mesh(part, MeshSpec(4e-3))
    assert problems[field] == str(caught.value)


def test_a_solid_is_chosen_by_its_name(path: Path) -> None:
    name = inspect_geometry(CadPart(path, contact=TOP, fixed=BOTTOM)).solids[1].name
    solids = inspect_geometry(CadPart(path, contact=TOP, fixed=INSIDE, solid=name)).solids
    assert [(each.number, each.name) for each in solids] == [(3, name)]


SCENE = """\
[seat]
kind = "cad"
file = "{}"
contact = {{ number = 18 }}
fixed = {{ number = {} }}
material = "steel"
damping_ratio = 0.02
{}
[reed]
kind = "rigid_mass"
mass = "2 g"
velocity = "-1 m/s"
[run]
duration = "60 us"
filter_width = "8 us"
"""


@pytest.mark.parametrize(("fixed", "more", "key"), [(12, "", "seat.fixed"), (5, "solid = 0", "seat.solid")])
def test_a_plan_names_the_key(
    path: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str], fixed: int, more: str, key: str
) -> None:
    (tmp_path / "scene.toml").write_text(SCENE.format(path, fixed, more))
    assert run_command(["plan", str(tmp_path / "scene.toml")]) == BAD_INPUT
    assert f"{key}: " in capfd.readouterr().err
