"""Worker process that draws pictures of bodies, in which VTK may crash or hang; started by `rendering`.

The only argument names a folder of pickled drawing functions, each called with ``path``. Each line on the standard
input is "FILE NAME", with an empty FILE to load libraries only; the answer, in JSON, is the reason for a failure or "".
"""

import json
import pickle
import sys
from pathlib import Path

from impact.pictures.drawing import gap_of
from seatfem.jobs.worker import answer_lines
from seatfem.pictures.rendering import load_pyvista, new_plotter


def main(folder: Path) -> None:
    """Serve until the parent ends this process."""

    def answer(line: str) -> str:
        drawing, _, name = line.partition(" ")

        def draw(path: Path) -> None:
            with (folder / drawing).open("rb") as file:
                pickle.load(file)(path=path)

        return json.dumps(gap_of(draw if drawing else _load, folder / name))

    answer_lines(answer)


def _load(_: Path) -> None:
    """Load libraries and open a window of OpenGL: the first one takes longest."""
    import matplotlib.backends.backend_agg  # noqa: F401

    new_plotter(load_pyvista(), (16, 16)).close()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
