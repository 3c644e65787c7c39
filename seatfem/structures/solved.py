"""A structure that is computed: its Green's function, and what is known of how it came about."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from impact.greens.base import GreensFunction
from seatfem.structures.method import COARSENING

if TYPE_CHECKING:
    from seatfem.structures.mesh.meridian import MeridianMesh
    from seatfem.structures.mesh.seat_mesh import SeatMesh
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
