"""Figures and pictures: what is drawn, what is written in them, and what happens when they cannot be made."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import skfem

import impact
from impact.measured.amplitudes import Candidate
from impact.measured.frf import FrequencyResponse
from impact.measured.pole_fit import fit_poles
from impact.measured.vector_fitting import Poles
from impact.pictures import plots
from impact.pictures.drawing import PictureError, sheet
from impact.pictures.fit_plots import plot_fit, plot_stabilisation
from impact.pictures.plots import plot_greens, sampled_filter
from impact.quantities import text
from seatfem.pictures import plots as seat_plots
from seatfem.pictures import rendering
from seatfem.pictures.moving import swing_frame
from seatfem.structures.model import Material, ModelError
from seatfem.study.runs.pictures import _seat_pictures
from tests.moving_block import block_modes
from tests.solids import assemble, solve_modes
from tests.steps import ModalGreens, Residual, Solved, load_scene

pytest.importorskip("matplotlib")


@pytest.fixture(scope="module")
def rod():
    return impact.fixed_rod(young=200e9, density=7850.0, area=4.17e-7, length=3e-3, damping_ratio=0.1)


@pytest.fixture(scope="module")
def modal():
    """Return two modes, a relaxation and a bare spring: every term a modal function can have."""
    return ModalGreens(
        omega=2 * np.pi * np.array([60e3, 210e3]),
        zeta=np.array([0.1, 0.2]),
        shapes=np.array([[20.0], [15.0]]),
        residual=Residual(np.array([[0.03]]), np.array([4e5]), np.array([[1e-9]])),
        error=impact.ErrorEstimate(0.004, None),
    )


@pytest.fixture(scope="module")
def runs(rod):
    reed = impact.cantilever_reed(
        young=200e9, density=7850.0, length=25.4e-3, width=10e-3, thickness=0.305e-3, damping_ratio=0.03, n_modes=12,
        tip_deflection=1e-3,
    )  # fmt: skip
    spring = impact.spring(stiffness=1 / float(rod.static_compliance()[0, 0]))
    return [impact.solve(impact.ContactProblem(reed, impact.Body(g)), dt=1e-7, duration=1.2e-3) for g in (rod, spring)]


@pytest.mark.parametrize(
    ("value", "unit", "expected"),
    [
        (3e-5, "m", "30.0 µm"),
        (0.0, "N", "0 N"),
        (809.2e-6, "N s", "809 µN s"),
        (-1.5e7, "N/m", "-15.0 MN/m"),
        (float("inf"), "m/N", "–"),
        (3.21e-18, "J", "3.21e-06 pJ"),
        (1e150, "m/N", "1.00e+141 Gm/N"),
    ],
)
def test_numbers_are_written_with_prefixed_units(value: float, unit: str, expected: str) -> None:
    assert text(value, unit) == expected


@pytest.mark.parametrize("name", ["modal", "rod", "spring"])
def test_sampled_filter_agrees_with_the_quadrature(name: str, request: pytest.FixtureRequest) -> None:
    g = impact.spring(stiffness=3e7) if name == "spring" else request.getfixturevalue(name)
    t, sampled = sampled_filter(g, 300, 2e-6)
    exact = g.filtered(t[::15], 2e-6)
    # trapezoidal rule over 48 intervals: (2 pi/48)^2/12 = 1.4e-3, doubled at the jump of a spring
    assert np.abs(sampled[::15] - exact).max() < 4e-3 * np.abs(exact).max()


@pytest.mark.slow
def test_force_figure_states_the_measured_numbers(runs: list[impact.ImpactResult], tmp_path: Path) -> None:
    plots.plot_force(*runs, tmp_path / "force.svg", filter_width=1e-6, title="A <b>title")
    written = (tmp_path / "force.svg").read_text(encoding="utf-8")
    assert "A &lt;b&gt;title" in written
    for run in runs:
        assert f">{text(impact.measures.peak_force(run), 'N')}<" in written
        assert f">{text(impact.measures.filtered_peak_force(run), 'N')}<" in written
        assert f">{text(impact.measures.impulse(run), 'N s')}<" in written


@pytest.mark.slow
def test_every_figure_is_a_whole_png_and_leaves_the_settings_alone(
    runs: list[impact.ImpactResult], modal: ModalGreens, tmp_path: Path
) -> None:
    import matplotlib
    from PIL import Image

    before = dict(matplotlib.rcParams)
    plots.plot_force(*runs, tmp_path / "force.png")
    plots.plot_motion(*runs, tmp_path / "motion.png")
    plots.plot_energy(runs[0], tmp_path / "energy.png")
    plot_greens(modal, tmp_path / "greens.png", duration=1e-4, width=2e-6)
    assert dict(matplotlib.rcParams) == before
    assert sorted(p.name for p in tmp_path.iterdir()) == ["energy.png", "force.png", "greens.png", "motion.png"]
    for picture in tmp_path.iterdir():
        with Image.open(picture) as image:
            assert min(image.size) > 900
            assert len(image.convert("L").getcolors()) > 50  # not blank


@pytest.mark.slow(but="plate")
@pytest.mark.parametrize(
    "greens",
    [
        impact.spring(stiffness=3e7),
        impact.spring(stiffness=99.99999999999999),  # a flat curve whose logarithm rounds
        impact.infinite_plate(young=2e11, poisson=0.3, density=7850.0, thickness=1e-3),
        impact.fixed_rod(young=2e11, density=7850.0, area=1e-6, length=3e-3),
        impact.rigid_mass(mass=1e-3, velocity=-1.0).greens,
    ],
    ids=["spring", "soft spring", "plate", "undamped rod", "free mass"],
)
def test_greens_figure_of_every_kind_of_function(greens: impact.GreensFunction, tmp_path: Path) -> None:
    plot_greens(greens, tmp_path / "greens.svg", duration=2e-5, width=1e-6)
    written = (tmp_path / "greens.svg").read_text(encoding="utf-8")
    finite = np.isfinite(greens.static_compliance()[0, 0])
    assert ("static " in written) == finite


def test_a_missing_matplotlib_names_the_extra_and_an_unknown_format_the_known_ones(
    monkeypatch: pytest.MonkeyPatch, modal: ModalGreens, tmp_path: Path
) -> None:
    with pytest.raises(ValueError, match="width <= duration"):
        plot_greens(modal, tmp_path / "greens.png", duration=1e-6, width=2e-6)
    with pytest.raises(PictureError, match=r"\.png"), sheet(tmp_path / "a.xyz", 3, 3):
        pass
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(PictureError, match=r"install 'seatfem\[pictures\]'"), sheet(tmp_path / "a.png", 3, 3):
        pass


@pytest.fixture(scope="module")
def block():
    """Give a small quadratic block with named faces, and its model."""
    straight = skfem.MeshTet.init_tensor(*[np.linspace(0.0, length, 3) for length in (2e-3, 2e-3, 3e-3)])
    mesh = skfem.MeshTet2.from_mesh(straight)
    mesh = mesh.with_boundaries({"fixed": lambda x: x[2] < 1e-9, "contact": lambda x: x[2] > 3e-3 - 1e-9})
    return assemble(mesh, Material(200e9, 0.3, 7850.0))


@pytest.fixture
def drawing() -> None:
    pytest.importorskip("pyvista")
    try:
        rendering.load_pyvista()
    except PictureError as gap:
        pytest.skip(str(gap))


def test_a_model_without_mesh_or_modes_is_refused(block, tmp_path: Path) -> None:
    bare, modes = type(block)(block.M, None, block.K, block.ports), solve_modes(block, 1)
    with pytest.raises(ModelError, match="does not know its mesh"):
        seat_plots.plot_modes(bare, modes, tmp_path / "modes.png")
    none = replace(modes, frequencies_hz=modes.frequencies_hz[:0], shapes=modes.shapes[:, :0])
    with pytest.raises(PictureError, match="at least one"):
        seat_plots.plot_modes(block, none, tmp_path / "modes.png")


@pytest.mark.slow
def test_mode_pictures(block, drawing: None, tmp_path: Path) -> None:
    from PIL import Image

    seat_plots.plot_modes(block, solve_modes(block, 2), tmp_path / "modes.png")
    with Image.open(tmp_path / "modes.png") as image:
        pixels = np.asarray(image.convert("RGB")).reshape(-1, 3).astype(int)
    yellow = (pixels[:, 0] > 200) & (pixels[:, 1] > 190) & (pixels[:, 2] < 90)  # largest displacement
    violet = (pixels[:, 0] < 90) & (pixels[:, 1] < 40) & (pixels[:, 2] > 45)  # at rest
    assert yellow.sum() > 1000
    assert violet.sum() > 1000


@pytest.mark.slow
def test_animation_is_a_loop_that_moves(drawing: None, tmp_path: Path) -> None:
    from PIL import Image, ImageSequence

    swing_frame(block_modes(), tmp_path / "mode.gif", pictures=8)
    with Image.open(tmp_path / "mode.gif") as image:
        frames = np.array([each.convert("RGB") for each in ImageSequence.Iterator(image)], dtype=int)
    assert len(frames) == 8
    assert np.abs(frames[0] - frames[4]).mean() > 2  # the two extremes
    assert np.abs(frames[1] - frames[7]).mean() < 1  # to and fro by the same way
    assert (tmp_path / "mode.gif").stat().st_size < 2e6


@pytest.mark.slow
def test_mesh_picture_shows_contact_and_fixed_faces(block, drawing: None, tmp_path: Path) -> None:
    from PIL import Image

    seat_plots.plot_mesh(block.dofs.mesh, tmp_path / "mesh.png")
    with Image.open(tmp_path / "mesh.png") as image:
        r, g, b = np.moveaxis(np.asarray(image.convert("RGB")).astype(int), 2, 0)
    assert ((r > 150) & (g > 60) & (g < 130) & (b < 60)).sum() > 2000
    assert ((b > 130) & (b - r > 60)).sum() > 2000


def test_a_missing_library_is_told_before_vtk_is_touched(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rendering, "picture_library_gap", lambda: "no pictures: apt-get install libegl1")
    with pytest.raises(PictureError, match="apt-get install libegl1"):
        rendering.load_pyvista()


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="drivers are found by path on Linux only")
def test_a_missing_driver_is_told_and_does_not_crash(drawing: None, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("__EGL_VENDOR_LIBRARY_FILENAMES", "/dev/null")
    rendering.can_draw.cache_clear()
    try:
        if rendering.can_draw():
            pytest.skip("this machine draws without EGL")
        with pytest.raises(PictureError, match="libgl1-mesa-dri"):
            rendering.load_pyvista()
    finally:
        rendering.can_draw.cache_clear()


F = np.arange(50.0, 20e3, 50.0)
S = 2j * np.pi * F
G = sum(a / ((2 * np.pi * f0) ** 2 + S**2 + 0.04 * np.pi * f0 * S) for a, f0 in ((50.0, 3e3), (30.0, 9e3)))


@pytest.mark.slow
def test_data_fit_and_band_are_named(tmp_path: Path) -> None:
    response = FrequencyResponse(F, G)
    plot_fit(response, fit_poles(response), tmp_path / "fit.svg", width=20e-6)  # type: ignore[arg-type]
    drawn = (tmp_path / "fit.svg").read_text(encoding="utf-8")
    for words in ("measured", "fitted poles", "measured band", "1/filter width", "phase [°]", "|receptance|", "misfit"):
        assert words in drawn, words


NOISY_F = np.arange(50.0, 12e3, 25.0)


def candidate(criterion: float, *modes: tuple[float, float]) -> Candidate:
    """Return a candidate with modes of these frequencies [Hz] and damping ratios."""
    pairs = [2 * np.pi * f * (-zeta + 1j * np.sqrt(1 - zeta**2)) for f, zeta in modes]
    return Candidate(Poles(np.array(pairs), np.zeros(0)), criterion)


@pytest.mark.slow
def test_a_run_on_a_noisy_record_draws_what_was_tried(tmp_path: Path) -> None:
    s, rng = 2j * np.pi * NOISY_F, np.random.default_rng(3)
    modes = ((50.0, 3e3), (30.0, 7e3))
    exact = s**2 * sum(a / ((2 * np.pi * f0) ** 2 + s**2 + 0.04 * np.pi * f0 * s) for a, f0 in modes)
    noise = 0.02 * np.sqrt(np.mean(np.abs(exact) ** 2) / 2)
    h = exact + noise * (rng.normal(size=len(NOISY_F)) + 1j * rng.normal(size=len(NOISY_F)))
    rows = [f"{f:g},{v.real:.9g},{v.imag:.9g}" for f, v in zip(NOISY_F, h, strict=True)]
    head = "frequency [Hz],accelerance real [1/kg],accelerance imag [1/kg]"
    (tmp_path / "h.csv").write_text("\n".join([head, *rows]), encoding="utf-8")
    text = '[seat]\nkind = "frf"\nfile = "h.csv"\n[reed]\nkind = "rigid_mass"\nmass = "5 g"\nvelocity = "-1 m/s"\n'
    (tmp_path / "scene.toml").write_text(text + '[run]\nduration = "1 ms"\nfilter_width = "20 us"\n', encoding="utf-8")
    scene = load_scene(tmp_path / "scene.toml")
    seat = scene.seat
    assert len(seat.fit().tried) > 1
    pictures = dict(_seat_pictures(seat, scene.run.filter_width, Solved(seat.fit().greens)))  # type: ignore[attr-defined]
    assert list(pictures) == ["fit.png", "stabilisation.png"]
    pictures["stabilisation.png"](tmp_path / "stabilisation.png")
    assert (tmp_path / "stabilisation.png").stat().st_size > 20_000
    response = seat.response()
    assert response is not None
    plot_stabilisation(response, seat.fit().tried, tmp_path / "drawn.svg")
    drawn = (tmp_path / "drawn.svg").read_text(encoding="utf-8")
    for words in ("pole pairs in the band", "frequency [kHz]", "|accelerance| [1/kg]", "least: 2 pairs", "stable: "):
        assert words in drawn, words
