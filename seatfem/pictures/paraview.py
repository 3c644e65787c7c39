"""Bodies in motion for ParaView: one .pvd that names the frames, one .vtu a frame in a folder beside it."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from impact.files.atomic import whole_file, write_whole
from impact.greens.base import Array
from seatfem.pictures.rendering import import_pyvista

if TYPE_CHECKING:
    from seatfem.pictures.moving import Moving

DISPLACEMENT = "displacement [m]"


def write_moving(made: Moving, path: str | os.PathLike[str]) -> None:
    """Write NAME.pvd and NAME/0001.vtu, ... of what a viewer would show: displacement and, where there are any, values.

    The body is at rest: warp it by its displacement. Frames are at their times [s], modes at their frequencies [Hz], or
    at their numbers.

    Raises:
        PictureError: pyvista is missing.
    """
    moments = next(
        each for each in (made.time, made.frequency, np.arange(1.0, 1 + len(made.labels))) if each is not None
    )
    fields: list[dict[str, Array]] = [{DISPLACEMENT: each} for each in made.displacement]
    if made.values is not None:
        for field, values in zip(fields, made.values, strict=True):
            field[f"{made.quantity} [{made.unit}]"] = values
    write_frames(made.points, made.triangles, zip(moments, fields, strict=True), path)


def write_frames(
    points: Array,
    triangles: NDArray[np.int64],
    frames: Iterable[tuple[float, Mapping[str, Array]]],
    path: str | os.PathLike[str],
) -> None:
    """Write the same of fields at the points, by name, at each of the times of ``frames``."""
    pyvista, path = import_pyvista(), Path(path)
    body = pyvista.PolyData.from_regular_faces(points, triangles).cast_to_unstructured_grid()
    entries = []
    for k, (moment, fields) in enumerate(frames, start=1):
        for name, values in fields.items():
            body.point_data[name] = values
        file = path.with_name(path.stem) / f"{k:04d}.vtu"
        file.parent.mkdir(exist_ok=True)
        with whole_file(file) as temporary:
            body.save(temporary)
        entries.append(f'    <DataSet timestep="{float(moment):.9g}" part="0" file="{path.stem}/{file.name}"/>\n')
    collection = (
        f'<VTKFile type="Collection" version="0.1">\n  <Collection>\n{"".join(entries)}  </Collection>\n</VTKFile>\n'
    )
    write_whole(path, f'<?xml version="1.0"?>\n{collection}'.encode())
