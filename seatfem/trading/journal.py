"""Outcomes on file, one JSON line each: a ladder that was stopped goes on where it was."""

from __future__ import annotations

import json
from contextlib import suppress
from dataclasses import asdict
from hashlib import sha256
from pathlib import Path

from seatfem.trading.point import Outcome, Point


def key_of(scene: Path, point: Point, version: str) -> str:
    """What an outcome depends on: the text of the scene, what the point changes in it, and the code."""
    parts = [version, scene.read_text(encoding="utf-8"), asdict(point)]
    return sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:20]


def read_journal(path: Path) -> dict[str, Outcome]:
    """Outcomes by key. A line that a kill cut short, or that is none of ours, is skipped."""
    found: dict[str, Outcome] = {}
    if not path.exists():
        return found
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        with suppress(ValueError, KeyError, TypeError, RecursionError):
            entry = json.loads(line)
            found[entry["key"]] = Outcome(**entry["outcome"])
    return found


def append(path: Path, key: str, point: Point, outcome: Outcome) -> None:
    """One more line, on the disk at once; after a line that was cut short it begins on a new one."""
    path.parent.mkdir(parents=True, exist_ok=True)
    whole = not path.exists() or path.stat().st_size == 0 or path.read_bytes().endswith(b"\n")
    line = json.dumps({"key": key, "point": point.name, "outcome": asdict(outcome)})
    with path.open("a", encoding="utf-8") as file:
        file.write(("" if whole else "\n") + line + "\n")
