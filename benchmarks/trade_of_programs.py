"""Error against time of seatfem and of other programs, measured: docs/trade_programs.md.

    PYTHONPATH=. python benchmarks/trade_of_programs.py [scene ...]

measures what the table lacks: every point is a process from start to end, with an empty store and one thread, and some
rows of results/trade_of_programs.csv. `trade_of_programs_page.py` then writes the page.
"""

from __future__ import annotations

import json
import math
import os
import resource
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Final

from points.flapper_landing import GRIDS
from table import RESULTS, append_rows, read_rows

from seatfem.structures.cache import VARIABLE

HERE: Final = Path(__file__).parent
ROOT: Final = HERE.parent
FILE: Final = RESULTS / "trade_of_programs.csv"
DIGITS: Final = 9
LONGEST: Final = 600  # s for a point
ONE_THREAD: Final = dict.fromkeys(
    ("OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS"), "1"
)
OURS, PLAIN, POINTS, CALCULIX, SICONOS = "seatfem", "plain program", "plate on points", "CalculiX", "Siconos"
MODULES: Final = {PLAIN: "plain_program", SICONOS: "siconos_landing"}
WORDS: Final = {
    "impulse_Ns": "impulse",
    "filtered_peak_force_N": "peak force",
    "peak_reed_stress_after_contact_Pa": "reed stress after first contact",
    "stress_at_contact_Pa": "stress at the contact",
    "life_margin": "fatigue margin",
    "gas_mass_forward_kg": "mass through the valve",
}
IMPULSE, PEAK, STRESS, CONTACT_STRESS, MARGIN, MASS = WORDS


@dataclass(frozen=True)
class Judged:
    """A scene with the keys that are compared, the program that is the reference and its finest level.

    ``besides``: levels of other programs. ``targets``: asked of ours.
    """

    name: str
    title: str
    keys: tuple[str, ...]
    reference: str
    finest: int
    besides: tuple[tuple[str, int], ...] = ()
    targets: tuple[float, ...] = (0.3, 0.1, 0.03, 0.01)

    @property
    def levels(self) -> list[tuple[str, int]]:
        """Return every other program that is run, with its level."""
        return [*((self.reference, level) for level in range(self.finest + 1)), *self.besides]


BY_SICONOS: Final = tuple((SICONOS, level) for level in range(2, 6))
SCENES: Final = (
    Judged("beam_on_rod", "Beam reed on a rod", (IMPULSE, PEAK, STRESS, CONTACT_STRESS), PLAIN, 9),
    Judged("mass_on_lip", "Rigid mass on the lip of a steel seat", (IMPULSE, PEAK), PLAIN, 7, BY_SICONOS),
    Judged("tilted_flapper", "Flapper that lands tilted", (IMPULSE, PEAK), POINTS, len(GRIDS) - 1),
    Judged("repeated_landing", "Fatigue margin of a beam reed", (MARGIN,), PLAIN, 8),
    Judged("gas_valve", "Suction reed, driven by the gas", (IMPULSE, PEAK, MASS), PLAIN, 5),
    Judged("film_landing", "Landing through a squeeze film", (IMPULSE, PEAK), PLAIN, 9),
    Judged("sprung_ring", "Ring valve with a spring", (IMPULSE, PEAK), PLAIN, 6),
    Judged("mass_on_slot", "Rigid mass on the lip of a CAD seat", (IMPULSE, PEAK), PLAIN, 6, targets=(0.3, 0.1, 0.03)),
)


@dataclass(frozen=True)
class Row:
    """One number of one point; ``setting`` is a target or a level, ``bar`` what the program says of its error."""

    scene: str
    program: str
    setting: str
    wall_s: float
    processor_s: float
    key: str
    value: float
    bar: float


def scene_text(name: str) -> str:
    """Return a scene as a file, with the strengths that it names by their whole path."""
    text = (HERE / "programs" / f"{name}.toml").read_text(encoding="utf-8")
    return text.replace('"../../', f'"{ROOT.as_posix()}/')


def run_process(words: Sequence[str], folder: Path) -> tuple[str, float, float]:
    """Run a command from an empty store; return what it prints, wall and processor time [s]."""
    with tempfile.TemporaryDirectory() as store:
        environment = {**os.environ, **ONE_THREAD, VARIABLE: store, "PYTHONPATH": str(ROOT)}
        used, start = resource.getrusage(resource.RUSAGE_CHILDREN), perf_counter()
        ended = subprocess.run(
            [sys.executable, *words], env=environment, cwd=folder, capture_output=True, text=True, timeout=LONGEST
        )
        wall, after = perf_counter() - start, resource.getrusage(resource.RUSAGE_CHILDREN)
    if ended.returncode > 1:  # 1: the target was missed
        raise SystemExit(f"{' '.join(words)}: {ended.stderr}")
    return ended.stdout, wall, after.ru_utime + after.ru_stime - used.ru_utime - used.ru_stime


def measure_ours(scene: Judged, target: float) -> list[Row]:
    """Run the scene as a user does."""
    with tempfile.TemporaryDirectory() as place:
        path, out = Path(place) / "scene.toml", Path(place) / "out"
        path.write_text(scene_text(scene.name), encoding="utf-8")
        words = ["-m", "seatfem", "run", str(path), "--no-pictures", "--quiet", "--set", f"accuracy.target={target}"]
        _, wall, processor = run_process([*words, "-o", str(out)], ROOT)
        found = json.loads((out / "summary.json").read_text(encoding="utf-8"))
    spots = found.get("reed_stress_hot_spots") or []
    found[CONTACT_STRESS] = next((spot["von_mises_Pa"] for spot in spots if spot["part"] == "contact"), math.nan)
    numbers = ((key, _first(found[key]), _first(found.get(f"error_bar_{key}"))) for key in scene.keys)
    return [Row(scene.name, OURS, f"{100 * target:g} %", wall, processor, *each) for each in numbers]


def _first(number: float | list[float] | None) -> float:
    return math.nan if number is None else float(number[0] if isinstance(number, list) else number)


def measure_other(scene: Judged, program: str, level: int) -> list[Row]:
    """Run another program."""
    if program == POINTS:
        text, wall, processor = run_process(["-m", "points.flapper_landing", str(level)], HERE)
    else:
        path = HERE / "programs" / f"{scene.name}.toml"
        text, wall, processor = run_process(["-m", f"benchmarks.peers.{MODULES[program]}", str(path), str(level)], ROOT)
    found = json.loads(text)
    setting = f"level {level}"
    return [Row(scene.name, program, setting, wall, processor, key, found[key], math.nan) for key in scene.keys]


def measure_calculix() -> list[Row]:
    """Return CalculiX's landing: our march of its deck, by which its numbers of the last run are stated."""
    from benchmarks.peers import calculix_landing as peer  # takes the whole of seatfem, for this point alone

    case = "spring, 0.2 deg"
    found = json.loads(peer.FOUND.read_text(encoding="utf-8"))[case]
    with tempfile.TemporaryDirectory() as place:
        path = Path(place) / "scene.toml"
        path.write_text(peer.SCENE.format(**peer.CASES[case]), encoding="utf-8")
        peer.export(path, "calculix", Path(place) / "deck")
        time, force = peer.np.loadtxt(Path(place) / "deck" / "contact.csv", delimiter=",", skiprows=1).T
    count = round(peer.WIDTH / time[1])
    peak = peer.np.convolve(force[1:], peer.np.full(count, 1 / count)).max()
    values = {IMPULSE: force[1:].sum() * time[1] * (1 + found["impulse"]), PEAK: peak * (1 + found["peak"])}
    head = "tilted_flapper", CALCULIX, "one mesh", math.nan, found["seconds"]
    return [Row(*head, key, float(value), math.nan) for key, value in values.items()]


def measure(scene: Judged) -> None:
    """Measure what the table lacks of a scene."""
    there = {(row.program, row.setting) for row in read_rows(Row, FILE) if row.scene == scene.name}
    targets = [target for target in scene.targets if (OURS, f"{100 * target:g} %") not in there]
    if targets:
        measure_ours(scene, scene.targets[0])  # not kept: it compiles what is not compiled yet
    for target in targets:
        append_rows(measure_ours(scene, target), FILE, DIGITS)
    levels = [(program, level) for program, level in scene.levels if (program, f"level {level}") not in there]
    if levels:
        measure_other(scene, *levels[0])
    for program, level in levels:
        append_rows(measure_other(scene, program, level), FILE, DIGITS)
    if scene.reference == POINTS and (CALCULIX, "one mesh") not in there:
        append_rows(measure_calculix(), FILE, DIGITS)


def main(names: Sequence[str]) -> None:
    """Measure what is asked for, by default all."""
    for scene in SCENES:
        if not names or scene.name in names:
            measure(scene)
            print(scene.name, flush=True)  # noqa: T201


if __name__ == "__main__":
    main(sys.argv[1:])
