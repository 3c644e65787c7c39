"""
A bar as a rod
==============

How much a clamped end stiffens a bar against the rod: the lateral contraction it forbids, times nu^2.
"""
# sphinx_gallery_thumbnail_path = "docs/images/scenes/bar_as_rod.png"

import numpy as np
import skfem

from seatfem.structures.elements.assembly import assemble
from seatfem.structures.materials import Material
from seatfem.structures.reduction.factorization import factorize

LENGTH = 12e-3
FACES = {
    "fixed": lambda x: x[2] < 1e-9,
    "contact": lambda x: x[2] > LENGTH - 1e-9,
    "symmetry_0": lambda x: x[1] < 1e-9,
    "symmetry_1": lambda x: x[0] < 1e-9,
}
factors = []
for width, height in ((4e-3, 4e-3), (4e-3, 2e-3), (8e-3, 1e-3)):
    sides = np.array([width / 2, height / 2, LENGTH])  # a quarter of the bar
    counts = np.ceil(3 * sides / min(width, height) - 1e-9).astype(int)
    grid = (np.linspace(0.0, side, count + 1) for side, count in zip(sides, counts, strict=True))
    mesh = skfem.MeshHex.init_tensor(*grid).with_boundaries(FACES)
    for poisson in (0.15, 0.3, 0.45):
        steel = Material(1.0, poisson, 1.0)
        model = assemble(mesh, steel, sliding=("symmetry_0", "symmetry_1"), copies=4, order=2)
        port = model.port_matrix
        compliance = float((port.T @ factorize(model.K).solve(port))[0, 0])
        lost = 1 - compliance * width * height / LENGTH
        factors.append(lost / (poisson**2 * np.sqrt(width * height) / LENGTH))
        print(f"{1e3 * width:g} x {1e3 * height:g} mm, nu {poisson}: {100 * lost:.2f} %, factor {factors[-1]:.2f}")
assert 0.30 < min(factors) < max(factors) < 0.52
