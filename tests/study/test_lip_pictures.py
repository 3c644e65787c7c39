"""Pictures of a contact along a lip: what they show is the run's own motion and forces."""

import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from impact.after.histories import best_plane
from impact.pictures.drawing import PictureError
from impact.pictures.lip_plots import plot_lip
from impact.quantities import text
from seatfem.pictures import rendering
from seatfem.pictures.moving import animate_frames
from seatfem.study.impacts.forces import Strike
from seatfem.study.runs.stress_wave import join_rings, landing_of, lip_pictures
from tests.gallery import FLAPPER, LIP, load_text
from tests.steps import Division, Lip, Solved, bed, run_contacts, solved_striker, striker_of

pytestmark = pytest.mark.slow
ARCS, RADIUS = 8, 5.5e-3
SCENE = (
    f'title = "a <tilted> landing"\ncontact = {{ gap = "1 um", tilt = "0.3 deg", ports = 8, rings = 2 }}\n'
    f'run = {{ duration = "0.3 ms" }}\n[seat]\n{LIP}[reed]\n{FLAPPER}greens = {{ bandwidth = "10 kHz" }}\n'
    f'release = {{ velocity = "-1 m/s" }}\n'
)


@pytest.fixture(scope="module")
def landed(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """Run a round as far as pictures ask for it, on springs, and its baseline."""
    scene, springs = load_text(tmp_path_factory.mktemp("lip"), SCENE), bed(Division(ARCS, 2), 5e6)
    striker = striker_of(scene)
    touches, stiffer = (run_contacts(scene, striker, seat, 2e-7) for seat in (springs, bed(Division(ARCS, 2), 5e7)))
    done = SimpleNamespace(
        plan=SimpleNamespace(scene=scene),
        touches=touches,
        seat=Solved(springs),
        striker=striker,
        reed=solved_striker(scene),
        strike=Strike(scene.geometry, striker, springs, touches),
    )
    return SimpleNamespace(done=done, baseline=stiffer)


def test_the_gaps_begin_with_the_tilt_of_the_scene(landed: Any) -> None:
    _, pitch, roll = best_plane(join_rings(landed.done.touches, Division(ARCS, 2)).gap, RADIUS)[0]
    assert np.degrees(np.arctan(roll)) == pytest.approx(0.3, rel=4e-3)  # the mean of an arc lies outside its middle
    assert abs(pitch) < 1e-9


def test_the_plate_that_is_drawn_is_the_one_that_touched(landed: Any) -> None:
    """Nodes near the lip's outer circle move as the arcs next to them, which the march knows; what the modes left out
    is not drawn."""
    lip = join_rings(landed.done.touches, Division(ARCS, 2))
    frames = landing_of(landed.done, lip)
    corners = frames.overlay.points.reshape(-1, 4, 3)[..., :2]
    inner, outer = corners[:, :2], corners[:, 2:]
    (x, y), radius = outer.mean(axis=(0, 1)), RADIUS
    for edge, away in ((inner, 5e-3), (outer, 6e-3)):
        np.testing.assert_allclose(np.linalg.norm(edge - (x, y), axis=2), away, rtol=1e-9)
    places = (frames.points[:, :2] - (x, y)) @ np.array([1, 1j])
    deflection = frames.displacement[..., 2]
    near = np.flatnonzero(np.abs(np.abs(places) - radius) < 0.5e-3)
    arcs = Lip(radius, 1e-3, ARCS).angles
    off = np.abs(np.angle(places[near, None] / np.exp(1j * arcs)))
    steps = np.searchsorted(landed.done.touches.seat.time, frames.time - 1e-12)
    moved = landed.done.touches.parts.striker_displacement[steps].reshape(len(steps), ARCS, 2).mean(axis=2)
    near, arcs_of = near[off.min(axis=1) < 0.3], off.argmin(axis=1)[off.min(axis=1) < 0.3]
    assert len(near) >= ARCS
    for node, arc in zip(near, arcs_of, strict=True):
        # an arc is 45 deg wide, the paddle turns by 3 mrad: the node is up to 2 mm from its middle
        assert np.abs(deflection[:, node] - moved[:, arc]).max() < 0.15 * np.ptp(moved)
    mean = np.abs(deflection[:, near].mean(axis=1) - moved.mean(axis=1))
    assert mean.max() < 0.03 * np.ptp(moved)
    assert np.all(np.diff(frames.time) > 0)
    middles = frames.overlay.height.reshape(ARCS, -1, 4).mean(axis=(1, 2))
    assert np.corrcoef(middles, -lip.gap[0])[0, 1] > 0.99
    force = frames.overlay.values.mean(axis=1) * 2 * np.pi * radius
    assert force.max() > 0
    assert frames.labels[int(force.argmax())].endswith(f"force {text(float(force.max()), 'N')}")


def test_figure_of_the_lip_says_over_what_it_is_averaged(landed: Any, tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    names = [name for name, _ in lip_pictures(landed.done, landed.baseline)]
    assert names == ["lip.png", "landing.gif", "landing.h5"]
    lip, springs = (join_rings(each, Division(ARCS, 2)) for each in (landed.done.touches, landed.baseline))
    plot_lip(lip, springs, tmp_path / "lip.svg", radius=RADIUS, share=0.25, filter_width=2e-6, title="a <b>title")
    written = (tmp_path / "lip.svg").read_text(encoding="utf-8")
    for words in (
        "a &lt;b&gt;title", "first contact: mean over 2 µs, 8 segments",
        "Impulse per length [mN s/m], over 8.6 mm",
        "Total force, mean over 2 µs", "Height over the lip, by 45°", "spring baseline",
        "roll, about x",
    ):  # fmt: skip
        assert f">{words}<" in written
    figure = plot_lip(lip, None, tmp_path / "alone.png", radius=RADIUS, share=0.25)
    (heights,) = (axes for axes in figure.axes if axes.get_title(loc="left").startswith("Height"))
    first = {line.get_label(): line.get_ydata()[0] for line in heights.lines}
    assert first["0°"] == pytest.approx(first["180°"], rel=1e-9)  # rolled about x
    assert first["90°"] > first["0°"] > first["270°"]
    assert (tmp_path / "alone.png").stat().st_size > 50_000


@pytest.mark.skipif(sys.platform != "linux", reason="drawn off-screen")
def test_landing_is_a_film_of_all_its_times(landed: Any, tmp_path: Path) -> None:
    pytest.importorskip("pyvista")
    try:
        rendering.load_pyvista()
    except PictureError as gap:
        pytest.skip(str(gap))
    from PIL import Image

    frames = landing_of(landed.done, join_rings(landed.done.touches, Division(ARCS, 2)))
    few = replace(
        frames, displacement=frames.displacement[::12], labels=frames.labels[::12], time=frames.time[::12],
        values=frames.values[::12], overlay=replace(frames.overlay, values=frames.overlay.values[::12]),
    )  # fmt: skip
    animate_frames(few, tmp_path / "landing.gif", title="t")
    with Image.open(tmp_path / "landing.gif") as film:
        assert film.n_frames == len(few.time)  # type: ignore[attr-defined]
        assert len(film.convert("L").getcolors()) > 20
