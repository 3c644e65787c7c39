"""The drawing of a scene: outlines in numbers, labels in the picture, for all examples and every kind of body."""

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from seatfem.structures.outlines import BodyViews, covered_share, crossings, draw_beam
from seatfem.structures.shapes.loops import inside
from seatfem.study.impacts.layout import cover_note, draw_scene, facts_of, layout_of
from tests.steps import Division, Scene, SceneError, kinds_of, load_scene

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted(path.stem for path in (ROOT / "examples").glob("*.toml") if not path.stem.endswith("_study"))
SAID = {
    "compressor_cycle": ("stopper 2 mm", "spring 50 N/um", "pressure of the gas, suction valve, port Ø 12 mm"),
    "cad_assembly": ("gap 20 um", "22 mm", "t 0.3 mm", "struck face 10.4 mm x 10.4 mm"),
    "flapper_between_stops": ("stopper 0.8 mm", "start 1 mm", "pressure 0 to 15 kPa"),
    "flapper_on_annular_seat": ("port Ø 8 mm", "lip 1 mm wide", "lip 0.5 mm high", "25.4 mm", "released from 1 mm"),
    "flapper_on_stopper": ("struck Ø 4 mm", "Ø 12 mm"),
    "kidney_landing": ("contact in 32 segments", "22.42 mm", "stopper contact in 16 segments, tilted 0.1°"),
    "life_of_a_flapper": ("gap 0.2 mm", "start in mode 1, velocity 2 m/s", "t 0.3 mm"),
    "mass_on_bar": ("60 mm", "5 mm", "bodies with a wavy break are shortened"),
    "ring_valve": ("gap 1 mm", "4 valve springs, 2 N/mm together, preload 4 N", "pressure -60 kPa to 0 on 236 mm²"),
    "slot_landing": ("contact in 48 segments", "about the direction 90°"),
    "suction_flapper": ("pressure -1000 kPa to 32 kPa on 60 to 95 mm²", "gravity 9.81 m/s^2"),
    "suction_valve": ("port Ø 9 mm", "34 mm", "12 mm", "t 0.3 mm", "stopper 1.5 mm", "reed x 5"),
    "tilted_landing": ("contact in 96 segments", "gap x 2000", "lip 1 mm wide"),
}
"""Of examples, what stands in the picture among other words."""


def example(name: str, **changed: object) -> Scene:
    return load_scene(
        ROOT / "examples" / f"{name}.toml", {key.replace("__", "."): each for key, each in changed.items()}
    )


@pytest.mark.slow(but="mass_on_bar")
@pytest.mark.parametrize("name", EXAMPLES)
def test_every_example_is_drawn_with_its_sizes(name: str, tmp_path: Path) -> None:
    layout = draw_scene(example(name), tmp_path / "drawing.svg")
    texts = re.findall(r"<text.*?</text>", (tmp_path / "drawing.svg").read_text(encoding="utf-8"), re.DOTALL)
    said = " ".join(re.sub(r"<[^>]+>", "", each) for each in texts)  # notes may be wrapped
    title = "Section A–A along the reed through the contact"
    expected = (title, "Plan, seen from above", "contact face", *SAID.get(name, ()))
    assert [words for words in expected if words not in said] == [], said
    assert [path.name for path in tmp_path.iterdir()] == ["drawing.svg"]
    if layout.reed.section:  # it lies above the seat, by the gap and no more
        heights = np.concatenate(layout.reed.section)[:, 1]
        assert heights.min() == pytest.approx(layout.gap, abs=1e-9)
        assert heights.max() > layout.gap
    if layout.seat.section:
        assert np.concatenate(layout.seat.section)[:, 1].max() == pytest.approx(0.0, abs=1e-6)


def test_the_suction_valve_in_numbers() -> None:
    layout = layout_of(example("suction_valve"))
    assert facts_of(layout) == (
        "reed (cantilever) 34 x 12 x 0.3 mm over a lip of 9.2 to 10.8 mm diameter, gap 0 mm, stopper at 1.5 mm "
        "(spring 10 N/um); pressure -900 kPa to 26 kPa on 80 mm² (suction_valve.csv): -72 N to 2.08 N on the "
        "closed reed, positive off its seat"
    )
    assert cover_note(layout) == ""
    assert "covers 50 %" in cover_note(layout_of(example("suction_valve", contact__at="34 mm")))
    sizes = {size.text: size.value for size in layout.seat.sizes}
    assert sizes["port Ø 9 mm"] == pytest.approx(9e-3)
    assert sizes["lip 1 mm wide"] == pytest.approx(1e-3)
    assert sizes["lip 0.5 mm high"] == pytest.approx(0.5e-3)
    assert sizes["8.5 mm"] == pytest.approx(8.5e-3)
    # cut: two halves from the bore to the rim, below the struck face
    assert crossings(layout.seat.section, -4e-3) == pytest.approx([-12e-3, -4.5e-3, 4.5e-3, 12e-3], abs=1e-9)
    assert crossings(layout.seat.section, -0.2e-3) == pytest.approx([-5.5e-3, -4.5e-3, 4.5e-3, 5.5e-3], abs=1e-9)
    # reed: from its clamp to its tip, 6 mm beyond the port's middle
    assert np.concatenate(layout.reed.plan).min(axis=0) == pytest.approx([-28e-3, -6e-3])
    assert np.concatenate(layout.reed.plan).max(axis=0) == pytest.approx([6e-3, 6e-3])
    assert layout.bodies["stopper"].origin[2] == pytest.approx(1.8e-3)


def test_a_flapper_lies_on_the_middle_of_its_port() -> None:
    layout = layout_of(example("tilted_landing"))
    outline, face = layout.reed.plan, layout.seat.contact
    assert inside(outline, np.concatenate(face)).all()
    (clamp,) = layout.reed.clamp
    assert sorted(clamp.tolist()) == pytest.approx(np.array([(-22.416e-3, -4e-3), (-22.416e-3, 4e-3)]), abs=1e-6)
    assert len(layout.arcs) == 96
    assert np.hypot(*layout.arcs[:, 0].T) == pytest.approx(5e-3)
    (tilt,) = layout.tilts
    assert (tilt.role, tilt.angle, tilt.axis) == ("seat", pytest.approx(math.radians(0.3)), 0.0)
    assert tilt.nearest == pytest.approx([0.0, -6e-3], abs=1e-4)  # the height rises with y
    assert len(layout_of(example("tilted_landing"), Division(16, 3)).arcs) == 16  # as a plan chose them


def test_the_tilt_of_a_stopper_is_drawn(tmp_path: Path) -> None:
    """The drawing has the tilt's axis and a dot where the reed is met first, on the other side for minus."""
    for degrees, side in ((0.1, -1), (-0.1, 1)):
        *_, tilt = layout_of(example("kidney_landing", stopper__tilt=f"{degrees} deg")).tilts
        assert (tilt.role, tilt.angle) == ("stopper", pytest.approx(math.radians(degrees)))
        across = np.array([-math.sin(tilt.axis), math.cos(tilt.axis)])
        assert side * (tilt.nearest @ across) == pytest.approx((side * tilt.corners @ across).max())
        assert side * (tilt.nearest @ across) > 0.5e-3
    draw_scene(example("kidney_landing"), tmp_path / "tilted.svg")
    assert "stopper, its axis of tilt" in (tmp_path / "tilted.svg").read_text(encoding="utf-8")


@pytest.mark.slow
def test_a_mesh_is_cut_as_the_seat_that_it_was_made_of() -> None:
    """meshes/annular_seat.msh is a seat of 4 mm bore: both sections enclose the same places."""
    drawn = layout_of(example("flapper_on_annular_seat")).seat
    meshed = layout_of(example("mass_on_meshed_seat")).seat
    x, z = np.linspace(-12.9e-3, 13.1e-3, 53), np.linspace(-8.9e-3, 0.33e-3, 30)  # no corner among them
    points = np.stack(np.meshgrid(x, z), axis=-1).reshape(-1, 2)
    clear = np.abs(np.abs(points[:, 0]) - 4e-3) > 0.2e-3  # its bore is in chords
    assert (inside(meshed.section, points) == inside(drawn.section, points))[clear].all()
    assert np.concatenate(meshed.held)[:, 1] == pytest.approx(-8.5e-3)
    radii = np.hypot(*np.concatenate(meshed.contact).T)
    assert (radii.min(), radii.max()) == pytest.approx((4.1e-3, 4.9e-3), rel=1e-3)


def test_a_part_that_is_struck_from_below_is_drawn_upside_down(tmp_path: Path) -> None:
    """Its underside is a face like another: the drawing shows it on top, and says so."""
    file = (ROOT / "meshes" / "valve_body.step").as_posix()
    text = (
        f'[seat]\nkind = "cad"\nfile = "{file}"\ncontact = {{ number = 8 }}\nfixed = {{ number = 11 }}\n'
        'material = "steel"\n[reed]\nkind = "rigid_mass"\nmass = "1 g"\nvelocity = "-1 m/s"\n[run]\nduration = "1 ms"\n'
    )
    (tmp_path / "scene.toml").write_text(text, encoding="utf-8")
    layout = layout_of(load_scene(tmp_path / "scene.toml"))
    assert "upside down" in layout.notes[0]
    bore = crossings(layout_of(example("flapper_on_valve_body")).seat.section, -3e-3)
    assert bore == pytest.approx([-10e-3, -4e-3, 4e-3, 10e-3], rel=0.01)
    boss = crossings(layout.seat.section, -11e-3)
    assert (boss.min(), boss.max()) == pytest.approx((-10e-3, 10e-3), rel=0.01)


def test_the_share_below_a_reed() -> None:
    """A ring of 4 to 5 mm below a beam as wide as its bore, up to the middle, is covered by asin(2/4.5)/pi."""
    seat = layout_of(example("flapper_on_annular_seat")).seat
    reed = draw_beam("beam", ((0.0, 4e-3), (20e-3, 4e-3)), 0.3e-3, 20e-3).turned_over()
    mean = math.asin(2 / 4.5) / math.pi
    assert covered_share(seat, reed, (0.0, 0.0)) == pytest.approx(mean, rel=0.05)
    assert covered_share(seat, reed, (10e-3, 0.0)) == 0.0
    assert covered_share(seat, BodyViews("spring", symbol="spring"), (0.0, 0.0)) is None


@pytest.mark.parametrize("kind", [kind for kind in kinds_of() if kind.__module__.startswith("seatfem.")], ids=str)
def test_every_kind_has_views_of_its_own_or_a_symbol(kind: Any) -> None:
    assert "views" in {name for base in kind.__mro__[:-1] for name in vars(base)}


def test_a_reed_beside_the_port_is_refused() -> None:
    narrow = example("suction_valve", reed__width="0.5 mm")
    with pytest.raises(SceneError, match=r"contact.at: 28 mm: .*3.5 % .*limit: 10 %.*34 x 0.5 mm.*wider"):
        draw_scene(narrow, Path("never.png"))
    beside = example("tilted_landing", contact__offset=["6 mm", "0 mm"])
    with pytest.raises(SceneError, match=r"contact.offset: \[6 mm, 0 mm\]: .*limit: .*offset"):
        draw_scene(beside, Path("never.png"))
    small = example("tilted_landing", reed__paddle_diameter="9 mm")
    with pytest.raises(SceneError, match=r"contact.offset: .*18 % .*6 mm .*4.5 mm"):
        draw_scene(small, Path("never.png"))


def test_a_contact_on_what_holds_the_seat_is_refused() -> None:
    """A contact on the underside, which rests on its joint, or on faces of both sides is refused."""
    with pytest.raises(SceneError, match=r"seat.contact: .*valve_body.step:.*'underside'"):
        draw_scene(example("flapper_on_valve_body", seat__contact={"number": 8}), Path("never.png"))
    faces = {"of": [{"number": 11}, {"number": 8}]}
    with pytest.raises(SceneError, match=r"seat.contact: .*opposite sides"):
        draw_scene(example("flapper_on_valve_body", seat__contact=faces, seat__supports=None), Path("never.png"))
