"""The life of a run in one line."""

from __future__ import annotations

from typing import Final

from impact.quantities import in_digits, percent
from seatfem.readings import BAR, Summary, as_number, is_known

MARGIN: Final = "life_margin"
OF_SPEED: Final = ("margin", "m_per_s", "limit_m_per_s")
"""Suffixes of the keys life_speed_... that the sentence on the closing speed needs."""


def life_sentence(summary: Summary) -> str:
    """Return the life of the reed in one line, with the source of its strength; "" if it was not requested.

    Values that the summary lacks, as one of an earlier version may, are omitted from the sentences.
    """
    sentences = []
    if MARGIN in summary:
        margin, cycles = as_number(summary[MARGIN]), as_number(summary.get("life_cycles"))
        design_cycles, share = (as_number(summary.get(f"life_{key}")) for key in ("design_cycles", "survival"))
        bar = as_number(summary.get(BAR + MARGIN))
        body = _body_at(summary, "life_at")
        asked_for = "the cycles asked for" if design_cycles is None else f"{in_digits(design_cycles)} cycles"
        asked_for += "" if share is None else f" with {percent(share, 6)} survival"
        plus = "" if bar is None else f" +- {in_digits(bar, 2)}"
        if bar is not None and margin is not None and not is_known(MARGIN, margin, bar):
            plus += " (not known)"
        if margin is None:
            sentences.append(f"no multiple of the stress uses up the life of {asked_for}")
        elif margin >= 1:
            sentences.append(f"the {body} endures {asked_for} even with {in_digits(margin)}{plus} times the stress")
        else:
            lived = "at once" if cycles is None else f"after {in_digits(cycles)} of {asked_for}"
            sentences.append(f"the {body} fails {lived}; it would endure {in_digits(margin)}{plus} of the stress")
        sentences[-1] += _in_brackets(summary, "life_at", "life_criterion", "life_strength_source")
    for name in ("multiaxial", "contact"):
        if (margin := as_number(summary.get(f"life_{name}_margin"))) is None:
            continue
        design_cycles = as_number(summary.get(f"life_{name}_cycles"))
        through = "the cycles of the two limits" if design_cycles is None else f"{in_digits(design_cycles)} cycles"
        body = name if name == "contact" else _body_at(summary, f"life_{name}_at")
        note = _in_brackets(summary, f"life_{name}_at", f"life_{name}_criterion", "life_strength_source")
        sentences.append(f"the {body} endures {through} with {in_digits(margin)} times the stress{note}")
    speed, closing, limit = (as_number(summary.get(f"life_speed_{key}")) for key in OF_SPEED)
    if speed and closing is not None and limit is not None:
        share_of_limit = f"{in_digits(1 / speed)} of the {in_digits(limit)} m/s allowed"
        note = _in_brackets(summary, "life_speed_source")
        sentences.append(f"it closes at {in_digits(closing)} m/s, {share_of_limit}{note}")
    return f"fatigue: {'; '.join(sentences)}".replace("\n", "\\n") if sentences else ""


def _body_at(summary: Summary, key: str) -> str:
    """Return the body of a place such as "reed, x = 3 mm"; "body" if the summary does not name one."""
    return str(summary.get(key) or "body").partition(",")[0]


def _in_brackets(summary: Summary, *keys: str) -> str:
    """Return the values of the keys that the summary has, in parentheses; "" if it has none."""
    stated = [str(value) for key in keys if (value := summary.get(key))]
    return f" ({'; '.join(stated)})" if stated else ""
