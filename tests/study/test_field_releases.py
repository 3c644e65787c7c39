"""Reeds that start with a field given node by node, and reeds that are not flat: heights, shapes, openings."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import impact
import seatfem
from seatfem.structures.sheets import PlateModes, plate_modes
from tests.gallery import FLAPPER, LIP, load_text, spring
from tests.steps import Division, Lip, ModelError, Scene, SceneError, striker_of

REED = FLAPPER + 'greens = { bandwidth = "10 kHz" }\n'
HEAD = "x [mm],y [mm],w [um],velocity [m/s]\n"
GRID = [(x, y) for x in np.linspace(-1, 32, 67) for y in np.linspace(-9, 9, 37)]


def scene_of(folder: Path, release: str) -> Scene:
    seat = '[seat]\nkind = "spring"\nstiffness = "20 N/um"\n'
    return load_text(folder, f'{seat}[reed]\n{REED}release = {release}\n[run]\nduration = "1 ms"\n')


def modes_of(scene: Scene) -> PlateModes:
    return plate_modes(scene.reed.sheet())  # type: ignore[attr-defined]


def of_field(folder: Path, rows: str) -> Scene:
    (folder / "field.csv").write_text(rows, encoding="utf-8")
    return scene_of(folder, '{ field = "field.csv" }')


@pytest.mark.slow
def test_a_mode_as_a_field_is_that_mode(tmp_path: Path) -> None:
    """The second bending mode at its nodes, and points beyond the outline that no node sees: its rotary inertia, 4e-4
    of its mass norm, is all that the field has not."""
    plate = modes_of(scene_of(tmp_path, '{ mode = 3, velocity = "-2 m/s" }'))
    amplitude = np.eye(len(plate.modes.omega))[2]
    w = plate.shape_at(amplitude, plate.mesh.points)
    scale = -2.0 / float(plate.centre @ amplitude)
    rows = [
        f"{1e3 * x!r},{1e3 * y!r},{scale * u!r},{scale * u!r}"
        for (x, y), u in zip(plate.mesh.points.tolist(), w.tolist(), strict=True)
    ]
    rows += [f"{x},{y},0,0" for x, y in ((-5, -20), (-5, 20), (40, -20), (40, 20))]
    start = striker_of(of_field(tmp_path, HEAD + "\n".join(rows) + "\n")).modal_start()
    stated = striker_of(scene_of(tmp_path, '{ mode = 3, velocity = "-2 m/s" }')).modal_start()
    np.testing.assert_allclose(start.velocity, stated.velocity, atol=1e-3 * np.abs(stated.velocity).max())
    np.testing.assert_allclose(start.displacement, 1e-6 * start.velocity, atol=1e-18)


def test_a_smooth_field_moves_the_contact_as_it_says(tmp_path: Path) -> None:
    """w = c x^2, which the clamp allows: at the paddle's centre that of the field to 1 %."""
    rows = "".join(f"{x},{y},{x * abs(x)},0\n" for x, y in GRID)
    scene = of_field(tmp_path, HEAD + rows)
    start, plate = striker_of(scene).modal_start(), modes_of(scene)
    x = plate.sheet.shape.centre[0]
    assert float(plate.centre @ start.displacement) == pytest.approx(1e-6 * (1e3 * x) ** 2, rel=1e-2)
    assert scene.reed.start_at(0.0) == pytest.approx(1e-6 * (1e3 * x) ** 2, rel=1e-3)
    assert not start.velocity.any()


@pytest.mark.parametrize(
    ("rows", "message"),
    [
        ("x [mm],y [mm],w [um]\n0,0,1\n9,0,1\n9,9,1\n", r"field = .*field.csv: .*its points do not surround \("),
        (HEAD + "".join(f"{x},{y},0,{(-1) ** k}\n" for k, (x, y) in enumerate(GRID)), "field = .*square of velocity"),
        ("x [mm],y [mm]\n0,0\n1,0\n0,1\n", "field: .*neither w nor velocity"),
        ("x [mm],y [mm],w [um]\n0,0,1\n1,1,1\n2,2,1\n", "field: .*its points lie on one line"),
        ("x [mm],w [um]\n0,0\n", "field: .*add a column y"),
    ],
)
def test_fields_that_do_not_serve(tmp_path: Path, rows: str, message: str) -> None:
    with pytest.raises((ModelError, SceneError), match=f"reed.release.{message}"):
        striker_of(of_field(tmp_path, rows))


def test_a_plates_matrices_strike_in_python(tmp_path: Path) -> None:
    """A body of a plate's SecondOrderModel by modes, in a state of its first: it lands on a spring with that speed, and
    flies there as q'' = -w^2 q says."""
    plate = modes_of(scene_of(tmp_path, '{ velocity = "-2 m/s" }'))
    model = plate.with_ports([Lip.disc(1e-3)])
    greens = seatfem.greens_function(model, bandwidth=10e3, duration=2e-3, tolerance=0.05, method="modes")
    seen = greens.modal.shapes[:, 0]
    zero = np.zeros_like(seen)
    rate = zero.copy()
    rate[0] = -2.0 / seen[0]
    pulse = impact.Load(seen, lambda t: np.full(np.shape(t), -1e-3))
    reed = impact.Body(greens, state=impact.ModalState(zero, rate), loads=(pulse,))
    result = impact.solve(impact.ContactProblem(reed, impact.spring(stiffness=20e6), gap=10e-6), dt=2e-7, duration=1e-4)
    first = int(np.argmax(result.force > 0))
    assert result.dt * first == pytest.approx(5e-6, abs=4e-7)  # 10 um at 2 m/s
    assert result.force.max() > 0


STRAIGHT = FLAPPER + 'greens = { bandwidth = "20 kHz" }\nrelease = { velocity = "-2 m/s" }\n'
RADIUS, WIDTH, GAP, ARCS = 5.5e-3, 1e-3, 1e-6, 16
CENTRE = 15e-3 + math.sqrt(16e-3**2 - 6e-3**2) / 2  # of the paddle
FINE = 20_000  # points on each arc, against the program's 256


def curved_scene(folder: Path, curvature: str = "", contact: str = "", seat: str = LIP) -> Scene:
    contact = f'[contact]\ngap = "1 um"\n{contact}\n'
    return load_text(folder, f'[seat]\n{seat}[reed]\n{STRAIGHT}{curvature}\n{contact}[run]\nduration = "0.2 ms"\n')


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
    flat = curved_scene(tmp_path, contact=f'tilt = "0.3 deg"\ntilt_axis = "{axis}"')
    curved = curved_scene(tmp_path, keys)
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

    np.testing.assert_allclose(
        curved_scene(tmp_path, keys).geometry.gaps(Division(ARCS)), openings(height), atol=0.02e-6
    )
    tilted = curved_scene(tmp_path, keys, 'tilt = "0.2 deg"\n')
    both = openings(lambda x, y: height(x, y) + math.tan(math.radians(0.2)) * y)
    np.testing.assert_allclose(tilted.geometry.gaps(Division(ARCS)), both, atol=0.02e-6)


@pytest.mark.slow
def test_own_shapes(tmp_path: Path) -> None:
    """The height at the centre is the one stated; the paddle is nearly straight: the openings differ by its rise along
    the axis, within 5 %."""
    gaps = {}
    for shape in ("mode", "force", "pressure"):
        scene = curved_scene(tmp_path, f'curvature = {{ deflection = "0.2 mm", shape = "{shape}" }}')
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
    default = curved_scene(tmp_path, 'curvature = { deflection = "0.2 mm" }')
    np.testing.assert_array_equal(default.geometry.gaps(Division(ARCS)), gaps["mode"])
    down = curved_scene(tmp_path, 'curvature = { deflection = "-0.2 mm" }').geometry.gaps(Division(ARCS))
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
        curved_scene(tmp_path, as_csv(tmp_path, keys) if "\n" in keys else keys, *more).geometry.gaps(Division(ARCS))
