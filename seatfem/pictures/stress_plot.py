"""Pictures of stress on a seat and over time at hot spots, and of fatigue margins on bodies and against a key."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import scipy
from numpy.typing import NDArray

from impact.files.safe_files import whole_file
from impact.greens.base import Array
from impact.pictures.drawing import BLUE, GREY, ORANGE, load_matplotlib, sheet, zero_line
from impact.quantities import scaled, text
from seatfem.pictures import frames, moving, rendering, skins

if TYPE_CHECKING:
    from matplotlib.axes import Axes


Curve = tuple[str, str, Array, Array | None, float]
"""Place; name and history (n,) of its leading component, von Mises stress (n,) [Pa]; time of its largest value [s]."""
MEGA: Final = 1e6
WIDTH, HEIGHT = 9.6, 1.75


def plot_stress_histories(
    time: Array, curves: Sequence[Curve], path: str | os.PathLike[str], *, touch: float, title: str
) -> None:
    """Draw one axes per place, MPa over ms, the first ``touch`` [s] dotted and the largest value since it ringed.

    Raises:
        PictureError: matplotlib is missing.
    """
    columns = 1 if len(curves) < 4 else 2
    rows = math.ceil(len(curves) / columns)
    with sheet(path, WIDTH, 0.8 + HEIGHT * rows) as figure:
        figure.suptitle(title)
        words = "blue: the component named; grey: von Mises; dotted: first touch; ring: the largest since"
        figure.supxlabel(words, fontsize=8)
        grid = figure.subplots(rows, columns, sharex=True, squeeze=False)
        for axes, (place, component, leading, mises, peak_time) in zip(grid.flat, curves, strict=False):
            zero_line(axes)
            if mises is not None:
                axes.plot(1e3 * time, mises / MEGA, color=GREY, linewidth=0.7)
            axes.plot(1e3 * time, leading / MEGA, color=BLUE, linewidth=0.8)
            if math.isfinite(touch):
                axes.axvline(1e3 * touch, color=ORANGE, linestyle=":", linewidth=1.0)
            shown = leading if mises is None else mises
            peak = float(shown[int(np.argmin(np.abs(time - peak_time)))])
            axes.plot(1e3 * peak_time, peak / MEGA, "o", mfc="none", mec=ORANGE, ms=6)
            axes.set_title(f"{place}: {component}")
            note = f"{text(abs(peak), 'Pa')} at {text(peak_time, 's', 4)}"
            axes.text(0.99, 0.97, note, ha="right", va="top", color=GREY, fontsize=8, transform=axes.transAxes)
            axes.set_ylabel("stress [MPa]")
        for axes in grid.flat[len(curves) :]:
            axes.axis("off")
        for column in range(columns):
            last = (len(curves) - 1 - column) // columns
            grid[last, column].set_xlabel("time [ms]")
            grid[last, column].tick_params(labelbottom=True)


SHOWN: Final = 400  # number of steps shown after the largest stress; a quarter of it before


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
    unsure: tuple[float, float] = (math.nan, math.nan),
) -> None:
    """Draw von Mises stress on a meridian's outline, or the surface of another body, at the time ``at``, and histories.

    Args:
        mesh: scikit-fem mesh.
        sites: surface nodes (P, d) with known stress ``snapshot`` (P,); the rest is grey [m, Pa].
        time: times (n,) of the ``histories`` (Q, n) of points named ``labels`` [s, Pa].
        unsure: interval in which the stress depends on the time step; marked in the picture [s].

    Raises:
        PictureError: the body is three-dimensional, and a package or driver for drawing it is missing.
    """
    factor, unit = scaled(np.concatenate([snapshot, histories.ravel()]), "Pa")
    worst = sites[int(np.argmax(snapshot))]
    image = None if mesh.dim() == 2 else _image(mesh, sites, factor * snapshot)
    with sheet(path, 9.6, 4.9) as figure:
        figure.suptitle(title)
        place, course = figure.subplots(1, 2)
        library = load_matplotlib()
        scale = library.cm.ScalarMappable(library.colors.Normalize(0.0, factor * float(snapshot.max())), moving.COLOURS)
        if image is None:
            _outline(place, mesh, sites, factor * snapshot, scale)
            place.plot(*(1e3 * worst), "o", mfc="none", mec=ORANGE, ms=10)
            place.set(aspect="equal", xlabel="r [mm]", ylabel="z [mm]")
        else:
            place.imshow(image, interpolation="lanczos")
            place.axis("off")
        place.set_title(f"von Mises on the surface at t = {1e6 * at:.5g} µs")
        figure.colorbar(scale, ax=place, label=unit, shrink=0.8)
        middle = int(np.searchsorted(time, at))
        shown = slice(max(0, middle - SHOWN // 4), middle + SHOWN)
        for label, values in zip(labels, histories, strict=True):
            course.plot(1e6 * time[shown], factor * values[shown], label=label, linewidth=1.0)
        course.axvline(1e6 * at, color="#6A6A6A", linestyle=":", linewidth=0.8)
        course.set(xlabel="t [µs]", ylabel=f"von Mises [{unit}], not filtered")
        if math.isfinite(unsure[0]):
            start, end = 1e6 * np.clip(unsure, time[shown][0], time[shown][-1])
            course.axvspan(start, end, color="#E3E3E3", zorder=0)
            width, step = text(unsure[1] - unsure[0], "s"), text(float(time[1] - time[0]), "s")
            words = (
                f"Grey outline: no stress computed. Grey band: within {width} of the first touch stress follows the "
                f"raw force, whose height depends on the time step, here {step}."
            )
            figure.supxlabel(words, fontsize=7.5)
        course.legend(fontsize=8)


def write_stress_vtu(sites: Array, largest: Array, time: Array, path: str | os.PathLike[str]) -> None:
    """Write the largest von Mises stress [Pa] and its time [s] at each site (P, d) [m], as points for ParaView.

    Raises:
        PictureError: pyvista is missing.
    """
    pyvista = rendering.import_pyvista()
    flat = sites.shape[1] == 2
    points = np.column_stack([sites[:, 0], np.zeros(len(sites)), sites[:, 1]]) if flat else sites
    cloud = pyvista.PolyData(points).cast_to_unstructured_grid()
    cloud.point_data["largest von Mises [Pa]"] = largest
    cloud.point_data["its time [s]"] = time
    with whole_file(path) as temporary:
        cloud.save(temporary)


def _values_at(sites: Array, values: Array, points: Array) -> Array:
    """Return the values (n,) at points (n, d) that are sites; nan at others."""
    away, which = scipy.spatial.cKDTree(sites).query(points)
    return np.where(away < 1e-9 * np.abs(points).max(), values[which], np.nan)


def _outline(place: Axes, mesh: Any, sites: Array, values: Array, scale: Any) -> None:
    """Draw the outline, through the mid-side nodes, as short segments, thick and coloured where stress is known."""
    lines_of = load_matplotlib().collections.LineCollection
    facets = mesh.boundary_facets()
    ends = mesh.p[:, mesh.facets[:, facets]].transpose(2, 1, 0)
    curved = mesh.doflocs.shape[1] > mesh.nvertices
    middle = mesh.doflocs[:, mesh.dofs.facet_dofs[0, facets]].T if curved else ends.mean(axis=1)
    at_ends, on_middle = (
        _values_at(sites, values, ends.reshape(-1, 2)).reshape(-1, 2),
        _values_at(sites, values, middle),
    )
    on_middle = np.where(np.isfinite(on_middle), on_middle, at_ends.mean(axis=1))
    halves = np.concatenate([np.stack([ends[:, k], middle], axis=1) for k in (0, 1)])
    heights = np.concatenate([np.stack([at_ends[:, k], on_middle], axis=1) for k in (0, 1)])
    unknown = moving.UNKNOWN
    place.add_collection(lines_of(list(1e3 * halves), colors=unknown, linewidths=3.5, zorder=1))
    share = np.linspace(0.0, 1.0, 6)[:, None, None]
    pieces = 1e3 * ((1 - share) * halves[:, 0] + share * halves[:, 1])
    along = np.stack([pieces[:-1], pieces[1:]], axis=2).reshape(-1, 2, 2)
    between = (share[1:, :, 0] + share[:-1, :, 0]) / 2
    colours = ((1 - between) * heights[:, 0] + between * heights[:, 1]).ravel()
    finite = np.isfinite(colours)
    lines = lines_of(list(along[finite]), array=colours[finite], cmap=scale.cmap, norm=scale.norm, linewidths=4.5)
    lines.set_antialiased(False)  # antialiasing would leave hairlines between the segments
    place.add_collection(lines)
    place.autoscale()


def _image(mesh: Any, sites: Array, values: Array) -> NDArray[np.uint8]:
    """Return an image of the surface from above."""
    triangles = skins.as_triangles(mesh.facets[:, mesh.boundary_facets()].T)
    nodes, numbered = np.unique(triangles, return_inverse=True)
    points = np.ascontiguousarray(mesh.p.T[nodes])
    surface = frames.Frames(
        "", points, numbered.reshape(-1, 3), np.zeros((1, *points.shape)), ("",), None,
        _values_at(sites, values, points)[None], "stress", high=float(values.max()),
    )  # fmt: skip
    return rendering.crop(moving.draw_frames(surface, [(0, 1.0)]))[0]
