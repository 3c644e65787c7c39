"""Ladders of mesh and reduction: element sizes and order, bands, tolerances, and the record of a measured seat."""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

import impact
from impact.greens.base import GreensFunction
from impact.greens.modal import Residual
from impact.quantities import percent
from impact.runs.variations import NARROWER, STATIC_SHARE, Terms, ringing_on
from seatfem.structures.fits import fit_of
from seatfem.structures.kinds import Structure
from seatfem.structures.method import ARC_ERROR, Method
from seatfem.structures.patch import PATCH_ORDER, Patch, Sizes, mesh_error, sizes_for
from seatfem.study.ladders.ladder import Beginning, ComputedRun, Ladder
from seatfem.study.ladders.modes import widen_plate_band, with_modes_beyond, with_other_modes
from seatfem.study.method import BAND, CONTACT_SIZE, REED_BAND, REED_CONTACT_SIZE, REED_SIZE, SIZE, TOLERANCE, RunMethod
from seatfem.study.plan import Plan

FIRST_ERROR: Final = 0.1  # relative error of g by the mesh with which a run begins
FIRST_BAND: Final = 0.25  # band of the seat over the filter's width with which a run begins
BANDS: Final = tuple(float(f"{10 ** (k / 5):.1e}") for k in range(15, 36))
"""Bandwidths to choose from [Hz]: five a decade, so that scenes with different contacts can share a cached seat."""
TOLERANCES: Final = (0.01, 0.02, 0.05, 0.1)
"""Tolerances of a seat's reduction. A run begins with the first, as looser ones hide the error of the mesh, and takes
the next where a Krylov space does not reach it; a lip in arcs, which is reduced to modes, has the last."""
PER_ARC: Final = 0.8  # largest element size over the length of an arc: meshes are a little coarser than requested
BAND_ORDER: Final = 3.0  # order of convergence for which bands are widened: 2 far above the filter, more below
LEAST_WIDER: Final = 1.1  # least factor by which a plate's band is widened
OF_DRAWS: Final = 1.2
"""Factor on the largest change among 24 random draws of a record, 2.3 standard deviations: with the budget's own factor
4. A mode too weak to be identified is missing, which may change as much as noise does (largest seen: 3.6)."""


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


def fit_contact_size(seat: Structure, how: Method, contact_size: float) -> float:
    """Return the size of elements on the struck face that puts one in each arc of a lip that is meshed in space."""
    lip = how.lip
    if lip is None or not how.in_arcs or seat.elements_of(how) != "3d":
        return contact_size
    return min(contact_size, PER_ARC * lip.length / lip.arcs)


@dataclass(frozen=True)
class ElementSize(Ladder):
    """Element sizes of a body; the neighbour is the run on the coarser mesh of the stated mesh error."""

    effort: float = 1.5
    rule: str = f"expected error of g about {percent(FIRST_ERROR)}, by wavelength and contact face"
    dimension: str = "length"
    remedy: str = "refine {table}"

    def begin(self, known: Beginning, method: RunMethod) -> RunMethod:
        """Return the method with sizes for a relative error `FIRST_ERROR` of g, by wavelength and patch, and an element
        in each part of a lip."""
        seat, band = known.scene.seat, method.seat.bandwidth or 0.0
        if self.key != SIZE or known.patch is None or not known.is_reduced or not seat.sizes(method.seat).size:
            return method
        sizes = element_sizes(known.patch, method.seat, band, FIRST_ERROR)
        on_face = method.seat.contact_size or fit_contact_size(seat, method.seat, sizes.contact_size)
        return method.replaced({SIZE: sizes.size, CONTACT_SIZE: on_face})

    def refine(self, plan: Plan, factor: float) -> RunMethod:
        """Return the method of a plan with smaller elements in the bulk and on the struck face; the same where either
        is stated, as both make one error."""
        scene, method = plan.scene, plan.method
        keys = {SIZE: (SIZE, CONTACT_SIZE), REED_SIZE: (REED_SIZE, REED_CONTACT_SIZE)}.get(self.key, ())
        body, how = (scene.seat, method.seat) if self.role == "seat" else (scene.reed, method.reed)
        if how.exact or not keys or method.given.intersection(keys) or not (sizes := body.sizes(how)).size:
            return method
        patch, band = body.patch(), how.bandwidth or 0.0
        if patch is None:
            finer = factor ** (1 / PATCH_ORDER)
            sizes = Sizes(sizes.size / finer, sizes.contact_size / finer)
        else:  # where the rule expects more of the error, in the bulk or on the face, elements become smaller
            by_rule = sizes_for(patch, band, mesh_error(patch, band, sizes, how.order) / factor, how.order)
            sizes = Sizes(min(sizes.size, by_rule.size), min(sizes.contact_size, by_rule.contact_size))
        values = (float(f"{max(size, sizes.contact_size):.2g}") for size in (sizes.size, sizes.contact_size))
        return method.replaced(dict(zip(keys, values, strict=True)))

    def neighbours(self, run: ComputedRun) -> Terms:
        """Return the run on the coarser mesh or, without one, with g larger by the stated error of the mesh."""
        solved = run.solved[self.role]
        if solved.coarser is None:
            return run.with_larger_g(self.role, solved.greens.error_estimate.mesh)
        return ((run.with_greens(self.role, solved.coarser, 1 / (solved.refinement**PATCH_ORDER - 1)),),)


@dataclass(frozen=True)
class Bandwidth(Ladder):
    """The bandwidth of a body's reduction. Its error is the change by leaving out the highest modes within it."""

    effort: float = 0.5
    rule: str = "covers the first resonance and what the filter passes"
    dimension: str = "frequency"
    remedy: str = "raise {key}"

    def begin(self, known: Beginning, method: RunMethod) -> RunMethod:
        """Return the method with a band of a seat up to its first resonance, and `FIRST_BAND` over the filter."""
        if self.role != "seat" or not known.is_reduced or BAND in method.given:
            return method
        first = 0.0 if known.patch is None else lowest_band(known.patch)
        return method.replaced({BAND: next_band(max(first, FIRST_BAND / known.scene.run.filter_width))})

    def refine(self, plan: Plan, factor: float) -> RunMethod:
        """Return the method of a plan with a wider band, of a plate at most its limit, and elements for its shorter
        waves."""
        scene, method = plan.scene, plan.method
        if self.key == REED_BAND and self.key not in method.given and (value := method.value(self.key)):
            wider = float(min(value * factor**0.5, max(value, scene.reed.band_limit[0])))
            return method.replaced({self.key: wider}) if wider >= LEAST_WIDER * value else method
        if self.key != BAND or BAND in method.given or not (band := method.seat.bandwidth):
            return method
        wider = next_band(factor ** (1 / BAND_ORDER) * band)
        if wider <= band:
            return method
        values: dict[str, float] = {BAND: wider}
        if method.seat.size and SIZE not in method.given and (patch := scene.seat.patch()) is not None:
            before, after = (sizes_for(patch, each, FIRST_ERROR, method.seat.order).size for each in (band, wider))
            smaller = float(f"{method.seat.size * after / before:.2g}")
            values[SIZE] = max(smaller, method.seat.contact_size or 0.0)
        return method.replaced(values)

    def neighbours(self, run: ComputedRun) -> Terms:
        """Return the run with the body's highest modes moved into its residual flexibility, and, where its contact
        feels few modes, with that flexibility in place of modes beyond.

        If the reduction's error is unknown, the ladder of its tolerance says so. Along a lip the error of the arcs'
        static compliance counts, too. The stated error of the reduction is that of an arc under a pulse as short as the
        band is wide: it hardly falls with the band.
        """
        greens, body = run.solved[self.role].greens, run.bodies[self.role]
        if (error := greens.error_estimate.reduction) is None:
            return ()
        if self.role == "seat":
            in_arcs = run.method.seat.in_arcs
            narrower = run.scene.seat.narrow_bands(greens, in_arcs=in_arcs)
            varied = tuple(run.with_greens("seat", other, share) for other, share in narrower)
            of_statics = run.with_larger_g("seat", min(error, ARC_ERROR)) if in_arcs else ()
            if varied and not in_arcs:
                beyond = with_modes_beyond(body, run.method.seat.bandwidth or 0.0)
                varied += tuple(run.with_greens("seat", other.greens, share) for other, share in beyond)
            return (varied, *of_statics) if varied else ()
        if self.role == "stopper":
            varied = tuple(run.with_body("stopper", other, share) for other, share in with_other_modes(body))
            return (varied,) if varied else ()
        reed = run.method.reed
        if not reed.exact or reed.bandwidth is None or body.greens.modal is None:  # of a reduction: by its tolerance
            return ()
        others = tuple(widen_plate_band(run)) or tuple(with_other_modes(body, reed.bandwidth))
        varied = tuple(run.with_body("reed", other, share) for other, share in others)
        return (varied,)


@dataclass(frozen=True)
class Tolerance(Ladder):
    """The tolerance of a body's reduction; its neighbour has g larger by the error that the reduction states."""

    effort: float = 0.2
    rule: str = "of no effect: a lip in arcs is reduced to modes"
    remedy: str = "lower {key}"

    def describe(self, value: float) -> str:
        """Return a tolerance in percent."""
        return percent(value)

    def begin(self, known: Beginning, method: RunMethod) -> RunMethod:
        """Return the method with a loose tolerance of the seat; a lip in arcs is reduced to modes, at any tolerance."""
        if self.role != "seat" or not known.is_reduced or TOLERANCE in method.given:
            return method
        return method.replaced({TOLERANCE: TOLERANCES[-1 if method.seat.in_arcs else 0]})

    def finer(self, value: float, factor: float) -> float:
        """Return a stricter tolerance."""
        return value / factor

    def neighbours(self, run: ComputedRun) -> Terms:
        """Return the run with g larger by the reduction's error; a fit to a record has its draws instead."""
        error = run.solved[self.role].greens.error_estimate.reduction
        if self.role == "seat" and (run.scene.seat.other_fits() or (run.method.seat.in_arcs and error is not None)):
            return ()  # along a lip, reduced to modes, the error is that of the band
        return run.with_larger_g(self.role, error)


@dataclass(frozen=True)
class MeasuredRecord(Ladder):
    """The record of a measured seat, whose error only a better measurement reduces."""

    remedy: str = "average over more hammer blows, or measure to higher frequencies than 1/run.filter_width"

    def applies(self, run: ComputedRun) -> bool:
        """Return whether the seat is a fit to a record, with draws."""
        return bool(run.scene.seat.other_fits())

    def neighbours(self, run: ComputedRun) -> Terms:
        """Return the run on each draw, that with the residual flexibility above the band as a mode at its end, and that
        with g larger by a misfit beyond the noise."""
        fit = fit_of(run.seat.greens)
        terms = [tuple(run.with_greens("seat", draw, OF_DRAWS) for draw in run.scene.seat.other_fits())]
        if fit.highest is not None and (ringing := _ringing_from(run.seat.greens, 2 * math.pi * fit.highest)):
            terms.append((run.with_greens("seat", ringing),))
        return (*terms, *run.with_larger_g("seat", fit.unexplained))


def _ringing_from(greens: GreensFunction, omega: float) -> GreensFunction | None:
    """Return a fit whose residual compliance is replaced by a mode at ``omega`` [rad/s]; ``None`` without one."""
    if (modal := greens.modal) is not None:
        ringing = ringing_on(impact.Body(greens), omega / float(modal.omega.max())) if np.any(modal.omega) else None
        return None if ringing is None else ringing.greens
    if (poles := greens.pole_sum) is None or len(greens.ports) > 1 or not np.any(poles.compliance):
        return None
    above = (1 - STATIC_SHARE) * float(poles.compliance[0, 0])
    zeta = float(np.median(-poles.poles.real / np.abs(poles.poles))) if len(poles.poles) else STATIC_SHARE
    mode = impact.ModalGreens(
        np.array([omega]), np.array([zeta]), np.array([[omega * math.sqrt(above)]]), Residual.none(), greens.ports
    )
    return impact.SumGreens((replace(poles, compliance=STATIC_SHARE * poles.compliance), mode))
