"""Several contacts at once: a stop on either side, a reed on two supports."""

from __future__ import annotations

import math
from functools import partial

import numpy as np

import impact
from seatfem.verification.case import Case, Estimate, richardson
from seatfem.verification.compliant import rigid_seat

_CLEARANCE = "Den Hartog, Mechanical Vibrations: oscillator with clearance"
_CLAPEYRON = "Clapeyron's three moments: two equal spans, one end built in"
_STEPS = 400  # per unit of time, coarsest of three


def several_cases() -> tuple[Case, ...]:
    """Between two springs; pressed on two supports."""
    return (_between_stops(), *_two_supports())


def _between_stops() -> Case:
    """A mass to and fro between a seat and a stopper, clearance 2 d: period 2 pi/w + 4 d/V. Here m = k = V = d = 1."""

    def period(stiffness: float, steps: int) -> float:
        """From the centre, towards the seat, to the same place; by the conserving rule."""
        contacts = [
            impact.Contact(impact.Body(rigid_seat()), gap=1.0, side=side, law=impact.LinearSpring(stiffness=k))
            for side, k in ((1, 1.0), (-1, stiffness))
        ]
        problem = impact.ContactProblem(impact.rigid_mass(mass=1.0, velocity=-1.0), contacts=contacts)
        result = impact.solve(problem, dt=1 / steps, duration=11.5, rule="conserving")
        place = result.striker_displacement[:, 0]
        m = int(np.flatnonzero((place[1:] <= 0) & (place[:-1] > 0))[-1])
        return float(result.time[m]) + result.dt * float(place[m] / (place[m] - place[m + 1]))

    return Case(
        "mass between two springs with clearance",
        "period w",
        2 * math.pi + 4,
        1e-9,
        _CLEARANCE,
        lambda k: richardson(partial(period, k), _STEPS, 2),
    )


def _two_supports() -> tuple[Case, Case]:
    """Pressure q on a cantilever that rests on rigid supports at its middle and its tip, spans L: 8/7 and 11/28 q L."""

    def reactions(load: float) -> tuple[float, float]:
        beam = impact.Cantilever(young=12.0, density=1.0, length=2.0, width=1.0, thickness=1.0)
        reed = impact.reed(beam, contact_at=(1.0, 2.0), loads=(impact.Pressure(lambda t: -load),))
        contacts = [impact.Contact(impact.Body(rigid_seat()), striker_port=port) for port in (0, 1)]
        problem = impact.ContactProblem(reed, contacts=contacts, preload=True)
        middle, tip = impact.solve(problem, dt=1e-3, duration=0.05).force[-1]
        return float(middle), float(tip)

    name = "reed pressed on two supports by a pressure q"
    return (
        Case(name, "N/(q L), middle", 8 / 7, 1e-6, _CLAPEYRON, lambda k: Estimate(reactions(k)[0])),
        Case(name, "N/(q L), tip", 11 / 28, 1e-6, _CLAPEYRON, lambda k: Estimate(reactions(k)[1])),
    )
