"""Decks for CalculiX (ccx): a model's mesh, materials, supports and struck patch, loads, and strikers in contact.

A reference node represents the struck patch: an *EQUATION makes one of its components the patch's area-averaged normal
displacement b'u, so that a *CLOAD on it acts as the consistent nodal forces b F (Dhondt, The Finite Element Method for
Three-Dimensional Thermomechanical Applications, Wiley 2004; manual of ccx 2.20). No deck has damping.

In contact the patch is the dependent surface, integrated face by face: pressure per penetration (*SURFACE BEHAVIOR,
PRESSURE-OVERCLOSURE=LINEAR). *DYNAMIC, DIRECT has the numerical damping alpha = -0.05, without which the iterations of
ccx do not converge.

A plate is one layer of C3D20R. ccx expands S8R shells to the same elements (all printed digits of frequencies agree),
but shells have no nodes on both faces, which initial rotations of a plate need. In-plane displacements of the corner
nodes in the mid-surface are fixed: our plate bends and does not stretch.

With steps of fixed size ccx stops when its energy balance, in which the springs of surface contact are not counted
correctly, gains 0.25 % of the largest energy so far (checkimpacts.f of ccx 2.20), although the forces and the energy of
the plate are right. A block in free flight away from the bodies, BALLAST, therefore has most of the energy.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray
from skfem import (
    ElementHex2,
    ElementHexS2,
    ElementTetP2,
    ElementTriP2,
)
from skfem.assembly import Dofs

from impact.greens.oscillator import hann
from seatfem.structures.elements.assembly import solids_by_region
from seatfem.structures.elements.axisymmetric import Section, ring_surface
from seatfem.structures.elements.mindlin import PlateMesh
from seatfem.structures.elements.shape_functions import discretize, surface
from seatfem.structures.materials import Material, Solid
from seatfem.structures.model import Array, ModelError, SecondOrderModel

Integers = NDArray[np.int64]
DEGREE: Final = 8  # degree of the quadrature over the patch


@dataclass(frozen=True)
class Kind:
    """Element type of ccx: ``ours`` and ``theirs``, elements with our nodes and with its own; ``nodes``, ours in its
    order; ``mirror``, the order that turns an element inside out; ``faces`` 1, 2, ... by their vertices."""

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
}  # fmt: skip


def oriented(points: Array, cells: Integers, kind: Kind, plane: bool) -> Integers:
    """Return the cells in the deck's order, with positive volume."""
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
    """Return b (nodes, 3): consistent nodal forces of a unit load, uniform over the patch, along its outward normal."""
    ours, theirs = Dofs(mesh, kind.ours).element_dofs[: len(kind.nodes)], Dofs(mesh, kind.theirs).element_dofs
    if plane:
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


def held_of(model: SecondOrderModel) -> NDArray[np.bool_]:
    """Return a mask (nodes, 3) of the displacement components that a support fixes."""
    dofs = model.dofs
    assert dofs is not None
    fixed = np.ones(dofs.points.size, bool)
    if dofs.turned is None:
        fixed[dofs.free] = False
    else:
        per_row = np.diff(dofs.turned.tocsr().indptr)
        if per_row.max(initial=0) > 1 or not np.allclose(np.abs(dofs.turned.data), 1.0):
            raise ModelError("a sliding support oblique to the axes has no place in a deck for CalculiX; turn the part")
        fixed[per_row > 0] = False
    return fixed.reshape(-1, 3)


def materials_of(mesh: Any, material: Solid | Mapping[str, Any]) -> Iterator[str]:
    """Yield the sets of elements, and the material of each."""
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
    """Yield the element and the face number of every facet of the patch."""
    for facet, cell in zip(facets, mesh.f2t[0, facets], strict=True):
        corners = set(np.searchsorted(used, mesh.facets[:, facet]).tolist())
        number = next(k for k, face in enumerate(kind.faces, 1) if corners == set(cells[cell, list(face)].tolist()))
        yield f"{cell + 1},S{number}"


def as_set(name: str, numbers: Integers, what: str = "NSET") -> Iterator[str]:
    yield f"*{what}, {what}={name}"
    yield from (",".join(map(str, part)) for part in cut(list(numbers), 12))


def cut(items: Sequence[Any], most: int) -> Iterator[Sequence[Any]]:
    return (items[k : k + most] for k in range(0, len(items), most))


PATCH: Final = "PATCH"  # name of the set of the reference node
FLAT: Final = 1e-6  # largest height difference of a flat patch's vertices over its width


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
        patch: positions (n, 3) of the patch's vertices [m].
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
        """Return whether the model is the half section of a body of revolution."""
        return self.element.startswith("CAX")

    @property
    def flat(self) -> bool:
        """Return whether the patch is flat with its normal along +z."""
        width = float(np.ptp(self.patch[:, :2], axis=0).max())
        return float(np.ptp(self.patch[:, 2])) <= FLAT * width and float(self.loads[:, 2].sum()) > 1 - FLAT

    def step(self, words: Sequence[str], steps: int = 0) -> list[str]:
        """Return a ``*STEP`` whose last lines print the displacement of the reference node."""
        printed = [f"*NODE PRINT, NSET={PATCH}, FREQUENCY=1", "U"] if steps else []
        return [f"*STEP, INC={steps + 1}" if steps else "*STEP", *words, *printed, "*END STEP"]

    def frequency(self, count: int) -> list[str]:
        """Return a step *FREQUENCY for the lowest ``count`` modes."""
        return self.step(["*FREQUENCY", f"{count}"])

    def transient(self, width: float, duration: float, dt: float) -> list[str]:
        """Return a step with a unit Hann pulse of ``width`` [s] on the patch, for ``duration`` [s], by the trapezoidal
        rule with steps ``dt`` [s] (*DYNAMIC, DIRECT, ALPHA=0), which prints U of the patch [m/(N s)]."""
        count = int(np.ceil(duration / dt))
        times = dt * np.arange(count + 2, dtype=np.float64)
        pairs = np.stack([times, hann(times, width)], axis=1).ravel()
        pulse = [",".join(f"{x:.12e}" for x in some) for some in cut(pairs.tolist(), 8)]
        load = ["*CLOAD, AMPLITUDE=HANN", f"{self.node},{self.axis},{self.share:.12g}"]
        march = self.step(["*DYNAMIC, DIRECT, ALPHA=0.", f"{dt:.12e},{dt * count:.12e}", *load], count)
        return ["*AMPLITUDE, NAME=HANN", *pulse, *march]


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
    fixed = held_of(model)[:, [0, 2, 1] if plane else [0, 1, 2]][used]
    for component in range(2 if plane else 3):
        if fixed[:, component].any():
            name = f"HELD{component + 1}"
            lines += [*as_set(name, np.flatnonzero(fixed[:, component]) + 1), "*BOUNDARY", f"{name},{component + 1}"]
    facets = np.asarray(mesh.boundaries[struck])
    lines += [*as_set("STRUCKNODES", np.flatnonzero(loads.any(axis=1)) + 1)]
    lines += ["*SURFACE, NAME=STRUCK", *faces_of(mesh, kind, facets, cells, used)]
    terms = [(n + 1, a + 1, loads[n, a]) for n, a in np.argwhere(loads) if not fixed[n, a]]
    lines += ["*EQUATION", f"{len(terms) + 1}", f"{node},{axis},-1."]
    lines += [",".join(f"{n},{a},{b:.12e}" for n, a, b in part) for part in cut(terms, 4)]
    patch = points[:, np.searchsorted(used, np.unique(mesh.facets[:, facets]))].T
    return CalculixBody(kind.name, tuple(lines), axis, node, len(cells), loads, 1 / copies, patch)


HEAVIER: Final = 1e4  # mass of the ballast over that of the plate
AWAY: Final = 1.0  # distance of the ballast from the bodies [m]
ROOM: Final = 0.1  # overhang of a rigid striker beyond the patch, over the patch's width


@dataclass(frozen=True, eq=False)
class PlateStriker:
    """Plate over a patch with its normal along +z.

    Attributes:
        mesh, material, thickness: as in `assemble_plate`; the mesh in the position of the plate, seen from above.
        clamped: numbers of the clamped nodes.
        underside: undeformed heights (n,) of the nodes on the underside [m].
        moved, rates: initial deflection [m] and rotations a = grad w (n, 3) of the nodes, and their rates.
    """

    mesh: PlateMesh
    material: Material
    thickness: float
    clamped: Integers
    underside: Array
    moved: Array
    rates: Array

    def lines(self, node: int, cell: int) -> Iterator[str]:
        """Yield nodes numbered from ``node`` + 1, elements from ``cell`` + 1, and the surface FACE on the underside."""
        corners, sides = np.unique(self.mesh.cells[:, :4]), np.unique(self.mesh.cells[:, 4:8])
        used = np.zeros((len(self.mesh.points), 3), dtype=bool)  # columns: below, in the mid-surface, above
        used[corners], used[sides, 0], used[sides, 2] = True, True, True
        number = node + np.cumsum(used).reshape(used.shape)
        place, level = np.nonzero(used)
        high = (level - 1) * self.thickness / 2
        yield "*NODE, NSET=STRIKER"
        places = np.column_stack([self.mesh.points[place], self.underside[place] + high + self.thickness / 2])
        yield from (f"{n}," + ",".join(f"{x:.12g}" for x in p) for n, p in zip(number[used], places, strict=True))
        yield "*ELEMENT, TYPE=C3D20R, ELSET=STRIKER"
        for k, row in enumerate(self.mesh.cells, start=cell + 1):
            first, second = row[:4], row[4:8]
            nodes = (number[first, 0], number[first, 2], number[second, 0], number[second, 2], number[first, 1])
            yield ",\n".join(",".join(map(str, part)) for part in cut([k, *np.concatenate(nodes)], 10))
        yield from ("*MATERIAL, NAME=PLATE", "*ELASTIC", f"{self.material.young:.12g},{self.material.poisson:.12g}")
        yield from ("*DENSITY", f"{self.material.density:.12g}", "*SOLID SECTION, ELSET=STRIKER, MATERIAL=PLATE")
        clamped = np.isin(place, self.clamped)
        for name, chosen, last in (("ROOT", clamped, 3), ("MIDDLE", ~clamped & (level == 1), 2)):
            if chosen.any():
                yield from (*as_set(name, number[used][chosen]), "*BOUNDARY", f"{name},1,{last}")
        for name, field in (("DISPLACEMENT", self.moved[place]), ("VELOCITY", self.rates[place])):
            values = np.column_stack([-high[:, None] * field[:, 1:], field[:, 0]])
            yield f"*INITIAL CONDITIONS, TYPE={name}"
            for n, moved in zip(number[used], values, strict=True):
                yield from (f"{n},{axis},{value:.12e}" for axis, value in enumerate(moved, 1))
        yield from ("*SURFACE, NAME=FACE", "STRIKER,S1")


def plate_contact(
    deck: CalculixBody, plate: PlateStriker, stiffness: float, duration: float, dt: float
) -> Iterator[str]:
    """Yield the deck of a plate that lands; the step prints the force on the patch. Otherwise as `mass_contact`."""
    check_patch(deck)
    node, cell = deck.node + 3 * len(plate.mesh.points), deck.cells + len(plate.mesh.cells)
    side = plate.thickness
    density = HEAVIER * plate.material.density * plate.mesh.area * plate.thickness / side**3
    yield from plate.lines(deck.node, deck.cells)
    yield from _brick("BALLAST", node, cell, np.array([AWAY] * 3), np.array([AWAY + side] * 3), density)
    yield from ("*INITIAL CONDITIONS, TYPE=VELOCITY", f"BALLAST,3,{np.abs(plate.rates[:, 0]).max():.12g}")
    yield from _pair(stiffness)
    yield from _march(deck, ["*CONTACT PRINT, SLAVE=STRUCK, MASTER=FACE", "CF"], duration, dt)


def mass_contact(
    deck: CalculixBody, mass: float, velocity: float, stiffness: float, duration: float, dt: float
) -> Iterator[str]:
    """Yield the deck of a rigid, flat striker of ``mass`` [kg] that arrives with ``velocity`` [m/s] < 0.

    It is one element whose nodes have the same displacement along z; the step prints that of one, HEAVY. ``stiffness``:
    contact stiffness [Pa/m]; ``duration`` [s] is integrated with steps of ``dt`` [s].

    Raises:
        ModelError: a half section, or a patch that is not flat with its normal along +z.
    """
    check_patch(deck)
    low, high = deck.patch.min(axis=0), deck.patch.max(axis=0)
    room = ROOM * float(np.ptp(deck.patch[:, :2], axis=0).max())
    low, high = np.array([*(low[:2] - room), high[2]]), np.array([*(high[:2] + room), high[2] + room])
    first = deck.node + 1
    yield from _brick("STRIKER", deck.node, deck.cells, low, high, deck.share * mass / float(np.prod(high - low)))
    yield from ("*BOUNDARY", "STRIKER,1,2")
    yield from (f"*EQUATION\n2\n{n},3,1.,{first},3,-1." for n in range(first + 1, first + 8))
    yield from ("*INITIAL CONDITIONS, TYPE=VELOCITY", f"STRIKER,3,{velocity:.12g}")
    yield from ("*SURFACE, NAME=FACE", "STRIKER,S1")
    yield from _pair(stiffness)
    yield from ("*NSET, NSET=HEAVY", f"{first}")
    yield from _march(deck, ["*NODE PRINT, NSET=HEAVY, FREQUENCY=1", "U,V"], duration, dt)


def check_patch(deck: CalculixBody) -> None:
    """Raise `ModelError` for the patch of an axisymmetric deck, or one that is not flat with its normal along +z."""
    if deck.plane:
        raise ModelError("ccx's surface contact finds no end between axisymmetric elements; state seat.model = '3d'")
    if not deck.flat:
        raise ModelError("contact by surfaces needs a flat patch that faces up along z")


def _brick(name: str, node: int, cell: int, low: Array, high: Array, density: float) -> Iterator[str]:
    """Yield one stiff element between two corners; its lower face is S1."""
    (x0, y0, z0), (x1, y1, z1) = low, high
    places = [(x, y, z) for z in (z0, z1) for x, y in ((x0, y0), (x1, y0), (x1, y1), (x0, y1))]
    nodes = range(node + 1, node + 9)
    yield f"*NODE, NSET={name}"
    yield from (f"{n}," + ",".join(f"{x:.12g}" for x in place) for n, place in zip(nodes, places, strict=True))
    yield from (f"*ELEMENT, TYPE=C3D8, ELSET={name}", ",".join(map(str, [cell + 1, *nodes])))
    yield from (f"*MATERIAL, NAME={name}", "*ELASTIC", "1e12,0.", "*DENSITY", f"{density:.12g}")
    yield f"*SOLID SECTION, ELSET={name}, MATERIAL={name}"


def _pair(stiffness: float) -> tuple[str, ...]:
    return (
        "*SURFACE INTERACTION, NAME=TOUCH",
        *("*SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR", f"{stiffness:.12g}"),
        *("*CONTACT PAIR, INTERACTION=TOUCH, TYPE=SURFACE TO SURFACE", "STRUCK,FACE"),
    )


def _march(deck: CalculixBody, output: Sequence[str], duration: float, dt: float) -> list[str]:
    count = int(np.ceil(duration / dt * (1 - 1e-12)))
    return deck.step(["*DYNAMIC, DIRECT", f"{dt:.12e},{dt * count:.12e}", *output], count)
