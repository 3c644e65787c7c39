"""Block Lanczos about shifts inside the spectrum: complete whatever repeats, crowds or coincides."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
import skfem

from seatfem.structures.elements.assembly import assemble
from seatfem.structures.model import ModelError, SecondOrderModel
from seatfem.structures.reduction import eigen_search, spectrum
from seatfem.structures.reduction.eigen_search import ConvergenceError, Shift, counting_shift
from seatfem.structures.reduction.factorization import FactorizationError
from seatfem.structures.reduction.modes import solve_modes
from seatfem.structures.reduction.spectrum import Spectrum

N = 700  # above what LAPACK would take
STEEL = {"young": 200e9, "poisson": 0.3, "density": 7850.0}


def pencil(values, seed=0):
    """Return dense K and M with the eigenvalues ``values``: M = L L' a random positive matrix, K = L Q diag Q' L'."""
    rng = np.random.default_rng(seed)
    n = len(values)
    lower = np.tril(rng.normal(size=(n, n)) * 0.3 / np.sqrt(n), -1) + np.diag(rng.uniform(0.7, 1.4, n))
    turn, _ = np.linalg.qr(rng.normal(size=(n, n)))
    root = lower @ turn
    K = root * values @ root.T
    M = lower @ lower.T
    return SecondOrderModel((M + M.T) / 2, None, (K + K.T) / 2, {})


SPECTRA = {
    "spread": np.linspace(1.0, 300.0, N) ** 2,
    "tenfold": np.concatenate([[2.0], np.full(10, 5.0), [7.0, 8.0], np.linspace(9.0, 1000.0, N - 13)]),
    "clusters": np.sort(
        np.concatenate([5.0 + 1e-9 * np.arange(6), 6.0 + 1e-6 * np.arange(5), np.linspace(6.5, 900.0, N - 11)])
    ),
    "one": np.concatenate([[1e-6], np.linspace(10.0, 1e5, N - 1)]),
}


@pytest.mark.slow
@pytest.mark.parametrize(("name", "backend"), [*((name, "auto") for name in SPECTRA), ("clusters", "superlu")])
def test_random_pencils_are_solved_whole(name, backend):
    values = SPECTRA[name]
    modes = solve_modes(pencil(values), 16, backend=backend)
    assert modes.complete
    # round-off of a dense K of norm max(values) is eps of that, some ten times over
    assert modes.omega**2 == pytest.approx(values[:16], rel=1e-9, abs=20 * 2.2e-16 * values.max())
    assert np.array_equal(modes.shapes, solve_modes(pencil(values), 16, backend=backend).shapes)


@pytest.mark.slow
def test_all_below_a_frequency():
    values, model, limit = SPECTRA["tenfold"], pencil(SPECTRA["tenfold"]), 8.5
    modes = solve_modes(model, up_to_hz=np.sqrt(limit) / (2 * np.pi))
    assert modes.complete
    assert len(modes.omega) == np.sum(values < limit)
    assert len(solve_modes(model, 3, up_to_hz=np.sqrt(limit) / (2 * np.pi)).omega) == 3


@pytest.mark.slow
def test_a_shift_that_is_an_eigenvalue_is_moved():
    values = SPECTRA["spread"]
    model = pencil(values)
    lanczos = Spectrum(model)
    lanczos.below(float(values[20]))
    assert len(lanczos.values) in (20, 21)  # it may fall on either side
    assert lanczos.top != values[20]
    for k in (3, 11):
        start = Spectrum(model)
        shift, _ = start._started(counting_shift(model, float(values[k]), "auto"), 16)
        # 1/|theta sigma| > 1e-8 leaves half of the digits
        assert np.abs(values / shift.value - 1).min() > 1e-8
        assert shift.count == np.sum(values < shift.value)


@pytest.fixture(scope="module")
def square_block():
    mesh = skfem.MeshHex.init_tensor(*(np.linspace(0, a, n) for a, n in ((1e-2, 5), (1e-2, 5), (4e-3, 4))))
    named = mesh.with_boundaries({"fixed": lambda x: x[2] < 1e-9, "contact": lambda x: x[2] > 4e-3 - 1e-9})
    return named


@pytest.mark.slow
@pytest.mark.parametrize(("fixed", "known"), [((), True), ((), False), ("fixed", True)])
def test_double_and_rigid_modes_of_a_square_block(square_block, fixed, known):
    model = assemble(square_block, STEEL, fixed=fixed, order=2)
    if not known:
        model = replace(model, dofs=None)
    exact = scipy.linalg.eigvalsh(model.K.toarray(), model.M.toarray())[:30]
    modes = solve_modes(model, 30)
    assert modes.complete
    rigid = 0 if fixed else 6
    assert np.all(modes.frequencies_hz[:rigid] == 0.0)
    assert modes.frequencies_hz[rigid:] == pytest.approx(np.sqrt(exact[rigid:]) / (2 * np.pi), rel=1e-9)
    assert np.sum(np.diff(modes.omega[rigid:]) < 1e-9 * modes.omega[rigid:-1]) >= 4  # pairs by symmetry
    assert modes.residuals.max() < 1e-6  # errors of 1e-8, with what is left of high modes weighted by their w^2


@pytest.mark.slow
def test_it_says_so_where_nothing_counts(square_block, monkeypatch):
    model = assemble(square_block, STEEL, fixed="fixed", order=2)

    def blind(matrix, **named):
        raise FactorizationError("a pivot on the diagonal is zero")

    monkeypatch.setattr(eigen_search, "factorize", blind)
    with pytest.raises(ConvergenceError, match=r"no factorization near .* check their units"):
        solve_modes(model, 10)


@pytest.mark.slow
def test_a_mode_that_inertia_counts_and_nobody_finds_is_an_error(monkeypatch):
    """One pivot too many is counted everywhere: the search goes on, and ends in words."""
    model = pencil(SPECTRA["spread"])

    def lying(model, value, backend):
        true = counting_shift(model, value, backend)
        return Shift(true.value, true.count + 1, true.factor)

    monkeypatch.setattr(spectrum, "counting_shift", lying)
    with pytest.raises(ConvergenceError, match=r"counted|solves leave an error"):
        Spectrum(model).first(8)


def test_unusable_requests(square_block):
    model = assemble(square_block, STEEL, fixed="fixed", order=2)
    for arguments, message in (
        ({"n": 0}, "n = 0"),
        ({"up_to_hz": -1.0}, "up_to_hz = -1.0"),
        ({"shift_hz": np.nan}, "shift_hz = nan"),
    ):
        with pytest.raises(ModelError, match=message):
            solve_modes(model, **arguments)
    with pytest.raises(ConvergenceError, match=r"modes .*\(limit 5\)"):
        Spectrum(model).below((2 * np.pi * 1e6) ** 2, 5)
    assert len(solve_modes(model, up_to_hz=1.0).omega) == 0
