"""Measures as functions of an `ImpactResult`: impulse, peaks, contact groups, restitution, work.

Each measure is of one contact, chosen by ``contact=`` 0, 1, ... if there are several; `total_impulse` sums over all.
The force of step m, ``force[m]``, m = 1..n, is constant over the step that ends at ``time[m]``; integrals over it are
exact. ``force[0]`` is the preload: it acted before t = 0 and does not count in impulse or work. With a film in the gap,
forces, impulses and work include those of the film; contacts begin and end with the solid contact force. Every function
raises `MeasureError` for a contact that the result does not have, or if it has several and none is named.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from impact.after.histories import MERGE as MERGE
from impact.after.histories import MOVING_AVERAGE, Window, averaged, largest_average, transform
from impact.after.histories import closed_steps as closed_steps
from impact.after.histories import merged as merged
from impact.after.result import ImpactResult, select_contacts
from impact.greens.base import Array
from impact.notices import SeatfemError

ONLY: Final = -1
"""Number of the contact of a result that has only one."""


class MeasureError(SeatfemError, ValueError):
    """A measure that this result cannot give; the message names the remedy."""


@dataclass(frozen=True)
class Work:
    """Work of one contact's force on each body over the whole record [J]; a negative sum is absorbed by the contact."""

    striker: float
    target: float


def select_contact(result: ImpactResult, contact: int) -> ImpactResult:
    """Return the result with force, gap and displacements (n + 1,) of one contact; energies remain those of all.

    Raises `MeasureError`: no contact of that number; `ONLY` where there are several.
    """
    count = _contacts(result)
    if contact == ONLY and count > 1:
        raise MeasureError(f"this result has {count} contacts: name one, contact=0 ... {count - 1}")
    contact = 0 if contact == ONLY else contact
    if not 0 <= contact < count:
        raise MeasureError(f"contact = {contact} must be 0 ... {count - 1}: this result has {count}")
    return result if result.rows.force.ndim == 1 else select_contacts(result, contact)


def impulse(result: ImpactResult, *, contact: int = ONLY) -> float:
    """Return the integral of the contact force [N s]; 0 without contact."""
    rows = select_contact(result, contact).rows
    return float(rows.force[1:] @ rows.spans)


def total_impulse(result: ImpactResult) -> float:
    """Return the momentum that all contacts gave the striker along the normal [N s]: seats push it up (+), stoppers
    down (-).

    Raises `MeasureError`: a contact with force but no relative motion, so that its side, seat or stopper, is unknown.
    """
    total = 0.0
    for contact in range(_contacts(result)):
        momentum = impulse(result, contact=contact)
        total += _known_side(select_contact(result, contact)) * momentum if momentum > 0 else 0.0
    return total


def peak_force(result: ImpactResult, *, contact: int = ONLY) -> float:
    """Return the largest force of any step [N]; at a velocity jump it converges only slowly, see
    `filtered_peak_force`."""
    return float(np.max(select_contact(result, contact).rows.force))


def film_force_peak(result: ImpactResult, *, contact: int = ONLY) -> float:
    """Return the largest force by which the film resists closing in any step [N]; 0 without a film."""
    return max(0.0, float(select_contact(result, contact).rows.film.max()))


def stiction_force_peak(result: ImpactResult, *, contact: int = ONLY) -> float:
    """Return the largest tensile force of the film in any step, on separating bodies [N]; 0 without a film."""
    return max(0.0, -float(select_contact(result, contact).rows.film.min()))


def filtered_force(
    result: ImpactResult, width: float = 1e-6, *, contact: int = ONLY, window: Window = MOVING_AVERAGE
) -> Array:
    """Return the (n + 1,) force averaged over ``width`` [s] around each recorded time, zero force outside the record
    [N].

    ``window`` weights the average, which is exact for the stepwise force: N_w(t) = integral of h(s) N(t - s) ds with

        "moving average":  h = 1/width                             (-3 dB at 0.443/width, first zero at 1/width),
        "hann":            h = (1 + cos(2 pi s/width))/width       (-3 dB at 0.720/width, first zero at 2/width),

    for |s| <= width/2, both without phase shift. Source: Harris, Proc. IEEE 66 (1978) 51. Raises `MeasureError`:
    ``width`` below two steps, which the record does not resolve; another window.
    """
    force = _resolve(result, width, contact).force
    if window not in ("moving average", "hann"):
        raise MeasureError(f"window {window!r} is unknown; choose 'moving average' or 'hann'")
    return averaged(force[1:], result.dt, width, window)


def filtered_peak_force(
    result: ImpactResult, width: float = 1e-6, *, contact: int = ONLY, window: Window = MOVING_AVERAGE
) -> float:
    """Return the largest `filtered_force` [N], with the Hann window at recorded times only; raises as that does."""
    if window == MOVING_AVERAGE:
        rows = _resolve(result, width, contact).rows
        return largest_average(rows.force[1:], rows.time, width)
    return float(np.max(filtered_force(result, width, contact=contact, window=window)))


def _resolve(result: ImpactResult, width: float, contact: int) -> ImpactResult:
    """Return the result of one contact; raises `MeasureError` for a ``width`` [s] below two steps."""
    one = select_contact(result, contact)
    if not width >= 2 * result.dt * (1 - 1e-9):
        raise MeasureError(
            f"filter width {width:g} s is below two steps of {result.dt:g} s: the filtered force is not resolved; "
            f"use dt <= {width / 2:g} s or a wider filter"
        )
    return one


def spectrum(result: ImpactResult, *, contact: int = ONLY, resolution: float = math.inf) -> tuple[Array, Array]:
    """Return the frequencies (K,) [Hz] and |N(f)| (K,) [N s], the magnitude of the Fourier transform of the contact
    force,

        N(f) = integral of N(t) exp(-2 pi i f t) dt = dt sinc(f dt) sum_m N_m exp(-2 pi i f (t_m - dt/2)),

    exact for the stepwise force, sinc(x) = sin(pi x)/(pi x). |N(0)| is the impulse. Frequencies run from 0 to half the
    sampling rate, 1/(n dt) apart, or closer: at most ``resolution`` [Hz], by zero force after the record. Raises
    `MeasureError`: a resolution that is not positive; a record without steps.
    """
    force = select_contact(result, contact).force[1:]
    if not resolution > 0:
        raise MeasureError(f"resolution = {resolution:g} Hz must be positive")
    if force.size == 0:
        raise MeasureError("this record has no steps: march before measuring")
    return transform(force, result.dt, max(len(force), math.ceil(1 / (resolution * result.dt))))


def contact_intervals(result: ImpactResult, *, contact: int = ONLY) -> Array:
    """Return the (n, 2) start and end [s] of each maximal run of steps with a solid contact force, film excluded."""
    rows = select_contact(result, contact).rows
    return np.asarray(rows.time[closed_steps(rows.solid[1:])])


def contact_groups(result: ImpactResult, *, contact: int = ONLY, merge: float = MERGE) -> Array:
    """Return the (n, 2) contact intervals [s], merged across openings shorter than ``merge`` [s]: impacts as users
    count them."""
    return merged(contact_intervals(result, contact=contact), merge)


def hardest_group(result: ImpactResult, width: float = 1e-6) -> tuple[int, Array]:
    """Return the number, from 0, and the (2,) start and end [s] of the group with the largest mean force over
    ``width`` [s].

    Groups and force are those of all contacts added up; ``width`` is at least a step. 0 and nan without contact.
    """
    rows = result.rows
    force, solid = (values.reshape(len(values), -1).sum(axis=1) for values in (rows.force, rows.solid))
    groups = merged(rows.time[closed_steps(solid[1:])])
    if len(groups) == 0:
        return 0, np.full(2, math.nan)
    mean = averaged(rows.spread_forces(force)[1:], result.dt, max(width, result.dt), MOVING_AVERAGE)
    peaks = [mean[first : last + 1].max() for first, last in np.rint(groups / result.dt).astype(int)]
    number = int(np.argmax(peaks))
    return number, groups[number]


def peak_time(result: ImpactResult, width: float = 1e-6, *, contact: int = ONLY) -> float:
    """Return the recorded time [s] of the largest `filtered_force`, ``nan`` without force; raises as that does."""
    force = filtered_force(result, width, contact=contact)
    return float(result.time[int(np.argmax(force))]) if np.any(force > 0) else math.nan


def impact_velocity(result: ImpactResult, *, contact: int = ONLY) -> float:
    """Return the closing speed -d(gap)/dt over the last step before the first contact [m/s].

    For contact from the first step on, it is the closing speed of the bodies' translation. ``nan`` without contact,
    under a preload, which has no approach (see `restitution`), and where contact begins at t = 0 and the approach is
    not recorded: both bodies held, or a contact other than the first.
    """
    one = select_contact(result, contact)
    closed = np.flatnonzero(one.solid > 0)
    if closed.size == 0:
        return math.nan
    m = int(closed[0])
    if m >= 2:
        return float(one.gap[m - 2] - one.gap[m - 1]) / result.dt
    if m == 0 or contact > 0 or (math.isinf(result.striker_mass) and math.isinf(result.target_mass)):
        return math.nan
    return (_side(one) or 1) * (result.target_velocity - result.striker_velocity)


def largest_impact_velocity(result: ImpactResult) -> float:
    """Return the largest closing speed -d(gap)/dt over the last step before any contact of one pair [m/s]; ``nan``
    without contact.

    The first contact counts with its `impact_velocity`, or with 0 under a preload.
    """
    closed = result.solid > 0
    starts = np.flatnonzero(closed[1:] & ~closed[:-1]) + 1
    later = starts[starts >= 2]
    first = 0.0 if closed[0] else impact_velocity(result)
    speeds = [first, *((result.gap[later - 2] - result.gap[later - 1]) / result.dt)]
    known = [speed for speed in speeds if not math.isnan(speed)]
    return float(max(known)) if known else math.nan


def rebound_velocity(result: ImpactResult, *, contact: int = ONLY, merge: float = MERGE) -> float:
    """Return the opening speed d(gap)/dt of the contact over the first step after its first group [m/s], the
    counterpart of `impact_velocity`; ``nan`` without contact.

    It is the speed between the two contact points, vibration included; that between the centres of mass is
    `restitution` times the closing speed. Raises `MeasureError`: contact not over before the last step of the record.
    """
    groups = contact_groups(result, contact=contact, merge=merge)
    if len(groups) == 0:
        return math.nan
    end = _step(result, groups[0, 1])
    if end + 1 >= len(result.time):
        raise MeasureError(f"the bodies are still in contact at the end, {result.time[-1]:g} s; run longer")
    gap = select_contact(result, contact).gap
    return float(gap[end + 1] - gap[end]) / result.dt


def first_is_cut(result: ImpactResult) -> bool:
    """Return whether the record ends within the first of the `contact_groups`, whose duration is then unknown."""
    return len(contact_groups(result)) == 1 and bool(result.solid[-1] > 0)


def restitution(result: ImpactResult, *, contact: int = ONLY, group: int = 0) -> float:
    """Return the coefficient of restitution, for a held striker that of one ``group`` of `contact_groups`, from 0.

    With a striker free to translate: ratio of the relative centre-of-mass velocities of the bodies after and before,
    (V_s' - V_t')/(V_t - V_s), from the impulse (a held target has V = 0). With a held striker (a reed): the energetic
    coefficient sqrt(E'/E) of the striker's energy just after and just before that group; it includes the work of other
    contacts and loads in between. Raises `MeasureError`: no contact, no such group, contact not over at the end of the
    record, or no approach, as from a preload; a free striker with several contacts, whose impulses on each target are
    not recorded separately, or ``group`` > 0 of a free striker, whose coefficient covers all groups.
    """
    one = select_contact(result, contact)
    groups = contact_groups(result, contact=contact)
    if len(groups) == 0:
        raise MeasureError("no contact in this record: the coefficient of restitution is not defined; run longer")
    if not 0 <= group < len(groups):
        raise MeasureError(f"group = {group}: it must be one of the {len(groups)} of this contact, numbered from 0")
    if one.force[0] and group == 0:
        raise MeasureError(
            f"a preload of {one.force[0]:.4g} N presses the bodies on each other, nothing comes in; run it without"
        )
    if math.isinf(result.striker_mass):
        start, end = groups[group]
        if end >= result.time[-1]:
            raise MeasureError(f"the bodies are still in contact at the end, {result.time[-1]:g} s; run longer")
        energy, ends = result.rows.energy.striker, result.rows.ends
        before, after = (int(np.searchsorted(ends, step)) for step in (_step(result, start), _step(result, end) + 1))
        if not energy[before] > 0:
            raise MeasureError(
                "the held striker has no energy before the contact: let the body that moves be the striker"
            )
        return math.sqrt(max(energy[min(after, len(energy) - 1)], 0.0) / energy[before])
    if group > 0:
        raise MeasureError("of a free striker restitution is that of all groups together; ask for group = 0")
    if _contacts(result) > 1:
        raise MeasureError(
            "a free striker with several contacts: compare result.energy.striker before and after, or use "
            "total_impulse(result)/result.striker_mass, its change of velocity"
        )
    if one.solid[-1] > 0:
        raise MeasureError(f"the bodies are still in contact at the end, {result.time[-1]:g} s; run longer")
    approach = (_side(one) or 1) * (result.target_velocity - result.striker_velocity)
    if approach <= 0:
        raise MeasureError(
            f"the bodies do not approach (closing speed {approach:g} m/s): let one move towards the other"
        )
    return impulse(result) * (1 / result.striker_mass + 1 / result.target_mass) / approach - 1.0


def work(result: ImpactResult, *, contact: int = ONLY) -> Work:
    """Return the work of the contact force on each body [J], exact for the stepwise force; zero without contact.

    W_s = side sum_m N_m (u_s[m] - u_s[m-1]) and W_t = -side sum_m N_m (u_t[m] - u_t[m-1]); -(W_s + W_t) is the energy
    stored and dissipated in the contact itself. Raises `MeasureError`: a contact with force but no relative motion, so
    that its side, seat or stopper, is unknown.
    """
    one = select_contact(result, contact)
    rows = one.rows
    if not np.any(rows.force[1:]):
        return Work(0.0, 0.0)
    push = _known_side(one) * rows.force[1:]
    striker, target = (float(push @ np.diff(rows.make_displacement(body))) for body in ("striker", "target"))
    return Work(striker, -target)


def _step(result: ImpactResult, time: float) -> int:
    """Return the index of the recorded ``time`` [s]."""
    return int(np.searchsorted(result.time, time))


def _contacts(result: ImpactResult) -> int:
    return 1 if result.rows.force.ndim == 1 else result.rows.force.shape[1]


def _known_side(one: ImpactResult) -> int:
    """Return the `_side` of a contact with force; raises `MeasureError` if it is unknown."""
    side = _side(one)
    if side == 0:
        raise MeasureError(
            f"a contact that never opens up to {one.time[-1]:g} s does not show whether it is a seat or a stopper; "
            "run longer, or let it start open"
        )
    return side


def _side(one: ImpactResult) -> int:
    """Return +1 for a seat, -1 for a stopper, from d(gap) = side d(u_striker - u_target); 0 if that never moves."""
    striker, target = (np.diff(one.rows.make_displacement(body)) for body in ("striker", "target"))
    agreement = float(np.diff(one.rows.gap) @ (striker - target))
    round_off = 1e-24 * float(striker @ striker + target @ target)
    return int(np.sign(agreement)) if abs(agreement) > round_off else 0
