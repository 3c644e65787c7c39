"""What a run will cost: time by stage and peak memory, without meshing or assembling anything."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from seatfem.machine.rates import Machine
from seatfem.structures.estimates.costs import (
    SeatModel,
    coarse_of,
    seat_memory,
    seat_model,
    seat_seconds,
)
from seatfem.structures.method import Method
from seatfem.study.planning.contact_costs import contact_model, contact_seconds
from seatfem.study.planning.plan import Cost, PlannedLevel
from seatfem.study.scene import Scene, method_of

__all__ = ["Cost", "predict_cost"]
PROGRAM: Final = 190e6  # bytes of the program while it makes the seat
CURVES: Final = 320e6  # the same when it has drawn curves
ELEMENTS: Final = 80e6  # more, with the libraries of finite elements
VIEWS: Final = 250e6  # more, when it has drawn bodies
PLAN: Final = 0.15  # time of a plan over that of the program's start
SHEETS: Final = 4  # pictures of curves
FRAMES: Final = 19  # pictures of modes and of their motion
MESH_VIEWS: Final = 3
SLICES: Final = 64  # of a revolved section in pictures; half of them are drawn


def predict_cost(scene: Scene, level: PlannedLevel, machine: Machine | None = None) -> Cost:
    """Wall time by stage, as the run's own stopwatch names them, and peak memory.

    Args:
        scene: filled; a time step that it leaves open is estimated.
        level: of the seat.
        machine: rates of this computer; default: those known.

    Raises:
        MachineError: a damaged calibration.
        GeometryError: a CAD file whose size cannot be read.
    """
    rates = machine or Machine.known()
    seat = _seat(scene, level)
    parts = {"program start": rates.start, "plan": PLAN * rates.start}
    if scene.seat.is_drawn and scene.seat.files():  # its inspection, by a gmsh process of its own
        parts["plan"] += rates.meshing_start
    if seat is not None:
        parts |= seat_seconds(seat, rates, static=level == "spring")
    coarser = None if seat is None else coarse_of(scene.seat, _method(scene, level), scene.run.duration)
    if coarser is not None:
        parts["mesh error"] = sum(seat_seconds(coarser, rates, static=level == "spring").values())
    contact = contact_model(scene, None if level == "spring" else seat)
    parts |= contact_seconds(contact, rates)
    parts["pictures"] = _pictures(seat, level, rates)
    return Cost(sum(parts.values()), _memory(seat, level, contact.memory), parts)


def _seat(scene: Scene, level: PlannedLevel) -> SeatModel | None:
    if level in ("rod", "closed form"):
        return None
    return seat_model(scene.seat, _method(scene, level), scene.run.duration)


def _method(scene: Scene, level: PlannedLevel) -> Method:
    return replace(method_of(scene), level=level)


def _has_views(seat: SeatModel | None, level: PlannedLevel) -> bool:
    return seat is not None and seat.runs == 1.0 and level != "spring"


def _pictures(seat: SeatModel | None, level: PlannedLevel, rates: Machine) -> float:
    curves = SHEETS * rates.sheet
    if seat is None or not _has_views(seat, level):
        return curves
    faces = seat.sizes.surface * (2 if seat.hexahedra else 1)
    if seat.section:
        faces = 2 * seat.sizes.surface * SLICES + 2 * seat.sizes.elements
        return curves + rates.sheet + FRAMES * (rates.view + faces * rates.face)
    return curves + (FRAMES + MESH_VIEWS) * (rates.view + faces * rates.face)


def _memory(seat: SeatModel | None, level: PlannedLevel, histories: float) -> float:
    if seat is None:
        return CURVES + histories
    peak, kept = seat_memory(seat)
    views = VIEWS if _has_views(seat, level) else 0.0
    return max(PROGRAM + peak, CURVES + ELEMENTS + views + kept + histories)
