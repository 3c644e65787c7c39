"""Files of bodies in motion: HDF5 for reports, VTK for ParaView."""

import json
import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from impact.files.safe_files import whole_file, write_whole
from impact.greens.base import Array
from impact.pictures.drawing import PictureError
from impact.storage.hdf5 import StorageError, finite_array, opened, written
from seatfem.pictures.frames import Frames
from seatfem.pictures.rendering import import_pyvista

MOST_TRIANGLES: Final = 24_000  # most triangles of a body that are kept: of 12,000 flat sections had too few for a wave
FINEST: Final = 32_767  # steps from 0 to the largest displacement
UNTOLD: Final = 65_535  # stored number of an unknown value
"""Values take the steps below it, from the lowest to the highest."""
MOST_POINTS: Final = 100_000  # most points of a body that are read
MOST_PLACES: Final = 10_000_000  # most coordinates in all frames that are read
BEYOND: Final = 1e30  # limit, in SI units, of coordinates, displacements and ends of scales in a sound file
CONTENT: Final = "moving body"
OF_FRAMES: Final = ("time", "frequency", "modal_mass")
"""Fields of each frame that are kept where they are known."""
KEPT: Final[Mapping[str, str]] = {
    "modes.h5": "Modes in motion",
    "stress_wave.h5": "Stress wave in motion",
    "reed_stress_wave.h5": "Stress wave in the reed, in motion",
    "landing.h5": "Landing in motion",
}
"""Files of bodies in the folder of a run, and what they show."""
SOURCES: Final[Mapping[str, str]] = {
    "modes.h5": "seatfem modes into the same folder, or a run that reduces the seat by its modes",
    "stress_wave.h5": "frames = 24 in [stress] of the scene",
    "reed_stress_wave.h5": "frames = 24 in [stress], and a reed of plate elements",
    "landing.h5": "a reed of plate elements that lands on a lip in segments",
}
"""The words that tell a user how each file of `KEPT` is made."""


def save_moving(frames: Frames, path: str | os.PathLike[str]) -> None:
    """Write a body, with `MOST_TRIANGLES` of it at most, to an HDF5 file, whole or absent.

    Displacements are kept to 1/32767 of the largest, values to 1/65534 of their scale: what lies beyond it is not told.

    Raises:
        PictureError: parts that do not fit together; pyvista is missing, and there are too many triangles.
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
    """Read what `save_moving` wrote. Raises `StorageError` of a file that is damaged, or larger than it may be."""
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
    """Return the body with at most `MOST_TRIANGLES`, on some of its own points; edges stay."""
    count = len(frames.triangles)
    if count <= MOST_TRIANGLES:
        return replace(frames, before=count)
    pyvista = import_pyvista()
    body = pyvista.PolyData.from_regular_faces(frames.points, frames.triangles)
    body.point_data["number"] = np.arange(len(frames.points))
    fewer = body.decimate_pro(1 - MOST_TRIANGLES / count, feature_angle=30.0, preserve_topology=True)
    kept = np.asarray(fewer.point_data["number"], dtype=np.int64)
    return replace(
        frames,
        points=frames.points[kept],
        triangles=np.asarray(fewer.regular_faces, dtype=np.int64),
        displacement=frames.displacement[:, kept],
        values=None if frames.values is None else frames.values[:, kept],
        before=count,
    )


def write_moving(frames: Frames, path: str | os.PathLike[str]) -> None:
    """Write NAME.pvd and NAME/0001.vtu, ... for viewers: displacement and, where there are any, values.

    The body is at rest: warp it by its displacement. Frames are at their times [s], modes at their frequencies [Hz], or
    at their numbers.

    Raises:
        PictureError: pyvista is missing, parts that do not fit together.
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
    """Write the body at rest with ``fields`` at its points as a .vtu. Raises `PictureError` without pyvista."""
    pyvista = import_pyvista()
    body = pyvista.PolyData.from_regular_faces(frames.points, frames.triangles).cast_to_unstructured_grid()
    for name, values in fields.items():
        body.point_data[name] = values
    with whole_file(path) as temporary:
        body.save(temporary)
