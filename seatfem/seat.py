"""From the [seat] table of a scene to the seat's Green's function."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import assert_never

import numpy as np

import impact
from impact.greens import ErrorEstimate, GreensFunction
from impact.modal import ModalGreens
from impact.progress import Progress, silent
from impact.sampled import SampledGreens
from impact.storage import load_greens
from seatfem import scene as scenes
from seatfem.assembly import assemble
from seatfem.geometry import GeometryError
from seatfem.greens import reduce_model
from seatfem.mesh_files import read_mesh
from seatfem.mesh_spec import MeshSpec
from seatfem.meshing import SeatMesh, make_mesh
from seatfem.model import Material, SecondOrderModel
from seatfem.modes import Modes
from seatfem.scene import ElasticSeat, Scene
from seatfem.scene.seats import DrawnSeat
from seatfem.stopwatch import Stopwatch

COARSENING = 1.6  # element size ratio of the mesh behind the mesh error estimate
PER_WAVELENGTH = 3  # second-order elements per shear wavelength at the band edge, where the scene gives no size


@dataclass(frozen=True)
class SeatAnswer:
    """A seat's Green's function and, where finite elements made it, the mesh and modes behind it.

    ``coarser``: the same on a mesh coarser by `COARSENING`.
    """

    greens: GreensFunction
    coarser: GreensFunction | None = None
    mesh: SeatMesh | None = None
    model: SecondOrderModel | None = None
    modes: Modes | None = None
    about: Mapping[str, object] = field(default_factory=dict)


def build_seat(scene: Scene, watch: Stopwatch, progress: Progress = silent, *, mesh_error: bool = True) -> SeatAnswer:
    """The Green's function of the scene's seat.

    With ``mesh_error``, a seat that gmsh draws is solved once more on a mesh coarser by `COARSENING`; the difference
    of the two, after the Hann pulse of the band, is the stated mesh error of the finer one.
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
            return SeatAnswer(rod, about={"seat_model": "rod, closed form"})
        case scenes.Spring():
            return SeatAnswer(impact.spring(stiffness=seat.stiffness), about={"seat_model": "spring"})
        case scenes.GreensFile():
            return SeatAnswer(load_greens(seat.file), about={"seat_model": f"Green's function from {seat.file.name}"})
        case scenes.MeshFile():
            with watch("mesh"):
                mesh = read_mesh(
                    seat.file,
                    contact=seat.contact,
                    fixed=seat.fixed,
                    unit=scenes.METRES[seat.unit],
                    progress=progress,
                )
            return _solved(scene, seat, mesh, watch, progress)
        case scenes.Annular() | scenes.BarSeat() | scenes.BlockSeat() | scenes.Cad():
            spec = mesh_spec(seat)
            with watch("mesh"):
                mesh = _drawn(seat, spec, progress)
            answer = _solved(scene, seat, mesh, watch, progress)
            if not mesh_error:
                return answer
            with watch("mesh error"):
                return _with_mesh_error(scene, seat, spec, answer, progress)
        case _ as never:
            assert_never(never)


def mesh_spec(seat: DrawnSeat) -> MeshSpec:
    """The mesh the scene asks for; sizes it leaves open follow the shear wavelength at the band edge."""
    material = _material(seat)
    size = seat.mesh.size or material.c_s / (PER_WAVELENGTH * seat.greens.bandwidth)
    contact = seat.mesh.contact_size or 0.4 * size
    return MeshSpec(size=size, contact_size=contact, order=seat.mesh.order)


def _drawn(seat: DrawnSeat, spec: MeshSpec, progress: Progress = silent) -> SeatMesh:
    """The mesh; what is wrong with a CAD file's faces names the file."""
    try:
        return make_mesh(seat.geometry(), spec, progress)
    except GeometryError as error:
        if isinstance(seat, scenes.Cad) and str(seat.file) not in str(error):
            raise GeometryError(f"{seat.file}: {error}") from error
        raise


def _solved(scene: Scene, seat: ElasticSeat, mesh: SeatMesh, watch: Stopwatch, progress: Progress) -> SeatAnswer:
    with watch("assembly"):
        rayleigh = None if seat.rayleigh is None else (seat.rayleigh.mass, seat.rayleigh.stiffness)
        model = assemble(mesh, _material(seat), rayleigh=rayleigh, progress=progress)
    with watch("reduction"):
        reduction = reduce_model(
            model,
            bandwidth=seat.greens.bandwidth,
            duration=memory(scene),
            tolerance=seat.greens.tolerance,
            damping_ratio=seat.damping_ratio,
            method=seat.greens.method,
            progress=progress,
        )
    about = {
        "seat_model": "finite elements, 3-D",
        "seat_dof": model.size,
        "seat_nodes": mesh.quality.nodes,
        "seat_elements": mesh.quality.elements,
        "seat_min_scaled_jacobian": mesh.quality.min_scaled_jacobian,
    }
    greens = reduction.greens
    if isinstance(greens, ModalGreens | SampledGreens):
        greens = replace(greens, origin={**greens.origin, "mesh": str(mesh), "mesh_hash": mesh.provenance.content_hash})
    return SeatAnswer(greens, None, mesh, model, reduction.modes, about)


def _with_mesh_error(
    scene: Scene, seat: DrawnSeat, spec: MeshSpec, answer: SeatAnswer, progress: Progress
) -> SeatAnswer:
    """``answer`` with the mesh error filled in from a coarser mesh of the same seat."""
    coarse_spec = replace(spec, size=COARSENING * spec.size, contact_size=COARSENING * spec.patch_size)

    def quiet(stage: str, done: float) -> None:
        progress("coarser mesh, for the error estimate", (0.1 + 0.8 * done) if stage == "reduction" else 0.05)

    coarse = _solved(scene, seat, _drawn(seat, coarse_spec), Stopwatch(), quiet)
    progress("coarser mesh, for the error estimate", 1.0)
    width = 1.0 / seat.greens.bandwidth
    t = np.linspace(0.0, min(memory(scene), 60 * width), 600)
    fine, other = (g.filtered(t, width) for g in (answer.greens, coarse.greens))
    difference = float(np.max(np.abs(fine - other)) / np.max(np.abs(fine)))
    greens = answer.greens
    assert isinstance(greens, ModalGreens | SampledGreens)
    greens = replace(greens, error=ErrorEstimate(greens.error.reduction, difference))
    return replace(
        answer, greens=greens, coarser=coarse.greens, about={**answer.about, "coarse_dof": coarse.about["seat_dof"]}
    )


def memory(scene: Scene) -> float:
    """How long the kernel must be right [s]: the run, or the time in which uniform damping forgets the band's tail.

    After ln(1000) / (zeta w) of the lowest frequency of interest, a tenth of the band, a thousandth is left.
    """
    seat = scene.seat
    if not isinstance(seat, ElasticSeat) or seat.damping_ratio <= 0:
        return scene.run.duration
    return min(scene.run.duration, math.log(1e3) / (seat.damping_ratio * 2 * math.pi * 0.1 * seat.greens.bandwidth))


def _material(seat: ElasticSeat) -> Material:
    m = seat.material
    return Material(young=m.young, poisson=m.poisson, density=m.density)
