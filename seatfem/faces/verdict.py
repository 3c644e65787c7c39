"""What a run means, in one sentence: whether a spring would have served in place of the seat."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from impact.pictures.drawing import scaled
from seatfem.study.scene.measures import all_measures, key_of

OF_EACH_STEP: Final = ("max_seat_displacement_m",)
"""Measures in which the spring follows the force of every single step, so that its value depends on the step."""


@dataclass(frozen=True)
class Difference:
    """The spring baseline against the seat, in one measure.

    Attributes:
        key: of the measure in summary.json.
        relative: spring/seat - 1.
        bars: |spring - seat| over the seat's error bar; ``inf`` for a bar of zero, 0 where there is no difference.
    """

    key: str
    relative: float
    bars: float


def difference(summary: Mapping[str, object], key: str) -> Difference | None:
    """Of one measure; ``None`` where it has no error bar, or seat or spring have no value to compare."""
    seat, spring, bar = (as_number(summary.get(name)) for name in (key, f"spring_{key}", f"error_bar_{key}"))
    if seat is None or spring is None or bar is None or seat == 0.0 or key in OF_EACH_STEP:
        return None
    off = abs(spring - seat)
    return Difference(key, spring / seat - 1, off / bar if bar > 0 else (math.inf if off > 0 else 0.0))


def verdict(summary: Mapping[str, object]) -> str:
    """One sentence for people, from the numbers of summary.json.

    The measures that the accuracy was asked for are compared, or, where a spring has none of them, filtered peak and
    impulse. A difference counts if it is larger than the error bar of the seat's value.
    """
    if summary.get("first_contact_s") is None and not summary.get("film_force_peak_N"):
        return "No contact within run.duration: nothing to compare."
    if summary.get("seat_kind") == "spring":
        return "The seat is a spring: it is its own baseline."
    if summary.get("plan_seat_level") == "spring":
        return _by_plan(summary)
    found = [d for key in asked(summary) if (d := difference(summary, key)) is not None]
    found = found or [
        d for name in ("filtered_peak", "impulse") if (d := difference(summary, key_of(name))) is not None
    ]
    if not found:
        return ""
    told = sorted((d for d in found if d.bars > 1), key=lambda d: -abs(d.relative))
    if not told:
        return _alike(summary, found)
    first, *others = (
        f"{100 * abs(d.relative):.2g} % {'high' if d.relative > 0 else 'low'} in the {name_of(d.key, summary)} here, "
        f"{count(d.bars)} error bars"
        for d in told
    )
    more = "".join(f"; and {words}" for words in others).replace(" here,", ",")
    return f"A constant stiffness would be {first}{more}."


def simpler(summary: Mapping[str, object]) -> str:
    """What simpler models would say of a contact with a film or along a lip, in one line; "" of other contacts."""
    told: list[str] = []
    for words, name in (("one without the film", "without_film"), ("one port", "one_port"), ("a beam", "beam")):
        peak, impulse = (as_number(summary.get(f"{name}_{key}")) for key in ("filtered_peak_force_N", "impulse_Ns"))
        if peak is not None and impulse is not None:
            told.append(f"{words}{'' if told else ' would say'} {_text(peak, 'N')} and {_text(impulse, 'N s')}")
    over = duration(summary.get("filter_width_s"))
    return f"simpler models: {', '.join(told)} (peak, {over} mean, and impulse)" if told else ""


def lasting(summary: Mapping[str, object]) -> str:
    """How long the reed lives, in one line with the source of its strength; "" where nobody asked."""
    told = []
    if "life_margin" in summary:
        margin, cycles = as_number(summary["life_margin"]), as_number(summary.get("life_cycles"))
        wanted, share = (as_number(summary.get(f"life_{key}")) for key in ("design_cycles", "survival"))
        bar = as_number(summary.get("error_bar_life_margin"))
        assert wanted is not None
        assert share is not None
        body = str(summary["life_at"]).partition(",")[0]
        asked_for = f"{wanted:.3g} cycles with {100 * share:.6g} % survival"
        more = "" if bar is None else f" +- {bar:.2g}"
        if margin is None:
            told.append(f"no stress, however large, uses up {asked_for}")
        elif margin >= 1:
            told.append(f"the {body} endures {asked_for}, also under {margin:.3g}{more} times the stress")
        else:
            lived = "at once" if cycles is None else f"after {cycles:.3g} of {asked_for}"
            told.append(f"the {body} fails {lived}; it would endure {margin:.3g}{more} of the stress")
        told[-1] += f" ({summary['life_at']}; {summary['life_criterion']}; {summary['life_strength_source']})"
    for name in ("multiaxial", "contact"):
        if (margin := as_number(summary.get(f"life_{name}_margin"))) is None:
            continue
        wanted, at = as_number(summary.get(f"life_{name}_cycles")), str(summary[f"life_{name}_at"])
        through = "the cycles of the two limits" if wanted is None else f"{wanted:.3g} cycles"
        body = name if name == "contact" else at.partition(",")[0]
        by = f"{at}; {summary[f'life_{name}_criterion']}; {summary['life_strength_source']}"
        told.append(f"the {body} endures {through} under {margin:.3g} times the stress ({by})")
    if (speed := as_number(summary.get("life_speed_margin"))) is not None:
        closing, limit = (as_number(summary[f"life_speed_{key}"]) for key in ("m_per_s", "limit_m_per_s"))
        told.append(
            f"it closes at {closing:.3g} m/s, {1 / speed:.3g} of the {limit:.3g} m/s allowed "
            f"({summary['life_speed_source']})"
        )
    return f"fatigue: {'; '.join(told)}".replace("\n", "\\n") if told else ""


def _text(value: float, unit: str) -> str:
    factor, prefixed = scaled(value, unit)
    return f"{factor * value:.3g} {plain(prefixed)}"


def name_of(key: str, summary: Mapping[str, object]) -> str:
    """A measure in words."""
    names = {each.key: each.words for each in all_measures().values()} | {
        "filtered_peak_force_N": f"peak force (mean over {duration(summary.get('filter_width_s'))})",
        "peak_reed_stress_Pa": "reed stress",
    }
    return names.get(key, key)


def duration(value: object) -> str:
    """Seconds with their unit, in plain letters."""
    number = as_number(value)
    if number is None:
        return "?"
    factor, unit = scaled(number, "s")
    return f"{factor * number:.3g} {plain(unit)}"


def plain(unit: str) -> str:
    """A unit in letters that every terminal has."""
    return unit.replace("µ", "u")


def as_number(value: object) -> float | None:
    """A finite number, or nothing."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        return None
    return float(value)


def asked(summary: Mapping[str, object]) -> tuple[str, ...]:
    """The keys of the measures that the scene asks for."""
    names = str(summary.get("accuracy_measures", "")).split(", ")
    return tuple(each.key for name, each in all_measures().items() if name in names)


def _by_plan(summary: Mapping[str, object]) -> str:
    names = " and ".join(name_of(key, summary) for key in asked(summary)) or "the measures"
    counted = f"what the seat's waves would change in {names} is counted in the error bars."
    serves = "Here a spring of the right stiffness serves. " if summary.get("accuracy_met") is True else ""
    took = "The plan took the seat for its static stiffness"
    apart = "which its arcs share, and those of the baseline do not"
    if "seat.model" in str(summary.get("plan_given", "")).split(", "):
        alone = apart if "ports" in summary else "the spring baseline itself"
        return f"seat.model = 'spring': the seat is its static stiffness alone, {alone}."
    if "ports" in summary:
        return f"{serves}{took}, {apart}: {counted} seat.model states another model."
    return (
        f"{serves}{took}, a spring: {counted} Seat and spring are alike for that reason; "
        "seat.model states another model."
    )


def _alike(summary: Mapping[str, object], found: list[Difference]) -> str:
    largest = max(found, key=lambda d: abs(d.relative))
    bar, value = (as_number(summary.get(prefix + largest.key)) for prefix in ("error_bar_", ""))
    assert bar is not None
    assert value is not None
    names = " and ".join(name_of(d.key, summary) for d in found)
    against = f"{100 * abs(largest.relative):.2g} % against {100 * bar / abs(value):.2g} %"
    if summary.get("accuracy_met") is False:
        return f"Whether a spring would serve cannot be told: the difference is below a wide error bar ({against})."
    return f"Here a spring serves: the difference in {names} is below the error bar ({against} at most)."


def count(bars: float) -> str:
    """So many error bars."""
    return "> 1000" if bars > 1000 else f"{bars:.2g}" if bars < 100 else f"{bars:.0f}"
