"""[[spring]]: what valve springs do to reeds of all kinds, their forces in results, what is wrong with their places."""

import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import impact
from seatfem.study.impacts.contact import run_contacts, valve_spring_keys
from seatfem.study.impacts.forces import Strike
from tests.as_stated import striker_of
from tests.gallery import load_text, refusal
from tests.steps import Scene, run_scene

STIFF = '[seat]\nkind = "spring"\nstiffness = "100 N/um"\n'
RING = (
    '[reed]\nkind = "ring_plate"\nouter_diameter = "20 mm"\ninner_diameter = "10 mm"\nthickness = "1.5 mm"\n'
    'material = "steel"\ngreens = { bandwidth = "30 kHz" }\nmesh = { size = "2 mm" }\n'
)
DISC = '[reed]\nkind = "disc"\ndiameter = "16 mm"\nthickness = "1 mm"\nmesh = { size = "2 mm" }\n'
MASS = '[reed]\nkind = "rigid_mass"\nmass = "2 g"\nvelocity = "-1 m/s"\n'
BEAM = '[reed]\nkind = "cantilever"\nlength = "25 mm"\nwidth = "10 mm"\nthickness = "0.3 mm"\n'
SPRING = '[[spring]]\nstiffness = "4 N/mm"\npreload = "6 N"\n'
AREA, SPAN, RIGIDITY = math.pi * 75e-6, 25e-3, 200e9 * 10e-3 * 0.3e-3**3 / 12
RING_MASS = 7850 * 1.5e-3 * AREA


def scene_of(folder: Path, text: str, more: str = "", run: str = 'duration = "1 ms"') -> Scene:
    return load_text(folder, f"{STIFF}{text}{more}[run]\n{run}\n")


@pytest.mark.slow
@pytest.mark.parametrize("places", ['number = 4\nradius = "7.5 mm"\n', ""])
def test_a_ring_plate_heaves_and_rocks(places: str, tmp_path: Path) -> None:
    """The ring heaves with sqrt(k/m) and rocks twice with sqrt(k r^2/2 / I), I = m ((R^2 + r_i^2)/4 + h^2/12), for
    point and spread springs; it bends by 2e-4 of either, and k or m 3 % off are 1.5 %."""
    omega = striker_of(scene_of(tmp_path, RING, SPRING + places)).greens.modal.omega
    turns = RING_MASS * ((1e-4 + 25e-6) / 4 + 1.5e-3**2 / 12)
    rocks, heaves = math.sqrt(4e3 * 7.5e-3**2 / 2 / turns), math.sqrt(4e3 / RING_MASS)
    assert omega[:3] == pytest.approx([rocks, rocks, heaves], rel=1e-3)
    assert omega[3] > 50 * heaves


def test_a_rigid_mass_lands_under_its_springs(tmp_path: Path) -> None:
    """The mass moves as its oscillator; the springs' force is P + k (g + x) and, as it touches, P."""
    scene = scene_of(tmp_path, MASS, f'{SPRING}[contact]\ngap = "1 mm"\n', 'duration = "2 ms"\ntime_step = "0.2 us"')
    striker, seat = striker_of(scene), impact.spring(stiffness=1e8)
    touches = run_contacts(scene, striker, seat, 2e-7)
    omega, centre = math.sqrt(4e3 / 2e-3), -1e-3 - 6 / 4e3
    t = touches.seat.time[: int(np.flatnonzero(touches.seat.force)[0]) - 1]
    exact = centre - centre * np.cos(omega * t) - np.sin(omega * t) / omega
    np.testing.assert_allclose(touches.seat.striker_displacement[: len(t)], exact, atol=1e-9)
    keys = valve_spring_keys(scene.spring, Strike(scene.geometry, striker, seat, touches))
    highest = float(touches.seat.striker_displacement.max())
    assert highest > 1e-5  # it returns beyond its start
    assert keys["valve_spring_force_max_N"] == pytest.approx(6 + 4e3 * (1e-3 + highest), rel=1e-9)
    assert keys["valve_spring_force_at_landing_N"] == pytest.approx(6.0, abs=2e-2)
    assert touches.seat.energy.residual < 1e-9


def test_the_stress_of_a_reed_that_springs_press_closed(tmp_path: Path) -> None:
    """A spring of k and preload P at a = 15 mm presses the reed with S = P + k u(a), and N at the tip bends it most
    below the spring, by (L - a) N. 3 % of P moves the stress by 3 %, of k by 0.4 %; modes leave out what falls like
    1/n."""
    stresses = {}
    for n_modes in (40, 80):
        more = f'n_modes = {n_modes}\n[contact]\npreload = true\n{SPRING}at = "15 mm"\n'
        scene = scene_of(tmp_path, BEAM, more, 'duration = "0.1 ms"\ntime_step = "1 us"')
        striker, seat = striker_of(scene), impact.spring(stiffness=1e8)
        touches = run_contacts(scene, striker, seat, 1e-6)
        stress = Strike(scene.geometry, striker, seat, touches).largest_stress()
        assert stress.largest.value == pytest.approx(stress.at_start.value, rel=1e-3)  # it stays at rest
        assert touches.seat.force == pytest.approx(touches.seat.force[0], rel=1e-6)
        stresses[n_modes] = stress.at_start.value

    def below_it(stiffness: float) -> float:
        a, tip = 15e-3, SPAN
        own, cross, far = a**3 / 3, a**2 * (3 * tip - a) / 6, tip**3 / 3
        rows = [[-own, cross, -RIGIDITY], [-cross, far + RIGIDITY / 1e8, 0.0], [1.0, 0.0, -stiffness]]
        contact = np.linalg.solve(rows, [0.0, 0.0, 6.0])[1]
        return (tip - a) * contact * 200e9 * 0.15e-3 / RIGIDITY

    assert 2 * stresses[80] - stresses[40] == pytest.approx(below_it(4e3), rel=1e-3)
    assert 2 * stresses[80] - stresses[40] != pytest.approx(below_it(1.03 * 4e3), rel=2e-3)


@pytest.mark.slow
def test_a_run_tells_the_force_of_its_springs(tmp_path: Path) -> None:
    """It lies at rest until the springs have it: under 6.8 N at the lift, 6 N closed, which is the static load."""
    more = f'{SPRING}number = 4\nradius = "7.5 mm"\n[contact]\ngap = "0.2 mm"\n'
    run = 'duration = "0.7 ms"\nfilter_width = "20 us"\n[accuracy]\ntarget = 0.9'
    summary: dict[str, Any] = run_scene(scene_of(tmp_path, RING, more, run), tmp_path).summary
    assert summary["valve_spring_force_max_N"] == pytest.approx(6 + 0.8, rel=1e-6)
    assert summary["valve_spring_force_at_landing_N"] == pytest.approx(6.0, rel=5e-3)
    assert summary["landing_static_load_N"] == pytest.approx(6.0, rel=5e-3)
    work = (6 + 0.4) * 0.2e-3
    assert summary["landing_closing_speed_m_per_s"] == pytest.approx(math.sqrt(2 * work / RING_MASS), rel=5e-3)
    assert summary["energy_residual"] < 1e-9


@pytest.mark.slow
def test_forces_and_weights_of_free_plates(tmp_path: Path) -> None:
    """A force beside the middle of a disc turns it: the edge goes by F/m + F e x/I, its mass times gravity falls."""
    shift = 'force = "-1 N"\npoint = ["3 mm", "0 mm"]\n'
    turned = striker_of(scene_of(tmp_path, DISC, f'[[load]]\n{shift}[[load]]\ngravity = "-9.81 m/s^2"\n'))
    mass, modal = 7850 * 1e-3 * math.pi * 64e-6, turned.greens.modal
    rigid = modal.omega == 0
    push, weight = turned.loads
    assert (push.shape[rigid] ** 2).sum() == pytest.approx(1 / mass + 9e-6 / (mass * (16e-6 + 1e-6 / 12)), rel=1e-3)
    assert (weight.shape[rigid] ** 2).sum() == pytest.approx(1 / mass, rel=1e-6)
    assert float(weight.amplitude(np.zeros(1))[0]) == pytest.approx(-9.81 * mass, rel=1e-3)
    ring = striker_of(scene_of(tmp_path, RING, '[[load]]\npressure = "-1 bar"\narea = "236 mm^2"\n'))
    assert np.abs(ring.loads[0].shape[ring.greens.modal.omega > 0]).max() < 1e-6 / math.sqrt(RING_MASS)  # it bends none


@pytest.mark.parametrize(
    ("reed", "spring", "words"),
    [
        (RING, '[[spring]]\npreload = "6 N"\n', "spring.0.stiffness: required"),
        (RING, f'{SPRING}number = 4\n', "spring.0.radius: required"),
        (RING, f'{SPRING}number = 4\nradius = "11 mm"\n', "spring.0.radius: 11 mm.*centre"),
        (RING, f'{SPRING}points = [["1 mm", "0 mm"]]\n', "spring.0.points: 1 mm.*centre"),
        (RING, f'{SPRING}at = "3 mm"\n', "spring.0.at:.*positions"),
        (MASS, f'{SPRING}points = [["1 mm", "0 mm"]]\n', "spring.0.points:.*places"),
        (BEAM, f'{SPRING}at = "30 mm"\n', "spring.0.at: 30 mm.*reed.*25 mm"),
        (BEAM, f'{SPRING}at = "3 mm"\nnumber = 2\nradius = "1 mm"\n', "spring.0.number:.*given"),
    ],
)  # fmt: skip
def test_what_is_wrong_with_springs(reed: str, spring: str, words: str, tmp_path: Path) -> None:
    assert re.search(words, refusal(scene_of, tmp_path, reed, spring))


def test_a_plate_that_its_springs_leave_free_to_rock(tmp_path: Path) -> None:
    """A ring in arcs that its springs leave free to rock is refused: each arc would move as a free body."""
    more = f'{SPRING}points = [["6 mm", "0 mm"]]\n'
    scene = scene_of(tmp_path, RING, more)
    method = replace(scene.reed.stated(), lip=scene.reed.own_lip.__class__(7e-3, 1e-3, 4))
    greens = scene.reed.solved(method).greens
    with pytest.raises(ValueError, match="leave the reed free to rock"):
        striker_of(scene, greens=greens)
