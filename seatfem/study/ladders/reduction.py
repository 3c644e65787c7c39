"""Ladders of the reductions: bands, tolerances, the modes of a plate that strikes, the record of a measured seat."""

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

import impact
from impact.greens.base import GreensFunction
from impact.greens.modal import Residual
from impact.runs.variations import AT_ONCE, NARROWER, Terms, narrowed, ringing_on
from seatfem.structures.estimates.costs import TOLERANCE_POWER, highest_pole, seat_memory, seat_seconds
from seatfem.structures.estimates.surrogate import ERRORS
from seatfem.structures.kinds import Structure
from seatfem.study.impacts import validity
from seatfem.study.ladders import ladder, mesh
from seatfem.study.method import BAND, REED_BAND, TOLERANCE, RunMethod
from seatfem.study.prerun import look, sensitivity
from seatfem.study.prerun.context import PlanningContext
from seatfem.study.safety import FEWER_POLES, LEAST_FINER, OF_DRAWS
from seatfem.study.scene import Run
from seatfem.units import write_quantity

UNCOUNTED: Final = 1e-6  # time of a reduction over its band, of a body whose modes cannot be counted yet [s/Hz]
LOOSER_AND_STRICTER: Final = (0.1, 0.003)  # tolerances that a trade compares
OF_A_BEAM: Final = 20e3  # Hz: of the plate in whose place a beam stands, which starts as it does


def measured_draws(run: ladder.ComputedRun) -> tuple[GreensFunction, ...]:
    """Return further fits to the record of a measured seat, whose spread stands for the error of a reduction."""
    measured = run.scene.seat.measured
    return () if measured is None else tuple(measured.fit().draws)


@dataclass(frozen=True)
class Bandwidth(ladder.BodyLadder):
    """The band of a body's reduction. Its error is what the highest modes within it change when they are left out."""

    def describe(self, value: float) -> str:
        """Return a frequency with its unit."""
        return write_quantity(value, "frequency", 3)

    def finer(self, value: float, factor: float, run: Run, reed: Structure) -> float | None:
        """Return a wider band; of a plate at most as far as its theory goes."""
        if self.role == "reed":
            plate = reed.thin_plate
            return float(min(value * factor**0.5, math.inf if plate is None else max(value, plate.widest_band)))
        return next((edge for edge in look.BANDS if edge > value * (1 + 1e-9)), float(LEAST_FINER * value))

    def neighbours(self, run: ladder.ComputedRun) -> Terms | None:
        """Return the run without the highest modes of the body, as moved into its residual.

        A Krylov space keeps modes far beyond the band: of the seat those down to 1.6 below the last are left out.
        Where the reduction's own error is not known, its ladder says so.
        """
        solved, body = run.solved(self.role), run.body(self.role)
        assert solved is not None
        assert body is not None
        if solved.greens.error_estimate.reduction is None:
            return ()
        if self.role == "seat":
            modal = solved.greens.modal
            if measured_draws(run) or run.scene.seat.elastic is None or modal is None or len(modal.omega) == 0:
                return ()
            highest = float(modal.frequencies_hz.max())
            return ((run.with_greens("seat", narrowed(modal, highest / NARROWER)),),)
        scene = run.scene
        struck = scene.reed.thin_plate if self.role == "reed" else scene.stopper and scene.stopper.body.elastic
        if struck is None:
            return ()
        modes = sensitivity.with_other_modes(body, run.method.reed.bandwidth or 0.0 if self.role == "reed" else 0.0)
        others = tuple(run.with_body(self.role, other, share) for other, share in modes)
        return (others,) if others or self.role == "stopper" else None

    def extend(self, context: PlanningContext, option: ladder.Option) -> Iterable[ladder.Option]:
        """Yield the bands up to one above which nothing counts, or in which modes are too many; of statics the
        narrowest; of a plate that strikes the one that its pre-runs chose."""
        if self.role != "seat":
            of_reed = {} if context.band is None else {REED_BAND: context.band.errors}
            yield replace(option, changes={**option.changes, **of_reed})
            return
        if not context.reduced or option.seat.exact:
            yield option
            return
        if option.seat.static:
            yield option.with_seat({}, {"bandwidth": context.lowest_band})
            return
        for band in context.bands:
            if band > context.bands[0]:
                seat = replace(context.elements(band, context.tolerances[0], ERRORS[0]), level=option.seat.level)
                if mesh.too_many_modes(context, seat):
                    return
            yield option.with_seat({}, {"bandwidth": band})
            if context.sensitivity.worst(context.sensitivity.above(band)) <= context.sensitivity.finest:
                return

    def beside(self, run: Run, reed: Structure, centre: RunMethod) -> Iterator[ladder.Neighbour]:
        """Yield narrower and wider bands; of a plate that has an equivalent beam also this beam."""
        name, value = ("band", centre.seat.bandwidth) if self.role == "seat" else ("reed band", centre.reed.bandwidth)
        if value is None or (self.role != "seat" and centre.ports is None) or self.role == "stopper":
            return
        if self.role == "reed":
            yield ladder.Neighbour("beam", "beam", {self.key: min(OF_A_BEAM, value)}, in_place=validity.BEAM)
        for k in (-1, 1):
            yield ladder.Neighbour(f"{name} x {ladder.RATIO**k:.2f}", name, {self.key: value * ladder.RATIO**k})


@dataclass(frozen=True)
class Tolerance(ladder.BodyLadder):
    """The tolerance of a body's reduction; g is larger by the error that the reduction states."""

    falls: bool = True

    def describe(self, value: float) -> str:
        """Return a tolerance in percent."""
        return ladder.large_percent(value)

    def finer(self, value: float, factor: float, run: Run, reed: Structure) -> float | None:
        """Return a stricter tolerance."""
        return value / factor if self.role == "seat" else None

    def neighbours(self, run: ladder.ComputedRun) -> Terms | None:
        """Return the run with g larger by the reduction's error; that of a fit to a record is among its draws."""
        solved = run.solved(self.role)
        assert solved is not None
        if self.role == "seat" and measured_draws(run):
            return ()
        return run.with_larger_g(self.role, solved.greens.error_estimate.reduction)

    def extend(self, context: PlanningContext, option: ladder.Option) -> Iterable[ladder.Option]:
        """Yield the tolerances, with the cost of the seat; a stricter one keeps modes farther beyond the band."""
        elements, band = option.elements, option.seat.bandwidth or 0.0
        if self.role != "seat" or elements is None:
            yield option
            return
        for tolerance in context.tolerances[:1] if option.seat.static else context.tolerances:
            errors: dict[str, sensitivity.Changes] = {}
            if not option.seat.static:
                reach = band * max(1.0, FEWER_POLES * highest_pole(elements.model, tolerance))
                errors = {BAND: context.sensitivity.above(reach), TOLERANCE: context.per_g(tolerance)}
            costs = _costs(context, elements, tolerance, band, static=option.seat.static)
            yield option.with_seat(errors, {"tolerance": tolerance}, **costs)

    def beside(self, run: Run, reed: Structure, centre: RunMethod) -> Iterator[ladder.Neighbour]:
        """Yield a looser and a stricter tolerance; none of a lip in arcs, which is reduced to modes."""
        if self.role == "seat" and centre.seat.bandwidth is not None and (centre.ports or 1) == 1:
            for tolerance in LOOSER_AND_STRICTER:
                yield ladder.Neighbour(f"tolerance {tolerance:g}", "tolerance", {TOLERANCE: tolerance})


def _costs(
    context: PlanningContext, elements: ladder.Elements, tolerance: float, band: float, *, static: bool
) -> Mapping[str, float]:
    """Return the predicted seconds, bytes and poles of a seat reduced to a tolerance."""
    over_band, model = UNCOUNTED * band, elements.model
    if model is None:
        return {"seconds": over_band * tolerance**TOLERANCE_POWER}
    ratio, rates = tolerance / elements.tolerance, context.machine
    own = model.stricter(ratio)
    models = [own] if elements.coarser is None else [own, elements.coarser.stricter(ratio)]
    seconds = sum(sum(seat_seconds(each, rates, static=static).values()) for each in models)
    seconds += 0.0 if own.drawn else over_band
    return {"seconds": seconds, "memory": seat_memory(own)[0], "poles": 0.0 if static else own.poles}


@dataclass(frozen=True)
class MeasuredRecord(ladder.Ladder):
    """The record of a measured seat, which only a better measurement makes finer."""

    def applies(self, run: ladder.ComputedRun) -> bool:
        """Return whether the seat is a fit to a record, with draws."""
        return bool(measured_draws(run))

    def neighbours(self, run: ladder.ComputedRun) -> Terms | None:
        """Return the run on each draw, with what lies above the band ringing at its end, and with g larger by a misfit
        beyond the noise."""
        fit = validity.fit_of(run.seat.greens)
        terms = [tuple(run.with_greens("seat", draw, OF_DRAWS) for draw in measured_draws(run))]
        if fit.highest is not None and (ringing := _ringing_from(run.seat.greens, 2 * math.pi * fit.highest)):
            terms.append((run.with_greens("seat", ringing),))
        return (*terms, *(run.with_larger_g("seat", fit.unexplained) or ()))


def _ringing_from(greens: GreensFunction, omega: float) -> GreensFunction | None:
    """Return a fit whose bare compliance rings at ``omega`` [rad/s]; ``None`` without one."""
    if (modal := greens.modal) is not None:
        ringing = ringing_on(impact.Body(greens), omega / float(modal.omega.max())) if np.any(modal.omega) else None
        return None if ringing is None else ringing.greens
    if (poles := greens.pole_sum) is None or len(greens.ports) > 1 or not np.any(poles.compliance):
        return None
    above = (1 - AT_ONCE) * float(poles.compliance[0, 0])
    zeta = float(np.median(-poles.poles.real / np.abs(poles.poles))) if len(poles.poles) else AT_ONCE
    mode = impact.ModalGreens(
        np.array([omega]), np.array([zeta]), np.array([[omega * math.sqrt(above)]]), Residual.none(), greens.ports
    )
    return impact.SumGreens((replace(poles, compliance=AT_ONCE * poles.compliance), mode))
