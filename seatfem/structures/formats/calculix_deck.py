"""Decks for CalculiX (ccx): a model's very mesh, materials, supports and struck patch, and the steps that load them.

A reference node stands for the struck patch: an *EQUATION makes one of its components the patch's area-averaged normal
displacement b'u, and so spreads a *CLOAD on it over the patch as the consistent nodal forces b F (Dhondt, The Finite
Element Method for Three-Dimensional Thermomechanical Applications, Wiley 2004; manual of ccx 2.20).
No deck has damping.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from skfem.assembly import Dofs

from impact.greens.pulse import hann
from seatfem.structures.formats.calculix_mesh import (
    KINDS,
    as_set,
    cut,
    faces_of,
    held_of,
    loads_of,
    materials_of,
    oriented,
)
from seatfem.structures.materials import Solid
from seatfem.structures.model import Array, ModelError, SecondOrderModel

PATCH: Final = "PATCH"  # the set of the reference node
FLAT: Final = 1e-6  # of a patch's width: by as much its vertices may differ in height


@dataclass(frozen=True, eq=False)
class CalculixBody:
    """A body in a deck.

    Attributes:
        element: its type.
        lines: nodes, elements, sets, materials, supports, the patch's surface (STRUCK) and its node.
        axis: component of the reference node that is the patch's mean normal displacement, 1 to 3.
        node: number of the reference node, the highest of the deck.
        cells: number of elements.
        loads: (nodes, 3) b, the nodal forces of a unit load on the patch; rows are the nodes of the deck.
        share: of the whole body's load that what is modelled bears: 1/4 of a quarter.
        patch: (n, 3) places of the patch's vertices [m].
    """

    element: str
    lines: tuple[str, ...]
    axis: int
    node: int
    cells: int
    loads: Array
    share: float
    patch: Array

    @property
    def plane(self) -> bool:
        """Return whether it is the half section of a body of revolution."""
        return self.element.startswith("CAX")

    @property
    def flat(self) -> bool:
        """Return whether the patch is flat and faces up along z."""
        width = float(np.ptp(self.patch[:, :2], axis=0).max())
        return float(np.ptp(self.patch[:, 2])) <= FLAT * width and float(self.loads[:, 2].sum()) > 1 - FLAT

    def step(self, words: Sequence[str], steps: int = 0) -> list[str]:
        """Return a step that ends with what is printed of the reference node."""
        printed = [f"*NODE PRINT, NSET={PATCH}, FREQUENCY=1", "U"] if steps else []
        return [f"*STEP, INC={steps + 1}" if steps else "*STEP", *words, *printed, "*END STEP"]

    def frequency(self, count: int) -> list[str]:
        """Return *FREQUENCY of the lowest ``count`` modes."""
        return self.step(["*FREQUENCY", f"{count}"])

    def transient(self, width: float, duration: float, dt: float, modes: int | None = None) -> list[str]:
        """Return the unit Hann pulse of ``width`` [s] on the patch for ``duration`` by the trapezoidal rule in steps of
        ``dt`` (*DYNAMIC, DIRECT, ALPHA=0), or by the sum of the lowest ``modes`` (*MODAL DYNAMIC): the patch's U [m/(N
        s)]."""
        count = int(np.ceil(duration / dt))
        times = dt * np.arange(count + 2, dtype=np.float64)
        pairs = np.stack([times, hann(times, width)], axis=1).ravel()
        pulse = [",".join(f"{x:.12e}" for x in pairs[k : k + 8]) for k in range(0, len(pairs), 8)]
        before = [] if modes is None else self.step(["*FREQUENCY, STORAGE=YES", f"{modes}"])
        rule = "*DYNAMIC, DIRECT, ALPHA=0." if modes is None else "*MODAL DYNAMIC"
        load = ["*CLOAD, AMPLITUDE=HANN", f"{self.node},{self.axis},{self.share:.12g}"]
        march = self.step([rule, f"{dt:.12e},{dt * count:.12e}", *load], count)
        return ["*AMPLITUDE, NAME=HANN", *pulse, *before, *march]


def calculix_body(
    model: SecondOrderModel, material: Solid | Mapping[str, Any], *, struck: str = "contact", copies: int = 1
) -> CalculixBody:
    """Return the deck of a model of finite elements of second order.

    Args:
        model: of solids in space, or of the half section of a body of revolution (harmonic 0).
        material: as in `assemble`.
        struck: boundary that is the patch.
        copies: how many of what is modelled make the whole.

    Hexahedra of 27 nodes become C3D20, quadrilaterals of 9 CAX8, without the nodes inside faces and elements.

    Raises:
        ModelError: a model without its mesh, elements of first order, a sliding support that is oblique to the axes.
    """
    dofs = model.dofs
    mesh: Any = None if dofs is None else dofs.mesh
    kind = KINDS.get(getattr(getattr(getattr(mesh, "elem", None), "refdom", None), "__name__", ""))
    if dofs is None or kind is None:
        raise ModelError("a deck for CalculiX needs a model of finite elements on a mesh of solids")
    if dofs.points.shape[1] <= mesh.t.max() + 1:
        raise ModelError("decks for CalculiX hold elements of second order: use mesh.order = 2")
    plane = kind.name.startswith("CAX")
    rows = Dofs(mesh, kind.ours).element_dofs
    used, cells = np.unique(rows[list(kind.nodes)], return_inverse=True)
    points = dofs.points[[0, 2, 1] if plane else [0, 1, 2]][:, used]
    cells = oriented(points, cells.reshape(len(kind.nodes), -1).T, kind, plane)
    loads = loads_of(mesh, kind, struck, used, plane)
    node, axis = len(used) + 1, int(np.argmax(np.abs(loads.sum(axis=0)))) + 1
    lines = ["*NODE, NSET=ALL"]
    lines += [f"{k},{x:.12g},{y:.12g},{z:.12g}" for k, (x, y, z) in enumerate(points.T, start=1)]
    lines += [f"*NODE, NSET={PATCH}", f"{node},0,0,0", f"*ELEMENT, TYPE={kind.name}, ELSET=BODY"]
    lines += [",\n".join(",".join(map(str, part)) for part in cut([k, *(c + 1)], 10)) for k, c in enumerate(cells, 1)]
    lines += materials_of(mesh, material)
    held = held_of(model)[:, [0, 2, 1] if plane else [0, 1, 2]][used]
    for component in range(2 if plane else 3):
        if held[:, component].any():
            name = f"HELD{component + 1}"
            lines += [*as_set(name, np.flatnonzero(held[:, component]) + 1), "*BOUNDARY", f"{name},{component + 1}"]
    facets = np.asarray(mesh.boundaries[struck])
    lines += [*as_set("STRUCKNODES", np.flatnonzero(loads.any(axis=1)) + 1)]
    lines += ["*SURFACE, NAME=STRUCK", *faces_of(mesh, kind, facets, cells, used)]
    terms = [(n + 1, a + 1, loads[n, a]) for n, a in np.argwhere(loads) if not held[n, a]]
    lines += ["*EQUATION", f"{len(terms) + 1}", f"{node},{axis},-1."]
    lines += [",".join(f"{n},{a},{b:.12e}" for n, a, b in part) for part in cut(terms, 4)]
    patch = points[:, np.searchsorted(used, np.unique(mesh.facets[:, facets]))].T
    return CalculixBody(kind.name, tuple(lines), axis, node, len(cells), loads, 1 / copies, patch)
