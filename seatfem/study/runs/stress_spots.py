"""Hot spots of both bodies, and stress histories at the largest of them, on file and as a picture."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from impact.files.csv_table import write_csv
from impact.greens.base import Array
from impact.quantities import finite_or_none
from impact.storage.hdf5 import StorageError, finite_array, opened, written
from seatfem.pictures import plots
from seatfem.study.runs.body_stress import BodyStress, History, Spot
from seatfem.units import axes_of

if TYPE_CHECKING:
    from seatfem.pictures.rendering import Picture

MOST_SHOWN: Final = 8  # most histories in the picture
MOST_NUMBERS: Final = 16_000_000  # most values of all histories together; longer runs are stored at every k-th step
HISTORIES_FILE: Final = "stress.h5"
PICTURE: Final = "stress_histories.png"
_FILES: Final = {"seat": "hot_spots.csv", "reed": "reed_hot_spots.csv"}


@dataclass(frozen=True)
class Spots:
    """All hot spots of a run, the largest of each body first, and the histories of some of them over ``time`` (m,)."""

    all: tuple[Spot, ...] = ()
    histories: tuple[History, ...] = ()
    time: Array = field(default_factory=lambda: np.zeros(0))

    @staticmethod
    def from_bodies(bodies: Sequence[BodyStress], time: Array, named: int = 0) -> Spots:
        """Return the spots of bodies in a run of the times (n + 1,) [s]; ``named``: number of points that the scene
        names."""
        stride = math.ceil(6 * (MOST_SHOWN + named) * len(time) / MOST_NUMBERS)
        spots, histories = zip(*(body.hot_spots(stride) for body in bodies), strict=True)
        return Spots(tuple(chain(*spots)), tuple(chain(*histories)), time[::stride])


def spot_keys(spots: Spots) -> dict[str, object]:
    """Return for summary.json the list of hot spots of each body that has any."""
    keys: dict[str, object] = {}
    for body in _FILES:
        rows = [
            {
                "von_mises_Pa": spot.value,
                "time_s": spot.time,
                "at_m": list(spot.at),
                "edge_distance_m": finite_or_none(spot.edge),
                "part": spot.part,
                "component": spot.component,
                "component_Pa": spot.leading,
            }
            for spot in spots.all
            if spot.body == body
        ]
        if rows:
            keys[f"{body}_stress_hot_spots"] = rows
    return keys


def write_spots(spots: Spots, folder: Path, *, courses: bool = True) -> tuple[Path, ...]:
    """Write hot_spots.csv (seat), reed_hot_spots.csv and, with ``courses``, the histories in stress.h5."""
    files = []
    for body, file in _FILES.items():
        if not (own := [spot for spot in spots.all if spot.body == body]):
            continue
        places = [f"{axis}_m" for axis in axes_of(own[0].at, body)]
        heads = ("von_mises_Pa", "time_s", *places, "edge_distance_m", "part", "component", "component_Pa")
        rows = ((p.value, p.time, *p.at, p.edge, p.part, p.component, p.leading) for p in own)
        files.append(write_csv(folder / file, heads, rows, digits=9))
    if spots.histories and courses:
        files.append(folder / HISTORIES_FILE)
        with written(files[-1], "stress") as file:
            file.create_dataset("time", data=spots.time, compression="gzip", shuffle=True)
            for number, history in enumerate(spots.histories):
                group = file.create_group(f"{number:02d}")
                group.attrs["name"], group.attrs["components"] = history.spot.name, json.dumps(history.components)
                group.create_dataset("stress", data=history.stress, compression="gzip", shuffle=True)
    return tuple(files)


def load_histories(path: Path) -> tuple[Array, dict[str, Array]]:
    """Return time (m,) [s], and stress (m,) [Pa] by place and component, from a stress.h5.

    Raises:
        StorageError: the file is absent or damaged.
    """
    with opened(path, "stress") as file:
        if sum(group["stress"].size for key, group in file.items() if key != "time") > 2 * MOST_NUMBERS:
            raise StorageError(f"{path}: claims more numbers than a run writes; compute it again")
        courses = {
            f"{group.attrs['name']}, {name}": values
            for key, group in file.items()
            if key != "time"
            for name, values in zip(json.loads(group.attrs["components"]), finite_array(group, "stress"), strict=True)
        }
        return finite_array(file, "time"), courses


def spot_pictures(spots: Spots, touch: float, title: str) -> list[Picture]:
    """Return stress_histories.png; ``touch``: time of the first touch [s]."""
    shown = spots.histories[:MOST_SHOWN]
    if not shown:
        return []
    curves = [(each.spot.name, each.spot.component, each.leading, each.mises, each.spot.time) for each in shown]
    draw = partial(plots.plot_stress_histories, spots.time, curves, touch=touch, title=title)
    return [(PICTURE, draw)]
