"""The estimate of what is still to come, on errors that are known."""

from collections.abc import Callable

import numpy as np
import pytest

from seatfem.structures.reduction.reducer import History

SIZES = [*range(10, 90, 10), *(int(80 * 1.125**k) for k in range(1, 14))]
WAVE = np.sin(np.linspace(0, 30, 400))


def estimates(error: Callable[[int], float], *, sized: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return (what is stated, what is true) at each check of a response off by ``error`` of its vectors."""
    history, stated, true = History(1e-3), [], []
    exact = np.cos(np.linspace(0, 9, 400))
    for n in SIZES:
        response = exact + error(n) * WAVE
        stated.append(history.add(response, n if sized else None))
        true.append(np.abs(response - exact).max() / np.abs(response).max())
    return np.array(stated), np.array(true)


@pytest.mark.parametrize("order", [2.0, 3.0, 6.0])
def test_slow_algebraic_convergence_is_stated_within_a_factor_of_five(order: float) -> None:
    """The stated error covers the true one of e ~ n^-order, and is at most five times as large later."""
    stated, true = estimates(lambda n: 0.1 * (10 / n) ** order, sized=True)
    is_known = np.isfinite(stated)
    assert is_known.sum() >= len(SIZES) - 3
    assert np.all(true[is_known] <= stated[is_known])
    assert np.all(stated[8:] <= 5 * true[8:])
