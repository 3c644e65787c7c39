"""The product against a plain program that shares nothing with it (`benchmarks/peers/plain_program.py`)."""

import copy
import json
import tomllib
from pathlib import Path

import pytest

from benchmarks.peers.plain_program import fidelity, number, solve
from tests.steps import load_scene, run_scene

SCENE = Path(__file__).parents[2] / "benchmarks" / "programs" / "beam_on_rod.toml"
KEYS = ("impulse_Ns", "filtered_peak_force_N", "peak_reed_stress_after_contact_Pa")
LEVEL = 5  # whose error is a third of the bars or less
COEFFICIENTS = (
    *(("reed", name) for name in ("length", "width", "thickness")),
    *(("reed", "material", name) for name in ("young", "density")),
    ("reed", "release", "velocity"),
    ("contact", "law", "stiffness"),
    *(("contact", name) for name in ("at", "gap")),
    *(("seat", name) for name in ("young", "length", "area")),
)


@pytest.fixture(scope="module")
def summary(tmp_path_factory):
    """Run the scene for 1 %."""
    folder = tmp_path_factory.mktemp("run")
    (folder / "scene.toml").write_text(SCENE.read_text().replace('target = "3 %"', 'target = "1 %"'))
    run_scene(load_scene(folder / "scene.toml"), folder, pictures=False, histories=False)
    return json.loads((folder / "summary.json").read_text())


@pytest.fixture(scope="module")
def scene():
    return tomllib.loads(SCENE.read_text())


@pytest.fixture(scope="module")
def doubts(scene):
    """Return what the next coarser level changes, which a first-order method still lacks."""
    fine, coarser = (solve(scene, fidelity(level)) for level in (LEVEL, LEVEL - 1))
    return {key: abs(fine[key] - coarser[key]) for key in KEYS}


def ratios(summary, scene, doubts):
    """Return the differences over what both programs say that they leave open."""
    reference = solve(scene, fidelity(LEVEL))
    return [abs(summary[key] - reference[key]) / (summary[f"error_bar_{key}"] + doubts[key]) for key in KEYS]


@pytest.mark.slow
def test_both_programs_agree_within_bar_and_doubt(summary, scene, doubts):
    assert max(ratios(summary, scene, doubts)) < 1


@pytest.mark.slow(but="seat.young")
@pytest.mark.parametrize("path", COEFFICIENTS, ids=".".join)
def test_a_coefficient_that_is_3_percent_off_is_seen(summary, scene, doubts, path):
    off = copy.deepcopy(scene)
    table = off
    for name in path[:-1]:
        table = table[name]
    text = table[path[-1]]
    table[path[-1]] = f"{1.03 * float(text.split()[0]):.12g} {text.split(' ', 1)[1]}"
    assert number(table[path[-1]]) == pytest.approx(1.03 * number(text))
    assert max(ratios(summary, off, doubts)) > 1
