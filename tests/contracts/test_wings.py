"""A wing is a part of the program that plugs into registries: the core imports none, and works where one is removed."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from tests.contracts.test_imports import FILES, ROOT, imports

WINGS = {
    "studies": (
        ("seatfem/study/sweep", "seatfem/study/trade", "seatfem/faces/study_verbs.py", "seatfem/faces/study_view.py"),
        {"optimise", "sweep", "trade", "init study", "seatfem.Trade", "seatfem.draw_trade", "seatfem.measure_trade",
         "seatfem.optimise", "seatfem.sweep", "seatfem.write_trade"},
    ),
    "identify": (("seatfem/study/identify", "seatfem/faces/identify_verbs.py"), {"identify"}),
    "live page": (("seatfem/faces/live", "seatfem/faces/live_verbs.py"), {"live"}),
    "gas": (("seatfem/wings/gas.py", "impact/gas.py", "impact/pictures/gas_plot.py"),
            {"[gas]", "scene/gas.md", "last cycle"}),
    "life": (("seatfem/wings/life.py", "seatfem/life", "impact/life"),
             {"[life]", "scene/life.md", "fatigue", "seatfem.load_strength", "seatfem.margin_curve",
              "seatfem.plot_margins"}),
    "measured responses": (
        ("impact/measured", "impact/pictures/fit_plots.py", "seatfem/structures/formats/uff_responses.py",
         "seatfem/structures/kinds/measured.py"),
        {"init frf", "impact.FrequencyResponse", "impact.fit_poles", "impact.read_impulse_response",
         "seatfem.FrequencyResponse", "seatfem.fit_impulse_response", "seatfem.fit_poles", "seatfem.read_frf",
         "seatfem.read_frf_uff"},
    ),
}  # fmt: skip
"""Files of each wing, and what the program has no more without them."""
TESTS = (
    "tests/contracts/test_toy_kinds.py", "tests/contracts/test_toy_law.py", "tests/contracts/test_toy_measure.py",
    "tests/contracts/test_results.py", "tests/study/test_scene.py",
    "tests/study/test_template.py", "tests/faces/test_cli.py", "tests/faces/test_report.py",
)  # fmt: skip
"""Files of the core's tests, of which those are run that are not slow."""
OFFERED = """
import json, sys
sys.path.insert(0, "docs")
import impact, seatfem
from scene_page import scene_pages
from summary_page import lines_of_page
from seatfem.faces.cli import app
from seatfem.faces.wings import file_kinds
from seatfem.fields import kind_of
from seatfem.structures.kinds import kinds_of
from seatfem.study.scene.keys import scene_schema
offered = [name for name in app if not name.startswith("-")] + [f"init {each.name}" for each in file_kinds()]
offered += [f"init {kind_of(each)}" for each in kinds_of()]
offered += [f"{package.__name__}.{name}" for package in (impact, seatfem) for name in package.__all__]
offered += [*scene_pages(), *(part.partition("\\n")[0] for part in "\\n".join(lines_of_page()).split("\\n## ")[1:])]
print(json.dumps(offered + [f"[{key}]" for key in scene_schema()["properties"]]))
"""


@pytest.mark.parametrize("wing", WINGS)
def test_nothing_outside_a_wing_imports_it(wing: str) -> None:
    own, _ = WINGS[wing]
    modules = tuple(each.removesuffix(".py").replace("/", ".") for each in own)
    assert all((ROOT / each).exists() for each in own)
    assert [
        f"{path.relative_to(ROOT)}:{line} imports {name}"
        for path in FILES
        if not path.relative_to(ROOT).as_posix().startswith(own)
        for line, name in imports(path)
        if f"{name}.".startswith(tuple(f"{module}." for module in modules))
    ] == []


@pytest.mark.slow
@pytest.mark.parametrize("wing", WINGS)
def test_the_core_works_without_a_wing(wing: str, tmp_path: Path) -> None:
    """What the wing offers is gone without its files, and nothing else; the core's tests pass."""
    own, lost = WINGS[wing]
    everything = json.loads(run_in(ROOT, "-c", OFFERED))
    for folder in ("impact", "seatfem", "tests"):
        shutil.copytree(ROOT / folder, tmp_path / folder)
    for each in ("docs", "examples", "meshes", "benchmarks", "pyproject.toml"):
        (tmp_path / each).symlink_to(ROOT / each)
    for each in own:
        (shutil.rmtree if (tmp_path / each).is_dir() else Path.unlink)(tmp_path / each)
    left = json.loads(run_in(tmp_path, "-c", OFFERED))
    assert {*everything} - {*left} == lost
    run_in(tmp_path, "-m", "seatfem", "--help")
    run_in(tmp_path, "-m", "seatfem", "run", "tests/contracts/mass_on_spring.toml", "--output", "out")
    run_in(tmp_path, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", "-m", "not slow", *TESTS)


def run_in(folder: Path, *arguments: str) -> str:
    """Return what Python prints in a copy of the project."""
    environment = os.environ | {"PYTHONPATH": str(folder)}
    done = subprocess.run(
        [sys.executable, *arguments], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout[-4000:] + done.stderr
    return done.stdout
