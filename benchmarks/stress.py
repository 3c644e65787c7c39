"""Time and memory of the largest stress on the surface of a seat of solid elements: 2e4 points, 2e5 steps.

python benchmarks/stress.py [steps]
"""

import resource
import sys
import time

import numpy as np
import skfem

from seatfem.structures.elements.assembly import assemble
from seatfem.structures.fields.recovery import largest, recover
from seatfem.structures.fields.sites import on_surface
from seatfem.structures.fields.solids import elements_of, solid_stress
from seatfem.structures.materials import Material

STEEL = Material(200e9, 0.3, 7850.0)
STEP = 20e-9  # s
SIDE = 48  # elements along an edge of the plate


def tell(line: str) -> None:
    """On the terminal."""
    sys.stdout.write(f"{line}\n")


def main(steps: int) -> None:
    """A plate of 12 x 12 x 4 mm, held below, struck on a strip above by a train of blows."""
    lines = np.linspace(0, 12e-3, SIDE + 1), np.linspace(0, 12e-3, SIDE + 1), np.linspace(0, 4e-3, 13)
    mesh = skfem.MeshHex.init_tensor(*lines).with_boundaries(
        {"fixed": lambda x: x[2] < 1e-9, "contact": lambda x: (x[2] > 4e-3 - 1e-9) & (np.abs(x[0] - 6e-3) < 1e-3)}
    )
    begun = time.perf_counter()
    model, made = assemble(mesh, STEEL, mass="nodal"), elements_of(mesh)
    tell(f"assembly, {model.size} unknowns: {time.perf_counter() - begun:.1f} s")
    sites = on_surface(made)
    begun = time.perf_counter()
    functional = solid_stress(made, STEEL, model, sites)
    field = recover(model, functional, sites.points, bandwidth=300e3, dt=STEP)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    tell(f"static solution, {field.modal.shape[2]} modes, {len(sites)} points: {time.perf_counter() - begun:.1f} s")
    tell(f"  up to here {memory:.2f} GiB, most of it two factorizations")
    t = STEP * np.arange(steps + 1)
    force = -100.0 * np.maximum(np.sin(2 * np.pi * t / 1e-3), 0.0) ** 4
    begun = time.perf_counter()
    found = largest(field, force, STEP).after_contact
    spent = time.perf_counter() - begun
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20 - memory
    tell(f"largest stress over {steps} steps: {spent:.1f} s, {grown:.2f} GiB more, {found.von_mises.max():.3g} Pa")


if __name__ == "__main__":
    main(int(float(sys.argv[1])) if len(sys.argv) > 1 else 200_000)
