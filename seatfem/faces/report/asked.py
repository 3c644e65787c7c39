"""What was asked, and how it was planned, kept beside the results of a run."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Final

from impact.files.atomic import write_whole
from seatfem.faces.plan_view import plan_json

if TYPE_CHECKING:
    from seatfem.study.planning.plan import Plan

SCENE_COPY: Final = "scene.toml"
PLAN_FILE: Final = "plan.json"


def keep_asked(scene: bytes, plan: Plan | None, folder: Path, changes: Sequence[str] = ()) -> tuple[Path, ...]:
    """Write the scene file's content, below the ``changes`` that were made to it as comments, and the plan of the last
    round into ``folder``; the files, in this order."""
    told = "".join(f"# --set {each!r}\n" for each in changes).encode("utf-8")
    written = {SCENE_COPY: told + scene} | ({} if plan is None else {PLAN_FILE: plan_json(plan).encode("utf-8")})
    for name, content in written.items():
        write_whole(folder / name, content)
    return tuple(folder / name for name in written)
