"""`python write_mesh_files.py FOLDER`: a quarter ring 1 <= r <= 2, 0 <= z <= 1 in every format gmsh writes with names.

Files are called SHAPE-ORDER-N.FORMAT, N elements along the quarter; "contact" is the face z = 1, "fixed" z = 0.
"""

import math
import sys
from pathlib import Path

import gmsh

MSH = {"msh2.msh": (2.2, 0), "msh2bin.msh": (2.2, 1), "msh4.msh": (4.1, 0), "msh4bin.msh": (4.1, 1)}
OTHERS = ("unv", "med", "inp", "bdf")


def quarter_ring(shape: str, order: int, n: int) -> None:
    gmsh.clear()
    gmsh.option.setNumber("Mesh.SecondOrderIncomplete", int(shape == "hex20"))
    hexes = shape != "tet"
    occ, mesh = gmsh.model.occ, gmsh.model.mesh
    layers = {"numElements": [n], "recombine": True} if hexes else {}
    line = occ.addLine(occ.addPoint(1, 0, 0), occ.addPoint(2, 0, 0))
    swept = occ.revolve([(1, line)], 0, 0, 0, 0, 0, 1, math.pi / 2, **layers)
    [base] = [tag for dimension, tag in swept if dimension == 2]
    solid = occ.extrude([(2, base)], 0, 0, 1, **(layers | {"numElements": [1]} if hexes else {}))
    occ.synchronize()
    for _, curve in gmsh.model.getEntities(1):
        arc = gmsh.model.getType(1, curve) == "Circle"
        mesh.setTransfiniteCurve(curve, n + 1 if arc else 2)
    for _, surface in gmsh.model.getEntities(2):
        mesh.setTransfiniteSurface(surface)
        if hexes:
            mesh.setRecombine(2, surface)
    top, [body] = solid[0][1], [tag for dimension, tag in solid if dimension == 3]
    gmsh.model.addPhysicalGroup(2, [top], name="contact")
    gmsh.model.addPhysicalGroup(2, [base], name="fixed")
    gmsh.model.addPhysicalGroup(3, [body], name="steel")
    mesh.generate(3)
    if order == 2:
        mesh.setOrder(2)


def main(folder: Path) -> None:
    gmsh.initialize([], readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    for shape, order in (("tet", 1), ("tet", 2), ("hex", 1), ("hex", 2), ("hex20", 2)):
        quarter_ring(shape, order, 2)
        for ending, (version, binary) in MSH.items():
            gmsh.option.setNumber("Mesh.MshFileVersion", version)
            gmsh.option.setNumber("Mesh.Binary", binary)
            gmsh.write(str(folder / f"{shape}-{order}-2.{ending}"))
        gmsh.option.setNumber("Mesh.Binary", 0)
        for ending in OTHERS:
            gmsh.write(str(folder / f"{shape}-{order}-2.{ending}"))
        quarter_ring(shape, order, 4)
        gmsh.write(str(folder / f"{shape}-{order}-4.inp"))
    gmsh.finalize()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
