"""Write the numbers of docs/howto/identify.md: the example, and how often intervals contain the truth in 100 draws.

    .venv/bin/python docs/identify_page.py [DRAWS]

The record of the example is drawn through figures of tests/measured/bar_on_bar.toml. Takes some minutes; with 0 draws:
the example alone.
"""

from __future__ import annotations

import shutil
import sys
import tempfile
import tomllib
from multiprocessing import Pool
from pathlib import Path

import numpy as np
from markers import between

from impact.files.csv_table import write_csv
from impact.files.safe_files import write_whole
from seatfem.study.identify.fit import identify, write

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT))
from tests.study.identification_truth import NOISE, TRUE, noise, true_record, write_files  # noqa: E402

PAGE = ROOT / "docs" / "howto" / "identify.md"
PICTURE = ROOT / "docs" / "images" / "identify.png"
EXAMPLE = ROOT / "examples" / "identify"
SPEED = (206e9 / 7800) ** 0.5 * 1e-6  # m/us
DISTANCE = 0.6  # m from the gauge to the joint
CORRELATED = 0.8


def main() -> None:
    draws = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    figures = tomllib.loads((ROOT / "tests" / "measured" / "bar_on_bar.toml").read_text(encoding="utf-8"))
    write_example(figures)
    page = PAGE.read_text(encoding="utf-8")
    page = between(between(page, "example", example()), "byhand", by_hand())
    if draws:
        page = between(page, "coverage", coverage(draws))
    write_whole(PAGE, page.encode("utf-8"))


def write_example(figures: dict) -> None:
    """Write the incoming pulse, and what comes back: a triangle for each blip, by its height, area and time."""
    time, strain = (np.array(figures["incident"][key], dtype=float) for key in ("time_us", "strain_V"))
    write_csv(EXAMPLE / "incident.csv", ["time [us]", "strain [um/m]"], np.column_stack([time, -1e3 * strain]), 6)
    values = {each["name"]: each["value"] for each in figures["predicted"]}
    half = np.interp(0.32, strain[:9], time[:9]) + 2 * DISTANCE / SPEED  # half of the plateau of 0.64 V
    at = np.arange(200, 450, 0.5)
    back = np.zeros(len(at))
    for which, fitted in (("first", "closure"), ("second", "recovery")):
        height, area = figures["fitted"][fitted]["value"], values[f"area of the {which} blip"]
        top = half + values[f"{which} blip, from half of the front on"]
        back += height * np.maximum(1 - np.abs(at - top) / (area / height), 0)
    write_csv(EXAMPLE / "thrown_back.csv", ["time [us]", "strain [um/m]"], np.column_stack([at, -1e3 * back]), 6)


def example() -> str:
    """Return what the program prints for the example; copy its picture."""
    with tempfile.TemporaryDirectory() as folder:
        result = identify(EXAMPLE / "two_bars_record.toml")
        _, gap = write(result, Path(folder))
        assert not gap
        shutil.copy(Path(folder) / "identify.png", PICTURE)
    return "<br>\n".join(f"> {sentence}" for sentence in result.sentences())


def by_hand() -> str:
    """Return the fit beside the two numbers that tests/measured/bar_on_bar.py fits to the heights alone."""
    from seatfem.verify import compare, measured_sets

    fits = next(compare(each).fits for each in measured_sets() if each.name == "bar_on_bar")
    closure, recovery = fits["closure"], fits["recovery"]
    micrometres = 1e-3 * SPEED * 1e6  # of 1 V us
    result = identify(EXAMPLE / "two_bars_record.toml")
    ours = {key: (value, (each.value(ends.high) - each.value(ends.low)) / 2) for key, each, value, ends in result}
    (closed, about), (back, around) = ours["contact.law.closure"], ours["contact.law.recovery"]
    hand = f"{micrometres * closure.value:.1f} +- {micrometres * closure.uncertainty:.1f} um"
    return (
        "There both numbers were fitted to the heights of the blips alone, one after the other: "
        f"closure {hand}, recovery {recovery.value:.2f} +- {recovery.uncertainty:.2f}. "
        f"The fit to the whole record gives {closed:.1f} +- {about:.1f} um and {back:.2f} +- {around:.2f}: "
        "the same numbers within their intervals."
    )


def coverage(draws: int) -> str:
    """Return how often the intervals of each key contain the truth, for noise without and with correlation."""
    with Pool(2) as pool:
        counts = pool.starmap(held_intervals, [(draws, 0.0), (draws, CORRELATED)])
    white, (kept, plain) = counts[0][0], counts[1]
    rows = [["0", "yes", *white.values()], [CORRELATED, "yes", *kept.values()], [CORRELATED, "no", *plain.values()]]
    heads = ["correlation of the noise", "correlation is counted", *TRUE]
    lines = [heads, ["---"] * len(heads), *rows]
    text = "\n".join("| " + " | ".join(map(str, line)) + " |" for line in lines)
    return (
        "A mass on a bar was computed with another mesh, another step and a joint by table. "
        f"Of {draws} records of it with a noise of 1.4 % of the peak, so many 95 % intervals contain the true value:"
        f"\n\n{text}"
    )


def held_intervals(draws: int, correlation: float) -> tuple[dict[str, int], dict[str, int]]:
    """Return by key how many intervals contain the truth, and how many of those that count every sample do."""
    time, force = true_record()
    kept, plain = dict.fromkeys(TRUE, 0), dict.fromkeys(TRUE, 0)
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(draws):
            given = force + NOISE * noise(len(time), 1000 + seed, correlation)
            result = identify(write_files(Path(folder), time, given))
            weight = result.counted[0].weight
            for (key, each, _, ends), share in zip(result, result.shares, strict=True):
                off = each.share(TRUE[key]) - share
                kept[key] += ends.low - share <= off <= ends.high - share
                plain[key] += weight * (ends.low - share) <= off <= weight * (ends.high - share)
    return kept, plain


if __name__ == "__main__":
    main()
