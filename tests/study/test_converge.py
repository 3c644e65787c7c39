"""The loop begins coarse, measures the error of each key by a neighbour, and refines what the target needs."""

import math
from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import pytest

from impact.runs.variations import SAFETY, Budget
from seatfem.structures.reduction import lip_modes
from seatfem.study.ladders import mesh
from seatfem.study.method import (
    BAND,
    MODEL,
    MODES,
    REED_TOLERANCE,
    SIZE,
    STEP,
    TOLERANCE,
    stated_method,
)
from seatfem.study.plan import Refinement
from seatfem.study.runs import converge
from seatfem.study.runs.converge import (
    LEAST,
    MOST,
    MOST_WORK,
    TRIES,
    begin_method,
    begin_plan,
    mark,
    refine_plan,
    work_ratio,
)
from seatfem.study.runs.next_round import Limits
from seatfem.study.runs.round import Round
from seatfem.study.runs.rounds import rounds
from tests.steps import Stopwatch, silent
from tests.study.small_scenes import ANNULAR, BAR, MASS, PLATE, REED, TWO_PORTS, scene_of

pytestmark = pytest.mark.usefixtures("own_store")
FINER = {**dict.fromkeys((SIZE, STEP, TOLERANCE), -1), **dict.fromkeys((BAND, MODES), 1)}
"""Sign of the change of a key that is refined."""


@pytest.fixture
def own_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SEATFEM_STORE", str(tmp_path / "store"))


def loop(scene: Any, folder: Path, most: int = 9) -> list[Round]:
    """Return the rounds of a scene, each as it was yielded last."""
    every = rounds(begin_plan(scene), folder, Stopwatch(), silent, limits=Limits(most))
    return list({done.number: done for done in every}.values())


def round_of(
    parts: Mapping[str, float],
    *,
    target: float = 0.1,
    refined: Mapping[str, tuple[Refinement, ...]] | None = None,
    **given: Any,
) -> Round:
    """Return a round of a mass on a seat with waves, whose impulse of 1 N s has these errors by key."""
    scene = scene_of(ANNULAR, MASS, accuracy={"target": target, "measures": ["impulse"], "landing": "run"}, **given)
    plan = begin_plan(scene)
    plan = replace(plan, method=plan.method.replaced({MODEL: "axisymmetric"}), refined=refined or {})
    by_key = {key: {"impulse": error} for key, error in parts.items()}
    sources: dict[str, dict[str, float]] = {}
    for key, part in by_key.items():
        source = sources.setdefault(converge.source_of(key), {"impulse": 0.0})
        source["impulse"] = math.hypot(source["impulse"], part["impulse"])
    budget = Budget({"impulse": 1.0}, sources, tuple(sources), by_key)
    touches = SimpleNamespace(landings=SimpleNamespace(status="landed"))
    return cast(
        Round, SimpleNamespace(plan=plan, left=budget, judged=("impulse",), number=1, spent={}, touches=touches)
    )


def test_stated_keys_are_kept_and_the_others_begin_coarse() -> None:
    scene = scene_of(
        ANNULAR, REED, seat__mesh={"size": "0.5 mm"}, seat__greens={"bandwidth": "300 kHz"}, run__time_step="0.1 us"
    )
    method = begin_method(scene)
    assert (method.seat.size, method.seat.bandwidth, method.time_step) == (0.5e-3, 300e3, 1e-7)
    assert method.seat.level == "spring"
    finer = stated_method(scene)
    assert (method.reed.n_modes or 0) < (finer.reed.n_modes or 0)


def test_a_stated_model_is_kept() -> None:
    assert begin_method(scene_of(ANNULAR, MASS, seat__model="axisymmetric")).seat.level == "axisymmetric"


@pytest.mark.slow
@pytest.mark.parametrize(("seat", "loose", "strict"), [(ANNULAR, 0.12, 0.02), (PLATE, 0.2, 0.1)])
def test_the_target_is_met_by_what_is_finer_in_every_refined_key(
    seat: str, loose: float, strict: float, tmp_path: Path
) -> None:
    """The values of a coarse and of a strict target agree within their bars."""
    coarse, fine = (
        loop(scene_of(seat, MASS, accuracy={"target": target, "landing": "run"}), tmp_path / str(target))
        for target in (loose, strict)
    )
    for done in (coarse[-1], fine[-1]):
        assert done.met, done.stopped
    assert len(fine) > 1
    for name in coarse[-1].judged:
        one, other = coarse[-1].left, fine[-1].left
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
    first, *_, last = loop(scene, tmp_path)
    assert first.plan.level == "spring"
    assert first.left.by_key[MODEL]["filtered_peak"] > 0.05 / SAFETY * first.left.values["filtered_peak"]
    assert last.plan.level != "spring"
    assert "left" in last.plan.choice(MODEL).reason


def test_errors_are_shared_by_effort_and_small_ones_are_left() -> None:
    """The squares of the errors add up to that of the whole, and are in proportion to efforts."""
    shares = converge._shares({SIZE: 0.3, STEP: 0.2, TOLERANCE: 1e-4}, 0.1**2)
    assert set(shares) == {SIZE, STEP}
    efforts = [converge.ladder_of(key).effort for key in (SIZE, STEP)]  # type: ignore[union-attr]
    assert (shares[SIZE] / shares[STEP]) ** 2 == pytest.approx(efforts[0] / efforts[1])
    assert math.hypot(*shares.values(), 1e-4) == pytest.approx(0.1)


def test_what_misses_the_target_is_marked_and_no_more() -> None:
    marks = mark(round_of({SIZE: 0.2, STEP: 1e-3, TOLERANCE: 1e-4}))
    assert set(marks.factors) == {SIZE}
    assert marks.factors[SIZE] == pytest.approx(min(0.2 / math.sqrt((0.85 * 0.1 / SAFETY) ** 2 - 1.01e-6), MOST))
    assert mark(round_of({SIZE: 0.01})).factors == {}


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
    done = round_of({SIZE: duration, STEP: 0.15})
    by_key = {SIZE: {"impulse": 0.0, "contact_duration": duration}, STEP: {"impulse": 0.15, "contact_duration": 0.0}}
    budget = Budget(
        {"impulse": 1.0, "contact_duration": 1.0}, {"mesh": by_key[SIZE], "time_step": by_key[STEP]}, (), by_key
    )

    def marked(errors: tuple[Mapping[str, float], ...], judged: tuple[str, ...]) -> Round:
        plan = replace(done.plan, earlier_errors=errors)
        known = {"plan": plan, "left": budget, "judged": judged, "number": 3, "spent": {}, "touches": done.touches}
        return cast(Round, SimpleNamespace(**known))

    both = mark(marked(bars, ("impulse", "contact_duration"))).factors
    assert {key: both[key] for key in both.keys() - {STEP}} == factors
    assert STEP in both
    assert SIZE in mark(marked(bars[:1], ("impulse", "contact_duration"))).factors  # one refinement so far
    plan, why = refine_plan(marked(bars, ("contact_duration",)))
    assert (plan is None) == (not factors)
    assert not why or "contact duration is 190 % of its value after 2 refinements" in why


def test_what_the_end_of_the_run_cuts_is_given_up_and_the_rest_is_refined() -> None:
    """An infinite error of a landing that the end cuts asks for a longer run; the peak alone is refined."""
    done = round_of({SIZE: 0.2})
    values = {"landing_impulse": 1.0, "landing_filtered_peak": 1.0}
    parts = {"mesh": {"landing_impulse": math.inf, "landing_filtered_peak": 0.2}}
    by_key = {SIZE: dict.fromkeys(values, 0.2)}

    def of(status: str, *judged: str) -> Round:
        touches = SimpleNamespace(landings=SimpleNamespace(status=status))
        budget = Budget(values, parts, ("mesh",), by_key)
        known = {"plan": done.plan, "left": budget, "judged": judged, "number": 1, "spent": {}, "touches": touches}
        return cast(Round, SimpleNamespace(**known))

    assert SIZE in mark(of("landed", "landing_impulse")).factors
    assert mark(of("cut off", "landing_impulse")).factors == {}
    assert SIZE in mark(of("cut off", *values)).factors
    assert "a longer run.duration includes all of it" in refine_plan(of("cut off", "landing_impulse"))[1]


def test_no_round_refines_a_key_that_the_scene_does_not_have() -> None:
    """The modes of a plate have no tolerance."""
    scene = scene_of(ANNULAR, REED)
    assert not converge.has_key(scene, REED_TOLERANCE)
    method = begin_method(scene)
    assert method.reed.tolerance
    assert converge._refined(scene, method, REED_TOLERANCE, MOST) is method


def test_work_is_bounded_by_what_gains_most() -> None:
    done = round_of({SIZE: 0.3, STEP: 0.3, BAND: 0.3}, target=0.001)
    plan, _ = refine_plan(done)
    assert plan is not None
    assert 1 < max(work_ratio(done.plan.method, plan.method, plan.scene.bodies).values()) <= MOST_WORK


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
    (done,) = loop(scene_of(TWO_PORTS), tmp_path, most=1)
    assert done.seat.greens.modal is not None
    assert most / 1.1**3 < len(done.seat.greens.modal.omega) <= most
    assert done.plan.method.value(BAND) <= min(first, 100e3)
    errors = {name: 0.2 * value for name, value in done.left.values.items()}
    budget = Budget(done.left.values, {"reduction": errors}, ("reduction",), {BAND: errors})
    further, why = refine_plan(replace(done, left=budget))
    assert further is None
    for words in (BAND, "kHz", f"more than {most} modes", "state a longer run.filter_width"):
        assert words in why
