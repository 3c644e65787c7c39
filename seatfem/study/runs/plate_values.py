"""The errors of a value of a plate's stress histories, such as its fatigue margin: the value itself in the runs of the
error budget, in a wider band of the plate and on a coarser mesh."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

import impact
from impact.greens.base import Array
from impact.march.problem import ContactProblem
from impact.march.rows import MarchRun
from impact.notices import Progress
from impact.runs.variations import Values
from seatfem.structures import sheets
from seatfem.structures.fields import peaks, recovery
from seatfem.structures.fields.sites import REACH
from seatfem.structures.kinds.thin_plate import ThinPlate
from seatfem.structures.method import COARSENING
from seatfem.study.impacts.bodies import problem_of, striker_of
from seatfem.study.impacts.contact import marched
from seatfem.study.impacts.forces import Strike
from seatfem.study.impacts.plate_stress import PlateLook, plate_field
from seatfem.study.method import REED_BAND
from seatfem.study.runs.body_stress import ValueOf
from seatfem.study.runs.error_bars import error_bars_of, runs_of_budget
from seatfem.study.runs.round import Round

NEAR: Final = 0.75  # least stress range of a place, over the largest, that may have the least value in another run
MOST: Final = 12  # most such places of each part
WORST: Final = 0.95  # least range of a place in one run, over the largest there, whose value is computed
FEW: Final = 8  # most such places
VALUE: Final = "value"


@dataclass(frozen=True)
class ValueLook:
    """Function that computes a value of a plate's stress from the contact forces of a run: the least of up to `FEW`
    places whose stress range is at least `WORST` of the largest in that run. One place of the largest range alone would
    let the value jump to that of another place, of nearly the same range and another mean stress.

    Attributes:
        look: field of the plate at the places that may have the least value, its body the striker at the start.
        value_of: the value of stress histories.
        turn: duration of the last part of a run that repeats [s]; ``inf``: the whole run.
    """

    look: PlateLook
    value_of: ValueOf
    turn: float = math.inf

    def __call__(self, run: MarchRun) -> Values:
        field, pushes, dt = self.look.in_run(run)
        first = 0 if math.isinf(self.turn) else max(0, len(pushes) - 1 - round(self.turn / dt))
        ranges = peaks.mises_range(field, pushes, dt, since=first)
        worst = np.argsort(-ranges, kind="stable")[: min(FEW, np.count_nonzero(ranges >= WORST * ranges.max()))]
        courses = recovery.tensor_histories(field.at(worst), pushes, dt)
        return {VALUE: self.value_of(course[first:] for course in courses)}

    def moved_to(self, field: recovery.StressField) -> ValueLook:
        """Return the look at these places of another model of the plate, by its ``field``."""
        return replace(self, look=replace(self.look, field=beside(field, self.look.field.points, REACH)))


def beside(field: recovery.StressField, points: Array, reach: float) -> recovery.StressField:
    """Return a field at those of its places that lie within ``reach`` times their median distance of given points
    (n, 2), or at the nearest ones."""
    spacing = float(np.median(cKDTree(field.points).query(field.points, k=[2])[0]))
    distance = np.asarray(cKDTree(points).query(field.points)[0])
    return field.at(np.asarray(distance <= max(reach * spacing, float(distance.min()))))


def places_of_value(ranges: Array, regions: NDArray[np.str_]) -> NDArray[np.int64]:
    """Return the places with the largest stress ``ranges`` (P,) of each part, at most `MOST` of it, that
    are at least `NEAR` of the largest of all."""
    hottest = peaks.hottest(ranges, regions, MOST)
    near: NDArray[np.int64] = hottest[ranges[hottest] >= NEAR * ranges.max()]
    return near


def errors_of_value(
    done: Round,
    plate: ThinPlate,
    strike: Strike,
    field: recovery.StressField,
    value_of: ValueOf,
    turn: float,
    progress: Progress,
) -> dict[str, float]:
    """Return the errors of the least value at the places of a ``field`` by source: the keys of the error budget and the
    ``mesh`` of the ``plate``. That by its band is the larger one of two, a wider band among them, ``inf`` where there
    is none.

    ``strike``: the run of the round ``done``; ``turn``: as in `ValueLook`.
    """
    scene, greens = done.plan.scene, strike.striker.greens
    look = ValueLook(PlateLook(plate, replace(field, body=strike.striker), strike.division), value_of, turn)
    budget, _ = error_bars_of(done, look, progress=progress)
    errors, own = {key: part[VALUE] for key, part in budget.parts.items()}, budget.values[VALUE]
    modes, method = plate.plate(greens), done.plan.method.reed
    lips = plate.lips(method.lip, method.behind)
    own_problem, _, flights = runs_of_budget(done, progress)  # marched already for the budget

    def in_model(striker: impact.Body, problem: ContactProblem) -> float:
        """Return the value by another model of the plate, under the forces of a run of the ``problem``."""
        run = marched(problem, strike.dt, scene.run.duration, flights)
        return look.moved_to(plate_field(scene.geometry, striker, strike.division))(run)[VALUE]

    coarser = sheets.plate_modes(modes.sheet, COARSENING)
    on_coarser = in_model(striker_of(scene, greens=coarser.greens(lips, plate.damping_ratio)), own_problem)
    mesh = abs(on_coarser - own) / (sheets.refinement(modes, coarser) ** sheets.ORDER - 1)
    band = math.inf
    if (beyond := plate.in_wider_band(greens, lips)) is not None:
        wider = striker_of(scene, greens=beyond[0])
        in_wider = in_model(wider, problem_of(scene, wider, impact.Body(done.seat.greens)))
        band = abs(in_wider - own) / (1 - beyond[1] ** -2)
    return {**errors, REED_BAND: max(band, errors.get(REED_BAND, 0.0)), "mesh": mesh}
