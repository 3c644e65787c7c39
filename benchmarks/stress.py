"""Time and memory of the largest stress on the surface of seats: 2e4 points, 2e5 steps.

python benchmarks/stress.py [steps] [seat ...]     seats: demo (in 32 arcs of its lip), plate

Times are of the processor, of all threads together; that of the search, which threads share, by the clock, too. Each
seat has a process of its own, whose memory is what it took at most.
"""

import math
import resource
import subprocess
import sys
import time

import numpy as np
import skfem

from impact.greens.base import Array
from seatfem.machine.threads import threads
from seatfem.structures.elements.assembly import assemble
from seatfem.structures.elements.axisymmetric import assemble_axisymmetric
from seatfem.structures.fields.around import Harmonic, RingField, felt, mixing_of
from seatfem.structures.fields.peaks import Field, largest
from seatfem.structures.fields.recovery import field_of, recover
from seatfem.structures.fields.response import Response
from seatfem.structures.fields.sites import on_surface
from seatfem.structures.fields.solids import elements_of, solid_stress
from seatfem.structures.materials import Material
from seatfem.structures.mesh.meridian import make_meridian
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.reduction.ring_patches import RingPatch
from seatfem.structures.shapes.revolved import AnnularSeat

STEEL, PEEK = Material(200e9, 0.3, 7850.0), Material(4.0e9, 0.4, 1300.0)
DEMO = AnnularSeat(
    bore_radius=4e-3, lip_width=1e-3, lip_height=0.5e-3, lip_edge_radius=0.1e-3, outer_radius=5.5e-3, thickness=12e-3
)
STEP = 20e-9  # s
BAND = 300e3  # Hz
POINTS = 20_000
ARCS = 32


def tell(line: str) -> None:
    """On the terminal."""
    sys.stdout.write(f"{line}\n")


def plate() -> tuple[Field, int]:
    """12 x 12 x 4 mm of steel, held below, struck on a strip above: 86,000 unknowns, 6,900 points."""
    side = 49
    lines = np.linspace(0, 12e-3, side), np.linspace(0, 12e-3, side), np.linspace(0, 4e-3, 13)
    mesh = skfem.MeshHex.init_tensor(*lines).with_boundaries(
        {"fixed": lambda x: x[2] < 1e-9, "contact": lambda x: (x[2] > 4e-3 - 1e-9) & (np.abs(x[0] - 6e-3) < 1e-3)}
    )
    return in_space(mesh, STEEL), 1


def in_space(mesh: object, material: Material) -> Field:
    """Stress at all nodes of the surface."""
    model, made = assemble(mesh, material, mass="nodal"), elements_of(mesh)
    sites = on_surface(made)
    tell(f"  {model.size} unknowns, {len(sites)} points, until here {memory():.2f} GiB")
    functional = solid_stress(made, material, model, sites)
    return recover(model, functional, sites.points, bandwidth=BAND, dt=STEP)


def demo() -> tuple[Field, int]:
    """The demo's seat struck in arcs of its lip: harmonics of its half section, at angles that make 2e4 points."""
    mesh = make_meridian(DEMO, MeshSpec(0.5e-3, 0.15e-3))
    made, arcs = elements_of(mesh), range(ARCS)
    sites = on_surface(made)
    patches = {str(k): RingPatch(2 * math.pi * (k + 0.5) / ARCS, 2 * math.pi / ARCS) for k in arcs}
    numbers, parts = felt(patches, blows(50_000, ARCS), int(math.pi * 4.5e-3 / 0.15e-3)), []
    for n in numbers:
        model = assemble_axisymmetric(mesh, PEEK, harmonic=n)
        response = Response.of(model, bandwidth=BAND, dt=STEP, resting=n > 0)
        field = field_of(response, solid_stress(made, PEEK, model, sites, harmonic=n), sites.points)
        parts.append(Harmonic(n, field, mixing_of(patches, ["contact"], n)))
    count = ARCS * math.ceil(POINTS / len(sites) / ARCS)
    angles = np.broadcast_to(2 * math.pi * (np.arange(count) + 0.5) / count, (len(sites), count))
    tell(f"  {len(numbers)} harmonics of {model.size} unknowns, {len(sites)} x {count} points")
    return RingField(sites.points, angles, tuple(parts)), ARCS


def memory() -> float:
    """Largest of the process so far [GiB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20


def blows(steps: int, ports: int) -> Array:
    """(n + 1, ports) forces, a blow every 1 ms; on several ports over half of the lip, running around it."""
    t = STEP * np.arange(steps + 1)[:, None]
    angle = 2 * np.pi * np.arange(ports) / ports
    around = np.maximum(np.cos(angle - 2 * np.pi * t / 0.4e-3), 0.0) if ports > 1 else np.ones((1, 1))
    return np.asarray(-100.0 * np.maximum(np.sin(2 * np.pi * t / 1e-3), 0.0) ** 4 * around)


def measure(name: str, steps: int) -> None:
    """The largest stress under `blows`."""
    tell(f"{name}: {steps} steps")
    begun = time.process_time()
    field, ports = {"plate": plate, "demo": demo}[name]()
    tell(f"  mesh, matrices, statics, {len(field.radians)} coordinates: {time.process_time() - begun:.1f} s")
    tell(f"  until here {memory():.2f} GiB")
    force = blows(steps, ports)
    begun, clock = time.process_time(), time.perf_counter()
    found = largest(field, force, STEP).after_contact
    spent, passed = time.process_time() - begun, time.perf_counter() - clock
    told = f"{spent:.1f} s, by the clock {passed:.1f} s, {threads()} threads"
    tell(f"  largest stress of {len(field.points)} points: {told}, {found.von_mises.max():.3g} Pa")
    tell(f"  {memory():.2f} GiB in all")


if __name__ == "__main__":
    given = [word for word in sys.argv[1:] if not word[:1].isdigit()]
    count = int(float(next((word for word in sys.argv[1:] if word[:1].isdigit()), "2e5")))
    if len(given) == 1:
        measure(given[0], count)
    else:
        for seat in given or ("demo", "plate"):
            subprocess.run([sys.executable, __file__, str(count), seat], check=True)
