"""The verb sweep, and what plan tells of a study: options, exit codes, messages."""

import json
import re
from pathlib import Path

import pytest

from seatfem.faces.cli import BAD_INPUT, DONE, FAILED, run_command
from seatfem.study.sweep import outcome as one
from seatfem.study.sweep.outcome import Outcome
from seatfem.study.sweep.study import Design, Outputs, Study, load_study
from seatfem.study.sweep.variations import Variation, kinds_below

ROOT = Path(__file__).parents[2]
SCENE = """[seat]
kind = "spring"
stiffness = "1 N/um"
[reed]
kind = "rigid_mass"
mass = "1 g"
velocity = "-1 m/s"
[run]
duration = "0.2 ms"
"""
Told = pytest.CaptureFixture[str]


@pytest.fixture
def study(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Three scenes, whose runs are answered at once; the one of 3 g fails."""

    def answered(jobs: list[str], *_: object, **__: object):
        for number, job in enumerate(jobs):
            yield number, one._reply(job)

    def carried_out(path: Path, changed: dict[str, object], rounds: int) -> Outcome:
        if changed["reed.mass"] == "3 g":
            raise RuntimeError("[uff] failed\x1b[2J")
        return Outcome(
            "done", "", 0.0, {"impulse_Ns": float(str(changed["reed.mass"])[0]), "filtered_peak_force_N": 2.0}
        )

    monkeypatch.setattr("seatfem.study.sweep.runner.answers_at_once", answered)
    monkeypatch.setattr(one, "_carried_out", carried_out)
    monkeypatch.chdir(tmp_path)
    return written(tmp_path, '[vary]\nreed.mass = ["1 g", "2 g", "3 g"]')


def written(folder: Path, text: str) -> Path:
    (folder / "scene.toml").write_text(SCENE, encoding="utf-8")
    path = folder / "gaps.toml"
    path.write_text(f'title = "Masses [1]"\nscene = "scene.toml"\n{text}', encoding="utf-8")
    return path


def test_a_study_is_run_and_told(study: Path, capsys: Told) -> None:
    assert run_command(["sweep", "gaps.toml"]) == FAILED  # of one scene there are no numbers
    out, err = capsys.readouterr()
    assert "Masses [1]: 3 scenes, 2 done, 1 failed" in out
    assert "scene 3 (reed.mass [g] = 3.0): failed: RuntimeError: [uff] failed\\x1b[2J" in out
    assert "wrote gaps-sweep/study.csv" in out
    assert "3 scenes: about " in err
    assert sorted(path.name for path in Path("gaps-sweep").iterdir()) == [
        "main_effects.csv",
        "main_effects.png",
        "study.csv",
        "study.jsonl",
    ]
    assert run_command(["sweep", "gaps.toml", "--quiet", "--no-pictures", "-o", "there"]) == FAILED
    assert not any(capsys.readouterr())
    assert sorted(path.name for path in Path("there").iterdir()) == ["main_effects.csv", "study.csv", "study.jsonl"]


def test_a_study_of_which_all_is_done(study: Path, tmp_path: Path) -> None:
    written(tmp_path, '[vary]\nreed.mass = ["1 g", "2 g"]')
    assert run_command(["sweep", "gaps.toml", "--quiet", "--workers", "2", "--rounds", "1", "--limit", "9.5"]) == DONE


def test_plan_tells_of_a_study(study: Path, capsys: Told) -> None:
    assert run_command(["plan", "gaps.toml"]) == DONE
    assert re.match(
        r"3 scenes: about [\d.]+ s predicted with \d+ workers? \([\d.]+ s a scene, ", capsys.readouterr().out
    )
    assert run_command(["plan", "gaps.toml", "--json"]) == DONE
    told = json.loads(capsys.readouterr().out)
    assert told["scenes"] == 3
    assert told["time_s"] >= told["start"] + told["each"]
    assert run_command(["plan", "gaps.toml", "--quiet"]) == DONE
    assert not any(capsys.readouterr())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--workers", "0"], "--workers = 0 must be at least 1"),
        (["--workers", "many"], "many"),
        (["--rounds", "0"], "--rounds = 0 must be at least 1"),
        (["--limit", "0"], "--limit = 0 s must be positive and finite"),
        (["--limit", "nan"], "--limit = nan s must be positive and finite"),
        (["--limit", "inf"], "--limit = inf s must be positive and finite"),
        (["-o", "scene.toml/deep"], "cannot be written (Not a directory); choose another place with --output"),
        (["--fast"], "--fast"),
    ],
)
def test_bad_options(options: list[str], message: str, study: Path, capfd: Told) -> None:
    assert run_command(["sweep", "gaps.toml", *options]) == BAD_INPUT
    out, err = capfd.readouterr()
    assert message in " ".join((out + err).split())
    assert "Traceback" not in out + err
    assert sorted(path.name for path in Path().iterdir()) == ["gaps.toml", "scene.toml"]


@pytest.mark.parametrize("verb", ["sweep", "plan"])
@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            '[vary]\nreed.mass = ["1 mm"]',
            "gaps.toml:4: vary.reed.mass: scene 1 of 1, reed.mass = '1 mm': '1 mm' is a length",
        ),
        ("[vary]\n", "vary: {}: dictionary should have at least 1 item"),
        (
            '[vary]\nreed.mass = { from = "1 g", to = "2 g", number = 100000 }',
            "gaps.toml:4: vary.reed.mass.number: 100000",
        ),
        ('limit = 1\n[vary]\nreed.mass = ["1 g", "2 g"]', "gaps.toml:3: limit: 2 scenes are more than limit = 1"),
        ('[vary]\n"seat.kind\x7f" = ["spring"]', "gaps.toml"),
        (f'[vary]\nreed.mass = ["{"9" * 5000} g"]', "a quantity has at most 80"),
        ("[vary]\n" + "a." * 400 + "b = 1", "a key of more than 32 parts"),
        ("[vary]\nx = " + "[" * 5000 + "]" * 5000, "gaps.toml"),
    ],
)
def test_bad_studies(verb: str, text: str, message: str, study: Path, tmp_path: Path, capsys: Told) -> None:
    written(tmp_path, text)
    assert run_command([verb, "gaps.toml", "--quiet"]) == BAD_INPUT
    err = capsys.readouterr().err
    assert message in err
    assert "Traceback" not in err
    assert max(map(len, err.splitlines())) < 1500
    assert sorted(path.name for path in tmp_path.iterdir()) == ["gaps.toml", "scene.toml"]


def test_a_scene_is_no_study(study: Path, capsys: Told) -> None:
    assert run_command(["sweep", "scene.toml"]) == BAD_INPUT
    assert "scene.toml: vary: required key is missing: values by dotted key of the scene" in capsys.readouterr().err


def test_the_page_has_every_key_design_and_kind() -> None:
    text = (ROOT / "docs" / "studies.md").read_text(encoding="utf-8")
    keys = {*Study.model_fields} - {"vary", "outputs"} | {f"outputs.{key}" for key in Outputs.model_fields}
    assert [key for key in keys if f"| `{key}` |" not in text] == []
    assert [name for name in Design.__args__ if f"`{name}`" not in text] == []
    kinds = {kind.model_fields["kind"].annotation.__args__[0]: kind for kind in kinds_below(Variation)}
    for name, kind in kinds.items():
        if name not in ("list", "range"):
            assert f'kind = "{name}"' in text
        keys = {field.alias or key for key, field in kind.model_fields.items()} - {"kind", "values"}
        assert [key for key in keys if f"{key} = " not in text] == []


def test_the_example_is_a_study() -> None:
    found = load_study(ROOT / "examples" / "tolerance_study.toml")
    assert found.number_of_scenes == 32
