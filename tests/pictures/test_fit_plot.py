"""A measured seat shows its fit over the data, and which of the tried poles are stable."""

from pathlib import Path

import numpy as np
import pytest

from impact.measured.amplitudes import Candidate
from impact.measured.frf import FrequencyResponse
from impact.measured.pole_fit import fit_poles
from impact.measured.vector_fitting import Poles
from impact.pictures.fit_plots import plot_fit, plot_stabilisation
from seatfem.structures.method import Solved
from seatfem.study.runs.pictures import _seat_pictures
from seatfem.study.scene import load_scene

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
