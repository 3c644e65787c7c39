"""Stress spaces of a body on file: they depend on the body and its mesh alone, not on the forces of a run."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields
from typing import Any, Final

import numpy as np

from impact.files.safe_files import MB
from impact.greens.base import Array
from impact.storage import hdf5
from seatfem.structures.cache import content_key, load_or_compute
from seatfem.structures.fields.recovery import Pairs, StressSpace

MOST: Final = 1024 * MB  # most bytes of all stress spaces in the store
FAR: Final = 1e9  # distance on file [m] from what there is none of
ARRAYS: Final = ("points", "static", "spanned")

Spaces = tuple[tuple[StressSpace, ...], ...]
"""Stress spaces by set of places, and within a set by harmonic."""


@dataclass(frozen=True)
class SpacesOnMesh:
    """Stress ``spaces`` on the mesh of a body, and distances (2, P) of the first set's places from its singular edges
    and from its struck face [m]: all that a run needs of the mesh."""

    spaces: Spaces
    distances: Array


def kept_spaces(parts: Mapping[str, object], compute: Callable[[], SpacesOnMesh]) -> SpacesOnMesh:
    """Return the stress spaces that are in the store under all ``parts`` on which they depend, else those that
    ``compute`` returns, which are then stored. Warns as `seatfem.structures.cache.load_or_compute`."""
    key = content_key({"stress of": parts})
    return load_or_compute(
        "stress", key, compute, content="stress of a body", read=_read, write=_write, most_bytes=MOST
    )


def _write(file: Any, kept: SpacesOnMesh) -> None:
    file.attrs["sets"], file["distances"] = len(kept.spaces), np.minimum(kept.distances, FAR)
    for number, of_set in enumerate(kept.spaces):
        group = file.create_group(f"{number}")
        group.attrs["spaces"] = len(of_set)
        for harmonic, space in enumerate(of_set):
            each = group.create_group(f"{harmonic}")
            each.attrs["ports"], each.attrs["resting"] = json.dumps(space.ports), space.resting
            for name in ARRAYS:
                each[name] = getattr(space, name)
            for name in ("pairs", "fewer"):
                for field in fields(Pairs):
                    each[f"{name}/{field.name}"] = getattr(getattr(space, name), field.name)


def _read(file: Any) -> SpacesOnMesh:
    groups = [file[f"{number}"] for number in range(int(file.attrs["sets"]))]
    spaces = tuple(tuple(_space(group[f"{k}"]) for k in range(int(group.attrs["spaces"]))) for group in groups)
    distances = hdf5.finite_array(file, "distances")
    return SpacesOnMesh(spaces, np.where(distances < FAR, distances, np.inf))


def _space(group: Any) -> StressSpace:
    points, static, spanned = (hdf5.finite_array(group, name) for name in ARRAYS)
    pairs, fewer = (
        Pairs(*(hdf5.finite_array(group, f"{name}/{field.name}") for field in fields(Pairs)))
        for name in ("pairs", "fewer")
    )
    ports = tuple(json.loads(str(group.attrs["ports"])))
    return StressSpace(points, static, spanned, pairs, fewer, ports, bool(group.attrs["resting"]))
