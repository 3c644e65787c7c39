"""The error bar of a plate's fatigue margin: the margin itself in the runs of the error budget, in a wider band of the
plate and on a coarser mesh."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

import impact
from impact.greens.base import GreensFunction
from impact.life.places import Demand, judged, on_planes, thinned
from impact.march.rows import MarchRun
from impact.notices import Progress, silent
from impact.runs.variations import SAFETY, Values
from seatfem.life.assess import LifeResult, block_from, body_of
from seatfem.life.table import LifeTable
from seatfem.structures import sheets
from seatfem.structures.fields import peaks, recovery
from seatfem.structures.fields.sites import REACH
from seatfem.structures.method import COARSENING
from seatfem.study.impacts.bodies import problem_of, striker_of
from seatfem.study.impacts.contact import marched
from seatfem.study.impacts.plate_stress import PlateLook, plate_field
from seatfem.study.method import REED_BAND
from seatfem.study.runs import kept, stresses
from seatfem.study.runs.reed_stress import PlateStress
from seatfem.study.runs.round import Round

NEAR: Final = 0.75  # least stress range of a place, over the largest, that may have the least margin in another run
MOST: Final = 12  # most such places of each part
WORST: Final = 0.85  # least range of a place in one run, over the largest there, whose margin is computed
MARGIN: Final = "life_margin"


@dataclass(frozen=True)
class MarginLook:
    """Function that computes the least margin of a plate from the contact forces of a run.

    Attributes:
        look: field of the plate at the places that may have the least margin, its body the striker at the start.
        regions: (P,) names of the parts on which they lie.
        demand: design life and criteria.
        turn: duration of the last part of a run that repeats [s]; ``inf``: the whole run.
    """

    look: PlateLook
    regions: NDArray[np.str_]
    demand: Demand
    turn: float = math.inf

    def __call__(self, run: MarchRun) -> Values:
        field, pushes, dt = self.look.in_run(run)
        first = 0 if math.isinf(self.turn) else max(0, len(pushes) - 1 - round(self.turn / dt))
        ranges = peaks.mises_range(field, pushes, dt, since=first)
        worst = peaks.hottest(ranges, self.regions, 1)
        worst = worst[ranges[worst] >= WORST * ranges.max()]
        courses = recovery.tensor_histories(field.at(worst), pushes, dt)
        blocks = [thinned(course[first:]) for course in courses]
        histories = on_planes(("", sign * block) for block in blocks for sign in (1.0, -1.0))
        return {MARGIN: judged(histories, self.demand).life.margin}

    def moved_to(self, field: recovery.StressField) -> MarginLook:
        """Return the look at these places of another model of the plate, by its ``field``."""
        own = cKDTree(self.look.field.points)
        spacing = float(np.median(cKDTree(field.points).query(field.points, k=[2])[0]))
        distance, nearest = map(np.asarray, own.query(field.points))
        near = np.asarray(distance <= max(REACH * spacing, float(distance.min())))
        other = replace(self.look, field=field.at(near))
        return replace(self, look=other, regions=self.regions[nearest[near]])


def margin_bar(
    life: LifeTable, done: Round, reed: PlateStress, result: LifeResult, progress: Progress = silent
) -> float:
    """Return the error bar of the least margin of a plate; nan where another body has the least one, and in a run
    without contact.

    It is `SAFETY` times the combined changes by the runs of the error budget, of the change in a wider band of the
    plate, where that is larger than the one by its band alone, and of that on a coarser mesh. In each run the least
    margin is that at the place of each part with the largest stress range among those whose range is at least `NEAR` of
    the largest in the run itself.
    """
    worst = result.of_one_axis
    if worst is None or body_of(worst.worst.at) != reed.role or math.isnan(done.touch):
        return math.nan
    demand, turn = life.demand(), done.plan.scene.turn
    assert demand is not None
    cycle = turn if life.block == "last cycle" and turn is not None else math.inf
    numbers = kept.cached_numbers(
        done, done.touches, "errors of the margin",
        lambda: _errors(life, done, reed, replace(demand, several_axes=None), cycle, progress),
    )  # fmt: skip
    by_key = numbers["force"]
    of_plate = max(numbers["band"], by_key.get(REED_BAND, 0.0))
    others = (error for key, error in by_key.items() if key != REED_BAND)
    return SAFETY * math.hypot(of_plate, numbers["mesh"], *others)


def _errors(
    life: LifeTable, done: Round, reed: PlateStress, demand: Demand, turn: float, progress: Progress
) -> dict[str, object]:
    """Return the errors of the margin by the ``force``, by key, by the plate's ``band`` and its ``mesh``."""
    scene, strike = done.plan.scene, reed.strike
    first, greens = block_from(life, scene.turn, strike.touches), strike.striker.greens
    likely = reed.likely[reed.counted[reed.likely]]
    ranges = peaks.mises_range(reed.field.at(likely), reed.force, reed.dt, since=first)
    hottest = peaks.hottest(ranges, reed.regions[likely], MOST)
    places = likely[hottest[ranges[hottest] >= NEAR * ranges.max()]]
    at_start = PlateLook(reed.reed, replace(reed.field.at(places), body=strike.striker), strike.division)
    look = MarginLook(at_start, reed.regions[places], demand, turn)
    budget, _ = stresses.error_bars_of(done, look, progress=progress)
    force, own = {key: part[MARGIN] for key, part in budget.parts.items()}, budget.values[MARGIN]
    plate, method = reed.reed.plate(greens), done.plan.method.reed
    lips = reed.reed.lips(method.lip, method.behind)

    def in_model(other: GreensFunction, *, runs: bool) -> float:
        """Return the margin by another model of the plate, in a run of its own or under the same forces."""
        striker = striker_of(scene, greens=other)
        problem = problem_of(scene, striker if runs else done.striker, impact.Body(done.seat.greens))
        run = marched(problem, reed.dt, scene.run.duration, done.flights)
        return look.moved_to(plate_field(scene.geometry, striker, strike.division))(run)[MARGIN]

    coarser = sheets.plate_modes(plate.sheet, COARSENING)
    on_coarser = in_model(coarser.greens(lips, reed.reed.damping_ratio), runs=False)
    mesh = abs(on_coarser - own) / (sheets.refinement(plate, coarser) ** sheets.ORDER - 1)
    if (beyond := reed.reed.in_wider_band(greens, lips)) is None:
        return {"force": force, "band": math.inf, "mesh": mesh}
    return {"force": force, "band": abs(in_model(beyond[0], runs=True) - own) / (1 - beyond[1] ** -2), "mesh": mesh}
