"""Bars in a chain and the joints between them: what is passed on, what comes back, what a joint loses."""

from __future__ import annotations

import math

import numpy as np

import impact
from seatfem.verify import Case

from .limits import stepped

_DALEMBERT = "d'Alembert; Graff, Wave Motion in Elastic Solids, ch. 2"
_LOOP = "area of the loop: a share 1 - r of the work k m^(n + 1)/(n + 1)"
_PLATEAU = 0.3
"""Strain of the wave that comes, in a bar of E = rho = A = 1."""


def bar_cases() -> tuple[Case, ...]:
    """Bars in a chain and the joints between them: what is passed on, what comes back, what a joint loses.

    Bars with E = rho = A = 1 unless multiplied.
    """
    return (_spring_joint(), _unequal_bars(), _chain(), *_rough_joint())


def _wave(rise: float) -> impact.IncomingWave:
    times, values = np.array([0.0, rise, 50.0]), -_PLATEAU * np.array([0.0, 1.0, 1.0])
    return impact.IncomingWave(impact.TimeSeries(times, values, "zero"), 1.0)


def _joined(law: impact.Law, area: float, rise: float, steps: int, duration: float = 4.0) -> impact.ImpactResult:
    first = impact.Body(impact.semi_infinite_rod(young=1.0, density=1.0, area=1.0), base=_wave(rise).outwards)
    second = impact.Body(impact.semi_infinite_rod(young=1.0, density=1.0, area=area))
    return impact.solve(impact.ContactProblem(second, first, law=law), dt=1 / steps, duration=duration)


def _spring_joint() -> Case:
    """Return the case of a ramp a t on a spring joint, N = a (t - tau (1 - exp(-t/tau))), tau = 1/(2 k)."""

    def solve(stiffness: float, steps: int) -> float:
        result = _joined(impact.LinearSpring(stiffness=0.7 * stiffness), 1.0, 4.0, steps)
        return float(result.force[steps] + result.force[steps + 1]) / 2 / _PLATEAU  # at t = 1

    tau = 1 / 1.4
    exact = (1 - tau * (1 - math.exp(-1 / tau))) / 4
    case, quantity = "two endless bars, a joint of a spring, a wave that rises", "force/plateau, 2 k t/Z = 1.4"
    return Case(case, quantity, exact, 1e-7, _DALEMBERT, stepped(solve, 1000, 2))


def _unequal_bars() -> Case:
    solve = stepped(lambda k, n: float(_joined(impact.Signorini(), 3 * k, 1.0, n).force[-1]) / _PLATEAU, 20)
    return Case("a wave into a bar of three times the area", "force/incident", 1.5, 1e-9, _DALEMBERT, solve)


def _chain() -> Case:
    """Return the case of a striker half as thick, of length 1, on two bars: v z/(1 + z), z = 1/2."""

    def solve(area: float, steps: int) -> float:
        rod = {"young": 1.0, "density": 1.0}
        striker = impact.Body(impact.free_rod(**rod, area=0.5 * area, length=1.0), velocity=-1.0)
        middle, last = impact.rod_of_two_ends(**rod, area=1.0, length=2.0), impact.semi_infinite_rod(**rod, area=1.0)
        contacts = [
            impact.Contact(impact.Body(last), striker_port="front"),
            impact.Contact(striker, striker_port="back", side=-1),
        ]
        result = impact.solve(impact.ContactProblem(impact.Body(middle), contacts=contacts), dt=1 / steps, duration=3.5)
        return float(result.force[3 * steps, 0])

    case = "striker, bar and endless bar in a chain, impedances 1/2, 1 and 1"
    return Case(case, "first pulse that the last bar is given/(Z v)", 1 / 3, 1e-9, _DALEMBERT, stepped(solve, 20))


def _rough_joint() -> tuple[Case, ...]:
    """Return the cases of a mass that a rough joint throws back, and of what it loses between bars."""

    def thrown(recovery: float, steps: int) -> float:
        law = impact.RoughJoint(stiffness=3.0, exponent=2.0, recovery=0.6 * recovery)
        mass = impact.rigid_mass(mass=1.0, velocity=-1.0)
        problem = impact.ContactProblem(mass, impact.spring(stiffness=1e12), law=law)
        return impact.measures.restitution(impact.solve(problem, dt=1 / steps, duration=4.0))

    def lost(closure: float, steps: int) -> float:
        law = impact.RoughJoint.through(force=_PLATEAU, closure=0.2 * closure, exponent=2.0, recovery=0.4)
        result = _joined(law, 1.0, 1.0, steps, duration=58.0)
        return float(result.energy.contact_loss[-1])

    return (
        Case("mass on a rough joint, r = 0.6", "restitution", math.sqrt(0.6), 1e-6, _LOOP, stepped(thrown, 400)),
        Case(
            "two endless bars, a rough joint, r = 0.4",
            "loss of a pulse/(Z v^2 l/c)",
            0.6 * _PLATEAU * 0.2 / 3,
            1e-6,
            _LOOP,
            stepped(lost, 200),
        ),
    )
