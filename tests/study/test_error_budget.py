"""Error bars of measures: how the runs behind them are made, and that they hold."""

import math
from pathlib import Path

import numpy as np
import pytest

import impact
from impact.greens.base import GreensFunctionError
from impact.greens.modal import ModalGreens, Residual
from impact.greens.sums import ScaledGreens
from impact.runs.budget import SAFETY, Budget, safety
from impact.runs.variations import narrowed
from seatfem.structures.solved import Solved
from seatfem.study.accuracy.error_budget import error_budget
from seatfem.study.impacts.contact import run_contacts, striker_of
from seatfem.study.impacts.measures import SOURCES, bar_keys, measured
from seatfem.study.impacts.touches import Touches
from seatfem.study.method import stated_method
from seatfem.study.scene import Scene, load_scene
from seatfem.study.scene.measures import all_measures

ROD = impact.fixed_rod(young=200e9, density=7850.0, area=1e-6, length=5e-3)
MODES = ModalGreens(
    np.array([2e6, 5e6, 9e6]), np.full(3, 0.02), np.array([[20.0], [30.0], [25.0]]), Residual.exponential(2e-11, 1e-2)
)
SCENE = """
[seat]
kind = "spring"
stiffness = "40 N/um"
[reed]
kind = "rigid_mass"
mass = "0.1 g"
velocity = "-1 m/s"
[run]
duration = "12 us"
"""


@pytest.fixture
def scene(tmp_path: Path) -> Scene:
    path = tmp_path / "scene.toml"
    path.write_text(SCENE, encoding="utf-8")
    return load_scene(path)


@pytest.mark.parametrize("greens", [ROD, MODES, impact.spring(stiffness=1e7)])
def test_a_multiple_is_one_in_every_view(greens: impact.GreensFunction) -> None:
    twice, t = ScaledGreens(greens, 2.0), np.linspace(0, 3e-5, 40)
    np.testing.assert_allclose(twice.step_response(t), 2 * greens.step_response(t))
    np.testing.assert_allclose(twice.impulse_response(t), 2 * greens.impulse_response(t))
    np.testing.assert_allclose(twice.static_compliance(), 2 * greens.static_compliance())
    np.testing.assert_allclose(twice.initial_value(), 2 * greens.initial_value())
    kernel, base = twice.step_kernel(1e-8, 50), greens.step_kernel(1e-8, 50)
    np.testing.assert_allclose(kernel.self_weight(1e-8), 2 * base.self_weight(1e-8), rtol=1e-12)
    with pytest.raises(GreensFunctionError, match="factor = -1 must be positive"):
        ScaledGreens(greens, -1)


def test_narrowing_keeps_the_statics_and_the_start() -> None:
    """Modes above the band become flexibility: compliance and g(0+) stay, frequencies go."""
    narrow = narrowed(MODES, 1e6)
    assert narrow.omega.tolist() == [2e6, 5e6]
    np.testing.assert_allclose(narrow.static_compliance(), MODES.static_compliance(), rtol=1e-12)
    np.testing.assert_allclose(narrow.initial_value(), MODES.initial_value(), rtol=1e-12)
    assert narrow.residual.static()[0, 0] == pytest.approx(2e-11 + (25 / 9e6) ** 2)


def test_a_spring_has_an_error_of_the_time_step_only(scene: Scene) -> None:
    """A mass on a spring: half a sine, peak V sqrt(K m). The march is of first order, the bar covers it."""
    exact = math.sqrt(40e6 * 1e-4)
    striker, spring = striker_of(scene), impact.spring(stiffness=40e6)
    bars = []
    for dt in (4e-8, 2e-8, 1e-8):
        result = run_contacts(scene, striker, spring, dt).seat
        found = error_budget(scene, stated_method(scene), Solved(spring, plane=True), striker, Touches(result))
        assert {source: part["impulse"] for source, part in found.parts.items() if source != "time_step"} == {
            "mesh": 0.0, "reduction": 0.0, "model": 0.0, "patch": 0.0,
        }  # fmt: skip
        assert found.unknown == ()
        assert found.dominant("seat_displacement") == "time_step"
        # the largest displacement is the peak force over K
        error = abs(found.values["seat_displacement"] * 40e6 - exact)
        assert 0 < error <= found.bar("seat_displacement") * 40e6 <= 5 * error
        bars.append(found.bar("seat_displacement"))
    assert np.log2(np.array(bars[:-1]) / bars[1:]) == pytest.approx([1, 1], abs=0.15)


def test_an_error_of_g_becomes_one_of_the_force_not_of_the_impulse(scene: Scene) -> None:
    """K off by 4 %: peak of a mass on a spring off by 2 %, the impulse 2 m V not at all (beyond the step's error)."""
    striker, spring = striker_of(scene), impact.spring(stiffness=40e6)
    result = run_contacts(scene, striker, spring, 1e-8).seat
    found = error_budget(scene, stated_method(scene), Solved(spring, level_error=0.04), striker, Touches(result))
    peak, impulse = (found.parts["model"][name] / found.values[name] for name in ("filtered_peak", "impulse"))
    assert peak == pytest.approx(1 - 1 / math.sqrt(1.04), rel=0.1)
    assert impulse < 2e-3


def test_a_budget_adds_up_and_names_what_dominates() -> None:
    values = dict.fromkeys(all_measures(), 10.0)
    found = Budget(
        values, {"mesh": dict.fromkeys(all_measures(), 0.3), "time_step": dict.fromkeys(all_measures(), 0.1)}, SOURCES
    )
    assert found.bar("impulse") == pytest.approx(SAFETY * 0.4)
    assert found.relative("impulse") == pytest.approx(SAFETY * 0.04)
    assert safety("stress") > safety("impulse") == SAFETY
    assert found.dominant("impulse") == "mesh"
    assert found.unknown == ("reduction", "model", "patch")
    assert bar_keys(found)["error_mesh_impulse_Ns"] == 0.3
    assert (
        Budget(dict.fromkeys(all_measures(), 0.0), {"mesh": dict.fromkeys(all_measures(), 0.1)}).relative("impulse")
        == math.inf
    )


def test_measures_of_no_contact_are_zero(scene: Scene) -> None:
    far = scene.model_copy(update={"contact": scene.contact.model_copy(update={"gap": 1.0})})
    result = run_contacts(far, striker_of(far), impact.spring(stiffness=40e6), 1e-7).seat
    assert set(measured(Touches(result), 1e-6).values()) == {0.0}
