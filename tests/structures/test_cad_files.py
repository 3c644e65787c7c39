"""CAD files: which of several solids count, and texts made to cost time or to bring other files in."""

import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from seatfem.faces.cli import BAD_INPUT, run_command
from seatfem.structures.shapes import CadPart, GeometryError, NumberedFace, PlaneFace
from seatfem.structures.shapes.cad import check_readable, state_directly, stated_unit, step_face_names
from tests.bounded import bounded
from tests.solids import MeshSpec, inspect_geometry, make_mesh

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


SCENE = """
seat = {{ kind = "cad", file = "{}", contact = {{ number = 18 }}, fixed = {{ number = {} }}, material = "steel", \
    damping_ratio = 0.02{} }}
reed = {{ kind = "rigid_mass", mass = "2 g", velocity = "-1 m/s" }}
run = {{ duration = "60 us", filter_width = "8 us" }}
"""


@pytest.mark.parametrize(("fixed", "more", "key"), [(12, "", "seat.fixed"), (5, ", solid = 0", "seat.solid")])
def test_a_plan_names_the_key(
    path: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str], fixed: int, more: str, key: str
) -> None:
    (tmp_path / "scene.toml").write_text(SCENE.format(path, fixed, more))
    assert run_command(["plan", str(tmp_path / "scene.toml")]) == BAD_INPUT
    assert f"{key}: " in capfd.readouterr().err


MESHES = Path(__file__).parents[2] / "meshes"
HEAD, TAIL = "ISO-10303-21;\nHEADER;ENDSEC;DATA;\n", "\nENDSEC;\nEND-ISO-10303-21;"
SLOW = 3.0  # s for a text of a few hundred thousand bytes, where each is looked at a few times; squares take minutes


@pytest.mark.parametrize(
    "body",
    [
        "#1=CARTESIAN_POINT('',(" * 20_000,
        "#1=(GLOBAL_UNIT_ASSIGNED_CONTEXT((#1,#1,#2)));#2=(CONVERSION_BASED_UNIT('',#3));" * 5_000,
        "CONVERSION_BASED_UNIT(" + " " * 400_000,
        "'" * 400_001,
        "/*" * 200_000,
    ],
)
def test_a_step_text_is_read_in_one_pass(tmp_path, body):
    path = tmp_path / "a.step"
    path.write_text(HEAD + body + TAIL)
    with bounded(SLOW):
        check_readable(path)
        assert step_face_names(path) == []
        assert stated_unit(path) == 0
        state_directly(path)


def test_a_part_that_points_to_other_files(tmp_path):
    sound = (MESHES / "block.step").read_text()
    path = tmp_path / "a.step"
    path.write_text(sound.replace("DATA;", "DATA;\n#99999 = DOCUMENT_FILE('/etc/other.step','',$,#1,'',$);", 1))
    with pytest.raises(GeometryError, match="#99999 points"):
        check_readable(path)


def test_semicolons_and_comments_where_they_mean_nothing(tmp_path):
    sound = (MESHES / "block.step").read_text()
    path = tmp_path / "a.step"
    strange = "DATA;\n/* don't; #1=(LENGTH_UNIT()SI_UNIT(.KILO.,.METRE.)); */ #99999 = DOCUMENT('a;b','it''s','/*',#1);"
    path.write_text(sound.replace("DATA;", strange, 1))
    assert stated_unit(path) == stated_unit(MESHES / "block.step") == 1e-3
    assert step_face_names(path) == step_face_names(MESHES / "block.step")


def test_a_file_larger_than_is_read(tmp_path, monkeypatch):
    monkeypatch.setattr("seatfem.structures.shapes.cad.LIMIT", 1 << 20)
    path = tmp_path / "a.step"
    with path.open("wb") as file:
        file.truncate(3 << 20)
    with pytest.raises(GeometryError, match=r"a\.step:.*3 MB.*file.*1 MB"):
        check_readable(path)
