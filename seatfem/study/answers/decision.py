"""A run decides: go, no-go or undecided, and says why, and what its numbers leave out."""

import csv
import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from importlib import resources
from typing import Any, Final, Literal, NamedTuple

from impact.quantities import enumeration, in_digits, percent, with_capital
from seatfem import readings, results
from seatfem.readings import BAR, MOST_UNCERTAIN, Summary, as_number, bar_of, is_known, reading, write_with_bar
from seatfem.results import Group, name_of, rows_of, words_of
from seatfem.study.answers.verdict import beyond_horizon, closing_order, is_static, standing, static_seat, which_landing
from seatfem.study.safety import source_in_words

Word = Literal["go", "no-go", "undecided"]
GO: Final = "go"
NO_GO: Final = "no-go"
UNDECIDED: Final = "undecided"
SPEED: Final = "landing_closing_speed_m_per_s"
PEAK_OF_LANDING: Final = results.LANDING + results.PEAK
ON_STOPPER: Final = "stopper_filtered_peak_force_N"
_NOT_CITED: Final = re.compile(
    r"\b(invent|assum|guess|estimat|unknown|example|placeholder|dummy|fictiti|made.up|todo|tbd|tbc|n/?a\b|none\b)|^\W*$",
    re.IGNORECASE,
)
"""Pattern of a source of strength that names no measurement."""


@dataclass(frozen=True)
class Decision:
    """A decision holds what a run says to whoever decides on the valve.

    Attributes:
        word: "go", "no-go" or "undecided".
        reasons: sentences that say why, those that decide first.
        happens: what happens in the run, in one sentence.
        checked: how often scenes of this kind were compared with finer runs, in one sentence.
        left_out: what the numbers leave out, a sentence each.
    """

    word: Word
    reasons: tuple[str, ...]
    happens: str
    checked: str
    left_out: tuple[str, ...]

    def keys(self) -> dict[str, object]:
        """Return the decision as keys of summary.json."""
        return {
            "decision": self.word,
            "decision_reasons": list(self.reasons),
            "decision_event": self.happens,
            "decision_checked": self.checked,
            "decision_left_out": list(self.left_out),
        }


class Finding(NamedTuple):
    """One reason for a decision: the word that it speaks for, and its sentence."""

    word: Word
    words: str


def decide(summary: Summary) -> Decision:
    """Return the decision that the numbers of summary.json allow.

    It is undecided without a complete landing, without a cited strength, if the accuracy asked for was missed, and if a
    stress that matters was not judged. Else
    each margin is compared with 1: one below it, its error bar included, means no-go; one whose error bar includes 1,
    or is not known, leaves the run undecided; all above mean go.
    """
    every = _landing(summary), _accuracy(summary), _strength(summary), *_gaps(summary)
    conditions = [each for each in every if each is not None]
    margins = [_compare(summary, key) for key in _margins(summary)]
    findings = [each for each in conditions if each.word != GO] or margins
    words = {each.word for each in findings}
    word: Word = NO_GO if NO_GO in words else UNDECIDED if UNDECIDED in words else GO
    in_order = sorted((*margins, *conditions), key=lambda each: each not in findings or each.word != word)
    reasons = tuple(each.words for each in in_order)
    others = tuple(each for each in left_out(summary) if each not in reasons)
    return Decision(word, reasons, what_happens(summary), how_often_checked(summary), others)


def what_happens(summary: Summary) -> str:
    """Return what happens in a run in one sentence: landings, closing speed, force, stress, least margin."""
    landings, contacts = as_number(summary.get("landing_count")), as_number(summary.get(results.CONTACTS))
    speed, force = as_number(summary.get(SPEED)), as_number(summary.get(PEAK_OF_LANDING))
    if landings and force is not None:
        often = {1: "once", 2: "twice"}.get(int(landings), f"{landings:.0f} times")
        hardest = "" if landings == 1 else ", the hardest" if speed is not None else ", at the hardest"
        at = "" if speed is None else f" at {_number(summary, SPEED, 'm/s')}"
        words = f"The reed lands {often} on the seat{hardest}{at} with {_number(summary, PEAK_OF_LANDING, 'N')}"
    elif contacts and (force := as_number(summary.get(results.PEAK))) is not None:
        words = f"The reed touches the seat, with up to {reading(summary, results.PEAK, 'N')}"
    else:
        words = "The reed does not land on the seat"
    if summary.get("stopper_landing_count"):
        face = "retainer" if "retainer" in str(summary.get("stopper_shape", "")) else "stopper"
        words += f" and meets the {face} with up to {_number(summary, ON_STOPPER, 'N')}"
    stress = [
        f"{body} stress up to {_number(summary, key, 'Pa')}{when}"
        for body, key, when in (
            ("reed", results.REED_STRESS, _note_early_stress(summary)),
            ("seat", results.SEAT_STRESS, ""),
        )
        if as_number(summary.get(key))
    ]
    least = [key for key in _margins(summary)[:1] if as_number(summary[key]) is not None]
    margin = [f"{results.name_of(key, summary)} {reading(summary, key, '')}" for key in least]
    sentence = "; ".join(filter(None, (words, ", ".join((*stress, *margin))))) + "."
    return " ".join(filter(None, (sentence, closing_order(summary))))


def _note_early_stress(summary: Summary) -> str:
    """Return that the largest stress of the reed is one before its first contact, if it is."""
    whole, after = (as_number(summary.get(key)) for key in (results.REED_STRESS, results.REED_STRESS_AFTER))
    return " before first contact" if whole is not None and after is not None and whole > after else ""


def _number(summary: Summary, key: str, unit: str) -> str:
    """Return a number with its error bar for the middle of a sentence, marked where the bar is above half of it."""
    words = reading(summary, key, unit)
    unknown = "not known ("
    return f"{words.removeprefix(unknown).removesuffix(')')} (not reliable)" if words.startswith(unknown) else words


def _margin_keys() -> dict[str, str]:
    """Return the keys of all margins, with those whose relative errors they have."""
    return {key: of for each in results.with_margins() for key, of in each.margins.items()}


def _margins(summary: Summary) -> list[str]:
    """Return the keys of the margins of a run, the least first; ``None`` stands for one without a limit."""
    values = {key: summary[key] for key in _margin_keys() if key in summary}
    limits = {key: math.inf if value is None else as_number(value) for key, value in values.items()}
    return sorted((key for key, limit in limits.items() if limit is not None), key=lambda key: limits[key] or 0.0)


def _compare(summary: Summary, key: str) -> Finding:
    """Return what a margin with its error bar says, compared with 1."""
    name = with_capital(results.name_of(key, summary))
    if (value := as_number(summary[key])) is None:
        return Finding(GO, f"{name}: no multiple of the load uses up the life.")
    bar = _bar(summary, key, value)
    if bar is None or not math.isfinite(bar):
        return Finding(UNDECIDED, f"{name} {in_digits(value)}: its uncertainty is not known.")
    bases = [each.basis for each in results.with_margins() if not each.margins.get(key, key)]
    words = [name, write_with_bar(key, value, bar, ""), *(str(summary[each]) for each in bases if each in summary)]
    stated = " ".join(words)
    if not is_known(key, value, bar) or abs(value - 1) <= bar:
        return Finding(UNDECIDED, f"{stated}: its uncertainty includes 1." if abs(value - 1) <= bar else f"{stated}.")
    return Finding(GO, f"{stated}: above 1.") if value > 1 else Finding(NO_GO, f"{stated}: below 1.")


def _bar(summary: Summary, key: str, value: float) -> float | None:
    """Return the error bar of a margin, which may have the relative error of another key."""
    of = _margin_keys()[key]
    other, error = as_number(summary.get(of)), as_number(summary.get(BAR + of))
    if BAR + key not in summary and other and error is not None:
        return value * error / other
    return bar_of(summary, key)


def _landing(summary: Summary) -> Finding | None:
    """Return that no complete landing can be judged, or ``None``."""
    return Finding(UNDECIDED, words) if (words := standing(summary)) else None


def _strength(summary: Summary) -> Finding | None:
    """Return that the strength is missing or not a cited one, or ``None``."""
    if not any(key in summary for key, of in _margin_keys().items() if not of):  # of a stress
        absent = " ".join(each.absent_words for each in results.with_margins())
        return Finding(UNDECIDED, absent or "No margin is computed.")
    stated = [summary[key] for each in results.with_margins() for key in each.sources if summary.get(key) is not None]
    sources = list(dict.fromkeys(str(each).strip() for each in stated))
    doubtful = next((source for source in sources if _NOT_CITED.search(source)), "" if not sources else None)
    if doubtful is None:
        return Finding(GO, f"Strength: {'; '.join(sources)}.")
    named = f'its source: "{doubtful}"' if doubtful else "no source"
    words = f"The strength is not a cited one ({named}): name a file with that of your material as [life] strength."
    return Finding(UNDECIDED, words)


def _gaps(summary: Summary) -> list[Finding]:
    """Return what stress the margins leave out that may be larger than what they judge."""
    larger = summary.get("stress_not_modelled") if _margins(summary) else None
    sentences = [str(summary[key]) for each in results.with_margins() for key in each.gaps if summary.get(key)]
    sentences += [f"{with_capital(str(each))}." for each in larger] if isinstance(larger, list) else []
    return [Finding(UNDECIDED, each) for each in sentences]


def _accuracy(summary: Summary) -> Finding | None:
    """Return whether the accuracy asked for was reached, by measures; ``None`` where nothing was judged."""
    target, met = as_number(summary.get("accuracy_target")), summary.get("accuracy_met")
    if target is None or not isinstance(met, bool):
        return None
    keys = results.asked(summary)
    bars = enumeration(_relative(summary, key) for key in keys)
    several = summary.get("landing_count") != 1 and any(key.startswith(results.LANDING) for key in keys)
    landing = f", {which_landing(summary)}" if several else ""
    reached = "reached" if met else "missed"
    return Finding(GO if met else UNDECIDED, f"Accuracy of {percent(target, 3)} {reached}: {bars}{landing}.")


def _relative(summary: Summary, key: str) -> str:
    """Return the name of a measure with its relative error bar."""
    value, bar, name = as_number(summary.get(key)), as_number(summary.get(BAR + key)), results.name_of(key, summary)
    if not value or bar is None:
        return f"{name} not known"
    share = bar / abs(value)
    return f"{name} ±{percent(share, 3)}" + (" (not known)" if share > MOST_UNCERTAIN else "")


BAR_UNKNOWN: Final = "Uncertainty not known"
TOO_WIDE: Final = "Not known, since the uncertainty is above half of the value"
NO_BAR: Final = "Without an uncertainty"
STATES: Final = (BAR_UNKNOWN, TOO_WIDE, NO_BAR)
BESIDE: Final = ("time_s", "_at_deg", "_at_m", "_over_rho_c0_v", "tilt_deg")
"""Suffixes of keys that state the time or place of another number, a multiple of it, or an input of the scene."""


def not_modelled(summary: readings.Summary) -> list[str]:
    """Return the sentences on effects that the model of a run leaves out."""
    sentences = summary.get("not_modelled")
    return list(map(str, sentences)) if isinstance(sentences, list) else []


def left_out(summary: readings.Summary) -> Iterator[str]:
    """Yield a sentence for each effect that a run leaves out of its model, its uncertainty, or its results."""
    if waves := static_seat(summary):
        yield waves
    elif is_static(summary):
        yield "Waves and stress in the seat are left out: the scene states a spring as its seat."
    for sentence in not_modelled(summary):
        yield f"{with_capital(sentence)}."
    if unknown := str(summary.get("error_unknown") or ""):
        sources = ", ".join(source_in_words(source) for source in unknown.split(", "))
        yield f"Not included in the uncertainty: {sources}."
    if statistics := beyond_horizon(summary):
        yield statistics
    yield from _not_computed(summary)


def omissions(summary: readings.Summary) -> Iterator[str]:
    """Yield a sentence for each thing that the numbers of a run leave out, the short list of `left_out` first."""
    yield from left_out(summary)
    for (words, group), names in _numbers_without_bar(summary).items():
        yield f"{words} ({results.HEADINGS[group].replace('{step}', '')}): {'; '.join(names)}."
    if empty := results.list_missing(summary):
        yield f"Asked for, but without a value in this run: {', '.join(name_of(key, summary) for key in empty)}."
    if summary.get("accuracy_met") is False and (reason := str(summary.get("accuracy_stopped_because") or "")):
        yield f"The accuracy asked for was missed, and no further round followed: {reason}."
    if missing := str(summary.get("pictures_missing") or ""):
        yield f"Pictures that could not be drawn: {missing}."


def _numbers_without_bar(summary: readings.Summary) -> dict[tuple[str, Group], list[str]]:
    """Return the names of numbers whose error is unknown or too large, by reason and by group of rows."""
    open_numbers: dict[tuple[str, Group], list[str]] = {}
    for group, rows in rows_of(summary).items():
        parent = ""
        for row in rows:
            words = words_of(row, summary)
            parent = parent if words.startswith(" ") else words
            value, bar = readings.as_number(summary.get(row.key)), readings.bar_of(summary, row.key)
            if not value or isinstance(summary[row.key], int) or row.key.endswith(BESIDE):
                continue
            if not readings.is_known(row.key, value, bar):
                state = NO_BAR if bar is None else TOO_WIDE if math.isfinite(bar) else BAR_UNKNOWN
                name = f"{parent}: {words.strip()}" if words.startswith(" ") else words
                open_numbers.setdefault((state, group), []).append(name)
    return dict(sorted(open_numbers.items(), key=lambda each: STATES.index(each[0][0])))


def _not_computed(summary: readings.Summary) -> Iterator[str]:
    """Yield the stresses that were not computed, and the keys of the scene that request them."""
    is_a_spring = is_static(summary) and not static_seat(summary)
    if readings.as_number(summary.get(results.SEAT_STRESS)) is None and not is_a_spring:
        yield "Stress in the seat was not computed; add [stress] to the scene (for seats of finite elements)."
    if readings.as_number(summary.get(results.REED_STRESS)) is None:
        yield "Stress in the reed was not computed; add [stress] to the scene (for reeds of plate elements)."


TABLE: Final = "checked_scenes.csv"
"""Table in the package that benchmarks/checked_scenes.py writes."""


def checked_scenes() -> list[dict[str, str]]:
    """Return the rows of `TABLE` as header -> cell."""
    lines = resources.files(__package__).joinpath(TABLE).read_text(encoding="utf-8").splitlines()
    return list(csv.DictReader(lines))


AIM: Final = 0.97
"""Least fraction of numbers with their true error within the bar, as docs/coverage.md states it."""
CHANCE: Final = 0.05  # probability of so few inside, if `AIM` holds, below which bars of a kind of scene count as bad
FEW: Final = 2  # scenes of a kind below which its coverage is thin
CAUTION: Final = "treat the uncertainty with caution"


def how_often_checked(summary: Mapping[str, Any]) -> str:
    """Return in one sentence how many scenes with the run's kinds of seat and reed were compared with finer runs, and
    how many of their uncertainties held; it asks for caution where these are few or held too seldom."""
    seat, reed = _kinds(summary)
    table, kinds = checked_scenes(), f'a seat "{seat}" and a reed "{reed}"'
    scenes, inside, numbers = _sums(each for each in table if (each["seat"], each["reed"]) == (seat, reed))
    if not scenes:
        with_seat, *_ = _sums(each for each in table if each["seat"] == seat)
        with_reed, *_ = _sums(each for each in table if each["reed"] == reed)
        either = f"; {with_seat} had such a seat, {with_reed} such a reed" if with_seat or with_reed else ""
        return f"No test scene with {kinds} was compared with a finer run{either}: {CAUTION}."
    chance = sum(math.comb(numbers, k) * AIM**k * (1 - AIM) ** (numbers - k) for k in range(inside + 1))
    held = f"{inside} of {numbers} results were right within their uncertainty"
    caution = f": {CAUTION}" if scenes < FEW or chance < CHANCE else ""
    return f"{scenes} test scene{'s'[: scenes > 1]} with {kinds} compared with finer runs: {held}{caution}."


def _kinds(summary: Mapping[str, Any]) -> tuple[str, str]:
    return str(summary.get("seat_kind")), str(summary.get("reed_kind"))


def _sums(scenes: Iterable[Mapping[str, str]]) -> tuple[int, int, int]:
    """Return the numbers of scenes, of values with their true error within the bar, and of values."""
    rows = list(scenes)
    count, inside, numbers = (sum(int(each[name]) for each in rows) for name in ("scenes", "inside", "numbers"))
    return count, inside, numbers
