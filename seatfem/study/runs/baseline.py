"""Baselines beside every result: a spring of the seat's static stiffness, and simpler models of the contact."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

import impact
from impact.after.result import ImpactResult
from impact.after.stresses import ReedStress
from impact.greens.base import GreensFunction
from impact.march.problem import ContactProblem
from impact.runs.budget import SAFETY, Budget, Values
from impact.runs.variations import Variation, budget_of
from seatfem.machine.stopwatch import Stopwatch
from seatfem.structures.rings import Division, face_compliance
from seatfem.structures.solved import bed
from seatfem.study.impacts.contact import RunError, problem_of, record_of, run_contacts, stress_of
from seatfem.study.impacts.gas import lift_of
from seatfem.study.impacts.measures import RECORD, RunRecord, blow_of, stress_since, values_of_record
from seatfem.study.impacts.simpler import simpler_models
from seatfem.study.impacts.touches import Touches
from seatfem.study.runs.reed_stress import stress_on_another_seat
from seatfem.study.runs.round import Round
from seatfem.study.safety import OF_DRAWS


@dataclass(frozen=True)
class Baseline:
    """The spring of equal static stiffness, struck as the seat was in ``beside``; and ``simpler`` models of the seat
    itself. ``left``, ``stiffness_bar``: the errors in it and in the stiffness [N/m], where a record is what it is from;
    ``None`` where they are not known."""

    beside: ImpactResult
    stiffness: float
    touches: Touches
    stress: ReedStress | None
    simpler: Mapping[str, Touches]
    left: Budget | None = None
    stiffness_bar: float | None = None

    @property
    def result(self) -> ImpactResult:
        """Return the impact on the spring."""
        return self.touches.seat


def baseline_of(done: Round, watch: Stopwatch) -> Baseline:
    """Return the baseline of a round. Raises as `static_stiffness`."""
    stiffness, scene = static_stiffness(done.seat.greens), done.plan.scene
    with watch("spring baseline"):
        division = Division.of(done.seat.greens)
        spring = bed(division, stiffness) if division.arcs > 1 else impact.spring(stiffness=stiffness)
        touches = run_contacts(scene, done.striker, spring, done.result.dt)
    stress = None
    if done.plate is not None:
        with watch("reed stress"):
            stress = stress_on_another_seat(done, touches)
    elif done.stress is not None:
        with watch("reed stress"):
            coarsely = not scene.needs_stress
            force, dt, lift, met = touches.seat.force, touches.seat.dt, lift_of(touches), touches.stopper_force
            since = stress_since(touches, scene.accuracy.landing)
            stress = stress_of(scene, done.striker, force, dt, lift, coarsely=coarsely, stopper=met, since=since)
    simpler: Mapping[str, Touches] = {}
    if done.touches.line is not None or scene.contact.film is not None:
        with watch("simpler models"):
            simpler = simpler_models(scene, done.striker, done.seat.greens, done.result.dt)
    errors, bar = None, None
    if (fit := scene.seat.fit()) is not None and fit.draws:
        with watch("spring baseline"):
            others = [static_stiffness(draw) for draw in fit.draws]
            errors = _left_by_record(done, touches, stress, stiffness, others)
            bar = SAFETY * OF_DRAWS * max(abs(other - stiffness) for other in others)
    return Baseline(done.result, stiffness, touches, stress, simpler, errors, bar)


def _left_by_record(
    done: Round, touches: Touches, stress: ReedStress | None, stiffness: float, others: Sequence[float]
) -> Budget:
    """Return what the step and the noise of the record, by the stiffnesses of its draws, leave in the baseline."""
    scene, width = done.plan.scene, done.plan.scene.run.filter_width

    def problem(value: float) -> ContactProblem:
        return problem_of(scene, done.striker, impact.Body(impact.spring(stiffness=value)))

    def run(varied: ContactProblem, dt: float) -> Values:
        return values_of_record(record_of(scene, varied, dt, like=touches.landings, look=done.look), touches.landings)

    own = problem(stiffness)
    blow = blow_of(touches, width, stress, scene.accuracy.landing)
    values = values_of_record(RunRecord(blow, touches.landings, touches.stopper_force), touches.landings)
    draws = tuple(Variation(problem(other), OF_DRAWS) for other in others)
    return budget_of(run, own, values, touches.seat.dt, {RECORD: (draws,)}, filter_width=width)


def static_stiffness(greens: GreensFunction) -> float:
    """Return the static stiffness of the struck patch [N/m]. Raises `RunError` for a seat that is free to move."""
    compliance = face_compliance(greens)
    if not np.isfinite(compliance) or compliance <= 0:
        raise RunError(
            "the seat has no static stiffness (it is free to move, or sampled without a rest), so there is no spring "
            "to compare with; hold the seat somewhere, or state seat.free = false for a record"
        )
    return 1.0 / compliance
