"""Pictures by VTK of the seat's mesh and of its modes, still and moving, and files for ParaView."""

from __future__ import annotations

import os
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from impact.files.safe_files import whole_file
from impact.pictures.drawing import ORANGE, SKY, PictureError, load_matplotlib, sheet
from impact.quantities import text
from seatfem.pictures.cell_grid import VTK_TYPES, CellGrid, Skin
from seatfem.pictures.frames import Frames, mode_frames
from seatfem.pictures.moving import album, plot_frames, swing_frame
from seatfem.pictures.rendering import ABOVE, BELOW, aim, crop, import_pyvista, load_pyvista, new_plotter, shoot
from seatfem.structures.model import Array

if TYPE_CHECKING:
    from types import ModuleType

    from matplotlib.axes import Axes


_LIGHT = {"ambient": 0.42, "diffuse": 0.62, "specular": 0.1}
_EDGES = {"show_edges": True, "edge_color": "#3F454C", "line_width": 1.0}
_BODY, _INSIDE = "#E4E7EA", "#F2DFA0"


def plot_modes(
    grid: CellGrid,
    shapes: Sequence[Array],
    frequencies_hz: Sequence[float] | Array,
    path: str | os.PathLike[str],
    *,
    title: str = "Modes of the seat",
    cut: bool = False,
    names: Sequence[str] | None = None,
) -> None:
    """Draw the modes side by side: deformed, coloured by the magnitude of displacement, undeformed edges in grey.

    Args:
        shapes: nodal displacements (3, n) of each mode, any scale.
        frequencies_hz: frequency of each mode [Hz].
        cut: whether to omit the half towards the viewer, for hollow bodies.
        names: text before each frequency [1, 2, ...].

    Raises:
        PictureError: there are no modes, or a package or driver for drawing is missing.
    """
    numbers = [str(k + 1) for k in range(len(shapes))] if names is None else names
    plot_frames(_frames(grid, shapes, frequencies_hz, numbers, cut), path, title=title)


def animate_mode(
    grid: CellGrid,
    shape: Array,
    frequency_hz: float,
    path: str | os.PathLike[str],
    *,
    cut: bool = False,
    frames: int = 24,
) -> None:
    """Draw one mode as an endless GIF of one period in ``frames`` (even) pictures.

    Raises:
        PictureError: a package or driver for drawing is missing.
    """
    swing_frame(_frames(grid, [shape], [frequency_hz], [""], cut), path, pictures=frames)


def write_vtu(
    grid: CellGrid, shapes: Sequence[Array], frequencies_hz: Sequence[float] | Array, path: str | os.PathLike[str]
) -> None:
    """Write the modes as vector fields on the mesh, curved cells included, for ParaView (Warp By Vector).

    Raises:
        PictureError: pyvista is missing.
    """
    _check(grid, shapes, frequencies_hz)
    pyvista = import_pyvista()
    data = _unstructured(pyvista, grid.points, grid.cells)
    for k, (shape, frequency) in enumerate(zip(shapes, frequencies_hz, strict=True), start=1):
        data.point_data[f"mode {k:02d}, {float(frequency):.6g} Hz"] = np.ascontiguousarray(np.asarray(shape).T)
    with whole_file(path) as temporary:
        data.save(temporary)


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


def _frames(
    grid: CellGrid, shapes: Sequence[Array], frequencies_hz: Sequence[float] | Array, names: Sequence[str], cut: bool
) -> Frames:
    """Return the surface of a grid, or of its half away from the viewer if it is cut, with its modes scaled to 1."""
    _check(grid, shapes, frequencies_hz)
    pyvista = load_pyvista()
    volume = _unstructured(pyvista, grid.points, grid.linear_cells)
    for k, shape in enumerate(shapes):
        volume.point_data[f"u{k}"] = np.asarray(shape, dtype=float).T
    if cut:
        low, high = np.array(volume.bounds[::2]), np.array(volume.bounds[1::2])
        volume = volume.clip(normal=(0.0, -1.0, 0.0), origin=(low + high) / 2)
    cells = volume.extract_surface(algorithm=None)  # cut cells have up to six corners
    edges = cells.extract_feature_edges(35, boundary_edges=False, manifold_edges=False, non_manifold_edges=False)
    surface = cells.triangulate()
    labels = [f"{name}:  {text(float(f), 'Hz', 4)}".lstrip(": ") for name, f in zip(names, frequencies_hz, strict=True)]
    skin = Skin(surface.points, surface.regular_faces, *(2 * [np.arange(surface.n_points)]))
    frames = mode_frames(skin, [surface.point_data[f"u{k}"] for k in range(len(shapes))], labels, "")
    return replace(frames, edges=edges.points[edges.lines.reshape(-1, 3)[:, 1:]])


def _unstructured(pyvista: ModuleType, points: Array, cells: NDArray[np.int64]) -> Any:
    counted = np.column_stack([np.full(len(cells), cells.shape[1]), cells]).ravel()
    kinds = np.full(len(cells), VTK_TYPES[cells.shape[1]], dtype=np.uint8)
    return pyvista.UnstructuredGrid(counted, kinds, points)


def _check(grid: CellGrid, shapes: Sequence[Array], frequencies_hz: Sequence[float] | Array) -> None:
    if len(shapes) == 0 or len(shapes) != len(frequencies_hz):
        raise PictureError(f"{len(shapes)} shapes and {len(frequencies_hz)} frequencies: give as many, at least one")
    for k, shape in enumerate(shapes):
        if np.shape(shape) != (3, len(grid.points)) or not np.all(np.isfinite(shape)):
            raise PictureError(f"shape {k} is {np.shape(shape)}, must be finite and (3, {len(grid.points)})")


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
