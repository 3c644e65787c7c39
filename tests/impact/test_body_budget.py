"""The error budget of any two bodies: the true error of impacts with a known answer lies inside it."""

import math
import threading
from collections.abc import Mapping

import numpy as np
import pytest

import impact
from impact import Body, Contact, ContactError, ContactProblem, ErrorEstimate, ModalGreens, Residual, measures
from impact.after.measures import MeasureError
from impact.march.laws import Law
from impact.runs.variations import Budget, Variation, budget_of, with_body

TRANSIT = 1e-5  # l/c of the rod; its impedance is 1 N s/m, its stiffness 1/TRANSIT
EXACT = impact.fixed_rod(young=1 / TRANSIT, density=TRANSIT, area=1.0, length=1.0)
COVERED = 0.95  # wanted share of the measures whose true error is inside the bar


def modes_of_rod(n: int, rest: str = "exponential", error: ErrorEstimate | None = None) -> ModalGreens:
    """Return the ``n`` lowest modes of `EXACT`, (k - 1/2) pi c/l, each with 2/mass, and the others' flexibility."""
    omega = (np.arange(n) + 0.5) * np.pi / TRANSIT
    flexibility = TRANSIT - float(np.sum(2 / TRANSIT / omega**2))
    residual = Residual.exponential(flexibility, 1.0) if rest == "exponential" else Residual.spring(flexibility)
    shapes = np.full((n, 1), math.sqrt(2 / TRANSIT))
    return ModalGreens(omega, np.zeros(n), shapes, residual, error=error or ErrorEstimate(mesh=0.0))


def blow(seat: impact.GreensFunction, mass: float, law: Law) -> ContactProblem:
    return ContactProblem(
        impact.rigid_mass(mass=mass * TRANSIT, velocity=-1.0), Body(seat), gap=0.01 * TRANSIT, law=law
    )


def measure_run(problem: ContactProblem, dt: float, duration: float, width: float) -> Mapping[str, float]:
    result = impact.solve(problem, dt=dt, duration=duration)
    group = measures.contact_groups(result)[0]
    return {
        "impulse": measures.impulse(result),
        "filtered_peak": measures.filtered_peak_force(result, width),
        "contact_duration": group[1] - group[0],
        "target_displacement": float(np.abs(result.target_displacement).max()),
    }


def drawn(rng: np.random.Generator) -> tuple[Budget, Mapping[str, float]]:
    """Draw a mass of 0.2 to 15 rods, any law, 6 to 60 modes, a filter no shorter than the highest period."""
    mass, n, k = 10 ** rng.uniform(-0.7, 1.2), int(rng.integers(6, 60)), 10 ** rng.uniform(-0.5, 2.5) / TRANSIT
    hertz = k / math.sqrt(TRANSIT)
    laws: list[Law] = [
        impact.Signorini(),
        impact.LinearSpring(k),
        impact.Hertz(hertz),
        impact.HuntCrossley(hertz, damping=0.3),
    ]
    law = laws[int(rng.integers(4))]
    dt = TRANSIT / int(rng.integers(15, 120))
    width = max(2 * TRANSIT / (n - 0.5), 2.5 * dt) * rng.uniform(1, 4)
    duration = TRANSIT * (3.5 * math.sqrt(mass * (1 + 1 / (k * TRANSIT))) + 6)
    seat = modes_of_rod(n, rng.choice(["exponential", "spring"]))
    budget = impact.error_budget(blow(seat, mass, law), dt=dt, duration=duration, filter_width=width)
    fine = TRANSIT / round(8 * TRANSIT / dt)
    return budget, measure_run(blow(EXACT, mass, law), fine, duration, width)


@pytest.mark.slow
def test_true_errors_of_a_random_set_are_inside_the_bars() -> None:
    rng, inside, excess = np.random.default_rng(3), [], []
    for _ in range(20):
        budget, truth = drawn(rng)
        for name, value in budget.values.items():
            error = abs(value - truth[name])
            inside.append(error <= budget.bar(name))
            excess.append((error - budget.bar(name)) / truth[name])
    assert len(inside) == 80
    assert np.mean(inside) >= COVERED
    assert max(excess) < 0.02  # of the value: what is outside is not far


def test_sources_are_named_by_body_and_the_unknown_too() -> None:
    striker = impact.cantilever_reed(
        young=200e9, density=7850.0, length=0.02, width=0.005, thickness=3e-4, n_modes=8, tip_deflection=2e-4
    )
    seat = modes_of_rod(5, error=ErrorEstimate(reduction=0.01))
    problem = ContactProblem(striker, Body(seat), law=impact.LinearSpring(1 / TRANSIT))
    budget = impact.error_budget(problem, dt=2e-7, duration=3e-4)
    assert set(budget.values) == {"impulse", "contact_duration", "target_displacement"}
    assert budget.sources == ("striker mesh", "striker reduction", "target mesh", "target reduction", "time_step")
    assert budget.unknown == ("target mesh",)
    assert "in no bar: target mesh" in str(budget)
    assert f"{budget.values['impulse']:.5g} +- " in str(budget)


def test_a_coarser_companion_takes_the_place_of_the_stated_error() -> None:
    law, dt = impact.LinearSpring(5 / TRANSIT), TRANSIT / 100
    seat = modes_of_rod(24, error=ErrorEstimate(0.0, None))
    companion = impact.Coarser(modes_of_rod(12), ratio=2.0)
    budget = impact.error_budget(
        blow(seat, 1.0, law), dt=dt, duration=6 * TRANSIT, coarser={"target mesh": companion},
        others={"law": blow(seat, 1.0, impact.LinearSpring(4.5 / TRANSIT))},
    )  # fmt: skip
    assert budget.unknown == ()
    values = [
        measures.impulse(impact.solve(blow(g, 1.0, law), dt=2 * dt, duration=6 * TRANSIT))
        for g in (seat, modes_of_rod(12))
    ]
    assert budget.parts["target mesh"]["impulse"] == pytest.approx(abs(values[0] - values[1]), rel=1e-9)
    assert budget.parts["target reduction"]["impulse"] == 0.0
    assert budget.dominant("target_displacement") == "law"


def test_several_contacts_and_measures_of_ones_own() -> None:
    mass = impact.rigid_mass(mass=TRANSIT, velocity=-1.0)
    seats = [Body(modes_of_rod(n)) for n in (10, 14)]
    law = impact.LinearSpring(3 / TRANSIT)
    problem = ContactProblem(mass, contacts=[Contact(seat, gap=0.02 * TRANSIT, law=law) for seat in seats])
    run = {"dt": TRANSIT / 50, "duration": 6 * TRANSIT}
    budget = impact.error_budget(problem, **run, filter_width=TRANSIT / 2)
    assert {"impulse 0", "impulse 1", "filtered_peak 1", "contact_duration 0"} <= set(budget.values)
    assert "target 1 reduction" in budget.parts
    assert 0 < budget.bar("impulse 0") < 0.05 * budget.values["impulse 0"]
    own = impact.error_budget(problem, **run, measures={"momentum": measures.total_impulse})
    assert list(own.values) == ["momentum"]
    exact = ContactProblem(mass, contacts=[Contact(Body(EXACT), gap=0.02 * TRANSIT, law=law) for _ in seats])
    truth = measures.total_impulse(impact.solve(exact, dt=TRANSIT / 800, duration=6 * TRANSIT))
    assert abs(own.values["momentum"] - truth) <= own.bar("momentum")


def test_what_a_budget_refuses() -> None:
    problem = blow(modes_of_rod(4), 1.0, impact.Signorini())
    with pytest.raises(ContactError, match="dt and duration"):
        impact.error_budget(problem)
    with pytest.raises(ContactError, match=r"'seat mesh'.*striker mesh"):
        impact.error_budget(
            problem, dt=1e-7, duration=1e-5, coarser={"seat mesh": impact.Coarser(modes_of_rod(2), ratio=2.0)}
        )
    with pytest.raises(ContactError, match="ratio = 1 must be above 1"):
        impact.Coarser(modes_of_rod(2), ratio=1.0)
    with pytest.raises(MeasureError, match="below two steps"):
        impact.error_budget(problem, dt=1e-7, duration=1e-5, filter_width=1e-7)


def test_runs_in_threads_leave_what_they_leave_one_after_the_other() -> None:
    """Four runs that wait for each other end, with the errors of single ones bit for bit."""
    problem = blow(modes_of_rod(12), 1.0, impact.LinearSpring(20 / TRANSIT))
    seat = problem.target
    others = [with_body(problem, seat, impact.Body(modes_of_rod(n))) for n in (9, 6)]
    sources = {"modes": ((Variation(others[0]), Variation(others[1], 0.5, others[0])),)}
    dt, width, duration = TRANSIT / 40, TRANSIT, 8 * TRANSIT
    gate = threading.Barrier(4, timeout=20)

    def run(one: ContactProblem, step: float) -> Mapping[str, float]:
        return measure_run(one, step, duration, width)

    def together(one: ContactProblem, step: float) -> Mapping[str, float]:
        gate.wait()
        return run(one, step)

    values = run(problem, dt)
    alone = budget_of(run, problem, values, dt, sources, filter_width=width)
    at_once = budget_of(together, problem, values, dt, sources, filter_width=width, threads=4)
    assert at_once.parts == alone.parts
    assert alone.parts["modes"]["filtered_peak"] > 0
