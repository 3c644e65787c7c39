"""Meshes that could never be solved here, refused before gmsh makes them."""

from __future__ import annotations

from typing import Final

from seatfem.machine.memory import available_memory
from seatfem.structures.counts.element_counts import predicted_sizes
from seatfem.structures.counts.memory_need import GB, MemoryNeedError, memory_need
from seatfem.structures.kinds.drawn import Drawn
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.method import Level, Method

MARGIN: Final = 2.0  # on predicted memory: a mesh that may fit after all is made, and counted exactly
FILE_MARGIN: Final = 4.0  # of a part from a file, whose small features may ask for more elements
MOST_ELEMENTS: Final = 2e7  # gmsh makes some 1e5 in a second, and needs 1 kB for each


def check_before_meshing(body: Drawn, spec: MeshSpec, level: Level, method: Method | None = None) -> None:
    """Raise `MemoryNeedError` where the mesh of a level would be far too large for this computer.

    ``method``: of the reduction; by default as the body's table states it.
    """
    how = body.stated() if method is None else method
    sizes = predicted_sizes(body.geometry(), spec, level, body.copies.get(level, 1))
    need = memory_need(sizes.counts)
    least = need.of(how.reduction)
    margin = FILE_MARGIN if body.files() else MARGIN
    there = available_memory()
    if least <= margin * there and sizes.elements <= margin * MOST_ELEMENTS:
        return
    chosen = "" if body.mesh.size else f" (from seat.greens.bandwidth = {how.bandwidth:.3g} Hz)"
    raise MemoryNeedError(
        f"seat.mesh.size = {1e3 * spec.size:.3g} mm{chosen}, contact_size = {1e3 * spec.patch_size:.3g} mm: about "
        f"{sizes.elements:.2g} elements, which need about {least / GB:.2g} GB of memory, {there / GB:.2g} GB are "
        "available; take larger elements, a lower seat.greens.bandwidth or a cheaper seat.model"
    )
