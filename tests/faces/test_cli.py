"""The program: exit codes, messages, no traceback. The pipeline is replaced: what it computes is tested elsewhere."""

import json
import os
import re
import subprocess
import sys
import tomllib
import types
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import pytest

from seatfem import verify
from seatfem.faces import cli, scene_verbs
from seatfem.faces.cli import BAD_INPUT, DONE, FAILED, INTERRUPTED, app, run_command
from seatfem.machine import doctor
from seatfem.machine import libraries as system
from seatfem.machine.doctor import Check
from seatfem.structures.shapes import GeometryError
from seatfem.study.plan import Plan
from seatfem.study.runs.converge import begin_plan
from seatfem.study.scene import Scene

ROOT = Path(__file__).parents[2]
SPRING_SCENE = ROOT / "examples" / "flapper_on_spring.toml"
SUMMARY = {
    "peak_force_N": 12.345678, "filtered_peak_force_N": 12.0, "impulse_Ns": 1.5e-3, "first_contact_s": 653.3246e-6,
    "contact_count": 3, "energy_residual": 1e-12, "spring_peak_force_N": 11.0, "spring_first_contact_s": None,
    "spring_filtered_peak_force_N": 11.0, "filter_width_s": 1e-6, "time_step_s": 1e-8,
    "error_bar_filtered_peak_force_N": 0.1, "accuracy_measures": "filtered_peak, impulse", "accuracy_target": 0.02,
}  # fmt: skip


@dataclass(frozen=True)
class Outcome:
    summary: dict[str, object] = field(default_factory=lambda: dict(SUMMARY))
    messages: tuple[str, ...] = ("pictures [skipped]",)
    files: tuple[Path, ...] = (Path("somewhere/summary.json"),)
    stages: dict[str, float] = field(default_factory=lambda: {"mesh": 0.5, "assembly": 2.0, "files": 0.0})
    met: bool = True
    modes: tuple[object, ...] = ()
    plan: Plan | None = None


class Pipeline(types.ModuleType):
    """Stands in for seatfem.study.runs.pipeline: remembers what it was asked, or fails as told."""

    def __init__(self) -> None:
        super().__init__("seatfem.study.runs.pipeline")
        self.asked: list[tuple[str, str, Path]] = []
        self.wanted: tuple[int | None, float | None] = (None, None)
        self.act: Callable[[], None] = lambda: None
        self.options: dict[str, object] = {}

    def run_scene(
        self, scene: Scene, folder: Path, progress: Callable[[str, float], None], **options: object
    ) -> Outcome:
        self.options = options
        return replace(self._answer("run", scene, folder, progress), plan=begin_plan(scene))

    def compute_greens(self, scene: Scene, path: Path, progress: Callable[[str, float], None]) -> Outcome:
        return self._answer("greens", scene, path, progress)

    def write_modes(
        self,
        scene: Scene,
        folder: Path,
        progress: Callable[[str, float], None],
        *,
        count: int | None,
        up_to_hz: float | None,
    ) -> Outcome:
        self.wanted = (count, up_to_hz)
        return self._answer("modes", scene, folder, progress)

    def _answer(self, verb: str, scene: Scene, path: Path, progress: Callable[[str, float], None]) -> Outcome:
        progress("stepping", 0.0)
        self.act()
        progress("stepping", 1.0)
        self.asked.append((verb, scene.title, path))
        return Outcome()


@pytest.fixture
def pipeline(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Pipeline:
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


def test_run_tells_results_notes_files_and_times(pipeline: Pipeline, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command(["run", str(SPRING_SCENE), "-o", "there", "--full"]) == DONE
    assert pipeline.asked == [("run", "Flapper reed on a spring", Path("there"))]
    out, err = capsys.readouterr()
    lines = [" ".join(line.replace("│", " ").split()) for line in out.splitlines()]
    assert "Flapper reed on a spring" in lines
    assert lines[lines.index("Flapper reed on a spring") + 3] == "Decision: undecided"
    spring = re.compile(r"Peak force .*1 us.* 11 N .*12 N \(-8\.3 %\)\. .* 12 N: 0\.1 N\.")
    assert any(spring.fullmatch(line) for line in lines)
    assert "peak force (mean over 1 us) 12.00 ± 0.10 N 11.00 N -8.3 % 10 0.83 %, reached" in lines
    assert "first contact 653.3 us -" in lines
    assert "contacts 3" in lines
    assert "raw, step 10 ns" in lines
    assert lines.index("peak force 12.35 N 11 N") > lines.index("raw, step 10 ns")
    assert "note: pictures [skipped]" in lines
    assert "wrote somewhere/summary.json" in lines
    assert lines[-1] == "time: assembly 2.0 s, mesh 0.5 s"
    assert "stepping: 0.0 s" in err


def test_what_a_run_tells_on_its_way_is_printed_unless_quiet(
    pipeline: Pipeline, capsys: pytest.CaptureFixture[str]
) -> None:
    pipeline.act = lambda: pipeline.options["tell"]("round 1: [bar] 3 %")  # type: ignore[operator]
    assert run_command(["run", str(SPRING_SCENE)]) == DONE
    assert "round 1: [bar] 3 %\n" in capsys.readouterr().err
    assert run_command(["run", str(SPRING_SCENE), "--quiet"]) == DONE
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("verb", sorted(name for name in app if not name.startswith("-")))
def test_every_verb_has_help(verb: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command([verb, "--help"]) == DONE
    assert f"Usage: seatfem {verb}" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["rum"], 'Did you mean "run"?'),
        (["run"], "SCENE"),
        (["run", str(SPRING_SCENE), "--fast"], "--fast"),
        (["run", str(SPRING_SCENE), "out"], "see seatfem run --help"),
        (["run", "absent.toml"], "absent.toml: "),
    ],
)
def test_bad_input(arguments: list[str], message: str, capfd: pytest.CaptureFixture[str]) -> None:
    assert run_command(arguments) == BAD_INPUT
    out, err = capfd.readouterr()
    assert message in out + err
    assert "Traceback" not in out + err


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
def test_failures_are_one_line(
    pipeline: Pipeline, capsys: pytest.CaptureFixture[str], error: BaseException, code: int, message: str
) -> None:
    pipeline.act = failing(error)
    assert run_command(["run", str(SPRING_SCENE), "--quiet"]) == code
    (line,) = capsys.readouterr().err.splitlines()
    assert re.match(f"seatfem: .*{message}", line)


def test_debug_shows_the_traceback(pipeline: Pipeline, monkeypatch: pytest.MonkeyPatch) -> None:
    pipeline.act = failing(ZeroDivisionError())
    with pytest.raises(ZeroDivisionError):
        run_command(["run", str(SPRING_SCENE), "--debug"])
    monkeypatch.setenv("SEATFEM_DEBUG", "1")
    with pytest.raises(ZeroDivisionError):
        run_command(["run", str(SPRING_SCENE)])


def test_doctor_exit_codes(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
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
def test_verify_exit_codes(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], passed: bool, code: int, verdict: str
) -> None:
    monkeypatch.setattr(verify, "verification_table", lambda progress: [Row(True), Row(passed)])
    assert run_command(["verify"]) == code
    assert verdict in capsys.readouterr().out


def test_the_demo_scene_is_found_in_a_source_tree_and_in_a_wheel(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
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


def test_set_changes_keys(pipeline: Pipeline, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    given = ["--set", "reed.thickness=0.2 mm", "--set", "reed.n_modes=7", "--set", 'title="Thin"']
    assert run_command(["run", str(SPRING_SCENE), "-o", str(tmp_path / "out"), "--quiet", *given]) == DONE
    assert pipeline.asked[-1][1] == "Thin"
    kept = (tmp_path / "out" / "scene.toml").read_text(encoding="utf-8")
    assert kept.startswith("# --set 'reed.thickness=0.2 mm'\n# --set 'reed.n_modes=7'\n")
    for wrong, message in (("reed.thickness", "must be KEY=VALUE"), ("reed.thicknes=1 mm", "did you mean 'thickness'")):
        for verb in ("run", "plan"):
            assert run_command([verb, str(SPRING_SCENE), "--set", wrong]) == BAD_INPUT
            assert message in capfd.readouterr().err


@pytest.mark.slow
def test_init_writes_a_scene_once(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
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


def test_init_knows_no_such_kind(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    assert run_command(["init", "../flapper", "--output", str(tmp_path / "a.toml")]) == BAD_INPUT
    assert "is no kind; choose" in capfd.readouterr().err
    assert not list(tmp_path.iterdir())


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
