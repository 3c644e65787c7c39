"""Quick answers: one march of a changed scene by the method of the last full run, whose error bars are carried over."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

import impact
from impact.greens.base import Array
from impact.march.rows import MarchRun
from impact.notices import Progress
from seatfem import readings, results
from seatfem.structures.cache import Cache, build, key_of
from seatfem.structures.kinds import Structure
from seatfem.structures.method import Method, Solved
from seatfem.study.impacts.bodies import problem_of, solve_body, striker_of
from seatfem.study.impacts.contact import Flights, fallback_step, marched, record_of_march
from seatfem.study.impacts.landings import Landings
from seatfem.study.impacts.touches import force_of, is_of_a_landing, values_of_record
from seatfem.study.plan import Plan
from seatfem.study.runs.afterwards import is_spring, spring_for, static_stiffness
from seatfem.study.runs.converge import begin_plan
from seatfem.study.runs.kept import plan_from_json, plan_to_json
from seatfem.study.runs.summary import landing_keys
from seatfem.study.scene import Run, Scene, measures
from seatfem.study.scene.wings import CYCLE

Numbers = Mapping[str, Any]
"""Numbers by their keys in summary.json."""
PATIENCE: Final = 0.2  # longest processor time of a quick answer, else its step is lengthened [s]
LONGER: Final = 2  # factor by which the step of quick answers is lengthened, as long as they take more
LONGEST: Final = 8  # largest such factor in all
POINTS: Final = 700  # points of a curve
MARGIN: Final = 0.35  # time shown before and after the hardest landing, over its duration


@dataclass(frozen=True)
class Known:
    """A body as the last full run computed it, and the key by which it is cached."""

    structure: Structure
    solved: Solved
    key: str

    def solved_for(self, structure: Structure, method: Method) -> Solved | None:
        """Return it for a ``structure`` that differs in its motion, or in its modal damping, which is added to that of
        each mode; ``None`` for any other difference."""
        change = structure.loss - self.structure.loss
        if change:
            structure = structure.model_copy(update={"damping_ratio": self.structure.loss})
        modal = self.solved.greens.modal
        if key_of(structure, method) != self.key or (change and modal is None):
            return None
        if not change or modal is None:
            return self.solved
        return replace(self.solved, greens=replace(modal, zeta=modal.zeta + change))


@dataclass(frozen=True)
class Reference:
    """The last full run, from which quick answers go on.

    Attributes:
        plan: its plan.
        summary: its summary.json.
        seat, reed: its bodies; a reed in closed form is ``None``.
        time_step: of quick answers [s].
        quick, curves: quick answer to its own scene.
    """

    plan: Plan
    summary: Numbers
    seat: Known
    reed: Known | None
    time_step: float
    quick: Numbers
    curves: Mapping[str, Any]

    def plan_for(self, scene: Scene) -> Plan | None:
        """Return the plan of this run for another scene; ``None`` if that divides its contact faces otherwise, as one
        with a first tilt, or needs another model of the seat."""
        plan = plan_from_json(scene, plan_to_json(self.plan))
        ours, theirs = (None if each is None else each.method for each in (self.plan, plan))
        if ours is None or theirs is None or ours.seat.level != theirs.seat.level or ours.contacts != theirs.contacts:
            return None
        return plan

    def is_quick(self, scene: Scene) -> bool:
        """Return whether a scene needs no other seat, reed or stopper than this run computed, but for damping."""
        if (plan := self.plan_for(scene)) is None:
            return False
        ours, theirs = self.plan.scene.stopper, plan.scene.stopper
        above = theirs is None or not theirs.body.traits.is_solved or (ours is not None and ours.body == theirs.body)
        seat = not scene.seat.traits.is_solved or self.seat.solved_for(scene.seat, plan.method.seat) is not None
        reed = self.reed is None or self.reed.solved_for(scene.reed, plan.method.reed) is not None
        return above and seat and reed


def reference_of(plan: Plan, summary: Numbers, cache: Cache, progress: Progress) -> Reference:
    """Return a full run as a reference, with the shortest of several steps by which an answer takes `PATIENCE` or less.

    ``cache``: cache in which the run has stored its seat.
    """
    scene, method = plan.scene, plan.method
    seat = build(scene.seat, method.seat, scene.run.duration, cache, progress=progress)
    reed = solve_body("reed", scene.reed, method.reed, scene.run.duration, progress)
    own_seat = Known(scene.seat, seat, key_of(scene.seat, method.seat))
    own_reed = None if reed is None else Known(scene.reed, reed, key_of(scene.reed, method.reed))
    striker = striker_of(scene, method.reed.n_modes, None if reed is None else reed.greens)
    step = method.time_step or fallback_step(scene.run, scene.driven_by, striker.greens, seat.greens)
    known = Reference(plan, summary, own_seat, own_reed, step, {}, {})
    march_of(known, scene, progress)  # compiles what is needed
    factor = 1
    while True:
        begun = time.process_time()
        known = replace(known, time_step=factor * step)
        quick, curves = march_of(known, scene, progress)
        is_fast = time.process_time() - begun <= PATIENCE
        if is_fast or factor == LONGEST or 2 * LONGER * known.time_step > scene.run.filter_width:
            return replace(known, quick=quick, curves=curves)
        factor *= LONGER


def march_of(known: Reference, scene: Scene, progress: Progress) -> tuple[Numbers, Mapping[str, Any]]:
    """Return the numbers of a scene on its seat and on the spring baseline, by one march each, and its curves.

    A body that differs from that of the ``known`` run in more than its damping is computed again by the same method.

    A scene that this method does not suit is computed by that of a first round. Raises what the stages of a run raise.
    """
    plan, step = known.plan_for(scene), known.time_step
    if plan is None:
        plan, step = begin_plan(scene), 0.0
    scene, method, duration = plan.scene, plan.method, plan.scene.run.duration
    seat = known.seat.solved_for(scene.seat, method.seat)
    if seat is None:
        seat = build(scene.seat, method.seat, duration, Cache(None), progress=progress, mesh_error=False)
    reed = None if known.reed is None else known.reed.solved_for(scene.reed, method.reed)
    if reed is None:
        reed = solve_body("reed", scene.reed, method.reed, duration, progress, mesh_error=False)
    progress("contact", 0.0)
    striker = striker_of(scene, method.reed.n_modes, None if reed is None else reed.greens)
    spring = spring_for(seat.greens, static_stiffness(seat.greens, scene.seat.endless_stiffness))
    flights = Flights(striker, duration, scene.contact.preload)
    step = step or method.time_step or fallback_step(scene.run, scene.driven_by, striker.greens, seat.greens)
    numbers, runs = dict[str, Any](), dict[str, tuple[MarchRun, Landings]]()
    for name, greens in (("seat", seat.greens), ("spring", spring)):
        if name == "spring" and is_spring(seat.greens, spring):
            numbers |= {f"{readings.SPRING}{key}": value for key, value in numbers.items()}
            continue
        run = marched(problem_of(scene, striker, impact.Body(greens)), step, duration, flights)
        record = record_of_march(scene, run)
        assert record.landings is not None
        values = values_of_record(record, record.landings)
        keys: dict[str, Any] = {
            measures.key_of(key): value
            for key, value in values.items()
            if not is_of_a_landing(key) and CYCLE not in key
        }
        keys |= landing_keys(record.landings, values)
        numbers |= {f"{readings.SPRING if name == 'spring' else ''}{key}": value for key, value in keys.items()}
        runs[name] = run, record.landings
        progress("contact", len(runs) / 2)
    return numbers, _curves(scene.run, runs)


def with_bars(known: Reference, numbers: Numbers, *, is_known: bool) -> dict[str, Any]:
    """Return numbers of a quick answer as a summary: with the error bars of the full run in proportion to the values,
    to which what the step of quick answers changes in that run's own scene is added. ``is_known``: whether they are,
    by the same method."""
    prefixes = ("accuracy_", "seat_kind", "plan_seat_level", "title", "filter_width_s")
    summary = {key: value for key, value in known.summary.items() if key.startswith(prefixes)} | dict(numbers)
    for key, value in numbers.items():
        bar, full = readings.bar_of(known.summary, key), readings.as_number(known.summary.get(key))
        if bar is None:
            continue
        quick, now = readings.as_number(known.quick.get(key)), readings.as_number(value)
        own = None
        if is_known and math.isfinite(bar) and full is not None and quick is not None and now is not None:
            share = 1.0 if full == 0 or key.endswith(readings.WITHOUT_ZERO) else abs(now / full)
            own = share * (bar + abs(quick - full))
        summary[f"{readings.BAR}{key}"] = own
    return summary


def rows(summary: Numbers, full: Numbers) -> list[dict[str, str]]:
    """Return the rows of a table: words, value with its bar, the spring's, and that of the full run; headings have
    words alone."""
    table = []
    for group, listed in results.rows_of(summary).items():
        shown = [row for row in listed if readings.as_number(summary.get(row.key)) is not None and group != "raw"]
        table += [{"words": results.HEADINGS[group]}] if shown else []
        for row in shown:
            words, value = results.words_of(row, summary).strip(), readings.reading(summary, row.key, row.unit)
            others = {"spring": summary.get(f"{readings.SPRING}{row.key}"), "full": full.get(row.key)}
            table.append(
                {"words": words, "value": value}
                | {name: readings.reading({row.key: each}, row.key, row.unit) for name, each in others.items()}
            )
    return table


def _curves(table: Run, runs: Mapping[str, tuple[MarchRun, Landings]]) -> dict[str, Any]:
    """Return the curves of force, from the start of the hardest landing on the seat if any, and of lift [SI]."""
    hard, whole, width = runs["seat"][1].hardest, (0.0, table.duration), table.filter_width
    span, zero = whole, 0.0
    if hard is not None:
        margin, zero = MARGIN * hard.duration + 2 * width, hard.start
        span = zero - margin, zero + hard.duration + margin
    force = {
        name: _curve(_averaged(force_of(each), each.dt, width), each.dt, span, zero) for name, (each, _) in runs.items()
    }
    lift = {name: _curve(each.opening, each.dt, whole) for name, (each, _) in runs.items()}
    return {"force": force, "lift": lift, "landed": hard is not None}


def _averaged(force: Array, dt: float, width: float) -> Array:
    """Return a force (n + 1,) averaged over ``width`` [s] around each time."""
    count = max(round(width / dt), 1)
    total = np.concatenate([np.zeros(1), np.cumsum(force)])
    low = np.clip(np.arange(len(force)) - count // 2, 0, len(force))
    high = np.clip(low + count, 0, len(force))
    return np.asarray((total[high] - total[low]) / count)


def _curve(values: Array, dt: float, span: tuple[float, float], zero: float = 0.0) -> dict[str, list[float]]:
    """Return times from ``zero`` and values within a ``span`` [s]; of many the smallest and largest of each of several
    bins."""
    first, last = max(int(span[0] / dt), 0), min(math.ceil(span[1] / dt) + 1, len(values))
    size = max(1, math.ceil(2 * (last - first) / POINTS))
    shown = values[first : first + (last - first) // size * size].reshape(-1, size)
    ends = np.stack([shown.argmin(axis=1), shown.argmax(axis=1)], axis=1) + size * np.arange(len(shown))[:, None]
    picks = first + np.unique(np.append(ends, [0, last - first - 1]))
    return {"time": [float(f"{dt * k - zero:.7g}") for k in picks], "value": [float(f"{values[k]:.5g}") for k in picks]}
