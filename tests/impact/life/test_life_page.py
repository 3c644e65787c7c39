"""The numbers of docs/life.md are those of the code."""

import re
from pathlib import Path

import numpy as np
import pytest

from impact.life.damage import mean_stress
from impact.life.multiaxial import multiaxial
from impact.life.places import SHARE
from impact.life.strength import Strength, basquin

PAGE = (Path(__file__).parents[3] / "docs" / "life.md").read_text(encoding="utf-8")
INVENTED = Strength("the page", ultimate=1800.0, fatigue_strength=2000.0, walker_exponent=0.65)
TIME = 2 * np.pi * np.arange(720) / 720


def rows(columns: int, *names: str) -> dict[str, list[str]]:
    """Return the named rows of the page's tables with so many columns."""
    table = {}
    for line in PAGE.splitlines():
        name, *cells = [cell.strip() for cell in line.strip("| ").split("|")]
        if name in names and len(cells) == columns - 1 and re.match(r"\d", cells[1]):
            table[name] = cells
    assert set(table) == set(names)
    return table


def test_mean_stresses() -> None:
    table = rows(4, "goodman", "gerber", "morrow", "walker", "swt")
    for name, cells in table.items():
        [equivalent] = mean_stress(name, INVENTED).equivalent(np.array([300.0]), np.array([200.0]))
        assert f"{equivalent:.2f}" == cells[1].split()[0]


@pytest.mark.slow
def test_criteria_of_several_axes() -> None:
    table = rows(4, "dang_van", "crossland", "papadopoulos")
    for name, cells in table.items():
        judge = multiaxial(name, Strength("the page", torsion_limit=310.0, bending_limit=500.0))
        for cell, lag, mean in zip(cells, (0.0, np.pi / 2, 0.0), (0.0, 0.0, 200.0), strict=True):
            stress = np.zeros((len(TIME), 6))
            stress[:, 0], stress[:, 5] = 300 * np.sin(TIME) + mean, 150 * np.sin(TIME - lag)
            assert judge.value(stress) == pytest.approx(float(cell), abs=1.5e-3)


def test_curves_and_maps() -> None:
    curve = basquin(400.0, 1e7, 12.0, scatter=0.25)
    assert f"gives {curve.stress(4.5e9):.2f} MPa at 4.5e9 cycles" in PAGE
    assert f"{curve.stress(4.5e9, 0.999):.2f} MPa for 99.9 % with s = 0.25" in PAGE
    assert f"below {SHARE:.0%} of".replace("%", " %") in " ".join(PAGE.split())
