"""A plate that lands on a lip, moving: deflected, exaggerated as it says, over the lip coloured by its force."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from impact.after.along import Pieces
from impact.pictures.drawing import ORANGE, PictureError
from impact.quantities import scaled, text
from seatfem.pictures.rendering import aim, load_pyvista, new_plotter, round_factor, shoot, write_gif
from seatfem.structures.model import Array

if TYPE_CHECKING:
    from types import ModuleType

HEIGHT: Final = 0.16
"""Largest drawn height over the size of the plate."""
VIEW: Final = (0.5, -1.0, -0.42)  # from the seat's side: the lip is not hidden
COLOURS: Final = "viridis"
CLEAR: Final = 0.01  # of the plate's size, by which the lip is drawn lower: the plate that touches it would hide it
GREY: Final = "#D8DADD"
SIZE: Final = (760, 390)
MARGIN: Final = 0.12  # of the plate's width
FULL: Final = 0.5  # of the largest force per length: from it on the lip is all orange
MILLISECONDS: Final = 120  # of each picture
OF_EACH: Final = 40  # of 256 colours, for the lip and for the scale
_QUARTERS: Final = ((0, 4, 8, 7), (4, 1, 5, 8), (8, 5, 2, 6), (7, 8, 6, 3))  # of an element of nine nodes
_BAR: Final = {
    "n_labels": 2,
    "fmt": "%.3g",
    "label_font_size": 13,
    "title_font_size": 14,
    "position_x": 0.64,
    "position_y": 0.84,
    "width": 0.34,
    "height": 0.12,
    "color": "black",
}
_LIGHT: Final = {"ambient": 0.45, "diffuse": 0.6, "specular": 0.1}


@dataclass(frozen=True)
class Landing:
    """Bodies and contacts at f times, as they are shown.

    Attributes:
        points, cells: (n, 2) nodes of the plate [m] and (m, 9) of each element.
        deflection: (f, n) of the nodes, away from the seat [m].
        time: (f,) [s].
        inner, outer: (m N, 2, 2) both ends of equal parts of both edges of the lip, as many in each of its N arcs [m].
        height: (N,) of the lip's arcs at rest, from the undeformed plate, negative [m].
        force: (f, N) per length of each arc [N/m]; ``total``: (f,) [N].
        averaged: over what forces are, in words.
        pieces: of the lip, as in `impact.after.along`.
    """

    points: Array
    cells: NDArray[np.int64]
    deflection: Array
    time: Array
    inner: Array
    outer: Array
    height: Array
    force: Array
    total: Array
    averaged: str
    pieces: Pieces = ()

    def check(self) -> None:
        """Raise `PictureError` of what does not fit together."""
        frames, arcs = self.force.shape
        if not len(self.time) == len(self.total) == len(self.deflection) == frames or len(self.height) != arcs:
            raise PictureError(
                f"{frames} pictures of {arcs} arcs need as many times and heights, not {len(self.time)} and "
                f"{len(self.height)}"
            )

    @property
    def exaggeration(self) -> float:
        """Return the factor of drawn over true heights: one of the numbers 1, 2, 5, 10, 20, ..."""
        largest = max(float(np.ptp(self.deflection)), float(np.ptp(np.append(self.height, 0.0))), 1e-30)
        return round_factor(HEIGHT * float(np.ptp(self.points, axis=0).max()) / largest)


def animate_landing(landing: Landing, path: str | os.PathLike[str], *, title: str = "") -> None:
    """Draw an endless GIF of a landing.

    Raises:
        PictureError: what drawing needs is missing, or parts that do not fit together.
    """
    landing.check()
    pyvista = load_pyvista()
    up, plotter, frames = landing.exaggeration, new_plotter(pyvista, SIZE), []
    (factor, unit), full = scaled(landing.deflection, "m"), FULL * float(landing.force.max()) or 1.0
    low, high = float(landing.deflection.min()), max(float(landing.deflection.max()), 0.0)
    plate, lip = _plate(pyvista, landing), _lip(pyvista, landing, up)
    everything = np.concatenate([_raised(landing, up * low), _raised(landing, up * high), lip.points])
    below = f"heights {up:g} times; lip orange from {text(full, 'N/m')} on; {landing.averaged}"
    for deflection, force, now, total in zip(
        landing.deflection, landing.force, landing.time, landing.total, strict=True
    ):
        plotter.clear_actors()
        plate.points[:, 2] = up * deflection
        plate.point_data["deflection"] = factor * deflection
        moved = plate.compute_normals(cell_normals=False, split_vertices=False, consistent_normals=False)
        limits = (factor * low, factor * high)
        drawn = plotter.add_mesh(
            moved, scalars="deflection", cmap=COLOURS, clim=limits, smooth_shading=True, show_scalar_bar=False, **_LIGHT
        )
        edges = moved.extract_feature_edges(feature_edges=False, non_manifold_edges=False, manifold_edges=False)
        plotter.add_mesh(edges, color="#404040", line_width=1.5)
        share = np.repeat(np.clip(force / full, 0.0, 1.0), len(landing.inner) // len(force))[:, None]
        lip.cell_data["colours"] = ((1 - share) * _rgb(GREY) + share * _rgb(ORANGE)).astype(np.uint8)
        plotter.add_mesh(lip, scalars="colours", rgb=True, lighting=False)
        plotter.add_scalar_bar(f"deflection [{unit}]", mapper=drawn.mapper, **_BAR)
        words = f"{title}   {text(float(now), 's')}   {text(float(total), 'N')}".strip()
        plotter.add_text(words, position=(14, SIZE[1] - 34), font_size=9, color="black")
        plotter.add_text(below, position=(14, 12), font_size=7, color="black")
        aim(plotter, everything, MARGIN * float(np.ptp(landing.points[:, 1])), VIEW)
        frames.append(shoot(plotter))
        plotter.remove_scalar_bar(f"deflection [{unit}]")
    plotter.close()
    write_gif(frames, _own_colours(), path, MILLISECONDS)


def _own_colours() -> Array:
    """Return white, and the colours of lip and scale."""
    import matplotlib

    shares = np.linspace(0.0, 1.0, OF_EACH)[:, None]
    ramp, scale = (1 - shares) * _rgb(GREY) + shares * _rgb(ORANGE), 255 * matplotlib.colormaps[COLOURS](shares[:, 0])
    return np.concatenate([np.full((1, 3), 255), ramp, scale[:, :3]])


def _rgb(colour: str) -> Array:
    return np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)], dtype=float)


def _raised(landing: Landing, height: float) -> Array:
    return np.column_stack([landing.points, np.full(len(landing.points), height)])


def _plate(pyvista: ModuleType, landing: Landing) -> Any:
    quarters = landing.cells[:, np.array(_QUARTERS)].reshape(-1, 4)
    return pyvista.PolyData.from_regular_faces(_raised(landing, 0.0), np.ascontiguousarray(quarters))


def _lip(pyvista: ModuleType, landing: Landing, up: float) -> Any:
    """Return quadrilaterals of the lip; heights are those of the arcs' middles, linear between those of one face."""
    arcs, count = len(landing.height), len(landing.inner)
    places, low = (np.arange(count)[:, None] + (0, 1)) / count, CLEAR * float(np.ptp(landing.points, axis=0).max())
    middles, heights, first = (np.arange(arcs) + 0.5) / arcs, np.empty(places.shape), 0
    for number, closed in landing.pieces or ((arcs, True),):
        of, cells = slice(first, first + number), slice(first * count // arcs, (first + number) * count // arcs)
        around = {"period": number / arcs} if closed else {}
        heights[cells] = np.interp(places[cells], middles[of], landing.height[of], **around)
        first += number
    corners = np.stack([*landing.inner.transpose(1, 0, 2), *landing.outer[:, ::-1].transpose(1, 0, 2)], axis=1)
    above = up * heights[:, [0, 1, 1, 0], None] - low
    points = np.concatenate([corners, above], axis=2).reshape(-1, 3)
    return pyvista.PolyData.from_regular_faces(points, np.arange(4 * count).reshape(-1, 4))
