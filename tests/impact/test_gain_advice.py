"""A law of one's own that returns more energy than it took is advised; laws that lose or keep energy are not."""

import numpy as np
import pytest

import impact
from impact import Advice, Body, ContactProblem, ImpactResult, compiled_law
from impact.march.laws import Law

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
