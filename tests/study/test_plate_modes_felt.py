"""What a plate's modes beyond its band change is what the bar knows, also where its contact feels few of them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import impact
from impact import Body, ContactProblem, solve, spring
from impact.after.measures import filtered_peak_force
from seatfem.study.ladders.ladder import ComputedRun
from seatfem.study.ladders.modes import widen_plate_band
from seatfem.study.method import BAND, MODEL, PORTS, RINGS
from seatfem.study.runs.reed_stress import plate_stress
from seatfem.study.runs.rounds import solve as solve_plan
from tests.as_stated import seat_of, striker_of, values_of_problem
from tests.gallery import load_text
from tests.steps import Scene, Stopwatch, begin_plan, problem_of, stated_method

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    ("diameter", "band", "width", "stiffness", "told"),
    [
        pytest.param("10 mm", 60, 1e-6, 5e8, "little", id="modes of a wider band tell half"),
        pytest.param("6 mm", 40, 3e-6, 5e9, "nothing", id="the next felt mode is beyond a wider band"),
        pytest.param("6 mm", 40, 8e-6, 5e8, "nothing", id="the filter hides a mode an octave beyond"),
        pytest.param("14 mm", 80, 3e-6, 5e8, "all", id="modes of a wider band tell all"),
    ],
)
def test_the_bar_of_a_free_disc_knows_what_is_beyond_its_band(
    diameter: str, band: float, width: float, stiffness: float, told: str, tmp_path: Path
) -> None:
    """The largest change by modes beyond the band is 0.67 to 4 times the true error (900 kHz, stiff spring)."""
    scene = scene_of_a_disc(tmp_path, band, diameter)
    narrow, wide = striker_of(scene), striker_of(scene_of_a_disc(tmp_path, 900, diameter))
    seat = seat_of(scene, mesh_error=False)
    run = ComputedRun(scene, stated_method(scene), seat, narrow)

    def peak(body: Body) -> float:
        result = solve(ContactProblem(body, Body(spring(stiffness=stiffness))), dt=width / 50, duration=6e-5)
        return filtered_peak_force(result, width)

    here = peak(narrow)
    error = abs(peak(wide) - here)
    changes = [share * abs(peak(body) - here) for body, share in widen_plate_band(run)]
    assert error > 0.02 * here
    assert error < 1.5 * max(changes) < 6 * error
    if told == "all":
        assert len(changes) == 2
    else:
        assert 1.5 * max(changes[:2]) < (0.01 if told == "nothing" else 0.9) * error


def test_a_plate_in_a_wider_band_has_the_ports_of_its_run(tmp_path: Path) -> None:
    """Rings across the seat's land divide the seat alone: the plate still meets it as a whole."""
    seat = (
        'kind = "annular"\nbore_radius = "2 mm"\nlip_width = "1 mm"\nlip_height = "0.5 mm"\nlip_edge_radius = "0 mm"\n'
        'outer_radius = "6 mm"\nthickness = "5 mm"\nmaterial = "steel"\nfixed = "underside"\ndamping_ratio = 0.01\n'
    )
    reed = (
        'kind = "ring_plate"\nouter_diameter = "8 mm"\ninner_diameter = "2 mm"\nthickness = "0.5 mm"\n'
        'material = "steel"\ndamping_ratio = 0.01\nvelocity = "-1 m/s"\n'
    )
    scene = load_text(tmp_path, f'[seat]\n{seat}[reed]\n{reed}[contact]\ngap = "1 um"\n[run]\nduration = "50 us"\n')
    whole = stated_method(scene).with_values(scene.geometry, {PORTS: 1})
    method = whole.replaced({MODEL: "axisymmetric", RINGS: 4, BAND: 2e5})
    solved, striker = seat_of(scene, method=method.seat, mesh_error=False), striker_of(scene, method=method.reed)
    run = ComputedRun(scene, method, solved, striker)
    assert run.division.rings == 4
    assert {tuple(body.greens.ports) for body, _ in widen_plate_band(run)} == {tuple(striker.greens.ports)}
    done = solve_plan(replace(begin_plan(scene), method=method), Stopwatch())
    stress = plate_stress(done)
    assert stress is not None
    assert 0 < stress.bar < np.inf


def scene_of_a_disc(folder: Path, band: float, diameter: str) -> Scene:
    """Return a free disc, with its modes up to three times a band [kHz], before a spring."""
    return load_text(
        folder,
        f'seat = {{ kind = "spring", stiffness = "5e8 N/m" }}\nrun = {{ duration = "60 us" }}\n'
        f'[reed]\nkind = "disc"\ndiameter = "{diameter}"\nthickness = "0.5 mm"\n'
        'material = { young = "200 GPa", poisson = 0.3, density = "8000 kg/m^3" }\n'
        f'damping_ratio = 0.02\nvelocity = "-0.5 m/s"\ngreens.bandwidth = "{band:g} kHz"\n',
    )


STEP = 5e-8


def flapper_scene(folder: Path, band: float) -> Scene:
    """Return a flapper struck in the middle of its paddle by a stiff spring."""
    return load_text(
        folder,
        '[seat]\nkind = "spring"\nstiffness = "40 N/um"\n[reed]\nkind = "flapper"\nroot_width = "8 mm"\n'
        'taper_length = "2 mm"\nneck_width = "6 mm"\nneck_length = "12 mm"\npaddle_diameter = "13 mm"\n'
        'thickness = "0.5 mm"\nmaterial = "steel"\ndamping_ratio = 0.01\ncontact_radius = "3 mm"\n'
        f'contact_width = "0.5 mm"\ngreens = {{ bandwidth = "{band:g} kHz" }}\n'
        'release = { velocity = "-1 m/s" }\n[contact]\ngap = "1 um"\n[run]\nduration = "60 us"\nfilter_width = "4 us"\n'
        "[accuracy]\ntarget = 0.1\n",
    )


def landing_of(scene: Scene, striker: impact.Body) -> tuple[float, float]:
    """Return impulse [N s] and filtered peak [N]."""
    problem = problem_of(scene, striker, impact.Body(seat_of(scene, mesh_error=False).greens))
    values = values_of_problem(scene, problem, STEP)
    return values["impulse"], values["filtered_peak"]


@pytest.mark.parametrize("band", [30, 60])
def test_the_bar_reaches_what_four_times_the_band_changes(band: float, tmp_path: Path) -> None:
    """The bar of the measure that changes more is 1 to 2.5 times what four times the band changes."""
    scene, wide = flapper_scene(tmp_path, band), flapper_scene(tmp_path, 4 * band)
    striker, seat = striker_of(scene), seat_of(scene, mesh_error=False)
    run = ComputedRun(scene, stated_method(scene), seat, striker)
    here, there = landing_of(scene, striker), landing_of(wide, striker_of(wide))
    others = [(share, landing_of(scene, body)) for body, share in widen_plate_band(run)]
    assert len(others) >= 2
    bars = [max(share * abs(values[k] - here[k]) / here[k] for share, values in others) for k in range(2)]
    errors = [abs(there[k] - here[k]) / here[k] for k in range(2)]
    most = max(range(2), key=lambda k: errors[k])
    assert errors[most] > 5e-3
    assert errors[most] < bars[most] < 2.5 * errors[most]
    assert errors[1 - most] < bars[1 - most] < bars[most] * 2.5
