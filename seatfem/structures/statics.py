"""A body as a spring, and what that leaves out."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from impact.greens.base import Array, ErrorEstimate, GreensFunction
from impact.greens.modal import ModalGreens, Residual
from seatfem.structures.rings import Division, as_a_whole

START: Final = "initial_value"
"""Key of a spring's provenance: g(0+) of the whole patch [m/(N s)], which the spring has not."""


def without_waves(greens: ModalGreens) -> ModalGreens:
    """Return the same with its static compliance in place of all waves."""
    start = float(as_a_whole(greens).initial_value()[0, 0])
    return replace(spring_of(greens.static_compliance(), start, greens.port_names, greens.origin), error=greens.error)


def with_start(greens: GreensFunction) -> GreensFunction | None:
    """Return a spring, which has no g(0+), as the exponential of the same compliance that has; ``None`` of what is
    none."""
    modal = greens.modal
    if modal is None or not isinstance(start := modal.provenance.get(START), float) or start <= 0:
        return None
    rest = Residual.exponential(modal.static_compliance(), np.diag(start / Division.of(modal).shares))
    return replace(modal, residual=rest)


def at_once(greens: GreensFunction) -> ModalGreens:
    """Return a body in arcs with its static compliance in place of all waves, which begins as it does."""
    rest = Residual.exponential(greens.static_compliance(), np.diag(np.diag(greens.initial_value())))
    none = np.zeros(0)
    return ModalGreens(none, none, np.zeros((0, len(greens.ports))), rest, greens.ports)


def bed(division: Division, stiffness: float) -> ModalGreens:
    """Return springs of the total ``stiffness`` [N/m] under the parts of a patch, which do not know of each other."""
    return spring_of(np.diag(1 / (stiffness * division.shares)), 0.0, division.names, {"kind": "bed of springs"})


def spring_of(compliance: Array, start: float, names: tuple[str, ...], origin: Mapping[str, object]) -> ModalGreens:
    """Return a compliance (p, p) [m/N] that remembers g(0+) of the whole patch, ``start`` [m/(N s)]."""
    none = np.zeros(0)
    return ModalGreens(
        none,
        none,
        np.zeros((0, len(names))),
        Residual.spring((compliance + compliance.T) / 2),
        names,
        ErrorEstimate(reduction=0.0),
        {**origin, START: start},
    )
