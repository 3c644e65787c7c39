"""What the Green's function of a seat costs: seconds by stage, and bytes at the peak."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Final

from seatfem.machine.rates import Machine
from seatfem.structures.counts.bodies import section_of
from seatfem.structures.counts.element_counts import Sizes, body_in_numbers, predicted_sizes
from seatfem.structures.counts.memory_need import KRYLOV_VECTORS, MATRIX_ENTRY, counts_of, memory_need
from seatfem.structures.kinds.seats import DrawnSeat, RevolvedSeat
from seatfem.structures.method import AnyLevel as PlannedLevel
from seatfem.structures.rings import rings_behind
from seatfem.structures.seats.levels import Level, applicable, sectors
from seatfem.structures.seats.needs import COARSENING, memory, mesh_spec
from seatfem.structures.seats.solids import solid
from seatfem.study.scene import ElasticSeat, MeshFile, Scene

if TYPE_CHECKING:
    from seatfem.structures.mesh.seat_mesh import SeatMesh

DISCRETE: Final[tuple[Level, ...]] = ("axisymmetric", "harmonics", "sector", "3d")
SECTION_ELEMENT, HEXAHEDRON = 0.5, 3.0  # effort of making one, over that of a tetrahedron
SECTION_ENTRY: Final = 10.0  # of assembling an entry of a section's matrix, over that of a solid's
SECTION_FACTOR: Final = 0.5  # of factor and solves of a section, over those of a solid
FEWEST_HARMONICS, STATIC_HARMONICS = 5, 3
ROOM: Final = 32  # Krylov vectors at first; their number is doubled where it does not do
FAST: Final = 1.8  # speed of pressure waves over that of shear waves
PORTS_POWER: Final = 0.6  # of the number of rings in the number of vectors
TOLERANCE_POWER: Final = -0.141  # of the tolerance in the number of vectors
HIGHEST: Final = 0.45  # highest pole kept, over the band and over tolerance^(-1/2)
HIGHEST_OF_ALL: Final = 7.0  # the same of models so small that all their modes are kept, over the band
STRICTER: Final = 8.0  # the tolerance of each harmonic, over that of their sum
ALL_MODES: Final = 200  # unknowns up to which all modes are computed, as `seatfem.structures.reduction.modal` says


@dataclass(frozen=True)
class SeatModel:
    """A seat's finite elements in numbers.

    Attributes:
        sizes: of the mesh.
        vectors: Krylov vectors, of one harmonic.
        runs: harmonics, 1 elsewhere.
        section: whether it is a half section.
        hexahedra: whether elements are hexahedra or quadrilaterals.
        drawn: whether gmsh makes the mesh.
    """

    sizes: Sizes
    vectors: float
    runs: float = 1.0
    section: bool = False
    hexahedra: bool = False
    drawn: bool = True

    def stricter(self, ratio: float) -> SeatModel:
        """With the tolerance of the reduction times ``ratio``."""
        return replace(self, vectors=min(self.vectors * ratio**TOLERANCE_POWER, self.sizes.counts.dof))

    @property
    def poles(self) -> float:
        """Poles of its Green's function."""
        return 0.85 * self.vectors * self.runs


def seat_model(scene: Scene, level: Level, coarser: float = 1.0) -> SeatModel:
    """The elastic seat of a scene at a level, with elements ``coarser`` times as large."""
    seat = scene.seat
    if isinstance(seat, MeshFile):
        sizes, volume = sizes_in(seat)
        modes = _of_volume(volume, seat.greens.bandwidth, _slowest(seat))
        vectors = krylov_vectors(scene, seat, modes) * scene.contact.rings**PORTS_POWER
        return SeatModel(sizes, min(vectors, sizes.counts.dof), drawn=False)
    assert isinstance(seat, DrawnSeat)
    spec = mesh_spec(seat, level)
    spec = replace(spec, size=coarser * spec.size, contact_size=coarser * spec.patch_size)
    parts = sectors(seat) if level == "sector" else 1
    sizes = predicted_sizes(seat.geometry(), spec, level, parts)
    rings = scene.contact.rings if coarser == 1.0 else rings_behind(scene.contact.rings)
    vectors = krylov_vectors(scene, seat, modes_in_band(seat, level)) * rings**PORTS_POWER
    vectors = min(vectors, sizes.counts.dof)
    around = harmonics(seat) if level == "harmonics" else 1.0
    return SeatModel(sizes, vectors, around, level in ("axisymmetric", "harmonics"), spec.shape == "hex")


def discrete_level(scene: Scene, level: PlannedLevel) -> Level:
    """The level of the finite elements: a spring's are of the cheapest that leaves nothing out."""
    found = next((name for name in DISCRETE if name == level), None)
    if found is not None:
        return found
    if not isinstance(scene.seat, DrawnSeat):
        return "3d"
    return next(a.level for a in applicable(scene.seat) if a.applies and a.level in DISCRETE)


def highest_pole(model: SeatModel | None, tolerance: float) -> float:
    """Frequency of the highest pole of a reduction, over the band edge."""
    if model is not None and model.sizes.counts.dof <= ALL_MODES:
        return HIGHEST_OF_ALL
    stricter = STRICTER if model is not None and model.runs > 1 else 1.0
    return HIGHEST * math.sqrt(stricter / tolerance)


def modes_in_band(seat: DrawnSeat, level: Level) -> float:
    """Weyl's law: V k^3 (2/c_s^3 + 1/c_p^3)/(6 pi^2) of a solid, A k^2 (1/c_s^2 + 1/c_p^2)/(4 pi) of a section.

    k = 2 pi times the bandwidth. Source: M. Dupuis, R. Mazo, L. Onsager, J. Chem. Phys. 33 (1960) 1452.
    """
    k, slow = 2 * math.pi * seat.greens.bandwidth, _slowest(seat)
    fast = FAST * slow
    if level in ("axisymmetric", "harmonics"):
        assert isinstance(seat, RevolvedSeat)
        area = section_of(seat.geometry().profile).inner.total
        return area * k**2 * (slow**-2 + fast**-2) / (4 * math.pi)
    volume = body_in_numbers(seat.geometry()).inner.total / (sectors(seat) if level == "sector" else 1)
    return _of_volume(volume, seat.greens.bandwidth, slow)


def _of_volume(volume: float, band: float, slow: float) -> float:
    return volume * (2 * math.pi * band) ** 3 * (2 * slow**-3 + (FAST * slow) ** -3) / (6 * math.pi**2)


def _slowest(seat: ElasticSeat) -> float:
    """Shear waves of the seat's materials [m/s]."""
    return min(solid(m).c_s for m in (seat.material, *seat.materials.values()))


def krylov_vectors(scene: Scene, seat: ElasticSeat, modes: float) -> float:
    """Of one port: a law fitted to bodies of all levels (within a third of them), the undamped ones only roughly."""
    k = 2 * math.pi * seat.greens.bandwidth
    modes = min(modes, seat.greens.bandwidth * memory(scene))
    ratio = seat.damping_ratio
    if seat.rayleigh is not None:
        ratio = seat.rayleigh.mass / (2 * k) + seat.rayleigh.stiffness * k / 2
    ratio = min(1.0, ratio + 0.15 / (k * memory(scene)))
    return float(3.2 * (modes + 8) ** 0.4 * ratio**-0.286 * seat.greens.tolerance**TOLERANCE_POWER)


def harmonics(seat: DrawnSeat) -> float:
    """Reduced for an arc: wavelengths of shear waves around the rim at the band edge, and the least number."""
    assert isinstance(seat, RevolvedSeat)
    slow = min(solid(m).c_s for m in (seat.material, *seat.materials.values()))
    around = 2 * math.pi * seat.geometry().profile.outer_radius * seat.greens.bandwidth / slow
    return max(FEWEST_HARMONICS, 0.9 * around)


def sizes_in(seat: MeshFile) -> tuple[Sizes, float]:
    """The mesh of a file in numbers, and its volume [m^3]."""
    from seatfem.structures.inspection.mesh_file import mesh_of  # its readers take half a second to load

    mesh = mesh_of(seat)
    return _sizes_of(mesh), mesh.quality.volume


@lru_cache(maxsize=1)
def _sizes_of(mesh: SeatMesh) -> Sizes:
    surface = float(mesh.mesh.boundary_facets().size)
    return Sizes(mesh.quality.elements, mesh.quality.nodes, surface, counts_of(mesh))


def seat_seconds(model: SeatModel, rates: Machine, *, static: bool = False) -> Mapping[str, float]:
    """Mesh, assembly and reduction [s]; ``static``: a factorization alone."""
    counts, sizes = model.sizes.counts, model.sizes
    weight = SECTION_ELEMENT if model.section else (HEXAHEDRON if model.hexahedra else 1.0)
    effort = SECTION_FACTOR if model.section else 1.0
    assembly = counts.nnz * rates.entry * (SECTION_ENTRY if model.section else 1.0)
    n, vectors = counts.dof, 1.0 if static else model.vectors
    factor = rates.factor_start + effort * rates.factor * n**1.47
    vector = effort * rates.solve * n ** (4 / 3) + rates.product * counts.nnz + rates.check + rates.inner * n * vectors
    mesh = (rates.meshing_start if model.drawn else 0.0) + sizes.elements * weight * rates.element
    if model.runs == 1.0:
        return {"mesh": mesh, "assembly": assembly, "reduction": factor + vectors * vector}
    around = model.runs * (factor + vectors * vector + assembly) + STATIC_HARMONICS * (factor + assembly)
    return {"mesh": mesh, "reduction": around}


def coarse_of(scene: Scene, level: Level) -> SeatModel:
    """The coarser one behind the mesh error."""
    return seat_model(scene, level, COARSENING)


def seat_memory(model: SeatModel) -> tuple[float, float]:
    """Bytes at the peak of the reduction, and those that stay: matrices, modes, mesh."""
    counts = model.sizes.counts
    room = ROOM * 2 ** max(0, math.ceil(math.log2(max(model.vectors, 1.0) / ROOM)))
    peak = memory_need(counts).factorized + 8 * counts.dof * max(0.0, room - KRYLOV_VECTORS)
    return peak, MATRIX_ENTRY * (counts.nnz + counts.mass_nnz) + 8 * 60 * counts.dof
