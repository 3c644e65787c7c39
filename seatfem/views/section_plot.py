"""The picture of a meridian mesh."""

from __future__ import annotations

import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from impact.drawing import ORANGE, SKY, sheet

_POINTS = 8  # drawn on each curved edge


def plot_section(mesh: Any, path: str | os.PathLike[str], *, title: str = "Half section of the seat") -> None:
    """Elements of a meridian mesh (x = r, y = z) with curved edges, contact and fixed boundaries in colour.

    ``mesh``: a scikit-fem mesh of triangles or quadrilaterals with named boundaries.
    """
    from matplotlib.collections import LineCollection

    contact, fixed = (
        np.asarray(mesh.boundaries.get(name, np.zeros(0)), dtype=np.int64) for name in ("contact", "fixed")
    )
    with sheet(path, 5.2, 4.4) as figure:
        figure.suptitle(title)
        axes = figure.add_subplot()
        for facets, colour, width, label in (
            (np.arange(mesh.nfacets), "#8A9097", 0.6, ""),
            (fixed, SKY, 2.5, "fixed"),
            (contact, ORANGE, 2.5, "contact"),
        ):
            curves = list(1e3 * _curves(mesh, facets))
            axes.add_collection(
                LineCollection(curves, colors=colour, linewidths=width, label=label or None, capstyle="round")
            )
        axes.axvline(0.0, color="#6A6A6A", linestyle="-.", linewidth=0.8)
        axes.autoscale()
        axes.set_aspect("equal")
        axes.set_xlabel("r [mm]")
        axes.set_ylabel("z [mm]")
        axes.set_xlim(left=-0.02 * 1e3 * float(mesh.p[0].max()))
        figure.legend(
            loc="outside lower center",
            ncols=2,
            title=f"{mesh.nelements} elements, {mesh.doflocs.shape[1]} nodes",
            title_fontsize=8,
        )


def _curves(mesh: Any, facets: NDArray[np.int64]) -> NDArray[np.float64]:
    """(facets, points, 2) places along edges [m], by the mesh's own map."""
    along = np.linspace(0.0, 1.0, _POINTS)[None, :]
    return np.asarray(mesh.mapping().G(along, find=facets)).transpose(1, 2, 0)
