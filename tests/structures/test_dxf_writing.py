"""Outlines written as DXF, read back: the same reed."""

import math
from pathlib import Path

import numpy as np
import pytest

from seatfem.faces.cli import BAD_INPUT, DONE, run_command
from seatfem.structures.formats.dxf import MM, read_outline, write_outline
from seatfem.structures.shapes import Flat, loops
from seatfem.structures.shapes.flat import Disc, Flapper, RingPlate
from seatfem.structures.shapes.outlined import Outlined
from tests.gallery import FLAPPER

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
