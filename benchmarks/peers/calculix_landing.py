"""A reed that lands on the lip of a solid seat: the deck of `seatfem export --to calculix` by ccx, beside our march.

Run: OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 NUMBA_NUM_THREADS=1 python -m benchmarks.peers.calculix_landing [case ...]

Writes benchmarks/results/calculix_landing.json and prints the table of docs/exchange.md.
"""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path
from typing import Any, Final

import numpy as np

from benchmarks.peers import calculix
from benchmarks.table import RESULTS
from impact.files.safe_files import write_whole
from seatfem.faces.exchange import export

FOUND: Final = RESULTS / "calculix_landing.json"
WIDTH: Final = 5e-6  # over which forces are compared [s]
SCENE: Final = """\
[seat]
kind = "annular"
bore_radius = "4 mm"
lip_width = "1 mm"
lip_edge_radius = "0 mm"
outer_radius = "8 mm"
thickness = "3 mm"
material = "steel"
mesh = {{ size = "3 mm", contact_size = "1.5 mm" }}
greens = {{ bandwidth = "200 kHz", tolerance = "2 %" }}
[reed]
kind = "flapper"
root_width = "8 mm"
taper_length = "2 mm"
neck_width = "6 mm"
neck_length = "15 mm"
paddle_diameter = "16 mm"
thickness = "0.3 mm"
material = {{ young = "206 GPa", poisson = 0.3, density = "7800 kg/m^3" }}
release = {{ mode = 1, velocity = "-2 m/s" }}
mesh = {{ size = "2 mm" }}
greens = {{ bandwidth = "60 kHz" }}
[contact]
law = {law}
gap = "2 um"
tilt = "{tilt}"
ports = 32
rings = 2
[run]
duration = "35 us"
filter_width = "10 us"
[accuracy]
target = "10 %"
"""
SPRING: Final = '{ kind = "spring", stiffness = "20 N/um" }'
CASES: Final = {
    "spring, flat": {"law": SPRING, "tilt": "0 deg"},
    "spring, 0.2 deg": {"law": SPRING, "tilt": "0.2 deg"},
}


def landing(case: dict[str, str]) -> dict[str, Any]:
    """Impulse, filtered peak and largest distance of the filtered forces, theirs over ours, and ccx's seconds."""
    with tempfile.TemporaryDirectory() as place:
        scene = Path(place) / "scene.toml"
        scene.write_text(SCENE.format(**case), encoding="utf-8")
        folder = Path(place) / "deck"
        export(scene, "calculix", folder)
        lines = (folder / "contact.inp").read_text(encoding="ascii").splitlines()
        text, seconds = calculix.run([(folder / lines[0].split("=")[1]).read_text(encoding="ascii"), *lines[1:]])
        time, ours = np.loadtxt(folder / "contact.csv", delimiter=",", skiprows=1).T
    _, theirs = calculix.contact_force_in(text)
    if len(theirs) < len(time) - 1:
        raise calculix.PeerError(f"{calculix.NAME} ends after {len(theirs)} of {len(time) - 1} steps")
    count = round(WIDTH / time[1])
    means = [np.convolve(force, np.full(count, 1 / count)) for force in (ours[1:], theirs[: len(ours) - 1])]
    return {
        "steps": len(time) - 1,
        "seconds": seconds,
        "impulse": float(theirs[: len(ours) - 1].sum() / ours[1:].sum() - 1),
        "peak": float(means[1].max() / means[0].max() - 1),
        "apart": float(np.abs(means[1] - means[0]).max() / means[0].max()),
    }


def table(found: dict[str, Any]) -> str:
    """In Markdown."""
    rows = ["| landing | steps | impulse (%) | peak over 5 us (%) | apart (%) | ccx (s) |", "| --- " * 6 + "|"]
    rows += [
        f"| {name} | {one['steps']} | {100 * one['impulse']:+.1f} | {100 * one['peak']:+.1f} | "
        f"{100 * one['apart']:.1f} | {one['seconds']:.0f} |"
        for name, one in found.items()
    ]
    return "\n".join(rows)


def main(names: list[str]) -> None:
    """The cases asked for, by default all."""
    found = json.loads(FOUND.read_text(encoding="utf-8")) if FOUND.exists() else {}
    for name in names or CASES:
        found[name] = landing(CASES[name])
        write_whole(FOUND, (json.dumps(found, indent=1) + "\n").encode())
    sys.stdout.write(table(found) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
