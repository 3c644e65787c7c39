"""What a run begins with and ends with: the file's keys are obeyed, open ones are chosen for the accuracy asked for."""

import itertools
import tomllib
from pathlib import Path

import pytest

from seatfem.study.ladders.table import ladder_of
from seatfem.study.method import MODES, SIZE, STEP, as_stated, is_given, stated_method
from tests.steps import Limits, Stopwatch, begin_plan, converge, rounds, silent
from tests.study.small_scenes import ANNULAR, MASS, REED, SPRING, STEEL, scene_of


@pytest.mark.slow
def test_what_the_file_states_is_obeyed() -> None:
    given = {
        "seat__model": "3d",
        "seat__mesh": {"size": "1.7 mm", "contact_size": "0.37 mm", "order": 1},
        "seat__greens": {"bandwidth": "321 kHz", "tolerance": "3.3 %", "method": "krylov"},
        "reed__n_modes": 23,
        "run__time_step": "77 ns",
    }
    scene = scene_of(ANNULAR, REED, **given)
    plan = begin_plan(scene)
    assert plan.scene == scene
    assert plan.method == stated_method(scene)
    assert all(choice.given for choice in plan.choices if choice.key.startswith(("seat", "reed")))
    for key in (SIZE, STEP, MODES):
        assert ladder_of(key).refine(scene, plan.method, 2.0) == plan.method


def test_what_it_leaves_open_is_filled_by_a_rule() -> None:
    plan = begin_plan(scene_of(ANNULAR, REED, run__time_step="7 ns"))
    assert plan.method.seat.size is not None
    assert plan.method.seat.contact_size is not None
    assert plan.method.time_step == pytest.approx(7e-9)
    for key in ("seat.mesh.size", "seat.greens.bandwidth", "reed.n_modes"):
        choice = plan.choice(key)
        assert not choice.given
        assert choice.reason
    assert plan.choice("run.time_step").given


def test_auto_and_absent_values_are_open() -> None:
    scene = scene_of(ANNULAR, REED, seat__model="auto")
    assert not is_given(scene, "seat.model")
    assert not is_given(scene, "run.time_step")
    assert stated_method(scene).seat.level == "axisymmetric"
    stated = as_stated(scene, stated_method(scene).replaced({"seat.model": "3d", "reed.n_modes": 7}))
    assert stated_method(stated).reed.n_modes == 7
    assert is_given(stated, "seat.model")


@pytest.mark.slow
def test_a_tighter_target_is_never_coarser() -> None:
    plans = [converge(scene_of(SPRING, REED, accuracy__target=target)).plan for target in ("20 %", "3 %", "1 %")]
    for target, plan in zip((0.2, 0.03, 0.01), plans, strict=True):
        assert max(plan.error.values()) <= target
    for loose, tight in itertools.pairwise(plans):
        assert tight.method.time_step <= loose.method.time_step
        assert tight.method.reed.n_modes >= loose.method.reed.n_modes
        assert tight.method != loose.method


@pytest.mark.slow
def test_an_impulse_needs_less_of_the_seat_than_a_peak() -> None:
    impulse, peak = (
        converge(scene_of(ANNULAR, REED, accuracy={"target": "2 %", "measures": [measure]})).plan
        for measure in ("impulse", "filtered_peak")
    )
    assert (impulse.level, peak.level) == ("spring", "axisymmetric")
    assert max(*impulse.error.values(), *peak.error.values()) <= 0.02


@pytest.mark.slow
@pytest.mark.parametrize("steps", [4, 8, 18])
@pytest.mark.parametrize("transits", [0.3, 3.0, 12.0])
def test_a_stated_step_that_misses_the_waves_is_told(transits: float, steps: int, tmp_path: Path) -> None:
    """Longer steps agree with it: only a shorter one tells that waves cross the rod within a step."""
    transit = 10e-6
    width = steps * transits * transit
    rod = 'seat = { kind = "rod", young = "200 GPa", density = "8000 kg/m^3", length = "50 mm", area = "1 mm^2" }'
    run = {"duration": "8 ms", "filter_width": f"{width} s"}
    dear, exact = (
        next(rounds(begin_plan(scene), tmp_path, Stopwatch(), silent, limits=Limits(1))).left
        for scene in (
            scene_of(rod, MASS.replace("5 g", "50 g"), run={**run, "time_step": f"{step} s"})
            for step in (transits * transit, transit / 50)
        )
    )
    for name in ("impulse", "filtered_peak"):
        assert abs(dear.values[name] - exact.values[name]) <= dear.bar(name), name


@pytest.mark.parametrize("factor", [1.0, 3.0])
def test_chosen_steps_end_with_the_run(factor: float) -> None:
    """Steps of the run and of its error bars, up to four times as long, end with it: g may be known no longer."""
    scene = scene_of(SPRING, REED, run__duration="0.7713 ms")
    method = begin_plan(scene).method
    dt = (method if factor == 1 else ladder_of(STEP).refine(scene, method, factor)).time_step
    assert 0.7713e-3 / (4 * dt) == pytest.approx(round(0.7713e-3 / (4 * dt)), abs=1e-9)


@pytest.mark.slow
def test_a_mesh_made_elsewhere_is_not_reduced_over_all_its_band() -> None:
    file = Path(__file__).parents[2] / "meshes" / "annular_seat.msh"
    seat = {"kind": "mesh", "file": str(file), "damping_ratio": 0.05, "material": tomllib.loads(STEEL)["material"]}
    plan = begin_plan(scene_of(REED, seat=seat))
    assert plan.method.seat.size is None
    assert plan.method.seat.bandwidth <= 1e6  # type: ignore[operator]
