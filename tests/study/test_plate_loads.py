"""Loads on plates and their releases: by the plate's own integrals, against its stiffness; energy under contact."""

import re
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse.linalg

from impact.greens.base import Array
from seatfem.structures.elements.mindlin import average, everywhere
from seatfem.structures.kinds.plates import Flapper
from seatfem.structures.lip import Lip, Patch
from tests.gallery import FLAPPER, load_text, refusal, spring
from tests.steps import Scene, striker_of

REED = FLAPPER + 'contact_radius = "5.5 mm"\ncontact_width = "1 mm"\ngreens = { bandwidth = "10 kHz" }\n'
RUN = '[run]\nduration = "4 ms"\ntime_step = "0.5 us"\n'


def scene_of(folder: Path, more: str) -> Scene:
    return load_text(folder, f"[seat]\n{spring('20 N/um')}[reed]\n{REED}{more}{RUN}")


def plate_of(scene: Scene) -> tuple[Flapper, Array, Array]:
    """Return the reed, the mean over the plate and over a disc of 5 mm, of its free unknowns."""
    plate = scene.reed.solved(scene.reed.stated()).plate
    (disc,) = Lip.disc(5e-3).patches(plate.sheet.shape.centre).values()
    free = plate.model.dofs.free
    return scene.reed, everywhere(plate.mesh)[free], average(plate.mesh, disc)[0][free]


def at(reed: Flapper, x: float) -> Array:
    plate = reed.solved(reed.stated()).plate
    return average(plate.mesh, Patch(np.array([[x, 0.0]]), np.ones(1)))[0][plate.model.dofs.free]


def still(scene: Scene) -> tuple[Array, Array]:
    """Return static modal coordinates under the loads at t = 0, and the centre's modes."""
    body = striker_of(scene)
    modal = body.greens.modal
    pull = sum(load.shape * float(load.amplitude(np.zeros(1))[0]) for load in body.loads)
    return pull / modal.omega**2, scene.reed.solved(scene.reed.stated()).plate.centre  # type: ignore[attr-defined]


@pytest.mark.parametrize("load", ["pressure", "disc", "gravity", "point", "force"])
def test_static_deflection_under_each_load(load: str, tmp_path: Path) -> None:
    """The paddle's centre sinks as K says, to what the modes left out yield: 3e-6, under a point 3e-4."""
    texts = {
        "pressure": 'pressure = "-20 mbar"\n',
        "disc": 'pressure = "-20 mbar"\npressure_radius = "5 mm"\n',
        "gravity": 'gravity = "-9.81 m/s^2"\n',
        "point": 'point_force = { value = "-0.2 N", at = "12 mm" }\n',
        "force": 'point_force = "-0.2 N"\n',
    }
    scene = scene_of(tmp_path, texts[load])
    reed, mean, disc = plate_of(scene)
    centre, outline = at(reed, reed.geometry().centre[0]), reed.geometry()
    push = {
        "pressure": -2000.0 * outline.area * mean,
        "disc": -2000.0 * np.pi * 25e-6 * disc,
        "gravity": -9.81 * 7800.0 * 0.3e-3 * outline.area * mean,
        "point": -0.2 * at(reed, 12e-3),
        "force": -0.2 * centre,
    }
    K = reed.solved(reed.stated()).plate.model.K
    exact = float(centre @ scipy.sparse.linalg.spsolve(K.tocsc(), push[load]))
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
    stated, _ = still(scene_of(tmp_path, own))
    loaded, _ = still(scene_of(tmp_path, f"[[load]]\n{load}"))
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
    assert re.search(words, refusal(scene_of, tmp_path, more))
