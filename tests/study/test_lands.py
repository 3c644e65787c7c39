"""Seats with several lands: which land closes first and when, how the impulse divides, what is refused."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

import impact
from impact.bodies.body import Body, ModalState
from impact.gas import FORWARD, GasHistory
from impact.greens.modal import ModalGreens, Residual
from seatfem.results import OF_LANDS
from seatfem.study.answers.verdict import closing_order
from seatfem.study.impacts.contact import record_of
from seatfem.study.impacts.landings import DELAY, SHARE, Landings, landings_of_lands
from seatfem.study.scene.wings import PortLift
from seatfem.wings.gas import masses_over_lands
from tests.gallery import Gallery, load_text, read_summary, refusal
from tests.steps import Division, Scene, SceneError, bed, check_files, problem_of, striker_of, values_of_record

ROOT = Path(__file__).parents[2]
SEAT = (
    '[seat]\nkind = "annular"\nmaterial = "steel"\nbore_radius = "7 mm"\nlip_width = "1 mm"\nlip_edge_radius = "0 mm"\n'
    'second_lip_radius = "12 mm"\nouter_radius = "16 mm"\nthickness = "6 mm"\n'
)
RING = (
    '[reed]\nkind = "ring_plate"\nmaterial = "steel"\nouter_diameter = "27 mm"\ninner_diameter = "13 mm"\n'
    'thickness = "2 mm"\nvelocity = "-1 m/s"\n'
)
RUN = '[run]\nduration = "3 ms"\nfilter_width = "20 us"\n'
ARCS, INNER, OUTER = 24, 9, 15  # equal areas: pi (8^2 - 7^2) to pi (13^2 - 12^2) mm^2 is 3 to 5
MASS, INERTIA = 6e-3, 3.4e-7  # kg, kg m^2
SPEED, GAP, TILT = 1.0, 20e-6, math.radians(0.2)
SOFT, STEP = 1e4, 1e-6  # N/m of all springs, which hardly slow the ring within 20 us: (k/m) t^2/6 = 1e-4; s


def scene_of(folder: Path, contact: str, seat: str = SEAT) -> Scene:
    return load_text(folder, seat + RING + f"[contact]\nports = {ARCS}\n{contact}" + RUN)


def landed(scene: Scene) -> tuple[Landings, dict[str, float]]:
    """Return the landings of a rigid ring on soft springs under both lands, and the values of the run."""
    lip, division = scene.geometry.struck(ARCS), Division(ARCS)
    assert lip is not None
    x, y = lip.line().mean(axis=1).T
    shapes = np.array([np.full(ARCS, MASS**-0.5), y * INERTIA**-0.5, x * INERTIA**-0.5])
    greens = ModalGreens(np.zeros(3), np.zeros(3), shapes, Residual.spring(np.zeros((ARCS, ARCS))), division.names)
    falling = ModalState(np.zeros(3), np.array([-SPEED * MASS**0.5, 0.0, 0.0]))
    problem = problem_of(scene, Body(greens, state=falling), impact.Body(bed(division, SOFT)))
    record = record_of(scene, problem, STEP)
    assert record.landings is not None
    return record.landings, dict(values_of_record(record, record.landings))


def test_a_tilted_ring_meets_the_outer_land_first(tmp_path: Path) -> None:
    """Kinematics: a segment closes after its gap over the speed, its gap the mean of the tilted plane along it. The
    outer land is touched at 276 deg, the inner at 260 deg, where their lowest segments have their middles."""
    landings, values = landed(scene_of(tmp_path, f'gap = "20 um"\ntilt = "{math.degrees(TILT)} deg"\n'))
    inner, outer = landings_of_lands(landings)
    assert inner is not None
    assert outer is not None

    def gap(radius: float, arcs: int, angle: float) -> float:
        depth = -radius * np.sinc(1 / arcs) * math.sin(math.radians(angle))
        return GAP + math.tan(TILT) * (13e-3 - depth)

    expected = gap(12.5e-3, OUTER, 276) / SPEED, gap(7.5e-3, INNER, 260) / SPEED
    assert outer.touch == pytest.approx(expected[0], rel=1e-3)
    assert inner.touch - outer.touch == pytest.approx(expected[1] - expected[0], rel=0.01)  # slowed by the first land
    assert values[f"seat land 1 {DELAY}"] == inner.touch - outer.touch
    assert values[f"seat land 2 {DELAY}"] == 0


def test_a_flat_ring_shares_its_impulse_by_area(tmp_path: Path) -> None:
    """Statics: under equal penetration springs of equal stiffness per area carry 3/8 and 5/8; the half period of the
    ring on them is the duration on both lands."""
    landings, values = landed(scene_of(tmp_path, 'gap = "20 um"\n'))
    period = 2 * math.pi * math.sqrt(MASS / SOFT)
    for number, (one, share) in enumerate(zip(landings_of_lands(landings), (3 / 8, 5 / 8), strict=True), start=1):
        assert one is not None
        assert one.touch == pytest.approx(GAP / SPEED, rel=1e-6)
        assert one.duration == pytest.approx(period / 2, rel=2e-3)  # second order in the step
        assert one.impulse == pytest.approx(2 * MASS * SPEED * share, rel=2e-3)
        assert values[f"seat land {number} {SHARE}"] == pytest.approx(share, rel=1e-9)
        assert one.filtered_peak == pytest.approx(SPEED * math.sqrt(SOFT * MASS) * share, rel=2e-3)


@pytest.mark.parametrize(
    ("change", "named"),
    [
        (('second_lip_radius = "12 mm"', 'second_lip_radius = "7.5 mm"'), "second_lip_radius: 7.5 mm"),
        (('second_lip_radius = "12 mm"', 'second_lip_radius = "15.5 mm"'), "outer_radius: 16 mm"),
        (('second_lip_radius = "12 mm"', 'port_depth = "1 mm"'), "port_depth: 1 mm.*second_lip_radius"),
        (('second_lip_radius = "12 mm"', 'second_lip_radius = "12 mm"\nport_depth = "6 mm"'), "port_depth: 6 mm"),
    ],
)
def test_a_second_lip_that_cannot_be_is_refused(tmp_path: Path, change: tuple[str, str], named: str) -> None:
    assert SEAT.count(change[0]) == 1
    assert re.search(named, refusal(load_text, tmp_path, SEAT.replace(*change) + RING + RUN))


def test_the_order_is_told_with_its_doubt() -> None:
    """Lands whose times differ by less than the error bar are in no known order; those not touched are named."""
    first = {"land": "port 2", "order": 1, "time_s": 1e-3, "closing_speed_m_per_s": 1.0, "land_deg": 180.0}
    later = {"land": "port 1", "order": 2, "after_first_s": 5e-6, "error_bar_after_first_s": 1e-6}
    sentence = closing_order({"lands": [later, first, {"land": "port 3", "order": None}]})
    assert sentence.startswith("Port 2 (at 180 deg) is touched first, at 1 ms")
    assert "port 1 5.0 ± 1.0 us later" in sentence
    assert sentence.endswith("port 3 is not touched in this landing.")
    doubtful = closing_order({"lands": [first, {**later, "error_bar_after_first_s": 6e-6}]})
    assert "which of them is earlier is not known" in doubtful


PORTS = (
    '[seat]\nkind = "plate"\nmaterial = "steel"\nports = 2\nlayout = "row"\nport_radius = "4 mm"\npitch = "12 mm"\n'
    'margin = "6 mm"\nthickness = "6 mm"\nland_width = "1 mm"\nclamp_width = "2 mm"\n'
    '[reed]\nkind = "flapper"\nmaterial = "steel"\nroot_width = "12 mm"\ntaper_length = "3 mm"\nneck_width = "10 mm"\n'
    'neck_length = "20 mm"\npaddle_diameter = "24 mm"\nthickness = "0.3 mm"\ngreens = { bandwidth = "20 kHz" }\n'
)
GAS = (
    '[gas]\nvalve = "suction"\nsuction = { pressure = "1 bar", temperature = "20 degC" }\n'
    'discharge = { pressure = "5 bar", temperature = "180 degC" }\nrpm = 3000\nport_diameter = "8 mm"\n'
    'bore = "50 mm"\nstroke = "40 mm"\nrod = "80 mm"\nclearance = "4 cm^3"\n'
)


def test_gas_divides_over_ports_by_their_lifts() -> None:
    """Two equal ports lifted 1 to 3 pass 1/4 and 3/4 of the gas; from a quarter of the diameter on no more."""
    time = np.linspace(0, 1e-3, 11)
    states = np.zeros((11, 7))
    states[:, FORWARD] = 8e-6 * time / time[-1]
    history = GasHistory(time, np.zeros(11), states)
    rim, area = math.pi * 8e-3, math.pi * 16e-6

    def shares(one: float, other: float) -> list[float]:
        lands = [PortLift("", np.full(11, lift), rim, area) for lift in (one, other)]
        masses = masses_over_lands(lands, history, 1e-4)
        return [masses[f"gas_land_{number}_mass_forward_kg"] / 8e-6 for number in (1, 2)]

    assert shares(0.5e-3, 1.5e-3) == pytest.approx([0.25, 0.75])
    assert shares(3e-3, 4e-3) == pytest.approx([0.5, 0.5])


@pytest.mark.slow
def test_gas_and_a_pressure_act_over_each_port_as_it_is_drawn(tmp_path: Path) -> None:
    """The static load of gas is that of two ports, of a pressure that of its area. Its part in each mode is the mean of
    that mode over both ports, which differs by more than 3 % from that over a disc at the paddle's centre."""
    scene = load_text(tmp_path, PORTS + GAS + '[contact]\npreload = true\n[run]\nduration = "2 ms"\n')
    points, body = scene.geometry.port_points(), striker_of(scene)
    assert [tuple(np.round(1e3 * each.mean(axis=0), 6)) for each in points] == [(-6, 0), (6, 0)]
    [load] = body.loads
    expected = np.mean([scene.reed.pushed_at(body, each).mean(axis=1) for each in points], axis=0)
    assert load.shape == pytest.approx(expected, rel=1e-12)
    of_disc = scene.reed.pushed_at(body, None, by="pressure")[:, 0]
    assert np.abs(load.shape - of_disc).max() > 0.03 * np.abs(of_disc).max()
    assert scene.geometry.port_areas() == pytest.approx([math.pi * 16e-6] * 2, rel=1e-3)  # within chords
    pressed = '[[load]]\npressure = "-0.2 bar"\narea = "90 mm^2"\n[run]\nduration = "2 ms"\n'
    [pressure] = striker_of(load_text(tmp_path, PORTS + pressed)).loads
    assert pressure.shape == pytest.approx(expected, rel=1e-12)
    assert pressure.amplitude(np.zeros(1)) == pytest.approx(-0.2e5 * 90e-6)
    assert scene.gas.areas_of(2).force(0.0) == pytest.approx(2 * math.pi * 16e-6, rel=1e-12)
    with pytest.raises(SceneError, match=r"gas\.ports: 3: the reed meets lands of 2 ports; use 2"):
        check_files(load_text(tmp_path, PORTS + GAS + 'ports = 3\n[run]\nduration = "2 ms"\n'))


@pytest.mark.slow
def test_a_run_says_which_land_closes_first(gallery: Gallery) -> None:
    """The outer land of a tilted ring valve closes first; every number of a land has its bar; shares add up to one."""
    summary = read_summary(gallery.run_of(ROOT / "examples" / "ring_valve_lands.toml"))
    inner, outer = summary["lands"]
    assert [(each["land"], each["order"]) for each in (inner, outer)] == [("inner land", 2), ("outer land", 1)]
    assert summary["first_touch_land"] == summary["landings"][0]["land"] == "outer land"
    assert {summary["line_force_peak_land"], summary["line_impulse_peak_land"]} <= {"inner land", "outer land"}
    assert inner["impulse_share"] + outer["impulse_share"] == pytest.approx(1, rel=1e-9)
    assert inner["time_s"] - outer["time_s"] == pytest.approx(inner["after_first_s"], rel=1e-9)
    for record in (inner, outer):
        known = [key for key in OF_LANDS if record.get(key) is not None]
        missing = [key for key in known if record.get(f"error_bar_{key}") is None]
        assert missing == ["closed_all_round_s", "static_load_N"]
    assert [each["land"] for each in summary["land_landings"]][:2] == ["outer land", "inner land"]
