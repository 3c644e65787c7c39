"""Random passive bodies with one to four contacts under any mix of laws: no energy gained, no pull, no penetration."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import impact
from impact import Body, Contact, ContactProblem, ImpactResult, ModalGreens, ModalState, Residual
from impact.march.laws import Law

pytestmark = pytest.mark.slow
FASTEST = 60.0  # highest angular frequency of the random modes; steps below are in units of 1/FASTEST
SEEDS = st.integers(0, 2**32 - 1)
STEPS = st.floats(-3.0, 1.0).map(lambda exponent: 10.0**exponent)


def body(rng: np.random.Generator, ports: int, moving: bool) -> Body:
    """Draw 1-8 modes from rigid to overdamped at several ports, with a coupled residual that yields at once."""
    n = int(rng.integers(1, 9))
    omega = rng.uniform(0.0, FASTEST, n) * (rng.random(n) > 0.15)
    zeta = rng.choice([0.0, 0.01, 0.1, 1.0, 2.0], n)
    root = rng.normal(size=(ports, ports)) * 0.2
    compliance, start = root @ root.T + 1e-3 * np.eye(ports), np.diag(rng.uniform(0.05, 2.0, ports))
    dashpots = Residual(np.diag(rng.uniform(0.1, 2.0, ports)), np.zeros(ports), np.zeros((ports, ports)))
    kinds = [Residual.exponential(compliance, start), Residual.spring(compliance), dashpots]
    residual = kinds[int(rng.choice(3, p=[0.5, 0.3, 0.2]))]
    names = tuple(f"p{i}" for i in range(ports))
    shapes = rng.normal(size=(n, ports))
    if ports > 1 and rng.random() < 0.3:  # two ports almost at one place
        shapes[:, 1] = shapes[:, 0] * (1 + 1e-7)
    state = ModalState(rng.normal(size=n) / (1 + omega), rng.normal(size=n)) if moving else None
    return Body(ModalGreens(omega, zeta, shapes, residual, port_names=names), state=state)


def law(rng: np.random.Generator, with_potential: bool = False) -> Law:
    k = float(10.0 ** rng.uniform(0, 5))
    laws: list[Law] = [impact.LinearSpring(stiffness=k), impact.Hertz(stiffness=k)]
    laws.append(impact.HertzOnPatch(stiffness=k, local=10.0 ** rng.uniform(-1, 2) / k))
    if not with_potential:
        laws.append(impact.Signorini())
        laws.append(impact.HuntCrossley(stiffness=k, damping=rng.uniform(0, 2), exponent=rng.uniform(1, 3)))
        laws.append(impact.HertzOnPatch(stiffness=k, local=1.0 / k, damping=rng.uniform(0, 2)))
    return laws[int(rng.integers(0, len(laws)))]


def problem(seed: int, with_potential: bool = False) -> ContactProblem:
    """Draw a moving striker over ports of one target and stoppers of others, all open by 0.01 at the start."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 5))
    striker, shared = body(rng, count, moving=True), body(rng, count, moving=False)
    start = striker.modal_start().displacement @ striker.greens.shapes  # type: ignore[attr-defined]
    contacts = []
    for c in range(count):
        side = int(rng.choice([1, -1]))
        target, port = (shared, c) if rng.random() < 0.6 else (body(rng, 1, moving=False), 0)
        gap = 0.01 - side * float(start[c])
        contacts.append(Contact(target, port=port, gap=gap, law=law(rng, with_potential), side=side, striker_port=c))
    return ContactProblem(striker, contacts=contacts)


def collide(posed: ContactProblem, step: float, steps: int, rule: str = "passive") -> ImpactResult:
    return impact.solve(posed, dt=step / FASTEST, duration=steps * step / FASTEST, rule=rule)


@settings(max_examples=60, deadline=None)
@given(seed=SEEDS, step=STEPS)
def test_energy_never_grows_whatever_the_contacts(seed: int, step: float) -> None:
    result = collide(problem(seed), step, 300)
    energy = result.energy
    largest = energy.stored.max()
    assert np.all(result.force >= 0)
    assert np.all(np.isfinite(result.force))
    assert np.all(np.diff(energy.stored) <= 1e-11 * largest)
    assert np.all(np.diff(energy.dissipated) >= -1e-11 * largest)
    assert np.all(np.diff(energy.contact_loss) >= -1e-11 * largest)
    assert energy.residual < 1e-10


@settings(max_examples=40, deadline=None)
@given(seed=SEEDS, step=STEPS)
def test_conserving_contacts_lose_nothing(seed: int, step: float) -> None:
    """Contacts lose no energy; only the damped bodies do."""
    result = collide(problem(seed, with_potential=True), step, 200, rule="conserving")
    largest = result.energy.stored.max()
    assert np.all(result.force >= 0)
    assert np.abs(result.energy.contact_loss).max() <= 1e-9 * largest
    assert np.all(np.diff(result.energy.stored) <= 1e-9 * largest)


@settings(max_examples=40, deadline=None)
@given(
    seed=SEEDS,
    steps=st.integers(3, 60),
    end=st.sampled_from([0.0, 0.3, 1.0, 4.0, np.inf]),
    damping_ratio=st.sampled_from([0.0, 0.05, 0.5]),
)
def test_ledger_closes_on_rods(seed: int, steps: int, end: float, damping_ratio: float) -> None:
    """Energy balances for waves on a reflecting rod and poles of a damped one, struck by a random body."""
    rng = np.random.default_rng(seed)
    rod = {"young": 1.0, "density": 1.0, "area": 1.0, "length": 1.0}
    if damping_ratio > 0:
        greens = impact.fixed_rod(**rod, damping_ratio=damping_ratio)
    else:
        greens = impact.rod_with_end_impedance(**rod, end_impedance=end)
    striker = body(rng, 1, moving=True)
    start = striker.modal_start().displacement @ striker.greens.shapes  # type: ignore[attr-defined]
    posed = ContactProblem(striker, Body(greens), gap=0.01 - float(start[0]), law=law(rng))
    result = impact.solve(posed, dt=2.0 / steps, duration=300 * 2.0 / steps)
    assert result.energy.by_work == ()
    assert result.energy.residual < 1e-10
    assert np.all(np.diff(result.energy.stored) <= 1e-11 * result.energy.stored.max())
