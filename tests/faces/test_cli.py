"""The program: exit codes, messages, no traceback. The pipeline is replaced: what it computes is tested elsewhere."""

import json
import os
import re
import subprocess
import sys
import tomllib
import types
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import pytest

from seatfem import verify
from seatfem.faces import cli, scene_verbs
from seatfem.faces.cli import BAD_INPUT, DONE, FAILED, INTERRUPTED, app, run_command
from seatfem.machine import doctor
from seatfem.machine import libraries as system
from seatfem.machine.doctor import Check
from seatfem.structures.shapes import GeometryError
from tests.gallery import Patch, Told
from tests.steps import Plan, Scene, begin_plan

ROOT = Path(__file__).parents[2]
SPRING_SCENE = ROOT / "examples" / "flapper_on_spring.toml"


@dataclass(frozen=True)
class Outcome:
    summary: dict[str, object] = field(default_factory=lambda: {"impulse_Ns": 1.5e-3})
    messages: tuple[str, ...] = ()
    files: tuple[Path, ...] = ()
    stages: dict[str, float] = field(default_factory=dict)
    met: bool = True
    plan: Plan | None = None


class Pipeline(types.ModuleType):
    """Stands in for seatfem.study.runs.pipeline: remembers what it was asked, or fails as told."""

    def __init__(self) -> None:
        super().__init__("seatfem.study.runs.pipeline")
        self.asked: list[str] = []
        self.act: Callable[[], None] = lambda: None

    def run_scene(
        self, scene: Scene, folder: Path, progress: Callable[[str, float], None], **options: object
    ) -> Outcome:
        self.act()
        self.asked.append(scene.title)
        return Outcome(plan=begin_plan(scene))


@pytest.fixture
def pipeline(monkeypatch: Patch, tmp_path: Path) -> Pipeline:
    stand_in = Pipeline()
    monkeypatch.chdir(tmp_path)  # where the scene and its plan are kept
    monkeypatch.setitem(sys.modules, "seatfem.study.runs.pipeline", stand_in)
    monkeypatch.setattr(scene_verbs, "pipeline", stand_in)
    monkeypatch.delenv("SEATFEM_DEBUG", raising=False)
    return stand_in


def failing(error: BaseException) -> Callable[[], None]:
    def act() -> None:
        raise error

    return act


@pytest.mark.parametrize("verb", sorted(name for name in app if not name.startswith("-")))
def test_every_verb_has_help(verb: str, capsys: Told) -> None:
    assert run_command([verb, "--help"]) == DONE
    assert f"Usage: seatfem {verb}" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("error", "code", "message"),
    [
        (GeometryError("lip_width: must be > 0"), BAD_INPUT, "lip_width: must be > 0"),
        (system.MissingLibraryError("libGLU; apt-get"), FAILED, "libGLU; apt-get"),
        (FileNotFoundError(2, "No such file", "x.step"), BAD_INPUT, "x.step: .*check"),
        (PermissionError(13, "Permission denied", "out"), FAILED, "Permission denied: 'out'"),
        (MemoryError(), FAILED, "memory; .*coarser .*seat.mesh.size"),
        (ZeroDivisionError("of zero"), FAILED, "ZeroDivisionError: of zero; .*bug.* --debug or SEATFEM_DEBUG=1"),
        (KeyboardInterrupt(), INTERRUPTED, "interrupted"),
    ],
)
def test_failures_are_one_line(pipeline: Pipeline, capsys: Told, error: BaseException, code: int, message: str) -> None:
    pipeline.act = failing(error)
    assert run_command(["run", str(SPRING_SCENE), "--quiet"]) == code
    (line,) = capsys.readouterr().err.splitlines()
    assert re.match(f"seatfem: .*{message}", line)


def test_debug_shows_the_traceback(pipeline: Pipeline, monkeypatch: Patch) -> None:
    pipeline.act = failing(ZeroDivisionError())
    with pytest.raises(ZeroDivisionError):
        run_command(["run", str(SPRING_SCENE), "--debug"])
    monkeypatch.setenv("SEATFEM_DEBUG", "1")
    with pytest.raises(ZeroDivisionError):
        run_command(["run", str(SPRING_SCENE)])


def test_doctor_exit_codes(monkeypatch: Patch, capsys: Told) -> None:
    fine, optional = Check("python", True, "3.11"), Check("pictures", False, "no EGL", "apt-get", required=False)
    monkeypatch.setattr(doctor, "doctor_report", lambda: (fine, optional))
    assert run_command(["doctor"]) == DONE
    assert "no EGL" in capsys.readouterr().out
    monkeypatch.setattr(doctor, "doctor_report", lambda: (fine, Check("gmsh", False, "absent", "pip install gmsh")))
    assert run_command(["doctor", "--quiet"]) == FAILED
    assert capsys.readouterr() == ("", "gmsh: absent; pip install gmsh\n")


@dataclass(frozen=True)
class Row:
    verdict: bool
    case: str = "rod"
    quantity: str = "peak"
    exact: float = 1.0
    ours: float = 1.001
    error: float = 1e-3
    tolerance: float = 1e-2


@pytest.mark.parametrize(("passed", "code", "verdict"), [(True, DONE, "pass"), (False, FAILED, "FAIL")])
def test_verify_exit_codes(monkeypatch: Patch, capsys: Told, passed: bool, code: int, verdict: str) -> None:
    monkeypatch.setattr(verify, "verification_table", lambda progress: [Row(True), Row(passed)])
    assert run_command(["verify"]) == code
    assert verdict in capsys.readouterr().out


def test_the_demo_scene_is_found_in_a_source_tree_and_in_a_wheel(tmp_path: Path, monkeypatch: Patch) -> None:
    assert cli.demo_scene().is_file()
    shipped = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    included = shipped["tool"]["hatch"]["build"]["targets"]["wheel"]["force-include"]
    files = (cli.DEMO_SCENE, "suction_valve.csv", "strengths/invented_strip.toml", "strengths/invented_strip.csv")
    shown = {f"examples/{file}": f"seatfem/data/{file}" for file in files}
    assert included == {
        **shown,
        "tests/known_answers": "seatfem/known_answers",
        "tests/measured": "seatfem/measured_sets",
    }
    inside = tmp_path / "data" / cli.DEMO_SCENE
    inside.parent.mkdir()
    inside.write_text("")
    monkeypatch.setattr(scene_verbs.resources, "files", lambda package: tmp_path)
    assert cli.demo_scene() == inside


def test_set_changes_keys(pipeline: Pipeline, tmp_path: Path, capfd: Told) -> None:
    given = ["--set", "reed.thickness=0.2 mm", "--set", "reed.n_modes=7", "--set", 'title="Thin"']
    assert run_command(["run", str(SPRING_SCENE), "-o", str(tmp_path / "out"), "--quiet", *given]) == DONE
    assert pipeline.asked == ["Thin"]
    kept = (tmp_path / "out" / "scene.toml").read_text(encoding="utf-8")
    assert kept.startswith("# --set 'reed.thickness=0.2 mm'\n# --set 'reed.n_modes=7'\n")
    for wrong, message in (("reed.thickness", "must be KEY=VALUE"), ("reed.thicknes=1 mm", "did you mean 'thickness'")):
        for verb in ("run", "plan"):
            assert run_command([verb, str(SPRING_SCENE), "--set", wrong]) == BAD_INPUT
            assert message in capfd.readouterr().err


@pytest.mark.slow
def test_init_writes_a_scene_once(tmp_path: Path, capfd: Told) -> None:
    file = tmp_path / "mine.toml"
    assert run_command(["init", "ball", "--output", str(file), "--schema"]) == DONE
    output = " ".join(capfd.readouterr().out.split())
    assert "next: seatfem draw" in output
    assert file.read_text(encoding="utf-8").startswith("#:schema seatfem.schema.json\n")
    assert json.loads((tmp_path / "seatfem.schema.json").read_text(encoding="utf-8"))["title"] == "seatfem scene"
    written = file.read_bytes()
    assert run_command(["init", "disc", "--output", str(file)]) == BAD_INPUT
    assert "exists already" in capfd.readouterr().err
    assert file.read_bytes() == written


@pytest.mark.slow
def test_letters_that_a_terminal_lacks_end_nothing() -> None:
    code = "from seatfem.faces import cli; cli.run_command = lambda arguments: print('12.0 \\u00b1 0.1 N'); cli.main()"
    environment = {**os.environ, "PYTHONIOENCODING": "ascii:strict"}
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env=environment)
    assert (done.returncode, done.stdout, done.stderr) == (0, "12.0 ? 0.1 N\n", "")


@pytest.mark.slow
@pytest.mark.parametrize(("setting", "threads"), [(None, "1"), ("3", "3")])
def test_dense_products_take_one_thread_unless_asked_for_more(setting: str | None, threads: str) -> None:
    """The number of threads is set before numpy is imported, which reads it once."""
    code = (
        "import atexit, os, sys; from seatfem.faces import cli; assert 'numpy' not in sys.modules;"
        "atexit.register(lambda: print(os.environ['OPENBLAS_NUM_THREADS'])); sys.argv[1:] = ['--version']; cli.main()"
    )
    environment = {key: value for key, value in os.environ.items() if key != "OPENBLAS_NUM_THREADS"}
    environment |= {} if setting is None else {"OPENBLAS_NUM_THREADS": setting}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)
    assert done.stdout.splitlines()[-1] == threads, done.stderr
