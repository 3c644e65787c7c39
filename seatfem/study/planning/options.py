"""The keys that a plan chooses, and what the planner knows of a scene before it chooses."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from impact.runs.variations import NARROWER
from seatfem.machine.rates import Machine
from seatfem.structures.estimates.mesh_size import Sizes, sizes_for
from seatfem.structures.estimates.patch import Patch
from seatfem.structures.estimates.surrogate import Surrogate
from seatfem.structures.rings import share_left
from seatfem.study.impacts.budget import Source
from seatfem.study.planning.filling import filled, value_of
from seatfem.study.planning.sensitivity import Changes, Sensitivity
from seatfem.study.scene import Scene

BAND, TOLERANCE = "seat.greens.bandwidth", "seat.greens.tolerance"
SIZE, CONTACT_SIZE, ORDER = "seat.mesh.size", "seat.mesh.contact_size", "seat.mesh.order"
MODEL, METHOD = "seat.model", "seat.greens.method"
MODES, STEP, RINGS = "reed.n_modes", "run.time_step", "contact.rings"
BEHIND: Final[Mapping[str, Source]] = {
    MODEL: "model", BAND: "reduction", TOLERANCE: "reduction", SIZE: "mesh", MODES: "model", STEP: "time_step",
    RINGS: "patch",
}  # fmt: skip
"""The source of error that a key is behind."""
BANDS: Final = tuple(float(f"{10 ** (k / 5):.1e}") for k in range(15, 36))
"""Band edges that are chosen from [Hz]: five a decade, so that different contact scenes share a seat."""
RING_NUMBERS: Final = (1, 4, 8)
"""Numbers of rings that are chosen from."""
TOLERANCES: Final = (0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001)
PATCH_BAR: Final = 2.0  # what a run states for its patch, over what the static compliance has of it
UNKNOWN_PATCH: Final = 0.03  # of the compliance, of a patch that nothing is known of
UNKNOWN_BODY: Final = 0.25  # band times filter width, for a body nothing is known of
FIRST_WAVE: Final = 4.0  # the body's first resonance: its depth is a quarter of a wavelength


@dataclass(frozen=True)
class Seen:
    """What the planner knows of a scene.

    Attributes:
        scene: as in the file.
        surrogate: the seat of the pre-runs.
        sensitivity: its pre-runs.
        machine: that will compute it.
    """

    scene: Scene
    surrogate: Surrogate
    sensitivity: Sensitivity
    machine: Machine

    @property
    def patch(self) -> Patch | None:
        """Of a seat of finite elements; ``None`` of matrices, responses and closed forms."""
        return self.surrogate.patch

    def per_g(self, error: float) -> Changes:
        """What an error of g leaves in the measures."""
        return {name: error * value for name, value in self.sensitivity.of_g.items()}

    def of_rings(self, rings: int) -> Changes:
        """What a patch in so many rings leaves in the measures, as the budget states it."""
        evened = UNKNOWN_PATCH
        if self.patch is not None:
            evened = PATCH_BAR * self.patch.evened / float(self.surrogate.greens.static_compliance()[0, 0])
        return self.per_g(evened * share_left(rings))


def fitted(dt: float, duration: float) -> float:
    """A step that ends with the run, as do those twice and four times as long: a record of g may end there, too."""
    return duration / (4 * math.ceil(duration / (4 * dt) * (1 - 1e-9)))


def mesh_sizes(seen: Seen, band: float, error: float) -> Sizes:
    """Sizes for an error of g; those of the file where it states them."""
    given_size, given_contact = (value_of(seen.scene, key) for key in (SIZE, CONTACT_SIZE))
    assert seen.patch is not None
    chosen = sizes_for(seen.patch, band, error, value_of(seen.scene, ORDER))
    size = given_size or max(chosen.size, given_contact or 0.0)
    return Sizes(size, given_contact or min(size, chosen.contact_size))


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
    if not scene.seat.is_drawn:
        return scene
    sizes = mesh_sizes(seen, band, error)
    return filled(scene, {SIZE: sizes.size, CONTACT_SIZE: sizes.contact_size, ORDER: value_of(scene, ORDER)})
