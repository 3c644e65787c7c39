"""Pictures of fatigue margins, on the surfaces of bodies and over the values of a key."""

from __future__ import annotations

import math
import os
from collections.abc import Sequence
from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np

from impact.greens.base import Array
from impact.life import places
from impact.life.places import Demand
from impact.pictures.drawing import BLUE, GREEN, GREY, ORANGE, sheet
from seatfem.life.assess import block_from
from seatfem.life.table import LifeTable
from seatfem.pictures import moving
from seatfem.study.runs import pictures
from seatfem.study.runs.body_stress import BodyStress
from seatfem.study.runs.round import Round

if TYPE_CHECKING:
    from seatfem.pictures import rendering

PICTURE: Final = "margin_map.png"


def margin_pictures(life: LifeTable, done: Round, bodies: Sequence[BodyStress]) -> list[rendering.Picture]:
    """Return margin_map.png, seat_margin.vtu and reed_margin.vtu of the bodies with a strength and a stress in finite
    elements; none unless the scene has [stress]."""
    if done.plan.scene.stress is None:
        return []
    first = block_from(life, done.plan.scene.turn, done.touches)
    demands = {"seat": life.demand("seat"), "reed": life.demand()}
    try:
        asked = [(body, demand) for body in bodies if (demand := demands[body.role]) is not None]
        every = (body.margin_map(partial(margin_of, demand), first) for body, demand in asked)
        maps = [each for each in every if each is not None]
    except Exception as problem:  # all numbers are on file: the missing picture is reported instead
        return [(PICTURE, partial(pictures.raising, problem))]
    if not maps:
        return []
    criterion = f" ({life.multiaxial})" if life.multiaxial else f" ({life.criterion}, critical plane)"
    title = f"{done.plan.scene.title or 'Fatigue'}: fatigue margin{criterion}\n"
    files: list[rendering.Picture] = [
        (f"{each.title}_margin.vtu", partial(moving.write_surface, each, {"margin": each.colours[0]})) for each in maps
    ]
    return [(PICTURE, partial(moving.plot_margin_map, maps, title=title)), *files]


def margin_of(demand: Demand, history: Array) -> float:
    """Return the factor on a stress ``history`` (m, 6) [Pa] at which it uses up the design life, or reaches the limit
    of the multiaxial criterion if there is one. Raises `LifeError` as `impact.life.places.judged`."""
    block = places.thin_history(history)
    if demand.several_axes is not None:
        return places.judged([("", block)], demand).tensor_margin or 0.0
    life = places.judged(places.resolve_on_planes([("", block)]), demand).life
    return math.inf if life is None else life.margin


ROUND: Final = (0.1, 0.2, 0.3, 0.5, 0.7, 1, 1.5, 2, 3, 5, 7, 10, 20, 50, 100)
FINER: Final = tuple(round(0.1 * number, 1) for number in range(1, 50))
"""Ticks that are used if fewer than three of the round ones lie on the axis."""


def plot_margins(
    values: Sequence[float],
    margins: Sequence[float],
    bars: Sequence[float],
    path: str | os.PathLike[str],
    *,
    label: str,
    allowed: float = math.nan,
    title: str = "Fatigue margin",
) -> None:
    """Draw margins (ratios) with error bars on a logarithmic scale, the limit 1, and the allowed value.

    Args:
        values, margins, bars: fields of `MarginCurve`; infinite margins and unknown bars are omitted.
        label: label of the values, with their unit.

    Raises:
        PictureError: matplotlib is missing.
    """
    spare = np.asarray(margins, dtype=float)
    half = np.nan_to_num(np.asarray(bars, dtype=float))
    shown = np.isfinite(spare) & (spare > 0)
    with sheet(path, 6.0, 3.8) as figure:
        figure.suptitle(title)
        axes = figure.add_subplot()
        where, height = np.asarray(values, dtype=float)[shown], spare[shown]
        below = np.minimum(half[shown], 0.99 * height)  # bars end above 0, which is not on the scale
        axes.errorbar(where, height, np.vstack([below, half[shown]]), marker="o", markersize=4, capsize=2.5, color=BLUE)
        axes.axhline(1.0, color=ORANGE, linestyle=(0, (4, 2)))
        axes.annotate(
            "fails", (0.01, 1.0), (0, -3), axes.get_yaxis_transform(), "offset points", color=ORANGE, va="top"
        )
        if not math.isnan(allowed):
            axes.axvline(allowed, color=GREEN, linewidth=1.0)
            axes.plot([allowed], [1.0], marker="D", color=GREEN)
            place = (5, -4) if 2 * allowed < sum(axes.get_xlim()) else (-5, -4)
            side, top = "left" if place[0] > 0 else "right", axes.get_xaxis_transform()
            words = f"allowed: {allowed:.4g}"
            axes.annotate(words, (allowed, 1.0), place, top, "offset points", color=GREEN, va="top", ha=side)
        axes.set_yscale("log")
        low, high = axes.get_ylim()
        rounded = ([tick for tick in each if low <= tick <= high] for each in (ROUND, FINER))
        ticks = next((each for each in rounded if len(each) > 2), [1.0])
        axes.set_yticks(ticks, [f"{tick:g}" for tick in ticks])
        axes.minorticks_off()
        axes.tick_params(colors="black", grid_color=GREY, grid_alpha=0.3)
        axes.set_xlabel(label)
        axes.set_ylabel("margin")
