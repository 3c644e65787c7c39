"""Scene files: what they become, and every way in which they can be wrong."""

import re
from collections.abc import Callable
from functools import partial
from pathlib import Path

import pytest

from seatfem.study.scene.problems import key_lines
from tests.gallery import load_text
from tests.steps import Scene, SceneError, key_of, load_scene, stated_method

SCENE = (
    'title = "test"\n[seat]\nkind = "annular"\nbore_radius = "4 mm"\nlip_width = "1 mm"\n'
    'material = { young = "200 GPa", poisson = 0.3, density = "7850 kg/m^3" }\n\n[reed]\nkind = "cantilever"\n'
    'length = "25.4 mm"\nwidth = "10 mm"\nthickness = "0.305 mm"\n'
    'material = { young = "200 GPa", density = "7850 kg/m^3" }\nrelease = { tip_deflection = "1 mm" }\n\n[run]\n'
    'duration = "3 ms"\n'
)
ROD = 'kind = "rod"\nyoung = "200 GPa"\ndensity = "7850 kg/m^3"\nlength = "3 mm"\n'

Load = Callable[[str], Scene]


def seat_key(scene: Scene) -> str:
    return key_of(scene.seat, stated_method(scene).seat)


@pytest.fixture
def load(tmp_path: Path) -> Load:
    return partial(load_text, tmp_path)


def messages(load: Load, text: str) -> list[str]:
    with pytest.raises(SceneError) as caught:
        load(text)
    return [str(problem).removeprefix(f"{problem.file.parent}/") for problem in caught.value.problems]


def changed(old: str, new: str, text: str = SCENE) -> str:
    assert old in text
    return text.replace(old, new)


def with_seat(seat: str) -> str:
    return "[seat]\n" + seat + SCENE[SCENE.index("[reed]") :]


def test_values_are_si_floats_and_defaults_are_filled_in(load: Load) -> None:
    scene = load(SCENE)
    assert (scene.seat.kind, scene.reed.kind) == ("annular", "cantilever")
    assert (scene.seat.bore_radius, scene.seat.thickness, scene.seat.mesh.order) == (0.004, 0.008, 2)
    assert (scene.reed.release.tip_deflection, scene.contact.at, scene.accuracy.target) == (0.001, None, 0.01)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('lip_width = "1 mm"\n', 'lip_width = "1 mm"\nouter_radus = "9 mm"\n',
         "scene.toml:6: seat.outer_radus: .*'outer_radius'"),
        ('[run]\nduration = "3 ms"\n', "", "scene.toml: run: .*missing"),
        ("[run]", "[run]\nfoo = 1",
         "scene.toml:17: run.foo: .*duration, time_step, filter_width, ensemble"),
        ('"25.4 mm"', '"3 kg"', "scene.toml:10: reed.length: '3 kg' .*mass.* length .*'3 mm'"),
        ('"25.4 mm"', "true", "scene.toml:10: reed.length: True .*unit.*'3 mm'"),
        ('"25.4 mm"', '"0 mm"', "scene.toml:10: reed.length: '0 mm' .*positive"),
        ("poisson = 0.3", "poisson = nan", "scene.toml:6: seat.material.poisson: nan: .*finite"),
        ('"annular"', '"anular"', "scene.toml:3: seat.kind: 'anular' .*cantilever, .*annular, .*ball, .*'annular'"),
        ("[run]\n", "[contact]\nlaw = 'signorin'\n[run]\n",
         "scene.toml:17: contact.law.kind: 'signorin' .*'signorini', 'spring', 'hertz', .*'table_joint'.* 'signorini'"),
        ('release = { tip_deflection = "1 mm" }', "release = 1",
         "scene.toml:14: reed.release: 1 .*release = { .*tip_deflection, mode, deflection, velocity"),
        ('lip_width = "1 mm"', 'lip_width = "1 mm"\nlip_edge_radius = "0.6 mm"',
         "scene.toml:6: seat.lip_edge_radius: 0.6 mm: .*< 0.5 mm .*lip_width"),
        ('lip_width = "1 mm"', 'lip_width = "1 mm"\nlip_fillet = "0.6 mm"',
         "scene.toml:6: seat.lip_fillet: 0.6 mm: .*< 0.4 mm .*lip_height .*lip_edge_radius"),
        ('lip_width = "1 mm"', 'lip_width = "1 mm"\nmesh = { size = "1 mm", contact_size = "2 mm" }',
         "scene.toml:6: seat.mesh.contact_size: 2 mm .*1 mm"),
        ('lip_width = "1 mm"', 'lip_width = "1 mm"\ndamping_ratio = 0.1\nrayleigh = { stiffness = "1 ns" }',
         "scene.toml:7: seat.rayleigh: damping_ratio .*keep one"),
        ('"3 ms"', '"3 ms"\ntime_step = "2 ms"',
         "scene.toml:18: run.time_step: 2 ms .*3 ms"),
        ("[run]", "[seat.greens]\nmethod = 'krilov'\n[run]",
         "scene.toml:17: seat.greens.method: 'krilov' .*'auto', 'krylov', 'modes', .*'krylov'"),
        ("[run]", "[[seat.supports]]\nkind = 'hinge'\non = 'rim'\n[run]",
         "scene.toml:17: seat.supports.0.kind: 'hinge' .*'foundation', 'bolted', 'absorbing', 'dashpot', 'sliding'"),
        ("[run]", "[seat.materials.insert]\nyoung = '200 GPa'\npoison = 0.3\ndensity = '7850 kg/m^3'\n[run]",
         "scene.toml:18: seat.materials.insert.poison: .*'poisson'"),
    ],
)  # fmt: skip
def test_bad_scenes(load: Load, old: str, new: str, message: str) -> None:
    (answer,) = messages(load, changed(old, new))
    assert re.search(message, answer)


@pytest.mark.parametrize(
    ("key", "value"), [("greens.backend", "slepc"), ("greens.method", "lanczos"), ("mesh.shape", "hex")]
)
def test_what_is_no_more_is_named_with_what_to_do(load: Load, key: str, value: str) -> None:
    table, name = key.split(".")
    (message,) = messages(load, changed("[reed]", f'[seat.{table}]\n{name} = "{value}"\n[reed]'))
    assert message.startswith(f"scene.toml:9: seat.{key}: ")
    assert "remove this" in message


def test_everything_wrong_is_told_at_once_in_the_order_of_the_file(load: Load) -> None:
    text = changed("lip_width =", "outer_radus =")
    text = changed('"25.4 mm"', '"3 kg"', text)
    text = changed('"3 ms"', '"3 mm"', text)
    assert [message.split(": ")[:2] for message in messages(load, text)] == [
        ["scene.toml:2", "seat.lip_width"],
        ["scene.toml:5", "seat.outer_radus"],
        ["scene.toml:10", "reed.length"],
        ["scene.toml:17", "run.duration"],
    ]


@pytest.mark.parametrize(
    ("section", "message"),
    [
        ('width = "1 mm"', "scene.toml:1: seat.area: .*area, or width and thickness"),
        ('area = "1 mm^2"\nwidth = "1 mm"', "scene.toml:6: seat.area: width or thickness .*keep"),
    ],
)
def test_rod_cross_section(load: Load, section: str, message: str) -> None:
    (answer,) = messages(load, with_seat(f"{ROD}{section}\n"))
    assert re.search(message, answer)


def test_files_are_found_from_the_folder_of_the_scene(load: Load, tmp_path: Path) -> None:
    text = with_seat(
        'kind = "cad"\nfile = "part.step"\n'
        'contact = { kind = "plane", normal = [0, 0, 1], offset = "8.5 mm" }\n'
        'material = { young = "200 GPa", density = "7850 kg/m^3" }\n'
    )
    (missing,) = messages(load, text)
    assert re.match(r"scene.toml:3: seat.file:.*part\.step", missing)
    (tmp_path / "part.step").write_text("")
    seat = load(text).seat
    assert seat.file == (tmp_path / "part.step").resolve()
    (contact,) = seat.geometry().patches["contact"]
    assert str(contact) == "plane face with normal (0.0, 0.0, 1.0), offset 8.5 mm"
    (bad,) = messages(load, changed("[0, 0, 1]", "[0, 0, 0]", text))
    assert bad.startswith("scene.toml:4: seat.contact.normal: (0.0, 0.0, 0.0): ")


def test_a_rigid_mass_strikes_downwards_and_has_no_positions(load: Load) -> None:
    start, end = SCENE.index("[reed]"), SCENE.index("[run]")
    mass = '[reed]\nkind = "rigid_mass"\nmass = "5 g"\nvelocity = "-2 m/s"\n'
    text = SCENE[:start] + mass + SCENE[end:]
    reed = load(text).reed
    assert (reed.mass, reed.velocity) == (0.005, -2.0)
    assert "at rest never touches" in messages(load, changed('"-2 m/s"', '"0 m/s"', text))[0]
    (placed,) = messages(load, text + '[contact]\nat = "1 mm"\n')
    assert re.match("scene.toml:15: contact.at: .*positions.*remove", placed)


def test_no_such_scene_and_no_text(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"absent\.toml: .*file"):
        load_scene(tmp_path / "absent.toml")
    with pytest.raises(SceneError, match="cannot be read: is a folder"):
        load_scene(tmp_path)
    binary = tmp_path / "seat.toml"
    binary.write_bytes(b"\x89HDF\r\n")
    with pytest.raises(SceneError, match=r"seat.toml:.*UTF-8 text \(byte 0\)"):
        load_scene(binary)


def test_the_seat_key_sees_the_seat_only(load: Load) -> None:
    key = seat_key(load(SCENE))
    assert seat_key(load(changed('"25.4 mm"', '"30 mm"'))) == key
    assert seat_key(load(changed('bore_radius = "4 mm"', 'bore_radius = "0.004 m"  # the same'))) == key
    assert seat_key(load(changed('bore_radius = "4 mm"', 'bore_radius = "4.1 mm"'))) != key


def test_key_lines_of_every_toml_construct() -> None:
    text = """\
a = 1 # [not.a.table]
b.c = "x = 1"
"quoted key".d = '''
[not.a.table]
'''
list = [ 1,
  { e = "}", f = [2, 3] }, # ]
]
[t.u]
g = { h = { i = 1.5 }, 'j' = \"\"\"
k = 1\"\"\" }
[[many]]
x = 1979-05-27 07:32:00
[[many]]
x = "\\"]"
"""
    lines = key_lines(text)
    expected = {
        "a": 1, "b.c": 2, "quoted key.d": 3, "list": 6, "list.1.e": 7, "list.1.f.1": 7, "t.u": 9, "t.u.g.h.i": 10,
        "t.u.g.j": 10, "many.0.x": 13, "many.1.x": 15,
    }  # fmt: skip
    assert {key: lines.get(key) for key in expected} == expected


def test_a_reed_needs_its_length_and_release_only(load: Load) -> None:
    steel = 'material = { young = "200 GPa", density = "7850 kg/m^3" }\nrelease'
    short = changed('width = "10 mm"\nthickness = "0.305 mm"\n' + steel, "release")
    assert load(short).reed == load(SCENE).reed


def test_a_level_of_accuracy_is_a_target_by_name(load: Load) -> None:
    for level, target in (("quick", 0.05), ("standard", 0.01), ("reference", 0.003)):
        assert load(SCENE + f'[accuracy]\nlevel = "{level}"\n').accuracy.target == target
    assert load(SCENE + '[accuracy]\ntarget = "2 %"\n').accuracy.level is None
    (both,) = messages(load, SCENE + '[accuracy]\nlevel = "quick"\ntarget = "2 %"\n')
    assert re.match("scene.toml:20: accuracy.target: level = 'quick' .*keep one", both)
    (unknown,) = messages(load, SCENE + '[accuracy]\nlevel = "exact"\n')
    assert re.search("accuracy.level: 'exact' .*'quick', 'standard', 'reference'", unknown)


def test_stress_is_asked_of_what_bends(load: Load) -> None:
    wanted = '[accuracy]\nmeasures = ["impulse", "stress"]\n'
    assert "stress" in load(SCENE + wanted).accuracy.measures
    start, end = SCENE.split("[reed]")[0], SCENE[SCENE.index("[run]") :]
    mass = start + '[reed]\nkind = "rigid_mass"\nmass = "1 g"\nvelocity = "-1 m/s"\n' + end
    (refused,) = messages(load, mass + wanted)
    words = "stress is asked of a body of kind 'rigid_mass', whose stress is not known: remove it, or use"
    assert words in refused


def test_axes_of_a_material_stand_at_right_angles(load: Load) -> None:
    wood = (
        '{ kind = "orthotropic", young = ["1 GPa", "1 GPa", "1 GPa"], poisson = [0.1, 0.1, 0.1], '
        'density = "700 kg/m^3", shear = ["1 GPa", "1 GPa", "1 GPa"], axes = [[1, 0, 0], [1, 1, 0], [0, 0, 1]] }'
    )
    sides = "".join(f'{key} = "4 mm"\n' for key in ("width", "depth", "thickness", "patch_width", "patch_depth"))
    with pytest.raises(SceneError, match=r"seat\.material\.axes: .*angles"):
        load(
            f'[seat]\nkind = "block"\n{sides}material = {wood}\n'
            '[reed]\nkind = "rigid_mass"\nmass = "1 g"\nvelocity = "-1 m/s"\n[run]\nduration = "1 ms"\n'
        )
