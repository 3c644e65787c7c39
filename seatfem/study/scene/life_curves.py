"""[life] curves: the values of speed, tilt and lift over which a margin is wanted, and the scene at each of them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import TYPE_CHECKING, Final

from seatfem.fields import Angle, Contradictions, Gap, KeyProblem, Speed, Table, default
from seatfem.study.scene.agreement import contradictions_of_start
from seatfem.study.scene.stopper import STEEPEST

if TYPE_CHECKING:
    from seatfem.study.scene.models import Scene

UNITS = {"speed": ("m/s", 1.0), "tilt": ("deg", math.degrees(1.0)), "lift": ("mm", 1e3)}
"""Of each curve in tables and pictures, and how many of them are one SI unit."""


OF_A_CURVE: Final = 4
"""Runs beside the values that the scene names, which look for the value with a margin of 1."""


class Curves(Table):
    """Margins over other values of a key: for each value the contact is run again, at the same method; every other key
    stays. Files margin_over_speed.csv and .png, ...; in summary.json life_allowed_speed_m_per_s, ... is the value with
    a margin of 1, where the curve reaches it."""

    speed: tuple[Speed, ...] = default((), "of the reed at its start, towards the seat, as [1, 2, 4] m/s")
    tilt: tuple[Angle, ...] = default((), "of the reed on the seat's lip: contact.tilt")
    lift: tuple[Gap, ...] = default((), "to the stopper: its gap, or its lift where that is stated")

    def contradictions(self) -> Contradictions:
        curves = {name: getattr(self, name) for name in UNITS if getattr(self, name)}
        if not curves:
            yield "speed", "no curve is asked for: give speed, tilt or lift, or remove the table"
        for name, values in curves.items():
            if len(set(values)) < 2:
                yield name, f"a curve needs two values or more, not {len(set(values))}"

    def asked(self) -> Iterator[tuple[str, tuple[float, ...]]]:
        """Yield names with their values in SI, each once, rising."""
        yield from ((name, tuple(sorted(set(values)))) for name in UNITS if (values := getattr(self, name)))

    @property
    def runs(self) -> tuple[int, int]:
        """Return the number of runs that all curves take, at least and at most."""
        curves = dict(self.asked())
        least = sum(map(len, curves.values()))
        return least, least + OF_A_CURVE * len(curves)

    def check(self, scene: Scene) -> Contradictions:
        """Yield the values that the scene cannot have."""
        for name, value in ((name, value) for name, values in self.asked() for value in values):
            unit, factor = UNITS[name]
            try:
                problems = [words for _, words in contradictions_of_start(varied(scene, name, value))]
            except KeyProblem as problem:
                problems = [str(problem)]
            yield from ((name, f"{value * factor:g} {unit}: {words}") for words in problems)


def varied(scene: Scene, name: str, value: float) -> Scene:
    """Return the scene with another speed [m/s], tilt [rad] or lift [m]. Raises `KeyProblem` if it has no such key."""
    reed, contact, stopper = scene.reed, scene.contact, scene.stopper
    if name == "tilt":
        from seatfem.study.scene.lips import usual_ports  # it reads whole scenes

        if scene.seat.no_lip or reed.thin_plate is None or (contact.ports or usual_ports(scene)) == 1:
            raise KeyProblem("tilt", "contact is not along a lip: state contact.ports, 16 or more, or contact.tilt")
        if abs(value) > STEEPEST:
            raise KeyProblem("tilt", f"it must be at most {math.degrees(STEEPEST):g} deg")
        return scene.model_copy(update={"contact": contact.model_copy(update={"tilt": value})})
    if name == "lift":
        if stopper is None:
            raise KeyProblem("lift", "the scene has no [stopper]; add one")
        key = "gap" if stopper.lift is None else "lift"
        return scene.model_copy(update={"stopper": stopper.model_copy(update={key: value})})
    release = getattr(reed, "release", None)
    if getattr(reed, "velocity", None) is not None:
        return scene.model_copy(update={"reed": reed.model_copy(update={"velocity": -abs(value)})})
    if getattr(release, "velocity", None) is not None:
        thrown = release.model_copy(update={"velocity": -abs(value)})  # type: ignore[union-attr]
        return scene.model_copy(update={"reed": reed.model_copy(update={"release": thrown})})
    raise KeyProblem("speed", "the reed does not start with a velocity: state one, or run over loads instead")
