"""Plans: what the file states is obeyed, what it leaves open is chosen for the accuracy asked for."""

import itertools
import tomllib
from collections.abc import Mapping
from dataclasses import replace
from functools import cache as cached
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import impact
from impact.greens.modal import ModalGreens, Residual
from seatfem.faces.cli import BAD_INPUT, DONE, run_command
from seatfem.structures import cache
from seatfem.structures.estimates.surrogate import Sizes, Surrogate, mesh_error, sizes_for
from seatfem.study.impacts.bodies import problem_of
from seatfem.study.impacts.contact import record_of
from seatfem.study.impacts.touches import SOURCES, values_of_record
from seatfem.study.ladders.level import changes_on, without_waves
from seatfem.study.method import BAND, STEP, RunMethod, as_stated, is_given, stated_method
from seatfem.study.planning.deciding import Choices, Decision
from seatfem.study.prerun import context, lips
from seatfem.study.prerun.bench import Bench, advanced, locate_contact_window
from seatfem.study.prerun.context import BANDS, PlanningContext, coarse_method
from seatfem.study.prerun.sensitivity import Rung, Sensitivity, no_better_than_finer
from seatfem.study.safety import AIM, DOUBT_OF_COARSE, FREE, MUCH_SHORTER, SIMPLER
from seatfem.study.scene import load
from tests.as_stated import seat_of, striker_of
from tests.steps import SAFETY, ModelError, Plan, Scene, Store, plan_scene, refine

STEEL = 'material = { young = "200 GPa", poisson = 0.3, density = "7850 kg/m^3" }'
ANNULAR = f"""
seat = {{ kind = "annular", bore_radius = "4 mm", lip_width = "1 mm", damping_ratio = 0.05, {STEEL} }}
"""
BAR = f"""
seat = {{ kind = "bar", length = "40 mm", width = "4 mm", height = "4 mm", damping_ratio = 0.02, {STEEL} }}
"""
PLATE = f"""
seat = {{ kind = "plate", ports = 4, port_radius = "3 mm", pitch = "10 mm", margin = "5 mm", thickness = "3 mm", \
    land_width = "1 mm", clamp_width = "2 mm", damping_ratio = 0.02, {STEEL} }}
"""
SPRING = 'seat = { kind = "spring", stiffness = "27.8 N/um" }'
REED = """
reed = { kind = "cantilever", length = "25.4 mm", damping_ratio = 0.03, release = { tip_deflection = "1 mm" } }
run = { duration = "1 ms" }
"""
MASS = """
reed = { kind = "rigid_mass", mass = "5 g", velocity = "-1 m/s" }
run = { duration = "0.1 ms", filter_width = "4 us" }
"""


def scene_of(*parts: str, **changes: object) -> Scene:
    """Tables put together; ``changes``: dotted keys with _ for the dot between table and key."""
    data: dict[str, Any] = tomllib.loads("\n".join(parts))
    for dotted, value in changes.items():
        *tables, key = dotted.split("__")
        table = data
        for name in tables:
            table = table.setdefault(name, {})
        table[key] = value
    return load.scene_of().model_validate(data)


@pytest.fixture(autouse=True)
def own_store(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SEATFEM_STORE", str(tmp_path / "store"))


def key_of(plan: Plan) -> str:
    return cache.key_of(plan.scene.seat, plan.method.seat)


def memory(scene: Scene, method: RunMethod) -> float:
    return scene.seat.memory(method.seat, scene.run.duration)


def with_stated(scene: Scene, values: Mapping[str, object]) -> Scene:
    """As if the file stated them."""
    return as_stated(scene, stated_method(scene).replaced(values))


class TestKeys:
    @pytest.mark.slow
    def test_what_the_file_states_is_obeyed(self) -> None:
        given = {
            "seat__model": "3d",
            "seat__mesh": {"size": "1.7 mm", "contact_size": "0.37 mm", "order": 1},
            "seat__greens": {"bandwidth": "321 kHz", "tolerance": "3.3 %", "method": "krylov"},
            "reed__n_modes": 23,
            "run__time_step": "77 ns",
        }
        scene = scene_of(ANNULAR, REED, **given)
        plan = plan_scene(scene)
        assert plan.scene == scene
        assert plan.method == stated_method(scene)
        assert all(choice.given for choice in plan.choices if choice.key.startswith(("seat", "reed")))

    @pytest.mark.slow
    def test_what_it_leaves_open_is_filled_with_a_reason(self) -> None:
        plan = plan_scene(scene_of(ANNULAR, REED, run__time_step="7 ns"))
        seat = plan.method.seat
        assert seat.level == plan.level
        assert seat.size is not None
        assert seat.contact_size is not None
        assert plan.method.time_step == pytest.approx(7e-9)
        for key in ("seat.mesh.size", "seat.greens.bandwidth", "reed.n_modes"):
            choice = plan.choice(key)
            assert not choice.given
            assert any(character.isdigit() for character in choice.reason + choice.leaves)
        assert plan.choice("run.time_step").given

    @pytest.mark.slow
    def test_what_a_plan_chooses_can_be_stated(self) -> None:
        plan = plan_scene(scene_of(ANNULAR, REED))
        assert plan_scene(as_stated(plan.scene, plan.method)).method == plan.method

    def test_auto_and_absent_values_are_open(self) -> None:
        scene = scene_of(ANNULAR, REED, seat__model="auto")
        assert not is_given(scene, "seat.model")
        assert not is_given(scene, "run.time_step")
        assert stated_method(scene).seat.level == "axisymmetric"
        assert stated_method(with_stated(scene, {"seat.model": "3d", "reed.n_modes": 7})).reed.n_modes == 7
        assert is_given(with_stated(scene, {"seat.model": "3d"}), "seat.model")


class TestTargets:
    @pytest.mark.slow
    @pytest.mark.parametrize("parts", [(ANNULAR, REED), (SPRING, REED), (BAR, MASS)])
    def test_a_tighter_target_is_never_coarser(self, parts: tuple[str, ...]) -> None:
        plans = [plan_scene(scene_of(*parts, accuracy__target=target)) for target in ("5 %", "1 %", "0.3 %")]
        for loose, tight in itertools.pairwise(plans):
            one, other = loose.method, tight.method
            assert other.time_step <= one.time_step
            assert (other.reed.n_modes or 0) >= (one.reed.n_modes or 0)
            assert max(tight.error.values()) <= max(loose.error.values())

    @pytest.mark.slow
    def test_the_prediction_meets_the_target(self) -> None:
        plan = plan_scene(scene_of(ANNULAR, REED, accuracy__target="1 %"))
        assert plan.meets_target
        for measure, error in plan.error.items():
            assert error == pytest.approx(SAFETY * sum(share[measure] for share in plan.shares.values()))
            assert 0 <= error <= 0.01

    @pytest.mark.slow
    def test_an_impulse_needs_less_of_the_seat_than_a_peak(self) -> None:
        impulse, peak, displacement = (
            plan_scene(scene_of(ANNULAR, REED, accuracy={"target": "1 %", "measures": [measure]}))
            for measure in ("impulse", "filtered_peak", "seat_displacement")
        )
        assert impulse.level == "spring"
        assert peak.level == displacement.level == "axisymmetric"
        assert impulse.method.seat.size >= peak.method.seat.size  # type: ignore[operator]
        assert displacement.method.seat.bandwidth > impulse.method.seat.bandwidth  # type: ignore[operator]
        assert displacement.method.seat.tolerance <= peak.method.seat.tolerance
        assert impulse.cost.seconds <= peak.cost.seconds

    @pytest.mark.slow
    def test_a_long_bar_is_a_rod_for_slow_measures_and_a_solid_for_fast_ones(self) -> None:
        slow = plan_scene(scene_of(BAR, MASS, accuracy={"target": "5 %", "measures": ["impulse"]}))
        fast = plan_scene(scene_of(BAR, MASS, accuracy={"target": "2 %", "measures": ["filtered_peak"]}))
        assert slow.level == "rod"
        assert fast.level == "sector"

    @pytest.mark.slow
    def test_alternatives_cost_and_err_otherwise(self) -> None:
        plan = plan_scene(scene_of(PLATE, REED, accuracy={"target": "5 %", "measures": ["filtered_peak"]}))
        assert plan.alternatives
        for other in plan.alternatives:
            assert other.error != plan.error
            assert other.cost.seconds > 0

    @pytest.mark.slow
    def test_what_is_out_of_reach_is_said(self) -> None:
        plan = plan_scene(scene_of(PLATE, REED, accuracy={"target": "0.1 %", "measures": ["seat_displacement"]}))
        assert not plan.meets_target
        assert any("will be missed" in note for note in plan.notes)
        assert any("seat.mesh.size" in note for note in plan.notes)

    @pytest.mark.parametrize("steps", [4, 8, 18])
    @pytest.mark.parametrize("transits", [0.3, 3.0, 12.0])
    def test_a_stated_step_that_misses_the_waves_is_told(self, transits: float, steps: int) -> None:
        """Longer steps agree with it: only a shorter one tells that waves cross the rod within a step."""
        transit = 10e-6
        width = steps * transits * transit
        rod = 'seat = { kind = "rod", young = "200 GPa", density = "8000 kg/m^3", length = "50 mm", area = "1 mm^2" }'
        scene = scene_of(rod, MASS.replace("5 g", "50 g"), run={"duration": "8 ms", "filter_width": f"{width} s"})
        coarse, fine = with_stated(scene, {STEP: transits * transit}), with_stated(scene, {STEP: transit / 50})
        plan = plan_scene(coarse)
        seat = scene.seat.surrogate(scene.run.duration, scene.reed.face).greens
        rough, exact = (
            values_of_record(record_of(s, problem_of(s, striker_of(s), impact.Body(seat)), s.run.time_step or 0.0))
            for s in (coarse, fine)
        )
        for name, bar in plan.error.items():
            assert abs(rough[name] - exact[name]) <= bar * abs(rough[name]), name

    @pytest.mark.slow
    def test_a_seat_that_hardly_counts_is_told(self) -> None:
        """Where twice or half its stiffness changes less than is asked for, a guess would do."""
        loose, tight = (plan_scene(scene_of(ANNULAR, REED, accuracy__target=target)) for target in ("10 %", "0.5 %"))
        told = [any("hardly matters" in note for note in plan.notes) for plan in (loose, tight)]
        assert told == [True, False]

    def test_a_contact_far_longer_than_the_filter_is_planned_too(self) -> None:
        """A soft spring under a short filter: no pre-run can march all of it; errors go on as the order says."""
        soft = SPRING.replace("27.8 N/um", "15 N/m")
        plan = plan_scene(scene_of(soft, MASS, run={"duration": "90 us", "filter_width": "10 ns"}))
        assert plan.method.time_step <= 10e-9 / 4

    @pytest.mark.slow
    def test_chosen_steps_end_with_the_run(self) -> None:
        """Also those of the error bars, twice and four times as long: what is known of g may end there."""
        dt = plan_scene(scene_of(SPRING, REED, run__duration="0.7713 ms")).method.time_step
        assert 0.7713e-3 / (4 * dt) == pytest.approx(round(0.7713e-3 / (4 * dt)), abs=1e-9)

    @pytest.mark.slow(but="1")
    @pytest.mark.parametrize("n_modes", [1, 2, 3, 5, 8])
    def test_few_modes_of_the_reed_are_known_to_leave_much_out(self, n_modes: int) -> None:
        """What leaving out some of them would not tell: of a single one, nothing at all."""
        scene = scene_of(SPRING, REED, reed__n_modes=n_modes, run__time_step="20 ns")
        seat = scene.seat.surrogate(scene.run.duration, scene.reed.face).greens
        few, truth = (
            values_of_record(record_of(scene, problem_of(scene, striker_of(scene, n), impact.Body(seat)), 20e-9))
            for n in (n_modes, 150)
        )
        off = abs(few["filtered_peak"] - truth["filtered_peak"])
        assert off <= plan_scene(scene).error["landing_filtered_peak"] * few["filtered_peak"]

    @pytest.mark.slow
    def test_a_mesh_made_elsewhere_is_not_reduced_over_all_its_band(self) -> None:
        file = Path(__file__).parents[2] / "meshes" / "annular_seat.msh"
        seat = {"kind": "mesh", "file": str(file), "damping_ratio": 0.05, "material": tomllib.loads(STEEL)["material"]}
        plan = plan_scene(scene_of(REED, seat=seat))
        assert plan.method.seat.size is None
        assert plan.method.seat.bandwidth <= 1e6  # type: ignore[operator]

    @pytest.mark.slow
    def test_no_contact_is_said(self) -> None:
        """And nothing else of the answer: no bar of what does not move, no word of how little the seat counts."""
        every = {"target": "0.1 %", "measures": ["impulse", "filtered_peak", "contact_duration", "seat_displacement"]}
        for seat in (SPRING, ANNULAR):
            plan = plan_scene(scene_of(seat, REED, run__duration="0.1 ms", accuracy=every))
            *of_the_lip, note = plan.notes
            assert all(each.startswith("the reed covers") for each in of_the_lip)
            assert "no contact" in note
            assert plan.error == {f"landing_{name}": 0.0 for name in every["measures"]}

    @pytest.mark.slow
    def test_a_contact_late_in_a_run_under_a_short_filter_is_seen(self) -> None:
        plan = plan_scene(scene_of(SPRING, REED, run={"duration": "1 ms", "filter_width": "10 ns"}))
        assert not any("no contact" in note for note in plan.notes)
        assert plan.error["landing_filtered_peak"] > 0

    def test_a_duration_is_known_to_a_step_at_best(self) -> None:
        """As the run's own bar has it."""
        wanted = {"target": "5 %", "measures": ["contact_duration"]}
        scene = scene_of(SPRING, MASS, accuracy=wanted, run__time_step="2 us")
        seat = scene.seat.surrogate(scene.run.duration, scene.reed.face).greens
        duration = Bench(scene, seat, locate_contact_window(scene, seat))
        least = 2e-6 / duration.measures(dt=0.1e-6)["contact_duration"]
        assert plan_scene(scene).error["landing_contact_duration"] >= 0.99 * SAFETY * least

    @pytest.mark.slow
    def test_the_history_is_told_as_it_will_be(self) -> None:
        undamped, damped = (BAR.replace("0.02", ratio) for ratio in ("0.0", "0.02"))
        for bar, poles in ((undamped, False), (damped, True)):
            plan = plan_scene(scene_of(bar, MASS, accuracy={"target": "5 %", "measures": ["impulse"]}))
            assert plan.level == "rod"
            assert (plan.choice("history").value == "poles") is poles
        assert "faster here than recursion over 9,300 modes" in plan.choice("history").reason

    @pytest.mark.slow
    @pytest.mark.parametrize(
        ("support", "method", "poles"),
        [
            ("", "auto", True),
            ("", "second_order", False),
            ("", "transient", False),
            ('kind = "dashpot"\non = "contact"\nnormal = "1e6 N*s/m^3"', "auto", False),
            ('kind = "foundation"\non = "contact"\nnormal = "1e13 N/m^3"', "auto", True),
        ],
    )
    def test_the_history_of_a_seat_that_is_convolved(self, support: str, method: str, poles: bool) -> None:
        """Complex poles and samples have step weights: there is no recursion to be exact."""
        seat = ANNULAR.replace("0.05", "0.0") if method == "transient" else ANNULAR
        supports = [tomllib.loads(support)] if support else []
        plan = plan_scene(
            scene_of(seat, REED, accuracy__target="5 %", seat__greens__method=method, seat__supports=supports)
        )
        history = plan.choice("history")
        assert (history.value == "poles") is poles
        assert ("modal recursion" in history.reason) is poles
        assert ("general method" in history.reason) is not poles

    @pytest.mark.slow
    def test_a_material_that_grows_wide_under_tension_is_planned_too(self) -> None:
        plan = plan_scene(scene_of(ANNULAR.replace("0.3,", "-0.3,"), REED))
        assert plan.meets_target


class TestRefining:
    @pytest.mark.slow
    def test_each_source_has_a_key_that_is_made_finer(self) -> None:
        plan = plan_scene(scene_of(ANNULAR, REED))
        finer = {source: refine(plan, source, 2.0) for source in SOURCES}
        old = plan.method
        for source, new in finer.items():
            assert max(new.error.values()) < max(plan.error.values()), source
        mesh, reduction, step, model, patch = (found.method for found in finer.values() if found is not None)
        assert mesh.seat.size == pytest.approx(old.seat.size / 2, rel=0.06)  # type: ignore[operator]
        assert reduction.seat.bandwidth > 1.5 * old.seat.bandwidth  # type: ignore[operator]
        assert step.time_step == pytest.approx(old.time_step / 2)  # type: ignore[operator]
        assert model.reed.n_modes >= 1.4 * old.reed.n_modes  # type: ignore[operator]
        assert (old.seat.rings, patch.seat.rings) == (1, 4)

    @pytest.mark.slow
    def test_a_spring_that_leaves_too_much_out_gives_way_to_waves(self) -> None:
        plan = plan_scene(scene_of(ANNULAR, REED, accuracy={"target": "1 %", "measures": ["impulse"]}))
        finer = refine(plan, "model")
        assert plan.level == "spring"
        assert finer.level == "axisymmetric"
        again = refine(finer, "model")
        assert again.level == "axisymmetric"
        assert again.method.reed.n_modes > finer.method.reed.n_modes  # type: ignore[operator]

    @pytest.mark.slow
    def test_elements_stay_no_smaller_than_those_stated_at_the_contact(self) -> None:
        plan = plan_scene(scene_of(ANNULAR, REED, seat__mesh={"contact_size": "2 mm"}))
        once = replace(plan, method=plan.method.replaced({"seat.mesh.size": 3e-3}))
        finer = refine(once, "mesh", 4.0)
        assert finer.method.seat.size == 2e-3
        assert refine(finer, "mesh") is None

    @pytest.mark.slow
    def test_a_round_that_keeps_its_seat_costs_no_seat(self) -> None:
        plan = plan_scene(scene_of(PLATE, REED, accuracy={"target": "5 %", "measures": ["seat_displacement"]}))
        step, mesh = refine(plan, "time_step"), refine(plan, "mesh")
        assert "mesh" not in step.cost.parts
        assert step.cost.seconds < plan.cost.seconds < mesh.cost.seconds

    def test_a_given_key_is_not_refined(self) -> None:
        plan = plan_scene(scene_of(SPRING, REED, run__time_step="50 ns", reed__n_modes=20))
        for source in SOURCES:
            assert refine(plan, source) is None


class TestSeatsAtHand:
    @pytest.mark.slow
    def test_different_contacts_share_a_seat(self, tmp_path: Path) -> None:
        """Either both need the same seat, or the finer one serves both."""
        store = Store(tmp_path / "kept")
        softer = {"reed__release": {"tip_deflection": "0.83 mm"}, "reed__damping_ratio": 0.025}
        plans = [plan_scene(scene_of(ANNULAR, REED, **more), store=store) for more in ({}, softer)]
        fine, coarse = sorted(plans, key=lambda plan: plan.method.seat.tolerance)
        self.keep(fine, store)
        assert key_of(plan_scene(coarse.scene, store=store)) == key_of(fine)
        assert fine.method != coarse.method

    @pytest.mark.slow
    @pytest.mark.parametrize("target", ["1 %", "5 %"])
    def test_a_seat_at_least_as_fine_is_used(self, target: str, tmp_path: Path) -> None:
        store = Store(tmp_path / "kept")
        waves = {"seat__model": "axisymmetric"}
        fine = plan_scene(scene_of(ANNULAR, REED, accuracy__target="1 %", **waves), store=store)
        assert not fine.kept
        self.keep(fine, store)
        again = plan_scene(scene_of(ANNULAR, REED, accuracy__target=target, **waves), store=store)
        assert again.kept
        assert key_of(again) == key_of(fine)
        assert again.cost.seconds < fine.cost.seconds
        assert "store" in again.choice("seat").reason

    @pytest.mark.slow
    def test_a_seat_that_is_too_coarse_or_too_short_is_not(self, tmp_path: Path) -> None:
        store = Store(tmp_path / "kept")
        self.keep(plan_scene(scene_of(ANNULAR, REED, accuracy__target="5 %"), store=store), store)
        tight = {"target": "1 %", "measures": ["seat_displacement"]}
        assert not plan_scene(scene_of(ANNULAR, REED, accuracy=tight), store=store).kept
        longer = scene_of(ANNULAR, REED, accuracy__target="5 %", run__duration="2 ms", seat__damping_ratio=0.0)
        self.keep(plan_scene(scene_of(ANNULAR, REED, accuracy__target="5 %", seat__damping_ratio=0.0)), store)
        assert not plan_scene(longer, store=store).kept

    @pytest.mark.slow
    def test_a_wider_band_is_forgotten_sooner_and_serves_all_the_same(self, tmp_path: Path) -> None:
        """What a damped seat must remember follows from its own band."""
        store = Store(tmp_path / "kept")
        mesh = {"size": "2 mm", "contact_size": "0.4 mm"}
        long = {"run__duration": "20 ms", "accuracy__target": "5 %", "seat__mesh": mesh}
        wanted = plan_scene(scene_of(ANNULAR, REED, **long), store=store)
        narrow: float = wanted.method.value(BAND)
        wider = wanted.method.replaced({BAND: next(band for band in BANDS if band > narrow)})
        assert memory(wanted.scene, wider) < memory(wanted.scene, wanted.method)
        self.keep(replace(wanted, method=wider), store)
        assert plan_scene(scene_of(ANNULAR, REED, **long), store=store).kept

    @staticmethod
    def keep(plan: Plan, store: Store) -> None:
        key = key_of(plan)
        scene, none = plan.scene, np.zeros(0)
        forgotten = memory(scene, plan.method) < scene.run.duration
        spring = ModalGreens(none, none, np.zeros((0, 1)), Residual.spring(1e-9), origin={"seat_key": key})
        store.put(key, spring if forgotten else spring.known_for(scene.run.duration))


class TestPreRuns:
    def test_free_flight_is_exact(self) -> None:
        """A window of the run is the run: same filtered peak and duration, whatever is left out before."""
        scene = scene_of(ANNULAR, REED)
        seat = scene.seat.surrogate(scene.run.duration, scene.reed.face).greens
        window = locate_contact_window(scene, seat)
        assert window.start > 0.5e-3
        dt = 20e-9
        inside = Bench(scene, seat, window).measures(dt=dt, n_modes=30)
        whole = Bench(scene, seat, replace(window, start=0.0, duration=window.start + window.duration))
        for name, value in whole.measures(dt=dt, n_modes=30).items():
            assert inside[name] == pytest.approx(value, rel=1e-6), name

    @pytest.mark.parametrize(("step", "shortest"), [(1.2e-9, 2), (0.5e-6, MUCH_SHORTER)])
    def test_a_stated_step_that_resolves_all_modes_is_known_by_half_of_it(self, step: float, shortest: int) -> None:
        """Nothing hides within it; a longer one is marched eight times shorter, too, as waves may cross within it."""
        sensitivity = choices_of(ANNULAR, MASS).context.sensitivity
        changes = sensitivity.of_stated_step(step)
        assert min(sensitivity._steps) == pytest.approx(step / shortest)
        assert all(value >= sensitivity.of_step(step)[name] for name, value in changes.items())

    def test_a_body_is_advanced_like_its_free_motion(self) -> None:
        body = striker_of(scene_of(SPRING, REED), 3)
        later = advanced(advanced(body, 1e-4), 2e-4)
        at_once = advanced(body, 3e-4)
        assert later.state.displacement == pytest.approx(at_once.state.displacement, rel=1e-9)

    def test_the_surrogate_starts_and_rests_as_told(self) -> None:
        scene = scene_of(ANNULAR, REED)
        patch = scene.seat.patch()  # type: ignore[arg-type]
        area = np.pi * (4.9e-3**2 - 4.1e-3**2)  # of the lip's flat top
        c_p = np.sqrt(200e9 * 0.7 / (1.3 * 0.4 * 7850))
        greens = scene.seat.surrogate(scene.run.duration, scene.reed.face).greens
        assert greens.initial_value()[0, 0] == pytest.approx(1 / (7850 * c_p * area), rel=1e-9)
        assert greens.static_compliance()[0, 0] == pytest.approx(patch.compliance, rel=1e-9)
        assert patch.width == pytest.approx(0.8e-3)

    def test_an_arc_is_a_part_of_the_ring(self) -> None:
        ring, arc = (scene_of(ANNULAR, REED, **more).seat.patch() for more in ({}, {"seat__arc": "60 deg"}))  # type: ignore[arg-type]
        assert ring.area == pytest.approx(6 * arc.area)


BENT = f"""
seat = {{ kind = "block", damping_ratio = 0.0022, width = "9.93 mm", depth = "9.02 mm", thickness = "7.33 mm", \
    patch_width = "3.58 mm", patch_depth = "2.70 mm", {STEEL} }}
reed = {{ kind = "cantilever", length = "36.4 mm", width = "5.71 mm", thickness = "0.364 mm", damping_ratio = 0.0066, \
    release = {{ tip_deflection = "0.274 mm" }} }}
contact = {{ gap = "0.0422 mm", law = {{ kind = "spring", stiffness = "185 N/um" }} }}
run = {{ duration = "1.66 ms", filter_width = "1.66 us" }}
accuracy = {{ target = "1.4 %" }}
"""
CONE = """
seat = { kind = "conical", material = "grey cast iron", damping_ratio = 0.0034, half_angle = "32.6 deg", \
    bore_radius = "4.27 mm", face_width = "1.82 mm", contact_width = "1.52 mm", outer_radius = "8.36 mm", \
    thickness = "6.87 mm" }
reed = { kind = "rigid_mass", mass = "26.4 g", velocity = "-0.39 m/s" }
run = { duration = "0.18 ms", filter_width = "6.9 us" }
accuracy = { target = "8 %" }
"""


FLAPPER = """
reed = { kind = "flapper", root_width = "8 mm", taper_length = "2 mm", neck_width = "6 mm", neck_length = "15 mm", \
    paddle_diameter = "16 mm", thickness = "0.3 mm", \
    material = { young = "206 GPa", poisson = 0.3, density = "7800 kg/m^3" }, \
    release = { mode = 1, velocity = "-2 m/s" } }
run = { duration = "80 us" }
"""


class TestWithoutWaves:
    """Where the surrogate leaves open whether a spring is enough, a coarse real seat tells."""

    @staticmethod
    def seen(*parts: str, look: float | None = None) -> PlanningContext:
        scene = scene_of(*parts)
        surrogate = scene.seat.surrogate(scene.run.duration, scene.reed.face)
        return PlanningContext.from_scene(scene, surrogate, look=look)

    @staticmethod
    def looked_at(scene: Scene) -> Surrogate:
        surrogate = scene.seat.surrogate(scene.run.duration, scene.reed.face)
        return context.look_at(scene, stated_method(scene), surrogate, Store.default(), longest=np.inf)

    @staticmethod
    def level_of(seen: PlanningContext) -> str:
        return Choices(seen).cheapest(seen.scene.accuracy.target).level

    @pytest.mark.slow
    def test_a_spring_is_said_to_be_enough_that_estimates_leave_open(self) -> None:
        seen = self.seen(BENT)
        found = without_waves(seen)
        assert found.measured
        assert found.enough(seen.scene.accuracy.target)
        assert self.level_of(self.seen(BENT, look=0.0)) != "spring"
        assert self.level_of(seen) == "spring"

    @pytest.mark.slow
    def test_a_seat_whose_waves_count_keeps_them(self) -> None:
        """What a spring changes is the target itself: 1.0 of it, on a fine seat, too."""
        seen = self.seen(CONE)
        found = without_waves(seen)
        assert found.measured
        assert not found.enough(seen.scene.accuracy.target)
        assert self.level_of(seen) == "axisymmetric"

    @pytest.mark.slow
    def test_a_coarse_seat_changes_as_much_as_a_fine_one(self) -> None:
        """Of a mesh twice as fine and a band twice as wide, within the doubt that plans have."""
        seen = self.seen(CONE)
        patch = seen.surrogate.patch
        method = coarse_method(seen.scene.seat, seen.stated, patch, seen.scene.run.filter_width)
        twice = replace(
            method, size=method.size / 2, contact_size=method.contact_size / 2, bandwidth=2 * method.bandwidth
        )
        coarse, fine = (
            changes_on(seen, seat_of(seen.scene, method=each, mesh_error=False).greens) for each in (method, twice)
        )
        assert fine["filtered_peak"] > 0.01
        assert 1 / DOUBT_OF_COARSE < coarse["filtered_peak"] / fine["filtered_peak"] < DOUBT_OF_COARSE

    @pytest.mark.slow
    def test_a_seat_that_cannot_be_made_is_the_run_s_to_tell_of(self, monkeypatch: pytest.MonkeyPatch) -> None:
        def impossible(*args: object, **more: object) -> None:
            raise ModelError("no mesh")

        monkeypatch.setattr(context, "build", impossible)
        found = without_waves(self.seen(BENT))
        assert not found.measured

        notes = plan_scene(scene_of(BENT)).notes
        assert any("rests on an estimate of the seat (contact face of" in note for note in notes)

    @pytest.mark.slow
    @pytest.mark.parametrize("greens", [{"method": "second_order"}, {"method": "transient"}, {"max_vectors": 3}])
    def test_the_look_has_a_reduction_of_its_own(self, greens: Mapping[str, object]) -> None:
        """Those of the file may have no modes, whose part above a band would be nothing, or too few vectors."""
        scene = scene_of(ANNULAR.replace("0.05", "0.0"), REED, seat__greens=greens)
        seat = self.looked_at(scene)
        assert seat.band is not None
        assert seat.greens.modal is not None
        bench = Bench(scene, seat.greens, locate_contact_window(scene, seat.greens))
        assert max(Sensitivity(bench, scene.accuracy.judged, 1e-3, band=seat.band).above(seat.band).values()) > 0

    @pytest.mark.slow
    def test_a_seat_with_dashpots_is_estimated(self) -> None:
        """A narrower band is left out of complex poles by no pre-run, nor by the error budget."""
        dashpots = {"kind": "dashpot", "on": "contact", "normal": "1e7 N*s/m^3"}
        scene = scene_of(ANNULAR, REED, seat__supports=[dashpots])
        stated, patch = stated_method(scene), self.looked_at(scene).patch
        assert seat_of(scene, method=coarse_method(scene.seat, stated, patch, 1e-6)).greens.modal is None
        assert self.looked_at(scene).band is None

    def test_a_lip_in_arcs_lies_on_the_seat_that_was_looked_at(self) -> None:
        scene = scene_of(ANNULAR, FLAPPER, contact={"ports": 8, "tilt": "0.1 deg"})
        seat = self.looked_at(scene)
        along = lips.surrogate_in_arcs(stated_method(scene), seat)
        assert len(along.greens.ports) > 1
        assert along.band == seat.band is not None

    @pytest.mark.slow
    def test_the_plan_tells_by_what_it_knows(self) -> None:
        reason = plan_scene(scene_of(CONE)).choice("seat.model").reason
        assert "without waves: " in reason
        assert "measured on a coarse mesh of the seat" in reason
        assert "enough" not in reason


def choices_of(*parts: str, **more: object) -> Choices:
    scene = scene_of(*parts, **more)
    surrogate = scene.seat.surrogate(scene.run.duration, scene.reed.face)
    bench = Bench(scene, surrogate.greens, locate_contact_window(scene, surrogate.greens))
    sensitivity = Sensitivity(bench, scene.accuracy.measures, 1e-4, exact=surrogate.exact)
    return Choices(PlanningContext(scene, stated_method(scene), surrogate, sensitivity))


@cached
def choices_of_a_plate() -> Choices:
    return choices_of(PLATE, REED, accuracy={"target": "1 %", "measures": ["seat_displacement"]})


class TestChoosing:
    def test_a_small_change_may_be_an_accident(self) -> None:
        changes = (1e-9, 0.1, 0.01)
        rungs = no_better_than_finer(tuple(Rung(k, {"a": change}) for k, change in enumerate(changes)))
        assert [rung.changes["a"] for rung in rungs] == [0.1, 0.1, 0.01]

    @pytest.mark.slow
    def test_nothing_cheaper_meets_the_target(self) -> None:
        """Of all combinations, looked at one by one: the choice spends little more than the least cost."""
        choices = choices_of(ANNULAR, REED)
        ways = [Decision(choices.context, seat, contact) for seat in choices.seats for contact in choices.contacts]
        for target in (0.05, 0.01):
            decision = choices.cheapest(target)
            assert max(decision.error.values()) <= AIM * target
            meet = [way for way in ways if max(way.error.values()) <= AIM * target]
            assert len(meet) < len(ways)
            assert worth(decision) <= (1 + FREE) * min(worth(way) for way in meet)

    @pytest.mark.slow
    def test_the_model_of_a_tighter_target_costs_more(self) -> None:
        choices = choices_of_a_plate()
        costs = [cost(choices.cheapest(target)) for target in (0.5, 0.1, 0.02)]
        assert costs == sorted(costs)
        assert costs[-1] > 2 * costs[0]

    @pytest.mark.slow
    def test_out_of_reach_it_comes_close_to_the_least_error_without_spending_all(self) -> None:
        choices = choices_of_a_plate()
        ways = [Decision(choices.context, seat, contact) for seat in choices.seats for contact in choices.contacts]
        least = min(max(way.error.values()) for way in ways)
        decision = choices.cheapest(0.01 * least)
        assert least <= max(decision.error.values()) <= 1.3 * least
        assert cost(decision) < max(cost(way) for way in ways)

    @pytest.mark.slow
    def test_a_measure_out_of_reach_leaves_the_others_their_target(self) -> None:
        """The tolerance, as stated, does not tell the seat's displacement; the filtered peak is met all the same."""
        wanted = {"target": "1 %", "measures": ["filtered_peak", "seat_displacement"]}
        choices = choices_of(ANNULAR, REED, seat__greens={"tolerance": "20 %"}, accuracy=wanted)
        decision = choices.cheapest(0.01)
        assert decision.error["landing_seat_displacement"] > 0.1
        assert decision.error["landing_filtered_peak"] <= 0.01

    @pytest.mark.slow
    def test_bars_without_an_end_can_be_compared(self) -> None:
        """Of a measure that comes and goes with the model: the others still choose."""
        choices = choices_of(SPRING, REED)
        vanishing = [
            replace(contact, changes={**contact.changes, STEP: {**contact.changes[STEP], "impulse": np.inf}})
            for contact in choices.contacts
        ]
        choices.__dict__["contacts"] = tuple(vanishing)
        assert choices.cheapest(0.01).error["landing_filtered_peak"] <= 0.01

    @pytest.mark.slow
    def test_a_limit_of_time_is_kept_where_it_can_be(self) -> None:
        choices = choices_of_a_plate()
        free = choices.cheapest(0.01)
        bounded = choices.cheapest(0.01, longest=free.seat.seconds / 3)
        assert bounded.seat.seconds <= free.seat.seconds / 3
        assert max(bounded.error.values()) > max(free.error.values())
        assert choices.cheapest(0.01, longest=0.0).seat.seconds == min(seat.seconds for seat in choices.seats)


def worth(decision: Decision) -> float:
    """The cost that choices are compared by: statics may take `SIMPLER` times as long as waves."""
    return cost(decision) / (SIMPLER if decision.seat.seat.static else 1.0)


def cost(decision: Decision) -> float:
    contact = decision.contact
    return decision.seat.seconds + contact.seconds + decision.seat.poles * contact.per_pole


class TestMeshSizes:
    def test_sizes_keep_what_they_promise(self) -> None:
        seat = scene_of(ANNULAR, REED).seat
        patch = seat.patch()
        before = Sizes(np.inf, np.inf)
        for error in (0.2, 0.05, 0.01, 0.002):
            sizes = sizes_for(patch, 500e3, error)
            assert mesh_error(patch, 500e3, sizes) <= error
            assert sizes.size <= before.size
            assert sizes.contact_size <= min(before.contact_size, 2 * patch.width)
            before = sizes
        wide = sizes_for(patch, 5e6, 0.05)
        assert wide.size < sizes_for(patch, 500e3, 0.05).size


class TestCommand:
    @pytest.mark.slow
    def test_plan_prints_choices_cost_and_error(self, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
        file = tmp_path / "scene.toml"
        file.write_text(ANNULAR + REED)
        assert run_command(["plan", str(file)]) == DONE
        told = capsys.readouterr().out
        for word in (
            "seat.greens.bandwidth",
            "error left",
            "this plan",
            "predicted time",
            "predicted error",
            "peak force",
        ):
            assert word in told
        assert list(tmp_path.glob("*-result")) == []

    def test_bad_input(self, tmp_path: Path) -> None:
        file = tmp_path / "scene.toml"
        file.write_text(PLATE + REED.replace("duration", 'time_step = "0.9 us", duration'))
        assert run_command(["plan", str(file)]) == BAD_INPUT
