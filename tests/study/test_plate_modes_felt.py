"""A plate whose contact feels few of its modes: the bar knows what may lie above the last."""

from pathlib import Path

import numpy as np
import pytest

from impact import Body, ContactProblem, solve, spring
from impact.after.measures import filtered_peak_force
from impact.bodies.body import ModalState
from impact.runs.variations import ringing_on
from seatfem.study.ladders.modes import with_other_modes
from seatfem.study.safety import OF_MODES
from tests.gallery import load_text
from tests.steps import ModalGreens, Residual, striker_of

HIGHEST = 2e6  # rad/s, of a mode that the contact does not feel, as one with waves around a ring
REST = 3e-11  # m/N above


def plate(*felt: float) -> Body:
    """Free, with modes of these frequencies that the contact feels, one at the highest that it does not, and a rest."""
    omega = np.array([0.0, *felt, HIGHEST])
    shapes = np.array([[20.0], *[[15.0]] * len(felt), [0.001]])
    greens = ModalGreens(omega, np.full(len(omega), 0.01), shapes, Residual.spring(REST))
    return Body(greens, state=ModalState(np.zeros(len(omega)), np.eye(len(omega))[0]))


def test_the_bar_of_a_plate_knows_a_mode_above_its_band() -> None:
    """Against the plate with a mode just above, what leaving out modes changes tells nothing, the others within two."""
    few = plate(0.1 * HIGHEST)
    true = ringing_on(few, 1.4)

    def impulse(body: Body) -> float:
        struck = ContactProblem(Body(body.greens, velocity=-1.0), Body(spring(stiffness=2e9)))
        result = solve(struck, dt=1e-8, duration=3e-5)
        return float(result.force.sum() * result.dt)

    here = impulse(few)
    error = abs(impulse(true) - here)
    changes = [share * abs(impulse(body) - here) for body, share in with_other_modes(few)]
    assert max(changes[: len(OF_MODES)]) < error / 10
    assert max(changes) > error / 2


def test_what_lies_beyond_a_plate_is_spread_as_its_modes_are() -> None:
    """Octaves beyond the last mode yield together what the residual did, each half as much as the one below it."""
    few = plate(0.1 * HIGHEST)
    spread = ringing_on(few, 1.0, octaves=4)
    added = spread.greens.modal.omega[len(few.greens.modal.omega) :] / HIGHEST
    np.testing.assert_allclose(added, 2 ** np.array([0.5, 1.5, 2.5, 3.5]))
    yields = (spread.greens.modal.shapes[len(few.greens.modal.omega) :, 0] / (added * HIGHEST)) ** 2
    np.testing.assert_allclose(yields[1:] / yields[:-1], 0.5)
    np.testing.assert_allclose(spread.greens.static_compliance(), few.greens.static_compliance(), rtol=1e-12)


@pytest.mark.slow
def test_the_bar_of_a_disc_knows_the_modes_above_a_narrow_band(tmp_path: Path) -> None:
    """A free disc on a spring a hundred times stiffer: its mean force over 1 us at 60 kHz is a sixth too low."""
    narrow, wide = (solved_disc(tmp_path, band) for band in ("60 kHz", "900 kHz"))
    width, duration = 1e-6, 6e-5

    def peak(body: Body) -> float:
        result = solve(ContactProblem(body, Body(spring(stiffness=5e8))), dt=width / 50, duration=duration)
        return filtered_peak_force(result, width)

    here = peak(narrow)
    error = peak(wide) - here
    changes = [share * abs(peak(body) - here) for body, share in with_other_modes(narrow)]
    assert error > 0.15 * here
    assert max(changes[: len(OF_MODES)]) < error / 10
    assert max(changes) > error


@pytest.mark.slow
def test_the_bar_of_a_small_disc_knows_a_mode_two_octaves_beyond(tmp_path: Path) -> None:
    """A free disc of 6 mm at 40 kHz on a nearly rigid seat: over 3 us it has a force 14 % too low, and the modes an
    octave beyond its last, or over four, change a fifth of that at most, by accident."""
    narrow, wide = (solved_disc(tmp_path, band, "6 mm") for band in ("40 kHz", "900 kHz"))
    width, duration = 3e-6, 6e-5

    def peak(body: Body) -> float:
        result = solve(ContactProblem(body, Body(spring(stiffness=5e9))), dt=width / 50, duration=duration)
        return filtered_peak_force(result, width)

    here = peak(narrow)
    error = peak(wide) - here
    assert error > 0.1 * here
    assert max(share * abs(peak(body) - here) for body, share in with_other_modes(narrow)) > error


def solved_disc(folder: Path, band: str, diameter: str = "10 mm") -> Body:
    """Return a disc with its modes up to three times a band."""
    text = (
        f'\n        seat = {{ kind = "spring", stiffness = "5e8 N/m" }}\n        run = {{ duration = "60 us" }}\n'
        f'        [reed]\n        kind = "disc"\n        diameter = "{diameter}"\n        thickness = "0.5 mm"\n'
        f'        material = {{ young = "200 GPa", poisson = 0.3, density = "8000 kg/m^3" }}\n'
        f'        damping_ratio = 0.02\n        velocity = "-0.5 m/s"\n        greens.bandwidth = "{band}"\n        '
    )
    return striker_of(load_text(folder, text))
