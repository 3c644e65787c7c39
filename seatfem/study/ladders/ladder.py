"""The ladder of a key: its values from coarse to fine, and the neighbours of a run on it.

A key that has a finer value causes an error, which is estimated from a neighbour: the same scene with another value of
this one key. The error budget of a run, the next round, and the measured trade, whose references are finer in
every key, all take these values from the key's ladder in `seatfem.study.ladders.table`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Literal

import impact
from impact.greens.base import GreensFunction
from impact.march.problem import ContactProblem
from impact.notices import Progress, silent
from impact.runs.variations import Terms, Variation, vary_greens, with_body
from seatfem.structures.method import Solved
from seatfem.structures.patch import Patch
from seatfem.structures.rings import Division
from seatfem.study.impacts import touches
from seatfem.study.impacts.bodies import problem_of, solved_stopper, striker_of
from seatfem.study.method import FIELDS, RunMethod
from seatfem.study.plan import Plan
from seatfem.study.scene import Scene
from seatfem.units import write_quantity

Role = Literal["seat", "reed", "stopper"]


@dataclass(frozen=True)
class ComputedRun:
    """A run whose errors are to be estimated.

    Attributes:
        scene, method: the scene, and how it was computed.
        seat: the solved seat.
        striker: the striker's Green's function and motion without contact.
        reed: the solved striker, if it is not in closed form.
        progress: receives the progress of what is solved for a comparison.
    """

    scene: Scene
    method: RunMethod
    seat: Solved
    striker: impact.Body
    reed: Solved | None = None
    progress: Progress = silent

    @cached_property
    def problem(self) -> ContactProblem:
        """Return the contact problem of the run."""
        return problem_of(self.scene, self.striker, impact.Body(self.seat.greens))

    @cached_property
    def bodies(self) -> Mapping[Role, impact.Body]:
        """Return the bodies of the contact problem by role."""
        known: dict[Role, impact.Body] = {"seat": self.problem.target, "reed": self.problem.striker}
        stopper = touches.stopper_in(self.problem)
        return known if stopper is None else {**known, "stopper": stopper}

    @cached_property
    def solved(self) -> Mapping[Role, Solved]:
        """Return what was solved of the bodies that are not in closed form, by role."""
        stopper = solved_stopper(self.scene.geometry, self.scene.run.duration) if "stopper" in self.bodies else None
        known: dict[Role, Solved | None] = {"seat": self.seat, "reed": self.reed, "stopper": stopper}
        return {role: solved for role, solved in known.items() if solved is not None}

    @property
    def division(self) -> Division:
        """Return the division of the seat's patch into parts."""
        return Division.from_greens(self.seat.greens)

    def with_greens(self, role: Role, greens: GreensFunction, weight: float = 1.0) -> Variation:
        """Return the run with another Green's function of one of its bodies."""
        if role == "seat":
            bodies = self.problem.striker, impact.Body(greens), self.bodies.get("stopper")
            return Variation(problem_of(self.scene, *bodies), weight)
        if role == "reed":
            return self.with_body("reed", striker_of(self.scene, greens=greens), weight)
        return self.with_body("stopper", replace(self.bodies["stopper"], greens=greens), weight)

    def with_body(self, role: Role, other: impact.Body, weight: float = 1.0) -> Variation:
        """Return the run with another body in place of one of its bodies."""
        return Variation(with_body(self.problem, self.bodies[role], other), weight)

    def with_larger_g(self, role: Role, error: float | None) -> Terms:
        """Return the run with a body's g larger by a relative error, which may be unknown."""
        return vary_greens(self.problem, self.bodies[role], error)


@dataclass(frozen=True)
class Beginning:
    """A beginning holds what is known of a scene before anything is computed.

    Attributes:
        scene: the scene.
        is_reduced: whether the seat's matrices are reduced, which needs a band and a tolerance.
        patch: struck patch of a seat of finite elements; ``None`` if it is not known, or there are no elements.
    """

    scene: Scene
    is_reduced: bool
    patch: Patch | None = None


@dataclass(frozen=True)
class Ladder:
    """A key with values from coarse to fine; subclasses override the methods that apply to them.

    Attributes:
        key: dotted key of the scene, or the name of a model.
        source: source of the error budget to which its error belongs.
        part: part of the error of a source that is a whole body; it names errors that are unknown.
        also: further keys whose error the same neighbour estimates.
        effort: power of the error, inverted, with which the work grows: work exponent over order of convergence.
        rule: the rule of the first value, in words.
        remedy: how the error becomes smaller, in words, with "{key}", or "{table}" of the key, for what is stated.
        dimension: dimension of the value; "" without one.
        role: body whose model it refines.
        hidden_by: key whose own error may hide that this one converges, and which is then refined, too; "" without one.
    """

    key: str
    source: touches.Source
    part: str = ""
    also: tuple[str, ...] = ()
    effort: float = 1.0
    rule: str = ""
    dimension: str = ""
    role: Role = "seat"
    remedy: str = ""
    hidden_by: str = ""

    def describe(self, value: Any) -> str:
        """Return a value in words, with its unit."""
        return write_quantity(value, self.dimension, 3) if self.dimension else str(value)

    def finer(self, value: Any, factor: float) -> Any:
        """Return a finer value, whose error is smaller by about ``factor``; the same if rounds change no such key."""
        return value

    def begin(self, known: Beginning, method: RunMethod) -> RunMethod:
        """Return the method with the key's first, coarse value by rule; keys that the file states are kept."""
        return method

    def refine(self, plan: Plan, factor: float) -> RunMethod:
        """Return the method of a plan with a finer value, whose error is smaller by about ``factor``; the same if the
        file states the key, or it is at its limit."""
        method = plan.method
        if self.key not in FIELDS or self.key in method.given or not (value := method.value(self.key)):
            return method
        return method.replaced({self.key: self.finer(value, factor)})

    def applies(self, run: ComputedRun) -> bool:
        """Return whether a run has this key and can have an error by it: its body is solved, not in closed form."""
        return self.role in run.solved

    def neighbours(self, run: ComputedRun) -> Terms:
        """Return the varied runs that estimate the errors by the key's value: terms are combined, and within a
        term the largest change counts; a term without runs if they are unknown."""
        return ()
