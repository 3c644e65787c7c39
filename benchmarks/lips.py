"""Contact along a lip in ever more arcs: what their number changes, and what a step of them costs.

A flapper lands on an annular seat, flat and tilted. The seat stands for its statics and the first velocity of each arc.
"""

from __future__ import annotations

import math
import tempfile
from pathlib import Path
from time import process_time

from table import Table, publish

import impact
from impact.after.along import line_force_peak, line_impulse_peak
from impact.after.spectrum import largest_average
from impact.greens.base import Array
from seatfem.study.impacts.contact import problem_of, seat_of, striker_of
from seatfem.study.impacts.touches import parts_of
from seatfem.study.method import stated_method
from seatfem.study.scene import load_scene

ARCS = (8, 16, 32, 64, 128, 256)
TILTS = (("0 deg", "0 deg"), ("0.1 deg", "0 deg"), ("0.3 deg", "0 deg"), ("1 deg", "0 deg"))
PITCH = tuple((tilt, "90 deg") for tilt in ("0.1 deg", "0.3 deg", "-0.3 deg", "1 deg"))
STEP, SHORT, LONG = 50e-9, 1e-6, 5e-6
RECORD, FIRST = 0.4e-3, 0.2e-3  # s; until the plate has left, and until the far side of the lip is struck from 1 degree
RADIUS, SHARE = 5.5e-3, 1 / 8
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
    """As `landed`."""
    path = folder / "scene.toml"
    text = SCENE.format(arcs=arcs, tilt=tilt, axis=axis).replace('"0.2 ms"', f'"{RECORD} s"')
    path.write_text(text, encoding="utf-8")
    scene = load_scene(path)
    seat = seat_of(scene, method=stated_method(scene).seat, mesh_error=False)
    return landed(problem_of(scene, striker_of(scene), impact.Body(seat.greens)))


def landed(problem: impact.ContactProblem) -> tuple[float, ...]:
    """Impulse of the record; until `FIRST` the mean peaks over 1 and 5 us, line force over 1 us and 45 degrees, impulse
    per length over 45 degrees [SI]; processor time of a step [s]."""
    prepared = impact.prepare(problem, STEP, RECORD)
    stepper = impact.ContactStepper(prepared)
    stepper.advance(1)  # compiled
    start = process_time()
    stepper.advance(prepared.steps)
    step = (process_time() - start) / (prepared.steps - 1)
    forces = parts_of(stepper)[1:]
    first = forces[: round(FIRST / STEP)]
    return (float(forces.sum()) * STEP, *peaks(first), step)


def peaks(forces: Array) -> tuple[float, ...]:
    """Of (n, arcs) forces, as `landed`."""
    total, length = forces.sum(axis=1), 2 * math.pi * RADIUS
    return (
        largest_average(total, STEP, SHORT),
        largest_average(total, STEP, LONG),
        line_force_peak(forces, STEP, SHORT, length, SHARE)[0],
        line_impulse_peak(forces, STEP, length, SHARE)[0],
    )


def main() -> None:
    """Every tilt in every number of arcs."""
    rows = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        for tilt, axis in (*TILTS, *PITCH):
            found = {arcs: landing(arcs, tilt, axis, folder) for arcs in ARCS}
            finest = found[ARCS[-1]]
            for arcs, (impulse, short, long, line, _, step) in found.items():
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
        "modes, 50 ns. The impulse is that of 0.4 ms, when the plate has left for good; peaks are those of the first",
        "0.2 ms: by 1 degree in pitch the far side of the lip is struck later. The line force is the mean over 45",
        "degrees and 1 us. Differences are from 256 arcs; processor time of a step of the march. Flat, a sheet lands",
        "everywhere at once, and few arcs do.",
    )
    columns = (
        *("tilt", "arcs", "impulse, uN s", "peak, 1 us, N", "peak, 5 us, N", "line force, N/mm"),
        *("impulse", "peak, 1 us", "peak, 5 us", "line force", "us a step"),
    )
    publish("lips", Table("Arcs of a lip", notes, columns, tuple(rows)))


if __name__ == "__main__":
    main()
