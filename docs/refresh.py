"""Refresh what the documents show: pictures of the demo, the verification table, the numbers in the README.

    .venv/bin/python docs/refresh.py [FOLDER] [--demo]

Runs the demo (or takes FOLDER, where `seatfem demo -o FOLDER` has run), three of the examples, the README's program,
the first command of the tutorial and the verification cases, then rewrites docs/images/ (that of the gallery by
docs/scene_pictures.py), docs/verification.md and what is between the markers in README.md.
With --demo: nothing of the verification, which takes minutes.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path

import assembly_tutorial
import drawings
import ring_valve_page
import scene_pictures
import sleeve_picture
import study_picture
import valve_picture
from markers import between

from impact.files.safe_files import whole_file
from seatfem.faces.cli import demo_scene, run_command
from seatfem.faces.plan_view import look_lines
from seatfem.faces.tables import is_baseline
from seatfem.readings import reading, unit_of
from seatfem.results import result_of, words_of
from seatfem.structures.cache import VARIABLE
from seatfem.study.answers.decision import decide
from seatfem.study.answers.verdict import verdict
from seatfem.study.runs.forecast import Look, look_at
from seatfem.study.runs.pipeline import run_scene
from seatfem.study.scene import load_scene
from seatfem.verify import Row, known_answers, verification_table

ROOT = Path(__file__).resolve().parent.parent
SLEEVE = ROOT / "examples" / "flapper_on_peek_sleeve.toml"
OF_EXAMPLES = {
    "tilted_landing": ("lip.png", "landing.gif"),
    "impact_stress": ("seat_stress.png", "stress_histories.png", "stress_wave.gif"),
}


def main() -> None:
    words = [word for word in sys.argv[1:] if word != "--demo"]
    if any(word.startswith("-") for word in words) or len(words) > 1:
        raise SystemExit(__doc__)
    os.environ[VARIABLE] = tempfile.mkdtemp()  # a seat that was computed before tells no unknowns
    folders = [Path(word) for word in words]
    folder = folders[0] if folders else Path(tempfile.mkdtemp())
    if not (folder / "summary.json").is_file():
        run_scene(load_scene(demo_scene()), folder)
    valve_picture.draw(folder)
    sleeve = Path(tempfile.mkdtemp())
    run_scene(load_scene(SLEEVE), sleeve)
    copied(sleeve, ("force.png",))
    for example, pictures in OF_EXAMPLES.items():
        made = Path(tempfile.mkdtemp())
        run_scene(load_scene(ROOT / "examples" / f"{example}.toml"), made)
        copied(made, pictures)
    drawings.main()
    sleeve_picture.main([])
    ring_valve_page.main()
    study_picture.main()
    assembly_tutorial.main(Path(tempfile.mkdtemp()))
    scene_pictures.main([])
    in_python()
    part = Path(shutil.copyfile(ROOT / "meshes" / "valve_body.step", Path(tempfile.mkdtemp()) / "part.step"))
    run_command(["faces", str(part), "-o", str(ROOT / "docs" / "images" / "tutorial_faces.png"), "--quiet"])
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    if "--demo" not in sys.argv[1:]:
        rows = verification_table()
        write(ROOT / "docs" / "verification.md", f"# Verification\n\n{PREFACE}{short_table(rows)}\n")
    demo, of_sleeve = (json.loads((run / "summary.json").read_text(encoding="utf-8")) for run in (folder, sleeve))
    readme = between(readme, "demo", f"{first_screen(demo)}\n\n{run_table(demo, OF_DEMO)}")
    readme = between(readme, "sleeve", f"> {verdict(of_sleeve)}\n\n{run_table(of_sleeve, OF_SLEEVE)}")
    os.environ[VARIABLE] = tempfile.mkdtemp()  # nor does a look find what a run has computed
    readme = between(readme, "plan", plan_table(look_at(load_scene(SLEEVE))))
    write(ROOT / "README.md", readme)


def copied(folder: Path, names: tuple[str, ...]) -> None:
    """Into docs/images."""
    for name in names:
        shutil.copyfile(folder / name, ROOT / "docs" / "images" / name)


def in_python() -> None:
    """The README's program, and its picture."""
    folder = Path(tempfile.mkdtemp())
    shutil.copytree(ROOT / "examples", folder / "examples")
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    [program] = re.findall(r"^```python\n(.*?)^```$", readme, re.DOTALL | re.MULTILINE)
    subprocess.run([sys.executable, "-c", program], cwd=folder, check=True)
    shutil.copyfile(folder / "force.png", ROOT / "docs" / "images" / "readme_force.png")


PREFACE = (
    "The cases of `seatfem verify`, by families; the command prints all of them. Their sources are in\n"
    "`tests/known_answers`. Errors and tolerances are relative; each case fails if one of its inputs is 3 % off. All\n"
    "pass unless marked `FAILS`. The table shows the case of each family that is nearest to its tolerance:\n\n"
)


def short_table(rows: tuple[Row, ...]) -> str:
    """One line a family of cases: their number, the row nearest to its tolerance."""
    lines = ["| cases | values | nearest to its limit | error | allowed |", "|---|---|---|---|---|"]
    remaining = list(rows)
    for provider in known_answers().PROVIDERS:
        members = [remaining.pop(0) for _ in provider()]
        worst = max(members, key=lambda row: abs(row.error) / row.tolerance)
        mark = "" if all(row.verdict for row in members) else ": FAILS"
        title = str(provider.__doc__).splitlines()[0].rstrip(".")
        place = f"{worst.case}: {worst.quantity}".replace("|", r"\|")
        lines.append(f"| {title}{mark} | {len(members)} | {place} | {abs(worst.error):.1e} | {worst.tolerance:.1e} |")
    return "\n".join(lines)


OF_SLEEVE = ("landing_filtered_peak_force_N", "landing_impulse_Ns", "landing_duration_s")
OF_DEMO = (
    "landing_time_s",
    "landing_closing_speed_m_per_s",
    *OF_SLEEVE,
    "landing_peak_reed_stress_Pa",
    "peak_reed_stress_after_contact_Pa",
    "life_margin",
)


def first_screen(summary: dict[str, object]) -> str:
    """Return what a run says first: what happens, the decision, why, and what was left out."""
    decision = decide(summary)
    reasons = [f"> - {sentence}" for sentence in (*decision.reasons, decision.checked)]
    left_out = [f"> - {sentence}" for sentence in decision.left_out]
    return "\n".join(
        [f"> {decision.happens}", ">", f"> **{decision.word}**", ">", *reasons, ">", "> Left out:", ">", *left_out]
    )


def run_table(summary: dict[str, object], keys: Sequence[str]) -> str:
    """Return the numbers of a run with their error bars, beside those of the spring unless the seat is that spring."""
    heads = ("seat (static)",) if is_baseline(summary) else ("seat", "spring baseline")
    lines = [f"| | {' | '.join(heads)} |", "|---" * (len(heads) + 1) + "|"]
    for key in keys:
        cells = [reading(summary, prefix + key, unit_of(key)) for prefix in ("", "spring_")[: len(heads)]]
        lines.append(f"| {words_of(result_of(key), summary).strip()} | {' | '.join(cells)} |")
    return "\n".join(lines)


def plan_table(look: Look) -> str:
    """Return what a look chooses and measures."""
    lines = ["| key | value | error left | why |", "|---|---|---|---|"]
    lines += [f"| `{c.key}` | {c.value} | {c.leaves} | {'given: ' * c.given}{c.reason} |" for c in look.plan.choices]
    return "\n".join([*lines, "", *(f"- {line}" for line in look_lines(look) if not line.startswith("note: "))])


def write(path: Path, text: str) -> None:
    with whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
