"""The seat on a coarse mesh of its real geometry, assembled and reduced, for the pre-runs of a plan."""

from dataclasses import replace
from typing import Final

from impact.runs.variations import NARROWER
from seatfem.machine.resources import Machine
from seatfem.structures.cache import Cache, build
from seatfem.structures.estimates.costs import seat_model, seat_seconds
from seatfem.structures.estimates.surrogate import ERRORS, Patch, Sizes, Surrogate, sizes_for
from seatfem.structures.kinds import Structure
from seatfem.structures.method import AUTO, Method, Solved
from seatfem.structures.store import Store
from seatfem.study.method import BAND, MODEL, SIZE, TOLERANCE, RunMethod
from seatfem.study.scene import Scene

BANDS: Final = tuple(float(f"{10 ** (k / 5):.1e}") for k in range(15, 36))
"""Bandwidths to choose from [Hz]: five a decade, so that scenes with different contacts can share a cached seat."""
BAND_PER_FILTER: Final = 0.5  # bandwidth of the coarse seat times the filter's width; also the centre of a trade
COARSE_TOLERANCE: Final = 0.02  # tolerance of the coarse seat's reduction: larger ones save no time
IMPOSSIBLE: Final = (ArithmeticError, MemoryError, OSError, RuntimeError, ValueError)
"""Errors of a coarse seat that cannot be computed: the plan then uses its surrogate, and the run reports the error."""


def look_at(
    scene: Scene, stated: RunMethod, surrogate: Surrogate, machine: Machine, store: Store, longest: float
) -> Surrogate:
    """Return the seat on a coarse mesh, struck as a whole, in place of its surrogate.

    Its band contains the first resonance or, where that takes too long, what the filter passes. The surrogate itself is
    returned for seats without reduction or open keys, for exact surrogates, if the coarse seat is predicted to take
    over ``longest`` [s], and if it has no modes (dashpots), as the effect of its band could not be estimated.
    """
    structure, run = scene.seat, scene.run
    if not leaves_open(structure, stated.given) or surrogate.exact or surrogate.patch is None:
        return surrogate
    method = coarse_method(structure, stated, surrogate.patch, run.filter_width)
    seat = coarse_seat(structure, run.duration, method, machine, store, longest)
    if seat is None and BAND not in stated.given:
        method = replace(method, bandwidth=next_band(BAND_PER_FILTER / run.filter_width))
        seat = coarse_seat(structure, run.duration, method, machine, store, longest)
    if seat is None or (modal := seat.greens.modal) is None or not len(modal.omega):
        return surrogate
    band = max(method.bandwidth or 0.0, float(modal.frequencies_hz.max()) / NARROWER)
    return replace(surrogate, greens=seat.greens, words=f"coarse mesh of the seat, {surrogate.words}", band=band)


def coarse_seat(
    seat: Structure, duration: float, method: Method, machine: Machine, store: Store, longest: float
) -> Solved | None:
    """Return the seat solved by a coarse method; ``None`` if it is predicted to take over ``longest`` [s], or fails."""
    model = seat_model(seat, method, duration)
    if model is None or sum(seat_seconds(model, machine).values()) > longest:
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


def lowest_band(patch: Patch) -> float:
    """Return the lowest bandwidth that describes a body [Hz]: its first resonance times `NARROWER`."""
    return NARROWER * patch.first_resonance
