"""Measures of a run, whose accuracy a scene may prescribe. A new one is a subclass of `Measure`, in any file."""

from __future__ import annotations

import itertools
import math
from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Final, Literal

import numpy as np

from impact.after import histories
from impact.after.histories import UNKNOWN_STRESS, ReedStress
from impact.after.landings import Landing, find_hardest, pair_landings
from impact.after.result import NO_FILM
from impact.greens.base import Array
from impact.march.grid import TimeGrid
from impact.names import import_all
from seatfem.results import WINGS, ResultSource

LandingChoice = Literal["hardest", "first", "run"]
HARDEST: Final = "landing_"
FIRST: Final = "first_landing_"
PREFIXES: Final[Mapping[LandingChoice, str]] = {"hardest": HARDEST, "first": FIRST, "run": ""}
"""Prefix of the names of measures, by the landing to which they refer."""
OPENING: Final = 0.1
"""Largest relative error assumed for the opening time that separates two groups of contacts; a smaller one is that of
the impulse over this limit, ten times as large."""
LANDING_WORDS: Final[Mapping[str, str]] = {HARDEST: " of the hardest landing", FIRST: " of the first landing", "": ""}


@dataclass(frozen=True)
class Line:
    """A contact along a lip.

    Attributes:
        force: (N + 1, arcs) force on each arc in the steps of ``grid`` [N].
        grid: steps of the run.
        length: length of the centre line, if the arcs are equal, or (arcs,) lengths of the arcs [m].
        share: fraction of the line over which forces are averaged.
        edges: (arcs + 1,) angles at the ends of the arcs [rad]; none if angles do not define places on the line.
        film: (N + 1, arcs) part of the force by a fluid film [N]; 0 without film.
        pieces: parts of the line, as in `impact.after.histories`.
        names: of the lands, one for each piece.
        places: (arcs, 2) mean x and y over each arc from the centre [m].
    """

    force: Array
    grid: TimeGrid
    length: float | Array
    share: float
    edges: Array = field(default_factory=lambda: np.zeros(0))
    film: Array = field(default_factory=lambda: NO_FILM)
    pieces: histories.Pieces = ()
    names: tuple[str, ...] = ()
    places: Array = field(default_factory=lambda: np.zeros((0, 2)))

    @property
    def lengths(self) -> Array:
        """Return the lengths of the arcs (arcs,) [m]."""
        return histories.lengths_of(self.length, self.force.shape[1])

    @property
    def lands(self) -> tuple[slice, ...]:
        """Return the arcs of each face of a lip of several; none of a single one."""
        ends = np.cumsum([0, *(number for number, _ in self.pieces)]).tolist()
        return tuple(slice(*pair) for pair in itertools.pairwise(ends)) if len(self.pieces) > 1 else ()

    def land_of(self, arc: int) -> tuple[str, float]:
        """Return the name of the land of an arc, and the angle of its middle about that land's own centre [deg], nan on
        one that is no ring; ("", nan) on a lip of a single land."""
        if not self.lands:
            return "", math.nan
        number = next(k for k, land in enumerate(self.lands) if land.start <= arc < land.stop)
        line = histories.ClosedLine(self.lengths, self.edges, self.places, self.pieces)
        return self.names[number], math.degrees(line.place_on_ring(arc)[1]) if line.rings else math.nan

    def degrees_at(self, place: float) -> float:
        """Return the angle [deg] at a fraction of the line from the start of the first arc; nan without angles."""
        if not len(self.edges):
            return math.nan
        borders = np.concatenate([[0.0], np.cumsum(self.lengths)]) / self.lengths.sum()
        return round(float(np.degrees(np.interp(place, borders, self.edges))), 6) % 360


@dataclass(frozen=True)
class ContactRecord:
    """Histories of the seat's contact in one run, from which measures are evaluated.

    Attributes:
        force: (n + 1,) total contact force [N].
        dt: time step [s].
        filter_width: averaging time of the filtered peak [s].
        displacement: (n + 1,) displacement of the seat's contact face [m]; ``None`` if not known.
        stress: largest stresses in the reed, if they are known.
        stress_since: start of the landing before and after which ``stress`` is evaluated [s]; nan without one.
        line: forces arc by arc for a contact along a lip, else ``None``.
        film: (n + 1,) part of the force by a fluid film [N]; 0 without film.
        landings: landings on the seat, in order of time.
        asked: landing to which the scene's measures refer.
        strains: (n + 1,) strain at each gauge.
    """

    force: Array
    dt: float
    filter_width: float
    displacement: Array | None = None
    stress: ReedStress = UNKNOWN_STRESS
    line: Line | None = None
    film: Array = field(default_factory=lambda: NO_FILM)
    landings: tuple[Landing, ...] = ()
    asked: LandingChoice = "hardest"
    stress_since: float = math.nan
    strains: tuple[Array, ...] = ()

    def steps_of(self, landing: Landing) -> slice:
        """Return the slice of the time steps of a landing."""
        return slice(round(landing.start / self.dt), round(landing.end / self.dt) + 1)


class Measure(ResultSource, ABC):
    """A result whose accuracy may be prescribed; each subclass with a ``name``, in any file, is a measure.

    Attributes:
        data: what of `ContactRecord` it needs in addition to the force: "displacement", "stress" or "line".
        judged_by: name of another measure of the whole run with the same relative error; "" if it has its own.
        of_some: whether it is omitted from the results of runs in which it is not defined.
        needs: key or table without which a scene cannot ask for it, as "[[gauge]]"; "" if there is none.
    """

    data: ClassVar[tuple[str, ...]] = ()
    judged_by: ClassVar[str] = ""
    of_some: ClassVar[bool] = False
    needs: ClassVar[str] = ""

    def is_known(self, blow: ContactRecord) -> bool:
        """Return whether the measure is defined for this run."""
        return all(getattr(blow, name) is not None for name in self.data)

    @abstractmethod
    def evaluate(self, blow: ContactRecord) -> float:
        """Return its value for the whole run [SI]; 0 without contact."""

    def measure_landing(self, blow: ContactRecord, landing: Landing) -> float | None:
        """Return its value for one landing [SI]; ``None`` if it is not defined."""
        return None

    def jump(self, blow: ContactRecord, share: float) -> float:
        """Return the possible jump of its value [SI] for a relative error ``share`` of the impulse; 0 for measures that
        depend smoothly on the force."""
        return 0.0

    def estimate_landing_jump(self, blow: ContactRecord, landing: Landing, share: float) -> float:
        """Return the same as `jump` for its value for one landing [SI]."""
        return 0.0


class Impulse(Measure):
    """Integral of the force."""

    name, key, words = "impulse", "impulse_Ns", "impulse"
    landing_key = "landing_impulse_Ns"

    def evaluate(self, blow: ContactRecord) -> float:
        return float(np.sum(blow.force[1:])) * blow.dt

    def measure_landing(self, blow: ContactRecord, landing: Landing) -> float:
        """Return the impulse above the quasi-static load."""
        return landing.impulse


class FilteredPeak(Measure):
    """Largest average of the force over the filter's width."""

    name, key, words = "filtered_peak", "filtered_peak_force_N", "peak force"
    landing_key = "landing_filtered_peak_force_N"

    def evaluate(self, blow: ContactRecord) -> float:
        return histories.largest_average(blow.force[1:], blow.dt, blow.filter_width)

    def measure_landing(self, blow: ContactRecord, landing: Landing) -> float:
        """Return the filtered peak with the quasi-static load."""
        return landing.filtered_peak


class ContactDuration(Measure):
    """Duration of the first group of contacts between the solid surfaces, without a film."""

    name, key, words = "contact_duration", "contact_duration_s", "contact duration"
    landing_key = "landing_duration_s"

    def evaluate(self, blow: ContactRecord) -> float:
        landing = self.landing_of(blow)
        return _first(blow.dt * histories.closed_steps(_solid(blow)[1:])) if landing is None else landing.duration

    @staticmethod
    def landing_of(blow: ContactRecord) -> Landing | None:
        """Return the landing that is the whole first group of contacts, if there is one."""
        groups = histories.merged(blow.dt * histories.closed_steps(_solid(blow)[1:]))[:1]
        ends = [(each.start, each.end) for each in blow.landings[: len(groups)]]
        return blow.landings[0] if ends and np.allclose(groups, ends, rtol=0, atol=blow.dt / 2) else None

    def measure_landing(self, blow: ContactRecord, landing: Landing) -> float:
        return landing.duration

    def jump(self, blow: ContactRecord, share: float) -> float:
        """Return the jump of the duration: a contact with an impulse below ``share`` may vanish, and an opening
        near the limit `histories.MERGE` may end the group or not."""
        return self._jump(blow, _solid(blow), share)

    def estimate_landing_jump(self, blow: ContactRecord, landing: Landing, share: float) -> float:
        """Return the same for a landing: by its opening, or the uncertainty of its end if it stays closed."""
        if landing.pressed_on:
            return landing.end_doubt
        solid = _solid(blow)
        groups = histories.merged(blow.dt * histories.closed_steps(solid[1:]))
        beside = groups[(groups[:, 0] > landing.start) & (groups[:, 0] < landing.end + (1 + OPENING) * histories.MERGE)]
        end = max([landing.end, *beside[:, 1]])  # with contacts that may belong to the group
        time = blow.dt * np.arange(len(solid))
        own = (time > landing.start + blow.dt / 2) & (time < end + blow.dt / 2)
        return self._jump(blow, np.where(own, solid, 0.0), share)

    @staticmethod
    def _jump(blow: ContactRecord, solid: Array, share: float) -> float:
        steps = histories.closed_steps(solid[1:])
        if not len(steps):
            return 0.0
        impulse = np.concatenate([[0.0], np.cumsum(solid[1:])])
        borne = np.diff(impulse[steps])[:, 0]
        raw, off = blow.dt * steps, min(OPENING, share / OPENING)
        kept = raw[borne > min(share * impulse[-1], float(borne.max()) / 2)]
        others = (_first(kept), *(_first(raw, histories.MERGE * (1 + by)) for by in (-off, off)))
        return max(abs(other - _first(raw)) for other in others)


def _solid(blow: ContactRecord) -> Array:
    """Return the contact force (n + 1,) without the film [N]."""
    return blow.force - blow.film


def _first(raw: Array, merge: float = histories.MERGE) -> float:
    """Return the duration of the first group of contacts (n, 2) [s]; 0 without contacts."""
    groups = histories.merged(raw, merge)
    return float(groups[0, 1] - groups[0, 0]) if len(groups) else 0.0


class Restitution(Measure):
    """Coefficient of restitution of a free striker, in a run with a single landing."""

    name, key, words = "restitution", "restitution", "restitution"
    landing_key = "landing_restitution"

    def is_known(self, blow: ContactRecord) -> bool:
        return len(blow.landings) == 1 and blow.landings[0].restitution is not None

    def evaluate(self, blow: ContactRecord) -> float:
        return blow.landings[0].restitution or 0.0

    def measure_landing(self, blow: ContactRecord, landing: Landing) -> float | None:
        return landing.restitution


class SeatDisplacement(Measure):
    """Largest displacement of the seat's contact face; exactly 0 without contact."""

    name, key, words = "seat_displacement", "max_seat_displacement_m", "seat displacement"
    landing_key = "landing_max_seat_displacement_m"
    data = ("displacement",)

    def evaluate(self, blow: ContactRecord) -> float:
        return float(np.max(np.abs(blow.displacement))) if np.any(blow.force) else 0.0  # type: ignore[arg-type]

    def measure_landing(self, blow: ContactRecord, landing: Landing) -> float | None:
        if blow.displacement is None:
            return None
        return float(np.max(np.abs(blow.displacement[blow.steps_of(landing)])))


class Stress(Measure):
    """Largest stress in the reed after the first contact."""

    name, key, words = "stress", "peak_reed_stress_after_contact_Pa", "reed stress after first contact"
    landing_key, landing_words = "landing_peak_reed_stress_Pa", "reed stress after landing"
    data = ("stress",)

    def is_known(self, blow: ContactRecord) -> bool:
        return blow.stress.is_known

    def evaluate(self, blow: ContactRecord) -> float:
        peak = blow.stress.after_contact
        return peak.value if peak.is_known else 0.0

    def measure_landing(self, blow: ContactRecord, landing: Landing) -> float | None:
        """Return the largest stress since the landing began."""
        peak = blow.stress.after_landing
        return peak.value if peak.is_known and blow.stress_since == landing.start else None


class GaugeStrain(Measure):
    """Largest magnitude of the strain at any gauge."""

    name, key, words = "gauge_strain", "peak_gauge_strain", "largest strain at a gauge"
    of_some = True
    needs = "[[gauge]]"

    def is_known(self, blow: ContactRecord) -> bool:
        return bool(blow.strains)

    def evaluate(self, blow: ContactRecord) -> float:
        return max(float(np.abs(strain).max()) for strain in blow.strains)


class _AlongLip:
    """Base of measures along a lip: the largest of averages over a part of the lip."""

    def evaluate(self, blow: ContactRecord) -> float:
        """Return the measure over the whole run."""
        assert blow.line is not None
        return self._peak(blow, blow.line, blow.line.force[1:], blow.line.grid.time)

    def measure_landing(self, blow: ContactRecord, landing: Landing) -> float | None:
        """Return the measure for one landing, the quasi-static load included."""
        line = blow.line
        if line is None:
            return None
        within, n = blow.steps_of(landing), len(blow.force) - 1
        rows, edges = line.grid.cut(within.start, min(within.stop, n))
        return self._peak(blow, line, line.force[rows], edges)

    def _peak(self, blow: ContactRecord, line: Line, force: Array, steps: float | Array) -> float:
        raise NotImplementedError


class LineForce(_AlongLip, Measure):
    """Largest force per length of a lip, averaged over a part of it and over the filter's width."""

    name, key, words = "line_force", "line_force_peak_N_per_m", "force per length"
    landing_key = "landing_line_force_peak_N_per_m"
    data = ("line",)

    def _peak(self, blow: ContactRecord, line: Line, force: Array, steps: float | Array) -> float:
        return histories.line_force_peak(force, steps, blow.filter_width, line.length, line.share, line.pieces)[0]


class LineImpulse(_AlongLip, Measure):
    """Largest impulse per length of a lip, averaged over a part of it."""

    name, key, words = "line_impulse", "line_impulse_peak_Ns_per_m", "impulse per length"
    landing_key = "landing_line_impulse_peak_Ns_per_m"
    data = ("line",)

    def _peak(self, blow: ContactRecord, line: Line, force: Array, steps: float | Array) -> float:
        return histories.line_impulse_peak(force, steps, line.length, line.share, line.pieces)[0]


def defined_measures() -> Mapping[str, Measure]:
    """Return an instance of each measure defined so far, by name, those of this module first."""
    return {each.name: each() for each in Measure.__subclasses__() if "name" in vars(each)}


def all_measures() -> Mapping[str, Measure]:
    """Return the measures defined so far and those of wings, by name."""
    import_all(WINGS)
    return defined_measures()


def judged_names(names: Collection[str], landing: LandingChoice) -> tuple[str, ...]:
    """Return the names, in `values_of` a run, of measures for this landing.

    A measure that is defined for whole runs only keeps its name; one with ``judged_by`` takes that name.
    """
    every, prefix = all_measures(), PREFIXES[landing]

    def judged(name: str) -> str:
        measure = every.get(name)
        if measure is None:
            return name
        return measure.judged_by or (prefix + name if measure.landing_key else name)

    return tuple(dict.fromkeys(judged(name) for name in names))


def judged_landings(landings: Sequence[Landing]) -> Mapping[str, Landing]:
    """Return the hardest and the first landing, by the prefix of the names of their values."""
    hard = find_hardest(landings)
    return {} if hard is None else {HARDEST: hard, FIRST: landings[0]}


def judged_landing(landings: Sequence[Landing], asked: LandingChoice) -> Landing | None:
    """Return the landing to which measures refer, the hardest for "run"; ``None`` if there is none."""
    return judged_landings(landings).get(FIRST if asked == "first" else HARDEST)


def values_of(blow: ContactRecord, like: Sequence[Landing]) -> dict[str, float]:
    """Return the measures of a run, and those of its hardest landing, as far as they are known.

    Where measures are asked of the first landing, its own are among them, too.

    ``like``: the landings of this run or of a neighbouring one, whose hardest and first ones are looked for in this
    run; a measure of one that has no partner is infinite.
    """
    values = {name: each.evaluate(blow) for name, each in all_measures().items() if each.is_known(blow)}
    partners = dict(zip(like, pair_landings(like, blow.landings), strict=True))
    for prefix, wanted in judged_landings(like).items():
        if prefix == FIRST and blow.asked != "first":
            continue
        partner = partners[wanted]
        for name, each in all_measures().items():
            if each.landing_key and partner is None:
                values[prefix + name] = math.inf
            elif partner is not None and (value := each.measure_landing(blow, partner)) is not None:
                values[prefix + name] = value
    return values


def describe_measure(name: str) -> str:
    """Return the meaning of a value of a run, with its key in brackets."""
    prefix, measure = _prefix_and_measure(name)
    of_landing = "" if all_measures()[measure].landing_words else LANDING_WORDS[prefix]
    return f"{short_words(name)}{of_landing} ({key_of(name)})"


def short_words(name: str) -> str:
    """Return the meaning of a value of a run, without its key and its landing."""
    prefix, measure = _prefix_and_measure(name)
    entry = all_measures()[measure]
    return (prefix and entry.landing_words) or entry.words


def asked_name(name: str) -> str:
    """Return the name of a value's measure in scenes, without the prefix of the landing."""
    return _prefix_and_measure(name)[1]


def key_of(name: str) -> str:
    """Return the key in summary.json of a value of a run; the name itself if there is none."""
    prefix, measure = _prefix_and_measure(name)
    if (known := all_measures().get(measure)) is None:
        return name
    return known.landing_key.replace(HARDEST, prefix, 1) if prefix else known.key


def _prefix_and_measure(name: str) -> tuple[str, str]:
    """Return the prefix of the landing in a name, or "", and the name of the measure."""
    prefix = next((prefix for prefix in (FIRST, HARDEST) if name.startswith(prefix)), "")
    return prefix, name.removeprefix(prefix)


def any_needs(names: Collection[str], data: str) -> bool:
    """Return whether one of these measures needs this of a `ContactRecord`, as "stress"."""
    return any(data in each.data for name, each in all_measures().items() if name in names)
