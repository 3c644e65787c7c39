"""In a worker: draws pictures of bodies, of which VTK may crash or hang. `seatfem.pictures.apart` starts it.

The only argument names a folder in which job NUMBER is the file NUMBER.pickle, written by the parent: what to draw,
to be called with ``path``. Each line on the standard input is "NUMBER NAME"; the answer is in JSON why it could not be
drawn, or "".
"""

from __future__ import annotations

import json
import pickle
import sys
from pathlib import Path

from impact.pictures.drawing import gap_of
from seatfem.jobs.worker import answer_lines


def main(folder: Path) -> None:
    """Serve until the parent ends this process."""

    def answer(line: str) -> str:
        number, _, name = line.partition(" ")

        def draw(path: Path) -> None:
            with (folder / f"{number}.pickle").open("rb") as file:
                pickle.load(file)(path=path)

        return json.dumps(gap_of(draw, folder / name))

    answer_lines(answer)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
