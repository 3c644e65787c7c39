"""Where the time goes: the demo, a tilted landing, scenes of a study, and a large factorization with its solves.

    OMP_NUM_THREADS=1 MKL_NUM_THREADS=1 python benchmarks/profiles.py [CASE ...]

Each case runs in a process of its own, with an empty store, all compiled code on file. The interpreter is interrupted
at every millisecond of processor time, and what passed since the last time is put down to the innermost function of
ours and to the library it was in: unlike cProfile, which makes calls of Python dear and none of compiled code, that
distorts nothing. Kept in results/profiles.jsonl, by case; drawn in docs/images/profiles.png.
"""

from __future__ import annotations

import json
import multiprocessing
import os
import resource
import signal
import sys
import tempfile
from collections import Counter
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from time import perf_counter, process_time
from types import FrameType

import numpy as np
from cost_vs_dof import assembled, reduced
from matplotlib import colormaps
from pypardiso import PyPardisoSolver
from scenes import SLEEVE
from scipy import sparse
from table import RESULTS, Table, publish

from impact.pictures.drawing import GREY, sheet
from seatfem.faces.scene_verbs import demo_scene
from seatfem.pictures.apart import drawing_apart
from seatfem.structures.store import VARIABLE
from seatfem.study.runs.pipeline import run_scene
from seatfem.study.scene import load_scene
from seatfem.study.sweep.outcome import carry_out

ROOT = Path(__file__).parents[1]
FILE, PICTURE = RESULTS / "profiles.jsonl", ROOT / "docs" / "images" / "profiles.png"
EVERY, LEAST = 1e-3, 0.02  # s between samples; share from which on a room is told
SCENES, SIZE = 20, 0.8e-3  # of the study; of the elements of the large seat [m]

WITHIN = {
    "plan_scene": "plan",
    "run_contacts": "contact with all energies",
    "error_budget": "error budget",
    "reed_stress": "stress of the reed",
    "_march": "marches in all of these",
}
"""Functions by what they do, with all that they call."""

Parts = dict[str, float]


@dataclass(frozen=True)
class Profile:
    """Processor seconds of one case: ``own`` of its process, ``elsewhere`` of those that mesh and draw; ``pictures``:
    seconds of the clock, of ``wall``; by room, with the libraries below it, by function, and ``within`` some of them;
    ``limit``: what bounds it.
    """

    case: str
    own: float
    elsewhere: float
    wall: float
    pictures: float
    rooms: Parts
    libraries: dict[str, Parts]
    functions: Parts
    within: Parts
    limit: str


class Sampler:
    """Counts where a process is."""

    def __init__(self) -> None:
        self.rooms: Counter[str] = Counter()
        self.functions: Counter[str] = Counter()
        self.libraries: dict[str, Counter[str]] = {}
        self.within: Counter[str] = Counter()
        self.total = 0.0
        self._last = process_time()

    def __call__(self, _: int, frame: FrameType | None) -> None:
        """At a signal."""
        spent, library = process_time() - self._last, "" if frame is None else _library(frame.f_code.co_filename)
        self.total += spent
        while frame is not None and not (room := _room(frame.f_code.co_filename)):
            frame = frame.f_back
        if frame is not None:
            self.rooms[room] += spent
            self.functions[f"{room}/{Path(frame.f_code.co_filename).stem}: {frame.f_code.co_name}"] += spent
            if library:
                self.libraries.setdefault(room, Counter())[library] += spent
        names = set()
        while frame is not None:
            names.add(frame.f_code.co_name)
            frame = frame.f_back
        for name in names & WITHIN.keys():
            self.within[WITHIN[name]] += spent
        self._last = process_time()


@cache
def _room(file: str) -> str:
    """impact/march, seatfem/study/runs, ...; "" of what is not ours."""
    path = Path(file)
    parts = path.relative_to(ROOT).parts if path.is_relative_to(ROOT) else ("",)
    return "/".join(parts[:-1]) if parts[0] in ("impact", "seatfem") else ""


@cache
def _library(file: str) -> str:
    """The package that a file is in; "" of Python's own and of ours."""
    parts = Path(file).parts
    return parts[parts.index("site-packages") + 1] if "site-packages" in parts else ""


def demo(folder: Path) -> tuple[float, str]:
    """`seatfem demo`."""
    return _whole(demo_scene(), folder)


def tilted_landing(folder: Path) -> tuple[float, str]:
    """The example."""
    return _whole(ROOT / "examples" / "tilted_landing.toml", folder)


def _whole(path: Path, folder: Path) -> tuple[float, str]:
    with drawing_apart() as painter:  # as `seatfem run` does
        outcome = run_scene(load_scene(path), folder / "out", painter=painter)
    return outcome.stages["pictures"], ""


def study(_: Path) -> tuple[float, str]:
    """Scenes of a study of the PEEK sleeve after the first one, whose seat serves them all."""
    rng, start = np.random.default_rng(1), FIRST[0]
    for _ in range(SCENES):
        changed = {
            "reed.thickness": f"{rng.normal(0.305, 0.003):.6f} mm",
            "reed.release.tip_deflection": f"{rng.normal(1, 0.05):.6f} mm",
            "contact.gap": f"{rng.uniform(0, 0.1):.6f} mm",
        }
        assert carry_out(SLEEVE, changed, 4, start, stress=False).has_numbers
    return 0.0, ""


FIRST: list[dict[str, object]] = []


def large_seat(_: Path) -> tuple[float, str]:
    """The seat of the PEEK sleeve in small elements, reduced on a Krylov space."""
    reduced(assembled("seat", SIZE)[0], "krylov", SIZE)
    return 0.0, ""


def limit_of_large_seat() -> str:
    """The factor's size, its operations, and how near factorization and solves come to products of matrices and to the
    memory's speed."""
    model = assembled("seat", SIZE)[0]
    upper = sparse.csr_matrix(sparse.triu(sparse.csr_matrix(model.K), format="csr"))
    solver, rhs = PyPardisoSolver(mtype=2), np.ones(model.size)
    solver.set_iparm(18, -1)
    solver.set_iparm(19, -1)
    analysed, made = (_spent(lambda phase=phase: _phase(solver, upper, rhs, phase)) for phase in (11, 22))
    solved = min(_spent(lambda: _phase(solver, upper, rhs, 33)) for _ in range(3))
    entries, flops = solver.get_iparm(18), 1e6 * solver.get_iparm(19)
    a, long = np.random.default_rng(0).normal(size=(1500, 1500)), np.ones(2**26)
    product = 2 * 1500**3 / min(_spent(lambda: a @ a) for _ in range(3))
    memory = long.nbytes / min(_spent(lambda: long.sum()) for _ in range(3))
    read = 2 * 8 * entries / solved
    return (
        f"{model.size} unknowns: factor of {8 * entries / 1e9:.2g} GB, ordered in {analysed:.1f} s, made in {made:.1f} "
        f"s: {flops / made / 1e9:.0f} Gflop/s, {flops / made / product:.0%} of NumPy's product of matrices; a solve "
        f"reads it twice in {1e3 * solved:.0f} ms: {read / 1e9:.1f} GB/s, {read / memory:.0%} of a sum over memory"
    )


def _phase(solver: PyPardisoSolver, upper: sparse.csr_matrix, rhs: np.ndarray, phase: int) -> None:  # type: ignore[type-arg]
    solver.set_phase(phase)
    solver._call_pardiso(upper, rhs)


def _spent(work: Callable[[], object]) -> float:
    start = process_time()
    work()
    return process_time() - start


CASES = {"demo": demo, "tilted landing": tilted_landing, "scenes of a study": study, "large seat": large_seat}


def measured(case: str) -> Profile:
    """One case, in this process."""
    with tempfile.TemporaryDirectory() as name:
        os.environ[VARIABLE] = str(Path(name) / "store")
        if case == "scenes of a study":
            FIRST.append(dict(carry_out(SLEEVE, {}, 4, {}, leads=True, stress=False).start))
        sampler = Sampler()
        signal.signal(signal.SIGPROF, sampler)
        before, start = _children(), perf_counter()
        signal.setitimer(signal.ITIMER_PROF, EVERY, EVERY)
        pictures, limit = CASES[case](Path(name))
        signal.setitimer(signal.ITIMER_PROF, 0)
        wall, elsewhere = perf_counter() - start, _children() - before
    libraries = {room: dict(found) for room, found in sampler.libraries.items()}
    if case == "large seat":
        limit = limit_of_large_seat()
    return Profile(
        case,
        sampler.total,
        elsewhere,
        wall,
        pictures,
        dict(sampler.rooms),
        libraries,
        dict(sampler.functions.most_common(12)),
        dict(sampler.within),
        limit,
    )


def _children() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def rows_of(found: Profile) -> list[tuple[str, ...]]:
    """The rooms that take `LEAST`, the dearest first."""
    rows = []
    for room, spent in sorted(found.rooms.items(), key=lambda item: -item[1]):
        if spent < LEAST * found.own:
            break
        below = sorted(found.libraries.get(room, {}).items(), key=lambda item: -item[1])
        told = ", ".join(f"{name} {part / found.own:.0%}" for name, part in below if part > 0.01 * found.own)
        first = next((name.rpartition("/")[2] for name in found.functions if name.rpartition("/")[0] == room), "")
        rows.append((found.case, room, f"{spent / found.own:.0%}", told, first))
    return rows


def report(profiles: list[Profile]) -> None:
    """Table and picture."""
    notes = []
    for found in profiles:
        drawn = f"; pictures {found.pictures / found.wall:.0%} of the clock" if found.pictures else ""
        limit = f" {found.limit[:1].upper()}{found.limit[1:]}." if found.limit else ""
        each = f" ({found.own / SCENES:.2g} s a scene)" if found.case == "scenes of a study" else ""
        within = ", ".join(f"{name} {spent / found.own:.0%}" for name, spent in found.within.items())
        limit += f" Of it {within}." if each else ""
        apart = f"{found.elsewhere:.1f} s in processes that mesh and draw"
        notes.append(f"- {found.case}: {found.own:.1f} s here{each}, {apart}{drawn}.{limit}")
    columns = ("case", "room", "share of the processor here", "in libraries", "most of it in")
    table = tuple(row for found in profiles for row in rows_of(found))
    publish("profiles", Table("Where the time goes", ("Processor time, sampled.", "", *notes), columns, table))
    picture(profiles)


def picture(profiles: list[Profile]) -> None:
    """A bar a case."""
    rooms = sorted({row[1] for found in profiles for row in rows_of(found)})
    colours = dict(zip(rooms, colormaps["tab20"].colors, strict=False))  # type: ignore[attr-defined]
    with sheet(PICTURE, 7.6, 0.9 + 0.55 * len(profiles) + 0.18 * len(rooms) / 3) as figure:
        axes = figure.subplots()
        for place, found in enumerate(reversed(profiles)):
            left = 0.0
            for room in [*rooms, "others"]:
                others = sum(spent for name, spent in found.rooms.items() if name not in rooms)
                width = (others if room == "others" else found.rooms.get(room, 0.0)) / sum(found.rooms.values())
                label = room if place == 0 else None
                axes.barh(place, width, 0.6, left, color=colours.get(room, GREY), label=label)
                left += width
        axes.set_yticks(range(len(profiles)), [f"{f.case}\n{f.own:.0f} s" for f in reversed(profiles)])
        axes.set(xlim=(0, 1), xlabel="share of the processor time of its process [-]")
        axes.grid(visible=False, axis="y")
        axes.legend(loc="upper center", bbox_to_anchor=(0.45, -0.16), ncols=3, fontsize=7)
        figure.suptitle("Where the time goes, by room", fontsize=9.5)


def main(wanted: list[str]) -> None:
    """The cases asked for, then all that are on file."""
    known = [Profile(**json.loads(line)) for line in FILE.read_text("utf-8").splitlines()] if FILE.exists() else []
    found = {profile.case: profile for profile in known}
    for case in wanted:
        with multiprocessing.get_context("spawn").Pool(1) as pool:
            found[case] = pool.apply(measured, (case,))
        lines = (json.dumps(asdict(found[name])) for name in CASES if name in found)
        FILE.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")
    report([found[name] for name in CASES if name in found])


if __name__ == "__main__":
    main(sys.argv[1:] or list(CASES))
