"""The verbs sweep and optimise, and what plan tells of a study: options, exit codes, messages."""

import json
import re
from pathlib import Path

import pytest

from tests.gallery import Patch, Told
from tests.steps import BAD_INPUT, DONE, FAILED, run_command
from tests.study.crew_at_hand import amount, answer_by, answer_here

SCENE = """seat = { kind = "spring", stiffness = "1 N/um" }
reed = { kind = "rigid_mass", mass = "1 g", velocity = "-1 m/s" }
run = { duration = "0.2 ms" }
"""


@pytest.fixture
def study(tmp_path: Path, monkeypatch: Patch) -> Path:
    """Write a study of three scenes, whose runs are answered at once; the one of 3 g fails."""

    def answer(changed: dict[str, object]) -> dict[str, object]:
        if changed["reed.mass"] == "3 g":
            raise RuntimeError("[uff] failed\x1b[2J")
        return {"landing_impulse_Ns": amount(changed["reed.mass"]), "landing_filtered_peak_force_N": 2.0}

    answer_here(monkeypatch)
    answer_by(monkeypatch, answer)
    monkeypatch.chdir(tmp_path)
    return written(tmp_path, '[vary]\nreed.mass = ["1 g", "2 g", "3 g"]')


def written(folder: Path, text: str) -> Path:
    (folder / "scene.toml").write_text(SCENE, encoding="utf-8")
    path = folder / "gaps.toml"
    path.write_text(f'title = "Masses [1]"\nscene = "scene.toml"\n{text}', encoding="utf-8")
    return path


def refusal(words: list[str], told: Told) -> str:
    """Return what is said of a command that is refused; it leaves no traceback and no file."""
    assert run_command(words) == BAD_INPUT
    said = "".join(told.readouterr())
    assert "Traceback" not in said
    assert sorted(path.name for path in Path().iterdir()) == ["gaps.toml", "scene.toml"]
    return said


@pytest.mark.slow
def test_a_study_is_run_and_told(study: Path, capsys: Told) -> None:
    assert run_command(["sweep", "gaps.toml"]) == FAILED  # of one scene there are no numbers
    out, err = capsys.readouterr()
    assert "Masses [1]: 3 scenes, 2 done, 1 failed" in out
    assert "impulse of landing [N s]: 1 to 2, mean 1.5\n" in out
    assert "scene 3 (reed.mass [g] = 3.0): failed: RuntimeError: [uff] failed\\x1b[2J" in out
    assert "wrote gaps-sweep/study.csv" in out
    assert "3 scenes: about " in err
    assert sorted(path.name for path in Path("gaps-sweep").iterdir()) == [
        "main_effects.csv", "main_effects.png", "report.html", "study.csv", "study.jsonl", "study.parquet",
    ]  # fmt: skip
    assert run_command(["sweep", "gaps.toml", "--quiet", "--no-pictures", "-o", "there"]) == FAILED
    assert not any(capsys.readouterr())
    assert sorted(path.name for path in Path("there").iterdir()) == [
        "main_effects.csv", "report.html", "study.csv", "study.jsonl", "study.parquet",
    ]  # fmt: skip


@pytest.mark.slow
def test_plan_tells_of_a_study(study: Path, capsys: Told) -> None:
    assert run_command(["plan", "gaps.toml"]) == DONE
    assert re.match(
        r"3 scenes: about [\d.]+ s expected with \d+ workers? \([\d.]+ s a scene, ", capsys.readouterr().out
    )
    assert run_command(["plan", "gaps.toml", "--json"]) == DONE
    plan = json.loads(capsys.readouterr().out)
    assert plan["scenes"] == 3
    assert plan["time_s"] >= plan["start"] + plan["each"]
    assert run_command(["plan", "gaps.toml", "--quiet"]) == DONE
    assert not any(capsys.readouterr())


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--workers", "0"], "--workers = 0.*least 1"),
        (["--rounds", "0"], "--rounds = 0.*least 1"),
        (["--limit", "0"], "--limit = 0 s.*positive"),
        (["--limit", "nan"], "--limit = nan"),
        (["--cluster", "tcp://host:8786", "--workers", "2"], "leave it out beside --cluster"),
        (["-o", "scene.toml/deep"], r"\(Not.*directory\).*--output"),
    ],
)
def test_bad_options(options: list[str], message: str, study: Path, capfd: Told) -> None:
    assert re.search(message, " ".join(refusal(["sweep", "gaps.toml", *options], capfd).split()))


@pytest.mark.parametrize("verb", ["sweep", "optimise", "trade"])
def test_an_address_that_is_none(verb: str, study: Path, tmp_path: Path, capsys: Told) -> None:
    file = "scene.toml" if verb == "trade" else "gaps.toml"
    if verb == "optimise":
        written(tmp_path, SOUGHT + 'minimise = "impulse_Ns"')
    assert run_command([verb, file, "--cluster", "host:8786"]) == BAD_INPUT
    assert "tcp://HOST:8786" in " ".join(capsys.readouterr().err.split())


@pytest.mark.parametrize("verb", ["sweep", "plan"])
@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[vary]\nreed.mass = ["1 mm"]', "gaps.toml:4: vary.reed.mass:.*1.*1, reed.mass = '1 mm': '1 mm'"),
        ("[vary]\n", r"vary: \{\}:.*1"),
        ('[vary]\nreed.mass = { from = "1 g", to = "2 g", number = 100000 }', "gaps.toml:4: vary.reed.mass.number"),
        ('limit = 1\n[vary]\nreed.mass = ["1 g", "2 g"]', "gaps.toml:3:.*2 scenes.*limit = 1"),
        ('[vary]\n"seat.kind\x7f" = ["spring"]', "gaps.toml"),
        (f'[vary]\nreed.mass = ["{"9" * 5000} g"]', "a quantity has at most 80"),
        ("[vary]\n" + "a." * 400 + "b = 1", "a key of more than 32 parts"),
        ("[vary]\nx = " + "[" * 5000 + "]" * 5000, "gaps.toml"),
    ],
)
def test_bad_studies(verb: str, text: str, message: str, study: Path, tmp_path: Path, capsys: Told) -> None:
    written(tmp_path, text)
    told = refusal([verb, "gaps.toml", "--quiet"], capsys)
    assert re.search(message, told)
    assert max(map(len, told.splitlines())) < 1500


SOUGHT = '[vary]\nreed.mass = { from = "1 g", to = "2.9 g" }\n[optimise]\n'


@pytest.mark.slow
def test_an_optimum_is_found_and_told(study: Path, tmp_path: Path, capsys: Told, monkeypatch: Patch) -> None:
    def answer(changed: dict[str, object]) -> dict[str, object]:
        if 2.2 < (mass := amount(changed["reed.mass"])) < 2.6:
            raise RuntimeError("[uff] failed\x1b[2J")
        return {"impulse_Ns": mass, "error_bar_impulse_Ns": 0.01}

    answer_by(monkeypatch, answer)
    written(tmp_path, SOUGHT + 'maximise = "impulse_Ns"\nsubject_to = ["impulse_Ns <= 2"]\nmost = 20')
    assert run_command(["optimise", "gaps.toml", "--rounds", "2", "--limit", "60"]) == DONE
    out, err = capsys.readouterr()
    assert re.search(r"Masses \[1\]: \d+ scenes .*[1-9]\d* failed, 3 confirmed", out)
    assert "failed: RuntimeError: [uff] failed\\x1b[2J" in out
    assert re.search(r"impulse_Ns = (2|2.00\d+|1.99\d+) ± 0.01 .*reed.mass = [\d.]+ g, .*impulse_Ns = ", out)
    assert "second best" in out
    assert "at most 20 scenes" in err
    names = ["optimum.csv", "optimum.json", "search.csv", "search.png", "study.jsonl"]
    assert sorted(path.name for path in Path("gaps-optimum").iterdir()) == names
    assert run_command(["optimise", "gaps.toml", "--retry", "--quiet", "--no-pictures", "-o", "there"]) == DONE
    assert not any(capsys.readouterr())
    assert sorted(path.name for path in Path("there").iterdir()) == [name for name in names if "png" not in name]
    assert run_command(["sweep", "gaps.toml"]) == BAD_INPUT
    assert "run it by seatfem optimise" in capsys.readouterr().err
    written(tmp_path, SOUGHT + 'minimise = "impulse_Ns"\nsubject_to = ["impulse_Ns >= 9"]\nmost = 9')
    assert run_command(["optimise", "gaps.toml", "--no-pictures"]) == FAILED
    assert "nearest has impulse_Ns = 2.9 ± 0.01" in capsys.readouterr().out


@pytest.mark.parametrize("verb", ["optimise", "plan"])
@pytest.mark.parametrize(
    ("text", "message"),
    [
        (SOUGHT, "gaps.toml:5: optimise.minimise:"),
        (SOUGHT + 'minimise = "a"\nmaximise = "b"', "gaps.toml:6: optimise.minimise: .*one of"),
        (SOUGHT + 'minimise = "a"\nsubject_to = ["b < 3"]', "toml:7: optimise.subject_to.0: 'b < 3'"),
        (SOUGHT + 'minimise = "a"\nsubject_to = ["b <= 3 mm"]', "'b <= 3 mm'.*summary"),
        (SOUGHT + 'minimise = "a"\nmost = 4', "gaps.toml:7: optimise.most: 4"),
        (SOUGHT + 'minimise = "impulse_Ns"\ncoarse = "0.1 %"', "gaps.toml:7: optimise.coarse: 0.001"),
        ("number = 3\n" + SOUGHT + 'minimise = "a"', r"gaps.toml:3:.*\[optimise\]"),
        (SOUGHT + 'minimise = "a"\n[outputs]\npareto = ["a", "b"]', r"gaps.toml:8: outputs.pareto: \[optimise\]"),
        (SOUGHT.replace("{ from = \"1 g\", to = \"2.9 g\" }", '["1 g"]') + 'minimise = "a"',
         r"gaps.toml:4: vary.reed.mass: \[optimise\].*\{ from"),
        (SOUGHT.replace("1 g", "-1 g") + 'minimise = "a"', "toml:4: vary.reed.mass:.*1.*3, reed.mass = '-1.0"),
        (SOUGHT.replace("[opt", 'accuracy.target = { from = 0.1, to = 0.2 }\n[opt') + 'minimise = "a"',
         r"gaps.toml:5: vary.accuracy.target: \[optimise\]"),
        (SOUGHT.replace("[opt", 'reed.velocity = { from = "-2 m/s", to = "-1 m/s"}\n[opt') + 'minimise = "a"\nmost = 6',
         "gaps.toml:8: optimise.most: 6 evaluations.*2 keys:.*7"),
    ],
)  # fmt: skip
def test_bad_searches(verb: str, text: str, message: str, study: Path, tmp_path: Path, capsys: Told) -> None:
    written(tmp_path, text)
    assert re.search(message, refusal([verb, "gaps.toml", "--quiet"], capsys))


@pytest.mark.slow
def test_a_search_without_its_table_or_measure(study: Path, tmp_path: Path, capsys: Told) -> None:
    assert run_command(["optimise", "gaps.toml"]) == BAD_INPUT
    assert "minimise or maximise" in capsys.readouterr().err
    written(tmp_path, SOUGHT + 'minimise = "impulse_N"')
    assert run_command(["optimise", "gaps.toml"]) == BAD_INPUT
    assert re.search(r"toml:6: optimise\.minimise: .*'impulse_N'; state .*impulse_Ns'", capsys.readouterr().err)
    assert run_command(["optimise", "gaps.toml", "--workers", "0"]) == BAD_INPUT
