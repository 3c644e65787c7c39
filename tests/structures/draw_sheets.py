"""STEP files that hold a flat reed, or something else: python draw_sheets.py FOLDER (gmsh keeps to its own process)."""

import sys
from pathlib import Path

import gmsh

from seatfem.structures.shapes import Flapper


def rectangle() -> None:
    """Draw 20 mm by 8 mm in the plane x = 3 mm, with y and z as coordinates, and a hole of 2 mm at (14, 0) mm."""
    occ = gmsh.model.occ
    occ.cut([(2, occ.addRectangle(0, -4, 0, 20, 8))], [(2, occ.addDisk(14, 0, 0, 2, 2))])
    occ.rotate(occ.getEntities(2), 0, 0, 0, 1, 1, 1, 2.0943951023931953)  # x -> y -> z
    occ.translate(occ.getEntities(2), 3, 0, 0)


def slotted() -> None:
    """Draw a flapper with a slot in its neck and a hole in its paddle."""
    shape = Flapper(8e-3, 2e-3, 6e-3, 15e-3, 16e-3, 0.3e-3, slot_width=2e-3, slot_length=8e-3, hole_diameter=6e-3)
    shape.build(gmsh.model.occ)


def ellipse() -> None:
    occ = gmsh.model.occ
    occ.addDisk(0, 0, 0, 12, 5)


def oblique() -> None:
    occ = gmsh.model.occ
    occ.rotate([(2, occ.addRectangle(0, -4, 0, 20, 8))], 0, 0, 0, 1, 0, 0, 0.3)


def two_faces() -> None:
    occ = gmsh.model.occ
    occ.addRectangle(0, -4, 0, 20, 8)
    occ.addRectangle(40, -4, 0, 20, 8)


def two_solids() -> None:
    occ = gmsh.model.occ
    occ.addBox(0, -4, 0, 20, 8, 1)
    occ.addBox(40, -4, 0, 20, 8, 1)


def conical() -> None:
    gmsh.model.occ.addCone(0, 0, 0, 0, 0, 1, 10, 8)


def bent() -> None:
    occ = gmsh.model.occ
    occ.extrude([(1, occ.addCircle(0, 0, 0, 9, angle1=0, angle2=1))], 0, 0, 8)


def wire() -> None:
    occ = gmsh.model.occ
    occ.addLine(occ.addPoint(0, 0, 0), occ.addPoint(9, 0, 0))


def main(folder: Path) -> None:
    gmsh.initialize([], readConfigFiles=False)
    gmsh.option.setNumber("General.Terminal", 0)
    for draw in (rectangle, slotted, ellipse, oblique, two_faces, two_solids, conical, bent, wire):
        gmsh.clear()
        draw()
        gmsh.model.occ.synchronize()
        gmsh.write(str(folder / f"{draw.__name__}.step"))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
