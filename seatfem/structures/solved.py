"""A structure that is computed: its Green's function and how it came about; a body as a spring."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Final

import numpy as np

from impact.greens.base import Array, ErrorEstimate, GreensFunction
from impact.greens.modal import ModalGreens, Residual
from seatfem.structures.method import COARSENING
from seatfem.structures.rings import Division, as_a_whole

if TYPE_CHECKING:
    from seatfem.structures.mesh.meridian import MeridianMesh
    from seatfem.structures.mesh.meshing import SeatMesh
    from seatfem.structures.model import SecondOrderModel
    from seatfem.structures.reduction.modes import Modes


@dataclass(frozen=True)
class Solved:
    """A structure's Green's function and, where finite elements made it, the mesh and modes behind it.

    Attributes:
        greens: its Green's function.
        coarser: the same on a mesh coarser by `COARSENING`, in truth by ``refinement``.
        mesh, model, modes: behind it; ``None`` where there are none, or it was computed before.
        about: numbers and words for the summary.
        level_error: relative, of the level of modelling itself.
        refinement: ratio of the element sizes of the two meshes.
        in_rings: a model whose patch is in `rings_behind` rings, on the coarser mesh where there is one.
        plane: the patch moves as a plane, whatever presses it.
        reused: it was computed before.
    """

    greens: GreensFunction
    coarser: GreensFunction | None = None
    mesh: SeatMesh | MeridianMesh | None = None
    model: SecondOrderModel | None = None
    modes: Modes | None = None
    about: Mapping[str, object] = field(default_factory=dict)
    level_error: float = 0.0
    refinement: float = COARSENING
    in_rings: GreensFunction | None = None
    plane: bool = False
    reused: bool = False


START: Final = "initial_value"
"""Key of a spring's provenance: g(0+) of the whole patch [m/(N s)], which the spring has not."""


def without_waves(greens: ModalGreens) -> ModalGreens:
    """Return the same with its static compliance in place of all waves."""
    start = float(as_a_whole(greens).initial_value()[0, 0])
    return replace(spring_of(greens.static_compliance(), start, greens.port_names, greens.origin), error=greens.error)


def with_start(greens: GreensFunction) -> GreensFunction | None:
    """Return a spring as the exponential of the same compliance that has a g(0+); ``None`` of what is no spring."""
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
