"""Laws of joints: conforming rough faces, bedded in, whose unloading is stiffer than their loading.

A joint remembers the deepest closure m since it last opened. Its closure at a force N has an elastic part u(N) and a
part that remains until it opens: on the loading branch, at and beyond m, the closure is l(N) >= u(N); below m, for
loading and unloading,

    pen = m - u(N_m) + u(N),   l(N_m) = m.

Opening resets the joint, so that each contact follows the same branches, as in a joint that is bedded in. If the slope
of u is at most that of l at each force, unloading is nowhere softer than loading. The recoverable energy is

    Psi = int_0^N N' u'(N') dN',   and N l' dN - dPsi >= 0 on the loading branch:

no history of closures gains energy. Over one step the joint is elastic: the work along its path is a convex function of
the closure at the end, so that every step rule of `impact.march.laws` applies unchanged, and the conserving rule
dissipates exactly the hysteresis of the joint.

Source of the power law of machined faces, closure like the root of the pressure: Back, Burdekin & Cowley, Proc. 13th
MTDR Conf. (1973) 87; of unloading along stiffer branches: Greenwood & Williamson, Proc. R. Soc. A 295 (1966) 300.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar, Final

import numpy as np

from impact.greens.base import Array
from impact.march.laws import ROUGH, TABLE, LawError, Parameters

MOST_KNOTS: Final = 500
"""Most rows of a joint by table: each of its contacts keeps a copy of them."""
_SAME: Final = 1e-9  # relative tolerance of slopes; also the force that counts as zero, over the largest force


def deepest_so_far(penetration: Array) -> Array:
    """Return the (n,) deepest closure since the joint last opened, for a history of penetrations (n,) [m]."""
    out = np.zeros(len(penetration))
    edges = np.flatnonzero(np.diff(np.concatenate([[False], penetration > 0, [False]])))
    for first, end in edges.reshape(-1, 2):
        out[first:end] = np.maximum.accumulate(penetration[first:end])
    return out


@dataclass(frozen=True)
class RoughJoint:
    """Rough faces, N = k pen^n when loaded; u(N) = r (N/k)^(1/n): unloading is 1/r times as stiff at each force.

    A cycle to the force N_m loses (1 - r) of its work k m^(n + 1)/(n + 1); r = 1 is elastic.

    Attributes:
        stiffness: k [N/m^n].
        exponent: n >= 1; 2 for machined faces.
        recovery: r, fraction of the closure that is elastic, 0 < r <= 1.

    Raises:
        LawError: a stiffness that is not positive, an exponent below 1, a recovery off (0, 1].
    """

    stiffness: float
    exponent: float = 2.0
    recovery: float = 1.0
    code: ClassVar[int] = ROUGH
    elastic: ClassVar[bool] = True

    def __post_init__(self) -> None:
        if not (self.stiffness > 0 and math.isfinite(self.stiffness)):
            raise LawError(f"RoughJoint.stiffness = {self.stiffness:g} must be positive and finite")
        if not (self.exponent >= 1 and math.isfinite(self.exponent)):
            raise LawError(f"RoughJoint.exponent = {self.exponent:g} must be >= 1 (softest at no load) and finite")
        if not 0 < self.recovery <= 1:
            raise LawError(f"RoughJoint.recovery = {self.recovery:g} must be in (0, 1]: above 1 it would give energy")

    @staticmethod
    def through(*, force: float, closure: float, exponent: float = 2.0, recovery: float = 1.0) -> RoughJoint:
        """Return the joint that a ``force`` [N] closes by ``closure`` [m]; raises as the class does."""
        if not closure > 0:
            raise LawError(f"RoughJoint: closure = {closure:g} m must be positive")
        return RoughJoint(force / closure**exponent, exponent, recovery)

    @property
    def parameters(self) -> Parameters:
        """Return k, n and r."""
        return (self.stiffness, self.exponent, self.recovery)

    def closure(self, force: float) -> float:
        """Return (N/k)^(1/n) [m]."""
        return float((force / self.stiffness) ** (1 / self.exponent))

    def potential(self, penetration: Array) -> Array:
        """Return the recoverable energy k r x^(n + 1)/(n + 1) [J], x = (pen - (1 - r) m)/r."""
        rest = (1 - self.recovery) * deepest_so_far(penetration)
        back = np.maximum(penetration - rest, 0.0) / self.recovery
        return np.asarray(self.stiffness * self.recovery * back ** (self.exponent + 1) / (self.exponent + 1))


@dataclass(frozen=True)
class TableJoint:
    """A joint by table: forces while it is loaded up to the last row, and while it is unloaded from there.

    Forces are linear between the rows, starting from zero force at zero closure, and extrapolated beyond the last row.

    Attributes:
        closures: rising closures [m]; the first may be 0.
        loading: rising forces [N].
        unloading: forces [N], at most ``loading``, equal in the last row; 0 up to the remaining closure.

    Raises:
        LawError: columns of unequal length, fewer than 2 rows or more than `MOST_KNOTS`, numbers that do not rise, a
            last row that is not common, an unloading branch softer than the loading one at some force.
    """

    closures: tuple[float, ...]
    loading: tuple[float, ...]
    unloading: tuple[float, ...]
    code: ClassVar[int] = TABLE
    elastic: ClassVar[bool] = True

    def __post_init__(self) -> None:
        x, up, down = (np.asarray(column, dtype=float) for column in (self.closures, self.loading, self.unloading))
        if not 2 <= len(x) <= MOST_KNOTS or len(x) != len(up) or len(x) != len(down):
            raise LawError(
                f"TableJoint: {len(x)} closures, {len(up)} loading and {len(down)} unloading forces: give as many of "
                f"each, 2 to {MOST_KNOTS}"
            )
        if not (np.all(np.isfinite([x, up, down])) and x[0] >= 0 and min(up[0], *down) >= 0):
            raise LawError("TableJoint: closures and forces must be finite and not negative")
        if x[0] == 0 and (up[0] > 0 or down[0] > 0):
            raise LawError("TableJoint: row 1 has a force at no closure: give 0 there")
        if row := next((k for k in range(1, len(x)) if x[k] <= x[k - 1] or up[k] <= up[k - 1]), 0):
            raise LawError(f"TableJoint: closure and loading force must rise from row to row, row {row + 1} does not")
        if down[-1] != up[-1]:
            raise LawError("TableJoint: the last row is where unloading begins: give it one force in both columns")
        self._check_unloading()

    def _check_unloading(self) -> None:
        """Raise `LawError` for an unloading branch that does not rise, or is softer than the loading one somewhere."""
        (x, up), (back, down) = self.branches
        if row := next((k for k in range(1, len(back)) if down[k] <= down[k - 1]), 0):
            raise LawError(
                f"TableJoint: the unloading force must be 0 up to a closure and rise from there on; at "
                f"{back[row] + self.closures[-1] - back[-1]:g} m it does not"
            )
        soft, stiff = np.diff(up) / np.diff(x), np.diff(down) / np.diff(back)
        for k, slope in enumerate(stiff):
            meant = (up[1:] > down[k] * (1 + _SAME)) & (up[:-1] < down[k + 1] * (1 - _SAME))
            if np.any(soft[meant] > slope * (1 + _SAME)):
                raise LawError(
                    f"TableJoint: between {down[k]:g} and {down[k + 1]:g} N it is unloaded along {slope:g} N/m, softer "
                    f"than it was loaded along, {soft[meant].max():g} N/m: such a joint would give energy"
                )

    @property
    def branches(self) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
        """Return (l, N) of the loading branch and (u, N) of the unloading one [m, N], each from (0, 0) on."""
        x, up, down = (np.asarray(column, dtype=float) for column in (self.closures, self.loading, self.unloading))
        pressed = int(np.argmax(down > _SAME * down[-1]))
        start = x[pressed - 1] if pressed else 0.0
        loaded = (x, up) if x[0] == 0 else (np.append(0.0, x), np.append(0.0, up))
        return loaded, (np.append(0.0, x[pressed:] - start), np.append(0.0, down[pressed:]))

    @property
    def parameters(self) -> Parameters:
        """Return the numbers of knots of both branches, and the knots."""
        (x, up), (back, down) = self.branches
        return (float(len(x)), float(len(back)), 0.0, 0.0, *x, *up, *back, *down)

    def closure(self, force: float) -> float:
        """Return l(N) [m]."""
        return float(_on_line(*self.branches[0][::-1], np.array([force]))[0])

    def potential(self, penetration: Array) -> Array:
        """Return the recoverable energy int N du [J]."""
        (x, up), (back, down) = self.branches
        deepest = deepest_so_far(penetration)
        at = penetration - deepest + _on_line(down, back, _on_line(x, up, deepest))
        at = np.maximum(at, 0.0)
        works = np.append(0.0, np.cumsum((down[1:] + down[:-1]) / 2 * np.diff(back)))
        below = np.minimum(np.searchsorted(back, at, side="right") - 1, len(back) - 2)
        start = down[below]
        return np.asarray(works[below] + (start + _on_line(back, down, at)) / 2 * (at - back[below]))

    def scaled(self, share: float) -> TableJoint:
        """Return the joint for a ``share`` of the area."""
        loading, unloading = (tuple(share * force for force in column) for column in (self.loading, self.unloading))
        return TableJoint(self.closures, loading, unloading)


def _on_line(x: Array, y: Array, at: Array) -> Array:
    """Return the values of a piecewise linear ``y`` over ``x``, extrapolated beyond its end."""
    beyond = np.maximum(at - x[-1], 0.0) * (y[-1] - y[-2]) / (x[-1] - x[-2])
    return np.asarray(np.interp(at, x, y) + beyond)
