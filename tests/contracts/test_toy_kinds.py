"""A kind of reed and a family of seats, each defined here alone: scenes name them, and runs carry them out."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, Literal

import numpy as np
import pytest
from pydantic import Field

import impact
from impact.bodies.body import Body, ModalState
from seatfem.fields import Length, Mass, Stiffness
from seatfem.structures.kinds.structure import Structure, Traits
from seatfem.structures.kinds.turned import Turned
from seatfem.structures.shapes import Turning
from seatfem.structures.shapes.profile import Profile, polygon
from seatfem.structures.shapes.selectors import Patches, PlaneFace
from tests.gallery import load_text
from tests.steps import GreensFunction, ModalGreens, Residual, SceneError, begin_plan, run_scene


@dataclass(frozen=True)
class ToyCup(Turning):
    """A disc with a rim, on which it is struck."""

    family: ClassVar[str] = "toy_cup"

    radius: float
    rim: float
    height: float

    @property
    def patches(self) -> Patches:
        return {
            "contact": (PlaneFace((0.0, 0.0, 1.0), self.height, radius_min=self.radius - self.rim),),
            "fixed": (PlaneFace((0.0, 0.0, -1.0), 0.0),),
        }

    @property
    def profile(self) -> Profile:
        inner, floor = self.radius - self.rim, self.height / 2
        corners = [(0.0, 0.0), (self.radius, 0.0), (self.radius, self.height), (inner, self.height), (inner, floor)]
        return Profile(polygon([*corners, (0.0, floor)], ["fixed", "", "contact", "", "", "axis"]))


@pytest.fixture
def toys() -> Iterator[None]:
    """Define two kinds only while a test needs them: other tests list those of the program."""

    class ToyHammer(Structure):
        """A mass on a spring, drawn back and let go."""

        traits: ClassVar[Traits] = Traits(moved_by=("drawn_back",))

        kind: Literal["toy_hammer"]
        mass: Mass = Field(description="of the head")
        stiffness: Stiffness = Field(description="of its spring")
        drawn_back: Length | None = Field(None, description="how far it is drawn back")

        def closed_form(self) -> GreensFunction | None:
            omega = np.array([np.sqrt(self.stiffness / self.mass)])
            return ModalGreens(omega, np.zeros(1), np.full((1, 1), self.mass**-0.5), Residual.none())

        def body(
            self, greens: GreensFunction | None = None, n_modes: int | None = None, at: float | None = None
        ) -> Body:
            q = np.array([(self.drawn_back or 0.0) * self.mass**0.5])
            return impact.Body(self.closed_form(), state=ModalState(q, np.zeros(1)))

    class Cup(Turned):
        """A disc with a rim, struck on the rim."""

        kind: Literal["toy_cup"]
        radius: Length = Field(description="of the cup")
        rim: Length = Field(description="width of the rim")
        height: Length = Field(description="of the rim above the underside")

        def geometry(self) -> ToyCup:
            return ToyCup(self.radius, self.rim, self.height)

        def struck_part(self) -> tuple[float, float, float]:
            return self.struck_area, self.rim, self.height

    yield
    for kind in (ToyHammer, Cup):
        del kind.model_fields["kind"]


SPRING = '[seat]\nkind = "spring"\nstiffness = "20 N/um"\n'
HAMMER = '[reed]\nkind = "toy_hammer"\nmass = "1 g"\nstiffness = "1 N/mm"\ndrawn_back = "0.1 mm"\n'
CUP = (
    '[seat]\nkind = "toy_cup"\nradius = "6 mm"\nrim = "1 mm"\nheight = "4 mm"\n'
    'material = "steel"\ndamping_ratio = 0.02\n'
)
BALL = '[reed]\nkind = "rigid_mass"\nmass = "1 g"\nvelocity = "-0.1 m/s"\n'
RUN = '[run]\nduration = "{}"\nfilter_width = "10 us"\n[accuracy]\ntarget = "30 %"\n'


@pytest.mark.slow
@pytest.mark.usefixtures("toys")
def test_a_toy_reed_strikes(tmp_path: Path) -> None:
    """The impulse is twice an oscillator's momentum at its middle, within the bar that the run states."""
    scene = load_text(tmp_path, SPRING + HAMMER + RUN.format("2 ms"))
    assert begin_plan(scene).level == "closed form"
    summary = run_scene(scene, tmp_path / "out", pictures=False).summary
    assert abs(summary["impulse_Ns"] - 2 * 1e-4 * np.sqrt(1e-3 * 1e3)) < summary["error_bar_impulse_Ns"]
    assert summary["error_bar_impulse_Ns"] < 0.3 * summary["impulse_Ns"]


@pytest.mark.slow
@pytest.mark.usefixtures("toys")
def test_a_toy_seat_is_meshed_and_struck(tmp_path: Path) -> None:
    """Its compliance is that of a ring on a disc: stiffer than a column as high, softer than the rim alone."""
    scene = load_text(tmp_path, CUP + BALL + RUN.format("0.2 ms"))
    assert begin_plan(scene).level == "spring"
    summary = run_scene(scene, tmp_path / "out", pictures=False).summary
    assert summary["seat_kind"] == "toy_cup"
    area, _, height = scene.seat.struck_part()
    column = scene.seat.material.young * area / height
    assert column < summary["seat_static_stiffness_N_per_m"] < 2 * column
    assert 1e-4 < summary["impulse_Ns"] < 2e-4  # thrown back, not faster than it came
    again = run_scene(scene, tmp_path / "again", pictures=False).summary
    assert again["seat_reused"] is True


@pytest.mark.usefixtures("toys")
def test_toys_are_checked_like_any_other(tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"seat.rimm:.*'rim'"):
        load_text(tmp_path, CUP.replace("rim =", "rimm =") + BALL + RUN.format("1 ms"))
    with pytest.raises(SceneError, match=r"reed.drawn_back: required"):
        load_text(tmp_path, SPRING + HAMMER.replace('drawn_back = "0.1 mm"\n', "") + RUN.format("1 ms"))
    with pytest.raises(SceneError, match=r"seat.drawn_back:.*struck"):
        load_text(tmp_path, HAMMER.replace("[reed]", "[seat]") + BALL + RUN.format("1 ms"))
    with pytest.raises(SceneError, match=r"reed.kind:.*'spring'"):
        load_text(tmp_path, SPRING + SPRING.replace("[seat]", "[reed]") + RUN.format("1 ms"))
