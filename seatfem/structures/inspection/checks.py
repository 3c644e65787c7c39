"""The files that a scene names, opened and checked before anything is planned: all that is wrong at once."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from pathlib import Path

import impact
from seatfem.structures.inspection.cad import inspect_geometry
from seatfem.structures.kinds.imported import FrequencyResponseFile, Matrices, UniversalModes
from seatfem.structures.mesh.gmsh_process import MeshingError
from seatfem.study.scene import Cad, DrawnSeat, ElasticSeat, GreensFile, MeshFile, Scene
from seatfem.study.scene.locate import KeyPath
from seatfem.study.scene.problems import Problem, SceneError

Finding = tuple[KeyPath, str]
"""A key, and what is wrong with it."""

# Readers take half a second to load: each is imported by the scenes that need it.

_OF_CAD = {"path": "file"}
"""Keys of a CAD seat that are called otherwise in the geometry's specification."""


def check_files(scene: Scene) -> None:
    """Open what the scene names, and look for the faces, groups and regions that it speaks of.

    Raises:
        SceneError: all that is wrong, by key; `seatfem.study.scene.located` adds the scene's file and its lines.
    """
    if findings := tuple(_findings(scene)):
        raise SceneError(tuple(Problem(None, 0, ".".join(map(str, path)), text, path) for path, text in findings))


def _findings(scene: Scene) -> Iterator[Finding]:
    seat = scene.seat
    match seat:
        case Cad():
            yield from _of_cad(seat)
        case MeshFile():
            yield from _of_mesh(seat)
        case DrawnSeat():
            yield from _unknown_names(seat, seat.geometry().patches, ("seat",))
        case Matrices() | UniversalModes() | FrequencyResponseFile():
            yield from _of_imported(seat)
        case GreensFile():
            yield from _opened(lambda: impact.load_greens(seat.file), {"file": seat.file})
        case _:
            return


def _of_imported(seat: Matrices | UniversalModes | FrequencyResponseFile) -> Iterator[Finding]:
    from seatfem.structures.inspection.imported import model_of, modes_of, response_of

    match seat:
        case Matrices():
            files = {"mass": seat.mass, "damping": seat.damping, "contact": seat.contact, "stiffness": seat.stiffness}
            yield from _opened(lambda: model_of(seat), files)
        case UniversalModes():
            yield from _opened(lambda: modes_of(seat), {"file": seat.file})
        case FrequencyResponseFile():
            yield from _opened(lambda: response_of(seat), {"file": seat.file})


def _of_cad(seat: Cad) -> Iterator[Finding]:
    try:
        found = inspect_geometry(seat.geometry())
    except (MeshingError, OSError) as error:
        yield ("seat", "file"), _naming(seat.file, str(error))
        return
    alone = len(found.problems) == 1
    for field, message in found.problems:
        first, *rest = field.split(".", 1)
        key = _OF_CAD.get(first, first)
        if key == "unit" and seat.unit is None:
            key = "file"
        told = message if alone else _without_list(message, f"seatfem faces {seat.file.name}")
        yield ("seat", key, *rest), _naming(seat.file, told)
    if found.faces:
        yield from _unknown_names(seat, seat.geometry().patches, found.regions)


def _of_mesh(seat: MeshFile) -> Iterator[Finding]:
    from seatfem.structures.inspection.mesh_file import mesh_of, regions_of
    from seatfem.structures.mesh.io import MeshError

    try:
        mesh = mesh_of(seat)
    except MeshError as error:
        for field, message in error.problems:
            yield ("seat", field or "file"), _naming(seat.file, message)
    except (MeshingError, OSError) as error:
        yield ("seat", "file"), _naming(seat.file, str(error))
    else:
        yield from _unknown_names(seat, mesh.mesh.boundaries or {}, regions_of(mesh))


def _unknown_names(seat: ElasticSeat, faces: Collection[str], regions: Collection[str]) -> Iterator[Finding]:
    """Supports on faces that are not there, materials of regions that are not there."""
    for number, support in enumerate(seat.supports):
        if support.on not in faces:
            yield ("seat", "supports", number, "on"), f"no face named {support.on!r}; there are: {_listed(faces)}"
    for name in seat.materials:
        if name not in regions:
            yield ("seat", "materials", name), f"no region named {name!r}; there are: {_listed(regions)}"


def _opened(read: Callable[[], object], files: Mapping[str, Path | None]) -> Iterator[Finding]:
    """What a reader says, at the key of the file that it speaks of; of none, at the last."""
    try:
        read()
    except (ValueError, OSError) as error:
        key = next((key for key, file in files.items() if file is not None and str(file) in str(error)), [*files][-1])
        yield ("seat", key), str(error)


def _without_list(message: str, command: str) -> str:
    """Where several selectors are wrong, the faces are not listed with each."""
    first, _, more = message.partition("\n")
    return f"{first} {command} shows them" if more else message


def _naming(file: Path, message: str) -> str:
    """The message, with the file's name in front where it lacks it."""
    return message if file.name in message else f"{file}: {message}"


def _listed(names: Collection[str]) -> str:
    return ", ".join(map(repr, names)) or "none"
