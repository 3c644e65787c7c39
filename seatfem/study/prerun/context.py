"""Knowledge of the planner about a scene before it chooses."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final

from impact.bodies.body import Body
from impact.notices import Progress, silent
from impact.runs.variations import SAFETY, times
from seatfem.machine.resources import Machine
from seatfem.structures.estimates.costs import SeatModel, count_elements
from seatfem.structures.estimates.surrogate import Patch, Sizes, Surrogate
from seatfem.structures.method import Applicability, Method, Solved
from seatfem.structures.rings import REFERENCE_RINGS, as_a_whole, left_by, share_left
from seatfem.structures.store import Store
from seatfem.study.impacts.validity import ONE_PORT
from seatfem.study.method import BAND, PORTS, RINGS, TOLERANCE, RunMethod, stated_method
from seatfem.study.prerun import lips
from seatfem.study.prerun.bench import prepare_bench
from seatfem.study.prerun.look import BANDS, coarse_method, coarse_seat, element_sizes, look_at, lowest_band
from seatfem.study.prerun.sensitivity import Changes, Sensitivity
from seatfem.study.safety import FINEST, LONGEST_LOOK, PATCH_BAR, STEP_UP, UNKNOWN_BODY, UNKNOWN_PATCH
from seatfem.study.scene import Scene

TOLERANCES: Final = (0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001)
RING_NUMBERS: Final = (1, 4, 8)
LOOKED_AT: Final = 0.02  # share of the target, bound of what rings change above which they are looked at
PER_ARC: Final = 0.8  # element size over the length of an arc, at most: meshes are a little coarser than asked for


@dataclass(frozen=True)
class PlanningContext:
    """Knowledge of the planner about a scene.

    Attributes:
        scene: what is asked.
        stated: what its file states of the method, and the defaults.
        surrogate: the seat of the pre-runs.
        sensitivity: its pre-runs.
        machine: that will compute it.
        arcs: of the seat's lip; ``None``: it is struck as a whole.
        one_port: what that leaves, where it was chosen in place of arcs; ``None``: it was not.
        store: of seats, coarse ones among them.
        look: what a coarse real seat may take, predicted [s]; 0: none is made.
        band: of a plate that strikes; ``None`` of other strikers.
        simpler: by the name of a simpler model of the striker, what it would change.
        without: levels that are not to be chosen.
    """

    scene: Scene
    stated: RunMethod
    surrogate: Surrogate
    sensitivity: Sensitivity
    machine: Machine
    arcs: lips.Arcs | None = None
    band: lips.PlateBand | None = None
    simpler: Mapping[str, Changes] = field(default_factory=dict)
    one_port: Changes | None = None
    store: Store = field(default_factory=Store.default)
    look: float = LONGEST_LOOK[False]
    without: tuple[str, ...] = ()

    @staticmethod
    def from_scene(
        scene: Scene,
        surrogate: Surrogate,
        machine: Machine,
        progress: Progress = silent,
        without: tuple[str, ...] = (),
        store: Store | None = None,
        look: float | None = None,
    ) -> PlanningContext:
        """Look at a scene by pre-runs, as closely as the tightest target asks for.

        ``without``: `ONE_PORT`, or levels; ``look``: what a coarse real seat may take, predicted [s].
        """
        store = Store.default() if store is None else store
        longest = LONGEST_LOOK[scene.seat.drawn is None or bool(scene.seat.files())] if look is None else look
        stated = stated_method(scene)
        surrogate = look_at(scene, stated, surrogate, machine, store, longest)
        finest = FINEST * scene.accuracy.target / STEP_UP / SAFETY
        stopper = None
        if scene.stopper is not None:  # a look costs nothing: the run computes it
            behind = scene.stopper.body.surrogate(scene.run.duration, scene.reed.face)
            stopper = Body(behind.greens, scene.stopper.speed)
        method, whole = stated, surrogate
        arcs = lips.choose_arc_count(scene, method, whole, stopper, progress)
        if arcs is not None:
            method, surrogate = arcs.method, arcs.surrogate
        band = lips.choose_plate_bandwidth(scene, method, surrogate.greens, stopper, progress)
        if band is not None:
            method = band.method
            if arcs is not None and PORTS not in stated.given:
                arcs = lips.choose_more_arcs(scene, method, whole, arcs, band.errors)
                method, surrogate = arcs.method, arcs.surrogate
        bench = prepare_bench(scene, method.reed, surrogate.greens, stopper, progress)
        simpler, one_port = lips.errors_of_simpler_models(bench), None
        if arcs is not None and band is not None and ONE_PORT not in without:
            one_port = lips.one_port_in_place(scene, arcs, simpler, band.errors)
        if one_port is not None:
            arcs, method, surrogate = None, method.along(scene.geometry, 1, scene.contact.rings), whole
            bench = prepare_bench(scene, method.reed, surrogate.greens, stopper, progress)
        widest = math.inf if surrogate.band is None else surrogate.band
        sensitivity = Sensitivity(bench, scene.accuracy.judged, finest, exact=surrogate.exact, band=widest)
        return PlanningContext(
            scene, method, surrogate, sensitivity, machine, arcs, band, simpler, one_port, store, longest, without
        )

    def elements_of(self, method: Method) -> tuple[SeatModel | None, SeatModel | None]:
        """Return the sizes of the seat's finite elements and of the coarser ones behind its mesh error."""
        return count_elements(self.scene.seat, method, self.scene.run.duration)

    def coarse_seat(self, method: Method) -> Solved | None:
        """Return the seat by a coarse method, within the time of a look; ``None`` where that takes longer."""
        return coarse_seat(self.scene.seat, self.scene.run.duration, method, self.machine, self.store, self.look)

    @property
    def patch(self) -> Patch | None:
        """Return the struck patch of a seat of finite elements; ``None`` for matrices, responses and closed forms."""
        return self.surrogate.patch

    @property
    def reduced(self) -> bool:
        """Return whether the seat's matrices are reduced, which a band is needed for."""
        return self.scene.seat.traits.is_reduced

    @property
    def drawn(self) -> bool:
        """Return whether a mesh is made for the run."""
        return self.scene.seat.drawn is not None

    @property
    def waves(self) -> Applicability:
        """Return how much of the seat is modelled where its waves count."""
        level = self.scene.seat.level(0.0)
        if self.stated.seat.lip is not None and level.level == "sector":
            return Applicability("3d", True, 0.0, "struck along a lip: no sectors are alike")
        return level

    @property
    def lowest_band(self) -> float:
        """Return the narrowest band that describes the seat [Hz]: its first resonance, a plate's in bending, and a
        margin.

        Below it a run could not tell what a narrower band changes.
        """
        if self.patch is None:
            return UNKNOWN_BODY / self.scene.run.filter_width
        return min(BANDS[-1], lowest_band(self.patch))

    @property
    def bands(self) -> tuple[float, ...]:
        """Return the band edges to choose from [Hz]; the stated one alone."""
        stated = self.stated.seat.bandwidth
        if stated is not None and BAND in self.stated.given:
            return (stated,)
        return tuple(band for band in BANDS if band >= self.lowest_band) or BANDS[-1:]

    @property
    def tolerances(self) -> tuple[float, ...]:
        """Return the tolerances of the reduction to choose from: the stated one, and what modes leave of a lip in
        arcs."""
        if self.arcs is not None:
            return TOLERANCES[:1]
        return (self.stated.seat.tolerance,) if TOLERANCE in self.stated.given else TOLERANCES

    def elements(self, band: float, tolerance: float, error: float) -> Method:
        """Return the seat by finite elements, with a mesh for an ``error`` of g; stated keys are kept."""
        seat = self.stated.seat
        seat = replace(
            seat,
            bandwidth=seat.bandwidth if BAND in self.stated.given else band,
            tolerance=seat.tolerance if TOLERANCE in self.stated.given else tolerance,
        )
        if not self.drawn:
            return seat
        sizes = self.sizes(band, error)
        return replace(seat, size=sizes.size, contact_size=sizes.contact_size)

    def sizes(self, band: float, error: float) -> Sizes:
        """Return the sizes of elements for an error of g; those of the file where it states them."""
        assert self.patch is not None
        sizes = element_sizes(self.patch, self.stated.seat, band, error)
        near = self.stated.seat.contact_size or min(sizes.contact_size, self._of_an_arc)
        return replace(sizes, contact_size=near)

    @property
    def _of_an_arc(self) -> float:
        """Return the element size for one element or more in each arc of a lip, of a body meshed around it [m]."""
        lip = self.stated.seat.lip
        body, stated = self.scene.seat.elastic, self.stated.seat
        if lip is None or body is None or not stated.in_arcs or body.elements_of(stated) != "3d":
            return math.inf
        return PER_ARC * lip.length / lip.arcs

    def per_g(self, error: float) -> Changes:
        """Return what an error of g leaves in the measures."""
        return {name: error * value for name, value in self.sensitivity.of_g.items()}

    def of_rings(self, rings: int) -> Changes:
        """Return what a patch in so many rings leaves in the measures, as the budget states it."""
        if self._by_rings is None:
            return self._bound_of_rings(rings)
        return times(left_by(rings) if rings > 2 else 1 + left_by(REFERENCE_RINGS), self._by_rings)

    def _bound_of_rings(self, rings: int) -> Changes:
        """Return what is left at most, by the compliance that a rigid face loses."""
        evened = UNKNOWN_PATCH
        if self.patch is not None:
            evened = PATCH_BAR * self.patch.evened / float(self.surrogate.greens.static_compliance()[0, 0])
        return self.per_g(evened * share_left(rings))

    @cached_property
    def _by_rings(self) -> Changes | None:
        """Return what rings change on a coarse mesh of the seat; ``None`` where they hardly can, or nobody looked."""
        patch, least = self.patch, LOOKED_AT * self.scene.accuracy.target
        if patch is None or self.surrogate.band is None or self.scene.seat.drawn is None:
            return None
        if self.sensitivity.worst(self._bound_of_rings(1)) <= least:
            return None
        method = coarse_method(self.scene.seat, self.stated, patch, self.scene.run.filter_width)
        seat = self.coarse_seat(replace(method, rings=REFERENCE_RINGS))
        return None if seat is None else self.sensitivity.between(as_a_whole(seat.greens), seat.greens)

    @cached_property
    def left_by_rings(self) -> Mapping[int, Changes]:
        """Return what the patch leaves in every number of rings that may be taken: one where they do not matter."""
        stated = RINGS in self.stated.given or self.one_port is not None  # arcs, which it stands for, have no more
        numbers = (self.stated.seat.rings or 1,) if stated else RING_NUMBERS
        chosen = numbers if self.sensitivity.worst(self.of_rings(1)) > 0 else numbers[:1]
        return {rings: self.of_rings(rings) for rings in chosen}
