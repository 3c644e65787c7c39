"""The margin of a reed's life against one key of a scene, as speed, lift or tilt, and the value that it allows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from impact.progress import Tell, untold
from seatfem.study.impacts.contact import RunError
from seatfem.study.runs.life_curves import MARGIN, MarginCurve, traced, write_curve
from seatfem.study.runs.pipeline import run_scene
from seatfem.study.scene import load_scene
from seatfem.units import UnitError, number_and_unit


def margin_curve(
    scene: Path | str,
    key: str,
    values: Sequence[str | float],
    folder: Path | str,
    *,
    margin: str = MARGIN,
    tell: Tell = untold,
) -> MarginCurve:
    """Run a scene over values of one key, and where two of them enclose a margin of 1, look for the value there.

    Each run is a whole one, with its error bars and without pictures, in a folder of its own; those that look for the
    allowed value, by Brent's method to `NEAR` of it, are on the curve, too. The table is in margin.csv.

    Args:
        scene: file with [life].
        key: dotted, as "reed.release.velocity" or "load.0.gravity".
        values: as the file would have them, all in one unit, such as "2 m/s" or, of a ratio, 0.1; at least two.
        folder: of the runs.
        margin: "life_margin", or "life_speed_margin".
        tell: hears of every run.

    Raises:
        RunError: fewer than two values, several units, a scene that tells no such margin.
        SceneError: a key or a value that the scene cannot have. Also what runs raise.
    """
    numbers, unit = _in_one_unit(key, values)

    def run(value: float) -> tuple[float, float | None]:
        written: object = f"{value!r} {unit}" if unit else value
        result = _one_run(scene, key, written, Path(folder) / f"{value:.9g}", margin)
        tell(f"{key} = {written}: {margin} {result[0]:.4g}")
        return result

    curve = traced(key, unit, numbers, run, margin=margin)
    write_curve(curve, Path(folder) / "margin.csv")
    return curve


def _one_run(scene: Path | str, key: str, value: object, folder: Path, margin: str) -> tuple[float, float | None]:
    summary = run_scene(load_scene(scene, {key: value}), folder, pictures=False).summary
    if margin not in summary:
        raise RunError(f"{scene}: a run with {key} = {value} has no {margin}; ask for it in [life]")
    result, bar = summary[margin], summary.get(f"error_bar_{margin}")
    return math.inf if result is None else float(str(result)), None if bar is None else float(str(bar))


def _in_one_unit(key: str, values: Sequence[str | float]) -> tuple[list[float], str]:
    """Return the values sorted, each once, and their unit."""
    try:
        quantities = [number_and_unit(value) for value in values]
    except UnitError as error:
        raise RunError(f"{key}: {error}") from error
    units = list(dict.fromkeys(unit for _, unit in quantities))
    numbers = sorted({number for number, _ in quantities})
    if len(units) > 1:
        raise RunError(f"{key}: values in {' and '.join(units)}; give all of them in one unit")
    if len(numbers) < 2:
        raise RunError(f"{key}: a curve needs two values or more, not {len(numbers)}")
    return numbers, units[0]
