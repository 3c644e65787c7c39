"""Does the error estimate of a seat's Green's function cover the true error? Random seats, two finer meshes.

    python benchmarks/coverage_of_seats.py [seed [first [last]]]

appends a row per seat to results/coverage_of_seats.csv (seeds 20 and 21, which led to `MESH_SAFETY` and
`refinement_of`) or, for any other seed, to results/coverage_of_seats_held_out.csv; seats that are there already are not
run again.
"""

from __future__ import annotations

import csv
import sys
import tempfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from time import perf_counter

import numpy as np

from impact.greens.base import GreensFunction
from seatfem.structures.kinds.drawn import Drawn
from seatfem.structures.method import COARSENING, PER_WAVELENGTH, Level
from seatfem.structures.reduction.modes import ConvergenceError
from seatfem.structures.solved import Solved
from seatfem.study.impacts.contact import seat_of
from seatfem.study.method import stated_method
from seatfem.study.scene import Scene, load_scene

SEED, SEATS = 20, 30
FITTED, HELD_OUT = (SEED, 21), (22, 31)  # the seats of the last two had no part in making the estimate
FILE = Path(__file__).parent / "results" / "coverage_of_seats.csv"
HELD_OUT_FILE = FILE.with_name("coverage_of_seats_held_out.csv")
FINER = COARSENING**2
COVERED, TIGHT = 0.95, 0.80  # wanted shares: true <= estimate, estimate <= 10 true

Draw = Callable[[np.random.Generator], tuple[str, float]]


@dataclass(frozen=True)
class Case:
    """A random seat: its geometry as lines of TOML, material, band, and the mesh asked for (SI)."""

    kind: str
    level: Level
    geometry: str
    young: float
    poisson: float
    density: float
    damping_ratio: float
    bandwidth: float
    tolerance: float
    size: float
    contact_size: float
    order: int
    pulses: float  # duration of the run, in pulse widths
    reduction: str = "auto"

    def finer(self, stricter: float, reduction: str = "auto") -> Case:
        """The reference: two levels finer, the tolerance divided by ``stricter``; the band is what is judged, and the
        rings are the port whose g it is."""
        size, contact_size, tolerance = self.size / FINER, self.contact_size / FINER, self.tolerance / stricter
        return replace(self, size=size, contact_size=contact_size, tolerance=tolerance, reduction=reduction)

    def toml(self) -> str:
        """The scene file."""
        material = f'young = "{self.young:.17g} Pa", poisson = {self.poisson:.6f}, density = "{self.density} kg/m^3"'
        size, contact = f"{self.size:.17g} m", f"{self.contact_size:.17g} m"
        return f"""
[seat]
kind = "{self.kind}"
model = "{self.level}"
{self.geometry}
material = {{ {material} }}
damping_ratio = {self.damping_ratio:.6f}
mesh = {{ size = "{size}", contact_size = "{contact}", order = {self.order} }}
greens = {{ bandwidth = "{self.bandwidth:.17g} Hz", tolerance = {self.tolerance:.6f}, method = "{self.reduction}" }}
[reed]
kind = "rigid_mass"
mass = "10 g"
velocity = "-1 m/s"
[contact]
law = "signorini"
[run]
duration = "{self.pulses / self.bandwidth:.17g} s"
"""


@dataclass(frozen=True)
class Row:
    """What came out for one seat; errors relative to the largest value of g after the pulse."""

    seed: int
    index: int
    kind: str
    level: str
    order: int
    young: float
    poisson: float
    damping_ratio: float
    bandwidth: float
    tolerance: float
    size: float
    unknowns: int
    reference_unknowns: int
    reduction: float
    mesh: float
    true: float
    seconds: float

    @property
    def estimate(self) -> float:
        """Reduction and mesh together."""
        return self.reduction + self.mesh


def annular(rng: np.random.Generator) -> tuple[str, float]:
    bore, lip = rng.uniform(2, 5), rng.uniform(0.8, 2)
    edge = lip * rng.uniform(0.2, 0.35) if rng.random() < 0.5 else 0.0
    height = edge + rng.uniform(0.2, 0.6)
    outer, thickness = bore + lip + rng.uniform(2, 8), rng.uniform(3, 9)
    lines = _lines(
        bore_radius=bore, lip_width=lip, lip_height=height, lip_edge_radius=edge, outer_radius=outer,
        thickness=thickness,
    )  # fmt: skip
    return lines, np.sqrt((outer - bore) * thickness)


def conical(rng: np.random.Generator) -> tuple[str, float]:
    bore, face = rng.uniform(2, 5), rng.uniform(1, 2.5)
    outer, thickness = bore + face + rng.uniform(2, 8), face + rng.uniform(2, 6)
    angle = f'half_angle = "{rng.uniform(25, 65):.6f} deg"\n'
    lines = _lines(
        bore_radius=bore, face_width=face, contact_width=face * rng.uniform(0.3, 1), outer_radius=outer,
        thickness=thickness,
    )  # fmt: skip
    return angle + lines, np.sqrt((outer - bore) * thickness)


def stopper(rng: np.random.Generator) -> tuple[str, float]:
    radius, thickness = rng.uniform(3, 8), rng.uniform(3, 8)
    lines = _lines(radius=radius, thickness=thickness, contact_radius=radius * rng.uniform(0.2, 0.8))
    dome = _lines(dome_radius=radius * rng.uniform(4, 10)) if rng.random() < 0.5 else ""
    return lines + dome, np.sqrt(radius * thickness)


def bar(rng: np.random.Generator) -> tuple[str, float]:
    length, width, height = rng.uniform(8, 20), rng.uniform(3, 6), rng.uniform(3, 6)
    return _lines(length=length, width=width, height=height), np.cbrt(length * width * height / 4)


def block(rng: np.random.Generator) -> tuple[str, float]:
    width, depth, thickness = rng.uniform(6, 14), rng.uniform(6, 14), rng.uniform(4, 9)
    patch = {"patch_width": width * rng.uniform(0.2, 0.6), "patch_depth": depth * rng.uniform(0.2, 0.6)}
    lines = _lines(width=width, depth=depth, thickness=thickness, **patch)
    return lines, np.cbrt(width * depth * thickness / 4)


def plate(rng: np.random.Generator) -> tuple[str, float]:
    ports, radius, land, thickness = (
        int(rng.integers(3, 7)),
        rng.uniform(2, 3),
        rng.uniform(0.8, 1.2),
        rng.uniform(3, 5),
    )
    pitch, margin = 2 * (radius + land) + rng.uniform(1.5, 3), radius + land + rng.uniform(3, 5)
    lines = _lines(
        port_radius=radius, pitch=pitch, margin=margin, thickness=thickness, land_width=land, clamp_width=1.5
    )
    return f"ports = {ports}\n" + lines, thickness


KINDS: Mapping[str, tuple[Level, Draw]] = {
    "annular": ("axisymmetric", annular),
    "bar": ("sector", bar),
    "conical": ("axisymmetric", conical),
    "block": ("sector", block),
    "stopper": ("axisymmetric", stopper),
    "plate": ("sector", plate),
}
ACROSS: Mapping[Level, tuple[float, float]] = {"axisymmetric": (6, 14), "sector": (2, 3.5)}
"""Elements across a typical length of the body, least and most."""


def draw_case(index: int, seed: int = SEED) -> Case:
    """Seat number ``index``: the kinds by turns, all else at random.

    The band follows from the element size: 0.7 to 1.5 times the elements per shear wavelength that a scene gets by
    default, twice that of first order.
    """
    rng = np.random.default_rng([seed, index])
    kind = tuple(KINDS)[index % len(KINDS)]
    level, draw = KINDS[kind]
    geometry, length = draw(rng)
    order = int(rng.choice([1, 2], p=[0.25, 0.75]))
    young, poisson, density = 1e9 * rng.uniform(70, 220), rng.uniform(0.2, 0.4), round(rng.uniform(2600, 8000))
    size = 1e-3 * length / rng.uniform(*ACROSS[level])
    shear_speed = np.sqrt(young / (2 * (1 + poisson) * density))
    per_wavelength = PER_WAVELENGTH[level] * rng.uniform(0.7, 1.5) * (3 - order)
    return Case(
        kind=kind,
        level=level,
        geometry=geometry,
        young=young,
        poisson=poisson,
        density=density,
        damping_ratio=rng.uniform(0, 0.2) if rng.random() < 0.85 else 0.0,
        bandwidth=float(shear_speed / (per_wavelength * size)),
        tolerance=float(10 ** rng.uniform(-3, -1.5)),
        size=size,
        contact_size=size * rng.uniform(0.3, 0.8),
        order=order,
        pulses=rng.uniform(15, 60),
    )


def measure(index: int, seed: int = SEED) -> Row:
    """One seat: its estimate, and its true error against the reference."""
    case, start = draw_case(index, seed), perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "seat.toml"
        scene = _scene(case, path)
        answer, reference = seat_of(scene), _reference(case, path)
    known = answer.greens.error_estimate
    if known.reduction is None or known.mesh is None:
        raise AssertionError(f"seat {index}: no complete error estimate, {known}")
    return Row(
        seed=seed,
        index=index,
        kind=case.kind,
        level=str(answer.about["seat_level"]),
        order=case.order,
        young=case.young,
        poisson=case.poisson,
        damping_ratio=case.damping_ratio,
        bandwidth=case.bandwidth,
        tolerance=case.tolerance,
        size=case.size,
        unknowns=int(str(answer.about["seat_dof"])),
        reference_unknowns=int(str(reference.about["seat_dof"])),
        reduction=known.reduction,
        mesh=known.mesh,
        true=difference(scene, answer.greens, reference.greens),
        seconds=perf_counter() - start,
    )


def _reference(case: Case, path: Path) -> Solved:
    """A tenth of the tolerance, or a fifth or less where the Krylov space has no room for that; or the modes."""
    for stricter in (10, 5, 2.5):
        with suppress(ConvergenceError):
            return seat_of(_scene(case.finer(stricter), path), mesh_error=False)
    return seat_of(_scene(case.finer(2.5, "modes"), path), mesh_error=False)


def difference(scene: Scene, greens: GreensFunction, reference: GreensFunction) -> float:
    """Largest difference after the Hann pulse of the band, relative to the largest value of the reference."""
    assert isinstance(scene.seat, Drawn)
    width = 1.0 / scene.seat.greens.bandwidth
    t = np.linspace(0.0, min(scene.seat.memory(stated_method(scene).seat, scene.run.duration), 60 * width), 600)
    g, exact = (each.filtered(t, width) for each in (greens, reference))
    return float(np.max(np.abs(g - exact)) / np.max(np.abs(exact)))


def read_rows(path: Path = FILE) -> list[Row]:
    """The rows so far, by index."""
    if not path.exists():
        return []
    types = {"int": int, "float": float, "str": str}
    with path.open(newline="", encoding="utf-8") as file:
        rows = [Row(**{f.name: types[str(f.type)](line[f.name]) for f in fields(Row)}) for line in csv.DictReader(file)]
    return sorted(rows, key=lambda row: (row.seed, row.index))


def shares(rows: Sequence[Row]) -> tuple[float, float]:
    """Share of seats whose true error is at most the estimate, and whose estimate is at most ten times the true one."""
    covered = [row.true <= row.estimate for row in rows]
    tight = [row.estimate <= 10 * row.true for row in rows]
    return sum(covered) / len(rows), sum(tight) / len(rows)


def _lines(**millimetres: float) -> str:
    return "".join(f'{key} = "{value:.6f} mm"\n' for key, value in millimetres.items())


def _scene(case: Case, path: Path) -> Scene:
    path.write_text(case.toml(), encoding="utf-8")
    return load_scene(path)


def _append(row: Row, path: Path) -> None:
    new = not path.exists()
    with path.open("a", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [f.name for f in fields(Row)], lineterminator="\n")
        if new:
            writer.writeheader()
        writer.writerow({key: f"{v:.6g}" if isinstance(v, float) else v for key, v in asdict(row).items()})


def main() -> None:
    """Run what is missing of one seed, print the shares."""
    given = [int(word) for word in sys.argv[1:4]]
    seed, first, last = (*given, *(SEED, 0, SEATS)[len(given) :])
    file = FILE if seed in FITTED else HELD_OUT_FILE
    done = {(row.seed, row.index) for row in read_rows(file)}
    for index in range(first, last):
        if (seed, index) not in done:
            try:
                row = measure(index, seed)
            except ConvergenceError as refusal:  # no space and no number of modes holds the reference
                print(f"{index:3d} without a reference: {refusal}", flush=True)  # noqa: T201
                continue
            _append(row, file)
            print(_line(row), flush=True)  # noqa: T201
    rows = [row for row in read_rows(file) if row.seed == seed]
    covered, tight = shares(rows)
    print(f"{len(rows)} seats: true <= estimate in {covered:.0%} (aim: {COVERED:.0%}),")  # noqa: T201
    print(f"estimate <= 10 true in {tight:.0%} (aim: {TIGHT:.0%})")  # noqa: T201


def _line(row: Row) -> str:
    sizes = f"{row.unknowns} and {row.reference_unknowns} unknowns"
    errors = f"true {row.true:.2g}, estimate {row.estimate:.2g} ({row.reduction:.2g} + {row.mesh:.2g})"
    return f"{row.index:3d} {row.kind} order {row.order}: {errors}; {sizes}, {row.seconds:.1f} s"


if __name__ == "__main__":
    main()
