"""What every Green's function promises, whatever it is made of: held, free, damped, with one port or two."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import impact
from impact import measures
from impact.exact.closed_form import BareFixedRod, PowerGreens
from impact.greens.base import ErrorEstimate, GreensFunction, GreensFunctionError, ScaledGreens, StepKernel, SumGreens
from impact.storage.hdf5 import load_greens, save_greens

ROD = {"young": 4.0, "density": 9.0, "area": 1.0, "length": 2.0 / 3.0}  # Z = 6, l/c = 1, mass 6
DT, STEPS = 0.02, 300
TIMES = DT * np.arange(STEPS + 1)

HELD = impact.ModalGreens(
    np.array([2.0, 7.0, 30.0]),
    np.array([0.02, 0.3, 1.4]),
    np.array([[0.5, -0.2], [0.3, 0.4], [0.1, 0.3]]),
    impact.Residual.exponential([[0.02, 0.01], [0.01, 0.03]], [[0.1, 0.0], [0.0, 0.2]]),
    ("tip", "middle"),
    ErrorEstimate(1e-3, 2e-3),
    {"method": "by hand", "dof": 3},
)
"""Two ports, held."""
FREE = replace(
    HELD,
    omega=np.array([0.0, 0.0, 5.0]),
    zeta=np.array([0.0, 0.0, 0.05]),
    shapes=np.array([[0.5, 0.5], [0.3, -0.3], [0.4, 0.2]]),
)
"""Two ports of a body that translates and turns; 1/m = 0.34 at either."""
FREE_MASS = 1 / 0.34
POLES = impact.PoleGreens.from_modal(FREE)
BALL = impact.rigid_mass(mass=0.7, velocity=0.0).greens


def sampled(greens: GreensFunction, tail: str, end: float = 12.0) -> impact.SampledGreens:
    """Return its samples on a grid of DT, long enough for what vibrates to come to rest."""
    t = DT * np.arange(round(end / DT) + 1)
    p = range(len(greens.ports))
    values = np.array([[greens.impulse_response(t, i, j) for j in p] for i in p])
    return impact.SampledGreens(values, DT, tail, greens.ports)  # type: ignore[arg-type]


DAMPED_FREE = impact.free_rod(**ROD, damping_ratio=0.3)
KINDS: dict[str, tuple[GreensFunction, float]] = {
    "modes, held, two ports": (HELD, math.inf),
    "modes, free, two ports": (FREE, FREE_MASS),
    "modes, for a time": (replace(HELD, valid_for=3.0), math.inf),
    "poles, held": (impact.PoleGreens.from_modal(HELD), math.inf),
    "poles, free, two ports": (POLES, FREE_MASS),
    "poles, for a time": (replace(POLES, valid_for=5.5), FREE_MASS),
    "mass": (BALL, 0.7),
    "rod of two ends": (impact.rod_of_two_ends(**ROD), 6.0),
    "spring": (impact.spring(stiffness=30.0), math.inf),
    "oscillator": (impact.single_mode(frequency_hz=0.5, mass=2.0, damping_ratio=0.1), math.inf),
    "rod, fixed": (impact.fixed_rod(**ROD), math.inf),
    "rod, free": (impact.free_rod(**ROD), 6.0),
    "rod, impedance": (impact.rod_with_end_impedance(**ROD, end_impedance=1.0), math.inf),
    "rod, endless": (impact.semi_infinite_rod(**ROD), math.inf),
    "rod, fixed, damped": (impact.fixed_rod(**ROD, damping_ratio=0.1), math.inf),
    "rod, bare": (BareFixedRod(6.0, 1.0, 0.1), math.inf),
    "rod, free, damped": (DAMPED_FREE, 6.0),
    "beam": (impact.infinite_beam(young=4.0, density=9.0, area=1.0, second_moment=0.2), math.inf),
    "power law of a mass": (PowerGreens(1 / 3.0, 1.0), 3.0),
    "plate": (impact.infinite_plate(young=4.0, poisson=0.3, density=9.0, thickness=0.5), math.inf),
    "half-space": (impact.half_space_patch(young=4.0, poisson=0.3, density=9.0, radius=0.4), math.inf),
    "reed": (impact.cantilever_reed(
        young=4.0, density=9.0, length=2.0, width=0.3, thickness=0.2, damping_ratio=0.03, n_modes=6,
        contact_at=(1.0, 2.0),
    ).greens, math.inf),
    "samples, ending": (sampled(HELD, "forbid"), math.inf),
    "samples, at rest": (sampled(impact.fixed_rod(**ROD, damping_ratio=0.4), "zero"), math.inf),
    "samples, rigid tail": (sampled(DAMPED_FREE, "rigid"), 6.0),
    "samples, rigid tail, two ports": (sampled(FREE, "rigid", end=60.0), FREE_MASS),
    "sum of modes": (SumGreens((BALL, impact.spring(stiffness=9.0))), 0.7),
    "sum of all kinds": (SumGreens((DAMPED_FREE, BALL, sampled(DAMPED_FREE, "rigid"))), 1 / (1 / 6 + 1 / 0.7 + 1 / 6)),
    "multiple of modes": (ScaledGreens(FREE, 0.5), 2 * FREE_MASS),
    "multiple of a rod": (ScaledGreens(DAMPED_FREE, 2.0), 3.0),
    "multiple of complex poles": (ScaledGreens(POLES, 3.0), FREE_MASS / 3),
    "sum, held, for a time": (SumGreens((replace(HELD, valid_for=4.0), impact.PoleGreens.from_modal(HELD))), math.inf),
}  # fmt: skip
MASSES_BY_SAMPLES = 1e-5  # what is left of the vibration in the last slope
FREE_KINDS = [name for name, (_, mass) in KINDS.items() if math.isfinite(mass)]


@pytest.fixture(params=KINDS)
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def greens(name: str) -> GreensFunction:
    return KINDS[name][0]


def pairs(greens: GreensFunction) -> list[tuple[int, int]]:
    return list(np.ndindex(len(greens.ports), len(greens.ports)))


def known_times(greens: GreensFunction) -> np.ndarray:
    return TIMES[greens.valid_for >= TIMES]


def leaves(greens: GreensFunction) -> list[GreensFunction]:
    """Return the functions that it is made of, down to those that are made of no other."""
    parts = getattr(greens, "parts", None) or [part for part in [getattr(greens, "part", None)] if part is not None]
    return [leaf for part in parts for leaf in leaves(part)] if parts else [greens]


def test_ports_have_names_and_numbers(greens: GreensFunction) -> None:
    for number, port in enumerate(greens.ports):
        assert greens.port_index(port) == greens.port_index(number) == number
    with pytest.raises(GreensFunctionError, match=greens.ports[0]):
        greens.port_index("elsewhere")
    for matrix in (greens.initial_value(), greens.inverse_mass()):
        assert matrix.shape == (len(greens.ports),) * 2


def test_it_is_reciprocal_causal_and_starts_at_its_initial_value(greens: GreensFunction) -> None:
    t = known_times(greens)
    for i, j in pairs(greens):
        np.testing.assert_allclose(
            greens.impulse_response(t, i, j), greens.impulse_response(t, j, i), rtol=1e-9, atol=1e-12
        )
        assert greens.impulse_response(np.array([-1.0]), i, j)[0] == 0.0
        start = greens.initial_value()[i, j]
        if np.isfinite(start):
            assert greens.impulse_response(np.array([0.0]), i, j)[0] == pytest.approx(start, abs=1e-9)


def test_g_is_the_slope_of_the_step_response(greens: GreensFunction) -> None:
    """g is the midpoint slope of the step response, off by h^2/24 of g'' between jumps."""
    h = 1e-4
    t = np.array([0.413, 0.777, 1.313, 1.713])  # off the grid of the samples, between the fronts
    for i, j in pairs(greens):
        slope = (greens.step_response(t + h / 2, i, j) - greens.step_response(t - h / 2, i, j)) / h
        largest = np.abs(greens.impulse_response(known_times(greens)[1:], i, j)).max()
        np.testing.assert_allclose(slope, greens.impulse_response(t, i, j), atol=1e-6 * largest)


def weights_of(kernel: StepKernel, n: int) -> np.ndarray:
    """Return (p, p, n) weights of a kernel, its oscillators included."""
    total = 0.0 if kernel.weights is None else kernel.weights[:, :, :n]
    if kernel.modal is not None:
        p = range(len(kernel.modal.ports))
        steps = [[kernel.modal.step_response(DT * np.arange(n + 1), i, j) for j in p] for i in p]
        weights = np.diff(np.array(steps), axis=2)
        weights[:, :, 0] += kernel.modal.residual.compliance
        total = total + weights
    return np.asarray(total)


def test_the_kernel_holds_the_steps_of_the_step_response(greens: GreensFunction) -> None:
    """The weights are W_m = S((m + 1) h) - S(m h), S(0-) = 0, and the kernel's own weight is W_0."""
    n = 60
    kernel = greens.step_kernel(DT, n)
    weights, own = weights_of(kernel, n), kernel.self_weight(DT)
    for i, j in pairs(greens):
        steps = np.diff(greens.step_response(DT * np.arange(n + 1), i, j))
        steps[0] = greens.step_response(np.array([DT]), i, j)[0]
        scale = np.abs(steps).max()
        np.testing.assert_allclose(weights[i, j], steps, atol=1e-10 * scale)
        assert own[i, j] == pytest.approx(steps[0], abs=1e-10 * scale)


def test_its_static_compliance_is_where_the_step_response_ends(name: str, greens: GreensFunction) -> None:
    """The late mean of the step response is the static compliance; without support the response grows on."""
    if name == "samples, ending":
        with pytest.raises(GreensFunctionError, match="static compliance is unknown"):
            greens.static_compliance()
        return
    static = greens.static_compliance()
    assert static.shape == (len(greens.ports),) * 2
    for i, j in pairs(greens):
        if math.isfinite(static[i, j]):
            late = np.linspace(2e4, 3e4, 20_011)
            assert np.mean(greens.step_response(late, i, j)) == pytest.approx(static[i, j], rel=1e-3, abs=1e-12)
        else:
            assert abs(greens.step_response(np.array([1e6]), i, j)[0]) > 1e3


@pytest.mark.slow(but="power law of a mass")
def test_filtered_is_g_after_a_pulse(greens: GreensFunction) -> None:
    """A class's own filtered response is the general rule's integral of the pulse's slope times the step response.

    The rule does not see where in one of its 256 panels a bare compliance jumps: 0.3 of 2 pi/256 of the peak.
    """
    t, width = np.array([0.3, 0.55]), 0.6
    whole = greens.filtered_matrix(t, width)
    assert whole.shape == (len(greens.ports), len(greens.ports), len(t))
    for i, j in pairs(greens) if type(greens).filtered is not GreensFunction.filtered else []:
        expected = GreensFunction.filtered(greens, t, width, i, j)
        np.testing.assert_allclose(whole[i, j], expected, rtol=1e-6, atol=0.3 * 2 * np.pi / 256 * np.abs(whole).max())
        np.testing.assert_allclose(greens.filtered(t, width, i, j), whole[i, j], rtol=1e-12, atol=1e-14)


def test_ports_are_combined_or_refuse_to_be(greens: GreensFunction) -> None:
    """The mean of all ports has the mean of all responses, W' S W; closed forms refuse."""
    p = len(greens.ports)
    weights, t = np.full((p, 1), 1 / p), known_times(greens)
    if any(part.closed_form for part in leaves(greens)):
        with pytest.raises(GreensFunctionError, match="cannot be combined"):
            greens.combined(weights, ("mean",))
        return
    mean = greens.combined(weights, ("mean",))
    assert mean.ports == ("mean",)
    expected = sum(greens.step_response(t, i, j) for i, j in pairs(greens)) / p**2
    np.testing.assert_allclose(mean.step_response(t), expected, rtol=1e-9, atol=1e-12 * np.abs(expected).max())
    assert mean.valid_for == greens.valid_for


def test_its_transform_is_that_of_g_or_is_not_known(greens: GreensFunction) -> None:
    """G(s) for s > 0 is the Gauss quadrature of exp(-s t) s S(t), bare compliances included."""
    s = 3.0
    if not all(isinstance(part, impact.ModalGreens | impact.PoleGreens) for part in leaves(greens)):
        with pytest.raises(GreensFunctionError, match="not known in closed form"):
            greens.transfer(np.array([s + 0j]))
        return
    transfer = greens.transfer(np.array([s + 0j]))
    nodes, gauss = np.polynomial.legendre.leggauss(20)
    edges = np.linspace(0.0, 12.0, 241)
    t = ((edges[1:] + edges[:-1])[:, None] / 2 + np.diff(edges)[:, None] / 2 * nodes).ravel()
    w = (np.diff(edges)[:, None] / 2 * gauss).ravel() * s * np.exp(-s * t)
    t, w = t[t <= greens.valid_for], w[t <= greens.valid_for]
    for i, j in pairs(greens):
        scale = np.abs(transfer).max()
        assert transfer[0, i, j] == pytest.approx(w @ greens.step_response(t, i, j), abs=2e-3 * scale)
    assert transfer.shape == (1, len(greens.ports), len(greens.ports))


def test_it_is_the_sum_of_what_it_names(greens: GreensFunction) -> None:
    t = known_times(greens)
    parts = greens.summands
    assert len(parts) > 1 or parts == (greens,)
    total = sum(part.step_response(t) for part in parts)
    np.testing.assert_allclose(total, greens.step_response(t), rtol=1e-12, atol=0)
    for same in (greens.modal, greens.pole_sum):
        if same is not None:
            np.testing.assert_allclose(same.step_response(t), greens.step_response(t), rtol=1e-9, atol=1e-12)


def test_its_mass_is_that_of_its_long_motion(name: str, greens: GreensFunction) -> None:
    mass = KINDS[name][1]
    assert greens.mass() == pytest.approx(mass, rel=MASSES_BY_SAMPLES)
    assert greens.mass(greens.ports[-1]) == pytest.approx(mass, rel=MASSES_BY_SAMPLES)
    if math.isfinite(mass):
        far = np.array([1e4, 2e4])
        for i, j in pairs(greens):
            slope = np.diff(greens.impulse_response(far, i, j))[0] / 1e4
            assert slope == pytest.approx(greens.inverse_mass()[i, j], rel=1e-3, abs=1e-6)


def test_it_says_until_when_it_is_known(greens: GreensFunction) -> None:
    greens.check_length(DT, 60)
    if math.isfinite(greens.valid_for):
        beyond = math.ceil(greens.valid_for / DT) + 2
        with pytest.raises(GreensFunctionError, match=rf"{beyond * DT:g} s .*shorten"):
            greens.check_length(DT, beyond)
        problem = impact.ContactProblem(
            impact.rigid_mass(mass=1.0, velocity=-1.0), greens, law=impact.LinearSpring(1.0)
        )
        with pytest.raises(GreensFunctionError, match="compute"):
            impact.solve(problem, dt=DT, duration=beyond * DT)


@pytest.mark.parametrize("factor", [2.5])
def test_scaled_is_the_multiple_in_every_answer(greens: GreensFunction, factor: float) -> None:
    scaled, t = greens.scaled(factor), known_times(greens)[1:]
    assert scaled.ports == greens.ports
    assert scaled.valid_for == greens.valid_for
    assert scaled.error_estimate == greens.error_estimate
    assert scaled.mass() == pytest.approx(greens.mass() / factor)
    assert (scaled.modal is None) == (greens.modal is None)
    assert (scaled.rod is None) == (greens.rod is None)
    assert scaled.highest_rate == pytest.approx(greens.highest_rate)
    for i, j in pairs(greens):
        for answer in ("impulse_response", "step_response"):
            one, other = (getattr(g, answer)(t, i, j) for g in (scaled, greens))
            np.testing.assert_allclose(one, factor * other, rtol=1e-9, atol=1e-10 * np.abs(other).max())
    with np.errstate(invalid="ignore"):
        np.testing.assert_allclose(scaled.initial_value(), factor * greens.initial_value(), rtol=1e-12)
    np.testing.assert_allclose(
        weights_of(scaled.step_kernel(DT, 40), 40), factor * weights_of(greens.step_kernel(DT, 40), 40), rtol=1e-9,
        atol=1e-12,
    )  # fmt: skip
    for wrong in (0.0, -1.0, math.nan, math.inf):
        with pytest.raises(GreensFunctionError, match="passive"):
            greens.scaled(wrong)


def test_the_form_for_forces_alone_is_the_same_function(greens: GreensFunction) -> None:
    lean, t = greens.forces_only(), known_times(greens)
    for i, j in pairs(greens):
        np.testing.assert_array_equal(lean.step_response(t, i, j), greens.step_response(t, i, j))
    assert lean.mass() == greens.mass()


def test_what_is_saved_is_loaded(greens: GreensFunction, tmp_path: Path) -> None:
    save_greens(greens, tmp_path / "g.h5")
    read, t = load_greens(tmp_path / "g.h5"), known_times(greens)
    assert read.ports == greens.ports
    assert read.valid_for == greens.valid_for
    assert read.mass() == greens.mass()
    assert read.error_estimate == greens.error_estimate
    assert dict(read.provenance) == dict(greens.provenance)
    for i, j in pairs(greens):
        np.testing.assert_array_equal(read.step_response(t, i, j), greens.step_response(t, i, j))


def test_its_error_and_origin_can_be_stated_or_are_its_own(greens: GreensFunction) -> None:
    if any(part.closed_form for part in leaves(greens)):
        with pytest.raises(GreensFunctionError, match="state neither"):
            greens.with_error(ErrorEstimate(0.01, 0.02))
        return
    stated = greens.with_error(ErrorEstimate(0.01, 0.02))
    assert stated.error_estimate == ErrorEstimate(0.01, 0.02)
    assert stated.valid_for == greens.valid_for


@pytest.mark.parametrize("name", FREE_KINDS)
def test_a_free_body_can_be_thrown(name: str) -> None:
    """A body keeps its speed without contact, has the energy m v^2/2, and its second port moves as a rigid body's."""
    greens, mass = KINDS[name]
    thrown, wall = impact.Body(greens, velocity=-0.5), impact.spring(stiffness=5.0)
    result = impact.solve(impact.ContactProblem(thrown, wall, gap=100.0), dt=DT, duration=2.0)
    np.testing.assert_allclose(result.striker_displacement, -0.5 * result.time, rtol=1e-5, atol=1e-12)
    assert result.energy.striker[0] == pytest.approx(mass * 0.25 / 2, rel=MASSES_BY_SAMPLES)
    assert result.energy.residual < 1e-9
    assert result.striker_mass == pytest.approx(mass, rel=MASSES_BY_SAMPLES)
    assert result.striker_velocity == -0.5
    if len(greens.ports) > 1:
        other = impact.solve(impact.ContactProblem(thrown, wall, gap=100.0, striker_port=1), dt=DT, duration=2.0)
        share = greens.inverse_mass()[1, 0] * mass
        np.testing.assert_allclose(other.striker_displacement, -0.5 * share * result.time, rtol=1e-4, atol=1e-9)
        assert other.striker_velocity == pytest.approx(-0.5 * share, rel=1e-5)


@pytest.mark.parametrize("name", FREE_KINDS)
@pytest.mark.parametrize("factor", [1.0, 3.0])
def test_restitution_of_free_bodies_is_momentum_s(name: str, factor: float) -> None:
    """Restitution follows from the change of both bodies' rigid motion, thrown or struck by a unit mass alike.

    e = J (1/m1 + 1/m2)/v - 1: Galilei's principle asks that it be the same whichever of the two moves.
    """
    greens, mass = KINDS[name][0].scaled(factor), KINDS[name][1] / factor
    law = impact.LinearSpring(20.0)
    ball = impact.rigid_mass(mass=1.0, velocity=0.0)
    struck = impact.ContactProblem(impact.rigid_mass(mass=1.0, velocity=-0.5), impact.Body(greens), law=law)
    throws = impact.ContactProblem(impact.Body(greens, velocity=-0.5), ball, law=law)
    one, other = (impact.solve(problem, dt=DT, duration=5.0) for problem in (struck, throws))
    e = measures.restitution(one)
    assert e == pytest.approx(measures.impulse(one) * (1 + 1 / mass) / 0.5 - 1, abs=1e-5)
    assert 0.0 < e <= 1.0 + 1e-9
    assert measures.restitution(other) == pytest.approx(e, abs=1e-5)
    assert one.energy.residual < 1e-9
    assert other.energy.residual < 1e-9


def test_a_representation_that_says_nothing_of_its_mass_is_asked_to() -> None:
    class Drifting(PowerGreens):
        def inverse_mass(self) -> np.ndarray:
            return GreensFunction.inverse_mass(self)

    with pytest.raises(GreensFunctionError, match=r"Drifting .*mass"):
        Drifting(1.0, 1.0).mass()


def test_time_limits_are_positive() -> None:
    with pytest.raises(GreensFunctionError, match="valid_for = -1"):
        replace(HELD, valid_for=-1.0)
