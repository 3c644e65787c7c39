"""Contact along a lip in ever more arcs: what their number changes, and what a step of them costs.

A flapper lands on an annular seat, flat and tilted. The seat stands for its statics and the first velocity of each arc.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from time import process_time

from table import Table, publish

import impact
from impact.after.along import line_force_peak
from impact.after.spectrum import largest_average
from seatfem.study.impacts.contact import problem_of, seat_of, striker_of
from seatfem.study.impacts.touches import parts_of
from seatfem.study.method import stated_method
from seatfem.study.scene import load_scene

ARCS = (8, 16, 32, 64, 128, 256)
TILTS = (("0 deg", "0 deg"), ("0.1 deg", "0 deg"), ("0.3 deg", "0 deg"), ("1 deg", "0 deg"))
PITCH = tuple((tilt, "90 deg") for tilt in ("0.1 deg", "0.3 deg", "-0.3 deg", "1 deg"))
STEP, SHORT, LONG = 50e-9, 1e-6, 5e-6
SCENE = """
[seat]
kind = "annular"
bore_radius = "5 mm"
lip_width = "1 mm"
lip_edge_radius = "0 mm"
material = {{ young = "206 GPa", poisson = 0.3, density = "7800 kg/m^3" }}
model = "spring"
[reed]
kind = "flapper"
root_width = "8 mm"
taper_length = "2 mm"
neck_width = "6 mm"
neck_length = "15 mm"
paddle_diameter = "16 mm"
thickness = "0.3 mm"
material = {{ young = "206 GPa", poisson = 0.3, density = "7800 kg/m^3" }}
greens = {{ bandwidth = "150 kHz" }}
release = {{ mode = 1, velocity = "-2 m/s" }}
[contact]
gap = "1 um"
ports = {arcs}
tilt = "{tilt}"
tilt_axis = "{axis}"
[run]
duration = "0.2 ms"
"""


def landing(arcs: int, tilt: str, axis: str, folder: Path) -> tuple[float, ...]:
    """Impulse, mean peaks over 1 and 5 us [SI], line force over 1 us and 45 degrees, processor time of a step [s]."""
    path = folder / "scene.toml"
    path.write_text(SCENE.format(arcs=arcs, tilt=tilt, axis=axis), encoding="utf-8")
    scene = load_scene(path)
    seat = seat_of(scene, method=stated_method(scene).seat, mesh_error=False)
    problem = problem_of(scene, striker_of(scene), impact.Body(seat.greens))
    prepared = impact.prepare(problem, STEP, scene.run.duration)
    stepper = impact.ContactStepper(prepared)
    start = process_time()
    stepper.advance(prepared.steps)
    step = (process_time() - start) / prepared.steps
    forces = parts_of(stepper)[1:]
    total, ring = forces.sum(axis=1), scene.seat.struck_ring
    assert ring is not None
    line = line_force_peak(forces, STEP, SHORT, 6.283185307179586 * ring[0], 1 / 8)[0] if arcs > 1 else 0.0
    peaks = (largest_average(total, STEP, width) for width in (SHORT, LONG))
    return (float(total.sum()) * STEP, *peaks, line, step)


def main() -> None:
    """Every tilt in every number of arcs; the first run, which compiles, is not counted."""
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        landing(16, "0 deg", "0 deg", folder)
        for tilt, axis in (*TILTS, *PITCH):
            found = {arcs: landing(arcs, tilt, axis, folder) for arcs in ARCS}
            finest = found[ARCS[-1]]
            for arcs, (impulse, short, long, line, step) in found.items():
                rows.append(
                    (
                        f"{tilt} {'roll' if axis == '0 deg' else 'pitch'}",
                        str(arcs),
                        *(f"{value:.5g}" for value in (1e6 * impulse, short, long, line / 1e3)),
                        *(
                            f"{100 * (one / other - 1):+.2f} %"
                            for one, other in zip(found[arcs][:4], finest, strict=False)
                        ),
                        f"{1e6 * step:.1f}",
                    )
                )
    notes = (
        "A flapper of 0.3 mm lands with 2 m/s in its first mode on a lip of 11 mm mean diameter and 1 mm width; 180",
        "modes, 50 ns. The line force is the mean over 45 degrees and 1 us. Differences are from 256 arcs; processor",
        "time of a step of the march. Flat, a sheet lands everywhere at once, and few arcs do.",
    )
    columns = (
        *("tilt", "arcs", "impulse, uN s", "peak, 1 us, N", "peak, 5 us, N", "line force, N/mm"),
        *("impulse", "peak, 1 us", "peak, 5 us", "line force", "us a step"),
    )
    publish("lips", Table("Arcs of a lip", notes, columns, tuple(rows)))


if __name__ == "__main__":
    main()
