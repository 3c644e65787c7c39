"""The `RunMethod` of a scene: how all its bodies and the march are computed; the loop chooses it, round by round.

A method has a value for each of `FIELDS`, the keys of a scene that concern the numerical method and not the problem.
Values that the file states are never changed; values that it leaves open are chosen by the loop.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

from pydantic import BaseModel

from seatfem.structures.method import AnyLevel, Method
from seatfem.structures.rings import Division
from seatfem.study.scene import ContactGeometry, Scene
from seatfem.study.scene.problems import rewrite_errors

MODEL, REDUCTION = "seat.model", "seat.greens.method"
SIZE, CONTACT_SIZE, ORDER = "seat.mesh.size", "seat.mesh.contact_size", "seat.mesh.order"
BAND, TOLERANCE = "seat.greens.bandwidth", "seat.greens.tolerance"
MODES, STEP, RINGS = "reed.n_modes", "run.time_step", "contact.rings"
PORTS: Final = "contact.ports"
REED_BAND: Final = "reed.greens.bandwidth"
REED_TOLERANCE: Final = "reed.greens.tolerance"
REED_SIZE, REED_CONTACT_SIZE = "reed.mesh.size", "reed.mesh.contact_size"
SEAT_MODES: Final = "seat.n_modes"
STOPPER_ARCS, STOPPER_RINGS = "stopper.arcs", "stopper.rings"
FIELDS: Final[Mapping[str, tuple[str, ...]]] = {
    MODEL: ("seat", "level"),
    SIZE: ("seat", "size"),
    CONTACT_SIZE: ("seat", "contact_size"),
    ORDER: ("seat", "order"),
    BAND: ("seat", "bandwidth"),
    TOLERANCE: ("seat", "tolerance"),
    REDUCTION: ("seat", "reduction"),
    SEAT_MODES: ("seat", "n_modes"),
    MODES: ("reed", "n_modes"),
    STEP: ("time_step",),
    RINGS: ("seat", "rings"),
    PORTS: ("ports",),
    REED_BAND: ("reed", "bandwidth"),
    REED_TOLERANCE: ("reed", "tolerance"),
    REED_SIZE: ("reed", "size"),
    REED_CONTACT_SIZE: ("reed", "contact_size"),
    STOPPER_ARCS: ("stopper", "arcs"),
    STOPPER_RINGS: ("stopper", "rings"),
}
"""Attribute path in `RunMethod` of each dotted key of a scene that the loop may choose."""
LEVEL_SHARE: Final = 4  # target over the error that a level of the seat may have without the loop
_UNITS: Final = {
    **dict.fromkeys((SIZE, CONTACT_SIZE, REED_SIZE, REED_CONTACT_SIZE), "m"),
    **dict.fromkeys((BAND, REED_BAND), "Hz"),
    STEP: "s",
}


@dataclass(frozen=True)
class RunMethod:
    """Models, meshes and steps by which one impact is computed.

    Attributes:
        seat, reed: the struck body and the striker.
        time_step: time step [s]; ``None``: from the highest rates of both bodies and the filter.
        given: keys of `FIELDS` that the file states, which no round changes.
        stopper: the parts of the stopper's face; ``None`` without a stopper.

    The lip along which seat and reed touch is part of both of their methods.
    """

    seat: Method
    reed: Method
    time_step: float | None = None
    given: frozenset[str] = field(default=frozenset(), compare=False)
    stopper: Division | None = None

    @property
    def contacts(self) -> int:
        """Return the number of contacts with seat and stopper."""
        return self.seat.division.count + (0 if self.stopper is None else self.stopper.count)

    @property
    def ports(self) -> int | None:
        """Return the number of arcs of the seat's lip; ``None`` where it is struck as a whole."""
        return None if self.seat.lip is None else self.seat.lip.arcs

    def along(self, geometry: ContactGeometry, ports: int | None, rings: int | None = None) -> RunMethod:
        """Return the method with the lip in ``ports`` arcs and ``rings`` rings, by default as stated; with a lip in
        arcs, a seat by sectors becomes a full 3-D one."""
        lip = geometry.lip(ports, rings)
        rings = self.seat.rings if lip is None else lip.rings
        level: AnyLevel = "3d" if lip is not None and self.seat.level == "sector" else self.seat.level
        seat = replace(self.seat, level=level, lip=lip, rings=rings)
        return replace(self, seat=seat, reed=replace(self.reed, lip=geometry.place_on_reed(lip)))

    def stopped(self, geometry: ContactGeometry, division: Division | None) -> RunMethod:
        """Return the method with the stopper's face in other parts, which the reed meets."""
        behind = geometry.with_stopper_in(division).place_behind_reed()
        return replace(self, stopper=division, reed=replace(self.reed, behind=behind))

    def value(self, key: str) -> Any:
        """Return the value of a dotted ``key`` of `FIELDS`."""
        value: Any = self
        for name in FIELDS[key]:
            value = None if value is None else getattr(value, name)  # of no stopper
        return value

    @property
    def values(self) -> dict[str, Any]:
        """Return the values of all `FIELDS`."""
        return {key: self.value(key) for key in FIELDS}

    def with_values(self, geometry: ContactGeometry, values: Mapping[str, Any]) -> RunMethod:
        """Return the method with other ``values`` of `FIELDS`, a lip in as many arcs and rings as they say."""
        arcs, rings = values.get(PORTS, self.ports), values.get(RINGS, self.seat.rings)
        method = self if arcs is None or rings is None else self.along(geometry, arcs, rings)
        if self.stopper is not None:
            parts = (values.get(key) or self.value(key) for key in (STOPPER_ARCS, STOPPER_RINGS))
            method = method.stopped(geometry, Division(*parts))
        return method.replaced(
            {k: value for k, value in values.items() if k not in (PORTS, STOPPER_ARCS, STOPPER_RINGS)}
        )

    def replaced(self, values: Mapping[str, object]) -> RunMethod:
        """Return the method with other ``values`` at dotted keys of `FIELDS`."""
        method = self
        for key, value in values.items():
            first, *rest = FIELDS[key]
            change: dict[str, Any] = {rest[0]: value} if rest else {first: value}
            method = replace(method, **({first: replace(getattr(method, first), **change)} if rest else change))
        return method


def stated_method(scene: Scene) -> RunMethod:
    """Return the method that the file states, with defaults for open values: the method of a run without the loop.

    An open ``seat.model`` becomes the cheapest level whose own error is below target/`LEVEL_SHARE`.

    Raises `LevelError`: the stated level cannot describe the seat.
    """
    given = stated_keys(scene)
    rings = scene.contact.rings if RINGS in given else None
    with rewrite_errors("reed", scene.reed):
        reed = scene.reed.stated()
    seat = scene.seat.stated(scene.accuracy.target / LEVEL_SHARE, rings)
    method = RunMethod(seat, reed, scene.run.time_step, given).along(scene.geometry, scene.contact.ports)
    return method.stopped(scene.geometry, None if scene.stopper is None else scene.stopper.parts)


def stated_keys(scene: BaseModel) -> frozenset[str]:
    """Return the keys of `FIELDS` that the file states."""
    return frozenset(key for key in FIELDS if is_given(scene, key))


def value_of(scene: BaseModel, key: str) -> Any:
    """Return the value that the file states at a dotted ``key``, or its default."""
    value: Any = scene
    for part in key.split("."):
        value = getattr(value, part)
    return value


def written(key: str, value: object) -> object:
    """Return an SI value of a key of `FIELDS` as it is written in a scene file, such as ``"0.001 m"``."""
    return f"{value!r} {_UNITS[key]}" if key in _UNITS else value


def is_given(scene: BaseModel, key: str) -> bool:
    """Return whether the file states the dotted ``key``; "auto" and an absent value are no statement."""
    if not has_key(scene, key):
        return False
    tables, _, name = key.rpartition(".")
    table = value_of(scene, tables) if tables else scene
    return name in table.model_fields_set and getattr(table, name) not in (None, "auto")


def has_key(scene: BaseModel, key: str) -> bool:
    """Return whether this kind of scene has the dotted ``key``, stated or not."""
    value: Any = scene
    for part in key.split("."):
        if not isinstance(value, BaseModel) or part not in type(value).model_fields:
            return False
        value = getattr(value, part)
    return True
