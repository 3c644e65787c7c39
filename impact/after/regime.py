"""Dimensionless numbers of an impact, and warnings about a result: unresolved contacts, energy gain, round-off."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np

from impact import notices, quantities
from impact.after.histories import closed_steps
from impact.after.measures import contact_groups
from impact.after.result import ImpactResult, find_separation_work
from impact.bodies.body import Body, as_body
from impact.files.csv_table import read_rows
from impact.greens.base import Array, GreensFunction, GreensFunctionError
from impact.march.grid import TimeGrid
from impact.march.laws import Signorini, TableJoint
from impact.march.problem import ContactProblem

EQUAL = 0.02  # relative error in peak force up to which the constant-stiffness model counts as equal to the seat
MAPS = Path(__file__).parent / "data"  # folder of the regime maps that examples/paper/regimes.py writes


@dataclass(frozen=True)
class Regime:
    """Dimensionless numbers of an impact; ``nan`` where one has no meaning.

    A seat other than a rod is represented by a rod of its static stiffness K and wave impedance Z = 1/g(0+).

    Attributes:
        mass_ratio: Z^2/K (rho A l of a rod) over the striker's mass; a held striker's is the modal mass 1/phi_1^2.
        round_trip: 2 l/c of a rod, half the period of the lowest mode of other seats [s].
        contact_duration: duration of the first contact group [s].
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
    """Return the dimensionless numbers of one impact at the first port of either body.

    The predicted errors come from the maps of examples/paper/regimes.py, made for a rigid striker on an undamped rod
    and for the reed of Table 1 (damping 3 %, seat 10 %, filter 1 us) on a fixed rod. For other reeds and seats the
    equivalent rod is used, so that the prediction is a hint, not a result.

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
        except GreensFunctionError:  # samples whose tail is not known
            compliance = math.nan
        stiffness, reflection = _ratio(1.0, compliance), -1.0
        impedance = _ratio(1.0, float(seat.initial_value()[0, 0]))
        elastic = np.zeros(0) if seat.modal is None else seat.modal.omega[seat.modal.omega > 0]
        trip = math.pi / float(elastic.min()) if elastic.size else math.nan
    mass, omega = striker.mass, math.nan  # a held body's mass is replaced by 1/phi^2 of its first mode
    if math.isinf(mass) and held is not None and len(held.omega):
        first = int(np.argmin(held.omega))
        mass, omega = _ratio(1.0, float(held.shapes[first, 0]) ** 2), float(held.omega[first])
    groups = contact_groups(result) if result.rows.force.ndim == 1 else np.zeros((0, 2))
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
    """Return the numbers of `regime` as one line of text."""
    return describe(regime(striker, target, result))


def describe(numbers: Regime) -> str:
    """Return one line with the prediction and the numbers, each with its meaning."""
    verdict = {
        "unknown": "no prediction for a constant stiffness (outside the regime map)",
        "equal": "a constant stiffness should agree in peak force within 2 %",
    }.get(
        numbers.predicted_sign,
        f"a constant stiffness should {numbers.predicted_sign}-estimate the peak force by about "
        f"{quantities.percent(abs(numbers.predicted_peak_error))}",
    )
    return (
        f"{verdict}; mass Z^2/K of the seat over the reed's {_number(numbers.mass_ratio)} (Z impedance, "
        "K stiffness), round trips of the seat's wave in the first contact "
        f"{_number(numbers.round_trips_per_contact)}, Zener lambda {_number(numbers.zener_lambda)} (peak force on a "
        "spring over that of the first wave)"
    )


def _nearest(name: str, scales: dict[str, float], plain: dict[str, float]) -> tuple[float, float]:
    """Return the (peak, impulse) errors at the nearest point of a map, ``scales`` on logarithmic axes; ``nan`` off the
    map."""
    table = _map(name)
    distance = np.zeros(len(table["peak_error"]))
    for wanted, logarithmic in ((scales, True), (plain, False)):
        for key, value in wanted.items():
            axis, at = table[key], value
            if logarithmic:
                axis, at = np.log(axis), math.log(value) if value > 0 else value
            steps = np.diff(np.unique(np.round(axis, 6)))
            cell = float(steps[steps > 1e-4].min())
            if not axis.min() - cell <= at <= axis.max() + cell:
                return math.nan, math.nan
            distance += ((axis - at) / cell) ** 2
    nearest = int(np.argmin(distance))
    return float(table["peak_error"][nearest]), float(table["impulse_error"][nearest])


@cache
def _map(name: str) -> Mapping[str, Array]:
    rows = read_rows(MAPS / name)
    return {key: np.array([row[key] for row in rows]) for key in rows[0]}


def _ratio(above: float, below: float) -> float:
    """Return the quotient; ``nan`` unless both are positive and finite."""
    sound = above > 0 and below > 0 and math.isfinite(above) and math.isfinite(below)
    return above / below if sound else math.nan


def _number(value: float) -> str:
    return "–" if math.isnan(value) else f"{value:.3g}"


FEWEST_STEPS = 10  # steps of the shortest contact that counts as resolved; in shorter ones the impulse errs by >= 1 %
UNRESOLVED = f"share of the impulse in contacts of fewer than {FEWEST_STEPS} steps"
"""Name of the advice on them."""
UNRESOLVED_LIMIT = 0.1  # largest fraction of the impulse in unresolved contacts without advice
DIGITS_LIMIT = 1e-6  # largest round-off of the gap over the displacement of a contact at its peak force without advice
GAIN_LIMIT = 1e-6  # largest energy gained from a contact law over the energy it absorbed that round-off explains


def contact_advice(force: Array, grid: TimeGrid) -> Iterator[notices.Advice]:
    """Yield advice on the share of the impulse of ``force`` (N, p) [N] in contacts of fewer than `FEWEST_STEPS` steps.

    ``grid``: the N steps, which count as fine ones. A contact cut off by the end of the record counts with its
    recorded steps; a force that rises over n steps errs by about 1/n.
    """
    spans, short, shortest = grid.spans, 0.0, FEWEST_STEPS
    total = float((spans @ force).sum())
    for each in force.T:
        column = each * spans
        rows = closed_steps(column)
        steps, running = np.diff(grid.ends[rows], axis=1)[:, 0], np.concatenate([[0.0], np.cumsum(column)])
        brief = steps < FEWEST_STEPS
        short += float(np.diff(running[rows], axis=1)[brief].sum())
        shortest = min(shortest, int(steps[brief].min(initial=FEWEST_STEPS)))
    share = short / total if total > 0 else 0.0
    if share <= UNRESOLVED_LIMIT:
        return
    yield notices.Advice(
        UNRESOLVED,
        share,
        UNRESOLVED_LIMIT,
        "the step does not resolve them: their force and rebound are set by the step",
        f"use dt <= {grid.dt * shortest / (2 * FEWEST_STEPS):.2g} s",
    )


def gain_advice(problem: ContactProblem, force: Array, gap: Array) -> Iterator[notices.Advice]:
    """Yield advice on contact laws that return more work than they absorbed; force (n, p), gap (n + 1, p).

    Contacts closed at the start or end, whose work is recorded only in part, and rigid ones are not examined.
    """
    for number, contact in enumerate(problem.contacts):
        if isinstance(contact.law, Signorini):
            continue
        work, inside = force[:, number] * np.diff(gap[:, number]), gap[:, number] < 0
        closed = closed_steps(inside[:-1] | inside[1:] | (force[:, number] > 0))
        whole = [(a, b) for a, b in closed if not (inside[a] or inside[b])]
        absorbed = np.array([-np.minimum(work[a:b], 0.0).sum() for a, b in whole])
        gained = np.array([work[a:b].sum() for a, b in whole])
        if not np.any(gained > max(GAIN_LIMIT * absorbed.max(initial=0.0), 1e-12 * np.abs(work).sum())):  # round-off
            continue
        worst = int(np.argmax(gained))
        yield notices.Advice(
            f"energy that the law of contact {number} gave back over what it took",
            1 + gained[worst] / absorbed[worst] if absorbed[worst] > 0 else np.inf,
            1 + GAIN_LIMIT,
            f"it put {gained[worst]:.3g} J into the bodies in one touch, which no contact without a source of energy "
            "does; the ledger counts it as a negative loss",
            "at each penetration the law's force must not be larger while the bodies part than while they close; if it "
            "is not, make the force rise with the penetration, which keeps a step from gaining energy",
        )


def table_advice(problem: ContactProblem, gap: Array) -> Iterator[notices.Advice]:
    """Yield advice on joints closed beyond the last row of their table; gap (n + 1, p)."""
    for number, contact in enumerate(problem.contacts):
        closed, law = float(-gap[:, number].min()), contact.law
        if isinstance(law, TableJoint) and closed > law.closures[-1] * (1 + 1e-9):
            yield notices.Advice(
                f"closure of contact {number} over the last one of its table",
                closed / law.closures[-1],
                1.0,
                f"beyond {law.closures[-1]:.3g} m its force follows from the last slopes of the table, a guess",
                f"give rows up to a closure of {closed:.3g} m",
            )


def overlap_advice(problem: ContactProblem, force: Array, gap: Array, dt: float) -> Iterator[notices.Advice]:
    """Yield advice on rigid contacts closed at t = 0 without a preload; force (n, p), gap (n + 1, p)."""
    if problem.preload:
        return
    rigid = np.array([isinstance(c.law, Signorini) for c in problem.contacts])
    overlap = float(np.max(-gap[0, rigid], initial=0.0))
    if overlap <= 1e-12 * max(float(gap.max()), -float(gap.min())):
        return
    work_done = float(find_separation_work(problem, force, gap)[-1])
    yield notices.Advice(
        "overlap of rigid contacts at t = 0 [m]",
        overlap,
        0.0,
        f"the first step of {dt:.3g} s drives them apart, with a force that grows like 1/dt and gives energy: "
        f"{work_done:.3g} J, counted as put in",
        "start with a gap >= 0, give preload=True, or a compliant contact law",
    )


def digits_advice(deflection: float, force: Array, gap: Array, own: Array) -> Iterator[notices.Advice]:
    """Yield advice on the round-off of gaps that the bodies' ``deflection`` [m] at t = 0 causes; force [N], gap [m].

    ``own``: (p, p) W_0, displacement of the contacts per force within one step [m/N]. The round-off of a gap is eps
    times the deflection; it must be small against W_0 N at the peak force N plus the penetration, or, in a contact that
    never closes, against the largest gap.
    """
    deepest = -gap.min(axis=0)
    contact_displacement = np.diag(own) * force.max(axis=0, initial=0.0) + np.maximum(deepest, 0.0)
    touched = force.any(axis=0)
    scale = float(np.min(np.where(touched, contact_displacement, np.maximum(gap.max(axis=0), deepest))))
    unknown = float(np.finfo(float).eps) * deflection
    if unknown <= DIGITS_LIMIT * scale:
        return
    yield notices.Advice(
        "round-off of the gap over what the contact yields",
        unknown / scale if scale > 0 else np.inf,
        DIGITS_LIMIT,
        f"a body is deflected by {deflection:.3g} m at the start, so that the gap is known to {unknown:.2g} m only",
        "check the units of loads and stiffnesses; measure displacements from the loaded state, or hold the body",
    )


def direction_advice(problem: ContactProblem, force: Array) -> Iterator[notices.Advice]:
    """Yield advice on unloaded bodies that move apart and never touch, ``force`` (n + 1, p) [N]."""
    striker = problem.striker
    pushed = striker.state is not None or striker.loads or any(t.state is not None or t.loads for t in problem.targets)
    if pushed or force.any():
        return
    apart = [c.side * (striker.velocity - c.target.velocity) for c in problem.contacts]
    if striker.velocity == 0.0 or min(apart) <= 0.0:
        return
    yield notices.Advice(
        "velocity of the striker [m/s]",
        striker.velocity,
        0.0,
        "it flies away from the target and never touches it",
        f"velocities are along the normal, from target to striker: towards the target write velocity = "
        f"{-striker.velocity:.3g}",
    )


def unsolved_advice(unsolved: int, steps: int) -> Iterator[notices.Advice]:
    """Yield advice on steps in which the iteration for the contact forces did not converge."""
    if unsolved == 0:
        return
    yield notices.Advice(
        "share of the steps whose contact forces were not found to 1e-12",
        unsolved / steps,
        0.0,
        "stiff contacts act almost at one place, and the forces of these steps are rough",
        "merge contacts that coincide, use a shorter step or a softer law",
    )
