"""[contact] film: what of a scene becomes of it, what a run tells of it, and what is refused."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

import impact
from impact import measures
from seatfem.study.answers.verdict import verdict
from seatfem.study.runs.summary import summarise
from tests.gallery import FLAPPER, LIP, load_text, refusal
from tests.steps import Division, Scene, Touches, bed, problem_of, run_contacts, striker_of

AIR = 'film = { viscosity = "18 uPa s", floor = "1 um" }'
LANDING = f"""
[seat]
{LIP}[reed]
{FLAPPER}greens = {{ bandwidth = "40 kHz" }}
release = {{ mode = 1, velocity = "-2 m/s" }}
[contact]
gap = "30 um"
MORE
[run]
duration = "80 us"
"""
MASS = """
[seat]
kind = "spring"
stiffness = "1e15 N/m"
[reed]
kind = "rigid_mass"
mass = "1 g"
velocity = "-0.2 m/s"
[contact]
gap = "5 um"
law = { kind = "spring", stiffness = "1 kN/um" }
film = { viscosity = "18 uPa s", floor = "1 um", width = "1 mm", length = "34.56 mm", tension_limit = "0.4 bar" }
[run]
duration = "200 us"
"""
STIFFNESS, DT = 2e8, 1e-7


def lip(folder: Path, more: str) -> Scene:
    return load_text(folder, LANDING.replace("MORE", more))


def struck(scene: Scene, arcs: int) -> Touches:
    return run_contacts(scene, striker_of(scene), bed(Division(arcs), STIFFNESS), DT)


@pytest.mark.slow
def test_the_film_of_a_lip_is_spread_over_its_arcs(tmp_path: Path) -> None:
    scene = lip(tmp_path, f"{AIR}\nports = 8")
    contacts = problem_of(scene, striker_of(scene), impact.Body(bed(Division(8), STIFFNESS))).contacts
    films = [contact.film for contact in contacts if contact.film is not None]
    assert len(films) == 8
    assert sum(film.coefficient for film in films) == pytest.approx(18e-6 * 2 * math.pi * 5.5e-3 * 1e-9)
    assert sum(film.tension for film in films) == pytest.approx(1e5 * 2 * math.pi * 5.5e-3 * 1e-3)
    assert {film.floor for film in films} == {1e-6}


def test_a_mass_is_stopped_by_the_momentum_of_its_film(tmp_path: Path) -> None:
    """The mass stops at k/2 (1/(g + f)^2 - 1/(g0 + f)^2) = m v; a coefficient 3 % off moves the place by 1.5 %."""
    scene = load_text(tmp_path, MASS)
    run = run_contacts(scene, striker_of(scene), impact.spring(stiffness=1e15), DT)
    k = 18e-6 * 34.56e-3 * 1e-9
    rest = (2 * 1e-3 * 0.2 / k + 1 / 6e-6**2) ** -0.5 - 1e-6
    assert run.seat.gap[-1] == pytest.approx(rest, rel=1e-3)
    kept = summarise(run, 1e-6, filmed=True)
    assert kept["first_contact_s"] is None
    assert kept["contact_duration_s"] is None
    assert kept["film_loss_J"] == pytest.approx(0.5 * 1e-3 * 0.2**2, rel=1e-3)
    assert kept["film_force_peak_N"] == kept["peak_force_N"]
    assert verdict({**kept, "seat_kind": "annular"}).startswith("No landing")


@pytest.mark.slow
def test_arcs_under_a_rigid_face_have_the_film_of_one_port(tmp_path: Path) -> None:
    """Arcs under an even gap give the total force of one port at every step; under a turning paddle far less."""
    seat, _, rest = LANDING.partition("[reed]")
    rigid = seat + '[reed]\nkind = "rigid_mass"\nmass = "1 g"\nvelocity = "-1 m/s"\n' + rest[rest.index("[contact]") :]
    many, one = (struck(load_text(tmp_path, rigid.replace("MORE", f"{AIR}\nports = {n}")), n) for n in (8, 1))
    size = measures.film_force_peak(one.seat)
    assert size > 10.0
    np.testing.assert_allclose(many.seat.force, one.seat.force, atol=1e-9 * size)
    np.testing.assert_allclose(many.seat.film, one.seat.film, atol=1e-9 * size)
    np.testing.assert_allclose(many.line.film.sum(axis=1), many.seat.film, atol=1e-9)
    turning, even = (measures.film_force_peak(struck(lip(tmp_path, f"{AIR}\nports = {n}"), n).seat) for n in (8, 1))
    assert turning < 0.5 * even


def test_tilt_within_an_arc_raises_its_floor(tmp_path: Path) -> None:
    """The floor rises by half the range of R tan(tilt) sin(angle) over the corners of the arc, on both rims."""
    scene = lip(tmp_path, f'{AIR}\nports = 8\ntilt = "0.1 deg"')
    films = scene.geometry.films(Division(8))
    slope = math.tan(math.radians(0.1))
    rise = 6e-3 * slope * math.sin(math.pi / 4)
    assert films[0].floor == pytest.approx(1e-6 + rise / 2, rel=3e-3)
    assert films[2].floor == pytest.approx(1e-6 + slope * (6e-3 - 5e-3 * math.sin(math.pi / 4)) / 2, rel=3e-3)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (MASS.replace('width = "1 mm", ', ""), "contact.film.width: required"),
        (MASS.replace('length = "34.56 mm", ', ""), "contact.film.length: required"),
        (LANDING.replace("MORE", f"{AIR}\nrings = 3"), "contact.film:.*across"),
    ],
)
def test_what_is_wrong_is_named(text: str, words: str, tmp_path: Path) -> None:
    assert re.search(words, refusal(load_text, tmp_path, text))
