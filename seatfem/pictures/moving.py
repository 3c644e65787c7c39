"""A body in motion, kept for reports and other programs: triangles, where their corners go, and what colours them."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from impact.greens.base import Array
from impact.pictures.drawing import PictureError
from impact.quantities import text
from impact.storage.hdf5 import StorageError, finite_array, opened, written
from seatfem.pictures.landing import Landing
from seatfem.pictures.rendering import import_pyvista
from seatfem.pictures.skin import Skin, skin_of_plate
from seatfem.pictures.stress_wave import StressWave
from seatfem.structures.elements.mindlin import PlateMesh

Integers = NDArray[np.int64]

MOST_TRIANGLES: Final = 24_000  # that are kept of a body: of 12,000 flat sections had too few for a wave
FINEST: Final = 32_767  # steps from 0 to the largest displacement
UNTOLD: Final = 65_535  # in place of a value that is not known
"""Values take the steps below it, from the lowest to the highest."""
MOST_POINTS: Final = 100_000  # that are read
MOST_PLACES: Final = 10_000_000  # in all frames
BEYOND: Final = 1e30  # in SI units: no coordinate, displacement or end of a scale of a sound file
CONTENT: Final = "moving body"
OF_FRAMES: Final = ("time", "frequency", "modal_mass")
"""What is kept of each frame, where it is known."""
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
"""What puts them there."""


@dataclass(frozen=True, eq=False)
class Moving:
    """A body in F frames: modes, or times of a run.

    Attributes:
        title: what is shown.
        points: (n, 3) at rest [m].
        triangles: (m, 3) of them.
        displacement: (F, n, 3) [m]; of modes with 1 as the largest.
        labels: (F,) of each frame.
        time: (F,) [s]; ``None`` of modes.
        values: (F, n) of what colours it, nan where it is not known; ``None``: the size of the displacement does.
        quantity, unit: of the values.
        low, high: ends of their colour scale.
        note: to be said below.
        before: triangles that there were before some were left out.
        frequency, modal_mass: (F,) of modes [Hz], and their modal masses for these shapes [kg]; ``None``: not known.
    """

    title: str
    points: Array
    triangles: Integers
    displacement: Array
    labels: tuple[str, ...]
    time: Array | None = None
    values: Array | None = None
    quantity: str = ""
    unit: str = ""
    low: float = 0.0
    high: float = 1.0
    note: str = ""
    before: int = 0
    frequency: Array | None = None
    modal_mass: Array | None = None

    def check(self) -> None:
        """Raise `PictureError` of what does not fit together."""
        frames, count = len(self.labels), len(self.points) if self.points.ndim == 2 else -1
        whole = self.points.shape == (count, 3) and self.triangles.ndim == 2 and self.triangles.shape[1] == 3
        inside = self.triangles.size == 0 or (self.triangles.min() >= 0 and self.triangles.max() < count)
        each = all(one is None or one.shape == (frames,) for one in (self.time, self.frequency, self.modal_mass))
        fits = self.displacement.shape == (frames, count, 3) and each
        if not whole or not inside or not fits or not frames or not len(self.triangles):
            raise PictureError(
                f"{frames} frames of {count} points need as many displacements, not {self.displacement.shape}"
            )
        if self.values is not None and self.values.shape != (frames, count):
            raise PictureError(f"{frames} frames of {count} points need as many values, not {self.values.shape}")

    @property
    def size(self) -> float:
        """Return the largest extent along an axis [m]."""
        return float(np.ptp(self.points, axis=0).max())

    @property
    def largest(self) -> float:
        """Return the largest displacement of all frames; 1 where nothing moves."""
        return float(np.linalg.norm(self.displacement, axis=2).max()) or 1.0


def moving_modes(
    skin: Skin, shapes: list[Array], labels: list[str], title: str, frequency: Array | None = None
) -> Moving:
    """Return the motion of shapes (n, 3) at the skin's points, scaled to 1; with ``frequency`` mass-normalised."""
    largest = np.array([float(np.linalg.norm(shape, axis=1).max()) or 1.0 for shape in shapes])
    masses = None if frequency is None else largest**-2.0
    scaled = np.array(shapes) / largest[:, None, None]
    motion = Moving(title, skin.points, skin.triangles, scaled, tuple(labels))
    return replace(motion, frequency=frequency, modal_mass=masses)


def moving_wave(wave: StressWave, title: str) -> Moving:
    """Return the motion of a stress wave; raises `PictureError` as `StressWave.check`."""
    wave.check()
    which = wave.skin.which
    return Moving(
        title,
        wave.skin.points,
        wave.skin.triangles,
        np.array([wave.skin.moved(each) for each in wave.displacement]),
        tuple(wave.heading(k) for k in range(len(wave.time))),
        wave.time,
        wave.mises[:, which],
        "von Mises stress",
        "Pa",
        0.0,
        wave.end,
        f"The scale ends at {text(wave.end, 'Pa')}, below which 98 % of all stress lies{wave.note}.",
    )


def moving_landing(landing: Landing, title: str) -> Moving:
    """Return the motion of a plate that lands, coloured by its deflection away from the seat."""
    skin = skin_of_plate(PlateMesh(landing.points, landing.cells))
    deflection = landing.deflection[:, skin.nodes]
    moved = np.zeros((*deflection.shape, 3))
    moved[..., 2] = deflection
    times = zip(landing.time, landing.total, strict=True)
    labels = tuple(f"{text(float(time), 's', 5)}, force {text(float(total), 'N')}" for time, total in times)
    low, high = float(deflection.min()), float(deflection.max())
    colours = (deflection, "deflection", "m", low, high, f"Positive away from the seat; {landing.averaged}.")
    return Moving(title, skin.points, skin.triangles, moved, labels, landing.time, *colours)


def save_moving(made: Moving, path: str | os.PathLike[str]) -> None:
    """Write a body, with `MOST_TRIANGLES` of it at most, to an HDF5 file, whole or absent.

    Displacements are kept to 1/32767 of the largest, values to 1/65534 of their scale: what lies beyond it is not told.

    Raises:
        PictureError: parts that do not fit together; pyvista is missing, and there are too many triangles.
    """
    made.check()
    made = _decimated(made)
    with written(path, CONTENT) as file:
        about = {key: getattr(made, key) for key in ("title", "labels", "quantity", "unit", "note", "before")}
        file.attrs["about"] = json.dumps(about)
        file["span"] = [made.low, made.high, made.largest]
        file["points"], file["triangles"] = made.points.astype(np.float32), made.triangles.astype(np.int32)
        packed = {"compression": "gzip", "shuffle": True}
        file.create_dataset("displacement", data=steps_of_displacement(made), **packed)
        for name in OF_FRAMES:
            if (each := getattr(made, name)) is not None:
                file[name] = each
        if made.values is not None:
            file.create_dataset("values", data=steps_of_values(made), **packed)


def load_moving(path: str | os.PathLike[str]) -> Moving:
    """Read what `save_moving` wrote. Raises `StorageError` of a file that is damaged, or larger than it may be."""
    with opened(path, CONTENT) as file:
        about = json.loads(str(file.attrs["about"]))
        frames, count, _ = file["displacement"].shape
        if count > MOST_POINTS or frames * count > MOST_PLACES:
            raise StorageError(
                f"{path}: {count} points in {frames} frames; at most {MOST_POINTS} are read, {MOST_PLACES} in all"
            )
        low, high, largest = (float(value) for value in file["span"][...])
        values = None
        if "values" in file:
            steps = file["values"][...].astype(float)
            values = np.where(steps < UNTOLD, low + (high - low) * steps / (UNTOLD - 1), np.nan)
        each = {name: finite_array(file, name) if name in file else None for name in OF_FRAMES}
        labels = tuple(str(label) for label in about["labels"])
        motion = Moving(
            str(about["title"]),
            np.asarray(file["points"][...], dtype=float),
            np.asarray(file["triangles"][...], dtype=np.int64),
            file["displacement"][...] * (largest / FINEST),
            labels,
            each["time"],
            values,
            str(about["quantity"]),
            str(about["unit"]),
            low,
            high,
            str(about["note"]),
            int(about["before"]),
            each["frequency"],
            each["modal_mass"],
        )
    try:
        motion.check()
    except PictureError as problem:
        raise StorageError(f"{Path(path)}: damaged: {problem}; compute it again") from problem
    numbers = (motion.points, motion.displacement, np.array([low, high, largest]))
    if not all((np.abs(each) < BEYOND).all() for each in numbers) or not largest > 0 or motion.size <= 0:
        raise StorageError(
            f"{Path(path)}: damaged: numbers beyond {BEYOND:g} or not finite, or no size; compute it again"
        )
    return motion


def moving_bodies(folder: Path) -> dict[str, Moving]:
    """Return what a folder has of `KEPT`. Raises `StorageError` for a damaged file."""
    return {name: load_moving(folder / name) for name in KEPT if (folder / name).is_file()}


def steps_of_displacement(made: Moving) -> NDArray[np.int16]:
    """Return displacements (F, n, 3) in steps of 1/32767 of the largest."""
    return np.asarray(np.rint(made.displacement * (FINEST / made.largest)), dtype=np.int16)


def steps_of_values(made: Moving) -> NDArray[np.uint16]:
    """Return values (F, n) in steps from the lowest to the highest; `UNTOLD` for nan."""
    assert made.values is not None
    share = np.clip((made.values - made.low) / ((made.high - made.low) or 1.0), 0.0, 1.0)
    return np.where(np.isnan(share), UNTOLD, np.rint((UNTOLD - 1) * share)).astype(np.uint16)


def _decimated(made: Moving) -> Moving:
    """Return the body with fewer triangles on some of the same points, where there are too many; edges stay."""
    count = len(made.triangles)
    if count <= MOST_TRIANGLES:
        return replace(made, before=count)
    pyvista = import_pyvista()
    body = pyvista.PolyData.from_regular_faces(made.points, made.triangles)
    body.point_data["number"] = np.arange(len(made.points))
    fewer = body.decimate_pro(1 - MOST_TRIANGLES / count, feature_angle=30.0, preserve_topology=True)
    kept = np.asarray(fewer.point_data["number"], dtype=np.int64)
    return replace(
        made,
        points=made.points[kept],
        triangles=np.asarray(fewer.regular_faces, dtype=np.int64),
        displacement=made.displacement[:, kept],
        values=None if made.values is None else made.values[:, kept],
        before=count,
    )
