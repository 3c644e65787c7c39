"""Work on other computers, by workers of dask that see no file of the client's."""

import json
import socket
import sys
import time
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest

import impact
from seatfem.jobs import cluster
from seatfem.jobs.cluster import ClusterError, cluster_crew, threads_of
from seatfem.jobs.crew import Lost
from seatfem.study.sweep.effort import Effort
from seatfem.study.sweep.runner import JOURNAL, Outcome, StudyError
from seatfem.study.sweep.study import load_study
from seatfem.study.sweep.sweep import run_study
from seatfem.study.trade.trade import MEMORY, PROCESSOR, Point, carry_out, run_points
from tests.extremes import battery
from tests.extremes import carry_out as cells_here
from tests.extremes.runner import run_battery
from tests.jobs.crowd import Crowd
from tests.study.test_studies import rows

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
pytest.importorskip("distributed")

SCENE = (
    '[seat]\nkind = "spring"\nstiffness = "1 N/um"\n[reed]\nkind = "greens"\nfile = "../parts/mass.h5"\n'
    'velocity = "-1 m/s"\n[[base]]\nof = "seat"\ndisplacement = "shaken, twice.csv"\n[run]\nduration = "0.3 ms"\n'
)
STUDY = 'scene = "scene.toml"\ndesign = "monte_carlo"\nnumber = {}\n[vary]\nreed.velocity = {}\n'
ANSWERS = "tests.jobs.answers:reply"
SPEEDS = '{ kind = "uniform", from = "-2 m/s", to = "-1 m/s" }'


def study_of(folder: Path, number: int) -> Path:
    """Write a study of a scene that names a table and a Green's function, in two folders."""
    for name in ("scenes", "parts"):
        (folder / name).mkdir(parents=True)
    impact.save_greens(impact.rigid_mass(mass=2e-3, velocity=0.0).greens, folder / "parts" / "mass.h5")
    course = "".join(f"{k / 10:g},{k * k / 20:g}\n" for k in range(11))
    (folder / "scenes" / "shaken, twice.csv").write_text(f"time [ms],displacement [um]\n{course}", encoding="utf-8")
    (folder / "scenes" / "scene.toml").write_text(SCENE, encoding="utf-8")
    path = folder / "scenes" / "study.toml"
    path.write_text(STUDY.format(number, SPEEDS), encoding="utf-8")
    return path


@pytest.mark.slow
def test_a_study_on_other_computers(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two workers that cannot open its files, one of which is killed in its midst: every row once, bit for bit those of
    a study here. The other one goes on: a job that kills its process, hangs, or is given up costs itself alone."""
    path = study_of(tmp_path / "mine", 10)
    out, heard = tmp_path / "out", list[float]()
    with Crowd(tmp_path / "theirs", hidden=tmp_path / "mine") as crowd:
        crowd.hire()
        crowd.hire()
        run_study(load_study(path), tmp_path / "here", Effort(workers=1))

        def kill_one(stage: str, done: float) -> None:
            if 0 < done < 1 and not heard:
                crowd.workers[0].kill()
            heard.extend([done] if done > 0 else [])

        end = time.monotonic() + 60  # at most, after they were started
        while (both := threads_of(crowd.address)) < 2 and time.monotonic() < end:
            time.sleep(0.1)
        run_study(load_study(path), out, Effort(cluster=crowd.address), progress=kill_one)
        assert both == 2
        assert heard[0] < 0.5
        assert crowd.workers[0].wait() < 0
        assert rows(out) == rows(tmp_path / "here")
        entries = [json.loads(line) for line in (out / JOURNAL).read_text(encoding="utf-8").splitlines()]
        assert sorted(Counter(entry["key"] for entry in entries if "key" in entry).values()) == [1] * 10
        scene, journal = path.with_name("scene.toml"), tmp_path / "trade.jsonl"
        points = [Point("coarse", "all keys"), Point("other", "all keys")]
        outcomes = run_points(scene, points, journal, cluster=crowd.address)
        assert values_of(outcomes["coarse"]) == values_of(outcomes["other"]) == values_of(carry_out(scene, points[0]))
        assert len(journal.read_text(encoding="utf-8").splitlines()) == 2
        cell = battery()[0]  # of the extremes
        [outcome] = run_battery([cell], tmp_path / "extremes.jsonl", cluster=crowd.address).values()
        here = replace(cells_here(cell), seconds=0.0)
        assert repr(replace(outcome, seconds=0.0, revision="")) == repr(here)  # nan is not nan
        ends_as_here(crowd.address, path, tmp_path, monkeypatch)
        given_up(crowd.address)
        monkeypatch.setattr(cluster, "code_version", lambda: "0123")
        with pytest.raises(ClusterError, match=r"tcp://.* \w+ of seatfem, .*0123"):
            run_study(load_study(path), tmp_path / "other", Effort(cluster=crowd.address))


def without_files(job: str) -> tuple[str, dict[str, Path]]:
    return job, {}


def values_of(outcome: Outcome) -> dict[str, object]:
    """Return the summary without what the computer has taken for it."""
    return {key: value for key, value in outcome.summary.items() if key not in (PROCESSOR, MEMORY)}


def ends_as_here(address: str, path: Path, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Check that jobs that die by SIGKILL, twice, or reach the limit of time end as they do on this computer."""
    monkeypatch.setattr("seatfem.study.sweep.runner.WORKER", "tests.study.dying_worker:reply")
    (path.parent / "scene.toml").write_text(
        SCENE.replace('kind = "greens"\nfile = "../parts/mass.h5"', 'kind = "rigid_mass"\nmass = "1 g"'),
        encoding="utf-8",
    )
    path.write_text('scene = "scene.toml"\n[vary]\nreed.mass = ["1 g", "2 g", "3 g"]\n', encoding="utf-8")
    table = run_study(load_study(path), folder / "dying", Effort(limit=1.5, cluster=address))
    assert list(table.columns["status"]) == ["done", "failed", "stopped"]
    assert table.columns["message"][1].startswith("the process died (signal SIGKILL)")
    assert table.columns["message"][2] == "no end within 1.5 s (--limit)"


def given_up(address: str) -> None:
    """Whoever stops asking ends the jobs that have begun: the only thread is free again, long before their limit."""
    begun = time.monotonic()
    with cluster_crew(address, ANSWERS, without_files) as ask:
        answers = ask(["a", "hang"], 600.0)
        next(answers)
        time.sleep(0.5)  # the second has begun: it takes a minute
        answers.close()
        [(_, answer)] = ask(["b"], 600.0)
    assert str(answer).startswith("b, ")
    assert time.monotonic() - begun < 30


@pytest.mark.slow
def test_a_job_that_kills_computers_is_lost(tmp_path: Path) -> None:
    """A job is lost after as many computers as allowed; a scheduler that ends is an error with a remedy."""
    with Crowd(tmp_path / "theirs", hidden=tmp_path / "mine", losses=0) as crowd:
        crowd.hire()
        with cluster_crew(crowd.address, ANSWERS, without_files) as ask:
            [(number, answer)] = ask(["kill the computer"], 60.0)
            assert number == 0
            assert isinstance(answer, Lost)
            assert answer.in_words().startswith("the process died (with its computer): ")
            crowd.scheduler.kill()
            crowd.scheduler.wait()
            with pytest.raises(ClusterError, match=r"scheduler.*same command"):
                list(ask(["well"], 60.0))


@pytest.mark.parametrize(
    "address",
    ["host:8786", "http://host:80", "tcp://host", "tcp://host:99999", "tcp://me@host:1", "tls://host:1/x", ""],
)
def test_what_is_no_address(address: str) -> None:
    with pytest.raises(ClusterError, match="tcp://HOST:8786"):
        threads_of(address)


def test_nobody_is_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A port where nobody listens, --workers beside it and a missing package are refused with a remedy."""
    monkeypatch.setattr(cluster, "PATIENCE", 0.3)
    with socket.create_server(("127.0.0.1", 0)) as held:
        address = f"tcp://127.0.0.1:{held.getsockname()[1]}"
    with pytest.raises(ClusterError, match=rf"--cluster {address}:.*0.3 s"):
        threads_of(address)
    with pytest.raises(StudyError, match="leave it out beside --cluster"):
        run_study(load_study(study_of(tmp_path, 1)), tmp_path / "out", Effort(workers=2, cluster=address))
    monkeypatch.setattr(cluster, "find_spec", lambda name: None)
    with pytest.raises(ClusterError, match=r"install.*'seatfem\[cluster\]'"):
        threads_of(address)


@pytest.mark.slow
def test_a_scheduler_without_workers_and_a_file_that_is_too_large(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Crowd(tmp_path / "theirs", hidden=tmp_path / "mine") as crowd:
        with monkeypatch.context() as patch:
            patch.setattr(cluster, "PATIENCE", 1.0)
            with pytest.raises(
                ClusterError, match=rf"no workers are there; start one by `dask worker {crowd.address}`"
            ):
                threads_of(crowd.address)
        crowd.hire()
        monkeypatch.setattr(cluster, "MOST", 2000)
        path = study_of(tmp_path / "mine", 1)
        with pytest.raises(ClusterError, match=r"mass\.h5: .* MB"):
            run_study(load_study(path), tmp_path / "out", Effort(cluster=crowd.address))


def test_tls_without_a_certificate_of_the_client() -> None:
    with socket.create_server(("127.0.0.1", 0)) as held:
        address = f"tls://127.0.0.1:{held.getsockname()[1]}"
        with pytest.raises(ClusterError, match=rf"--cluster {address}: .*TLS.*name your certificates \(docs/"):
            threads_of(address)
