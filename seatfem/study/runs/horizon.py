"""The predictable landings of a run, by a perturbed twin of the last round, and statistics of the later ones."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

import impact
from impact.after.landings import Landing
from impact.march.grid import TimeGrid
from impact.march.ladder import NO_STEPS
from impact.march.problem import ContactProblem
from impact.march.rows import MarchRun
from impact.notices import Progress
from impact.runs.solver import PERTURBATION, ROUND_OFF, Horizon, growth_of_difference, make_twin, widen_gaps
from seatfem import results
from seatfem.study.impacts.bodies import problem_of
from seatfem.study.impacts.contact import marched
from seatfem.study.impacts.landings import landings_of_march
from seatfem.study.runs.round import Round

INPUTS: Final = 1e-3
"""Relative uncertainty of inputs that are read from a drawing."""
STAGE: Final = "ensemble"
NO_ENSEMBLE: Final[Mapping[str, object]] = {results.ENSEMBLE: 1, results.ENSEMBLE_LANDINGS: 0}
"""Keys of a run whose landings are all known: one member, and no landings to average."""


def has_horizon(done: Round) -> bool:
    """Return whether a run has more than two landings, so that a difference may grow and the last ones be unknown."""
    landings = done.touches.landings
    return len(landings.seat) + len(landings.stopper) > 2


def horizon_keys(done: Round, progress: Progress) -> dict[str, object]:
    """Return the number of known landings, the growth rate of a perturbation, and ensemble statistics of later ones."""
    scene = done.plan.scene
    problem = problem_of(scene, done.striker, impact.Body(done.seat.greens))
    run = _march(done, problem)
    rows, landings = run.rows.drop_forces(), _landings(done, run)
    del run
    twin, shift = make_twin(problem, rows.gap, PERTURBATION)
    starts = [round(landing.start / done.result.dt) for landing in landings]
    horizon = Horizon(growth_of_difference(rows, _march(done, twin, rows).rows, starts, shift))
    known = horizon.known()
    keys: dict[str, object] = {
        results.KNOWN_LANDINGS: known,
        results.KNOWN_OF_INPUTS: horizon.known(INPUTS),
        results.LANDING_GROWTH: horizon.rate,
    }
    if (members := scene.run.ensemble) is None:
        return keys
    if known >= len(landings):  # landings that only other members have are no sample of this run
        return {**keys, **NO_ENSEMBLE}
    runs = [landings[known:]]
    for number in range(1, members):
        progress(STAGE, number / members)
        wider = widen_gaps(problem, number * ROUND_OFF * shift / PERTURBATION)
        runs.append(_landings(done, _march(done, wider, rows))[known:])
    return keys | ensemble_keys(runs)


def ensemble_keys(runs: Sequence[Sequence[Landing]]) -> dict[str, object]:
    """Return statistics of the landings beyond the horizon, given one sequence for each member: means, their error bars
    (twice the standard error over the members), and the standard deviation of single landings."""
    values = {
        results.ENSEMBLE_SPEED: [[landing.closing_speed for landing in run] for run in runs],
        results.ENSEMBLE_PEAK: [[landing.filtered_peak for landing in run] for run in runs],
    }
    keys: dict[str, object] = {results.ENSEMBLE: len(runs), results.ENSEMBLE_LANDINGS: sum(map(len, runs))}
    for key, members in values.items():
        means = np.array([np.mean(member) for member in members if member])
        if len(means) < 2:
            continue
        pooled = np.concatenate([member for member in members if member])
        keys[key] = float(means.mean())
        keys[f"error_bar_{key}"] = 2 * float(means.std(ddof=1)) / math.sqrt(len(means))
        keys[results.spread_of(key)] = float(pooled.std(ddof=1))
    return keys


def _march(done: Round, problem: ContactProblem, like: TimeGrid = NO_STEPS) -> MarchRun:
    """March a problem, in steps ``like`` those of another run."""
    return marched(problem, done.result.dt, done.plan.scene.run.duration, done.flights, like=like)


def _landings(done: Round, run: MarchRun) -> tuple[Landing, ...]:
    """Return the landings on seat and stopper in the order of time."""
    landings = landings_of_march(run, done.plan.scene.run.filter_width, rebound=False)
    return tuple(sorted((*landings.seat, *landings.stopper), key=lambda landing: landing.start))
