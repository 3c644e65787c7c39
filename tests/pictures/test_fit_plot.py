"""An FRF seat shows its fit over the data: magnitude and phase, the measured band marked."""

from pathlib import Path

import numpy as np
import pytest

from impact.measured.frf import FrequencyResponse
from impact.measured.pole_fit import fit_poles
from seatfem.pictures.fit_plots import _degrees, plot_fit
from seatfem.structures.method import Solved
from seatfem.study.runs.pictures import _seat_pictures
from seatfem.study.scene import load_scene

F = np.arange(50.0, 20e3, 50.0)
S = 2j * np.pi * F
G = sum(a / ((2 * np.pi * f0) ** 2 + S**2 + 0.04 * np.pi * f0 * S) for a, f0 in ((50.0, 3e3), (30.0, 9e3)))


@pytest.fixture
def frf_scene(tmp_path: Path) -> Path:
    rows = [f"{a:.17g},{b.real:.17g},{b.imag:.17g}" for a, b in zip(F, G, strict=True)]
    header = "frequency [Hz],receptance real [m/N],receptance imag [m/N]"
    (tmp_path / "frf.csv").write_text("\n".join([header, *rows]) + "\n", encoding="utf-8")
    scene = tmp_path / "scene.toml"
    scene.write_text(
        '[seat]\nkind = "frf"\nfile = "frf.csv"\n[reed]\nkind = "rigid_mass"\nmass = "5 g"\nvelocity = "-1 m/s"\n'
        '[run]\nduration = "1 ms"\nfilter_width = "20 us"\n',
        encoding="utf-8",
    )
    return scene


def test_a_run_on_a_measured_seat_draws_its_fit(frf_scene: Path, tmp_path: Path) -> None:
    scene = load_scene(frf_scene)
    (picture,) = _seat_pictures(scene.seat, scene.run.filter_width, Solved(scene.seat.fit().greens))  # type: ignore[arg-type]
    name, draw = picture
    assert name == "fit.png"
    draw(tmp_path / name)
    assert (tmp_path / name).stat().st_size > 20_000


def test_data_fit_and_band_are_named(tmp_path: Path) -> None:
    response = FrequencyResponse(F, G)
    plot_fit(response, fit_poles(response), tmp_path / "fit.svg", width=20e-6)  # type: ignore[arg-type]
    drawn = (tmp_path / "fit.svg").read_text(encoding="utf-8")
    for words in ("measured", "fitted poles", "measured band", "1/filter width", "phase [°]", "|receptance|", "misfit"):
        assert words in drawn, words


def test_phases_are_in_degrees_and_jumps_leave_no_strokes() -> None:
    shown = _degrees(np.exp(1j * np.radians([-90.0, -179.0, 179.0, 90.0])))
    assert shown[0] == pytest.approx(-90)
    assert np.isnan(shown[1])  # before the jump
    assert shown[2:] == pytest.approx([179, 90])
