"""Outlines in DXF files: curves of every kind, units, files that have none; and outlines written and read back."""

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import ezdxf
import numpy as np
import pytest

from seatfem.faces.cli import BAD_INPUT, run_command
from seatfem.structures.errors import GeometryError
from seatfem.structures.formats.dxf import read_outline, write_outline
from seatfem.structures.shapes import Flat, loops
from seatfem.structures.shapes.flat import Disc, Flapper, RingPlate
from seatfem.structures.shapes.outlined import Outlined
from tests.bounded import bounded

HEAD = "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n{}\n0\nENDSEC\n"
Draw = Callable[[Any], object]
"""What draws into a layout of ezdxf."""


def entity(name: str, *groups: tuple[int, float]) -> str:
    return f"0\n{name}\n8\n0\n" + "".join(f"{code}\n{value}\n" for code, value in groups)


def line(*ends: float) -> str:
    return entity("LINE", *zip((10, 20, 11, 21), ends, strict=True))


def written(path: Path, *entities: str, unit: int | str = 4) -> Path:
    """Write a drawing as the oldest programs do, without versions and tables."""
    text = f"{HEAD.format(unit)}0\nSECTION\n2\nENTITIES\n{''.join(entities)}0\nENDSEC\n0\nEOF\n"
    path.write_text(text, encoding="utf-8")
    return path


def drawn(path: Path, *draw: Draw, unit: int = 4) -> Path:
    drawing = ezdxf.new(units=unit)
    for each in draw:
        each(drawing.modelspace())
    drawing.saveas(path)
    return path


STADIUM = 20e-3 * 6e-3 + math.pi * 9e-6  # m^2
STRAIGHT = line(0, -3, 20, -3), line(20, 3, 0, 3)
ARCS = (
    entity("ARC", (10, 20), (20, 0), (40, 3), (50, 270), (51, 90)),
    entity("ARC", (10, 0), (20, 0), (40, 3), (50, 90), (51, 270)),
)
CORNERS = [(0, -3, 0), (20, -3, 1), (20, 3, 0), (0, 3, 1)]
LWPOLYLINE: Draw = lambda space: space.add_lwpolyline(CORNERS, "xyb", close=True)  # noqa: E731
FROM_BELOW: Draw = lambda space: space.add_lwpolyline(  # noqa: E731
    [(-x, y, -bulge) for x, y, bulge in CORNERS], "xyb", close=True, dxfattribs={"extrusion": (0, 0, -1)}
)
POLYLINE: Draw = lambda space: space.add_polyline2d(CORNERS, "xyb", close=True)  # noqa: E731
CIRCLE: Draw = lambda space: space.add_circle((5, 0), 2)  # noqa: E731


def block(space: Any, name: str = "B") -> None:
    """Insert the stadium as the block of a block, moved, turned and twice as large."""
    inner, outer = space.doc.blocks.new("A"), space.doc.blocks.new(name)
    LWPOLYLINE(inner)
    outer.add_blockref("A", (3, 1), dxfattribs={"rotation": 90})
    outer.add_text("a part")
    space.add_blockref(name, (9, 9), dxfattribs={"xscale": 2, "yscale": 2})


@pytest.mark.parametrize("entities", [(*STRAIGHT, *ARCS), (ARCS[1], STRAIGHT[1], ARCS[0], STRAIGHT[0])])
def test_a_stadium(entities: tuple[str, ...], tmp_path: Path) -> None:
    """Lines and arcs in any order and direction are one outline, texts are none."""
    (outline,) = read_outline(written(tmp_path / "a.dxf", *entities, entity("TEXT", (10, 1), (20, 1), (40, 1))))
    assert abs(loops.area(outline)) == pytest.approx(STADIUM, rel=1e-12)
    assert np.ptp(loops.polygon(outline)[0], axis=0) == pytest.approx((26e-3, 6e-3), rel=1e-9)
    assert len(outline) == 4


@pytest.mark.parametrize(
    ("draw", "times"),
    [(LWPOLYLINE, 1), (FROM_BELOW, 1), (POLYLINE, 1), (block, 4)],
    ids=["lw", "below", "old", "block"],
)
def test_polylines_and_blocks(draw: Draw, times: float, tmp_path: Path) -> None:
    """Polylines of both kinds, from above and below, and those in blocks keep their arcs."""
    (outline,) = read_outline(drawn(tmp_path / "a.dxf", draw))
    assert len(outline) == 4
    assert abs(loops.area(outline)) == pytest.approx(times * STADIUM, rel=1e-12)
    if draw is not block:
        assert outline[:, 0].min() == pytest.approx(0.0, abs=1e-15)


def test_splines_and_ellipses(tmp_path: Path) -> None:
    """The areas of an ellipse, of a circle squeezed with its block and of a spline of chords are right to 5e-4."""

    def squeezed(space: Any) -> None:
        CIRCLE(space.doc.blocks.new("C"))
        space.add_blockref("C", (100, 0), dxfattribs={"yscale": 0.5, "zscale": 0})

    def splines(space: Any) -> None:
        points = [(200 + 3 * math.cos(a), 3 * math.sin(a)) for a in np.linspace(0, math.tau, 41)]
        space.add_spline(points)

    ellipse: Draw = lambda space: space.add_ellipse((0, 0), (0, 9), 0.4)  # noqa: E731
    outlines = read_outline(drawn(tmp_path / "a.dxf", ellipse, squeezed, splines))
    areas = [abs(loops.area(loop)) * 1e6 for loop in outlines]
    assert areas == pytest.approx([math.pi * 9 * 3.6, math.pi * 9, math.pi * 2], rel=5e-4)
    assert max(map(len, outlines)) < 200


def test_inner_loops_come_after_the_outline(tmp_path: Path) -> None:
    """Holes come last, in whatever order they are drawn; an array of blocks counts as often as it is inserted."""

    def holes(space: Any) -> None:
        space.doc.blocks.new("H").add_circle((0, 0), 0.5)
        space.add_blockref("H", (2, 0), dxfattribs={"column_count": 3, "column_spacing": 4})

    outline, *inner = read_outline(drawn(tmp_path / "a.dxf", holes, LWPOLYLINE))
    assert abs(loops.area(outline)) == pytest.approx(STADIUM, rel=1e-12)
    assert [abs(loops.area(each)) for each in inner] == pytest.approx([math.pi * 0.25e-6] * 3, rel=1e-12)
    assert sorted(float(each[:, 0].mean()) for each in inner) == pytest.approx([2e-3, 6e-3, 10e-3])


def test_a_circle_and_units(tmp_path: Path) -> None:
    """The header's unit counts where the scene states none."""
    (inches,) = read_outline(drawn(tmp_path / "a.dxf", CIRCLE, unit=1))
    assert np.ptp(loops.polygon(inches)[0], axis=0) == pytest.approx((4 * 0.0254, 4 * 0.0254))
    (stated,) = read_outline(drawn(tmp_path / "a.dxf", CIRCLE, unit=0), 1e-3)
    assert np.mean(stated[:, :2], axis=0) == pytest.approx((5e-3, 0.0))
    assert loops.area(stated) == pytest.approx(math.pi * 4e-6, rel=1e-12)


@pytest.mark.parametrize(
    ("entities", "unit", "message"),
    [
        ((), 4, "LINE, ARC, CIRCLE, LWPOLYLINE"),
        (STRAIGHT, 4, r"\(20, -3\)"),
        ((*STRAIGHT, ARCS[0]), 4, "its outline is open at"),
        ((entity("ARC", (10, 0), (20, 0), (40, 3)),), 4, "ARC.*start_angle"),
        ((entity("NOVELTY"),), 4, "a NOVELTY.*convert it"),
        ((entity("INSERT", (2, "B"), (10, 0), (20, 0)),), 4, "block 'B' is not in the file.*explode"),  # type: ignore[arg-type]
        (tuple(line(k, 0, k + 1, 0) for k in range(5001)), 4, "10000 corners"),
        (("0\nPOINT\n" * 20_001,), 4, "more than 20000 entities"),
        ((*STRAIGHT, *ARCS), "²", "line: 8"),
        ((*STRAIGHT, *ARCS), 0, 'unit = "mm"'),
    ],
)
def test_what_is_no_outline_is_refused(
    entities: tuple[str, ...], unit: int | str, message: str, tmp_path: Path
) -> None:
    with pytest.raises(GeometryError, match=message):
        read_outline(written(tmp_path / "a.dxf", *entities, unit=unit))


def nested(space: Any) -> None:
    """Insert blocks of ten blocks each, eight deep."""
    for depth in range(8):
        inner = space.doc.blocks.new(f"B{depth}")
        for _ in range(10 * (depth > 0)):
            inner.add_blockref(f"B{depth - 1}", (0, 0))
    space.add_blockref("B7", (0, 0))


def of_itself(space: Any) -> None:
    space.doc.blocks.new("B").add_blockref("B", (1, 0))
    space.add_blockref("B", (0, 0))


def array(space: Any) -> None:
    LWPOLYLINE(space.doc.blocks.new("B"))
    space.add_blockref("B", (0, 0), dxfattribs={"column_count": 30_000, "row_count": 30_000, "row_spacing": 9})


def outside(space: Any) -> None:
    space.doc.add_xref_def("/etc/other.dxf", "X")
    space.add_blockref("X", (0, 0))


@pytest.mark.parametrize(
    ("draw", "message"),
    [
        (lambda space: space.add_3dface([(0, 0), (1, 0), (1, 1), (0, 1)]), "a 3DFACE.*convert it"),
        (nested, "more than 20000 entities with those of its blocks"),
        (of_itself, "block 'B' .*in 16 others"),
        (array, "block 'B' .*in a large array"),
        (outside, "block 'X' is not in the file"),
    ],
)
def test_drawings_that_stand_for_much_or_for_nothing(draw: Draw, message: str, tmp_path: Path) -> None:
    """What would take long, or lies outside of the plane or of the file, is refused within seconds."""
    drawn(tmp_path / "a.dxf", draw)
    with bounded(5.0), pytest.raises(GeometryError, match=message):
        read_outline(tmp_path / "a.dxf")


@pytest.mark.parametrize(
    ("data", "message"),
    [(b"AutoCAD Binary DXF\r\n\x1a", "no DXF.*as ASCII"), (b"0\nSECTION\n2\nENTITIES\n0\nLINE\n10\n", "not readable")],
)
def test_what_is_no_dxf_is_refused(data: bytes, message: str, tmp_path: Path) -> None:
    (tmp_path / "a.dxf").write_bytes(data)
    with pytest.raises(GeometryError, match=message):
        read_outline(tmp_path / "a.dxf")


SCENE = """
seat = { kind = "spring", stiffness = "1 N/um" }
reed = { kind = "rigid_mass", mass = "1 g", velocity = "-1 m/s" }
run = { duration = "1 ms" }
"""
REED = Flapper(8e-3, 2e-3, 6e-3, 15e-3, 16e-3, 0.3e-3, slot_width=1e-3, slot_length=6e-3, hole_diameter=4e-3)
HOLED = Outlined(((0, -5e-3), (20e-3, -5e-3, 1), (20e-3, 5e-3), (0, 5e-3)), 4e-4, (15e-3, 0), side=(-1, 0, -4e-3))


def perimeter(loop: np.ndarray) -> float:
    """Length of straight edges and arcs."""
    return sum(
        math.dist(a[:2], b[:2]) if a[2] == 0 else loops.circle(a, b, float(a[2]))[1] * abs(4 * math.atan(a[2]))
        for a, b in loops.edges(loop)
    )


@pytest.mark.parametrize("shape", [REED, HOLED, Disc(7e-3, 2e-4), RingPlate(9e-3, 4e-3, 2e-4)])
def test_what_is_written_comes_back(shape: Flat, tmp_path: Path) -> None:
    """Every arc is an arc: to round-off; the largest loop first, as it is read."""
    write_outline(shape.drawn, tmp_path / "a.dxf")
    back = read_outline(tmp_path / "a.dxf")
    assert len(back) == len(shape.drawn)
    drawn = sorted(shape.drawn, key=loops.area, reverse=True)
    for loop, read in zip(drawn, back, strict=True):
        assert len(read) == len(loop)
        assert loops.area(read) == pytest.approx(loops.area(loop), rel=1e-13)
        assert perimeter(read) == pytest.approx(perimeter(loop), rel=1e-13)
    if shape is not HOLED:
        assert loops.area(back[0]) - sum(map(loops.area, back[1:])) == pytest.approx(shape.area, rel=1e-12)


def test_a_reed_without_an_outline(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "scene.toml").write_text(SCENE)
    assert run_command(["export", str(tmp_path / "scene.toml"), "--to", "dxf"]) == BAD_INPUT
    assert "reed.kind = 'rigid_mass' has no outline" in capfd.readouterr().err
