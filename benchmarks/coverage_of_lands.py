"""Is each land right by itself, by another program? Two ports under one paddle and a ring valve with two lands.

    python benchmarks/coverage_of_lands.py [--only NAME] [--document]

`points` computes the same landings on two grids; what the last step changes is its doubt. Seats are a hundred times as
stiff as steel, as in `drawn_regions`. Springs act between the bodies, so that a flat landing is determined and each
land has its share. The rows go into results/coverage_of_lands.csv; ``--document`` writes the table into docs/lands.md.
"""

from __future__ import annotations

import argparse
import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from coverage_of_regions import run_scene
from drawn_regions import OF_STEEL, RIGID, STEEL, RegionLanding
from points.march import filtered_peak, impulse
from points.outlines import Flapper, Outline, Ring
from points.region_landing import GRIDS, Fall, Fineness, march_region
from points.regions import Region, RoundLand
from table import RESULTS, append_rows, read_rows, write_between

FILE: Final = RESULTS / "coverage_of_lands.csv"
PAGE: Final = Path(__file__).parents[1] / "docs" / "lands.md"
MM: Final = 1e-3
PORTS: Final = (
    '[seat]\nkind = "plate"\nports = 2\nlayout = "row"\nport_radius = "4 mm"\npitch = "12 mm"\nmargin = "6 mm"\n'
    f'thickness = "8 mm"\nland_width = "1 mm"\nclamp_width = "2 mm"\n{RIGID}'
)
LANDS: Final = (
    '[seat]\nkind = "annular"\nbore_radius = "7 mm"\nlip_width = "1 mm"\nlip_edge_radius = "0 mm"\n'
    'second_lip_radius = "12 mm"\nport_depth = "1 mm"\nouter_radius = "16 mm"\nthickness = "8 mm"\n'
    f"{RIGID}"
)
PADDLE: Final = (
    '[reed]\nkind = "flapper"\nroot_width = "12 mm"\ntaper_length = "3 mm"\nneck_width = "10 mm"\n'
    f'neck_length = "20 mm"\npaddle_diameter = "24 mm"\nthickness = "0.3 mm"\n{OF_STEEL}'
    'release = { mode = 1, velocity = "-1 m/s" }\n'
)
RING: Final = (
    '[reed]\nkind = "ring_plate"\nouter_diameter = "27 mm"\ninner_diameter = "13 mm"\nthickness = "1 mm"\n'
    f'{OF_STEEL}velocity = "-1 m/s"\n'
)
AT: Final = {"ports": ((-6.0, 4.0, 5.0), (6.0, 4.0, 5.0)), "lands": ((0.0, 7.0, 8.0), (0.0, 12.0, 13.0))}
"""Place along x, inner and outer radius of each land [mm]."""
REEDS: Final[Mapping[str, tuple[str, Outline, float]]] = {
    "ports": (PORTS + PADDLE, Flapper(*(MM * size for size in (12, 3, 10, 20, 24))), 0.3 * MM),
    "lands": (LANDS + RING, Ring(6.5 * MM, 13.5 * MM), 1 * MM),
}
SEGMENTS: Final = {"ports": 16, "lands": 24}
SCENES: Final[Mapping[str, tuple[str, float, float]]] = {
    "two ports, flat": ("ports", 0.0, 0.0),
    "two ports, tilted": ("ports", 0.1, -90.0),
    "ring valve, flat": ("lands", 0.0, 0.0),
    "ring valve, tilted": ("lands", 0.1, 0.0),
}
"""Reed and seat, tilt and the direction about which it tilts [deg], by name."""
KEYS: Final[Mapping[str, str]] = {
    "first touch": "time_s", "after the first": "after_first_s", "peak": "filtered_peak_force_N",
    "impulse": "impulse_Ns", "share": "impulse_share",
}  # fmt: skip


@dataclass(frozen=True)
class Row:
    """One number of one land [SI]; ``inside``: whether the bar holds the reference, "" without a bar."""

    scene: str
    land: str
    measure: str
    value: float = math.nan
    bar: float = math.nan
    reference: float = math.nan
    doubt: float = math.nan
    inside: str = ""


def landing_of(name: str) -> RegionLanding:
    """Return a scene, and the same landing in the other program's words."""
    which, tilt, axis = SCENES[name]
    table, outline, thickness = REEDS[which]
    fall = Fall(5e-6, math.radians(tilt), math.radians(axis), 1.0, 1e8, 80e-6, 10e-6)  # one landing
    lands = [RoundLand((MM * x, 0.0), MM * inner, MM * outer) for x, inner, outer in AT[which]]
    text = (
        f'{table}[contact]\ngap = "5 um"\ntilt = "{tilt} deg"\ntilt_axis = "{axis} deg"\n'
        f'ports = {SEGMENTS[which]}\nlaw = {{ kind = "spring", stiffness = "1e8 N/m" }}\n'
        '[run]\nduration = "80 us"\nfilter_width = "10 us"\n[accuracy]\ntarget = "25 %"\n'
        'measures = ["impulse", "filtered_peak"]\n'
    )
    return RegionLanding(name, text, outline, thickness, Region(lands), fall)


def by_points(landing: RegionLanding, grid: Fineness) -> list[dict[str, float]]:
    """Return the numbers of each land, of all touches in the time, by the other program."""
    marched, cells = march_region(landing.outline, STEEL, landing.thickness, landing.region, landing.fall, grid)
    ends = np.cumsum([0, *(each.areas.size for each in cells)])
    forces = [marched.forces[:, a:b].sum(axis=1) for a, b in itertools.pairwise(ends)]
    touches = [grid.dt * int(np.argmax(force > 0)) for force in forces]
    total = impulse(sum(forces), grid.dt)
    return [
        {
            "first touch": touch, "after the first": touch - min(touches), "impulse": impulse(force, grid.dt),
            "share": impulse(force, grid.dt) / total,
            "peak": filtered_peak(force, grid.dt, landing.fall.filter_width),
        }
        for touch, force in zip(touches, forces, strict=True)
    ]  # fmt: skip


def judge(name: str, before: Sequence[Row]) -> Iterator[Row]:
    """Yield the rows of one scene, with the references of the rows ``before`` where those have them."""
    landing = landing_of(name)
    rows = [replace(row, value=math.nan, bar=math.nan, inside="") for row in before]
    names = ("port 1", "port 2") if SCENES[name][0] == "ports" else ("inner land", "outer land")
    if not rows:
        fine, coarse = by_points(landing, GRIDS[1]), by_points(landing, GRIDS[0])
        rows = [
            Row(name, land, measure, reference=one[measure], doubt=abs(one[measure] - other[measure]))
            for land, one, other in zip(names, fine, coarse, strict=True)
            for measure in KEYS
        ]
    summary: Any = run_scene(landing)[0]
    lands = {each["land"]: each for each in (summary or {}).get("lands", ())}
    for row in rows:
        record, key = lands.get(row.land, {}), KEYS[row.measure]
        value, bar = record.get(key), record.get(f"error_bar_{key}")
        row = replace(row, value=math.nan if value is None else value)
        if value is not None and bar is not None:
            row = replace(row, bar=bar, inside=str(abs(value - row.reference) <= bar + row.doubt))
        yield row


def table_of(rows: Sequence[Row]) -> str:
    """Return the table of all rows for the page."""
    units = {"first touch": (1e6, "us"), "after the first": (1e6, "us"), "peak": (1, "N"), "impulse": (1e6, "uN s")}
    lines = ["", "| scene | land | number | seatfem | other program | inside |", "|---|---|---|---|---|---|"]
    for row in rows:
        factor, unit = units.get(row.measure, (1, ""))
        value, bar, reference, doubt = (factor * x for x in (row.value, row.bar, row.reference, row.doubt))
        lines.append(
            f"| {row.scene} | {row.land} | {row.measure} | {value:.4g} ± {bar:.2g} {unit} | {reference:.4g} ± "
            f"{doubt:.2g} {unit} | {'yes' if row.inside == 'True' else 'no' if row.inside else 'no bar'} |"
        )
    barred = [row for row in rows if row.inside]
    inside = sum(row.inside == "True" for row in barred)
    lines += ["", f"{inside} of {len(barred)} bars hold the other program's value."]
    return "\n".join(lines)


def main() -> None:
    """Run the scenes, and write their rows and the page."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--only", choices=SCENES, action="append")
    parser.add_argument("--document", action="store_true", help="run nothing, write the page")
    asked = parser.parse_args()
    for name in () if asked.document else asked.only or SCENES:
        rows = list(judge(name, [row for row in read_rows(Row, FILE) if row.scene == name]))
        others = [row for row in read_rows(Row, FILE) if row.scene != name]
        FILE.unlink(missing_ok=True)
        append_rows(sorted([*others, *rows], key=lambda row: list(SCENES).index(row.scene)), FILE)
    print(table_of(read_rows(Row, FILE)))  # noqa: T201
    if asked.document:
        write_between(PAGE, "coverage_of_lands", table_of(read_rows(Row, FILE)))


if __name__ == "__main__":
    main()
