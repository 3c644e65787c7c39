"""The ball: its modes against Lamb's sphere, its mass, its flight, its local compliance."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq

from seatfem.structures.natural_modes import Wanted, modes_of
from tests.gallery import load_text
from tests.steps import Scene, Stopwatch, striker_of

YOUNG, POISSON, DENSITY, RADIUS, FACET = 200e9, 0.3, 7850.0, 5e-3, 0.6e-3
SHEAR_WAVE = math.sqrt(YOUNG / (2 * (1 + POISSON)) / DENSITY)
RATIO = 2 * (1 - POISSON) / (1 - 2 * POISSON)  # (c_p/c_s)^2
BALL = """kind = "ball"
diameter = "10 mm"
contact_radius = "0.6 mm"
material = { young = "200 GPa", poisson = 0.3, density = "7850 kg/m^3" }
greens = { bandwidth = "400 kHz" }
mesh = { size = "0.8 mm", contact_size = "0.15 mm" }
"""
SPRING = 'kind = "spring"\nstiffness = "200 N/um"\n'
FLIGHT = 'velocity = "-0.5 m/s"\n'
RUN = '[contact]\ngap = "1 um"\n[run]\nduration = "0.2 ms"\n'


def scene_of(folder: Path, reed: str = BALL + FLIGHT, seat: str = SPRING) -> Scene:
    return load_text(folder, f"[seat]\n{seat}[reed]\n{reed}{RUN}")


def breathing(x: float) -> float:
    """Return 0 at the radial mode of a free sphere, x = w R/c_p. Source: A. E. H. Love, Elasticity, article 196."""
    return math.cos(x) / math.sin(x) * x - 1 + RATIO / 4 * x**2


def twist(x: float) -> float:
    """Return 0 at the lowest toroidal mode, d/dr (j_2(r)/r) = 0 at r = x = w R/c_s: x j_2' = j_2."""
    j = (3 / x**3 - 1 / x) * math.sin(x) - 3 / x**2 * math.cos(x)
    before = math.sin(x) / x**2 - math.cos(x) / x
    return x * (before - 3 / x * j) - j


@pytest.mark.slow
def test_modes_of_a_free_sphere(tmp_path: Path) -> None:
    """Its facet is a 100th of its section and moves them by less than a part in a thousand; six are rigid."""
    modes = modes_of(scene_of(tmp_path).reed, Wanted(48), Stopwatch(), lambda *given: None)
    scaled = 2 * np.pi * modes.frequencies_hz * RADIUS / SHEAR_WAVE
    assert np.sum(scaled == 0) == 6
    torsion = brentq(twist, 2.0, 3.0)
    assert torsion == pytest.approx(2.5011, rel=1e-4)
    assert scaled[6:11] == pytest.approx([torsion] * 5, rel=1e-3)
    radial = brentq(breathing, 1.5, 3.0) * math.sqrt(RATIO)
    assert np.abs(scaled / radial - 1).min() < 1e-3


@pytest.mark.slow
def test_its_facet_has_the_compliance_of_a_disc_on_a_half_space(tmp_path: Path) -> None:
    """The mean compliance under a uniform pressure is 16 (1 - nu^2)/(3 pi^2 E a) as a/R goes to zero; a free sphere
    differs by the first order in a/R, which two facets extrapolate to 1 %."""
    relative = []
    for facet in (FACET, FACET / 2):
        keys = BALL.replace("0.6 mm", f"{1e3 * facet:g} mm").replace("0.15 mm", f"{250 * facet:g} mm")
        modal = striker_of(scene_of(tmp_path, keys + FLIGHT)).greens.modal
        elastic = modal.omega > 0
        assert np.sum(~elastic) == 1
        shapes = modal.shapes[elastic, 0] / modal.omega[elastic]
        compliance = float(shapes @ shapes) + modal.residual.static()[0, 0]
        relative.append(compliance * 3 * math.pi**2 * YOUNG * facet / (16 * (1 - POISSON**2)))
    assert relative[0] < relative[1] < 1
    assert 2 * relative[1] - relative[0] == pytest.approx(1.0, abs=0.01)
