"""Common functions of the tasks of the gmsh process: messages, untrusted files, reuse of the model, sizes, arrays.

gmsh executes files of unknown format as scripts (`SystemCall`, `Merge`, `Printf > file`), and FILE.opt next to FILE.
"""

import json
import re
import signal
import sys
import tempfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Final, TypeVar

import numpy as np
from numpy.typing import NDArray

from impact.files.safe_files import MB, opened_file
from seatfem.structures.mesh.spec import GRADING, MeshSpec
from seatfem.structures.shapes import GeometryError, cad
from seatfem.structures.shapes.profile import PER_ARC

BOUNDED: Final = ("building the geometry", "reading the mesh")
LONGEST: Final = 100  # time limit of a bounded stage [s]: sound files take seconds, some broken ones never end


def send(**message: Any) -> None:
    """Send one JSON line to the parent."""
    sys.stdout.write(json.dumps(message) + "\n")
    sys.stdout.flush()


def stage(what: str, done: float) -> None:
    """Report the stage that begins; the process is killed if a stage of `BOUNDED` takes longer than `LONGEST`."""
    if hasattr(signal, "alarm"):  # not on Windows
        signal.alarm(LONGEST if what in BOUNDED else 0)
    send(stage=what, done=done)


LIMIT: Final = 2048 * MB  # largest file
HEAD: Final = 400  # bytes at the beginning of a file by which its format is recognized
HEADS: Final[Mapping[str, tuple[re.Pattern[bytes], str]]] = MappingProxyType(
    {
        ".msh": (
            re.compile(rb"\$MeshFormat[ \t]*\r?\n[ \t]*[234](\.\d+)?[ \t]+[01][ \t]+8[ \t]*\r?\n"),
            "'$MeshFormat' and a line like '4.1 0 8' (gmsh, versions 2 to 4)",
        ),
        ".med": (re.compile(rb"\x89HDF\r\n\x1a\n"), "the mark of an HDF5 file"),
        ".step": (re.compile(rb"\s*ISO-10303-21\s*;"), "'ISO-10303-21;'"),
        ".brep": (re.compile(rb"\s*(DBRep_DrawableShape\s+)?CASCADE Topology"), "'CASCADE Topology'"),
    }
)
SAME: Final = MappingProxyType({".stp": ".step"})


@contextmanager
def handed_over(path: Path) -> Iterator[Path]:
    """Yield a copy of the file, alone in a private folder, after checking that its first bytes are those of its format,
    else raise `GeometryError`. Errors while the copy is used name the original file.
    """
    suffix = SAME.get(path.suffix.lower(), path.suffix.lower())
    if suffix not in HEADS:
        raise GeometryError(f"{path}: {suffix or 'no suffix'}: export it as one of {', '.join(HEADS)}")
    with tempfile.TemporaryDirectory(prefix="seatfem-") as folder:
        copy = Path(folder) / f"input{suffix}"
        with opened_file(path, LIMIT, GeometryError) as source, copy.open("xb") as target:
            while block := source.read(MB):
                target.write(block)
        with copy.open("rb") as file:
            head = file.read(HEAD)
        pattern, wanted = HEADS[suffix]
        if not pattern.match(head):
            raise GeometryError(
                f"{path}: is no {suffix} file; it begins with {head[:20]!r} instead of {wanted}. Export it again"
            )
        try:
            if suffix == ".step":
                cad.state_directly(copy)
            yield copy
        except Exception as error:
            message = str(error).replace(str(copy), str(path))
            if isinstance(error, GeometryError):
                raise GeometryError(message, error.field) from error
            raise RuntimeError(message) from error


Integers = NDArray[np.int64]

# gmsh's element types
SOLIDS = {4: "tetrahedron", 11: "tetrahedron", 5: "hexahedron", 17: "hexahedron", 12: "hexahedron"}
FACES = {"tetrahedron": (2, 9), "hexahedron": (3, 10, 16)}
CORNERS = {"tetrahedron": 3, "hexahedron": 4}


def arrays(gmsh: Any, scale: float) -> dict[str, Any]:
    """Return the points (metres), cells and named groups as plain arrays for `seatfem.structures.mesh.io.from_gmsh`.

    ``scale``: metres per model unit. Keys: "points", "cells", and one "volume:NAME", "surface:NAME" or "nodes:NAME" per
    group; groups of the same dimension and name are joined. Raises `GeometryError`, with a list of the elements, unless
    all volume elements are tetrahedra or all are hexahedra, of one order, 1 or 2.
    """
    mesh = gmsh.model.mesh
    tags, coordinates, _ = mesh.getNodes()
    index = rows_of(tags)
    solid = _solid_type(mesh)
    elements, nodes = mesh.getElementsByType(solid)
    row = rows_of(elements)
    out = {"points": scale * coordinates.reshape(-1, 3), "cells": index[nodes].reshape(len(elements), -1)}
    groups: dict[str, list[Integers]] = {}
    for dimension, tag in gmsh.model.getPhysicalGroups():
        name = gmsh.model.getPhysicalName(dimension, tag).strip() or f"group {tag}"  # .med pads with blanks
        entities = gmsh.model.getEntitiesForPhysicalGroup(dimension, tag)
        if dimension == 3:
            parts = [mesh.getElementsByType(solid, entity)[0] for entity in entities]
            members, kind = row[np.concatenate([[], *parts]).astype(np.int64)], "volume"
        elif dimension == 2:
            members, kind = index[_faces(mesh, SOLIDS[solid], entities)], "surface"
        elif dimension == 0:
            members, kind = index[mesh.getNodesForPhysicalGroup(0, tag)[0].astype(np.int64)], "nodes"
        else:
            continue
        groups.setdefault(f"{kind}:{name}", []).append(members)
    return out | {key: np.concatenate(parts) for key, parts in groups.items()}


def _solid_type(mesh: Any) -> int:
    present = [kind for kind in mesh.getElementTypes() if mesh.getElementProperties(kind)[1] == 3]
    if len(present) != 1 or present[0] not in SOLIDS:
        listed = ", ".join(_described(mesh, kind) for kind in present) or "none"
        raise GeometryError(
            f"volume elements must be tetrahedra or hexahedra, all of one order, 1 or 2; found: {listed}"
        )
    return int(present[0])


def _described(mesh: Any, kind: int) -> str:
    name, _, _, nodes, *_ = mesh.getElementProperties(kind)
    return f"{len(mesh.getElementsByType(kind)[0])} {name} of {nodes} nodes"


def _faces(mesh: Any, shape: str, entities: list[int]) -> Integers:
    """Return the vertex tags (f, 3) or (f, 4) of the element faces on the entities."""
    corners = CORNERS[shape]
    parts = [np.empty((0, corners), dtype=np.int64)]
    for kind in FACES[shape]:
        width = mesh.getElementProperties(kind)[3]
        parts += [mesh.getElementsByType(kind, entity)[1].reshape(-1, width)[:, :corners] for entity in entities]
    return np.concatenate(parts).astype(np.int64)


def rows_of(tags: Any) -> Integers:
    """Return an array that maps each tag to its row, -1 for missing tags."""
    index = np.full(int(tags.max(initial=0)) + 1, -1, dtype=np.int64)
    index[tags.astype(np.int64)] = np.arange(len(tags))
    return index


Tags = TypeVar("Tags")

GEOMETRY: Final = ("task", "geometry", "sectors")  # keys of a job that decide the geometry
UNKNOWN: Final = "unknown"
SAMPLES_PER_CURVE = 200
GROWTH_FROM_ARC = 1.0  # growth of the element size per unit distance from an arc


@dataclass
class KeptModel:
    """Present content of gmsh's model: ``key`` of the geometry ("" if empty) and ``tags`` returned by its builder."""

    key: str = ""
    tags: Any = None

    def forget(self) -> None:
        """Make the next call of `built` build the geometry again."""
        self.key = UNKNOWN

    def built(self, gmsh: Any, job: Mapping[str, Any], build: Callable[[], Tags], heal: bool = False) -> Tags:
        """Return the tags of the job's geometry, by ``build`` unless the previous job had the same geometry.

        Mesh and size fields of a model that is used again are removed.
        """
        rings = job.get("spec", {}).get("rings")  # they divide edges of a half section
        key = json.dumps([heal, rings, *(job.get(name) for name in GEOMETRY)], sort_keys=True)
        if key == self.key:
            gmsh.model.mesh.clear()
            for field in gmsh.model.mesh.field.list():
                gmsh.model.mesh.field.remove(field)
            tags: Tags = self.tags
            return tags
        if self.key:
            gmsh.clear()
        self.forget()
        self.tags = build()
        self.key = key
        return self.tags  # type: ignore[no-any-return]


def set_sizes(
    gmsh: Any,
    spec: MeshSpec,
    surfaces: list[int],
    curves: list[int],
    scale: float,
    arcs: Mapping[int, int] = MappingProxyType({}),
) -> None:
    """Set the size field: constant near the contact patch, then growing linearly to the size in the bulk.

    ``surfaces``, ``curves``: tags of the patch and its outline. ``scale``: model units per metre. ``arcs``: curve ->
    least number of elements along it.
    """
    near, far = scale * spec.patch_size, scale * spec.size
    end = max(near + (far - near) / GRADING, near + 1e-3 * near)
    fields = [growing(gmsh, surfaces, curves, (near, far), (near, end))]
    for arc, elements in arcs.items():
        if (size := gmsh.model.occ.getMass(1, arc) / max(PER_ARC, spec.fillets * elements)) < far:
            end = max(size + (far - size) / GROWTH_FROM_ARC, 1e-3 * size)
            fields.append(growing(gmsh, [], [arc], (size, far), (0.0, end)))
    least = gmsh.model.mesh.field.add("Min")
    gmsh.model.mesh.field.setNumbers(least, "FieldsList", fields)
    gmsh.model.mesh.field.setAsBackgroundMesh(least)


def growing(
    gmsh: Any,
    surfaces: list[int],
    curves: list[int],
    sizes: tuple[float, float],
    reach: tuple[float, float],
    samples: int = SAMPLES_PER_CURVE,
) -> int:
    """Return the tag of a size field that grows linearly from the first to the second of ``sizes``, between the two
    distances ``reach`` from the surfaces and curves."""
    field = gmsh.model.mesh.field
    distance, threshold = field.add("Distance"), field.add("Threshold")
    field.setNumbers(distance, "SurfacesList", surfaces)
    field.setNumbers(distance, "CurvesList", curves)
    field.setNumber(distance, "Sampling", samples)
    numbers = {"InField": distance, "SizeMin": sizes[0], "SizeMax": sizes[1], "DistMin": reach[0], "DistMax": reach[1]}
    for name, value in numbers.items():
        field.setNumber(threshold, name, value)
    return int(threshold)
