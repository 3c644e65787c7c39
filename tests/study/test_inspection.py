"""Files that scenes name, opened before anything is computed; their faces, regions and supports; scenes that travel."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest

from seatfem.jobs.crew import FILES
from seatfem.structures.finite_elements import draw, matrices
from seatfem.structures.formats.writing import write_mesh
from seatfem.structures.kinds import Plate
from seatfem.structures.shapes import Bar, CadPart, CylinderFace, GeometryError, NumberedFace, Region
from seatfem.study.scene.files import describe_content, packed
from tests.gallery import load_text, write_scene
from tests.solids import MeshSpec, inspect_geometry, make_mesh, read_mesh, solve_modes
from tests.steps import BAD_INPUT, DONE, Method, Scene, SceneError, check_files, key_of, load_scene, run_command

ROOT = Path(__file__).parents[2]
MESHES = ROOT / "meshes"
REST = '[reed]\nkind = "rigid_mass"\nmass = "5 g"\nvelocity = "-2 m/s"\n[run]\nduration = "0.1 ms"\n'
CAD = '[seat]\nkind = "cad"\nfile = "{}"\nmaterial = "steel"\n'
MESH = f'[seat]\nkind = "mesh"\nfile = "{MESHES / "annular_seat.msh"}"\nmaterial = "steel"\n'
COARSE = MeshSpec(8e-3, order=1, curved=False)


def plan_messages(folder: Path, seat: str, capsys: pytest.CaptureFixture[str], verb: str = "plan") -> list[str]:
    out = ["-o", str(folder / "out")] if verb == "run" else []
    assert run_command([verb, str(write_scene(folder, seat, REST)), *out]) == BAD_INPUT
    assert not (folder / "out").exists()
    text = capsys.readouterr().err.removeprefix("seatfem: ").replace(f"{folder}/", "")
    return [line for line in text.splitlines() if line.startswith("scene.toml")]


@pytest.mark.parametrize("verb", ["plan", "run"])
def test_every_wrong_selector_is_told_at_its_line(verb, tmp_path, capsys):
    seat = (
        CAD.format(MESHES / "valve_plate.step")
        + 'contact = { number = 77 }\nfixed = { normal = [0, 0, 1], offset = "77 mm" }\n'
        + 'groups.bores = { radius = "3 mm" }\nregions.ring = { order = 3 }\nmaterials.core = "titanium"\n'
        + 'supports = [{ kind = "bolted", on = "rimm", normal = "5 GPa/mm" }]\n'
    )
    lines = plan_messages(tmp_path, seat, capsys, verb)
    assert [line.split(":")[1:3] for line in lines] == [
        ["5", " seat.contact"], ["6", " seat.fixed"], ["7", " seat.groups.bores"], ["8", " seat.regions.ring"],
        ["9", " seat.materials.core"], ["10", " seat.supports.0.on"],
    ]  # fmt: skip
    assert "number 77" in lines[0]
    assert "6 separate faces match" in lines[2]
    assert "seatfem faces valve_plate.step" in lines[0]


@pytest.mark.slow
def test_wrong_groups_of_a_mesh_are_told_together(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lines = plan_messages(tmp_path, MESH + 'contact = "contac"\nfixed = "clamp"\n', capsys)
    assert [line.split(":")[1:3] for line in lines] == [["5", " seat.contact"], ["6", " seat.fixed"]]
    lines = plan_messages(tmp_path, MESH + 'supports = [{ kind = "sliding", on = "x" }]\n', capsys)
    assert re.match("scene.toml:5: seat.supports.0.on: .*'x'; .*'contact'", lines[0])


@pytest.mark.parametrize(
    ("seat", "place", "words"),
    [
        ('kind = "frf"\nfile = "seat.csv"', "3: seat.file", "Hz"),
        ('kind = "greens"\nfile = "seat.csv"', "3: seat.file", "seat.csv"),
        ('kind = "modes"\nfile = "seat.csv"\nnode = 1\ndirection = "+z"', "3: seat.file", "seat.csv"),
        ('kind = "matrices"\nstiffness = "seat.csv"\nmass = "seat.csv"\ncontact = "seat.csv"', "4: seat.mass",
         "cannot be read"),
        (f'kind = "cad"\nmaterial = "steel"\nfile = "{MESHES / "README.md"}"', "", "unknown CAD format"),
    ],
)  # fmt: skip
def test_wrong_headers_are_told_by_a_plan(seat, place, words, tmp_path, capsys):
    (tmp_path / "seat.csv").write_text("a,b\n1,2\n", encoding="utf-8")
    lines = plan_messages(tmp_path, f"[seat]\n{seat}\n", capsys)
    assert place in lines[0]
    assert words in lines[0]


def test_supports_of_drawn_seats_are_looked_up_without_a_file(tmp_path: Path) -> None:
    seat = '[seat]\nkind = "annular"\nbore_radius = "4 mm"\nlip_width = "1 mm"\nmaterial = "steel"\n'
    scene = load_text(tmp_path, seat, 'supports = [{ kind = "sliding", on = "top" }]\n', REST)
    with pytest.raises(SceneError, match=r"'top'.*'contact', 'fixed'"):
        check_files(scene)


def test_numbers_are_those_of_the_file_and_stay_through_fragmenting() -> None:
    """The ring's top is face 8 of the file; the common faces of two solids have two numbers each."""
    part = CadPart(MESHES / "insert_seat.step", contact=NumberedFace((8,)), fixed=NumberedFace((3,)))
    inspected = inspect_geometry(part)
    assert inspected.problems == ()
    assert [face.numbers for face in inspected.faces if "contact" in face.groups] == [(8,)]
    assert sorted(face.numbers for face in inspected.faces if len(face.numbers) == 2) == [(4, 7), (6, 9)]
    mesh = make_mesh(part, COARSE)
    assert mesh.quality.cad_areas["contact"] == pytest.approx(np.pi * (8e-3**2 - 4e-3**2), rel=1e-9)
    assert mesh.quality.cad_areas["fixed"] == pytest.approx(np.pi * (12e-3**2 - 4e-3**2), rel=1e-9)


@pytest.mark.slow
def test_a_cylinder_is_selected_by_its_radius_alone() -> None:
    """A radius selects bolt holes off the axis, and ports that the file calls extrusions."""
    body = CadPart(MESHES / "valve_body.step", fixed=CylinderFace(2.25e-3, several=True))
    shape = inspect_geometry(body).shape
    holes = [face for face in inspect_geometry(body).faces if "fixed" in face.groups]
    assert len(holes) == 4
    assert sum(face.area for face in holes) == pytest.approx(4 * 2 * np.pi * 2.25e-3 * 8e-3, rel=1e-9)
    assert set(shape.groups) == {"contact", "fixed"}
    plate = CadPart(MESHES / "valve_plate.step", fixed=CylinderFace(3e-3, several=True))
    assert sum("fixed" in face.groups for face in inspect_geometry(plate).faces) == 6
    one = CadPart(MESHES / "valve_body.step", fixed=CylinderFace(2.25e-3))
    assert "4 separate faces" in inspect_geometry(one).problems[0][1]


def test_of_several_cylinders_that_about_the_z_axis_is_meant(tmp_path: Path) -> None:
    """A radius without an axis means the cylinder about the z axis."""
    scene = cad(tmp_path, 'fixed = { radius = "4 mm" }')
    (bore,) = (face for face in inspect_geometry(scene.seat.geometry()).faces if "fixed" in face.groups)
    assert bore.area == pytest.approx(2 * np.pi * 4e-3 * 14e-3, rel=1e-9)


@pytest.mark.slow
def test_a_cad_plate_is_measured_like_the_same_plate_drawn_here(tmp_path: Path) -> None:
    """A CAD plate's faces give lands 1 mm wide on a plate that bends inside its rim, not one as wide as the reed."""
    drawn = Plate.model_validate(
        {
            "kind": "plate", "ports": 6, "port_radius": "3 mm", "pitch": "10 mm", "margin": "5 mm", "thickness": "6 mm",
            "land_width": "1 mm", "clamp_width": "2 mm", "material": "steel", "struck": 1,
        }
    ).patch()  # fmt: skip
    patch = cad(tmp_path, "contact = { number = 11 }", "valve_plate.step").seat.patch()
    assert patch.area == pytest.approx(drawn.area, rel=0.02)
    assert patch.width == pytest.approx(drawn.width, rel=0.05)
    assert patch.depth == pytest.approx(drawn.depth, rel=1e-6)
    for key in ("bending", "bending_frequency"):  # a plate with its load off the centre is stiffer than at the centre
        assert 1 / 4 < getattr(patch, key) / getattr(drawn, key) < 4


@pytest.mark.slow
def test_faces_as_a_table_and_a_picture(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene = write_scene(tmp_path, CAD.format(MESHES / "valve_body.step"), "contact = { number = 9 }\n", REST)
    for part, said in (
        (scene, "contact"),
        (MESHES / "annular_seat.msh", "fixed"),
        (MESHES / "insert_seat.step", "4 = 7"),
    ):
        table = tmp_path / f"{part.stem}.csv"
        assert run_command(["faces", str(part), "-o", str(table)]) == DONE
        assert said in capsys.readouterr().out
        rows = table.read_text(encoding="utf-8").splitlines()
        assert rows[0].startswith("number,surface,area [mm^2],centre [mm],normal or axis,radius [mm]")
    assert run_command(["faces", str(scene), "-o", str(tmp_path / "faces.png"), "--quiet"]) == DONE
    assert (tmp_path / "faces.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_the_unit_of_a_mesh_is_asked_for(tmp_path: Path) -> None:
    areas, mesh = {}, str(MESHES / "annular_seat.msh")
    for unit in ("m", "inch"):
        table = tmp_path / f"{unit}.csv"
        assert run_command(["faces", mesh, "--unit", unit, "-o", str(table), "--quiet"]) == DONE
        areas[unit] = float(table.read_text(encoding="utf-8").splitlines()[1].split(",")[2])
    assert areas["m"] == pytest.approx(areas["inch"] / 0.0254**2, rel=1e-3)


def test_faces_of_what_has_none(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    spring = write_scene(tmp_path, '[seat]\nkind = "spring"\nstiffness = "20 N/um"\n', REST)
    assert run_command(["faces", str(spring)]) == BAD_INPUT
    assert "has no faces" in capsys.readouterr().err


def cad(folder: Path, seat: str, file: str = "valve_body.step") -> Scene:
    return load_text(folder, f"{CAD.format(MESHES / file)}{seat}\n", REST)


def areas(scene):
    return dict(make_mesh(scene.seat.geometry(), COARSE).quality.cad_areas)


def ring(outer, inner):
    return math.pi * (outer**2 - inner**2)


def test_every_selector_finds_its_faces(tmp_path):
    scene = cad(
        tmp_path,
        """
contact = { kind = "union", of = [{ kind = "plane", normal = [0, 0, 1], offset = "14 mm" },
                                  { kind = "point", point = ["7 mm", "0 mm", "14 mm"] }] }
fixed = { kind = "cylinder", radius = "20 mm" }
[seat.groups]
bolt = { kind = "cylinder", radius = "2.25 mm", axis_point = ["15 mm", "0 mm", "0 mm"] }
underside = { kind = "colour", colour = [0, 0, 255] }
""",
    )
    assert areas(scene) == pytest.approx(
        {
            "contact": ring(10e-3, 4e-3),
            "fixed": 2 * math.pi * 20e-3 * 8e-3,
            "bolt": 2 * math.pi * 2.25e-3 * 8e-3,
            "underside": ring(20e-3, 4e-3) - 4 * ring(2.25e-3, 0),
        },
        rel=1e-9,
    )


@pytest.mark.parametrize(
    ("seat", "words"),
    [
        ('contact = { kind = "cone", half_angle = "90 deg" }', "seat.contact.half_angle: .*between 0.*pi/2"),
        ('contact = { kind = "cylinder", radius = "3 mm", axis = [0, 0, 0] }', "seat.contact.axis: .*zero"),
        ('contact = { kind = "colr", colour = [1, 2, 3] }', "seat.contact.kind: 'colr' .*'colour', 'plane'"),
        ('groups = { contact = { kind = "name", name = "x" } }', "each name must stand once"),
        ("regions = { ring = { order = 1, solid = 'x' } }", "seat.regions.ring:.*exactly"),
        ("regions = { ring = { order = 0 } }", "seat.regions.ring.order: 0"),
        ('supports = [{ kind = "absorbing", on = "a", centre = ["1 mm", "2 mm"] }]', "seat.supports.0.centre"),
    ],
)
def test_what_is_wrong_is_named_by_its_key(tmp_path, seat, words):
    with pytest.raises(SceneError, match=words):
        cad(tmp_path, seat)


def test_a_selector_that_finds_nothing_lists_the_faces_and_names_the_file(tmp_path):
    scene = cad(tmp_path, 'contact = { kind = "name", name = "SEAT" }')
    with pytest.raises(GeometryError, match=r"survive.*export") as caught:
        draw(scene.seat, COARSE, "3d", scene.seat.stated())
    assert "valve_body.step" in str(caught.value)
    assert "Cylinder" in str(caught.value)


def test_regions_carry_materials(tmp_path):
    scene = cad(
        tmp_path,
        'fixed = { kind = "nothing" }\nmaterials.ring = { young = "400 GPa", density = "15000 kg/m^3" }\n'
        "regions = { ring = { colour = [255, 170, 0] } }",
        "insert_seat.step",
    )
    assert scene.seat.geometry().regions == (Region("ring", colour=(255, 170, 0, 255)),)
    mesh = draw(scene.seat, COARSE, "3d", scene.seat.stated())
    ring_share = mass(scene, mesh) / (7850 * mesh.quality.volume) - 1  # (15000/7850 - 1) of the ring's volume
    exact = (15000 / 7850 - 1) * ring(8e-3, 4e-3) * 3e-3 / (ring(12e-3, 4e-3) * 9e-3)
    assert ring_share == pytest.approx(exact, rel=0.1)  # straight elements in coarse circles


def mass(scene, mesh):
    """Return the mass of a free body [kg]: the sum over the three directions, divided by 3."""
    return float(matrices(scene.seat, mesh, "3d", lambda stage, done: None).M.sum()) / 3


@pytest.mark.parametrize(
    ("supports", "held"),
    [
        ("", False),
        ('supports = [{ kind = "dashpot", on = "contact", normal = "1 N*s/m^3" }]', False),
        ('supports = [{ kind = "absorbing", on = "contact" }]', False),
        ('supports = [{ kind = "absorbing", on = "contact", centre = ["0 mm", "0 mm", "0 mm"] }]', True),
        ('supports = [{ kind = "foundation", on = "contact", normal = "1 N/m^3" }]', True),
        ('supports = [{ kind = "bolted", on = "contact", normal = "1 N/m^3" }]', True),
        ('supports = [{ kind = "sliding", on = "contact" }]', True),
    ],
)
def test_what_holds_a_body_without_a_clamped_face(tmp_path, supports, held):
    scene = cad(tmp_path, 'fixed = { kind = "nothing" }\n' + supports)
    assert not scene.seat.clamped
    assert (not scene.seat.loose) is held
    assert not cad(tmp_path, supports).seat.loose


@pytest.mark.parametrize("verb", ["run", "greens"])
def test_a_free_seat_is_refused_before_it_is_meshed(verb, tmp_path, capsys):
    cad(tmp_path, 'fixed = { kind = "nothing" }')
    out = tmp_path / ("out" if verb == "run" else "seat.h5")
    assert run_command([verb, str(tmp_path / "scene.toml"), "-o", str(out), "--quiet"]) == BAD_INPUT
    message = capsys.readouterr().err
    assert "seat.fixed names no face" in message
    assert "clamp a face or add a support" in message
    assert not out.exists()


def test_a_free_mesh_has_six_modes_at_zero_whatever_its_groups_are_called(tmp_path):
    write_mesh(make_mesh(Bar(12e-3, 4e-3, 4e-3), MeshSpec(4e-3, order=1)), tmp_path / "bar.msh")
    seat = load_text(tmp_path, CAD.format("bar.msh").replace("cad", "mesh"), 'fixed = ""\n', REST).seat
    mesh = read_mesh(seat.file, contact=seat.contact, fixed=seat.fixed or None)
    assert "fixed" in mesh.mesh.boundaries
    modes = solve_modes(matrices(seat, mesh, "3d", lambda stage, done: None), 7)
    assert np.all(modes.frequencies_hz[:6] == 0.0)
    assert modes.frequencies_hz[6] > 1e3


EXAMPLES = Path(__file__).parents[2] / "examples"
OF_MESH = '[seat]\nkind = "mesh"\nfile = "{}"\ncontact = "lip"\nmaterial = "steel"\ndamping_ratio = 0.01\n'
THROWN = '[reed]\nkind = "rigid_mass"\nmass = "1 g"\nvelocity = "-1 m/s"\n[run]\nduration = "1 ms"\n'


def unpacked_scene(path: Path, changed: dict[str, object], folder: Path) -> tuple[Scene, dict[str, Path]]:
    """Return the scene as another computer reads it, from a folder of its own, and which file is which."""
    place, there, files = packed(path, changed)
    for name, file in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(file.read_bytes())
    here = json.loads(json.dumps(there).replace(FILES, str(folder)))
    return load_scene(place.replace(FILES, str(folder)), here), {
        str(folder / name): file for name, file in files.items()
    }


@pytest.mark.parametrize(
    ("name", "count"),
    [("flapper_on_valve_body", 1), ("suction_flapper", 1), ("life_of_a_flapper", 2), ("flapper_on_spring", 0)],
)
def test_a_scene_is_the_same_elsewhere(name: str, count: int, tmp_path: Path) -> None:
    """An unpacked scene is the same but for its files' places, also with tables that name others."""
    path = EXAMPLES / f"{name}.toml"
    there, files = unpacked_scene(path, {"run.duration": "1.5 ms"}, tmp_path)
    text = there.model_dump_json()
    for place, file in files.items():
        text = text.replace(place, str(file))
    assert json.loads(text) == json.loads(load_scene(path, {"run.duration": "1.5 ms"}).model_dump_json())
    assert len(files) == count + 1


def test_files_that_vary_travel_too(tmp_path: Path) -> None:
    """Files that vary are packed in place of the scene's own, with those that they include under the names in them."""
    for name in ("a b.inp", "nodes.inp", "c.inp"):
        text = "*INCLUDE, INPUT=nodes.inp\n" if name[0] != "n" else "*NODE\n1, 0, 0, 0\n"
        (tmp_path / name).write_text(text, encoding="utf-8")
    _, there, files = packed(write_scene(tmp_path, OF_MESH.format("c.inp"), THROWN), {"seat.file": "a b.inp"})
    assert there == {"seat.file": f"{FILES}/1/input.inp"}
    assert {name: file.name for name, file in files.items()} == {
        "0/input.toml": "scene.toml", "1/input.inp": "a b.inp", "1/nodes.inp": "nodes.inp",
    }  # fmt: skip


@pytest.mark.parametrize("other", ["mesh/nodes.inp", "my nodes.inp"])
def test_what_cannot_travel(other: str, tmp_path: Path) -> None:
    """An included name that means something else elsewhere is refused."""
    folder = tmp_path / "deck"
    (folder / other).parent.mkdir(parents=True)
    (folder / other).write_text("*NODE\n", encoding="utf-8")
    (folder / "deck.inp").write_text(f"*INCLUDE, INPUT={other}\n", encoding="utf-8")
    write_scene(folder, OF_MESH.format("deck.inp"), THROWN)
    with pytest.raises(SceneError, match=r"seat\.file: .*deck\.inp.*nodes\.inp"):
        packed(folder / "scene.toml", {})


def test_what_a_file_is_read_with_counts(tmp_path: Path) -> None:
    """A change of a mesh's other half, an .xdmf's HDF5 or an included deck changes the scene's content and the seat's
    key."""
    for name in ("disk.ele", "disk.node", "arrays.h5", "nodes.inp"):
        (tmp_path / name).write_bytes(b"one")
    (tmp_path / "disk.xdmf").write_text('<DataItem Format="HDF">arrays.h5:/data0</DataItem>', encoding="utf-8")
    (tmp_path / "deck.inp").write_text("*INCLUDE, INPUT=nodes.inp\n", encoding="utf-8")
    for name, other in (("disk.ele", "disk.node"), ("disk.xdmf", "arrays.h5"), ("deck.inp", "nodes.inp")):
        scene = load_text(tmp_path, OF_MESH.format(name) + THROWN)
        assert f"1/{other}".replace("disk.", "input.") in packed(tmp_path / "scene.toml", {})[2]
        before = describe_content(scene), key_of(scene.seat, Method())
        (tmp_path / other).write_bytes(b"two")
        assert describe_content(scene)["seat"]["file"] != before[0]["seat"]["file"]
        assert key_of(scene.seat, Method()) != before[1]
        (tmp_path / other).write_bytes(b"one")
        assert (describe_content(scene), key_of(scene.seat, Method())) == before


def test_the_curve_of_a_strength_counts(tmp_path: Path) -> None:
    for suffix in ("toml", "csv"):
        file = EXAMPLES / "strengths" / f"invented_strip.{suffix}"
        (tmp_path / file.name).write_text(file.read_text(encoding="utf-8"), encoding="utf-8")
    scene = load_scene(EXAMPLES / "life_of_a_flapper.toml", {"life.strength": str(tmp_path / "invented_strip.toml")})
    before = describe_content(scene)
    curve = tmp_path / "invented_strip.csv"
    curve.write_text(curve.read_text(encoding="utf-8") + "\n", encoding="utf-8")
    assert {key for key, value in describe_content(scene).items() if value != before[key]} == {"life"}
