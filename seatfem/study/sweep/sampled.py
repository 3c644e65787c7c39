"""error_bars = "sampled": some scenes of a study run in full, the others are marched side by side and have their bars.

The first scenes settle how all are computed, at a target of `TIGHTER` of the scene's own. The sample runs in full by
those settings, in one round: the extremes of every key, the scenes nearest to the corners of all, and others evenly
through the design, chosen by their values alone. Of each measure the largest relative error bar among them, times
`SAFETY`, is the bar of the others. One more scene that is drawn as n others are has a larger bar than all of them with
a chance of 1/(n + 1); the factor is for a sample that is laid out, not drawn.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import islice, product
from typing import Final

import numpy as np

from seatfem import results
from seatfem.study.impacts.landed import BAR, STATUS, has_landed
from seatfem.study.impacts.measures import OF_A_LANDING
from seatfem.study.method import PORTS, RINGS, is_given
from seatfem.study.scene import Scene
from seatfem.study.scene.lips import lip_of
from seatfem.study.scene.measures import PREFIXES, Measure, Restitution, all_measures, key_of
from seatfem.study.scene.problems import scene_error
from seatfem.study.sweep.cases import Case, columns_of, key_of_case
from seatfem.study.sweep.design import Changes
from seatfem.study.sweep.outcome import Outcome
from seatfem.study.sweep.study import Study

SAFETY: Final = 1.25
TIGHTER: Final = 0.6  # of accuracy.target, so that bars of others with their factor are within it
LEAST: Final = 24  # scenes through the design
CORNERS: Final = 32  # at most
STRESSES: Final = ("peak_reed_stress", "peak_reed_stress_after_contact", "initial_reed_stress")
STRESS: Final = (
    *(f"{name}_{what}" for name in STRESSES for what in ("Pa", "at_m", "time_s")),
    results.REED_STRESS_AT_START,
    results.REED_STRESS_BEFORE_LANDING,
)
OTHERS: Final = (results.RAW_PEAK, results.FIRST_CONTACT, results.CONTACTS)
OF_LANDINGS: Final = (STATUS, *(f"landing_{key}" for key in (*OF_A_LANDING.values(), results.STATIC, "count")))
PRESSED_ON: Final = ("pressed_on_time_s", "pressed_on_largest_load_N")


def settings(scene: Scene) -> Changes:
    """Return what is changed in all scenes of such a study, besides what varies: the target, and one port."""
    one_port = {RINGS: scene.seat.elastic is not None, PORTS: lip_of(scene) is not None}
    ports = {key: 1 for key, applies in one_port.items() if applies and not is_given(scene, key)}
    return {"accuracy.target": TIGHTER * scene.accuracy.target, **ports}


def divided(study: Study, cases: list[Case], scene: Scene, measures: Sequence[str]) -> list[Case]:
    """Return the cases: the first as they are, the sample in one round, the others to be marched side by side.

    Raises `SceneError` of a ``scene``, the first of them, that is marched by itself, and of measures that take a run
    in full.
    """
    _check(scene, measures)
    needs, sample = _needs(measures), _sample(study, cases)

    def way(place: int, case: Case) -> Case:
        if case.leads:
            return case
        if place in sample:
            return replace(case, key=key_of_case(case, "sample"), way="sample")
        return replace(case, key=key_of_case(case, "beside", *needs), way="beside", needs=needs)

    return [way(place, case) for place, case in enumerate(cases)]


def _needs(measures: Sequence[str]) -> tuple[str, ...]:
    """Return what these keys of summary.json take beside the force."""
    every = all_measures().values()
    moved = [key for each in every if each.needs_displacement for key in _keys(each)]
    stressed = [key for each in every if each.needs_stress for key in _keys(each)]
    needs = {"displacement": moved, "stress": {*stressed, *STRESS}}
    return tuple(name for name, keys in needs.items() if set(keys) & set(measures))


def _keys(measure: Measure) -> tuple[str, ...]:
    """Return the keys of a measure in summary.json: of the run, of the hardest and of the first landing."""
    return tuple(key_of(prefix + measure.name) for prefix in PREFIXES.values() if not prefix or measure.landing_key)


def _sample(study: Study, cases: list[Case]) -> set[int]:
    """Return the places of the scenes that run in full, besides the first."""
    numbers = [np.asarray(column, dtype=float) for column in columns_of(cases, study).values()]
    unit = np.array([(n - n.min()) / np.ptp(n) for n in numbers if np.ptp(n) > 0]).reshape(-1, len(cases))
    places = {int(place) for place in np.linspace(0, len(cases) - 1, LEAST).round()}
    for key in unit:
        places |= {int(key.argmin()), int(key.argmax())}
    corners = islice(product((0.0, 1.0), repeat=len(unit)), CORNERS)
    return places | {int(np.abs(unit.T - corner).max(axis=1).argmin()) for corner in corners if corner}


def is_own(outcome: Outcome) -> bool:
    """Return whether a scene has been run in full."""
    return "accuracy_met" in outcome.summary or not outcome.has_numbers


def judged(cases: Sequence[Case], outcomes: Mapping[str, Outcome], measures: Sequence[str]) -> dict[str, Outcome]:
    """Return the outcomes, those marched side by side with the sample's bars, by the target of the study's scene.

    A measure that is zero has none, nor has a scene that did not land or was cut off: none of the sample is like it,
    and no target is asked of it. Nor has one of which a scene of the sample has none, nor has any where such a scene
    was not carried out: what asks for it misses.
    """
    full = [outcomes[case.key].summary for case in cases if is_own(outcomes[case.key])]
    sample = [each for case in cases if case.way == "sample" and has_landed(each := outcomes[case.key].summary)]
    first = next((summary for summary in full if "accuracy_target" in summary), {})
    keys = str(first.get("accuracy_judged_keys", "")).split(", ")
    target = float(first.get("accuracy_target") or math.inf) / TIGHTER
    shares = {name: [_share(each, name) for each in sample if each.get(name)] for name in {*measures, *keys}}
    lost = [case.number for case in cases if case.way == "sample" and not outcomes[case.key].has_numbers]
    largest = {name: SAFETY * max(of) for name, of in shares.items() if not lost and of and max(of) < math.inf}

    def one(outcome: Outcome) -> Outcome:
        summary = dict(outcome.summary)
        if not outcome.has_numbers or not (is_own(outcome) or has_landed(summary)):
            return outcome
        if not is_own(outcome):
            values = {name: summary.get(name) for name in largest}
            summary |= {BAR + k: largest[k] * abs(v) for k, v in values.items() if isinstance(v, int | float) and v}
        above = {name: share for name in keys if target < (share := _share(summary, name)) < math.inf}
        unknown = [name for name in keys if summary.get(name) and summary.get(BAR + name) is None]
        if unknown:
            which = f"scene {lost[0]} of the sample was not carried out" if lost else "one of the sample has none"
            why = f"{unknown[0]} has no error bar, as {which}; leave error_bars out"
            return replace(outcome, state="missed", message=why, summary=summary)
        if not above:
            message = outcome.message if outcome.state == "done" else ""
            return replace(outcome, state="done", message=message, summary=summary)
        name = max(above, key=lambda each: above[each])
        why = f"{name} has an error bar of {above[name]:.2g}, above accuracy.target = {target:g}; leave error_bars out"
        return replace(outcome, state="missed", message=why, summary=summary)

    return {case.key: one(outcomes[case.key]) for case in cases}


def _share(summary: Mapping[str, object], name: str) -> float:
    """Return the relative bar; infinite where it is not known."""
    value, bar = summary.get(name), summary.get(BAR + name)
    known = isinstance(value, int | float) and isinstance(bar, int | float)
    return abs(float(bar) / float(value)) if known and value else math.inf  # type: ignore[arg-type]


def _check(scene: Scene, measures: Sequence[str]) -> None:
    words = {
        "a gas": scene.gas is not None,
        "a [[spring]]": bool(scene.spring),
        "a stopper": scene.stopper is not None,
        "a film in the gap": scene.contact.film is not None,
        "a preload": scene.contact.preload,
        "contact.rings": is_given(scene, RINGS) and scene.contact.rings not in (None, 1),
        "contact.ports": is_given(scene, PORTS) and scene.contact.ports not in (None, 1),
    }
    for name in [name for name, forbids in words.items() if forbids][:1]:
        text = f"'sampled' marches scenes side by side, which {name} forbids; leave the key out"
        raise scene_error("error_bars", text)
    keys = {key for each in all_measures().values() if not each.needs_line for key in _keys(each)}
    keys = (keys | {*STRESS, *OTHERS, *OF_LANDINGS, *PRESSED_ON}) - {Restitution.key}  # of all energies of a run
    for name in [name for name in measures if name not in keys][:1]:
        known = ", ".join(sorted(keys))
        raise scene_error("outputs.measures", f"{name!r} takes a run in full: leave error_bars out, or ask for {known}")
