"""The seat as a spring, and what the cheaper descriptions of a seat leave out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from impact.greens import ErrorEstimate, GreensFunction
from impact.modal import ModalGreens, Residual
from seatfem.scene import BarSeat, Scene
from seatfem.seats.rods import love_rod

START: Final = "initial_value"
"""Key of a spring's provenance: g(0+) of the seat [m/(N s)], which the spring has not."""


def without_waves(greens: ModalGreens) -> ModalGreens:
    """The same with its static compliance in place of all waves."""
    compliance, start = float(greens.static_compliance()[0, 0]), float(greens.initial_value()[0, 0])
    return replace(spring_of(compliance, start, greens.port_names, greens.origin), error=greens.error)


def beyond_level(scene: Scene, greens: GreensFunction) -> GreensFunction | None:
    """What a cheap description of the seat leaves out, to first order: a seat that has it; ``None``: nothing is known.

    A spring has no g(0+): beside it stands the exponential of the same compliance that has. A bar as a rod has no
    lateral inertia: beside it stands Love's rod.
    """
    modal = greens.modal
    if modal is not None and isinstance(start := modal.provenance.get(START), float) and start > 0:
        rest = Residual.exponential(modal.static_compliance(), [[start]])
        return replace(modal, residual=rest)
    if isinstance(scene.seat, BarSeat) and scene.seat.model == "rod":
        return love_rod(scene.seat)
    return None


def spring_of(compliance: float, start: float, names: tuple[str, ...], origin: Mapping[str, object]) -> ModalGreens:
    """A compliance [m/N] that remembers the seat's g(0+), ``start`` [m/(N s)]."""
    none = np.zeros(0)
    return ModalGreens(
        none,
        none,
        np.zeros((0, 1)),
        Residual.spring(compliance),
        names,
        ErrorEstimate(reduction=0.0),
        {**origin, START: start},
    )
