"""Contact laws and step rules: one's own laws, restitution of Hunt-Crossley, the conserving rule, refusals."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

import impact
from impact import (
    Advice,
    Body,
    Contact,
    ContactError,
    ContactProblem,
    ImpactResult,
    LawError,
    ModalGreens,
    PlainLaw,
    Residual,
    compiled_law,
)
from impact.greens.base import Array
from impact.march.laws import BLENDED, CONSERVING, PASSIVE, Law
from impact.march.loop.forces import contact_force

RIGID = ModalGreens(np.zeros(0), np.zeros(0), np.zeros((0, 1)), Residual.spring(1e-14))
SEAT = ModalGreens(
    np.array([30.0, 80.0]), np.array([0.1, 0.2]), np.array([[0.7], [0.5]]), Residual.exponential(5e-3, 0.3)
)


def hunt_crossley(pen: float, pen_start: float, dt: float) -> float:
    return 300.0 * pen**1.5 * max(0.0, 1.0 + 0.2 * (pen - pen_start) / dt)


def mass_on(law: Law, target: ModalGreens = SEAT, velocity: float = -1.0) -> ContactProblem:
    return ContactProblem(impact.rigid_mass(mass=1.0, velocity=velocity), Body(target), law=law, gap=0.01)


def two_seats(*laws: Law) -> ContactProblem:
    contacts = [Contact(Body(SEAT), gap=0.01 * k, law=law) for k, law in enumerate(laws)]
    return ContactProblem(impact.rigid_mass(mass=1.0, velocity=-1.0), contacts=contacts)


@pytest.mark.slow(but="mass_on")
@pytest.mark.parametrize("problem", [mass_on, lambda law: two_seats(law, impact.LinearSpring(stiffness=500.0), law)])
def test_a_law_of_ones_own_is_the_built_in_one(problem: Callable[[Law], ContactProblem]) -> None:
    """A plain and a compiled law agree bit for bit, and with the built-in one but for round-off."""
    laws = PlainLaw(hunt_crossley), compiled_law(hunt_crossley), impact.HuntCrossley(stiffness=300.0, damping=0.2)
    a, b, c = (impact.solve(problem(law), dt=1e-3, duration=1.0, rule="passive") for law in laws)
    assert np.all(a.force.max(axis=0) > 0.1)
    np.testing.assert_array_equal(a.force, b.force)
    np.testing.assert_array_equal(a.energy.dissipated, b.energy.dissipated)
    np.testing.assert_allclose(a.force, c.force, atol=1e-11 * c.force.max(), rtol=0)
    assert a.energy.residual < 1e-10


def test_a_problem_has_one_law_of_ones_own() -> None:
    with pytest.raises(ContactError, match="one CompiledLaw or PlainLaw"):
        two_seats(PlainLaw(hunt_crossley), compiled_law(hunt_crossley))
    with pytest.raises(ContactError, match="give the same object"):
        two_seats(PlainLaw(hunt_crossley), impact.Signorini(), PlainLaw(lambda pen, start, dt: pen))


def broken(pen: float, pen_start: float, dt: float) -> float:
    if pen > 0.01:
        raise KeyError("no such depth")
    return 300.0 * pen


def interrupted(pen: float, pen_start: float, dt: float) -> float:
    raise KeyboardInterrupt


def endless(pen: float, pen_start: float, dt: float) -> float:
    return math.inf if pen > 1e-3 else 300.0 * pen


@pytest.mark.slow
@pytest.mark.parametrize("problem", [mass_on, lambda law: two_seats(law, impact.Signorini(), law)])
def test_what_goes_wrong_in_a_plain_law_is_heard(problem: Callable[[Law], ContactProblem]) -> None:
    law = PlainLaw(broken)
    for _ in range(2):  # told once per run, and the law is as good as new
        with pytest.raises(LawError, match=r"broken .*KeyError: 'no such depth'") as caught:
            impact.solve(problem(law), dt=1e-3, duration=0.5)
        assert isinstance(caught.value.__cause__, KeyError)
    with pytest.raises(LawError, match="its force is nan N"):
        impact.solve(problem(PlainLaw(lambda pen, start, dt: math.nan)), dt=1e-3, duration=0.5)
    with pytest.raises(LawError, match="TypeError"):
        impact.solve(problem(PlainLaw(lambda pen: pen)), dt=1e-3, duration=0.5)  # type: ignore[arg-type, misc]
    with pytest.raises(KeyboardInterrupt):
        impact.solve(problem(PlainLaw(interrupted)), dt=1e-3, duration=0.5)
    with pytest.raises(LawError, match=r"compiled law.*finite"):
        impact.solve(problem(compiled_law(endless)), dt=1e-3, duration=0.5)
    stepper = impact.ContactStepper(impact.prepare(problem(law), 1e-3, 0.1))
    stepper.advance(9)  # still open
    with pytest.raises(LawError, match=r"broken.*KeyError"):
        stepper.advance(90)


@pytest.mark.slow
def test_a_batch_tells_of_a_failing_law() -> None:
    with pytest.raises(LawError, match="broken failed"):
        impact.solve_many(mass_on(PlainLaw(broken), velocity=-3.0), dt=1e-3, duration=0.1, velocities=[-3.0, -4.0])


def restitution(law: Law, steps: int) -> float:
    result = impact.solve(mass_on(law, RIGID), dt=4.0 / steps, duration=4.0)
    assert np.all(result.force >= 0)
    return impact.measures.restitution(result)


@pytest.mark.parametrize("exponent", [1.0, 1.5, 3.0])
@pytest.mark.parametrize("damping", [0.05, 0.5, 2.0])
def test_hunt_crossley_restitution_for_any_exponent(exponent: float, damping: float) -> None:
    """m v dv = -k x^n (1 + d v) dx integrates to k x_max^(n+1)/((n+1) m) = [v/d - ln(1 + d v)/d^2] on the way in, from
    0 to V, and out, from -e V to 0: (1 + e) d V = ln((1 + d V)/(1 - e d V)), whatever n, k and m."""

    def balance(e: float) -> float:
        return (1 + e) * damping - math.log((1 + damping) / (1 - e * damping))

    exact = brentq(balance, 1e-3, min(1.0, 1 / damping) * (1 - 1e-12), xtol=1e-14)
    law = impact.HuntCrossley(stiffness=300.0, damping=damping, exponent=exponent)
    # n = 1 starts and ends with a jump of the force's rate and exits at a phase of the step: quantised, second order
    e = [restitution(law, steps) for steps in (8000, 16000, 32000)]
    once = [2 * e[1] - e[0], 2 * e[2] - e[1]]  # without the first order; then without the second
    assert (4 * once[1] - once[0]) / 3 == pytest.approx(exact, abs=2e-5)


@settings(max_examples=100, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_no_step_gains_energy(seed: int) -> None:
    """Every law has N (end - start) >= Psi(end) - Psi(start), with equality by the conserving undamped rule."""
    rng = np.random.default_rng(seed)
    start, pen = rng.uniform(-1, 1, 2)
    w0, k, dt = 10.0 ** rng.uniform([-6, -2, -3], [2, 4, 1])
    elastic = [
        impact.LinearSpring(stiffness=k),
        impact.Hertz(stiffness=k),
        impact.HuntCrossley(stiffness=k, exponent=rng.uniform(1, 3)),
        impact.HuntCrossley(stiffness=k, damping=rng.uniform(0, 3), exponent=rng.uniform(1, 3)),
        impact.HertzOnPatch(stiffness=k, local=10.0 ** rng.uniform(-3, 1) / k),
        impact.HertzOnPatch(stiffness=k, local=10.0 ** rng.uniform(-3, 1) / k, damping=rng.uniform(0, 3)),
    ]
    laws: list[tuple[Law, int]] = [(law, rule) for law in elastic for rule in (PASSIVE, CONSERVING, BLENDED)]
    if start <= 0:  # a rigid contact holds no penetration
        laws.append((impact.Signorini(), PASSIVE))
    for law, rule in laws:
        force = contact_force(law.code, rule, *law.parameters, None, pen, start, w0, w0, dt)
        end = pen - w0 * force
        before, after = law.potential(np.array([start, end]))
        # the end is known to 1e-16 of pen: that times the force in the work, times Psi' <= 4 Psi/end in the potential
        # a patch's potential is the fifth power of a root by arc sines: up to 1.05e-14 in 30,000 draws
        share = 2e-14 if isinstance(law, impact.HertzOnPatch) else 1e-14
        round_off = share * (before + after + force * (abs(pen) + abs(start)))
        round_off += 1e-15 * abs(pen) * 4 * after / end if end > 0 else 0.0
        assert force >= 0.0
        gain = after - before - force * (end - start)
        assert gain <= round_off
        if rule == CONSERVING and not getattr(law, "damping", 0.0):
            assert gain >= -round_off


REED = impact.Cantilever(young=2e11, density=7850.0, length=0.0254, width=0.01, thickness=0.000305)


@pytest.mark.parametrize(
    "law", [impact.Signorini(), compiled_law(lambda pen, start, dt: pen), PlainLaw(lambda pen, start, dt: pen)]
)
def test_laws_without_a_potential_refuse_the_conserving_rule(law: Law) -> None:
    for problem in (mass_on(law), two_seats(impact.Hertz(stiffness=1.0), law)):
        with pytest.raises(ContactError, match=f"{type(law).__name__} has none"):
            impact.solve(problem, dt=1e-3, duration=0.1, rule="conserving")


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: PlainLaw(3.0), "must be a callable"),  # type: ignore[arg-type]
        (lambda: impact.HuntCrossley(stiffness=0.0), "stiffness = 0 must be positive"),
        (lambda: impact.HuntCrossley(stiffness=1.0, damping=-0.1), r"damping = -0.1 s/m.*>= 0"),
        (lambda: impact.HuntCrossley(stiffness=1.0, exponent=0.9), "exponent = 0.9 must be >= 1"),
        (lambda: impact.HertzOnPatch(stiffness=1.0, local=0.0), "local = 0 m/N must be positive"),
        (lambda: compiled_law(lambda pen, start, dt: open("no")), "cannot be compiled"),  # type: ignore[arg-type, return-value]  # noqa: SIM115
    ],
)
def test_impossible_laws_are_refused(make: Callable[[], object], words: str) -> None:
    with pytest.raises(LawError, match=words):
        make()


@pytest.mark.parametrize("exponent", range(-30, 31, 3))
@pytest.mark.parametrize("pen", [1e-9, 1.0, 1e6])
def test_hertz_force_is_the_root_over_sixty_decades(exponent: int, pen: float) -> None:
    """d^2 + k w0 d^3 = pen with N = k d^3: every term positive, so that the sum shows the relative error."""
    k, w0 = 10.0 ** (exponent / 2) * 7.0, 10.0 ** (exponent / 2) / 3.0
    force = float(contact_force(impact.Hertz.code, PASSIVE, k, 0.0, 0.0, None, pen, 0.0, w0, w0, 1.0))
    assert force > 0
    assert (force / k) ** (2 / 3) + w0 * force == pytest.approx(pen, rel=1e-14)


def test_a_contact_stiffer_than_the_step_resolves_does_not_ring() -> None:
    """k W0 = 1e5: the conserving force swings from step to step, the default follows the rigid contact."""

    def force(law: Law, rule: str = "auto") -> Array:
        reed = impact.reed(REED, n_modes=8, release=impact.StaticShape(deflection=1e-3))
        omega, transit = (np.arange(8) + 0.5) * np.pi, 1e-6  # a fixed rod, 1 % damped
        rest = Residual.exponential((1 - float(np.sum(2 / omega**2))) / 5e7, 1 / 5e7 / transit)
        stiff = ModalGreens(omega / transit, np.full(8, 0.01), np.full((8, 1), np.sqrt(2 / 5e7) / transit), rest)
        return impact.solve(ContactProblem(reed, Body(stiff), law=law), dt=2e-8, duration=1e-3, rule=rule).force

    rigid, rough = force(impact.Signorini()), force(impact.LinearSpring(5e12), "conserving")
    smooth = force(impact.LinearSpring(5e12))
    swing = [float(np.abs(np.diff(f)).sum() / f.max()) for f in (rigid, rough, smooth)]
    assert swing[1] > 1.5 * swing[0]
    assert swing[2] == pytest.approx(swing[0], rel=0.02)
    assert smooth.max() == pytest.approx(rigid.max(), rel=1e-3)


def test_the_law_of_a_sphere_has_the_stiffness_of_hertz() -> None:
    """The stiffness is (4/3) E* sqrt(R) with E* of both bodies; a second body not given is rigid."""
    steel = 210e9 / (2 * (1 - 0.3**2))
    law = impact.Hertz.from_sphere(radius=5e-3, young=210e9, poisson=0.3, young_2=210e9, poisson_2=0.3)
    assert law.stiffness == pytest.approx(4 / 3 * steel * 5e-3**0.5, rel=1e-14)
    assert impact.Hertz.from_sphere(radius=5e-3, young=210e9, poisson=0.3).stiffness == pytest.approx(2 * law.stiffness)


STIFFNESS, MASS, SPEED = 1e6, 1e-3, 1.0
MORE = 1.05  # of the force while the bodies part: restitution sqrt(1.05) = 1.0247


def spring_times(opening: float) -> Law:
    """Return a spring that bears ``opening`` times its force while the bodies part."""

    def force(pen: float, start: float, dt: float) -> float:
        return STIFFNESS * pen if pen >= start else opening * STIFFNESS * pen

    return compiled_law(force)


def blow(law: Law, *, duration: float = 3e-4, preload: bool = False) -> ImpactResult:
    """Run a mass onto a seat that hardly yields; the touch, of 99 us, has five thousand steps."""
    problem = ContactProblem(
        impact.rigid_mass(mass=MASS, velocity=-SPEED), Body(impact.spring(stiffness=1e12)), law=law, preload=preload
    )
    return impact.solve(problem, dt=2e-8, duration=duration)


def gains(result: ImpactResult) -> list[Advice]:
    return [advice for advice in result.advice if "gave back" in advice.name]


@pytest.mark.slow
def test_a_law_that_gains_energy_is_advised() -> None:
    """The work of a touch is known: a twentieth of m v^2/2, but for the 0.1 % of the whole
    that passive steps take: pi omega h/2."""
    result = blow(spring_times(MORE))
    (advice,) = gains(result)
    assert result.energy.residual < 1e-10  # the ledger is closed all the same
    assert advice.value == pytest.approx(MORE, abs=0.0015)
    assert 1 < advice.limit < 1 + 1e-5
    put_in = float(f"{-result.energy.contact_loss[-1]:.3g}")
    assert f"{put_in:.3g} J into the bodies" in advice.reason
    assert put_in == pytest.approx((MORE - 1) * MASS * SPEED**2 / 2, rel=0.03)
    assert "while the bodies part" in advice.remedy


@pytest.mark.slow
@pytest.mark.parametrize(
    "law",
    [
        spring_times(1.0),
        spring_times(0.5),
        impact.LinearSpring(stiffness=STIFFNESS),
        impact.Hertz(stiffness=1e9),
        impact.HuntCrossley(stiffness=1e9, damping=0.3),
    ],
)
def test_laws_that_keep_or_lose_energy_are_not(law: Law) -> None:
    result = blow(law)
    assert np.any(result.force > 0)
    assert not gains(result)
