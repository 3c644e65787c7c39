"""Studies: same numbers however they are stopped and shared out, nothing computed twice, how scenes begin."""

import csv
import json
import os
import random
import signal
import subprocess
import sys
import time
from collections import Counter
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import pytest

import seatfem
from impact.files.safe_files import OutputError
from seatfem.jobs.folders import JournalError, claimed
from seatfem.study.sweep import runner as one
from seatfem.study.sweep.cases import PILOTS, begun, cases_of, chosen, start_of
from seatfem.study.sweep.effort import Effort
from seatfem.study.sweep.runner import JOURNAL, Outcome, StudyError, carry_out, read_journal
from seatfem.study.sweep.study import load_study
from seatfem.study.sweep.sweep import TABLE, run_study
from seatfem.study.sweep.table import write_parquet
from tests.gallery import Patch
from tests.steps import SceneError, begin_plan, converge, load_scene, run_scene

ROOT = Path(__file__).parents[2]
posix = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
BALL = """reed = { kind = "rigid_mass", mass = "1 g", velocity = "-1 m/s" }
run = { duration = "0.2 ms" }
"""
SPRING = f'seat = {{ kind = "spring", stiffness = "1 N/um" }}\n{BALL}'
MESHED = f"""seat = {{ kind = "annular", bore_radius = "4 mm", lip_width = "1 mm", lip_height = "0.5 mm", \
    outer_radius = "12 mm", thickness = "8 mm", damping_ratio = 0.1, fixed = "underside", \
    material = {{ young = "200 GPa", poisson = 0.3, density = "7850 kg/m^3" }} }}
{BALL}accuracy = {{ target = "10 %" }}
"""
DRAWN = """design = "monte_carlo"
number = {}
[vary]
reed.mass = {{ kind = "normal", mean = "1 g", deviation = "0.1 g" }}
"""


def study_file(folder: Path, text: str, scene: str = SPRING) -> Path:
    (folder / "scene.toml").write_text(scene, encoding="utf-8")
    path = folder / "study.toml"
    path.write_text(f'scene = "scene.toml"\n{text}', encoding="utf-8")
    return path


def rows(folder: Path) -> list[dict[str, str]]:
    """Return the rows of a study's table without what the clock says."""
    with (folder / TABLE).open(newline="", encoding="utf-8") as file:
        return [{key: value for key, value in row.items() if key != "wall_time_s"} for row in csv.DictReader(file)]


@pytest.mark.slow
def test_the_table_has_what_runs_of_the_scenes_have(tmp_path: Path, jobs: list[str]) -> None:
    """The table has 2 m v and v sqrt(k m) of a mass on a spring to its bars, and a run's own number."""
    text = '[vary]\nreed.mass = ["1 g", "4 g"]\nreed.velocity = ["-1 m/s", "-2 m/s"]'
    path = study_file(tmp_path, text)
    table = run_study(load_study(path), tmp_path / "out")
    assert table.parameters == ("reed.mass [g]", "reed.velocity [m/s]")
    assert table.measures == ("landing_impulse_Ns", "landing_filtered_peak_force_N")
    assert list(table.columns["landing_status"]) == ["landed"] * 4
    assert list(table.columns["status"]) == ["done"] * 4
    for mass, speed, impulse, bar, peak, peak_bar in zip(
        *(table.numbers(name) for name in list(table.columns)[1:7]), strict=True
    ):
        assert impulse == pytest.approx(-2e-3 * mass * speed, abs=max(bar, 1e-12))
        assert peak == pytest.approx(-speed * (1e6 * mass * 1e-3) ** 0.5, abs=peak_bar)
    [last] = [row for row in rows(tmp_path / "out") if (row["reed.mass [g]"], row["scene"]) == ("4.0", "4")]
    alone = run_scene(load_scene(path.parent / "scene.toml", {"reed.mass": "4 g", "reed.velocity": "-2 m/s"}), tmp_path)
    assert float(last["landing_impulse_Ns"]) == alone.summary["landing_impulse_Ns"]


@pytest.mark.slow
def test_nothing_is_computed_twice(tmp_path: Path, jobs: list[str]) -> None:
    """Equal scenes, larger studies, other measures and other designs take what was computed already."""
    out = tmp_path / "out"
    run_study(load_study(study_file(tmp_path, '[vary]\nreed.mass = ["1 g", "0.001 kg", "2 g"]')), out)
    assert len(jobs) == 2
    larger = 'design = "zip"\n[vary]\nreed.mass = ["1 g", "2 g", "3 g"]\n[outputs]\nmeasures = ["restitution"]'
    table = run_study(load_study(study_file(tmp_path, larger)), out)
    assert len(jobs) == 3
    assert table.measures == ("restitution",)
    assert table.numbers("restitution") == pytest.approx([1, 1, 1], abs=5e-3)  # of its step
    run_study(load_study(study_file(tmp_path, larger)), out)
    assert len(jobs) == 3


@pytest.mark.slow
def test_a_seat_of_several_scenes_is_computed_once(tmp_path: Path, store_of_the_test: Path) -> None:
    """A study's first scene computes the seat; its numbers depend neither on the number of workers nor on the store."""
    text = '[vary]\nreed.mass = ["1 g", "1.1 g"]'
    path = study_file(tmp_path, text, MESHED)
    run_study(load_study(path), tmp_path / "one", Effort(workers=1))
    kept = {file: file.stat().st_mtime_ns for file in store_of_the_test.glob("*.h5")}
    run_study(load_study(path), tmp_path / "two", Effort(workers=2))
    assert len(kept) >= 2  # with the coarser one behind its error
    assert {file.name for file in store_of_the_test.glob("*.h5")} == {file.name for file in kept}
    assert rows(tmp_path / "one") == rows(tmp_path / "two")
    journals = [read_journal(tmp_path / name / JOURNAL) for name in ("one", "two")]
    of_the_work = ("time_s", "memory", "seat_model", "reused")
    for key, first in journals[0].items():
        second = journals[1][key].summary
        different = {name for name in first.summary.keys() & second.keys() if second[name] != first.summary[name]}
        assert [name for name in different if not any(word in name for word in of_the_work)] == []


def kill_at_random(command: list[str], journal: Path, chance: random.Random, most: int) -> bool:
    """Start the program and end it by SIGKILL once it has put some more lines into the journal, or is about to; whether
    it had not ended by itself."""
    before = len(journal.read_bytes().splitlines()) if journal.exists() else 0
    wanted, pause = before + chance.randint(0, most), chance.random() * chance.choice([0.02, 0.1, 0.5])
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL) as process:
        while process.poll() is None:
            if journal.exists() and len(journal.read_bytes().splitlines()) >= wanted:
                with suppress(subprocess.TimeoutExpired):
                    process.wait(pause)
                break
            time.sleep(0.005)
        alive = process.poll() is None
        process.send_signal(signal.SIGKILL)
    return alive


@posix
@pytest.mark.slow
def test_a_study_survives_kills_at_any_moment(tmp_path: Path, jobs: list[str]) -> None:
    """A study killed three times, or as many as SEATFEM_KILLS says (50 take two minutes), loses nothing, computes
    nothing twice and has all numbers of one that nobody disturbed."""
    kills = int(os.environ.get("SEATFEM_KILLS", "3"))
    scenes = 6 * kills
    path = study_file(tmp_path, DRAWN.format(scenes))
    run_study(load_study(path), tmp_path / "whole")
    out = tmp_path / "out"
    journal, chance = out / JOURNAL, random.Random(kills)
    command = [sys.executable, "-m", "seatfem", "sweep", str(path), "-o", str(out), "--workers", "1", "--no-pictures"]
    done = sum(kill_at_random(command, journal, chance, 3) for _ in range(kills))
    assert done >= 2 * kills // 3
    torn = set(out.glob(".*-*"))  # of one that was killed as it wrote the table
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    assert rows(out) == rows(tmp_path / "whole")
    lines = [json.loads(line) for line in journal.read_text(encoding="utf-8").splitlines()]
    times = Counter(line["key"] for line in lines if "key" in line)
    assert len(times) == scenes
    assert set(times.values()) == {1}
    assert set(out.glob(".*-*")) <= torn  # nothing half-written is left by the one that ended well


@pytest.mark.slow
def test_a_scene_that_fails_stands_in_the_table(tmp_path: Path, monkeypatch: Patch, jobs: list[str]) -> None:
    """A failed scene has a row with its message and values, and is tried again if that is asked for."""
    text = '[vary]\nrun.duration = "0.2 ms"\nseat.mesh.size = ["1 mm", "60 mm"]'
    real = one._carried_out

    def failing(path: Path, changed: dict[str, object], *given: object, **named: object) -> Outcome:
        if changed["seat.mesh.size"] == "60 mm":
            raise RuntimeError("no mesh\nof that kind")
        return real(path, changed, *given, **named)

    monkeypatch.setattr(one, "_carried_out", failing)
    path = study_file(tmp_path, text, MESHED)
    table = run_study(load_study(path), tmp_path / "out")
    assert list(table.columns["status"])[1] == "failed"
    [message] = table.failures()
    assert message.startswith("scene 2 (run.duration [ms] = 0.2, seat.mesh.size [mm] = 60.0): failed: RuntimeError: no")
    assert rows(tmp_path / "out")[1]["message"] == "RuntimeError: no mesh of that kind"
    assert rows(tmp_path / "out")[1]["landing_impulse_Ns"] == ""
    monkeypatch.setattr(one, "_carried_out", real)
    run_study(load_study(path), tmp_path / "out")
    assert len(jobs) == 2
    again = run_study(load_study(path), tmp_path / "out", Effort(retry=True))
    assert len(jobs) == 3
    assert again.has_numbers.all()


@pytest.mark.slow
@posix
def test_a_worker_that_dies_or_hangs_is_an_outcome(tmp_path: Path, monkeypatch: Patch) -> None:
    """It is given one more chance if it dies, and more time if more is given."""
    module = "tests.study.dying_worker:reply"
    monkeypatch.setattr("seatfem.study.sweep.runner.WORKER", module)
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    path = study_file(tmp_path, '[vary]\nreed.mass = ["1 g", "2 g", "3 g"]')
    table = run_study(load_study(path), tmp_path / "out", Effort(limit=1.5))
    assert list(table.columns["status"]) == ["done", "failed", "stopped"]
    assert table.columns["message"][1] == "the process died (signal SIGKILL): no message"
    assert table.columns["message"][2] == "no end within 1.5 s (--limit)"
    lines = (tmp_path / "out" / JOURNAL).read_text(encoding="utf-8").splitlines()
    assert len(lines) == 4
    run_study(load_study(path), tmp_path / "out", Effort(limit=1.0))
    assert len((tmp_path / "out" / JOURNAL).read_text(encoding="utf-8").splitlines()) == 4
    run_study(load_study(path), tmp_path / "out", Effort(limit=1.6))
    assert len((tmp_path / "out" / JOURNAL).read_text(encoding="utf-8").splitlines()) == 6


@pytest.mark.slow
def test_a_measure_that_no_summary_has(tmp_path: Path, jobs: list[str]) -> None:
    path = study_file(tmp_path, '[vary]\nreed.mass = ["1 g", "2 g"]\n[outputs]\nmeasures = ["impulse_N"]')
    for _ in range(2):  # at once, the second time from the journal
        with pytest.raises(StudyError, match=r"'impulse_N'.*'impulse_Ns'"):
            run_study(load_study(path), tmp_path / "out")
    assert jobs == []  # a look tells


@pytest.mark.slow
@posix
def test_nothing_outside_the_folder_is_written(tmp_path: Path, jobs: list[str]) -> None:
    path, out = study_file(tmp_path, '[vary]\nreed.mass = ["1 g"]'), tmp_path / "out"
    out.mkdir()
    mine = tmp_path / "mine"
    mine.write_text("mine", encoding="utf-8")
    (out / JOURNAL).symlink_to(mine)
    with pytest.raises(StudyError, match="is a link"):
        run_study(load_study(path), out)
    (out / JOURNAL).unlink()
    os.mkfifo(out / JOURNAL)
    with pytest.raises(JournalError, match="is a pipe"):
        run_study(load_study(path), out)
    (out / JOURNAL).unlink()
    (out / TABLE).symlink_to(mine)
    run_study(load_study(path), out)
    assert mine.read_text(encoding="utf-8") == "mine"
    assert not (out / TABLE).is_symlink()
    with pytest.raises(OutputError, match="choose another place"):
        run_study(load_study(path), mine / "out")


@pytest.mark.slow
def test_a_damaged_journal_costs_what_is_damaged(tmp_path: Path, jobs: list[str]) -> None:
    path, out = study_file(tmp_path, '[vary]\nreed.mass = ["1 g", "2 g", "3 g"]'), tmp_path / "out"
    run_study(load_study(path), out)
    before = rows(out)
    lines = (out / JOURNAL).read_text(encoding="utf-8").splitlines()
    strange = [
        lines[2].replace('"done"', '"fine"'),
        lines[2].replace('"wall": ', '"wall": "x", "was": '),
        json.dumps(json.loads(lines[2]) | {"outcome": {"state": "done", "summary": {"impulse_Ns": [1]}}}),
        json.dumps(json.loads(lines[2]) | {"outcome": 3}),
    ]
    (out / JOURNAL).write_text("\n".join([lines[1], *strange, "\x00", lines[3][:-9]]), encoding="utf-8")
    run_study(load_study(path), out)
    assert rows(out) == before
    assert len(jobs) == 5


@pytest.mark.slow
@posix
def test_two_sweeps_in_one_folder(tmp_path: Path) -> None:
    path, out = study_file(tmp_path, '[vary]\nreed.mass = ["1 g"]'), tmp_path / "out"
    with claimed(out / f".{JOURNAL}.lock", 0.0), pytest.raises(StudyError, match="another sweep is at work there"):
        run_study(load_study(path), out)


@pytest.mark.slow
@posix
def test_a_claim_is_one_programs(tmp_path: Path) -> None:
    """Two processes that take it in turn never hold it at once; a killed one holds nothing."""
    code = (
        "import sys, time\nfrom pathlib import Path\nfrom seatfem.jobs.folders import claimed\n"
        "place = Path(sys.argv[1])\n"
        "for _ in range(40):\n"
        "    with claimed(place / 'lock', 60) as ours:\n"
        "        assert ours\n"
        "        (place / 'inside').touch(exist_ok=False)\n"
        "        time.sleep(0.002)\n"
        "        (place / 'inside').unlink()\n"
    )
    both = [
        subprocess.Popen([sys.executable, "-c", code, str(tmp_path)], env=os.environ | {"PYTHONPATH": str(ROOT)})
        for _ in range(3)
    ]
    assert [each.wait() for each in both] == [0, 0, 0]
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "lock").touch()
    with claimed(tmp_path / "lock", 0.0) as ours:
        assert ours
        with claimed(tmp_path / "lock", 0.05) as other:
            assert not other


@pytest.mark.slow
def test_sweeps_from_python(tmp_path: Path, monkeypatch: Patch, jobs: list[str]) -> None:
    (tmp_path / "scene.toml").write_text(SPRING, encoding="utf-8")
    vary = {"reed.mass": {"from": "1 g", "to": "2 g"}}
    monkeypatch.setattr("seatfem.study.sweep.table.find_spec", lambda name: None)  # no pandas
    table = seatfem.sweep(
        tmp_path / "scene.toml", vary, design="latin_hypercube", number=3, measures=["restitution", "impulse_Ns"],
        below={"restitution": 0.5}, units={"impulse_Ns": "mN s"},
    )  # fmt: skip
    heads = [
        "scene",
        "reed.mass [g]",
        "restitution",
        "error_bar_restitution",
        "impulse [mN s]",
        "error_bar_impulse [mN s]",
    ]
    assert list(table) == [*heads, "verdict", "landing_status", "status", "wall_time_s", "message", "notes"]
    assert list(table["verdict"]) == ["does not hold"] * 3
    assert table["impulse [mN s]"] == pytest.approx([2 * mass for mass in table["reed.mass [g]"]], rel=5e-3)
    assert table["notes"] == [""] * 3
    assert [path.name for path in tmp_path.iterdir()] == ["scene.toml"]
    with pytest.raises(SceneError, match="number: required"):
        seatfem.sweep(tmp_path / "scene.toml", vary, design="monte_carlo")
    with pytest.raises(SceneError, match=r"vary\.reed\.mas: scene 1 of 1"):
        seatfem.sweep(tmp_path / "scene.toml", {"reed.mas": ["1 g"]})


def test_tables_for_pandas_and_parquet(tmp_path: Path) -> None:
    """A Parquet file comes back through pandas; without these packages none is written."""
    columns = {"scene": [1, 2], "a": [0.1, None], "name": ["x", "y"]}
    try:
        import pandas
        import pyarrow  # noqa: F401
    except ImportError:
        assert not write_parquet(tmp_path / "a.parquet", columns)
        assert not list(tmp_path.iterdir())
        return
    assert write_parquet(tmp_path / "a.parquet", columns)
    frame = pandas.read_parquet(tmp_path / "a.parquet")
    assert frame["a"][0] == 0.1
    assert list(frame) == list(columns)


MASSES = '[vary]\nreed.mass = ["1 g", "1.1 g", "1.2 g", "1 g", "1.3 g", "1.4 g", "1.5 g"]'


@pytest.mark.slow
def test_the_first_scenes_show_how_to_begin(tmp_path: Path, jobs: list[str]) -> None:
    """The first begins by rule, those after it as it ended, all others as the second dearest of these did; a
    study that goes on hands on the same."""
    path = study_file(tmp_path, MASSES)
    cases = cases_of(load_study(path))
    assert [case.leads for case in cases] == [True] * (PILOTS + 2) + [False]  # 1 g twice
    assert cases[3].key == cases[0].key
    assert cases[-1].guides == tuple(dict.fromkeys(case.key for case in cases[:-1]))
    run_study(load_study(path), tmp_path / "out")
    sent, journal = [json.loads(job) for job in jobs], read_journal(tmp_path / "out" / JOURNAL)
    first, *others = (journal[case.key].start for case in cases)
    assert sent[0]["start"] == {}
    assert [job["start"] for job in sent[1:-1]] == [first] * PILOTS
    ranked = sorted((first, *others[:2], *others[3:-1]), key=lambda start: float(start["work"]))
    assert sent[-1]["start"] == ranked[-2]
    assert journal[cases[-1].key].start == {}
    lines = (tmp_path / "out" / JOURNAL).read_text(encoding="utf-8").splitlines(keepends=True)
    (tmp_path / "out" / JOURNAL).write_text("".join(lines[:-1]), encoding="utf-8")
    jobs.clear()
    run_study(load_study(path), tmp_path / "out")
    assert [json.loads(job) for job in jobs] == sent[-1:]


@pytest.mark.slow
def test_a_start_that_is_too_coarse_is_refined(tmp_path: Path) -> None:
    """Each scene measures its own error: it meets its target from wherever it begins, or by rule."""
    path = study_file(tmp_path, MASSES, f'{SPRING}[accuracy]\ntarget = "0.1 %"\n').parent / "scene.toml"
    plan = converge(load_scene(path)).plan
    coarse = replace(plan, method=replace(plan.method, time_step=8 * plan.method.time_step))
    outcome = carry_out(path, {"reed.mass": "2 g"}, 4, start_of(coarse))
    assert outcome.state == "done"
    assert outcome.summary["accuracy_rounds"] in (2, 3)
    alone = carry_out(path, {"reed.mass": "2 g"}, 1, start_of(coarse), leads=True)
    assert alone.state == "done"  # by rule
    own = converge(load_scene(path, {"reed.mass": "2 g"})).plan
    assert alone.start["plan"]["values"] == start_of(own)["plan"]["values"]


def test_scenes_that_are_too_different_begin_by_rule(tmp_path: Path, monkeypatch: Patch) -> None:
    path = study_file(tmp_path, MASSES).parent / "scene.toml"
    start, hertz = start_of(begin_plan(load_scene(path))), {"kind": "hertz", "stiffness": "1e9 N/m^1.5"}
    assert begun(load_scene(path, {"reed.mass": "3 g"}), start) is not None
    others = {"run.duration": "0.3 ms", "accuracy.target": "1 %", "run.time_step": "10 ns", "contact.law": hertz}
    for key, value in others.items():
        assert begun(load_scene(path, {key: value}), start) is None
    assert begun(load_scene(path), {**start, "plan": {**start["plan"], "values": {}}}) is None  # a damaged journal
    assert chosen([]) == {}
    with pytest.raises(TypeError, match="no outcome"):
        one.Outcome("done", start={"work": "x"})
