"""Write the numbers of the page of two parts as they are drawn: what follows from the files, and the landing.

    .venv/bin/python docs/assembly_tutorial.py [FOLDER]

Runs examples/cad_assembly.toml into FOLDER, or takes what is there, and rewrites what is between the markers of
docs/tutorial_assembly.md, and docs/images/tutorial_assembly_force.png.
"""

from __future__ import annotations

import json
import math
import shutil
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from markers import between

from seatfem.readings import reading
from seatfem.results import rows_of, words_of
from seatfem.structures.inspection.mesh_file import open_part
from seatfem.study.runs.pipeline import run_scene
from seatfem.study.scene import Scene, load_scene

ROOT = Path(__file__).resolve().parent.parent
PAGE = ROOT / "docs" / "tutorial_assembly.md"
EXAMPLE = ROOT / "examples" / "cad_assembly.toml"


def main(folder: Path) -> None:
    """Run what is missing and write page and picture."""
    scene = load_scene(EXAMPLE)
    if not (folder / "summary.json").is_file():
        run_scene(scene, folder)
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    page = PAGE.read_text(encoding="utf-8")
    for part in ("plate", "flapper"):
        page = between(page, part, face_rows(ROOT / "meshes" / f"assembly_{part}.step"))
    page = between(between(page, "placed", placed_rows(scene)), "landing", landing_rows(summary))
    PAGE.write_text(page, encoding="utf-8")
    shutil.copyfile(folder / "force.png", ROOT / "docs" / "images" / "tutorial_assembly_force.png")


def face_rows(file: Path) -> str:
    """Return the faces of a part as Markdown."""
    lines = ["| number | surface | area (mm^2) | centre (mm) |", "|---|---|---|---|"]
    for face in open_part(file).faces:
        centre = ", ".join(f"{1e3 * each:.4g}" if abs(each) > 1e-7 else "0" for each in face.centre)
        numbers = " = ".join(map(str, face.numbers))
        lines.append(f"| {numbers} | {face.kind.lower()} | {1e6 * face.area:.4g} | {centre} |")
    return "\n".join(lines)


def placed_rows(scene: Scene) -> str:
    """Return what follows from the files as Markdown."""
    contact, frame = scene.contact, scene.reed.frame  # type: ignore[attr-defined]
    at = scene.reed.geometry().centre  # type: ignore[attr-defined]
    rows = {
        "`contact.gap`": f"{1e6 * contact.gap:.4g} um",
        "`contact.tilt`": f"{math.degrees(contact.tilt):.4g} deg",
        "`contact.offset`": _in_mm(contact.offset),
        "`reed.contact_at`, from the clamp": _in_mm(at),
        "`reed.frame.origin`, the middle of the clamp": _in_mm(frame.origin),
    }
    return "\n".join(["| key | from the files |", "|---|---|", *(f"| {key} | {text} |" for key, text in rows.items())])


def landing_rows(summary: Mapping[str, Any]) -> str:
    """Return the rows of the landing as Markdown."""
    lines = ["| landing | seat | spring |", "|---|---|---|"]
    for row in rows_of(summary)["landing"]:
        spring = reading(summary, f"spring_{row.key}", row.unit)
        lines.append(f"| {words_of(row, summary).strip()} | {reading(summary, row.key, row.unit)} | {spring} |")
    return "\n".join(lines)


def _in_mm(place: tuple[float, ...]) -> str:
    return "(" + ", ".join(f"{1e3 * each:.4g}" for each in place) + ") mm"


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(tempfile.mkdtemp()))
