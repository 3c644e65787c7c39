"""Derivatives of a march against central differences of whole marches."""

from dataclasses import replace

import numpy as np
import pytest

import impact
from impact.runs.sensitivity import Neighbours, force_sensitivities, why_no_derivative

UNIT = {"young": 1.0, "density": 1.0, "area": 1.0}
NEAR = 1e-5  # relative half width of the differences: to its square 1e-10, and round-off 1e-16 over it 1e-11
SAME = 5e-6
"""Largest difference from central differences, over the largest derivative: the forces of a step are found to 2e-16 of
the penetrations, over NEAR 2e-11, a hundred steps of a joint's kink, and the square of the widths add up to 2e-6."""


def bars(stiffness=6e-3, recovery=0.67, gap=0.2345, velocity=-1.0, young=1.0):
    """Return a bar that strikes an endless one through a joint that remembers; touched on and off."""
    striker = impact.Body(impact.free_rod(**UNIT | {"young": young}, length=40.0), velocity)
    seat = impact.semi_infinite_rod(**UNIT)
    return impact.ContactProblem(striker, seat, gap=gap, law=impact.RoughJoint(stiffness, 2.0, recovery))


def mass(stiffness=3.0, damping=0.2, gap=0.1019, velocity=-0.937, damping_ratio=0.05):
    """Return a mass on a short damped rod; it touches twice."""
    seat = impact.fixed_rod(**UNIT, length=3.0, damping_ratio=damping_ratio)
    striker, law = impact.rigid_mass(mass=1.0, velocity=velocity), impact.HuntCrossley(stiffness, damping, 1.5)
    return impact.ContactProblem(striker, seat, gap=gap, law=law)


def rigid(gap=0.1019, velocity=-0.937, damping_ratio=0.05):
    """Return the same without a law, Signorini's."""
    seat = impact.fixed_rod(**UNIT, length=3.0, damping_ratio=damping_ratio)
    return impact.ContactProblem(impact.rigid_mass(mass=1.0, velocity=velocity), seat, gap=gap)


def pair(stiffness=1.0, recovery=0.5, velocity=-0.937, hertz=2.0):
    """Return a bar between two contacts of different laws."""
    bar = impact.Body(impact.free_rod(**UNIT, length=10.0), velocity)
    one, other = (impact.Body(impact.fixed_rod(**UNIT, length=x, damping_ratio=0.02)) for x in (3.0, 2.0))
    first = impact.Contact(one, gap=0.0511, law=impact.RoughJoint(stiffness, 2.0, recovery))
    return impact.ContactProblem(bar, contacts=[first, impact.Contact(other, gap=0.0217, law=impact.Hertz(hertz))])


def modes(deflection=5e-5, damping_ratio=0.02):
    """Return a beam reed, by its modes, on a rod, by the poles of all."""
    reed = impact.cantilever_reed(
        young=200e9, density=7850.0, length=25e-3, width=10e-3, thickness=3e-4, damping_ratio=damping_ratio,
        n_modes=6, tip_deflection=deflection,
    )  # fmt: skip
    seat = impact.ModalGreens(np.array([2e5]), np.array([0.05]), np.array([[20.0]]), impact.Residual.spring([[1e-9]]))
    return impact.ContactProblem(reed, seat, law=impact.LinearSpring(1e7))


CASES = {
    bars: (117.0, 0.05, ("stiffness", "recovery", "gap", "velocity", "young")),
    mass: (8.0, 0.004, ("stiffness", "damping", "gap", "velocity", "damping_ratio")),
    rigid: (8.0, 0.004, ("gap", "velocity", "damping_ratio")),
    pair: (30.0, 0.02, ("stiffness", "recovery", "velocity", "hertz")),
    modes: (1.2e-3, 4e-7, ("deflection", "damping_ratio")),
}
KEYS = [(case, key) for case, (_, _, keys) in CASES.items() for key in keys]


def marched(case, **values):
    duration, dt, _ = CASES[case]
    stepper = impact.ContactStepper(impact.prepare(case(**values), dt, duration))
    stepper.advance(stepper.prepared.steps)
    return stepper


def usual(case, key):
    return case.__defaults__[case.__code__.co_varnames.index(key)]


def neighbours(case, key, width=NEAR):
    duration, dt, _ = CASES[case]
    value = usual(case, key)
    below, above = (impact.prepare(case(**{key: value * (1 + s * width)}), dt, duration) for s in (-1, 1))
    return Neighbours(below, above, 2 * width * value)


def difference(case, key, width):
    """Return the derivative by two whole marches, and whether all steps are as closed in both as in the middle."""
    value, base = usual(case, key), marched(case).force
    low, high = (marched(case, **{key: value * (1 + s * width)}).force for s in (-1, 1))
    alike = np.array_equal(low != 0, base != 0) and np.array_equal(high != 0, base != 0)
    return (high - low) / (2 * width * value), alike


@pytest.mark.slow(but="modes-deflection")
@pytest.mark.parametrize(("case", "key"), KEYS, ids=[f"{case.__name__}-{key}" for case, key in KEYS])
def test_it_is_what_two_marches_differ_by(case, key):
    stepper = marched(case)
    assert why_no_derivative(stepper) == ""
    [slope] = force_sensitivities(stepper, [neighbours(case, key)])
    by_marches, alike = difference(case, key, NEAR)
    assert alike, "the case is to keep its contact steps"
    assert np.abs(slope - by_marches).max() < SAME * np.abs(by_marches).max()


SMOOTH = [(mass, "gap"), (mass, "damping_ratio"), (bars, "recovery"), (pair, "recovery"), (modes, "damping_ratio")]


@pytest.mark.slow(but="modes")
@pytest.mark.parametrize(("case", "key"), SMOOTH, ids=[f"{case.__name__}-{key}" for case, key in SMOOTH])
def test_marches_come_near_it_with_the_square_of_their_distance(case, key):
    """Differences of marches approach the slope with the square of their width, at equal contact steps."""
    [slope] = force_sensitivities(marched(case), [neighbours(case, key)])
    apart = []
    for width in (4e-3, 2e-3, 1e-3):
        by_marches, alike = difference(case, key, width)
        assert alike
        apart.append(np.abs(slope - by_marches).max())
    orders = np.log2(np.array(apart[:-1]) / apart[1:])
    assert orders == pytest.approx(2.0, abs=0.1)


def test_it_fails_for_a_law_that_is_off_by_three_percent():
    """The tolerance above sees an error of a coefficient, in the march or in its derivative."""
    [slope] = force_sensitivities(marched(bars), [replace(neighbours(bars, "recovery"), width=2e-5 * 1.03 * 0.67)])
    by_marches, _ = difference(bars, "recovery", NEAR)
    assert np.abs(slope - by_marches).max() > 0.02 * np.abs(by_marches).max()


@pytest.mark.slow
def test_bodies_that_are_shared_are_not_computed_again():
    """The same derivative by a problem that shares the march's discretised bodies."""
    stepper = marched(bars)
    s, law = stepper.prepared, impact.RoughJoint
    sides = []
    for k in (6e-3 * (1 - NEAR), 6e-3 * (1 + NEAR)):
        [contact] = s.problem.contacts
        varied = impact.ContactProblem(s.problem.striker, contacts=[replace(contact, law=law(k, 2.0, 0.67))])
        sides.append(impact.prepare(varied, s.dt, s.steps * s.dt, bodies=s.bodies))
    with pytest.raises(impact.ContactError, match="must be those of the problem"):
        impact.prepare(varied, s.dt / 2, s.steps * s.dt, bodies=s.bodies)
    [shared] = force_sensitivities(stepper, [Neighbours(*sides, 2 * NEAR * 6e-3)])
    [anew] = force_sensitivities(stepper, [neighbours(bars, "stiffness")])
    assert np.abs(shared - anew).max() < 1e-9 * np.abs(anew).max()  # of sums by other orders


@pytest.mark.slow
def test_what_has_no_derivative_says_why():
    film = impact.SqueezeFilm(1e-3, 1e-3)
    striker, seat = impact.rigid_mass(mass=1.0, velocity=-1.0), impact.fixed_rod(**UNIT, length=3.0)
    own = impact.PlainLaw(lambda pen, start, dt: 3 * pen)
    for given, word in (({"film": film}, "film"), ({"law": own}, "own")):
        problem = impact.ContactProblem(striker, seat, gap=0.1, **{"law": impact.LinearSpring(3.0)} | given)
        stepper = impact.ContactStepper(impact.prepare(problem, 0.01, 2.0))
        stepper.advance(200)
        assert word in why_no_derivative(stepper)
