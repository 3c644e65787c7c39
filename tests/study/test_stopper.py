"""[stopper]: a second contact of the same striker, known exactly between two springs, and as built by hand."""

import json
import math
import re
from pathlib import Path

import numpy as np
import pytest

import impact
from impact import measures
from impact.runs.variations import SAFETY, Budget
from impact.storage.hdf5 import load_results, save_greens
from seatfem.study.impacts.touches import Touches, stopper_values
from seatfem.study.ladders.ladder import ComputedRun
from tests.gallery import load_text, refusal
from tests.steps import ErrorEstimate, Scene, Solved, error_budget, run_contacts, run_scene, stated_method, striker_of

SEAT = '[seat]\nkind = "spring"\nstiffness = "1 N/um"\n'
MASS = '[reed]\nkind = "rigid_mass"\nmass = "1 g"\nvelocity = "-1 m/s"\n[contact]\ngap = "0.1 mm"\n'
STOPPER = '[stopper]\nkind = "spring"\nstiffness = "4 N/um"\ngap = "0.2 mm"\n'
RUN = '[run]\nduration = "1.4 ms"\ntime_step = "0.1 us"\n[accuracy]\ntarget = "5 %"\n'
REED = (
    '[reed]\nkind = "cantilever"\nlength = "25.4 mm"\nn_modes = 8\nrelease = { tip_deflection = "1 mm" }\n'
    'pressure = "0.3 bar"\n'
)
ABOVE = '[stopper]\nkind = "spring"\nstiffness = "5 N/um"\nat = "18 mm"\ngap = "0.8 mm"\n'
SHORT = '[run]\nduration = "2 ms"\ntime_step = "0.2 us"\n[accuracy]\ntarget = "50 %"\n'
KEYS = ("peak_force_N", "filtered_peak_force_N", "impulse_Ns", "first_contact_s", "contact_count")


def bounced(scene: Scene, dt: float) -> Touches:
    return run_contacts(scene, striker_of(scene), impact.spring(stiffness=1e6), dt)


MASS_KG, SPEED, WAY = 1e-3, 1.0, 3e-4
OF_SEAT, OF_STOPPER = (math.pi * math.sqrt(MASS_KG / k) for k in (1e6, 4e6))  # s, of each contact
SECOND = 1e-4 + OF_SEAT + OF_STOPPER + 2 * WAY / SPEED  # s, when the mass comes back to the seat


def test_a_mass_between_two_springs(tmp_path: Path) -> None:
    """The mass has half periods pi sqrt(m/k), flights at v, 2 m v each time and peaks v sqrt(k m).

    A rigid contact on a spring takes energy in proportion to the step (measured: 4e-3 of the stopper's impulse at 0.05
    us), so that errors halve with it and their extrapolation is exact to second order.
    """
    scene = load_text(tmp_path, SEAT + MASS + STOPPER + RUN)
    coarse, fine = bounced(scene, 1e-7), bounced(scene, 5e-8)
    momentum, peak = 2 * MASS_KG * SPEED, SPEED * math.sqrt(4e6 * MASS_KG)
    exact = {
        "seat impulse": (lambda run: measures.impulse(run.seat), 2 * momentum, 1e-4),
        "stopper impulse": (lambda run: measures.impulse(run.stopper), 2 * momentum, 1e-4),
        "stopper peak": (lambda run: run.stopper.force[: len(run.stopper.force) // 2].max(), peak, 1e-4),
        # starts and ends are known to a step
        "first": (lambda run: measures.contact_groups(run.stopper)[0, 0], 1e-4 + OF_SEAT + WAY / SPEED, 2e-7 / 5e-4),
        "second": (lambda run: measures.contact_groups(run.seat)[1, 0], SECOND, 2e-7 / SECOND),
        "length": (lambda run: float(np.diff(measures.contact_groups(run.stopper)[0])[0]), OF_STOPPER, 4e-3),
    }
    for name, (measure, value, within) in exact.items():
        assert 2 * measure(fine) - measure(coarse) == pytest.approx(value, rel=within), name  # of first order
    for name in ("seat impulse", "stopper impulse"):
        measure, value, _ = exact[name]
        ratio = (measure(coarse) - value) / (measure(fine) - value)
        assert ratio == pytest.approx(2.0, abs=0.03), name  # of first order
    assert len(measures.contact_groups(coarse.seat)) == len(measures.contact_groups(coarse.stopper)) == 2
    assert fine.seat.energy.residual < 1e-12


@pytest.mark.slow
def test_a_cantilever_released_towards_the_stopper(tmp_path: Path) -> None:
    """A reed released away from the seat runs only with a stopper; a stopper that flies away is refused."""
    reed = REED.replace('tip_deflection = "1 mm"', 'mode = 1, velocity = "2 m/s"').replace('pressure = "0.3 bar"\n', "")
    stopper = STOPPER.replace("0.2 mm", "0.5 mm")
    summary = run_scene(load_text(tmp_path, SEAT + reed + stopper + SHORT), tmp_path / "out", pictures=False).summary
    assert 0.5e-3 / 2 < summary["stopper_first_contact_s"] < 0.3e-3 < summary["first_contact_s"]
    message = refusal(load_text, tmp_path, SEAT + reed + SHORT)
    assert re.search(r"reed\.release\.velocity: .*fly away.*'-2 m/s'.*\[stopper\]", message)
    away = '[stopper]\nkind = "rigid_mass"\nmass = "1 g"\nvelocity = "1 m/s"\ngap = "1 mm"\n'
    assert re.search(r"stopper\.velocity: .*'-1 m/s'", refusal(load_text, tmp_path, SEAT + reed + away + SHORT))


def test_a_scene_is_the_problem_built_by_hand(tmp_path: Path) -> None:
    """Seat at the tip, stopper at 18 mm: the reed has two ports, and both contacts are those of `impact.Contact`."""
    law = 'law = { kind = "spring", stiffness = "50 N/um" }\n'
    scene = load_text(tmp_path, SEAT + REED + ABOVE + law + SHORT)
    touches = bounced(scene, 2e-7)
    reed = impact.reed(
        impact.Cantilever(200e9, 7850.0, 25.4e-3, 10e-3, 0.305e-3),
        n_modes=8,
        contact_at=(25.4e-3, 18e-3),
        release=impact.StaticShape(1e-3),
        loads=(impact.Pressure(lambda t: np.full(np.shape(t), 3e4)),),
    )
    contacts = [
        impact.Contact(impact.spring(stiffness=1e6), striker_port=0),
        impact.Contact(
            impact.spring(stiffness=5e6), gap=0.8e-3, law=impact.LinearSpring(50e6), side=-1, striker_port=1
        ),
    ]
    byhand = impact.solve(impact.ContactProblem(reed, contacts=contacts), dt=2e-7, duration=2e-3)
    assert byhand.force[:, 1].max() > 1.0
    for column, one in enumerate((touches.seat, touches.stopper)):
        for name in ("force", "gap", "striker_displacement", "target_displacement"):
            theirs = getattr(byhand, name)[:, column]
            np.testing.assert_allclose(getattr(one, name), theirs, rtol=0, atol=1e-12 * np.abs(theirs).max())


@pytest.mark.slow
def test_the_keys_of_a_run(tmp_path: Path) -> None:
    """Seat, stopper and both spring baselines have their own keys, with the values of their results."""
    scene = load_text(tmp_path, SEAT + MASS + STOPPER + RUN)
    out = tmp_path / "out"
    run_scene(scene, out, pictures=False)
    summary = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    results = load_results(out / "result.h5")
    assert set(results) == {"wave", "spring", "stopper", "spring_stopper"}
    assert results["wave"].force.ndim == results["stopper"].force.ndim == 1
    for name, prefix in (("stopper", "stopper_"), ("wave", ""), ("spring_stopper", "spring_stopper_")):
        values = {key: summary[prefix + key] for key in KEYS}
        one = results[name]
        assert values["peak_force_N"] == measures.peak_force(one)
        assert values["filtered_peak_force_N"] == measures.filtered_peak_force(one, 1e-6)
        assert values["impulse_Ns"] == pytest.approx(measures.impulse(one), rel=1e-13)  # summed in another order
        assert values["first_contact_s"] == measures.contact_groups(one)[0, 0]
        assert values["contact_count"] == 2
    assert summary["stopper_kind"] == "spring"
    assert summary["restitution"] is None  # of a mass that came back from the stopper
    assert summary["energy_residual"] < 1e-12
    # the bars are the seat's: a spring of the same stiffness is the same seat
    assert summary["spring_impulse_Ns"] == pytest.approx(summary["impulse_Ns"], rel=1e-9)
    assert summary["error_bar_impulse_Ns"] > abs(summary["impulse_Ns"] - 4e-3)


CUT = '[run]\nduration = "{} ms"\n[accuracy]\ntarget = "5 %"\n'
"""A run that ends during the second contact with the seat: its impulse tells when that began."""


def stopper_share(scene: Scene, dt: float = 1e-7) -> tuple[Touches, Budget]:
    """Return a run with the stopper, and its error budget."""
    touches, seat = bounced(scene, dt), Solved(impact.spring(stiffness=1e6), plane=True)
    return touches, error_budget(ComputedRun(scene, stated_method(scene), seat, striker_of(scene)), touches)


def read_stopper(folder: Path, mesh: float | None) -> Scene:
    """Return the mass between its springs until mid second contact, its stopper from a file with a mesh error."""
    greens = impact.spring(stiffness=4e6).with_error(ErrorEstimate(reduction=0.0, mesh=mesh))
    save_greens(greens, folder / "stopper.h5")
    stopper = STOPPER.replace('"spring"', '"greens"').replace('stiffness = "4 N/um"', 'file = "stopper.h5"')
    return load_text(folder, SEAT + MASS + stopper + CUT.format(1e3 * (SECOND + OF_SEAT / 2)))


@pytest.mark.slow
def test_an_error_of_the_stopper_is_in_the_bars(tmp_path: Path) -> None:
    """g larger by e keeps the mass by sqrt(1 + e) longer: it comes back to the seat so much later, where the force is
    v sqrt(k m) when the run ends. The impulse left out is that force times the delay, which is known to the step of
    20 ns that the budget marches with: to 0.8 %. The first contact is not changed. The same file without an error
    leaves nothing."""
    error, of_first = 0.1, "seat_displacement"
    expected = SPEED * math.sqrt(1e6 * MASS_KG) * OF_STOPPER * (math.sqrt(1 + error) - 1)
    off, exact = (stopper_share(read_stopper(tmp_path, each), 1e-8)[1] for each in (error, 0.0))
    assert off.parts["stopper"]["impulse"] == pytest.approx(expected, rel=0.01)
    assert off.parts["stopper"][of_first] == 0.0
    assert off.bar("impulse") == pytest.approx(math.hypot(exact.bar("impulse"), SAFETY * expected), rel=0.01)
    assert set(exact.parts["stopper"].values()) == {0.0}


@pytest.mark.slow
def test_an_error_of_the_stopper_is_in_the_bars_of_its_forces(tmp_path: Path) -> None:
    """g larger by e bears a peak smaller by 1 - 1/sqrt(1 + e) and the same impulse 2 m v, which the bars know."""
    peak, impulse = "stopper_filtered_peak_force_N", "stopper_impulse_Ns"
    budget = stopper_share(read_stopper(tmp_path, 0.1), 1e-8)[1]
    largest, error = SPEED * math.sqrt(4e6 * MASS_KG), 1 - 1 / math.sqrt(1.1)
    assert budget.parts["stopper"][peak] == pytest.approx(error * largest, rel=0.01)
    assert budget.parts["stopper"][impulse] < 1e-4 * MASS_KG * SPEED
    assert budget.values[peak] == pytest.approx(largest, rel=1e-3)
    assert abs(budget.values[impulse] - 2 * MASS_KG * SPEED) < budget.bar(impulse) < 1e-2 * MASS_KG * SPEED


def test_what_is_not_known_of_a_stopper_is_named(tmp_path: Path) -> None:
    """An error that a file does not state is in no bar, and is said to be missing."""
    assert stopper_share(read_stopper(tmp_path, None))[1].unknown == ("stopper's mesh", "stopper's patch")


@pytest.mark.slow
def test_the_mesh_and_the_patch_of_a_stopper_are_in_the_bars(tmp_path: Path) -> None:
    """A steel disc of coarse elements, whose patch moves as its mean, throws the mass back to the seat: what elements
    half as large change by the end, and with four rings in the patch, is within the stopper's share of the errors."""
    disc = (
        '[stopper]\nkind = "stopper"\nradius = "8 mm"\nthickness = "3 mm"\ncontact_radius = "2 mm"\n'
        'material = "steel"\ndamping_ratio = 0.02\ngap = "0.05 mm"\nmesh = {{ size = "{} mm" }}\n'
    )
    near = SEAT + MASS.replace("0.1 mm", "0.05 mm")
    coarse, fine = (load_text(tmp_path, near + disc.format(size) + CUT.format(0.4)) for size in (0.7, 0.35))
    rings = fine.stopper.model_copy(update={"arcs": 1, "rings": 8})  # which no file asks of a rigid mass
    divided = fine.model_copy(update={"stopper": rings})
    touches, budget = stopper_share(coarse)
    share, seat = budget.parts["stopper"]["impulse"], measures.impulse(touches.seat)
    of_mesh, of_both = (abs(measures.impulse(bounced(each, 1e-7).seat) - seat) for each in (fine, divided))
    assert 1e-6 < of_mesh < of_both < share < 3 * of_both
    peak = "stopper_filtered_peak_force_N"
    truth = stopper_values(bounced(divided, 1e-7).stopper_force, 1e-7, coarse.run.filter_width)[peak]
    off = abs(truth - budget.values[peak])
    assert 0.01 * truth < off < SAFETY * budget.parts["stopper"][peak] < 4 * off


REFUSED = [
    ("", '[stopper]\nkind = "spring"\nstiffness = "1 N/um"\n', "stopper.gap: .*missing"),
    ("", STOPPER.replace('"0.2 mm"', '"-0.2 mm"'), "stopper.gap: '-0.2 mm' .*>= 0"),
    ("", STOPPER.replace('gap = "0.2', 'lift = "0.0'), "stopper.lift: 0 mm: .*leave"),
    ("", STOPPER.replace('gap = "0.2 mm"', 'lift = "0.09 mm"'), "stopper.lift: 0.09 mm .*contact.gap ="),
    (REED + '[contact]\ngap = "0.1 mm"\n', ABOVE.replace("gap", "lift"), "stopper.lift: with contact.gap = 0.1 mm"),
    (
        REED + '[contact]\ngap = "0.1 mm"\n',
        ABOVE.replace('gap = "0.8 mm"', 'lift = "1.05 mm"').replace('at = "18 mm"\n', ""),
        "stopper.lift: 1.05 mm: .* 1 mm .*1.1 mm",
    ),
    ("", STOPPER + 'at = "1 mm"\n', "stopper.at: .*positions"),
    (REED, ABOVE.replace("18 mm", "26 mm"), "stopper.at: 26 mm .*25.4 mm"),
]


@pytest.mark.parametrize(("reed", "stopper", "words"), REFUSED, ids=[words[:40] for _, _, words in REFUSED])
def test_what_is_wrong_is_named(reed: str, stopper: str, words: str, tmp_path: Path) -> None:
    assert re.search(f": {words}", refusal(load_text, tmp_path, SEAT + (reed or MASS) + stopper + RUN))


@pytest.mark.parametrize(
    ("release", "at", "limit"),
    [
        ('release = { tip_deflection = "1 mm" }', "18 mm", 0.5753559),  # x^2 (3 L - x)/(2 L^3)
        ('release = { tip_deflection = "1 mm" }', "25.4 mm", 1.0),
        ('release = { mode = 1, deflection = "1 mm" }', "25.4 mm", 1.0),
        ('release = { mode = 2, deflection = "-1 mm" }', "12.7 mm", 0.713),  # in the middle: 0.7137 of the tip
    ],
)  # fmt: skip
def test_a_reed_that_starts_inside_the_stopper_is_refused(release: str, at: str, limit: float, tmp_path: Path) -> None:
    reed = REED.replace('release = { tip_deflection = "1 mm" }', release)

    def with_gap(gap: float) -> str:
        return (
            SEAT + reed + f'[stopper]\nkind = "spring"\nstiffness = "1 N/um"\ngap = "{gap} mm"\nat = "{at}"\n' + SHORT
        )

    message = refusal(load_text, tmp_path, with_gap(0.999 * limit))
    match = re.search(rf"stopper\.gap: {0.999 * limit:.6g} mm: .*gap at least ([\d.]+) mm", message)
    assert match
    assert float(match[1]) == pytest.approx(limit, rel=2e-3)
    assert load_text(tmp_path, with_gap(1.002 * limit)).stopper is not None


def test_a_lift_is_counted_from_the_seat(tmp_path: Path) -> None:
    """The mass travels exactly the lift between leaving the seat and meeting the stopper, and the runs are the same."""
    lifted = load_text(tmp_path, SEAT + MASS + STOPPER.replace('gap = "0.2 mm"', 'lift = "0.3 mm"') + RUN)
    stated = load_text(tmp_path, SEAT + MASS + STOPPER + RUN)
    assert lifted.geometry.stopper_gap == pytest.approx(stated.geometry.stopper_gap, rel=1e-12)
    touches = bounced(lifted, 1e-7)
    both = touches.seat.gap + touches.stopper.gap  # each opening, where neither body is pressed: the lift
    free = (touches.seat.force == 0) & (touches.stopper.force == 0) & (np.arange(len(both)) * 1e-7 < 1e-4)
    assert np.count_nonzero(free) > 500
    np.testing.assert_allclose(both[free], 3e-4, rtol=1e-9)
