"""Knowledge of the planner about a scene before it chooses keys: a coarse seat, pre-runs, and errors by key.

The coarse seat is assembled and reduced on a coarse mesh of the real geometry.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final

from impact.bodies.body import Body
from impact.notices import Progress, silent
from impact.runs.variations import NARROWER, SAFETY, times
from seatfem.structures.cache import Cache, Store, build
from seatfem.structures.estimates.costs import SeatModel, count_elements, seat_model, seat_seconds
from seatfem.structures.estimates.surrogate import ERRORS, Patch, Sizes, Surrogate, sizes_for
from seatfem.structures.kinds import Structure
from seatfem.structures.method import AUTO, Applicability, Method, Solved
from seatfem.structures.rings import REFERENCE_RINGS, as_a_whole, left_by, share_left
from seatfem.study.impacts.validity import ONE_PORT
from seatfem.study.method import BAND, MODEL, PORTS, RINGS, SIZE, TOLERANCE, RunMethod, stated_method
from seatfem.study.prerun import lips
from seatfem.study.prerun.bench import prepare_bench
from seatfem.study.prerun.sensitivity import Changes, Sensitivity
from seatfem.study.safety import FINEST, LONGEST_LOOK, PATCH_BAR, STEP_UP, UNKNOWN_BODY, UNKNOWN_PATCH
from seatfem.study.scene import Scene, local

BANDS: Final = tuple(float(f"{10 ** (k / 5):.1e}") for k in range(15, 36))
"""Bandwidths to choose from [Hz]: five a decade, so that scenes with different contacts can share a cached seat."""
BAND_PER_FILTER: Final = 0.5  # bandwidth of the coarse seat times the filter's width; also the centre of a trade
COARSE_TOLERANCE: Final = 0.02  # tolerance of the coarse seat's reduction: larger ones save no time
IMPOSSIBLE: Final = (ArithmeticError, MemoryError, OSError, RuntimeError, ValueError)
"""Errors of a coarse seat that cannot be computed: the plan then uses its surrogate, and the run reports the error."""


def look_at(scene: Scene, stated: RunMethod, surrogate: Surrogate, store: Store, longest: float) -> Surrogate:
    """Return the seat on a coarse mesh, struck as a whole, in place of its surrogate.

    Its band contains the first resonance or, where that takes too long, what the filter passes. The surrogate itself is
    returned for seats without reduction or open keys, for exact surrogates, if the coarse seat is predicted to take
    over ``longest`` [s], and if it has no modes (dashpots), as the effect of its band could not be estimated.
    """
    structure, run = scene.seat, scene.run
    if not leaves_open(structure, stated.given) or surrogate.exact or surrogate.patch is None:
        return surrogate
    method = coarse_method(structure, stated, surrogate.patch, run.filter_width)
    seat = coarse_seat(structure, run.duration, method, store, longest)
    if seat is None and BAND not in stated.given:
        method = replace(method, bandwidth=next_band(BAND_PER_FILTER / run.filter_width))
        seat = coarse_seat(structure, run.duration, method, store, longest)
    if seat is None or (modal := seat.greens.modal) is None or not len(modal.omega):
        return surrogate
    band = max(method.bandwidth or 0.0, float(modal.frequencies_hz.max()) / NARROWER)
    return replace(surrogate, greens=seat.greens, words=f"coarse mesh of the seat, {surrogate.words}", band=band)


def coarse_seat(seat: Structure, duration: float, method: Method, store: Store, longest: float) -> Solved | None:
    """Return the seat solved by a coarse method; ``None`` if it is predicted to take over ``longest`` [s], or fails."""
    model = seat_model(seat, method, duration)
    if model is None or sum(seat_seconds(model).values()) > longest:
        return None
    try:
        return build(seat, method, duration, Cache(None, store), mesh_error=False)
    except IMPOSSIBLE:
        return None


def leaves_open(seat: Structure, given: frozenset[str]) -> bool:
    """Return whether a scene that states the keys ``given`` leaves band, level or mesh of a reduced seat to
    the plan."""
    return seat.traits.is_reduced and not given.issuperset((BAND,) if seat.drawn is None else (BAND, MODEL, SIZE))


def coarse_method(seat: Structure, stated: RunMethod, patch: Patch, width: float) -> Method:
    """Return the coarsest method that resolves the waves passed by a filter of ``width`` [s], with one contact face;
    keys that the file states are kept.

    The stated reduction is not, as all reductions give the same Green's function to within their tolerance.
    """
    least = max(lowest_band(patch), BAND_PER_FILTER / width)
    band = next_band(least)
    coarse = replace(stated.seat, level=seat.level(0.0).level, rings=1, lip=None, reduction=AUTO, max_vectors=None)
    coarse = coarse if BAND in stated.given else replace(coarse, bandwidth=band)
    coarse = coarse if TOLERANCE in stated.given else replace(coarse, tolerance=COARSE_TOLERANCE)
    if seat.drawn is None:
        return coarse
    sizes = element_sizes(patch, stated.seat, (coarse.bandwidth or band) if BAND in stated.given else least, ERRORS[0])
    return replace(coarse, size=sizes.size, contact_size=sizes.contact_size)


def next_band(least: float) -> float:
    """Return the lowest of `BANDS` that is at least ``least`` [Hz]; the highest if none is."""
    return next((edge for edge in BANDS if edge >= least), BANDS[-1])


def element_sizes(patch: Patch, stated: Method, band: float, error: float) -> Sizes:
    """Return the element sizes for an ``error`` of the Green's function; stated sizes are kept."""
    chosen = sizes_for(patch, band, error, stated.order)
    size = stated.size or max(chosen.size, stated.contact_size or 0.0)
    return Sizes(size, stated.contact_size or min(size, chosen.contact_size))


def sizes_along(seat: Structure, patch: Patch, how: Method, band: float, error: float) -> Sizes:
    """Return `element_sizes`, with an element in each arc of a lip that is meshed in space."""
    sizes, body, lip = element_sizes(patch, how, band, error), seat.elastic, how.lip
    if how.contact_size or lip is None or body is None or not how.in_arcs or body.elements_of(how) != "3d":
        return sizes
    return replace(sizes, contact_size=min(sizes.contact_size, PER_ARC * lip.length / lip.arcs))


def level_with_waves(seat: Structure, how: Method) -> Applicability:
    """Return the level of a seat with waves: 3-D, a half section or a sector."""
    level = seat.level(0.0)
    if how.lip is not None and level.level == "sector":
        return Applicability("3d", True, 0.0, "struck along a lip: no sectors are alike")
    return level


def lowest_band(patch: Patch) -> float:
    """Return the lowest bandwidth that describes a body [Hz]: its first resonance times `NARROWER`."""
    return NARROWER * patch.first_resonance


TOLERANCES: Final = (0.1, 0.05, 0.02, 0.01, 0.005, 0.002, 0.001)  # tolerances of a reduction to choose from
RING_NUMBERS: Final = (1, 4, 8)  # numbers of rings of a contact face to choose from
LOOKED_AT: Final = 0.02  # bound of the rings' effect, over the target, above which it is computed on a coarse seat
PER_ARC: Final = 0.8  # largest element size over the length of an arc: meshes are a little coarser than requested


@dataclass(frozen=True)
class PlanningContext:
    """Knowledge of the planner about a scene.

    Attributes:
        scene: the scene.
        stated: method with the keys that the file states, defaults, and choices by pre-runs (arcs, band of a plate).
        surrogate: the coarse or surrogate seat of the pre-runs.
        sensitivity: relative changes of the measures, by pre-runs.
        arcs: division of the seat's lip into arcs; ``None`` if it is struck as a whole.
        one_port: errors by one contact of a plate in place of arcs; ``None`` if there is none, or they are not known.
        store: cache of seats, coarse ones included.
        look: longest predicted time of a coarse seat [s]; 0: none is computed.
        band: bandwidth of a plate that strikes, and its error; ``None`` for other strikers.
        simpler: relative changes by simpler models, by their names.
        without: levels of the seat, or `ONE_PORT`, that are excluded.
    """

    scene: Scene
    stated: RunMethod
    surrogate: Surrogate
    sensitivity: Sensitivity
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
        progress: Progress = silent,
        without: tuple[str, ...] = (),
        store: Store | None = None,
        look: float | None = None,
    ) -> PlanningContext:
        """Return the context of a scene, from pre-runs as accurate as the tightest target needs.

        ``without``: excluded levels, or `ONE_PORT`; ``look``: longest predicted time of a coarse seat [s].
        """
        store = Store.default() if store is None else store
        longest = LONGEST_LOOK[scene.seat.drawn is None or bool(scene.seat.files())] if look is None else look
        stated = stated_method(scene)
        surrogate = look_at(scene, stated, surrogate, store, longest)
        finest = FINEST * scene.accuracy.target / STEP_UP / SAFETY
        stopper = None
        if scene.stopper is not None:
            stopper_surrogate = scene.stopper.body.surrogate(scene.run.duration, scene.reed.face)
            stopper = Body(stopper_surrogate.greens, scene.stopper.speed)
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
        elif method.ports in (None, 1):
            one_port = lips.error_of_one_contact(bench, method, whole)
        widest = math.inf if surrogate.band is None else surrogate.band
        sensitivity = Sensitivity(bench, scene.accuracy.judged, finest, exact=surrogate.exact, band=widest)
        return PlanningContext(
            scene, method, surrogate, sensitivity, arcs, band, simpler, one_port, store, longest, without
        )

    def elements_of(self, method: Method) -> tuple[SeatModel | None, SeatModel | None]:
        """Return the size of the seat's finite-element model and of the coarser one for its mesh error."""
        return count_elements(self.scene.seat, method, self.scene.run.duration)

    def coarse_seat(self, method: Method) -> Solved | None:
        """Return the seat by a coarse method; ``None`` if it is predicted to take longer than `look`, or fails."""
        return coarse_seat(self.scene.seat, self.scene.run.duration, method, self.store, self.look)

    @property
    def patch(self) -> Patch | None:
        """Return the struck patch of a seat with finite elements; ``None`` for matrices, responses and closed forms."""
        return self.surrogate.patch

    @property
    def reduced(self) -> bool:
        """Return whether the seat's matrices are reduced, which needs a bandwidth."""
        return self.scene.seat.traits.is_reduced

    @property
    def drawn(self) -> bool:
        """Return whether the seat's geometry is meshed for the run."""
        return self.scene.seat.drawn is not None

    @property
    def waves(self) -> Applicability:
        """Return the level of the seat with waves."""
        return level_with_waves(self.scene.seat, self.stated.seat)

    @property
    def lowest_band(self) -> float:
        """Return the lowest bandwidth that describes the seat [Hz]: its first resonance and a margin.

        Below it a run could not estimate the error by its bandwidth.
        """
        if self.patch is None:
            return UNKNOWN_BODY / self.scene.run.filter_width
        return min(BANDS[-1], lowest_band(self.patch))

    @property
    def bands(self) -> tuple[float, ...]:
        """Return the bandwidths to choose from [Hz]; only the stated one, if there is one."""
        stated = self.stated.seat.bandwidth
        if stated is not None and BAND in self.stated.given:
            return (stated,)
        return tuple(band for band in BANDS if band >= self.lowest_band) or BANDS[-1:]

    @property
    def tolerances(self) -> tuple[float, ...]:
        """Return the tolerances of the reduction to choose from; a lip in arcs, solved by modes, has one value."""
        if self.arcs is not None:
            return TOLERANCES[:1]
        return (self.stated.seat.tolerance,) if TOLERANCE in self.stated.given else TOLERANCES

    def elements(self, band: float, tolerance: float, error: float) -> Method:
        """Return the method of a seat with finite elements, and a mesh for an ``error`` of g; stated keys are kept."""
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
        """Return the element sizes for an ``error`` of g; stated sizes are kept."""
        assert self.patch is not None
        return sizes_along(self.scene.seat, self.patch, self.stated.seat, band, error)

    def per_g(self, error: float) -> Changes:
        """Return the relative errors of the measures by a relative ``error`` of the Green's function g."""
        return {name: error * value for name, value in self.sensitivity.of_g.items()}

    def of_rings(self, rings: int) -> Changes:
        """Return the relative errors of the measures by a contact face in so many rings, as the budget states them.

        They are none where the law holds the patch's local compliance.
        """
        if local.holds_patches(self.scene.geometry):
            return self.per_g(0.0)
        if self._by_rings is None:
            return self._bound_of_rings(rings)
        return times(left_by(rings) if rings > 2 else 1 + left_by(REFERENCE_RINGS), self._by_rings)

    def _bound_of_rings(self, rings: int) -> Changes:
        """Return a bound of these errors, from the compliance lost if the face stays plane."""
        compliance_error = UNKNOWN_PATCH
        if self.patch is not None:
            compliance_error = PATCH_BAR * self.patch.evened / float(self.surrogate.greens.static_compliance()[0, 0])
        return self.per_g(compliance_error * share_left(rings))

    @cached_property
    def _by_rings(self) -> Changes | None:
        """Return the changes by rings on a coarse seat; ``None`` if their bound is small, or it is not solved."""
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
        """Return the errors by the contact face for each number of rings to choose from; one if they have no effect."""
        stated = RINGS in self.stated.given or self.one_port is not None
        numbers = (self.stated.seat.rings or 1,) if stated else RING_NUMBERS
        chosen = numbers if self.sensitivity.worst(self.of_rings(1)) > 0 else numbers[:1]
        return {rings: self.of_rings(rings) for rings in chosen}
