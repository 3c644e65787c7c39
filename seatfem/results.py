"""Results of a run: every number of summary.json that people are shown, once, with its words, unit, group and digits.

Whatever shows results reads this table: the terminal, reports, sentences, charts of studies. A row that is added here
is shown by all of them, and listed in docs/summary.md; a measure that is defined anywhere, by being a `ResultSource`,
is a row, too.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import ClassVar, Final, Literal

from impact.names import import_all
from seatfem.readings import Summary, as_number, duration, ending_of, unit_of

Group = Literal["landing", "run", "stopper", "spring", "film", "lip", "seat", "life", "cycle", "raw"]

HEADINGS: Final[Mapping[Group, str]] = {
    "landing": "landing on the seat",
    "run": "whole run",
    "stopper": "at the stopper",
    "spring": "valve springs",
    "film": "film in the gap",
    "lip": "along the lip",
    "seat": "stress in the seat",
    "life": "fatigue",
    "cycle": "last cycle",
    "raw": "raw{step}",
}
LANDINGS_FILE: Final = "landings.csv"
LANDING: Final = "landing_"
"""Prefix of the keys of the judged landing."""
NO_LOAD: Final = 1e-3
"""Share of the peak force below which a static load is none: error bars of forces are larger."""

PEAK, IMPULSE, RESTITUTION = "filtered_peak_force_N", "impulse_Ns", "restitution"
STATIC, EXCESS = "static_load_N", "excess_peak_force_N"
PEAK_TIME, FIRST_CONTACT, CONTACTS = "peak_time_s", "first_contact_s", "contact_count"
LANDING_TIME: Final = "landing_time_s"
SEAT_DISPLACEMENT: Final = "max_seat_displacement_m"
REED_STRESS, REED_STRESS_AFTER = "peak_reed_stress_Pa", "peak_reed_stress_after_contact_Pa"
REED_STRESS_BEFORE: Final = "initial_reed_stress_Pa"
REED_STRESS_AT_START, REED_STRESS_BEFORE_LANDING = "reed_stress_at_start_Pa", "reed_stress_before_landing_Pa"
SEAT_STRESS: Final = "peak_seat_stress_Pa"
FILM_PEAK: Final = "film_force_peak_N"
LINE_PEAK: Final = "line_force_peak"
PORTS: Final = "ports"
RAW_PEAK: Final = "peak_force_N"
KNOWN_LANDINGS, KNOWN_OF_INPUTS, LANDING_GROWTH = "known_landings", "known_landings_of_inputs", "growth_per_landing"
ENSEMBLE, ENSEMBLE_LANDINGS = "ensemble_members", "ensemble_landings"
ENSEMBLE_SPEED, ENSEMBLE_PEAK = "ensemble_closing_speed_m_per_s", f"ensemble_{PEAK}"


@dataclass(frozen=True)
class Result:
    """One number of a run.

    Attributes:
        key: in summary.json [SI], its unit at its end; the spring baseline's has the prefix spring_.
        words: before it; {width} is the filter's, {closed} says whether the reed starts closed, {cut} whether the
            run ends meanwhile, {above} whether the impulse of a landing is that above a static load.
        group: of rows, in the order of `HEADINGS`.
        repeats: key of the landing; a row of the whole run with the same value as that is left out.
        unless: tells of which runs it says nothing.
        of_each_step: whether the spring baseline follows the force of every single step in it.
        demand: key of the pure number that the scene demands of this one, shown beside it; "" without.
    """

    key: str
    words: str
    group: Group
    repeats: str = ""
    unless: Callable[[Summary], bool] | None = None
    of_each_step: bool = False
    demand: str = ""

    @property
    def unit(self) -> str:
        """Return its unit [SI], without prefix."""
        return unit_of(self.key)


def spread_of(key: str) -> str:
    """Return the key of the standard deviation of single landings, beside the mean of an ensemble."""
    return key.replace("ensemble_", "ensemble_spread_", 1)


def is_loaded(numbers: Summary, prefix: str = "") -> bool:
    """Return whether a static load presses during a landing: a record, or the keys of a summary with their prefix."""
    static, peak = (as_number(numbers.get(f"{prefix}{key}")) for key in (STATIC, PEAK))
    return static is not None and abs(static) > NO_LOAD * (peak or 0.0)


def _not_loaded(summary: Summary) -> bool:
    return not is_loaded(summary, LANDING)


def _starts_closed(summary: Summary) -> bool:
    """Return whether the first contact is the rest of a closed reed, which has neither a landing nor a duration."""
    return summary.get(FIRST_CONTACT) == 0


def _has_angles(summary: Summary) -> bool:
    return summary.get(f"{LINE_PEAK}_at_deg") is not None


MEAN_PEAK: Final = "peak force (mean over {width})"
RESULTS: Final = (
    Result(LANDING_TIME, "time", "landing"),
    Result("landing_closing_speed_m_per_s", "closing speed", "landing"),
    Result(LANDING + PEAK, MEAN_PEAK, "landing"),
    Result(LANDING + EXCESS, "  above the static load", "landing", unless=_not_loaded),
    Result(LANDING + STATIC, "  static load", "landing", unless=_not_loaded),
    Result(LANDING + IMPULSE, "impulse{above}", "landing"),
    Result("landing_duration_s", "contact duration", "landing"),
    Result(LANDING + RESTITUTION, "restitution", "landing"),
    Result(LANDING + SEAT_DISPLACEMENT, "seat displacement", "landing", of_each_step=True),
    Result("landing_peak_reed_stress_Pa", "reed stress after landing", "landing"),
    Result(REED_STRESS_BEFORE_LANDING, "reed stress before landing", "landing"),
    Result(PEAK, MEAN_PEAK, "run", repeats=LANDING + PEAK),
    Result(PEAK_TIME, "  when", "run", repeats=LANDING + PEAK),
    Result(IMPULSE, "impulse", "run", repeats=LANDING + IMPULSE),
    Result(FIRST_CONTACT, "first contact{closed}", "run", repeats=LANDING_TIME),
    Result("contact_duration_s", "  contact duration{cut}", "run", repeats="landing_duration_s", unless=_starts_closed),
    Result(RESTITUTION, "  restitution", "run", repeats=LANDING + RESTITUTION),
    Result(CONTACTS, "contacts", "run"),
    Result(SEAT_DISPLACEMENT, "seat displacement", "run", repeats=LANDING + SEAT_DISPLACEMENT, of_each_step=True),
    Result(REED_STRESS_AFTER, "reed stress after first contact", "run"),
    Result("peak_reed_stress_over_rho_c0_v", "  over rho c v (plane wave: 1)", "run"),
    Result(REED_STRESS_BEFORE, "reed stress before first contact", "run", unless=_starts_closed),
    Result(REED_STRESS_AT_START, "reed stress at the start", "run"),
    Result(REED_STRESS, "largest reed stress", "run", unless=lambda run: REED_STRESS_AFTER in run),
    Result(ENSEMBLE_SPEED, "unpredictable landings: closing speed", "run"),
    Result(ENSEMBLE_PEAK, f"unpredictable landings: {MEAN_PEAK}", "run"),
    Result("stopper_filtered_peak_force_N", MEAN_PEAK, "stopper"),
    Result("stopper_impulse_Ns", "impulse", "stopper"),
    Result("stopper_first_contact_s", "first contact", "stopper"),
    Result("stopper_contact_count", "contacts", "stopper"),
    Result("valve_spring_force_max_N", "largest force", "spring"),
    Result("valve_spring_force_at_landing_N", "  as the landing begins", "spring"),
    Result(FILM_PEAK, "largest force", "film"),
    Result("stiction_force_peak_N", "largest pull", "film"),
    Result("film_loss_J", "energy lost", "film"),
    Result("without_film_filtered_peak_force_N", f"without it: {MEAN_PEAK}", "film"),
    Result("without_film_impulse_Ns", "without it: impulse", "film"),
    Result("line_force_peak_N_per_m", "force per length", "lip"),
    Result("line_force_peak_at_deg", "  where", "lip"),
    Result("line_force_peak_at_m", "  where", "lip", unless=_has_angles),
    Result("line_impulse_peak_Ns_per_m", "impulse per length", "lip"),
    Result("line_impulse_peak_at_deg", "  where", "lip"),
    Result("line_impulse_peak_at_m", "  where", "lip", unless=_has_angles),
    Result("first_touch_at_deg", "first touch", "lip"),
    Result("first_touch_at_m", "first touch", "lip", unless=_has_angles),
    Result(
        "first_touch_segments", "  segments at once", "lip", unless=lambda run: run.get("first_touch_segments") == 1
    ),
    Result(PORTS, "lip segments", "lip"),
    Result("tilt_deg", "tilt", "lip"),
    Result(SEAT_STRESS, "largest, von Mises", "seat"),
    Result("peak_seat_stress_time_s", "  when", "seat"),
    Result("peak_seat_stress_over_rho_c0_v", "  over rho c v (plane wave: 1)", "seat"),
    Result("peak_seat_principal_stress_Pa", "largest tension", "seat"),
    Result(RAW_PEAK, "peak force", "raw"),
    Result("stopper_peak_force_N", "stopper's peak force", "raw"),
)
OF_LANDINGS: Final[Mapping[str, str]] = {
    "time_s": "time",
    "closing_speed_m_per_s": "closing\nspeed",
    PEAK: "peak\nforce",
    STATIC: "static\nload",
    EXCESS: "peak above\nstatic load",
    IMPULSE: "impulse",
    "duration_s": "contact\nduration",
    RESTITUTION: "restitution",
}
"""Keys of the records of landings, and the heads of their columns."""
OF_LANDS: Final[Mapping[str, str]] = {
    "time_s": "first touch",
    "after_first_s": "after the\nfirst land",
    "closed_all_round_s": "all round",
    "closing_speed_m_per_s": "closing\nspeed",
    PEAK: "peak\nforce",
    STATIC: "static\nload",
    EXCESS: "peak above\nstatic load",
    IMPULSE: "impulse",
    "impulse_share": "share",
    "duration_s": "duration",
    "line_force_peak_N_per_m": "line\nforce",
}
"""Keys of the records of lands, and the heads of their columns."""
WINGS: Final = "seatfem.wings"
"""Package whose files may add results."""


class ResultSource:
    """Base of what has results of its own, by being a subclass: a measure, with its name and key, or a wing.

    Attributes:
        rows: further results, by wings.
        captions: words for its pictures in a report, by file name.
        section: prefix and title of all its keys in a section of the report; "" without.
        absent_words: what a decision says where none of these keys is there.
        margins: keys of pure numbers that a decision compares with 1; with each the key whose relative error it has,
            "" where it has an error bar of its own.
        sources: keys of the sources of what these rest on, as of a strength.
        basis: key of the words, with margins of stress, for what they are stated.
        gaps: keys of sentences on what these leave out, which leave a run undecided.
        name: by which scenes ask for it.
        key: in summary.json, with its unit.
        words: in sentences, and in the tables of a run where `RESULTS` has no row of it.
        landing_key: in summary.json, of a landing; "" of one that speaks of the whole run alone.
        landing_words: instead of ``words`` for one landing, if its value means something else there.
    """

    name: ClassVar[str]
    key: ClassVar[str]
    words: ClassVar[str]
    landing_key: ClassVar[str] = ""
    landing_words: ClassVar[str] = ""
    rows: ClassVar[tuple[Result, ...]] = ()
    captions: ClassVar[Mapping[str, str]] = {}
    section: ClassVar[tuple[str, str]] = ("", "")
    absent_words: ClassVar[str] = ""
    margins: ClassVar[Mapping[str, str]] = {}
    sources: ClassVar[tuple[str, ...]] = ()
    basis: ClassVar[str] = ""
    gaps: ClassVar[tuple[str, ...]] = ()

    @classmethod
    def sentence(cls, summary: Summary) -> str:
        """Return its results in one line, below the table of a run; "" without any."""
        return ""


def _all_sources(kind: type[ResultSource] = ResultSource) -> Iterator[type[ResultSource]]:
    import_all(WINGS)
    for each in kind.__subclasses__():
        yield from (each, *_all_sources(each))


def _sources() -> Iterator[type[ResultSource]]:
    return (each for each in _all_sources() if "name" in vars(each))


def all_results() -> dict[str, Result]:
    """Return all results that are declared, by key: `RESULTS` and those of wings."""
    return {row.key: row for row in (*RESULTS, *(row for each in _all_sources() for row in each.rows))}


def all_captions() -> dict[str, str]:
    """Return the captions of pictures by wings."""
    return {name: words for each in _all_sources() for name, words in each.captions.items()}


def all_sentences(summary: Summary) -> Iterator[str]:
    """Yield a line on the results of each wing that has one."""
    return filter(None, (each.sentence(summary) for each in _all_sources()))


def all_sections() -> Iterator[tuple[str, str]]:
    """Yield prefix and title of the sections of reports by wings."""
    return (each.section for each in _all_sources() if each.section[0])


def with_margins() -> tuple[type[ResultSource], ...]:
    """Return the sources of results that have margins."""
    return tuple(each for each in _all_sources() if each.margins)


def _measure_words(key: str) -> str:
    return {each.key: each.words for each in _sources()}.get(key, "")


def result_of(key: str) -> Result:
    """Return the result of a key; of one that this table does not know the key stands in it where it tells no unit."""
    if (known := all_results().get(key)) is not None:
        return known
    words = _measure_words(key.removeprefix(LANDING)) or key
    result = Result(key, words, "landing" if key.startswith(LANDING) else "run")
    return result if result.unit or words == key else Result(key, f"{words} ({key})", result.group)


def label_of(key: str) -> str:
    """Return the meaning of a key of summary.json on an axis, as "peak force"; another name as it is."""
    known = all_results().get(key)
    words = {each.landing_key: each.landing_words for each in _sources()}.get(key) or _measure_words(key)
    if known is not None and (known.group == "landing" or not words):
        words = known.words.partition("{")[0].removesuffix("(mean over ").strip(" ,")
        if known.group == "landing":
            words += "" if "landing" in words else " of landing"
        elif known.group != "run":
            words = f"{HEADINGS[known.group].partition('{')[0]}: {words}"
    return words or (key.removesuffix(ending).replace("_", " ") if (ending := ending_of(key)) else key)


def name_of(key: str, summary: Summary) -> str:
    """Return a measure in words, the same of a landing as of a whole run."""
    if (known := all_results().get(key)) is not None and not known.words.startswith(" ") and known.group != "film":
        return words_of(known, summary)
    return _measure_words(key) or _measure_words(key.removeprefix(LANDING)) or key


def words_of(row: Result, summary: Summary) -> str:
    """Return what stands before the number of a row."""
    replaced = {
        "{width}": duration(summary.get("filter_width_s")),
        "{closed}": ", reed starts closed" if _starts_closed(summary) else "",
        "{cut}": ", cut off by the end of the run" if summary.get("contact_cut_off") else "",
        "{above}": " above static load" if is_loaded(summary, LANDING) else "",
    }
    words = row.words
    for name, text in replaced.items():
        words = words.replace(name, text)
    return words


def asked(summary: Summary) -> tuple[str, ...]:
    """Return the keys that the accuracy was asked for, by which a run is judged: of a landing, or of the whole run."""
    if judged := str(summary.get("accuracy_judged_keys") or ""):
        return tuple(judged.split(", "))
    return _keys_asked(summary)


def list_missing(summary: Summary) -> list[str]:
    """Return the keys that the accuracy was asked for and that have no value; those of a landing only if one is."""
    landed = summary.get(LANDING_TIME) is not None
    return [key for key in asked(summary) if summary.get(key) is None and (landed or not key.startswith(LANDING))]


def _keys_asked(summary: Summary) -> tuple[str, ...]:
    names = str(summary.get("accuracy_measures") or "").split(", ")
    return tuple(each.key for each in _sources() if each.name in names)


def rows_of(summary: Summary) -> dict[Group, list[Result]]:
    """Return the rows of a run by group, in the order they are read: the group first by which the run is judged.

    Every measure has a row, wherever it is defined; what is judged or asked for has one without a value, too.
    """
    judged, order = {*asked(summary), *_keys_asked(summary)}, [*HEADINGS]
    if asked(summary) and not any(key.startswith(LANDING) for key in asked(summary)):
        order[:2] = ["run", "landing"]
    measured = {each.key for each in _sources()}
    rows = (declared := all_results()) | {key: result_of(key) for key in sorted((judged | measured) - declared.keys())}
    groups = {group: [row for row in rows.values() if row.group == group] for group in order}
    return {group: shown for group, of_it in groups.items() if (shown := list(_shown(summary, group, of_it, judged)))}


def _shown(summary: Summary, group: Group, rows: list[Result], judged: set[str]) -> Iterator[Result]:
    if group == "landing" and summary.get(LANDING_TIME) is None:
        return
    if group == "lip" and PORTS not in summary and not judged & {row.key for row in rows}:
        return
    for row in rows:
        if row.key not in asked(summary) and _repeats(summary, row):
            continue
        needless = row.unless is not None and row.unless(summary)
        place = group == "lip" and row.unit in ("deg", "m")
        empty = summary.get(row.key) is None and (row.unit == "Pa" or place or group in ("landing", "run"))
        if row.key in judged or (row.key in summary and not (needless or empty)):
            yield row


def _repeats(summary: Summary, row: Result) -> bool:
    """Return whether a row of the whole run says again what the judged landing says."""
    own, landing = (as_number(summary.get(key)) for key in (PEAK if row.key == PEAK_TIME else row.key, row.repeats))
    return own is not None and landing is not None and math.isclose(own, landing, rel_tol=1e-9, abs_tol=1e-12)
