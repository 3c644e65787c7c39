"""Reeds that are released from within what they are to strike are refused, with the opening that would serve."""

from pathlib import Path

import pytest

import impact
from tests.gallery import FLAPPER, LIP, load_text
from tests.steps import Division, Scene, SceneError, bed, problem_of, striker_of


def problem(folder: Path, deflection: str, contact: str, more: str = "") -> tuple[Scene, impact.ContactProblem]:
    reed = FLAPPER + f'greens = {{ bandwidth = "10 kHz" }}\nrelease = {{ deflection = "{deflection}" }}\n'
    text = f'[seat]\n{LIP}[reed]\n{reed}[contact]\nports = 16\n{contact}\n{more}[run]\nduration = "1 ms"\n'
    scene = load_text(folder, text)
    seat = bed(Division(16), 1e-9)
    return scene, problem_of(scene, striker_of(scene, greens=None), impact.Body(seat))


def test_the_gap_that_is_asked_for_serves_and_no_less(tmp_path: Path) -> None:
    """A tilted lip that opens to 58 um, and a reed bent by 40 um: it stands deepest where the lip is nearest."""
    tilt = 'tilt = "0.3 deg"\ntilt_axis = "90 deg"\ngap = "{:.3f} um"'
    with pytest.raises(SceneError, match=r"contact\.gap: .*add ([\d.]+) um") as refused:
        problem(tmp_path, "-40 um", tilt.format(1))
    more = float(str(refused.value).partition(": add ")[2].partition(" um")[0])
    scene, problems = problem(tmp_path, "-40 um", tilt.format(1 + more + 0.01))
    greens, state = problems.striker.greens, problems.striker.state
    bent = greens.modal.shapes.T @ state.displacement
    openings = scene.geometry.gaps(Division(16))
    openings = openings + bent[[greens.port_index(contact.striker_port) for contact in problems.contacts]]
    assert openings.min() == pytest.approx(0.01e-6, abs=0.03e-6)
    with pytest.raises(SceneError, match="begin inside it"):
        problem(tmp_path, "-40 um", tilt.format(1 + 0.97 * more))


def test_a_spring_may_begin_compressed(tmp_path: Path) -> None:
    law = 'gap = "1 um"\nlaw = { kind = "spring", stiffness = "20 N/um" }'
    assert len(problem(tmp_path, "-40 um", law)[1].contacts) == 16
