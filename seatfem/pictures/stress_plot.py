"""Pictures of the stress in a seat: on its section at the instant of the largest, and over time at points."""

from __future__ import annotations

import os
from typing import Any

import numpy as np

from impact.files.atomic import whole_file
from impact.pictures.drawing import ORANGE, scaled, sheet
from seatfem.pictures.rendering import import_pyvista
from seatfem.structures.model import Array

SHOWN = 400  # steps on either side of it


def plot_stress(
    mesh: Any,
    sites: Array,
    snapshot: Array,
    time: Array,
    histories: Array,
    labels: tuple[str, ...],
    path: str | os.PathLike[str],
    *,
    at: float,
    title: str,
) -> None:
    """Von Mises stress on a section (of other bodies seen from the side) at the time ``at``, and histories around it.

    Args:
        mesh: scikit-fem mesh.
        sites: (P, d) where the stress ``snapshot`` (P,) is known [m, Pa].
        time: (n,) of the ``histories`` (Q, n) of points called ``labels`` [s, Pa].
    """
    factor, unit = scaled(np.concatenate([snapshot, histories.ravel()]), "Pa")
    with sheet(path, 9.6, 4.6) as figure:
        figure.suptitle(title)
        place, course = figure.subplots(1, 2)
        if mesh.dim() == 2:
            outline = mesh.p[:, mesh.facets[:, mesh.boundary_facets()]] * 1e3
            place.plot(*outline, color="#8A9097", linewidth=0.6, zorder=1)
        dots = place.scatter(1e3 * sites[:, 0], 1e3 * sites[:, -1], c=factor * snapshot, s=14, cmap="viridis", zorder=2)
        worst = sites[int(np.argmax(snapshot))]
        place.plot(1e3 * worst[0], 1e3 * worst[-1], "o", mfc="none", mec=ORANGE, ms=10)
        place.set(aspect="equal", xlabel="r [mm]" if mesh.dim() == 2 else "x [mm]", ylabel="z [mm]")
        place.set_title(f"von Mises at t = {1e6 * at:.5g} µs")
        figure.colorbar(dots, ax=place, label=unit, shrink=0.8)
        middle = int(np.searchsorted(time, at))
        shown = slice(max(0, middle - SHOWN // 4), middle + SHOWN)
        for label, values in zip(labels, histories, strict=True):
            course.plot(1e6 * time[shown], factor * values[shown], label=label, linewidth=1.0)
        course.axvline(1e6 * at, color="#6A6A6A", linestyle=":", linewidth=0.8)
        course.set(xlabel="t [µs]", ylabel=f"von Mises [{unit}]")
        course.legend(fontsize=8)


def write_stress_vtu(sites: Array, largest: Array, time: Array, path: str | os.PathLike[str]) -> None:
    """Largest von Mises stress [Pa] and its time [s] of each site (P, d) [m], as points for ParaView.

    Raises:
        PictureError: pyvista is missing.
    """
    pyvista = import_pyvista()
    flat = sites.shape[1] == 2
    points = np.column_stack([sites[:, 0], np.zeros(len(sites)), sites[:, 1]]) if flat else sites
    cloud = pyvista.PolyData(points).cast_to_unstructured_grid()
    cloud.point_data["largest von Mises [Pa]"] = largest
    cloud.point_data["its time [s]"] = time
    with whole_file(path) as temporary:
        cloud.save(temporary)
