"""The files that a scene names, opened and checked before anything is planned: all that is wrong at once."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from seatfem.structures.errors import ModelError
from seatfem.structures.inspection.opened import naming
from seatfem.structures.rings import Division
from seatfem.structures.shapes import GeometryError
from seatfem.study.scene.lips import NO_ANGLES
from seatfem.study.scene.load import load_scene
from seatfem.study.scene.models import Scene
from seatfem.study.scene.places import misplaced
from seatfem.study.scene.problems import Problem, SceneError

if TYPE_CHECKING:
    from seatfem.structures.inspection.parts import Part
    from seatfem.structures.kinds.structure import Finding
    from seatfem.structures.lip import AnyLip


def check_files(scene: Scene) -> None:
    """Open what the scene names, and look for the faces, groups and regions that it speaks of.

    Raises:
        SceneError: all that is wrong, by key; `seatfem.study.scene.located` adds the scene's file and its lines.
    """
    findings = [((role, *path), text) for role, body in scene.bodies.items() for path, text in body.problems()]
    if not findings and (key := scene.contact.along_a_lip or ("ports" if scene.contact.ports else "")):
        try:
            findings += _of_lip(scene, scene.seat.lip(1, scene.contact.rings))
        except ModelError as error:
            message = next((naming(file, str(error)) for file in scene.seat.files()), str(error))
            findings.append((("contact", key), message))
    if not findings and scene.stopper is not None and scene.stopper.parts != Division():
        try:
            scene.stopper.body.lip()
        except ModelError as error:
            message = next((naming(file, str(error)) for file in scene.stopper.body.files()), str(error))
            findings.append((("stopper", "arcs"), message))
    if not findings:
        findings += misplaced(scene)
    if findings:
        raise SceneError(tuple(Problem(None, 0, ".".join(map(str, path)), text, path) for path, text in findings))


def _of_lip(scene: Scene, lip: AnyLip | None) -> Iterator[Finding]:
    """Yield what of [contact] does not fit the seat's lip."""
    arcs = scene.contact.ports or 1
    if lip is not None and arcs > 1 and (whole := lip.whole(arcs)) != arcs:
        text = f"of {arcs} segments of equal areas some would lie on two of the seat's faces; take {whole}"
        yield ("contact", "ports"), text
    if lip is not None and scene.contact.waviness and lip.edges is None:
        yield ("contact", "waviness"), NO_ANGLES


def part_of_scene(path: Path) -> Part:
    """Return the faces of a scene's seat. Raises `GeometryError` for a seat that has none, `SceneError`."""
    seat = load_scene(path).seat
    if seat.elastic is None:
        raise GeometryError(f"{path}: seat.kind = {seat.kind!r} has no faces; take a cad, mesh or drawn seat")
    return seat.elastic.part()
