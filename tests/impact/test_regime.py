"""Regime numbers against closed forms; the regime map resumes, and its stored copy is what the code gives."""

import math

import pytest
from paper_case import CASES, strike, table_1_reed
from regime_map import reed_point, rigid_point

import impact
from impact.after.regime import MAPS, regime, regime_card
from impact.after.rods import fixed_rod_modes
from impact.files.csv_table import read_rows


def mass_on_rod(alpha: float, end: float = math.inf):
    rod = impact.rod_with_end_impedance(young=1.0, density=1.0, area=1.0, length=1.0, end_impedance=end)
    striker, target = impact.rigid_mass(mass=1 / alpha, velocity=-1.0), impact.Body(rod)
    return striker, target, impact.solve(impact.ContactProblem(striker, target), dt=0.01, duration=7.0)


def test_rigid_mass_on_a_fixed_rod() -> None:
    """Contact lasts 5.89959 l/c for alpha = 1/4 (Timoshenko & Goodier); lambda = 1/sqrt(alpha)."""
    card = regime(*mass_on_rod(0.25))
    assert card.mass_ratio == pytest.approx(0.25)
    assert card.zener_lambda == pytest.approx(2.0)
    assert card.round_trips_per_contact == pytest.approx(5.89959 / 2, abs=0.01)
    assert card.predicted_sign == "under"
    assert card.predicted_impulse_error > 0


def test_an_absorbing_end_turns_the_sign_at_equal_masses() -> None:
    assert regime(*mass_on_rod(0.1, 1.0)).predicted_sign == "over"
    assert regime(*mass_on_rod(4.0, 1.0)).predicted_sign == "under"


@pytest.mark.parametrize(("number", "sign"), [(0, "equal"), (1, "equal"), (2, "over"), (3, "under")])
def test_card_of_table_1(number: int, sign: str) -> None:
    case, reed = CASES[number], table_1_reed()
    greens = fixed_rod_modes(case.rod, 40, residual=True)
    result = strike(greens, dt=50e-9, duration=1.2e-3)
    card_1 = regime(reed, impact.Body(case.rod), result)
    assert card_1.predicted_sign == sign
    reed_mass = 25.4e-3 * 10e-3 * 0.305e-3 * 7850 / 4  # phi_1^2 = 4/mass at the tip
    assert card_1.mass_ratio == pytest.approx(7850 * case.area * case.length / reed_mass, rel=1e-9)
    # as modes it is the same seat, but for the impedance its damping lowers: 0.941
    assert regime(reed, impact.Body(greens), result).round_trip == pytest.approx(card_1.round_trip)
    assert regime(reed, impact.Body(greens), result).mass_ratio == pytest.approx(card_1.mass_ratio / 0.941**2, rel=1e-3)
    card = regime_card(reed, impact.Body(case.rod), result)
    assert "\n" not in card
    assert "Z^2/K" in card  # no number without its meaning
    assert {"equal": "within 2 %", "over": "over-estimate", "under": "under-estimate"}[sign] in card


@pytest.mark.slow
def test_stored_maps_are_what_the_code_gives() -> None:
    """Points of either sign; fails when the reed or the solver changes and the maps were not made again."""
    for compute, name, rows in (
        (rigid_point, "regime_rigid.csv", (0, 130, 274)),
        (reed_point, "regime_reed.csv", (85, 190)),
    ):
        stored = read_rows(MAPS / name)
        for row in (stored[k] for k in rows):
            again = compute(*list(row.values())[:2])
            assert again["peak_error"] == pytest.approx(row["peak_error"], abs=2e-3)
            assert again["impulse_error"] == pytest.approx(row["impulse_error"], abs=2e-3)
