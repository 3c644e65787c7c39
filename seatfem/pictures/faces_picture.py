"""Picture of the faces of a part, with numbers on them, from as many sides as are needed to show all."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import scipy
from numpy.typing import NDArray

from impact.pictures.drawing import BLUE, ORANGE, load_matplotlib, sheet
from seatfem.pictures.rendering import Image, aim, load_pyvista, new_plotter, shoot
from seatfem.structures.inspection.cad import Part

if TYPE_CHECKING:
    from types import ModuleType

    from matplotlib.axes import Axes

Mask = NDArray[np.bool_]
View = tuple[float, float, float]

VIEWS: Final[tuple[View, ...]] = (
    (0.45, -1.0, 0.75), (-0.45, 1.0, -0.75), (-0.9, -0.6, 0.5), (0.9, 0.6, -0.5), (0.1, -1.0, 0.1), (-0.1, 1.0, 0.1),
    (1.0, 0.1, 0.1), (-1.0, -0.1, 0.1), (0.05, -0.1, 1.0), (0.05, -0.1, -1.0),
)  # fmt: skip
"""Directions from the body to the camera, tried in this order."""
MOST_VIEWS: Final = 4
SIZE: Final = (900, 760)
LEGIBLE: Final = 150  # pixels of a face above which it is shown well enough
LEAST: Final = 12  # fewest pixels of a face that counts as visible
ROOM, APART = 16, 36  # least distance in pixels from a number to its face's border, and to other numbers
PLAIN, DARK, GHOST = "#E9EBEE", "#2B2F36", "#9AA1AA"
GROUPS: Final = {"contact": ORANGE, "fixed": BLUE}
FURTHER: Final = ("#009E73", "#CC79A7", "#F0E442", "#56B4E9", "#E69F00")  # of Okabe and Ito's palette
LIGHT: Final = {"smooth_shading": True, "ambient": 0.5, "diffuse": 0.55, "specular": 0.05}
INCH: Final = 4.6  # side of one view [inch]
BOX: Final[dict[str, Any]] = {"boxstyle": "round,pad=0.18", "facecolor": "white", "edgecolor": "none", "alpha": 0.85}


@dataclass(frozen=True)
class _Shot:
    """Image of the part, and the number of the face that each pixel shows (height, width); -1 for none."""

    image: Image
    owner: NDArray[np.int64]
    heading: str

    def pixels(self, face: int) -> int:
        return int(np.sum(self.owner == face))


def draw_faces(part: Part, path: str | os.PathLike[str]) -> None:
    """Write the picture: struck faces orange, clamped ones blue, other groups in further colours, numbers on all faces.

    Faces that are visible from no side, such as those between two solids, are drawn alone within the others' outlines.

    Raises:
        PictureError: a package or driver for drawing is missing.
    """
    pyvista = load_pyvista()
    scene = _Scene(pyvista, part)
    shots = scene.shots()
    scene.close()
    shown = {face: max(range(len(shots)), key=lambda k: shots[k].pixels(face)) for face in range(len(part.faces))}
    columns = min(2, len(shots))
    rows = math.ceil(len(shots) / columns)
    with sheet(path, columns * INCH, rows * INCH * SIZE[1] / SIZE[0] + 0.6) as figure:
        axes = np.atleast_1d(figure.subplots(rows, columns)).ravel()
        for ax in axes:
            ax.set_axis_off()
        for k, (ax, shot) in enumerate(zip(axes, shots, strict=False)):
            _show(ax, shot, part, [face for face, best in shown.items() if best == k])
        figure.suptitle(f"Faces of {part.name}", fontsize=11)
        _legend(figure, scene.colours)


class _Scene:
    """Off-screen plotters that show the part."""

    def __init__(self, pyvista: ModuleType, part: Part) -> None:
        self._pyvista, self._part = pyvista, part
        self._plotter = new_plotter(pyvista, SIZE)
        self._flat = pyvista.Plotter(off_screen=True, notebook=False, window_size=list(SIZE))
        self._flat.disable_anti_aliasing()
        used = part.shape.points[np.unique(part.shape.triangles)]
        self._corners, self._margin = used, 0.03 * float(np.linalg.norm(np.ptp(used, axis=0)))
        self._faces = [self._surface(rows) for rows in part.rows]
        self.colours = _colours(part)

    def close(self) -> None:
        self._plotter.close()
        self._flat.close()

    def shots(self) -> list[_Shot]:
        """Return views until every outer face is shown, then views of the hidden faces."""
        every = range(len(self._faces))
        shots = [self._shot(VIEWS[0], every, ""), self._shot(VIEWS[1], every, "")]
        for view in VIEWS[2:]:
            if len(shots) == MOST_VIEWS or not self._poor(shots, LEGIBLE):
                break
            shot = self._shot(view, every, "")
            if any(shot.pixels(face) >= LEGIBLE for face in self._poor(shots, LEGIBLE)):
                shots.append(shot)
        if hidden := self._poor(shots, LEAST):
            shots.append(self._shot(VIEWS[0], hidden, "within"))
            if self._poor(shots, LEAST):
                shots.append(self._shot(VIEWS[1], self._poor(shots, LEAST), "within, from the other side"))
        return shots

    def _poor(self, shots: Sequence[_Shot], pixels: int) -> list[int]:
        """Return the faces that no shot shows with at least so many pixels."""
        return [face for face in range(len(self._faces)) if max(shot.pixels(face) for shot in shots) < pixels]

    def _shot(self, view: View, only: Sequence[int], heading: str) -> _Shot:
        plotter = self._plotter
        plotter.clear_actors()
        for face, surface in enumerate(self._faces):
            if face in only:
                plotter.add_mesh(surface, color=self._colour(face), **LIGHT)
            edges = surface.extract_feature_edges(
                boundary_edges=True, feature_edges=False, non_manifold_edges=False, manifold_edges=False
            )
            if edges.n_points:
                drawn = face in only
                plotter.add_mesh(edges, color=DARK if drawn else GHOST, line_width=2.0 if drawn else 0.8)
        aim(plotter, self._corners, self._margin, view)
        return _Shot(shoot(plotter), self._owners(view, only), heading)

    def _owners(self, view: View, only: Sequence[int]) -> NDArray[np.int64]:
        """Return the number of the face that each pixel shows, from an image in which colours are numbers of faces."""
        flat = self._flat
        flat.clear_actors()
        flat.set_background("white")
        for face, surface in enumerate(self._faces):
            if face in only:
                code = face + 1
                colour = [code % 256 / 255, code // 256 % 256 / 255, 0.0]
                flat.add_mesh(surface, color=colour, lighting=False)
        aim(flat, self._corners, self._margin, view)
        flat.render()
        image = np.asarray(flat.screenshot(return_img=True))[..., :3].astype(np.int64)
        coded = image[..., 0] + 256 * image[..., 1] - 1
        return np.where(image[..., 2] == 0, coded, -1)

    def _colour(self, face: int) -> str:
        groups = self._part.faces[face].groups
        return next((self.colours[name] for name in groups if name in self.colours), PLAIN)

    def _surface(self, rows: NDArray[np.int64]) -> Any:
        triangles = self._part.shape.triangles[rows]
        cells = np.column_stack([np.full(len(triangles), 3), triangles])
        return self._pyvista.PolyData(self._part.shape.points, cells.ravel()).clean()


def _colours(part: Part) -> dict[str, str]:
    further = [name for name in part.shape.groups if name not in GROUPS]
    others = {name: FURTHER[k % len(FURTHER)] for k, name in enumerate(further)}
    return {name: colour for name, colour in (GROUPS | others).items() if name in part.shape.groups}


def _show(ax: Axes, shot: _Shot, part: Part, needed: Sequence[int]) -> None:
    """Draw the image, with the number of each face at the deepest point of its visible part, if there is room.

    ``needed``: faces that no other image shows better; without room, a line leads from the number to the face.
    """
    ax.imshow(shot.image, interpolation="lanczos")
    ax.set_title(shot.heading, fontsize=9)
    occupied: list[tuple[float, float]] = []
    visible = [face for face in range(len(part.faces)) if shot.pixels(face) >= (1 if face in needed else LEGIBLE)]
    for face in sorted(visible, key=lambda face: (face not in needed, shot.pixels(face))):
        number = " = ".join(map(str, part.faces[face].numbers))
        (x, y), room = _deepest(shot.owner == face)
        if room > ROOM and all(math.hypot(x - a, y - b) > APART for a, b in occupied):
            ax.text(x, y, number, bbox=BOX, ha="center", va="center", fontsize=9, color=DARK)
            occupied.append((x, y))
        elif face in needed:
            a, b = _beside((x, y), occupied)
            line = {"arrowstyle": "-", "color": DARK, "linewidth": 0.7}
            ax.annotate(
                number, (x, y), (a, b), bbox=BOX, arrowprops=line, ha="center", va="center", fontsize=9, color=DARK
            )
            ax.plot(x, y, ".", color=DARK, markersize=3)
            occupied.append((a, b))


def _deepest(mask: Mask) -> tuple[tuple[float, float], float]:
    """Return the pixel (x, y) of a mask that is farthest from its border, and its distance."""
    depth = scipy.ndimage.distance_transform_edt(np.pad(mask, 1))[1:-1, 1:-1]
    y, x = np.unravel_index(int(np.argmax(depth)), depth.shape)
    return (float(x), float(y)), float(depth[y, x])


def _beside(place: tuple[float, float], occupied: Sequence[tuple[float, float]]) -> tuple[float, float]:
    """Return a free place for a number near a point, away from the middle of the image."""
    start = math.atan2(place[1] - SIZE[1] / 2, place[0] - SIZE[0] / 2)
    for radius in (48, 70, 95, 125, 160):
        for turn in (0.0, 0.5, -0.5, 1.0, -1.0, 1.6, -1.6, 2.3, -2.3, 3.1):
            x, y = (place[0] + radius * math.cos(start + turn), place[1] + radius * math.sin(start + turn))
            inside = 15 < x < SIZE[0] - 15 and 15 < y < SIZE[1] - 15
            if inside and all(math.hypot(x - a, y - b) > APART for a, b in occupied):
                return x, y
    return place[0] + 48, place[1]


def _legend(figure: Any, colours: Mapping[str, str]) -> None:
    if not colours:
        return
    handles = [
        load_matplotlib().patches.Patch(facecolor=colour, edgecolor=DARK, label=name)
        for name, colour in colours.items()
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=min(6, len(handles)), frameon=False, fontsize=9)
