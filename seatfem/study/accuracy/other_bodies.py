"""Errors that a computed striker, and a stopper, leave in the measures of a run."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from impact.bodies.body import Body
from impact.greens.base import GreensFunction
from impact.march.problem import ContactProblem
from impact.runs.variations import Terms, Variation, narrower, of_g, ringing_on, with_body
from seatfem.structures.rings import OF_TWICE, Division, divided_less, face_compliance, left_by, parts_behind
from seatfem.structures.solved import bed
from seatfem.study.impacts.contact import problem_of, solved_stopper, solved_striker, striker_of
from seatfem.study.impacts.touches import stopper_in
from seatfem.study.method import RunMethod
from seatfem.study.safety import BEYOND, FEW, FEWER, HALF, MANY, OF_MODES, UNEVEN
from seatfem.study.scene import Scene
from seatfem.study.scene.lips import behind_the_reed

if TYPE_CHECKING:
    from seatfem.structures.solved import Solved

Parts = Mapping[str, Terms | None]
"""By name, what is not known to be exact in a body; ``None``: it is unknown."""


def of_striker(scene: Scene, reed: Solved | None, problem: ContactProblem) -> Parts | None:
    """Return the errors that a computed striker leaves; ``None`` for others."""
    if reed is None:
        return None
    modes = scene.reed.thin_plate is not None
    return _of_solved(problem, problem.striker, reed, lambda greens: striker_of(scene, greens=greens), modes=modes)


def of_stopper(scene: Scene, method: RunMethod, problem: ContactProblem) -> Parts | None:
    """Return the errors of a computed stopper, of a beam's modes, and of its arcs; ``None`` for what is exact."""
    body = stopper_in(problem)
    if scene.stopper is None or body is None:
        return None
    if (solved := solved_stopper(scene)) is not None:
        modes = scene.stopper.body.elastic is not None
        known = _of_solved(problem, body, solved, lambda greens: replace(body, greens=greens), modes=modes)
        return {**known, "patch": _of_parts(scene, method, problem, body, solved)}
    if scene.stopper.parts != Division():
        return {"patch": _of_parts(scene, method, problem, body, None)}
    if (number := scene.stopper.body.stated().n_modes) is None:
        return None
    less = ((scene.stopper.body.body(None, other).greens, weight) for other, weight in other_modes(number))
    return {"modes": (tuple(Variation(with_body(problem, body, replace(body, greens=g)), w) for g, w in less),)}


def _of_parts(
    scene: Scene, method: RunMethod, problem: ContactProblem, body: Body, solved: Solved | None
) -> Terms | None:
    """Return the variation of the parts in which a stopper is met: `_beside` names those that they are compared with;
    ``None`` where the body is not known in these."""
    assert scene.stopper is not None
    division = scene.stopper.parts
    other, weight = _beside(division)
    if solved is None:  # springs side by side, or a body that moves as a whole
        springs = len(body.greens.ports) > 1
        own, other_greens = body.greens, bed(other, 1 / face_compliance(body.greens)) if springs else body.greens
    else:
        models = [each for each in (solved.in_rings, solved.greens) if each is not None]
        model = next((each for each in models if _holds(each, division) and _holds(each, other)), None)
        if model is None:
            return () if solved.plane else None
        own, other_greens = divided_less(model, division), divided_less(model, other)
    stopper = scene.stopper.model_copy(update={"arcs": other.arcs, "rings": other.rings})
    changed, striker = scene.model_copy(update={"stopper": stopper}), problem.striker
    if scene.reed.thin_plate is not None and (lip := behind_the_reed(scene)) is not None:
        how = replace(method.reed, behind=replace(lip, arcs=other.arcs, rings=other.rings))  # type: ignore[type-var]
        reed = solved_striker(changed, method=how, mesh_error=False)
        striker = striker_of(changed, greens=None if reed is None else reed.greens)
    same = problem if own is body.greens else with_body(problem, body, replace(body, greens=own))
    varied = problem_of(changed, striker, problem.target, replace(body, greens=other_greens))
    return ((Variation(varied, weight, same),),)


def _beside(division: Division) -> tuple[Division, float]:
    """Return the parts that others are compared with, and the share of what they change that is left: twice as many
    arcs, half as many where no more can be; several rings in place of one or two, one in place of more."""
    other = parts_behind(division)
    if division.arcs == 1:
        return (Division(), left_by(division.rings)) if division.rings > 2 else (other, 1 + left_by(other.rings))
    return (Division(division.arcs // 2, division.rings), OF_TWICE - 1) if other == division else (other, OF_TWICE)


def _holds(greens: GreensFunction, division: Division) -> bool:
    """Return whether the parts of a patch make those of a coarser division."""
    known = Division.of(greens)
    return known.arcs % division.arcs == 0 and known.rings % division.rings == 0


def _of_solved(
    problem: ContactProblem, body: Body, solved: Solved, with_greens: Callable[[GreensFunction], Body], *, modes: bool
) -> Parts:
    """Return the errors of mesh, reduction and level; ``modes``: the highest are left out, too."""
    stated = solved.greens.error_estimate
    mesh = of_g(problem, body, stated.mesh)
    if solved.coarser is not None:
        coarser = with_body(problem, body, with_greens(solved.coarser))
        mesh = ((Variation(coarser, 1 / (solved.refinement - 1)),),)
    reduction = of_g(problem, body, stated.reduction)
    if reduction is not None and modes:
        others = (Variation(with_body(problem, body, each), share) for each, share in with_other_modes(body))
        reduction = (*reduction, tuple(others))
    return {"mesh": mesh, "reduction": reduction, "level": of_g(problem, body, solved.level_error)}


def with_other_modes(body: Body) -> Iterator[tuple[Body, float]]:
    """Yield a plate with other modes than its own, and the share of what each changes that is left in a run.

    First without its highest modes, as `OF_MODES` says. These tell how the next ones go on if the modes that the
    contact feels lie evenly. A ring all around feels few, those that are alike there: where it yields more beyond the
    last mode than by the highest ones, over `UNEVEN`, all that lies beyond may be one mode, at each of `BEYOND`; where
    none can be left out, this alone tells, and counts twice.
    """
    modal = body.greens.modal
    beyond, with_highest = (0.0 if modal is None else float(np.trace(modal.residual.static()))), 0.0
    for ratio, share in OF_MODES:
        if (fewer := narrower(body, ratio)) is not None and fewer.greens.modal is not None:
            with_highest = float(np.trace(fewer.greens.modal.residual.static()))
            yield fewer, share
    if beyond > UNEVEN * (with_highest - beyond):
        for ratio in BEYOND:
            if (ringing := ringing_on(body, ratio)) is not None:
                yield ringing, 1.0 if with_highest else 2.0


def other_modes(n_modes: int) -> tuple[tuple[int, float], ...]:
    """Return the numbers of reed modes to compare ``n_modes`` with, and how much of each change is left in it."""
    less = ((max(1, round(n_modes / FEWER)), 1.0), (max(1, round(n_modes / HALF)), 1 / 2))
    more = ((MANY, 1.0),) if n_modes < FEW else ()
    return tuple((number, weight) for number, weight in less + more if number != n_modes)
