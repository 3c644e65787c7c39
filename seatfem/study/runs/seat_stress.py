"""Stress in the seat of a run: its largest on the surface with an error bar, and histories at named points."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from impact import measures
from impact.greens.base import Array
from impact.progress import Progress, silent
from seatfem.pictures.apart import Picture
from seatfem.pictures.stress_plot import plot_stress, write_stress_vtu
from seatfem.structures.discretise import AnyMesh, matrices
from seatfem.structures.fields.corners import near, singular_points
from seatfem.structures.fields.recovery import (
    VECTORS,
    Largest,
    StressField,
    at_time,
    histories,
    largest,
    recover,
    von_mises,
)
from seatfem.structures.fields.sites import Sites, at_points, on_surface
from seatfem.structures.fields.solids import elements_of, solid_stress
from seatfem.structures.finite_elements import MESH_SAFETY, refinement_of
from seatfem.structures.inspection.mesh_file import regions_of
from seatfem.structures.kinds.elastic import Elastic
from seatfem.structures.method import Level
from seatfem.structures.model import ModelError, SecondOrderModel
from seatfem.structures.rings import Division
from seatfem.study.impacts.touches import Touches
from seatfem.study.planning.plan import Plan
from seatfem.study.runs.round import Round

FEWER: Final = 0.75  # of the vectors, for the error bar


@dataclass(frozen=True)
class SeatStress:
    """Stress in the seat.

    Attributes:
        mesh: scikit-fem's, of the body, its half section or its sector.
        model: on it.
        sites: (P, d) on its surface, away from singular edges [m].
        peak: of each of them.
        bar, tension_bar: of the largest von Mises stress and of the largest tension [Pa]; nan where no coarser mesh is
            known.
        largest_at: the field at the sites of both.
        time: (n + 1,) [s].
        points: (Q, d) that are named [m].
        named: (Q + 1, 6, n + 1) their stress, and last that of the site of the largest [Pa].
        snapshot: (P, 6) on the surface when it is largest [Pa].
        front: rho c_0 v, c_0^2 = E/rho, of the first touch [Pa]; nan without one.
        field, of_points: of all sites, and of the named points, under whatever pushes.
    """

    mesh: Any
    model: SecondOrderModel
    sites: Array
    peak: Largest
    bar: float
    tension_bar: float
    largest_at: StressField
    time: Array
    points: Array
    named: Array
    snapshot: Array
    front: float
    field: StressField
    of_points: StressField

    @property
    def where(self) -> int:
        """The site of the largest von Mises stress."""
        return int(self.peak.von_mises.argmax())


@dataclass(frozen=True)
class _Meshed:
    """A mesh of the seat and what it takes to recover stress on it."""

    done: Round
    level: Level
    mesh: AnyMesh
    model: SecondOrderModel

    def field(self, points: Array | None, vectors: int = VECTORS) -> StressField:
        """At points (Q, 3) or, for ``None``, on the surface away from singular edges."""
        scene, body = self.done.plan.scene, self.done.plan.scene.seat
        assert isinstance(body, Elastic)
        assert scene.stress is not None
        made, distance = elements_of(self.mesh), scene.stress.distance
        singular = singular_points(self.mesh, body.held)
        sites = on_surface(made) if points is None else at_points(made, self._own(points))
        close = near(sites.points, singular, distance)
        if points is None:
            sites = _some(sites, ~close)
        elif close.any():
            place = ", ".join(f"{1e3 * x:.4g}" for x in points[int(np.argmax(close))])
            raise ModelError(
                f"stress.points: ({place}) mm is within stress.distance = {1e3 * distance:.4g} mm of an edge where "
                "elasticity knows no stress: move the point away, or round the edge"
            )
        functional = solid_stress(made, body.solids(regions_of(self.mesh)), self.model, sites)
        return recover(
            self.model,
            functional,
            sites.points,
            bandwidth=self.done.plan.method.seat.bandwidth or 1 / scene.run.filter_width,
            dt=self.done.result.dt,
            damping_ratio=body.damping_ratio,
            vectors=vectors + 20 * (len(self.model.ports) - 1),
        )

    def _own(self, points: Array) -> Array:
        """In the mesh's coordinates."""
        flat = elements_of(self.mesh).places.shape[1] == 2
        return np.column_stack([np.hypot(points[:, 0], points[:, 1]), points[:, 2]]) if flat else points


def seat_stress(done: Round, progress: Progress = silent) -> SeatStress | None:
    """The stress in the seat of a round, on a mesh that is drawn again; ``None`` where the scene asks for none.

    Its bar is `MESH_SAFETY` times the change by a coarser mesh over r - 1, plus the change by fewer vectors; a mesh
    leaves as much in the tension as in von Mises' stress, and the larger change counts for both.

    Raises:
        ModelError: a named point off the seat or at a singular edge.
    """
    scene = done.plan.scene
    if scene.stress is None:
        return None
    fine, coarse = _meshes(done, progress)
    dt, force = done.result.dt, -by_port(done, done.touches, len(fine.model.ports))
    named = np.array(scene.stress.points).reshape(-1, 3)
    field = fine.field(None)
    found = largest(field, force, dt).after_contact
    worst = int(found.von_mises.argmax())
    both = np.array([worst, int(found.principal.argmax())])
    fewer = largest(fine.field(None, int(FEWER * VECTORS)).at(both), force, dt).after_contact
    bars = np.abs(_both(fewer) - _both(found))
    if coarse is None:
        bars = bars * math.nan
    else:
        change = np.abs(_both(largest(coarse.field(None), force, dt).after_contact) - _both(found)).max()
        bars += MESH_SAFETY * change / (refinement_of(fine.mesh, coarse.mesh) - 1)
    steps = round(found.von_mises_time[worst] / dt)
    of_points = fine.field(named) if len(named) else field.at(np.zeros(0, dtype=np.int64))
    made = elements_of(fine.mesh)
    return SeatStress(
        made.mesh,
        fine.model,
        field.points,
        found,
        float(bars[0]),
        float(bars[1]),
        field.at(both),
        done.result.time,
        of_points.points,
        np.concatenate([histories(of_points, force, dt), histories(field.at(np.array([worst])), force, dt)]),
        at_time(field, force, dt, steps),
        _front(done),
        field,
        of_points,
    )


def _both(found: Largest) -> Array:
    """(2,) the largest von Mises stress and the largest tension of all places [Pa]."""
    return np.array([found.von_mises.max(), found.principal.max()])


def check_stress(plan: Plan) -> None:
    """Raise `ModelError` where a plan strikes the seat in a way in which its stress is not known."""
    body, method = plan.scene.seat, plan.method.seat
    if plan.scene.stress is None or not isinstance(body, Elastic):
        return
    if method.in_arcs or body.elements_of(method) == "harmonics":
        raise ModelError(
            "stress: the seat is struck in arcs of its lip, whose stress is not known; set contact.ports = 1, or "
            "remove [stress]"
        )


def stress_keys(stress: SeatStress | None) -> dict[str, object]:
    """For summary.json: the largest von Mises stress in the seat, where and when, also over rho c_0 v."""
    if stress is None:
        return {}
    k, peak = stress.where, stress.peak
    value = float(peak.von_mises[k])
    place = [float(x) for x in stress.sites[k]]
    return {
        "peak_seat_stress_Pa": value,
        "peak_seat_stress_at_m": place,
        "peak_seat_stress_time_s": float(peak.von_mises_time[k]),
        "peak_seat_principal_stress_Pa": float(peak.principal.max()),
        "error_bar_peak_seat_stress_Pa": None if math.isnan(stress.bar) else stress.bar,
        "error_bar_peak_seat_principal_stress_Pa": None if math.isnan(stress.tension_bar) else stress.tension_bar,
        "peak_seat_stress_over_rho_c0_v": None if math.isnan(stress.front) else value / stress.front,
    }


def stress_pictures(
    stress: SeatStress | None, title: str, unsure: tuple[float, float] = (math.nan, math.nan)
) -> list[Picture]:
    """seat_stress.png and seat_stress.vtu; none where no stress is known. ``unsure``: as `plot_stress` has it."""
    if stress is None:
        return []
    k, peak = stress.where, stress.peak
    places = [*stress.points, stress.sites[k]]
    labels = tuple("(" + ", ".join(f"{1e3 * x:.3g}" for x in place) + ") mm" for place in places)
    draw = partial(
        plot_stress,
        stress.mesh,
        stress.sites,
        von_mises(stress.snapshot),
        stress.time,
        von_mises(np.moveaxis(stress.named, 1, 2)),
        (*labels[:-1], f"largest, {labels[-1]}"),
        at=float(peak.von_mises_time[k]),
        title=title,
        unsure=unsure,
    )
    write = partial(write_stress_vtu, stress.sites, peak.von_mises, peak.von_mises_time)
    return [("seat_stress.png", draw), ("seat_stress.vtu", write)]


def _meshes(done: Round, progress: Progress) -> tuple[_Meshed, _Meshed | None]:
    body, method = done.plan.scene.seat, done.plan.method.seat
    assert isinstance(body, Elastic)
    level = body.elements_of(method)
    mesh, coarse = body.meshes(method, progress)
    rings = method.rings or 1
    fine = _Meshed(done, level, mesh, matrices(body, mesh, level, rings=rings))
    if coarse is None:
        return fine, None
    return fine, _Meshed(done, level, coarse, matrices(body, coarse, level, rings=rings))


def by_port(done: Round, touches: Touches, ports: int) -> Array:
    """(n + 1, ports) contact forces of a run; on a seat struck as a whole, shared by the rings as a pressure is."""
    if touches.parts is not None:
        return touches.parts.force
    shares = Division.of(done.seat.greens).shares if ports > 1 else np.ones(1)
    return np.asarray(touches.seat.force[:, None] * shares)


def _front(done: Round) -> float:
    """rho c_0 v of the first touch [Pa]."""
    body, speed = done.plan.scene.seat, abs(measures.impact_velocity(done.result))
    assert isinstance(body, Elastic)
    solid = body.material.solid
    return math.sqrt(float(np.max(solid.young)) * solid.density) * speed or math.nan


def _some(sites: Sites, chosen: NDArray[np.bool_]) -> Sites:
    """Those of the sites, numbered anew."""
    kept = chosen[sites.site]
    number = np.cumsum(chosen) - 1
    return Sites.of(sites.points[chosen], number[sites.site[kept]], sites.element[kept], sites.inside[:, kept])
