"""What a run will cost: time by stage and peak memory, without meshing or assembling anything."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Final

import numpy as np

from seatfem.planning.element_counts import Sizes, predicted_sizes
from seatfem.planning.machine import Machine
from seatfem.planning.plan import Cost, PlannedLevel
from seatfem.scene import ElasticSeat, Scene
from seatfem.scene.seats import DrawnSeat, RevolvedSeat
from seatfem.seats.discretise import solid
from seatfem.seats.levels import Level, sectors
from seatfem.seats.memory_need import memory_need
from seatfem.seats.seat import COARSENING, memory, mesh_spec

__all__ = ["Cost", "predict_cost"]
PROGRAM: Final = 350e6  # bytes of the program itself, pictures included
ARRAYS: Final = 40  # histories of 8 bytes a step that live at once
SECTION_ELEMENT, HEXAHEDRON = 0.5, 4.0  # effort of meshing one, over that of a tetrahedron
BUDGET_RUNS: Final = 4.5  # contacts as long as the run itself, behind an error budget


def predict_cost(scene: Scene, level: PlannedLevel, machine: Machine | None = None) -> Cost:
    """Wall time by stage and peak memory of a run of a filled scene, by the rates of ``machine``, or the known ones."""
    rates = machine or Machine.known()
    parts: dict[str, float] = {"program start": rates.start}
    used = PROGRAM
    seat = scene.seat
    modes = 0.0
    if isinstance(seat, DrawnSeat) and level in ("axisymmetric", "harmonics", "sector", "3d"):
        fine = _sizes(seat, level, 1.0)
        coarse = _sizes(seat, level, COARSENING)
        vectors = krylov_vectors(scene, seat, level)
        modes = 0.85 * vectors * (_harmonics(seat) if level == "harmonics" else 1)
        stages = _seat_stages(fine, seat, vectors, level, rates)
        parts |= stages
        parts["mesh error"] = sum(_seat_stages(coarse, seat, vectors, level, rates).values())
        used += memory_need(fine.counts).factorized
    steps = _steps(scene, modes)
    poles = modes + _reed_poles(scene)
    parts["contact"] = steps * (rates.step + poles * rates.pole)
    parts["spring baseline"] = steps * (rates.step + _reed_poles(scene) * rates.pole)
    parts["error budget"] = BUDGET_RUNS * parts["contact"]
    parts["files"] = 22 * steps * rates.value
    bodies = 3 + 6 + 13 if modes and level != "harmonics" else 0
    parts["pictures"] = (5 if modes else 4) * rates.sheet + bodies * rates.view
    return Cost(sum(parts.values()), used + 8 * ARRAYS * steps, parts)


def _sizes(seat: DrawnSeat, level: Level, coarser: float) -> Sizes:
    spec = mesh_spec(seat, level)
    spec = replace(spec, size=coarser * spec.size, contact_size=coarser * spec.patch_size)
    return predicted_sizes(seat.geometry(), spec, level, sectors(seat) if level == "sector" else 1)


def _seat_stages(sizes: Sizes, seat: DrawnSeat, vectors: float, level: Level, rates: Machine) -> Mapping[str, float]:
    section = level in ("axisymmetric", "harmonics")
    weight = SECTION_ELEMENT if section else (HEXAHEDRON if seat.mesh.shape == "hex" else 1.0)
    n, entries = sizes.counts.dof, sizes.counts.nnz
    runs = _harmonics(seat) if level == "harmonics" else 1
    once = entries * rates.entry
    reduction = rates.factor * n**1.47 + vectors * n * rates.vector + vectors / 8 * rates.check
    assembly = {} if level == "harmonics" else {"assembly": once}
    return {
        "mesh": rates.meshing_start + sizes.elements * weight * rates.element,
        **assembly,
        "reduction": runs * (reduction + (once if level == "harmonics" else 0.0)),
    }


def krylov_vectors(scene: Scene, seat: DrawnSeat, level: Level) -> float:
    """Vectors for one port: those that short signals take, and a part of the modes of the band (Weyl's law)."""
    k = 2 * math.pi * seat.greens.bandwidth
    found = [solid(m) for m in (seat.material, *seat.materials.values())]
    slow = min(m.c_s for m in found)
    sizes = predicted_sizes(seat.geometry(), replace(mesh_spec(seat, level), order=1), level)
    del sizes
    extent = _extent(seat)
    if level in ("axisymmetric", "harmonics"):
        modes = extent[1] * k**2 / (4 * math.pi * slow**2) * 1.3
    else:
        modes = extent[0] * k**3 / (6 * math.pi**2 * slow**3) * 2.2 / (sectors(seat) if level == "sector" else 1)
    return float(45 + 0.25 * min(modes, 2 * seat.greens.bandwidth * memory(scene)))


def _extent(seat: DrawnSeat) -> tuple[float, float]:
    """Volume, and area of the half section of a solid of revolution (else 0)."""
    from seatfem.mesh.spec import MeshSpec
    from seatfem.planning.bodies import section_of, solid_of

    geometry, spec = seat.geometry(), MeshSpec(size=1e-3)
    volume = solid_of(geometry, spec).inner.total
    area = section_of(seat.geometry().profile, spec).inner.total if isinstance(seat, RevolvedSeat) else 0.0
    return volume, area


def _harmonics(seat: DrawnSeat) -> float:
    """Harmonics with waves in the band: the circumference over the wavelength of slow surface waves."""
    assert isinstance(seat, RevolvedSeat)
    radius = seat.geometry().profile.outer_radius
    slow = min(solid(m).c_s for m in (seat.material, *seat.materials.values()))
    return float(max(5.0, 1.0 * 2 * math.pi * seat.greens.bandwidth * radius / slow))


def _reed_poles(scene: Scene) -> float:
    return float(getattr(scene.reed, "n_modes", 0)) + 1


def _steps(scene: Scene, modes: float) -> float:
    from seatfem.runs.contact import striker_of, time_step

    if scene.run.time_step:
        return scene.run.duration / scene.run.time_step
    reed = striker_of(scene).greens
    dt = time_step(scene, reed, reed)
    if modes and isinstance(scene.seat, ElasticSeat):
        dt = min(dt, 1 / (4 * 2 * np.pi * 1.5 * scene.seat.greens.bandwidth))
    return float(scene.run.duration / dt)
