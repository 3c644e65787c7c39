"""The half-space: against its own Laplace transform, stresses below loads on it; what a Green's function must be."""

import json
import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.special import j1

import impact
from impact import Body, ContactProblem, GreensFunctionError, ModalGreens, Residual
from impact.exact import contact_stress as cs
from impact.exact import half_space
from impact.exact.contact_stress import ContactStressError
from impact.exact.half_space import DiskResponse, HalfSpacePatch, disk_compliance, half_space_patch
from impact.greens.base import SumGreens

STEEL = {"young": 200e9, "poisson": 0.3, "density": 7850.0, "radius": 1e-3}
UNIT = {"young": 1.0, "poisson": 0.0}  # (1 - nu^2)/E = 1
POISSON = [0.0, 0.05, 0.2, 0.2629, 0.263082, 0.27, 0.3, 0.4, 0.45, 0.49, 0.4999, 0.5]


def patch_of(poisson: float) -> HalfSpacePatch:
    """Return a patch with c_s = 1, a = 1."""
    return half_space_patch(young=2 * (1 + poisson), poisson=poisson, density=1.0, radius=1.0)


@pytest.mark.parametrize("poisson", POISSON)
def test_disk_response_has_the_laplace_transform_of_the_wave_equation(poisson: float) -> None:
    """The transform of dS/dT is Lamb's slowness integral times the disk's (2 J1(z)/z)^2."""
    response = DiskResponse.from_poisson(poisson)
    kappa2 = (1 - 2 * poisson) / (2 * (1 - poisson))
    for s in (0.3, 2.0, 10.0):
        time, weight = panels(np.union1d(response.breaks, response.breaks[-1] * np.geomspace(1e-6, 1.0, 40)))
        transform = np.sum(weight * np.exp(-s * time) * response(time, integrated=False))
        # z = s q/2; slowness q by panels to z = 200, where the part beyond 1 - nu has decayed like z^-4: 1e-8
        q, weight = panels(np.concatenate([np.linspace(0, 4, 60), np.linspace(4, 400 / s, 300)[1:]]))
        root_p, root_s = np.sqrt(q**2 + kappa2), np.sqrt(q**2 + 1)
        rayleigh = (2 * q**2 + 1) ** 2 - 4 * q**2 * root_p * root_s
        part = (q * root_p / rayleigh - (1 - poisson)) * (2 * j1(s * q / 2) / (s * q / 2)) ** 2
        right = 1 + s * 3 * math.pi / (32 * (1 - poisson)) * np.sum(weight * part)
        assert transform == pytest.approx(right, abs=1e-8)


def panels(edges: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    nodes, gauss = np.polynomial.legendre.leggauss(12)
    half = np.diff(edges)[:, None] / 2
    return ((edges[:-1, None] + half) + half * nodes).ravel(), (half * gauss).ravel()


@pytest.mark.parametrize("poisson", POISSON)
def test_patch_starts_at_its_impedance_and_ends_at_boussinesq(poisson: float) -> None:
    patch = patch_of(poisson)
    assert patch.response.error < 1e-10
    # nu = 0.5 starts like T log T: 1e-9 of the peak stands for its zero
    assert float(patch.impulse_response(0.0)) == pytest.approx(patch.initial_value()[0, 0], rel=1e-10, abs=1e-9)
    end = patch.crossing_time
    assert end == pytest.approx(2 / half_space.rayleigh_speed(poisson), rel=1e-12)
    late = np.array([end * (1 + 1e-12), 3 * end])
    assert np.all(patch.step_response(late) == patch.static_compliance())
    assert np.all(patch.impulse_response(late) == 0.0)
    assert float(patch.impulse_response(0.999 * end)) > 0
    assert float(patch.step_response(end * (1 - 1e-12))) == pytest.approx(patch.static_compliance()[0, 0], rel=1e-12)
    assert patch.impulse_response(-1.0) == patch.step_response(-1.0) == 0.0
    weights, steps = patch.step_kernel(end / 50.5, 200).weights[0, 0], end / 50.5 * np.arange(1, 201)
    np.testing.assert_allclose(np.cumsum(weights), patch.step_response(steps), rtol=1e-13)
    assert np.all(weights[51:] == 0.0)


MODE = impact.single_mode(frequency_hz=2e3, mass=0.05, damping_ratio=0.01)


PATCH = half_space_patch(**STEEL)
LOCAL = float(PATCH.static_compliance()[0, 0])


def test_exact_part_of_a_sum_is_left_out() -> None:
    assert half_space.without_patch(SumGreens((PATCH, MODE)), PATCH, band_hz=1e4) is MODE
    rest = half_space.without_patch(SumGreens((MODE, half_space_patch(**STEEL), MODE)), PATCH, band_hz=1e4)
    assert isinstance(rest, SumGreens)
    assert rest.parts == (MODE, MODE)
    rigid = half_space.without_patch(PATCH, PATCH, band_hz=1e4)
    assert rigid.static_compliance()[0, 0] == 0.0
    assert half_space.without_patch(SumGreens((PATCH,)), PATCH, band_hz=1e4).static_compliance()[0, 0] == 0.0


def test_hertz_striker_on_a_corrected_seat_is_hertz_in_series_with_the_bulk() -> None:
    """A seat less its local compliance bears the force of the bulk alone."""
    seat = MODE.merge([ModalGreens(np.zeros(0), np.zeros(0), np.zeros((0, 1)), Residual.spring(LOCAL + 1e-11))])
    bulk = MODE.merge([impact.spring(stiffness=1e11)])
    striker, law = impact.rigid_mass(mass=0.004, velocity=-1.0), impact.Hertz(stiffness=1e10)
    force = [
        impact.solve(ContactProblem(striker, Body(g), law=law), dt=1e-7, duration=1e-4).force
        for g in (bulk, half_space.without_patch(seat, PATCH, band_hz=1e5), seat)
    ]
    np.testing.assert_allclose(force[1], force[0], rtol=1e-9)
    assert force[2].max() < 0.99 * force[0].max()  # counted twice


def seat_of(compliance: float, relaxing: float, modal: tuple[float, ...]) -> ModalGreens:
    """Return bare and relaxing compliance and modes at 1, 2, ... MHz with these static shares, in units of LOCAL."""
    omega = 2e6 * np.pi * np.arange(1, len(modal) + 1)
    shapes = omega[:, None] * np.sqrt(LOCAL * np.array(modal))[:, None]
    rates = np.array([2e7])
    residual = Residual(np.sqrt(LOCAL * relaxing * rates)[:, None], rates, np.array([[compliance * LOCAL]]))
    return ModalGreens(omega, np.full(len(modal), 0.01), shapes, residual)


@pytest.mark.parametrize(
    ("seat", "bare", "relaxing", "modes", "lowest_hz"),
    [
        (seat_of(1.5, 1.0, (1.0,)), 0.5, 1.0, (1.0,), None),
        (seat_of(0.25, 1.0, (1.0,)), 0.0, 0.25, (1.0,), 2e7 / (2 * np.pi)),
        (seat_of(0.25, 0.25, (9.0, 1.0, 0.25)), 0.0, 0.0, (9.0, 0.75), 2e6),
    ],
)
def test_local_compliance_is_taken_from_the_fastest_terms(
    seat: ModalGreens, bare: float, relaxing: float, modes: tuple[float, ...], lowest_hz: float | None
) -> None:
    # the relaxation at 3.2 MHz is faster than all modes but none here exceeds it: bare, then it, then modes downward
    rest = half_space.without_patch(seat, PATCH, band_hz=5e5)
    assert isinstance(rest, ModalGreens)
    before, after = seat.static_compliance()[0, 0], rest.static_compliance()[0, 0]
    assert before - after == pytest.approx(LOCAL, rel=1e-12)
    assert rest.residual.compliance[0, 0] == pytest.approx(bare * LOCAL, abs=1e-12 * LOCAL)
    assert np.sum(rest.residual.shapes**2 / 2e7) == pytest.approx(relaxing * LOCAL, abs=1e-12 * LOCAL)
    np.testing.assert_allclose((rest.shapes[:, 0] / rest.omega) ** 2, LOCAL * np.array(modes), rtol=1e-12)
    about = rest.provenance["without_patch"]
    assert about == {"compliance": LOCAL, "band_hz": 5e5, "lowest_hz": pytest.approx(lowest_hz) if lowest_hz else None}
    json.dumps(about)


def test_compliance_that_is_not_there_is_not_removed() -> None:
    seat = seat_of(0.1, 0.2, (5.0, 0.3))
    with pytest.raises(GreensFunctionError, match=rf"{LOCAL:.4g} m/N.*{0.6 * LOCAL:.4g} m/N .*1.5e\+06"):
        half_space.without_patch(seat, PATCH, band_hz=1.5e6)
    half_space.without_patch(seat, PATCH, band_hz=5e5)
    free = ModalGreens(np.zeros(1), np.zeros(1), np.ones((1, 1)), Residual.none())
    with pytest.raises(GreensFunctionError, match="exceeds the 0 m/N"):  # a rigid-body motion is no compliance
        half_space.without_patch(free, PATCH, band_hz=0.0)


ROD = impact.fixed_rod(young=1.0, density=1.0, area=1.0, length=1.0)
LIP = ModalGreens(np.ones(1), np.zeros(1), np.ones((1, 1)), Residual.none(), ("lip",))


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: half_space_patch(**STEEL | {"poisson": 0.51}), r"poisson = 0.51.*\[0, 0.5\]"),
        (lambda: half_space_patch(**STEEL | {"radius": 0.0}), "radius = 0 must be a positive"),
        (lambda: disk_compliance(**UNIT, radius=1.0, at="rim"), r"at = 'rim'.*mean, centre, edge"),
        (lambda: half_space.rayleigh_speed(0.6), r"poisson = 0\.6"),
        (lambda: SumGreens(()), "at least one part"),
        (lambda: SumGreens((MODE, LIP)), r"\('contact',\).*\('lip',\)"),
        (lambda: half_space.without_patch(ROD, PATCH, band_hz=1.0), "out of a DelayRod with 1 ports"),
        (lambda: half_space.without_patch(patch_of(0.3), PATCH, band_hz=1.0), "out of a HalfSpacePatch"),
        (lambda: cs.edge_tension(poisson=0.7), r"poisson = 0\.7.*\[0, 0\.5\]"),
        (lambda: cs.line_axis_stress([1.0, -1.0]), r"depth = -1.*surface"),
        (lambda: cs.hertz_impact(stiffness=1.0, mass=0.0, speed=1.0), "mass = 0 must be positive"),
        (lambda: cs.hertz_stiffness(reduced_modulus=1.0, radius=math.nan), "radius = nan"),
    ],
)
def test_what_is_refused(make: Callable[[], object], words: str) -> None:
    with pytest.raises((GreensFunctionError, ContactStressError), match=words):
        make()


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
