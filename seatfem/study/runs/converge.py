"""The loop of a run: from coarse values by rule to values whose measured errors, together, meet the target.

A round solves a scene and estimates the error of every key by its neighbours (`seatfem.study.error_budget`). Here the
keys are marked that are to be refined, each by a factor, and refined along their ladders. The errors e_k that the keys
may leave minimise the work sum_k e_k^(-p_k) under sum_k e_k^2 = target^2: e_k^2 in proportion to p_k times the work of
the key, of which only the power p_k (`Ladder.effort`) is known, so that e_k^2 is taken in proportion to p_k. Nothing
depends on the clock.

Source: refinement of one key at a time by its measured surplus, Gerstner and Griebel, Computing 71 (2003).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final

from impact.quantities import percent
from impact.runs.variations import SAFETY
from seatfem.structures.kinds import Structure
from seatfem.structures.method import MOST_MODES, Method
from seatfem.structures.rings import Division
from seatfem.study.impacts import contact
from seatfem.study.ladders.ladder import Beginning
from seatfem.study.ladders.mesh import LEAST_WIDER
from seatfem.study.ladders.table import LADDERS, described, ladder_of, source_of
from seatfem.study.method import (
    BAND,
    FIELDS,
    MODEL,
    PORTS,
    REED_BAND,
    RINGS,
    SIZE,
    STOPPER_ARCS,
    STOPPER_RINGS,
    TOLERANCE,
    RunMethod,
    has_key,
    is_given,
    stated_method,
)
from seatfem.study.plan import Choice, Plan, Refinement
from seatfem.study.runs.round import remedy_by_key
from seatfem.study.safety import source_in_words
from seatfem.study.scene import Scene
from seatfem.study.scene.files import check_files
from seatfem.study.scene.measures import key_of, short_words

if TYPE_CHECKING:
    from seatfem.study.runs.round import Round

AIM: Final = 0.85  # share of the allowed error at which a round aims: a wrong order of convergence costs another round
LEAST: Final = 2.0  # least factor by which one round reduces an error: less is not worth a round
MOST: Final = 5.0  # largest factor: errors that were measured on coarse values are no more accurate than this
MOST_WORK: Final = 8.0  # largest ratio of the counted work of a round to that of the one before
POWERS: Final = (1.0, 0.5, 0.25)  # of a factor of refinement, tried in turn until the work is allowed
TRIES: Final = 3  # refinements after which an error that has hardly fallen is taken for one that does not converge
HOPES: Final = 2  # rounds of refinement after which a measure whose error bar exceeds its value is given up
SEAT_KEYS: Final = frozenset({SIZE, BAND, TOLERANCE, RINGS, PORTS, STOPPER_ARCS})
"""Keys whose finer values may be out of reach of meshing, reduction or memory."""


@dataclass(frozen=True)
class Marks:
    """The keys to be refined.

    Attributes:
        factors: factor by which the error of each key is to be reduced.
        wanted: keys whose errors are too large; `factors` may be of others, which hide their convergence.
        stuck: errors that cannot be reduced [SI] by source, the largest first, of each measure that they keep from the
            target.
    """

    factors: Mapping[str, float]
    wanted: frozenset[str] = frozenset()
    stuck: Mapping[str, Mapping[str, float]] = field(default_factory=dict)


def begin_method(scene: Scene) -> RunMethod:
    """Return the method with which the loop begins: the keys that the file states, and coarse values by rule.

    Raises `LevelError`: the stated level cannot describe the seat.
    """
    method, is_reduced = stated_method(scene), scene.seat.traits.is_reduced
    patch = scene.seat.patch() if is_reduced else None
    known = Beginning(scene, is_reduced and not method.seat.exact, patch)
    for ladder in LADDERS:
        method = ladder.begin(known, method)
    return method


def begin_plan(scene: Scene) -> Plan:
    """Return the plan of a scene's first round.

    Raises:
        RunError: the stated time step cannot resolve the measures, or there are more steps than can be stored.
        LevelError: the stated level does not describe the seat.
        SceneError: a file cannot be read, or has no such face, group or region.
    """
    contact.check_step(scene)
    check_files(scene)
    method = begin_method(scene)
    contact.check_length(scene, method.time_step or scene.run.filter_width, method.seat.division.count)
    plan, stated, choices = Plan(scene, method, ()), stated_method(scene), []
    for key in FIELDS:
        if _matters(plan, key) and (value := method.value(key)) is not None:
            ladder, given = ladder_of(key), is_given(scene, key)
            rule = "default" if value == stated.value(key) else ladder.rule if ladder else ""
            choices.append(Choice(key, described(key, value), "" if given else rule, given))
    return replace(plan, choices=tuple(choices))


def _matters(plan: Plan, key: str) -> bool:
    """Return whether a scene has a key, of the parts of a stopper's face only where this can be divided."""
    scene = plan.scene
    if key not in (STOPPER_ARCS, STOPPER_RINGS) or is_given(scene, key) or plan.method.stopper != Division():
        return has_key(scene, key)
    return _can_refine(plan, STOPPER_ARCS)


def with_measured_errors(done: Round) -> Plan:
    """Return the plan of a round with its measured error bars, and what each key left of the judged measures."""
    refused = {**done.plan.refused, **_out_of_reach(done)}
    choices = tuple(replace(choice, leaves=_leaves(done, choice.key)) for choice in done.plan.choices)
    error = {name: done.budget.relative(name) for name in done.judged}
    return replace(done.plan, choices=choices, error=error, refused=refused)


def _out_of_reach(done: Round) -> Mapping[str, str]:
    """Return the bands that no round can widen, with limit and remedy in words: the number of modes of a seat in
    segments grows at most with the cube of its band."""
    plan, scene, how, modal = done.plan, done.plan.scene, done.plan.method.seat, done.seat.greens.modal
    refused, (widest, beyond) = dict[str, str](), scene.reed.band_limit
    in_space = how.in_arcs and scene.seat.elements_of(how) == "3d"
    if in_space and how.bandwidth and modal is not None and len(modal.omega) * LEAST_WIDER**3 > MOST_MODES:
        refused[BAND] = too_many_modes(how.bandwidth)
    if (band := plan.method.reed.bandwidth) and band * LEAST_WIDER > widest:
        refused[REED_BAND] = f"above {described(REED_BAND, band)} {beyond}"
    return {key: why for key, why in refused.items() if plan.is_open(key)}


def too_many_modes(band: float) -> str:
    """Return in words that a seat in segments has too many modes above a ``band`` [Hz], with a remedy."""
    above = f"above {described(BAND, band)} the seat in segments has more than {MOST_MODES} modes in reach"
    return f"{above}: state a longer run.filter_width, or contact.ports = 1"


def limit_band(plan: Plan, band: float) -> Plan:
    """Return the plan with the widest ``band`` of a seat in segments [Hz] that has no more than `MOST_MODES` modes."""
    method, why = plan.method.replaced({BAND: band}), too_many_modes(band)
    new = replace(plan.choice(BAND), value=described(BAND, band), reason=why)
    choices = tuple(new if each.key == BAND else each for each in plan.choices)
    return replace(plan, method=method, choices=choices, refused={**plan.refused, BAND: why})


def errors_by_key(done: Round, measure: str) -> Mapping[str, float]:
    """Return the error of a measure by each key [SI], scaled so that the keys of a source make up its whole error.

    An infinite error counts as the value itself.
    """
    value, errors = abs(done.budget.values[measure]), dict[str, float]()
    by_key = {key: min(part[measure], value) for key, part in done.budget.by_key.items()}
    for source, part in done.budget.parts.items():
        whole = part[measure] if math.isfinite(part[measure]) else value
        keys = [key for key in by_key if source_of(key) == source]
        known = math.hypot(*(by_key[key] for key in keys))
        errors |= {key: whole * by_key[key] / known for key in keys} if known else {source: whole}
    return errors


def mark(done: Round) -> Marks:
    """Return the keys whose errors are to be reduced, and by how much, for the measures that miss the target."""
    scene, budget = done.plan.scene, done.budget
    factors, wanted, stuck = dict[str, float](), set[str](), dict[str, Mapping[str, float]]()
    for measure in done.judged:
        allowed = scene.accuracy.target * abs(budget.values[measure]) / SAFETY
        if budget.relative(measure) <= scene.accuracy.target:
            continue
        errors = errors_by_key(done, measure)
        given_up = _is_cut(done, measure) or _is_hopeless(done, measure)
        tried = frozenset[str]() if given_up else errors.keys() - done.plan.refused.keys()
        open_keys = {key for key in tried if _can_refine(done.plan, key) and not _is_stalled(done, key)}
        fixed = math.hypot(*(error for key, error in errors.items() if key not in open_keys))
        room = max((AIM * allowed) ** 2 - fixed**2, (allowed**2 - fixed**2) / 2)
        if room <= 0:
            stuck[measure] = {
                key: errors[key] for key in sorted(errors.keys() - open_keys, key=lambda key: -errors[key])
            }
            room = (fixed / 2) ** 2  # what can be reduced still is, until it hardly counts
        for key, share in _shares({key: errors[key] for key in open_keys}, room).items():
            wanted.add(key)
            factors[key] = max(factors.get(key, 1.0), errors[key] / share)
            if other := _hiding(done, key):
                factors[other] = max(factors.get(other, 1.0), LEAST)
    return Marks({key: min(max(factor, LEAST), MOST) for key, factor in factors.items()}, frozenset(wanted), stuck)


def _shares(errors: Mapping[str, float], room: float) -> Mapping[str, float]:
    """Return the error that each key may leave, its square in proportion to its effort, of those that exceed it;
    ``room``: sum of the squares that all may leave."""
    large = dict(errors)
    while large:
        efforts = {key: ladder.effort if (ladder := ladder_of(key)) else 1.0 for key in large}
        free = room - sum(error**2 for key, error in errors.items() if key not in large)
        shares = {key: math.sqrt(free * effort / sum(efforts.values())) for key, effort in efforts.items()}
        if small := [key for key in large if large[key] <= shares[key]]:
            for key in small:
                del large[key]
            continue
        return shares
    return {}


def _refined(plan: Plan, key: str, factor: float) -> RunMethod:
    """Return the method of a plan with one key refined; the same if it is stated, at its limit, or no key of the
    scene."""
    if (ladder := ladder_of(key)) is None or (key in FIELDS and not has_key(plan.scene, key)):
        return plan.method
    return ladder.refine(plan, factor)


def _can_refine(plan: Plan, key: str) -> bool:
    """Return whether a key has a finer value."""
    return _refined(plan, key, MOST) != plan.method


def _hiding(done: Round, key: str) -> str:
    """Return the key that is refined together with one whose error has hardly fallen by its last refinement: it hides
    its convergence, as a step that of modes, or a tolerance that of a mesh. "" if there is none."""
    past, other = done.plan.refined.get(key, ()), ladder.hidden_by if (ladder := ladder_of(key)) else ""
    has_stayed = past and _worst(done, key) > past[-1].error / past[-1].factor ** 0.5
    return other if has_stayed and _can_refine(done.plan, other) else ""


def _is_stalled(done: Round, key: str) -> bool:
    """Return whether a key's error has fallen by less than half of what its order says in `TRIES` refinements."""
    past = done.plan.refined.get(key, ())[-TRIES:]
    factor = math.prod(each.factor for each in past)
    return len(past) == TRIES and not _worst(done, key) < past[0].error / factor**0.5  # infinite: unknown


def _is_hopeless(done: Round, measure: str) -> bool:
    """Return whether a measure's error bar exceeds its value after `HOPES` rounds of refinement for it."""
    past = [bars.get(measure, 0.0) for bars in done.plan.earlier_errors[-HOPES:]]
    missed = len(past) == HOPES and min(past) > done.plan.scene.accuracy.target
    return missed and 1 < done.budget.relative(measure) < math.inf  # an infinite one is unknown


def _is_cut(done: Round, measure: str) -> bool:
    """Return whether the end of the run cuts the landing of a measure, so that no refinement makes it known."""
    return done.touches.landings.status == "cut off" and math.isinf(done.budget.relative(measure))


def attempts(done: Round, further: Plan) -> Iterator[tuple[Plan, frozenset[str]]]:
    """Yield the plan of the next round and what is tried where that one fails: keys that are refined half as far, and
    then those of the march and of the reed alone; no method twice. Beside each are the keys that it leaves out."""
    yield further, frozenset()
    tried = [further.method]
    for power, without in ((POWERS[1], frozenset[str]()), (1.0, SEAT_KEYS)):
        plan, _ = refine_plan(done, power, without)
        if plan is not None and plan.method not in tried:
            tried.append(plan.method)
            yield plan, without & mark(done).factors.keys()


def refine_plan(done: Round, power: float = 1.0, without: frozenset[str] = frozenset()) -> tuple[Plan | None, str]:
    """Return the plan of the next round, or ``None`` and in words why nothing can be refined.

    ``power``: of the factors by which errors are to be reduced; ``without``: keys that are not refined.
    """
    plan, marks = done.plan, mark(done)
    factors = {key: factor**power for key, factor in marks.factors.items() if key not in without}
    method, taken = _within_work(done, factors)
    if method == plan.method:
        return None, what_remains(done) or _why_nothing(done)
    refined, wanted = plan.refined, marks.wanted & taken.keys()
    if method.value(MODEL) != plan.method.value(MODEL):  # errors measured on a spring say nothing of waves
        refined, wanted = {}, wanted & {MODEL}
    latest = {key: (*refined.get(key, ()), Refinement(_worst(done, key), taken[key])) for key in wanted}
    choices = tuple(
        replace(choice, value=described(choice.key, method.value(choice.key)), reason=_why(done, choice.key, marks))
        if method.value(choice.key) != plan.method.value(choice.key)
        else choice
        for choice in plan.choices
        if choice.key in FIELDS
    )
    errors = (*plan.earlier_errors, {name: done.budget.relative(name) for name in done.judged})
    return replace(plan, method=method, choices=choices, earlier_errors=errors, refined={**refined, **latest}), ""


def _within_work(done: Round, factors: Mapping[str, float]) -> tuple[RunMethod, Mapping[str, float]]:
    """Return the method refined in the key of the largest error and then in those that reduce most of the error per
    counted work, within `MOST_WORK`; and the factor of each."""
    plan = done.plan
    alone = {key: _refined(plan, key, factor) for key, factor in factors.items()}
    alone = {key: finer for key, finer in alone.items() if finer != plan.method}

    def gain_per_work(key: str) -> float:
        more = max(work_ratio(plan.method, alone[key], plan.scene.bodies).values()) - 1
        return _worst(done, key) * (1 - 1 / factors[key]) / more if more > 0 else math.inf

    first = max(alone, key=lambda key: _worst(done, key), default="")
    method, taken = plan.method, dict[str, float]()
    for key in sorted(alone, key=lambda key: (key != first, -gain_per_work(key))):
        for power in POWERS:
            finer = _refined(replace(plan, method=method), key, factors[key] ** power)
            fits = max(work_ratio(plan.method, finer, plan.scene.bodies).values()) <= MOST_WORK
            if fits or (key == first and power == POWERS[-1]):
                method, taken[key] = finer, factors[key] ** power
                break
    return method, taken


def _worst(done: Round, key: str) -> float:
    """Return the largest relative error of a judged measure by a key."""
    return max(_relative_errors(done, key).values(), default=0.0)


def _relative_errors(done: Round, key: str) -> Mapping[str, float]:
    """Return the relative errors of the judged measures by a key."""
    part = done.budget.by_key.get(key, {})
    return {name: part[name] / abs(done.budget.values[name]) for name in done.judged if name in part}


def _leaves(done: Round, key: str) -> str:
    """Return in words a key's largest part of the relative error bar of a judged measure; "" if it is not known."""
    parts = {name: SAFETY * error for name, error in _relative_errors(done, key).items()}
    name = max(parts, key=lambda each: parts[each], default="")
    if not name or not math.isfinite(parts[name]):
        return ""
    return f"{percent(parts[name])} of {short_words(name)}" if parts[name] else "nothing"


def _why(done: Round, key: str, marks: Marks) -> str:
    """Return in words why a key was refined: the error that its last value left."""
    before, leaves = described(key, done.plan.method.value(key)), _leaves(done, key)
    if key in marks.wanted and leaves:
        return f"{before} before left {leaves}, measured"
    hidden = [each for each in marks.wanted if (ladder := ladder_of(each)) and ladder.hidden_by == key]
    return f"{before} before; refined with {f'{hidden[0]}, whose error it may hide' if hidden else 'another key'}"


def what_remains(done: Round) -> str:
    """Return in words what leaves most of the measure that misses the target most, of those that do so whatever is
    refined; "" if there is none."""
    stuck = {measure: errors for measure, errors in mark(done).stuck.items() if errors and done.budget.values[measure]}
    if not stuck:
        return ""
    measure = max(stuck, key=done.budget.relative)
    if _is_cut(done, measure):
        return "the run ends during the judged landing; a longer run.duration includes all of it"
    key, error = next(iter(stuck[measure].items()))
    if _is_hopeless(done, measure):
        bar, words = percent(done.budget.relative(measure)), short_words(measure)
        return f"the error bar of {words} is {bar} of its value after {HOPES} refinements: it is given up"
    share = percent(SAFETY * error / abs(done.budget.values[measure]))
    if math.isinf(done.budget.by_key.get(key, {}).get(measure, error)):
        share = "an unknown part"
    value = done.plan.method.value(key) if key in FIELDS else None
    most = isinstance(value, int) and not _can_refine(done.plan, key)
    why = f"rounds take at most {value}: state {key}" if most else "it cannot be made smaller"
    remedy = remedy_by_key(done.plan, key) if key == STOPPER_ARCS or key not in FIELDS else ""
    why = f"no round refines it further: {remedy}" if remedy else why
    why = done.plan.refused.get(key) or why
    if done.plan.is_given(key):
        why = "the file states it" + (f": {remedy}" if remedy else "")
    named = f"{words_of(key)} ({key})" if "." in key else words_of(key)
    return f"{named} leaves {share} of {short_words(measure)}, and {why}"


def words_of(key: str) -> str:
    """Return the source of error of a key, or of a model, in words."""
    return source_in_words(source_of(key) if ladder_of(key) else key)


def _why_nothing(done: Round) -> str:
    """Return in words why nothing is refined although no measure is kept from the target by what cannot be."""
    zero = [key_of(name) for name in done.judged if not done.budget.values[name]]
    return f"{zero[0]} is zero, so that a relative error has no meaning" if zero else "nothing is left to refine"


def work_ratio(before: RunMethod, after: RunMethod, bodies: Mapping[str, Structure]) -> Mapping[str, float]:
    """Return the counted work by one method over that by another: of seat and reed by unknowns, band and contact
    points, of the contact by steps, points and modes."""
    points = after.contacts / before.contacts
    bands = (
        ratio_of(new.bandwidth, old.bandwidth) for old, new in ((before.seat, after.seat), (before.reed, after.reed))
    )
    modes = max(*bands, ratio_of(after.reed.n_modes, before.reed.n_modes))
    return {
        "seat": _solving_ratio(bodies["seat"], before.seat, after.seat),
        "reed": _solving_ratio(bodies["reed"], before.reed, after.reed),
        "contact": points * modes * ratio_of(before.time_step, after.time_step),
    }


def _solving_ratio(body: Structure, before: Method, after: Method) -> float:
    """Return the work of solving a body by one method over that by another: its unknowns times its band, and for Krylov
    vectors times its ports; the modes of a body in arcs do not depend on these."""
    band = ratio_of(after.bandwidth, before.bandwidth)
    if not after.in_arcs:
        band *= after.division.count / before.division.count
    dimensions = 3 if body.elements_of(before) in ("3d", "sector") else 2
    old, new = body.sizes(before), body.sizes(after)
    finer = ratio_of(old.size, new.size) ** dimensions, ratio_of(old.contact_size, new.contact_size) ** (dimensions - 1)
    return max(finer) * band


def ratio_of(one: float | None, other: float | None) -> float:
    """Return the ratio of two values of a key; 1 where the key has none."""
    return one / other if one and other else 1.0
