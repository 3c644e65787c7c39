"""Three parts in one coordinate system, in mm: python benchmarks/valve_parts.py FOLDER.

``plate.step``: a valve plate with a raised lip, clamped at its underside. ``reed.step``: a straight reed above it.
``stopper.step``: a block whose underside limits the lift.
"""

import sys
from pathlib import Path
from typing import Final

import gmsh

LIP: Final = (3.0, 4.0)  # inner and outer radius, about the origin
TOP: Final = 5.4  # height of the lip
REED: Final = (-20.0, 6.0, 10.0, 0.25)  # beginning and end along x, width, thickness
GAP: Final = 0.03  # between lip and reed
STOPPER: Final = 4.0  # half the sides of its face, about the origin
LIFT: Final = 0.4  # from the reed as it is drawn to the stopper


def main(folder: Path) -> None:
    """Write the three files."""
    begin, end, width, thickness = REED
    below = TOP + GAP
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    occ = gmsh.model.occ
    for name in ("plate", "reed", "stopper"):
        gmsh.clear()
        if name == "plate":
            body = [(3, occ.addBox(-26, -14, 0, 40, 28, 5))]
            solid = occ.fuse(body, [(3, occ.addCylinder(0, 0, 0, 0, 0, TOP, LIP[1]))])[0]
            occ.cut(solid, [(3, occ.addCylinder(0, 0, 0, 0, 0, TOP, LIP[0]))])
        elif name == "reed":
            occ.addBox(begin, -width / 2, below, end - begin, width, thickness)
        else:
            occ.addBox(-STOPPER, -STOPPER, below + thickness + LIFT, 2 * STOPPER, 2 * STOPPER, 5)
        occ.synchronize()
        gmsh.write(str(folder / f"{name}.step"))
    gmsh.finalize()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
