"""Every fenced block of the pages runs, validates as what it is, or says on its first line why it is not run.

The blocks of a page are one session, top to bottom, in a folder that holds copies of examples/ and meshes/:

- toml whose first line is "# NAME.toml" is kept under that name; whatever names no scene to change is validated as a
  scene, a study or a file of strength. "# in NAME.toml": keys of that scene; the scene is validated with them.
- bash runs `seatfem` here: `run` without pictures, but where a look leaves more than `DEAR` the look alone, and not
  of examples/, which have tests of their own; of verbs that take minutes, and of what follows a run that was left out,
  there is `--help`. Of `make`, `python` and `pip` it is asked that target, script and extra exist.
- python is executed; names live on through the page. What is a script of examples/ is tested there.
"""

import re
import shlex
import shutil
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

from seatfem.life.table import load_strength
from seatfem.study.identify.record import load_identification
from seatfem.study.sweep.study import load_study
from tests.steps import load_scene, look_at, run_command

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
DEAR = 1.5  # seconds of a look, and of the rounds that it may leave to a run
ELSEWHERE = ("demo", "verify", "trade", "sweep", "optimise", "view", "live")  # long, or with windows; tested there
SCRIPTS = [path.read_text(encoding="utf-8") for path in (ROOT / "examples").glob("*.py")]  # tested as such
REASON = "# not run here: "
OTHERS = {"text", "{eval-rst}"}
EXTRAS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
TARGETS = set(" ".join(re.findall(r"^\.PHONY: (.*)", (ROOT / "Makefile").read_text(encoding="utf-8"), re.M)).split())


def blocks(page: Path) -> list[tuple[str, str]]:
    """Return language and content of each fenced block."""
    return re.findall(r"^```(\S*)\n(.*?)^```$", page.read_text(encoding="utf-8"), re.DOTALL | re.MULTILINE)


TO_RUN = [page for page in PAGES if any(language not in OTHERS for language, _ in blocks(page))]


@pytest.mark.slow(but="studies")
@pytest.mark.parametrize("page", TO_RUN, ids=[page.stem for page in TO_RUN])
def test_snippets(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shutil.copytree(ROOT / "examples", tmp_path / "examples")
    shutil.copytree(ROOT / "meshes", tmp_path / "meshes")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SEATFEM_STORE", str(tmp_path / "store"))
    names: dict[str, object] = {"__name__": "__main__"}
    for language, text in blocks(page):
        if text.startswith(REASON) or language in OTHERS:
            assert len(text.partition("\n")[0]) > len(REASON) or language in OTHERS, "a reason, please"
        elif language == "python" and text not in SCRIPTS:
            exec(compile(text, str(page), "exec"), names)
        elif language == "toml":
            validate(text)
        elif language == "bash":
            for line in text.replace("\\\n", " ").splitlines():
                if words := shlex.split(line, comments=True):
                    carry_out(words)
        elif language != "python":
            pytest.fail(f"{page.name}: a block of {language or 'no language'}: {text[:60]}")


def validate(text: str) -> None:
    """Validate a scene, a study, a strength, records of a rig, or keys to be put into a scene."""
    first = text.partition("\n")[0]
    if named := re.fullmatch(r"# in (\S+\.toml)", first):
        load_scene(named[1], changed=dict(dotted(tomllib.loads(text))))
        return
    named = re.fullmatch(r"# (\S+\.toml)", first)
    assert named, f"a scene begins with a comment that names it: {first}"
    path = Path(named[1])
    path.write_text(text, encoding="utf-8")
    keys = tomllib.loads(text)
    readers = {"vary": load_study, "source": load_strength, "record": load_identification}
    next((read for key, read in readers.items() if key in keys), load_scene)(path)


def dotted(table: dict[str, object], before: str = "") -> Iterator[tuple[str, object]]:
    """Yield keys of nested tables, as one names them in a change."""
    for key, value in table.items():
        if isinstance(value, dict) and not before:
            yield from dotted(value, f"{key}.")
        else:
            yield f"{before}{key}", value


def carry_out(words: list[str]) -> None:
    program, *rest = words
    name = Path(program).name
    if name == "seatfem":
        if rest[0] in ELSEWHERE or (rest[0] in ("report", "export") and not Path(rest[1]).exists()):
            rest = [rest[0], "--help"]
        elif rest[0] == "run":
            rest.append("--no-pictures")
            if rest[1].startswith("examples/") or look_at(load_scene(Path(rest[1])), DEAR).left.seconds > DEAR:
                return
        assert run_command(rest) == 0, words
    elif name == "make":
        assert set(rest) <= TARGETS, words
    elif name == "python":
        script = rest[0] if rest[0] != "-m" else rest[1].replace(".", "/")
        assert (ROOT / script).exists(), words
    elif name == "pip":
        extras = re.search(r"\[(.+)\]", rest[-1])
        assert rest[0] == "install"
        assert extras is None or set(extras[1].split(",")) <= EXTRAS.keys(), words
    elif name == "cp":
        shutil.copy(rest[0], rest[1])
    else:
        pytest.fail(f"how is {name} tried?")
