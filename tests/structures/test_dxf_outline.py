"""Outlines in DXF files: curves of every kind, units, files that have none; and outlines written and read back."""

import math
from pathlib import Path

import numpy as np
import pytest

from seatfem.faces.cli import BAD_INPUT, DONE, run_command
from seatfem.structures.errors import GeometryError
from seatfem.structures.formats.dxf import MM, read_outline, write_outline
from seatfem.structures.shapes import Flat, loops
from seatfem.structures.shapes.flat import Disc, Flapper, RingPlate
from seatfem.structures.shapes.outlined import Outlined
from tests.gallery import FLAPPER

HEAD = "0\nSECTION\n2\nHEADER\n9\n$INSUNITS\n70\n{}\n0\nENDSEC\n"


def entity(name: str, *groups: tuple[int, float]) -> str:
    return f"0\n{name}\n8\n0\n" + "".join(f"{code}\n{value}\n" for code, value in groups)


def line(*ends: float) -> str:
    return entity("LINE", *zip((10, 20, 11, 21), ends, strict=True))


def written(path: Path, *entities: str, unit: int | str = 4) -> Path:
    text = f"{HEAD.format(unit)}0\nSECTION\n2\nENTITIES\n{''.join(entities)}0\nENDSEC\n0\nEOF\n"
    path.write_text(text, encoding="utf-8")
    return path


STADIUM = 20e-3 * 6e-3 + math.pi * 9e-6  # m^2
STRAIGHT = line(0, -3, 20, -3), line(20, 3, 0, 3)
ARCS = (
    entity("ARC", (10, 20), (20, 0), (40, 3), (50, 270), (51, 90)),
    entity("ARC", (10, 0), (20, 0), (40, 3), (50, 90), (51, 270)),
)
CORNERS = ((10, 0), (20, -3)), ((10, 20), (20, -3), (42, 1)), ((10, 20), (20, 3)), ((10, 0), (20, 3), (42, 1))
POLYLINE = entity("LWPOLYLINE", (90, 4), (70, 1), *(group for corner in CORNERS for group in corner))


@pytest.mark.parametrize("entities", [(*STRAIGHT, *ARCS), (ARCS[1], STRAIGHT[1], ARCS[0], STRAIGHT[0]), (POLYLINE,)])
def test_a_stadium(entities: tuple[str, ...], tmp_path: Path) -> None:
    """Lines in any order and direction, arcs, bulges: the same."""
    (outline,) = read_outline(written(tmp_path / "a.dxf", *entities, entity("TEXT", (10, 1), (20, 1), (40, 1))))
    assert abs(loops.area(outline)) == pytest.approx(STADIUM, rel=1e-12)
    assert np.ptp(loops.polygon(outline)[0], axis=0) == pytest.approx((26e-3, 6e-3), rel=1e-9)
    assert len(outline) == 4


def test_inner_loops_come_after_the_outline(tmp_path: Path) -> None:
    """In whatever order they are drawn; polylines may turn either way."""
    hole = entity("CIRCLE", (10, 15), (20, 0), (40, 1))
    outline, found = read_outline(written(tmp_path / "a.dxf", hole, POLYLINE))
    assert abs(loops.area(outline)) == pytest.approx(STADIUM, rel=1e-12)
    assert abs(loops.area(found)) == pytest.approx(math.pi * 1e-6, rel=1e-12)


def test_a_circle_and_units(tmp_path: Path) -> None:
    circle = entity("CIRCLE", (10, 1), (20, 2), (40, 5))
    (inches,) = read_outline(written(tmp_path / "a.dxf", circle, unit=1))
    assert np.ptp(loops.polygon(inches)[0], axis=0) == pytest.approx((0.254, 0.254))
    (stated,) = read_outline(written(tmp_path / "a.dxf", circle, unit=0), 1e-3)
    assert np.mean(stated[:, :2], axis=0) == pytest.approx((1e-3, 2e-3))
    assert loops.area(stated) == pytest.approx(math.pi * 25e-6, rel=1e-12)


@pytest.mark.parametrize(
    ("entities", "unit", "message"),
    [
        ((), 4, "LINE, ARC, CIRCLE, LWPOLYLINE"),
        (STRAIGHT, 4, r"\(20, -3\)"),
        ((*STRAIGHT, ARCS[0]), 4, "its outline is open at"),
        ((entity("CIRCLE", (10, 5), (20, 0), (40, math.inf)),), 4, "CIRCLE.*numbers"),
        ((entity("SPLINE", (70, 8)),), 4, "SPLINE.*LINE"),
        ((entity("ARC", (10, 0), (20, 0), (40, 3)),), 4, "ARC.*numbers"),
        ((entity("ARC", (10, 0), (20, 0), (40, 3), (50, 0), (51, 9), (230, -1)),), 4, "drawn from below"),
        ((entity("LINE", (10, 1e300), (20, 0), (11, 0), (21, 0)),), 4, "LINE.*1000 m"),
        ((entity("CIRCLE", (10, 0), (20, 0), (40, 1e200)),), 4, "a CIRCLE beyond 1000 m"),
        ((entity("LWPOLYLINE", (70, 1), (10, 0), (20, 0), (42, 1e200), (10, 1), (20, 0)),), 4, "a bulge beyond 10000"),
        (tuple(line(k, 0, k + 1, 0) for k in range(5001)), 4, "more than 10000 corners"),
        ((entity("LWPOLYLINE", *[(10, 0), (20, 0)] * 40_001),), 4, "more than 10000 corners"),
        ((POLYLINE,), "²", 'unit = "mm"'),
        ((POLYLINE,), "4" * 5000, 'unit = "mm"'),
        ((POLYLINE,), 0, 'unit = "mm"'),
    ],
)
def test_what_is_no_outline_is_refused(
    entities: tuple[str, ...], unit: int | str, message: str, tmp_path: Path
) -> None:
    with pytest.raises(GeometryError, match=message):
        read_outline(written(tmp_path / "a.dxf", *entities, unit=unit))


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"AutoCAD Binary DXF\r\n\x1a", "binary"),
        (b"solid\nfacet\n", "no DXF file"),
        (b"\xff\xfe\x00", "no length unit|no DXF"),
    ],
)
def test_what_is_no_dxf_is_refused(data: bytes, message: str, tmp_path: Path) -> None:
    (tmp_path / "a.dxf").write_bytes(data)
    with pytest.raises(GeometryError, match=message):
        read_outline(tmp_path / "a.dxf")


SCENE = """\
[seat]
kind = "spring"
stiffness = "1 N/um"
[reed]
{}
[run]
duration = "1 ms"
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


def test_the_reed_of_a_scene_is_written_by_the_verb(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(SCENE.format(f'{FLAPPER}release = {{ mode = 1, velocity = "-1 m/s" }}'))
    assert run_command(["export", str(tmp_path / "scene.toml"), "--to", "dxf", "-o", str(tmp_path), "--quiet"]) == DONE
    outline, *holes = (tuple(map(tuple, loop.tolist())) for loop in read_outline(tmp_path / "reed.dxf"))
    own = Flapper(8e-3, 2e-3, 6e-3, 15e-3, 16e-3, 0.3e-3)
    read = Outlined(outline, 0.3e-3, own.centre, segment=((0, -4e-3), (0, 4e-3)), holes=tuple(holes))
    assert read.area == pytest.approx(own.area, rel=1e-9)
    assert (*read.room, read.narrowest) == pytest.approx((*own.room, own.narrowest))


def test_a_reed_without_an_outline(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "scene.toml").write_text(SCENE.format('kind = "rigid_mass"\nmass = "1 g"\nvelocity = "-1 m/s"'))
    assert run_command(["export", str(tmp_path / "scene.toml"), "--to", "dxf"]) == BAD_INPUT
    assert "reed.kind = 'rigid_mass' has no outline" in capfd.readouterr().err


def test_another_reader_takes_it(tmp_path: Path) -> None:
    ezdxf = pytest.importorskip("ezdxf")
    write_outline(REED.drawn, tmp_path / "a.dxf")
    drawing = ezdxf.readfile(tmp_path / "a.dxf")
    assert drawing.units == MM
    assert not drawing.audit().errors
    for found, loop in zip(drawing.modelspace().query("LWPOLYLINE"), REED.drawn, strict=True):
        assert found.closed
        np.testing.assert_allclose(found.get_points("xyb"), loop * (1e3, 1e3, 1), rtol=1e-12)
