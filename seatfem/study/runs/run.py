"""The run of a scene by one call from Python."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

from impact.notices import Progress, Tell, ignore, silent
from seatfem.study.runs.next_round import Limits
from seatfem.study.runs.outcome import RunResult
from seatfem.study.runs.pipeline import run_scene
from seatfem.study.safety import MOST_ROUNDS
from seatfem.study.scene import Scene, SceneError, located
from seatfem.study.scene.load import AnyScene, take_scene, with_target
from seatfem.study.scene.tables import UNCHANGED, is_text
from seatfem.units import parse_quantity


def run(
    scene: AnyScene,
    folder: Path | str | None = None,
    *,
    changed: Mapping[str, object] = UNCHANGED,
    target: float | str | None = None,
    rounds: int = MOST_ROUNDS,
    max_time: float | str = math.inf,
    pictures: bool = True,
    progress: Progress = silent,
    tell: Tell = ignore,
) -> RunResult:
    """Run a scene, as ``seatfem run`` does, and return its numbers with error bars, landings and histories.

        result = seatfem.run("scene.toml", changed={"reed.thickness": "0.2 mm"}, target="2 %")
        print(result.measures["filtered_peak"], result.landings)

    Args:
        scene: path of the scene's file, its text (a string of several lines), or a `Scene`.
        folder: where files and pictures are written, as by the command; ``None``: nothing is kept on file.
        changed: values by dotted keys that replace those of the file, in the same form; ``None`` removes a key.
        target: relative accuracy of the measures asked for, in place of the scene's: 0.02 or "2 %".
        rounds: most rounds of refinement, the first included.
        max_time: wall time after which no further round goes on, in seconds or as "1 min".
        pictures: whether to draw into the ``folder``.
        progress: called with the stage and the fraction done.
        tell: called with a line on each round.

    Raises:
        SeatfemError: `SceneError` of the scene, its keys and the target; `OutputError` of the folder; `RunError` of a
            scene that cannot be run; and what its stages raise.
    """
    checked = take_scene(scene, changed)
    if target is not None:
        checked = with_target(checked, target)
    seconds = parse_quantity(max_time, "time") if isinstance(max_time, str) else max_time
    try:
        return run_scene(checked, folder, progress, tell=tell, limits=Limits(rounds, seconds), pictures=pictures)
    except SceneError as error:
        raise located(error, None if isinstance(scene, Scene) or is_text(scene) else Path(scene)) from None
