"""Where is a spring enough in place of a seat, and does the plan say so? Random scenes, marched with waves and without.

    python benchmarks/decisions_of_springs.py [seed [first [last]]]

The truth: a seat is computed with its waves, finer than the plan asks for, and the impact is marched on it and on its
static compliance alone; a spring is enough where no asked measure changes by more than the target. A line per scene is
kept in results/decisions_of_springs.jsonl, and scenes that are there are not marched again. All of them are then
planned, by estimates alone and as `seatfem plan` does, each with an empty store: results/decisions_of_springs.csv has a
row per scene, and the counts are printed.
"""

from __future__ import annotations

import csv
import json
import os
import signal
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from time import perf_counter

import numpy as np
from coverage_of_runs import TooLong, chosen, stop, written
from coverage_of_seats import KINDS

import impact
from impact.greens.base import GreensFunction
from seatfem.machine.rates import Machine
from seatfem.structures.method import COARSENING
from seatfem.structures.reduction.modes import ConvergenceError
from seatfem.structures.rings import Division
from seatfem.structures.statics import at_once, spring_of
from seatfem.study.accuracy.prerun import relative_changes
from seatfem.study.impacts.contact import measures_of, problem_of, seat_of, solved_striker, striker_of
from seatfem.study.method import RunMethod, as_stated
from seatfem.study.planning.coarse_seat import without_waves
from seatfem.study.planning.deciding import Choices
from seatfem.study.planning.planner import plan_scene
from seatfem.study.planning.seen import Seen

SEED, SCENES = 71, 37
FILE = Path(__file__).parent / "results" / "decisions_of_springs.jsonl"
TABLE = FILE.with_suffix(".csv")
ABOUT = ("seed", "index", "seat", "material", "striker", "ports", "target")
SEATS = ("annular", "conical", "lip", "block", "annular", "plate", "lip", "stopper")
MATERIALS = ("steel", "grey cast iron", "aluminium", "PEEK")
MEASURES = ("impulse", "filtered_peak", "contact_duration")
WIDER, STRICTER, MORE_MODES, SHORTER = 1.6, 2.0, 1.6, 2.0
LONGEST = 120  # processor seconds for a scene


@dataclass(frozen=True)
class Truth:
    """What a spring in place of a seat changes: relative, by asked measure."""

    seed: int
    index: int
    seat: str
    material: str
    striker: str
    ports: int
    target: float
    changes: Mapping[str, float]
    seconds: float

    @property
    def worst(self) -> float:
        """Of the asked measures."""
        return max(self.changes.values())

    @property
    def enough(self) -> bool:
        """Whether a spring meets the target."""
        return self.worst <= self.target


def draw_scene(index: int, seed: int = SEED) -> str:
    """Scene number ``index`` as TOML: seats by turns, all else at random."""
    rng = np.random.default_rng([seed, index])
    kind, material = SEATS[index % len(SEATS)], str(rng.choice(MATERIALS, p=[0.3, 0.2, 0.2, 0.3]))
    damping = rng.uniform(0.02, 0.06) if material == "PEEK" else rng.uniform(0.001, 0.03)
    bore, width = rng.uniform(3.0, 6.0), rng.uniform(0.6, 1.6)
    if kind == "lip":
        geometry = (
            f'bore_radius = "{bore:.4f} mm"\nlip_width = "{width:.4f} mm"\nlip_height = "0.5 mm"\n'
            f'outer_radius = "{bore + width + rng.uniform(3, 8):.4f} mm"\nthickness = "{rng.uniform(3, 10):.4f} mm"\n'
        )
        striker = _flapper(rng, bore + width)
    else:
        geometry, _ = KINDS[kind][1](rng)
        striker = _cantilever(rng) if rng.random() < 0.55 else _mass(rng)
    seat = f'[seat]\nkind = "{"annular" if kind == "lip" else kind}"\nmaterial = "{material}"\n'
    asked = sorted(rng.choice(MEASURES, size=rng.integers(1, len(MEASURES) + 1), replace=False))
    filter_width = f'filter_width = "{10 ** rng.uniform(0.0, 1.1):.4f} us"\n'
    target = f"[accuracy]\ntarget = {10 ** rng.uniform(-2, -1):.5f}\nmeasures = {json.dumps(asked)}\n"
    return f"{seat}damping_ratio = {damping:.4f}\n{geometry}{striker}{filter_width}{target}"


def _flapper(rng: np.random.Generator, lip: float) -> str:
    """A plate over a lip of this radius [mm]; a third of them tilted."""
    paddle = 2 * (lip + rng.uniform(0.8, 3.0))
    neck = rng.uniform(0.3, 0.6) * paddle
    contact = f'[contact]\ngap = "{rng.uniform(0.5, 5):.4f} um"\n'
    if rng.random() < 1 / 3:
        contact += f'tilt = "{10 ** rng.uniform(-1.7, -0.3):.4f} deg"\ntilt_axis = "{rng.uniform(0, 360):.3f} deg"\n'
    return (
        f'[reed]\nkind = "flapper"\nroot_width = "{rng.uniform(1.0, 1.5) * neck:.4f} mm"\ntaper_length = "2 mm"\n'
        f'neck_width = "{neck:.4f} mm"\nneck_length = "{rng.uniform(0.7, 1.3) * paddle:.4f} mm"\n'
        f'paddle_diameter = "{paddle:.4f} mm"\nthickness = "{rng.uniform(0.3, 0.7):.4f} mm"\ndamping_ratio = 0.01\n'
        f'release = {{ mode = 1, velocity = "-{rng.uniform(0.5, 4):.4f} m/s" }}\n{contact}'
        f'[run]\nduration = "{rng.uniform(0.1, 0.2):.4f} ms"\n'
    )


def _cantilever(rng: np.random.Generator) -> str:
    """A beam, bent and let go, until a little after its landing."""
    length, thickness, tip = rng.uniform(12, 40), rng.uniform(0.15, 0.6), 10 ** rng.uniform(-0.7, 0.2)
    quarter = np.pi / 2 / (3.516 * np.sqrt(200e9 / 7850 / 12) * 1e-3 * thickness / (1e-3 * length) ** 2)
    return (
        f'[reed]\nkind = "cantilever"\nlength = "{length:.4f} mm"\nwidth = "{rng.uniform(5, 12):.4f} mm"\n'
        f'thickness = "{thickness:.4f} mm"\ndamping_ratio = {rng.uniform(0.005, 0.03):.4f}\n'
        f'release = {{ tip_deflection = "{tip:.4f} mm" }}\n'
        f'[contact]\ngap = "{tip * rng.uniform(0, 0.2):.4f} mm"\n{_law(rng)}'
        f'[run]\nduration = "{min(quarter * rng.uniform(1.2, 1.6), 3e-3):.9f} s"\n'
    )


def _mass(rng: np.random.Generator) -> str:
    """A rigid body, thrown."""
    return (
        f'[reed]\nkind = "rigid_mass"\nmass = "{10 ** rng.uniform(-0.5, 2):.4f} g"\n'
        f'velocity = "-{10 ** rng.uniform(-0.5, 0.7):.4f} m/s"\n[contact]\n{_law(rng)}'
        f'[run]\nduration = "{10 ** rng.uniform(2, 2.6):.2f} us"\n'
    )


def _law(rng: np.random.Generator) -> str:
    if rng.random() < 0.6:
        return ""
    return f'law = {{ kind = "spring", stiffness = "{10 ** rng.uniform(7, 8.5):.4g} N/m" }}\n'


def judge(index: int, seed: int = SEED) -> Truth:
    """The impact of one scene on a seat with waves, and on its statics alone."""
    start = perf_counter()
    with written(draw_scene(index, seed)) as (scene, _):
        method = _finer(plan_scene(scene, without=("spring", "rod")).method)
        stated = as_stated(scene, method)
        seat = seat_of(scene, method=method.seat, mesh_error=False).greens
        reed = solved_striker(stated, method=method.reed, mesh_error=False)
        striker = striker_of(stated, greens=None if reed is None else reed.greens)
        assert method.time_step is not None
        waves, spring = (
            measures_of(stated, problem_of(stated, striker, impact.Body(greens)), method.time_step)
            for greens in (seat, _statics(seat))
        )
    changes = relative_changes(waves, spring)
    return Truth(
        seed=seed,
        index=index,
        seat=scene.seat.kind,
        material=scene.seat.material.name or "",
        striker=scene.reed.kind,
        ports=method.ports or 1,
        target=scene.accuracy.target,
        changes={name: changes[name] for name in scene.accuracy.judged},
        seconds=perf_counter() - start,
    )


def _finer(method: RunMethod) -> RunMethod:
    """With a wider band, a stricter reduction, a finer mesh, more modes of the reed and a shorter step."""
    seat, modes = method.seat, method.reed.n_modes
    assert seat.bandwidth is not None
    assert seat.size is not None
    assert seat.contact_size is not None
    assert method.time_step is not None
    finer = replace(
        seat,
        bandwidth=WIDER * seat.bandwidth,
        tolerance=seat.tolerance / STRICTER,
        size=seat.size / COARSENING,
        contact_size=seat.contact_size / COARSENING,
    )
    reed = replace(method.reed, n_modes=None if modes is None else round(MORE_MODES * modes))
    return RunMethod(finer, reed, method.time_step / SHORTER)


def _statics(seat: GreensFunction) -> GreensFunction:
    """What a run takes that leaves out waves."""
    if Division.of(seat).arcs > 1:
        return at_once(seat)
    return spring_of(seat.static_compliance(), 0.0, seat.ports, {})


def read() -> list[Truth]:
    """The scenes so far, by number."""
    if not FILE.exists():
        return []
    found = [Truth(**json.loads(line)) for line in FILE.read_text(encoding="utf-8").splitlines()]
    return sorted(found, key=lambda truth: (truth.seed, truth.index))


@dataclass(frozen=True)
class Row:
    """What plans say of a scene, and what is true: relative changes over the target; processor seconds.

    ``before``: whether a plan by estimates takes a spring; ``planned``: the same of one with a coarse seat; ``after``:
    whether that one says that a spring is enough, also where waves on a coarser mesh take less time.
    """

    seed: int
    index: int
    seat: str
    material: str
    striker: str
    ports: int
    target: float
    true: float
    estimated: float
    measured: float | None
    enough: bool
    before: bool
    planned: bool
    after: bool
    plan_s: float
    look_s: float


def decide(truth: Truth) -> Row:
    """One scene, planned by estimates alone and by a coarse real seat."""
    with written(draw_scene(truth.index, truth.seed)) as (scene, _):
        start, target = _processor(), scene.accuracy.target
        seen = Seen.of(scene, scene.seat.surrogate(scene.run.duration, scene.reed.face), Machine())
        before = Choices(replace(seen, look=0.0)).cheapest(target).level
        planned = _processor()
        found = without_waves(seen)
        looked = _processor()
        after = Choices(seen).cheapest(target).level
    worst, asked = seen.sensitivity.worst, {key: value for key, value in vars(truth).items() if key in ABOUT}
    return Row(
        **asked,
        true=truth.worst / target,
        estimated=worst(seen.sensitivity.spring) / target,
        measured=worst(found.changes) / target if found.measured else None,
        enough=truth.enough,
        before=before == "spring",
        planned=after == "spring",
        after=after == "spring" or found.enough(target),
        plan_s=planned - start,
        look_s=looked - planned,
    )


def _processor() -> float:
    """Seconds of this process and of the mesher."""
    return sum(os.times()[:4])


def write_table(rows: Sequence[Row]) -> None:
    """A line for each."""
    with TABLE.open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, [field.name for field in fields(Row)], lineterminator="\n")
        writer.writeheader()
        for row in rows:
            cells = {key: "" if value is None else value for key, value in asdict(row).items()}
            writer.writerow({k: f"{value:.3g}" if isinstance(value, float) else value for k, value in cells.items()})


def counts(rows: Sequence[Row]) -> str:
    """Said and true, before and after, as a table in Markdown."""
    lines = [
        "| plan | enough, rightly | enough, wrongly | waves, rightly | waves, needlessly |",
        "|---|---|---|---|---|",
    ]
    for name, words in (("before", "by estimates"), ("after", "with a coarse seat")):
        said = [(getattr(row, name), row.enough) for row in rows]
        cells = (said.count(each) for each in ((True, True), (True, False), (False, False), (False, True)))
        lines.append(f"| {words} | {' | '.join(map(str, cells))} |")
    looks = sorted(row.look_s for row in rows if row.measured is not None)
    middle = f", {looks[len(looks) // 2]:.2f} s each (median; {looks[-1]:.2f} s at most)" if looks else ""
    return "\n".join([*lines, "", f"{len(rows)} scenes; coarse seats made for {len(looks)} of them{middle}"])


def main() -> None:
    """March what is missing, plan all, write the table, print the counts."""
    seed, numbers = chosen(SEED, SCENES)
    there = {(truth.seed, truth.index) for truth in read()}
    signal.signal(signal.SIGPROF, stop)
    for index in numbers:
        if (seed, index) in there:
            continue
        signal.setitimer(signal.ITIMER_PROF, LONGEST)
        try:
            truth = judge(index, seed)
        except TooLong:
            print(f"{index:3d} stopped: it takes more than {LONGEST} processor seconds", flush=True)  # noqa: T201
            continue
        except ConvergenceError as refusal:
            print(f"{index:3d} without a truth: {refusal}", flush=True)  # noqa: T201
            continue
        finally:
            signal.setitimer(signal.ITIMER_PROF, 0)
        with FILE.open("a", encoding="utf-8") as file:
            file.write(json.dumps(asdict(truth)) + "\n")
        print(f"{index:3d} {truth.worst:.2g} of {truth.target:.2g}; {truth.seconds:.0f} s", flush=True)  # noqa: T201
    rows = [decide(truth) for truth in read() if truth.seed == seed and truth.index in numbers]
    write_table(rows)
    print(counts(rows))  # noqa: T201


if __name__ == "__main__":
    main()
