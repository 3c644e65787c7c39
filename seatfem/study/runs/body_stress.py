"""Stress in each body of a run, as hot spots, fatigue life and maps of margins ask for it."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, ClassVar, Final

import numpy as np
from numpy.typing import NDArray

from impact.greens.base import Array
from impact.notices import Progress
from seatfem.pictures import frames
from seatfem.structures.fields import peaks, recovery
from seatfem.study.impacts.forces import Strike
from seatfem.study.impacts.touches import Touches
from seatfem.study.runs.round import Round
from seatfem.units import place_words

if TYPE_CHECKING:
    from seatfem.pictures.skins import Skin
    from seatfem.structures.fields.solids import AnyField

Histories = Iterable[tuple[str, Array]]
"""Pairs of a place ("body, place") and its stress over the run [Pa]: (n + 1,) uniaxial, or (n + 1, 6) tensors."""
MarginOf = Callable[[Array], float]
"""Function that returns the margin under a history of stress tensors (m, 6) [Pa]."""
ValueOf = Callable[[Iterable[Array]], float]
"""Function that returns the least value of the (m, 6) stress histories of several places [Pa]."""
Errors = Mapping[str, float]
"""Errors of a number of the stress by source."""
COMPONENTS: Final = ("xx", "yy", "zz", "yz", "xz", "xy")
LEAST: Final = 0.1  # least stress of a spot with a history, over the largest in its body
SHARE: Final = 0.3
"""Least range of von Mises stress, over the largest, at which a margin is computed; below, it is 3 times
larger."""
EACH: Final = 8  # points of each part whose life is computed
ONE_FACE: Final = (("", 1.0),)
BOTH_FACES: Final = ((", face away from the seat", 1.0), (", face towards the seat", -1.0))


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

    @staticmethod
    def at_peak(
        body: str, part: str, at: Array, stress: Array, touches: Touches, names: Sequence[str], stride: int
    ) -> History:
        """Return every ``stride``-th step of a ``stress`` (6 or 1, n + 1), and its state when it is largest after the
        first touch or, without one, in the whole run, as a spot."""
        names, time, touch = tuple(names[: len(stress)]), touches.seat.time, touches.touch
        size = recovery.von_mises(stress.T) if len(stress) > 1 else np.abs(stress[0])
        first = 0 if math.isnan(touch) else int(np.searchsorted(time, touch))
        k = first + int(size[first:].argmax())
        spot = Spot.from_stress(body, part, at, math.inf, float(time[k]), stress[:, k], names)
        return History(spot, names, stress[:, ::stride])

    @property
    def leading(self) -> Array:
        """Return the (m,) history of the component that is the largest at the spot's time."""
        return np.asarray(self.stress[self.components.index(self.spot.component)])

    @property
    def mises(self) -> Array | None:
        """Return the (m,) history of von Mises stress; ``None`` for a beam."""
        return recovery.von_mises(self.stress.T) if len(self.components) > 1 else None


def foremost(histories: Iterable[History]) -> tuple[History, ...]:
    """Return the histories of the spots with at least `LEAST` of the largest stress, the largest first."""
    largest_first = sorted(histories, key=lambda each: -each.spot.value)
    return tuple(each for each in largest_first if each.spot.value >= LEAST * largest_first[0].spot.value)


class BodyStress(ABC):
    """The stress in a body under the forces of one run; ``role``: "reed" or "seat"."""

    role: ClassVar[str]

    @property
    @abstractmethod
    def relative_bar(self) -> float:
        """Return the relative error bar of the largest stress; nan if it has none."""

    @abstractmethod
    def under(self, strike: Strike) -> BodyStress:
        """Return the stress under the forces of another run."""

    @abstractmethod
    def histories(self, first: int) -> Histories:
        """Yield name and stress history of each place that may fail by the load block after the ``first`` steps."""

    @abstractmethod
    def hot_spots(self, stride: int) -> tuple[tuple[Spot, ...], tuple[History, ...]]:
        """Return the hot spots, and the histories of the largest in every ``stride``-th step."""

    def errors_of_value(self, done: Round, value_of: ValueOf, first: int, turn: float, progress: Progress) -> Errors:
        """Return the errors, by source, of the least value of stress histories at the places that may have it, by the
        load block after the ``first`` steps, the last ``turn`` [s] of a run; empty of a body of which only the error of
        the largest stress is known."""
        return {}

    def margin_map(self, margin_of: MarginOf, first: int) -> frames.Frames | None:
        """Return the surface with its fatigue margins by the load block after the ``first`` steps; ``None`` for a body
        in closed form."""
        return None

    @property
    def wave_span(self) -> tuple[float, float]:
        """Return start and end of the time in which its stress wave is shown [s]; nan without a contact."""
        return math.nan, math.nan

    def wave(self, steps: range) -> frames.Frames | None:
        """Return the stress wave at the ends of the time ``steps``; ``None`` for a body in closed form."""
        return None


@dataclass(frozen=True)
class ClosedFormStress(BodyStress):
    """The stress in a striker that is known in closed form, or of which none is known."""

    role: ClassVar[str] = "reed"

    strike: Strike
    relative_bar: float = math.nan

    def under(self, strike: Strike) -> ClosedFormStress:
        return replace(self, strike=strike)

    def histories(self, first: int) -> Histories:
        """Yield the histories that the kind of body states, those at the places of its largest stresses included."""
        stress = self.strike.stress
        peaks = (stress.initial, stress.after_contact, stress.largest)
        if (known := self.strike.known_stress) is not None:
            for name, history in known.histories({peak.at for peak in peaks if peak.is_known}):
                yield f"{self.role}, {name}", history

    def hot_spots(self, stride: int) -> tuple[tuple[Spot, ...], tuple[History, ...]]:
        stress, known, touches = self.strike.stress, self.strike.known_stress, self.strike.touches
        if known is None or not stress.is_known:
            return (), ()
        spots = known.spots((stress.after_contact if stress.after_contact.is_known else stress.initial).at)
        histories = foremost(
            History.at_peak(self.role, part, at, history.reshape(len(history), -1).T, touches, COMPONENTS, stride)
            for part, at, history in spots
        )
        return tuple(each.spot for each in histories), histories


@dataclass(frozen=True)
class FieldStress(BodyStress):
    """The stress in a body of finite elements, by its field.

    Attributes:
        strike: the run.
        field: stress at P points of the surface for any forces on the ports.
    """

    faces: ClassVar[tuple[tuple[str, float], ...]] = ONE_FACE
    """This names each face whose stress the field gives, with its factor on the stress."""
    each: ClassVar[int] = EACH
    """Number of points of each part that may fail."""

    strike: Strike
    field: AnyField

    @property
    @abstractmethod
    def force(self) -> Array:
        """Return the (n + 1, ports) forces on the ports in the run [N]."""

    @property
    def dt(self) -> float:
        """Return the time step [s]."""
        return self.strike.dt

    @property
    @abstractmethod
    def regions(self) -> NDArray[np.str_]:
        """Return the (P,) names of the parts on which the points lie."""

    @property
    def counted(self) -> NDArray[np.bool_]:
        """Return the (P,) mask of the points whose life counts."""
        return np.ones(len(self.field.points), dtype=bool)

    @property
    def likely(self) -> NDArray[np.int64]:
        """Return the points among which those with the largest stress ranges are, by default all."""
        return np.arange(len(self.field.points))

    @property
    def components(self) -> tuple[str, ...]:
        """Return the names of the stress components."""
        return COMPONENTS

    @abstractmethod
    def map_to_skin(self, values: Array) -> tuple[Skin, Array]:
        """Return the visible surface, and values (P,) of the field's points at its (S,) nodes, nan elsewhere."""

    def histories(self, first: int) -> Histories:
        likely = self.likely
        ranges = peaks.mises_range(self.field.at(likely), self.force, self.dt, since=first)
        hottest = likely[peaks.hottest(ranges, self.regions[likely], self.each)]
        hottest = hottest[self.counted[hottest]]
        yield from self._named_histories(self.field.at(hottest), self.regions[hottest])

    def _named_histories(self, field: AnyField, parts: NDArray[np.str_]) -> Histories:
        """Yield place and stress (n + 1, 6) at the points of a field, in each face."""
        histories = recovery.tensor_histories(field, self.force, self.dt)
        for point, part, stress in zip(field.points, parts, histories, strict=True):
            at = f"({', '.join(f'{1e3 * x:.3g}' for x in point)}) mm"
            place = ", ".join(filter(None, (self.role, part, at)))
            for face, sign in self.faces:
                yield f"{place}{face}", sign * stress

    def spots_at(
        self, which: NDArray[np.int64], parts: NDArray[np.str_], edges: Array, times: Array
    ) -> tuple[Spot, ...]:
        """Return the spots at the points ``which`` (k,) at their own ``times`` (k,) [s]; ``edges``: (k,) distances from
        singular edges [m]."""
        steps, field = np.round(times / self.dt).astype(np.int64), self.field.at(which)
        states = recovery.at_own_times(field, self.force, self.dt, steps)
        return tuple(
            Spot.from_stress(self.role, str(part), at, float(edge), float(time), state, self.components)
            for at, part, edge, time, state in zip(field.points, parts, edges, times, states, strict=True)
        )

    def histories_at(self, which: NDArray[np.int64], spots: Iterable[Spot], stride: int) -> list[History]:
        """Return the histories of ``spots`` at the points ``which``."""
        courses = recovery.histories(self.field.at(which), self.force, self.dt, stride)
        return [History(spot, self.components, course) for spot, course in zip(spots, courses, strict=True)]

    def margins(self, margin_of: MarginOf, first: int = 0) -> Array:
        """Return the margins (P,) of each point by the load block after the ``first`` steps, in its worse face; nan
        where the range is below `SHARE` of the largest, and where the life does not count. Raises as ``margin_of``."""
        force = self.force
        ranges = peaks.mises_range(self.field, force, self.dt, since=first)
        hot = np.flatnonzero(ranges >= SHARE * ranges.max())
        factors = np.full(len(ranges), np.nan)
        histories = recovery.tensor_histories(self.field.at(hot), force, self.dt)
        for number, history in zip(hot, histories, strict=True):
            factors[number] = min(margin_of(sign * history[first:]) for _, sign in self.faces)
        return np.where(self.counted, factors, np.nan)

    def margin_map(self, margin_of: MarginOf, first: int) -> frames.Frames | None:
        return frames.margin_frames(self.role, *self.map_to_skin(self.margins(margin_of, first)))


def rows_of(points: Array, among: Array) -> NDArray[np.int64]:
    """Return for each of the points (P, d) the number of the identical row of ``among`` (n, d)."""
    place = {tuple(each): k for k, each in enumerate(among.tolist())}
    return np.array([place[tuple(each)] for each in points.tolist()])
