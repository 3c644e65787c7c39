"""docs/scene.md says what the program does."""

from pathlib import Path

from seatfem.scene_docs import scene_page

PAGE = Path(__file__).parents[2] / "docs" / "scene.md"


def test_the_page_is_current() -> None:
    assert PAGE.read_text(encoding="utf-8") == scene_page(), "run: make docs"


def test_every_kind_of_seat_is_on_the_page() -> None:
    for kind in ("annular", "bar", "block", "cad", "mesh", "rod", "spring", "greens"):
        assert f'## [seat], kind = "{kind}"' in scene_page()
    assert '| `lip_height` | length, `"3 mm"` | `"0.5 mm"` |' in scene_page()
