"""The next round of a run whose target is missed: a finer plan within the limits, and its expected time."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from impact.quantities import in_time
from seatfem.machine.resources import available_memory, own_memory
from seatfem.study.impacts.contact import MAX_STEPS, RunError
from seatfem.study.impacts.touches import STRIKER
from seatfem.study.plan import Plan
from seatfem.study.runs import converge
from seatfem.study.runs.round import Round
from seatfem.study.safety import MOST_ROUNDS
from seatfem.units import write_quantity

STAGES: Final = {
    "seat": ("mesh", "assembly", "reduction", "mesh error", "patch error", "pole fit"),
    "reed": (STRIKER,),
    "contact": ("stopper", "contact", "reed stress", "error budget", "spring baseline", "files"),
}
"""Stages of a round by the part of its work with which they grow."""
LONGEST: Final = 600.0  # longest expected time [s] of a further round that is begun without --max-time
PROGRAM: Final = 2.5e8  # memory of the program, its packages and a first coarse mesh [bytes]
AFTERWARDS: Final = 8e7  # memory of what follows the last round: files, horizon, pictures [bytes]
LEAST_GROWTH: Final = 1.5  # of the work from one round to the next; times of less growth do not tell its power
HISTORIES: Final = 10  # histories in the peak memory of a round: forces, gaps, motions, averages, those before
FIXED: Final = 0.5  # wall time of seat, reed or contact that does not grow: start of gmsh, loading of compiled code [s]
POWER: Final = 0.5  # of the growth of the work, to which time grows while the last two rounds do not show it


@dataclass(frozen=True)
class Limits:
    """Limits on the rounds and the time of a run.

    Attributes:
        rounds: largest number of rounds.
        seconds: wall time of the whole run [s]. A round expected to exceed it is not begun; one that exceeds it is
            stopped, and the round before is the answer. Infinite: `LONGEST` each round.
        first: wall time after which the first round is stopped, with `OutOfTime` and no answer [s].
        steady: whether only an exceeded ``seconds`` stops the rounds, so that results do not depend on expected times.
        stress: whether the last round has the reed's largest stresses although the scene does not ask for them.

    Raises:
        RunError: ``rounds`` below 1, ``seconds`` not positive.
    """

    rounds: int = MOST_ROUNDS
    seconds: float = math.inf
    first: float = math.inf
    steady: bool = False
    stress: bool = True

    def __post_init__(self) -> None:
        if not (isinstance(self.rounds, int) and self.rounds >= 1):
            raise RunError(f"--rounds = {self.rounds!r} must be a whole number, at least 1")
        if not isinstance(self.seconds, int | float):
            raise RunError(f"--max-time = {self.seconds!r} is no time; state seconds")
        if not self.seconds > 0:
            raise RunError(f"--max-time = {write_quantity(self.seconds, 'time')} must be positive")


def expect_time(done: Round, plan: Plan) -> float:
    """Return the expected wall time [s] of a further round, from the price of the round before and the growth of its
    counted work: of the seat by unknowns, ports and band, of the contact by steps, ports and modes."""
    before, after = done.plan.method, plan.method
    work = converge.work_ratio(before, after, done.plan.scene.bodies)
    is_repeated = {"seat": before.seat != after.seat, "reed": before.reed != after.reed, "contact": True}
    return sum(_grown(done, part, ratio) for part, ratio in work.items() if is_repeated[part])


def _grown(done: Round, part: str, ratio: float) -> float:
    """Return the expected wall time [s] of a part of a round whose work grows by a ratio: by the power of it that the
    last two rounds showed, else, without its fixed part, by `POWER`."""
    seconds = time_of(done.price, part)
    if done.before is not None and seconds > 0 and (earlier := time_of(done.before[1], part)) > 0:
        work = converge.work_ratio(done.before[0], done.plan.method, done.plan.scene.bodies)[part]
        if work > LEAST_GROWTH:
            power = math.log(seconds / earlier) / math.log(work)
            return float(seconds * ratio ** min(max(power, 0.0), 1.0))
    fixed = min(seconds, FIXED)
    return fixed + (seconds - fixed) * float(ratio**POWER)


def expect_memory(done: Round, plan: Plan | None, count: int = 1) -> float:
    """Return the expected peak memory [bytes] of a run after ``count`` further rounds, the first by the ``plan``;
    ``None``: it ends with the round that is done.

    What the process held before, and the program's own, do not grow; histories of the whole contact do with fine steps,
    those of all contacts with the steps that are taken, which are long where the motion is smooth, and all the rest
    with the work of seat or reed, by `LEAST_GROWTH` in rounds after the first.

    nan if the peak so far is not known.
    """
    if plan is None:
        return done.memory + AFTERWARDS
    before, after, rows = done.plan.method, plan.method, done.result.rows
    contacts, finer = before.contacts, converge.ratio_of(before.time_step, after.time_step)
    of_rows = (finer if rows.is_uniform else finer**0.5) * after.contacts / contacts
    work = converge.work_ratio(before, after, done.plan.scene.bodies)
    of_bodies = max(work["seat"], work["reed"], LEAST_GROWTH)
    whole, each = (HISTORIES * 8.0 * values for values in (int(rows.ends[-1]), len(rows.ends) * contacts))
    program = max(PROGRAM, done.memory_before)
    bodies = max(done.memory - program - whole - each, 0.0)
    grown = program + bodies * of_bodies * LEAST_GROWTH ** (count - 1) + whole * finer**count + each * of_rows**count
    return float(max(done.memory, grown)) + AFTERWARDS


def time_of(price: Mapping[str, float], part: str) -> float:
    """Return the wall time of seat, reed or contact [s] in that of all stages."""
    return sum(price.get(stage, 0.0) for stage in STAGES[part])


def next_plan(done: Round, limits: Limits, time_left: float) -> tuple[Plan | None, str]:
    """Return the refined plan, or ``None`` and the reason in words; ``time_left``: remaining time of the run [s]."""
    if done.number >= limits.rounds:
        return None, f"{limits.rounds} round{'s'[: limits.rounds > 1]} at most"
    further, why = converge.refine_plan(done)
    if further is not None and not further.changes_since(done.plan):
        return None, converge.what_remains(done)
    if further is not None:
        why = _exceeded_limit(done, further, math.nan if limits.steady else time_left)
    return (None, why) if why else (further, "")


def _exceeded_limit(done: Round, plan: Plan, time_left: float) -> str:
    """Return in words which limit a further round would exceed; "" if none. ``time_left`` of nan: none of time."""
    seconds = expect_time(done, plan)
    if seconds > time_left:
        return (
            f"the next round would take about {in_time(seconds)}, {in_time(max(time_left, 0.0))} of --max-time are left"
        )
    if math.isinf(time_left) and seconds > LONGEST:
        return f"the next round would take about {in_time(seconds)}; --max-time, or a finer seat.mesh or step, insists"
    need, room = expect_memory(done, plan), available_memory() + own_memory()
    if need > room:
        return f"the next round would need about {need / 1e9:.2g} GB of memory, {room / 1e9:.2g} GB are available"
    dt = plan.method.time_step
    if dt is not None and plan.scene.run.duration / dt > MAX_STEPS:
        return f"the next round would take {plan.scene.run.duration / dt:.2g} steps, at most {MAX_STEPS:.0e} are stored"
    return ""
