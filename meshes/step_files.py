"""STEP files of the families, and the colours of faces in such files: python meshes/step_files.py FOLDER (run by
make_meshes.py)."""

import re
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

import gmsh

from seatfem.structures.shapes import AnnularSeat, Bar, Block, ConicalSeat, Flapper, Geometry, Stopper, ValvePlate
from seatfem.structures.shapes.inspect import patch_tags
from seatfem.structures.shapes.selectors import CONTACT_COLOUR, FIXED_COLOUR, Colour

MILLIMETRE = 1e-3
COLOURS = {"contact": CONTACT_COLOUR, "fixed": FIXED_COLOUR}
FAMILIES = {
    "annular_seat": AnnularSeat(),
    "flat_seat": AnnularSeat(lip_height=0.0, lip_edge_radius=0.0),
    "conical_seat": ConicalSeat(contact_width=1e-3),
    "valve_plate": ValvePlate(),
    "reed_plate": ValvePlate(ports=3, layout="row"),
    "stopper": Stopper(),
    "domed_stopper": Stopper(dome_radius=20e-3),
    "bar": Bar(length=30e-3, width=3e-3, height=3e-3),
    "flapper": Flapper(
        root_width=8e-3,
        taper_length=2e-3,
        neck_width=6e-3,
        neck_length=15e-3,
        paddle_diameter=16e-3,
        thickness=0.3e-3,
    ),
    "block": Block(width=20e-3, depth=16e-3, thickness=8e-3, patch_width=3e-3, patch_depth=2e-3),
}


def paint(step: str, faces: Mapping[int, Colour], solids: Mapping[int, Colour] = MappingProxyType({})) -> str:
    """Return the STEP text with colours given to faces and solids, both counted from 1 in the order of the file's
    solids.

    ISO 10303-21 text, presentation entities of ISO 10303-46 (STYLED_ITEM and what it points to); alpha is dropped.
    """
    shells = dict(re.findall(r"(#\d+)\s*=\s*CLOSED_SHELL\s*\('[^']*',\s*\(([^)]*)\)\)", step))
    breps = re.findall(r"(#\d+)\s*=\s*MANIFOLD_SOLID_BREP\s*\('[^']*',\s*(#\d+)\)", step)
    representations = re.findall(r"ADVANCED_BREP_SHAPE_REPRESENTATION\s*\('[^']*',\s*\(([^)]*)\),\s*(#\d+)\)", step)
    if not breps or len(breps) != len(shells):
        raise ValueError(
            f"a STEP file to be painted needs a closed shell for each solid, has {len(shells)} and {len(breps)}"
        )
    first, lines = 1 + max(int(n) for n in re.findall(r"^#(\d+)\s*=", step, re.MULTILINE)), list[str]()

    def add(definition: str) -> str:
        lines.append(f"#{first + len(lines)} = {definition};\n")
        return lines[-1].partition(" ")[0]

    counted = 0
    for number, (brep, shell) in enumerate(breps, 1):
        own = re.findall(r"#\d+", shells[shell])
        painted = {brep: solids[number]} if number in solids else {}
        painted |= {face: faces[counted + k] for k, face in enumerate(own, 1) if counted + k in faces}
        counted += len(own)
        items = [_styled_item(add, item, colour) for item, colour in painted.items()]
        context = next(context for members, context in representations if brep in re.findall(r"#\d+", members))
        if items:
            add(f"MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION('',({','.join(items)}),{context})")
    head, end, tail = step.rpartition("ENDSEC;")
    return head + "".join(lines) + end + tail


def _styled_item(add: Callable[[str], str], item: str, colour: Colour) -> str:
    channels = (f"{c / 255:.6g}" for c in colour[:3])
    name = add(f"COLOUR_RGB('',{','.join(c if '.' in c else c + '.' for c in channels)})")
    for wrapped in (
        "FILL_AREA_STYLE_COLOUR('',{})",
        "FILL_AREA_STYLE('',({}))",
        "SURFACE_STYLE_FILL_AREA({})",
        "SURFACE_SIDE_STYLE('',({}))",
        "SURFACE_STYLE_USAGE(.BOTH.,{})",
        "PRESENTATION_STYLE_ASSIGNMENT(({}))",
    ):
        name = add(wrapped.format(name))
    return add(f"STYLED_ITEM('color',({name}),{item})")


def write(geometry: Geometry, path: Path) -> None:
    """Write a geometry in millimetres, "contact" painted red and "fixed" blue: `CadPart`'s default colours."""
    gmsh.clear()
    geometry.build(gmsh.model.occ)
    gmsh.model.occ.synchronize()
    gmsh.write(str(path))
    # The order of faces is the file's, not that of the model it came from: they are selected in what was written.
    gmsh.clear()
    gmsh.model.occ.importShapes(str(path))
    gmsh.model.occ.synchronize()
    tags = patch_tags(gmsh.model, geometry.patches, MILLIMETRE)
    colours = {tag: COLOURS[name] for name, faces in tags.items() if name in COLOURS for tag in faces}
    path.write_text(paint(path.read_text(encoding="ascii"), colours), encoding="ascii")


def main(folder: Path) -> None:
    gmsh.initialize([], readConfigFiles=False, interruptible=False)
    gmsh.option.setNumber("General.Terminal", 0)
    for name, geometry in FAMILIES.items():
        write(geometry, folder / f"{name}.step")
    gmsh.finalize()


if __name__ == "__main__":
    main(Path(sys.argv[1]))
