"""The table of all ladders.

A key that is declared here is in the error budget, in all rounds and in the measured trade, and is finer in a
reference; a test fails if a key of how bodies are computed is in no table here.
"""

from typing import Any

from seatfem.study import method
from seatfem.study.impacts.touches import LIP, RECORD, STOPPER, STRIKER, Source
from seatfem.study.impacts.validity import ONE_PORT
from seatfem.study.ladders import level, march, mesh, modes, patch
from seatfem.study.ladders.ladder import Ladder

LADDERS: list[Ladder] = [
    patch.Arcs(method.PORTS, "patch"),
    level.Level(method.MODEL, "model", rule="static stiffness, to begin with"),
    mesh.Bandwidth(method.BAND, "reduction", hidden_by=method.SIZE),
    mesh.ElementSize(method.SIZE, "mesh", also=(method.CONTACT_SIZE,), hidden_by=method.TOLERANCE),
    Ladder("seat.mesh.order", "mesh"),  # no error besides that of the mesh
    mesh.Tolerance(method.TOLERANCE, "reduction"),
    patch.OnePort(ONE_PORT, LIP),
    patch.Rings(method.RINGS, "patch"),
    modes.ModeCount("seat.n_modes", "model"),
    mesh.MeasuredRecord("seat.file", RECORD),
    march.TimeStep(method.STEP, "time_step", hidden_by=method.MODES),
    modes.ModeCount(method.MODES, "model", role="reed", hidden_by=method.STEP),
    mesh.ElementSize(
        method.REED_SIZE,
        STRIKER,
        "mesh",
        (method.REED_CONTACT_SIZE, "reed.mesh.order"),
        role="reed",
        hidden_by=method.REED_TOLERANCE,
    ),
    mesh.Tolerance(method.REED_TOLERANCE, STRIKER, "reduction", role="reed"),
    mesh.Bandwidth(method.REED_BAND, STRIKER, role="reed", hidden_by=method.REED_SIZE),
    level.Level("reed.model", STRIKER, "level", role="reed"),
    mesh.ElementSize(
        "stopper.mesh.size", STOPPER, "mesh", ("stopper.mesh.contact_size", "stopper.mesh.order"), role="stopper"
    ),
    mesh.Tolerance("stopper.greens.tolerance", STOPPER, "reduction", role="stopper"),
    mesh.Bandwidth("stopper.greens.bandwidth", STOPPER, role="stopper"),
    level.Level("stopper.model", STOPPER, "level", role="stopper"),
    patch.StopperParts(
        method.STOPPER_ARCS, STOPPER, "patch", (method.STOPPER_RINGS,), 0.7, "its face as a whole, to begin with"
    ),
    modes.ModeCount("stopper.n_modes", STOPPER, role="stopper"),
]
"""All ladders; those of the seat in the order in which their first values are chosen."""


def ladder_of(key: str) -> Ladder | None:
    """Return the ladder of a key, or that whose neighbour tells its error, too; ``None`` if there is none."""
    return next((ladder for ladder in LADDERS if key in (ladder.key, *ladder.also)), None)


def source_of(key: str) -> Source:
    """Return the source of error to which a key, or a model, belongs. Raises `KeyError` if it has none."""
    if (ladder := ladder_of(key)) is None:
        raise KeyError(key)
    return ladder.source


def described(key: str, value: Any) -> str:
    """Return a key's value with its unit."""
    return str(value) if (ladder := ladder_of(key)) is None else ladder.describe(value)
