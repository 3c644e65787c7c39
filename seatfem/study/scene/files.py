"""The files of a scene: checks of them, and of how reed and seat lie, before planning; portable copies; hashes."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from pydantic import BaseModel

from impact.quantities import in_digits, percent
from seatfem.fields import KeyProblem
from seatfem.jobs.crew import FILES
from seatfem.structures import cache, errors, lands, outlines, rings
from seatfem.structures.formats import mesh_files
from seatfem.structures.inspection import cad
from seatfem.structures.kinds.structure import Finding, Structure
from seatfem.structures.lip import Lip
from seatfem.structures.shapes.loops import distances
from seatfem.study.scene import lips, load, models, problems, tables
from seatfem.study.scene.contradictions import overlaps_with_profile
from seatfem.study.scene.problems import Problem, SceneError
from seatfem.study.scene.wings import tables_in_files

PLATE: Final = 0.97  # least share of a ring of revolution under a plate, with an allowance for chords and sampling


def misplaced(geometry: lips.ContactGeometry, *, as_drawn: bool) -> Iterator[Finding]:
    """Yield a problem if the reed, in plan, does not cover enough of the seat's contact face.

    ``as_drawn``: whether the relative position follows from CAD files.
    """
    contact, reed, seat = geometry.contact, geometry.reed, geometry.seat
    if not reed.least_cover:
        return
    try:
        views, face = reed.views_at(geometry.own_place, coarse=True), seat.views(coarse=True)
    except errors.ModelError:  # missing faces are reported elsewhere
        return
    over = views.turned_over()
    if (share := outlines.covered_share(face, over, contact.offset)) is None:
        return
    in_parts, limit = _too_little(geometry, views, share)
    if not limit:
        return
    reach = 1e3 * max(float(np.hypot(*loop.T).max()) for loop in face.contact)
    part = f"{percent(share)} of the seat's struck face, which reaches {reach:.4g} mm from its middle"
    words = f"in plan the reed{', as drawn,' if as_drawn else ''} covers {part} ({limit}); the reed"
    if in_parts:
        room = 1e3 * min(distances(loop, np.roll(loop, -1, axis=0), np.zeros((1, 2))).min() for loop in over.plan)
        words = f"{words} has {in_digits(room, 2)} mm about that of its contact:"
        if as_drawn:
            text = f"{words} move one of the parts in the CAD program, or take a wider reed or a smaller lip"
            yield ("assembly", "placed"), text
            return
        x, y = (1e3 * each for each in contact.offset)
        text = f"[{x:.4g} mm, {y:.4g} mm]: {words} change the offset, or reed and seat, until the reed covers the lip"
        yield ("contact", "offset"), text
    else:
        length, width = (1e3 * float(side) for side in np.subtract(*over.extent[::-1]))
        words = f"{words}, {length:.4g} x {width:.4g} mm, lies beside the port:"
        if contact.at is not None:
            text = f"{1e3 * contact.at:.4g} mm: {words} move the contact, or take a wider reed or a smaller port"
            yield ("contact", "at"), text
        else:
            yield ("reed",), f"{words} take a wider reed or a smaller port, or state contact.at"


def _too_little(geometry: lips.ContactGeometry, reed: outlines.BodyViews, share: float) -> tuple[bool, str]:
    """Return whether the reed meets the struck face in parts, and the limit that it passes on a share of it; "" if it
    meets enough."""
    contact, least = geometry.contact, geometry.reed.least_cover
    region = None
    if contact.lip_key or not geometry.reed.states_contact:
        try:
            region = geometry.reed.meets(geometry.overlap(geometry.seat))
        except lands.UncoveredError as error:
            return True, str(error)
        except errors.ModelError:  # no lip: reported elsewhere
            return True, ""
    if region is None:
        return False, "" if share >= least else f"limit: {percent(least)}"
    if not isinstance(region, lands.FaceLip):
        return True, "" if share >= PLATE else "limit: all of it"
    points = region.lines_across(2).reshape(-1, 2) + contact.offset
    thickness = -reed.heights[0]
    near = any(distances(line[:-1], line[1:], points).min() < thickness for line in reed.turned_over().clamp)
    return True, f"up to its clamp; limit: {1e3 * thickness:.3g} mm away, its thickness" if near else ""


def check_files(scene: models.Scene) -> None:
    """Open the files of the scene, and check the faces, groups and regions that it names.

    Raises `SceneError` with all problems by key, or of a face that is no lip; `seatfem.study.scene.located` adds the
    scene's file and lines.
    """
    contact, stopper = scene.contact, scene.stopper
    findings = [((role, *path), text) for role, body in scene.bodies.items() for path, text in body.problems()]
    if not findings and (key := contact.lip_key or ("ports" if contact.ports else "")):
        findings += _find_lip_problems(scene.geometry, scene.seat, "contact", key)
    is_flat = stopper is not None and stopper.profile is None
    if not findings and stopper is not None and is_flat:
        findings += _not_flat(stopper.body)
    if not findings and stopper is not None and is_flat and stopper.parts != rings.Division():
        findings += _find_lip_problems(scene.geometry, stopper.body, "stopper", "arcs")
    if not findings and scene.geometry.retainer is not None:
        try:
            findings += [(tuple(key.split(".")), text) for key, text in overlaps_with_profile(scene.geometry)]
        except KeyProblem as problem:
            findings += [(tuple(problem.key.split(".")), str(problem))]
    if not findings:
        findings += lips.or_diameter(scene.geometry, partial(misplaced, as_drawn=scene.assembly is not None))
    if not findings:
        scene.geometry.region()  # refuse faces that a plate cannot meet
        ports = len(scene.geometry.port_points()) or 1 if scene.driven_by else 1
        findings += [
            ((each.table, *key.split(".")), text) for each in scene.driven_by for key, text in each.check_ports(ports)
        ]
        findings += _beyond_the_reed(scene.geometry)
    if findings:
        raise SceneError(tuple(Problem(None, 0, ".".join(map(str, path)), text) for path, text in findings))


def _beyond_the_reed(geometry: lips.ContactGeometry) -> Iterator[Finding]:
    """Yield a problem if the ring or disc of a stopper of revolution, which is met all round, reaches off a plate."""
    if geometry.stopper is None or not isinstance(geometry.place_behind_reed(), Lip):
        return
    over, face = geometry.reed.views_at(geometry.own_place, coarse=True), geometry.stopper.body.views(coarse=True)
    share = outlines.covered_share(face, over, (0.0, 0.0))
    if share is not None and share < PLATE:
        yield (
            ("stopper",),
            f"in plan its struck face has {percent(share)} of its area behind the reed (limit: all of it, of a body of "
            "revolution): take a smaller stopper, or a part of kind cad, whose rings and strips are met as far as the "
            "reed reaches; or state the reed's own face, reed.contact_radius",
        )


def _not_flat(stopper: Structure) -> Iterator[Finding]:
    """Yield a problem if the struck face of a stopper from a file is not flat: the gap is known of all of it as one.

    The limit is that of lands: a reed passes the rise of a face of 10 mm, 10 um, at 1 m/s within a landing, some 10 us.
    """
    rise, size = (1e3 * each for each in stopper.rise())
    if rise > lands.FLAT * size:
        yield (
            ("stopper", "contact"),
            f"this face of {stopper.files()[0].name} is not flat: it rises by {rise:.3g} mm over {size:.3g} mm (limit "
            f"{lands.FLAT * size:.2g} mm); state stopper.profile = {{ own_face = true }}, on which the reed rolls from "
            "its clamp on, or choose a flat face",
        )


def _find_lip_problems(geometry: lips.ContactGeometry, body: Structure, table: str, key: str) -> Iterator[Finding]:
    """Yield problems if a body has no lip although ``key`` needs one, or keys of [contact] do not fit the seat."""
    contact, lip = geometry.contact, None
    try:
        lip = body.region()
        lip = geometry.overlap(body)
    except errors.ModelError as error:
        if lip is None or table == "stopper":  # what the reed leaves of a seat is told by `misplaced`
            yield (table, key), next((cad.naming(file, str(error)) for file in body.files()), str(error))
            return
    if table != "contact":
        return
    if lip is not None and (arcs := contact.ports or 1) > 1 and (whole := lip.whole(arcs)) != arcs:
        text = f"of {arcs} segments of equal areas some would lie on two of the seat's faces; take {whole}"
        yield ("contact", "ports"), text
    if lip is not None and contact.waviness and not len(lip.edges):
        yield ("contact", "waviness"), lips.NO_ANGLES


def part_of_scene(path: Path) -> cad.Part:
    """Return the faces of a scene's seat. Raises `GeometryError` if it has none, or `SceneError`."""
    return load.load_scene(path).seat.part()


_SUFFIX: Final = re.compile(r"(\.[A-Za-z0-9_]{1,8}){1,2}$")
_PLAIN: Final = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,99}")


def packed(path: Path, changed: Mapping[str, Any]) -> tuple[str, dict[str, Any], dict[str, Path]]:
    """Return a changed scene for another computer: its path and changes there, and its files by their paths there.

    Files to which a file refers (included decks, the HDF5 of an .xdmf, the curve of a strength) keep their names.
    Raises `SceneError` for errors of the scene, and if such a name is not portable.
    """
    files = {"0/input.toml": path}
    renamed = dict(changed)
    for number, (key, file) in enumerate(_files(load.load_scene(path, changed).model_dump(by_alias=True)), start=1):
        suffix = _SUFFIX.search(file.name)
        name = f"{number}/input{suffix[0] if suffix else ''}"
        files[name] = file
        renamed[key] = f"{FILES}/{name}"
        for other in _with(file, key):
            half = other.stem == file.stem and file.suffix.lower() in (".ele", ".node")
            inner = f"input{other.suffix}" if half else other.name
            if other.parent != file.parent or not _PLAIN.fullmatch(inner):
                text = (
                    f"{file} is read with {other}, which cannot travel to another computer: put it into the same "
                    "folder under a name of letters, digits and _.-"
                )
                raise problems.scene_error(key, text, path)
            files[f"{number}/{inner}"] = other
    return f"{FILES}/0/input.toml", renamed, files


def files_of(scene: BaseModel) -> set[Path]:
    """Return the absolute paths of all files that a scene names; a copy may have bodies of kinds its type lacks."""
    return {path for _, path in _files(scene.model_dump(by_alias=True, warnings=False))}


def _files(table: Any, key: str = "") -> Iterator[tuple[str, Path]]:
    """Yield pairs of dotted key and file."""
    if isinstance(table, Path):
        yield key, table
    parts = table.items() if isinstance(table, Mapping) else enumerate(table) if isinstance(table, list | tuple) else ()
    for name, part in parts:
        yield from _files(part, f"{key}.{name}" if key else str(name))


def _with(file: Path, key: str) -> list[Path]:
    """Return the files to which the file of a ``key`` refers."""
    if (table := tables_in_files().get(key)) is not None:
        return [other for _, other in _files(tables.load_table(file, table).model_dump())]
    return [] if file.suffix.lower() == ".csv" else list(mesh_files.all_files(file)[1:])  # slow


def describe_content(scene: BaseModel, known: dict[Path, object] | None = None) -> dict[str, Any]:
    """Return the keys of a scene that are set, except the title, with each file replaced by a hash of its content and
    that of the files to which it refers. ``known``: hashes by path, extended here."""
    hashes = {} if known is None else known

    def hashed(asked: Any, key: str) -> Any:
        if isinstance(asked, Mapping):
            return {name: hashed(value, f"{key}{name}.") for name, value in asked.items()}
        if isinstance(asked, list | tuple):
            return [hashed(value, key) for value in asked]
        if not isinstance(asked, Path):
            return asked
        if asked not in hashes:
            hashes[asked] = cache.content_key({"files": [asked, *_with(asked, key.rstrip("."))]})
        return hashes[asked]

    content: dict[str, Any] = hashed(scene.model_dump(exclude={"title"}, exclude_unset=True, warnings=False), "")
    return content
