"""Materials by name: cited values, single ones overruled, errors that list what there is."""

from collections.abc import Callable
from pathlib import Path

import pytest

from seatfem.structures.materials import NAMED_MATERIALS, named_material
from seatfem.structures.materials import Material as Solid
from seatfem.study.scene import Scene, SceneError
from tests.gallery import load_text

Load = Callable[[str, str], Scene]


@pytest.fixture
def load(tmp_path: Path) -> Load:
    def write_and_load(seat: str, reed: str) -> Scene:
        return load_text(
            tmp_path,
            f'[seat]\nkind = "annular"\nbore_radius = "4 mm"\nlip_width = "1 mm"\nmaterial = {seat}\n'
            '[reed]\nkind = "cantilever"\nlength = "20 mm"\nrelease = { tip_deflection = "1 mm" }\n'
            f'material = {reed}\n[run]\nduration = "1 ms"\n',
        )

    return write_and_load


def test_a_name_is_its_values(load: Load) -> None:
    scene = load('"grey cast iron"', '"Stainless_Valve-Steel"')
    assert (scene.seat.material.young, scene.seat.material.poisson, scene.seat.material.density) == (110e9, 0.26, 7200)
    assert (scene.reed.material.young, scene.reed.material.density) == (215e9, 7700)


def test_a_value_beside_the_name_overrules_the_list(load: Load) -> None:
    scene = load('{ name = "steel", young = "210 GPa", loss_factor = 0.01 }', '"steel"')
    assert scene.seat.material.young == 210e9
    assert scene.seat.material.density == 7850
    assert scene.seat.material.loss_factor == 0.01


@pytest.mark.parametrize(
    ("given", "place"), [('"steal"', "scene.toml:5: seat.material"), ('{ name = "steal" }', "seat.material.name")]
)
def test_an_unknown_name_lists_what_there_is(load: Load, given: str, place: str) -> None:
    with pytest.raises(SceneError) as caught:
        load(given, '"steel"')
    (problem,) = caught.value.problems
    assert place in str(problem)
    assert "did you mean 'steel'?" in problem.message
    assert all(repr(name) in problem.message for name in NAMED_MATERIALS)


def test_every_material_is_a_sound_solid_with_a_source() -> None:
    for name, material in NAMED_MATERIALS.items():
        assert material is named_material(name)
        assert material.source
        solid = Solid(young=material.young, poisson=material.poisson, density=material.density)
        assert 1300 < solid.c_0 < 5400  # from polymers to light metals; waves in metals are near 5 km/s
    assert named_material("Cast iron") is NAMED_MATERIALS["grey cast iron"]
