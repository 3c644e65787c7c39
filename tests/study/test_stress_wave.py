"""The stress wave and the map of margins of a run: numbers, times, files and pictures."""

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from impact.pictures.drawing import PictureError
from seatfem.life.maps import margin_of, margin_pictures
from seatfem.pictures.moving import load_moving, plot_margin_map
from seatfem.structures.fields.recovery import Response, find_frames, histories, recover, response_in_frames, von_mises
from seatfem.structures.fields.sites import at_nodes
from seatfem.structures.fields.solids import Harmonic, RingField, elements_of, solid_stress
from seatfem.study.runs.reed_stress import plate_stress
from seatfem.study.runs.seat_stress import SeatStress, seat_stress
from seatfem.study.runs.stress_wave import wave_of, wave_pictures
from tests.gallery import FLAPPER, load_text, mass
from tests.steps import Limits, SceneError, Stopwatch, begin_plan, rounds, silent
from tests.study.small_scenes import PRESSED, PRESSURE

STRENGTH = (
    'source = "invented for tests"\nultimate = "1800 MPa"\ntorsion_limit = "310 MPa"\nbending_limit = "500 MPa"\n'
    'limit_cycles = 1e7\ncurve = { knee_stress = "500 MPa", knee_cycles = 1e7, slope = 12 }\n'
)
ASKED = '[life]\nseat_strength = "seat.toml"\nmultiaxial = "{}"\ncycles = 4.5e9\n'
SCENE = PRESSED.replace("[contact]", '[contact]\ngap = "10 um"').replace("330 us", "360 us")
TOUCH = 20e-6


def load(folder: Path, stress: str = "frames = 12", criterion: str = "crossland") -> Any:
    (folder / "seat.toml").write_text(STRENGTH, encoding="utf-8")
    return load_text(folder, f"{SCENE}{stress}\n{ASKED.format(criterion)}")


@pytest.fixture(scope="module")
def pressed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Any, Any]:
    """Give the last round of a mass on a soft spring that presses a bar, and the stress in it."""
    folder = tmp_path_factory.mktemp("pressed")
    scene = load(folder, 'frames = 12\nframes_from = "10 us"\nframes_until = "340 us"')
    *_, done = rounds(begin_plan(scene), folder, Stopwatch(), silent)
    return done, seat_stress(done)


@pytest.mark.slow
def test_frames_are_the_histories_at_their_times(pressed: tuple[Any, Any]) -> None:
    """Frames made by a field of stress or by the unknowns themselves are its histories at their times."""
    done, stress = pressed
    force, dt = stress.force, stress.dt
    nodes = np.array([5, 17, 30])
    elements = elements_of(stress.mesh)
    sites = at_nodes(elements, nodes)
    functional = solid_stress(elements, done.plan.scene.seat.material.solid, stress.model, sites)
    field = recover(stress.model, functional, sites.points, bandwidth=100e3, dt=dt, damping_ratio=0.05)
    steps = range(140, 1600, 140)
    exact = np.moveaxis(histories(field, force, dt)[:, :, list(steps)], 2, 0)
    np.testing.assert_allclose(find_frames(field, force, dt, steps), exact, atol=1e-9 * np.abs(exact).max())
    response = Response.from_model(stress.model, bandwidth=100e3, damping_ratio=0.05)
    moved = response_in_frames(response, force, dt, steps)
    computed = np.moveaxis((functional @ moved.T).reshape(3, 6, -1), 2, 0)
    np.testing.assert_allclose(computed, exact, atol=1e-6 * np.abs(exact).max())


@pytest.mark.slow
def test_the_wave_shows_the_pressure_and_how_the_bar_gives_way(pressed: tuple[Any, Any]) -> None:
    done, stress = pressed
    wave = wave_of(done, stress)
    assert len(wave.time) == 12
    assert wave.time[0] == pytest.approx(10e-6, abs=30e-6)
    assert 300e-6 < wave.time[-1] <= 341e-6
    assert np.all(wave.values[wave.time < TOUCH] == 0)
    now = done.result.force[np.round(wave.time / done.result.dt).astype(int)] / (2e-3 * 3e-3)
    middle = np.abs(wave.points[:, 2] - 5e-3) < 1.1e-3
    late = wave.time > 60e-6
    assert wave.values[late][:, middle].mean(axis=1) == pytest.approx(now[late], rel=0.03)
    top = wave.points[:, 2] > 10e-3 - 1e-9
    assert wave.displacement[late][:, top, 2].mean(axis=1) == pytest.approx(-now[late] * 10e-3 / 200e9, rel=0.05)


@pytest.mark.slow
def test_its_files_and_pictures(pressed: tuple[Any, Any], tmp_path: Path) -> None:
    """Each time has a picture and a file; the exaggeration moves the body by 2 to 5 % of its size."""
    done, stress = pressed
    done = replace(done, plan=replace(done.plan, scene=load(tmp_path, "frames = 4")))
    pictures = dict(wave_pictures(done, [stress]))
    assert set(pictures) == {"stress_wave.gif", "stress_wave.png", "seat_stress.pvd", "stress_wave.h5"}
    for name, draw in pictures.items():
        draw(path=tmp_path / name)
    from PIL import Image

    with Image.open(tmp_path / "stress_wave.gif") as moving, Image.open(tmp_path / "stress_wave.png") as album:
        assert moving.n_frames == 4
        assert album.size[0] > 500
    series = (tmp_path / "seat_stress.pvd").read_text(encoding="utf-8")
    assert series.count("<DataSet") == 4
    assert 'file="seat_stress/0004.vtu"' in series
    import pyvista

    wave = wave_of(done, stress)
    last = pyvista.read(tmp_path / "seat_stress" / "0004.vtu")
    np.testing.assert_allclose(last.point_data["von Mises [Pa]"], wave.values[-1], rtol=1e-6)
    np.testing.assert_allclose(last.point_data["displacement [m]"], wave.displacement[-1], rtol=1e-6)
    kept = load_moving(tmp_path / "stress_wave.h5")
    assert kept.labels[-1] == wave.labels[3]
    mises = wave.values[-1]
    np.testing.assert_allclose(kept.values[-1], np.minimum(mises, wave.high), atol=1e-4 * wave.high)
    np.testing.assert_allclose(kept.displacement[-1], wave.displacement[-1], atol=1e-4 * kept.largest)
    farthest = wave.exaggeration * wave.largest / wave.size
    assert 0.02 - 1e-9 <= farthest <= 0.05 + 1e-9


@pytest.mark.slow(but="crossland")
@pytest.mark.parametrize("criterion", ["", "crossland"])
def test_margins_of_a_bar_that_is_pressed(pressed: tuple[Any, Any], tmp_path: Path, criterion: str) -> None:
    """Its sides bear -p and are let go: Crossland's sqrt(J2a) is p/2/sqrt 3 and pmax 0, Goodman's amplitude p/2 under
    a compressive mean, which counts for nothing. The bar's own waves are 2 %."""
    stress = pressed[1]
    scene = load(tmp_path, criterion=criterion)
    demand = scene.life.demand("seat")
    middle = stress.field.at(np.flatnonzero(np.abs(stress.field.points[:, 2] - 5e-3) < 1.1e-3))
    values = replace(stress, field=middle, sites=middle.points).margins(partial(margin_of, demand))
    amplitude = demand.strength.curve.stress(4.5e9)
    exact = 310e6 * 2 * np.sqrt(3) / PRESSURE if criterion else 2 * amplitude / PRESSURE
    assert len(values) > 4
    assert values == pytest.approx(exact, rel=0.03)


@pytest.mark.slow
def test_the_map_of_margins_is_drawn_and_written(pressed: tuple[Any, Any], tmp_path: Path) -> None:
    done, stress = pressed
    pictures = dict(margin_pictures(done.plan.scene.life, done, [stress]))
    assert set(pictures) == {"margin_map.png", "seat_margin.vtu"}
    for name, draw in pictures.items():
        draw(path=tmp_path / name)
    import pyvista

    margin = pyvista.read(tmp_path / "seat_margin.vtu").point_data["margin"]
    assert np.nanmin(margin) == pytest.approx(310e6 * 2 * np.sqrt(3) / PRESSURE, rel=0.05)
    assert np.isnan(margin).any()  # near the clamp
    with pytest.raises(PictureError, match="lower the load"):
        plot_margin_map([], tmp_path / "none.png", title="")


@pytest.mark.parametrize(
    ("stress", "said"),
    [
        ('frames_from = "10 us"', "stress.frames_from:.*frames:"),
        ('frames = 9\nframes_from = "20 us"\nframes_until = "10 us"', "stress.frames_until: 10 us.*later"),
        ('frames = 9\nframes_until = "400 us"', "stress.frames_until: 0.4 ms.*run.duration = 0.36 ms"),
        ("frames = 501", "stress.frames: "),
    ],
)
def test_times_that_cannot_be_are_refused(tmp_path: Path, stress: str, said: str) -> None:
    with pytest.raises(SceneError, match=said):
        load(tmp_path, stress)


@pytest.mark.slow
def test_a_plate_that_strikes_is_shown_as_it_moves(tmp_path: Path) -> None:
    """The struck patch moves as far as the run says; stress is shown away from the contact, and only there."""
    reed = f"{FLAPPER}greens = {{ bandwidth = '10 kHz' }}\nrelease = {{ velocity = '-1 m/s' }}\n"
    text = f"{SCENE}frames = 8\n{ASKED.format('')}".replace('gap = "10 um"', 'gap = "5 um"\nports = 1')
    text = text.replace(mass(1, "-0.5 m/s"), f"{reed}contact_radius = '1 mm'\n")
    (tmp_path / "seat.toml").write_text(STRENGTH, encoding="utf-8")
    scene = load_text(tmp_path, text.replace('"360 us"', '"60 us"'))
    *_, done = rounds(begin_plan(scene), tmp_path, Stopwatch(), silent)
    wave = wave_of(done, plate_stress(done))
    steps = np.round(wave.time / done.result.dt).astype(int)
    centre = np.asarray(scene.reed.geometry().centre)
    struck = np.linalg.norm(wave.points[:, :2] - centre, axis=1) < 1e-3
    moved = wave.displacement[:, struck, 2].mean(axis=1)
    exact = done.result.striker_displacement[steps]
    assert moved == pytest.approx(
        exact, abs=0.03 * np.abs(exact).max()
    )  # of the patch of 2 x 3 mm, and without residual
    is_known = np.isfinite(wave.values).all(axis=0)
    assert np.isnan(wave.values[:, ~is_known]).all()
    assert not is_known[struck].any()
    assert is_known.sum() > 0.5 * len(is_known)
    assert wave.values[-1, is_known].max() > 0


ARCS = """
seat = { kind = "annular", bore_radius = "4 mm", lip_width = "1 mm", lip_edge_radius = "0.2 mm", material = "steel", \
    damping_ratio = 0.05, mesh = { size = "2 mm", contact_size = "1.2 mm" }, greens = { bandwidth = "50 kHz" } }
reed = { kind = "flapper", root_width = "8 mm", taper_length = "2 mm", neck_width = "6 mm", neck_length = "12 mm", \
    paddle_diameter = "12 mm", thickness = "0.3 mm", damping_ratio = 0.02, release = { velocity = "-1 m/s" }, \
    greens = { bandwidth = "30 kHz" } }
contact = { gap = "2 um", tilt = "0.02 deg", ports = 8 }
run = { duration = "60 us", time_step = "200 ns" }
accuracy = { target = "20 %" }
stress = { frames = 5 }
life = { seat_strength = "seat.toml", multiaxial = "crossland", cycles = 4.5e9 }
"""


PLACE = np.array([1e-3, 2e-3, 5e-3])


@pytest.mark.slow
def test_the_wave_and_the_margins_of_a_ring_struck_in_arcs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The wave at any angle is the stress of the ring's own field; a map shows each point with its own margin."""
    (tmp_path / "seat.toml").write_text(STRENGTH, encoding="utf-8")
    *_, done = rounds(begin_plan(load_text(tmp_path, ARCS)), tmp_path, Stopwatch(), silent, limits=Limits(rounds=1))
    stress = seat_stress(done)
    assert len(stress.known.waves.numbers) > 3
    wave = wave_of(done, stress)
    some, section = np.arange(len(wave.points))[:: len(wave.points) // 4], elements_of(stress.mesh).nodes.T
    places = np.column_stack([np.hypot(*wave.points[some, :2].T), wave.points[some, 2]])
    nodes = np.array([np.linalg.norm(section - place, axis=1).argmin() for place in places])
    nodes, first = np.unique(nodes, return_index=True)
    some = some[first]
    angles = np.arctan2(wave.points[some, 1], wave.points[some, 0])
    sites = at_nodes(elements_of(stress.mesh), nodes)
    parts = [
        Harmonic(
            n, response.stress(stress.drawn.stress_of(model, sites, n), sites.points).field(done.result.dt), mixing
        )
        for n, model, response, mixing in stress.drawn.harmonics(stress.known.waves)
    ]
    field = RingField(sites.points, angles[:, None], tuple(parts))
    exact = von_mises(np.moveaxis(histories(field, stress.force, stress.dt), 1, 2))
    now = np.round(wave.time / done.result.dt).astype(int)
    assert exact.max() > 0
    np.testing.assert_allclose(wave.values[:, some].T, exact[:, now], atol=1e-9 * exact.max())
    # in place of margins the distance from a place: each point is drawn with its own
    monkeypatch.setattr(SeatStress, "margins", lambda self, *_: np.linalg.norm(self.field.points - PLACE, axis=1))
    (drawn,) = dict(margin_pictures(done.plan.scene.life, done, [stress]))["margin_map.png"].args[0]  # type: ignore[attr-defined]
    seen = np.isfinite(drawn.colours[0])
    assert seen.sum() >= len(stress.sites)
    np.testing.assert_allclose(drawn.colours[0][seen], np.linalg.norm(drawn.points[seen] - PLACE, axis=1), atol=1e-12)
