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
    from seatfem.structures.kinds.structure import Finding, Structure
    from seatfem.study.scene.contact import Contact


def check_files(scene: Scene) -> None:
    """Open what the scene names, and look for the faces, groups and regions that it speaks of.

    Raises `SceneError`: all that is wrong, by key; `seatfem.study.scene.located` adds the scene's file and its lines.
    """
    contact, stopper = scene.contact, scene.stopper
    findings = [((role, *path), text) for role, body in scene.bodies.items() for path, text in body.problems()]
    if not findings and (key := contact.along_a_lip or ("ports" if contact.ports else "")):
        findings += _of_lip(contact, scene.seat, key)
    if not findings and stopper is not None and stopper.parts != Division():
        try:
            stopper.body.lip()
        except ModelError as error:
            findings.append((("stopper", "arcs"), _naming_file(stopper.body, error)))
    if not findings:
        findings += misplaced(scene)
    if findings:
        raise SceneError(tuple(Problem(None, 0, ".".join(map(str, path)), text, path) for path, text in findings))


def _of_lip(contact: Contact, seat: Structure, key: str) -> Iterator[Finding]:
    """Yield what of [contact], in which a ``key`` asks for a lip, does not fit the seat."""
    try:
        lip, arcs = seat.lip(1, contact.rings), contact.ports or 1
    except ModelError as error:
        yield ("contact", key), _naming_file(seat, error)
        return
    if lip is not None and arcs > 1 and (whole := lip.whole(arcs)) != arcs:
        text = f"of {arcs} segments of equal areas some would lie on two of the seat's faces; take {whole}"
        yield ("contact", "ports"), text
    if lip is not None and contact.waviness and lip.edges is None:
        yield ("contact", "waviness"), NO_ANGLES


def _naming_file(body: Structure, error: ModelError) -> str:
    return next((naming(file, str(error)) for file in body.files()), str(error))


def part_of_scene(path: Path) -> Part:
    """Return the faces of a scene's seat. Raises `GeometryError` for a seat that has none, `SceneError`."""
    seat = load_scene(path).seat
    if seat.elastic is None:
        raise GeometryError(f"{path}: seat.kind = {seat.kind!r} has no faces; take a cad, mesh or drawn seat")
    return seat.elastic.part()
