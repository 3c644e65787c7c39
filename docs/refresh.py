"""Refresh what the documents show: pictures of the demo, the verification table, the numbers in the README.

    .venv/bin/python docs/refresh.py [FOLDER] [--demo]

Runs the demo (or takes FOLDER, where `seatfem demo -o FOLDER` has run), three of the examples, the first command of the
tutorial and the verification cases, then rewrites docs/images/ (that of the gallery by docs/scene_pictures.py),
docs/verification.md and what is between the markers in README.md.
With --demo: nothing of the verification, which takes minutes.
"""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import drawings
import first_picture
import ring_valve_page
import scene_pictures
from markers import between

from impact.files.atomic import whole_file
from seatfem.faces.cli import demo_scene, run_command
from seatfem.faces.verdict import verdict
from seatfem.structures.store import VARIABLE, Store
from seatfem.study.planning.plan import Plan
from seatfem.study.planning.planner import plan_scene
from seatfem.study.runs.pipeline import run_scene
from seatfem.study.scene import load_scene
from seatfem.study.scene.measures import asked_name
from seatfem.verification.case import Row
from seatfem.verification.table import PROVIDERS, markdown_table, verification_table

ROOT = Path(__file__).resolve().parent.parent
PICTURES = ("force.png", "greens.png", "modes.png", "mesh.png", "mode_1.gif")
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
    copied(folder, PICTURES)
    for example, pictures in OF_EXAMPLES.items():
        made = Path(tempfile.mkdtemp())
        run_scene(load_scene(ROOT / "examples" / f"{example}.toml"), made)
        copied(made, pictures)
    drawings.main()
    first_picture.main([])
    ring_valve_page.main()
    scene_pictures.main([])
    in_python()
    part = Path(shutil.copyfile(ROOT / "meshes" / "valve_body.step", Path(tempfile.mkdtemp()) / "part.step"))
    run_command(["faces", str(part), "-o", str(ROOT / "docs" / "images" / "tutorial_faces.png"), "--quiet"])
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    if "--demo" not in sys.argv[1:]:
        rows = verification_table()
        words = f"# Verification\n\n{PREFACE}{short_table(rows)}\n\n## All cases\n\n{markdown_table(rows)}"
        write(ROOT / "docs" / "verification.md", words)
    readme = between(readme, "demo", demo_table(json.loads((folder / "summary.json").read_text(encoding="utf-8"))))
    readme = between(
        readme, "plan", plan_table(plan_scene(load_scene(demo_scene()), store=Store(Path(tempfile.mkdtemp()))))
    )
    write(ROOT / "README.md", readme)


def copied(folder: Path, names: tuple[str, ...]) -> None:
    """Into docs/images."""
    for name in names:
        shutil.copyfile(folder / name, ROOT / "docs" / "images" / name)


def in_python() -> None:
    """The README's program, and its picture."""
    folder = Path(tempfile.mkdtemp())
    subprocess.run([sys.executable, ROOT / "examples" / "readme.py"], cwd=folder, check=True)
    shutil.copyfile(folder / "force.png", ROOT / "docs" / "images" / "readme_force.png")


PREFACE = (
    "Made by `docs/refresh.py` from the cases of `seatfem verify`. Errors and tolerances are relative; each case fails "
    "when one of its inputs is 3 % off (a test asserts it).\n\n"
)


def short_table(rows: tuple[Row, ...]) -> str:
    """One line a family of cases: their number, the row nearest to its tolerance."""
    lines = ["| cases | values | nearest to its limit | error | allowed | verdict |", "|---|---|---|---|---|---|"]
    remaining = list(rows)
    for provider in PROVIDERS:
        members = [remaining.pop(0) for _ in provider()]
        worst = max(members, key=lambda row: abs(row.error) / row.tolerance)
        verdict = "pass" if all(row.verdict for row in members) else "FAIL"
        title = str(provider.__doc__).splitlines()[0].rstrip(".")
        place = f"{worst.case}: {worst.quantity}".replace("|", r"\|")
        lines.append(
            f"| {title} | {len(members)} | {place} | {abs(worst.error):.1e} | {worst.tolerance:.1e} | {verdict} |"
        )
    return "\n".join(lines)


def demo_table(s: dict[str, float]) -> str:
    """What the demo prints: its sentence, the answer beside the spring's."""
    quantities = (
        ("landing", "landing_time_s", 1e6, "us"),
        ("closing speed", "landing_closing_speed_m_per_s", 1.0, "m/s"),
        ("peak force, mean over 1 us", "landing_filtered_peak_force_N", 1.0, "N"),
        ("impulse", "landing_impulse_Ns", 1e6, "uN s"),
        ("duration", "landing_duration_s", 1e6, "us"),
        ("restitution", "landing_restitution", 1.0, ""),
        ("energy balance error", "energy_residual", 1.0, ""),
    )
    lines = [f"> {verdict(s)}", "", "| | elastic seat | error bar | spring baseline | unit |", "|---|---|---|---|---|"]
    for name, key, factor, unit in quantities:
        bar = "" if s.get(f"error_bar_{key}") is None else f"{s[f'error_bar_{key}'] * factor:.2g}"
        lines.append(f"| {name} | {s[key] * factor:.4g} | {bar} | {s['spring_' + key] * factor:.4g} | {unit} |")
    lines.append(f"\n{s['seat_dof']} unknowns ({s['seat_level']}).")
    return "\n".join(lines)


def plan_table(plan: Plan) -> str:
    """What the demo's plan chooses and predicts."""
    lines = ["| key | value | error left | why |", "|---|---|---|---|"]
    lines += [f"| `{c.key}` | {c.value} | {c.leaves} | {'given: ' * c.given}{c.reason} |" for c in plan.choices]
    each = ((asked_name(name).replace("_", " "), 100 * error) for name, error in plan.error.items())
    errors = ", ".join(f"{words} {percent:.2g} %" for words, percent in each)
    lines.append(f"\nPredicted: {plan.cost.seconds:.2g} s, {plan.cost.memory / 1e9:.2g} GB, error bars: {errors}.")
    return "\n".join(lines)


def write(path: Path, text: str) -> None:
    with whole_file(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
