"""The drawing of a scene, as a file and as the first picture of a run."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from seatfem.pictures.apart import Picture
from seatfem.pictures.layout import Layout
from seatfem.pictures.scene_drawing import draw_layout
from seatfem.structures.rings import Division
from seatfem.study.impacts.layout import layout_of
from seatfem.study.scene import Scene
from seatfem.study.scene.files import check_files

DRAWING: Final = "drawing.png"


def draw_scene(scene: Scene, path: Path, division: Division | None = None) -> Layout:
    """Draw a scene in section and plan to a file, .png, .svg or .pdf; return what the drawing shows.

    Args:
        scene: as it is asked.
        path: of the drawing, written whole or not at all.
        division: of the lip into arcs, as planned; ``None``: as the scene states it.

    Raises:
        SceneError: a file that cannot be read, bodies that cannot meet as they lie.
        PictureError: matplotlib is missing, or cannot write this format.
        Also what `layout_of` raises.
    """
    check_files(scene)
    layout = layout_of(scene, division)
    draw_layout(layout, path)
    return layout


def drawing_picture(scene: Scene, division: Division) -> Picture:
    """Return the drawing as a picture of a run, whose lip is divided so."""
    return DRAWING, lambda path: draw_layout(layout_of(scene, division), path)
