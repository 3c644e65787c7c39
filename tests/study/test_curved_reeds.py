"""Reeds that are not flat: heights as given, shapes of their own, the openings along a lip, and what is refused."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from tests.gallery import FLAPPER, LIP, load_text, spring
from tests.steps import Division, Scene, SceneError

LANDING = FLAPPER + 'greens = { bandwidth = "20 kHz" }\nrelease = { velocity = "-2 m/s" }\n'
RADIUS, WIDTH, GAP, ARCS = 5.5e-3, 1e-3, 1e-6, 16
CENTRE = 15e-3 + math.sqrt(16e-3**2 - 6e-3**2) / 2  # of the paddle
FINE = 20_000  # points on each arc, against the program's 256


def scene_of(folder: Path, curvature: str = "", contact: str = "", seat: str = LIP) -> Scene:
    return load_text(
        folder,
        f'[seat]\n{seat}[reed]\n{LANDING}{curvature}\n[contact]\ngap = "1 um"\n{contact}\n[run]\nduration = "0.2 ms"\n',
    )


def openings(height: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> np.ndarray:
    """Return the means over the arcs of the centre line of height(x, y) over the lowest, which is on the outer rim."""
    th = 2 * np.pi * (np.arange(ARCS * FINE) + 0.5) / (ARCS * FINE)
    centre_line, rim = (height(CENTRE + r * np.cos(th), r * np.sin(th)) for r in (RADIUS, RADIUS + WIDTH / 2))
    return np.asarray(GAP + (centre_line - rim.min()).reshape(ARCS, -1).mean(axis=1))


def as_csv(folder: Path, text: str) -> str:
    (folder / "shape.csv").write_text(text, encoding="utf-8")
    return 'curvature = { file = "shape.csv" }'


@pytest.mark.parametrize("way", ["heights", "x", "x, y"])
def test_a_plane_is_a_tilt(tmp_path: Path, way: str) -> None:
    """A plane written in any way has the gaps of its tilt, pitch over x or roll over x and y, to round-off."""
    rise, ends = math.tan(math.radians(0.3)), (0.0, 40.0)
    if way == "heights":
        keys = "curvature = { heights = [" + ", ".join(f'["{x} mm", "{-rise * x!r} mm"]' for x in ends) + "] }"
    elif way == "x":
        keys = as_csv(tmp_path, "x [mm],height [mm]\n" + "".join(f"{x},{-rise * x!r}\n" for x in ends))
    else:
        places = [(x, y) for x in ends for y in (-9.0, 9.0)]
        keys = as_csv(tmp_path, "x [mm],y [mm],height [mm]\n" + "".join(f"{x},{y},{rise * y!r}\n" for x, y in places))
    axis = "0 deg" if way == "x, y" else "90 deg"
    flat = scene_of(tmp_path, contact=f'tilt = "0.3 deg"\ntilt_axis = "{axis}"')
    curved = scene_of(tmp_path, keys)
    np.testing.assert_allclose(curved.geometry.gaps(Division(ARCS)), flat.geometry.gaps(Division(ARCS)), rtol=1e-12)
    assert curved.geometry.usual_ports == flat.geometry.usual_ports > 1


@pytest.mark.slow
def test_openings_are_means_of_the_shape(tmp_path: Path) -> None:
    """A saddle k x y, over a grid of 0.25 mm: k h^2/4 between its nodes; and with a tilt the two add up."""
    grid = np.arange(0, 36.01, 0.25), np.arange(-9, 9.01, 0.25)
    rows = "".join(f"{x},{y},{float((x - 1e3 * CENTRE) * y)!r}\n" for x in grid[0] for y in grid[1])
    keys = as_csv(tmp_path, "x [mm],y [mm],height [um]\n" + rows)

    def height(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return (x - CENTRE) * y

    np.testing.assert_allclose(scene_of(tmp_path, keys).geometry.gaps(Division(ARCS)), openings(height), atol=0.02e-6)
    tilted = scene_of(tmp_path, keys, 'tilt = "0.2 deg"\n')
    both = openings(lambda x, y: height(x, y) + math.tan(math.radians(0.2)) * y)
    np.testing.assert_allclose(tilted.geometry.gaps(Division(ARCS)), both, atol=0.02e-6)


@pytest.mark.slow
def test_own_shapes(tmp_path: Path) -> None:
    """The height at the centre is the one stated; the paddle is nearly straight: the openings differ by its rise along
    the axis, within 5 %."""
    gaps = {}
    for shape in ("mode", "force", "pressure"):
        scene = scene_of(tmp_path, f'curvature = {{ deflection = "0.2 mm", shape = "{shape}" }}')
        gaps[shape] = scene.geometry.gaps(Division(ARCS))
        rise = WIDTH / (4 * RADIUS) * np.ptp(gaps[shape])  # from the rim, where the gap is, to the centre line
        assert GAP < gaps[shape].min() - rise < GAP + 0.03 * np.ptp(gaps[shape])  # a mean over an arc
        heights = scene.reed.heights(
            np.array([(0.0, 0.0), (RADIUS, 0.0), (-RADIUS, 0.0), (0.0, RADIUS), (0.0, -RADIUS)])
        )
        assert heights[0] == pytest.approx(0.2e-3, rel=1e-9)
        assert heights[3] == pytest.approx(heights[4], rel=1e-9)  # it is mirrored
        assert np.ptp(gaps[shape]) == pytest.approx(heights[1] - heights[2], rel=0.05)
    assert np.ptp(gaps["force"]) == pytest.approx(np.ptp(gaps["mode"]), rel=0.1)
    assert np.abs(gaps["force"] - gaps["pressure"]).max() > 1e-7
    default = scene_of(tmp_path, 'curvature = { deflection = "0.2 mm" }')
    np.testing.assert_array_equal(default.geometry.gaps(Division(ARCS)), gaps["mode"])
    down = scene_of(tmp_path, 'curvature = { deflection = "-0.2 mm" }').geometry.gaps(Division(ARCS))
    np.testing.assert_allclose(down - GAP, (gaps["mode"] - GAP)[::-1][np.roll(np.arange(ARCS), ARCS // 2)], atol=2.5e-6)


BOWED = 'curvature = { deflection = "0.1 mm" }'
HEIGHTS = 'curvature = { heights = [["0 mm", "0 um"], ["20 mm", "9 um"]] }'


@pytest.mark.parametrize(
    ("keys", "more", "message"),
    [
        ("curvature = {}", (), "reed.curvature.heights:.*deflection"),
        (HEIGHTS.replace("0 mm", "30 mm", 1), (), "reed.curvature.heights:.*increase"),
        (HEIGHTS.replace(" }", ', shape = "mode" }'), (), "only a deflection"),
        (HEIGHTS, (), r"reed.curvature.heights:.*0.*20 mm.*16.4\d*.*28.4\d*"),
        (BOWED, ("ports = 1",), "contact.ports: .*mean gap"),
        (BOWED, ("", spring("20 N/um")), "reed.curvature:.*'spring'"),
        ("x [mm],height\n0,1\n", (), "reed.curvature.file: .*shape.csv:1:.*'height'"),
        ("x [mm],height [s]\n0,1\n", (), "reed.curvature.file: .*shape.csv:1: column 'height"),
        ("x [mm],y [mm]\n0,1\n", (), "reed.curvature.file: .*shape.csv:1:.*column"),
        ("x [mm],height [um]\n0,1\n2,nan\n", (), "reed.curvature.file: .*shape.csv, line 3, column 2: 'nan'"),
        ("x [mm],height [um]\n2,1\n1,1\n", (), "reed.curvature.file: .*x must increase"),
        ("x [mm],y [mm],height [um]\n0,0,1\n30,0,1\n30,5,2\n", (), "reed.curvature.file:.*surround"),
    ],
)
def test_shapes_that_do_not_fit(tmp_path: Path, keys: str, more: tuple[str, ...], message: str) -> None:
    with pytest.raises(SceneError, match=message):
        scene_of(tmp_path, as_csv(tmp_path, keys) if "\n" in keys else keys, *more).geometry.gaps(Division(ARCS))
