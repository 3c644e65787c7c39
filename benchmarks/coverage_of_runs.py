"""Do the error bars of runs cover the true errors? Random scenes, finer mesh, band, patch, reed, step.

    python benchmarks/coverage_of_runs.py [seed [first [last]]]

appends a line per scene to results/coverage_of_runs.jsonl, leaving out those that are there, then writes
results/coverage_of_runs.csv, a row per scene and measure. Any other seed than 5, the first, which the budget was made
on: scenes that no constant was ever chosen by, in files of their own; from 300 on every kind of striker, release, load
and law is among them, and stoppers.
"""

from __future__ import annotations

import csv
import json
import os
import signal
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from time import perf_counter

import numpy as np
from coverage_of_seats import KINDS, Case, draw_case
from finer_scenes import finest_reference

from impact.progress import silent
from impact.runs.budget import Values
from seatfem.machine.stopwatch import Stopwatch
from seatfem.structures.reduction.modes import ConvergenceError
from seatfem.structures.store import VARIABLE
from seatfem.study.method import MODES, is_given
from seatfem.study.planning.planner import plan_scene
from seatfem.study.runs.rounds import Round, rounds
from seatfem.study.scene import Scene, load_scene
from seatfem.study.scene.measures import all_measures

SEED, FROM_FILES_ON, EVERY_STRIKER_ON, SCENES = 5, 211, 300, 48
FILE = Path(__file__).parent / "results" / "coverage_of_runs.jsonl"
HELD_OUT_FILE = FILE.with_name("coverage_of_runs_held_out.jsonl")
COVERED = 0.95  # wanted share of scene-measures whose true error is inside the bar
ROUND_OFF = 1e-9  # relative: what a true error may be without any source
SEATS = (
    "annular",
    "rod",
    "stopper",
    "spring",
    "conical",
    "annular",
    "bar",
    "stopper",
    "rod",
    "conical",
    "block",
    "annular",
)
FROM_FILES = {4: "cad", 11: "cad", 8: "mesh"}
"""From seed 211 on: of the scenes, those of these numbers, modulo the number of seats, have a seat from a file."""
PARTS = ("stopper", "conical_seat", "flat_seat", "bar")
MESHES = Path(__file__).parents[1] / "meshes"
MEASURES = ("impulse", "filtered_peak", "contact_duration", "seat_displacement", "stress")
COLUMNS = (
    *("seed", "index", "seat", "level", "striker", "target", "met", "rounds"),
    *("measure", "value", "bar", "true", "inside"),
)
LONGEST = 240  # s of processor time for a scene and its reference


@dataclass(frozen=True)
class Verdict:
    """One scene: values, bars and true errors by measure (SI)."""

    seed: int
    index: int
    seat: str
    level: str
    striker: str
    stated: bool
    target: float
    met: bool
    rounds: int
    values: Mapping[str, float]
    bars: Mapping[str, float]
    true: Mapping[str, float]
    seconds: float

    @classmethod
    def of(
        cls,
        done: Round,
        number: tuple[int, int],
        values: Mapping[str, float],
        bars: Mapping[str, float],
        exact: Mapping[str, float],
        *,
        seconds: float,
        stated: bool = False,
        striker: str = "",
    ) -> Verdict:
        """Of a round of the scene of this seed and index, against the values of its reference."""
        scene = done.plan.scene
        return cls(
            *number,
            seat=scene.seat.kind,
            level=done.plan.level,
            striker=striker or scene.reed.kind,
            stated=stated,
            target=scene.accuracy.target,
            met=done.met,
            rounds=done.number,
            values=dict(values),
            bars={name: bars[name] for name in values},
            true={name: abs(values[name] - exact[name]) for name in values},
            seconds=seconds,
        )

    def inside(self, measure: str) -> bool:
        """Whether the true error is within the bar."""
        return self.true[measure] <= self.bars[measure] + ROUND_OFF * abs(self.values[measure])


def draw_scene(index: int, seed: int = SEED) -> str:
    """Scene number ``index`` as TOML: seats by turns, all else at random."""
    rng = np.random.default_rng([seed, index])
    kind = kind_of(index, seed)
    stated = kind in ("bar", "block", "cad", "mesh") or rng.random() < 0.4
    seat = _seat(kind, index, seed, rng, stated)
    if seed >= EVERY_STRIKER_ON:
        striker, measures = _any_striker(rng, stated)
    else:
        striker, measures = _cantilever(rng, stated) if rng.random() < 0.55 else _mass(rng)
    asked = sorted(rng.choice(measures, size=rng.integers(1, len(measures) + 1), replace=False))
    accuracy = f"target = {10 ** rng.uniform(-2.2, -1):.6f}\nmeasures = {json.dumps(asked)}\n"
    return f'{seat}{striker}filter_width = "{rng.uniform(2, 10):.6f} us"\n[accuracy]\n{accuracy}'


def kind_of(index: int, seed: int) -> str:
    """Of the seat of a scene."""
    turn = index % len(SEATS)
    return FROM_FILES.get(turn, SEATS[turn]) if seed >= FROM_FILES_ON else SEATS[turn]


def _file_seat(kind: str, material: str, damping: float, rng: np.random.Generator) -> str:
    """A CAD part, or a mesh, with a band that its size can afford."""
    size = rng.uniform(2.5, 4.0)
    band = f'bandwidth = "{rng.uniform(80, 200):.3f} kHz", tolerance = {rng.uniform(0.01, 0.03):.4f}'
    of_material = material.strip().replace("\n", ", ")
    rest = f"damping_ratio = {max(damping, 0.01):.6f}\ngreens = {{ {band} }}\nmaterial = {{ {of_material} }}\n"
    if kind == "mesh":
        return f'[seat]\nkind = "mesh"\nfile = "{MESHES / "annular_seat.msh"}"\n{rest}'
    part = MESHES / f"{PARTS[rng.integers(len(PARTS))]}.step"
    mesh = f'mesh = {{ size = "{size:.3f} mm", contact_size = "{size * rng.uniform(0.25, 0.4):.3f} mm" }}\n'
    return f'[seat]\nkind = "cad"\nfile = "{part}"\n{mesh}{rest}'


def _seat(kind: str, index: int, seed: int, rng: np.random.Generator, stated: bool) -> str:
    if kind == "spring":
        return f'[seat]\nkind = "spring"\nstiffness = "{10 ** rng.uniform(6, 9):.6g} N/m"\n'
    damping = rng.uniform(0.005, 0.15) if rng.random() < 0.85 else 0.0
    material = f'young = "{rng.uniform(70, 220):.6f} GPa"\ndensity = "{rng.uniform(2600, 8000):.6f} kg/m^3"\n'
    if kind in ("cad", "mesh"):
        return _file_seat(kind, material, damping, rng)
    if kind == "rod":
        size = f'length = "{rng.uniform(5, 60):.6f} mm"\narea = "{10 ** rng.uniform(-0.5, 1.5):.6g} mm^2"\n'
        return f'[seat]\nkind = "rod"\n{material}{size}damping_ratio = {damping:.6f}\n'
    number = next(i for i in range(6 * index, 6 * index + 6) if tuple(KINDS)[i % len(KINDS)] == kind)
    case = draw_case(number, seed)
    text = case.toml().partition("[reed]")[0]
    return text if stated else _opened(text, case)


def _opened(text: str, case: Case) -> str:
    """Without what the planner may choose."""
    chosen = ("mesh =", "greens =", "model =")
    return "".join(line + "\n" for line in text.splitlines() if not line.startswith(chosen))


def _cantilever(rng: np.random.Generator, stated: bool) -> tuple[str, tuple[str, ...]]:
    length, thickness, tip = rng.uniform(12, 40), rng.uniform(0.15, 0.6), 10 ** rng.uniform(-0.7, 0.3)
    at = length * (1.0 if rng.random() < 0.5 else rng.uniform(0.7, 1.0))
    quarter = np.pi / 2 / (3.516 * np.sqrt(200e9 / 7850 / 12) * 1e-3 * thickness / (1e-3 * length) ** 2)
    modes = f"n_modes = {rng.integers(8, 60)}\n" if stated else ""
    text = f"""[reed]
kind = "cantilever"
length = "{length:.6f} mm"
width = "{rng.uniform(5, 12):.6f} mm"
thickness = "{thickness:.6f} mm"
material = {{ young = "200 GPa", density = "7850 kg/m^3" }}
damping_ratio = {rng.uniform(0.005, 0.05):.6f}
{modes}release = {{ tip_deflection = "{tip:.6f} mm" }}
[contact]
at = "{at:.6f} mm"
gap = "{tip * rng.uniform(0, 0.2):.6f} mm"
[run]
duration = "{min(quarter * rng.uniform(1.3, 2.2), 4e-3):.9f} s"
"""
    return text, MEASURES


def _mass(rng: np.random.Generator) -> tuple[str, tuple[str, ...]]:
    text = f"""[reed]
kind = "rigid_mass"
mass = "{10 ** rng.uniform(-1, 1.3):.6f} g"
velocity = "-{10 ** rng.uniform(-1, 0.7):.6f} m/s"
[run]
duration = "{rng.uniform(60, 300):.6f} us"
"""
    return text, MEASURES[:-1]


def _any_striker(rng: np.random.Generator, stated: bool) -> tuple[str, tuple[str, ...]]:
    draw = rng.choice([_beam, _mass, _bar, _rod], p=[0.6, 0.18, 0.11, 0.11])
    text, measures = draw(rng, stated) if draw is _beam else draw(rng)
    stiffness = 10 ** rng.uniform(6, 8.5)
    laws = {
        "signorini": "",
        "spring": f'law = {{ kind = "spring", stiffness = "{stiffness:.4g} N/m" }}\n',
        "hertz": f'law = {{ kind = "hertz", stiffness = "{1e3 * stiffness:.4g} N/m^1.5" }}\n',
        "hunt_crossley": f'law = {{ kind = "hunt_crossley", stiffness = "{1e3 * stiffness:.4g} N/m^1.5", '
        f'damping = "{rng.uniform(0.05, 0.4):.3f} s/m" }}\n',
    }
    law = laws[rng.choice(list(laws), p=[0.6, 0.16, 0.12, 0.12])]
    return text.replace("[contact]\n", f"[contact]\n{law}"), measures


def _beam(rng: np.random.Generator, stated: bool) -> tuple[str, tuple[str, ...]]:
    """A beam of any kind, released, in a mode, or pressed on; some meet a stopper."""
    kind = rng.choice(["cantilever", "timoshenko", "tip_mass", "clamped_clamped"])
    length, width = rng.uniform(12, 40), rng.uniform(5, 12)
    thickness = rng.uniform(0.15, 0.6) * (3.0 if kind == "timoshenko" else 1.0)
    held, tip = 3.516 if kind != "clamped_clamped" else 22.37, 10 ** rng.uniform(-0.7, 0.3)
    if kind == "clamped_clamped":
        tip *= 0.2
    omega = held * np.sqrt(200e9 / 7850 / 12) * 1e-3 * thickness / (1e-3 * length) ** 2
    own = ""
    if kind == "tip_mass":
        mass = 7850e-9 * length * width * thickness  # kg of the reed
        share = rng.uniform(0.05, 1.0)
        own, omega = f'tip_mass = "{1e3 * share * mass:.6f} g"\n', omega / np.sqrt(1 + 4 * share)
    ways = ("release", "mode", "pressed", "loaded")
    way = rng.choice(ways, p=[0.5, 0.2, 0.2, 0.1])
    stiffness = 7850e-9 * thickness * 1e6 * omega**2 * 1e-3 * tip  # Pa that opens it by about the tip's deflection
    moved = {
        "release": f'release = {{ tip_deflection = "{tip:.6f} mm" }}\n',
        "mode": f'release = {{ mode = {rng.integers(1, 3)}, deflection = "{tip:.6f} mm" }}\n',
        "pressed": f'release = {{ tip_deflection = "{tip:.6f} mm" }}\npressure = "-{0.3 * stiffness:.6g} Pa"\n',
        "loaded": f'pressure = "-{stiffness:.6g} Pa"\n',
    }[way]
    gap = tip * rng.uniform(0, 0.2) if way != "loaded" else tip * rng.uniform(0.1, 0.6)
    at = length * (1.0 if rng.random() < 0.5 else rng.uniform(0.7, 1.0)) * (0.5 if kind == "clamped_clamped" else 1.0)
    stopper = ""
    if kind != "clamped_clamped" and way in ("release", "pressed") and rng.random() < 0.25:
        where, far = rng.uniform(0.5, 1.0) * length, rng.uniform(0.3, 0.9)
        k = 10 ** rng.uniform(5.5, 7.5)
        stands = tip * (where / length) ** 2 * (3 - where / length) / 2
        stopper = (
            f'[stopper]\nkind = "spring"\nstiffness = "{k:.5g} N/m"\nat = "{where:.6f} mm"\n'
            f'gap = "{stands * (1 + 0.2 * far):.6f} mm"\n'
        )
    modes = f"n_modes = {rng.integers(8, 60)}\n" if stated else ""
    text = f"""[reed]
kind = "{kind}"
length = "{length:.6f} mm"
width = "{width:.6f} mm"
thickness = "{thickness:.6f} mm"
{own}material = {{ young = "200 GPa", density = "7850 kg/m^3" }}
damping_ratio = {rng.uniform(0.005, 0.05):.6f}
{modes}{moved}{stopper}[contact]
at = "{at:.6f} mm"
gap = "{gap:.6f} mm"
[run]
duration = "{min(np.pi / 2 / omega * rng.uniform(1.3, 2.2) * (3 if stopper else 1), 4e-3):.9f} s"
"""
    return text, MEASURES if kind == "cantilever" else MEASURES[:-1]  # whose stress is known


def _bar(rng: np.random.Generator) -> tuple[str, tuple[str, ...]]:
    """Finite elements strike: a clamped bar, let go from a deflection."""
    length, side, opening = rng.uniform(8, 25), rng.uniform(2, 5), rng.uniform(0.5, 4)
    text = f"""[reed]
kind = "bar"
length = "{length:.6f} mm"
width = "{side:.6f} mm"
height = "{side:.6f} mm"
material = {{ young = "{rng.uniform(70, 220):.4f} GPa", density = "{rng.uniform(2600, 8000):.4f} kg/m^3" }}
damping_ratio = {rng.uniform(0.01, 0.1):.6f}
model = "sector"
mesh = {{ size = "{side * rng.uniform(0.35, 0.6):.4f} mm" }}
greens = {{ bandwidth = "{rng.uniform(150, 350):.3f} kHz", tolerance = {rng.uniform(0.005, 0.03):.4f} }}
deflection = "{opening:.6f} um"
[contact]
gap = "{opening * rng.uniform(0, 0.5):.6f} um"
[run]
duration = "{max(rng.uniform(1.5, 4) * 2e-3 * length / 5100, 12e-6):.9f} s"
"""
    return text, MEASURES[:-1]


def _rod(rng: np.random.Generator) -> tuple[str, tuple[str, ...]]:
    """A free rod, thrown."""
    length = rng.uniform(5, 40)
    text = f"""[reed]
kind = "rod"
young = "{rng.uniform(70, 220):.4f} GPa"
density = "{rng.uniform(2600, 8000):.4f} kg/m^3"
length = "{length:.6f} mm"
area = "{10 ** rng.uniform(-0.3, 1.5):.6g} mm^2"
damping_ratio = {rng.uniform(0.0, 0.05):.6f}
far_end = "free"
velocity = "-{10 ** rng.uniform(-1, 0.5):.6f} m/s"
[contact]
[run]
duration = "{rng.uniform(60, 200):.6f} us"
"""
    return text, MEASURES[:-1]


def judge(index: int, seed: int = SEED) -> Verdict:
    """One scene: run as planned, and its reference."""
    start = perf_counter()
    with written(draw_scene(index, seed)) as (scene, folder):
        *_, done = rounds(plan_scene(scene), folder, Stopwatch(), silent)
        exact = finest_reference(done)[1].values
    stated = is_given(scene, MODES) or scene.seat.kind in ("bar", "block", "cad", "mesh")
    values, seconds = bare_values(done), perf_counter() - start
    bars = {name: done.left.bar(name) for name in values}
    return Verdict.of(done, (seed, index), values, bars, exact, stated=stated, seconds=seconds)


@contextmanager
def written(text: str) -> Iterator[tuple[Scene, Path]]:
    """The scene of a text, in a folder of its own with a store of its own."""
    with tempfile.TemporaryDirectory() as folder:
        os.environ[VARIABLE] = f"{folder}/store"
        path = Path(folder) / "scene.toml"
        path.write_text(text, encoding="utf-8")
        yield load_scene(path), Path(folder)


def bare_values(done: Round) -> Values:
    """The measures of a whole run, whatever landings it has."""
    return {name: value for name, value in done.left.values.items() if name in all_measures()}


def read(path: Path = FILE) -> list[Verdict]:
    """The scenes so far, by number."""
    if not path.exists():
        return []
    lines = path.read_text(encoding="utf-8").splitlines()
    return sorted((Verdict(**json.loads(line)) for line in lines), key=lambda verdict: (verdict.seed, verdict.index))


def coverage(verdicts: Sequence[Verdict]) -> tuple[float, float]:
    """Shares of scene-measures, and of scenes with all their measures, whose true error is inside the bar."""
    inside = [[v.inside(measure) for measure in v.values] for v in verdicts]
    every = [one for scene in inside for one in scene]
    return sum(every) / len(every), sum(all(scene) for scene in inside) / len(inside)


def write_table(verdicts: Sequence[Verdict], path: Path) -> None:
    """A row per scene and measure."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for v in verdicts:
            for name in v.values:
                numbers = (f"{part[name]:.6g}" for part in (v.values, v.bars, v.true))
                row = (v.seed, v.index, v.seat, v.level, v.striker, f"{v.target:.3g}", v.met, v.rounds, name)
                writer.writerow([*row, *numbers, v.inside(name)])


def line(v: Verdict) -> str:
    """For the log."""

    def one(name: str) -> str:
        scale = abs(v.values[name]) or 1.0
        mark = "" if v.inside(name) else " OUT"
        return f"{name} {v.true[name] / scale:.1e}/{v.bars[name] / scale:.1e}{mark}"

    head = f"{v.index:3d} {v.seat}/{v.level} {v.striker} target {v.target:.2g} met {v.met} {v.rounds}: "
    return head + ", ".join(one(name) for name in v.values) + f"; {v.seconds:.0f} s"


class TooLong(BaseException):
    """Not to be caught by what runs."""


def stop(signum: int, frame: object) -> None:
    raise TooLong


def cover(
    path: Path,
    seed: int,
    indices: range,
    judge: Callable[[int, int], Verdict],
    longest: int,
    refused: type[Exception] = ConvergenceError,
) -> None:
    """Judge the scenes of a seed that are not in the file, each within seconds of processor time; table and shares.

    ``refused``: what a scene that is not to be judged ends with; by default, stated band, tolerance and duration that
    no Krylov space holds.
    """
    signal.signal(signal.SIGPROF, stop)
    done = {(v.seed, v.index) for v in read(path)}
    for index in indices:
        if (seed, index) not in done:
            signal.setitimer(signal.ITIMER_PROF, longest)
            try:
                verdict = judge(index, seed)
            except refused as refusal:
                print(f"{index:3d} refused: {refusal}", flush=True)  # noqa: T201
                continue
            except TooLong:
                print(f"{index:3d} stopped: it or its reference takes more than {longest} s", flush=True)  # noqa: T201
                continue
            finally:
                signal.setitimer(signal.ITIMER_PROF, 0)
            with path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(asdict(verdict)) + "\n")
            print(line(verdict), flush=True)  # noqa: T201
    write_table(read(path), path.with_suffix(".csv"))
    verdicts = [v for v in read(path) if v.seed == seed]
    measures, scenes = coverage(verdicts)
    count = sum(len(v.values) for v in verdicts)
    words = f"{measures:.1%} inside (aim {COVERED:.0%}), all measures of a scene in {scenes:.1%}"
    print(f"{count} measures of {len(verdicts)} scenes: {words}")  # noqa: T201


def chosen(seed: int, scenes: int) -> tuple[int, range]:
    """The seed and the scenes of the command line, where it names any."""
    given = [int(word) for word in sys.argv[1:]]
    seed, first, last = (*given, *(seed, 0, scenes)[len(given) :])
    return seed, range(first, last)


def main() -> None:
    """Run what is missing, write the table, print the shares."""
    seed, numbers = chosen(SEED, SCENES)
    cover(FILE if seed == SEED else HELD_OUT_FILE, seed, numbers, judge, LONGEST)


if __name__ == "__main__":
    main()
