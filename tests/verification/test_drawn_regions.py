"""The landings on whole regions that are drawn for benchmarks/points: the same each time, and valid scenes."""

from dataclasses import replace

import numpy as np
import pytest
from drawn_regions import KINDS, SCENES, draw_region

from seatfem.study.scene import load_scene


def test_draws_are_the_same_each_time_and_differ() -> None:
    texts = [draw_region(index).text for index in range(SCENES)]
    assert texts == [draw_region(index).text for index in range(SCENES)]
    assert len(set(texts)) == SCENES
    assert draw_region(0).text != draw_region(0, seed=1).text


@pytest.mark.slow
@pytest.mark.parametrize("index", range(len(KINDS)))
def test_region_is_the_struck_face(index, tmp_path) -> None:
    """The land that the product finds on the seat has the area and the reach of the other program's region."""
    drawn, path = draw_region(index), tmp_path / "scene.toml"
    path.write_text(drawn.text, encoding="utf-8")
    lip = replace(load_scene(path).seat.region(), arcs=64)
    cells = drawn.region.cells(720, 4)
    assert sum(each.areas.sum() for each in cells) == pytest.approx(lip.area, rel=1e-3)
    far = max(np.hypot(*each.places.reshape(-1, 2).T).max() for each in cells)
    assert far == pytest.approx(lip.outer, rel=0.02)
