"""Laws of joints: loops in closed form, never a gain of energy, slopes, the march with them, and what is refused."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import impact
from impact.march.laws import BLENDED, CONSERVING, DEEPEST, PASSIVE, LawError, deepest_so_far
from impact.march.loop.joints import joint_force, joint_step, joint_stiffness, update_deepest
from impact.march.stepper import march_numbers

ROUGH = impact.RoughJoint(stiffness=3.0, exponent=2.0, recovery=0.4)
TABLE = impact.TableJoint(closures=(0.5, 1.0, 2.0), loading=(0.5, 2.0, 8.0), unloading=(0.0, 0.0, 8.0))
RULES = {PASSIVE: "passive", CONSERVING: "conserving", BLENDED: "blended"}


def path(law: impact.Law, closures: np.ndarray) -> np.ndarray:
    """Return the forces (n,) of a law that is closed so, quasi-statically."""
    numbers, out = march_numbers([law.parameters]), np.zeros(len(closures))
    for n, pen in enumerate(closures):
        out[n] = joint_force(law.code, numbers, 0, pen)
        update_deepest(numbers, 0, pen)
    return out


def test_unloading_is_the_loading_branch_drawn_together() -> None:
    """Rough faces unload and reload from m on by N = k ((pen - (1 - r) m)/r)^n, go on beyond m as if never unloaded,
    and are new once opened."""
    closures = np.array([0.5, 1.0, 0.9, 0.65, 0.5, 0.9, 1.2, 0.0, 0.5])
    force = path(ROUGH, closures)
    expected = [0.75, 3.0, 3 * 0.75**2, 3 * 0.125**2, 0.0, 3 * 0.75**2, 3 * 1.2**2, 0.0, 0.75]
    np.testing.assert_allclose(force, expected, rtol=1e-14, atol=1e-15)
    np.testing.assert_allclose(deepest_so_far(closures), [0.5, 1, 1, 1, 1, 1, 1.2, 0, 0.5])


def test_a_table_of_a_curve_becomes_that_law_at_second_order() -> None:
    """Tables of ROUGH with ever more rows reach its forces, also after a partial load, at second order."""
    turns, errors = (0.0, 0.83, 0.6, 0.95, 0.6), []
    closures = np.concatenate([np.linspace(*pair, 500) for pair in itertools.pairwise(turns)])
    exact = path(ROUGH, closures)
    for rows in (20, 40, 80):
        pen = np.linspace(0.0, 1.0, rows + 1)
        down = 3.0 * (np.maximum(pen - 0.6, 0.0) / 0.4) ** 2
        law = impact.TableJoint(tuple(pen), tuple(3.0 * pen**2), tuple(down))
        errors.append(np.abs(path(law, closures) - exact).max())
    assert errors[2] < 2e-3
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx(2.0, abs=0.1)


def random_joint(rng: np.random.Generator) -> impact.Law:
    if rng.random() < 0.5:
        return impact.RoughJoint(10.0 ** rng.uniform(-2, 4), rng.uniform(1, 4), rng.uniform(0.05, 1))
    rows = int(rng.integers(2, 9))
    pen, up = np.cumsum(rng.uniform(0.1, 1, rows)), np.cumsum(rng.uniform(0.1, 1, rows))
    share = rng.uniform(0.1, 1, rows)  # of each piece of the closure comes back, at the same forces
    back = np.cumsum(share * np.diff(np.append(0.0, pen)))
    stays = pen[-1] - back[-1]
    grid = np.unique(np.concatenate([pen, back + stays, [stays]]))
    grid = grid[grid > 0]
    loading = np.interp(grid, np.append(0.0, pen), np.append(0.0, up))
    unloading = np.interp(grid, np.append(stays, back + stays), np.append(0.0, up))
    unloading[-1] = loading[-1]
    keep = np.append(np.diff(grid) > 1e-6, True)
    return impact.TableJoint(tuple(grid[keep]), tuple(loading[keep]), tuple(unloading[keep]))


@settings(max_examples=80, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_no_history_of_steps_gains_energy(seed: int) -> None:
    """Each of 40 random steps by each rule has N (end - start) >= dPsi, with equality by the conserving one below the
    deepest closure, and the work from an open start is not negative."""
    rng = np.random.default_rng(seed)
    law, w0, aims = random_joint(rng), 10.0 ** rng.uniform(-6, 2), rng.uniform(-0.5, 3, 40)
    for rule in RULES:
        numbers, start, ends, forces = march_numbers([law.parameters]), 0.0, [0.0], []
        for aim in aims:
            force = joint_step(law.code, rule, numbers, 0, aim, start, w0, w0, 1.0)
            start = aim - w0 * force
            update_deepest(numbers, 0, start)
            ends.append(start)
            forces.append(force)
        closures, work = np.array(ends), np.array(forces) * np.diff(ends)
        psi = law.potential(closures)
        round_off = 1e-12 * (psi.max() + np.abs(work).max())
        assert min(forces) >= 0
        assert np.all(np.diff(psi) <= work + round_off)
        assert np.cumsum(work).min() >= -round_off * len(aims)
        if rule == CONSERVING:
            deepest = deepest_so_far(closures)
            within = (deepest[1:] == deepest[:-1]) & (deepest[1:] > 0)
            np.testing.assert_allclose(work[within], np.diff(psi)[within], atol=round_off)


@pytest.mark.parametrize("law", [ROUGH, TABLE])
@pytest.mark.parametrize("pen", [0.3, 0.77, 1.6, 1.45])
def test_stiffness_is_the_slope_of_the_force(law: impact.Law, pen: float) -> None:
    """The stiffness is the force's difference quotient on loading and below a closure of 1.5; rough faces have 6 x."""
    for deepest in (0.0, 1.5):
        numbers = march_numbers([law.parameters])
        numbers[0, DEEPEST] = deepest
        force = [joint_force(law.code, numbers, 0, pen + d) for d in (-1e-6, 1e-6)]
        slope = joint_stiffness(law.code, numbers, 0, pen)
        assert slope == pytest.approx((force[1] - force[0]) / 2e-6, rel=1e-5, abs=1e-9)
        if law is ROUGH and pen > max(deepest, 0.9):
            assert slope == pytest.approx(6 * pen, rel=1e-14)


def struck(law: impact.Law, dt: float, rule: str) -> impact.ImpactResult:
    mass = impact.rigid_mass(mass=1.0, velocity=-1.0)
    rigid = impact.spring(stiffness=1e12)
    return impact.solve(impact.ContactProblem(mass, rigid, law=law), dt=dt, duration=4.0, rule=rule)


@pytest.mark.parametrize(("law", "part"), [(ROUGH, 0.4), (impact.TableJoint((1.0, 2.0), (4.0, 8.0), (0.0, 8.0)), 0.5)])
def test_a_mass_rebounds_with_the_energy_that_comes_back(law: impact.Law, part: float) -> None:
    """e^2 = r of rough faces, whatever the exponent and the speed; of a table with half its closure 1/2. The conserving
    rule is of second order, but for where branches meet within a step; the passive one of first."""
    conserving, passive = (
        [impact.measures.restitution(struck(law, dt, rule)) ** 2 - part for dt in (4e-3, 2e-3, 1e-3, 5e-4)]
        for rule in ("conserving", "passive")
    )
    assert abs(conserving[-1]) < 1e-5 * part < 0.03 * part
    assert np.log2(passive[0] / passive[-1]) / 3 == pytest.approx(1.0, abs=0.1)
    assert np.log2(abs(conserving[0] / conserving[-1])) / 3 > 1.7


def test_the_ledger_books_the_loop_as_lost_in_the_contact() -> None:
    result = struck(ROUGH, 1e-3, "blended")
    assert result.energy.residual < 1e-11
    assert result.energy.contact_loss[-1] == pytest.approx(0.6 * 0.5, rel=1e-5)
    assert np.diff(result.energy.contact_loss).min() > -1e-14


def test_a_joint_closed_beyond_its_table_is_told() -> None:
    short = impact.TableJoint(closures=(0.1, 0.2), loading=(0.1, 0.5), unloading=(0.0, 0.5))
    (note,) = struck(short, 1e-3, "auto").advice
    assert note.name.startswith("closure of contact 0 ")
    assert note.value == pytest.approx(np.max(-struck(short, 1e-3, "auto").gap) / 0.2)
    assert not struck(TABLE, 1e-3, "auto").advice


@pytest.mark.slow
def test_one_contact_many_and_lanes_march_alike() -> None:
    """One joint, its two halves on one port, and 20 scenes side by side have the same forces."""
    rod = impact.free_rod(young=4.0, density=1.0, area=3.0, length=2.0)
    mass = impact.rigid_mass(mass=1.0, velocity=-1.0)
    half = impact.RoughJoint(stiffness=1.5, exponent=2.0, recovery=0.4)
    one = impact.solve(impact.ContactProblem(mass, rod, law=ROUGH), dt=1e-2, duration=6.0)
    seat = impact.Body(rod)
    halves = [impact.Contact(seat, law=half), impact.Contact(seat, law=half)]
    two = impact.solve(impact.ContactProblem(mass, contacts=halves), dt=1e-2, duration=6.0)
    np.testing.assert_allclose(two.force.sum(axis=1), one.force, atol=1e-9 * one.force.max())
    spring = impact.single_mode(frequency_hz=0.3, mass=1.0)
    problem = impact.ContactProblem(mass, spring, gap=-0.01, law=ROUGH)
    alone = impact.solve(problem, dt=1e-2, duration=6.0)
    many = impact.solve_many(problem, dt=1e-2, duration=6.0, gaps=np.linspace(-0.01, 0.2, 20), record="force")
    np.testing.assert_allclose(many.force[0], alone.force, atol=1e-12 * alone.force.max())


def test_a_march_goes_on_from_a_checkpoint_in_the_middle_of_unloading() -> None:
    problem = impact.ContactProblem(impact.rigid_mass(mass=1.0, velocity=-1.0), impact.spring(stiffness=1e3), law=TABLE)
    prepared = impact.prepare(problem, 1e-2, 4.0)
    whole = impact.ContactStepper(prepared)
    whole.advance(400)
    turn = int(np.argmax(whole.force[:, 0])) + 5
    first, second = impact.ContactStepper(prepared), impact.ContactStepper(prepared)
    first.advance(turn)
    second.restore(first.checkpoint())
    second.advance(400)
    assert whole.force[turn + 3, 0] > 0
    np.testing.assert_array_equal(second.force, whole.force)


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: impact.RoughJoint(stiffness=1.0, recovery=1.2), r"recovery = 1.2.*\(0, 1\]"),
        (lambda: impact.RoughJoint(stiffness=1.0, exponent=0.5), "exponent = 0.5 must be >= 1"),
        (lambda: impact.RoughJoint.through(force=1.0, closure=0.0), "closure = 0 m"),
        (lambda: impact.TableJoint((0.0, 1.0), (0.0, 1.0), (0.5, 1.0)), "row 1 .*force"),
        (lambda: impact.TableJoint((0.0, 1.0, 1.0), (0.0, 1.0, 2.0), (0.0, 0.0, 2.0)), "row 3 does not"),
        (lambda: impact.TableJoint((1.0, 2.0), (1.0, 2.0), (0.0, 1.9)), "one force in both columns"),
        (lambda: impact.TableJoint((1.0, 2.0, 3.0), (1.0, 4.0, 9.0), (0.5, 6.0, 9.0)), "softer than it was loaded"),
        (lambda: impact.TableJoint((1.0, 2.0, 3.0), (1.0, 4.0, 9.0), (0.5, 0.0, 9.0)), "at 2 m it does not"),
        (lambda: impact.TableJoint((1.0,), (1.0,), (1.0,)), "1 closures"),
    ],
)
def test_impossible_joints_are_refused(make: object, words: str) -> None:
    with pytest.raises(LawError, match=words):
        make()  # type: ignore[operator]


def test_a_film_beside_a_joint_is_refused() -> None:
    film = impact.SqueezeFilm(coefficient=1e-9, floor=1e-6)
    with pytest.raises(impact.ContactError, match="a film beside a RoughJoint"):
        impact.Contact(impact.Body(impact.spring(stiffness=1.0)), law=ROUGH, film=film)


@pytest.mark.parametrize("law", [ROUGH, TABLE])
def test_the_static_closure_is_that_of_the_loading_branch(law: impact.Law) -> None:
    """A force's closure is the one that loads to it, beyond the table too; half the joint needs half the force."""
    closures = np.array([0.2, 0.7, 1.3, 2.5])
    forces = path(law, closures)
    np.testing.assert_allclose([law.closure(force) for force in forces], closures, rtol=1e-12)
    if isinstance(law, impact.TableJoint):
        np.testing.assert_allclose([law.scaled(0.5).closure(force / 2) for force in forces], closures, rtol=1e-12)
