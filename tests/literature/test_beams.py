"""The reeds against the values of beams.json."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from impact.beams.cantilever import Cantilever
from impact.beams.clamped import ClampedClamped
from impact.beams.timoshenko import TimoshenkoCantilever
from impact.beams.tip_mass import TipMassCantilever
from impact.bodies.reeds import ModeShape, StaticShape, reed
from impact.greens.oscillator import impulse_response

REFERENCES = {entry["id"]: entry for entry in json.loads(Path(__file__).with_name("beams.json").read_text())}
REED = Cantilever(**REFERENCES["paper_reed_freqs"]["parameters"])
UNIT = {"young": 12.0, "density": 1.0, "length": 1.0, "width": 1.0, "thickness": 1.0}  # EI = rho A = L = 1


def agrees(name: str, ours: object, half_digit: float = 0.0) -> None:
    np.testing.assert_allclose(ours, REFERENCES[name]["value"], rtol=REFERENCES[name]["rtol"], atol=half_digit)


def test_wave_numbers() -> None:
    agrees("eb_cantilever_lambda", REED.wave_numbers(6))
    agrees("eb_clamped_clamped_lambda2", ClampedClamped(**UNIT).frequencies(3))
    agrees("eb_tip_mass_1_lambda2", TipMassCantilever(**UNIT, tip_mass=1.0).frequencies(5))


def test_timoshenko_frequencies() -> None:
    beam = TimoshenkoCantilever(**REFERENCES["timo_cantilever_Lh10"]["parameters"])
    # half of the last decimal printed besides rtol: 5e-6 Hz is 1.2e-8 of f_1
    agrees("timo_cantilever_Lh10", beam.frequencies(5) / (2 * np.pi), half_digit=5e-6)


def test_reed_of_the_paper() -> None:
    agrees("paper_reed_freqs", REED.frequencies(6) / (2 * np.pi))
    stiffness = 1 / REED.compliance(REED.length, REED.length)
    agrees("paper_reed_static", [REED.mass, REED.rigidity, stiffness, 1e-3 * stiffness])
    root_moment = 1e-3 * stiffness * REED.length
    agrees("paper_static_root_stress", root_moment / (REED.width * REED.thickness**2 / 6))


@pytest.mark.parametrize("name", ["paper_v_static_z0", "paper_v_static_z3", "paper_v_mode1_z0", "paper_v_mode1_z3"])
def test_free_flight_after_release(name: str) -> None:
    zeta, mode = REFERENCES[name]["parameters"].values()
    release = ModeShape(mode, 1e-3) if mode else StaticShape(1e-3)
    body = reed(REED, damping_ratio=zeta, n_modes=1000, release=release)
    omega, tip, q = body.greens.omega, body.greens.shapes[:, 0], body.state.displacement

    def velocity(
        t: float,
    ) -> float:  # released at rest: q' = -omega^2 q_0 h(t), h the impulse response of the oscillator
        return float(-(tip * q * omega**2) @ impulse_response(np.array(t), omega, np.full(1000, zeta)))

    def deflection(t: float) -> float:
        decay, damped = zeta * omega, omega * np.sqrt(1 - zeta**2)
        return float((tip * q * np.exp(-decay * t)) @ (np.cos(damped * t) + decay / damped * np.sin(damped * t)))

    first = brentq(deflection, 0.5e-3, 0.7e-3, xtol=1e-16)
    agrees(name, [first, velocity(first)])


def test_tip_kernel_at_short_times() -> None:
    a = np.sqrt(REED.rigidity / REED.line_density)
    t = REFERENCES["eb_tip_kernel_small_t"]["parameters"]["t_a_over_L2"] * REED.length**2 / a
    # the band-limited sum rings around the asymptote; a pulse of the length of t/5 averages over the ringing
    greens = reed(REED, n_modes=1500).greens
    width = t / 5
    start = 2 * np.sqrt(2 * a / np.pi) / np.sqrt(REED.rigidity * REED.line_density)
    s = np.linspace(0, width, 20001)
    mean = np.trapezoid(np.sqrt(t - s) * (1 - np.cos(2 * np.pi * s / width)) / width, s)
    agrees("eb_tip_kernel_small_t", float(greens.filtered(t, width)) / (start * mean))


def test_every_value_has_a_source_and_a_tolerance() -> None:
    for entry in REFERENCES.values():
        assert entry["source"]
        assert 0 < entry["rtol"] < 3e-2
