"""What a measured seat leaves: the draws of its fit, what rings above its band, and what its fit does not explain."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

import impact
from impact.greens.base import GreensFunction
from impact.greens.modal import Residual
from impact.runs.variations import AT_ONCE, Terms, ringing_on
from seatfem.study.impacts.validity import fit_of
from seatfem.study.ladders.ladder import ComputedRun, Ladder
from seatfem.study.ladders.reduction import measured_draws
from seatfem.study.safety import OF_DRAWS


@dataclass(frozen=True)
class MeasuredRecord(Ladder):
    """The record of a measured seat, which only a better measurement makes finer."""

    def applies(self, run: ComputedRun) -> bool:
        """Return whether the seat is a fit to a record, with draws."""
        return bool(measured_draws(run))

    def neighbours(self, run: ComputedRun) -> Terms | None:
        """Return the run on each draw, with what lies above the band ringing at its end, and with g larger by a misfit
        beyond the noise."""
        fit = fit_of(run.seat.greens)
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
