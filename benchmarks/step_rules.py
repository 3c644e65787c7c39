"""Step rules of elastic contacts, compared: `python benchmarks/step_rules.py`.

A light mass, and a reed, on a rod of 5 modes, at the step that the advice on frequencies allows (w_max h = 1/2) and at
four times that. Errors against the conserving rule at a 32nd of the step.
"""

from __future__ import annotations

import math

import numpy as np
from table import Table, publish

import impact
from impact import Body, ContactProblem, ModalGreens, Residual
from impact.after.spectrum import largest_average
from impact.march.laws import Law

STIFFNESS, TRANSIT, MODES = 5e7, 1e-6, 5
RULES = ("passive", "conserving", "blended")


def seat() -> ModalGreens:
    """The lowest modes of a fixed rod, 1 % damped, and an exponential for the others."""
    omega = (np.arange(MODES) + 0.5) * math.pi / TRANSIT
    left = (1 - float(np.sum(2 * TRANSIT**-2 / omega**2))) / STIFFNESS
    shapes = np.full((MODES, 1), math.sqrt(2 / STIFFNESS) / TRANSIT)
    start = 1 / (STIFFNESS * TRANSIT)
    return ModalGreens(omega, np.full(MODES, 0.01), shapes, Residual.exponential(left, start))


def laws(penetration: float) -> dict[str, Law]:
    """As stiff as the seat, and thirty and a thousand times so, at a typical penetration [m]."""
    found: dict[str, Law] = {}
    for times in (1, 30, 1000):
        k, hertz = times * STIFFNESS, times * STIFFNESS / math.sqrt(penetration)
        found[f"spring, {times} K"] = impact.LinearSpring(k)
        found[f"Hertz, {times} K"] = impact.Hertz(hertz)
        found[f"Hunt-Crossley, {times} K"] = impact.HuntCrossley(hertz, damping=0.1)
    return found


def main() -> None:
    """The table."""
    target, mass = Body(seat()), 5e-5
    reed = impact.cantilever_reed(
        young=200e9, density=7850.0, length=30e-3, width=8e-3, thickness=4e-4, damping_ratio=0.01, n_modes=8,
        tip_deflection=1e-3,
    )  # fmt: skip
    thrown = impact.rigid_mass(mass=mass, velocity=-1.0)
    strikers = {"mass of 50 mg": (thrown, 1.2e-5, 1e-6), "reed": (reed, 1.2e-3, 1e-6)}
    rows = []
    for name, (striker, duration, penetration) in strikers.items():
        for words, law in laws(penetration).items():
            problem = ContactProblem(striker, target, law=law)
            step = 0.5 / float(seat().omega.max())
            exact = measures(problem, step / 32, duration, "conserving")
            for times in (1, 4):
                found = [measures(problem, times * step, duration, rule) for rule in RULES]
                errors = [
                    " / ".join(f"{100 * (a / b - 1):+.3f}" for a, b in zip(one, exact, strict=True)) for one in found
                ]
                rows.append((name, words, f"{0.5 * times:g}", *errors))
    notes = ("Errors of the impulse / of the peak of the 4 us mean, in percent.",)
    publish("step_rules", Table("Step rules", notes, ("striker", "law", "w_max h", *RULES), tuple(rows)))


def measures(problem: ContactProblem, dt: float, duration: float, rule: str) -> tuple[float, float]:
    """Impulse [N s] and filtered peak [N]."""
    stepper = impact.ContactStepper(impact.prepare(problem, dt, duration, rule))
    stepper.advance(stepper.prepared.steps)
    force = stepper.force[:, 0]
    return float(force.sum()) * dt, largest_average(force, dt, 4e-6)


if __name__ == "__main__":
    main()
