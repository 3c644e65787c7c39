"""Error bars of whole scenes against references that are finer in every key: benchmarks/coverage_of_scenes.py.

A cheap scene is run here; those of the committed table are only read.
"""

import operator
from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

import checked_scenes
import coverage_of_scenes
import pytest
from drawn_scenes import SEATS, STRIKERS, draw_scene
from finer_scenes import FINEST, LADDER, Finer, finer_in_every_key
from scenes_summary import in_target, is_inside, is_known, kind_of, share, width
from table import read_rows

from seatfem.structures.kinds import Structure
from seatfem.structures.kinds.drawn import Drawn
from seatfem.study import method as keys
from seatfem.study.method import RunMethod, stated_method
from tests.steps import Method, Scene, load_scene

ROWS = read_rows(coverage_of_scenes.Row, coverage_of_scenes.FILE)
JUDGED = [row for row in ROWS if row.outcome == "judged"]
of_the_table = pytest.mark.skipif(not ROWS, reason="the table is being made: benchmarks/coverage_of_scenes.py")
TRIED = 4  # a seed that nothing was held out of
EXAMPLES = Path(__file__).parents[2] / "examples"


FINER: Mapping[str, Callable[[Any, Any], bool] | None] = {
    **dict.fromkeys((keys.SIZE, keys.CONTACT_SIZE, keys.TOLERANCE, keys.STEP), operator.lt),
    **dict.fromkeys((keys.REED_TOLERANCE, keys.REED_SIZE, keys.REED_CONTACT_SIZE), operator.lt),
    **dict.fromkeys((keys.BAND, keys.SEAT_MODES, keys.MODES, keys.RINGS, keys.PORTS, keys.REED_BAND), operator.gt),
    **dict.fromkeys((keys.ORDER, keys.STOPPER_ARCS, keys.STOPPER_RINGS), operator.ge),
    keys.MODEL: lambda new, _: new not in ("spring", "rod"),
    keys.REDUCTION: None,
}
"""What is finer of each key that a plan may choose, (new, old); ``None``: which of several ways leads to the same."""


def sized(seat: Structure, method: Method) -> Method:
    """Return the method with the sizes of elements that it leaves to the band."""
    if not isinstance(seat, Drawn) or method.exact:
        return method
    spec = seat.mesh_spec(replace(method, level=seat.discrete(method.level)))
    return replace(method, size=spec.size, contact_size=spec.patch_size)


def coarser_keys(scene: Scene, method: RunMethod, by: Finer) -> list[str]:
    """Return the keys that a reference has no finer than a run by the method."""
    finer, how = finer_in_every_key(scene, method, by)
    if scene.seat.elastic is not None and method.seat.level in ("spring", "rod"):
        method = replace(method, seat=replace(method.seat, level=scene.seat.discrete(method.seat.level)))  # type: ignore[attr-defined]
    before = replace(method, seat=sized(scene.seat, method.seat))
    unlike = [key for key, finer_than in FINER.items() if finer_than and _is_chosen(scene, before, key)]
    bad = [key for key in unlike if not FINER[key](how.value(key), before.value(key))]  # type: ignore[misc]
    pairs = {"reed": (scene.reed, finer.reed)}
    if scene.stopper is not None and finer.stopper is not None:
        pairs["stopper"] = (scene.stopper.body, finer.stopper.body)
    for role, (body, other) in pairs.items():
        old, new = sized(body, body.stated()), sized(other, other.stated())
        for name in ("size", "contact_size", "tolerance", "n_modes"):
            finer_than = operator.gt if name == "n_modes" else operator.lt
            is_of_it = name != "tolerance" or hasattr(getattr(body, "greens", None), "tolerance")
            if is_of_it and getattr(old, name) is not None and not finer_than(getattr(new, name), getattr(old, name)):
                bad.append(f"{role}.{name}")
        if old.bandwidth is not None and not new.bandwidth > old.bandwidth:
            bad.append(f"{role}.bandwidth")
    return bad


def _is_chosen(scene: Scene, method: RunMethod, key: str) -> bool:
    """Return whether the key says anything of a run of the scene."""
    if method.value(key) is None:
        return False
    if key == keys.RINGS:
        return scene.seat.elastic is not None
    if key == keys.REED_TOLERANCE:
        return scene.reed.elastic is not None and scene.reed.traits.is_reduced
    has_band = method.seat.bandwidth is not None
    return has_band if key in (keys.MODEL, keys.TOLERANCE, keys.ORDER) else True


def test_every_key_that_a_plan_may_choose_is_looked_at() -> None:
    assert set(FINER) == set(keys.FIELDS)


@pytest.mark.parametrize("index", range(len(SEATS)))
def test_references_are_finer_in_every_key(index: int, tmp_path: Path) -> None:
    scene = load_scene(draw_scene(index, TRIED).write(tmp_path))
    for by in (LADDER[0], LADDER[-1]):
        assert coarser_keys(scene, replace(stated_method(scene), time_step=1e-7), by) == []


@pytest.mark.parametrize("name", [each.name for each in fields(Finer) if each.name not in ("reduction", "rings")])
def test_a_key_that_is_not_finer_is_seen(name: str, tmp_path: Path) -> None:
    scenes = (EXAMPLES / "life_of_a_flapper.toml", EXAMPLES / "flapper_on_stopper.toml", EXAMPLES / "ball_on_seat.toml")
    same = replace(FINEST, **{name: 0 if name in ("across", "divides") else 1})
    seen = [
        coarser_keys(scene, replace(stated_method(scene), time_step=1e-7), same) for scene in map(load_scene, scenes)
    ]
    if name == "modes":
        same = replace(same, modes=0.0)
        modes = replace(stated_method(load_scene(scenes[1])), time_step=1e-7)
        modes = replace(modes, reed=replace(modes.reed, n_modes=70))
        seen.append(coarser_keys(load_scene(scenes[1]), modes, same))
    assert any(seen)


@pytest.mark.slow
def test_the_true_error_is_inside_the_bar() -> None:
    rows = coverage_of_scenes.judge(18, TRIED)
    assert {row.outcome for row in rows} == {"judged"}
    assert [row.measure for row in rows if row.inside == "False"] == []


@of_the_table
def test_enough_scenes_were_judged() -> None:
    """The judged scenes are 110 or more and have every kind of seat and striker that is drawn."""
    scenes = {(row.seed, row.index): row for row in JUDGED}
    assert len(scenes) >= 110
    assert {row.seat for row in scenes.values()} == set(SEATS)
    assert {row.reed for row in scenes.values()} == set(STRIKERS)


@of_the_table
def test_true_errors_are_inside_the_bars() -> None:
    comparable = [row for row in JUDGED if row.asked and is_known(row)]
    assert share(comparable, is_inside) >= 0.97


@of_the_table
@pytest.mark.parametrize(("measure", "most"), [("impulse", 6.0), ("filtered_peak", 7.0)])
def test_bars_are_no_wider_than_they_need_be(measure: str, most: float) -> None:
    """The bars of impulses are at most 6 times their errors, those of peaks 7 times, in the median."""
    assert width([row for row in JUDGED if row.asked and kind_of(row) == measure]) <= most


@of_the_table
def test_bars_are_within_the_target() -> None:
    """Four in five bars of scenes that state neither mesh nor band meet the target, also where a lip is met in arcs."""
    planned = [row for row in JUDGED if row.asked == "measures" and not row.stated]
    assert share(planned, in_target) >= 0.8
    assert share([row for row in planned if "in arcs" in row.about], in_target) >= 0.75


def test_the_package_has_the_counts_of_the_tables() -> None:
    """Reports show them; `python benchmarks/checked_scenes.py` writes them."""
    assert checked_scenes.FILE.read_text(encoding="utf-8") == checked_scenes.checked_scenes()
    page = coverage_of_scenes.PAGE.read_text(encoding="utf-8")
    assert [heading for heading in checked_scenes.SECTIONS if f"\n## {heading}\n" not in page] == []


@of_the_table
def test_the_table_is_of_the_scenes_drawn_today() -> None:
    """A change of the draw without new runs must not pass."""
    for row in {(row.seed, row.index): row for row in ROWS}.values():
        drawn = draw_scene(row.index, row.seed)
        assert (drawn.seat, drawn.reed, drawn.about) == (row.seat, row.reed, row.about)
