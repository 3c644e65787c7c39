"""The error bar of a fatigue margin: the margin itself in other runs, bands and meshes of the body."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from typing import Final

from impact.greens.base import Array
from impact.life.places import Demand, judged, on_planes, thinned
from impact.notices import Progress, silent
from impact.runs.variations import SAFETY
from seatfem.life.assess import LifeResult, block_from, body_of
from seatfem.life.table import LifeTable
from seatfem.study.runs import kept
from seatfem.study.runs.body_stress import BodyStress
from seatfem.study.runs.round import Round

MARGIN: Final = "life_margin"


def margin_bar(
    life: LifeTable, done: Round, reed: BodyStress, result: LifeResult, progress: Progress = silent
) -> float:
    """Return the error bar of the least margin of the reed: `SAFETY` times the combined `BodyStress.errors_of_value`;
    nan where that is not known, where another body has the least margin, and in a run without contact."""
    worst = result.of_one_axis
    if worst is None or body_of(worst.worst.at) != reed.role or math.isnan(done.touch):
        return math.nan
    demand, turn = life.demand(), done.plan.scene.turn
    assert demand is not None
    cycle = turn if life.block == "last cycle" and turn is not None else math.inf
    first = block_from(life, turn, done.touches)
    margin_of = partial(least_margin, replace(demand, several_axes=None))
    cached = partial(kept.cached_numbers, done, done.touches, "errors of the margin")
    errors = reed.errors_of_value(done, margin_of, first, cycle, cached, progress)
    return SAFETY * math.hypot(*errors.values()) if errors else math.nan


def least_margin(demand: Demand, blocks: Iterable[Array]) -> float:
    """Return the least margin under stress histories (m, 6) of several places, in both faces of a plate."""
    histories = on_planes(("", sign * thinned(block)) for block in blocks for sign in (1.0, -1.0))
    return judged(histories, demand).life.margin
