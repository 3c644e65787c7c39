"""A plan: how a scene is to be computed, with the reason of each choice and the errors that were measured."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TypeVar

from pydantic import BaseModel

from seatfem.structures.method import AnyLevel
from seatfem.study.method import FIELDS, RunMethod, has_key
from seatfem.study.scene import Scene

_Table = TypeVar("_Table", bound=BaseModel)


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
        scene: the scene, as in the file, but with the stopper's face in the parts of the method.
        method: method of the run: keys that the file states, and chosen values of the others.
        choices: all keys that matter for cost and error.
        error: measured relative error bar of each judged measure; empty before the first round.
        earlier_errors: relative error bars of the judged measures in each of the rounds before.
        refined: refinements of each key so far, in the order of the rounds.
        refused: keys of which a finer value cannot be computed, with the reason.
    """

    scene: Scene
    method: RunMethod
    choices: tuple[Choice, ...]
    error: Mapping[str, float] = field(default_factory=dict)
    earlier_errors: tuple[Mapping[str, float], ...] = ()
    refined: Mapping[str, tuple[Refinement, ...]] = field(default_factory=dict)
    refused: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        stopper, parts = self.scene.stopper, self.method.stopper
        if stopper is not None and parts is not None and stopper.parts != parts:
            scene = self.scene.model_copy(update={"stopper": stopper.divided(parts)})
            object.__setattr__(self, "scene", scene)

    def as_stated(self) -> Scene:
        """Return the scene as if its file stated the method, for functions that take a scene without a method."""
        scene = self.scene
        for key in FIELDS:
            if has_key(scene, key) and (value := self.method.value(key)) is not None:  # a default, too, is stated then
                scene = _with(scene, key.split("."), value)
        return scene

    @property
    def level(self) -> AnyLevel:
        """Return the level of the seat's model; "closed form" if nothing is discretised."""
        return self.method.seat.level

    def choice(self, key: str) -> Choice:
        """Return the choice of a key. Raises `KeyError` if the plan has none."""
        for choice in self.choices:
            if choice.key == key:
                return choice
        raise KeyError(key)

    def changes_since(self, before: Plan) -> str:
        """Return in words the keys whose values differ from those of a plan before, with both values."""
        values = {choice.key: choice.value for choice in before.choices}
        return ", ".join(
            f"{choice.key} {values[choice.key]} -> {choice.value}"
            for choice in self.choices
            if values.get(choice.key, choice.value) != choice.value
        )

    def is_given(self, key: str) -> bool:
        """Return whether the file states the key."""
        return any(choice.key == key and choice.given for choice in self.choices)

    def is_open(self, key: str) -> bool:
        """Return whether the plan has chosen the key."""
        return any(choice.key == key and not choice.given for choice in self.choices)


def _with(table: _Table, path: list[str], value: object) -> _Table:
    name, *rest = path
    return table.model_copy(update={name: _with(getattr(table, name), rest, value) if rest else value})
