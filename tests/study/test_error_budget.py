"""Error bars of measures: how the runs behind them are made, also of parts and ends of a run, and that they hold."""

import math
from dataclasses import replace

import numpy as np
import pytest

import impact
from impact.after.landings import JUMP, Landing
from impact.after.loads import StaticLoad
from impact.march.ladder import march
from impact.runs.variations import SAFETY, Budget, narrow_greens
from seatfem.study.error_budget import CLOCK, FLOOR_OF_SPRING, FLOORS, unresolved_steps, with_jumps
from seatfem.study.impacts.landings import Landings, landings_of_march
from seatfem.study.impacts.touches import displacement_of
from seatfem.study.impacts.window import Excerpt, window_of
from seatfem.study.ladders.ladder import ComputedRun
from seatfem.study.method import stated_method
from seatfem.study.scene.measures import ContactDuration, ContactRecord, Impulse
from tests.steps import ErrorEstimate, ModalGreens, Residual, Solved, error_budget, run_contacts, striker_of
from tests.study.small_scenes import ANNULAR, REED, scene_of

MODES = ModalGreens(
    np.array([2e6, 5e6, 9e6]), np.full(3, 0.02), np.array([[20.0], [30.0], [25.0]]), Residual.exponential(2e-11, 1e-2)
)
SEAT = 'seat = { kind = "spring", stiffness = "40 N/um" }'
BALL = 'reed = { kind = "rigid_mass", mass = "0.1 g", velocity = "-1 m/s" }\nrun = { duration = "12 us" }'
STIFFNESS, MASS, SPEED = 40e6, 1e-4, 1.0
SPRING = impact.spring(stiffness=STIFFNESS)
ON_PLANE = Solved(SPRING, plane=True)


def budget_of(solved: Solved = ON_PLANE, dt: float = 1e-8, level: str = "", **changes: object) -> Budget:
    """Return the error budget of a ball on a spring; ``level``: of the seat, in place of the one that is stated."""
    scene = scene_of(SEAT, BALL, **changes)
    method, striker = stated_method(scene), striker_of(scene)
    if level:
        method = replace(method, seat=replace(method.seat, level=level))
    return error_budget(ComputedRun(scene, method, solved, striker), run_contacts(scene, striker, SPRING, dt))


def test_narrowing_keeps_the_statics_and_the_start() -> None:
    """Modes above the band become flexibility: compliance and g(0+) stay, frequencies go."""
    narrow = narrow_greens(MODES, 1e6)
    assert narrow.omega.tolist() == [2e6, 5e6]
    np.testing.assert_allclose(narrow.static_compliance(), MODES.static_compliance(), rtol=1e-12)
    np.testing.assert_allclose(narrow.initial_value(), MODES.initial_value(), rtol=1e-12)
    assert narrow.residual.static()[0, 0] == pytest.approx(2e-11 + (25 / 9e6) ** 2)


def test_a_spring_has_an_error_of_the_time_step_only() -> None:
    """The step's bar alone covers the error of the peak V sqrt(K m), and is of first order."""
    exact = SPEED * math.sqrt(STIFFNESS * MASS)
    bars = []
    for dt in (4e-8, 2e-8, 1e-8):
        budget = budget_of(dt=dt)
        others = {source: part["impulse"] for source, part in budget.parts.items() if source != "time_step"}
        assert others == dict.fromkeys(("mesh", "reduction", "model", "patch"), 0.0)
        assert budget.unknown == ()
        assert budget.dominant("seat_displacement") == "time_step"
        # the largest displacement is the peak force over K
        error = abs(budget.values["seat_displacement"] * STIFFNESS - exact)
        assert 0 < error <= budget.bar("seat_displacement") * STIFFNESS <= 5 * error
        bars.append(budget.bar("seat_displacement"))
    assert np.log2(np.array(bars[:-1]) / bars[1:]) == pytest.approx([1, 1], abs=0.15)


def test_an_error_of_g_becomes_one_of_the_force_not_of_the_impulse() -> None:
    """A stiffness 4 % off changes the peak on a spring by 2 %, and the impulse not beyond the step."""
    budget = budget_of(Solved(SPRING, level_error=0.04))
    peak, impulse = (budget.parts["model"][name] / budget.values[name] for name in ("filtered_peak", "impulse"))
    assert peak == pytest.approx(1 - 1 / math.sqrt(1.04), rel=0.1)
    assert impulse < 2e-3


def test_a_seat_taken_for_a_spring_has_its_floor() -> None:
    """The impulse of a mass on a spring is 2 m V whatever its stiffness: the floor alone knows of waves."""
    budget = budget_of(Solved(SPRING.with_error(ErrorEstimate(1e-3, 1e-3), {}), plane=True), level="spring")
    exact, floors = budget_of(), {**FLOORS, "model": FLOOR_OF_SPRING, "patch": 0.0}
    for source in ("model", "mesh", "reduction"):
        assert budget.parts[source]["impulse"] >= floors[source] * budget.values["impulse"] > 0
        assert exact.parts[source]["impulse"] == 0


def touches(*pieces: tuple[int, float]) -> ContactRecord:
    """Return a record of touches with forces [N] that each last so many microseconds."""
    force = np.concatenate([[0.0], *(np.full(steps, each) for steps, each in pieces), [0.0]])
    return ContactRecord(force, 1e-6, 1e-6, np.zeros_like(force))


JUMPS = [  # openings end a group from 30 us on
    ("an opening just short of the limit", ((50, 1.0), (28, 0.0), (20, 1.0)), 0.02, 48),
    ("an opening just beyond it", ((50, 1.0), (32, 0.0), (20, 1.0)), 0.02, 52),
    ("nearer than ten times what the impulse is off", ((50, 1.0), (28, 0.0), (20, 1.0)), 0.007, 48),
    ("not so near", ((50, 1.0), (28, 0.0), (20, 1.0)), 0.006, 0),
    ("never more than a tenth", ((50, 1.0), (26, 0.0), (20, 1.0)), 0.2, 0),
    ("a light touch that may be none", ((50, 1.0), (10, 0.0), (2, 0.1)), 0.0041, 12),
    ("one that is there", ((50, 1.0), (10, 0.0), (2, 0.1)), 0.0039, 0),
    ("the heaviest is there", ((50, 1.0),), 2.0, 0),
    ("none", ((50, 0.0),), 0.5, 0),
]


@pytest.mark.parametrize(("pieces", "share", "jump"), [row[1:] for row in JUMPS], ids=[row[0] for row in JUMPS])
def test_a_duration_may_jump(pieces: tuple[tuple[int, float], ...], share: float, jump: float) -> None:
    blow = touches(*pieces)
    assert ContactDuration().jump(blow, share) == pytest.approx(jump * 1e-6, abs=1e-15)
    assert Impulse().jump(blow, share) == 0.0


def test_a_jump_is_in_the_bar_of_the_duration_alone() -> None:
    """It is in the part of what blurs the impulse most."""
    blow = touches(*JUMPS[0][1])
    values = {"impulse": 70e-6, "contact_duration": 98e-6}
    parts = {"mesh": {"impulse": 1e-6, "contact_duration": 1e-6}, "model": dict.fromkeys(values, 0.1e-6)}
    before = Budget(values, parts, ("mesh", "model"))
    after = with_jumps(before, blow)  # known to 1.5/70, 2.1 %
    assert after.bar("contact_duration") == pytest.approx(SAFETY * math.hypot(1e-6 + 48e-6, 0.1e-6))
    assert after.bar("impulse") == before.bar("impulse")
    assert after.dominant("contact_duration") == "mesh"
    assert with_jumps(Budget(values, {}, ("mesh",)), blow).parts == {}


def test_times_known_to_whole_steps_err_by_a_step() -> None:
    """A duration errs by a step for a whole contact, by a jump for a resolved landing, by nothing without one."""
    force = np.zeros(100)
    force[21:31] = 1.0
    whole = Landing(20e-6, 30e-6, 25e-6, 0, 1.0, 1.0, 0.0, 1.0, 1e-5, pressed_on=False, cut_off=False)
    part = replace(whole, to_touch=0.4e-6, to_opening=-0.7e-6, is_resolved=True)
    duration, none = ContactDuration(), Landings((), (), StaticLoad(*np.zeros((3, 1))))
    for landing, value, error in ((whole, 10e-6, 1.0), (part, 8.9e-6, JUMP), (replace(part, end=29e-6), 10e-6, 1.0)):
        record = ContactRecord(force, 1e-6, 4e-6, landings=(landing,))
        assert duration.evaluate(record) == pytest.approx(value)
        assert unresolved_steps(none, record) == {"contact_duration": error}
    assert unresolved_steps(none, ContactRecord(np.zeros(100), 1e-6, 4e-6)) == {}


STEP = 20e-9


def test_free_flight_is_exact() -> None:
    """A window of the run is the run: same filtered peak and duration, whatever is left out before."""
    scene = scene_of(ANNULAR, REED)
    seat, striker = scene.seat.estimate(), striker_of(scene, 30)
    touches = run_contacts(scene, striker, seat, STEP)
    window = window_of(scene, striker, touches.seat.force[1:], STEP, landings=touches.landings.seat)
    assert window.start > 0.5e-3
    excerpt = Excerpt(scene, window, seat, striker)
    whole = replace(excerpt, window=replace(window, start=0.0, duration=window.start + window.duration))
    (inside,), (outside,) = (each.measures([STEP]) for each in (excerpt, whole))
    assert {"impulse", "filtered_peak", "contact_duration"} <= set(inside)
    for name, value in outside.items():
        assert inside[name] == pytest.approx(value, rel=1e-6), name


REED_ABOVE = impact.cantilever_reed(
    young=200e9, density=7850, length=30e-3, width=10e-3, thickness=0.4e-3, damping_ratio=0.01, n_modes=8,
    tip_deflection=1e-3,
)  # fmt: skip
ROD = impact.fixed_rod(young=200e9, density=7850, area=1e-5, length=30e-3)
PLATE = impact.infinite_plate(young=200e9, poisson=0.3, density=7850, thickness=5e-3)


@pytest.mark.parametrize("greens", [PLATE, ROD], ids=["poles", "step weights"])
def test_a_run_that_is_cut_is_the_run_that_ends_there(greens: impact.GreensFunction) -> None:
    """Forces, landings and the seat's motion agree to round-off, also where the end cuts a landing."""
    problem, dt = impact.ContactProblem(REED_ABOVE, impact.Body(greens), gap=0.0), 2e-7
    whole = march(problem, dt, 20000 * dt)
    closed = np.flatnonzero(whole.force > 0)
    for steps in (15000, int(closed[0]) + 20, 20000):
        part, short = whole.until(steps), march(problem, dt, steps * dt)
        assert part.steps == short.steps
        np.testing.assert_allclose(part.force, short.force, rtol=0, atol=1e-9 * short.force.max())
        np.testing.assert_allclose(displacement_of(part), displacement_of(short), rtol=0, atol=1e-15)
        landings, expected = (landings_of_march(each, 1e-6).seat for each in (part, short))
        assert len(landings) == len(expected) > 0
        for one, other in zip(landings, expected, strict=True):
            assert one.cut_off == other.cut_off == (steps == closed[0] + 20)
            assert one.impulse == pytest.approx(other.impulse, rel=1e-9)
            assert one.filtered_peak == pytest.approx(other.filtered_peak, rel=1e-9)


WAY = 30e-6  # from spring to spring [m]
TOUCH = np.pi * np.sqrt(MASS / STIFFNESS)  # half a period
PERIOD = 2 * (WAY / SPEED + TOUCH)
FIRST = 10e-6 / SPEED
IMPULSE = 2 * MASS * SPEED


@pytest.mark.slow
def test_an_end_within_the_delay_of_a_touch_is_in_the_bar_of_the_impulse() -> None:
    """The bar holds the last touch of the seat, which came later than known and is not finished: a step of 2 ns delays
    the eighth touch by about 4 us, most of a touch."""
    late = FIRST + 7 * PERIOD + 1.2 * TOUCH
    stopper = {"kind": "spring", "stiffness": "40 N/um", "gap": "20 um"}
    budget = budget_of(dt=2e-9, stopper=stopper, contact={"gap": "10 um"}, run={"duration": f"{1e6 * late} us"})
    whole, rest = divmod(late - FIRST, PERIOD)  # the mass loses nothing and returns every period
    exact = IMPULSE * (whole + 0.5 * (1 - np.cos(np.pi * min(rest / TOUCH, 1.0))))
    error = abs(budget.values["impulse"] - exact)
    assert error > 0.02 * budget.values["impulse"]  # an eighth of it is at stake
    assert error <= budget.bar("impulse") <= (SAFETY + 1) * IMPULSE  # of a touch, and what was there before
    assert budget.dominant("impulse") == "time_step"
    assert CLOCK not in budget.values
    assert all(CLOCK not in part for part in budget.parts.values())
