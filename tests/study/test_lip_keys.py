"""Keys of a contact along a lip, and of a film in it: what becomes of them, and how those that do not fit are named."""

import math
import re
from pathlib import Path

import numpy as np
import pytest

import impact
from seatfem.study.answers.verdict import verdict
from seatfem.study.runs.summary import summarise
from tests.as_stated import striker_of
from tests.gallery import FLAPPER, LIP, load_text, mass, refusal, spring
from tests.steps import Division, ModelError, Scene, SceneError, Touches, bed, problem_of, run_command, run_contacts

LANDING = 'release = { velocity = "-2 m/s" }\n'
REED = f'{FLAPPER}greens = {{ bandwidth = "20 kHz" }}\n{LANDING}'
BEAM = 'kind = "cantilever"\nlength = "30 mm"\nmaterial = "steel"\nrelease = { tip_deflection = "1 mm" }\nwidth = '
MASS, SPRING = mass(0.1, "-1 m/s"), spring("20 N/um")
OPEN = 'gap = "30 um"\nfilm = { viscosity = "18 uPa s", floor = "1 um" }\nports = '
FILMED = (
    'gap = "5 um"\nlaw = { kind = "spring", stiffness = "1 kN/um" }\n'
    'film = { viscosity = "18 uPa s", floor = "1 um", width = "1 mm", length = "34.56 mm", tension_limit = "0.4 bar" }'
)
ON_STIFF = mass(1, "-0.2 m/s"), spring("1e15 N/m")
STIFFNESS, DT = 2e8, 1e-7


def scene_of(folder: Path, contact: str, reed: str = REED, seat: str = LIP) -> Scene:
    return load_text(folder, f'[seat]\n{seat}[reed]\n{reed}[contact]\n{contact}\n[run]\nduration = "0.1 ms"\n')


@pytest.mark.parametrize(
    ("contact", "bodies", "key", "words"),
    [
        ("ports = 1000000000000000000000000", (), "ports", "must be at most 4096"),
        ("ports = -32", (), "ports", "must be at least 1"),
        ("ports = 131", (), "ports", "131 segments.*1"),
        ("ports = 2048\nrings = 4", (), "ports", "2048.*4096.*take fewer"),
        ('ports = 1\ntilt = "0.1 deg"', (), "ports", "contact.*several"),
        ('tilt = "-31 deg"', (), "tilt", "-31 deg must be at most 30 deg"),
        ('line_arc = "361 deg"', (), "line_arc", "361 deg must be above 0"),
        ('waviness = [["9 deg", "0 um"], ["5 deg", "1 um"]]', (), "waviness", "5 deg.*9 deg:"),
        ('waviness = [["-10 deg", "0 um"], ["350 deg", "1 um"]]', (), "waviness", "within 360 deg"),
        ('tilt = "1 deg"', (REED, SPRING), "tilt", "'spring'.*struck"),
        ('waviness = [["0 deg", "1 um"]]', (REED, SPRING), "waviness", "struck.*remove"),
        ('offset = ["0 mm", "1 mm"]', (REED, SPRING), "offset", "struck.*remove"),
        ("ports = 16", (MASS, SPRING), "ports", "struck.*remove"),
        ("ports = 16", (REED, LIP + 'arc = "90 deg"\n'), "ports", "struck.*part"),
        *(
            ("ports = 16", (REED, f'{LIP}model = "{model}"\n'), "ports", f"with model = '{model}' is struck as a whole")
            for model in ("3d", "sector", "rod", "harmonics")
        ),
        ('tilt = "1 deg"', (MASS, LIP + 'model = "3d"\n'), "tilt", "model = '3d'"),
        ('offset = ["1 mm", "0 mm"]', (MASS, LIP), "offset", "touches.*remove"),
        ("rings = 4", (MASS, SPRING), "rings", "'spring'"),
        ("rings = 17", (MASS,), "rings", "17"),
        (FILMED.replace('width = "1 mm", ', ""), ON_STIFF, "film", ".width: required"),
        (FILMED.replace('length = "34.56 mm", ', ""), ON_STIFF, "film", ".length: required"),
        (f"{OPEN}8\nrings = 3", (), "film", "across"),
        ('at = "5.9 mm"', (f'{BEAM}"12 mm"\n',), "at", "5.9 mm .*6 mm.*behind"),
    ],
)
def test_keys_that_do_not_fit(tmp_path: Path, contact: str, bodies: tuple[str, ...], key: str, words: str) -> None:
    message = refusal(scene_of, tmp_path, contact, *bodies)
    assert re.search(f"scene.toml:.*contact.{key}.*{words}", message)  # and the line


@pytest.mark.slow(only=("waves",))
@pytest.mark.parametrize(
    ("change", "contact", "words"),
    [
        (("", ""), 'offset = ["3 mm", "0 mm"]',
         ("contact.offset: [3 mm, 0 mm]", "limit: all", "reed has 8 mm", "change the")),
        (('"0.3 mm"', '"5 mm"\ngreens = { bandwidth = "300 kHz" }'), "",
         ("reed.thickness", "5 mm", "0.39", "limit 0.33", "to 217 kHz", "'cad' or 'mesh'")),
    ],
    ids=["reaches_off", "waves"],
)  # fmt: skip
def test_a_reed_that_does_not_fit_is_told_of_by_the_program(change, contact, words, tmp_path, capsys):
    scene_of(tmp_path, f'gap = "1 um"\n{contact}', FLAPPER.replace(*change) + LANDING)
    assert run_command(["run", str(tmp_path / "scene.toml"), "-o", str(tmp_path / "out")]) == 2
    out, said = capsys.readouterr()
    assert out == ""
    assert [part for part in words if part not in " ".join(said.split())] == []
    assert "Traceback" not in said
    assert not list(tmp_path.glob("out/*"))


def test_an_uneven_lip_has_arcs(tmp_path: Path) -> None:
    """A tilted, wavy or offset lip has arcs even under a rigid face, and no more than its rings allow; a seat whose
    stated model is in space keeps it, and has none."""
    assert scene_of(tmp_path, "", seat=LIP + 'model = "3d"\n').geometry.lip() is None
    assert scene_of(tmp_path, "").geometry.lip().arcs == 32
    for contact, arcs in (('tilt = "0.1 deg"', 32), ('waviness = [["0 deg", "1 um"]]\nrings = 16', 16)):
        lip = scene_of(tmp_path, contact, MASS).geometry.lip()
        assert lip.arcs == arcs
    assert scene_of(tmp_path, "", MASS).geometry.lip() is None
    disc = REED + 'contact_radius = "3 mm"\n'  # what touches if nothing is said of the lip
    assert scene_of(tmp_path, "", disc).geometry.lip() is None
    lip = scene_of(tmp_path, 'offset = ["0.5 mm", "0 mm"]', disc).geometry.lip()
    assert lip.arcs == 32


@pytest.mark.slow
def test_a_lip_over_a_hole_of_the_reed(tmp_path: Path) -> None:
    with pytest.raises(ModelError, match=r"contact\.offset: .*lip.* 5\.5 .*8 mm"):
        striker_of(scene_of(tmp_path, "", REED + 'hole_diameter = "11 mm"\n'))


@pytest.mark.parametrize(("at", "width", "share"), [(30, 12, "50 %"), (24, 5.5, "33 %")])
def test_a_note_says_how_much_of_the_lip_a_beam_covers(tmp_path: Path, at: float, width: float, share: str) -> None:
    """A beam of half the lip's mean diameter covers 2/pi asin(1/2) = 1/3 of its circle."""
    ((key, note),) = scene_of(tmp_path, f'at = "{at} mm"', f'{BEAM}"{width} mm"\n').geometry.cover_doubts()
    assert key == ("contact", "at")
    assert f"covers {share} of the lip, whose outer diameter is 12 mm" in note


def bent_into(folder: Path, contact: str) -> tuple[Scene, impact.ContactProblem]:
    """Return a flapper that starts bent towards the lip by 40 um."""
    reed = FLAPPER + 'greens = { bandwidth = "10 kHz" }\nrelease = { deflection = "-40 um" }\n'
    scene = scene_of(folder, f"ports = 16\n{contact}", reed)
    return scene, problem_of(scene, striker_of(scene, greens=None), impact.Body(bed(Division(16), 1e-9)))


def test_the_gap_that_is_asked_for_serves_and_no_less(tmp_path: Path) -> None:
    """A tilted lip that opens to 58 um, and a reed bent by 40 um: it stands deepest where the lip is nearest."""
    tilt = 'tilt = "0.3 deg"\ntilt_axis = "90 deg"\ngap = "{:.3f} um"'
    with pytest.raises(SceneError, match=r"contact\.gap: .*add ([\d.]+) um") as refused:
        bent_into(tmp_path, tilt.format(1))
    more = float(str(refused.value).partition(": add ")[2].partition(" um")[0])
    scene, problem = bent_into(tmp_path, tilt.format(1 + more + 0.01))
    greens, state = problem.striker.greens, problem.striker.state
    bent = greens.modal.shapes.T @ state.displacement
    openings = scene.geometry.gaps(Division(16))
    openings = openings + bent[[greens.port_index(contact.striker_port) for contact in problem.contacts]]
    assert openings.min() == pytest.approx(0.01e-6, abs=0.03e-6)
    with pytest.raises(SceneError, match="begin inside it"):
        bent_into(tmp_path, tilt.format(1 + 0.97 * more))
    law = 'gap = "1 um"\nlaw = { kind = "spring", stiffness = "20 N/um" }'  # which may begin compressed
    assert len(bent_into(tmp_path, law)[1].contacts) == 16


def struck(scene: Scene, arcs: int) -> Touches:
    return run_contacts(scene, striker_of(scene), bed(Division(arcs), STIFFNESS), DT)


@pytest.mark.slow
def test_the_film_of_a_lip_is_spread_over_its_arcs(tmp_path: Path) -> None:
    scene = scene_of(tmp_path, f"{OPEN}8")
    contacts = problem_of(scene, striker_of(scene), impact.Body(bed(Division(8), STIFFNESS))).contacts
    films = [contact.film for contact in contacts if contact.film is not None]
    assert len(films) == 8
    assert sum(film.coefficient for film in films) == pytest.approx(18e-6 * 2 * math.pi * 5.5e-3 * 1e-9)
    assert sum(film.tension for film in films) == pytest.approx(1e5 * 2 * math.pi * 5.5e-3 * 1e-3)
    assert {film.floor for film in films} == {1e-6}


def test_a_mass_is_stopped_by_the_momentum_of_its_film(tmp_path: Path) -> None:
    """The mass stops at k/2 (1/(g + f)^2 - 1/(g0 + f)^2) = m v; a coefficient 3 % off moves the place by 1.5 %."""
    scene = scene_of(tmp_path, FILMED, *ON_STIFF)
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
    many, one = (struck(scene_of(tmp_path, f"{OPEN}{n}", mass(1, "-1 m/s")), n) for n in (8, 1))
    size = impact.measures.film_force_peak(one.seat)
    assert size > 10.0
    np.testing.assert_allclose(many.seat.force, one.seat.force, atol=1e-9 * size)
    np.testing.assert_allclose(many.seat.film, one.seat.film, atol=1e-9 * size)
    np.testing.assert_allclose(many.line.film.sum(axis=1), many.seat.film, atol=1e-9)
    turning, even = (impact.measures.film_force_peak(struck(scene_of(tmp_path, f"{OPEN}{n}"), n).seat) for n in (8, 1))
    assert turning < 0.5 * even


def test_tilt_within_an_arc_raises_its_floor(tmp_path: Path) -> None:
    """The floor rises by half the range of R tan(tilt) sin(angle) over the corners of the arc, on both rims."""
    scene = scene_of(tmp_path, f'{OPEN}8\ntilt = "0.1 deg"')
    films = scene.geometry.films(Division(8))
    slope = math.tan(math.radians(0.1))
    rise = 6e-3 * slope * math.sin(math.pi / 4)
    assert films[0].floor == pytest.approx(1e-6 + rise / 2, rel=3e-3)
    assert films[2].floor == pytest.approx(1e-6 + slope * (6e-3 - 5e-3 * math.sin(math.pi / 4)) / 2, rel=3e-3)
