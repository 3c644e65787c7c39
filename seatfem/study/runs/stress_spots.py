"""Hot spots of both bodies: their list, and histories of stress at the foremost, on file and as a picture."""

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
from seatfem import pictures
from seatfem.structures import fields
from seatfem.study import runs
from seatfem.study.impacts.life import beam_histories
from seatfem.study.runs.round import Round

if TYPE_CHECKING:
    from seatfem.pictures.rendering import Picture
    from seatfem.study.runs import reed_stress, seat_stress


COMPONENTS: Final = ("xx", "yy", "zz", "yz", "xz", "xy")
AROUND: Final = ("rr", "tt", "zz", "tz", "rz", "rt")
LIP: Final = "lip"
LEAST: Final = 0.1  # least stress of a spot with a history, over the largest in its body
MOST_SHOWN: Final = 8
MOST_NUMBERS: Final = 16_000_000  # most numbers of all histories; of a longer run every second step is kept, or third
HISTORIES_FILE: Final = "stress.h5"
PICTURE: Final = "stress_histories.png"
_FILES: Final = {"seat": "hot_spots.csv", "reed": "reed_hot_spots.csv"}


def axes_of(place: Sequence[float] | Array, body: str) -> tuple[str, ...]:
    """Return the names of the coordinates of a place in a body: of a seat's section r and z."""
    return ("r", "z") if len(place) == 2 and body == "seat" else ("x", "y", "z")[: len(place)]


def place_words(place: Sequence[float] | Array, body: str) -> str:
    """Return a place with its axes, in millimetres: ``"(r, z) = (4.62, 6) mm"``."""
    axes, values = ", ".join(axes_of(place, body)), ", ".join(f"{1e3 * x:.3g}" for x in place)
    return f"({axes}) = ({values}) mm" if len(place) > 1 else f"{axes} = {values} mm"


@dataclass(frozen=True)
class Spot:
    """A place of large stress.

    Attributes:
        body, part: "seat" or "reed", and what of it is called so.
        at: (d,) where [m].
        edge: distance from the nearest singular edge [m]; ``inf`` where there is none.
        value, time: the largest von Mises stress since the first touch, of a beam of |bending stress| [Pa, s].
        component, leading: the largest of its components then, with its sign, and its name [Pa].
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
        """Return the spot of the stress (6,), or (1,) of one axis, at its time."""
        value = float(fields.recovery.von_mises(state)) if len(state) > 1 else abs(float(state[0]))
        k = int(np.argmax(np.abs(state)))
        return Spot(body, part, tuple(map(float, at)), edge, value, time, names[k], float(state[k]))

    @property
    def name(self) -> str:
        """Return its body, part and place in words."""
        return f"{self.body}, {self.part}, {place_words(self.at, self.body)}"


@dataclass(frozen=True)
class History:
    """Stress (6, m) or, of one axis, (1, m), of the ``components``, at a spot, at every ``stride``-th step [Pa]."""

    spot: Spot
    components: tuple[str, ...]
    stress: Array

    @property
    def leading(self) -> Array:
        """Return the history (m,) of the component that is the largest at the spot's time."""
        return np.asarray(self.stress[self.components.index(self.spot.component)])

    @property
    def mises(self) -> Array | None:
        """Return von Mises' stress (m,); ``None`` for one axis."""
        return fields.recovery.von_mises(self.stress.T) if len(self.components) > 1 else None


@dataclass(frozen=True)
class Spots:
    """All hot spots of a run, the largest of each body first, and the histories of some of them over ``time`` (m,)."""

    all: tuple[Spot, ...] = ()
    histories: tuple[History, ...] = ()
    time: Array = field(default_factory=lambda: np.zeros(0))

    @staticmethod
    def from_round(done: Round, seat: seat_stress.SeatStress | None, plate: reed_stress.PlatePeaks | None) -> Spots:
        """Return the spots of a round whose stress is known; of a beam it always is."""
        named = 0 if seat is None else len(seat.points)
        stride = math.ceil(6 * (MOST_SHOWN + named) * len(done.result.time) / MOST_NUMBERS)
        own = _of_plate(done, plate, stride) if plate is not None else _of_beam(done, stride)
        of_seat, others = ((), ()) if seat is None else _of_seat(done, seat, stride)
        return Spots((*(history.spot for history in own), *of_seat), (*own, *others), done.result.time[::stride])


def spot_keys(spots: Spots) -> dict[str, object]:
    """Return for summary.json the lists of both bodies, as far as they have any."""
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
    """Write hot_spots.csv of the seat and reed_hot_spots.csv, and stress.h5 with the ``courses``."""
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
    """Time (m,) [s], and stress (m,) [Pa] by place and component, of a stress.h5.

    Raises:
        StorageError: no such file, or a damaged one.
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
                pictures.stress_plot.plot_stress_histories,
                spots.time,
                curves,
                touch=done.touch,
                title=title,
            ),
        )
    ]


def _of_beam(done: Round, stride: int) -> list[History]:
    """Return the histories at root, contacts and the largest stress of a beam, in the face towards the seat."""
    scene, stress = done.plan.scene, done.stress
    if stress is None:
        return []
    at, touch = scene.geometry.contact_at, done.touch
    places = at if isinstance(at, tuple) else () if at is None else (at,)
    worst = (stress.after_contact or stress.initial).at
    known = {f"{1e3 * worst:.4g} mm from the root": worst, **dict(zip(("contact", "stopper"), places, strict=False))}
    known["root"], kept = 0.0, []
    for name, course in beam_histories(scene.geometry, done.striker, done.touches, stress, few=True):
        place, _, face = name.partition(", face ")
        if face == "towards the seat" and place in known:
            k = _since(done, np.abs(course), touch)
            time, where = float(done.result.time[k]), np.array([known[place]])
            spot = Spot.from_stress("reed", place, where, math.inf, time, course[k : k + 1], COMPONENTS)
            kept.append(History(spot, COMPONENTS[:1], course[None, ::stride]))
    return _foremost(kept)


def _of_plate(done: Round, plate: reed_stress.PlatePeaks, stride: int) -> list[History]:
    """Return the histories of the largest von Mises stress in each part of a plate, in the face away from the seat."""
    parts = runs.reed_stress.parts_of_plate(done, plate.field.points)
    peak = plate.found.after_contact if math.isfinite(plate.found.spans.touch) else plate.found.initial
    own = [np.flatnonzero(parts == part) for part in np.unique(parts)]
    chosen = np.array([which[peak.von_mises[which].argmax()] for which in own])
    some, force, dt = plate.field.at(chosen), runs.reed_stress.plate_pushes(done, done.touches), done.result.dt
    times, edges = (
        peak.von_mises_time[chosen],
        fields.corners.edge_distances(some.points, runs.reed_stress.singular_of_plate(done)),
    )
    states = fields.recovery.at_own_times(some, force, dt, np.round(times / dt).astype(np.int64))
    spot_histories = []
    for k, course in enumerate(fields.recovery.histories(some, force, dt, stride)):
        part, edge, time = str(parts[chosen[k]]), float(edges[k]), float(times[k])
        spot = Spot.from_stress("reed", part, some.points[k], edge, time, states[k], COMPONENTS)
        spot_histories.append(History(spot, COMPONENTS, course))
    return _foremost(spot_histories)


def _of_seat(done: Round, seat: seat_stress.SeatStress, stride: int) -> tuple[tuple[Spot, ...], tuple[History, ...]]:
    """Return all hot spots; the largest on the lip and elsewhere, and the named points, with histories."""
    force, dt, names = (
        runs.seat_fields.force_by_port(done, done.touches),
        done.result.dt,
        AROUND if seat.is_around else COMPONENTS,
    )
    times, own = seat.peak.von_mises_time[seat.spots], seat.field.at(seat.spots)
    states = fields.recovery.at_own_times(own, force, dt, np.round(times / dt).astype(np.int64))
    parts = np.where(seat.on_lip[seat.spots], LIP, "body")
    spots = tuple(
        Spot.from_stress("seat", str(part), seat.sites[k], float(seat.singular[k]), float(time), state, names)
        for k, part, time, state in zip(seat.spots, parts, times, states, strict=True)
    )
    first = np.sort(np.unique(parts, return_index=True)[1])
    courses = fields.recovery.histories(own.at(first), force, dt, stride)
    kept = [History(spots[k], names, course) for k, course in zip(first, courses, strict=True)]
    for point, course in zip(seat.named_places, seat.named[:-1], strict=True):
        k = _since(done, fields.recovery.von_mises(course.T), done.touch)
        spot = Spot.from_stress("seat", "named", point, math.inf, float(done.result.time[k]), course[:, k], names)
        kept.append(History(spot, names, course[:, ::stride]))
    return spots, tuple(kept)


def _since(done: Round, size: Array, touch: float) -> int:
    """Return the step at which ``size`` (n + 1,) is largest since the first touch, or, without one, ever."""
    first = 0 if math.isnan(touch) else int(np.searchsorted(done.result.time, touch))
    return first + int(size[first:].argmax())


def _foremost(found: list[History]) -> list[History]:
    least = LEAST * max((each.spot.value for each in found), default=0.0)
    return sorted((each for each in found if each.spot.value >= least), key=lambda each: -each.spot.value)
