"""Pictures of bodies drawn in a worker, in which VTK may crash or hang; started by `rendering`."""

import json
import os
import pickle
from pathlib import Path

from impact.pictures.drawing import load_matplotlib, try_draw
from seatfem.pictures.rendering import TRIED, load_pyvista, new_plotter


def reply(text: str) -> str:
    """Return the reason why a picture was not drawn, or "". The job, in JSON: the file of a pickled drawing function,
    empty to load libraries only, and the path of the picture."""
    drawing, picture = json.loads(text)
    os.environ[TRIED] = "1"

    def draw(path: Path) -> None:
        pickle.loads(Path(drawing).read_bytes())(path=path)

    return try_draw(draw if drawing else _load, Path(picture))


def _load(_: Path) -> None:
    """Load libraries and open a window of OpenGL: the first one takes longest."""
    load_matplotlib()
    new_plotter(load_pyvista(), (16, 16)).close()
