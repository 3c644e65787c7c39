"""What contact along a lip takes: modes of the plate, a step of the march, a whole tilted landing."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from time import process_time

from lips import SCENE
from table import Table, publish

import impact
from impact.progress import silent
from seatfem.structures.sheets import Sheet, plate_modes
from seatfem.structures.store import VARIABLE
from seatfem.study.impacts.contact import problem_of, seat_of, solved_striker, striker_of
from seatfem.study.method import stated_method
from seatfem.study.runs.pipeline import run_scene
from seatfem.study.scene import Scene, load_scene

STEP = 50e-9
ARCS = (16, 32, 64, 256)
CAD = Path(__file__).parents[1] / "examples" / "tilted_cad_flapper.toml"
BAND, SIZE = 290e3, 0.42e-3  # Hz, m: 300 modes below three times the band, 22,000 unknowns


def _scene(folder: Path, text: str) -> Scene:
    path = folder / "scene.toml"
    path.write_text(text, encoding="utf-8")
    return load_scene(path)


def modes(scene: Scene) -> tuple[str, str, str]:
    """300 modes of the plate."""
    sheet = scene.reed.sheet()
    asked = Sheet(sheet.shape, sheet.material, BAND, SIZE)
    start = process_time()
    found = plate_modes(asked)
    spent = process_time() - start
    return f"{len(found.modes.omega)} modes of the plate, {found.model.size:,} unknowns", f"{spent:.1f} s", "10 s"


def march(folder: Path, arcs: int) -> tuple[str, str, str]:
    """A step of the run alone, beside a seat with the modes of 150 kHz."""
    scene = _scene(folder, SCENE.format(arcs=arcs, tilt="0.3 deg", axis="0 deg").replace('"spring"', '"axisymmetric"'))
    method = stated_method(scene).replaced({"reed.greens.bandwidth": 290e3, "seat.greens.bandwidth": 150e3})
    seat = seat_of(scene, method=method.seat, mesh_error=False)
    reed = solved_striker(scene, method=method.reed, mesh_error=False)
    assert reed is not None
    problem = problem_of(scene, striker_of(scene, greens=reed.greens), impact.Body(seat.greens))
    impact.ContactStepper(impact.prepare(problem, STEP, 1e-5)).advance(50)  # compiled
    prepared = impact.prepare(problem, STEP, scene.run.duration)
    stepper = impact.ContactStepper(prepared)
    start = process_time()
    stepper.advance(prepared.steps)
    each = (process_time() - start) / prepared.steps
    modal = [body.body.greens.modal for body in prepared.bodies]
    counts = " x ".join(str(len(g.omega)) for g in modal if g is not None)
    return (
        f"a step, {arcs} ports, modes of plate and seat {counts}",
        f"{1e6 * each:.1f} us",
        "20 us" if arcs == 64 else "",
    )


def whole(folder: Path) -> list[tuple[str, str, str]]:
    """A tilted landing as planned, 2 % in impulse and peak of the mean over 5 us, without and with what was computed
    before."""
    text = SCENE.format(arcs=0, tilt="0.3 deg", axis="0 deg")
    for line in ("ports = 0\n", 'model = "spring"\n', 'greens = { bandwidth = "150 kHz" }\n'):
        text = text.replace(line, "")
    text = text.replace("[run]\n", '[run]\nfilter_width = "5 us"\n')
    scene = _scene(folder, text + '[accuracy]\ntarget = "2 %"\n')
    rows = []
    for words, aim in (("nothing computed before", "60 s"), ("seat and plate computed before", "5 s")):
        start = process_time()
        outcome = run_scene(scene, folder / "out", silent, pictures=False)
        met = "met" if outcome.met else f"not met, rounds: {outcome.summary['accuracy_rounds']}"
        rows.append((f"a tilted landing to 2 %, {words} ({met})", f"{process_time() - start:.1f} s", aim))
    return rows


def on_the_command_line(folder: Path) -> list[tuple[str, str, str]]:
    """`seatfem run` of the reed from a CAD file, as planned, and again."""

    def row(words: str, aim: str) -> tuple[str, str, str]:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        done = subprocess.run([sys.executable, "-m", "seatfem", *run], check=False, stdout=subprocess.DEVNULL)
        if done.returncode not in (0, 1):  # 1: the target was not met
            done.check_returncode()
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
        return f"{words} ({'not met' if done.returncode else 'met'})", f"{spent:.1f} s", aim

    run = ("run", str(CAD), "--no-pictures", "--quiet", "--output", str(folder / "cad"))
    return [
        row("`seatfem run --no-pictures` of `tilted_cad_flapper.toml`, 2 %, nothing computed before", "60 s"),
        row("the same again, all of it on file", "5 s"),
    ]


def main() -> None:
    """All of it with one thread, in processor time."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        os.environ[VARIABLE] = str(folder / "store")
        scene = _scene(folder, SCENE.format(arcs=16, tilt="0 deg", axis="0 deg"))
        rows = [modes(scene), *(march(folder, arcs) for arcs in ARCS), *whole(folder), *on_the_command_line(folder)]
    notes = (
        "The flapper and the seat of the table before; processor time of one thread, the program loaded and compiled.",
        "The last two are whole commands; on two cores the runs of their error budget go side by side, and they end",
        "earlier than their processor time says.",
    )
    publish("lip_speed", Table("What contact along a lip takes", notes, ("what", "time", "aim"), tuple(rows)))


if __name__ == "__main__":
    main()
