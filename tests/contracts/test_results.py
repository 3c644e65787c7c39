"""Each result is declared once: who shows results reads the table, and names no key."""

from __future__ import annotations

import ast
from pathlib import Path

from seatfem.results import RESULTS, ResultSource, label_of, rows_of

ROOT = Path(__file__).parents[2]
COMPUTING = (
    "results.py", "study/impacts/", "study/runs/", "study/scene/measures.py", "study/sweep/side_by_side.py",
    "study/error_budget.py",
)  # fmt: skip
"""What declares results, and what computes them or their errors."""
WORDS = {"ports", "restitution"}
"""Keys of results that are keys of scenes or names of measures, too."""


def test_no_key_is_named_where_results_are_shown() -> None:
    keys = {result.key for result in RESULTS} - WORDS - {"tilt_deg"}
    named = [
        f"{path.relative_to(ROOT)}:{node.lineno} {node.value!r}"
        for path in (ROOT / "seatfem").rglob("*.py")
        if not path.relative_to(ROOT / "seatfem").as_posix().startswith(COMPUTING)
        if any(f'"{key}"' in (text := path.read_text(encoding="utf-8")) for key in keys)
        for node in ast.walk(ast.parse(text))
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and node.value in keys
    ]
    assert named == []


def test_every_key_is_declared_once() -> None:
    keys = [result.key for result in RESULTS]
    assert len(set(keys)) == len(keys)


def test_a_declared_measure_has_its_row_and_its_label() -> None:
    class Loudness(ResultSource):
        name, key, words = "loudness", "loudness_Pa", "sound pressure"

    try:
        summary = {"accuracy_measures": "loudness", "loudness_Pa": 2.0}
        (row,) = rows_of(summary)["run"]
        assert (row.key, row.words, row.unit) == ("loudness_Pa", "sound pressure", "Pa")
        assert label_of("loudness_Pa") == "sound pressure [Pa]"
    finally:
        del Loudness.name
    assert label_of("stopper_impulse_Ns") == "at the stopper: impulse [N s]"
