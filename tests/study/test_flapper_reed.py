"""The flapper in scenes: its keys, starts, roles, and loads on it against its own stiffness."""

import re
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse.linalg

from impact.greens.base import Array
from seatfem.structures.cache import build, key_of
from seatfem.structures.elements.mindlin import average, everywhere
from seatfem.structures.kinds import Structure
from seatfem.structures.lip import Lip, Patch
from seatfem.structures.natural_modes import Wanted, modes_of
from seatfem.structures.sheets import Sheet, SolvedSheet
from tests.gallery import FLAPPER, load_text, refusal, summary_of
from tests.steps import ModelError, Scene, Stopwatch, striker_of

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


LOADED = FLAPPER + 'contact_radius = "5.5 mm"\ncontact_width = "1 mm"\ngreens = { bandwidth = "10 kHz" }\n'


def loaded_scene(folder: Path, more: str) -> Scene:
    return load_text(folder, f'[seat]\n{SPRING}[reed]\n{LOADED}{more}[run]\nduration = "4 ms"\ntime_step = "0.5 us"\n')


def still(scene: Scene) -> tuple[Array, Array]:
    """Return static modal coordinates under the loads at t = 0, and the centre's modes."""
    body = striker_of(scene)
    modal = body.greens.modal
    pull = sum(load.shape * float(load.amplitude(np.zeros(1))[0]) for load in body.loads)
    return pull / modal.omega**2, solved_of(scene.reed).plate.centre


LOADS = {
    'pressure = "-20 mbar"\n': lambda area, mean, disc, at: -2000.0 * area * mean,
    'pressure = "-20 mbar"\npressure_radius = "5 mm"\n': lambda area, mean, disc, at: -2000.0 * np.pi * 25e-6 * disc,
    'gravity = "-9.81 m/s^2"\n': lambda area, mean, disc, at: -9.81 * 7800.0 * 0.3e-3 * area * mean,
    'point_force = { value = "-0.2 N", at = "12 mm" }\n': lambda area, mean, disc, at: -0.2 * at(12e-3),
    'point_force = "-0.2 N"\n': lambda area, mean, disc, at: -0.2 * at(None),
}
"""Loads with their forces on the unknowns, by means over the plate and over a disc of 5 mm, and values at places."""


@pytest.mark.parametrize("load", LOADS, ids=["pressure", "disc", "gravity", "point", "force"])
def test_static_deflection_under_each_load(load: str, tmp_path: Path) -> None:
    """The paddle's centre sinks as K says, to what the modes left out yield: 3e-6, under a point 3e-4."""
    scene = loaded_scene(tmp_path, load)
    plate, outline = solved_of(scene.reed).plate, scene.reed.geometry()
    free, mesh, centre = plate.model.dofs.free, plate.mesh, outline.centre[0]

    def at(x: float | None) -> Array:
        place = Patch(np.array([[centre if x is None else x, 0.0]]), np.ones(1))
        return average(mesh, place)[0][free]

    (disc,) = Lip.disc(5e-3).patches(plate.sheet.shape.centre).values()
    push = LOADS[load](outline.area, everywhere(mesh)[free], average(mesh, disc)[0][free], at)
    exact = float(at(None) @ scipy.sparse.linalg.spsolve(plate.model.K.tocsc(), push))
    q, seen = still(scene)
    assert exact < -1e-6
    assert q @ seen == pytest.approx(exact, rel=1e-3)


@pytest.mark.parametrize(
    ("own", "load"),
    [
        ('pressure = "-20 mbar"\npressure_radius = "5.5 mm"\n', 'pressure = "-20 mbar"\narea = "95.0331777711 mm^2"\n'),
        ('gravity = "-9.81 m/s^2"\n', 'base_motion = "9.81 m/s^2"\n'),
        ('point_force = { value = "-0.2 N", at = "12 mm" }\n', 'force = "-0.2 N"\nat = "12 mm"\n'),
        ('point_force = "-0.2 N"\n', 'force = "-0.2 N"\n'),
    ],
)
def test_loads_of_the_scene_are_those_of_the_reed(own: str, load: str, tmp_path: Path) -> None:
    """An effective area is spread over the disc that the ring of the contact encloses, pi (5.5 mm)^2."""
    stated, _ = still(loaded_scene(tmp_path, own))
    loaded, _ = still(loaded_scene(tmp_path, f"[[load]]\n{load}"))
    np.testing.assert_allclose(loaded, stated, rtol=1e-9, atol=1e-12 * np.abs(stated).max())


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ('pressure = "1 mbar"\npressure_radius = "9 mm"\n', "reed.pressure_radius: 9 mm.*most"),
        ('gravity = "9 m/s^2"\npressure_radius = "5 mm"\n', "reed.pressure_radius: .*no pressure"),
        ('point_force = { value = "1 N", at = "40 mm" }\n', "reed.point_force.at: 40 mm.*reed"),
        ('release = { deflection = "1 mm", velocity = "-1 m/s" }\n', "reed.release.velocity: deflection"),
        ('release = { velocity = "-1 m/s", shape = "force" }\n', "reed.release.shape: .*mode"),
        ('[[load]]\nforce = "1 N"\nat = "40 mm"\n', "load.0.at: 40 mm.*30.4"),
        ("release = { mode = 2 }\n", "reed.release.velocity: required"),
    ],
)
def test_what_is_wrong_is_named(more: str, words: str, tmp_path: Path) -> None:
    assert re.search(words, refusal(loaded_scene, tmp_path, more))
