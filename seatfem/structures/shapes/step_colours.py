"""Paints faces and solids in a STEP file: OpenCASCADE as gmsh builds it writes solids without colours."""

from __future__ import annotations

import re
from collections.abc import Mapping
from types import MappingProxyType

from seatfem.structures.errors import GeometryError
from seatfem.structures.shapes.faces import Colour


def paint(step: str, faces: Mapping[int, Colour], solids: Mapping[int, Colour] = MappingProxyType({})) -> str:
    """Return the STEP text with colours given to faces and solids, both counted from 1 in the order of the file's
    solids.

    ISO 10303-21 text, presentation entities of ISO 10303-46 (STYLED_ITEM and what it points to); alpha is dropped.
    """
    shells = dict(re.findall(r"(#\d+)\s*=\s*CLOSED_SHELL\s*\('[^']*',\s*\(([^)]*)\)\)", step))
    breps = re.findall(r"(#\d+)\s*=\s*MANIFOLD_SOLID_BREP\s*\('[^']*',\s*(#\d+)\)", step)
    representations = re.findall(r"ADVANCED_BREP_SHAPE_REPRESENTATION\s*\('[^']*',\s*\(([^)]*)\),\s*(#\d+)\)", step)
    if not breps or len(breps) != len(shells):
        raise GeometryError(
            f"a STEP file to be painted needs a closed shell for each solid, has {len(shells)} and {len(breps)}"
        )
    entities = _Entities(first=1 + max(int(n) for n in re.findall(r"^#(\d+)\s*=", step, re.MULTILINE)))
    counted = 0
    for number, (brep, shell) in enumerate(breps, 1):
        own = re.findall(r"#\d+", shells[shell])
        painted = {brep: solids[number]} if number in solids else {}
        painted |= {face: faces[counted + k] for k, face in enumerate(own, 1) if counted + k in faces}
        counted += len(own)
        items = [_styled_item(entities, item, colour) for item, colour in painted.items()]
        context = next(context for members, context in representations if brep in re.findall(r"#\d+", members))
        if items:
            entities.add(f"MECHANICAL_DESIGN_GEOMETRIC_PRESENTATION_REPRESENTATION('',({','.join(items)}),{context})")
    head, end, tail = step.rpartition("ENDSEC;")
    return head + entities.text() + end + tail


class _Entities:
    """Numbered lines to be appended to the DATA section."""

    def __init__(self, first: int) -> None:
        self._first = first
        self._lines: list[str] = []

    def add(self, definition: str) -> str:
        name = f"#{self._first + len(self._lines)}"
        self._lines.append(f"{name} = {definition};\n")
        return name

    def text(self) -> str:
        return "".join(self._lines)


def _styled_item(entities: _Entities, item: str, colour: Colour) -> str:
    red, green, blue = (f"{c / 255:.6g}" for c in colour[:3])
    red, green, blue = (c if "." in c else c + "." for c in (red, green, blue))
    rgb = entities.add(f"COLOUR_RGB('',{red},{green},{blue})")
    fill = entities.add(f"FILL_AREA_STYLE_COLOUR('',{rgb})")
    area = entities.add(f"FILL_AREA_STYLE('',({fill}))")
    style = entities.add(f"SURFACE_STYLE_FILL_AREA({area})")
    side = entities.add(f"SURFACE_SIDE_STYLE('',({style}))")
    usage = entities.add(f"SURFACE_STYLE_USAGE(.BOTH.,{side})")
    assignment = entities.add(f"PRESENTATION_STYLE_ASSIGNMENT(({usage}))")
    return entities.add(f"STYLED_ITEM('color',({assignment}),{item})")
