"""The margin of a reed's life against one key of a scene, as speed, lift or tilt, and the value that it allows."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Final

from scipy.optimize import brentq

from impact.files.atomic import whole_file
from impact.progress import Tell, untold
from seatfem.study.impacts.contact import RunError
from seatfem.study.runs.pipeline import run_scene
from seatfem.study.scene import load_scene

MARGIN: Final = "life_margin"
NEAR: Final = 1e-3  # of the allowed value, relative
MOST: Final = 20  # runs that look for it
FARTHEST: Final = 20.0  # |log margin|: further out it is as good as none, or infinite
_QUANTITY: Final = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")


@dataclass(frozen=True)
class MarginCurve:
    """Margins by the values of one key, in the order of the values.

    Attributes:
        key, unit: dotted; "" of pure numbers.
        values: in that unit.
        margins: factors on stress, ``inf`` where nothing fails; of the key ``margin`` in summary.json.
        bars: their error bars; ``None``: not known.
        allowed: the value at which the margin is 1, the first one; ``None`` where no two values enclose one.
        margin: which one.
    """

    key: str
    unit: str
    values: tuple[float, ...]
    margins: tuple[float, ...]
    bars: tuple[float | None, ...]
    allowed: float | None
    margin: str = MARGIN

    @property
    def label(self) -> str:
        """Of an axis."""
        return f"{self.key} [{self.unit}]" if self.unit else self.key


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
        values: as the file would have them, all in one unit, at least two.
        folder: of the runs.
        margin: "life_margin", or "life_speed_margin".
        tell: hears of every run.

    Raises:
        RunError: fewer than two values, several units, a scene that tells no such margin.
        SceneError: a key or a value that the scene cannot have. Also what runs raise.
    """
    numbers, unit = _in_one_unit(key, values)
    folder = Path(folder)
    found: dict[float, tuple[float, float | None]] = {}

    def excess(value: float) -> float:
        """log(margin)."""
        if value not in found:
            given: object = f"{value!r} {unit}" if unit else value
            found[value] = _one_run(scene, key, given, folder / f"{value:.9g}", margin)
            tell(f"{key} = {given}: {margin} {found[value][0]:.4g}")
        spare = found[value][0]
        return min(max(math.log(spare), -FARTHEST), FARTHEST) if spare > 0 else -FARTHEST

    signs = [(value, excess(value)) for value in numbers]
    allowed: float | None = next((value for value, off in signs if off == 0.0), None)
    for (low, one), (high, other) in pairwise(signs):
        if allowed is None and one * other < 0:
            near = NEAR * max(abs(low), abs(high)) / 2
            allowed = float(brentq(excess, low, high, xtol=near, rtol=NEAR / 2, maxiter=MOST, disp=False))
    points = sorted(found)
    margins, bars = zip(*(found[value] for value in points), strict=True)
    curve = MarginCurve(key, unit, tuple(points), margins, bars, allowed, margin)
    _write(curve, folder / "margin.csv")
    return curve


def _one_run(scene: Path | str, key: str, value: object, folder: Path, margin: str) -> tuple[float, float | None]:
    summary = run_scene(load_scene(scene, {key: value}), folder, pictures=False).summary
    if margin not in summary:
        raise RunError(f"{scene}: a run with {key} = {value} tells no {margin}; [life] must ask for it")
    found, bar = summary[margin], summary.get(f"error_bar_{margin}")
    return math.inf if found is None else float(str(found)), None if bar is None else float(str(bar))


def _in_one_unit(key: str, values: Sequence[str | float]) -> tuple[list[float], str]:
    """Sorted, each once."""
    found = [_QUANTITY.fullmatch(str(value)) for value in values]
    if wrong := [value for value, match in zip(values, found, strict=True) if match is None]:
        raise RunError(f"{key}: {wrong[0]!r} is no number with a unit")
    units = list(dict.fromkeys(match[2] for match in found if match))
    numbers = sorted({float(match[1]) for match in found if match})
    if len(units) > 1:
        raise RunError(f"{key}: values in {' and '.join(units)}; give all of them in one unit")
    if len(numbers) < 2:
        raise RunError(f"{key}: a curve needs two values or more, not {len(numbers)}")
    return numbers, units[0]


def _write(curve: MarginCurve, path: Path) -> None:
    rows = zip(curve.values, curve.margins, curve.bars, strict=True)
    lines = [f"{curve.label},{curve.margin},error_bar"]
    lines += [f"{value:.9g},{margin:.9g},{'' if bar is None else f'{bar:.3g}'}" for value, margin, bar in rows]
    with whole_file(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")
