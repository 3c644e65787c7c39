"""The ladders of one scene: what each value of an open key leaves in the measures."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

from seatfem.planning.filling import filled, is_given
from seatfem.planning.ladders import Changes, Ladder
from seatfem.planning.mesh_size import ERRORS, Sizes, mesh_error, sizes_for
from seatfem.planning.patch import Patch
from seatfem.planning.sensitivity import BANDS, Rung, Sensitivity
from seatfem.planning.surrogate import Surrogate
from seatfem.runs.budget import Source
from seatfem.runs.contact import MAX_STEPS
from seatfem.runs.variations import NARROWER
from seatfem.scene import Cantilever, DrawnSeat, ElasticSeat, Scene
from seatfem.scene.imported import Matrices
from seatfem.seats.needs import mesh_spec

BAND, TOLERANCE = "seat.greens.bandwidth", "seat.greens.tolerance"
SIZE, CONTACT_SIZE, ORDER = "seat.mesh.size", "seat.mesh.contact_size", "seat.mesh.order"
MODEL, METHOD = "seat.model", "seat.greens.method"
MODES, STEP = "reed.n_modes", "run.time_step"
TOLERANCES: Final = (0.05, 0.02, 0.01, 0.005, 0.002, 0.001)
MESH_BAR: Final = 2.0  # the bar that a run states for its mesh, over the error that the mesh has
UNKNOWN_BODY: Final = 0.25  # band times filter width, for a body nothing is known of
FIRST_WAVE: Final = 4.0  # the body's first resonance: its depth is a quarter of a wavelength


@dataclass(frozen=True)
class Seen:
    """What the planner knows of a scene.

    Attributes:
        scene: as in the file.
        surrogate: the seat of the pre-runs.
        sensitivity: its pre-runs.
    """

    scene: Scene
    surrogate: Surrogate
    sensitivity: Sensitivity

    @property
    def patch(self) -> Patch | None:
        """Of a drawn seat; ``None`` where no geometry is known."""
        return self.surrogate.patch

    def per_g(self, error: float) -> Changes:
        """What an error of g leaves in the measures."""
        return {name: error * value for name, value in self.sensitivity.of_g.items()}


def run_ladders(seen: Seen) -> tuple[Ladder, ...]:
    """Of the contact: time step and reed modes; a key that the file states is a ladder of one."""
    scene, sensitivity = seen.scene, seen.sensitivity
    if scene.run.time_step is not None:
        given = Rung(scene.run.time_step, sensitivity.of_step(scene.run.time_step))
        found = [_ladder(STEP, "time_step", (given,))]
    else:
        stored = [rung for rung in sensitivity.steps if scene.run.duration <= MAX_STEPS * rung.value]
        found = [_ladder(STEP, "time_step", tuple(stored) or sensitivity.steps[:1])]
    if isinstance(scene.reed, Cantilever):
        n = scene.reed.n_modes
        rungs = (Rung(n, sensitivity.of_modes(n)),) if is_given(scene, MODES) else sensitivity.modes
        found.append(_ladder(MODES, "model", rungs))
    return tuple(found)


def seat_ladders(seen: Seen) -> tuple[Ladder, ...]:
    """Of a seat of finite elements: band and tolerance; mesh sizes follow in `mesh_ladder`, once the band is known."""
    seat = seen.scene.seat
    if not isinstance(seat, ElasticSeat | Matrices):
        return ()
    bands = [rung for rung in seen.sensitivity.bands if rung.value >= lowest_band(seen)] or [_at(seen, BANDS[-1])]
    if is_given(seen.scene, BAND):
        bands = [_at(seen, seat.greens.bandwidth)]
    tolerances = (seat.greens.tolerance,) if is_given(seen.scene, TOLERANCE) else TOLERANCES
    return (
        _ladder(BAND, "reduction", tuple(bands)),
        _ladder(TOLERANCE, "reduction", tuple(Rung(value, seen.per_g(value)) for value in tolerances)),
    )


def mesh_ladder(seen: Seen, band: float) -> tuple[Ladder, ...]:
    """Of the mesh, by the error of g that it is made for."""
    seat = seen.scene.seat
    if not isinstance(seat, DrawnSeat) or seen.patch is None:
        return ()
    rungs = []
    for error in ERRORS:
        left = mesh_error(seen.patch, band, mesh_sizes(seen, band, error), seat.mesh.order)
        rungs.append(Rung(error, seen.per_g(MESH_BAR * left)))
    return (_ladder(SIZE, "mesh", tuple(rungs)),)


def mesh_sizes(seen: Seen, band: float, error: float) -> Sizes:
    """Sizes for an error of g; those of the file where it states them."""
    seat = seen.scene.seat
    assert isinstance(seat, DrawnSeat)
    assert seen.patch is not None
    chosen = sizes_for(seen.patch, band, error, seat.mesh.order)
    size = seat.mesh.size or max(chosen.size, seat.mesh.contact_size or 0.0)
    return Sizes(size, seat.mesh.contact_size or min(size, chosen.contact_size))


def lowest_band(seen: Seen) -> float:
    """The narrowest band that says something of the seat [Hz]: its first resonance, a plate's in bending, and a margin.

    Below it a run could not tell what a narrower band changes.
    """
    if seen.patch is None:
        return UNKNOWN_BODY / seen.scene.run.filter_width
    bends = seen.patch.bending_frequency / (2 * math.pi)
    return min(BANDS[-1], NARROWER * (bends or seen.patch.c_p / (FIRST_WAVE * seen.patch.depth)))


def fill_seat(seen: Seen, band: float, tolerance: float, error: float) -> Scene:
    """The scene with band, tolerance and sizes filled in where they are open."""
    values: dict[str, object] = {BAND: band, TOLERANCE: tolerance}
    scene = filled(seen.scene, values)
    if not isinstance(scene.seat, DrawnSeat):
        return scene
    if seen.patch is not None:
        sizes = mesh_sizes(seen, band, error)
    else:
        spec = mesh_spec(scene.seat, "3d")
        sizes = Sizes(spec.size, spec.patch_size)
    return filled(scene, {SIZE: sizes.size, CONTACT_SIZE: sizes.contact_size, ORDER: scene.seat.mesh.order})


def _at(seen: Seen, band: float) -> Rung:
    """A given band, between the rungs."""
    below = [rung for rung in seen.sensitivity.bands if rung.value <= band] or seen.sensitivity.bands[:1]
    return Rung(band, below[-1].changes if below else {})


def _ladder(key: str, source: Source, rungs: tuple[Rung, ...]) -> Ladder:
    return Ladder.steady(key, source, tuple(rung.value for rung in rungs), tuple(rung.changes for rung in rungs))
