"""The ladder of numbers of modes, and other modes of a plate that estimate the error by those beyond the last."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from impact.bodies.body import Body
from impact.runs.variations import NARROWER, Terms, Variation, narrow_body, ringing_on
from seatfem.structures.kinds.structure import MOST_BEAM_MODES
from seatfem.structures.rings import Division
from seatfem.study.impacts.bodies import striker_of
from seatfem.study.ladders.ladder import Beginning, ComputedRun, Ladder
from seatfem.study.method import MODES, RunMethod

FEW_MODES: Final = 20  # modes of a beam with which a run begins; with less than half as many, fewer ones tell little
FEWER: Final = 1.4  # ratio of the numbers of a beam's modes whose change equals the truncation error
OF_MODES: Final = ((NARROWER, 0.65), (NARROWER**2, 0.3))
"""Ratio r, and the truncation error of a plate's modes over the change without those above 1/r of the highest: second
order gives 0.64 and 0.18; 0.3, as the first alone was too small for three of 108 measures."""
MANY_FELT: Final = 4.0
"""Limit of `modes_felt`, the effective number of modes above 1/2.56 of the highest in a contact, from which on they
predict what the truncated ones do: tip of a strip 6.5, lip in arcs 13 to 28; middle of a disc 1.0 to 1.6, paddle 2.3"""
BEYOND: Final = ((1.0, 0), (2.0, 0), (1.0, 4))
"""Modes in place of all that yields beyond the highest: (their frequency over its, octaves they span or 0 for one). One
alone may be hidden by the filter."""
HIDDEN: Final = 1.5
"""Factor on the change by the modes of `BEYOND`, as the time step damps higher ones: with 1, 8 of 186 bars of discs,
whose highest modes alone were known, were too narrow, by 1.45 at most."""
ALONE: Final = 2.0  # that factor where no mode can be left out: with `HIDDEN` a bar was 12 % too narrow
HARDLY: Final = 0.7
"""Share of what yields beyond a plate's band below which the modes of a wider band are little of it, so that `BEYOND`
counts, too: a small disc may feel its next mode beyond that band (tests/study/test_plate_modes_felt.py)."""


@dataclass(frozen=True)
class ModeCount(Ladder):
    """The number of modes of a beam; its neighbours are runs with fewer modes and, if it is small, one with many."""

    effort: float = 0.7
    rule: str = "few, to begin with"
    remedy: str = "keep more {key}"

    def finer(self, value: int, factor: float) -> int:
        """Return more modes."""
        return min(MOST_BEAM_MODES, math.ceil(value * FEWER ** math.ceil(math.log2(factor))))

    def begin(self, known: Beginning, method: RunMethod) -> RunMethod:
        """Return the method with `FEW_MODES` modes of a reed that is a beam."""
        is_open = self.role == "reed" and method.reed.n_modes is not None and MODES not in method.given
        return method.replaced({MODES: FEW_MODES}) if is_open else method

    def applies(self, run: ComputedRun) -> bool:
        """Return whether the body is a beam; a stopper must also have one contact only."""
        return self._number(run) > 0

    def _number(self, run: ComputedRun) -> int:
        """Return the number of modes of a beam; 0 of other bodies."""
        if self.role != "stopper":
            return (run.method.seat if self.role == "seat" else run.method.reed).n_modes or 0
        stopper = run.scene.stopper
        is_beam = stopper is not None and "stopper" not in run.solved and stopper.parts == Division()
        return stopper.body.stated().n_modes or 0 if stopper is not None and is_beam else 0

    def neighbours(self, run: ComputedRun) -> Terms:
        """Return the run with other numbers of modes."""
        return (tuple(self._with(run, other, weight) for other, weight in other_modes(self._number(run))),)

    def _with(self, run: ComputedRun, number: int, weight: float) -> Variation:
        scene = run.scene
        if self.role == "reed":
            return run.with_body("reed", striker_of(scene, number), weight)
        kind = scene.seat if self.role == "seat" or scene.stopper is None else scene.stopper.body
        return run.with_greens(self.role, kind.body(None, number).greens, weight)


def widen_plate_band(run: ComputedRun) -> Iterator[tuple[Body, float]]:
    """Yield a plate that strikes with its modes in a wider band, all of them and those in `NARROWER` times its own, and
    the factor from each change to the truncation error, of second order; nothing where plate theory allows none.

    Where these modes are little of what yields beyond the band (`HARDLY`), as few are felt in the middle of a disc or
    all around a ring, what is left beyond vibrates, too (`BEYOND`).
    """
    body, reed, own = run.scene.reed, run.method.reed, run.problem.striker
    beyond = body.solve_in_wider_band(own.greens, body.lips(reed.lip, reed.behind), run.progress)
    if beyond is None:
        return
    wider, ratio = beyond
    striker = striker_of(run.scene, greens=wider)
    yield striker, 1 / (1 - ratio**-2)
    if ratio > NARROWER and (less := narrow_body(striker, ratio / NARROWER)) is not None:
        yield less, 1 / (1 - NARROWER**-2)
    if _residual(striker) > (1 - HARDLY) * _residual(own):
        for ringing in _add_modes(striker, ratio * (reed.bandwidth or 0.0)):
            yield ringing, 1.0


def _residual(body: Body) -> float:
    """Return what yields beyond a body's modes, summed over its contacts [m/N]."""
    return 0.0 if body.greens.modal is None else float(np.trace(body.greens.modal.residual.static()))


def with_other_modes(body: Body, band: float = 0.0) -> Iterator[tuple[Body, float]]:
    """Yield a plate of a ``band`` [Hz] with other modes, and the factor from its change to the truncation error.

    First the highest modes are left out (`OF_MODES`); their effect extrapolates to that of the next ones if many of
    them take part in the contact. In the middle of a disc, or all around a ring, few do: then modes beyond the last are
    added (`with_modes_beyond`). A run's time step hides a part of their effect (`HIDDEN`).
    """
    weight = ALONE
    for ratio, share in OF_MODES:
        if (fewer := narrow_body(body, ratio)) is not None:
            weight = HIDDEN
            yield fewer, share
    yield from with_modes_beyond(body, band, weight)


def with_modes_beyond(body: Body, band: float, weight: float = HIDDEN) -> Iterator[tuple[Body, float]]:
    """Yield a body of a ``band`` [Hz] with modes added beyond its last (`BEYOND`), each with the ``weight`` of its
    change; nothing where the contact feels so many modes (`MANY_FELT`) that leaving some out tells the error."""
    for ringing in _add_modes(body, band) if modes_felt(body) < MANY_FELT else ():
        yield ringing, weight


def _add_modes(body: Body, band: float) -> Iterator[Body]:
    """Yield a body of a ``band`` [Hz] with each of the modes of `BEYOND`; nothing where none yields beyond its last."""
    for above, octaves in BEYOND:
        if (ringing := ringing_on(body, above, band, octaves)) is not None:
            yield ringing


def modes_felt(body: Body) -> float:
    """Return the effective number of a body's highest modes (last ratio of `OF_MODES`) that take part in its contacts.

    It is the participation number (sum c)^2/sum c^2 of their compliances c = |shape|^2/omega^2: n for n equal modes, 1
    if one dominates. A free plate that meets a lip in parts may close them all at once, with their mean: the lesser
    number counts.
    """
    g = body.greens.modal
    if g is None or not np.any(g.omega):
        return 0.0
    top = g.omega > g.omega.max() / OF_MODES[-1][0]
    each = g.shapes[top] / g.omega[top, None]
    yields = np.sum(each**2, axis=1)[None]
    if not np.all(g.omega):
        yields = np.append(yields, np.mean(each, axis=1)[None] ** 2, axis=0)
    squares = np.maximum(np.sum(yields**2, axis=1), np.finfo(float).tiny)
    return float(np.min(yields.sum(axis=1) ** 2 / squares))


def other_modes(n_modes: int) -> tuple[tuple[int, float], ...]:
    """Return the numbers of a beam's modes to compare ``n_modes`` with, and the factor from each change to its error:
    fewer by `FEWER`, half as many, whose change is twice the error, and many where there are few."""
    less = ((max(1, round(n_modes / FEWER)), 1.0), (max(1, round(n_modes / 2)), 1 / 2))
    more = ((2 * FEW_MODES, 1.0),) if 2 * n_modes < FEW_MODES else ()
    return tuple((number, weight) for number, weight in less + more if number != n_modes)
