"""
A bar as a rod
==============

How much a clamped end stiffens a bar against the rod: the lateral contraction it forbids, times nu^2.
"""
# sphinx_gallery_thumbnail_path = "docs/images/scenes/bar_as_rod.png"

import numpy as np

from seatfem.structures.elements.assembly import assemble
from seatfem.structures.materials import Material
from seatfem.structures.mesh.meshing import make_mesh
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.reduction.factorization import factorize
from seatfem.structures.shapes import Bar

LENGTH = 12e-3
factors = []
for width, height in ((4e-3, 4e-3), (4e-3, 2e-3), (8e-3, 1e-3)):
    size = min(width, height) / 3
    spec = MeshSpec(size=size, contact_size=size, shape="hex")
    mesh = make_mesh(Bar(length=LENGTH, width=width, height=height), spec, sector=4)
    for poisson in (0.15, 0.3, 0.45):
        model = assemble(mesh, Material(1.0, poisson, 1.0), sliding=("symmetry_0", "symmetry_1"), copies=4)
        port = model.port_matrix
        compliance = float((port.T @ factorize(model.K).solve(port))[0, 0])
        lost = 1 - compliance * width * height / LENGTH
        factors.append(lost / (poisson**2 * np.sqrt(width * height) / LENGTH))
        print(f"{1e3 * width:g} x {1e3 * height:g} mm, nu {poisson}: {100 * lost:.2f} %, factor {factors[-1]:.2f}")
assert 0.30 < min(factors) < max(factors) < 0.52
