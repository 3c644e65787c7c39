"""What a deck for CalculiX says of a mesh: its elements in ccx's own order of nodes, faces, sets, materials."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from skfem import (
    ElementHex2,
    ElementHexS2,
    ElementQuad2,
    ElementQuadS2,
    ElementTetP2,
    ElementTriP2,
    FacetBasis,
    LinearForm,
)
from skfem.assembly import Dofs

from seatfem.structures.elements.assembly import solids_by_region
from seatfem.structures.materials import Material, Solid
from seatfem.structures.model import Array, ModelError, SecondOrderModel

Integers = NDArray[np.int64]


@dataclass(frozen=True)
class Kind:
    """An element in the deck's words: ``nodes``, columns of ours; ``mirror``, of its own, where ours is mirrored;
    ``faces``, by its own vertices."""

    name: str
    ours: Any
    theirs: Any
    nodes: tuple[int, ...]
    mirror: tuple[int, ...]
    faces: tuple[tuple[int, ...], ...]


KINDS: Final[Mapping[str, Kind]] = {
    "RefTet": Kind(
        "C3D10", ElementTetP2(), ElementTetP2(), tuple(range(10)), (1, 0, 2, 3, 4, 6, 5, 8, 7, 9),
        ((0, 1, 2), (0, 1, 3), (1, 2, 3), (0, 2, 3)),
    ),
    "RefHex": Kind(
        "C3D20", ElementHex2(), ElementHexS2(),
        (7, 4, 1, 5, 6, 2, 0, 3, 17, 11, 12, 18, 14, 9, 10, 16, 19, 13, 8, 15),
        (4, 5, 6, 7, 0, 1, 2, 3, 12, 13, 14, 15, 8, 9, 10, 11, 16, 17, 18, 19),
        ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 4, 5), (1, 2, 5, 6), (2, 3, 6, 7), (0, 3, 4, 7)),
    ),
    "RefTri": Kind(
        "CAX6", ElementTriP2(), ElementTriP2(), tuple(range(6)), (0, 2, 1, 5, 4, 3), ((0, 1), (1, 2), (0, 2))
    ),
    "RefQuad": Kind(
        "CAX8", ElementQuad2(), ElementQuadS2(), tuple(range(8)), (0, 3, 2, 1, 7, 6, 5, 4),
        ((0, 1), (1, 2), (2, 3), (0, 3)),
    ),
}  # fmt: skip


def oriented(points: Array, cells: Integers, kind: Kind, plane: bool) -> Integers:
    """Return cells whose volume is positive in the deck's order."""
    if plane:
        first, second = (points[:2, cells[:, k]] - points[:2, cells[:, 0]] for k in (1, -1 + len(kind.faces)))
        volume = first[0] * second[1] - first[1] * second[0]
    else:
        ends = (1, 3, 4) if len(kind.faces) == 6 else (1, 2, 3)
        a, b, c = (points[:, cells[:, k]] - points[:, cells[:, 0]] for k in ends)
        volume = np.einsum("ke,ke->e", np.cross(a.T, b.T).T, c)
    cells = cells.copy()
    cells[volume < 0] = cells[volume < 0][:, list(kind.mirror)]
    return cells


def loads_of(mesh: Any, kind: Kind, struck: str, used: Integers, plane: bool) -> Array:
    """Return the (nodes, 3) b: the consistent nodal forces of a unit load, uniform over the patch, along its outward
    normal."""
    basis = FacetBasis(mesh, kind.theirs, facets=mesh.boundaries[struck], intorder=8)
    radius = basis.global_coordinates()[0] if plane else 1.0
    area = float(np.sum(radius * basis.dx))
    loads = np.zeros((len(used), 3))
    known = Dofs(mesh, kind.ours).element_dofs[: len(kind.nodes)], Dofs(mesh, kind.theirs).element_dofs
    place = np.full(int(known[1].max()) + 1, -1, dtype=np.int64)
    place[known[1]] = np.searchsorted(used, known[0])
    for axis in range(2 if plane else 3):
        form = LinearForm(lambda v, w, axis=axis: (w.x[0] if plane else 1.0) * w.n[axis] * v / area)
        loads[place, axis] = form.assemble(basis)
    loads[np.abs(loads) < 1e-14 * np.abs(loads).max()] = 0.0
    return loads


def held_of(model: SecondOrderModel) -> NDArray[np.bool_]:
    """Return (nodes, 3) whether a component is held."""
    dofs = model.dofs
    assert dofs is not None
    held = np.ones(dofs.points.size, bool)
    if dofs.turned is None:
        held[dofs.free] = False
    else:
        per_row = np.diff(dofs.turned.tocsr().indptr)
        if per_row.max(initial=0) > 1 or not np.allclose(np.abs(dofs.turned.data), 1.0):
            raise ModelError("a sliding support oblique to the axes has no place in a deck for CalculiX; turn the part")
        held[per_row > 0] = False
    return held.reshape(-1, 3)


def materials_of(mesh: Any, material: Solid | Mapping[str, Any]) -> Iterator[str]:
    """Yield sets of elements, and what each is made of."""
    solids, region = solids_by_region(mesh, material)
    for k, solid in enumerate(solids, start=1):
        yield from as_set(f"REGION{k}", np.flatnonzero(region == k - 1) + 1, "ELSET")
        oriented = ""
        if isinstance(solid, Material):
            elastic = ["*ELASTIC", f"{solid.young:.12g},{solid.poisson:.12g}"]
        else:
            shear = (solid.shear[0], solid.shear[1], solid.shear[2])
            numbers = [f"{x:.12g}" for x in (*solid.young, *solid.poisson, *shear)]
            elastic = ["*ELASTIC, TYPE=ENGINEERING CONSTANTS", ",".join(numbers[:8]), numbers[8]]
            yield from (f"*ORIENTATION, NAME=AXES{k}", ",".join(f"{x:.12g}" for row in solid.axes[:2] for x in row))
            oriented = f", ORIENTATION=AXES{k}"
        yield from (f"*MATERIAL, NAME=SOLID{k}", *elastic, "*DENSITY", f"{solid.density:.12g}")
        yield f"*SOLID SECTION, ELSET=REGION{k}, MATERIAL=SOLID{k}{oriented}"


def faces_of(mesh: Any, kind: Kind, facets: Integers, cells: Integers, used: Integers) -> Iterator[str]:
    """Yield element and number of the face, of every facet of the patch."""
    for facet, cell in zip(facets, mesh.f2t[0, facets], strict=True):
        corners = set(np.searchsorted(used, mesh.facets[:, facet]).tolist())
        number = next(k for k, face in enumerate(kind.faces, 1) if corners == set(cells[cell, list(face)].tolist()))
        yield f"{cell + 1},S{number}"


def as_set(name: str, numbers: Integers, what: str = "NSET") -> Iterator[str]:
    yield f"*{what}, {what}={name}"
    yield from (",".join(map(str, part)) for part in cut(list(numbers), 12))


def cut(items: Sequence[Any], most: int) -> Iterator[Sequence[Any]]:
    return (items[k : k + most] for k in range(0, len(items), most))
