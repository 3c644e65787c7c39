"""The order in which a landing closes the lands of a seat with several, as a sentence."""

import math
from collections.abc import Mapping, Sequence
from typing import Final

from impact.quantities import in_units, with_capital
from seatfem import readings

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
    which is closed all round first; "" for a seat with a single land, or without a landing."""
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
    """Return when the lands are closed all round, the first one first; "" where that is not known of two of them."""
    times = [(time, str(each.get("land"))) for each in lands if (time := readings.as_number(each.get(SEALED)))]
    if len(times) < 2:
        return ""
    in_order = ", ".join(f"{name} at {in_units(time, 's', 4)}" for time, name in sorted(times))
    return f"closed all round: {in_order}"


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
        most = readings.in_text(DELAY, delay + bar, None, "s")
        return f"{_name(land)} within {most} of it, {with_speed}: which of them is earlier is not known"
    return f"{_name(land)} {_time(land, DELAY)} later, {with_speed}"
