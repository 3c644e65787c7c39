"""How many landings of a run are known, and statistics of those beyond: twins of the last round, marched for it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

import impact
from impact.after.landings import Landing
from impact.greens.base import Array
from impact.march.problem import ContactProblem
from impact.notices import Progress
from impact.runs.horizon import PERTURBATION, ROUND_OFF, Horizon, growth_of_difference, twin_of, with_wider_gaps
from seatfem import results
from seatfem.study.impacts.bodies import problem_of
from seatfem.study.impacts.contact import marched
from seatfem.study.impacts.landings import landings_of_march
from seatfem.study.runs.round import Round

FEWEST: Final = 3
"""Landings from which on a run has a horizon: of fewer, all are known."""
INPUTS: Final = 1e-3
"""Relative difference of runs whose inputs are known as well as they are on a drawing."""
STAGE: Final = "ensemble"
NO_ENSEMBLE: Final[Mapping[str, object]] = {results.ENSEMBLE: 1, results.ENSEMBLE_LANDINGS: 0}
"""Keys of a run whose landings are all known: its own run alone, and nothing to average."""


def has_horizon(done: Round) -> bool:
    """Return whether a run has so many landings that some may not be known."""
    landings = done.touches.landings
    return landings is not None and len(landings.seat) + len(landings.stopper) >= FEWEST


def horizon_keys(done: Round, progress: Progress) -> dict[str, object]:
    """Return how many landings are known, the growth of a difference, and what an ensemble says of later ones."""
    scene = done.plan.scene
    problem = problem_of(scene, done.striker, impact.Body(done.seat.greens))
    gap, both = _march(done, problem)
    twin, shift = twin_of(problem, gap, PERTURBATION)
    starts = [round(landing.start / done.result.dt) for landing in both]
    horizon = Horizon(growth_of_difference(gap, _march(done, twin)[0], starts, shift))
    known = horizon.known()
    keys: dict[str, object] = {
        results.KNOWN_LANDINGS: known,
        results.KNOWN_OF_INPUTS: horizon.known(INPUTS),
        results.LANDING_GROWTH: horizon.rate,
    }
    if (members := scene.run.ensemble) is None:
        return keys
    if known >= len(both):  # later ones, which only some members have, are no sample of this run
        return {**keys, **NO_ENSEMBLE}
    runs = [both[known:]]
    for number in range(1, members):
        progress(STAGE, number / members)
        runs.append(_march(done, with_wider_gaps(problem, number * ROUND_OFF * shift / PERTURBATION))[1][known:])
    return keys | ensemble_keys(runs)


def ensemble_keys(runs: Sequence[Sequence[Landing]]) -> dict[str, object]:
    """Return the statistics of the landings beyond the horizon, one sequence a member: means with their bars, twice the
    standard error over the members, and the standard deviation of single landings."""
    values = {
        results.ENSEMBLE_SPEED: [[landing.closing_speed for landing in run] for run in runs],
        results.ENSEMBLE_PEAK: [[landing.filtered_peak for landing in run] for run in runs],
    }
    keys: dict[str, object] = {results.ENSEMBLE: len(runs), results.ENSEMBLE_LANDINGS: sum(map(len, runs))}
    for key, members in values.items():
        means = np.array([np.mean(member) for member in members if member])
        if len(means) < 2:
            continue
        every = np.concatenate([member for member in members if member])
        keys[key] = float(means.mean())
        keys[f"error_bar_{key}"] = 2 * float(means.std(ddof=1)) / math.sqrt(len(means))
        keys[results.spread_of(key)] = float(every.std(ddof=1))
    return keys


def _march(done: Round, problem: ContactProblem) -> tuple[Array, tuple[Landing, ...]]:
    """Return openings (n + 1, p) [m], and the landings on seat and stopper in the order of time."""
    scene = done.plan.scene
    stepper = marched(problem, done.result.dt, scene.run.duration, done.flights)
    landings = landings_of_march(stepper, scene.run.filter_width, rebound=False)
    both = sorted((*landings.seat, *landings.stopper), key=lambda landing: landing.start)
    return stepper.gap[: stepper.done + 1], tuple(both)
