"""The landings of `plate_on_points.py` by the product, beside that independent reference.

    python benchmarks/plate_on_points_product.py [--rings N] [number ...]

runs the landings that results/points_reference.csv holds, as the product chooses, and writes results/points.csv, a row
per landing and measure; numbers given are run again, the other rows stay. With --rings the scenes state as many parts
across the land, and the table is results/points_with_N_rings.csv. A ratio is |difference| over bar plus doubt.
`plate_on_points_page.py` then writes the page.
"""

from __future__ import annotations

import argparse
import csv
import json
import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from plate_on_points import draw_landing, read_references
from points.landing import Doubted, Landing
from points.outlines import Flapper, Outline, RingPlate, Sheet
from points.plate import Material

from seatfem.study.runs.pipeline import run_scene
from seatfem.study.scene import load_scene

RESULTS = Path(__file__).parent / "results"
TARGET = "5 %"
RIGID = Material(20e12, 0.3, 7850.0)  # 100 times as stiff as steel
KEYS = {"impulse": "impulse_Ns", "filtered_peak": "filtered_peak_force_N"}


@dataclass(frozen=True)
class Row:
    """One measure of one landing, by both programs, in SI units; ``bar`` is nan where the product states none."""

    number: int
    reed: str
    seat_GPa: float
    law: str
    tilt_deg: float
    measure: str
    filter_us: float
    reference: float
    doubt: float
    product: float
    bar: float
    met: bool
    ports: int

    @property
    def ratio(self) -> float:
        """Difference over what both programs say that they leave open."""
        return abs(self.product - self.reference) / (self.bar + self.doubt)

    @property
    def is_inside(self) -> bool:
        """Whether the two agree."""
        return self.ratio <= 1


def write_scene(landing: Landing, duration: float, rings: int | None = None) -> str:
    """Return a landing as a scene file; a rigid seat becomes one 100 times as stiff as steel."""
    seat = landing.seat
    inner = landing.lip_radius - landing.lip_width / 2
    sizes = (0.5e-3, 12e-3, 8e-3) if seat is None else (seat.lip_height, seat.outer, seat.thickness)
    height, outer, thickness = map(_mm, sizes)
    law = {
        "signorini": '"signorini"',
        "spring": f'{{ kind = "spring", stiffness = "{landing.stiffness:.10g} N/m" }}',
        "hertz": f'{{ kind = "hertz", stiffness = "{landing.stiffness / 1e9:.10g} GN/m^1.5" }}',
    }[landing.law]
    lines = [
        'title = "Landing on points"',
        "[seat]",
        'kind = "annular"',
        f"bore_radius = {_mm(inner)}",
        f"lip_width = {_mm(landing.lip_width)}",
        f"lip_height = {height}",
        'lip_edge_radius = "0 mm"',
        f"outer_radius = {outer}",
        f"thickness = {thickness}",
        f"material = {_material(RIGID if seat is None else seat.material)}",
        f"damping_ratio = {0.02 if seat is None else seat.damping}",
        "[reed]",
        *_reed(landing.outline),
        f"thickness = {_mm(landing.thickness)}",
        f"material = {_material(landing.material)}",
        f"contact_radius = {_mm(landing.lip_radius)}",
        f"contact_width = {_mm(landing.lip_width)}",
        f'release = {{ mode = 1, velocity = "-{landing.speed:g} m/s" }}'
        if landing.outline.clamped
        else f'velocity = "-{landing.speed:g} m/s"',
        "[contact]",
        f"law = {law}",
        f'gap = "{1e6 * landing.gap:.10g} um"',
        f'tilt = "{math.degrees(landing.tilt):.10g} deg"',
        f'tilt_axis = "{math.degrees(landing.tilt_axis):.10g} deg"',
        *([] if rings is None else [f"rings = {rings}"]),
        "[run]",
        f'duration = "{1e6 * duration:.10g} us"',
        f'filter_width = "{1e6 * landing.filter_width:.10g} us"',
        "[accuracy]",
        f'target = "{TARGET}"',
        f"measures = {json.dumps(list(KEYS))}",
    ]
    return "\n".join(lines) + "\n"


def _mm(length: float) -> str:
    return f'"{1e3 * length:.10g} mm"'


def _material(material: Material) -> str:
    return (
        f'{{ young = "{material.young / 1e9:.10g} GPa", poisson = {material.poisson}, '
        f'density = "{material.density:.10g} kg/m^3" }}'
    )


def _reed(outline: Outline) -> Iterator[str]:
    """Yield the lines of a reed's outline."""
    match outline:
        case Sheet():
            side = _mm(outline.width / 2)
            low, end = side.replace('"', '"-', 1), _mm(outline.length)
            yield 'kind = "sheet"'
            yield f'outline = [["0 mm", {low}], [{end}, {low}], [{end}, {side}], ["0 mm", {side}]]'
            yield f'clamped = {{ segment = [["0 mm", {low}], ["0 mm", {side}]] }}'
            yield f'contact_at = [{_mm(outline.contact_at)}, "0 mm"]'
        case Flapper():
            yield 'kind = "flapper"'
            for name in ("root_width", "taper_length", "neck_width", "neck_length", "paddle_diameter"):
                yield f"{name} = {_mm(getattr(outline, name))}"
        case RingPlate():
            yield 'kind = "ring_plate"'
            yield f"outer_diameter = {_mm(outline.outer_diameter)}"
            yield f"inner_diameter = {_mm(outline.inner_diameter)}"


def compare(number: int, landing: Landing, reference: Doubted, rings: int | None) -> list[Row]:
    """Run one landing by the product and return a row for each measure."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "scene.toml"
        path.write_text(write_scene(landing, reference.duration, rings), encoding="utf-8")
        run_scene(load_scene(path), Path(folder), pictures=False, histories=False)
        summary = json.loads((Path(folder) / "summary.json").read_text(encoding="utf-8"))
    stiffness = (RIGID if landing.seat is None else landing.seat.material).young / 1e9
    truths = {
        "impulse": (reference.impulse, reference.impulse_doubt),
        "filtered_peak": (reference.filtered_peak, reference.filtered_peak_doubt),
    }
    rows = []
    for measure, key in KEYS.items():
        bar = summary.get(f"error_bar_{key}")
        rows.append(
            Row(
                number, type(landing.outline).__name__, stiffness, landing.law, round(math.degrees(landing.tilt), 4),
                measure, round(1e6 * landing.filter_width, 3), *truths[measure], summary[key],
                math.nan if bar is None else bar, bool(summary["accuracy_met"]), int(summary["ports"]),
            )
        )  # fmt: skip
    return rows


def table_file(rings: int | None = None) -> Path:
    """Return where the table is."""
    return RESULTS / ("points.csv" if rings is None else f"points_with_{rings}_rings.csv")


def read_rows(rings: int | None = None) -> list[Row]:
    """Return the rows on file."""
    file = table_file(rings)
    if not file.is_file():
        return []
    with file.open(newline="", encoding="utf-8") as lines:
        return [
            Row(
                int(row["number"]), row["reed"], float(row["seat_GPa"]), row["law"], float(row["tilt_deg"]),
                row["measure"], float(row["filter_us"]), float(row["reference"]), float(row["doubt"]),
                float(row["product"]), float(row["bar"]), row["met"] == "True", int(row["ports"]),
            )
            for row in csv.DictReader(lines)
        ]  # fmt: skip


def write_rows(rows: list[Row], rings: int | None = None) -> None:
    """Write the table, by number."""
    names = tuple(Row.__dataclass_fields__)
    with table_file(rings).open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow([*names, "ratio"])
        for row in sorted(rows, key=lambda row: row.number):
            values = [getattr(row, name) for name in names] + [row.ratio]
            writer.writerow([f"{value:.6g}" if isinstance(value, float) else value for value in values])


def main() -> None:
    """Run what is asked for, or what the table lacks."""
    parser = argparse.ArgumentParser()
    parser.add_argument("numbers", nargs="*", type=int)
    parser.add_argument("--rings", type=int)
    asked = parser.parse_args()
    references, rows = read_references(), read_rows(asked.rings)
    numbers = asked.numbers or [number for number in references if number not in {row.number for row in rows}]
    for number in numbers:
        rows = [row for row in rows if row.number != number]
        rows += compare(number, draw_landing(number), references[number][1], asked.rings)
        write_rows(rows, asked.rings)


if __name__ == "__main__":
    main()
