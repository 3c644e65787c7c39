"""Damaged files: a seeded sample of what `python -m tests.fuzz` does, its judgement, and defects that it has found."""

import csv
import json
import re
import signal
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

import impact
from impact.march.problem import ContactError
from impact.storage.hdf5 import StorageError, load_results, restore_checkpoint, save_checkpoint, save_results
from seatfem.faces.cli import BAD_INPUT, MOST_LINES, WIDEST, run_command
from seatfem.structures.mesh import gmsh_process
from seatfem.study.scene.problems import MOST
from tests.fuzz.mutations import seal
from tests.fuzz.samples import Sample, build, march
from tests.fuzz.trials import STOPPED, judged
from tests.solids import GeometryError, MeshingError

ROOT = Path(__file__).parents[2]
TABLE = ROOT / "benchmarks" / "results" / "fuzz.csv"
BALL = '[reed]\nkind = "rigid_mass"\nmass = "1 g"\nvelocity = "-1 m/s"\n[run]\nduration = "0.1 ms"\n'
SPRING = '[seat]\nkind = "spring"\nstiffness = "1 N/um"\n'


@pytest.mark.slow
def test_a_sample_of_the_trials(tmp_path: Path) -> None:
    """60 damaged files are refused in words, or run, and some of each."""
    options = ("--trials", "60", "--seed", "7", "--folder", str(tmp_path), "--cheap")
    command = [sys.executable, "-m", "tests.fuzz", *options]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    assert re.search(r"\d\d trials, 0 defects", done.stdout)


@pytest.mark.slow
def test_sound_samples_run(tmp_path: Path) -> None:
    """Each sample is read to its end before it is damaged; what gmsh would draw is stopped there."""
    for name, sample in build(tmp_path / "samples").items():
        verdict = judged(sample, tmp_path / "samples" / sample.name)
        assert verdict.word == ("refused" if sample.read == "draw" else "ran"), (name, verdict)
        assert (STOPPED in verdict.said) == (sample.read == "draw"), (name, verdict)


def test_defects_are_seen(tmp_path: Path) -> None:
    """The judgement finds what it is there for: tracebacks, silence, memory, files left behind."""

    def bug(path: Path) -> None:
        raise KeyError("a")

    def refused(path: Path) -> None:
        raise GeometryError("it is wrong" if path.parent.name == "vague" else f"{path}: it is wrong")

    def stray(path: Path) -> None:
        path.with_name("more.txt").touch()

    def large(path: Path) -> None:
        np.ones(200_000_000)

    reads = {"traceback": bug, "refused": refused, "vague": refused, "stray files": stray, "memory": large}
    for word, read in reads.items():
        (tmp_path / word).mkdir()
        (tmp_path / word / "a.txt").touch()
        assert judged(Sample("a", "a.txt", "bytes", read), tmp_path / word).word == word


def test_the_committed_table_has_no_defect() -> None:
    rows = list(csv.DictReader(TABLE.read_text(encoding="utf-8").splitlines()))
    assert sum(int(row["cases"]) for row in rows) >= 2900
    assert sum(int(row["defects"]) for row in rows) == 0


@pytest.mark.slow
def test_messages_have_an_end(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(SPRING + "".join(f"k{k} = {k}\n" for k in range(3000)) + f'x = "{"y" * 10_000}"\n{BALL}', "utf-8")
    assert run_command(["run", str(path), "--quiet"]) == BAD_INPUT
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == MOST_LINES + 1
    assert lines[-1] == f"... and {MOST + 1 - MOST_LINES} more lines"  # the last tells of problems untold
    assert max(map(len, lines)) <= WIDEST + 20


@pytest.mark.parametrize(
    ("name", "data", "words"),
    [
        ("wave/gap", np.zeros(7), r"histories.*differ"), ("state/done", [1, 2], "must say how many"),
        ("state/done", -3, "done -3 steps"), ("state/done", 10**6, "done 1000000 steps"),
        ("state/gap", 1.0, "gap has shape"),
    ],
)  # fmt: skip
def test_results_and_checkpoints_from_elsewhere(name: str, data: object, words: str, tmp_path: Path) -> None:
    """Restored, a checkpoint would be marched on beyond the end of arrays, in compiled code."""
    path = tmp_path / "march.h5"
    if name.startswith("state"):
        save_checkpoint(march(10), path)
    else:
        save_results(path, {"wave": impact.solve(march().prepared.problem, dt=1e-6, duration=1e-4)}, {})
    with h5py.File(path, "r+") as file:
        del file[name]
        file[name] = data
    seal(path)
    with pytest.raises(StorageError, match=rf"march\.h5.*{words}"):
        restore_checkpoint(march(), path) if name.startswith("state") else load_results(path)


@pytest.mark.filterwarnings("ignore:overflow", "ignore:invalid value")
def test_a_march_that_leaves_the_range_of_numbers() -> None:
    problem = impact.ContactProblem(
        impact.rigid_mass(mass=1e180, velocity=-1e90), impact.Body(impact.spring(stiffness=1e-150))
    )
    with pytest.raises(ContactError, match="leave the range of numbers at "):
        impact.solve(problem, dt=1e-6, duration=1e-4)


@pytest.mark.slow
def test_a_cad_kernel_that_finds_no_end_is_ended() -> None:
    code = "import time, seatfem.structures.mesh._gmsh_base as m; m.LONGEST = 1; m.stage('building the geometry', 0); "
    command = [sys.executable, "-c", code + "time.sleep(60)"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, timeout=50, check=False)
    assert done.returncode == -signal.SIGALRM
    with pytest.raises(MeshingError, match=r"gmsh.*geometry"):
        gmsh_process._check(done.returncode, json.loads(done.stdout), "")
    going_on = [sys.executable, "-c", code + "m.stage('meshing surfaces', 0.1); time.sleep(1.5)"]
    assert subprocess.run(going_on, cwd=ROOT, capture_output=True, timeout=50, check=False).returncode == 0
