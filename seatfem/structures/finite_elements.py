"""Structures of finite elements: from mesh or drawing, at the level that was chosen, to the Green's function with
its errors.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from impact.greens import base, modal
from impact.notices import Progress, silent
from seatfem.fields import build_from_fields
from seatfem.structures.elements.assembly import assemble
from seatfem.structures.elements.axisymmetric import assemble_axisymmetric
from seatfem.structures.elements.supports import Absorbing, Bolted, Dashpot, Foundation, Support
from seatfem.structures.inspection import cad, mesh_file
from seatfem.structures.kinds.elastic import Elastic, Reduced
from seatfem.structures.lands import FaceLip
from seatfem.structures.lip import Lip
from seatfem.structures.memory_need import check_before_meshing, check_elastic
from seatfem.structures.mesh.gmsh_process import MeshingError, gmsh_session
from seatfem.structures.mesh.meshing import SeatMesh, make_mesh
from seatfem.structures.mesh.plane_meshes import MeridianMesh, make_meridian
from seatfem.structures.mesh.spec import MeshSpec
from seatfem.structures.method import COARSENING, NAMES, Aims, Level, Method, Solved, Task, replace_waves, spring_of
from seatfem.structures.model import ModelError, SecondOrderModel
from seatfem.structures.reduction import factorization, harmonics
from seatfem.structures.reduction.greens import reduced as reduce_by_aims
from seatfem.structures.reduction.lip_modes import face_greens, lip_greens
from seatfem.structures.reduction.modes import ConvergenceError, solve_modes
from seatfem.structures.reduction.reducer import Reduction
from seatfem.structures.rings import divided_less, division_to_compare, join_all_parts, ring_names
from seatfem.structures.shapes import GeometryError

if TYPE_CHECKING:
    from seatfem.structures.kinds.drawn import Drawn

AnyMesh = SeatMesh | MeridianMesh
DRAWN_MODES: Final = 12  # most modes that are drawn or kept


def draw(body: Drawn, spec: MeshSpec, level: Level, method: Method, progress: Progress = silent) -> AnyMesh:
    """Return the mesh of a level, unless its reduction by the method would take far too much memory; what is wrong with
    a file's faces names the file."""
    try:
        check_before_meshing(body, spec, level, method)
        if level in ("axisymmetric", "harmonics"):
            return make_meridian(body.geometry(), spec, progress)
        return make_mesh(body.geometry(), spec, progress, sector=body.copies.get(level, 1))
    except (GeometryError, MeshingError) as error:
        named = next((text for file in body.files() if (text := cad.naming(file, str(error))) != str(error)), None)
        if named is not None:
            raise type(error)(named) from error
        raise


def draw_both(body: Drawn, spec: MeshSpec, level: Level, task: Task) -> tuple[AnyMesh, AnyMesh | None]:
    """Return the mesh, and where its error is asked for one coarser by `COARSENING`, by one process of gmsh."""
    method = task.method
    with gmsh_session():
        with task.watch("mesh"):
            mesh = draw(body, spec, level, method, task.progress)
        if not task.mesh_error:
            return mesh, None
        with task.watch("mesh error"):
            coarse = replace(spec, size=COARSENING * spec.size, contact_size=COARSENING * spec.patch_size)
            coarse = replace(coarse, fillets=spec.fillets / COARSENING)
            return mesh, draw(body, coarse, level, method)


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
    materials = body.solids(mesh_file.regions_of(mesh))
    stated: dict[str, Any] = {"fixed": body.held, "supports": supports_of(body), "rings": rings, "progress": progress}
    if body.rayleigh is not None:
        stated["rayleigh"] = body.rayleigh.mass, body.rayleigh.stiffness
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
        place = next(iter(body.files()), f"seat.model = {level!r}")
        raise ModelError(f"{place}: {error}") from error


def with_mesh(body: Elastic, solved: Solved, mesh: AnyMesh, method: Method, progress: Progress) -> Solved:
    """Return a body of which only the Green's function is known with its mesh and the modes that are drawn."""
    level = body.elements_of(method)
    if method.static or level == "harmonics":
        return replace(solved, mesh=mesh)
    model = matrices(body, mesh, level, progress)
    modes = solve_modes(model, DRAWN_MODES, progress=progress)
    return replace(solved, mesh=mesh, model=model, modes=modes, about={**solved.about, "seat_level": level})


def supports_of(body: Elastic) -> tuple[Support, ...]:
    """Return the supports of the body beside its fixed and sliding faces."""
    known = {"foundation": Foundation, "bolted": Bolted, "dashpot": Dashpot, "absorbing": Absorbing}
    supports = (support for support in body.supports if support.kind in known)
    return tuple(build_from_fields(known[support.kind], support, boundary=support.on) for support in supports)


LEAST_REFINEMENT: Final = 1.1  # least ratio of the element sizes of two meshes that are compared
MESH_SAFETY: Final = 1.75  # safety factor of the mesh error, found on random seats (benchmarks/coverage_of_scenes.py)
RINGS_TOLERANCE: Final = 0.05  # tolerance of the reduction in which only the change by the rings counts
LIP: Final = "a body of revolution with lip segments: Fourier harmonics in the angle"
FACE: Final = "contact by lip segments: no sectors are alike"
LIP_MODES: Final = "finite elements, modes of each Fourier harmonic in the band, statics of each lip segment"
FACE_MODES: Final = "finite elements, 3-D, modes in the band, statics of each lip segment"
AT_ONCE: Final = "static compliance of the finite elements and first velocity, for each lip segment"
SPRING: Final = "static compliance of the finite elements, a spring"


def reduced(body: Reduced, model: SecondOrderModel, task: Task) -> Reduction:
    """Return a model of a body, reduced as its task says."""
    return reduce_by_aims(model, _aims(body, task), body.damping_ratio, task.method.reduction, task.progress)


def from_mesh(body: Elastic, mesh: SeatMesh, task: Task) -> Solved:
    """Solve on a mesh that is given, with the patch in more parts on the same mesh."""
    check_arcs(body, mesh, task.method)
    solved, division = _solved(body, mesh, task), task.method.division
    if division_to_compare(division) == division:
        return replace(solved, in_rings=solved.greens)
    with task.watch("patch error"):
        return replace(solved, in_rings=_solve_in_parts(body, mesh, task))


def check_arcs(body: Elastic, mesh: AnyMesh, method: Method) -> None:
    """Raise `ModelError` of more arcs of a lip than its face has elements along it."""
    if not isinstance(mesh, SeatMesh) or not method.in_arcs or (lip := method.lip) is None:
        return
    facets = len((mesh.mesh.boundaries or {}).get(body.struck_face, ()))
    halves = 1 if mesh.shape == "hexahedron" else 2
    elements = lip.length / math.sqrt(halves * lip.area / max(facets, 1))
    if lip.arcs > elements:
        size = f"{1e3 * lip.length / lip.arcs:.2g} mm"
        finer = f"refine seat.mesh.contact_size to {size} or less, or " if body.sizes(method).size else ""
        raise ModelError(
            f"contact.ports = {lip.arcs}: the struck face has only about {elements:.0f} elements along its "
            f"{1e3 * lip.length:.3g} mm, fewer than one per lip segment: {finer}take fewer"
        )


def _solve_in_parts(body: Elastic, mesh: SeatMesh, task: Task) -> base.GreensFunction | None:
    """Return the patch in more parts on the same mesh, to `RINGS_TOLERANCE`; ``None`` where that cannot be had."""
    method = task.method
    loose = replace(method, tolerance=max(method.tolerance, RINGS_TOLERANCE))
    what = "contact face in segments" if method.in_arcs else "contact face in rings"
    try:
        return _solved_for_error(body, mesh, replace(task, method=loose), what).greens
    except ConvergenceError:
        return None
    finally:
        task.progress(f"{what}, for the error estimate", 1.0)


def _solved_for_error(body: Elastic, mesh: AnyMesh, task: Task, what: str) -> Solved:
    """Return the patch in more parts on a mesh, solved for an error estimate alone."""

    def quiet(stage: str, done: float) -> None:
        task.progress(f"{what}, for the error estimate", (0.1 + 0.8 * done) if stage == "reduction" else 0.05)

    method = task.method.divided(division_to_compare(task.method.division))
    return _solved(body, mesh, Task(method, task.duration, progress=quiet))


def from_geometry(body: Drawn, task: Task) -> Solved:
    """Solve on the mesh of a drawing at the level of its method.

    Where its mesh error is asked for it is solved once more on a mesh coarser by `COARSENING`. Their difference after
    the Hann pulse of the band, over r - 1 (order 1, which clamped and reentrant corners may bring it down to) times
    `MESH_SAFETY`, is the stated mesh error of the finer one; r is what `refinement_of` finds of the coarsening.
    """
    method = task.method
    level = body.elements_of(method)
    reason = (
        (LIP if level == "harmonics" else FACE)
        if method.in_arcs
        else next(option.reason for option in body.levels() if option.level == level)
    )
    about: dict[str, object] = {"seat_level": level, "seat_level_reason": reason}
    spec = body.mesh_spec(method)
    mesh, coarse = draw_both(body, spec, level, task)
    check_arcs(body, mesh, method)
    solved = _solved(body, mesh, task)
    solved = replace(solved, about={**solved.about, **about})
    if coarse is None:
        return solved
    with task.watch("mesh error"):
        return _with_mesh_error(body, coarse, task, solved)


def _solved(body: Elastic, mesh: AnyMesh, task: Task) -> Solved:
    method, watch, progress = task.method, task.watch, task.progress
    level = body.elements_of(method)
    if level == "harmonics":
        return _solve_by_harmonics(body, mesh, task)
    check_elastic(body, mesh, level, method)
    with watch("assembly"):
        lip = method.lip if method.in_arcs and isinstance(method.lip, FaceLip) else None
        model = matrices(body, mesh, level, progress, rings=method.rings or 1, lip=lip)
    about = {"seat_model": NAMES[level], "seat_dof": model.size, **_mesh_keys(mesh)}
    if lip is not None:
        with watch("reduction"):
            aims = _aims(body, task)
            greens, modes = face_greens(model, aims, body.damping_ratio, static=method.static, progress=progress)
        about["seat_model"] = AT_ONCE if method.static else FACE_MODES
        return Solved(_from_mesh(greens, mesh), None, mesh, model, modes, about)
    if method.static:
        with watch("reduction"):
            spring = static_greens(model, body.damping_ratio)
        return Solved(_from_mesh(spring, mesh), None, mesh, model, about={**about, "seat_model": SPRING})
    with watch("reduction"):
        reduction = reduced(body, model, task)
    return Solved(_from_mesh(reduction.greens, mesh), None, mesh, model, reduction.modes, about)


def _solve_by_harmonics(body: Elastic, mesh: AnyMesh, task: Task) -> Solved:
    """Return an arc of the ring, or all of the ring in arcs, by Fourier harmonics."""
    method, aims, lip = task.method, _aims(body, task), task.method.lip
    rings = lip.rings if isinstance(lip, Lip) and method.in_arcs else method.rings or 1
    faces = ring_names("contact", rings)
    build = harmonics.every_harmonic(lambda harmonic: matrices(body, mesh, "harmonics", rings=rings, harmonic=harmonic))
    with task.watch("reduction"):
        if isinstance(lip, Lip) and method.in_arcs:
            places = [(float(angle), face) for angle in lip.angles for face in faces]
            patches = [harmonics.RingPatch(angle, 2 * np.pi / lip.arcs, face) for angle, face in places]
            named, model = dict(zip(lip.division.names, patches, strict=True)), AT_ONCE if method.static else LIP_MODES
            greens = lip_greens(build, named, aims, body.damping_ratio, static=method.static, progress=task.progress)
        else:
            named, model = {name: harmonics.RingPatch(0.0, body.struck_arc, name) for name in faces}, NAMES["harmonics"]
            try:
                greens = harmonics.combine_harmonics(build, named, aims, body.damping_ratio, progress=task.progress)
            except ConvergenceError as error:
                raise ConvergenceError(f"seat.arc with seat.greens.tolerance: {error}") from error
            if method.static:
                greens, model = replace_waves(greens), SPRING
    return Solved(_from_mesh(greens, mesh), None, mesh, about={"seat_model": model, **_mesh_keys(mesh)})


def _aims(body: Reduced, task: Task) -> Aims:
    method = task.method
    assert method.bandwidth is not None
    remembered = body.memory(method, task.duration)
    return Aims(method.bandwidth, remembered, method.tolerance, method.max_vectors)


def _mesh_keys(mesh: AnyMesh) -> dict[str, object]:
    quality = mesh.quality
    return {
        "seat_nodes": quality.nodes,
        "seat_elements": quality.elements,
        "seat_min_scaled_jacobian": quality.min_scaled_jacobian,
    }


def _from_mesh(greens: base.GreensFunction, mesh: AnyMesh) -> base.GreensFunction:
    """Return ``greens`` with the provenance of its mesh."""
    known = {"mesh": mesh.provenance.source, "mesh_hash": mesh.provenance.content_hash}
    return greens.with_error(greens.error_estimate, {**greens.provenance, **known})


def _with_mesh_error(body: Drawn, mesh: AnyMesh, task: Task, solved: Solved) -> Solved:
    """Return ``solved`` with the mesh error by a coarser ``mesh`` of the same body, whose patch is in rings."""
    method, coarse = task.method, _solved_for_error(body, mesh, task, "coarser mesh")
    task.progress("coarser mesh, for the error estimate", 1.0)
    assert method.bandwidth is not None
    width = 1.0 / method.bandwidth
    t = np.linspace(0.0, min(body.memory(method, task.duration), 60 * width), 600)
    fine, other = (join_all_parts(g).filtered(t, width) for g in (solved.greens, coarse.greens))
    difference = float(np.max(np.abs(fine - other)) / np.max(np.abs(fine)))
    assert solved.mesh is not None
    ratio = refinement_of(solved.mesh, mesh)
    mesh_error = MESH_SAFETY * difference / (ratio - 1)
    greens, coarser = solved.greens, coarse.greens
    greens = greens.with_error(base.ErrorEstimate(greens.error_estimate.reduction, mesh_error))
    coarser = coarser.with_error(coarser.error_estimate, {**coarser.provenance, "refinement": ratio})
    about = {**solved.about, "coarse_dof": coarse.about.get("seat_dof"), "coarse_refinement": ratio}
    same = divided_less(coarser, method.division)
    solved = replace(solved, greens=greens, about=about, refinement=ratio)
    return replace(solved, coarser=same, in_rings=coarser, coarser_mesh=mesh)


def refinement_of(fine: AnyMesh, coarse: AnyMesh) -> float:
    """Return the ratio of the element sizes in truth, from the numbers of elements: at most `COARSENING`, at least 1.1.

    A mesh that the geometry forbids to be coarser, a thin plate or a narrow land, is hardly another one: the little
    that it changes says little.
    """
    ratio = fine.quality.elements / coarse.quality.elements
    return float(np.clip(ratio ** (1 / (2 if isinstance(fine, MeridianMesh) else 3)), LEAST_REFINEMENT, COARSENING))


def static_greens(model: SecondOrderModel, damping_ratio: float) -> modal.ModalGreens:
    """Return B' K^-1 B delta(t): the static compliance of the ports alone, by one factorization.

    Raises:
        FactorizationError: a body that can move freely has no static compliance.
    """
    impedance = sum(port.impedance for port in model.ports.values())
    start = model.damping.plus(damping_ratio).first_velocity() / impedance
    return spring_of(
        factorization.static_compliance(model), start, model.port_names, {"method": "statics", "dof": model.size}
    )
