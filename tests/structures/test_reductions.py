"""Krylov vectors, modes and time steps from M, C, K to g on small models whose modes are all known."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import scipy.linalg
import skfem
from scipy import sparse

import impact
from impact.greens.modal import ModalGreens, Residual
from seatfem.machine.libraries import has_pardiso
from seatfem.structures.model import Damping, ModelError, Port, SecondOrderModel, as_csr
from seatfem.structures.reduction import greens as reductions
from seatfem.structures.reduction.eigen_search import rigid_shapes
from seatfem.structures.reduction.factorization import SINGLE, TWO_GRIDS
from seatfem.structures.reduction.modal import Modal
from seatfem.structures.reduction.modes import ConvergenceError
from seatfem.structures.reduction.reducer import History, residual, truncate
from seatfem.structures.reduction.transient import Transient, march
from tests.rod_model import rod_model
from tests.solids import Aims, Krylov, assemble, greens_function

ROD = {"young": 200e9, "density": 7850.0, "area": 1e-4, "length": 30e-3}
STEEL = {"young": 200e9, "poisson": 0.3, "density": 7850.0}
BLOCK_PORTS = {
    "fixed": lambda x: x[2] < 1e-9,
    "left": lambda x: (x[2] > 4e-3 - 1e-9) & (x[0] < 6e-3),
    "right": lambda x: (x[2] > 4e-3 - 1e-9) & (x[0] > 6e-3),
}


@pytest.fixture(scope="module")
def rod():
    return rod_model(**ROD, elements=200)


@pytest.fixture(scope="module")
def block():
    """Return a steel block, two patches on its top, about 1000 unknowns, not symmetric."""
    mesh = skfem.MeshTet.init_tensor(
        np.linspace(0, 12e-3, 5) ** 1.05, np.linspace(0, 11e-3, 5), np.linspace(0, 4e-3, 3)
    )
    mesh = skfem.MeshTet(mesh.p * np.array([[12e-3 / mesh.p[0].max()], [1], [1]]), mesh.t)
    return assemble(mesh.with_boundaries(BLOCK_PORTS), STEEL, ports={"left": "left", "right": "right"}, order=2)


@cache
def spectrum(size, *matrices):
    """Return eigenvalues and modes of two matrices, given as bytes to be kept for many tests."""
    return scipy.linalg.eigh(*(np.frombuffer(matrix).reshape(size, size) for matrix in matrices))


def all_modes(model, damping):
    values, shapes = spectrum(model.size, model.K.toarray().tobytes(), model.M.toarray().tobytes())
    omega = np.sqrt(np.where(values < 1e-9 * values[-1] * 1e-4, 0.0, values))
    p = model.port_matrix.shape[1]
    zeta = damping.ratios(omega, damping.losses(shapes))
    return truncate(omega, zeta, shapes.T @ model.port_matrix, np.inf, np.zeros((p, p)), model, damping)


def true_error(greens, model, damping, bandwidth, duration):
    t = np.linspace(0, duration, 3001)
    reference = all_modes(model, damping).filtered_matrix(t, 1 / bandwidth)
    return np.abs(greens.filtered_matrix(t, 1 / bandwidth) - reference).max() / np.abs(reference).max()


@pytest.mark.parametrize("zeta", [0.1, 1.0, 2.5])
def test_closed_form_pulse_response_is_the_quadrature(zeta):
    omega = np.array([0.0, 0.3, 1.0, 2 * np.pi / 1.3, 20.0])
    shapes = np.random.default_rng(0).random((5, 2))
    rest = Residual.exponential(0.1 * np.eye(2), [[2.0, 0.5], [0.5, 1.0]])
    greens = ModalGreens(omega, zeta * (omega > 0), shapes, rest, ("a", "b"))
    t = np.linspace(0, 5, 23)
    quadrature = greens.filtered(t, 1.3, 0, 1)
    # the double pole at zeta = 1 is replaced by a pair 1e-7 apart
    assert greens.filtered_matrix(t, 1.3)[0, 1] == pytest.approx(quadrature, abs=1e-6 * np.abs(quadrature).max())


@pytest.mark.slow
@pytest.mark.parametrize(
    ("damping", "tolerance", "bandwidth"),
    [
        (Damping(), 1e-3, 1e5),
        (Damping(0.1), 1e-2, 4e5),
        (Damping(0.1), 1e-3, 1e5),
        (Damping(0.0, 1e3, 1e-8), 1e-2, 4e5),
        (Damping(), 1e-4, 4e5),  # so slow that it starts again with a higher shift
    ],
)
def test_krylov_error_is_below_its_estimate(rod, block, damping, tolerance, bandwidth):
    for model in (rod, block):
        greens = Krylov().reduce(model, damping, Aims(bandwidth, 8 / bandwidth, tolerance)).greens
        stated = greens.error_estimate.reduction
        error = true_error(greens, model, damping, bandwidth, 8 / bandwidth)
        assert stated <= tolerance
        # the measuring points miss the largest value by a few percent; an estimate beyond 15 times tells nothing
        assert error <= 1.1 * stated
        assert stated <= 15 * error


@pytest.mark.slow
@pytest.mark.skipif(not has_pardiso(), reason="no MKL")
@pytest.mark.parametrize(("damping", "tolerance"), [(Damping(), 1e-2), (Damping(0.02), 1e-3)])
def test_vectors_of_rounded_solutions_make_the_same_g(block, monkeypatch, damping, tolerance):
    """K and M are projected on them in double precision: what they miss is far below the tolerance, and stated."""
    aims = Aims(4e5, 2e-5, tolerance)
    exact = Krylov().reduce(block, damping, aims).greens
    monkeypatch.setattr("seatfem.structures.method.SINGLE_FROM", 0)
    rough = Krylov().reduce(block, damping, aims).greens
    assert SINGLE not in exact.origin["factorization"]
    assert SINGLE in rough.origin["factorization"]
    assert true_error(rough, block, damping, 4e5, 2e-5) <= 1.1 * rough.error_estimate.reduction
    t = np.linspace(0, 2e-5, 1001)
    one, other = (greens.filtered_matrix(t, 1 / 4e5) for greens in (exact, rough))
    assert 0 < np.abs(one - other).max() <= 1e-3 * tolerance * np.abs(one).max()
    tighter = Krylov().reduce(block, damping, replace(aims, tolerance=9e-4)).greens
    plain = Krylov().reduce(block, damping, replace(aims, backend="superlu")).greens
    assert SINGLE not in tighter.origin["factorization"]
    assert SINGLE not in plain.origin["factorization"]
    monkeypatch.setattr("seatfem.structures.method.ITERATED_FROM", 0)
    iterated = Krylov().reduce(block, damping, aims).greens
    assert iterated.origin["factorization"] == TWO_GRIDS
    assert true_error(iterated, block, damping, 4e5, 2e-5) <= 1.1 * iterated.error_estimate.reduction
    other = iterated.filtered_matrix(t, 1 / 4e5)
    assert 0 < np.abs(one - other).max() <= 0.1 * tolerance * np.abs(one).max()


@pytest.mark.slow
@pytest.mark.parametrize(("damping", "band"), [(Damping(), 1e5), (Damping(0.05), 1e5), (Damping(), 2e4)])
def test_modal_error_is_below_its_estimate(block, damping, band):
    """Also in a band below the lowest mode, of which few are computed."""
    narrow = Modal().reduce(block, damping, Aims(band, 5 / band, 2e-2))
    error = true_error(narrow.greens, block, damping, band, 5 / band)
    assert error <= narrow.greens.error_estimate.reduction <= 2e-2
    assert band < 1e5 or narrow.greens.error_estimate.reduction <= 10 * error
    assert 0 < narrow.modes.frequencies_hz[-1] < 6e5


@pytest.mark.parametrize("zeta", [0.1, 1.0, 3.0])
def test_first_velocity_of_a_damped_rod_is_the_sum_over_its_modes(zeta):
    w = np.geomspace(1e-4, 1e5, 400001)  # their integral at t = 1
    integral = np.trapezoid(impact.greens.oscillator.impulse_response(1.0, w, zeta) * w, np.log(w))
    assert Damping(zeta).first_velocity() == pytest.approx(2 / np.pi * integral, rel=1e-3)


def test_an_unknown_impedance_gives_a_bare_spring(rod):
    bare = SecondOrderModel(rod.M, None, rod.K, {"contact": rod.port_matrix[:, 0]})
    assert residual(np.array([[2e-9]]), bare, Damping()).compliance[0, 0] == 2e-9
    relaxed = residual(np.array([[2e-9]]), bare, Damping(0, 0, 1e-7))
    assert 1 / relaxed.rates == pytest.approx([1e-7], rel=1e-6)


@pytest.mark.slow
def test_the_marched_samples_are_second_order(rod):
    """Newmark's samples tend to all modes of the same matrices after the pulse at second order."""
    duration, width = 4e-5, 1e-5
    t = np.linspace(0, duration, 161)
    exact = all_modes(rod, Damping()).filtered(t, width)
    errors = []
    for n in (200, 400, 800):
        g = impact.SampledGreens(march(rod, duration / n, n), duration / n)
        errors.append(np.abs(g.filtered(t, width) - exact).max() / np.abs(exact).max())
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(np.abs(orders - 2) < 0.15)  # the next term is O(h^2) of the first: 5 % at these steps
    assert errors[-1] < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("rayleigh", [None, (1e4, 3e-8)])
def test_transient_error_is_below_its_estimate(rod, rayleigh):
    model = rod_model(**ROD, elements=100, damping=rayleigh)
    greens = Transient().reduce(model, model.damping, Aims(1e5, 5e-5, 1e-2)).greens
    t = np.linspace(0, 5e-5, 201)
    exact = all_modes(model, model.damping).filtered(t, 1e-5)
    error = np.abs(greens.filtered(t, 1e-5) - exact).max() / np.abs(exact).max()
    assert error <= greens.error_estimate.reduction <= 1e-2
    assert greens.error_estimate.reduction <= 10 * error
    static = 30e-3 / (200e9 * 1e-4)
    assert greens.static_compliance()[0, 0] == pytest.approx(static, rel=1e-6)
    if rayleigh is None:  # the first half step averages g over less than an element's transit time
        assert greens.initial_value()[0, 0] == pytest.approx(1 / (1e-4 * np.sqrt(200e9 * 7850.0)), rel=0.1)


def test_auto_chooses_and_says_why(block):
    small = rod_model(**ROD, elements=20)
    chosen = greens_function(small, bandwidth=1e5, duration=2e-5, tolerance=2e-2)
    assert chosen.provenance["method"] == "modes"
    assert chosen.provenance["checks"]["passive"] is True
    large = greens_function(block, bandwidth=1e5, duration=2e-5, tolerance=2e-2, damping_ratio=0.1, ports=["right"])
    assert large.provenance["method"] == "krylov"
    assert "one factorization" in large.provenance["reason"]
    assert large.ports == ("right",)
    assert large.provenance["dof"] == block.size


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"bandwidth": 0.0}, "bandwidth = 0.0"),
        ({"bandwidth": np.inf}, "bandwidth = inf"),
        ({"damping_ratio": np.nan, "method": "transient"}, "damping_ratio = nan.*>= 0"),
        ({"method": "magic"}, "method 'magic' is unknown"),
        ({"damping_ratio": -0.1, "method": "krylov"}, "damping_ratio = -0.1.*>= 0"),
        ({"damping_ratio": 0.1, "method": "transient"}, "M\\^-1 K"),
        ({"ports": ["lip"]}, "port 'lip'.*contact"),
    ],
)
def test_refused_arguments(rod, arguments, message):
    with pytest.raises(ModelError, match=message):
        greens_function(rod, **{"bandwidth": 1e5, "duration": 1e-5, "tolerance": 1e-2, **arguments})


def test_refused_damping(rod):
    dashpot = SecondOrderModel(rod.M, sparse.diags_array(np.arange(rod.size, dtype=float)), rod.K, rod.ports)
    with pytest.raises(ModelError, match="use method='second_order'"):
        greens_function(dashpot, bandwidth=1e5, duration=1e-5, tolerance=1e-2, method="krylov")
    free = rod_model(**ROD, elements=300, fixed_end=False, damping=(1e3, 0.0))
    with pytest.raises(ModelError, match="damps the rigid motion"):
        greens_function(free, bandwidth=1e5, duration=1e-5, tolerance=1e-2, method="krylov")
    feeding = rod_model(**ROD, elements=10, damping=(0.0, -1e-8))
    with pytest.raises(ModelError, match="feed energy"):
        greens_function(feeding, bandwidth=1e5, duration=1e-5, tolerance=1e-2)


def test_what_is_not_reached_is_stated_with_numbers(rod, block):
    with pytest.raises(ConvergenceError, match=r"30 Krylov .*\d"):
        Krylov().reduce(rod, Damping(), Aims(1e6, 1e-4, 1e-4, 30))
    with pytest.raises(ConvergenceError, match=r"modes .*MHz \(limit 5\)"):
        Modal(most=5).reduce(block, Damping(), Aims(1e6, 1e-5, 1e-3))
    with pytest.raises(ConvergenceError, match=r"\d+ steps .*\(limit 100\)"):
        Transient(most=100).reduce(rod, rod.damping, Aims(1e6, 1e-4, 1e-4))


@pytest.mark.slow
def test_an_indefinite_stiffness_is_refused(rod):
    square = (2 * np.pi * 1e5) ** 2  # K - w^2 M has the diagonal of a stiffness, and negative eigenvalues
    indefinite = SecondOrderModel(rod.M, None, rod.K - square * rod.M, rod.ports)
    for method in ("krylov", "modes", "transient"):
        with pytest.raises(ModelError, match="K is indefinite"):
            greens_function(indefinite, bandwidth=1e6, duration=1e-5, tolerance=1e-2, method=method)


def test_time_stepping_takes_a_free_body():
    free = rod_model(**ROD, elements=100, fixed_end=False)
    greens = Transient().reduce(free, free.damping, Aims(1e5, 2e-5, 1e-2)).greens
    assert greens.static.size == 0
    with pytest.raises(impact.GreensFunctionError, match="static compliance is unknown"):
        greens.static_compliance()


WIDTH, SPAN, SHORT = 1 / 4e5, 4e-5, 5e-6


def late_error(model, greens, ratio, duration):
    """Return the largest error of g after the pulse over ``duration``, of its largest value; all modes are true."""
    exact = all_modes(model, model.damping.plus(ratio))
    t = np.linspace(0.0, duration, 2000)
    truth, computed = (g.filtered_matrix(t, WIDTH) for g in (exact, greens))
    return float(np.abs(truth - computed).max() / np.abs(truth).max())


@pytest.mark.slow
def test_g_is_known_for_as_long_as_it_was_computed(block):
    """Pairs near the edge of the band are fitted to the duration: measured, 7 % off after 30 times 5 us."""
    greens = greens_function(block, bandwidth=1 / WIDTH, duration=SHORT, tolerance=2e-2, method="krylov")
    assert greens.valid_for == SHORT
    assert late_error(block, greens, 0.0, SHORT) <= greens.error_estimate.reduction
    assert late_error(block, greens, 0.0, 30 * SHORT) > 3 * greens.error_estimate.reduction
    problem = impact.ContactProblem(impact.rigid_mass(mass=1e-3, velocity=-1.0), greens)
    impact.prepare(problem, 1e-8, SHORT)
    with pytest.raises(impact.GreensFunctionError, match=r"6e-06 s.*5e-06 s .* 500 steps"):
        impact.prepare(problem, 1e-8, 6e-6)


@pytest.mark.slow
def test_where_krylov_vectors_do_not_suffice_the_next_way_is_taken(block, monkeypatch):
    """Unless the scene states their number; where no way reaches the tolerance, the message has the reason of each."""
    ways = {"krylov": Krylov(most=12), "modes": Modal()}
    monkeypatch.setattr(reductions, "reducers", lambda: ways)
    arguments = {"bandwidth": 1 / WIDTH, "duration": SPAN, "tolerance": 2e-2}
    greens, modes = greens_function(block, **arguments), greens_function(block, **arguments, method="modes")
    assert greens.origin["method"] == "modes"
    assert "not by krylov: 12 Krylov vectors leave" in greens.origin["reason"]
    assert np.array_equal(greens.omega, modes.omega)
    with pytest.raises(ConvergenceError, match=r"^krylov: 12 Krylov vectors leave .*seat\.greens\.max_vectors"):
        greens_function(block, **arguments, max_vectors=12)
    ways["modes"] = Modal(most=3)
    with pytest.raises(ConvergenceError, match=r"(?s)^krylov: 12 Krylov.*bandwidth.*; modes: .*") as refused:
        greens_function(block, **arguments)
    assert "use method" not in str(refused.value)


@pytest.mark.parametrize("method", ["krylov", "second_order"])
def test_the_number_of_vectors_can_be_given(block, method):
    arguments = {"bandwidth": 1 / WIDTH, "duration": SPAN, "tolerance": 1e-4, "method": method}
    with pytest.raises(ConvergenceError, match=r"(?s)^(12|14) .*max_vectors \(seat\.greens\.max_vectors"):
        greens_function(block, **arguments, max_vectors=12)
    with pytest.raises(ModelError, match="max_vectors = 0"):
        greens_function(block, **arguments, max_vectors=0)


@pytest.mark.parametrize(
    ("method", "mass", "weight", "message"),
    [
        ("auto", 1.0, 1e-300, "port 'contact'"),
        ("krylov", 1.0, 1e200, "port 'contact'"),
        ("modes", 1e250, 1.0, "M"),
        ("krylov", 1e-250, 1.0, "M"),
        ("second_order", 1e250, 1.0, "M"),
        ("transient", 1.0, 1e200, "port 'contact'"),
    ],
)
def test_numbers_beyond_all_measure_are_refused(rod, method, mass, weight, message):
    port = rod.ports["contact"]
    model = SecondOrderModel(as_csr(mass * rod.M), None, rod.K, {"contact": Port(weight * port.vector)})
    with pytest.raises(ModelError, match=rf"^{message}: .*units"):
        greens_function(model, bandwidth=1e5, duration=2e-5, tolerance=2e-2, method=method)


@pytest.mark.slow
@pytest.mark.parametrize("method", ["krylov", "modes"])
def test_a_free_block_keeps_its_rigid_part_exactly(method):
    mesh = skfem.MeshHex.init_tensor(np.linspace(0, 12e-3, 5), np.linspace(0, 11e-3, 4), np.linspace(0, 4e-3, 3))
    free = assemble(
        mesh.with_boundaries(BLOCK_PORTS), STEEL, ports={"left": "left", "right": "right"}, order=2, fixed=()
    )
    rigid = rigid_shapes(free)
    assert rigid.shape[1] == 6
    # six translations and rotations: total mass in the first moments, no energy
    assert np.abs(free.K @ rigid).max() < 1e-9 * np.abs(free.K).max() * np.abs(rigid).max()
    greens = greens_function(free, bandwidth=1.5e5, duration=3e-5, tolerance=3e-2, method=method)
    loose = greens.shapes[greens.omega == 0]
    assert np.sum(greens.omega == 0) == 6
    part = rigid.T @ free.port_matrix
    assert loose.T @ loose == pytest.approx(part.T @ part, rel=1e-12)
    # a push on both patches with equal pressure lifts the block and turns it about y: 1/m + (arm)^2/I by hand
    mass = 7850.0 * 12e-3 * 11e-3 * 4e-3
    inertia = mass / 12 * (np.array([11e-3, 12e-3, 0]) ** 2 + np.array([4e-3, 4e-3, 0]) ** 2)
    arm = 3e-3
    assert (loose.T @ loose)[0, 0] == pytest.approx(1 / mass + arm**2 / inertia[1], rel=1e-9)


SIZES = [*range(10, 90, 10), *(int(80 * 1.125**k) for k in range(1, 14))]
WAVE = np.sin(np.linspace(0, 30, 400))


@pytest.mark.parametrize("order", [2.0, 3.0, 6.0])
def test_slow_algebraic_convergence_is_stated_within_a_factor_of_five(order: float) -> None:
    """The stated error covers the true one of e ~ n^-order, and is at most five times as large later."""
    history, exact = History(1e-3), np.cos(np.linspace(0, 9, 400))
    responses = [exact + 0.1 * (10 / n) ** order * WAVE for n in SIZES]
    stated = np.array([history.add(response, n) for response, n in zip(responses, SIZES, strict=True)])
    true = np.array([np.abs(response - exact).max() / np.abs(response).max() for response in responses])
    is_known = np.isfinite(stated)
    assert is_known.sum() >= len(SIZES) - 3
    assert np.all(true[is_known] <= stated[is_known])
    assert np.all(stated[8:] <= 5 * true[8:])
