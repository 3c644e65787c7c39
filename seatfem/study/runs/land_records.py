"""Records of the lands of a seat with several, for summary.json."""

from __future__ import annotations

import math

from impact.after.landings import Landing
from impact.quantities import finite_or_none
from impact.runs.variations import Budget
from seatfem.study.impacts.landings import DELAY, LINE_FORCE, SHARE, closed_all_round, land_place, landings_of_lands
from seatfem.study.impacts.touches import OF_A_LANDING, Touches, landing_name
from seatfem.study.scene.measures import Line

OF_A_LAND = tuple(key for field, key in OF_A_LANDING.items() if field != "restitution")
"""Keys of a landing that one of several lands has by itself: the reed's energy belongs to none of them."""

ACROSS = (DELAY, SHARE, LINE_FORCE)
"""Further keys of a land, which compare it with the others in one landing or belong to that landing."""


def land_keys(touches: Touches, budget: Budget) -> dict[str, object]:
    """Return the lists `lands`, a record of each land in the hardest landing on the seat, and `land_landings`, a record
    of every landing on each land in the order of time; none on a seat with a single land."""
    line, landings = touches.line, touches.landings
    if line is None or not landings.lands:
        return {}
    of_lands = landings_of_lands(landings)
    order = sorted((one.touch, number) for number, one in enumerate(of_lands) if one is not None)
    numbers = {number: place for place, (_, number) in enumerate(order, start=1)}
    lands = [
        {
            "land": line.names[number],
            "order": numbers.get(number),
            **_numbers(touches, budget, number, one),
            "closed_all_round_s": one and closed_all_round(line, number, one),
            "land_deg": one and _angle(touches, line, number, one),
            "landing_count": len(landings.lands[number]),
            "segments": line.lands[number].stop - line.lands[number].start,
            "length_m": float(line.lengths[line.lands[number]].sum()),
        }
        for number, one in enumerate(of_lands)
    ]
    in_time = sorted(
        (one.touch, number, index) for number, each in enumerate(landings.lands) for index, one in enumerate(each)
    )
    every = [
        {
            "land": line.names[number],
            "number": index + 1,
            **_numbers(touches, budget, number, landings.lands[number][index], alone=True),
        }
        for _, number, index in in_time
    ]
    return {"lands": lands, "land_landings": every}


def _numbers(
    touches: Touches, budget: Budget, number: int, landing: Landing | None, *, alone: bool = False
) -> dict[str, object]:
    """Return the numbers of a landing on a land with their error bars, ``None`` for what it has not; ``alone``: without
    those that compare the lands of one landing."""
    place, names = land_place(number), {}
    if landing is not None:
        index = touches.landings.lands[number].index(landing)
        names = {key: landing_name(place, index, key) for key in OF_A_LAND}
        names |= {} if alone else {key: f"{place} {key}" for key in ACROSS}
    known = {key: name for key, name in names.items() if name in budget.values}
    keys = OF_A_LAND if alone else (*OF_A_LAND, *ACROSS)
    return {
        **{key: budget.values[known[key]] if key in known else None for key in keys},
        "static_load_N": landing and landing.static_load,
        "pressed_on": landing and landing.pressed_on,
        **{f"error_bar_{key}": finite_or_none(budget.bar(known[key])) if key in known else None for key in keys},
    }


def _angle(touches: Touches, line: Line, number: int, landing: Landing) -> float | None:
    """Return the angle of the first touch on a land about its own centre [deg], the least of several at once; ``None``
    on one that is no ring."""
    assert touches.parts is not None
    rings = touches.parts.rows.force.shape[1] // line.force.shape[1]
    first, parts = line.lands[number].start, landing.first_parts or (landing.part,)
    angles = [line.land_of(first + part // rings)[1] for part in parts]
    return min((angle for angle in angles if not math.isnan(angle)), default=None)
