"""Rules of first values: bands, element sizes and levels of a seat before anything of it is known but its face."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

from impact.runs.variations import NARROWER
from seatfem.structures.kinds import Structure
from seatfem.structures.method import AUTO, Applicability, Method
from seatfem.structures.patch import ERRORS, Patch, Sizes, sizes_for

BANDS: Final = tuple(float(f"{10 ** (k / 5):.1e}") for k in range(15, 36))
"""Bandwidths to choose from [Hz]: five a decade, so that scenes with different contacts can share a cached seat."""
BAND_PER_FILTER: Final = 0.5  # bandwidth of the coarse seat times the filter's width
COARSE_TOLERANCE: Final = 0.02  # tolerance of the coarse seat's reduction: larger ones save no time
PER_ARC: Final = 0.8  # largest element size over the length of an arc: meshes are a little coarser than requested


def next_band(least: float) -> float:
    """Return the lowest of `BANDS` that is at least ``least`` [Hz]; the highest if none is."""
    return next((edge for edge in BANDS if edge >= least), BANDS[-1])


def lowest_band(patch: Patch) -> float:
    """Return the lowest bandwidth that describes a body [Hz]: its first resonance times `NARROWER`."""
    return NARROWER * patch.first_resonance


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


def coarse_method(seat: Structure, stated: Method, patch: Patch, width: float) -> Method:
    """Return the coarsest method of a seat that resolves the waves passed by a filter of ``width`` [s], struck as a
    whole: any reduction gives the same Green's function to within its tolerance."""
    least = min(max(lowest_band(patch), BAND_PER_FILTER / width), BANDS[-1])
    coarse = replace(
        stated,
        level=seat.level(0.0).level,
        rings=1,
        lip=None,
        reduction=AUTO,
        max_vectors=None,
        bandwidth=next_band(least),
        tolerance=COARSE_TOLERANCE,
    )
    if seat.drawn is None:
        return coarse
    sizes = element_sizes(patch, stated, least, ERRORS[0])
    return replace(coarse, size=sizes.size, contact_size=sizes.contact_size)
