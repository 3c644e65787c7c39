"""
A gas force that follows the lift
=================================

A reed valve whose gas force depends on its own opening: loads given step by step (co-simulation).

The gas pushes the tip with F(g) = F0 (1 - g/g1): fully on the closed valve, not at all at the opening g1. The reed is
thrown on its seat, bounces, and comes to rest where it balances the gas. With C its static compliance at the tip,

    g = C F(g)   =>   g = C F0/(1 + C F0/g1).
"""
# sphinx_gallery_thumbnail_path = "docs/images/scenes/pressure_feedback.png"

import numpy as np

import impact
from impact.pictures.drawing import sheet

DT, DURATION = 2e-6, 0.12
FULL_FORCE, OPEN = 0.4, 1e-3  # F0 [N], g1 [m]

reed = impact.cantilever_reed(
    young=2e11,
    density=7850.0,
    length=0.0254,
    width=0.01,
    thickness=0.0003,
    damping_ratio=0.05,
    n_modes=6,
    tip_deflection=1e-3,
)
assert isinstance(reed.greens, impact.ModalGreens)
gas = impact.Load(reed.greens.shapes[:, 0], np.zeros_like)  # at the tip; how much is told as the march goes
striker = impact.Body(reed.greens, state=reed.state, loads=(gas,))
problem = impact.ContactProblem(striker, impact.Body(impact.spring(stiffness=1e6)))

stepper = impact.ContactStepper(impact.prepare(problem, DT, DURATION))
state = stepper.state
while stepper.done < stepper.prepared.steps:
    state = stepper.step(np.array([FULL_FORCE * (1 - state.gap[0] / OPEN)]))
result = impact.collect(stepper)

free = float(reed.greens.static_compliance()[0, 0]) * FULL_FORCE
rest = free / (1 + free / OPEN)
contacts = impact.measures.contact_groups(result)
print(f"opening at rest {1e6 * result.gap[-1]:.2f} um, closed form {1e6 * rest:.2f} um", end=", ")
print(f"after {len(contacts)} impacts, energy ledger closed to {result.energy.residual:.0e}")
assert len(contacts) == 3
assert abs(result.gap[-1] / rest - 1) < 5e-4  # what is left of the swinging after 0.12 s: 1.3e-4
assert result.energy.residual < 1e-10  # the gas' work is part of it

with sheet("pressure_feedback.png", 6.4, 3.2) as figure:
    axes = figure.add_subplot(xlabel="time [ms]", ylabel="opening [mm]", title="The gas lets go as the valve opens")
    axes.plot(1e3 * result.time, 1e3 * result.gap)
    axes.axhline(1e3 * rest, linestyle="--", color="grey", label="at rest, closed form")
    axes.legend()
