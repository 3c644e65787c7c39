"""What stands beside every result: a spring of the seat's static stiffness, and simpler models of the contact."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

import impact
from impact.after.result import ImpactResult
from impact.after.stresses import ReedStress
from impact.greens.base import GreensFunction
from seatfem.machine.stopwatch import Stopwatch
from seatfem.structures.rings import Division, face_compliance
from seatfem.structures.statics import bed
from seatfem.study.impacts.contact import RunError, run_contacts, stress_of
from seatfem.study.impacts.gas import lift_of
from seatfem.study.impacts.measures import stress_since
from seatfem.study.impacts.simpler import simpler_models
from seatfem.study.impacts.touches import Touches
from seatfem.study.runs.round import Round


@dataclass(frozen=True)
class Baseline:
    """The spring of equal static stiffness, struck as the seat was in ``beside``; and ``simpler`` models of the seat
    itself."""

    beside: ImpactResult
    stiffness: float
    touches: Touches
    stress: ReedStress | None
    simpler: Mapping[str, Touches]

    @property
    def result(self) -> ImpactResult:
        """At the spring."""
        return self.touches.seat


def baseline_of(done: Round, watch: Stopwatch) -> Baseline:
    """Of a round. Raises as `static_stiffness`."""
    stiffness, scene = static_stiffness(done.seat.greens), done.plan.scene
    with watch("spring baseline"):
        division = Division.of(done.seat.greens)
        spring = bed(division, stiffness) if division.arcs > 1 else impact.spring(stiffness=stiffness)
        touches = run_contacts(scene, done.striker, spring, done.result.dt)
    stress = None
    if done.stress is not None:
        with watch("reed stress"):
            coarsely = not scene.needs_stress
            force, dt, lift, met = touches.seat.force, touches.seat.dt, lift_of(touches), touches.stopper_force
            since = stress_since(touches, scene.accuracy.landing)
            stress = stress_of(scene, done.striker, force, dt, lift, coarsely=coarsely, stopper=met, since=since)
    simpler: Mapping[str, Touches] = {}
    if done.touches.line is not None or scene.contact.film is not None:
        with watch("simpler models"):
            simpler = simpler_models(scene, done.striker, done.seat.greens, done.result.dt)
    return Baseline(done.result, stiffness, touches, stress, simpler)


def static_stiffness(greens: GreensFunction) -> float:
    """Of the struck patch [N/m]. Raises `RunError` of a seat that is free to move."""
    compliance = face_compliance(greens)
    if not np.isfinite(compliance) or compliance <= 0:
        raise RunError(
            "the seat has no static stiffness (it is free to move, or sampled without a rest), so there is no spring "
            "to compare with; hold the seat somewhere"
        )
    return 1.0 / compliance
