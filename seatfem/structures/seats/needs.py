"""What a seat of finite elements needs: element sizes, the length of its memory."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from impact.greens.base import GreensFunction
from seatfem.structures.kinds.seats import DrawnSeat
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.reduction.memory import memory as forgotten_after
from seatfem.structures.reduction.registry import AUTO, named
from seatfem.structures.seats.levels import Level
from seatfem.structures.seats.solids import solid
from seatfem.study.scene import ElasticSeat, Matrices, Scene

COARSENING: Final = 1.6  # element size ratio of the mesh behind the mesh error estimate
PER_WAVELENGTH: Final[Mapping[Level, float]] = {"rod": 1, "axisymmetric": 6, "harmonics": 6, "sector": 4, "3d": 3}
"""Second-order elements per shear wavelength at the band edge, where the scene gives no size."""


def mesh_spec(seat: DrawnSeat, level: Level, rings: int = 1) -> MeshSpec:
    """The mesh the scene asks for; sizes it leaves open follow the slowest shear wave at the band edge."""
    per_wavelength = PER_WAVELENGTH[level]
    slowest = min(solid(m).c_s for m in (seat.material, *seat.materials.values()))
    size = seat.mesh.size or slowest / (per_wavelength * seat.greens.bandwidth)
    contact = seat.mesh.contact_size or 0.4 * size
    return MeshSpec(size=size, contact_size=contact, order=seat.mesh.order, shape=seat.mesh.shape, rings=rings)


def memory(scene: Scene) -> float:
    """How long the kernel must be right [s]: the run, or the time in which uniform damping forgets the band's tail."""
    seat = scene.seat
    if not isinstance(seat, ElasticSeat | Matrices):
        return scene.run.duration
    return min(scene.run.duration, forgotten_after(seat.damping_ratio, seat.greens.bandwidth))


def serves(greens: GreensFunction | None, key: str, scene: Scene) -> bool:
    """Whether it is there, belongs to this seat and is known for this run."""
    if greens is None or greens.provenance.get("seat_key") != key:
        return False
    return greens.valid_for >= scene.run.duration * (1 - 1e-9)


def is_convolved(scene: Scene) -> bool:
    """Whether the seat's g will be no sum of oscillators: damping couples its modes, or it is stepped in time."""
    seat = scene.seat
    if not isinstance(seat, ElasticSeat | Matrices):
        return False
    if seat.greens.method != AUTO:
        return not named(seat.greens.method).oscillators
    return seat.damping is not None if isinstance(seat, Matrices) else any(part.damps for part in seat.supports)
