"""Five parts as CAD programs export them: python meshes/cad_parts.py FOLDER (run by make_meshes.py).

``valve_body.step``: a seat in a housing with filleted shoulder and four bolt holes. ``insert_seat.step``: a hard ring
pressed into a softer body: two solids, each of its own colour. ``slot_seat.step``: a slot with a raised lip around it.
``kidney_seat.step``: a kidney-shaped port with such a lip. ``retainer.step``: a bar with a face curved along it.
"""

import math
import sys
from pathlib import Path
from typing import Any

import gmsh
from step_files import paint

from seatfem.structures.shapes import CONTACT_COLOUR, FIXED_COLOUR
from seatfem.structures.shapes.inspect import faces_of
from seatfem.structures.shapes.selectors import Colour, Face

MILLIMETRE = 1e-3
BODY_COLOUR: Colour = (128, 128, 128, 255)
INSERT_COLOUR: Colour = (255, 170, 0, 255)


def valve_body(occ: Any) -> None:
    """Flange of 40 mm with four bolt holes, filleted boss of 20 mm, bore of 8 mm; millimetres."""
    flange = occ.addCylinder(0, 0, 0, 0, 0, 8, 20)
    boss = occ.addCylinder(0, 0, 8, 0, 0, 6, 10)
    solid = occ.fuse([(3, flange)], [(3, boss)])[0][0][1]
    occ.synchronize()
    corner = [tag for _, tag in gmsh.model.getEntities(1) if _circle(tag, 10.0, 8.0)]
    solid = occ.fillet([solid], corner, [1.5])[0][1]
    holes = [(3, occ.addCylinder(x, y, 0, 0, 0, 8, 2.25)) for x, y in ((15, 0), (0, 15), (-15, 0), (0, -15))]
    occ.cut([(3, solid)], [*holes, (3, occ.addCylinder(0, 0, 0, 0, 0, 14, 4))])


def insert_seat(occ: Any) -> None:
    """Body of 24 mm, 9 mm high; ring of 16 mm, 3 mm high, in its top; bore of 8 mm; millimetres."""
    body, pocket = occ.addCylinder(0, 0, 0, 0, 0, 9, 12), occ.addCylinder(0, 0, 6, 0, 0, 3, 8)
    bore = occ.addCylinder(0, 0, 0, 0, 0, 9, 4)
    occ.cut([(3, body)], [(3, pocket), (3, bore)])
    ring, hole = occ.addCylinder(0, 0, 6, 0, 0, 3, 8), occ.addCylinder(0, 0, 6, 0, 0, 3, 4)
    occ.cut([(3, ring)], [(3, hole)])


def slot_seat(occ: Any) -> None:
    """Plate of 30 by 24 mm, 6 mm thick; slot of 10 by 5 mm with a lip around it, 1 mm wide and high; millimetres."""
    plate, lip = occ.addBox(-15, -12, 0, 30, 24, 6), _slot(occ, 3.5, 7)
    solid = occ.fuse([(3, plate)], [lip])[0]
    occ.cut(solid, [_slot(occ, 2.5, 7)])


def _slot(occ: Any, radius: float, height: float) -> tuple[int, int]:
    """Of this radius about both ends of a line of 5 mm along x, from z = 0 upwards."""
    ends = [(x, y) for x, y in ((2.5, -radius), (2.5, radius), (-2.5, radius), (-2.5, -radius))]
    a, b, c, d = (occ.addPoint(x, y, 0) for x, y in ends)
    right, left = (occ.addPoint(x, 0, 0) for x in (2.5 + radius, -2.5 - radius))
    centres = [occ.addPoint(x, 0, 0) for x in (2.5, -2.5)]
    round_right = [occ.addCircleArc(a, centres[0], right), occ.addCircleArc(right, centres[0], b)]
    round_left = [occ.addCircleArc(c, centres[1], left), occ.addCircleArc(left, centres[1], d)]
    loop = occ.addCurveLoop([*round_right, occ.addLine(b, c), *round_left, occ.addLine(d, a)])
    return next(entity for entity in occ.extrude([(2, occ.addPlaneSurface([loop]))], 0, 0, height) if entity[0] == 3)


def kidney_seat(occ: Any) -> None:
    """Plate of 30 by 24 mm, 6 mm thick; kidney-shaped port, 2.4 mm wide about an arc of 4.5 mm radius over 150 degrees,
    with a lip around it, 1 mm wide and high; millimetres."""
    plate, lip = occ.addBox(-15, -12, 0, 30, 24, 6), _kidney(occ, 2.2, 7)
    solid = occ.fuse([(3, plate)], [lip])[0]
    occ.cut(solid, [_kidney(occ, 1.2, 7)])


def _kidney(occ: Any, radius: float, height: float) -> tuple[int, int]:
    """Of this radius about an arc from z = 0 upwards, symmetric about y = 0, its middle at x = 3 mm."""
    bend, half, to = 4.5, math.radians(75), 3.0 - 4.5
    outer, inner = bend + radius, bend - radius
    rays = [(math.cos(a), math.sin(a)) for a in (-half, 0.0, half)]
    centre = occ.addPoint(to, 0, 0)
    far, near = ([occ.addPoint(to + r * x, r * y, 0) for x, y in rays] for r in (outer, inner))
    middles = [occ.addPoint(to + bend * x, bend * y, 0) for x, y in rays]
    ends = [(bend * x + s * radius * y, bend * y - s * radius * x) for (x, y), s in ((rays[0], 1), (rays[2], -1))]
    low, high = (occ.addPoint(to + x, y, 0) for x, y in ends)
    curves = [occ.addCircleArc(far[k], centre, far[k + 1]) for k in (0, 1)]
    curves += [occ.addCircleArc(far[2], middles[2], high), occ.addCircleArc(high, middles[2], near[2])]
    curves += [occ.addCircleArc(near[k], centre, near[k - 1]) for k in (2, 1)]
    curves += [occ.addCircleArc(near[0], middles[0], low), occ.addCircleArc(low, middles[0], far[0])]
    face = occ.addPlaneSurface([occ.addCurveLoop(curves)])
    return next(entity for entity in occ.extrude([(2, face)], 0, 0, height) if entity[0] == 3)


def retainer(occ: Any) -> None:
    """Bar of 30 by 10 mm, 8 mm thick at the clamp, its upper face curved by a radius of 200 mm; millimetres."""
    bar, curve = occ.addBox(0, -5, 0, 30, 10, 8), occ.addCylinder(0, -6, -192, 0, 12, 0, 200)
    occ.intersect([(3, bar)], [(3, curve)])


def _circle(curve: int, radius: float, z: float) -> bool:
    x0, _, z0, x1, _, z1 = gmsh.model.getBoundingBox(1, curve)
    return abs((x1 - x0) / 2 - radius) < 1e-3 and abs(z0 - z) < 1e-3 and abs(z1 - z) < 1e-3


def _is_flat(face: Face, z: float, up: float) -> bool:
    return face.normal is not None and face.normal[2] * up > 0.99 and abs(face.centre[2] - z) < 1e-6


def write(path: Path, contact_z: float, solids: dict[int, Colour]) -> None:
    """Write the model's solids, paint them and their faces: struck on top, clamped underneath."""
    gmsh.write(str(path))
    gmsh.clear()
    gmsh.model.occ.importShapes(str(path))
    gmsh.model.occ.synchronize()
    found = faces_of(gmsh.model, MILLIMETRE)
    struck = [face for face in found if _is_flat(face, contact_z, 1.0)] or [each for each in found if not each.normal]
    faces = {face.tag: CONTACT_COLOUR for face in struck}
    faces |= {face.tag: FIXED_COLOUR for face in faces_of(gmsh.model, MILLIMETRE) if _is_flat(face, 0.0, -1.0)}
    if solids:  # only the ring is struck
        faces = {tag: colour for tag, colour in faces.items() if colour == FIXED_COLOUR or _on_second_solid(tag)}
    path.write_text(paint(path.read_text(encoding="ascii"), faces, solids), encoding="ascii")


def _on_second_solid(face: int) -> bool:
    return int(gmsh.model.getAdjacencies(2, face)[0][0]) == 2


def main(folder: Path) -> None:
    gmsh.initialize([], readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    valve_body(gmsh.model.occ)
    gmsh.model.occ.synchronize()
    write(folder / "valve_body.step", 14e-3, {})
    gmsh.clear()
    insert_seat(gmsh.model.occ)
    gmsh.model.occ.synchronize()
    write(folder / "insert_seat.step", 9e-3, {1: BODY_COLOUR, 2: INSERT_COLOUR})
    gmsh.clear()
    slot_seat(gmsh.model.occ)
    gmsh.model.occ.synchronize()
    write(folder / "slot_seat.step", 7e-3, {})
    gmsh.clear()
    kidney_seat(gmsh.model.occ)
    gmsh.model.occ.synchronize()
    write(folder / "kidney_seat.step", 7e-3, {})
    gmsh.clear()
    retainer(gmsh.model.occ)
    gmsh.model.occ.synchronize()
    write(folder / "retainer.step", math.inf, {})
    gmsh.finalize()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
