"""The lowest eigenpairs of (K, M), complete by inertia, growing as more of them are asked for.

The shift lies inside the wanted part of the spectrum: K - sigma M is then indefinite, and the number of its negative
pivots (Sylvester) is that of the eigenvalues below. Lanczos continues until all of them are found; those above the
shift are counted at a gap behind them, by another factorization. A shift in the middle takes two thirds of the solves
of one below the spectrum; a shift just above the last eigenvalue takes half as many again, but counts all of them,
which is cheaper if a factorization costs more than these solves.
"""

from collections.abc import Callable
from functools import partial
from typing import Final

import numpy as np

from impact.notices import Progress, silent
from seatfem.structures.model import Array, SecondOrderModel
from seatfem.structures.reduction.eigen_search import (
    BlockLanczos,
    ConvergenceError,
    Counted,
    CountError,
    CrowdedError,
    RitzValues,
    Shift,
    between,
    counting_shift,
    expected,
    rigid_shapes,
)
from seatfem.structures.reduction.factorization import Backend
from seatfem.units import write_quantity

TOLERANCE: Final = 1e-8  # largest ||OP y - theta y||/|theta|; the error of an eigenvalue is its square, or round-off
WIDEST: Final = 8  # columns of a block: of 16 columns each costs a quarter less, but half as many again are needed
_AT_ONCE: Final = 160  # most eigenvalues about one shift; for more of them several shifts cost less
_BELOW: Final = 0.6  # fraction of the wanted eigenvalues below a shift with the fewest solves (up to 0.5: a sixth more)
_ALL: Final = 1.3  # estimated over wanted eigenvalues below a shift that is to count all; often a sixth fewer are there
_MANY: Final = 1.7  # most eigenvalues below such a shift, over the wanted: beyond, another factorization is cheaper
_EXTRA: Final = 0.27  # most eigenvalues from one shift above them, over unknowns^0.47, in 3-D; beyond, two are cheaper
_NEAR: Final = 1e8  # |theta sigma| of an eigenvalue so near to the shift that others lose too many digits
_GAP: Final = 1e-4  # least relative distance of two eigenvalues between which a count is made, if there is such a gap
_SEARCHES: Final = 14  # most factorizations in the search for a shift
_FEW: Final = 40  # eigenvalues up to which a better shift is not worth another factorization
_MOST_SOLVES: Final = 12  # most solves for each eigenvalue; three or four are usual
_MOST_BLOCKS: Final = 60  # blocks beyond these, for few eigenvalues


class Spectrum:
    """Eigenpairs of (K, M), the lowest first, none missing.

    Args:
        lowest: estimate of the lowest eigenvalue that is not zero [1/s^2]; 0: from the model.
        known: count, values and M-orthonormal vectors of all eigenpairs below a value, to begin with.

    Attributes:
        values, shapes: (m,) eigenvalues [1/s^2] and (n, m) M-orthonormal eigenvectors.
        top: value below which there are no other eigenvalues, by inertia [1/s^2].
        solves: number of right-hand sides.
        factorization: backend of the last factorization.
    """

    def __init__(
        self,
        model: SecondOrderModel,
        *,
        backend: Backend = "auto",
        lowest: float = 0.0,
        known: tuple[Counted, Array, Array] | None = None,
        progress: Progress = silent,
    ) -> None:
        self.model, self.backend, self.progress = model, backend, progress
        self.top, self.solves = 0.0, 0
        if known is None:
            self.shapes = rigid_shapes(model)
            self.values = np.zeros(self.shapes.shape[1])
        else:
            below, self.values, self.shapes = known
            self.top = below.value
        self.factorization = "none"
        self._lowest = lowest

    def first(self, n: int) -> None:
        """Compute at least the ``n`` lowest eigenpairs."""
        n = min(n, self.model.size)
        while len(self.values) < n:
            have = len(self.values)
            upto = min(n, have + _AT_ONCE)
            shift = self._search(have, upto)
            if shift.count >= upto:
                self._fill(shift)
            else:
                self._about(shift, upto, None)

    def below(self, value: float, most: float = np.inf) -> None:
        """Compute all eigenpairs below ``value`` [1/s^2], which is moved slightly if it is an eigenvalue.

        Raises:
            CrowdedError: there are more than ``most``.
        """
        if value <= self.top:
            return
        top: Counted = self._shift(value)
        if top.count > most:
            highest = write_quantity(np.sqrt(value) / (2 * np.pi), "frequency", 3)
            words = f"{top.count} modes lie below {highest} (limit {most:g}); lower the bandwidth"
            raise CrowdedError(words, top.count)
        if self._takes_two_shifts(top.count - len(self.values)):
            top = Counted(top.value, top.count)  # without its factors, which would be held beside those of others
        while top.count - len(self.values) > _AT_ONCE:
            self.first(len(self.values) + _AT_ONCE)
        if top.value > self.top:
            self._fill(top)

    def _shift(self, value: float) -> Shift:
        self.progress("factorization", 0.0)
        shift = counting_shift(self.model, value, self.backend)
        self.progress("factorization", 1.0)
        self.factorization = shift.factor.backend
        return shift

    def _fill(self, top: Counted) -> None:
        """Compute all eigenpairs below a shift, whose number is known."""
        missing = top.count - len(self.values)
        if missing < 0:
            raise CountError(
                f"{len(self.values)} eigenvalues are found, {top.count} counted below {top.value:.6e} 1/s^2"
            )
        if self._takes_two_shifts(missing):
            lower = max(self.top, 0.0)
            self._about(self._shift(lower + 0.5 * (top.value - lower)), top.count, top)
        elif missing > 0:
            self._about(top if isinstance(top, Shift) else self._shift(top.value), top.count, top)
        self.top = top.value

    def _about(self, shift: Shift, upto: int, top: Counted | None) -> None:
        """Compute the eigenpairs below a shift, and those above up to number ``upto``, below ``top`` or before a
        gap."""
        have, end = len(self.values), None if top is None else Counted(top.value, top.count)
        shift, lanczos = self._started(shift, upto - have)
        if shift.count < have:
            raise CountError(f"{have} eigenvalues are found where {shift.count} are counted below {shift.value:.6e}")
        aim = 2 * (upto - have) + lanczos.block
        done = have / (upto + 1)
        while True:
            _grow(lanczos, aim, partial(self.progress, "modes", done))
            ritz = lanczos.ritz()
            settled = _settled(ritz, shift, have, upto, end)
            if settled is not None and end is None and upto > shift.count:
                end = self._counted_behind(ritz, shift, upto)
                upto = end.count
                settled = _settled(ritz, shift, have, upto, end)
            if settled is not None:
                break
            need, good = upto - have, int(np.sum(ritz.errors <= TOLERANCE))
            done = min(0.99, (have + good) / (upto + 1))
            if lanczos.exhausted or lanczos.solves > _MOST_SOLVES * need + _MOST_BLOCKS * lanczos.block:
                raise self._failure(lanczos, ritz, shift, need)
            if good >= need + 2 * lanczos.block:  # an eigenvalue may be repeated more often than the block is wide
                lanczos.renew()
            aim = lanczos.size + max(lanczos.block, need // 8)
        self._take(lanczos, ritz, settled)
        self.top = shift.value if end is None else end.value
        self.progress("modes", 1.0)

    def _started(self, shift: Shift, need: int) -> tuple[Shift, BlockLanczos]:
        """Return the Lanczos process about a shift, which is moved if an eigenvalue is too near."""
        block = min(WIDEST, max(4, need))
        for move in (1e-3, -7e-3, 2e-2, 0.0):
            room = 4 * need + 8 * block
            lanczos = BlockLanczos(self.model, shift.factor, shift.value, self.shapes, block=block, room=room)
            lanczos.expand()
            if move == 0.0 or np.abs(lanczos.ritz().theta).max() * abs(shift.value) < _NEAR:
                break
            self.solves += lanczos.solves
            shift = self._shift(shift.value * (1 + move))
        return shift, lanczos

    def _counted_behind(self, ritz: RitzValues, shift: Shift, upto: int) -> Counted:
        """Return the number of eigenvalues below the first gap behind the ``upto``-th."""
        order = np.argsort(ritz.values)
        order = order[ritz.values[order] > shift.value]
        values, good = ritz.values[order], ritz.errors[order] <= TOLERANCE
        ready = len(good) if good.all() else int(np.argmin(good))
        ends = np.append(values, 1.05 * values[-1])
        places = range(upto - shift.count, ready + 1)  # between ends[i - 1] and ends[i]
        gaps = {i: (ends[i] - ends[i - 1]) / ends[i - 1] for i in places}
        place = next((i for i in places if gaps[i] > _GAP), max(places, key=lambda i: gaps[i]))
        counted = self._shift((ends[place - 1] + min(ends[place], 1.05 * ends[place - 1])) / 2)
        return Counted(counted.value, counted.count)

    def _take(self, lanczos: BlockLanczos, ritz: RitzValues, found: Array) -> None:
        """Add the Ritz pairs ``found`` of a Lanczos process to the eigenpairs."""
        shapes = lanczos.vectors(ritz, found)
        values = np.concatenate([self.values, np.einsum("nm,nm->m", shapes, self.model.K @ shapes)])
        order = np.argsort(values, kind="stable")
        self.values, self.shapes = values[order], np.concatenate([self.shapes, shapes], axis=1)[:, order]
        self.solves += lanczos.solves

    def _takes_two_shifts(self, missing: int) -> bool:
        """Return whether the ``missing`` eigenvalues below a counted shift are computed about another one."""
        return missing > WIDEST and not self._is_one_shift_cheaper(missing)

    def _is_one_shift_cheaper(self, want: int) -> bool:
        """Return whether one shift above ``want`` eigenvalues takes fewer operations than two factorizations."""
        solid = self.model.dofs is None or len(self.model.dofs.points) == 3
        return solid and want <= _EXTRA * self.model.size**0.47

    def _failure(self, lanczos: BlockLanczos, ritz: RitzValues, shift: Shift, need: int) -> ConvergenceError:
        where = f"about {write_quantity(np.sqrt(abs(shift.value)) / (2 * np.pi), 'frequency', 4)}"
        if lanczos.exhausted:
            return CountError(f"{need} modes are counted {where}, where there are {lanczos.size} at all")
        worst = np.sort(ritz.errors)[min(need, len(ritz.errors)) - 1]
        return ConvergenceError(
            f"{lanczos.solves} solves leave an error of {worst:.1e} in the {need} modes {where} "
            f"(limit {TOLERANCE:.0e}): too badly scaled matrices, check their units"
        )

    def _search(self, have: int, upto: int) -> Shift:
        """Return a shift with a part of the eigenvalues from ``have`` to ``upto`` below it, or hardly more than all."""
        want = upto - have
        once = self._is_one_shift_cheaper(want)
        target, most = have + (_ALL if once else _BELOW) * want, (_MANY if once else 1.3) * want + 4
        best: Shift | None = None
        counts: list[Counted] = []
        if self.top > 0 and have >= _FEW // 4:
            counts.append(Counted(self.top, have))
            value = between(counts, target)
        elif self._lowest > 0:
            value = self._lowest * max(target, 1.0) ** (2 / 3)
        else:
            value = expected(self.model, target)
        for _ in range(_SEARCHES):
            shift = self._shift(value)
            part = shift.count - have
            if want <= part <= most:
                return shift
            if part <= (1.0 if once else 0.85) * want:
                best = shift
                if part >= 0.1 * want or want <= _FEW:
                    break
            counts.append(Counted(shift.value, shift.count))
            value = between(counts, target)
        if best is None:
            raise CountError(f"{shift.count} eigenvalues lie below {shift.value:.3e} 1/s^2, and none can be told apart")
        return best


def _settled(ritz: RitzValues, shift: Shift, have: int, upto: int, end: Counted | None) -> Array | None:
    """Return the indices of Ritz pairs that are the eigenpairs from ``have`` to ``upto``; ``None`` if any is missing.

    Raises:
        CountError: there are more than the inertia counts.
    """
    good = ritz.errors <= TOLERANCE
    below = np.flatnonzero(good & (ritz.values < shift.value))
    order = np.argsort(ritz.values)
    above = order[ritz.values[order] > shift.value]
    if end is None:
        above = above[: upto - shift.count]
        settled = len(above) == upto - shift.count and bool(good[above].all())
    else:
        above = above[good[above] & (ritz.values[above] < end.value)]
        settled = len(above) == upto - shift.count
    if len(below) > shift.count - have or len(above) > upto - shift.count:
        raise CountError(
            f"{len(below)} and {len(above)} eigenvalues are found below and above {shift.value:.6e} 1/s^2, where "
            f"inertia counts {shift.count - have} and {upto - shift.count}"
        )
    return np.concatenate([below, above]) if settled and len(below) == shift.count - have else None


def _grow(lanczos: BlockLanczos, size: int, report: Callable[[], None]) -> None:
    """Grow by at least one block, up to ``size`` vectors.

    ``report``: called before each block, of which many may take minutes.
    """
    while not lanczos.exhausted:
        report()
        lanczos.expand()
        if lanczos.size >= size:
            break
