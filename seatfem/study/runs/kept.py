"""Numbers that follow from a run and take long to find: on file by the hash of all they depend on, and found again."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any, Final

from impact.files.atomic import write_whole
from impact.files.input_files import read_text
from seatfem.machine.code import cache_folder, code_version
from seatfem.structures.store import content_key
from seatfem.study.impacts.touches import Touches
from seatfem.study.method import FIELDS
from seatfem.study.runs.ended import UNSOUND
from seatfem.study.runs.round import Round
from seatfem.study.scene.parcel import by_content

MOST: Final = 100_000  # bytes of a file
OLDEST: Final = 2000  # files that are kept, the last written first


def kept_numbers(
    done: Round, touches: Touches, what: str, compute: Callable[[], Mapping[str, Any]]
) -> Mapping[str, Any]:
    """Return numbers of one run of a round as they are on file, else as ``compute`` finds them, and keep them there.

    They are found again where scene, method, forces of the run and program are the same; a folder that cannot be
    written to, and a file that is damaged, cost the time to compute alone.

    Args:
        done: the round.
        touches: its own run, or one of its scene on another seat.
        what: they are called.
        compute: them, as JSON holds them: mappings, lists, texts, numbers.
    """
    path = _file(done, touches, what)
    with suppress(*UNSOUND):
        numbers = json.loads(read_text(path, MOST, ValueError))
        if isinstance(numbers, dict):
            return numbers
    numbers = dict(compute())
    with suppress(OSError, TypeError):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, json.dumps(numbers).encode())
        _prune(path.parent)
    return numbers


def _file(done: Round, touches: Touches, what: str) -> Path:
    parts = None if touches.parts is None else touches.parts.force
    key = content_key(
        {
            "what": what,
            "scene": by_content(done.plan.scene),
            "method": {key: done.plan.method.value(key) for key in FIELDS},
            "forces": [touches.seat.force, parts, touches.stopper_force],
            "gap": touches.seat.gap,
            "step": touches.seat.dt,
            "program": code_version(),
        }
    )
    return cache_folder() / "numbers" / f"{key}.json"


def _prune(folder: Path) -> None:
    """Delete the files written longest ago beyond `OLDEST`."""
    files = sorted(folder.glob("*.json"), key=lambda file: -file.stat().st_mtime)
    for file in files[OLDEST:]:
        file.unlink(missing_ok=True)
