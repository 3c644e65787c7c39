"""The ladder of a key: its values from coarse to fine, and the neighbours of a run or a plan on it.

A key that has a finer value leaves an error. What that is, a neighbour tells: the same scene with another value of this
one key. Five questions are asked of it, by the error budget of a run, by the plan, by the next round, by the measured
trade, and by references that must be finer in every key. A key that is declared in `seatfem.study.ladders.table`
answers all of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final, Literal

import impact
from impact.greens.base import GreensFunction
from impact.march.problem import ContactProblem
from impact.quantities import percent
from impact.runs.variations import Terms, Variation, of_g, with_body
from seatfem.structures.estimates.costs import SeatModel
from seatfem.structures.kinds import Structure
from seatfem.structures.method import Method, Solved
from seatfem.structures.rings import Division
from seatfem.study.impacts import touches
from seatfem.study.impacts.bodies import problem_of, solved_stopper, striker_of
from seatfem.study.method import RunMethod
from seatfem.study.prerun.context import PlanningContext
from seatfem.study.prerun.sensitivity import Changes
from seatfem.study.scene import Run, Scene

RATIO: Final = 1.6  # between neighbouring values in a trade

Role = Literal["seat", "reed", "stopper"]


def large_percent(value: float) -> str:
    """Return a share in percent, whole ones from 1 on."""
    return percent(value) if value < 1 else f"{100 * value:,.0f} %"


@dataclass(frozen=True)
class ComputedRun:
    """A run whose errors are asked for.

    Attributes:
        scene, method: what was computed, and how.
        seat: the struck body.
        problem: that was marched.
        reed: the striker, where it was computed.
    """

    scene: Scene
    method: RunMethod
    seat: Solved
    problem: ContactProblem
    reed: Solved | None = None

    def solved(self, role: Role) -> Solved | None:
        """Return a body that was computed; ``None`` for a closed form, and for one that is not there."""
        if role == "seat":
            return self.seat
        if role == "reed":
            return self.reed
        return None if self.body("stopper") is None else solved_stopper(self.scene.geometry, self.scene.run.duration)

    def body(self, role: Role) -> impact.Body | None:
        """Return a body of the march; ``None`` for a stopper that is not there."""
        if role == "seat":
            return self.problem.target
        return self.problem.striker if role == "reed" else touches.stopper_in(self.problem)

    @property
    def division(self) -> Division:
        """Return the parts of the seat's patch."""
        return Division.from_greens(self.seat.greens)

    def with_greens(self, role: Role, greens: GreensFunction, weight: float = 1.0) -> Variation:
        """Return the run with another Green's function of one of its bodies."""
        stopper = self.body("stopper")
        if role == "seat":
            return Variation(problem_of(self.scene, self.problem.striker, impact.Body(greens), stopper), weight)
        if role == "reed":
            return self.with_body("reed", striker_of(self.scene, greens=greens), weight)
        assert stopper is not None
        return self.with_body("stopper", replace(stopper, greens=greens), weight)

    def with_body(self, role: Role, other: impact.Body, weight: float = 1.0) -> Variation:
        """Return the run with another body in place of one of its bodies."""
        body = self.body(role)
        assert body is not None
        return Variation(with_body(self.problem, body, other), weight)

    def with_larger_g(self, role: Role, error: float | None) -> Terms | None:
        """Return the run with a body's g larger by a relative error; ``None`` where the error is unknown."""
        body = self.body(role)
        assert body is not None
        return of_g(self.problem, body, error)


@dataclass(frozen=True)
class Elements:
    """Finite elements of a seat that a plan may choose.

    Attributes:
        error: of g, that the mesh is made for; 0 of a mesh that is there.
        model: in numbers, for the loosest tolerance that a plan chooses; ``None`` of matrices whose size is not known.
        coarser: behind the mesh error; ``None`` where there is none.
        tolerance: of ``model``.
    """

    error: float
    model: SeatModel | None
    coarser: SeatModel | None
    tolerance: float


@dataclass(frozen=True)
class Option:
    """A way to compute a scene, or the part of it that the ladders up to here decide.

    Attributes:
        method: how.
        changes: by key, the relative error left in each measure.
        why: the level of the seat, in words.
        seconds, memory: predicted [s, bytes].
        poles: of the seat's Green's function, each of which costs a march ``per_pole`` [s].
        elements: of a seat that is meshed or assembled; ``None`` of others.
    """

    method: RunMethod
    changes: Mapping[str, Changes] = field(default_factory=dict)
    why: str = ""
    seconds: float = 0.0
    memory: float = 0.0
    poles: float = 0.0
    per_pole: float = 0.0
    elements: Elements | None = None

    def with_seat(self, changes: Mapping[str, Changes], values: Mapping[str, Any], **costs: Any) -> Option:
        """Return the option with other ``values`` of the seat's method, which leave these ``changes``; and ``costs``:
        other attributes of its own."""
        method = replace(self.method, seat=replace(self.method.seat, **values))
        return replace(self, method=method, changes={**self.changes, **changes}, **costs)

    @property
    def seat(self) -> Method:
        """Return how the seat is computed."""
        return self.method.seat


@dataclass(frozen=True)
class Neighbour:
    """A point of the measured trade beside its centre.

    Attributes:
        name: unique in the trade.
        varied: what is changed, in words.
        values: of dotted keys, SI.
        in_place: of the contact along a lip, a simpler model by its name.
    """

    name: str
    varied: str
    values: Mapping[str, object] = field(default_factory=dict)
    in_place: str = ""


@dataclass(frozen=True)
class Ladder:
    """A key with values from coarse to fine; each kind of ladder answers what it can of the five questions.

    Attributes:
        key: dotted, as in the scene, or the name of a model that stands for a choice.
        source: of the error budget, which its error belongs to.
        part: of a source that is a whole body, which part of its error; what is not known is named by it.
        also: further keys whose error the same neighbour tells.
        falls: whether finer values are smaller.
        of_seat: whether it decides the seat of a plan, or the march.
    """

    key: str
    source: touches.Source
    part: str = ""
    also: tuple[str, ...] = ()
    falls: bool = False
    of_seat: bool = True

    def describe(self, value: Any) -> str:
        """Return a value in words, with its unit."""
        return str(value)

    def finer(self, value: Any, factor: float, run: Run, reed: Structure) -> Any:
        """Return a finer value, which leaves an error smaller by about ``factor``; ``None`` where no round changes it:
        a model gives way to another plan. ``reed``: what strikes in the ``run`` that is asked for."""
        return None

    def applies(self, run: ComputedRun) -> bool:
        """Return whether a run has this key, or can err by it at all."""
        return True

    def neighbours(self, run: ComputedRun) -> Terms | None:
        """Return the runs whose changes tell what the key's value leaves in the measures of ``run``: terms add up, of
        the variations within one the largest counts; ``None`` where it is not known."""
        return ()

    def extend(self, context: PlanningContext, option: Option) -> Iterable[Option]:
        """Yield ``option`` with each value of the key that a plan may choose, with what it leaves and costs."""
        return (option,)

    def beside(self, run: Run, reed: Structure, centre: RunMethod) -> Iterator[Neighbour]:
        """Yield the points of the measured trade with other values of the key than its ``centre``, of a ``run`` with
        this ``reed``."""
        return iter(())


@dataclass(frozen=True)
class BodyLadder(Ladder):
    """A ladder of one of the bodies, which computed bodies have and others have not."""

    role: Role = "seat"

    def applies(self, run: ComputedRun) -> bool:
        """Return whether the body was computed."""
        return run.solved(self.role) is not None
