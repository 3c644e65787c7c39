"""Lines of decks for CalculiX: what strikes a body's patch, by ccx's own surface contact and direct dynamics.

The patch is the dependent surface, integrated face by face: pressure per penetration (*SURFACE BEHAVIOR,
PRESSURE-OVERCLOSURE=LINEAR). *DYNAMIC, DIRECT has the numerical damping of alpha = -0.05 here, without which ccx does
not find the end of a step.

A plate is one layer of C3D20R. ccx makes the same of S8R shells (the frequencies agree to all digits that it prints),
but these have no nodes on both faces, by which a plate can start with its rotations. The vertices' nodes in the
mid-surface are held in the plane: our plate bends and does not stretch.

With steps of fixed size ccx ends as soon as its own account of the energies, in which springs of surface contact are
not all right, gains 0.25 % of the largest energy so far (checkimpacts.f of ccx 2.20), although the forces are right and
the plate's energy is. A block that flies freely elsewhere, BALLAST, therefore has most of the energy.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from seatfem.structures.elements.mindlin import PlateMesh
from seatfem.structures.formats.calculix_deck import CalculixBody, Integers, as_set, cut
from seatfem.structures.materials import Material
from seatfem.structures.model import Array, ModelError

HEAVIER: Final = 1e4  # mass of the ballast over that of the plate
AWAY: Final = 1.0  # distance of the ballast from all else [m]
ROOM: Final = 0.1  # overhang of a rigid striker beyond the patch, over the patch's width


@dataclass(frozen=True, eq=False)
class PlateStriker:
    """A plate over a patch that faces up along z.

    Attributes:
        mesh, material, thickness: as of `assemble_plate`; the mesh where the plate stands, seen from above.
        clamped: nodes without motion.
        underside: (n,) heights of the nodes on the underside, undeformed [m].
        moved, rates: (n, 3) deflection [m] and rotations a = grad w of the nodes at the start, and their rates.
    """

    mesh: PlateMesh
    material: Material
    thickness: float
    clamped: Integers
    underside: Array
    moved: Array
    rates: Array

    def lines(self, node: int, cell: int) -> Iterator[str]:
        """Yield nodes above ``node``, elements above ``cell`` and the surface FACE below."""
        corners, sides = np.unique(self.mesh.cells[:, :4]), np.unique(self.mesh.cells[:, 4:8])
        used = np.zeros((len(self.mesh.points), 3), dtype=bool)  # below, in the mid-surface, above
        used[corners], used[sides, 0], used[sides, 2] = True, True, True
        number = node + np.cumsum(used).reshape(used.shape)
        at, level = np.nonzero(used)
        high = (level - 1) * self.thickness / 2
        yield "*NODE, NSET=STRIKER"
        places = np.column_stack([self.mesh.points[at], self.underside[at] + high + self.thickness / 2])
        yield from (f"{n}," + ",".join(f"{x:.12g}" for x in p) for n, p in zip(number[used], places, strict=True))
        yield "*ELEMENT, TYPE=C3D20R, ELSET=STRIKER"
        for k, row in enumerate(self.mesh.cells, start=cell + 1):
            first, second = row[:4], row[4:8]
            nodes = (number[first, 0], number[first, 2], number[second, 0], number[second, 2], number[first, 1])
            yield ",\n".join(",".join(map(str, part)) for part in cut([k, *np.concatenate(nodes)], 10))
        yield from ("*MATERIAL, NAME=PLATE", "*ELASTIC", f"{self.material.young:.12g},{self.material.poisson:.12g}")
        yield from ("*DENSITY", f"{self.material.density:.12g}", "*SOLID SECTION, ELSET=STRIKER, MATERIAL=PLATE")
        held = np.isin(at, self.clamped)
        for name, which, last in (("ROOT", held, 3), ("MIDDLE", ~held & (level == 1), 2)):
            if which.any():
                yield from (*as_set(name, number[used][which]), "*BOUNDARY", f"{name},1,{last}")
        for name, field in (("DISPLACEMENT", self.moved[at]), ("VELOCITY", self.rates[at])):
            values = np.column_stack([-high[:, None] * field[:, 1:], field[:, 0]])
            yield f"*INITIAL CONDITIONS, TYPE={name}"
            for n, moved in zip(number[used], values, strict=True):
                yield from (f"{n},{axis},{value:.12e}" for axis, value in enumerate(moved, 1))
        yield from ("*SURFACE, NAME=FACE", "STRIKER,S1")


def plate_contact(
    deck: CalculixBody, plate: PlateStriker, stiffness: float, duration: float, dt: float
) -> Iterator[str]:
    """Yield the deck of a plate that lands; the step prints the force on the patch. Else as `mass_contact`."""
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

    It is one element whose nodes move alike along z; the step prints one of them, HEAVY. ``stiffness``: of the contact
    [Pa/m]; for ``duration`` in steps of ``dt`` [s].

    Raises:
        ModelError: a half section, a patch that is not flat or does not face up.
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
    """Raise `ModelError` of a patch of an axisymmetric deck, or of one that is not flat and up along z."""
    if deck.plane:
        raise ModelError("ccx's surface contact finds no end between axisymmetric elements; state seat.model = '3d'")
    if not deck.flat:
        raise ModelError("contact by surfaces needs a flat patch that faces up along z")


def _brick(name: str, node: int, cell: int, low: Array, high: Array, density: float) -> Iterator[str]:
    """Yield one stiff element between two corners, its lower face S1."""
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


def _march(deck: CalculixBody, told: Sequence[str], duration: float, dt: float) -> list[str]:
    count = int(np.ceil(duration / dt * (1 - 1e-12)))
    return deck.step(["*DYNAMIC, DIRECT", f"{dt:.12e},{dt * count:.12e}", *told], count)
