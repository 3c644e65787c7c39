"""What is known of a seat before it is solved: its surrogate, sizes of elements, and a coarse seat with its waves."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import impact
from impact.greens.base import GreensFunction
from seatfem.structures.mesh.gmsh_process import gmsh_session
from seatfem.structures.method import AUTO
from seatfem.structures.patch import Sizes, mesh_error, sizes_for
from seatfem.structures.rings import face_compliance
from seatfem.study.impacts.bodies import problem_of
from seatfem.study.impacts.contact import record_of
from seatfem.study.ladders import level
from seatfem.study.ladders.ladder import ComputedRun
from seatfem.study.ladders.level import DOUBT, DOUBT_OF_COARSE, coarse_method, level_with_waves
from seatfem.study.ladders.table import ladder_of
from seatfem.study.method import MODEL, PORTS, stated_method
from seatfem.study.runs.converge import begin_method
from seatfem.study.scene import Scene
from tests.as_stated import seat_of, striker_of
from tests.steps import Limits, ModelError, Solved, Stopwatch, begin_plan, rounds, silent, values_of_record
from tests.study.small_scenes import ANNULAR, REED, scene_of

CONE = """
seat = { kind = "conical", material = "grey cast iron", damping_ratio = 0.0034, half_angle = "32.6 deg", \
    bore_radius = "4.27 mm", face_width = "1.82 mm", contact_width = "1.52 mm", outer_radius = "8.36 mm", \
    thickness = "6.87 mm" }
reed = { kind = "rigid_mass", mass = "26.4 g", velocity = "-0.39 m/s" }
run = { duration = "0.18 ms", filter_width = "6.9 us" }
accuracy = { target = "8 %" }
"""


def test_the_surrogate_starts_and_rests_as_told() -> None:
    scene = scene_of(ANNULAR, REED)
    patch = scene.seat.patch()  # type: ignore[arg-type]
    area = np.pi * (4.9e-3**2 - 4.1e-3**2)  # of the lip's flat top
    c_p = np.sqrt(200e9 * 0.7 / (1.3 * 0.4 * 7850))
    greens = scene.seat.estimate()
    assert greens.initial_value()[0, 0] == pytest.approx(1 / (7850 * c_p * area), rel=1e-9)
    assert greens.static_compliance()[0, 0] == pytest.approx(patch.compliance, rel=1e-9)
    assert patch.width == pytest.approx(0.8e-3)


def test_an_arc_is_a_part_of_the_ring() -> None:
    ring, arc = (scene_of(ANNULAR, REED, **more).seat.patch() for more in ({}, {"seat__arc": "60 deg"}))  # type: ignore[arg-type]
    assert ring.area == pytest.approx(6 * arc.area)


def test_sizes_keep_what_they_promise() -> None:
    patch = scene_of(ANNULAR, REED).seat.patch()
    before = Sizes(np.inf, np.inf)
    for error in (0.2, 0.05, 0.01, 0.002):
        sizes = sizes_for(patch, 500e3, error)
        assert mesh_error(patch, 500e3, sizes) <= error
        assert sizes.size <= before.size
        assert sizes.contact_size <= min(before.contact_size, 2 * patch.width)
        before = sizes
    wide = sizes_for(patch, 5e6, 0.05)
    assert wide.size < sizes_for(patch, 500e3, 0.05).size


@pytest.mark.parametrize("greens", [{"method": "second_order"}, {"method": "transient"}, {"max_vectors": 3}])
def test_the_coarse_seat_has_a_reduction_of_its_own(greens: Mapping[str, object]) -> None:
    """Those of the file may have no modes, whose part above a band would be nothing, or too few vectors."""
    scene = scene_of(ANNULAR.replace("0.05", "0.0"), REED, seat__greens=greens)
    method = coarse_method(scene.seat, stated_method(scene).seat, scene.seat.patch(), 1e-6)
    assert (method.reduction, method.max_vectors) == (AUTO, None)


def changed_by_waves(scene: Scene, greens: GreensFunction) -> float:
    """Return the relative change of the filtered peak by a seat's waves, against its static compliance."""
    seats = greens, impact.spring(stiffness=1 / face_compliance(greens))
    problems = [problem_of(scene, striker_of(scene), impact.Body(seat)) for seat in seats]
    waves, static = (values_of_record(record_of(scene, each, 5e-8))["filtered_peak"] for each in problems)
    return abs(waves - static) / waves


@pytest.mark.slow
def test_a_coarse_seat_changes_as_much_as_a_fine_one() -> None:
    """A mesh and a band twice as fine change it by less than the doubt that the error budget has."""
    scene = scene_of(CONE)
    method = coarse_method(scene.seat, stated_method(scene).seat, scene.seat.patch(), scene.run.filter_width)
    twice = replace(method, size=method.size / 2, contact_size=method.contact_size / 2, bandwidth=2 * method.bandwidth)
    coarse, fine = (
        changed_by_waves(scene, seat_of(scene, method=each, mesh_error=False).greens) for each in (method, twice)
    )
    assert fine > 0.01
    assert 1 / DOUBT_OF_COARSE < coarse / fine < DOUBT_OF_COARSE


def test_the_surrogate_stands_for_a_coarse_seat_that_cannot_be_made(monkeypatch: pytest.MonkeyPatch) -> None:
    def impossible(*args: Any, **more: Any) -> None:
        raise ModelError("no mesh")

    monkeypatch.setattr(level, "solve_body", impossible)
    scene = scene_of(CONE)
    estimate = scene.seat.estimate()
    spring = impact.spring(stiffness=1 / scene.seat.patch().compliance)
    problem = problem_of(scene, striker_of(scene), impact.Body(spring))
    method = stated_method(scene).replaced({"seat.model": "spring"})
    (variation,) = level._waves(ComputedRun(scene, method, Solved(spring), problem))
    assert variation.weight == DOUBT
    np.testing.assert_array_equal(variation.problem.target.greens.modal.omega, estimate.omega)


THIN = """
reed = { kind = "flapper", root_width = "9 mm", taper_length = "3 mm", neck_width = "7 mm", neck_length = "20 mm", \
    paddle_diameter = "13 mm", thickness = "0.25 mm", material = "steel", damping_ratio = 0.02, \
    release = { mode = 1, velocity = "-2 m/s" } }
seat = { kind = "plate", ports = 2, layout = "row", struck = 1, port_radius = "4 mm", pitch = "12 mm", \
    margin = "6 mm", thickness = "1.5 mm", land_width = "1 mm", clamp_width = "2 mm", material = "steel", \
    damping_ratio = 0.02 }
contact = { tilt = "0.2 deg" }
run = { duration = "1 ms", filter_width = "5 us" }
accuracy = { target = "10 %" }
"""


@pytest.mark.slow
def test_what_a_coarse_seat_struck_as_a_whole_tells_of_a_tilted_landing_is_enough(tmp_path: Path) -> None:
    """A thin plate rocks under a paddle that lands on one side: the spring is told to be off by at least what the waves
    of the same mesh, in the same segments, change."""
    scene = scene_of(THIN)
    plan = begin_plan(scene)
    waves = plan.method.replaced({MODEL: level_with_waves(scene.seat, plan.method.seat)})
    with gmsh_session():
        (still,), (moved,) = (
            rounds(replace(plan, method=method), tmp_path, Stopwatch(), silent, limits=Limits(1))
            for method in (plan.method, waves)
        )
    assert still.plan.method.seat.lip.arcs == moved.plan.method.seat.lip.arcs == 16
    changes = {name: abs(moved.left.values[name] - still.left.values[name]) for name in ("impulse", "filtered_peak")}
    assert changes["impulse"] > 0.01 * moved.left.values["impulse"]
    for name, change in changes.items():
        assert still.left.by_key[MODEL][name] > change, name


def test_segments_of_a_seat_that_is_meshed_in_space_have_an_element_each() -> None:
    """Twice as many arcs get elements half as long if the scene leaves their size open."""
    for stated in ({}, {"seat__mesh": {"contact_size": "1.3 mm"}}):
        scene = scene_of(THIN, **stated)
        method = begin_method(scene)
        finer = ladder_of(PORTS).refine(scene, method, 2.0)
        arc = finer.seat.lip.length / finer.seat.lip.arcs
        assert finer.seat.lip.arcs == 2 * method.seat.lip.arcs
        assert (finer.seat.contact_size < arc < method.seat.contact_size) is not bool(stated)
