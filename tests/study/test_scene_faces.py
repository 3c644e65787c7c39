"""Faces, regions and supports of CAD and mesh files, named in scenes."""

import math
from pathlib import Path

import numpy as np
import pytest

from seatfem.structures.finite_elements import draw, matrices
from seatfem.structures.formats.mesh_files import read_mesh
from seatfem.structures.formats.writing import write_mesh
from seatfem.structures.mesh.meshing import make_mesh
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.reduction.modes import solve_modes
from seatfem.structures.shapes import Bar, GeometryError, Region
from tests.gallery import load_text
from tests.steps import BAD_INPUT, Scene, SceneError, run_command

MESHES = Path(__file__).parents[2] / "meshes"
SCENE = (
    '[seat]\nkind = "cad"\nfile = "{file}"\nmaterial = {{ young = "200 GPa", density = "7850 kg/m^3" }}\n{seat}\n'
    '[reed]\nkind = "rigid_mass"\nmass = "5 g"\nvelocity = "-2 m/s"\n[run]\nduration = "1 ms"\n'
)
COARSE = MeshSpec(8e-3, order=1, curved=False)


@pytest.fixture
def load(tmp_path):
    def write_and_load(seat: str, file: str = "valve_body.step") -> Scene:
        return load_text(tmp_path, SCENE.format(file=MESHES / file, seat=seat))

    return write_and_load


def areas(scene):
    return dict(make_mesh(scene.seat.geometry(), COARSE).quality.cad_areas)


def ring(outer, inner):
    return math.pi * (outer**2 - inner**2)


def test_every_selector_finds_its_faces(load):
    scene = load("""
contact = { kind = "union", of = [{ kind = "plane", normal = [0, 0, 1], offset = "14 mm" },
                                  { kind = "point", point = ["7 mm", "0 mm", "14 mm"] }] }
fixed = { kind = "cylinder", radius = "20 mm" }
[seat.groups]
bolt = { kind = "cylinder", radius = "2.25 mm", axis_point = ["15 mm", "0 mm", "0 mm"] }
underside = { kind = "colour", colour = [0, 0, 255] }
""")
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
def test_what_is_wrong_is_named_by_its_key(load, seat, words):
    with pytest.raises(SceneError, match=words):
        load(seat)


def test_a_selector_that_finds_nothing_lists_the_faces_and_names_the_file(load):
    scene = load('contact = { kind = "name", name = "SEAT" }')
    with pytest.raises(GeometryError, match=r"survive.*export") as caught:
        draw(scene.seat, COARSE, "3d", scene.seat.stated())
    assert "valve_body.step" in str(caught.value)
    assert "Cylinder" in str(caught.value)


def test_regions_carry_materials(load):
    scene = load(
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
def test_what_holds_a_body_without_a_clamped_face(load, supports, held):
    scene = load('fixed = { kind = "nothing" }\n' + supports)
    assert not scene.seat.clamped
    assert (not scene.seat.loose) is held
    assert not load(supports).seat.loose


@pytest.mark.parametrize("verb", ["run", "greens"])
def test_a_free_seat_is_refused_before_it_is_meshed(verb, load, tmp_path, capsys):
    load('fixed = { kind = "nothing" }')
    out = tmp_path / ("out" if verb == "run" else "seat.h5")
    assert run_command([verb, str(tmp_path / "scene.toml"), "-o", str(out), "--quiet"]) == BAD_INPUT
    message = capsys.readouterr().err
    assert "seat.fixed names no face" in message
    assert "clamp a face or add a support" in message
    assert not out.exists()


def test_a_free_mesh_has_six_modes_at_zero_whatever_its_groups_are_called(tmp_path):
    write_mesh(make_mesh(Bar(12e-3, 4e-3, 4e-3), MeshSpec(4e-3, order=1)), tmp_path / "bar.msh")
    seat = load_text(tmp_path, SCENE.format(file="bar.msh", seat='fixed = ""').replace('"cad"', '"mesh"')).seat
    mesh = read_mesh(seat.file, contact=seat.contact, fixed=seat.fixed or None)
    assert "fixed" in mesh.mesh.boundaries
    modes = solve_modes(matrices(seat, mesh, "3d", lambda stage, done: None), 7)
    assert np.all(modes.frequencies_hz[:6] == 0.0)
    assert modes.frequencies_hz[6] > 1e3
