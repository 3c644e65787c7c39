"""No reader takes the square of a file's size, in time or memory; and the judgement of this finds one that does."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from .sizes import Growth, Reading, defects, growths, measured


@pytest.mark.slow
def test_no_reader_takes_squares() -> None:
    found = subprocess.run(
        [sys.executable, "-m", "tests.fuzz.sizes", "--bytes", "150000", "--enough", "0.3"],
        cwd=Path(__file__).parents[2], env=dict(os.environ), capture_output=True, text=True, check=False, timeout=900,
    )  # fmt: skip
    kinds = [json.loads(line) for line in found.stdout.splitlines()]
    assert [kind["name"] for kind in kinds] == [growth.name for growth in growths()], found.stderr[-2000:]
    assert {kind["name"]: kind["defects"] for kind in kinds if kind["defects"]} == {}
    assert found.returncode == 0


def written(path: Path, count: int) -> None:
    path.write_bytes(b"x" * count)


def squares(path: Path) -> int:
    length = path.stat().st_size
    return sum(sum(range(16 * length)) for _ in range(length))  # twice what counts on the fastest machine so far


def proportions(path: Path) -> int:
    return sum(range(3000 * path.stat().st_size))


@pytest.mark.slow
@pytest.mark.parametrize(("read", "sound"), [(squares, False), (proportions, True)])
def test_squares_are_found(read, sound) -> None:
    readings = measured(Growth("a", written, read), 5_000, enough=0.3)
    assert bool(list(defects(readings))) != sound, readings


@pytest.mark.parametrize(
    ("reading", "words"),
    [
        (Reading(512, 1000, 0.1, 300 << 20, ""), "MB of memory for 0.001 MB"),
        (Reading(512, 1000, 0.1, 0, "!TypeError: x"), "TypeError"),
        (Reading(512, 1000, 2.0, 0, ""), "times the time"),
        (Reading(512, 1000, 1.0, 0, "MeshError: refused"), ""),
    ],
)
def test_what_is_a_defect(reading, words) -> None:
    told = list(defects([Reading(64, 125, 0.05, 0, ""), reading]))
    assert (told == []) if not words else any(words in each for each in told)
