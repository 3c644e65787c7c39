"""What is known of a seat before it is solved: its surrogate, sizes of elements, and a coarse seat with its waves."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from seatfem.structures.mesh.gmsh_process import gmsh_session
from seatfem.study.ladders.level import level_with_waves
from seatfem.study.method import MODEL
from tests.steps import Limits, Stopwatch, begin_plan, rounds, silent
from tests.study.small_scenes import ANNULAR, REED, scene_of


def test_the_surrogate_starts_and_rests_as_told() -> None:
    scene = scene_of(ANNULAR, REED)
    patch = scene.seat.patch()  # type: ignore[arg-type]
    area = np.pi * (4.9e-3**2 - 4.1e-3**2)  # of the lip's flat top
    c_p = np.sqrt(200e9 * 0.7 / (1.3 * 0.4 * 7850))
    greens = scene.seat.estimate()
    assert greens.initial_value()[0, 0] == pytest.approx(1 / (7850 * c_p * area), rel=1e-9)
    assert greens.static_compliance()[0, 0] == pytest.approx(patch.compliance, rel=1e-9)
    assert patch.width == pytest.approx(0.8e-3)


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
