"""Hot spots of both bodies, and stress histories at the largest of them, on file and as a picture."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from impact.files.csv_table import write_csv
from impact.greens.base import Array
from impact.quantities import finite_or_none
from impact.storage.hdf5 import StorageError, finite_array, opened, written
from seatfem.pictures import stress_plot
from seatfem.structures.fields import recovery, sites
from seatfem.study.impacts import life
from seatfem.study.runs import seat_fields, stresses
from seatfem.study.runs.round import Round
from seatfem.units import axes_of, place_words

if TYPE_CHECKING:
    from seatfem.pictures.rendering import Picture
    from seatfem.study.impacts.plate_stress import PlatePeaks
    from seatfem.study.runs.seat_stress import SeatStress


COMPONENTS: Final = ("xx", "yy", "zz", "yz", "xz", "xy")
AROUND: Final = ("rr", "tt", "zz", "tz", "rz", "rt")  # stress components of a body of revolution
LIP: Final = "lip"
LEAST: Final = 0.1  # least stress of a spot with a history, over the largest in its body
MOST_SHOWN: Final = 8  # most histories in the picture
MOST_NUMBERS: Final = 16_000_000  # most values of all histories together; longer runs are stored at every k-th step
HISTORIES_FILE: Final = "stress.h5"
PICTURE: Final = "stress_histories.png"
_FILES: Final = {"seat": "hot_spots.csv", "reed": "reed_hot_spots.csv"}


@dataclass(frozen=True)
class Spot:
    """A hot spot.

    Attributes:
        body, part: "seat" or "reed", and the name of the part of that body.
        at: (d,) position [m].
        edge: distance to the nearest singular edge [m]; ``inf`` if there is none.
        value, time: largest von Mises stress (beam: |bending stress|) after the first touch, and its time [Pa, s].
        component, leading: name and signed value [Pa] of the largest stress component at that time.
    """

    body: str
    part: str
    at: tuple[float, ...]
    edge: float
    value: float
    time: float
    component: str
    leading: float

    @staticmethod
    def from_stress(
        body: str, part: str, at: Array, edge: float, time: float, state: Array, names: Sequence[str]
    ) -> Spot:
        """Return the spot with the stress ``state`` (6,), or (1,) for a beam, at ``time``."""
        value = float(recovery.von_mises(state)) if len(state) > 1 else abs(float(state[0]))
        k = int(np.argmax(np.abs(state)))
        return Spot(body, part, tuple(map(float, at)), edge, value, time, names[k], float(state[k]))

    @property
    def name(self) -> str:
        """Return body, part and position in words."""
        return f"{self.body}, {self.part}, {place_words(self.at, self.body)}"


@dataclass(frozen=True)
class History:
    """Stress history (6, m), or (1, m) for a beam, of the ``components`` at a spot, over `Spots.time` [Pa]."""

    spot: Spot
    components: tuple[str, ...]
    stress: Array

    @property
    def leading(self) -> Array:
        """Return the (m,) history of the component that is the largest at the spot's time."""
        return np.asarray(self.stress[self.components.index(self.spot.component)])

    @property
    def mises(self) -> Array | None:
        """Return the (m,) history of von Mises stress; ``None`` for a beam."""
        return recovery.von_mises(self.stress.T) if len(self.components) > 1 else None


@dataclass(frozen=True)
class Spots:
    """All hot spots of a run, the largest of each body first, and the histories of some of them over ``time`` (m,)."""

    all: tuple[Spot, ...] = ()
    histories: tuple[History, ...] = ()
    time: Array = field(default_factory=lambda: np.zeros(0))

    @staticmethod
    def from_round(done: Round, seat: SeatStress | None, plate: PlatePeaks | None) -> Spots:
        """Return the spots of a round: of a beam or of the ``plate``, and of the ``seat`` if its stress is known."""
        named = 0 if seat is None else len(seat.points)
        stride = math.ceil(6 * (MOST_SHOWN + named) * len(done.result.time) / MOST_NUMBERS)
        reed_histories = _plate_histories(done, plate, stride) if plate is not None else _beam_histories(done, stride)
        seat_spots, seat_histories = ((), ()) if seat is None else _seat_spots(done, seat, stride)
        return Spots(
            (*(history.spot for history in reed_histories), *seat_spots),
            (*reed_histories, *seat_histories),
            done.result.time[::stride],
        )


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


def spot_pictures(done: Round, spots: Spots) -> list[Picture]:
    """Return stress_histories.png."""
    shown = spots.histories[:MOST_SHOWN]
    if not shown:
        return []
    curves = [(each.spot.name, each.spot.component, each.leading, each.mises, each.spot.time) for each in shown]
    title = f"{done.plan.scene.title or 'Stress'}: histories at the hot spots"
    return [
        (
            PICTURE,
            partial(
                stress_plot.plot_stress_histories,
                spots.time,
                curves,
                touch=done.touch,
                title=title,
            ),
        )
    ]


def _beam_histories(done: Round, stride: int) -> list[History]:
    """Return a beam's stress histories at its root, contacts and largest stress, in the face towards the seat."""
    scene, stress = done.plan.scene, done.stress
    if stress is None:
        return []
    at, touch = scene.geometry.contact_at, done.touch
    places = at if isinstance(at, tuple) else () if at is None else (at,)
    worst = (stress.after_contact or stress.initial).at
    positions = {
        f"{1e3 * worst:.4g} mm from the root": worst,
        **dict(zip(("contact", "stopper"), places, strict=False)),
    }
    positions["root"], spot_histories = 0.0, []
    for name, course in life.beam_histories(scene.geometry, done.striker, done.touches, stress, few=True):
        place, _, face = name.partition(", face ")
        if face == "towards the seat" and place in positions:
            k = _peak_step(done, np.abs(course), touch)
            time, where = float(done.result.time[k]), np.array([positions[place]])
            spot = Spot.from_stress("reed", place, where, math.inf, time, course[k : k + 1], COMPONENTS)
            spot_histories.append(History(spot, COMPONENTS[:1], course[None, ::stride]))
    return _foremost(spot_histories)


def _plate_histories(done: Round, plate: PlatePeaks, stride: int) -> list[History]:
    """Return the stress histories at the von Mises peaks of all parts of a plate, in the face away from the seat."""
    parts = stresses.parts_of_plate(done, plate.field.points)
    peak = plate.found.after_contact if math.isfinite(plate.found.spans.touch) else plate.found.initial
    by_part = [np.flatnonzero(parts == part) for part in np.unique(parts)]
    chosen = np.array([which[peak.von_mises[which].argmax()] for which in by_part])
    field, force, dt = plate.field.at(chosen), stresses.plate_pushes(done, done.touches), done.result.dt
    times, edges = (
        peak.von_mises_time[chosen],
        sites.edge_distances(field.points, stresses.singular_of_plate(done)),
    )
    states = recovery.at_own_times(field, force, dt, np.round(times / dt).astype(np.int64))
    spot_histories = []
    for k, course in enumerate(recovery.histories(field, force, dt, stride)):
        part, edge, time = str(parts[chosen[k]]), float(edges[k]), float(times[k])
        spot = Spot.from_stress("reed", part, field.points[k], edge, time, states[k], COMPONENTS)
        spot_histories.append(History(spot, COMPONENTS, course))
    return _foremost(spot_histories)


def _seat_spots(done: Round, seat: SeatStress, stride: int) -> tuple[tuple[Spot, ...], tuple[History, ...]]:
    """Return all hot spots of the seat, and histories at the largest on the lip and elsewhere and at named points."""
    force, dt, names = (
        seat_fields.force_by_port(done, done.touches),
        done.result.dt,
        AROUND if seat.is_around else COMPONENTS,
    )
    times, field = seat.peak.von_mises_time[seat.spots], seat.field.at(seat.spots)
    states = recovery.at_own_times(field, force, dt, np.round(times / dt).astype(np.int64))
    parts = np.where(seat.on_lip[seat.spots], LIP, "body")
    spots = tuple(
        Spot.from_stress("seat", str(part), seat.sites[k], float(seat.singular[k]), float(time), state, names)
        for k, part, time, state in zip(seat.spots, parts, times, states, strict=True)
    )
    first = np.sort(np.unique(parts, return_index=True)[1])
    courses = recovery.histories(field.at(first), force, dt, stride)
    spot_histories = [History(spots[k], names, course) for k, course in zip(first, courses, strict=True)]
    for point, course in zip(seat.named_places, seat.named[:-1], strict=True):
        k = _peak_step(done, recovery.von_mises(course.T), done.touch)
        spot = Spot.from_stress("seat", "named", point, math.inf, float(done.result.time[k]), course[:, k], names)
        spot_histories.append(History(spot, names, course[:, ::stride]))
    return spots, tuple(spot_histories)


def _peak_step(done: Round, size: Array, touch: float) -> int:
    """Return the step at which ``size`` (n + 1,) is largest after the first touch or, without one, in the whole run."""
    first = 0 if math.isnan(touch) else int(np.searchsorted(done.result.time, touch))
    return first + int(size[first:].argmax())


def _foremost(spots: list[History]) -> list[History]:
    least = LEAST * max((each.spot.value for each in spots), default=0.0)
    return sorted((each for each in spots if each.spot.value >= least), key=lambda each: -each.spot.value)
