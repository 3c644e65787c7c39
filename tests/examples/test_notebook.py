"""A small notebook, run by a kernel without a screen: what objects, plots and scenes of pyvista show there."""

import base64
import io
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import matplotlib.image
import numpy as np
import pytest

from seatfem.machine.libraries import picture_library_gap

ROOT = Path(__file__).parents[2]
MODE = """
import numpy as np
import pyvista
import skfem.io.meshio
import seatfem
from seatfem.structures.shapes import Bar

size = seatfem.MeshSpec(size=2e-3, contact_size=2e-3)
body = seatfem.make_mesh(Bar(length=20e-3, width=4e-3, height=2e-3), size)
model = seatfem.assemble(body, seatfem.Material(200e9, 0.3, 7850.0))
modes = seatfem.solve_modes(model, 3)
grid = pyvista.from_meshio(skfem.io.meshio.to_meshio(body.mesh))
shape = model.expand(modes.shapes[:, 0]).T
grid["displacement"] = 3e-3 * shape / np.abs(shape).max()
plotter = pyvista.Plotter(window_size=(400, 500))
plotter.add_mesh(grid.warp_by_vector("displacement"), scalars="displacement", show_edges=True)
plotter.show(jupyter_backend="static")
"""


RUN = """
import sys
import nbclient, nbformat
page = nbformat.read(sys.argv[1], as_version=4)
nbclient.NotebookClient(page, timeout=240, kernel_name="python3").execute()
nbformat.write(page, sys.argv[1])
"""


def executed(folder: Path) -> list[list[dict[str, Any]]]:
    """Return what each cell shows: the example of the README, its results, a plot, a mode."""
    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    match = re.search(r"## In Python\n+```python\n(.*?)```", readme, re.DOTALL)
    example = match[1].replace(', "force.png"', "")  # as figures are shown in notebooks: without a file
    assert example != match[1]
    shutil.copytree(ROOT / "examples", folder / "examples")
    cells = [example, "result", "result.landings", "result.plot('force')", MODE]
    empty = {"cell_type": "code", "metadata": {}, "outputs": [], "execution_count": None}
    page = {"cells": [empty | {"source": cell} for cell in cells], "metadata": {}, "nbformat": 4, "nbformat_minor": 4}
    path = folder / "page.ipynb"
    path.write_text(json.dumps(page), encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "IPYTHONDIR": str(folder), "DISPLAY": ""}
    command = [sys.executable, "-P", "-c", RUN, str(path)]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=400)
    assert done.returncode == 0, done.stderr
    return [cell["outputs"] for cell in json.loads(path.read_text(encoding="utf-8"))["cells"]]


def joined(text: Any) -> str:
    """Return the whole of a text that may be kept line by line."""
    return text if isinstance(text, str) else "".join(text)


@pytest.mark.skipif(picture_library_gap() != "", reason="no pictures here")
@pytest.mark.own_gmsh
@pytest.mark.slow
def test_a_notebook_shows_tables_figures_and_scenes(tmp_path: Path) -> None:
    outputs = executed(tmp_path)
    text = "".join(joined(out["text"]) for cell in outputs for out in cell if "text" in out)
    assert "peak force 46." in text
    assert "arning" not in text
    shown = [[out for out in cell if "data" in out] for cell in outputs]
    assert [len(cell) for cell in shown] == [0, 1, 1, 1, 1]
    for [table], words in zip(shown[1:3], ("landing_impulse_Ns", "closing speed"), strict=True):
        assert joined(table["data"]["text/html"]).startswith("<table>")
        assert words in joined(table["data"]["text/html"])
    for [out], least in zip(shown[3:], (600, 400), strict=True):
        page = io.BytesIO(base64.b64decode(joined(out["data"]["image/png"])))
        image = np.asarray(matplotlib.image.imread(page, format="png"))
        assert min(image.shape[:2]) >= least
        levels = image[..., :3].sum(axis=2)
        assert len(np.unique(levels.round(2))) > 20  # not blank
        assert 0.01 < float((levels < 2.9).mean()) < 0.9
