"""A look at the seat before anything is chosen: its real geometry on a coarse mesh, assembled and reduced."""

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
"""Band edges that are chosen from [Hz]: five a decade, so that different contact scenes share a seat."""
BAND_PER_FILTER: Final = 0.5  # band times the width of the filter, of a look and of the centre of a trade
COARSE_TOLERANCE: Final = 0.02  # of its reduction: looser ones take as long and tell less
IMPOSSIBLE: Final = (ArithmeticError, MemoryError, OSError, RuntimeError, ValueError)
"""What a seat that cannot be made ends with: the run tells of it, a plan is made by the surrogate."""


def look_at(
    scene: Scene, stated: RunMethod, surrogate: Surrogate, machine: Machine, store: Store, longest: float
) -> Surrogate:
    """Return the seat itself on a coarse mesh, as a whole, in place of its surrogate; the surrogate of a seat that is
    not reduced or exact, of which nothing is open, where the look is predicted to take over ``longest`` [s], and of one
    without modes, as with dashpots: what a narrower band leaves, neither a plan nor a run could tell on it.

    Over the band of its first resonance, or where that takes too long, over the one that the filter passes.
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
    """Return the seat by a coarse method; ``None`` where that is predicted to take over ``longest`` [s], or cannot be
    made."""
    model = seat_model(seat, method, duration)
    if model is None or sum(seat_seconds(model, machine).values()) > longest:
        return None
    try:
        return build(seat, method, duration, Cache(None, store), mesh_error=False)
    except IMPOSSIBLE:
        return None


def leaves_open(seat: Structure, given: frozenset[str]) -> bool:
    """Return whether the file, in which some keys are ``given``, leaves the band, the level or the mesh of a reduced
    seat to the plan."""
    return seat.traits.is_reduced and not given.issuperset((BAND,) if seat.drawn is None else (BAND, MODEL, SIZE))


def coarse_method(seat: Structure, stated: RunMethod, patch: Patch, width: float) -> Method:
    """Return the coarsest method whose seat shows the waves that a filter of a ``width`` [s] passes, its face in one
    ring; keys that the file states are as in the ``stated`` one.

    The reduction that the file states is for the run: any other has the same g to within its tolerance.
    """
    least = max(lowest_band(patch), BAND_PER_FILTER / width)
    band = next_band(least)
    how = replace(stated.seat, level=seat.level(0.0).level, rings=1, lip=None, reduction=AUTO, max_vectors=None)
    how = how if BAND in stated.given else replace(how, bandwidth=band)
    how = how if TOLERANCE in stated.given else replace(how, tolerance=COARSE_TOLERANCE)
    if seat.drawn is None:
        return how
    sizes = element_sizes(patch, stated.seat, (how.bandwidth or band) if BAND in stated.given else least, ERRORS[0])
    return replace(how, size=sizes.size, contact_size=sizes.contact_size)


def next_band(least: float) -> float:
    """Return the narrowest of the bands that are chosen from that is as wide [Hz]; the widest where none is."""
    return next((edge for edge in BANDS if edge >= least), BANDS[-1])


def element_sizes(patch: Patch, stated: Method, band: float, error: float) -> Sizes:
    """Return the sizes of elements for an error of g; those of the file where it states them."""
    chosen = sizes_for(patch, band, error, stated.order)
    size = stated.size or max(chosen.size, stated.contact_size or 0.0)
    return Sizes(size, stated.contact_size or min(size, chosen.contact_size))


def lowest_band(patch: Patch) -> float:
    """Return the narrowest band that describes a body [Hz]: its first resonance, a plate's in bending, and more."""
    return NARROWER * patch.first_resonance
