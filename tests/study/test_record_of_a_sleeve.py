"""A seat of finite elements as a laboratory would measure it: a noisy accelerance that ends among its modes."""

from pathlib import Path

import numpy as np
import pytest

from impact.measured.frf import receptance
from impact.measured.pole_fit import fit_response
from seatfem.study.ladders.mesh import OF_DRAWS
from tests.steps import SAFETY, GreensFunction, load_scene, seat_of

SCENE = Path(__file__).parents[2] / "examples" / "flapper_on_peek_sleeve.toml"
NOISE = 0.02  # of the root mean square of all lines


@pytest.fixture(scope="module")
def sleeve() -> GreensFunction:
    return seat_of(load_scene(SCENE)).greens


@pytest.mark.slow
@pytest.mark.parametrize(("highest", "in_band"), [(60e3, 2), (80e3, 3), (100e3, 4)])
def test_what_lies_above_the_band_is_in_the_bars(sleeve: GreensFunction, highest: float, in_band: int) -> None:
    """The record ends between modes. A mode next to the end of the band stays one, and does not leave to stand for
    those above; these fit the lines alike in different numbers, which changes the static compliance by more than noise.
    """
    lines = np.arange(100.0, highest, 100.0)
    s = np.asarray(2j * np.pi * lines, dtype=np.complex128)
    exact = sleeve.transfer(s)[:, 0, 0] * s**2
    rng = np.random.default_rng(13)
    noise = NOISE * np.sqrt(np.mean(np.abs(exact) ** 2) / 2)
    measured = exact + noise * (rng.normal(size=len(lines)) + 1j * rng.normal(size=len(lines)))
    fit = fit_response(receptance(lines, measured, "accelerance"))
    report = fit.greens.provenance["fit"]
    assert report["pole_pairs"] >= in_band
    assert report["unexplained_lines_hz"] == []
    static, true = (float(each.static_compliance()[0, 0]) for each in (fit.greens, sleeve))
    changes = [abs(float(draw.static_compliance()[0, 0]) - static) for draw in fit.draws]
    bar = SAFETY * OF_DRAWS * max(changes)  # that of a run
    assert abs(static - true) < bar < 0.1 * true
    width, t = 2 / lines[-1], np.linspace(0.0, 2e-4, 600)
    own, exactly = (each.filtered_matrix(t, width)[0, 0] for each in (fit.greens, sleeve))
    error = fit.greens.error_estimate.reduction
    assert np.abs(own - exactly).max() < error * np.abs(exactly).max() < 0.1 * np.abs(exactly).max()
