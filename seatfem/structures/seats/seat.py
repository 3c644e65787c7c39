"""From the [seat] table of a scene to the seat's Green's function."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Final, assert_never

import numpy as np

import impact
from impact.greens.base import ErrorEstimate, GreensFunction
from impact.progress import Progress, silent
from seatfem.machine.stopwatch import Stopwatch
from seatfem.structures.counts.memory_need import check_seat
from seatfem.structures.inspection.imported import greens_of, modes_of
from seatfem.structures.inspection.mesh_file import mesh_of
from seatfem.structures.kinds.seats import DrawnSeat
from seatfem.structures.mesh.meridian import MeridianMesh
from seatfem.structures.mesh.seat_mesh import SeatMesh
from seatfem.structures.model import SecondOrderModel
from seatfem.structures.reduction.greens import reduce_model
from seatfem.structures.reduction.harmonics import ring_greens
from seatfem.structures.reduction.modes import ConvergenceError, Modes
from seatfem.structures.reduction.ring_patches import RingPatch
from seatfem.structures.rings import rings_behind, with_fewer_rings
from seatfem.structures.seats.discretise import (
    NAMES,
    draw_both,
    matrices,
    rayleigh_of,
    sliding_faces,
    solids,
    supports_of,
)
from seatfem.structures.seats.imported_seats import from_matrices, from_response
from seatfem.structures.seats.levels import Level, choose_level, clamp_error
from seatfem.structures.seats.needs import COARSENING, memory, mesh_spec
from seatfem.structures.seats.rods import rod_of
from seatfem.structures.seats.static_spring import static_greens
from seatfem.structures.seats.statics import without_waves
from seatfem.study import scene as scenes
from seatfem.study.scene import ElasticSeat, Scene

LEAST_REFINEMENT: Final = 1.1  # of two meshes that are compared
MESH_SAFETY: Final = 1.75  # found by benchmarks/honesty.py: 98 % of its seats are covered, and all of those held out
RINGS_TOLERANCE: Final = 0.05  # of the reduction in which only the change by the rings counts
SPRING: Final = "static compliance of the finite elements, a spring"
ROD_SHARE: Final = 4  # the part of the accuracy target that a level may use up by itself


@dataclass(frozen=True)
class SeatAnswer:
    """A seat's Green's function and, where finite elements made it, the mesh and modes behind it.

    ``coarser``: the same on a mesh coarser by `COARSENING`, in truth by ``refinement``. ``in_rings``: a model whose
    patch is in `rings_behind` rings, on the coarser mesh where there is one. ``level_error``: relative, of the level
    itself. ``plane``: the patch moves as a plane, whatever presses it.
    """

    greens: GreensFunction
    coarser: GreensFunction | None = None
    mesh: SeatMesh | MeridianMesh | None = None
    model: SecondOrderModel | None = None
    modes: Modes | None = None
    about: Mapping[str, object] = field(default_factory=dict)
    level_error: float = 0.0
    refinement: float = COARSENING
    in_rings: GreensFunction | None = None
    plane: bool = False


def build_seat(scene: Scene, watch: Stopwatch, progress: Progress = silent, *, mesh_error: bool = True) -> SeatAnswer:
    """The Green's function of the scene's seat.

    With ``mesh_error``, a seat that gmsh draws is solved once more on a mesh coarser by `COARSENING`. Their difference
    after the Hann pulse of the band, over r - 1 (order 1, which clamped and reentrant corners may bring it down to)
    times `MESH_SAFETY`, is the stated mesh error of the finer one; r is what `refinement_of` finds of the coarsening.
    """
    seat = scene.seat
    match seat:
        case scenes.Rod():
            rod = impact.fixed_rod(
                young=seat.young,
                density=seat.density,
                area=seat.cross_section,
                length=seat.length,
                damping_ratio=seat.damping_ratio,
            )
            return SeatAnswer(rod, about={"seat_model": "rod, closed form"}, plane=True)
        case scenes.Spring():
            return SeatAnswer(impact.spring(stiffness=seat.stiffness), about={"seat_model": "spring"}, plane=True)
        case scenes.GreensFile():
            greens = _as_asked(greens_of(seat, scene.run.duration), scene)
            return SeatAnswer(greens, about={"seat_model": f"Green's function from {seat.file.name}"})
        case scenes.Matrices():
            with watch("reduction"):
                model, reduction = from_matrices(seat, memory(scene), progress)
            about = {"seat_model": f"matrices from {seat.stiffness.name}", "seat_dof": model.size}
            return SeatAnswer(reduction.greens, model=model, modes=reduction.modes, about=about)
        case scenes.UniversalModes():
            return SeatAnswer(modes_of(seat), about={"seat_model": f"modes from {seat.file.name}"})
        case scenes.FrequencyResponseFile():
            with watch("pole fit"):
                fitted = from_response(seat)
            return SeatAnswer(fitted, about={"seat_model": f"poles fitted to {seat.file.name}"})
        case scenes.MeshFile():
            return _from_file(scene, seat, watch, progress)
        case scenes.DrawnSeat():
            return _from_geometry(scene, seat, watch, progress, mesh_error)
        case _ as never:
            assert_never(never)


def _as_asked(greens: GreensFunction, scene: Scene) -> GreensFunction:
    """The rings of a file: those asked for, or as it has them. Raises `GreensFunctionError` where they cannot be."""
    return with_fewer_rings(greens, scene.contact.rings) if "rings" in scene.contact.model_fields_set else greens


def _from_file(scene: Scene, seat: scenes.MeshFile, watch: Stopwatch, progress: Progress) -> SeatAnswer:
    with watch("mesh"):
        mesh = mesh_of(seat, progress)
    answer = _solved(scene, seat, mesh, "3d", scene.contact.rings, watch, progress)
    if rings_behind(scene.contact.rings) == scene.contact.rings:
        return replace(answer, in_rings=answer.greens)
    with watch("patch error"):
        return replace(answer, in_rings=_in_rings(scene, seat, mesh, progress))


def _in_rings(scene: Scene, seat: scenes.MeshFile, mesh: SeatMesh, progress: Progress) -> GreensFunction | None:
    """The patch in rings on the same mesh, to `RINGS_TOLERANCE`; ``None`` where that cannot be had."""
    settings = seat.greens.model_copy(update={"tolerance": max(seat.greens.tolerance, RINGS_TOLERANCE)})
    loose = seat.model_copy(update={"greens": settings})

    def quiet(stage: str, done: float) -> None:
        progress("patch in rings, for the error estimate", (0.1 + 0.8 * done) if stage == "reduction" else 0.05)

    try:
        rings = rings_behind(scene.contact.rings)
        return _solved(scene, loose, mesh, "3d", rings, Stopwatch(), quiet).greens
    except ConvergenceError:
        return None
    finally:
        progress("patch in rings, for the error estimate", 1.0)


def _from_geometry(scene: Scene, seat: DrawnSeat, watch: Stopwatch, progress: Progress, mesh_error: bool) -> SeatAnswer:
    level = choose_level(seat, scene.accuracy.target / ROD_SHARE)
    about: dict[str, object] = {"seat_level": level.level, "seat_level_reason": level.reason}
    if level.level == "rod":
        assert isinstance(seat, scenes.BarSeat)
        about["seat_model"] = NAMES["rod"]
        return SeatAnswer(rod_of(seat), about=about, level_error=clamp_error(seat), plane=True)
    rings = scene.contact.rings
    spec = mesh_spec(seat, level.level, rings)
    mesh, coarse = draw_both(seat, spec, level.level, watch, progress, coarser=mesh_error)
    answer = _solved(scene, seat, mesh, level.level, rings, watch, progress)
    answer = replace(answer, about={**answer.about, **about})
    if coarse is None:
        return answer
    with watch("mesh error"):
        return _with_mesh_error(scene, seat, coarse, level.level, answer, progress)


def _solved(
    scene: Scene,
    seat: ElasticSeat,
    mesh: SeatMesh | MeridianMesh,
    level: Level,
    rings: int,
    watch: Stopwatch,
    progress: Progress,
) -> SeatAnswer:
    """With the patch in so many ``rings``."""
    if level == "harmonics":
        return _around(scene, seat, mesh, rings, watch, progress)
    check_seat(seat, mesh, level)
    with watch("assembly"):
        model = matrices(seat, mesh, level, progress, rings=rings)
    about = {"seat_model": NAMES[level], "seat_dof": model.size, **_mesh_keys(mesh)}
    if _is_spring(seat):
        with watch("reduction"):
            spring = static_greens(model, seat.damping_ratio)
        return SeatAnswer(_from_mesh(spring, mesh), None, mesh, model, about={**about, "seat_model": SPRING})
    with watch("reduction"):
        reduction = reduce_model(
            model,
            bandwidth=seat.greens.bandwidth,
            duration=memory(scene),
            tolerance=seat.greens.tolerance,
            damping_ratio=seat.damping_ratio,
            method=seat.greens.method,
            max_vectors=seat.greens.max_vectors,
            progress=progress,
        )
    return SeatAnswer(_from_mesh(reduction.greens, mesh), None, mesh, model, reduction.modes, about)


def _around(
    scene: Scene, seat: ElasticSeat, mesh: SeatMesh | MeridianMesh, rings: int, watch: Stopwatch, progress: Progress
) -> SeatAnswer:
    """An arc of the ring, by Fourier harmonics."""
    assert isinstance(seat, scenes.RevolvedSeat)
    assert seat.arc is not None
    with watch("reduction"):
        try:
            greens = ring_greens(
                mesh,
                solids(seat, mesh),
                {"contact": RingPatch(0.0, seat.arc)},
                bandwidth=seat.greens.bandwidth,
                duration=memory(scene),
                tolerance=seat.greens.tolerance,
                damping_ratio=seat.damping_ratio,
                max_vectors=seat.greens.max_vectors,
                sliding=sliding_faces(seat),
                supports=supports_of(seat),
                rayleigh=rayleigh_of(seat),
                rings=rings,
                progress=progress,
            )
        except ConvergenceError as error:
            raise ConvergenceError(f"seat.arc with seat.greens.tolerance: {error}") from error
    about = {"seat_model": NAMES["harmonics"], **_mesh_keys(mesh)}
    if _is_spring(seat):
        greens, about = without_waves(greens), {**about, "seat_model": SPRING}
    return SeatAnswer(_from_mesh(greens, mesh), None, mesh, about=about)


def _is_spring(seat: ElasticSeat) -> bool:
    return isinstance(seat, DrawnSeat) and seat.model == "spring"


def _mesh_keys(mesh: SeatMesh | MeridianMesh) -> dict[str, object]:
    quality = mesh.quality
    return {
        "seat_nodes": quality.nodes,
        "seat_elements": quality.elements,
        "seat_min_scaled_jacobian": quality.min_scaled_jacobian,
    }


def _from_mesh(greens: GreensFunction, mesh: SeatMesh | MeridianMesh) -> GreensFunction:
    """``greens`` that knows the mesh it came from."""
    known = {"mesh": mesh.provenance.source, "mesh_hash": mesh.provenance.content_hash}
    return greens.with_error(greens.error_estimate, {**greens.provenance, **known})


def _with_mesh_error(
    scene: Scene,
    seat: DrawnSeat,
    mesh: SeatMesh | MeridianMesh,
    level: Level,
    answer: SeatAnswer,
    progress: Progress,
) -> SeatAnswer:
    """``answer`` with the mesh error filled in from a coarser mesh of the same seat, whose patch is in rings."""

    def quiet(stage: str, done: float) -> None:
        progress("coarser mesh, for the error estimate", (0.1 + 0.8 * done) if stage == "reduction" else 0.05)

    coarse = _solved(scene, seat, mesh, level, rings_behind(scene.contact.rings), Stopwatch(), quiet)
    progress("coarser mesh, for the error estimate", 1.0)
    width = 1.0 / seat.greens.bandwidth
    t = np.linspace(0.0, min(memory(scene), 60 * width), 600)
    fine, other = (with_fewer_rings(g, 1).filtered(t, width) for g in (answer.greens, coarse.greens))
    difference = float(np.max(np.abs(fine - other)) / np.max(np.abs(fine)))
    ratio = refinement_of(answer.mesh, coarse.mesh)
    mesh_error = MESH_SAFETY * difference / (ratio - 1)
    greens, coarser = answer.greens, coarse.greens
    greens = greens.with_error(ErrorEstimate(greens.error_estimate.reduction, mesh_error))
    coarser = coarser.with_error(coarser.error_estimate, {**coarser.provenance, "refinement": ratio})
    about = {**answer.about, "coarse_dof": coarse.about.get("seat_dof"), "coarse_refinement": ratio}
    same = with_fewer_rings(coarser, scene.contact.rings)
    return replace(answer, greens=greens, coarser=same, in_rings=coarser, about=about, refinement=ratio)


def refinement_of(fine: SeatMesh | MeridianMesh | None, coarse: SeatMesh | MeridianMesh | None) -> float:
    """Ratio of the element sizes in truth, from the numbers of elements: at most `COARSENING`, at least 1.1.

    A mesh that the geometry forbids to be coarser, a thin plate or a narrow land, is hardly another one: the little
    that it changes says little.
    """
    assert fine is not None
    assert coarse is not None
    ratio = fine.quality.elements / coarse.quality.elements
    return float(np.clip(ratio ** (1 / (2 if isinstance(fine, MeridianMesh) else 3)), LEAST_REFINEMENT, COARSENING))
