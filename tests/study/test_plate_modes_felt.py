"""A plate whose contact feels few of its modes: the bar knows what may lie above the last, and the plan."""

import numpy as np

from impact import Body, ContactProblem, solve, spring
from impact.bodies.body import ModalState
from impact.greens.modal import ModalGreens, Residual
from impact.runs.variations import ringing_on
from seatfem.study.prerun.sensitivity import with_other_modes
from seatfem.study.safety import OF_MODES

HIGHEST = 2e6  # rad/s, of a mode that the contact does not feel, as one with waves around a ring
REST = 3e-11  # m/N above


def plate(*felt: float) -> Body:
    """Free, with modes of these frequencies that the contact feels, one at the highest that it does not, and a rest."""
    omega = np.array([0.0, *felt, HIGHEST])
    shapes = np.array([[20.0], *[[15.0]] * len(felt), [0.001]])
    greens = ModalGreens(omega, np.full(len(omega), 0.01), shapes, Residual.spring(REST))
    return Body(greens, state=ModalState(np.zeros(len(omega)), np.eye(len(omega))[0]))


def test_the_bar_of_a_plate_knows_a_mode_above_its_band() -> None:
    """Against the plate with a mode just above, what leaving out modes changes tells nothing, the others within two."""
    few = plate(0.1 * HIGHEST)
    true = ringing_on(few, 1.4)
    assert true is not None

    def impulse(body: Body) -> float:
        struck = ContactProblem(Body(body.greens, velocity=-1.0), Body(spring(stiffness=2e9)))
        result = solve(struck, dt=1e-8, duration=3e-5)
        return float(result.force.sum() * result.dt)

    here = impulse(few)
    error = abs(impulse(true) - here)
    changes = [share * abs(impulse(body) - here) for body, share in with_other_modes(few)]
    assert max(changes[: len(OF_MODES)]) < error / 10
    assert max(changes) > error / 2
