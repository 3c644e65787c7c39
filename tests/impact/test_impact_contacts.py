"""Several contacts: the active set against an oracle, symmetry, seats and stoppers, preload."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import nnls

import impact
from impact import Body, Contact, ContactError, ContactProblem, Load, ModalGreens, Residual, measures
from impact.march.laws import Law
from impact.march.loop.marches import active_set, linear_laws, sweep_forces

SEAT = ModalGreens(
    np.array([30.0, 80.0]), np.array([0.1, 0.2]), np.array([[0.7], [0.5]]), Residual.exponential(5e-3, 0.3)
)


def contact_forces(codes, rules, numbers, user, pen, start, w, dt, force) -> bool:  # type: ignore[no-untyped-def]
    """Change the forces of one step without films in place, as `march_many` does; return whether they are solved."""
    if (shifted := linear_laws(codes, rules, numbers, w)) is not None:
        active_set(shifted, pen, force)
        return True
    return bool(sweep_forces(codes, rules, numbers, user, None, None, pen, start, w, dt, force))


def compliance(kind: str, p: int, rng: np.random.Generator) -> np.ndarray:
    """Return (p, p) a symmetric positive definite matrix."""
    if kind == "random":
        shapes = rng.normal(size=(p, 3 * p))
    elif kind == "twins":  # two ports almost at one place
        shapes = rng.normal(size=(p, 3 * p))
        shapes[-1] = shapes[0] + 1e-6 * rng.normal(size=3 * p)
    elif kind == "string":
        return np.minimum.outer(x := np.sort(rng.uniform(0.1, 1.0, p)), x)
    else:  # ten decades of eigenvalues: block exchanges alone cycle
        shapes = np.linalg.qr(rng.normal(size=(p, p)))[0] * np.sqrt(10.0 ** rng.uniform(-10, 0, p))
    return np.asarray(shapes @ shapes.T)


@pytest.mark.parametrize("kind", ["random", "twins", "string", "ten decades"])
@pytest.mark.parametrize("p", [2, 7, 64])
def test_active_set_finds_the_least_squares_force(kind: str, p: int) -> None:
    """N >= 0, W N >= pen, N (W N - pen) = 0 is the minimum of N W N/2 - pen N over N >= 0: nnls of W's root."""
    rng = np.random.default_rng(p)
    condition = 1e10 if kind == "ten decades" else 1e13 if kind == "twins" else 1e6
    for _ in range(20):
        w, pen = compliance(kind, p, rng), rng.normal(size=p)
        warm = np.maximum(rng.normal(size=p), 0.0)
        cold = np.zeros(p)
        active_set(w, pen, cold)
        active_set(w, pen, warm)
        root = np.linalg.cholesky(w + 1e-16 * np.trace(w) * np.eye(p))
        oracle, _ = nnls(root.T, np.linalg.solve(root, pen), maxiter=50 * p)
        energy = [0.5 * x @ w @ x - pen @ x for x in (cold, warm, oracle)]
        # round-off of the terms, which are up to |W| |N| large
        size = np.abs(pen).max() + np.abs(w).max() * cold.max()
        gap = w @ cold - pen
        assert np.all(cold >= 0)
        assert gap.min() >= -1e-12 * size
        assert np.abs(cold * gap).max() <= 1e-12 * size * cold.max()
        # the energy is flat there: its error is that of the oracle's factor, 1e-16 times the condition
        np.testing.assert_allclose(energy[:2], energy[2], rtol=1e-15 * condition)
        if kind != "twins" and kind != "ten decades":
            np.testing.assert_allclose(warm, cold, atol=1e-13 * condition * cold.max(), rtol=0)


@pytest.mark.parametrize("apart", [0.0, 1e-14, 1e-9, 1e-4])
@pytest.mark.parametrize("code", [1, 2])
def test_stiff_contacts_almost_at_one_place_share_the_force_of_one(code: int, apart: float) -> None:
    """Sweeps alone would take k W steps; conserving rule, whose laws are not a linear problem."""
    root = np.array([1.0, 1.0 + apart, 1.0 - apart])
    both = np.outer(root, root)
    ones, numbers = np.ones(3, dtype=np.int64), np.tile([1e8, 0.0, 0.0], (3, 1))
    force, alone = np.zeros(3), np.zeros(1)
    is_solved = contact_forces(code * ones, ones, numbers, None, np.full(3, 1e-3), np.zeros(3), both, 1.0, force)
    thrice = np.array([[3e8, 0.0, 0.0]])
    contact_forces(code * ones[:1], ones[:1], thrice, None, np.full(1, 1e-3), np.zeros(1), both[:1, :1], 1.0, alone)
    assert is_solved
    assert np.all(force >= 0)
    assert force.sum() == pytest.approx(alone[0], rel=1e-9 + 3 * apart)


LAWS: list[Law] = [impact.Signorini(), impact.Hertz(stiffness=300.0), impact.HuntCrossley(stiffness=300.0, damping=0.2)]


@pytest.mark.parametrize("law", LAWS)
def test_two_equal_seats_under_one_mass_are_one_under_half_of_it(law: Law) -> None:
    striker = impact.rigid_mass(mass=2.0, velocity=-1.0)
    both = ContactProblem(striker, contacts=[Contact(Body(SEAT), gap=0.01, law=law) for _ in range(2)])
    half = ContactProblem(impact.rigid_mass(mass=1.0, velocity=-1.0), Body(SEAT), gap=0.01, law=law)
    two, one = (impact.solve(p, dt=1e-3, duration=1.0) for p in (both, half))
    assert one.force.max() > 1.0
    for c in (0, 1):
        np.testing.assert_allclose(two.force[:, c], one.force, atol=1e-11 * one.force.max(), rtol=0)
        np.testing.assert_allclose(two.gap[:, c], one.gap, atol=1e-12, rtol=0)
    np.testing.assert_allclose(two.energy.stored, 2 * one.energy.stored, rtol=1e-10)
    assert measures.total_impulse(two) == pytest.approx(2 * measures.impulse(one), rel=1e-11)


REED = {"young": 2e11, "density": 7850.0, "length": 0.0254, "width": 0.01, "thickness": 0.000305}
PLATE = ModalGreens(np.array([2e5]), np.array([0.1]), np.array([[6.0]]), Residual.exponential(1e-9, 1e-3))


def reed(at: tuple[float, ...] = (0.0254,), **more: object) -> Body:
    return impact.reed(impact.Cantilever(**REED), damping_ratio=0.02, n_modes=12, contact_at=at, **more)  # type: ignore[arg-type]


def pressed(course: object, interference: float = 1e-4, law: Law | None = None) -> ContactProblem:
    closing = Load(-reed().greens.shapes[:, 0], course)  # type: ignore[attr-defined, arg-type]
    body = replace(reed(), loads=(closing,))
    return ContactProblem(body, Body(PLATE), gap=-interference, law=law, preload=True)


@pytest.mark.parametrize("law", [impact.Signorini(), impact.LinearSpring(stiffness=1e6)])
def test_pressed_reed_stays_in_equilibrium(law: Law) -> None:
    """Its force N has N (c_reed + c_seat + 1/k) = interference + F c_reed, with F at the tip."""
    load, interference = 0.05, 1e-4
    result = impact.solve(pressed(lambda t: np.full_like(t, load), interference, law), dt=1e-6, duration=2e-3)
    greens = reed().greens
    c_reed, c_modes = float(greens.static_compliance()[0, 0]), float(np.sum((greens.shapes[:, 0] / greens.omega) ** 2))
    c_rest = float(PLATE.static_compliance()[0, 0]) + (1e-6 if isinstance(law, impact.LinearSpring) else 0.0)
    force = (interference + load * c_modes) / (c_reed + c_rest)  # a Load moves the modes only
    np.testing.assert_allclose(result.force, force, rtol=1e-10)
    # gaps are sums of terms of 1e-4 m; 1e-16 of that over W0 = 1e-3 m/(N s) x 1e-6 s is 1e-11 N under the rigid law
    limit = 1e-10 if isinstance(law, impact.Signorini) else 1e-12
    np.testing.assert_allclose(result.force, result.force[0], rtol=limit)
    assert force == pytest.approx(0.137, rel=0.05)
    assert result.energy.residual < 1e-10
    assert np.ptp(result.energy.stored) < 1e-12 * result.energy.stored[0]


def test_pressed_reed_opens_under_a_later_load_and_comes_back() -> None:
    """A reed pressed by 0.0866 N opens under 0.3 N from 1 to 3 ms, and strikes harder as it returns."""

    def course(t: np.ndarray) -> np.ndarray:
        return np.where((t > 1e-3) & (t < 3e-3), -0.3, 0.0)

    result = impact.solve(pressed(course), dt=1e-6, duration=8e-3)
    c_reed = float(reed().greens.static_compliance()[0, 0])
    before = result.time < 0.999e-3
    np.testing.assert_allclose(result.force[before], 1e-4 / (c_reed + PLATE.static_compliance()[0, 0]), rtol=1e-9)
    opened = result.time[int(np.argmax(result.gap > 1e-7))]
    assert 1e-3 < opened < 1.2e-3
    assert result.gap.max() > 1e-4
    # it returns within a period (2.6 ms) after the load has ended, and strikes harder than it was pressed
    closed = result.force[result.time > 3e-3]
    assert closed.max() > 3 * result.force[0]
    assert result.energy.residual < 1e-10
    assert np.all(np.diff(result.energy.dissipated) >= -1e-12 * result.energy.stored.max())
    assert result.energy.input[-1] != result.energy.input[0]


def test_preload_that_cannot_be_is_refused() -> None:
    free = ContactProblem(impact.rigid_mass(mass=1.0, velocity=0.0), Body(PLATE), preload=True)
    with pytest.raises(ContactError, match="free to move"):
        impact.solve(free, dt=1e-3, duration=1e-2)
    soft = pressed(np.zeros_like, law=impact.Hertz(stiffness=1e9))
    with pytest.raises(ContactError, match="rigid and linear-spring"):
        impact.solve(soft, dt=1e-6, duration=1e-5)
    bent = reed(release=impact.StaticShape(1e-3))
    with pytest.raises(ContactError, match="no initial state"):
        impact.solve(ContactProblem(bent, Body(PLATE), preload=True), dt=1e-6, duration=1e-5)


SEATS = [impact.spring(stiffness=1e6), impact.semi_infinite_rod(young=4.0, density=9.0, area=1.0)]


@pytest.mark.parametrize("seat", SEATS)
@pytest.mark.parametrize("overlap", [1e-4, 3e-3])
def test_the_energy_of_an_overlap_is_put_in(seat: impact.GreensFunction, overlap: float) -> None:
    """Rigid bodies that begin inside each other: what drives them apart is counted, told, and never a gain."""
    ball = impact.rigid_mass(mass=1e-2, velocity=-1.0)
    result = impact.solve(impact.ContactProblem(ball, seat, gap=-overlap), dt=1e-5, duration=1e-2)
    at_rest = 0.5 * 1e-2
    assert result.energy.input[0] == pytest.approx(at_rest, rel=1e-12)
    put_in = float(result.force[1] * overlap)  # the gap closes to zero within the first step
    assert result.energy.input[-1] == pytest.approx(at_rest + put_in, rel=1e-9)
    assert result.energy.residual < 1e-9
    assert result.energy.contact_loss.min() >= -1e-12 * result.energy.input[-1]
    assert np.max(result.energy.stored - result.energy.input) <= 1e-9 * result.energy.input[-1]
    (note,) = (advice for advice in result.advice if "overlap" in advice.name)
    assert note.value == pytest.approx(overlap)
    assert f"{put_in:.3g} J, counted as put in" in note.reason


def oscillator(stiffness: float, load: float) -> impact.Body:
    """Return a unit mass on a soft spring under a steady load."""
    greens = impact.single_mode(frequency_hz=stiffness**0.5 / (2 * np.pi), mass=1.0)
    return impact.Body(greens, loads=(impact.Load(np.array([1.0]), lambda t: np.full(t.shape, load)),))


@pytest.mark.parametrize(("stiffness", "is_told"), [(1e-4, True), (1e2, False)])
def test_a_preload_far_beyond_the_gap_is_told(stiffness: float, is_told: bool) -> None:
    """A gap keeps 2e-11 m of the 1e5 m by which 10 N move 1e-4 N/m; the seat yields 1e-5 m: advice says so."""
    problem = impact.ContactProblem(oscillator(stiffness, -10.0), impact.spring(stiffness=1e6), preload=True)
    result = impact.solve(problem, dt=1e-4, duration=1e-2)
    notes = [advice for advice in result.advice if "round-off of the gap" in advice.name]
    assert bool(notes) is is_told
    if is_told:
        assert notes[0].value == pytest.approx(2.2e-16 * 1e5 / 1e-5, rel=0.1)
        assert "deflected by 1e+05 m" in notes[0].reason
