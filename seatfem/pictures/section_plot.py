"""The picture of a meridian mesh."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from impact.pictures.drawing import ORANGE, SKY, sheet

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_POINTS = 8  # drawn on each curved edge


def plot_section(mesh: Any, path: str | os.PathLike[str]) -> None:
    """Draw the elements of a meridian mesh (x = r, y = z) with curved edges, contact and fixed boundaries in colour;
    beside the whole section the elements around the contact face.

    ``mesh``: a scikit-fem mesh of triangles or quadrilaterals with named boundaries.
    """
    contact, fixed = (
        np.asarray(mesh.boundaries.get(name, np.zeros(0)), dtype=np.int64) for name in ("contact", "fixed")
    )
    groups = (
        (1e3 * _curves(mesh, np.arange(mesh.nfacets)), "#8A9097", 0.6, ""),
        (1e3 * _curves(mesh, fixed), SKY, 2.5, "fixed"),
        (1e3 * _curves(mesh, contact), ORANGE, 2.5, "contact"),
    )
    with sheet(path, 7.2 if contact.size else 5.2, 4.6) as figure:
        figure.suptitle("Half section of the seat")
        whole, *close = figure.subplots(1, 2 if contact.size else 1, squeeze=False)[0]
        _draw(whole, groups)
        whole.axvline(0.0, color="#6A6A6A", linestyle="-.", linewidth=0.8)
        whole.autoscale()
        whole.set_xlim(left=-0.02 * 1e3 * float(mesh.p[0].max()))
        for axes in close:
            _draw(axes, groups)
            low, high = _window(groups[2][0])
            axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), ylabel="")
            axes.set_title("around the contact face")
            corners = [low[0], high[0], high[0], low[0], low[0]], [low[1], low[1], high[1], high[1], low[1]]
            whole.plot(*corners, color="#6A6A6A", linewidth=0.7)
        handles, labels = whole.get_legend_handles_labels()
        figure.legend(
            handles,
            labels,
            loc="outside lower center",
            ncols=2,
            title=f"{mesh.nelements} elements, {mesh.doflocs.shape[1]} nodes",
            title_fontsize=8,
        )


def _draw(axes: Axes, groups: Iterable[tuple[NDArray[np.float64], str, float, str]]) -> None:
    from matplotlib.collections import LineCollection

    for curves, colour, width, label in groups:
        lines = LineCollection(list(curves), colors=colour, linewidths=width, label=label or None, capstyle="round")
        axes.add_collection(lines)
    axes.set_aspect("equal")
    axes.set(xlabel="r [mm]", ylabel="z [mm]")


def _window(patch: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the corners of a square around the patch, twice as wide, two thirds of it on the body's side (below)."""
    low, high = patch.min(axis=(0, 1)), patch.max(axis=(0, 1))
    half = max(float(np.max(high - low)), 1e-6)
    middle = (low + high) / 2 - np.array([0.0, half / 3])
    return middle - half, middle + half


def _curves(mesh: Any, facets: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return (facets, points, 2) places along edges [m], by the mesh's own map."""
    along = np.linspace(0.0, 1.0, _POINTS)[None, :]
    return np.asarray(mesh.mapping().G(along, find=facets)).transpose(1, 2, 0)
