"""Reeds of varying width in scenes."""

import re
from pathlib import Path

import pytest

from tests.gallery import load_text, refusal, summary_of
from tests.steps import Scene

KEYS = 'kind = "{}"\n{}\nthickness = "0.3 mm"\nn_modes = 10\nrelease = {{ tip_deflection = "0.2 mm" }}\n'
UNIFORM = 'widths = [["0 mm", "8 mm"], ["20 mm", "8 mm"]]'
RUN = '[run]\nduration = "2 ms"\nfilter_width = "20 us"\ntime_step = "1 us"\n'


def scene_of(folder: Path, kind: str, section: str, contact: str = "") -> Scene:
    seat = '[seat]\nkind = "spring"\nstiffness = "20 N/um"\n'
    return load_text(folder, f"{seat}[reed]\n{KEYS.format(kind, section)}{contact}{RUN}")


@pytest.mark.slow
def test_a_uniform_one_is_the_cantilever(tmp_path: Path) -> None:
    """A uniform stepped reed has the cantilever's impulse, first contact and frequencies."""
    there = '[contact]\nat = "18 mm"\ngap = "1 um"\n'
    mine, theirs = (
        summary_of(scene_of(tmp_path, *each, there), tmp_path / each[0])
        for each in (("stepped", UNIFORM), ("cantilever", 'length = "20 mm"\nwidth = "8 mm"'))
    )
    for key in ("impulse_Ns", "first_contact_s", "reed_frequencies_Hz"):
        assert mine[key] == pytest.approx(theirs[key], rel=1e-4)


@pytest.mark.parametrize(
    ("section", "contact", "key", "message"),
    [
        ('widths = [["1 mm", "8 mm"], ["20 mm", "8 mm"]]', "", "reed.widths", "positions must rise from 0"),
        ('widths = [["0 mm", "8 mm"], ["20 mm", "-1 mm"]]', "", "reed.widths", "'-1 mm'"),
        ('widths = [["0 mm", "0 mm"], ["20 mm", "8 mm"]]', "", "reed.widths", "all must be positive"),
        ('widths = [["0 mm", "8 mm"]]', "", "reed.widths", "at least 2"),
        (UNIFORM, '[contact]\nat = "21 mm"\n', "contact.at", "reed.*20 mm"),
    ],
)
def test_keys_that_do_not_fit(tmp_path: Path, section: str, contact: str, key: str, message: str) -> None:
    answer = refusal(scene_of, tmp_path, "stepped", section, contact)
    assert key in answer
    assert re.search(message, answer)
