"""Stresses in closed form against the literature, equilibrium, and the equations they solve."""

import math

import numpy as np
import pytest

from impact.exact import contact_stress as cs
from impact.exact.contact_stress import ContactStressError


def test_axis_stress_is_the_integral_of_point_loads() -> None:
    """Stress on the axis is Boussinesq's, sigma_z = -(3/(2 pi)) P z^3/s^5, trace -(1 + nu) P z/(pi s^3), over rings."""
    poisson, z = 0.27, np.array([0.2, 0.5, 1.0, 2.5])
    r, w = np.polynomial.legendre.leggauss(400)
    r, w = (1 + r) / 2, w / 2
    for pressure, (radial, axial) in (
        (np.sqrt(1 - r**2), cs.circular_axis_stress(z, poisson=poisson)),
        (np.ones_like(r), cs.disk_axis_stress(z, poisson=poisson)),
    ):
        s = np.sqrt(r**2 + z[:, None] ** 2)
        load = 2 * np.pi * r * w * pressure
        normal = -(3 / (2 * np.pi) * z[:, None] ** 3 / s**5) @ load
        trace = -((1 + poisson) / np.pi * z[:, None] / s**3) @ load
        np.testing.assert_allclose(axial, normal, rtol=2e-6)  # the pressure's root end, 400 nodes
        np.testing.assert_allclose(2 * radial, trace - normal, rtol=2e-6, atol=1e-8)


def test_a_line_contact_carries_its_load() -> None:
    """The half ellipse pi b p0/2 is the load, and p0 = sqrt(N' E*/(pi R)) (Johnson 4.45)."""
    load, modulus, radius = 3e5, 1.1e11, 4e-3
    line = cs.hertz_line(force_per_length=load, reduced_modulus=modulus, radius=radius)
    assert line.pressure == pytest.approx(math.sqrt(load * modulus / (math.pi * radius)), rel=1e-14)
    assert math.pi / 2 * line.half_width * line.pressure == pytest.approx(load, rel=1e-14)


def test_line_stress_is_the_integral_of_line_loads() -> None:
    """Stress below a line is the integral of Flamant's -(2/pi) P z^3/s^4 and -(2/pi) P x^2 z/s^4."""
    z = np.array([[0.2], [0.8], [2.0]])
    n = 2000
    x = np.cos(np.pi * np.arange(1, n + 1) / (n + 1))  # Gauss-Chebyshev of the second kind: weight sqrt(1 - x^2)
    load = np.pi / (n + 1) * (1 - x**2)
    across, along = cs.line_axis_stress(z[:, 0])
    s4 = (x**2 + z**2) ** 2
    np.testing.assert_allclose(along, -2 / np.pi * (z**3 / s4) @ load, rtol=1e-12)
    np.testing.assert_allclose(across, -2 / np.pi * (x**2 * z / s4) @ load, rtol=1e-12)


def test_first_contact_of_waves() -> None:
    steel = {"young": 200e9, "density": 7850.0}
    rod, body = cs.rod_wave_speed(**steel), cs.pressure_wave_speed(**steel, poisson=0.3)
    assert body / rod == pytest.approx(math.sqrt(0.7 / (1.3 * 0.4)), rel=1e-14)
    assert cs.pressure_wave_speed(**steel, poisson=0.5) == math.inf
    z = 7850.0 * body
    assert cs.first_contact_pressure(speed=2.0, impedance=z, impedance_2=z) == pytest.approx(z, rel=1e-14)
    assert cs.first_contact_pressure(speed=2.0, impedance=z) == pytest.approx(2 * z, rel=1e-14)
    # rods of impedance 1 and 3: 3/4 of v
    assert cs.first_contact_pressure(speed=1.0, impedance=1.0, impedance_2=3.0) == pytest.approx(0.75, rel=1e-14)


def test_tip_step_stress_of_a_section() -> None:
    """The stress is M y/I with M = v sqrt(EI rho A) m, and sections scale it."""
    young, density, width, height, speed = 200e9, 7850.0, 0.01, 3e-4, 1.5
    area, inertia = width * height, width * height**3 / 12
    moment = speed * math.sqrt(young * inertia * density * area)
    stress = moment * height / 2 / inertia
    assert cs.midspan_step_stress(young=young, density=density, speed=speed) == pytest.approx(stress, rel=1e-12)
    wave = cs.tip_step_stress(young=young, density=density, speed=speed, eta=[0.5, 2.0])
    np.testing.assert_allclose(wave, stress * cs.tip_step_moment([0.5, 2.0]), rtol=1e-12)
    impedance = math.sqrt(young * density)
    assert stress == pytest.approx(math.sqrt(3) * impedance * speed, rel=1e-12)
    round_bar = cs.midspan_step_stress(young=young, density=density, speed=speed, section=2.0)
    assert round_bar == pytest.approx(2 * impedance * speed, rel=1e-12)
    assert cs.tip_step_force(0.0, speed=1.0, bending_stiffness=1.0, mass_per_length=1.0) == math.inf
    one, three = (cs.tip_step_force(1.0, speed=1.0, bending_stiffness=k, mass_per_length=k) for k in (1.0, 3.0))
    assert three == pytest.approx(3 * one, rel=1e-12)  # three beams side by side


def test_impossible_numbers_are_refused() -> None:
    with pytest.raises(ContactStressError, match=r"poisson = 0\.7.*\[0, 0\.5\]"):
        cs.edge_tension(poisson=0.7)
    with pytest.raises(ContactStressError, match=r"depth = -1.*surface"):
        cs.line_axis_stress([1.0, -1.0])
    with pytest.raises(ContactStressError, match="mass = 0 must be positive"):
        cs.hertz_impact(stiffness=1.0, mass=0.0, speed=1.0)
    with pytest.raises(ContactStressError, match="radius = nan"):
        cs.hertz_stiffness(reduced_modulus=1.0, radius=math.nan)
