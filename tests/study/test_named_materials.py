"""Materials by name: cited values, single ones overruled, errors that list what there is."""

from pathlib import Path

import pytest

from seatfem.structures.materials import NAMED_MATERIALS, named_material
from seatfem.structures.materials import Material as Solid
from tests.gallery import load_text, refusal
from tests.study.small_scenes import ANNULAR, REED, scene_of


def test_a_name_is_its_values() -> None:
    scene = scene_of(ANNULAR, REED, seat__material="grey cast iron", reed__material="Stainless_Valve-Steel")
    assert (scene.seat.material.young, scene.seat.material.poisson, scene.seat.material.density) == (110e9, 0.26, 7200)
    assert (scene.reed.material.young, scene.reed.material.density) == (215e9, 7700)


def test_a_value_beside_the_name_overrules_the_list() -> None:
    scene = scene_of(ANNULAR, REED, seat__material={"name": "steel", "young": "210 GPa", "loss_factor": 0.01})
    assert scene.seat.material.young == 210e9
    assert scene.seat.material.density == 7850
    assert scene.seat.material.loss_factor == 0.01


@pytest.mark.parametrize("given", ['"steal"', '{ name = "steal" }'])
def test_an_unknown_name_lists_what_there_is(given: str, tmp_path: Path) -> None:
    message = refusal(load_text, tmp_path, REED.replace("length", f"material = {given}, length"), ANNULAR)
    assert "scene.toml:2: reed.material" in message
    assert "did you mean 'steel'?" in message
    assert all(repr(name) in message for name in NAMED_MATERIALS)


def test_every_material_is_a_sound_solid_with_a_source() -> None:
    for name, material in NAMED_MATERIALS.items():
        assert material is named_material(name)
        assert material.source
        solid = Solid(young=material.young, poisson=material.poisson, density=material.density)
        assert 1300 < solid.c_0 < 5400  # from polymers to light metals; waves in metals are near 5 km/s
    assert named_material("Cast iron") is NAMED_MATERIALS["grey cast iron"]
