"""A run obeys the file's keys, begins coarse in open ones, measures each error by a neighbour, and refines as asked."""

import itertools
import math
import tomllib
from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from seatfem.structures.reduction import lip_modes
from seatfem.study.ladders import mesh
from seatfem.study.ladders.table import ladder_of
from seatfem.study.method import BAND, MODEL, MODES, SIZE, STEP, TOLERANCE, stated_method
from seatfem.study.plan import Refinement
from seatfem.study.runs import converge
from seatfem.study.runs.converge import LEAST, MOST, MOST_WORK, TRIES, mark, refine_plan, work_ratio
from seatfem.study.runs.forecast import converge as converge_scene
from tests.steps import SAFETY, Budget, Round, begin_plan
from tests.study.small_scenes import ANNULAR, BAR, MASS, PLATE, REED, SPRING, STEEL, TWO_PORTS, rounds_of, scene_of

FINER = {**dict.fromkeys((SIZE, STEP, TOLERANCE), -1), **dict.fromkeys((BAND, MODES), 1)}
"""Sign of the change of a key that is refined."""


def round_of(
    errors: Mapping[str, float | Mapping[str, float]],
    judged: tuple[str, ...] = ("impulse",),
    status: str = "landed",
    number: int = 1,
    **of_plan: Any,
) -> Round:
    """Return a round of a mass on a seat with waves, whose measures of 1 have these errors by key."""
    plan = begin_plan(scene_of(ANNULAR, MASS, accuracy={"target": 0.1, "measures": ["impulse"], "landing": "run"}))
    plan = replace(plan, method=plan.method.replaced({MODEL: "axisymmetric"}), **of_plan)
    by_key = {
        key: error if isinstance(error, Mapping) else dict.fromkeys(judged, error) for key, error in errors.items()
    }
    parts = {converge.source_of(key): part for key, part in by_key.items()}
    budget = Budget({name: 1.0 for part in parts.values() for name in part}, parts, tuple(parts), by_key)
    touches = SimpleNamespace(landings=SimpleNamespace(status=status))
    known = {"plan": plan, "budget": budget, "judged": judged, "number": number, "spent": {}, "touches": touches}
    return cast(Round, SimpleNamespace(**known))


@pytest.mark.slow
@pytest.mark.parametrize(("seat", "loose", "strict"), [(ANNULAR, 0.12, 0.02), (PLATE, 0.2, 0.1)])
def test_the_target_is_met_by_what_is_finer_in_every_refined_key(
    seat: str, loose: float, strict: float, tmp_path: Path
) -> None:
    """The values of a coarse and of a strict target agree within their bars."""
    coarse, fine = (
        rounds_of(
            begin_plan(scene_of(seat, MASS, accuracy={"target": target, "landing": "run"})),
            tmp_path / str(target),
            rounds=9,
        )
        for target in (loose, strict)
    )
    for done in (coarse[-1], fine[-1]):
        assert done.met, done.stopped
    assert len(fine) > 1
    for name in coarse[-1].judged:
        one, other = coarse[-1].budget, fine[-1].budget
        assert abs(one.values[name] - other.values[name]) <= one.bar(name) + other.bar(name)
    for before, after in pairwise(fine):
        old, new = before.plan.method, after.plan.method
        assert (
            max(work_ratio(old, new, before.plan.scene.bodies).values()) <= MOST_WORK
            or old.seat.level != new.seat.level
        )
        for key, sign in FINER.items():
            if old.value(key) and new.value(key):
                assert sign * (new.value(key) - old.value(key)) >= 0


@pytest.mark.slow
def test_a_spring_is_dismissed_where_waves_count(tmp_path: Path) -> None:
    """The plan's spring is replaced when the waves of a long bar return while the contact lasts."""
    scene = scene_of(BAR, MASS, accuracy={"target": 0.05, "landing": "run"})
    first, *_, last = rounds_of(begin_plan(scene), tmp_path, rounds=9)
    assert first.plan.level == "spring"
    assert first.budget.by_key[MODEL]["filtered_peak"] > 0.05 / SAFETY * first.budget.values["filtered_peak"]
    assert last.plan.level != "spring"
    assert "left" in last.plan.choice(MODEL).reason


def test_keys_that_hide_each_other_are_refined_together() -> None:
    """The error of the mesh has hardly fallen by its last refinement: the tolerance is refined, too, by the least."""
    done = round_of({SIZE: 0.2}, refined={SIZE: (Refinement(0.25, 4.0),)})
    assert set(mark(done).factors) == {SIZE, TOLERANCE}
    assert mark(done).factors[TOLERANCE] == LEAST < mark(done).factors[SIZE]
    assert set(mark(round_of({SIZE: 0.2}, refined={SIZE: (Refinement(0.5, 4.0),)})).factors) == {SIZE}


@pytest.mark.parametrize("error", [0.2, math.inf])
def test_an_error_that_does_not_converge_is_given_up(error: float) -> None:
    """An unknown error counts as the value itself, and is given up likewise."""
    done = round_of({SIZE: error}, refined={SIZE: (Refinement(1.05 * error, 2.0),) * TRIES})
    assert refine_plan(done)[0] is None


@pytest.mark.parametrize(("before", "duration", "factors"), [((0.76, 2.5), 1.1, {}), ((0.76, 2.5), 0.5, {SIZE: MOST})])
def test_a_measure_whose_bar_exceeds_its_value_is_given_up(
    before: tuple[float, ...], duration: float, factors: Mapping[str, float]
) -> None:
    """Two refinements have left a duration of 1 s with a bar of 1.87 s, or of 0.85 s; the impulse is refined on."""
    bars = tuple({"impulse": 0.3, "contact_duration": bar} for bar in before)
    by_key = {SIZE: {"impulse": 0.0, "contact_duration": duration}, STEP: {"impulse": 0.15, "contact_duration": 0.0}}

    def after(errors: tuple[Mapping[str, float], ...], *judged: str) -> Round:
        return round_of(by_key, judged, number=3, earlier_errors=errors)

    both = mark(after(bars, "impulse", "contact_duration")).factors
    assert {key: both[key] for key in both.keys() - {STEP}} == factors
    assert STEP in both
    assert SIZE in mark(after(bars[:1], "impulse", "contact_duration")).factors  # one refinement so far
    plan, why = refine_plan(after(bars, "contact_duration"))
    assert (plan is None) == (not factors)
    assert not why or "contact duration is 190 % of its value after 2 refinements" in why


def test_what_the_end_of_the_run_cuts_is_given_up_and_the_rest_is_refined() -> None:
    """An infinite error of a landing that the end cuts asks for a longer run; the peak alone is refined."""
    errors = {SIZE: {"landing_impulse": math.inf, "landing_filtered_peak": 0.2}}
    cut = round_of(errors, ("landing_impulse",), "cut off")
    assert SIZE in mark(round_of(errors, ("landing_impulse",))).factors
    assert mark(cut).factors == {}
    assert SIZE in mark(round_of(errors, tuple(errors[SIZE]), "cut off")).factors
    assert "a longer run.duration includes all of it" in refine_plan(cut)[1]


@pytest.mark.slow
@pytest.mark.parametrize(("most", "first"), [(60, 400e3), (80, 100e3)])
def test_bands_end_where_a_seat_in_segments_has_too_many_modes(
    most: int, first: float, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The first band is narrowed to one with at most 60 modes; that of 100 kHz, with 66 of 80, is not widened. No round
    fails, and the last words name key, value, limit and remedy."""
    for module in (lip_modes, converge):
        monkeypatch.setattr(module, "MOST_MODES", most)
    monkeypatch.setattr(mesh, "lowest_band", lambda patch: first)
    (done,) = rounds_of(begin_plan(scene_of(TWO_PORTS)), tmp_path, rounds=1)
    assert done.seat.greens.modal is not None
    assert most / 1.1**3 < len(done.seat.greens.modal.omega) <= most
    assert done.plan.method.value(BAND) <= min(first, 100e3)
    errors = {name: 0.2 * value for name, value in done.budget.values.items()}
    budget = Budget(done.budget.values, {"reduction": errors}, ("reduction",), {BAND: errors})
    further, why = refine_plan(replace(done, budget=budget))
    assert further is None
    for words in (BAND, "kHz", f"more than {most} modes", "state a longer run.filter_width"):
        assert words in why


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
        assert ladder_of(key).refine(plan, 2.0) == plan.method


@pytest.mark.slow
def test_a_tighter_target_is_never_coarser() -> None:
    plans = [converge_scene(scene_of(SPRING, REED, accuracy__target=target)).plan for target in ("20 %", "3 %", "1 %")]
    for target, plan in zip((0.2, 0.03, 0.01), plans, strict=True):
        assert max(plan.error.values()) <= target
    for loose, tight in itertools.pairwise(plans):
        assert tight.method.time_step <= loose.method.time_step
        assert tight.method.reed.n_modes >= loose.method.reed.n_modes
        assert tight.method != loose.method


@pytest.mark.slow
def test_an_impulse_needs_less_of_the_seat_than_a_peak() -> None:
    impulse, peak = (
        converge_scene(scene_of(ANNULAR, REED, accuracy={"target": "2 %", "measures": [measure]})).plan
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
        rounds_of(begin_plan(scene), tmp_path, rounds=1)[-1].budget
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
    plan = begin_plan(scene)
    dt = (plan.method if factor == 1 else ladder_of(STEP).refine(plan, factor)).time_step
    assert 0.7713e-3 / (4 * dt) == pytest.approx(round(0.7713e-3 / (4 * dt)), abs=1e-9)


@pytest.mark.slow
def test_a_mesh_made_elsewhere_is_not_reduced_over_all_its_band() -> None:
    file = Path(__file__).parents[2] / "meshes" / "annular_seat.msh"
    seat = {"kind": "mesh", "file": str(file), "damping_ratio": 0.05, "material": tomllib.loads(STEEL)["material"]}
    plan = begin_plan(scene_of(REED, seat=seat))
    assert plan.method.seat.size is None
    assert plan.method.seat.bandwidth <= 1e6  # type: ignore[operator]
