"""What the program answers stays: numbers of the scenes that take a few seconds, and the help of all verbs."""

import json
from pathlib import Path

import pytest

from seatfem.structures.sheets import plate_modes, solved_sheet
from tests.frozen.recorded import FILE, HELP, help_of_verbs, moved, numbers_of, scenes, versions

FROZEN = json.loads(FILE.read_text(encoding="utf-8"))
QUICK = ("rigid_mass_on_bar", "ball_on_stopper", "flapper_on_spring", "timoshenko_on_rod", "paper_table1_3mm_strip")


def test_all_scenes_are_frozen() -> None:
    assert sorted(FROZEN["scenes"]) == sorted(scenes())
    assert all(len(numbers) > 50 for numbers in FROZEN["scenes"].values())


@pytest.mark.parametrize("name", QUICK)
def test_numbers_stay(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All others: `python -m tests.frozen`."""
    monkeypatch.setenv("SEATFEM_STORE", str(tmp_path / "store"))
    plate_modes.cache_clear()
    solved_sheet.cache_clear()
    numbers = numbers_of(scenes()[name], tmp_path / "run")
    assert moved(numbers, FROZEN["scenes"][name], foreign=FROZEN["versions"] != versions()) == []


def test_a_number_that_moves_is_told() -> None:
    frozen = {
        "a": 1.0,
        "error_bar_a": 0.1,
        "landings.0.a": 2.0,
        "landings.0.error_bar_a": 0.02,
        "count": 3,
        "met": True,
    }
    assert moved({**frozen, "a": 1.004}, frozen) == []
    assert moved({**frozen, "a": 1.006}, frozen) == ["a: 1 -> 1.006"]
    assert moved({**frozen, "landings.0.a": 2.0013}, frozen) == ["landings.0.a: 2 -> 2.0013"]
    assert moved({**frozen, "count": 4, "met": False}, frozen) == ["count: 3 -> 4", "met: True -> False"]
    assert moved({"a": 1.0}, {"b": 1.0}) == ["b: is no longer there", "a: is new"]


def test_help_stays() -> None:
    assert help_of_verbs() == json.loads(HELP.read_text(encoding="utf-8"))
