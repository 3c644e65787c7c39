"""The flapper in scenes: its keys, how it starts, what it is struck by, in every role."""

from pathlib import Path

import numpy as np
import pytest

from seatfem.structures.cache import build, key_of
from seatfem.structures.kinds import Structure
from seatfem.structures.model import ModelError
from seatfem.structures.natural_modes import Wanted, modes_of
from seatfem.structures.sheets import Sheet, SolvedSheet
from tests.gallery import FLAPPER, load_text, summary_of
from tests.steps import Scene, Stopwatch, striker_of

COARSE = 'greens = { bandwidth = "30 kHz" }\n'
SPRING = 'kind = "spring"\nstiffness = "20 N/um"\n'
BALL = 'kind = "rigid_mass"\nmass = "0.1 g"\nvelocity = "-0.1 m/s"\n'
LANDING = 'release = { velocity = "-2 m/s" }\n'
RUN = '[contact]\ngap = "1 um"\n[run]\nduration = "0.3 ms"\n{}[accuracy]\ntarget = "20 %"\n'


def scene_of(folder: Path, reed: str, seat: str = SPRING, more: str = "", step: str = "") -> Scene:
    return load_text(folder, f"[seat]\n{seat}[reed]\n{reed}{more}{RUN.format(step)}")


def solved_of(reed: Structure) -> SolvedSheet:
    return reed.solved(reed.stated())  # type: ignore[attr-defined]


@pytest.mark.slow
def test_it_lands_with_a_velocity_in_one_mode(tmp_path: Path) -> None:
    """The paddle's centre has the stated velocity in one mode, undeformed, whichever patch touches."""
    more = 'contact_radius = "5.5 mm"\ncontact_width = "1 mm"\nrelease = { mode = 3, velocity = "-2 m/s" }\n'
    for release, mode in ((more, 3), (more.replace("mode = 3, ", ""), 1)):
        scene = scene_of(tmp_path, FLAPPER + COARSE, more=release)
        body, solved = striker_of(scene), solved_of(scene.reed)
        assert not body.state.displacement.any()
        assert np.flatnonzero(body.state.velocity) == [mode - 1]
        assert solved.plate.centre @ body.state.velocity == pytest.approx(-2.0)


@pytest.mark.slow
def test_the_mesh_error_covers_the_truth(tmp_path: Path) -> None:
    """Elements half as large change g by less than the stated mesh error."""
    reed = scene_of(tmp_path, FLAPPER + COARSE, more=LANDING).reed
    solved = solved_of(reed)
    sheet: Sheet = reed.sheet()  # type: ignore[attr-defined]
    finer = solved_of(reed.model_copy(update={"mesh": reed.mesh.model_copy(update={"size": sheet.element_size / 2})}))  # type: ignore[attr-defined]
    t = np.linspace(0, 2e-3, 2000)
    g, truth = (each.greens.filtered(t, 1 / 30e3) for each in (solved, finer))
    assert np.abs(g - truth).max() / np.abs(truth).max() < solved.greens.error_estimate.mesh


@pytest.mark.slow
def test_it_is_struck_and_stops(tmp_path: Path) -> None:
    """A flapper serves as a seat under a ball and as a stopper."""
    scene = scene_of(tmp_path, BALL, FLAPPER + COARSE)
    summary = summary_of(scene, tmp_path / "out")
    assert summary["contact_count"] != 0
    assert "Mindlin plate" in str(summary["seat_model"])
    stopper = f'[stopper]\ngap = "0.5 mm"\n{FLAPPER}{COARSE}'
    reed = 'kind = "cantilever"\nlength = "20 mm"\nn_modes = 4\nrelease = { tip_deflection = "0.2 mm" }\n'
    body = load_text(tmp_path, f"[seat]\n{SPRING}[reed]\n{reed}{stopper}{RUN.format('')}").stopper
    assert build(body.body, body.body.stated(), 1e-3).greens.ports == ("contact",)


def test_natural_modes(tmp_path: Path) -> None:
    reed = scene_of(tmp_path, FLAPPER + COARSE, more=LANDING).reed
    modes = modes_of(reed, Wanted(3), Stopwatch(), lambda *given: None)
    assert modes.frequencies_hz == pytest.approx((196.6, 915.2, 1644.7), rel=2e-3)
    assert modes.modes[1].share == pytest.approx(0.0, abs=1e-6)  # torsion


def test_what_its_function_depends_on(tmp_path: Path) -> None:
    """The key changes with contact, band, elements and damping, and not with how the reed starts."""
    keys = {
        more: key_of(reed := scene_of(tmp_path, FLAPPER, more=LANDING + more).reed, reed.stated())
        for more in ("", 'contact_radius = "2 mm"\n', COARSE, 'mesh = { size = "2 mm" }\n', "damping_ratio = 0.01\n")
    }
    assert len(set(keys.values())) == len(keys)
    at_rest = scene_of(tmp_path, FLAPPER, more='force = "-1 N"\n').reed
    assert key_of(at_rest, at_rest.stated()) == keys[""]


@pytest.mark.parametrize(
    ("more", "message"),
    [
        (COARSE + 'release = { mode = 2, velocity = "-2 m/s" }\n', "reed.release.mode = 2:.*centre"),  # torsion
        (COARSE + 'release = { mode = 500, velocity = "-2 m/s" }\n', "release.mode = 500:.*reed.greens.bandwidth"),
        (LANDING + 'greens = { bandwidth = "3.6 MHz" }\n', "reed.greens.bandwidth = 3.6 MHz:"),
        (LANDING + 'mesh = { size = "1 um" }\n', r"reed.mesh.size = 0.001 mm.*2.91e\+08 elements"),
    ],
)
def test_modes_that_do_not_move_it_and_too_many_are_refused(tmp_path: Path, more: str, message: str) -> None:
    with pytest.raises(ModelError, match=message):
        striker_of(scene_of(tmp_path, FLAPPER, more=more))
