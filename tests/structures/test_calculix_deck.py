"""Decks for CalculiX: the same mesh, loads and supports, by what ccx answers."""

import re
from pathlib import Path

import numpy as np
import pytest
import skfem

from benchmarks.peers import calculix
from seatfem.faces.cli import BAD_INPUT, DONE, run_command
from seatfem.structures.finite_elements import static_greens
from seatfem.structures.formats.calculix_deck import calculix_body
from seatfem.structures.model import ModelError, SecondOrderModel
from tests.solids import Material, Orthotropic, assemble, assemble_axisymmetric, read_mesh, solve_modes

STEEL = Material(200e9, 0.3, 7850.0)
WOOD = Orthotropic((9e9, 1e9, 5e9), (0.3, 0.25, 0.03), (0.8e9, 0.7e9, 0.9e9), 600.0, ((0, 1, 0), (0, 0, 1), (1, 0, 0)))
SIDES = (8e-3, 6e-3, 4e-3)
here = pytest.mark.skipif(bool(calculix.absent()), reason=calculix.absent())


def block(kind: type = skfem.MeshTet, material: Material | Orthotropic = STEEL, copies: int = 1) -> SecondOrderModel:
    """Return a block clamped below, pushed above; or the half of one that is twice as long."""
    mesh = kind.init_tensor(*(np.linspace(0, side, n + 1) for side, n in zip(SIDES, (3, 2, 2), strict=True)))
    named = {"contact": lambda x: x[2] > SIDES[2] - 1e-9, "fixed": lambda x: x[2] < 1e-9, "cut": lambda x: x[0] < 1e-9}
    cut = ("cut",) if copies > 1 else ()
    return assemble(mesh.with_boundaries(named), material, order=2, sliding=cut, copies=copies)


def ring() -> SecondOrderModel:
    """Return the half section of one, clamped below, pushed above."""
    mesh = skfem.MeshTri.init_tensor(np.linspace(2e-3, 5e-3, 4), np.linspace(0, 4e-3, 5))
    named = {"contact": lambda x: x[1] > 4e-3 - 1e-9, "fixed": lambda x: x[1] < 1e-9}
    return assemble_axisymmetric(mesh.with_boundaries(named), STEEL, order=2)


def test_the_loads_are_those_of_the_port() -> None:
    """The deck's loads are the port's forces on its nodes, in its order."""
    for model, axis in ((block(), 2), (ring(), 2)):
        deck, [port] = calculix_body(model, STEEL), model.ports.values()
        of_port = model.expand(port.vector)[axis][: len(deck.loads)]
        np.testing.assert_allclose(deck.loads[:, deck.axis - 1], of_port, atol=1e-12 * of_port.max())


@here
@pytest.mark.parametrize(
    ("model", "material", "element", "apart"),
    [
        (block(), STEEL, "C3D10", 4e-3),
        (block(material=WOOD), WOOD, "C3D10", 4e-3),
        (block(skfem.MeshHex), STEEL, "C3D20", 1e-2),
        (ring(), STEEL, "CAX6", 6e-3),
    ],
    ids=["tetrahedra", "orthotropic", "hexahedra", "triangles"],
)
def test_frequencies(model: SecondOrderModel, material: Material, element: str, apart: float) -> None:
    """CalculiX's frequencies agree within what its fewer points leave on coarse meshes; 3 % of modulus are 1.5 %."""
    deck = calculix_body(model, material)
    assert deck.element == element
    text, _ = calculix.run([*deck.lines, *deck.frequency(5)])
    assert np.abs(calculix.frequencies_in(text, 5) / solve_modes(model, 5).frequencies_hz - 1).max() < apart


@here
@pytest.mark.parametrize(
    ("model", "copies"), [(block(), 1), (block(copies=2), 2), (ring(), 1)], ids=["whole", "half", "section"]
)
def test_the_patch_gives_way_as_ours(model: SecondOrderModel, copies: int) -> None:
    """Straight tetrahedra of ten nodes and triangles of six have the same stiffness: what is left is what it prints."""
    deck = calculix_body(model, STEEL, copies=copies)
    text, _ = calculix.run([*deck.lines, *deck.static()])
    _, [moved] = calculix.course_in(text, "displacements", "PATCH")
    assert moved[deck.axis - 1] == pytest.approx(static_greens(model, 0.0).static_compliance()[0, 0], rel=1e-4)


def test_the_deck_is_a_mesh_again(tmp_path: Path) -> None:
    """Read as any other Abaqus file: coordinates have twelve digits."""
    model = block()
    deck = tmp_path / "mesh.inp"
    deck.write_text("\n".join(calculix_body(model, STEEL).lines) + "\n", encoding="ascii")
    read = read_mesh(deck, contact="STRUCK", fixed="HELD1")
    assert read.order == 2
    assert read.mesh.t.shape == model.dofs.mesh.t.shape  # type: ignore[attr-defined]
    assert read.quality.volume == pytest.approx(np.prod(SIDES), rel=1e-11)
    for patch, height in (("contact", SIDES[2]), ("fixed", 0.0)):
        assert read.quality.areas[patch] == pytest.approx(SIDES[0] * SIDES[1], rel=1e-11)
        np.testing.assert_allclose(read.mesh.p[2, read.mesh.facets[:, read.mesh.boundaries[patch]]], height, atol=1e-14)


def test_what_decks_do_not_hold() -> None:
    bare = SecondOrderModel(np.eye(2), None, np.eye(2), {"contact": np.array([1.0, 0.0])})  # type: ignore[arg-type]
    with pytest.raises(ModelError, match="on a mesh of solids"):
        calculix_body(bare, STEEL)
    mesh = skfem.MeshTet().refined().with_boundaries({"contact": lambda x: x[2] > 0.9, "fixed": lambda x: x[2] < 0.1})
    with pytest.raises(ModelError, match=r"mesh\.order = 2"):
        calculix_body(assemble(mesh, STEEL, order=1), STEEL)


SCENE = """
seat = { kind = "bar", length = "8 mm", width = "6 mm", height = "4 mm", material = "steel", model = "3d", \
    mesh = { size = "4 mm", contact_size = "4 mm" }, greens = { bandwidth = "100 kHz", tolerance = "5 %" } }
reed = { kind = "rigid_mass", mass = "5 g", velocity = "-1 m/s" }
contact = { law = { kind = "spring", stiffness = "1 N/um" } }
run = { duration = "1 ms", filter_width = "10 us" }
accuracy = { target = "30 %" }
"""


@pytest.mark.slow
@here
def test_the_verb_writes_decks_that_run_and_our_answers(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "bar.toml").write_text(SCENE, encoding="utf-8")
    deck = tmp_path / "deck"
    assert run_command(["export", str(tmp_path / "bar.toml"), "--to", "calculix", "-o", str(deck)]) == DONE
    output = capfd.readouterr().out
    assert f"wrote {deck / 'static.inp'}" in output
    assert "note: no contact.inp: reed.kind = 'rigid_mass'" in output
    assert not (deck / "contact.inp").exists()
    mesh = (deck / "mesh.inp").read_text(encoding="ascii")
    include = "*INCLUDE, INPUT=mesh.inp\n"
    text, _ = calculix.run([(deck / "frequency.inp").read_text(encoding="ascii").replace(include, mesh)])
    ours = np.loadtxt(deck / "frequency.csv", delimiter=",", skiprows=1)[:5, 1]
    assert np.abs(calculix.frequencies_in(text, 5) / ours - 1).max() < 1e-2
    text, _ = calculix.run([(deck / "static.inp").read_text(encoding="ascii").replace(include, mesh)])
    _, [moved] = calculix.course_in(text, "displacements", "PATCH")
    assert moved[2] == pytest.approx(np.loadtxt(deck / "static.csv", skiprows=1), rel=1e-4)
    assert "C3D10" in (deck / "README.txt").read_text(encoding="utf-8")


LANDING = """
seat = { kind = "annular", bore_radius = "2 mm", lip_width = "1 mm", lip_edge_radius = "0 mm", lip_height = "0 mm", \
    outer_radius = "4 mm", thickness = "2 mm", material = "steel", mesh = { size = "4 mm", contact_size = "2 mm" }, \
    greens = { bandwidth = "100 kHz", tolerance = "5 %" } }
reed = { kind = "sheet", outline = [["0 mm", "-4 mm"], ["15 mm", "-4 mm"], ["15 mm", "4 mm"], ["0 mm", "4 mm"]], \
    clamped = [["0 mm", "-4 mm"], ["0 mm", "4 mm"]], contact_at = ["11 mm", "0 mm"], thickness = "0.5 mm", \
    material = { young = "206 GPa", poisson = 0.3, density = "7800 kg/m^3" }, mesh = { size = "2 mm" }, \
    release = { mode = 1, velocity = "-2 m/s" } }
contact = { gap = "1 um", tilt = "0.1 deg", ports = 16, rings = 2, law = { kind = "spring", stiffness = "20 N/um" } }
run = { duration = "20 us", filter_width = "20 us" }
accuracy = { target = "30 %" }
"""


def exported(scene: str, folder: Path) -> Path:
    """Return the folder of a scene's decks."""
    (folder / "scene.toml").write_text(scene, encoding="utf-8")
    deck = folder / "deck"
    assert run_command(["export", str(folder / "scene.toml"), "--to", "calculix", "-o", str(deck), "--quiet"]) == DONE
    return deck


@here
@pytest.mark.slow
def test_a_reed_lands_tilted(tmp_path: Path) -> None:
    """CalculiX's whole seat is struck like the run's half section; its C3D20R of 2 mm are 1 % too stiff."""
    deck = exported(LANDING, tmp_path)
    assert "CAX6" in (deck / "README.txt").read_text(encoding="utf-8")
    lines = (deck / "contact.inp").read_text(encoding="ascii").splitlines()
    assert lines[0] == "*INCLUDE, INPUT=whole.inp"
    text, _ = calculix.run([(deck / "whole.inp").read_text(encoding="ascii"), *lines[1:]])
    times, theirs = calculix.contact_force_in(text)
    time, ours = np.loadtxt(deck / "contact.csv", delimiter=",", skiprows=1).T
    np.testing.assert_allclose(times, time[1:], rtol=1e-6)
    dt, both = time[1], np.stack([ours[1:], theirs])
    assert dt * both[1].sum() == pytest.approx(dt * both[0].sum(), rel=0.015)
    smooth = [np.convolve(force, np.full(10, 0.1)) for force in both]  # means over 5 us
    assert np.abs(smooth[1] - smooth[0]).max() < 0.04 * smooth[0].max()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('gap = "1 um"', 'gap = "1 mm"', "within run.duration|so soon"),
        ('kind = "sheet"', 'kind = "sheet", pressure = "-1 bar"', "reed"),
        ("ports =", 'waviness = [["0 deg", "0 um"], ["180 deg", "1 um"]], ports =', "contact.waviness"),
        ('law = { kind = "spring", stiffness = "20 N/um" }', 'law = "signorini"', "'signorini'.*stiffness"),
    ],
    ids=["away", "loaded", "wavy", "rigid"],
)
def test_landings_that_no_deck_holds(tmp_path: Path, old: str, new: str, words: str) -> None:
    deck = exported(LANDING.replace(old, new), tmp_path)
    assert re.search(words, (deck / "README.txt").read_text(encoding="utf-8"))
    assert not {"contact.inp", "whole.inp"} & {path.name for path in deck.iterdir()}


@pytest.mark.slow
def test_a_deck_begins_just_before_the_first_touch(tmp_path: Path) -> None:
    """Let go at 10 um, the reed is 1 um below its middle position after acos(-0.1)/w of its first mode, at w 10 um; the
    higher modes of the static shape take some per cent."""
    release = 'release = { deflection = "10 um" }'
    scene = LANDING.replace('release = { mode = 1, velocity = "-2 m/s" }', release).replace('tilt = "0.1 deg", ', "")
    deck = exported(scene.replace('duration = "20 us"', 'duration = "0.3 ms"'), tmp_path)
    start = float((deck / "README.txt").read_text(encoding="utf-8").split("Pa/m, from ")[1].split(" s ")[0])
    omega = 2 * np.pi * 1889.5
    assert start == pytest.approx(np.arccos(-0.1) / omega, rel=0.05)
    block = (deck / "contact.inp").read_text(encoding="ascii").split("TYPE=VELOCITY\n")[1].split("*")[0]
    rates = np.array([line.split(",")[2] for line in block.splitlines() if line.split(",")[1] == "3"], dtype=float)
    tip = 15 / 11  # further out than the contact, where the mode moves about this much more
    assert rates.min() == pytest.approx(-(tip**1.5) * omega * 10e-6, rel=0.15)


def test_a_seat_without_elements_has_no_deck(tmp_path: Path) -> None:
    scene = tmp_path / "bar.toml"
    scene.write_text(SCENE.replace('kind = "bar"', 'kind = "rod"'), encoding="utf-8")
    assert run_command(["export", str(scene), "--to", "calculix", "-o", str(tmp_path / "deck")]) == BAD_INPUT
