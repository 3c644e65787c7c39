"""Margins over the values of one key of a scene, each from a complete run, and the value with a margin of 1."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from impact.notices import Tell, ignore
from seatfem.life import lives
from seatfem.life.lives import MarginCurve
from seatfem.study.impacts.contact import RunError
from seatfem.study.runs.pipeline import run_scene
from seatfem.study.scene import load_scene
from seatfem.units import UnitError, number_and_unit


def margin_curve(
    scene: Path | str,
    key: str,
    values: Sequence[str | float],
    folder: Path | str,
    *,
    margin: str = "life_margin",
    tell: Tell = ignore,
) -> MarginCurve:
    """Run a scene over values of one key, and where two of them enclose a margin of 1, find the value there.

    Each value is a complete run with error bars, without pictures, in its own folder; the runs of the search for the
    allowed value (Brent's method, to `lives.NEAR`) are added to the curve. The table is written to margin.csv.

    Args:
        scene: file with [life].
        key: dotted key, such as "reed.release.velocity" or "load.0.gravity".
        values: at least two, written as in the file and in one unit, such as "2 m/s" or, for a ratio, 0.1.
        folder: parent of the runs' folders.
        margin: "life_margin", or "life_speed_margin".
        tell: receives a line for each run.

    Raises:
        RunError: fewer than two values, several units, or a scene without this margin.
        SceneError: the scene cannot have the key or the value. Also what runs raise.
    """
    numbers, unit = _in_one_unit(key, values)

    def run(value: float) -> tuple[float, float | None]:
        written: object = f"{value!r} {unit}" if unit else value
        result = _one_run(scene, key, written, Path(folder) / f"{value:.9g}", margin)
        tell(f"{key} = {written}: {margin} {result[0]:.4g}")
        return result

    curve = lives.traced(key, unit, numbers, run, margin=margin)
    lives.write_curve(curve, Path(folder) / "margin.csv")
    return curve


def _one_run(scene: Path | str, key: str, value: object, folder: Path, margin: str) -> tuple[float, float | None]:
    summary = run_scene(load_scene(scene, {key: value}), folder, pictures=False).summary
    if margin not in summary:
        raise RunError(f"{scene}: a run with {key} = {value} has no {margin}; ask for it in [life]")
    result, bar = summary[margin], summary.get(f"error_bar_{margin}")
    return math.inf if result is None else float(str(result)), None if bar is None else float(str(bar))


def _in_one_unit(key: str, values: Sequence[str | float]) -> tuple[list[float], str]:
    """Return the sorted numbers without repetitions, and their unit. Raises `RunError` as `margin_curve`."""
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
