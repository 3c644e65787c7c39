"""Bodies in motion, drawn as sheets of frames and as films, and their files: HDF5 for reports, VTK for ParaView."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from impact.files.safe_files import whole_file, write_whole
from impact.greens.base import Array
from impact.pictures.drawing import ORANGE, PictureError, load_matplotlib, sheet
from impact.storage.hdf5 import StorageError, finite_array, opened, written
from seatfem.pictures.frames import Frames
from seatfem.pictures.rendering import (
    Image,
    aim,
    crop,
    halved,
    import_pyvista,
    load_pyvista,
    new_plotter,
    shoot,
    write_gif,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLOURS: Final = "viridis"  # colour map that is legible with every common colour blindness, and in grey
UNKNOWN: Final = "#D8DADD"
FILM, SHEET = (1280, 944), (900, 750)  # pixels before images are shrunk, which smooths them in a third of the time
SHOWN: Final = 12  # largest number of frames on a sheet
PERIOD: Final = 1500  # duration of the film of one mode [ms]
EACH: Final = 150  # duration of one time of a run in a film [ms]
OF_EACH: Final = 50  # number of the 256 colours of a film that each colour scale has
LIGHT: Final = {"ambient": 0.55, "diffuse": 0.5, "specular": 0.05}
"""Lighting of bodies whose colours are values: mostly ambient, so that shade does not change them."""
_BAR: Final = {
    "n_labels": 2, "fmt": "%.3g", "label_font_size": 24, "title_font_size": 24, "color": "black",
    "position_x": 0.64, "position_y": 0.86, "width": 0.34, "height": 0.09,
}  # fmt: skip


def draw_frames(
    frames: Frames, shown: Sequence[tuple[int, float]], *, title: str = "", alone: bool = False
) -> list[Image]:
    """Return images of frames; ``shown``: number of each, and phase, the factor on its displacement.

    ``title``: title above each image, which has a colour scale and half the size; ``alone``: the body without them.

    Raises:
        PictureError: a package or driver for drawing is missing, or shapes of arrays are inconsistent.
    """
    frames.check()
    size = SHEET if alone else FILM
    plotter = new_plotter(load_pyvista(), size, shrunk=True)
    stage, images = _Stage(plotter, frames, titled=not alone), []
    for number, phase in shown:
        stage.move(number, phase)
        if not alone:
            heading = f"{title}\n{frames.labels[number]}".strip()
            plotter.add_text(heading, position=(24, size[1] - 96), font_size=17, color="black", name="heading")
        images.append(shoot(plotter) if alone else halved(shoot(plotter)))
    plotter.close()
    return images


def animate_frames(frames: Frames, path: str | os.PathLike[str], *, title: str = "") -> None:
    """Draw an endless GIF of a body at times of a run. Raises as `draw_frames`."""
    images = draw_frames(frames, [(k, 1.0) for k in range(len(frames.labels))], title=title)
    write_gif(images, _own_colours(), path, EACH)


def swing_frame(frames: Frames, path: str | os.PathLike[str], *, pictures: int = 24) -> None:
    """Draw the first mode as an endless GIF of one period in ``pictures`` (even) images. Raises as `draw_frames`."""
    phases = [math.cos(2 * math.pi * k / pictures) for k in range(pictures // 2 + 1)]
    half = draw_frames(frames, [(0, phase) for phase in phases])
    images = [*half, *half[-2:0:-1]]  # the second half of the period repeats the same pictures
    write_gif(images, _own_colours(), path, round(PERIOD / pictures))


def plot_frames(frames: Frames, path: str | os.PathLike[str], *, title: str = "", most: int = SHOWN) -> None:
    """Draw at most so many frames on one sheet: the first modes, or times all over a run. Raises as `draw_frames`."""
    count = min(most, len(frames.labels))
    columns = 0 if frames.time is None else 3 if count > 4 else 2
    last = (count if frames.time is None else len(frames.labels)) - 1
    chosen = np.unique(np.linspace(0, last, count).round().astype(int)).tolist()
    images = crop(draw_frames(frames, [(k, 1.0) for k in chosen], alone=True))
    factor, words = frames.colour_scale
    with album(images, [frames.labels[k] for k in chosen], path, title, columns) as figure:
        library = load_matplotlib()
        scale = library.cm.ScalarMappable(library.colors.Normalize(factor * frames.low, factor * frames.high), COLOURS)
        bar = figure.colorbar(scale, ax=figure.axes, orientation="horizontal", aspect=50, shrink=0.6, pad=0.02)
        bar.set_label(f"{words}\n{frames.footer()}".strip(), fontsize=8)


def plot_margin_map(bodies: Sequence[Frames], path: str | os.PathLike[str], *, title: str) -> None:
    """Draw the fatigue margins of bodies side by side, each in its own colour scale.

    Raises:
        PictureError: a package or driver for drawing is missing, or no margin is finite and positive.
    """
    shown = [each for each in bodies if np.isfinite(each.colours).any() and each.low > 0]
    if not shown:
        raise PictureError("no point has a finite margin above zero to draw: lower the load")
    images = crop([draw_frames(each, [(0, 1.0)], alone=True)[0] for each in shown])
    with album(images, [each.labels[0] for each in shown], path, title, len(shown)) as figure:
        library = load_matplotlib()
        for place, each in zip(figure.axes[:], shown, strict=False):
            scale = library.cm.ScalarMappable(library.colors.LogNorm(each.low, each.high), f"{COLOURS}_r")
            bar = figure.colorbar(scale, ax=place, orientation="horizontal", aspect=40, shrink=0.9, pad=0.02)
            ticks = [each.low * factor for factor in (1.0, 1.5, 2.0, 3.0)] + [each.high]
            bar.set_ticks(ticks, labels=[f"{tick:.3g}" for tick in ticks])
            bar.minorticks_off()
            bar.set_label(
                "margin: factor on stress, below 1 it fails\ngrey: little stress, or none computed", fontsize=8
            )


@contextmanager
def album(
    images: Sequence[Image],
    headings: Sequence[str],
    path: str | os.PathLike[str],
    title: str,
    columns: int = 0,
) -> Iterator[Figure]:
    """Yield the figure of a sheet of images of equal size in rows, below their headings, at most as large as a page."""
    height, width = images[0].shape[:2]
    rows = math.ceil(len(images) / (columns or math.ceil(math.sqrt(1.5 * len(images) * height / width))))
    columns = columns or math.ceil(len(images) / rows)
    cell = min(7.0 / columns, min(7.5 / rows, 4.2) * width / height)
    with sheet(path, max(cell * columns + 0.2, 4.0), 0.8 + rows * (cell * height / width + 0.28)) as figure:
        figure.suptitle(title)
        places = figure.subplots(rows, columns, squeeze=False).ravel()
        for place in places:
            place.axis("off")
        for place, image, heading in zip(places, images, headings, strict=False):
            place.imshow(image, interpolation="lanczos")
            place.set_title(heading, loc="center")
        yield figure


class _Stage:
    """Body in a plotter: surface, boundary of an open surface, edges at rest of modes, and overlay."""

    def __init__(self, plotter: Any, frames: Frames, *, titled: bool) -> None:
        pyvista = load_pyvista()
        self._frames, self._scale = frames, frames.exaggeration
        factor, words = frames.colour_scale
        colours, limits = factor * frames.colours, np.array([factor * frames.low, factor * frames.high])
        if frames.logarithmic:
            colours, limits = np.log(np.clip(colours, *limits)), np.log(limits)
        self._colours = colours
        surface = pyvista.PolyData.from_regular_faces(frames.points, frames.triangles)
        surface.point_data["number"] = np.arange(len(frames.points))
        # sharp edges are split once for all frames
        self._body = surface.compute_normals(cell_normals=False, feature_angle=35, split_vertices=True)
        self._body.point_data[words] = colours[0][self._body["number"]]
        self._words, self._moved = words, [(self._body, self._body.points.copy(), self._body["number"])]
        actor = plotter.add_mesh(
            self._body, scalars=words, cmap=f"{COLOURS}_r" if frames.logarithmic else COLOURS, clim=limits.tolist(),
            nan_color=UNKNOWN, show_scalar_bar=False, **LIGHT,
        )  # fmt: skip
        actor.prop.interpolation = "phong"  # by the normals that `move` updates
        rim = surface.extract_feature_edges(feature_edges=False, manifold_edges=False, non_manifold_edges=False)
        if rim.n_points and frames.values is not None:
            plotter.add_mesh(rim, color="#404040", line_width=1.5)
            self._moved.append((rim, rim.points.copy(), rim["number"]))
        if frames.time is None and frames.values is None:
            edges = surface.extract_feature_edges(35, manifold_edges=False, non_manifold_edges=False)
            if edges.n_points:
                plotter.add_mesh(edges, color="#6A6A6A", line_width=2)
        corners = [frames.points]
        self._beside: Any = None
        if (overlay := frames.overlay) is not None:
            corners.append(overlay.points + np.outer(self._scale * overlay.height, (0.0, 0.0, 1.0)))
            quads = np.arange(len(overlay.points)).reshape(-1, 4)
            self._beside = pyvista.PolyData.from_regular_faces(corners[-1], quads)
            self._beside.cell_data["force"] = overlay.values[0]
            plotter.add_mesh(
                self._beside, scalars="force", cmap=_lip_colours(), clim=(0.0, overlay.full), lighting=False,
                show_scalar_bar=False,
            )  # fmt: skip
        if titled:
            if frames.values is not None:
                plotter.add_scalar_bar(words, mapper=actor.mapper, **_BAR)
            plotter.add_text(frames.footer(), position=(24, 20), font_size=13, color="black")
        still = frames.values is not None and not frames.displacement.any()
        margin = 0.0 if still else self._scale * frames.largest + (0.04 * frames.size if titled else 0.0)
        aim(plotter, np.concatenate(corners), margin, frames.view)

    def move(self, number: int, phase: float) -> None:
        """Move the body to the frame of this number, with ``phase`` (-1..1) times its displacement."""
        displacement = phase * self._scale * self._frames.displacement[number]
        for mesh, rest, which in self._moved:
            mesh.points = rest + displacement[which]
        self._body.compute_normals(cell_normals=False, split_vertices=False, consistent_normals=False, inplace=True)
        self._body.point_data[self._words] = self._colours[number][self._moved[0][2]]
        if self._beside is not None and self._frames.overlay is not None:
            self._beside.cell_data["force"] = self._frames.overlay.values[number]


def _lip_colours() -> Any:
    return load_matplotlib().colors.LinearSegmentedColormap.from_list("lip", [UNKNOWN, ORANGE])


def _own_colours() -> Array:
    """Return white, and the colours (n, 3) of both colour scales, 0..255."""
    shares = np.linspace(0.0, 1.0, OF_EACH)
    scales = [load_matplotlib().colormaps[COLOURS](shares), _lip_colours()(shares)]
    return np.concatenate([np.full((1, 3), 255.0), *(255 * scale[:, :3] for scale in scales)])


MOST_TRIANGLES: Final = 24_000  # largest number stored: 12,000 were too few for waves in flat sections
FINEST: Final = 32_767  # number of steps from 0 to the largest displacement
UNTOLD: Final = 65_535  # stored number of an unknown value
"""Stored numbers below it are the steps from the lowest to the highest value."""
MOST_POINTS: Final = 100_000  # largest number of points of a body that is read
MOST_PLACES: Final = 10_000_000  # largest number of coordinates in all frames that is read
BEYOND: Final = 1e30  # limit, in SI units, of coordinates, displacements and ends of scales in a valid file
CONTENT: Final = "moving body"
OF_FRAMES: Final = ("time", "frequency", "modal_mass")
"""Arrays with one entry per frame that are stored if they are known."""
KEPT: Final[Mapping[str, str]] = {
    "modes.h5": "Modes in motion",
    "stress_wave.h5": "Stress wave in motion",
    "reed_stress_wave.h5": "Stress wave in the reed, in motion",
    "landing.h5": "Landing in motion",
}
"""Files of bodies in the folder of a run, and their content."""
SOURCES: Final[Mapping[str, str]] = {
    "modes.h5": "seatfem modes into the same folder, or a run that reduces the seat by its modes",
    "stress_wave.h5": "frames = 24 in [stress] of the scene",
    "reed_stress_wave.h5": "frames = 24 in [stress], and a reed of plate elements",
    "landing.h5": "a reed of plate elements that lands on a lip in segments",
}
"""Instructions that tell a user how each file of `KEPT` is made."""


def save_moving(frames: Frames, path: str | os.PathLike[str]) -> None:
    """Write a body, decimated to `MOST_TRIANGLES`, to an HDF5 file, complete or not at all.

    Displacements are stored in steps of 1/32767 of the largest, values in 1/65534 of their scale, clipped to it.

    Raises:
        PictureError: shapes of arrays are inconsistent, or decimation is needed and pyvista is missing.
    """
    frames.check()
    frames = _decimated(frames)
    with written(path, CONTENT) as file:
        about = {key: getattr(frames, key) for key in ("title", "labels", "quantity", "unit", "note", "before")}
        file.attrs["about"] = json.dumps(about)
        file["span"] = [frames.low, frames.high, frames.largest]
        file["points"], file["triangles"] = frames.points.astype(np.float32), frames.triangles.astype(np.int32)
        packed = {"compression": "gzip", "shuffle": True}
        file.create_dataset("displacement", data=steps_of_displacement(frames), **packed)
        for name in OF_FRAMES:
            if (each := getattr(frames, name)) is not None:
                file[name] = each
        if frames.values is not None:
            file.create_dataset("values", data=steps_of_values(frames), **packed)


def load_moving(path: str | os.PathLike[str]) -> Frames:
    """Return the frames in a file of `save_moving`. Raises `StorageError` if it is damaged or too large."""
    with opened(path, CONTENT) as file:
        about = json.loads(str(file.attrs["about"]))
        number, count, _ = file["displacement"].shape
        if count > MOST_POINTS or number * count > MOST_PLACES:
            raise StorageError(
                f"{path}: {count} points in {number} frames; at most {MOST_POINTS} are read, {MOST_PLACES} in all"
            )
        low, high, largest = (float(value) for value in file["span"][...])
        values = None
        if "values" in file:
            steps = file["values"][...].astype(float)
            values = np.where(steps < UNTOLD, low + (high - low) * steps / (UNTOLD - 1), np.nan)
        fields: dict[str, Any] = {name: str(about[name]) for name in ("title", "quantity", "unit", "note")}
        fields |= {name: finite_array(file, name) if name in file else None for name in OF_FRAMES}
        frames = Frames(
            points=np.asarray(file["points"][...], dtype=float),
            triangles=np.asarray(file["triangles"][...], dtype=np.int64),
            displacement=file["displacement"][...] * (largest / FINEST),
            labels=tuple(str(label) for label in about["labels"]),
            values=values,
            low=low,
            high=high,
            before=int(about["before"]),
            **fields,
        )
    try:
        frames.check()
    except PictureError as problem:
        raise StorageError(f"{Path(path)}: damaged: {problem}; compute it again") from problem
    numbers = (frames.points, frames.displacement, np.array([low, high, largest]))
    if not all((np.abs(each) < BEYOND).all() for each in numbers) or not largest > 0 or frames.size <= 0:
        raise StorageError(
            f"{Path(path)}: damaged: numbers beyond {BEYOND:g} or not finite, or no size; compute it again"
        )
    return frames


def moving_bodies(folder: Path) -> dict[str, Frames]:
    """Return the bodies of `KEPT` in a folder, by file. Raises `StorageError` for a damaged file."""
    return {name: load_moving(folder / name) for name in KEPT if (folder / name).is_file()}


def steps_of_displacement(frames: Frames) -> NDArray[np.int16]:
    """Return displacements (F, n, 3) in steps of 1/32767 of the largest."""
    return np.asarray(np.rint(frames.displacement * (FINEST / frames.largest)), dtype=np.int16)


def steps_of_values(frames: Frames) -> NDArray[np.uint16]:
    """Return values (F, n) in steps from the lowest to the highest; `UNTOLD` for nan."""
    assert frames.values is not None
    share = np.clip((frames.values - frames.low) / ((frames.high - frames.low) or 1.0), 0.0, 1.0)
    return np.where(np.isnan(share), UNTOLD, np.rint((UNTOLD - 1) * share)).astype(np.uint16)


def _decimated(frames: Frames) -> Frames:
    """Return the body with at most `MOST_TRIANGLES`, on a subset of its points."""
    count = len(frames.triangles)
    if count <= MOST_TRIANGLES:
        return replace(frames, before=count)
    pyvista = import_pyvista()
    body = pyvista.PolyData.from_regular_faces(frames.points, frames.triangles)
    body.point_data["number"] = np.arange(len(frames.points))
    fewer = body.decimate_pro(1 - MOST_TRIANGLES / count, feature_angle=30.0, preserve_topology=True)
    points = np.asarray(fewer.point_data["number"], dtype=np.int64)
    return replace(
        frames,
        points=frames.points[points],
        triangles=np.asarray(fewer.regular_faces, dtype=np.int64),
        displacement=frames.displacement[:, points],
        values=None if frames.values is None else frames.values[:, points],
        before=count,
    )


def write_moving(frames: Frames, path: str | os.PathLike[str]) -> None:
    """Write NAME.pvd and NAME/0001.vtu, ... for ParaView: displacement and, if present, values.

    The body is at rest: warp it by its displacement. Frames are stored at their times [s], modes at their frequencies
    [Hz].

    Raises:
        PictureError: pyvista is missing, or shapes of arrays are inconsistent.
    """
    frames.check()
    path, entries, count = Path(path), "", len(frames.labels)
    moments = next(each for each in (frames.time, frames.frequency, np.arange(1.0, 1 + count)) if each is not None)
    path.with_name(path.stem).mkdir(exist_ok=True)
    for k, moment in enumerate(moments):
        file = path.with_name(path.stem) / f"{k + 1:04d}.vtu"
        fields = {"displacement [m]": frames.displacement[k]}
        if frames.values is not None:
            fields[f"{frames.quantity} [{frames.unit}]"] = frames.values[k]
        write_surface(frames, fields, file)
        entries += f'    <DataSet timestep="{float(moment):.9g}" part="0" file="{path.stem}/{file.name}"/>\n'
    collection = f'<VTKFile type="Collection" version="0.1">\n  <Collection>\n{entries}  </Collection>\n</VTKFile>\n'
    write_whole(path, f'<?xml version="1.0"?>\n{collection}'.encode())


def write_surface(frames: Frames, fields: Mapping[str, Array], path: str | os.PathLike[str]) -> None:
    """Write the body at rest with ``fields`` at its points as .vtu. Raises `PictureError` without pyvista."""
    pyvista = import_pyvista()
    body = pyvista.PolyData.from_regular_faces(frames.points, frames.triangles).cast_to_unstructured_grid()
    for name, values in fields.items():
        body.point_data[name] = values
    with whole_file(path) as temporary:
        body.save(temporary)
