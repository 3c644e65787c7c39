"""Reeds that start with a field given node by node, and plates in Python with states of their modes."""

from pathlib import Path

import numpy as np
import pytest

import impact
import seatfem
from seatfem.structures.sheets import PlateModes, plate_modes
from tests.gallery import FLAPPER, load_text
from tests.steps import Lip, ModelError, Scene, SceneError, striker_of

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
