"""Landings on each land of a seat with several: which lands one landing closes, in which order, and how hard.

A landing on a land is what `impact.after.landings` makes of the forces on that land alone. Those that begin during the
hardest landing on the seat say in which order this landing closes the lands.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from impact.after.histories import line_force_peak
from impact.after.landings import Landing, hardest, pair_landings
from seatfem.study.impacts.landings import Landings, land_place
from seatfem.study.scene.measures import Line

SHARE: Final = "impulse_share"
LINE_FORCE: Final = "line_force_peak_N_per_m"
DELAY: Final = "after_first_s"
TOGETHER: Final = 1e-6  # fraction of a step, or of a landing, within which times count as one


def landings_of_lands(landings: Landings) -> tuple[Landing | None, ...]:
    """Return the hardest landing on each land that begins during the hardest one on the seat; ``None`` for a land that
    is not touched in it."""
    if (whole := landings.hardest) is None:
        return (None,) * len(landings.lands)
    early = TOGETHER * max(whole.duration, 1e-9)
    return tuple(
        hardest([one for one in each if whole.start - early <= one.start < whole.end]) for each in landings.lands
    )


def values_of_lands(
    line: Line | None, landings: Landings, width: float, like: Landings | None = None
) -> dict[str, float]:
    """Return, by name, the largest force per length on each land during the hardest landing [N/m], the time from the
    first touch of any land to its own [s], and its share of the impulse on all lands during the hardest landing.

    Args:
        line: contact along the lips; ``None``, or of a single land: there are no values.
        landings: landings of the run.
        width: width of the filter [s].
        like: landings of a neighbouring run, whose partners are taken; infinite values for one without partner.
    """
    if line is None or len(line.lands) != len(landings.lands):
        return {}
    of_lands = landings_of_lands(like or landings)
    own = tuple(
        one if like is None else _partner(one, like.lands[k], landings.lands[k]) for k, one in enumerate(of_lands)
    )
    first = min((one.touch for one in own if one is not None), default=math.nan)
    values, shares = {}, _shares(line, _hardest(landings, like))
    for k, (asked, one) in enumerate(zip(of_lands, own, strict=True)):
        if asked is not None:
            place = land_place(k)
            delay = math.inf if one is None else one.touch - first
            values[f"{place} {DELAY}"] = delay if delay > TOGETHER * line.grid.dt else 0.0
            values[f"{place} {SHARE}"] = shares[k]
            values[f"{place} {LINE_FORCE}"] = math.inf if one is None else largest_line_force(line, k, one, width)
    return values


def _hardest(landings: Landings, like: Landings | None) -> Landing | None:
    """Return the hardest landing on the seat, or the partner of that of a neighbouring run."""
    if like is None or like.hardest is None:
        return landings.hardest
    return _partner(like.hardest, like.seat, landings.seat)


def _shares(line: Line, landing: Landing | None) -> list[float]:
    """Return the share of each land in the impulse of a landing, loads included; infinite without one."""
    if landing is None:
        return [math.inf] * len(line.lands)
    rows = _rows_of(line, landing)
    impulses = np.diff(line.grid.time)[rows] @ line.force[1:][rows]
    return [float(impulses[land].sum() / impulses.sum()) for land in line.lands]


def _rows_of(line: Line, landing: Landing) -> slice:
    """Return the steps of the grid during a landing."""
    begins, ends = line.grid.time[:-1], line.grid.time[1:]
    rows = np.flatnonzero((ends > landing.start) & (begins < landing.end + line.grid.dt / 2))
    return slice(int(rows[0]), int(rows[-1]) + 1)


def _partner(one: Landing | None, landings: tuple[Landing, ...], others: tuple[Landing, ...]) -> Landing | None:
    pairs = zip(landings, pair_landings(landings, others), strict=True)
    return next((other for each, other in pairs if each is one), None)


def largest_line_force(line: Line, number: int, landing: Landing, width: float) -> float:
    """Return the largest force per length on a land during a landing on it [N/m], as a mean over the ``width`` [s] and
    over the length of line over which all forces along the lip are averaged; lands are numbered from 0."""
    arcs, lengths = line.lands[number], line.lengths
    own, span = lengths[arcs], _rows_of(line, landing)
    share = min(1.0, line.share * float(lengths.sum()) / float(own.sum()))
    times = line.grid.time[span.start : span.stop + 1]
    piece = (len(own), line.pieces[number][1])
    return line_force_peak(line.force[1:][span, arcs], times, width, own, share, (piece,))[0]


def closed_all_round(line: Line, number: int, landing: Landing) -> float | None:
    """Return the time by which every segment of a land has touched during a landing on it [s]; ``None`` if one has not.

    It is known to whole steps."""
    pressed = (line.force - line.film)[:, line.lands[number]] > 0
    during = (line.grid.time > landing.start) & (line.grid.time <= landing.end + line.grid.dt / 2)
    touched = pressed & during[:, None]
    if not touched.any(axis=0).all():
        return None
    begins = np.concatenate([[0.0], line.grid.time[:-1]])
    return max(landing.touch, float(begins[touched.argmax(axis=0)].max()))
