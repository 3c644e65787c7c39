"""What the viewer draws: one of the bodies of a run, in a frame, deformed, coloured, cut; values where one points."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from impact.greens.base import Array
from impact.quantities import scaled
from seatfem.pictures.moving import Moving
from seatfem.pictures.rendering import ABOVE, LIGHT, aim, load_pyvista, new_plotter
from seatfem.pictures.stress_wave import COLOURS, UNTOLD

SIZE: Final = (900, 640)
PLANES: Final[Mapping[str, Sequence[float]]] = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
"""Normals of section planes."""
OF_MODES: Final = 0.3  # of the size, that a mode is drawn by at most
OF_WAVES: Final = 0.1  # the same of true displacements, with the slider in its middle
EDGES: Final = "#5A6069"
_BAR: Final = {
    "n_labels": 2,
    "fmt": "%.3g",
    "label_font_size": 14,
    "title_font_size": 15,
    "position_x": 0.64,
    "position_y": 0.87,
    "width": 0.33,
    "height": 0.09,
    "color": "black",
}


@dataclass(frozen=True)
class Look:
    """What is seen: the ``frame``; its colours, by the body's ``values`` or by displacement; ``scale`` from 0, true or
    undeformed, to 1; the ``phase`` of a mode; a section across an axis, at the share ``cut`` of the body's extent."""

    frame: int = 0
    values: bool = True
    scale: float = 0.5
    phase: float = 1.0
    plane: str = ""
    cut: float = 0.5


class Stage:
    """An off-screen picture of a body, for a window of VTK that a server sends.

    Raises:
        PictureError: what drawing needs is missing.
    """

    def __init__(self, body: Moving) -> None:
        self._pyvista = load_pyvista()
        self.plotter: Any = new_plotter(self._pyvista, SIZE)
        self.put(body)

    def put(self, body: Moving) -> None:
        """Another body, seen as at first."""
        self.body = body
        self._rest = self._pyvista.PolyData.from_regular_faces(body.points, body.triangles)
        alike = self._rest.compute_normals(cell_normals=False, split_vertices=False)  # triangles may wind either way
        self._edges = alike.extract_feature_edges(feature_angle=35, manifold_edges=False, non_manifold_edges=False)
        self._edges.clear_data()
        self._seen = self._rest.copy()
        self.show(Look())
        self.reset()

    def reset(self) -> None:
        """The camera as at first."""
        aim(self.plotter, self.body.points, 0.12 * self.body.size, ABOVE)

    def turn(self, around: float, up: float) -> None:
        """The camera by angles [degrees], about its upward axis and then upwards."""
        self.plotter.camera.Azimuth(around)
        self.plotter.camera.Elevation(up)
        self.plotter.camera.OrthogonalizeViewUp()
        self.plotter.reset_camera_clipping_range()

    def factor(self, scale: float) -> float:
        """By which displacements are drawn; ``scale`` from 0 to 1."""
        body = self.body
        if body.time is None:
            return OF_MODES * scale**2 * body.size / body.largest
        middle = max(1.0, OF_WAVES * body.size / body.largest)
        return float(middle ** (2 * scale) if scale < 0.5 else middle * 4 ** (2 * scale - 1))

    def show(self, look: Look) -> None:
        """Draw it; what is seen of the window changes when it is rendered."""
        self._look, body, plotter = look, self.body, self.plotter
        values, low, high, name = self._colours(look)
        pull = self.factor(look.scale) * (look.phase if body.time is None else 1.0)
        seen = self._rest.copy()
        seen.points = body.points + pull * body.displacement[look.frame]
        seen.point_data[name] = values
        self._seen = shown = seen
        plotter.clear_actors()
        if look.plane:
            normal = PLANES[look.plane]
            along = seen.points @ np.array(normal)
            origin = (along.min() + look.cut * np.ptp(along)) * np.array(normal)
            shown = seen.clip(normal=normal, origin=origin, invert=True)
            outline = seen.slice(normal=normal, origin=origin)
            if outline.n_points:
                plotter.add_mesh(outline, color="black", line_width=3)
        if shown.n_points:
            drawn = plotter.add_mesh(
                shown,
                scalars=name,
                cmap=COLOURS,
                clim=(low, high),
                nan_color=UNTOLD,
                smooth_shading=False,
                show_scalar_bar=False,
                **LIGHT,
            )
            for title in [*plotter.scalar_bars.keys()]:
                plotter.remove_scalar_bar(title)
            plotter.add_scalar_bar(name, mapper=drawn.mapper, **_BAR)
        plotter.add_mesh(self._edges, color=EDGES, line_width=1.2)
        plotter.reset_camera_clipping_range()

    def probe(self, across: float, up: float) -> str:
        """What is told at a place of the window, from 0 to 1, of the corner next to it; "" where there is no body."""
        from vtkmodules.vtkRenderingCore import vtkCellPicker

        picker, (width, height) = vtkCellPicker(), self.plotter.render_window.GetSize()
        if not picker.Pick(across * width, up * height, 0.0, self.plotter.renderer):
            return ""
        corner = self._seen.find_closest_point(picker.GetPickPosition())
        return self.told(int(corner), self._look.frame)

    def told(self, corner: int, frame: int) -> str:
        """Place at rest, displacement and value of a corner."""
        body = self.body
        place = ", ".join(f"{1e3 * x:.4g}" for x in body.points[corner])
        factor, unit = (1.0, "of the largest") if body.time is None else scaled(body.largest, "m")
        moved = ", ".join(f"{factor * x:.3g}" for x in body.displacement[frame, corner])
        words = f"at ({place}) mm: displacement ({moved}) {unit}"
        if body.values is None:
            return words
        value = float(body.values[frame, corner])
        rate, prefixed = scaled(max(abs(body.low), abs(body.high)), body.unit)
        told = f"no {body.quantity} is told" if math.isnan(value) else f"{body.quantity} {rate * value:.4g} {prefixed}"
        return f"{words}; {told}{' or more' if value >= body.high and body.unit == 'Pa' else ''}"

    def _colours(self, look: Look) -> tuple[Array, float, float, str]:
        """Values, both ends of their scale and its title."""
        body = self.body
        if look.values and body.values is not None:
            factor, unit = scaled(max(abs(body.low), abs(body.high)), body.unit)
            values = factor * body.values[look.frame]
            return values, factor * body.low, factor * body.high, f"{body.quantity} [{unit}]"
        moved = np.linalg.norm(body.displacement[look.frame], axis=1)
        if body.time is None:
            return moved / body.largest, 0.0, 1.0, "displacement, relative"
        factor, unit = scaled(body.largest, "m")
        return factor * moved, 0.0, factor * body.largest, f"displacement [{unit}]"
