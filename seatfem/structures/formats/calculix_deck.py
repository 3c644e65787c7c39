"""Decks for CalculiX (ccx): a body with its material, supports and struck patch, and a plate that lands on it.

A reference node represents the struck patch: an *EQUATION makes one of its components the patch's area-averaged normal
displacement b'u, so that a *CLOAD on it acts as the consistent nodal forces b F (Dhondt, The Finite Element Method for
Three-Dimensional Thermomechanical Applications, Wiley 2004; manual of ccx 2.20). No deck has damping.

In contact the patch is the dependent surface, integrated face by face: pressure per penetration. *DYNAMIC, DIRECT has
the numerical damping alpha = -0.05, without which the iterations of ccx do not converge. The plate is one layer of
C3D20R, as shells have no nodes on both faces, which initial rotations need. With steps of fixed size ccx stops when its
energy balance, in which the springs of surface contact are not counted correctly, gains 0.25 % of the largest energy so
far (checkimpacts.f of ccx 2.20). A mass in free flight, BALLAST, therefore has most of the energy.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from skfem import element as elements
from skfem.assembly import Dofs

from impact.bodies.body import ModalState
from seatfem.structures.elements.assembly import solids_by_region
from seatfem.structures.elements.axisymmetric import Section, ring_surface
from seatfem.structures.elements.shape_functions import discretize, surface
from seatfem.structures.materials import Material, Solid
from seatfem.structures.mesh.plane_meshes import CLAMPED
from seatfem.structures.model import Array, ModelError, SecondOrderModel
from seatfem.structures.sheets import PlateModes

PATCH: Final = "PATCH"  # name of the set of the reference node
DEGREE: Final = 8  # degree of the quadrature over the patch
HEAVIER: Final = 1e4  # mass of the ballast over that of the plate


@dataclass(frozen=True)
class Kind:
    """Element type of ccx: ``ours`` and ``theirs``, elements with our nodes and with its own; ``nodes``, ours in its
    order; ``ends``, those next to the first; ``mirror``, the order that turns an element inside out; ``faces`` 1, 2,
    ... by their vertices."""

    name: str
    ours: Any
    theirs: Any
    nodes: tuple[int, ...]
    ends: tuple[int, ...]
    mirror: tuple[int, ...]
    faces: tuple[tuple[int, ...], ...]


KINDS: Final[Mapping[str, Kind]] = {
    "RefTet": Kind(
        "C3D10", elements.ElementTetP2(), elements.ElementTetP2(), tuple(range(10)), (1, 2, 3),
        (1, 0, 2, 3, 4, 6, 5, 8, 7, 9), ((0, 1, 2), (0, 1, 3), (1, 2, 3), (0, 2, 3)),
    ),
    "RefHex": Kind(
        "C3D20", elements.ElementHex2(), elements.ElementHexS2(),
        (7, 4, 1, 5, 6, 2, 0, 3, 17, 11, 12, 18, 14, 9, 10, 16, 19, 13, 8, 15), (1, 3, 4),
        (4, 5, 6, 7, 0, 1, 2, 3, 12, 13, 14, 15, 8, 9, 10, 11, 16, 17, 18, 19),
        ((0, 1, 2, 3), (4, 5, 6, 7), (0, 1, 4, 5), (1, 2, 5, 6), (2, 3, 6, 7), (0, 3, 4, 7)),
    ),
    "RefTri": Kind(
        "CAX6", elements.ElementTriP2(), elements.ElementTriP2(), tuple(range(6)), (1, 2),
        (0, 2, 1, 5, 4, 3), ((0, 1), (1, 2), (0, 2)),
    ),
}  # fmt: skip


@dataclass(frozen=True, eq=False)
class CalculixBody:
    """Part of a deck that describes one body.

    Attributes:
        element: element type.
        lines: nodes, elements, sets, materials, supports, the patch's surface (STRUCK) and its node.
        axis: component of the reference node that is the patch's mean normal displacement, 1 to 3.
        node: number of the reference node, the highest of this body.
        cells: number of elements.
        loads: b (nodes, 3), nodal forces of a unit load on the patch; rows are the nodes of the deck.
        share: share of the whole body's load on the model: 1/4 for a quarter.
        centre: centroid (3,) [m] of a flat patch in space that faces up along z; ``None`` for other patches.
    """

    element: str
    lines: tuple[str, ...]
    axis: int
    node: int
    cells: int
    loads: Array
    share: float
    centre: Array | None

    def frequency(self, count: int) -> list[str]:
        """Return a step *FREQUENCY for the lowest ``count`` modes."""
        return ["*STEP", "*FREQUENCY", f"{count}", "*END STEP"]

    def static(self) -> list[str]:
        """Return a step *STATIC with a unit force on the patch of the whole body, which prints U of its node [m/N]."""
        force = ["*CLOAD", f"{self.node},{self.axis},{self.share:.12g}"]
        return ["*STEP", "*STATIC", *force, f"*NODE PRINT, NSET={PATCH}", "U", "*END STEP"]


def calculix_body(
    model: SecondOrderModel, material: Solid | Mapping[str, Any], *, struck: str = "contact", copies: int = 1
) -> CalculixBody:
    """Return the deck of a model of finite elements of second order.

    Args:
        model: model of solids in space, or of the half section of a body of revolution (harmonic 0).
        material: material as in `assemble`.
        struck: name of the boundary that is the patch.
        copies: number of copies of the model in the whole body.

    Hexahedra of 27 nodes become C3D20, without nodes inside faces and elements.

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
    if dofs.turned is not None and not np.allclose(np.abs(dofs.turned.data), 1.0):
        raise ModelError("a sliding support oblique to the axes has no place in a deck for CalculiX; turn the part")
    dim = len(kind.ends)
    axes = [0, 1, 2] if dim == 3 else [0, 2, 1]  # a half section lies in the plane of x and y
    used, cells = np.unique(Dofs(mesh, kind.ours).element_dofs[list(kind.nodes)], return_inverse=True)
    points, cells = dofs.points[axes][:, used], cells.reshape(len(kind.nodes), -1).T
    edges = points[:dim, cells[:, kind.ends]] - points[:dim, cells[:, :1]]
    cells = np.where(np.linalg.det(edges.transpose(1, 0, 2))[:, None] < 0, cells[:, kind.mirror], cells)
    loads = _loads(mesh, kind, struck, used)
    node, axis = len(used) + 1, int(np.argmax(np.abs(loads.sum(axis=0)))) + 1
    lines = ["*NODE, NSET=ALL", *(row(k, point) for k, point in enumerate(points.T, start=1))]
    lines += [f"*NODE, NSET={PATCH}", f"{node},0,0,0", f"*ELEMENT, TYPE={kind.name}, ELSET=BODY"]
    lines += [_cell(k, cell + 1) for k, cell in enumerate(cells, start=1)]
    lines += _materials(mesh, material)
    moving = dofs.free if dofs.turned is None else dofs.turned.nonzero()[0]
    fixed = ~np.isin(np.arange(dofs.points.size), moving).reshape(-1, 3)[:, axes][used]
    for component in np.flatnonzero(fixed[:, :dim].any(axis=0)) + 1:
        lines += _set(f"HELD{component}", np.flatnonzero(fixed[:, component - 1]) + 1)
        lines += ["*BOUNDARY", f"HELD{component},{component}"]
    lines.append("*SURFACE, NAME=STRUCK")
    for facet, cell in zip(facets := mesh.boundaries[struck], mesh.f2t[0, facets], strict=True):
        corners = set(np.searchsorted(used, mesh.facets[:, facet]).tolist())
        number = next(k for k, face in enumerate(kind.faces, 1) if corners == set(cells[cell, list(face)].tolist()))
        lines.append(f"{cell + 1},S{number}")
    terms = [f"{n + 1},{a + 1},{loads[n, a]:.12e}" for n, a in np.argwhere(loads) if not fixed[n, a]]
    lines += ["*EQUATION", f"{len(terms) + 1}", f"{node},{axis},-1.", *map(",".join, _cut(terms, 4))]
    centre = points @ loads[:, 2] if dim == 3 and np.isclose(loads[:, 2].sum(), 1.0) else None
    return CalculixBody(kind.name, tuple(lines), axis, node, len(cells), loads, 1 / copies, centre)


def _loads(mesh: Any, kind: Kind, struck: str, used: NDArray[np.int64]) -> Array:
    """Return b (nodes, 3): consistent nodal forces of a unit load, uniform over the patch, along its outward normal."""
    ours, theirs = Dofs(mesh, kind.ours).element_dofs[: len(kind.nodes)], Dofs(mesh, kind.theirs).element_dofs
    if plane := len(kind.ends) == 2:
        patch = ring_surface(Section.from_mesh(mesh, 2), struck, "port", 1.0, DEGREE)
    else:
        made = replace(discretize(mesh, 2), element=kind.theirs, cells=np.asarray(theirs.T))
        patch = surface(made, struck, "port", DEGREE)
    place = np.full(int(theirs.max()) + 1, -1, dtype=np.int64)
    place[theirs] = np.searchsorted(used, ours)
    loads = np.zeros((len(used), 3))
    normals = patch.normals[..., [0, 2, 1]] if plane else patch.normals
    of_nodes = np.einsum("fqn,fqa,fq->fna", patch.shapes, normals, patch.weights / patch.area)
    np.add.at(loads, place[patch.cells], of_nodes)
    loads[np.abs(loads) < 1e-14 * np.abs(loads).max()] = 0.0
    return loads


def _materials(mesh: Any, material: Solid | Mapping[str, Any]) -> Iterator[str]:
    """Yield the sets of elements, and the material of each."""
    solids, region = solids_by_region(mesh, material)
    for k, solid in enumerate(solids, start=1):
        yield from _set(f"REGION{k}", np.flatnonzero(region == k - 1) + 1, "ELSET")
        oriented = ""
        if isinstance(solid, Material):
            elastic = ["*ELASTIC", row(solid.young, [solid.poisson])]
        else:
            first, *others = (*solid.young, *solid.poisson, *solid.shear)
            elastic = ["*ELASTIC, TYPE=ENGINEERING CONSTANTS", row(first, others[:7]), f"{others[7]:.12g}"]
            yield from (f"*ORIENTATION, NAME=AXES{k}", ",".join(f"{x:.12g}" for axis in solid.axes[:2] for x in axis))
            oriented = f", ORIENTATION=AXES{k}"
        yield from (f"*MATERIAL, NAME=SOLID{k}", *elastic, "*DENSITY", f"{solid.density:.12g}")
        yield f"*SOLID SECTION, ELSET=REGION{k}, MATERIAL=SOLID{k}{oriented}"


def landing(
    deck: CalculixBody, plate: PlateModes, under: Array, state: ModalState, stiffness: float, steps: int, dt: float
) -> Iterator[str]:
    """Yield what follows the body in the deck of a plate that lands on its patch; it prints the force on the patch.

    ``under``: positions (n, 3) of the plate's nodes on its undeformed underside [m]; ``state``: its modal coordinates
    at the start; ``stiffness``: per area of contact [Pa/m]; ``steps`` of ``dt`` [s] are integrated.
    """
    mesh, thickness, material = plate.mesh, plate.sheet.shape.thickness, plate.sheet.weighed(plate.mesh)
    corners, sides = np.unique(mesh.cells[:, :4]), np.unique(mesh.cells[:, 4:8])
    used = np.zeros((len(mesh.points), 3), dtype=bool)  # columns: below, in the mid-surface, above
    used[corners], used[sides, 0], used[sides, 2] = True, True, True
    number = deck.node + np.cumsum(used).reshape(used.shape)
    (place, level), numbers = np.nonzero(used), number[used]
    high = (level - 1) * thickness / 2
    yield "*NODE, NSET=STRIKER"
    yield from map(row, numbers, under[place] + np.outer(high + thickness / 2, [0.0, 0.0, 1.0]))
    yield "*ELEMENT, TYPE=C3D20R, ELSET=STRIKER"
    for k, nodes in enumerate(mesh.cells, start=deck.cells + 1):
        first, second = number[nodes[:4]], number[nodes[4:8]]
        yield _cell(k, np.concatenate([first[:, 0], first[:, 2], second[:, 0], second[:, 2], first[:, 1]]))
    yield from ("*MATERIAL, NAME=PLATE", "*ELASTIC", row(material.young, [material.poisson]))
    yield from ("*DENSITY", f"{material.density:.12g}", "*SOLID SECTION, ELSET=STRIKER, MATERIAL=PLATE")
    clamped = np.isin(place, mesh.lines.get(CLAMPED, []))
    for name, chosen, last in (("ROOT", clamped, 3), ("MIDDLE", ~clamped & (level == 1), 2)):
        if chosen.any():
            yield from (*_set(name, numbers[chosen]), "*BOUNDARY", f"{name},1,{last}")
    for name, amplitudes in (("DISPLACEMENT", state.displacement), ("VELOCITY", state.velocity)):
        field = plate.field(amplitudes)[place]  # deflection and rotations
        yield f"*INITIAL CONDITIONS, TYPE={name}"
        for n, moved in zip(numbers, np.column_stack([-high[:, None] * field[:, 1:], field[:, 0]]), strict=True):
            yield from (f"{n},{axis},{value:.12e}" for axis, value in enumerate(moved, 1))
    ballast, mass = int(numbers.max()) + 1, HEAVIER * plate.mass
    yield from ("*NODE, NSET=BALLAST", f"{ballast},0,0,0", "*ELEMENT, TYPE=MASS, ELSET=BALLAST")
    yield from (f"{deck.cells + len(mesh.cells) + 1},{ballast}", "*MASS, ELSET=BALLAST", f"{mass:.12g}")
    yield from ("*INITIAL CONDITIONS, TYPE=VELOCITY", f"BALLAST,3,{np.abs(field[:, 0]).max():.12g}")
    yield from ("*SURFACE, NAME=FACE", "STRIKER,S1", "*SURFACE INTERACTION, NAME=TOUCH")
    yield from ("*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", f"{stiffness:.12g}")
    yield from ("*CONTACT PAIR, INTERACTION=TOUCH, TYPE=SURFACE TO SURFACE", "STRUCK,FACE")
    yield from (f"*STEP, INC={steps + 1}", "*DYNAMIC, DIRECT", f"{dt:.12e},{dt * steps:.12e}")
    yield from ("*CONTACT PRINT, SLAVE=STRUCK, MASTER=FACE", "CF", "*END STEP")


def row(first: float, values: Iterable[float]) -> str:
    """Return a line of numbers to twelve digits."""
    return ",".join(f"{x:.12g}" for x in (first, *values))


def _cell(number: int, nodes: NDArray[np.int64]) -> str:
    return ",\n".join(",".join(map(str, part)) for part in _cut([number, *nodes.tolist()], 10))


def _set(name: str, numbers: NDArray[np.int64], what: str = "NSET") -> Iterator[str]:
    yield f"*{what}, {what}={name}"
    yield from (",".join(map(str, part)) for part in _cut(numbers.tolist(), 12))


def _cut(items: Sequence[Any], most: int) -> Iterator[Sequence[Any]]:
    return (items[k : k + most] for k in range(0, len(items), most))
