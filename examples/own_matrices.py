"""
Your own M, K and C
===================

Matrices of another program as the seat: here a chain of 40 masses, a PEEK rod of 12 mm length that is held at one end.
"""
# sphinx_gallery_thumbnail_path = "docs/images/scenes/own_matrices.png"

import numpy as np

import impact
import seatfem

n, stiffness, mass = 40, 4e9 * 1e-4 / 12e-3 * 40, 1300 * 1e-4 * 12e-3 / 40  # of one part: E A / l, rho A l
K = stiffness * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
K[-1, -1] = stiffness
M = mass * np.diag([1.0] * (n - 1) + [0.5])
C = 1e-7 * K
face = np.eye(n)[-1]  # mean displacement of the struck face = face @ u: the last mass

seat = seatfem.SecondOrderModel(M=M, C=C, K=K, ports={"contact": face})
greens = seatfem.greens_function(seat, bandwidth=200e3, duration=2e-3, tolerance=0.01)
reed = impact.cantilever_reed(
    young=200e9, density=7850, length=25.4e-3, width=10e-3, thickness=0.305e-3, damping_ratio=0.03, tip_deflection=1e-3
)
result = impact.solve(impact.ContactProblem(reed, greens), dt=5e-8, duration=1e-3)
print(greens, result, sep="\n")
assert abs(greens.static_compliance()[0, 0] * stiffness / n - 1) < 1e-9  # 40 springs in series
