"""A scene: its tables, and what follows from several of them."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Final

from pydantic import Field, ValidationInfo, model_validator

from seatfem.fields import Contradictions, Table, absent, default, one_of, read_rpm
from seatfem.structures.kinds import Structure, kinds_of
from seatfem.study.scene.agreement import contradictions_of
from seatfem.study.scene.assembly import Assembly, with_places
from seatfem.study.scene.base import Base
from seatfem.study.scene.contact import Contact
from seatfem.study.scene.external import ExternalLoad
from seatfem.study.scene.gas import CompressorGas
from seatfem.study.scene.life import LifeTable
from seatfem.study.scene.measures import any_needs_stress
from seatfem.study.scene.run import Accuracy, Run
from seatfem.study.scene.spring import ValveSpring
from seatfem.study.scene.stopper import Stopper
from seatfem.study.scene.stress import Stress
from seatfem.units import UnitError

if TYPE_CHECKING:
    Body = Structure
else:
    Body = one_of(kinds_of())  # of those that the program has of its own
BODIES: Final = ("seat", "reed")
"""The roles of every scene: tables that take any kind of structure."""


class Scene(Table):
    """One impact: a reed, a seat, and how long to watch. All values are SI floats."""

    title: str = default("", "for reports and pictures")
    seat: Body = Field(description="what is struck")
    reed: Body = Field(description="what strikes")
    assembly: Assembly | None = absent("how two parts from CAD come together; by [contact] if absent")
    contact: Contact = default({}, "where and how the two touch")
    stopper: Stopper | None = absent("a second body, which limits the lift")
    load: tuple[ExternalLoad, ...] = default((), "known loads on the reed, a table each: [[load]]")
    spring: tuple[ValveSpring, ...] = default((), "valve springs on the reed, a table each: [[spring]]")
    base: tuple[Base, ...] = default((), "what moves the bases of bodies, a table each: [[base]]")
    gas: CompressorGas | None = absent("the gas that the reed, as a valve, lets through")
    run: Run = Field(description="what is simulated")
    accuracy: Accuracy = default({}, "the accuracy asked for")
    life: LifeTable | None = absent("fatigue life asked for; not computed where absent")
    stress: Stress | None = absent("stress in the seat; not computed where absent")

    @property
    def needs_stress(self) -> bool:
        """Return whether the reed's stress is asked for while it strikes, by a measure or for its life."""
        for_life = self.life is not None and self.life.demand() is not None and self.reed.traits.has_stress
        return any_needs_stress(self.accuracy.measures) or for_life

    @model_validator(mode="before")
    @classmethod
    def _places_as_drawn(cls, given: object, info: ValidationInfo) -> object:
        """Return the scene with what the files of [assembly] give; what is wrong with its key is reported there."""
        context = info.context or {}
        if not isinstance(given, Mapping) or given.get("assembly") != {"placed": "as drawn"}:
            return given
        return with_places(given, context.get("folder", Path()), unread=bool(context.get("unread")))

    @model_validator(mode="before")
    @classmethod
    def _duration_of_the_cycles(cls, given: object) -> object:
        """Return gas.cycles in place of run.duration; what is wrong with either is reported where it is read."""
        gas = given.get("gas") if isinstance(given, Mapping) else None
        if not isinstance(given, Mapping) or not isinstance(gas, Mapping) or "cycles" not in gas:
            return given
        turns, rpm, run = gas["cycles"], gas.get("rpm"), given.get("run", {})
        with suppress(UnitError):
            rpm = read_rpm(rpm)
        plain = all(isinstance(number, int | float) and number > 0 for number in (turns, rpm))
        if not plain or not isinstance(run, Mapping) or "duration" in run:
            return given
        return {**given, "run": {**run, "duration": f"{60 * turns / rpm!r} s"}}

    @property
    def bodies(self) -> Mapping[str, Structure]:
        """Return the bodies that take part, by the names of their tables."""
        bodies = {"seat": self.seat, "reed": self.reed}
        return bodies if self.stopper is None else {**bodies, "stopper": self.stopper.body}

    @property
    def contact_at(self) -> float | tuple[float, float] | None:
        """Return where on the reed the contacts lie [m]: the seat's, and the stopper's where that is another place."""
        at = self.contact.at
        if self.stopper is None or self.stopper.at is None:
            return at
        place = self.reed.free_point if at is None else at
        assert place is not None
        return at if self.stopper.at == place else (place, self.stopper.at)

    @property
    def has_two_places(self) -> bool:
        """Return whether seat and stopper meet the reed at different places: the second is a port of its own."""
        return isinstance(self.contact_at, tuple)

    @property
    def stopper_gap(self) -> float:
        """Return the distance from the undeformed reed to the stopper, or its stated lift - contact.gap [m]."""
        assert self.stopper is not None
        if self.stopper.lift is not None:
            return self.stopper.lift - self.contact.gap
        assert self.stopper.gap is not None
        return self.stopper.gap

    def base_of(self, role: str) -> Base | None:
        """Return what moves the base of the body in this role; ``None``: it rests."""
        return next((base for base in self.base if base.of == role), None)

    @property
    def is_loaded(self) -> bool:
        """Return whether known forces drive the reed, or gas or springs do, or bases move."""
        return bool(self.load or self.base or self.spring) or self.gas is not None or self.reed.is_loaded

    @property
    def is_blown_by_lift(self) -> bool:
        """Return whether any load depends on how far the reed is off its seat."""
        return self.gas is not None or any(load.by_lift for load in self.load)

    def contradictions(self) -> Contradictions:
        return contradictions_of(self)
