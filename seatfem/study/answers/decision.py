"""A run decides: go, no-go or undecided, and says why, and what its numbers leave out."""

import math
import re
from dataclasses import dataclass
from typing import Final, Literal, NamedTuple

from impact.quantities import enumeration, in_digits, percent, with_capital
from seatfem import results
from seatfem.readings import BAR, MOST_UNCERTAIN, Summary, as_number, bar_of, in_text, is_known, reading
from seatfem.study.answers.omissions import how_often_checked, left_out
from seatfem.study.answers.verdict import closing_order, standing, which_landing

Word = Literal["go", "no-go", "undecided"]
GO: Final = "go"
NO_GO: Final = "no-go"
UNDECIDED: Final = "undecided"
SPEED: Final = "landing_closing_speed_m_per_s"
PEAK_OF_LANDING: Final = results.LANDING + results.PEAK
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
    stress = [
        f"{body} stress up to {_number(summary, key, 'Pa')}"
        for body, key in (("reed", results.REED_STRESS), ("seat", results.SEAT_STRESS))
        if as_number(summary.get(key))
    ]
    least = [key for key in _margins(summary)[:1] if as_number(summary[key]) is not None]
    margin = [f"{results.name_of(key, summary)} {reading(summary, key, '')}" for key in least]
    sentence = "; ".join(filter(None, (words, ", ".join((*stress, *margin))))) + "."
    return " ".join(filter(None, (sentence, closing_order(summary))))


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
    words = [name, in_text(key, value, bar, ""), *(str(summary[each]) for each in bases if each in summary)]
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
