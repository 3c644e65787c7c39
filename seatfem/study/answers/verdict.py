"""Statements on the result of a run: whether a landing occurred, in which order it closes the lands of a seat with
several, whether a spring would be enough for the seat.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from impact.quantities import enumeration, in_digits, in_units, percent, plain, scaled, with_capital
from seatfem import readings, results
from seatfem.readings import BAR, SPRING, WITHOUT_ZERO, Summary, as_number, bar_of, duration, is_known, reading
from seatfem.results import asked, name_of, result_of

LANDED: Final = "landed"
STATUS: Final[Mapping[str, str]] = {
    "no landing": (
        "No landing: the reed does not reach the seat in {time}, so there is no result to check. Remedy: a longer "
        "run.duration, or loads and velocities that close the reed."
    ),
    "cut off": (
        "Cut off: the run ends in a contact, whose impulse and duration are not complete. Remedy: a run.duration "
        "longer than {time}."
    ),
    "never opened": (
        "Never opened: the reed is closed at the start and does not open in {time}, so there is no landing to judge. "
        'Remedy: a longer run.duration, or loads that open the reed; accuracy.landing = "run" judges the whole run.'
    ),
}
"""First sentence about a run without a landing, by its landing_status."""


@dataclass(frozen=True)
class Difference:
    """Difference between spring baseline and seat in one measure.

    Attributes:
        key: key of the measure in summary.json.
        seat, spring: values of seat and spring [SI].
        bar: larger of both error bars; a spring has one only beside a measured seat [SI].
    """

    key: str
    seat: float
    spring: float
    bar: float

    @property
    def relative(self) -> float:
        """Return spring/seat - 1."""
        return self.spring / self.seat - 1

    @property
    def bars(self) -> float:
        """Return |spring - seat| over the error bar; ``inf`` for a bar of zero, 0 without a difference."""
        distance = abs(self.spring - self.seat)
        return distance / self.bar if self.bar > 0 else (math.inf if distance > 0 else 0.0)


def difference(summary: Summary, key: str) -> Difference | None:
    """Return the spring's difference in one measure.

    ``None`` if error bar or either value is missing; for times, whose origin is arbitrary; and for the static load,
    which is the same on any seat.
    """
    if result_of(key).of_each_step or key == results.LANDING + results.STATIC or key.endswith(WITHOUT_ZERO):
        return None
    seat, spring, bar = (as_number(summary.get(name)) for name in (key, SPRING + key, BAR + key))
    if seat is None or spring is None or bar is None or seat == 0.0:
        return None
    return Difference(key, seat, spring, max(bar, as_number(summary.get(BAR + SPRING + key)) or 0.0))


def against_spring(summary: Summary) -> str:
    """Return the comparison with the spring baseline in sentences; "" without a landing, or if both are springs."""
    return "" if standing(summary) or is_static(summary) else verdict(summary)


def verdict(summary: Summary) -> str:
    """Return the result of a run in sentences, from the numbers of summary.json.

    A run without a landing states this first. Then the measures to which the accuracy applies, or filtered peak and
    impulse if the spring has none of them, are compared with the spring baseline. A difference is significant if it
    exceeds the error bar of the seat's value and that value is known.
    """
    state = standing(summary)
    if state and not any(summary.get(key) for key in asked(summary)):
        return state
    if not state and summary.get(results.FIRST_CONTACT) is None and not summary.get(results.FILM_PEAK):
        return "No contact within run.duration: there is nothing to compare."
    return " ".join(filter(None, (state, _comparison(summary))))


def is_static(summary: Summary) -> bool:
    """Return whether the seat was computed by its static stiffness alone, as the baseline is."""
    return "spring" in (summary.get("seat_kind"), summary.get("plan_seat_level"))


def is_free(summary: Summary) -> bool:
    """Return whether the seat is free to move, so that a rigid body stands in the place of the spring."""
    return summary.get("seat_static_stiffness_N_per_m") == 0


def _simple(summary: Summary) -> str:
    return "a rigid body of the seat's mass and static compliance" if is_free(summary) else "a spring"


def standing(summary: Summary) -> str:
    """Return a sentence if nothing landed or the run ends in a contact, with the remedy; "" otherwise."""
    status = str(summary.get("landing_status") or LANDED)
    whole = summary.get("accuracy_landing") == "run" and as_number(summary.get(results.CONTACTS))
    if status == LANDED or (whole and status != "cut off"):
        return ""
    length = as_number(summary.get("run_duration_s"))
    time = str(summary.get("plan_run_duration") or "run.duration") if length is None else duration(length)
    return STATUS.get(status, status.capitalize() + ".").replace("{time}", time)


def which_landing(summary: Summary) -> str:
    """Return the landing on the seat by which the run is judged, and its number: "hardest landing (2 of 3)"."""
    words = "first landing" if summary.get("accuracy_landing") == "first" else "hardest landing"
    words += " on the seat" if as_number(summary.get("stopper_landing_count")) else ""
    number, number_of_all = (as_number(summary.get(f"landing_{key}")) for key in ("number", "count"))
    if number is None or number_of_all is None:
        return words
    return f"{words} ({number:.0f} of {number_of_all:.0f})" if number_of_all > 1 else "landing"


def pressed_on(summary: Summary) -> str:
    """Return how hard and how long the loads alone press the reed on its seat; "" if they do not."""
    time, load = (as_number(summary.get(f"pressed_on_{key}")) for key in ("time_s", "largest_load_N"))
    if not time or not load:
        return ""
    lasts = f"{duration(time)} in total (not a landing)"
    return f"reed pressed on its seat by its loads: up to {in_units(load, 'N')}, {lasts}"


HARDLY: Final = 1.1  # growth of a difference from landing to landing below which it is called none
NO_ENSEMBLE: Final = ". No landing is left to an ensemble (run.ensemble): it was not marched"


def horizon(summary: Summary) -> str:
    """Return which landings are predictable, and the ensemble's statistics of the others; "" for few landings."""
    known, growth = as_number(summary.get(results.KNOWN_LANDINGS)), as_number(summary.get(results.LANDING_GROWTH))
    number = len(landings) if isinstance(landings := summary.get("landings"), list) else 0
    nothing = NO_ENSEMBLE if summary.get(results.ENSEMBLE_LANDINGS) == 0 else ""
    if known is None or growth is None or not number:
        return nothing.removeprefix(". ")
    words = f"all {number} landings can be predicted" if known >= number else _partly(int(known))
    grows = "hardly grows" if growth < HARDLY else f"grows {growth:.2g}-fold"
    words += f": a small difference, of round-off or inputs and not of the step, {grows} from one to the next"
    of_inputs = as_number(summary.get(results.KNOWN_OF_INPUTS))
    if of_inputs is not None and of_inputs < min(known, number):
        words += f"; with inputs exact to 0.1 %, {_count(int(of_inputs))}"
    means = ((results.ENSEMBLE_SPEED, "m/s", "closing speed"), (results.ENSEMBLE_PEAK, "N", "peak force"))
    averages = [
        f"{name} {reading(summary, key, unit)} (of single landings ± {in_digits(factor * spread, 2)} {prefixed})"
        for key, unit, name in means
        if (spread := as_number(summary.get(results.spread_of(key)))) is not None
        for factor, prefixed in [scaled([as_number(summary.get(key)) or spread], unit)]
    ]
    members = as_number(summary.get(results.ENSEMBLE))
    mean = f". Mean of the others over {members:.0f} runs: {', '.join(averages)}" if averages and members else ""
    return words + (nothing or mean)


def _partly(known: int) -> str:
    after = f"from {known + 1} on only statistics" if known else "there are only statistics"
    return f"{_count(known)}, {after}"


def _count(known: int) -> str:
    return {0: "no landing can", 1: "landing 1 can"}.get(known, f"landings 1 to {known} can") + " be predicted"


def beyond_horizon(summary: Summary) -> str:
    """Return from which landing on only statistics can be given; "" if all landings can be predicted."""
    known = as_number(summary.get(results.KNOWN_LANDINGS))
    number = len(landings) if isinstance(landings := summary.get("landings"), list) else 0
    words = "" if known is None or known >= number else _partly(int(known))
    return words and f"{with_capital(words)}."


def simpler(summary: Summary) -> str:
    """Return the results of simpler models of a contact with a film or along a lip, in one line; "" without any."""
    models: list[str] = []
    for words, name in (("without the film", "without_film"), ("single contact point", "one_port"), ("beam", "beam")):
        peak, impulse = (as_number(summary.get(f"{name}_{key}")) for key in (results.PEAK, results.IMPULSE))
        if peak is not None and impulse is not None:
            models.append(f"{words} {in_units(peak, 'N')} and {in_units(impulse, 'N s')}")
    over = duration(summary.get("filter_width_s"))
    return f"simpler models: {', '.join(models)} (peak, {over} mean, and impulse of the whole run)" if models else ""


def sentences(summary: Summary) -> tuple[str, ...]:
    """Return what a run says besides its decision and tables: static pressing, predictable landings, simpler models,
    lines of wings."""
    own = (each(summary) for each in (pressed_on, horizon, simpler))
    return (*filter(None, own), *results.all_sentences(summary))


def count(bars: float) -> str:
    """Return a number of error bars as text."""
    return "> 1000" if bars > 1000 else "0" if bars < 1e-3 else in_digits(bars, 2) if bars < 100 else f"{bars:.0f}"


def _comparison(summary: Summary) -> str:
    """Return how the spring baseline differs from the seat, in the measures asked for."""
    if summary.get("seat_kind") == "spring":
        return "The seat is a spring: it is its own baseline."
    if words := static_seat(summary):
        return words
    differences = [d for key in asked(summary) if (d := difference(summary, key)) is not None]
    usual = [] if differences else [results.PEAK, results.IMPULSE]
    differences = differences or [d for key in usual if (d := difference(summary, key)) is not None]
    counted = sorted(
        (d for d in differences if d.bars > 1 and _is_known(summary, d.key)), key=lambda d: -abs(d.relative)
    )
    if counted:
        return " ".join(_instead(summary, each) for each in counted)
    return _alike(summary, differences) if differences else ""


def _is_known(summary: Summary, key: str) -> bool:
    value = as_number(summary.get(key))
    return value is not None and is_known(key, value, bar_of(summary, key))


def _instead(summary: Summary, each: Difference) -> str:
    """Return the spring's number in place of the seat's, and the uncertainty of the seat's."""
    unit, name = result_of(each.key).unit, name_of(each.key, summary)
    factor, prefixed = scaled(each.seat, unit) if unit else (1.0, "")
    after, bar = f" {plain(prefixed)}" if prefixed else "", as_number(summary.get(BAR + each.key)) or 0.0
    texts = [[_short(factor * value, digits) for value in (each.seat, each.spring)] for digits in range(2, 7)]
    seat, spring = next((pair for pair in texts if pair[0] != pair[1]), texts[-1])  # the fewest digits that differ
    return (
        f"{with_capital(name)}: {with_capital(_simple(summary))} would give {spring}{after} instead of {seat}{after} "
        f"({percent(each.relative, sign=True)}). Uncertainty of the {seat}{after}: {in_digits(factor * bar, 2)}{after}."
    )


def _short(value: float, digits: int) -> str:
    """Return a number with so many significant digits, without an exponent below 10^6."""
    places = max(digits - 1 - math.floor(math.log10(abs(value) or 1.0)), 0)
    return f"{value:.{places}f}" if abs(value) < 1e6 else in_digits(value, digits)


def static_seat(summary: Summary) -> str:
    """Return why the waves in an elastic seat were left out, so that it agrees with the baseline; "" if they were
    not."""
    if summary.get("seat_kind") == "spring" or summary.get("plan_seat_level") != "spring":
        return ""
    lip = "; the baseline has independent springs along the lip" if results.PORTS in summary else ""
    if "seat.model" in str(summary.get("plan_given", "")).split(", "):
        return f'Waves in the seat are left out, by seat.model = "spring"{lip}.'
    names = enumeration(name_of(key, summary) for key in asked(summary)) or "the measures"
    stiff = "it is so stiff that only its static stiffness matters"
    if summary.get("accuracy_met") is not True:
        stiff = "its static stiffness stands for it, as the rounds did not go on to waves"
    return (
        f"Waves in the seat are left out: {stiff}{lip}; their effect on {names} is part of the uncertainty. To "
        'compute them: seat.model = "3d".'
    )


def _alike(summary: Summary, differences: list[Difference]) -> str:
    largest = max(differences, key=lambda d: abs(d.relative))
    bar = as_number(summary.get(BAR + largest.key)) or 0.0
    names = enumeration(name_of(d.key, summary) for d in differences)
    changes = f"it changes {names} by {percent(abs(largest.relative))} at most"
    within = f"within the uncertainty of {percent(bar / abs(largest.seat))}"
    if summary.get("accuracy_met") is False or not _is_known(summary, largest.key):
        return f"This run cannot show whether {_simple(summary)} is enough: {changes}, {within}."
    return f"{with_capital(_simple(summary))} is enough here: {changes}, {within}."


TIME: Final = "time_s"
DELAY: Final = "after_first_s"
SPEED: Final = "closing_speed_m_per_s"
SEALED: Final = "closed_all_round_s"


def lands_of(summary: readings.Summary) -> list[readings.Summary]:
    """Return the records of the lands in the order of the drawing; none for a seat with a single land."""
    lands = summary.get("lands")
    return [each for each in lands if isinstance(each, Mapping)] if isinstance(lands, list) else []


def closing_order(summary: readings.Summary) -> str:
    """Return in which order the hardest landing touches the lands, with the times between and their error bars, and
    by when each has been touched all round; "" for a seat with a single land, or without a landing."""
    lands = lands_of(summary)
    touched = sorted((each for each in lands if each.get("order")), key=lambda each: int(str(each["order"])))
    if not touched:
        return ""
    words = [f"{_name(touched[0])} is touched first, at {_time(touched[0], TIME)}, {_speed(touched[0])}"]
    words += [_later(each) for each in touched[1:]]
    words += [f"{_name(each)} is not touched in this landing" for each in lands if not each.get("order")]
    words += filter(None, [_sealing(touched)])
    sentence = "; ".join(words)
    return f"{with_capital(sentence)}."


def _sealing(lands: Sequence[readings.Summary]) -> str:
    """Return by when each land has been touched all round, if not at once, the first one first; "" for a single land,
    or where none has."""
    times = [(readings.as_number(each.get(SEALED)) or math.inf, str(each.get("land"))) for each in lands]
    if len(times) < 2 or math.isinf(min(times)[0]):
        return ""
    words = (f"{name} {'not' if math.isinf(by) else 'by ' + in_units(by, 's', 4)}" for by, name in sorted(times))
    return f"touched all round, if not at once: {', '.join(words)}"


def _name(land: readings.Summary) -> str:
    angle = readings.as_number(land.get("land_deg"))
    return str(land.get("land")) + ("" if angle is None else f" (at {angle:.4g} deg)")


def _time(land: readings.Summary, key: str) -> str:
    return readings.reading(land, key, readings.unit_of(key))


def _speed(land: readings.Summary) -> str:
    return f"closing speed {_time(land, SPEED)}"


def _later(land: readings.Summary) -> str:
    """Return how much later a land closes; that the order is not known where the error bar is as large."""
    delay, bar = readings.as_number(land.get(DELAY)), readings.bar_of(land, DELAY)
    with_speed = _speed(land)
    if not delay:
        return f"{_name(land)} at the same time, {with_speed}"
    known = bar is not None and math.isfinite(bar)
    if known and bar is not None and bar >= delay:
        most = readings.write_with_bar(DELAY, delay + bar, None, "s")
        return f"{_name(land)} within {most} of it, {with_speed}: which of them is earlier is not known"
    return f"{_name(land)} {_time(land, DELAY)} later, {with_speed}"
