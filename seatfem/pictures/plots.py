"""Pictures of the seat's mesh, in space and in section, of a model's modes, and of stress over time at hot spots."""

from __future__ import annotations

import math
import os
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from impact.greens.base import Array
from impact.pictures.drawing import BLUE, GREY, ORANGE, SKY, PictureError, load_matplotlib, sheet, zero_line
from impact.quantities import text
from seatfem.pictures.frames import mode_frames
from seatfem.pictures.moving import album, plot_frames
from seatfem.pictures.rendering import ABOVE, BELOW, aim, crop, load_pyvista, new_plotter, shoot
from seatfem.pictures.skins import skin_of
from seatfem.structures.model import SecondOrderModel
from seatfem.structures.reduction.modes import Modes

if TYPE_CHECKING:
    from matplotlib.axes import Axes


_LIGHT = {"ambient": 0.42, "diffuse": 0.62, "specular": 0.1}
_EDGES = {"show_edges": True, "edge_color": "#3F454C", "line_width": 1.0}
_BODY, _INSIDE = "#E4E7EA", "#F2DFA0"


def plot_modes(
    model: SecondOrderModel,
    modes: Modes,
    path: str | os.PathLike[str],
    *,
    title: str = "Modes of the seat",
    names: Sequence[str] = (),
) -> None:
    """Draw the modes of a model side by side: deformed, coloured by the magnitude of displacement, edges at rest in
    grey; a half section as its body, open towards the viewer.

    ``names``: text before each frequency [1, 2, ...].

    Raises:
        ModelError: the model has no mesh that can be drawn.
        PictureError: there are no modes, or a package or driver for drawing is missing.
    """
    if not len(modes.frequencies_hz):
        raise PictureError("there are no modes to draw: compute at least one")
    skin, words = skin_of(model), names or [str(k) for k in range(1, 1 + len(modes.frequencies_hz))]
    shapes = [skin.moved(model.expand(shape)[:, skin.nodes].T) for shape in modes.shapes.T]
    labels = [f"{name}: {text(float(f), 'Hz', 4)}" for name, f in zip(words, modes.frequencies_hz, strict=True)]
    plot_frames(mode_frames(skin, shapes, labels, title), path, title=title, most=len(labels))


def plot_mesh(mesh: Any, path: str | os.PathLike[str]) -> None:
    """Draw the mesh from above, cut open, from below, and near the contact face; contact and fixed faces in colour.

    ``mesh``: a scikit-fem mesh of tetrahedra or hexahedra with named boundaries, or an object with one as ``.mesh``.

    Raises:
        PictureError: a package or driver for drawing is missing.
    """
    mesh = getattr(mesh, "mesh", mesh)
    pyvista = load_pyvista()
    vertices = np.ascontiguousarray(mesh.p[:, : mesh.nvertices].T)
    colours = {"contact": ORANGE, "fixed": SKY, "surface": _BODY, "inside": _INSIDE}
    back_half = vertices[mesh.t].mean(axis=0)[:, 1] > vertices[:, 1].mean()
    images = []
    plotter = new_plotter(pyvista, (700, 580))
    all_cells = np.ones_like(back_half)
    views = [("from above", ABOVE, all_cells, vertices), ("cut open", ABOVE, back_half, vertices)]
    views.append(("from below", BELOW, all_cells, vertices))
    patch = np.asarray(mesh.boundaries.get("contact", np.zeros(0)), dtype=np.int64)
    if patch.size:
        near, half = vertices[np.unique(mesh.facets[:, patch])], vertices[:, 2].min() + vertices[:, 2].max()
        views.append(("contact patch", ABOVE if 2 * near[:, 2].mean() >= half else BELOW, all_cells, near))
    for _, view, shown_cells, region in views:
        plotter.clear_actors()
        for name, facets in _visible_facets(mesh, shown_cells, ("contact", "fixed")).items():
            if facets.size:
                faces = pyvista.PolyData.from_regular_faces(vertices, np.ascontiguousarray(mesh.facets[:, facets].T))
                plotter.add_mesh(faces, color=colours[name], **_EDGES, **_LIGHT)
        aim(plotter, region, 0.0 if region is vertices else 0.1 * float(np.ptp(region, axis=0).max()), view)
        images.append(shoot(plotter))
    plotter.close()
    cells = "tetrahedra" if len(mesh.t) == 4 else "hexahedra"
    with album(crop(images), [heading for heading, *_ in views], path, "Mesh of the seat", 2) as figure:
        figure.legend(
            handles=[load_matplotlib().patches.Patch(color=colours[name], label=name) for name in ("contact", "fixed")],
            loc="outside lower center",
            ncols=2,
            title=f"{mesh.nelements} {cells}, {mesh.doflocs.shape[1]} nodes; edges drawn straight",
            title_fontsize=8,
        )


def _visible_facets(mesh: Any, elements: NDArray[np.bool_], groups: tuple[str, ...]) -> dict[str, NDArray[np.int64]]:
    """Return the facets around the ``elements``: each named group, the rest of the "surface", and those "inside"
    that the cut exposes."""
    first, second = mesh.f2t
    outer = second < 0
    shown = np.where(outer, elements[first], elements[first] != elements[second])
    visible = {"inside": np.flatnonzero(shown & ~outer)}
    unnamed = shown & outer
    for name in groups:
        facets = np.asarray(mesh.boundaries.get(name, np.zeros(0)), dtype=np.int64)
        visible[name] = facets[shown[facets]]
        unnamed[facets] = False
    return {**visible, "surface": np.flatnonzero(unnamed)}


_POINTS = 8  # number of points drawn on each curved edge


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
    for curves, colour, width, label in groups:
        lines = load_matplotlib().collections.LineCollection(
            list(curves), colors=colour, linewidths=width, label=label or None, capstyle="round"
        )
        axes.add_collection(lines)
    axes.set_aspect("equal")
    axes.set(xlabel="r [mm]", ylabel="z [mm]")


def _window(patch: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the corners of a square around the patch, of twice its width, two thirds of it below, in the body."""
    low, high = patch.min(axis=(0, 1)), patch.max(axis=(0, 1))
    half = max(float(np.max(high - low)), 1e-6)
    middle = (low + high) / 2 - np.array([0.0, half / 3])
    return middle - half, middle + half


def _curves(mesh: Any, facets: NDArray[np.int64]) -> NDArray[np.float64]:
    """Return points (facets, points, 2) along edges [m], by the mapping of the mesh."""
    along = np.linspace(0.0, 1.0, _POINTS)[None, :]
    return np.asarray(mesh.mapping().G(along, find=facets)).transpose(1, 2, 0)


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
