"""Poles fitted to responses with a known answer: clean, noisy, free, cut off, coupled by damping, several ports."""

from dataclasses import replace

import numpy as np
import pytest

import impact
from impact.greens.passivity import pole_passivity
from impact.measured.frf import FrequencyResponse, FrequencyResponseError, causality_defect, receptance
from impact.measured.pole_fit import fit_impulse_response, fit_poles, fit_response
from tests.impact.test_poles import complex_modes

F = 10.0 * np.arange(5, 1201)  # 50 Hz ... 12 kHz
S = 2j * np.pi * F
SEAT = impact.ModalGreens(
    2 * np.pi * np.array([2e3, 5.1e3, 9.3e3]),
    np.array([0.02, 0.01, 0.03]),
    np.array([[20.0], [16.0], [12.0]]),
    impact.Residual.spring(2e-9),
)
TWO = replace(
    SEAT,
    shapes=np.array([[20.0, 5.0], [16.0, -12.0], [12.0, 7.0]]),
    residual=impact.Residual.spring([[2e-9, 1e-9], [1e-9, 2e-9]]),
    port_names=("lip", "stop"),
)


def measured(greens: impact.ModalGreens | impact.PoleGreens, noise: float = 0.0, seed: int = 0) -> FrequencyResponse:
    g = greens.transfer(S)
    rng = np.random.default_rng(seed)
    error = (rng.normal(size=g.shape) + 1j * rng.normal(size=g.shape)) / np.sqrt(2)
    return FrequencyResponse(F, g * (1 + noise * error), greens.port_names)


def coupled(dashpot: float, ports: int) -> impact.PoleGreens:
    """Return two masses, a dashpot between the second and the ground only: its modes are complex."""
    stiffness = np.array([[4e7, -3e7], [-3e7, 5e7]])
    return complex_modes(np.diag([0.02, 0.03]), np.diag([0.0, dashpot]), stiffness, np.eye(2)[:, :ports])


def filtered_error(fit: impact.GreensFunction, truth: impact.GreensFunction) -> float:
    """Return the error after the Hann pulse of the band, over the largest value."""
    t = np.linspace(0, 5e-3, 800)
    exact = truth.filtered_matrix(t, 2 / F[-1])
    return float(np.abs(fit.filtered_matrix(t, 2 / F[-1]) - exact).max() / np.abs(exact).max())


@pytest.mark.slow
@pytest.mark.parametrize("truth", [SEAT, TWO], ids=["one port", "two ports"])
def test_exact_responses_give_the_modes_back(truth: impact.ModalGreens) -> None:
    fit = fit_poles(measured(truth))
    assert isinstance(fit, impact.ModalGreens)
    assert fit.omega == pytest.approx(truth.omega, rel=1e-9)
    assert fit.zeta == pytest.approx(truth.zeta, rel=1e-7)
    for mode, shape in zip(fit.shapes, truth.shapes, strict=True):
        assert np.outer(mode, mode) == pytest.approx(np.outer(shape, shape), rel=1e-6)
    assert fit.residual.compliance == pytest.approx(truth.residual.compliance, rel=1e-6)
    assert fit.error_estimate.reduction is not None
    assert fit.error_estimate.reduction < 1e-9


@pytest.mark.slow(but="2-one port")
@pytest.mark.parametrize("truth", [SEAT, TWO], ids=["one port", "two ports"])
@pytest.mark.parametrize("seed", range(3))
def test_one_percent_noise(truth: impact.ModalGreens, seed: int) -> None:
    fit = fit_poles(measured(truth, 0.01, seed))
    assert isinstance(fit, impact.ModalGreens)
    # Half width zeta f, about 2 zeta f/df lines in it: the pole is known to noise * zeta f/sqrt(2 zeta f/df), 1.4e-4 f
    # at most here. Five deviations of it; 3 % would be two hundred.
    f, half = truth.frequencies_hz, truth.zeta * truth.frequencies_hz
    deviation = 0.01 * half / np.sqrt(2 * half / 10.0)
    assert len(fit.omega) == 3
    assert np.all(np.abs(fit.frequencies_hz - f) < 5 * deviation)
    assert np.all(np.abs(fit.zeta - truth.zeta) < 5 * deviation / f)
    assert np.all(np.abs(np.abs(fit.shapes) / np.abs(truth.shapes) - 1) < 0.015)
    report = fit.provenance["fit"]
    assert 0.008 < report["misfit_weighted_rms"] < 0.012  # the noise, no more and no less
    assert report["causality_defect"] < 0.001
    assert filtered_error(fit, truth) < fit.error_estimate.total < 0.01  # type: ignore[operator]


@pytest.mark.slow
def test_the_error_estimate_covers_the_error() -> None:
    """The true error of random noisy bodies is near or below the estimate, also with modes beyond the band."""
    ratios = []
    for seed in range(6, 12):
        rng = np.random.default_rng(seed)
        modes, ports = int(rng.integers(2, 12)), int(rng.integers(1, 3))
        truth = impact.ModalGreens(
            2 * np.pi * np.sort(rng.uniform(500, 15000, modes)),
            10 ** rng.uniform(-2.5, -1, modes),
            10 * rng.normal(size=(modes, ports)),
            impact.Residual.spring(1e-9 * np.eye(ports)),
            ("lip", "stop")[:ports],
        )
        g = truth.transfer(S)
        noise = 10 ** rng.uniform(-3, -1.5) * (rng.normal(size=g.shape) + 1j * rng.normal(size=g.shape))
        g = g * (1 + noise) if seed % 2 else g + 0.05 * np.abs(g).max() * noise
        fit = fit_poles(FrequencyResponse(F, g, truth.port_names))
        assert fit.error_estimate.total is not None
        ratios.append(filtered_error(fit, truth) / fit.error_estimate.total)
    assert max(ratios) < 2.5
    assert np.mean(np.array(ratios) < 1.25) >= 0.8  # true error over its estimate


@pytest.mark.slow
def test_modes_above_the_band_count_as_compliance() -> None:
    many = impact.ModalGreens(
        2 * np.pi * np.linspace(1.1e3, 60e3, 40), np.full(40, 0.01), np.full((40, 1), 10.0), impact.Residual.none()
    )
    fit = fit_poles(measured(many, 0.01))
    assert fit.static_compliance() == pytest.approx(many.static_compliance(), rel=0.01)
    inside = many.frequencies_hz[many.frequencies_hz < 11e3]
    assert fit.frequencies_hz[: len(inside)] == pytest.approx(inside, rel=1e-3)
    assert filtered_error(fit, many) < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("ports", [1, 2])
@pytest.mark.parametrize("dashpot", [40.0, 400.0])
def test_modes_coupled_by_damping_need_complex_residues(dashpot: float, ports: int) -> None:
    truth = coupled(dashpot, ports)
    exact = fit_poles(measured(truth))
    assert isinstance(exact, impact.PoleGreens)
    assert exact.poles == pytest.approx(truth.poles, rel=1e-8)
    assert filtered_error(exact, truth) < 1e-8
    noisy = fit_poles(measured(truth, 0.01))
    assert isinstance(noisy, impact.PoleGreens)
    assert pole_passivity(noisy).passive
    assert filtered_error(noisy, truth) < 0.005
    modal = fit_poles(measured(truth), form="modal")  # real modes cannot: the choice above was needed
    assert filtered_error(modal, truth) > 0.01


def test_an_impulse_response_that_still_rings() -> None:
    dt, n = 5e-6, 400  # 2 ms: the first mode is left with exp(-0.5) of its amplitude
    truth = replace(SEAT, residual=impact.Residual.none())
    sampled = impact.SampledGreens(truth.impulse_response(dt * np.arange(n)), dt)
    fit = fit_impulse_response(sampled, highest=2e4)
    assert fit.frequencies_hz == pytest.approx(truth.frequencies_hz, rel=1e-3)
    assert fit.error_estimate.reduction < 0.01
    t = np.linspace(0, 1e-2, 500)  # five times as long as the record
    exact = truth.filtered(t, 1e-4)
    assert fit.filtered(t, 1e-4) == pytest.approx(exact, abs=0.01 * np.abs(exact).max())


@pytest.mark.parametrize("seed", range(3))
def test_a_hammer_test_with_noise(seed: int) -> None:
    dt, n = 1e-5, 2000
    truth = replace(SEAT, residual=impact.Residual.none())
    g = truth.impulse_response(dt * np.arange(n))
    g = g + 0.01 * np.abs(g).max() * np.random.default_rng(seed).normal(size=n)
    g[0] = 0.0
    record = impact.SampledGreens(g, dt, tail="zero")
    fit = fit_impulse_response(record, highest=1.5e4)
    t = np.linspace(0, 1e-2, 500)
    exact = truth.filtered(t, 1e-4)
    raw, error = (float(np.abs(body.filtered(t, 1e-4) - exact).max()) for body in (record, fit))
    assert error < raw  # nearer to the truth than the record itself
    assert error < 0.015 * np.abs(exact).max()
    strong = [k for k, f in enumerate(fit.frequencies_hz) if np.abs(truth.frequencies_hz - f).min() < 0.005 * f]
    assert len(strong) == 3


@pytest.mark.parametrize("free", [False, True])
def test_causality(free: bool) -> None:
    body = replace(SEAT, omega=np.array([0.0 if free else SEAT.omega[0], *SEAT.omega[1:]]))
    response = measured(body, 0.01)
    defect = causality_defect(response)
    assert defect is not None
    assert defect < 0.01
    mirrored = FrequencyResponse(F, response.receptance.conj())
    with pytest.raises(FrequencyResponseError, match=r"not causal: \d+% .* conjugate"):
        fit_poles(mirrored)
    high = F > 5e3
    assert np.isnan(causality_defect(FrequencyResponse(F[high], response.receptance[high])))


def test_noise_alone_is_refused() -> None:
    rng = np.random.default_rng(0)
    g = rng.normal(size=len(F)) + 1j * rng.normal(size=len(F))
    with pytest.raises(FrequencyResponseError, match=r"nothing but noise|not causal"):
        fit_poles(FrequencyResponse(F, g), most_pairs=6)
    with pytest.raises(FrequencyResponseError, match="form 'real' is unknown"):
        fit_poles(measured(SEAT), form="real")  # type: ignore[arg-type]


HAMMER_F = np.arange(20.0, 16e3, 10.0)
HAMMER_S = 2j * np.pi * HAMMER_F
STATIC = 2.11e-8  # m/N


def hammered() -> impact.ModalGreens:
    """Return modes at 2.3, 6.1 and 11.8 kHz, with 9 % of the static compliance above them."""
    omega, parts = 2 * np.pi * np.array([2.3e3, 6.1e3, 11.8e3]), np.array([1.2e-8, 5e-9, 2.1e-9])
    shapes = (omega * np.sqrt(parts))[:, None]
    return impact.ModalGreens(
        omega, np.array([0.02, 0.015, 0.02]), shapes, impact.Residual.spring(STATIC - parts.sum())
    )


def accelerance(body: impact.GreensFunction, noise: float, seed: int) -> FrequencyResponse:
    """Return an accelerance with white noise, a part of the root mean square of all lines."""
    exact = body.transfer(HAMMER_S)[:, 0, 0] * HAMMER_S**2
    size = noise * np.sqrt(np.mean(np.abs(exact) ** 2)) / np.sqrt(2)
    rng = np.random.default_rng(seed)
    white = size * (rng.normal(size=len(exact)) + 1j * rng.normal(size=len(exact)))
    return receptance(HAMMER_F, exact + white, "accelerance")


@pytest.mark.slow(but="1")
@pytest.mark.parametrize("seed", range(3))
def test_a_noisy_accelerance_gives_its_modes_and_its_static_compliance(seed: int) -> None:
    """Divided by the squared frequency, the noise of the lowest lines is 400 times the receptance."""
    fit = fit_response(accelerance(hammered(), 0.02, seed))
    greens, report = fit.greens, fit.greens.provenance["fit"]
    assert isinstance(greens, impact.ModalGreens)
    assert greens.frequencies_hz == pytest.approx([2.3e3, 6.1e3, 11.8e3], rel=1e-3)
    assert (report["free"], report["pole_pairs"], report["modes_beyond_band_hz"]) == (False, 3, [])
    static = [float(each.static_compliance()[0, 0]) / STATIC for each in (greens, *fit.draws)]
    deviation = np.std(static[1:])
    assert 0.001 < deviation < 0.01
    assert abs(static[0] - 1) < 4 * deviation
    assert report["misfit_rms"] == pytest.approx(0.02, rel=0.05)  # the noise, no more and no less
    assert report["unexplained"] == 0.0
    assert report["unexplained_lines_hz"] == []


@pytest.mark.slow
def test_lines_that_no_mode_explains_are_named() -> None:
    response = accelerance(hammered(), 0.002, 0)
    odd = (response.frequency > 8.4e3) & (response.frequency < 9.0e3)
    values = np.where(odd[:, None, None], 1.3 * response.receptance, response.receptance)
    report = fit_poles(replace(response, receptance=values)).provenance["fit"]
    low, high = report["unexplained_lines_hz"][0]
    assert report["misfit_over_noise_worst"] > 3
    assert 8.2e3 < low < high < 9.2e3
