"""Measures of a scene, for which an accuracy may be asked. A new one is a subclass of `Measure`, in any file."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, Final, Literal

import numpy as np

from impact import measures
from impact.after import histories, stresses
from impact.after.landings import Landing, hardest, pair_landings
from impact.greens.base import Array
from seatfem.results import ResultSource
from seatfem.study.safety import OF_IMPULSE, OPENING

LandingChoice = Literal["hardest", "first", "run"]
HARDEST: Final = "landing_"
FIRST: Final = "first_landing_"
PREFIXES: Final[Mapping[LandingChoice, str]] = {"hardest": HARDEST, "first": FIRST, "run": ""}
"""Prefixes of the names of measures of a landing."""
LANDING_WORDS: Final[Mapping[str, str]] = {HARDEST: " of the hardest landing", FIRST: " of the first landing", "": ""}


@dataclass(frozen=True)
class Line:
    """A contact along a lip.

    Attributes:
        force: (n + 1, arcs) of its arcs [N].
        length: of its centre line, whose arcs are equal, or (arcs,) of each arc [m].
        share: of it over which forces are averaged.
        edges: (arcs + 1,) angles at which the arcs begin and end [rad]; ``None``: angles do not tell places.
        film: (n + 1, arcs) what of the force a film bears [N]; ``None``: nothing.
        pieces: of the line, as in `impact.after.histories`.
    """

    force: Array
    length: float | Array
    share: float
    edges: Array | None = None
    film: Array | None = None
    pieces: histories.Pieces = ()

    @property
    def lengths(self) -> Array:
        """Return the lengths of the arcs (arcs,) [m]."""
        return histories.lengths_of(self.length, self.force.shape[1])

    def degrees_at(self, place: float) -> float | None:
        """Return the angle at a share of the line from the first arc's beginning; ``None`` without angles."""
        if self.edges is None:
            return None
        borders = np.concatenate([[0.0], np.cumsum(self.lengths)]) / self.lengths.sum()
        return round(float(np.degrees(np.interp(place, borders, self.edges))), 6) % 360


@dataclass(frozen=True)
class ContactRecord:
    """Histories of the seat's contact in one run, read by measures (`impact.ContactRecord` is of any face).

    Attributes:
        force: (n + 1,) of one contact [N].
        dt: step [s].
        filter_width: of the run [s].
        displacement: (n + 1,) of the seat's patch [m]; ``None``: not known.
        stress: the reed's; ``None``: not known.
        stress_since: start of the landing that it is told apart by [s]; ``None``: of none.
        line: arc by arc, of a contact along a lip; ``None`` of others.
        film: (n + 1,) what of the force a film bears [N]; ``None``: nothing.
        landings: on the seat, in order of time.
        asked: which of them measures are asked of.
        strains: (n + 1,) at each gauge.
    """

    force: Array
    dt: float
    filter_width: float
    displacement: Array | None = None
    stress: stresses.ReedStress | None = None
    line: Line | None = None
    film: Array | None = None
    landings: tuple[Landing, ...] = ()
    asked: LandingChoice = "hardest"
    stress_since: float | None = None
    strains: tuple[Array, ...] = ()

    def steps_of(self, landing: Landing) -> slice:
        """Return the recorded times of a landing, as numbers."""
        return slice(round(landing.start / self.dt), round(landing.end / self.dt) + 1)


class Measure(ResultSource, ABC):
    """A number that an accuracy may be asked for. A subclass with a ``name``, in any file, is one more.

    Attributes:
        landing_words: the words of one landing, where they are something else.
        needs_displacement, needs_stress, needs_line: what it takes of the run beside the force.
        judged_by: the measure of the whole run whose relative error it has; "" of one with an error of its own.
        of_some: whether it is left out of the results of runs that do not know it.
    """

    landing_words: ClassVar[str] = ""
    needs_displacement: ClassVar[bool] = False
    needs_stress: ClassVar[bool] = False
    needs_line: ClassVar[bool] = False
    judged_by: ClassVar[str] = ""
    of_some: ClassVar[bool] = False

    def is_known(self, blow: ContactRecord) -> bool:
        """Return whether the run has a value of it."""
        return not (
            (self.needs_displacement and blow.displacement is None)
            or (self.needs_stress and blow.stress is None)
            or (self.needs_line and blow.line is None)
        )

    @abstractmethod
    def evaluate(self, blow: ContactRecord) -> float:
        """Return its value [SI]. A contact that never was has the value 0."""

    def of_landing(self, blow: ContactRecord, landing: Landing) -> float | None:
        """Return its value of one landing [SI]; ``None`` where that has none."""
        return None

    def jump(self, blow: ContactRecord, share: float) -> float:
        """Return by how much it may jump [SI] where the impulse is known to a ``share`` of it; 0 for what follows the
        force smoothly."""
        return 0.0

    def jump_of_landing(self, blow: ContactRecord, landing: Landing, share: float) -> float:
        """Return by how much its value of one landing may jump [SI], as `jump` has it."""
        return 0.0


class Impulse(Measure):
    """Integral of the force."""

    name, key, words = "impulse", "impulse_Ns", "impulse"
    landing_key = "landing_impulse_Ns"

    def evaluate(self, blow: ContactRecord) -> float:
        return float(np.sum(blow.force[1:])) * blow.dt

    def of_landing(self, blow: ContactRecord, landing: Landing) -> float:
        """Return the impulse above the quasi-static load."""
        return landing.impulse


class FilteredPeak(Measure):
    """Largest average of the force over the filter's width."""

    name, key, words = "filtered_peak", "filtered_peak_force_N", "peak force"
    landing_key = "landing_filtered_peak_force_N"

    def evaluate(self, blow: ContactRecord) -> float:
        return histories.largest_average(blow.force[1:], blow.dt, blow.filter_width)

    def of_landing(self, blow: ContactRecord, landing: Landing) -> float:
        """Return the filtered peak with the quasi-static load."""
        return landing.filtered_peak


class ContactDuration(Measure):
    """Duration of the first group of contacts, of the bodies themselves."""

    name, key, words = "contact_duration", "contact_duration_s", "contact duration"
    landing_key = "landing_duration_s"

    def evaluate(self, blow: ContactRecord) -> float:
        return _first(blow.dt * measures.closed_steps(_solid(blow)[1:]))

    def of_landing(self, blow: ContactRecord, landing: Landing) -> float:
        return landing.duration

    def jump(self, blow: ContactRecord, share: float) -> float:
        """Return the jump of the duration: a touch below ``share`` may be none, an opening near the limit an end."""
        return self._jump(blow, _solid(blow), share)

    def jump_of_landing(self, blow: ContactRecord, landing: Landing, share: float) -> float:
        """Return the same of a landing: where the bodies part, or else by which its end moves with the band."""
        if landing.pressed_on:
            return landing.end_doubt
        solid = _solid(blow)
        groups = measures.merged(blow.dt * measures.closed_steps(solid[1:]))
        beside = groups[(groups[:, 0] > landing.start) & (groups[:, 0] < landing.end + (1 + OPENING) * measures.MERGE)]
        end = max([landing.end, *beside[:, 1]])  # of what an opening near the limit may join
        time = blow.dt * np.arange(len(solid))
        own = (time > landing.start + blow.dt / 2) & (time < end + blow.dt / 2)
        return self._jump(blow, np.where(own, solid, 0.0), share)

    @staticmethod
    def _jump(blow: ContactRecord, solid: Array, share: float) -> float:
        steps = measures.closed_steps(solid[1:])
        if not len(steps):
            return 0.0
        impulse = np.concatenate([[0.0], np.cumsum(solid[1:])])
        borne = np.diff(impulse[steps])[:, 0]
        raw, off = blow.dt * steps, min(OPENING, OF_IMPULSE * share)
        kept = raw[borne > min(share * impulse[-1], float(borne.max()) / 2)]
        others = (_first(kept), *(_first(raw, measures.MERGE * (1 + by)) for by in (-off, off)))
        return max(abs(other - _first(raw)) for other in others)


def _solid(blow: ContactRecord) -> Array:
    """Return the force (n + 1,) of the bodies themselves [N]."""
    return blow.force if blow.film is None else blow.force - blow.film


def _first(raw: Array, merge: float = measures.MERGE) -> float:
    """Return how long the first group lasts of contacts (n, 2) [s]; 0 without any."""
    groups = measures.merged(raw, merge)
    return float(groups[0, 1] - groups[0, 0]) if len(groups) else 0.0


class Restitution(Measure):
    """Coefficient of restitution of the first landing, in a run where a free striker lands but once."""

    name, key, words = "restitution", "restitution", "restitution"
    landing_key = "landing_restitution"

    def is_known(self, blow: ContactRecord) -> bool:
        return len(blow.landings) == 1 and blow.landings[0].restitution is not None

    def evaluate(self, blow: ContactRecord) -> float:
        return blow.landings[0].restitution or 0.0

    def of_landing(self, blow: ContactRecord, landing: Landing) -> float | None:
        return landing.restitution


class SeatDisplacement(Measure):
    """The seat's largest; 0 where nothing touched it, whatever round-off says."""

    name, key, words = "seat_displacement", "max_seat_displacement_m", "seat displacement"
    landing_key = "landing_max_seat_displacement_m"
    needs_displacement = True

    def evaluate(self, blow: ContactRecord) -> float:
        return float(np.max(np.abs(blow.displacement))) if np.any(blow.force) else 0.0  # type: ignore[arg-type]

    def of_landing(self, blow: ContactRecord, landing: Landing) -> float | None:
        if blow.displacement is None:
            return None
        return float(np.max(np.abs(blow.displacement[blow.steps_of(landing)])))


class Stress(Measure):
    """The reed's largest after the first touch."""

    name, key, words = "stress", "peak_reed_stress_after_contact_Pa", "reed stress after the first touch"
    landing_key, landing_words = "landing_peak_reed_stress_Pa", "reed stress since the landing"
    needs_stress = True

    def evaluate(self, blow: ContactRecord) -> float:
        peak = blow.stress.after_contact if blow.stress else None
        return peak.value if peak else 0.0

    def of_landing(self, blow: ContactRecord, landing: Landing) -> float | None:
        """Return the largest stress since the landing began."""
        peak = blow.stress.after_landing if blow.stress and blow.stress_since == landing.start else None
        return peak.value if peak else None


class LifeMargin(Measure):
    """The margin over the reed's design life, which is inversely proportional to its stress in the whole run.

    It is found from histories once the last round is over: plans and rounds look at the stress.
    """

    name, key, words = "life_margin", "life_margin", "margin over the design life"
    needs_stress = True
    judged_by = Stress.name

    def is_known(self, blow: ContactRecord) -> bool:
        return False

    def evaluate(self, blow: ContactRecord) -> float:
        return math.nan


class GaugeStrain(Measure):
    """The largest size of a strain at any gauge."""

    name, key, words = "gauge_strain", "peak_gauge_strain", "largest strain at a gauge"
    of_some = True

    def is_known(self, blow: ContactRecord) -> bool:
        return bool(blow.strains)

    def evaluate(self, blow: ContactRecord) -> float:
        return max(float(np.abs(strain).max()) for strain in blow.strains)


class _AlongLip:
    """What a measure of a contact along a lip is: the largest over a part of the lip."""

    needs_line = True

    def evaluate(self, blow: ContactRecord) -> float:
        """Return the measure over the whole run."""
        assert blow.line is not None
        return self._peak(blow, blow.line, blow.line.force[1:])

    def of_landing(self, blow: ContactRecord, landing: Landing) -> float | None:
        """Return the measure of one landing, with what the quasi-static load adds."""
        line = blow.line
        return None if line is None else self._peak(blow, line, line.force[1:][blow.steps_of(landing)])

    def _peak(self, blow: ContactRecord, line: Line, force: Array) -> float:
        raise NotImplementedError


class LineForce(_AlongLip, Measure):
    """Largest force per length of a lip, averaged over a part of it and over the filter's width."""

    name, key, words = "line_force", "line_force_peak_N_per_m", "force per length"
    landing_key = "landing_line_force_peak_N_per_m"

    def _peak(self, blow: ContactRecord, line: Line, force: Array) -> float:
        return histories.line_force_peak(force, blow.dt, blow.filter_width, line.length, line.share, line.pieces)[0]


class LineImpulse(_AlongLip, Measure):
    """Largest impulse per length of a lip, averaged over a part of it."""

    name, key, words = "line_impulse", "line_impulse_peak_Ns_per_m", "impulse per length"
    landing_key = "landing_line_impulse_peak_Ns_per_m"

    def _peak(self, blow: ContactRecord, line: Line, force: Array) -> float:
        return histories.line_impulse_peak(force, blow.dt, line.length, line.share, line.pieces)[0]


def all_measures() -> Mapping[str, Measure]:
    """Return one of each measure that is defined by now, by name, ours first."""
    return {each.name: each() for each in Measure.__subclasses__() if "name" in vars(each)}


def judged_names(names: Collection[str], landing: LandingChoice) -> tuple[str, ...]:
    """Return the names of measures of this landing among the values of a run.

    A measure that speaks of whole runs alone keeps its name, or has that of the one by which it is judged.
    """
    every, prefix = all_measures(), PREFIXES[landing]

    def judged(name: str) -> str:
        measure = every.get(name)
        if measure is None:
            return name
        return measure.judged_by or (prefix + name if measure.landing_key else name)

    return tuple(dict.fromkeys(judged(name) for name in names))


def judged_landings(landings: Sequence[Landing]) -> Mapping[str, Landing]:
    """Return the landings that measures may be of, by the prefix of the names of their values."""
    hard = hardest(landings)
    return {} if hard is None else {HARDEST: hard, FIRST: landings[0]}


def judged_landing(
    landings: Sequence[Landing], asked: LandingChoice, like: Sequence[Landing] | None = None
) -> Landing | None:
    """Return the landing that measures are of, of the whole run the hardest; ``None`` where there is none.

    ``like``: the landings of a neighbouring run, whose own is looked for.
    """
    every = landings if like is None else like
    wanted = judged_landings(every).get(FIRST if asked == "first" else HARDEST)
    if wanted is None or like is None:
        return wanted
    return pair_landings(like, landings)[like.index(wanted)]


def values_of(blow: ContactRecord, like: Sequence[Landing] | None = None) -> dict[str, float]:
    """Return the measures of a run, and those of its hardest landing, as far as they are known.

    Where measures are asked of the first landing, its own are among them, too.

    ``like``: the landings of a neighbouring run, whose hardest and first ones are looked for in this run; a measure of
    one that has no partner is infinite.
    """
    values = {name: each.evaluate(blow) for name, each in all_measures().items() if each.is_known(blow)}
    reference = blow.landings if like is None else like
    partners = dict(zip(reference, pair_landings(reference, blow.landings), strict=True)) if like is not None else {}
    for prefix, wanted in judged_landings(reference).items():
        if prefix == FIRST and blow.asked != "first":
            continue
        partner = wanted if like is None else partners[wanted]
        for name, each in all_measures().items():
            if each.landing_key and partner is None:
                values[prefix + name] = math.inf
            elif partner is not None and (value := each.of_landing(blow, partner)) is not None:
                values[prefix + name] = value
    return values


def in_words(name: str) -> str:
    """Return the meaning of a value of a run in words, its key in brackets."""
    prefix, measure = _parted(name)
    return f"{all_measures()[measure].words}{LANDING_WORDS[prefix]} ({key_of(name)})"


def short_words(name: str) -> str:
    """Return the meaning of a value of a run in words, without its key and its landing."""
    prefix, measure = _parted(name)
    entry = all_measures()[measure]
    return (prefix and entry.landing_words) or entry.words


def asked_name(name: str) -> str:
    """Return the name under which a scene asks for a value of a run, whichever landing it is of."""
    return _parted(name)[1]


def key_of(name: str) -> str:
    """Return the key in summary.json of a value of a run; the name itself where there is none."""
    prefix, measure = _parted(name)
    if (known := all_measures().get(measure)) is None:
        return name
    return known.landing_key.replace(HARDEST, prefix, 1) if prefix else known.key


def _parted(name: str) -> tuple[str, str]:
    """Return which landing a name speaks of, "" of none, and its measure."""
    prefix = next((prefix for prefix in (FIRST, HARDEST) if name.startswith(prefix)), "")
    return prefix, name.removeprefix(prefix)


def any_needs_displacement(names: Collection[str]) -> bool:
    """Return whether the displacement of the seat's patch is wanted for one of these measures."""
    return any(each.needs_displacement for name, each in all_measures().items() if name in names)


def any_needs_stress(names: Collection[str]) -> bool:
    """Return whether the reed's stress is wanted for one of these measures."""
    return any(each.needs_stress for name, each in all_measures().items() if name in names)
