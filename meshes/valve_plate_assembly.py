"""Two parts in one coordinate system: python meshes/valve_plate_assembly.py FOLDER.

``assembly_plate.step``: a valve plate of 60 x 40 x 6 mm with a bored port, a raised lip around it and four bolt holes.
``assembly_flapper.step``: a flapper of 0.3 mm above the lip, its root clamped, its paddle over the port. The functions
take angles and places, so that tests draw the same parts turned, tilted and moved.
"""

import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import gmsh

PLATE: Final = (60.0, 40.0, 6.0)  # mm
BEFORE: Final = -40.0  # x of its short side, on the side of the root
LIP: Final = (4.0, 5.2, 0.5)  # inner and outer radius and height over the plate, about the origin
BOLT: Final = 2.25  # radius of the holes
BOLTS: Final = ((-34.0, -14.0), (-34.0, 14.0), (14.0, -14.0), (14.0, 14.0))
ROOT: Final = -22.0  # x of the clamped edge
NECK: Final = 4.0  # half of its width
PADDLE: Final = 7.5  # radius, about the origin
THICKNESS: Final = 0.3
GAP: Final = 0.02  # between lip and flapper

Bodies = list[tuple[int, int]]
"""Dimension and tag of each."""
Move = Callable[[Any, Bodies], None]
"""Moves bodies of gmsh's OpenCASCADE model."""


def plate(occ: Any) -> Bodies:
    """Add the valve plate (millimetres); its lip looks along z, at z = 6.5 mm."""
    (length, width, height), (inner, outer, rise) = PLATE, LIP
    body, lip = (
        occ.addBox(BEFORE, -width / 2, 0, length, width, height),
        occ.addCylinder(0, 0, 0, 0, 0, height + rise, outer),
    )
    solid = occ.fuse([(3, body)], [(3, lip)])[0]
    holes = [(3, occ.addCylinder(x, y, 0, 0, 0, height, BOLT)) for x, y in BOLTS]
    return list(occ.cut(solid, [(3, occ.addCylinder(0, 0, 0, 0, 0, height + rise, inner)), *holes])[0])


def flapper(occ: Any) -> Bodies:
    """Add the flapper (millimetres): a neck from its root to a round paddle, its underside `GAP` over the lip."""
    z = PLATE[2] + LIP[2] + GAP
    meet = -math.sqrt(PADDLE**2 - NECK**2)
    low, high = occ.addPoint(ROOT, -NECK, z), occ.addPoint(ROOT, NECK, z)
    after, before = occ.addPoint(meet, -NECK, z), occ.addPoint(meet, NECK, z)
    centre, tip = occ.addPoint(0, 0, z), occ.addPoint(PADDLE, 0, z)
    curves = [
        occ.addLine(high, low),
        occ.addLine(low, after),
        occ.addCircleArc(after, centre, tip),
        occ.addCircleArc(tip, centre, before),
        occ.addLine(before, high),
    ]
    face = occ.addPlaneSurface([occ.addCurveLoop(curves)])
    return [each for each in occ.extrude([(2, face)], 0, 0, THICKNESS) if each[0] == 3]


def stay(occ: Any, bodies: Bodies) -> None:
    """Leave bodies where they are drawn."""


@contextmanager
def drawing() -> Iterator[Any]:
    """Yield gmsh's OpenCASCADE model of an own session."""
    gmsh.initialize([], readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    try:
        yield gmsh.model.occ
    finally:
        gmsh.finalize()


def write(path: Path, part: Callable[[Any], Bodies], move: Move = stay) -> None:
    """Write one part to a STEP file, moved."""
    with drawing() as occ:
        move(occ, part(occ))
        occ.synchronize()
        gmsh.write(str(path))


def main(folder: Path) -> None:
    """Write both parts."""
    write(folder / "assembly_plate.step", plate)
    write(folder / "assembly_flapper.step", flapper)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
