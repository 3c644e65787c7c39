"""A new contact law is one class: no file knows this one, and scenes, plans and runs carry it out."""

from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import pytest
from pydantic import Field

from impact.march.laws import Law, compiled_law
from seatfem.fields import Stiffness
from seatfem.study.scene.laws import ContactLaw
from tests.gallery import load_text
from tests.steps import SceneError, begin_plan, run_scene

SCENE = """
seat = {{ kind = "spring", stiffness = "1 GN/m" }}
reed = {{ kind = "rigid_mass", mass = "1 g", velocity = "-1 m/s" }}
contact = {{ law = {{ kind = "{kind}", stiffness = "1 N/um" }} }}
run = {{ duration = "0.3 ms", filter_width = "10 us", time_step = "0.2 us" }}
accuracy = {{ target = "30 %" }}
"""


@pytest.fixture
def toy() -> Iterator[None]:
    class Rubber(ContactLaw):
        """A spring that takes half of its force when the bodies part."""

        kind: Literal["toy_rubber"]
        stiffness: Stiffness = Field(description="force per penetration")

        def law(self, share: float = 1.0) -> Law:
            k = share * self.stiffness

            def force(pen: float, start: float, dt: float) -> float:
                return k * pen if pen >= start else 0.5 * k * pen

            return compiled_law(force)

    yield
    del Rubber.model_fields["kind"]


@pytest.mark.slow
@pytest.mark.usefixtures("toy")
def test_a_toy_law_is_run(tmp_path: Path) -> None:
    """Half the energy is lost: restitution 1/sqrt(2), to what steps of a 500th of the blow leave."""
    scene = load_text(tmp_path, SCENE.format(kind="toy_rubber"))
    assert begin_plan(scene).level == "closed form"
    summary = run_scene(scene, tmp_path / "out", pictures=False).summary
    spring = run_scene(load_text(tmp_path, SCENE.format(kind="spring")), tmp_path / "2", pictures=False).summary
    assert summary["restitution"] == pytest.approx(0.5**0.5, rel=5e-3)
    assert summary["peak_force_N"] == pytest.approx(spring["peak_force_N"], rel=5e-3)


@pytest.mark.slow
@pytest.mark.usefixtures("toy")
def test_its_keys_are_checked_and_its_name_is_listed(tmp_path: Path) -> None:
    wrong = SCENE.format(kind="toy_rubber").replace('stiffness = "1 N/um" }', "stifness = 1 }")
    with pytest.raises(SceneError, match=r"contact.law.stifness:.*'stiffness'"):
        load_text(tmp_path, wrong)
    with pytest.raises(SceneError, match=r"contact.law.kind: 'rubber'.*'toy_rubber'"):
        load_text(tmp_path, SCENE.format(kind="rubber"))
