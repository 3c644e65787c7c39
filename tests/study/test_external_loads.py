"""[[load]], [[base]] and [[spring]]: known motions, the same by other keys or in another frame, refusals."""

import math
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import impact
from impact.after.result import ImpactResult
from impact.bodies.time_series import TimeSeriesError
from seatfem.study.impacts.bodies import check_base
from seatfem.study.impacts.contact import run_contacts, valve_spring_keys
from seatfem.study.impacts.forces import Strike
from tests.gallery import load_text, refusal
from tests.steps import GreensFunctionError, Scene, SceneError, problem_of, run_scene, seat_of, striker_of

SEAT = '[seat]\nkind = "spring"\nstiffness = "1 N/um"\n'
MASS = '[reed]\nkind = "rigid_mass"\nmass = "1 g"\nvelocity = "-1 m/s"\n[contact]\ngap = "1 mm"\n'
REED = '[reed]\nkind = "cantilever"\nlength = "25.4 mm"\nn_modes = 6\nrelease = { tip_deflection = "0.2 mm" }\n'
ROD = (
    '[reed]\nkind = "rod"\nyoung = "2 GPa"\ndensity = "7 g/cm^3"\nlength = "9 mm"\narea = "3 mm^2"\n'
    'far_end = "free"\nvelocity = "-1 m/s"\n'
)
RING_PLATE = (
    '[reed]\nkind = "ring_plate"\nouter_diameter = "20 mm"\ninner_diameter = "10 mm"\nthickness = "1.5 mm"\n'
    'material = "steel"\ngreens = { bandwidth = "30 kHz" }\nmesh = { size = "2 mm" }\n'
)
DISC = '[reed]\nkind = "disc"\ndiameter = "16 mm"\nthickness = "1 mm"\nmesh = { size = "2 mm" }\n'
HEAVY = '[reed]\nkind = "rigid_mass"\nmass = "2 g"\nvelocity = "-1 m/s"\n'
BEAM = '[reed]\nkind = "cantilever"\nlength = "25 mm"\nwidth = "10 mm"\nthickness = "0.3 mm"\n'
VALVE = '[[spring]]\nstiffness = "4 N/mm"\npreload = "6 N"\n'
RUN = '[run]\nduration = "3 ms"\ntime_step = "0.5 us"\n'
RATE, WAY = 2000.0, 0.2e-3  # 1/s, m


def scene_of(folder: Path, text: str, seat: str = SEAT, run: str = RUN) -> Scene:
    return load_text(folder, seat + text + run)


def write_records(folder: Path) -> None:
    """Write three records of one motion, s = A (1 - cos W t), from rest."""
    t = np.linspace(0, 4e-3, 4001)
    for kind, unit, values in (
        ("displacement", "m", WAY * (1 - np.cos(RATE * t))),
        ("velocity", "m/s", WAY * RATE * np.sin(RATE * t)),
        ("acceleration", "m/s^2", WAY * RATE**2 * np.cos(RATE * t)),
    ):
        lines = [f"time [s],{kind} [{unit}]", *(f"{a:.9g},{b:.12g}" for a, b in zip(t, values, strict=True))]
        (folder / f"{kind}.csv").write_text("\n".join(lines), encoding="utf-8")


def base(of: str, kind: str = "displacement") -> str:
    return f'[[base]]\nof = "{of}"\n{kind} = "{kind}.csv"\n'


def run(scene: Scene, dt: float = 5e-7, duration: float = 3e-3) -> ImpactResult:
    seat = seat_of(scene).greens
    check_base(scene.mount("seat"), seat, scene.run.duration)
    problem = problem_of(scene, striker_of(scene), impact.Body(seat))
    return impact.solve(problem, dt=dt, duration=duration)


def test_a_fall(tmp_path: Path) -> None:
    """Gravity, pressure on an area, force and a receding frame all give x = gap - v t + a t^2/2."""
    loads = (
        'gravity = "-200 m/s^2"',
        'pressure = "-1 bar"\narea = "2 mm^2"',
        'force = "-0.2 N"',
        'base_motion = "200 m/s^2"',
        'force = "-0.5 N"\n[[load]]\ngravity = "300 m/s^2"',  # which add up
    )
    t = np.arange(0, 0.8e-3, 5e-7)
    for load in loads:
        gap = run(scene_of(tmp_path, f"{MASS}[[load]]\n{load}\n")).gap[: len(t)]
        np.testing.assert_allclose(gap, 1e-3 - t - 100 * t**2, atol=1e-12)


def test_an_area_that_falls_with_the_lift_is_a_spring(tmp_path: Path) -> None:
    """A mass under p A0 (1 - x/L) moves by L + (x0 - L) cos wt - v/w sin wt, w^2 = p A0/(m L), at second order.

    The load is held for 32 steps at what the opening will be in their middle, and the ledger counts its work.
    """
    load = '[[load]]\npressure = "10 bar"\narea = [["0 mm", "4 mm^2"], ["2 mm", "0.000001 mm^2"]]\n'
    scene = scene_of(tmp_path, MASS + load)
    omega, t = math.sqrt(1e6 * 4e-6 / (1e-3 * 2e-3)), 1e-3
    exact = 2e-3 - 1e-3 * math.cos(omega * t) - 1 / omega * math.sin(omega * t)
    errors = []
    for dt in (1e-6, 5e-7):
        result = run(scene, dt, t)
        assert not np.any(result.force)
        assert result.energy.residual < 1e-9
        errors.append(result.gap[-1] - exact)
    assert errors[0] / errors[1] == pytest.approx(4.0, abs=0.3)
    assert abs(errors[1]) < 4e-4 * abs(exact)
    assert abs(1e-3 - t + 2e3 * t**2 - exact) > 0.1 * exact  # what the area at the seat alone would do


@pytest.mark.parametrize(
    ("own", "load"),
    [
        ('gravity = "-50 m/s^2"\n', 'gravity = "-50 m/s^2"\n'),
        ('gravity = "-50 m/s^2"\n', 'base_motion = "50 m/s^2"\n'),
        ('point_force = { value = "-1 N", at = "12 mm" }\n', 'force = "-1 N"\nat = "12 mm"\n'),
        ('point_force = "-1 N"\n', 'pressure = "-1 bar"\narea = "10 mm^2"\n'),
    ],
)
def test_as_by_the_keys_of_a_beam(own: str, load: str, tmp_path: Path) -> None:
    stated, loaded = scene_of(tmp_path, REED + own), scene_of(tmp_path, f"{REED}[[load]]\n{load}")
    one, other = run(stated), run(loaded)
    assert one.force.max() > 1.0
    np.testing.assert_allclose(other.gap, one.gap, atol=1e-12)


def test_a_pressure_in_crank_angle(tmp_path: Path) -> None:
    """A record of 20 mbar at 60 deg acts on 80 mm^2 in a turn of 2 ms that begins at 300 deg."""
    (tmp_path / "p.csv").write_text("angle [deg],pressure [mbar]\n0,0\n60,20\n120,0\n210,0\n300,0\n", encoding="utf-8")
    load = '[[load]]\npressure = { file = "p.csv", rpm = 30000, angle = "300 deg" }\narea = "80 mm^2"\n'
    scene = scene_of(tmp_path, REED + load)
    assert scene.is_loaded
    course = striker_of(scene).loads[0].amplitude
    t = np.array([0.0, 1, 2, 3, 8]) * 1e-3 / 3
    np.testing.assert_allclose(course(t), [0.0, 0.0, 0.16, 0.0, 0.16], atol=1e-9)


@pytest.mark.parametrize(
    ("reed", "load", "words"),
    [
        (MASS, "", "load.0.pressure:.*base_motion"),
        (MASS, 'force = "1 N"\ngravity = "1 m/s^2"\n', "load.0.gravity: force"),
        (MASS, 'pressure = "1 bar"\n', "load.0.area: required"),
        (MASS, 'force = "1 N"\narea = "1 mm^2"\n', "load.0.area:.*pressure"),
        (MASS, 'gravity = "1 m/s^2"\nat = "1 mm"\n', "load.0.at:.*force"),
        (MASS, 'force = "1 N"\nat = "1 mm"\n', "load.0.at:.*positions"),
        (REED, 'force = "1 N"\nat = "26 mm"\n', "load.0.at: 26 mm.*reed"),
        (
            MASS,
            'pressure = "1 bar"\narea = [["1 mm", "1 mm^2"], ["0 mm", "2 mm^2"]]\n',
            "area.lift:.*increase: 0 mm.*1 mm",
        ),
        (
            MASS,
            'pressure = "1 bar"\narea = [["0 mm", "1 mm^2"], ["1 mm", "-2 mm^2"]]\n',
            r"load.0.area.area:.*-2 mm\^2:",
        ),
        (MASS, 'pressure = "1 bar"\narea = [["-1 mm", "1 mm^2"]]\n', "load.0.area.lift:.*lift.*-1 mm"),
        (MASS, 'pressure = "1 bar"\narea = ["1 mm^2"]\n', "load.0.area: rows"),
        (MASS, 'pressure = { value = "1 bar", rpm = 3000 }\narea = "1 mm^2"\n', "load.0.pressure.rpm: .*no"),
        (ROD, 'gravity = "1 m/s^2"\n', "load.0.gravity:.*'rod'"),
        (MASS, base("reed"), "base.0.of: reed.kind = 'rigid_mass'"),
        (REED, base("stopper"), r"base.0.of:.*\[stopper\]"),
        (REED, base("seat") + base("seat"), "base.1.of:.*before"),
        (REED, base("seat") + 'velocity = "velocity.csv"\n', "base.0.velocity: displacement"),
        (REED, '[[base]]\nof = "seat"\n', "base.0.displacement: nothing"),
        (REED, base("seat").replace("nt.csv", "nt.txt"), "base.0.displacement:.*file"),
        (REED, base("seat").replace('"disp', '{ file = "disp').replace('csv"', 'csv" }'), "displacement: .*'file'"),
        (REED, base("seat") + 'columns = { force = "F" }\n', "columns.*displacement"),
        (RING_PLATE, '[[spring]]\npreload = "6 N"\n', "spring.0.stiffness: required"),
        (RING_PLATE, f"{VALVE}number = 4\n", "spring.0.radius: required"),
        (RING_PLATE, f'{VALVE}number = 4\nradius = "11 mm"\n', "spring.0.radius: 11 mm.*centre"),
        (RING_PLATE, f'{VALVE}points = [["1 mm", "0 mm"]]\n', "spring.0.points: 1 mm.*centre"),
        (RING_PLATE, f'{VALVE}at = "3 mm"\n', "spring.0.at:.*positions"),
        (HEAVY, f'{VALVE}points = [["1 mm", "0 mm"]]\n', "spring.0.points:.*places"),
        (BEAM, f'{VALVE}at = "30 mm"\n', "spring.0.at: 30 mm.*reed.*25 mm"),
        (BEAM, f'{VALVE}at = "3 mm"\nnumber = 2\nradius = "1 mm"\n', "spring.0.number:.*given"),
    ],
)
def test_what_is_wrong_is_named(reed: str, load: str, words: str, tmp_path: Path) -> None:
    write_records(tmp_path)
    message = refusal(scene_of, tmp_path, reed + (load if load.startswith("[") else f"[[load]]\n{load}"))
    assert re.search(words, message)
    assert int(message.split("scene.toml:")[1].split(":")[0]) >= (SEAT + reed).count("\n") + 1


def test_loads_need_no_other_motion(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, REED.split("release")[0] + '[[load]]\nforce = "1 N"\n')
    assert run(scene).gap.max() > 1e-4
    with pytest.raises(SceneError, match=r"reed.release: required"):
        scene_of(tmp_path, REED.split("release")[0])


CARRIED = '[reed]\nkind = "cantilever"\nlength = "25.4 mm"\nn_modes = 12\ndamping_ratio = 0.01\n'
FIXED = ROD.replace("[reed]", "[seat]").replace("2 GPa", "200 GPa").partition("far_end")[0]


def carried(folder: Path, more: str, seat: str = SEAT) -> ImpactResult:
    """Run a reed on what carries it."""
    write_records(folder)
    return run(scene_of(folder, CARRIED + more, seat, f'[contact]\ngap = "20 um"\n{RUN}'), 2e-7)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["velocity", "acceleration"])
def test_either_record_moves_the_clamp_alike(kind: str, tmp_path: Path) -> None:
    by_way, other = (carried(tmp_path, base("reed", each)) for each in ("displacement", kind))
    assert by_way.force.max() > 0.1
    np.testing.assert_allclose(other.gap, by_way.gap, atol=1e-4 * WAY)
    assert by_way.energy.residual < 1e-9


@pytest.mark.slow
def test_on_one_base_all_is_as_in_its_frame(tmp_path: Path) -> None:
    """Reed and seat carried alike: the reed feels its inertia alone, as under the load base_motion."""
    both = carried(tmp_path, base("reed", "acceleration") + base("seat", "acceleration"))
    frame = carried(tmp_path, '[[load]]\nbase_motion = { file = "acceleration.csv" }\n')
    size = frame.force.max()
    assert size > 0.05
    np.testing.assert_allclose(both.force, frame.force, atol=1e-6 * size)
    np.testing.assert_allclose(both.gap, frame.gap, atol=1e-11)


@pytest.mark.slow
def test_a_rod_follows_a_slow_base_and_refuses_a_fast_one(tmp_path: Path) -> None:
    """Its first frequency is c/(4 l) = 148 kHz: 318 Hz is slow; of a rod of 10 m it is not."""
    assert carried(tmp_path, base("seat"), FIXED).energy.residual < 1e-9
    with pytest.raises(GreensFunctionError, match=r"133\.6 Hz.*800 m/s\^2"):
        carried(tmp_path, base("seat"), FIXED.replace("9 mm", "10 m"))


def test_a_record_shorter_than_the_run_is_refused(tmp_path: Path) -> None:
    write_records(tmp_path)
    scene = scene_of(tmp_path, CARRIED + base("reed"))
    (tmp_path / "displacement.csv").write_text("time [ms],displacement [um]\n0,0\n1,1\n", encoding="utf-8")
    with pytest.raises(TimeSeriesError, match=r"displacement.*0\.\.0\.001 s"):
        run(scene)


STIFF = '[seat]\nkind = "spring"\nstiffness = "100 N/um"\n'
AREA, SPAN, RIGIDITY = math.pi * 75e-6, 25e-3, 200e9 * 10e-3 * 0.3e-3**3 / 12
RING_MASS = 7850 * 1.5e-3 * AREA


def sprung_scene(folder: Path, text: str, more: str = "", run: str = 'duration = "1 ms"') -> Scene:
    return load_text(folder, f"{STIFF}{text}{more}[run]\n{run}\n")


@pytest.mark.slow
@pytest.mark.parametrize("places", ['number = 4\nradius = "7.5 mm"\n', ""])
def test_a_ring_plate_heaves_and_rocks(places: str, tmp_path: Path) -> None:
    """The ring heaves with sqrt(k/m) and rocks twice with sqrt(k r^2/2 / I), I = m ((R^2 + r_i^2)/4 + h^2/12), for
    point and spread springs; it bends by 2e-4 of either, and k or m 3 % off are 1.5 %."""
    omega = striker_of(sprung_scene(tmp_path, RING_PLATE, VALVE + places)).greens.modal.omega
    turns = RING_MASS * ((1e-4 + 25e-6) / 4 + 1.5e-3**2 / 12)
    rocks, heaves = math.sqrt(4e3 * 7.5e-3**2 / 2 / turns), math.sqrt(4e3 / RING_MASS)
    assert omega[:3] == pytest.approx([rocks, rocks, heaves], rel=1e-3)
    assert omega[3] > 50 * heaves


def test_a_rigid_mass_lands_under_its_springs(tmp_path: Path) -> None:
    """The mass moves as its oscillator; the springs' force is P + k (g + x) and, as it touches, P."""
    scene = sprung_scene(
        tmp_path, HEAVY, f'{VALVE}[contact]\ngap = "1 mm"\n', 'duration = "2 ms"\ntime_step = "0.2 us"'
    )
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
        more = f'n_modes = {n_modes}\n[contact]\npreload = true\n{VALVE}at = "15 mm"\n'
        scene = sprung_scene(tmp_path, BEAM, more, 'duration = "0.1 ms"\ntime_step = "1 us"')
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
    more = f'{VALVE}number = 4\nradius = "7.5 mm"\n[contact]\ngap = "0.2 mm"\n'
    run = 'duration = "0.7 ms"\nfilter_width = "20 us"\n[accuracy]\ntarget = 0.9'
    summary: dict[str, Any] = run_scene(sprung_scene(tmp_path, RING_PLATE, more, run), tmp_path).summary
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
    turned = striker_of(sprung_scene(tmp_path, DISC, f'[[load]]\n{shift}[[load]]\ngravity = "-9.81 m/s^2"\n'))
    mass, modal = 7850 * 1e-3 * math.pi * 64e-6, turned.greens.modal
    rigid = modal.omega == 0
    push, weight = turned.loads
    assert (push.shape[rigid] ** 2).sum() == pytest.approx(1 / mass + 9e-6 / (mass * (16e-6 + 1e-6 / 12)), rel=1e-3)
    assert (weight.shape[rigid] ** 2).sum() == pytest.approx(1 / mass, rel=1e-6)
    assert float(weight.amplitude(np.zeros(1))[0]) == pytest.approx(-9.81 * mass, rel=1e-3)
    ring = striker_of(sprung_scene(tmp_path, RING_PLATE, '[[load]]\npressure = "-1 bar"\narea = "236 mm^2"\n'))
    assert np.abs(ring.loads[0].shape[ring.greens.modal.omega > 0]).max() < 1e-6 / math.sqrt(RING_MASS)  # it bends none


def test_a_plate_that_its_springs_leave_free_to_rock(tmp_path: Path) -> None:
    """A ring in arcs that its springs leave free to rock is refused: each arc would move as a free body."""
    more = f'{VALVE}points = [["6 mm", "0 mm"]]\n'
    scene = sprung_scene(tmp_path, RING_PLATE, more)
    method = replace(scene.reed.stated(), lip=scene.reed.own_lip.__class__(7e-3, 1e-3, 4))
    greens = scene.reed.solved(method).greens
    with pytest.raises(ValueError, match="leave the reed free to rock"):
        striker_of(scene, greens=greens)
