"""
Another program drives the contact
==================================

A plenum drives a reed step by step, is interrupted, and goes on from files (docs/exchange.md).

The other program is a plenum behind a reed valve: its pressure pushes the reed's tip and falls by what flows out,

    dp/dt = -R g^+,   F = A p,

R rate of the pressure per opening. Each step it reads the opening g, and tells the force of the next step.
"""
# sphinx_gallery_thumbnail_path = "docs/images/scenes/co_simulation.png"

import json
import tempfile
from pathlib import Path

import numpy as np

import impact
from impact.storage.hdf5 import restore_checkpoint, save_checkpoint

DT, STEPS, BREAK = 2e-6, 4000, 1500
AREA, START, RATE = 4e-5, 1.5e4, 2e9  # A [m^2], p(0) [Pa], R [Pa/(s m)]

reed = impact.cantilever_reed(
    young=2e11, density=7850.0, length=0.0254, width=0.01, thickness=0.0003, damping_ratio=0.02, n_modes=6,
    tip_deflection=1e-4,
)  # fmt: skip
assert isinstance(reed.greens, impact.ModalGreens)
at_tip = impact.Load(reed.greens.shapes[:, 0], np.zeros_like)  # how large the force is comes from outside
striker = impact.Body(reed.greens, state=reed.state, loads=(at_tip,))
problem = impact.ContactProblem(striker, impact.Body(impact.spring(stiffness=1e6)))


def new_stepper() -> impact.ContactStepper:
    """Prepared in the same way each time: a checkpoint goes on in no other problem."""
    return impact.ContactStepper(impact.prepare(problem, DT, STEPS * DT))


def march(stepper: impact.ContactStepper, pressure: float, until: int) -> float:
    """The exchange of one program with the other, a step at a time; the plenum's pressure at the end."""
    while stepper.done < until:
        state = stepper.step(np.array([AREA * pressure]))
        pressure -= DT * RATE * max(0.0, float(state.gap[0]))
    return pressure


whole = new_stepper()
march(whole, START, STEPS)

with tempfile.TemporaryDirectory() as folder:
    ours, theirs = Path(folder) / "contact.h5", Path(folder) / "plenum.json"
    first = new_stepper()
    theirs.write_text(json.dumps(march(first, START, BREAK)), encoding="utf-8")
    save_checkpoint(first, ours)

    second = new_stepper()
    restore_checkpoint(second, ours)
    left = march(second, json.loads(theirs.read_text(encoding="utf-8")), STEPS)

one, two = impact.collect(whole), impact.collect(second)
print(f"{np.count_nonzero(one.force > 0)} steps in contact, {left:.0f} Pa left in the plenum", end=", ")
print(f"energy ledger closed to {two.energy.residual:.0e}")
assert np.array_equal(one.force, two.force)  # bit for bit
assert np.array_equal(one.gap, two.gap)
assert 0 < left < 0.9 * START
assert two.energy.residual < 1e-9
