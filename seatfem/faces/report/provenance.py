"""Provenance of a run: what computed it, and how it is computed again."""

from __future__ import annotations

import hashlib
import math
import shlex
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path
from typing import Any

from seatfem.faces.report.asked import SCENE_COPY, changes_in
from seatfem.faces.report.folder import text_of
from seatfem.faces.report.html_tables import html_rows
from seatfem.faces.tables import time_line
from seatfem.readings import as_number


def provenance(folder: Path, summary: Mapping[str, Any]) -> str:
    """Return bodies, time, the command that repeats the run, and the files with their checksums."""
    stages = summary.get("stages_s")
    known = stages if isinstance(stages, dict) else {}
    spent = {str(name): seconds for name, value in known.items() if (seconds := as_number(value)) is not None}
    facts = [
        ("seat", f"{summary.get('seat_kind')}: {summary.get('seat_model')}"),
        ("reed", str(summary.get("reed_kind"))),
        ("time", f"{_time(summary.get('wall_time_s'))}: {time_line(spent)}"),
        ("to reproduce", _command(folder)),
    ]
    files = [
        (file.name, f"{file.stat().st_size:,} bytes, SHA-256 {_digest(file)}")
        for file in sorted(folder.iterdir())
        if file.is_file() and not file.is_symlink() and file.suffix in (".json", ".h5", ".toml", ".csv")
    ]
    return html_rows(("", ""), facts) + "<h3>Files</h3>" + html_rows(("file", ""), files)


def _time(seconds: object) -> str:
    return "" if (value := as_number(seconds)) is None or not math.isfinite(value) else f"{value:.3g} s"


def _digest(file: Path) -> str:
    with file.open("rb") as opened:
        return hashlib.file_digest(opened, "sha256").hexdigest()


def versions() -> str:
    """Return the versions of this program and of the libraries that it computes with."""
    names = ("seatfem", "numpy", "scipy", "scikit-fem", "gmsh", "numba")
    return "Made by " + ", ".join(f"{name} {metadata.version(name)}" for name in names if _is_there(name))


def _is_there(name: str) -> bool:
    try:
        metadata.version(name)
    except metadata.PackageNotFoundError:
        return False
    return True


def _command(folder: Path) -> str:
    """Return the command line, quoted for a shell, that runs the scene again with the changes made to it."""
    if not (text := text_of(folder / SCENE_COPY)):
        return "seatfem run SCENE"
    return shlex.join(["seatfem", "run", SCENE_COPY, *(word for each in changes_in(text) for word in ("--set", each))])
