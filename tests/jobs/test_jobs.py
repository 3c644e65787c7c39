"""Workers end with their parent, asked or killed; those that hang, fail or die are lost alone; folders are removed."""

import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path

import psutil
import pytest

from seatfem.jobs import folders
from seatfem.jobs.crew import Lost, crew
from seatfem.jobs.folders import LOCK, private_folder, sweep
from seatfem.jobs.processes import Terminated, ended_by_signals, exit_code
from tests.gallery import write_scene

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
SOON = 3.0  # s within which orphans have ended, on a busy machine too
ASKED = 20.0  # s within which a program tidies up and an interpreter ends
LONG = (
    '\n[seat]\nkind = "block"\nwidth = "20 mm"\ndepth = "20 mm"\nthickness = "8 mm"\npatch_width = "4 mm"\n'
    'patch_depth = "4 mm"\nmaterial = { young = "200 GPa", density = "7850 kg/m^3" }\n'
    'mesh = { size = "0.5 mm", contact_size = "0.4 mm" }\ngreens = { bandwidth = "50 kHz" }\n[reed]\n'
    'kind = "rigid_mass"\nmass = "1 g"\nvelocity = "-1 m/s"\n[run]\nduration = "20 us"\n'
)
"""Its mesh of some 400,000 elements takes the better part of a minute."""
SHORT = '[seat]\nkind = "spring"\nstiffness = "1 N/um"\n' + LONG[LONG.index("[reed]") :]


@contextmanager
def program(folder: Path, *command: str) -> Iterator[subprocess.Popen[str]]:
    """Start a program with an empty TMPDIR of its own; nothing of it survives the test."""
    temporary = folder / "tmp"
    temporary.mkdir(exist_ok=True)
    environment = os.environ | {"TMPDIR": str(temporary), "PYTHONPATH": str(ROOT)}
    pipe = subprocess.PIPE
    command = (sys.executable, *command)
    with subprocess.Popen(command, cwd=folder, stdout=pipe, stderr=pipe, text=True, env=environment) as process:
        family = [psutil.Process(process.pid)]
        try:
            yield process
        finally:
            with suppress(psutil.NoSuchProcess):
                family += family[0].children(recursive=True)
            for member in family:
                with suppress(psutil.NoSuchProcess):
                    member.kill()


def seatfem(folder: Path, *arguments: str):
    return program(folder, "-m", "seatfem", *arguments)


def workers(process: subprocess.Popen[str], which: str, busy: float = 0.0) -> list[psutil.Process]:
    """Return all descendants once one whose command line holds ``which`` took that much processor time."""
    top = psutil.Process(process.pid)

    def at_work() -> list[psutil.Process]:
        family = top.children(recursive=True)
        for member in family:
            with suppress(psutil.Error):
                used = member.cpu_times()
                if which in " ".join(member.cmdline()) and used.user + used.system >= busy:
                    return family
        return []

    return wait_for(at_work, 120, process)


def wait_for(find: Callable[[], list[psutil.Process]], most: float, process: subprocess.Popen[str]):
    end = time.monotonic() + most
    while time.monotonic() < end and process.poll() is None:
        if family := find():
            return family
        time.sleep(0.05)
    raise AssertionError(f"no worker at work (the program: {process.poll()})")


def alive(family: Sequence[psutil.Process]) -> list[psutil.Process]:
    """Return those that still run after `SOON`; nobody may be there to bury a zombie."""
    end = time.monotonic() + SOON
    while time.monotonic() < end and (remaining := [m for m in family if _runs(m)]):
        time.sleep(0.05)
    return remaining


def _runs(member: psutil.Process) -> bool:
    with suppress(psutil.NoSuchProcess):
        return member.is_running() and member.status() != psutil.STATUS_ZOMBIE
    return False


def error_bars_of(folder: Path) -> list[str]:
    return sorted(path.name for path in (folder / "tmp").iterdir() if path.name.startswith("seatfem"))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "which"),
    [(("greens",), "_gmsh_worker"), (("trade", "--quick"), "_gmsh_worker")],
    ids=["mesher", "mesher of a trade"],
)
def test_nothing_survives_kill_9(arguments: tuple[str, ...], which: str, tmp_path: Path) -> None:
    with seatfem(tmp_path, *arguments, str(write_scene(tmp_path, LONG))) as process:
        family = workers(process, which, busy=0.5)
        process.kill()
        process.wait()
        assert alive(family) == []
        assert error_bars_of(tmp_path) != []  # a killed program cannot tidy up
    (tmp_path / "next.toml").write_text(SHORT, encoding="utf-8")
    with seatfem(tmp_path, "plan", "next.toml", "--quiet") as process:
        assert process.wait(60) == 0, process.stderr.read()
    assert error_bars_of(tmp_path) == []


@pytest.mark.slow
def test_asked_to_end_the_program_tidies_up(tmp_path: Path) -> None:
    with seatfem(tmp_path, "run", str(write_scene(tmp_path, LONG)), "-o", "out") as process:
        family = workers(process, "_gmsh_worker", busy=0.5)
        process.terminate()
        assert process.wait(ASKED) == 143
        assert alive(family) == []
        message = process.stderr.read()
    assert "seatfem: interrupted" in message
    assert "Traceback" not in message
    assert error_bars_of(tmp_path) == []
    assert not list((tmp_path / "out").glob("*"))


@pytest.mark.slow
@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGHUP, 129), (signal.SIGINT, 130)])
def test_the_exit_code_names_the_signal(number: signal.Signals, code: int, tmp_path: Path) -> None:
    text = "import signal; signal.signal(signal.SIGHUP, signal.SIG_DFL)\n"  # nohup, around the tests, ignores SIGHUP
    text += "import sys, time; from seatfem.faces import cli, terminal\n"
    text += "def busy(*given): print('busy', flush=True); time.sleep(60)\n"
    text += "terminal.load = busy; sys.exit(cli.run_command(['plan', 'scene.toml']))"
    with program(tmp_path, "-c", text) as process:
        assert process.stdout.readline() == "busy\n"
        process.send_signal(number)
        assert process.wait(ASKED) == code
        assert re.fullmatch("seatfem: interrupted.*\n", process.stderr.read())


WORKER = """
import ctypes, os, time
from pathlib import Path
from seatfem.jobs.processes import lines_from_parent
def reply(job):
    Path("pid").write_text(str(os.getpid()))
    {busy}
if __name__ == "__main__":
    lines_from_parent()
    reply("by itself")
"""
PARENT = """
import os, threading, time
from pathlib import Path
from seatfem.jobs.crew import crew
from seatfem.jobs.processes import start_worker
os.environ["PYTHONPATH"] = {path!r}
def start():
    global worker
    worker = start_worker("worker", log=Path("log"))
def hire():
    with crew("worker:reply") as ask:
        list(ask(["a job"], 60.0))
{start}
time.sleep(60)
"""


@pytest.mark.parametrize(
    ("busy", "start"),
    [
        ("time.sleep(60)", "start()"),
        ("time.sleep(60)", "t = threading.Thread(target=start); t.start(); t.join()"),
        ("time.sleep(60)", "hire()"),
        pytest.param(
            "ctypes.PyDLL(None).sleep(60)",  # holds on to the interpreter: no thread of the worker runs
            "hire()",
            marks=pytest.mark.skipif(sys.platform != "linux", reason="only Linux kills with the parent"),
        ),
    ],
    ids=["by pipe", "after the thread that started it", "of a crew", "of a crew, in compiled code"],
)
def test_a_worker_ends_with_its_parent(busy: str, start: str, tmp_path: Path) -> None:
    path = os.pathsep.join([str(tmp_path), str(ROOT)])
    (tmp_path / "worker.py").write_text(WORKER.format(busy=busy), encoding="utf-8")
    with program(tmp_path, "-c", PARENT.format(path=path, start=start)) as process:
        file = tmp_path / "pid"
        family = wait_for(lambda: [psutil.Process(int(file.read_text()))] if file.exists() else [], 60, process)
        time.sleep(1.0)  # at work
        assert all(map(_runs, family))
        process.kill()
        process.wait()
        assert alive(family) == []


def test_a_folder_is_private_and_goes_with_its_block(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    with private_folder("test") as folder:
        assert folder.parent == tmp_path
        assert folder.stat().st_mode & 0o077 == 0
        (folder / "deep").mkdir()
        (folder / "deep" / "file").write_text("", encoding="utf-8")
        assert sweep() == ()  # its owner lives
        assert (folder / "deep" / "file").exists()
        with pytest.raises(ZeroDivisionError), private_folder("other") as other:
            raise ZeroDivisionError
        assert not other.exists()
    assert list(tmp_path.iterdir()) == []


def test_only_what_is_ours_and_left_over_is_swept(tmp_path: Path) -> None:
    outside = tmp_path / "outside"
    outside.mkdir()
    (outside / "precious").write_text("", encoding="utf-8")
    (outside / LOCK).write_text("", encoding="utf-8")
    among = tmp_path / "among"
    dead, foreign, unlocked, linked = (among / f"seatfem-{name}" for name in ("dead", "foreign", "unlocked", "linked"))
    other = among / "other-1"
    for folder in (dead, foreign, unlocked, other):
        folder.mkdir(parents=True)
    for folder in (dead, foreign, other):
        (folder / LOCK).write_text("", encoding="utf-8")
    (dead / "link").symlink_to(outside)
    (dead / "arrays.npz").write_text("", encoding="utf-8")
    linked.symlink_to(outside)
    lock_is_a_link = among / "seatfem-lock"
    lock_is_a_link.mkdir()
    (lock_is_a_link / LOCK).symlink_to(outside / LOCK)
    (among / "seatfem-file").write_text("", encoding="utf-8")
    kept = {unlocked.name, linked.name, other.name, lock_is_a_link.name, "seatfem-file"}
    if os.geteuid() == 0:
        os.chown(foreign, 12345, 12345)
        kept.add(foreign.name)
    assert dead in sweep(among)
    assert {path.name for path in among.iterdir()} == kept
    assert sorted(path.name for path in outside.iterdir()) == [LOCK, "precious"]
    assert sweep(tmp_path / "nowhere") == ()


def _asked(*numbers: signal.Signals) -> None:
    with ended_by_signals():
        for number in numbers:
            os.kill(os.getpid(), number)
        time.sleep(1)
        pytest.fail("went on")


def test_signals_that_are_ignored_or_handled_are_left_alone() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)  # nohup
    try:
        with pytest.raises(Terminated) as stopped:
            _asked(signal.SIGHUP, signal.SIGTERM)
        assert exit_code(stopped.value) == 143
        assert exit_code(KeyboardInterrupt()) == 130
        assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
        assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL
    finally:
        signal.signal(signal.SIGHUP, before)


def test_a_second_signal_does_not_disturb_the_tidying_up() -> None:
    tidied = []

    def work() -> None:
        try:
            os.kill(os.getpid(), signal.SIGTERM)
            time.sleep(1)
        finally:
            os.kill(os.getpid(), signal.SIGTERM)
            tidied.append(True)

    with pytest.raises(Terminated), ended_by_signals():
        work()
    assert tidied == [True]


def test_a_journal_keeps_whole_lines_and_passes_the_rest(tmp_path: Path) -> None:
    path = tmp_path / "new" / "log.jsonl"
    assert list(folders.entries(path)) == []
    folders.append(path, {"a": 1})
    with path.open("a", encoding="utf-8") as file:
        file.write('{"a": 2')  # a kill
    folders.append(path, {"a": "3\n\u2028"})
    with path.open("a", encoding="utf-8") as file:
        file.write("[1]\nnull\n" + "[" * 5000 + "\n")
    folders.append(path, {"a": 4})
    assert [entry["a"] for entry in folders.entries(path)] == [1, "3\n\u2028", 4]


@pytest.mark.slow
def test_two_programs_share_a_journal(tmp_path: Path) -> None:
    code = "import sys; from pathlib import Path; from seatfem.jobs.folders import append\n"
    code += "for k in range(300): append(Path('log'), {'who': sys.argv[1], 'k': k, 'much': 'x' * 5000})"
    command = [sys.executable, "-c", code]
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    both = [subprocess.Popen([*command, who], cwd=tmp_path, env=environment) for who in ("a", "b")]
    assert [process.wait(60) for process in both] == [0, 0]
    entries = list(folders.entries(tmp_path / "log"))
    for who in ("a", "b"):
        assert [entry["k"] for entry in entries if entry["who"] == who] == list(range(300))


def test_every_interpreter_is_started_without_the_current_folder() -> None:
    """Every started interpreter has -P: Python puts the current folder first otherwise."""
    started = [
        (path, line)
        for room in ("impact", "seatfem")
        for path in (ROOT / room).rglob("*.py")
        for line in path.read_text(encoding="utf-8").splitlines()
        if "sys.executable, " in line and '"-' in line
    ]
    assert started
    assert [path for path, line in started if 'sys.executable, "-P"' not in line] == []


ANSWERS = "tests.jobs.answers:reply"


@pytest.mark.slow
def test_jobs_are_answered_in_other_processes() -> None:
    """Two other processes of one thread each answer every job of several batches once."""
    with crew(ANSWERS, workers=2) as ask:
        batches = [[f"slow {batch} {k}" for k in range(3)] for batch in range(2)]
        answers = [answer for jobs in batches for _, answer in sorted(ask(jobs, 60.0))]
    parts = [str(answer).split(", ") for answer in answers]
    assert [job for job, _, _ in parts] == [*batches[0], *batches[1]]
    assert {threads for _, _, threads in parts} == {"1"}
    pids = {pid for _, pid, _ in parts}
    assert len(pids) == 2
    assert str(os.getpid()) not in pids


@pytest.mark.slow
def test_what_is_lost_costs_itself_alone() -> None:
    """A lost job has its reason, the end of its log and its time; jobs before and after it are answered."""
    with crew(ANSWERS) as ask:
        answers = dict(ask(["a", "die", "fail", "b", "hang", "c"], 1.5))
    lost = {number: answer for number, answer in answers.items() if isinstance(answer, Lost)}
    assert sorted(lost) == [1, 2, 4]
    assert lost[1].in_words() == "the process died (signal SIGKILL): at die"
    assert lost[2].in_words() == "the process died (exit code 1): KeyError: 'no such thing'"
    assert [each.hung for each in lost.values()] == [False, False, True]
    assert lost[4].log.splitlines()[-1] == "at hang"
    assert 1.5 <= lost[4].seconds < 10.0
    pids = [str(answers[number]).split(", ")[1] for number in (0, 3, 5)]
    assert len(set(pids)) == 3


@pytest.mark.slow
def test_whoever_stops_asking_ends_what_has_begun() -> None:
    """Jobs are taken as there are workers for them; the crew is there for others."""
    taken = count()

    def jobs() -> Iterator[str]:
        for job in ("a", "hang", "b"):
            next(taken)
            yield job

    begun = time.monotonic()
    with crew(ANSWERS) as ask:
        answers = ask(jobs(), 60.0)
        next(answers)
        assert next(taken) == 1
        answers.close()
        [(_, answer)] = ask(["c"], 60.0)
    assert str(answer).startswith("c, ")
    assert time.monotonic() - begun < 30


@pytest.mark.slow
def test_workers_that_cannot_be_started_are_told_for_each_job() -> None:
    with crew("tests.jobs.no_such_module:reply", workers=2) as ask:
        answers = dict(ask(["a", "b", "c"], 60.0))
    words = "the process died (exit code 1): ModuleNotFoundError: No module named 'tests.jobs.no_such_module'"
    assert [answer.in_words() for _, answer in sorted(answers.items()) if isinstance(answer, Lost)] == [words] * 3


@pytest.mark.slow
def test_what_workers_leave_is_removed() -> None:
    with crew(ANSWERS) as ask:
        [(_, folder)] = ask(["litter"], 60.0)
        assert Path(str(folder)).is_dir()
    assert not Path(str(folder)).exists()


@pytest.mark.slow
def test_workers_neither_run_the_script_again_nor_take_modules_beside_it(tmp_path: Path) -> None:
    """A script without a guard beside foreign modules runs once, and its workers take none of them."""
    for name in ("pebble", "runpy", "psutil"):
        (tmp_path / f"{name}.py").write_text("import pathlib; pathlib.Path('ran').touch(); raise SystemExit(7)")
    script = f"from seatfem.jobs.crew import crew\nwith crew({ANSWERS!r}) as ask: print(*ask(['a'], 60.0))\n"
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(["", str(ROOT)])}
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout.startswith("(0, 'a, ")
    assert done.stdout.count("\n") == 1
    assert not (tmp_path / "ran").exists()
