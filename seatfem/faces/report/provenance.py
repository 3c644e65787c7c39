"""Provenance of a run: what computed it, and how it is computed again."""

from __future__ import annotations

import hashlib
import shlex
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from seatfem.faces.report.asked import SCENE_COPY, changes_in
from seatfem.faces.report.folder import text_of
from seatfem.faces.report.html_tables import html_rows
from seatfem.faces.tables import time_line
from seatfem.machine.packages import installed_version
from seatfem.readings import as_number


def provenance(folder: Path, summary: Mapping[str, Any]) -> str:
    """Return bodies, time, the command that repeats the run, and the files with their checksums."""
    stages = summary.get("stages_s")
    known = stages if isinstance(stages, dict) else {}
    spent = {str(name): seconds for name, value in known.items() if (seconds := as_number(value)) is not None}
    wall, command = as_number(summary.get("wall_time_s")), ["seatfem", "run", "SCENE"]
    if text := text_of(folder / SCENE_COPY):
        command[2:] = [SCENE_COPY, *(word for change in changes_in(text) for word in ("--set", change))]
    facts = [
        ("seat", f"{summary.get('seat_kind')}: {summary.get('seat_model')}"),
        ("reed", str(summary.get("reed_kind"))),
        ("time", f"{'' if wall is None else f'{wall:.3g} s'}: {time_line(spent)}"),
        ("to reproduce", shlex.join(command)),
    ]
    files = [
        (file.name, f"{file.stat().st_size:,} bytes, SHA-256 {_digest(file)}")
        for file in sorted(folder.iterdir())
        if file.is_file() and not file.is_symlink() and file.suffix in (".json", ".h5", ".toml", ".csv")
    ]
    return html_rows(("", ""), facts) + "<h3>Files</h3>" + html_rows(("file", ""), files)


def _digest(file: Path) -> str:
    with file.open("rb") as opened:
        return hashlib.file_digest(opened, "sha256").hexdigest()


def versions() -> str:
    """Return the versions of this program and of the libraries that it computes with."""
    names = ("seatfem", "numpy", "scipy", "scikit-fem", "gmsh", "numba")
    return "Made by " + ", ".join(f"{name} {number}" for name in names if (number := installed_version(name)))
