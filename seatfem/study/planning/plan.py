"""A plan: how a scene is to be computed, with reasons, predicted cost and predicted errors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from seatfem.structures.method import AnyLevel
from seatfem.study.impacts.touches import Source
from seatfem.study.method import RunMethod
from seatfem.study.scene import Scene


@dataclass(frozen=True)
class Choice:
    """The choice of one key of the scene.

    Attributes:
        key: dotted key, as in the file.
        value: value with its unit.
        reason: reason in words, with numbers.
        given: whether the file states the value.
        leaves: largest relative error of a judged measure by this value, in words; "" if unknown.
    """

    key: str
    value: str
    reason: str
    given: bool
    leaves: str = ""


@dataclass(frozen=True)
class Cost:
    """Predicted cost of a run.

    Attributes:
        seconds: wall time of the whole run [s].
        memory: peak memory of the process [bytes].
        parts: wall time by stage [s], which adds up to ``seconds``.
    """

    seconds: float
    memory: float
    parts: Mapping[str, float] = field(default_factory=dict)

    def after(self, stage: str, seconds: float) -> Cost:
        """Return the cost with another stage of ``seconds`` before it, if they are not zero."""
        if not seconds:
            return self
        return Cost(self.seconds + seconds, self.memory, {stage: seconds, **self.parts})


@dataclass(frozen=True)
class Alternative:
    """Another plan for the same scene.

    Attributes:
        what: the key that differs, with its value.
        cost: predicted cost.
        error: predicted relative error of each judged measure.
    """

    what: str
    cost: Cost
    error: Mapping[str, float]


@dataclass(frozen=True)
class Refinement:
    """The refinement of a key from one round to the next.

    Attributes:
        error: largest relative error of a judged measure by the key before.
        factor: factor by which it was to be reduced.
    """

    error: float
    factor: float


@dataclass(frozen=True)
class Plan:
    """A plan says how a scene is to be computed.

    Attributes:
        scene: the scene, as in the file.
        method: method of the run: keys that the file states, and chosen values of the others.
        choices: all keys that matter for cost and error.
        cost: predicted cost.
        error: predicted relative error of each judged measure.
        alternatives: cheaper and more accurate plans.
        shares: predicted relative errors by source, then measure.
        kept: whether the seat's Green's function is reused.
        notes: sentences for the reader, such as on a target out of reach.
        without: levels of the seat, or `ONE_PORT`, that earlier rounds found too coarse.
        parts: predicted relative errors by arcs and rings of a lip, by key, then measure.
        by_rule: whether the loop measures instead: values by rule at first, refined by measured errors.
        refined: refinements of each key so far, in the order of the rounds.
    """

    scene: Scene
    method: RunMethod
    choices: tuple[Choice, ...]
    cost: Cost
    error: Mapping[str, float]
    alternatives: tuple[Alternative, ...] = ()
    shares: Mapping[Source, Mapping[str, float]] = field(default_factory=dict)
    kept: bool = False
    notes: tuple[str, ...] = ()
    without: tuple[str, ...] = ()
    parts: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    by_rule: bool = False
    refined: Mapping[str, tuple[Refinement, ...]] = field(default_factory=dict)

    @property
    def level(self) -> AnyLevel:
        """Return the level of the seat's model; "closed form" if nothing is discretised."""
        return self.method.seat.level

    @property
    def meets_target(self) -> bool:
        """Return whether every measure's predicted error is within the target."""
        return all(error <= self.scene.accuracy.target for error in self.error.values())

    def choice(self, key: str) -> Choice:
        """Return the choice of a key. Raises `KeyError` if the plan has none."""
        for choice in self.choices:
            if choice.key == key:
                return choice
        raise KeyError(key)

    def is_given(self, key: str) -> bool:
        """Return whether the file states the key."""
        return any(choice.key == key and choice.given for choice in self.choices)

    def is_open(self, key: str) -> bool:
        """Return whether the plan has chosen the key."""
        return any(choice.key == key and not choice.given for choice in self.choices)
