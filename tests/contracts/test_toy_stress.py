"""A kind of reed that is defined here alone: runs give its stress, hot spots, strain and life, and draw them."""

from collections.abc import Iterator
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
import pytest
from pydantic import Field

import impact
from impact.bodies.body import Body, ModalState
from impact.greens.base import Array
from impact.march.motion import modal_coordinates
from seatfem.fields import Area, Length, Mass, Stiffness
from seatfem.structures.kinds.places import StressAtPlaces
from seatfem.structures.kinds.structure import At, Structure, Traits
from tests.gallery import load_text
from tests.steps import GreensFunction, ModalGreens, Residual, run_scene

YOUNG = 200e9


@pytest.fixture
def toys() -> Iterator[None]:
    """Define the kind only while a test needs it."""

    class ToyPunch(Structure):
        """A mass on a light rod, drawn back and let go."""

        traits: ClassVar[Traits] = Traits(moved_by=("drawn_back",), stress="closed form")

        kind: Literal["toy_punch"]
        mass: Mass = Field(description="of the head")
        stiffness: Stiffness = Field(description="of the rod")
        section: Area = Field(description="cross-section of the rod")
        drawn_back: Length | None = Field(None, description="how far it is drawn back")

        def closed_form(self) -> GreensFunction | None:
            omega = np.array([np.sqrt(self.stiffness / self.mass)])
            return ModalGreens(omega, np.zeros(1), np.full((1, 1), self.mass**-0.5), Residual.none())

        def body(self, greens: GreensFunction | None = None, n_modes: int | None = None, at: At = None) -> Body:
            q = np.array([(self.drawn_back or 0.0) * self.mass**0.5])
            return impact.Body(self.closed_form(), state=ModalState(q, np.zeros(1)))

        def stress(self, force: Array, dt: float, body: Body, at: At) -> StressAtPlaces:
            moved = modal_coordinates(body, force[None, 1:], dt, 1)[:, 0] / self.mass**0.5
            rod = moved * self.stiffness / self.section
            return StressAtPlaces({"rod": (0.0, rod)}, force, dt)

        def check_gauge(self, at: float, table: str, role: str) -> None:
            """Accept any place, as the rod is strained evenly."""

        def strain_at(self, place: float, force: Array, dt: float, body: Body, at: At = None) -> Array:
            return next(self.stress(force, dt, body, at).histories())[1] / YOUNG

    yield
    del ToyPunch.model_fields["kind"]


STRENGTH = 'source = "invented for tests"\ncurve = { knee_stress = "400 MPa", knee_cycles = 1e7, slope = 12 }\n'
SCENE = """
seat = { kind = "spring", stiffness = "20 N/um" }
reed = { kind = "toy_punch", mass = "1 g", stiffness = "1 N/mm", section = "0.01 mm^2", drawn_back = "0.1 mm" }
gauge = [{ of = "reed", at = "0 mm", name = "rod" }]
run = { duration = "5 ms", filter_width = "10 us" }
accuracy = { target = "30 %", measures = ["impulse", "stress"] }
life = { strength = "strength.toml", criterion = "swt", cycles = 1e7 }
"""


@pytest.mark.slow
@pytest.mark.usefixtures("toys")
def test_the_stress_of_a_toy(tmp_path: Path) -> None:
    """It is released from k d/A in tension, which a stiff seat gives back: the range of a block is from there to 0."""
    (tmp_path / "strength.toml").write_text(STRENGTH, encoding="utf-8")
    outcome = run_scene(load_text(tmp_path, SCENE), tmp_path / "out")
    keys, largest = outcome.summary, 1e3 * 1e-4 / 1e-8
    assert keys["reed_stress_at_start_Pa"] == pytest.approx(largest, rel=1e-9)
    thrown_back, bar = (keys[f"{of}peak_reed_stress_after_contact_Pa"] for of in ("", "error_bar_"))
    assert abs(thrown_back - largest) < bar < 0.1 * largest
    assert keys["gauge_rod_largest_strain"] == pytest.approx(largest / YOUNG, rel=0.02)
    (spot,) = keys["reed_stress_hot_spots"]
    assert (spot["part"], spot["component"]) == ("rod", "xx")
    assert keys["life_at"] == "reed, rod"
    assert 0 < keys["error_bar_life_margin"] < keys["life_margin"]
    assert keys["life_margin"] == pytest.approx(400e6 / (np.sqrt(0.5) * largest), rel=0.2)  # swt, of a range from 0
    assert {path.name for path in outcome.files} >= {"reed_hot_spots.csv", "stress.h5", "stress_histories.png"}
