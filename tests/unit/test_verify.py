"""Every verification case passes, and fails when one physical input is 3 % off."""

import math
from functools import cache

import pytest

from seatfem.verification.case import Case, Estimate, Row, carry_out, refined, richardson
from seatfem.verify import markdown_table, verification_cases, verification_table

CASES = {f"{case.case}: {case.quantity}": case for case in verification_cases()}


@pytest.mark.parametrize("name", CASES)
def test_case_passes_and_can_fail(name: str) -> None:
    case = CASES[name]
    row = carry_out(case)
    assert row.verdict, f"error {row.error:.2e}, tolerance {row.tolerance:.2e}"
    assert row.tolerance < 2e-3
    for coefficient in (1.03, 0.97):
        assert not carry_out(case, coefficient).verdict


@cache
def table() -> tuple[tuple[Row, ...], tuple[tuple[str, float], ...]]:
    heard: list[tuple[str, float]] = []
    rows = verification_table(lambda stage, done: heard.append((stage, done)))
    return rows, tuple(heard)


def test_table_has_every_case_and_tells_progress() -> None:
    rows, heard = table()
    assert [f"{row.case}: {row.quantity}" for row in rows] == list(CASES)
    assert all(row.verdict for row in rows)
    fractions = [done for _, done in heard]
    assert fractions == sorted(fractions)
    assert fractions[0] == 0.0
    assert fractions[-1] == 1.0


def test_observed_orders_are_those_of_theory() -> None:
    """Within 1 % where the error is a smooth series in h = 1/200 or less: the next term leaves O(h) in the order.

    The end of contact, which falls anywhere within a step, leaves 3 %; physical limits (light plate, heavy mass), whose
    parameter is not that small, 5 %.
    """
    for row in table()[0]:
        if row.order is None:
            continue
        limit = any(word in row.quantity for word in ("lambda to 0", "leading order"))
        end = any(word in row.quantity for word in ("end of contact", "duration"))
        assert row.order == pytest.approx(row.theory, abs=0.05 if limit else 0.03 if end else 0.01), row


def test_passive_march_is_first_order_at_jumps_and_second_on_the_grid() -> None:
    theory = {f"{row.case}: {row.quantity}": row.theory for row in table()[0] if row.order is not None}
    assert {order for name, order in theory.items() if "largest" in name} == {1}
    for smooth in ("semi-infinite rod: N", "free rod, rod mass/mass = 0.5", "infinite beam: v/V"):
        assert {order for name, order in theory.items() if smooth in name} == {2}


def test_markdown_table_shows_verdicts() -> None:
    good = carry_out(Case("spring", "k [N/m]", 2.0, 1e-6, "Hooke", lambda k: Estimate(2.0 * k, order=1.0)))
    bad = carry_out(Case("spring", "k [N/m]", 2.0, 1e-6, "Hooke", Estimate), 1.0)
    lines = markdown_table((good, bad)).splitlines()
    assert len(lines) == 4
    assert lines[2] == "| spring | k [N/m] | 2 | 2 | +0.0e+00 | 1.0e-06 | 1.00 | pass | Hooke |"
    assert "| -5.0e-01 |" in lines[3]
    assert "| FAIL |" in lines[3]


def test_richardson_finds_limit_order_and_bounds_its_error() -> None:
    estimate = richardson(lambda n: 3.0 + 2.0 / n + 5.0 / n**2, 100, 1)
    assert estimate.order == pytest.approx(1.0, abs=0.05)
    assert estimate.theory == 1
    assert 0 < abs(estimate.value - 3.0) <= estimate.uncertainty
    assert estimate.uncertainty < 1e-3  # the two-point limit is in error by 10/n^2, n = 200


def test_refined_bounds_an_irregular_error() -> None:
    estimate = refined(lambda n: 1.0 + math.sin(n) / n, 64)
    assert abs(estimate.value - 1.0) <= estimate.uncertainty
