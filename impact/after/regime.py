"""The regime in which an impact took place, and what a constant stiffness in place of the seat would have got wrong."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from impact.after.measures import contact_groups
from impact.after.result import ImpactResult
from impact.bodies.body import Body, as_body
from impact.files.table import read_rows
from impact.greens.base import GreensFunction, GreensFunctionError
from impact.quantities import percent

EQUAL = 0.02  # smaller errors of the constant stiffness have no sign
MAPS = Path(__file__).parent / "data"  # written by examples/paper/regimes.py


@dataclass(frozen=True)
class Regime:
    """Dimensionless numbers of an impact; ``nan`` where one has no meaning.

    A rod of the same static stiffness K and wave impedance Z = 1/g(0+) stands for any seat; for rods it is the rod.

    Attributes:
        mass_ratio: Z^2/K (rho A l of a rod) over the striker's mass, 1/phi_1^2 of a held one.
        round_trip: 2 l/c of a rod, half the period of the lowest mode of other seats [s].
        contact_duration: of the first contact group [s].
        round_trips_per_contact: contact_duration/round_trip.
        zener_lambda: sqrt(K m)/Z, Zener's inelasticity parameter for a linear contact: spring peak V sqrt(K m) over the
            force V Z of the first wave.
        predicted_peak_error, predicted_impulse_error: constant-K model/seat - 1 in filtered peak and impulse, at the
            nearest point of the regime map.
    """

    mass_ratio: float
    round_trip: float
    contact_duration: float
    round_trips_per_contact: float
    zener_lambda: float
    predicted_peak_error: float
    predicted_impulse_error: float

    @property
    def predicted_sign(self) -> str:
        """Return the sign of the constant-K model's error in the filtered peak: "over", "under", "equal" (2 %) or
        "unknown"."""
        if math.isnan(self.predicted_peak_error):
            return "unknown"
        if abs(self.predicted_peak_error) <= EQUAL:
            return "equal"
        return "over" if self.predicted_peak_error > 0 else "under"


def regime(striker: Body | GreensFunction, target: Body | GreensFunction, result: ImpactResult) -> Regime:
    """Return the numbers of one impact (first port of either body).

    The prediction is read off the maps of examples/paper/regimes.py: a rigid striker on an undamped rod, a reed as the
    one of Table 1 (damping 3 %, seat 10 %, filter 1 us) on a fixed rod. Other reeds and seats enter by their equivalent
    rod, which makes the prediction a hint, not a result.

    Source: Zener, Phys. Rev. 59 (1941) 669, for lambda.
    """
    striker, target = as_body(striker), as_body(target)
    seat, rod, held = target.greens, target.greens.rod, striker.greens.modal
    if rod is not None:
        stiffness, impedance, reflection = rod.impedance / rod.transit, rod.impedance, rod.reflection
        trip = 2 * rod.transit
    else:
        try:
            compliance = float(seat.static_compliance()[0, 0])
        except GreensFunctionError:  # sampled without a rest
            compliance = math.nan
        stiffness, reflection = _ratio(1.0, compliance), -1.0
        impedance = _ratio(1.0, float(seat.initial_value()[0, 0]))
        elastic = np.zeros(0) if seat.modal is None else seat.modal.omega[seat.modal.omega > 0]
        trip = math.pi / float(elastic.min()) if elastic.size else math.nan
    mass, omega = striker.mass, math.nan  # of a held body 1/phi^2 of its first mode
    if math.isinf(mass) and held is not None and len(held.omega):
        first = int(np.argmin(held.omega))
        mass, omega = _ratio(1.0, float(held.shapes[first, 0]) ** 2), float(held.omega[first])
    groups = contact_groups(result) if result.force.ndim == 1 else np.zeros((0, 2))
    duration = float(groups[0, 1] - groups[0, 0]) if len(groups) else math.nan
    ratio = _ratio(impedance * impedance, stiffness * mass)
    if math.isfinite(striker.mass):
        errors = _nearest("regime_rigid.csv", {"alpha": ratio}, {"reflection": reflection})
    else:
        scales = {"trip_ratio": _ratio(2 * impedance * omega, stiffness * 2 * math.pi)}
        errors = _nearest("regime_reed.csv", {**scales, "impedance_ratio": _ratio(impedance, mass * omega)}, {})
        errors = errors if reflection == -1 else (math.nan, math.nan)
    return Regime(
        mass_ratio=ratio,
        round_trip=trip,
        contact_duration=duration,
        round_trips_per_contact=_ratio(duration, trip),
        zener_lambda=_ratio(math.sqrt(stiffness * mass), impedance),
        predicted_peak_error=errors[0],
        predicted_impulse_error=errors[1],
    )


def regime_card(striker: Body | GreensFunction, target: Body | GreensFunction, result: ImpactResult) -> str:
    """Return `regime` as one line of text."""
    return in_words(regime(striker, target, result))


def in_words(found: Regime) -> str:
    """Return one line that says what each number is."""
    verdict = {
        "unknown": "no prediction for a constant stiffness (outside the regime map)",
        "equal": "a constant stiffness should agree in peak force within 2 %",
    }.get(
        found.predicted_sign,
        f"a constant stiffness should {found.predicted_sign}-estimate the peak force by about "
        f"{percent(abs(found.predicted_peak_error))}",
    )
    return (
        f"{verdict}; mass Z^2/K of the seat over the reed's {_number(found.mass_ratio)} (Z impedance, "
        f"K stiffness), round trips of the seat's wave in the first contact {_number(found.round_trips_per_contact)}, "
        f"Zener lambda {_number(found.zener_lambda)} (peak force on a spring over that of the first wave)"
    )


def _nearest(name: str, scales: dict[str, float], plain: dict[str, float]) -> tuple[float, float]:
    """Return the (peak, impulse) errors at the nearest point of a map, ``scales`` on logarithmic axes; ``nan`` off the
    map."""
    rows = read_rows(MAPS / name)
    distance = np.zeros(len(rows))
    for wanted, logarithmic in ((scales, True), (plain, False)):
        for key, value in wanted.items():
            axis, at = np.array([row[key] for row in rows]), value
            if logarithmic:
                axis, at = np.log(axis), math.log(value) if value > 0 else value
            steps = np.diff(np.unique(np.round(axis, 6)))
            cell = float(steps[steps > 1e-4].min())
            if not axis.min() - cell <= at <= axis.max() + cell:
                return math.nan, math.nan
            distance += ((axis - at) / cell) ** 2
    row = rows[int(np.argmin(distance))]
    return row["peak_error"], row["impulse_error"]


def _ratio(above: float, below: float) -> float:
    """Return the quotient; ``nan`` unless both are positive and finite."""
    sound = above > 0 and below > 0 and math.isfinite(above) and math.isfinite(below)
    return above / below if sound else math.nan


def _number(value: float) -> str:
    return "–" if math.isnan(value) else f"{value:.3g}"
