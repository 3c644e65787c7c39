"""From a drawn seat to mesh and matrices, at the level of modelling that was chosen."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from impact.progress import Progress, silent
from seatfem.machine.stopwatch import Stopwatch
from seatfem.structures.counts.before_meshing import check_before_meshing
from seatfem.structures.elements.assembly import assemble
from seatfem.structures.elements.axisymmetric import assemble_axisymmetric
from seatfem.structures.elements.supports import Absorbing, Bolted, Dashpot, Foundation, Support
from seatfem.structures.inspection.mesh_file import regions_of
from seatfem.structures.kinds.parts import AnySupport
from seatfem.structures.kinds.seats import DrawnSeat, ElasticSeat, RevolvedSeat
from seatfem.structures.mesh.gmsh_process import Gmsh, GmshSession, MeshingError, run_gmsh
from seatfem.structures.mesh.meridian import MeridianMesh, make_meridian
from seatfem.structures.mesh.meshing import make_mesh
from seatfem.structures.mesh.seat_mesh import SeatMesh
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.model import ModelError, SecondOrderModel
from seatfem.structures.seats.levels import Level, sectors
from seatfem.structures.seats.needs import COARSENING
from seatfem.structures.seats.solids import Solid, solid
from seatfem.structures.shapes import GeometryError
from seatfem.study.scene import Cad, MeshFile

NAMES: Mapping[Level, str] = {
    "rod": "rod, closed form",
    "axisymmetric": "finite elements, axisymmetric",
    "harmonics": "finite elements, Fourier harmonics in the angle",
    "sector": "finite elements, one of several equal sectors",
    "3d": "finite elements, 3-D",
}


@dataclass(frozen=True)
class Discretisation:
    """A seat's mesh and matrices."""

    mesh: SeatMesh | MeridianMesh
    model: SecondOrderModel


def draw(
    seat: DrawnSeat, spec: MeshSpec, level: Level, progress: Progress = silent, gmsh: Gmsh = run_gmsh
) -> SeatMesh | MeridianMesh:
    """The mesh of a level, unless it would be far too large; what is wrong with a CAD file's faces names the file."""
    try:
        check_before_meshing(seat, spec, level)
        if level in ("axisymmetric", "harmonics"):
            assert isinstance(seat, RevolvedSeat)
            return make_meridian(seat.geometry(), spec, progress, gmsh=gmsh)
        count = sectors(seat) if level == "sector" else 1
        return make_mesh(seat.geometry(), spec, progress, sector=count, gmsh=gmsh)
    except (GeometryError, MeshingError) as error:
        if isinstance(seat, Cad) and str(seat.file) not in str(error):
            raise type(error)(f"{seat.file}: {error}") from error
        raise


def draw_both(
    seat: DrawnSeat, spec: MeshSpec, level: Level, watch: Stopwatch, progress: Progress, *, coarser: bool
) -> tuple[SeatMesh | MeridianMesh, SeatMesh | MeridianMesh | None]:
    """The mesh, and where it is asked for one ``coarser`` by `COARSENING`, by one process of gmsh."""
    with GmshSession() as gmsh:
        with watch("mesh"):
            mesh = draw(seat, spec, level, progress, gmsh)
        if not coarser:
            return mesh, None
        with watch("mesh error"):
            coarse = replace(spec, size=COARSENING * spec.size, contact_size=COARSENING * spec.patch_size)
            return mesh, draw(seat, coarse, level, gmsh=gmsh)


def matrices(
    seat: ElasticSeat,
    mesh: SeatMesh | MeridianMesh,
    level: Level,
    progress: Progress = silent,
    *,
    rings: int = 1,
) -> SecondOrderModel:
    """Mass, stiffness, damping and ports of the seat on its mesh; what is wrong with its groups names file or level."""
    try:
        return _assembled(seat, mesh, level, rings, progress)
    except ModelError as error:
        place = seat.file if isinstance(seat, MeshFile) else f"seat.model = {level!r}"
        raise ModelError(f"{place}: {error}") from error


def _assembled(
    seat: ElasticSeat, mesh: SeatMesh | MeridianMesh, level: Level, rings: int, progress: Progress
) -> SecondOrderModel:
    if isinstance(mesh, MeridianMesh):
        return assemble_axisymmetric(
            mesh,
            solids(seat, mesh),
            sliding=sliding_faces(seat),
            supports=supports_of(seat),
            rayleigh=rayleigh_of(seat),
            rings=rings,
            progress=progress,
        )
    copies = sectors(seat) if isinstance(seat, DrawnSeat) and level == "sector" else 1
    cuts = ("symmetry_0", "symmetry_1") if copies > 1 else ()
    return assemble(
        mesh,
        solids(seat, mesh),
        fixed=("fixed",) if seat.clamped else (),
        sliding=(*sliding_faces(seat), *cuts),
        supports=supports_of(seat),
        mass="nodal" if mesh.shape == "hexahedron" else "consistent",
        rayleigh=rayleigh_of(seat),
        ports={"contact": seat.struck_face if isinstance(seat, DrawnSeat) else "contact"},
        copies=copies,
        rings=rings,
        progress=progress,
    )


def rayleigh_of(seat: ElasticSeat) -> tuple[float, float] | None:
    """(alpha [1/s], beta [s]), or ``None``."""
    return None if seat.rayleigh is None else (seat.rayleigh.mass, seat.rayleigh.stiffness)


def sliding_faces(seat: ElasticSeat) -> tuple[str, ...]:
    """Names of the faces that cannot leave their planes."""
    return tuple(support.on for support in seat.supports if support.kind == "sliding")


def solids(seat: ElasticSeat, mesh: SeatMesh | MeridianMesh) -> Solid | Mapping[str, Solid]:
    """The material of the body, or of each of its regions: what ``seat.materials`` does not name is ``seat.material``.

    Raises:
        ModelError: a name that is no region of the mesh.
    """
    if not seat.materials:
        return solid(seat.material)
    regions = regions_of(mesh)
    if unknown := [name for name in seat.materials if name not in regions]:
        raise ModelError(f"seat.materials.{unknown[0]}: the mesh has no such region; it has {', '.join(regions)}")
    return {name: solid(seat.materials.get(name, seat.material)) for name in regions}


def supports_of(seat: ElasticSeat) -> tuple[Support, ...]:
    """What holds the seat beside its fixed and sliding faces."""
    return tuple(found for support in seat.supports if (found := _support(support)) is not None)


def _support(given: AnySupport) -> Support | None:
    match given.kind:
        case "foundation":
            return Foundation(given.on, given.normal, given.tangential)
        case "dashpot":
            return Dashpot(given.on, given.normal, given.tangential)
        case "bolted":
            return Bolted(given.on, given.normal, given.tangential)
        case "absorbing":
            return Absorbing(given.on, given.centre)
        case "sliding":
            return None
