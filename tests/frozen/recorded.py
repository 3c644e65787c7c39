"""Values of a scene with their error bars as the command line writes them, and how far they are from those on file."""

import json
import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from impact.files.safe_files import write_whole

ROOT: Final = Path(__file__).parents[2]
FILE: Final = Path(__file__).with_name("numbers.json")
BAR: Final = "error_bar_"
MOST_LANDINGS: Final = 3  # of a scene; later ones are of the same kind
MOST_OF_BARS: Final = 1.5  # ratio of a bar to that on file: bars are sums of differences between two runs
ROUND_OFF: Final = 1e-7  # of a value: the digits on file; a bar below it is no more than round-off
OF_ZERO: Final = 1e-10  # in SI units: the round-off of a value that is zero, as the speed of faces that touch
SMALL_BAR: Final = 1e-3  # of a value: whether a smaller bar is doubled decides nothing
WORTH_TELLING: Final = 0.1  # of its bar: who moves a value by more says so in CHANGELOG.md

CHEAP: Final = (
    "ball_on_stopper", "bar_on_bar", "flapper_between_stops", "flapper_on_annular_seat",
    "flapper_on_arc", "flapper_on_cantilever", "flapper_on_spring", "flapper_on_stopper", "impact_stress",
    "paper_table1_30mm_strip", "paper_table1_3mm_area", "paper_table1_3mm_strip", "rigid_mass_on_bar", "ring_valve",
)  # fmt: skip
"""Scenes that take two or three seconds or less, each with a store of its own."""
Numbers = Mapping[str, tuple[float, float]]
"""Value and error bar by key, of landings as "landings.0.impulse_Ns"."""


def scenes() -> Mapping[str, Path]:
    """Return the scenes that are frozen, by name: all examples, and those beside this file."""
    examples = sorted({*(ROOT / "examples").glob("*.toml")} - {*(ROOT / "examples").glob("*_study.toml")})
    return {path.stem: path for path in (*examples, *sorted((Path(__file__).parent / "scenes").glob("*.toml")))}


def read_frozen() -> dict[str, Numbers]:
    """Return the numbers on file, by scene."""
    content: dict[str, dict[str, list[float]]] = json.loads(FILE.read_text(encoding="utf-8"))
    return {name: {key: (value, bar) for key, (value, bar) in pairs.items()} for name, pairs in content.items()}


def write_frozen(frozen: Mapping[str, Numbers]) -> None:
    """Write the numbers of all scenes to the file: eight digits, a value with its bar in each line."""
    lines = {
        name: ",\n".join(f'"{key}": [{value:.8g}, {bar:.8g}]' for key, (value, bar) in sorted(numbers.items()))
        for name, numbers in frozen.items()
    }
    write_whole(
        FILE, ("{\n" + ",\n".join(f'"{name}": {{\n{text}\n}}' for name, text in lines.items()) + "\n}\n").encode()
    )


def numbers_in(summary: Mapping[str, Any]) -> Numbers:
    """Return the values of summary.json that have a finite error bar, with that."""
    landings = summary.get("landings", ())[:MOST_LANDINGS]
    records = {"": summary} | {f"landings.{number}.": landing for number, landing in enumerate(landings)}
    return dict(pair for prefix, record in records.items() for pair in _pairs(prefix, record))


def _pairs(prefix: str, record: Mapping[str, Any]) -> Iterator[tuple[str, tuple[float, float]]]:
    for name, bar in record.items():
        value = record.get(name.removeprefix(BAR)) if name.startswith(BAR) else None
        if isinstance(value, int | float) and isinstance(bar, int | float) and math.isfinite(bar):
            yield prefix + name.removeprefix(BAR), (value, bar)


def moved(now: Numbers, frozen: Numbers) -> list[str]:
    """Return a line for each value that is missing, new, or off by more than its bar, and each bar off by a factor."""
    lines = [f"{key}: is no longer there" for key in sorted(frozen.keys() - now.keys())]
    lines += [f"{key}: is new" for key in sorted(now.keys() - frozen.keys())]
    for key in sorted(frozen.keys() & now.keys()):
        (value, bar), (before, bar_before) = now[key], frozen[key]
        if not math.isclose(value, before, rel_tol=ROUND_OFF, abs_tol=max(bar_before, OF_ZERO)):
            lines.append(f"{key}: {before:.6g} -> {value:.6g}, error bar {bar_before:.2g}")
        if not min(bar, bar_before) * MOST_OF_BARS >= max(bar, bar_before) - max(SMALL_BAR * abs(before), OF_ZERO):
            lines.append(f"{key}: error bar {bar_before:.3g} -> {bar:.3g}")
    return lines


def worth_telling(now: Numbers, frozen: Numbers) -> list[str]:
    """Return a line for each value that moved within its bar, but by more than a tenth of it."""
    told = {key: pair for key, pair in frozen.items() if key in now and pair[1] > ROUND_OFF * abs(pair[0])}
    shares = {key: abs(now[key][0] - value) / bar for key, (value, bar) in told.items()}
    return [f"{key}: moved by {share:.2f} of its bar" for key, share in shares.items() if share > WORTH_TELLING]
