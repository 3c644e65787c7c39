"""The half-space against its own Laplace transform, and what a Green's function must be."""

import json
import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.special import j1

import impact
from impact import Body, ContactProblem, GreensFunctionError, ModalGreens, Residual
from impact.exact import half_space
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
        (lambda: half_space_patch(**STEEL | {"young": math.nan}), "young = nan"),
        (lambda: half_space_patch(**STEEL | {"density": math.inf}), "density = inf"),
        (lambda: disk_compliance(**UNIT, radius=1.0, at="rim"), r"at = 'rim'.*mean, centre, edge"),
        (lambda: half_space.rayleigh_speed(0.6), r"poisson = 0\.6"),
        (lambda: SumGreens(()), "at least one part"),
        (lambda: SumGreens((MODE, LIP)), r"\('contact',\).*\('lip',\)"),
        (lambda: half_space.without_patch(ROD, PATCH, band_hz=1.0), "out of a DelayRod with 1 ports"),
        (lambda: half_space.without_patch(patch_of(0.3), PATCH, band_hz=1.0), "out of a HalfSpacePatch"),
    ],
)
def test_what_is_refused(make: Callable[[], object], words: str) -> None:
    with pytest.raises(GreensFunctionError, match=words):
        make()
