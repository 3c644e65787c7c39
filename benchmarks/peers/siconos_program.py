"""Siconos on modes against a mass, run by Debian's own Python: ``siconos_program.py IN.npz OUT.npz`` or ``--version``.

It imports nothing of the project, as its interpreter has none of it.
"""

import sys
from time import process_time

import numpy as np
import siconos.kernel as kernel


def theta_rule(d, dt):
    """First order: x' = A x + B N, gap = C x, 0 <= gap + N/k, N >= 0; both sides by the midpoint of the step."""
    n = len(d["omega"])
    A, B, C = np.zeros((2 * n + 2, 2 * n + 2)), np.zeros((2 * n + 2, 1)), np.zeros((1, 2 * n + 2))
    k = np.arange(n + 1)
    A[k, n + 1 + k] = 1.0
    A[n + 1 + k[:n], k[:n]] = -(d["omega"] ** 2)
    B[n + 1 :, 0] = [*-d["shares"], 1 / d["mass"]]
    C[0, : n + 1] = [*-d["shares"], 1.0]
    start = np.zeros(2 * n + 2)
    start[-1] = -d["speed"]
    body = kernel.FirstOrderLinearTIDS(start, A)
    relation = kernel.FirstOrderLinearTIR(C, B)
    relation.setDPtr(np.array([[1 / float(d["stiffness"])]]))
    law = kernel.ComplementarityConditionNSL(1)
    rule = kernel.EulerMoreauOSI(0.5, 0.5)
    rule.setUseGammaForRelation(True)
    return body, relation, law, rule


def march(d, dt):
    """(steps,) force [N] and the processor seconds of building and stepping."""
    before = process_time()
    body, relation, law, rule = theta_rule(d, dt)
    contact = kernel.Interaction(law, relation)
    duration = float(d["duration"])
    system = kernel.NonSmoothDynamicalSystem(0.0, duration)
    system.insertDynamicalSystem(body)
    system.link(contact, body)
    stepping = kernel.TimeStepping(system, kernel.TimeDiscretisation(0.0, dt), rule, kernel.LCP())
    force = np.empty(round(duration / dt))
    for step in range(len(force)):
        stepping.computeOneStep()
        force[step] = contact.lambda_(0)[0]
        stepping.nextStep()
    return force, process_time() - before


if __name__ == "__main__":
    asked = dict(np.load(sys.argv[1]))
    runs = [march(asked, float(dt)) for dt in asked["steps"]]
    np.savez(sys.argv[2], *(np.array([seconds, *force]) for force, seconds in runs))
