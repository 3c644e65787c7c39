"""Energy of the passive march for random bodies, laws and steps: nothing is gained, everything is accounted for."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

import impact
from impact import Body, ContactProblem, ImpactResult, ModalGreens, ModalState, Residual
from impact.march.laws import Law

FASTEST = 60.0  # highest angular frequency of the random modes; steps below are in units of 1/FASTEST


def modal_body(rng: np.random.Generator, moving: bool, port: bool) -> Body:
    """1-12 modes from rigid to overdamped; a residual of each kind, or none where the port allows."""
    n = int(rng.integers(1, 13))
    omega = rng.uniform(0.0, FASTEST, n) * (rng.random(n) > 0.15)
    zeta = rng.choice([0.0, 0.01, 0.1, 0.7, 1.0, 2.0], n)
    shapes = rng.normal(size=(n, 1))
    residual = [
        Residual.exponential(rng.uniform(1e-3, 1.0), rng.uniform(0.05, 5.0)),
        Residual.spring(rng.uniform(1e-3, 1.0)),
        Residual(np.array([[rng.uniform(0.1, 2.0)]]), np.zeros(1), np.zeros((1, 1))),
        Residual.none(),
    ][int(rng.integers(0, 3 if port else 4))]
    state = ModalState(rng.normal(size=n) / (1 + omega), rng.normal(size=n)) if moving else None
    return Body(ModalGreens(omega, zeta, shapes, residual), state=state)


def law(rng: np.random.Generator) -> Law:
    stiffness = float(10.0 ** rng.uniform(0, 5))
    return [impact.Signorini(), impact.LinearSpring(stiffness=stiffness), impact.Hertz(stiffness=stiffness)][
        int(rng.integers(0, 3))
    ]


def start_gap(striker: Body) -> float:
    """Bodies that do not overlap at the start: an overlap would be energy that a rigid law does not know."""
    start = striker.modal_start().displacement @ striker.greens.shapes[:, 0]  # type: ignore[attr-defined]
    return 0.01 - float(start)


def collide(seed: int, step: float) -> tuple[ContactProblem, ImpactResult]:
    rng = np.random.default_rng(seed)
    striker, target = modal_body(rng, moving=True, port=True), modal_body(rng, moving=False, port=False)
    problem = ContactProblem(striker, target, gap=start_gap(striker), law=law(rng))
    return problem, impact.solve(problem, dt=step / FASTEST, duration=600 * step / FASTEST)


SEEDS = st.integers(0, 2**32 - 1)
STEPS = st.floats(-3.0, 1.0).map(lambda exponent: 10.0**exponent)


@settings(max_examples=150, deadline=None)
@given(seed=SEEDS, step=STEPS)
def test_energy_never_grows_and_every_part_is_accounted_for(seed: int, step: float) -> None:
    _, result = collide(seed, step)
    energy = result.energy
    largest = energy.stored.max()
    assert np.all(result.force >= 0)
    assert np.all(np.diff(energy.stored) <= 1e-12 * largest)
    # both losses are integrals of squares, each on its own
    assert np.all(np.diff(energy.dissipated) >= -1e-12 * largest)
    assert np.all(np.diff(energy.contact_loss) >= -1e-12 * largest)
    # each of 600 steps rounds terms as large as the largest energy
    assert energy.residual < 1e-10


@settings(max_examples=40, deadline=None)
@given(
    seed=SEEDS,
    steps=st.integers(3, 60),
    end=st.sampled_from([0.0, 0.3, 1.0, 4.0, np.inf]),
    damping_ratio=st.sampled_from([0.0, 0.05, 0.5]),
)
def test_ledger_closes_on_rods(seed: int, steps: int, end: float, damping_ratio: float) -> None:
    """Waves on a reflecting rod and poles of a damped one, struck by a random modal body."""
    rng = np.random.default_rng(seed)
    rod = {"young": 1.0, "density": 1.0, "area": 1.0, "length": 1.0}
    if damping_ratio > 0:
        greens = impact.fixed_rod(**rod, damping_ratio=damping_ratio)
    else:
        greens = impact.rod_with_end_impedance(**rod, end_impedance=end)
    striker = modal_body(rng, moving=True, port=False)
    problem = ContactProblem(striker, Body(greens), gap=start_gap(striker), law=law(rng))
    result = impact.solve(problem, dt=2.0 / steps, duration=300 * 2.0 / steps)
    assert result.energy.by_work == ()
    assert result.energy.residual < 1e-10
    assert np.all(np.diff(result.energy.stored) <= 1e-11 * result.energy.stored.max())
