"""A plan: how a scene is going to be computed, and why."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from seatfem.structures.method import AnyLevel
from seatfem.study.impacts.touches import Source
from seatfem.study.method import RunMethod
from seatfem.study.scene import Scene


@dataclass(frozen=True)
class Choice:
    """One key of the scene, and what became of it.

    Attributes:
        key: dotted, as in the file.
        value: with unit.
        reason: in words, with numbers.
        given: whether the file states it; it is obeyed then.
        leaves: the error that it leaves in the measure asked for that feels it most; "" where none is known.
    """

    key: str
    value: str
    reason: str
    given: bool
    leaves: str = ""


@dataclass(frozen=True)
class Cost:
    """Predicted effort.

    Attributes:
        seconds: wall time of the whole run.
        memory: peak of the process [bytes].
        parts: seconds by stage, adding up to ``seconds``.
    """

    seconds: float
    memory: float
    parts: Mapping[str, float] = field(default_factory=dict)

    def after(self, stage: str, seconds: float) -> Cost:
        """Return the same with another stage before it, if that takes any time."""
        if not seconds:
            return self
        return Cost(self.seconds + seconds, self.memory, {stage: seconds, **self.parts})


@dataclass(frozen=True)
class Alternative:
    """Another plan for the same scene.

    Attributes:
        what: what would be different.
        cost: of it.
        error: predicted relative error of each measure.
    """

    what: str
    cost: Cost
    error: Mapping[str, float]


@dataclass(frozen=True)
class Plan:
    """A run as it is going to be computed.

    Attributes:
        scene: what is asked, as in the file.
        method: how it is computed: what the file states, and what was chosen for the rest.
        choices: every key that matters for cost and error.
        cost: predicted.
        error: predicted relative error of each measure asked for.
        alternatives: cheaper and more accurate plans.
        shares: by source, then measure, the predicted relative error that it leaves.
        kept: whether the seat's Green's function is there already.
        notes: what is worth telling, such as a target out of reach.
        without: levels of the seat, or `ONE_PORT`, that were found too coarse before.
        parts: by key, then measure, what arcs and rings of a lip leave of the patch's share.
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

    @property
    def level(self) -> AnyLevel:
        """Return the model of the seat; "closed form" where nothing is discretised."""
        return self.method.seat.level

    @property
    def meets_target(self) -> bool:
        """Return whether every measure's predicted error is within the target."""
        return all(error <= self.scene.accuracy.target for error in self.error.values())

    def choice(self, key: str) -> Choice:
        """Return the choice of a key. Raises `KeyError` where the plan has none."""
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
