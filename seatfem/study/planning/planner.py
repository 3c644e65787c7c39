"""From a scene to a plan: the cheapest model that meets the accuracy asked for."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Final

from impact.progress import Progress, silent
from impact.runs.budget import SAFETY
from seatfem.machine.rates import Machine
from seatfem.structures.estimates.mesh_size import ERRORS
from seatfem.structures.store import Store
from seatfem.study.impacts.budget import Source
from seatfem.study.impacts.contact import check_length, check_step
from seatfem.study.impacts.validity import validity_advice
from seatfem.study.planning.choices import choices_of
from seatfem.study.planning.deciding import Choices, Decision
from seatfem.study.planning.filling import is_given
from seatfem.study.planning.kept import Fineness, finer, kept_seat
from seatfem.study.planning.means import cost_of, notes_on, within_means
from seatfem.study.planning.options import BAND, BANDS, MODEL, TOLERANCE, TOLERANCES, Seen
from seatfem.study.planning.plan import Alternative, Plan, PlannedLevel
from seatfem.study.planning.prerun import Bench, first_look
from seatfem.study.planning.refining import finer_keys
from seatfem.study.planning.sensitivity import Sensitivity
from seatfem.study.scene import Scene
from seatfem.study.scene.files import check_files

__all__ = ["plan_scene", "refine"]

STEP_UP: Final = 2.5  # ratio of the targets of the alternatives to the target
FINEST: Final = 0.05  # part of the tightest target looked at that the finest rungs must reach


def plan_scene(
    scene: Scene,
    machine: Machine | None = None,
    progress: Progress = silent,
    *,
    folder: Path | None = None,
    store: Store | None = None,
    without: tuple[PlannedLevel, ...] = (),
) -> Plan:
    """Every open key of ``scene`` chosen, with reason and number; predicted cost and error.

    Args:
        scene: as in the file; what it states is obeyed.
        machine: rates of this computer; default: those known.
        folder: of the run, whose seat may serve again.
        store: of seats; default: the user's.
        without: levels that are not to be chosen, because a run has found them too coarse.

    Raises:
        RunError: a given time step that cannot resolve the measures; more steps than can be stored.
        LevelError: a level that does not describe the seat is asked for.
        SceneError: a file that cannot be read, or has no such face, group or region.
    """
    check_step(scene)
    check_files(scene)
    choices = Choices(_look(scene, machine or Machine.known(), progress), without)
    wanted = choices.cheapest(scene.accuracy.target)
    found = _kept(wanted, folder, Store.default() if store is None else store)
    if found is not None:
        decision, complete = wanted, found[1]
    else:
        decision = within_means(choices, wanted, scene.accuracy.target)
        complete = decision.scene()
    check_length(complete, complete.run.time_step or complete.run.filter_width)
    progress("planning", 0.9)
    plan = Plan(
        scene=complete,
        level=decision.level,
        choices=choices_of(decision, complete, "" if found is None else found[2]),
        cost=cost_of(complete, decision.level, machine, kept=found is not None),
        error=decision.error,
        alternatives=_alternatives(choices, decision, machine),
        shares=decision.shares,
        kept=found is not None,
        asked=scene,
        without=without,
    )
    limits = map(str, validity_advice(scene))
    return replace(plan, notes=(*notes_on(plan, wanted, decision, machine), *limits))


def _look(scene: Scene, machine: Machine, progress: Progress) -> Seen:
    surrogate = scene.seat.surrogate(scene.run.duration, scene.reed.face)
    progress("planning", 0.1)
    window = first_look(scene, surrogate.greens)
    finest = FINEST * scene.accuracy.target / STEP_UP / SAFETY
    sensitivity = Sensitivity(
        Bench(scene, surrogate.greens, window), scene.accuracy.measures, finest, exact=surrogate.exact
    )
    return Seen(scene, surrogate, sensitivity, machine)


def _kept(decision: Decision, folder: Path | None, store: Store) -> tuple[Fineness, Scene, str] | None:
    seen, fineness = decision.seen, decision.seat.fineness
    if fineness is None or not seen.scene.seat.is_meshed:
        return None

    def candidates() -> Iterator[tuple[Fineness, Scene]]:
        for finer_one in finer(
            fineness,
            () if is_given(seen.scene, BAND) else BANDS,
            () if is_given(seen.scene, TOLERANCE) else TOLERANCES,
            ERRORS if fineness.mesh else (),
        ):
            yield finer_one, decision.scene(finer_one)

    return kept_seat(candidates(), None if folder is None else folder / "seat.h5", store)


def _alternatives(choices: Choices, decision: Decision, machine: Machine | None) -> tuple[Alternative, ...]:
    """The plans for a target looser and tighter by `STEP_UP`."""
    target = decision.seen.scene.accuracy.target
    found = []
    for other in (STEP_UP * target, target / STEP_UP):
        if other < 1:
            plan = choices.cheapest(other)
            if plan.scene() == decision.scene():
                continue
            found.append(
                Alternative(f"target = {100 * other:.2g} %", cost_of(plan.scene(), plan.level, machine), plan.error)
            )
    return tuple(found)


def refine(plan: Plan, source: Source, factor: float = 2.0, machine: Machine | None = None) -> Plan | None:
    """``plan`` with what is behind ``source`` made finer, so that its share shrinks by about ``factor``.

    A level of modelling that leaves something out gives way to the next; else keys are made finer.

    Args:
        plan: whose run missed the target.
        source: of the error that dominates: mesh, reduction, time_step or model.
        factor: by which its share is too large; taken between 1.6 and 4.

    Returns:
        ``None`` where the file states what is behind the source, or nothing is.
    """
    cheap = plan.level in ("spring", "rod") and not plan.is_given(MODEL)
    if source == "model" and cheap and plan.asked is not None:
        return plan_scene(plan.asked, machine, without=(*plan.without, plan.level))
    return finer_keys(plan, source, factor, machine)
