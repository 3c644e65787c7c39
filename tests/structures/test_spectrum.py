"""Modes by block Lanczos: complete whatever repeats or crowds; of thin bodies; even and odd ones of plates."""

import math
from dataclasses import replace
from typing import Final

import numpy as np
import pytest
import scipy.linalg
import skfem

from seatfem.structures import sheets
from seatfem.structures.reduction import spectrum
from seatfem.structures.reduction.eigen_search import ConvergenceError, Shift, counting_shift, null_limit
from seatfem.structures.reduction.modes import modes_by_parity, solve_modes
from seatfem.structures.reduction.spectrum import Spectrum
from seatfem.structures.shapes.flat import Disc, Flapper, Flat
from tests.solids import Material, ModelError, SecondOrderModel, assemble

N = 700  # above what LAPACK would take
STEEL = Material(200e9, 0.3, 7850.0)


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


RADIUS = 10e-3
TWO_DIAMETERS, ONE_CIRCLE = 5.358, 9.003  # lambda^2 of the free disc, nu = 0.3 (Itao & Crandall, J. Appl. Mech. 1979)


@pytest.mark.slow
def test_free_thin_disc_has_six_rigid_modes_and_kirchhoffs_frequencies():
    """Without known rigid shapes they are told from bending by round-off alone. The thickness is 0.005 times the
    radius, in one layer of hexahedra, six across."""
    x = np.linspace(-1, 1, 7)
    square = skfem.MeshHex.init_tensor(x, x, np.array([0.0, 0.005 * RADIUS]))
    x, y, z = square.p
    round_ = np.stack([RADIUS * x * np.sqrt(1 - y**2 / 2), RADIUS * y * np.sqrt(1 - x**2 / 2), z])
    thin = assemble(skfem.MeshHex(round_, square.t), STEEL, fixed=(), ports={}, order=2)
    modes, unknown = (solve_modes(each, 9) for each in (thin, replace(thin, dofs=None)))
    assert modes.complete
    assert np.all(modes.frequencies_hz[:6] == 0.0)
    assert np.all(unknown.frequencies_hz[:6] == 0.0)
    # six straight elements across: the dodecagon's area is 4.5 % small, so the frequencies lie up to that much above
    kirchhoff = 0.005 / RADIUS * math.sqrt(STEEL.young / (12 * (1 - STEEL.poisson**2) * STEEL.density))  # w/lambda^2
    excess = modes.omega[6:] / kirchhoff / np.array([TWO_DIAMETERS, TWO_DIAMETERS, ONE_CIRCLE]) - 1
    assert np.all((excess > 0) & (excess < 0.045))
    assert unknown.frequencies_hz[6:] == pytest.approx(modes.frequencies_hz[6:], rel=1e-4)


def held_column(height):
    """Return a column between smooth walls, clamped below; its lowest tetrahedra are ``height`` times as high."""
    mesh = skfem.MeshTet.init_tensor(*(np.linspace(0, 1, n + 1) for n in (2, 2, 3)))
    points = mesh.p.copy()
    points[2, np.isclose(points[2], 1 / 3)] *= height
    mesh = skfem.MeshTet(points, mesh.t).with_boundaries(
        {"fixed": lambda x: x[2] < 1e-12, "top": lambda x: x[2] > 1 - 1e-9}
        | {f"side {i}{e}": lambda x, i=i, e=e: np.abs(x[i] - e) < 1e-9 for i in (0, 1) for e in (0, 1)}
    )
    sides = [f"side {i}{e}" for i in (0, 1) for e in (0, 1)]
    return assemble(mesh, Material(1.0, 0.3, 1.0), fixed="fixed", sliding=sides, ports={"contact": "top"}, order=2)


@pytest.mark.parametrize("height", [1e-4, 1e-6, 1e-8])
def test_one_layer_of_flat_elements_turns_no_mode_of_a_held_body_into_a_rigid_one(height):
    """It raises max K/M, hence the limit, far beyond the lowest w^2 = (pi/2)^2 (lambda + 2 mu)."""
    model = held_column(height)
    lam, mu = Material(1.0, 0.3, 1.0).lame
    assert (null_limit(model) > (math.pi / 2) ** 2 * (lam + 2 * mu)) == (height < 1e-6)
    assert solve_modes(model, 1).omega[0] == pytest.approx(math.pi / 2 * math.sqrt(lam + 2 * mu), rel=1e-3)


SPRING_STEEL: Final = Material(206e9, 0.3, 7800.0)
SHAPES: Final = (
    Flapper(thickness=0.3e-3, root_width=8e-3, taper_length=2e-3, neck_width=6e-3, neck_length=15e-3,
            paddle_diameter=16e-3),
    Disc(thickness=0.5e-3, diameter=20e-3),
)  # fmt: skip


@pytest.mark.parametrize("shape", SHAPES, ids=lambda each: type(each).__name__)
def test_even_and_odd_modes_are_all_modes(shape: Flat) -> None:
    """Frequencies are those of the whole plate, shapes solve its equations, and each is even or odd."""
    plate = sheets.plate_modes(sheets.Sheet(shape, SPRING_STEEL, 30e3))
    whole = solve_modes(plate.model, up_to_hz=sheets.CUTOFF * 30e3)
    own = plate.modes
    elastic = own.omega > 0
    assert own.frequencies_hz[elastic] == pytest.approx(whole.frequencies_hz[whole.omega > 0], rel=1e-7)
    assert int(np.sum(~elastic)) == int(np.sum(whole.omega == 0)) == (0 if shape.is_clamped else 3)
    gram = own.shapes.T @ (plate.model.M @ own.shapes)
    assert np.abs(gram - np.eye(len(gram))).max() < 1e-6
    left = plate.model.K @ own.shapes - plate.model.M @ own.shapes * own.omega**2
    assert np.abs(left).max() < 1e-5 * np.abs(plate.model.K @ own.shapes).max()
    middle = plate.mesh.points[:, 1] == 0
    for shape_of_mode in own.shapes.T:
        full = np.zeros((len(plate.mesh.points), 3))
        full.ravel()[plate.dofs.free] = shape_of_mode
        bent, turned = np.abs(full[middle, 0]).max(), np.abs(full[middle, 2]).max()
        assert min(bent, turned) == 0  # an odd mode has w = 0 there, an even one no slope across


def test_no_mode_within_a_band_is_computed_again() -> None:
    """Modes of a wider band begin with those of the narrower one, and are those that are found without them."""
    sheet = sheets.Sheet(SHAPES[0], SPRING_STEEL, 30e3)
    plate = sheets.plate_modes(sheet)
    known = sheets.CUTOFF * 30e3, plate.modes
    wide = modes_by_parity(plate.model, plate.mesh.points, up_to_hz=2 * known[0], known=known)
    fresh = modes_by_parity(plate.model, plate.mesh.points, up_to_hz=2 * known[0])
    assert wide.frequencies_hz == pytest.approx(fresh.frequencies_hz, rel=1e-7)
    assert wide.solves < 0.8 * fresh.solves
    beyond = sheets.solve_in_wider_band(plate)
    assert beyond is not None
    assert np.array_equal(beyond[0].mesh.points, plate.mesh.points)
    assert np.array_equal(beyond[0].mesh.cells, plate.mesh.cells)
    assert beyond[0].sheet == replace(sheet, bandwidth=beyond[1] * 30e3)


def test_a_plate_without_symmetry_has_its_modes_at_once() -> None:
    """A mesh that is moved off the line y = 0 has no even and odd modes, and the same frequencies."""
    plate = sheets.plate_modes(sheets.Sheet(SHAPES[0], SPRING_STEEL, 10e3))
    at_once = modes_by_parity(plate.model, plate.mesh.points + np.array([0.0, 1e-3]), up_to_hz=30e3)
    assert at_once.frequencies_hz == pytest.approx(plate.modes.frequencies_hz, rel=1e-7)
