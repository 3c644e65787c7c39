"""What the plan's run takes, against the cheapest point of a small grid of options that meets the target in truth."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

from decision_options import Truth
from finer_scenes import REFUSALS
from table import forget, spent

from impact.bodies.body import Body
from impact.notices import silent
from seatfem.machine.resources import Stopwatch
from seatfem.structures.cache import build
from seatfem.structures.method import Method
from seatfem.study.impacts.bodies import problem_of, solve_body, striker_of
from seatfem.study.impacts.contact import record_of
from seatfem.study.impacts.touches import values_of_record
from seatfem.study.method import RunMethod
from seatfem.study.planning.plan import Plan
from seatfem.study.runs.rounds import Limits, rounds
from seatfem.study.scene import Scene

RATIO: Final = 1.6  # between meshes, and between bands
LONGER: Final = (1, 2, 4)  # steps over the plan's
FEWER: Final = (1.0, 1.4, 2.0)  # the plan's modes of the reed over those of a point


@dataclass(frozen=True)
class Front:
    """The plan of one scene against the grid.

    Attributes:
        plan_seconds: of processor time, as the user waits: plan, all rounds, error bars.
        points, meeting: of the grid, and those of them that meet the target in truth.
        cheapest: of these, in words; "" where there is none, and its seconds are nan.
        bare_seconds: seat, reed and march of it.
        seconds: of it with its error bars, as a run of a file that states all of these keys.
    """

    plan_seconds: float
    points: int
    meeting: int
    cheapest: str
    bare_seconds: float
    seconds: float

    @property
    def ratio(self) -> float:
        """Of the plan's seconds to those of the cheapest point, with its error bars."""
        return self.plan_seconds / self.seconds

    @property
    def bare_ratio(self) -> float:
        """Of the plan's seconds to those of the cheapest point without error bars."""
        return self.plan_seconds / self.bare_seconds


def front_of(plan: Plan, truth: Truth, plan_seconds: float, folder: Path) -> Front:
    """Return the plan against the grid; without seconds of a point where none of the grid meets the target."""
    scene = plan.scene
    points: list[tuple[float, str, RunMethod, float]] = []
    for seat in _seats(plan):
        try:
            points.extend(_points(scene, replace(plan.method, seat=seat), truth))
        except REFUSALS:
            continue
    meeting = [(seconds, words, method) for seconds, words, method, error in points if error <= scene.accuracy.target]
    if not meeting:
        return Front(plan_seconds, len(points), 0, "", math.nan, math.nan)
    bare, words, method = min(meeting, key=lambda point: point[0])
    forget()
    start = spent()
    next(rounds(replace(plan, method=method), folder, Stopwatch(), silent, limits=Limits(rounds=1)))
    return Front(plan_seconds, len(points), len(meeting), words, bare, spent() - start)


def _seats(plan: Plan) -> Iterator[Method]:
    """Yield the plan's seat, and with a coarser mesh, a narrower band, both, and without waves."""
    seat = plan.method.seat
    yield seat
    meshed = seat.size is not None and seat.contact_size is not None
    coarser = seat
    if meshed:
        assert seat.size is not None
        assert seat.contact_size is not None
        coarser = replace(seat, size=RATIO * seat.size, contact_size=RATIO * seat.contact_size)
        yield coarser
    if seat.bandwidth is not None and not seat.static:
        narrow = replace(seat, bandwidth=seat.bandwidth / RATIO)
        yield narrow
        if meshed:
            yield replace(coarser, bandwidth=narrow.bandwidth)
            yield replace(coarser, bandwidth=narrow.bandwidth, level="spring")
    if (seat.rings or 1) > 1 and seat.lip is None:
        yield replace(seat, rings=1)


def _points(scene: Scene, method: RunMethod, truth: Truth) -> Iterator[tuple[float, str, RunMethod, float]]:
    """Yield (seconds, words, method, largest error of an asked measure) with one seat."""
    start = spent()
    seat = build(scene.seat, method.seat, scene.run.duration, mesh_error=False).greens
    of_seat, modes = spent() - start, method.reed.n_modes
    numbers = [None] if modes is None else sorted({max(1, round(modes / ratio)) for ratio in FEWER})
    assert method.time_step is not None
    for number in numbers:
        forget()
        start = spent()
        reed = solve_body("reed", scene.reed, method.reed, scene.run.duration, mesh_error=False)
        striker = striker_of(scene, number, None if reed is None else reed.greens)
        of_striker, problem = spent() - start, problem_of(scene, striker, Body(seat))
        for factor in LONGER:
            step = factor * method.time_step
            if 2 * step > scene.run.filter_width:
                break
            start = spent()
            error, _ = truth.change(
                values_of_record(record_of(scene, problem, step, like=truth.landings), truth.landings)
            )
            seconds = of_seat + of_striker + spent() - start
            here = replace(method, reed=replace(method.reed, n_modes=number), time_step=step)
            yield seconds, _in_words(here), here, error if math.isfinite(error) else math.inf


def _in_words(method: RunMethod) -> str:
    seat, step = method.seat, method.time_step
    parts = [str(seat.level)]
    if seat.size is not None:
        parts.append(f"mesh {1e3 * seat.size:.3g} mm")
    if seat.bandwidth is not None and not seat.static:
        parts.append(f"{seat.bandwidth / 1e3:.3g} kHz")
    if method.reed.n_modes is not None:
        parts.append(f"{method.reed.n_modes} modes")
    if step is not None:
        parts.append(f"{1e9 * step:.3g} ns")
    return ", ".join(parts)
