"""Outcomes on file, one JSON line each: a ladder that was stopped goes on where it was."""

from __future__ import annotations

import json
from contextlib import suppress
from dataclasses import asdict
from hashlib import sha256
from pathlib import Path

from seatfem.jobs import journal
from seatfem.jobs.journal import entries
from seatfem.study.trade.point import Outcome, Point


def key_of(scene: Path, point: Point, version: str) -> str:
    """What an outcome depends on: the text of the scene, what the point changes in it, and the code."""
    parts = [version, scene.read_text(encoding="utf-8"), asdict(point)]
    return sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()[:20]


def read_journal(path: Path) -> dict[str, Outcome]:
    """Outcomes by key. A line that a kill cut short, or that is none of ours, is skipped."""
    found: dict[str, Outcome] = {}
    for entry in entries(path):
        with suppress(KeyError, TypeError):
            found[entry["key"]] = Outcome(**entry["outcome"])
    return found


def append(path: Path, key: str, point: Point, outcome: Outcome) -> None:
    """One more line, on file at once."""
    journal.append(path, {"key": key, "point": point.name, "outcome": asdict(outcome)})
