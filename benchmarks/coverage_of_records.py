"""Do the error bars of a seat that was measured cover the truth? Drawn records of bodies in closed form.

    python benchmarks/coverage_of_records.py [--seed SEED] [--records N] [--summary]

appends a row per record to results/coverage_of_records.csv and writes the table into docs/coverage.md. Records that are
there already are not run again. `TUNED` are the seeds on which constants were settled; the table is of `SEED`.
"""

from __future__ import annotations

import argparse
import csv
import sys
import tempfile
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from time import perf_counter
from typing import Final

import numpy as np

import impact
from impact.greens.base import Array, ComplexArray
from seatfem.study.impacts.contact import run_contacts, striker_of
from seatfem.study.runs.pipeline import run_scene
from seatfem.study.scene import load_scene

SEED: Final = 5521
TUNED: Final = (415, 8107)
RECORDS: Final = 36
FILE: Final = Path(__file__).parent / "results" / "coverage_of_records.csv"
PAGE: Final = Path(__file__).parents[1] / "docs" / "coverage.md"
NAME: Final = "coverage_of_records"
WANTED: Final = 0.95
QUANTITIES: Final = ("receptance", "mobility", "accelerance")
UNITS: Final = {"receptance": "m/N", "mobility": "m/s/N", "accelerance": "m/s^2/N"}
KINDS: Final = ("white", "of each line", "by coherence")
KEYS: Final = {
    "static": "seat_static_stiffness_N_per_m",
    "peak": "filtered_peak_force_N",
    "impulse": "impulse_Ns",
    "spring_peak": "spring_filtered_peak_force_N",
    "spring_impulse": "spring_impulse_Ns",
}
"""What is judged, and its key in summary.json."""


@dataclass(frozen=True)
class Record:
    """A drawn body, the record of it, and what strikes it.

    Attributes:
        body: the truth.
        frequency: lines [Hz].
        quantity: what is measured.
        noise: its size: of the root mean square of all lines (white), or of each line.
        kind: one of `KINDS`.
        missed: modes above the band.
        mass: of the striker [kg].
        law: stiffness of the contact [N/m].
        width: of the filter [s].
        duration: of the run [s].
    """

    body: impact.ModalGreens
    frequency: Array
    quantity: str
    noise: float
    kind: str
    missed: int
    mass: float
    law: float
    width: float
    duration: float


def draw_record(index: int, seed: int = SEED) -> Record:
    """Return a record by its number."""
    rng = np.random.default_rng([seed, index])
    lowest = 10 ** rng.uniform(2.8, 3.7)
    count = int(rng.integers(1, 7))
    frequency = np.cumsum(np.append(lowest, lowest * rng.uniform(0.5, 2.0, count - 1)))
    stiffness = 10 ** rng.uniform(6.5, 8.5)
    shares = rng.uniform(0.2, 1.0, count) / np.arange(1, count + 1) ** 1.5
    shares *= (1 - rng.uniform(0.02, 0.2)) / shares.sum()
    omega = 2 * np.pi * frequency
    body = impact.ModalGreens(
        omega,
        10 ** rng.uniform(-2.3, -1.3, count),
        (omega * np.sqrt(shares / stiffness))[:, None],
        impact.Residual.spring((1 - shares.sum()) / stiffness),
    )
    missed = int(rng.integers(1, count)) if count > 1 and rng.random() < 0.5 else 0
    last = frequency[count - missed - 1]
    after = frequency[count - missed] if missed else 2 * last
    highest = last + (after - last) * rng.uniform(0.4, 0.8)
    lines = int(rng.integers(300, 1600))
    first = lowest * rng.uniform(0.02, 0.3)
    width = 2 / highest
    mass = stiffness / omega[0] ** 2 * 10 ** rng.uniform(-0.5, 1.0)
    law = stiffness * 10 ** rng.uniform(-0.5, 1.0)
    joint = stiffness * law / (stiffness + law)
    return Record(
        body,
        np.linspace(first, highest, lines),
        QUANTITIES[index % 3],
        10 ** rng.uniform(-3, np.log10(0.05)),
        KINDS[int(rng.integers(3))],
        missed,
        float(mass),
        float(law),
        float(width),
        float(max(1.5 * np.pi * np.sqrt(mass / joint), 4 * width)),
    )


def measure(record: Record, rng: np.random.Generator) -> tuple[ComplexArray, Array | None]:
    """Return the noisy lines in the unit of the quantity, and their coherence where it is in the file (ten blows)."""
    s = 2j * np.pi * record.frequency
    exact = record.body.transfer(s)[:, 0, 0] * s ** QUANTITIES.index(record.quantity)
    size = np.abs(exact) if record.kind == "of each line" else np.sqrt(np.mean(np.abs(exact) ** 2))
    deviation = record.noise * size * np.ones(len(exact))
    noise = deviation * (rng.normal(size=len(exact)) + 1j * rng.normal(size=len(exact))) / np.sqrt(2)
    if record.kind != "by coherence":
        return exact + noise, None
    ratio = AVERAGES * deviation**2 / np.abs(exact) ** 2
    return exact + noise, 1 / (1 + ratio)


AVERAGES: Final = 10


def write_scene(record: Record, folder: Path, rng: np.random.Generator) -> Path:
    """Write record and scene as a laboratory has them; return the scene's path."""
    values, coherence = measure(record, rng)
    columns = [record.frequency, values.real, values.imag]
    unit = UNITS[record.quantity]
    heads = ["Frequency (Hz)", f"Real ({unit})", f"Imag ({unit})"]
    if coherence is not None:
        heads, columns = [*heads, "Coherence"], [*columns, coherence]
    rows = [";".join(f"{cell:.9e}" for cell in row).replace(".", ",") for row in zip(*columns, strict=True)]
    (folder / "record.csv").write_text("\n".join([";".join(heads), *rows]) + "\n", encoding="utf-8")
    scene = folder / "scene.toml"
    averages = "" if coherence is None else f"averages = {AVERAGES}\n"
    scene.write_text(
        f'[seat]\nkind = "frf"\nfile = "record.csv"\n{averages}'
        f'[reed]\nkind = "rigid_mass"\nmass = "{record.mass:.9g} kg"\nvelocity = "-1 m/s"\n'
        f'[contact]\nlaw = {{ kind = "spring", stiffness = "{record.law:.9g} N/m" }}\n'
        f'[accuracy]\nmeasures = ["filtered_peak", "impulse"]\n'
        f'[run]\nduration = "{record.duration:.9g} s"\nfilter_width = "{record.width:.9g} s"\n',
        encoding="utf-8",
    )
    return scene


@dataclass(frozen=True)
class Row:
    """What came out of one record: relative errors and error bars, nan where there is none; ``refused``: why."""

    seed: int
    index: int
    quantity: str
    noise: float
    kind: str
    modes: int
    missed: int
    found: int
    static_error: float
    static_bar: float
    peak_error: float
    peak_bar: float
    impulse_error: float
    impulse_bar: float
    spring_peak_error: float
    spring_peak_bar: float
    spring_impulse_error: float
    spring_impulse_bar: float
    seconds: float
    refused: str = ""

    def inside(self, name: str) -> bool | None:
        """Return whether an error is within its bar; ``None`` without one."""
        error, bar = (float(getattr(self, f"{name}_{part}")) for part in ("error", "bar"))
        return None if np.isnan(bar) else error <= bar


def run_record(index: int, seed: int = SEED) -> Row:
    """Return what a run says of a record, against the same impact on the body that it is of."""
    record, start = draw_record(index, seed), perf_counter()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        scene = load_scene(write_scene(record, folder, np.random.default_rng([seed, index, 1])))
        about = (seed, index, record.quantity, record.noise, record.kind, len(record.body.omega), record.missed)
        try:
            summary = run_scene(scene, folder / "out", pictures=False, histories=False).summary
        except ValueError as problem:
            return Row(*about, 0, *[np.nan] * 10, perf_counter() - start, str(problem).replace(name, "").strip("/"))
        exact = true_values(scene, record, float(summary["time_step_s"]))  # type: ignore[arg-type]
        found = scene.seat.fitted()  # type: ignore[attr-defined]
        numbers: list[float] = []
        for each, key in KEYS.items():
            value, bar = summary[key], summary.get(f"error_bar_{key}")
            numbers += [abs(float(value) / exact[each] - 1), np.nan if bar is None else float(bar) / abs(exact[each])]
    return Row(*about, int(np.sum(found.frequencies_hz <= record.frequency[-1])), *numbers, perf_counter() - start)


def true_values(scene: object, record: Record, dt: float) -> dict[str, float]:
    """Return what is judged, of the same impact on the true body and on the spring of its static stiffness."""
    static = float(record.body.static_compliance()[0, 0])
    found = {"static": 1 / static}
    for prefix, body in (("", record.body), ("spring_", impact.spring(stiffness=1 / static))):
        touches = run_contacts(scene, striker_of(scene), body, dt / 4)  # type: ignore[arg-type]
        found[f"{prefix}peak"] = impact.measures.filtered_peak_force(touches.seat, record.width)
        found[f"{prefix}impulse"] = impact.measures.impulse(touches.seat)
    return found


def read_rows(path: Path = FILE) -> list[Row]:
    """Return the rows that are there."""
    if not path.exists():
        return []
    kinds = {field.name: {"int": int, "float": float}.get(str(field.type), str) for field in fields(Row)}
    with path.open(newline="", encoding="utf-8") as file:
        return [Row(**{key: kinds[key](value) for key, value in row.items()}) for row in csv.DictReader(file)]


def append(row: Row, path: Path = FILE) -> None:
    """Add a row to the table."""
    new = not path.exists()
    with path.open("a", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [field.name for field in fields(Row)], lineterminator="\n")
        if new:
            writer.writeheader()
        writer.writerow({k: f"{v:.6g}" if isinstance(v, float) else v for k, v in asdict(row).items()})


def share(rows: list[Row], name: str) -> tuple[int, int]:
    """Return how many errors are inside their bars, and how many bars there are."""
    known = [inside for row in rows if (inside := row.inside(name)) is not None]
    return sum(known), len(known)


def table_of(rows: list[Row]) -> str:
    """Return the table of the page."""
    words = {
        "static": "static stiffness",
        "peak": "filtered peak",
        "impulse": "impulse",
        "spring_peak": "spring's filtered peak",
        "spring_impulse": "spring's impulse",
    }
    groups = {"all": rows}
    groups |= {each: [row for row in rows if row.quantity == each] for each in QUANTITIES}
    groups |= {f"noise {each}": [row for row in rows if row.kind == each] for each in KINDS}
    groups["modes above the band"] = [row for row in rows if row.missed]
    groups["noise of 1 % and more"] = [row for row in rows if row.noise >= 0.01]
    lines = ["| records | " + " | ".join(words.values()) + " |", "|---" * (1 + len(words)) + "|"]
    for group, chosen in groups.items():
        cells = [f"{inside} of {known}" for inside, known in (share(chosen, name) for name in words)]
        lines.append(f"| {group} ({len(chosen)}) | " + " | ".join(cells) + " |")
    for title, part in (("median error", "error"), ("median bar", "bar")):
        medians = [np.nanmedian([getattr(row, f"{name}_{part}") for row in rows]) for name in words]
        lines.append(f"| {title} | " + " | ".join(f"{100 * value:.2g} %" for value in medians) + " |")
    refused = [row for row in rows if row.refused]
    right = sum(row.found == row.modes - row.missed for row in rows if not row.refused)
    judged = len(rows) - len(refused)
    end = f"\n{len(refused)} refused; as many modes found as are in the band in {right} of {judged} records."
    return "\n".join(lines) + "\n" + end


def write_page(rows: list[Row]) -> None:
    """Put the table between its markers on the page."""
    sys.path.insert(0, str(PAGE.parent))
    from markers import between

    PAGE.write_text(between(PAGE.read_text(encoding="utf-8"), NAME, table_of(rows)), encoding="utf-8")


def main() -> None:
    """Run what is missing, then write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--records", type=int, default=RECORDS)
    parser.add_argument("--summary", action="store_true", help="of what is there, without a run")
    asked = parser.parse_args()
    path = FILE if asked.seed == SEED else Path(tempfile.gettempdir()) / f"{NAME}_{asked.seed}.csv"
    there = {(row.seed, row.index) for row in read_rows(path)}
    for index in range(0 if asked.summary else asked.records):
        if (asked.seed, index) not in there:
            row = run_record(index, asked.seed)
            append(row, path)
            outside = " ".join(name for name in KEYS if row.inside(name) is False)
            about = f"{index:3} {row.quantity:11} {100 * row.noise:.2g} % {row.kind}: {row.seconds:.1f} s"
            sys.stdout.write(f"{about} {outside} {row.refused}\n")
            sys.stdout.flush()
    rows = read_rows(path)
    sys.stdout.write(table_of(rows) + "\n")
    if asked.seed == SEED:
        write_page(rows)


if __name__ == "__main__":
    main()
