"""[[base]]: bodies that are carried and shaken, by files; the same in another frame; what is refused."""

import re
from pathlib import Path

import numpy as np
import pytest

import impact
from impact.after.result import ImpactResult
from impact.bodies.time_series import TimeSeriesError
from seatfem.study.impacts.bodies import check_base, problem_of
from tests.as_stated import seat_of, striker_of
from tests.gallery import load_text, refusal
from tests.steps import GreensFunctionError, Scene

REED = '[reed]\nkind = "cantilever"\nlength = "25.4 mm"\nn_modes = 12\ndamping_ratio = 0.01\n'
SPRING = '[seat]\nkind = "spring"\nstiffness = "1 N/um"\n'
ROD = (
    '[seat]\nkind = "rod"\nyoung = "200 GPa"\ndensity = "7850 kg/m^3"\nlength = "10 mm"\narea = "3 mm^2"\n'
    'far_end = "fixed"\n'
)
REST = '[contact]\ngap = "20 um"\n[run]\nduration = "3 ms"\ntime_step = "0.2 us"\n'
MASS = '[reed]\nkind = "rigid_mass"\nmass = "1 g"\nvelocity = "-1 m/s"\n'
DT, DURATION, RATE, WAY = 2e-7, 3e-3, 2000.0, 0.2e-3


def scene_of(folder: Path, text: str) -> Scene:
    """Return the scene beside three records of one motion, s = A (1 - cos W t), from rest."""
    t = np.linspace(0, 4e-3, 4001)
    for kind, unit, values in (
        ("displacement", "m", WAY * (1 - np.cos(RATE * t))),
        ("velocity", "m/s", WAY * RATE * np.sin(RATE * t)),
        ("acceleration", "m/s^2", WAY * RATE**2 * np.cos(RATE * t)),
    ):
        lines = [f"time [s],{kind} [{unit}]", *(f"{a:.9g},{b:.12g}" for a, b in zip(t, values, strict=True))]
        (folder / f"{kind}.csv").write_text("\n".join(lines), encoding="utf-8")
    return load_text(folder, text + REST)


def base(of: str, kind: str = "displacement") -> str:
    return f'[[base]]\nof = "{of}"\n{kind} = "{kind}.csv"\n'


def run(scene: Scene) -> ImpactResult:
    seat = seat_of(scene).greens
    check_base(scene.mount("seat"), seat, scene.run.duration)
    problem = problem_of(scene, striker_of(scene), impact.Body(seat))
    return impact.solve(problem, dt=DT, duration=DURATION)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["velocity", "acceleration"])
def test_either_record_moves_the_clamp_alike(kind: str, tmp_path: Path) -> None:
    by_way, other = (run(scene_of(tmp_path, SPRING + REED + base("reed", each))) for each in ("displacement", kind))
    assert by_way.force.max() > 0.1
    np.testing.assert_allclose(other.gap, by_way.gap, atol=1e-4 * WAY)
    assert by_way.energy.residual < 1e-9


@pytest.mark.slow
def test_on_one_base_all_is_as_in_its_frame(tmp_path: Path) -> None:
    """Reed and seat carried alike: the reed feels its inertia alone, as under the load base_motion."""
    both = run(scene_of(tmp_path, SPRING + REED + base("reed", "acceleration") + base("seat", "acceleration")))
    frame = run(scene_of(tmp_path, SPRING + REED + '[[load]]\nbase_motion = { file = "acceleration.csv" }\n'))
    size = frame.force.max()
    assert size > 0.05
    np.testing.assert_allclose(both.force, frame.force, atol=1e-6 * size)
    np.testing.assert_allclose(both.gap, frame.gap, atol=1e-11)


@pytest.mark.slow
def test_a_rod_follows_a_slow_base_and_refuses_a_fast_one(tmp_path: Path) -> None:
    """Its first frequency is c/(4 l) = 126 kHz: 318 Hz is slow; of a rod of 10 m it is not."""
    scene = scene_of(tmp_path, ROD + REED + base("seat"))
    assert run(scene).energy.residual < 1e-9
    long = scene_of(tmp_path, ROD.replace("10 mm", "10 m") + REED + base("seat"))
    with pytest.raises(GreensFunctionError, match=r"126\.2 Hz.*800 m/s\^2"):
        run(long)


def test_a_record_shorter_than_the_run_is_refused(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, SPRING + REED + base("reed"))
    (tmp_path / "displacement.csv").write_text("time [ms],displacement [um]\n0,0\n1,1\n", encoding="utf-8")
    with pytest.raises(TimeSeriesError, match=r"displacement.*0\.\.0\.001 s"):
        run(scene)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (SPRING + MASS + base("reed"), "base.0.of: reed.kind = 'rigid_mass'"),
        (SPRING + REED + base("stopper"), r"base.0.of:.*\[stopper\]"),
        (SPRING + REED + base("seat") + base("seat"), "base.1.of:.*before"),
        (SPRING + REED + base("seat") + 'velocity = "velocity.csv"\n', "base.0.velocity: displacement"),
        (SPRING + REED + '[[base]]\nof = "seat"\n', "base.0.displacement: nothing"),
        (SPRING + REED + base("seat").replace("nt.csv", "nt.txt"), "base.0.displacement:.*file"),
        (SPRING + REED + '[[base]]\nof = "seat"\ndisplacement = { file = "displacement.csv" }\n',
         r"base.0.displacement: \{'file': 'displacement.csv'\}"),
        (SPRING + REED + base("seat") + 'columns = { force = "F" }\n', "columns.*displacement"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(text: str, words: str, tmp_path: Path) -> None:
    assert re.search(words, refusal(scene_of, tmp_path, text))
