"""The way from a drawn structure to mesh and matrices, at the level of modelling that was chosen."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from impact.progress import Progress, silent
from seatfem.fields import of_same_names
from seatfem.machine.stopwatch import Stopwatch
from seatfem.structures.counts.element_counts import check_before_meshing
from seatfem.structures.elements.assembly import assemble
from seatfem.structures.elements.axisymmetric import assemble_axisymmetric
from seatfem.structures.elements.supports import Absorbing, Bolted, Dashpot, Foundation, Support
from seatfem.structures.inspection.mesh_file import regions_of
from seatfem.structures.inspection.opened import naming
from seatfem.structures.kinds.drawn import Drawn
from seatfem.structures.kinds.elastic import Elastic
from seatfem.structures.lands import FaceLip
from seatfem.structures.mesh.gmsh_process import Gmsh, GmshSession, MeshingError, run_gmsh
from seatfem.structures.mesh.meridian import MeridianMesh, make_meridian
from seatfem.structures.mesh.meshing import SeatMesh, make_mesh
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.method import COARSENING, Level, Method
from seatfem.structures.model import ModelError, SecondOrderModel
from seatfem.structures.shapes import GeometryError

AnyMesh = SeatMesh | MeridianMesh


def draw(
    body: Drawn,
    spec: MeshSpec,
    level: Level,
    progress: Progress = silent,
    gmsh: Gmsh = run_gmsh,
    method: Method | None = None,
) -> AnyMesh:
    """Return the mesh of a level, unless it would be far too large; what is wrong with a file's faces names the file.

    ``method``: of the reduction, which determines the memory that is needed; by default as the body's table states it.
    """
    try:
        check_before_meshing(body, spec, level, method)
        if level in ("axisymmetric", "harmonics"):
            return make_meridian(body.geometry(), spec, progress, gmsh=gmsh)
        return make_mesh(body.geometry(), spec, progress, sector=body.copies.get(level, 1), gmsh=gmsh)
    except (GeometryError, MeshingError) as error:
        named = next((text for file in body.files() if (text := naming(file, str(error))) != str(error)), None)
        if named is not None:
            raise type(error)(named) from error
        raise


def draw_both(
    body: Drawn, spec: MeshSpec, level: Level, watch: Stopwatch, progress: Progress, *, method: Method, coarser: bool
) -> tuple[AnyMesh, AnyMesh | None]:
    """Return the mesh, and where it is asked for one ``coarser`` by `COARSENING`, by one process of gmsh."""
    with GmshSession() as gmsh:
        with watch("mesh"):
            mesh = draw(body, spec, level, progress, gmsh, method)
        if not coarser:
            return mesh, None
        with watch("mesh error"):
            coarse = replace(spec, size=COARSENING * spec.size, contact_size=COARSENING * spec.patch_size)
            coarse = replace(coarse, fillets=spec.fillets / COARSENING)
            return mesh, draw(body, coarse, level, gmsh=gmsh, method=method)


def matrices(
    body: Elastic,
    mesh: AnyMesh,
    level: Level,
    progress: Progress = silent,
    *,
    rings: int = 1,
    harmonic: int = 0,
    torsion: bool = False,
    lip: FaceLip | None = None,
) -> SecondOrderModel:
    """Return mass, stiffness, damping and ports of a body on its mesh; errors of groups name the file or the level.

    ``harmonic``: in the angle, of a half section, ``torsion`` that of the harmonic 0; ``lip``: the face struck, in
    parts, of a whole body.
    """
    materials = body.solids(regions_of(mesh))
    stated: dict[str, Any] = {"fixed": body.held, "supports": supports_of(body), "rings": rings, "progress": progress}
    stated["rayleigh"] = None if body.rayleigh is None else (body.rayleigh.mass, body.rayleigh.stiffness)
    sliding = tuple(support.on for support in body.supports if support.kind == "sliding")
    copies = body.copies.get(level, 1)
    try:
        if isinstance(mesh, MeridianMesh):
            return assemble_axisymmetric(mesh, materials, sliding=sliding, harmonic=harmonic, torsion=torsion, **stated)
        return assemble(
            mesh,
            materials,
            sliding=(*sliding, *(("symmetry_0", "symmetry_1") if copies > 1 else ())),
            mass="nodal" if mesh.shape == "hexahedron" else "consistent",
            ports={"contact": body.struck_face},
            copies=copies,
            lip=lip,
            **stated,
        )
    except ModelError as error:
        place = next(iter(body.files()), None) if body.drawn is None else f"seat.model = {level!r}"
        raise ModelError(f"{place}: {error}") from error


def supports_of(body: Elastic) -> tuple[Support, ...]:
    """Return what holds the body beside its fixed and sliding faces."""
    known = {"foundation": Foundation, "bolted": Bolted, "dashpot": Dashpot, "absorbing": Absorbing}
    supports = (support for support in body.supports if support.kind in known)
    return tuple(of_same_names(known[support.kind], support, boundary=support.on) for support in supports)
