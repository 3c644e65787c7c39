"""How much model a seat requires: what applies, what is chosen, and that the answers agree."""

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from seatfem.structures.kinds.drawn import Drawn
from tests.gallery import load_text
from tests.steps import LevelError, Solved, load_scene, seat_of

REST = (
    '\nmaterial = { young = "200 GPa", density = "7850 kg/m^3" }\ndamping_ratio = 0.1\n[reed]\nkind = "rigid_mass"\n'
    'mass = "1 g"\nvelocity = "-1 m/s"\n[run]\nduration = "20 us"\n'
)
RING = 'kind = "annular"\nbore_radius = "4 mm"\nlip_width = "2 mm"\nlip_edge_radius = "0 mm"\nouter_radius = "8 mm"\n'
RING += 'thickness = "4 mm"\nmesh = { size = "2 mm", contact_size = "1 mm" }\ngreens = { bandwidth = "150 kHz" }\n'
BAR = 'kind = "bar"\nlength = "12 mm"\nwidth = "4 mm"\nheight = "4 mm"\n'
BAR += 'mesh = { size = "2 mm" }\ngreens = { bandwidth = "100 kHz" }\n'
PLATE = 'kind = "plate"\nports = 3\nport_radius = "2 mm"\npitch = "8 mm"\nmargin = "4 mm"\nthickness = "4 mm"\n'
PLATE += 'land_width = "1 mm"\nclamp_width = "2 mm"\nmesh = { size = "2 mm", contact_size = "0.8 mm" }\n'
PLATE += 'greens = { bandwidth = "60 kHz" }\n'

Build = Callable[..., Solved]


@pytest.fixture
def seat(tmp_path: Path) -> Callable[[str], Drawn]:
    def read(text: str) -> Drawn:
        body = load_text(tmp_path, "[seat]\n" + text + REST).seat
        return body

    return read


@pytest.fixture(scope="module")
def build(tmp_path_factory: pytest.TempPathFactory) -> Build:
    """Give a function that builds every seat once."""
    path = tmp_path_factory.mktemp("levels") / "scene.toml"

    @cache
    def solve(text: str, model: str, mesh_error: bool = True) -> Solved:
        path.write_text(f'[seat]\nmodel = "{model}"\n{text}{REST}', encoding="utf-8")
        return seat_of(load_scene(path), mesh_error=mesh_error)

    return solve


@pytest.mark.parametrize(
    ("text", "levels", "chosen"),
    [
        (RING, {"axisymmetric", "sector", "3d"}, "axisymmetric"),
        (RING + 'arc = "60 deg"\n', {"harmonics"}, "harmonics"),
        (BAR, {"rod", "sector", "3d"}, "sector"),
        (BAR.replace("12 mm", "200 mm").replace("100 kHz", "20 kHz"), {"rod", "sector", "3d"}, "rod"),
        (BAR.replace("100 kHz", "1 MHz"), {"rod", "sector", "3d"}, "sector"),
        (PLATE, {"sector", "3d"}, "sector"),
        (PLATE + "struck = 2\n", {"3d"}, "3d"),
    ],
)
def test_what_applies_and_what_is_chosen(text, levels, chosen, seat):
    possible = seat(text).levels()
    assert {level.level for level in possible if level.applies} == levels
    assert all(level.reason for level in possible)
    assert seat(text).level(0.0025).level == chosen


def test_a_level_that_does_not_apply_is_refused_with_what_does(seat: Callable[[str], Drawn]) -> None:
    with pytest.raises(LevelError, match=r"seat.model = 'axisymmetric' .*sector, 3d"):
        seat(PLATE + 'model = "axisymmetric"\n').level(0.01)


def test_loves_correction_grows_with_the_square_of_the_band(seat: Callable[[str], Drawn]) -> None:
    """The error is nu^2 w^2 r^2/(2 c_0^2) with r^2 = 32/12 mm^2, and a hundredfold at ten times the band."""
    one, ten = (seat(BAR.replace("100 kHz", band)) for band in ("100 kHz", "1 MHz"))
    assert one.love_error(1e5) == pytest.approx(0.09 * (2 * np.pi * 1e5) ** 2 * (32e-6 / 12) / 2 / (200e9 / 7850))
    assert ten.love_error(1e6) == pytest.approx(100 * one.love_error(1e5))


def difference(one: Solved, other: Solved, band: float) -> float:
    """Return the largest difference of g after the Hann pulse of the band, relative."""
    t = np.linspace(0, 20e-6, 200)
    a, b = (answer.greens.filtered(t, 1 / band) for answer in (one, other))
    return float(np.abs(a - b).max() / np.abs(a).max())


def stated(answer: Solved) -> float:
    total = answer.greens.error_estimate.total
    return total + answer.level_error


@pytest.mark.slow
@pytest.mark.parametrize(
    ("text", "models", "band"),
    [
        (RING, ("axisymmetric", "sector", "3d"), 150e3),
        (BAR, ("rod", "sector", "3d"), 100e3),
        (PLATE, ("sector", "3d"), 60e3),
    ],
)
def test_levels_agree_within_their_stated_errors(text: str, models: tuple[str, ...], band: float, build: Build) -> None:
    answers = [build(text, model) for model in models]
    for k, one in enumerate(answers):
        assert 0 <= stated(one) < 0.3  # the plate of narrow lands states most: 0.26
        for other in answers[k + 1 :]:
            assert difference(one, other, band) <= stated(one) + stated(other)
