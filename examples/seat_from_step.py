"""
A seat from a STEP file
=======================

A valve seat drawn in a CAD program: from its STEP file by mesh, matrices and Green's function to the impact of a reed.

The faces that matter are painted: pure red is struck, pure blue is clamped. A coarse mesh, so that it takes seconds.
"""
# sphinx_gallery_thumbnail_path = "docs/images/scenes/seat_from_step.png"

import math
from pathlib import Path

import impact
import seatfem
from impact import measures
from impact.pictures.plots import plot_force
from seatfem.pictures.plots import plot_mesh, plot_modes
from seatfem.structures.shapes import CadPart

STEP_FILE = Path(seatfem.__file__).parents[1] / "meshes" / "annular_seat.step"
BAND = 200e3  # Hz
RUN = 1e-3  # s: g is computed for as long as it is used
steel = seatfem.Material(young=200e9, poisson=0.3, density=7850.0)

seat = seatfem.make_mesh(CadPart(STEP_FILE), seatfem.MeshSpec(size=3e-3, contact_size=1.5e-3))
print(seat)
model = seatfem.assemble(seat, steel, fixed="fixed", ports={"contact": "contact"})
modes = seatfem.solve_modes(model, n=3)
print("first modes", [f"{1e-3 * f:.1f} kHz" for f in modes.frequencies_hz])
g = seatfem.greens_function(model, bandwidth=BAND, duration=RUN, tolerance=0.01, damping_ratio=0.10)
stiffness = 1 / g.static_compliance()[0, 0]
print(f"static stiffness {1e-6 * stiffness:.0f} N/um, error of the reduction {g.error_estimate.reduction:.1e}")

reed = impact.cantilever_reed(
    young=200e9, density=7850.0, length=25.4e-3, width=10e-3, thickness=0.305e-3, damping_ratio=0.03,
    n_modes=20, tip_deflection=1e-3,
)  # fmt: skip
result = impact.solve(impact.ContactProblem(reed, impact.Body(g)), dt=5e-8, duration=RUN)
start, end = measures.contact_groups(result)[0]
print(f"strikes at {1e6 * start:.2f} us, closed for {1e6 * (end - start):.1f} us, {measures.impulse(result):.3e} N s")

# the struck ring lies between the rounded edges: 4.1 mm to 4.9 mm
assert abs(seat.quality.areas["contact"] / (math.pi * (4.9e-3**2 - 4.1e-3**2)) - 1) < 1e-3
assert abs(start - 653.3246e-6) < 5e-8  # the free reed arrives, known from its modal sum
assert g.error_estimate.reduction < 0.01

plot_mesh(seat, "seat_from_step_1_mesh.png")
plot_modes(model, modes, "seat_from_step_2_modes.png")
plot_force(result, None, "seat_from_step_3_force.png")
