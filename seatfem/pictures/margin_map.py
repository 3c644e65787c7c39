"""Margins of fatigue of the points of bodies, in colours on what is seen of them."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from impact.files.atomic import whole_file
from impact.pictures.drawing import PictureError
from seatfem.pictures.plots import album
from seatfem.pictures.rendering import ABOVE, LIGHT, Image, aim, crop, import_pyvista, load_pyvista, new_plotter, shoot
from seatfem.pictures.skin import Skin
from seatfem.structures.model import Array

COLOURS: Final = "viridis_r"  # the darkest fails first; told apart with every common colour blindness
UNTOLD: Final = "#D8DADD"
SIZE: Final = (900, 700)
SPAN: Final = 4.0  # from the least margin to the end of the scale


@dataclass(frozen=True, eq=False)
class MarginMap:
    """Margins (S,) of the nodes of a body's skin, inf where nothing fails, nan where none is judged."""

    body: str
    skin: Skin
    margins: Array

    @property
    def least(self) -> float:
        """Return the least margin of all points."""
        return float(np.nanmin(self.margins))

    @property
    def heading(self) -> str:
        """Return the heading: body, least margin and where."""
        k = int(np.nanargmin(self.margins))
        place = self.skin.points[int(np.flatnonzero(self.skin.which == k)[0])]
        if self.skin.angles is not None and len(self.skin.nodes) < len(self.skin.points):
            place = np.array([np.hypot(place[0], place[1]), place[2]])
        where = ", ".join(f"{1e3 * x:.3g}" for x in place)
        return f"{self.body}: least margin {self.least:.3g}, at ({where}) mm"


def plot_margin_map(maps: Sequence[MarginMap], path: str | os.PathLike[str], *, title: str) -> None:
    """Draw bodies side by side, each in a logarithmic scale of colours from its least margin to `SPAN` times it.

    Raises:
        PictureError: what drawing needs is missing, nothing judged.
    """
    shown = [each for each in maps if np.isfinite(each.margins).any() and each.least > 0]
    if not shown:
        raise PictureError("no point has a finite margin above zero to draw: lower the load")
    images = crop([_image(each) for each in shown])
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import LogNorm

    with album(images, [each.heading for each in shown], path, title, len(shown)) as figure:
        for place, each in zip(figure.axes[:], shown, strict=False):
            scale = ScalarMappable(LogNorm(each.least, SPAN * each.least), COLOURS)
            bar = figure.colorbar(scale, ax=place, orientation="horizontal", aspect=40, shrink=0.9, pad=0.02)
            ticks = [each.least * factor for factor in (1.0, 1.5, 2.0, 3.0, SPAN)]
            bar.set_ticks(ticks, labels=[f"{tick:.3g}" for tick in ticks])
            bar.minorticks_off()
            bar.set_label(
                "margin: factor on stress, below 1 it fails\ngrey: little stress, or none computed", fontsize=8
            )


def write_margins(found: MarginMap, path: str | os.PathLike[str]) -> None:
    """Write the margins on the body's surface, for ParaView. Raises `PictureError` without pyvista."""
    pyvista = import_pyvista()
    body = pyvista.PolyData.from_regular_faces(found.skin.points, found.skin.triangles).cast_to_unstructured_grid()
    body.point_data["margin"] = found.margins[found.skin.which]
    with whole_file(path) as temporary:
        body.save(temporary)


def _image(found: MarginMap) -> Image:
    pyvista, low = load_pyvista(), found.least
    body = pyvista.PolyData.from_regular_faces(found.skin.points, found.skin.triangles)
    finite = np.where(np.isinf(found.margins), SPAN * low, np.maximum(found.margins, low))
    body.point_data["margin"] = np.log(finite)[found.skin.which]
    plotter = new_plotter(pyvista, SIZE)
    plotter.add_mesh(
        body,
        scalars="margin",
        cmap=COLOURS,
        clim=(np.log(low), np.log(SPAN * low)),
        nan_color=UNTOLD,
        show_scalar_bar=False,
        **LIGHT,
    )
    aim(plotter, found.skin.points, 0.0, ABOVE)
    image = shoot(plotter)
    plotter.close()
    return image
