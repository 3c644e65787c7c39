"""Contact laws, force N >= 0 from penetration, and fluid films in the open gap, which resist closing and opening.

Step rules. With the *passive* rule the force of a step is the law's at the end of the step, N = law(pen_end),
pen_end = pen_free - W0 N; for a convex potential Psi

    N (pen_end - pen_start) >= Psi(pen_end) - Psi(pen_start),

so that a step may lose energy and never gains it; for a law with a potential the loss is of first order in the step.
With the *conserving* rule the force is the discrete gradient N = (Psi(pen_end) - Psi(pen_start))/(pen_end - pen_start),
times the law's own damping factor 1 + d pen', if it has one; without damping the equality holds. The rule is of second
order; where the step does not resolve the contact's own oscillation (Psi'' W0 > 1), the force alternates from step to
step. The *blended* rule is N = (1 - s) conserving + s passive with

    s = x^2/(1 + x^2),   x = Psi''(pen_start) W0  (W0: displacement per unit force if all contacts press at once),

so that it is conserving where the contact is resolved, passive where it is not, and never gains energy, as s is known
before the step. Each rule solves one increasing scalar equation per contact for N. These statements concern the contact
only: whatever the rule, bodies lose energy by their damping, and a bare residual compliance c loses c/2 times the
square of each force jump. The default, *auto*, is blended for a law that is `elastic`, else passive.

Source: Gonzalez, J. Nonlinear Sci. 6 (1996) 449 (discrete gradients); docs/methods.md, "Contact".

A user's law is a `compiled_law` (full speed) or a `PlainLaw` (any Python callable); a problem may contain one of them.

To add a law, write a frozen dataclass with ``code``, ``elastic``, ``parameters``, ``potential`` and ``closure``. Add
its branch to `impact.march.loop.forces.law_force`; if it is elastic, also to `law_potential`, `_elastic_force` and
`stiffness` there.

Joints are conforming rough faces, bedded in, whose unloading is stiffer than their loading. A joint remembers the
deepest closure m since it last opened. Its closure at a force N has an elastic part u(N) and a part that remains until
it opens: on the loading branch, at and beyond m, the closure is l(N) >= u(N); below m, for loading and unloading,

    pen = m - u(N_m) + u(N),   l(N_m) = m.

Opening resets the joint, so that each contact follows the same branches, as in a joint that is bedded in. If the slope
of u is at most that of l at each force, unloading is nowhere softer than loading. The recoverable energy is

    Psi = int_0^N N' u'(N') dN',   with N l' dN - dPsi >= 0 on the loading branch,

so that no history of closures gains energy. Over one step the joint is elastic: the work along its path is a convex
function of the closure at the end. Hence every step rule applies unchanged, and the conserving rule dissipates exactly
the hysteresis of the joint. Sources: Back, Burdekin & Cowley, Proc. 13th MTDR Conf. (1973) 87, for the power law of
machined faces, whose closure is proportional to the square root of the pressure; Greenwood & Williamson, Proc. R. Soc.
A 295 (1966) 300, for unloading along stiffer branches.

The film is an incompressible fluid of viscosity mu, without inertia, in a plane, parallel gap under a long strip of
width w and length l. Its force is

    N = -c(g) dg/dt,   c(g) = k/(g + f)^3,   k = mu l w^3,

with a floor f of the gap g, which roughness, and tilt within the strip, leave open when the bodies touch. Over a step
of length h, from the gap g0 to g1, the force is the mean of the exact solution,

    N h = k/2 (1/G1^2 - 1/G0^2),   G = max(g, 0) + f,

solved together with the law of the contact. Whatever the steps, the film takes the momentum k/2 (1/G1^2 - 1/G0^2) from
the bodies, and N (g1 - g0) <= 0 in each step. (With c of the step before, the scheme would be unstable for c > h/W0,
the more so the shorter the step.) The film acts in the open gap only: where a law lets the bodies penetrate, G = f.
Beyond `FAR` floors, where a millionth of its momentum remains, it is neglected.

Cavitation limits the tension to the underpressure times the strip's area.

The fluid may be a gas as long as the film's pressure is small compared to the ambient one; otherwise the gas is
compressed, and the force of this film is an upper bound.

Source: Stefan, Sitzungsber. Akad. Wiss. Wien 69 II (1874) 713; Reynolds, Phil. Trans. R. Soc. 177 (1886) 157.
"""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from typing import Any, ClassVar, Final, Protocol

import numpy as np

from impact.exact import contact_stress
from impact.greens.base import Array
from impact.notices import SeatfemError

SIGNORINI, SPRING, HERTZ, HUNT_CROSSLEY, ON_PATCH, USER, ROUGH, TABLE = range(8)
"""Codes of the laws; those from `ROUGH` on remember the deepest closure since the contact last opened."""
DEEPEST, FIRST_KNOT = 3, 4
"""Columns in the time loop's parameters of a law with a memory: deepest closure [m], and first knot of a table."""
PASSIVE, CONSERVING, BLENDED = 0, 1, 2
FIRMEST: Final = 0.9
"""Square root of the indentation over 2/(3 c k) up to which `HertzOnPatch` follows its curve, and its tangent beyond.
"""
FIRMEST_PENETRATION: Final = FIRMEST**2 - 2 / 3 * FIRMEST**3
"""Penetration at `FIRMEST`, over (2/(3 c k))^2."""
FIRMEST_SLOPE: Final = 1.5 * FIRMEST / (1 - FIRMEST)
"""Slope of the law at `FIRMEST`, over 2/(3 c)."""

Parameters = tuple[float, ...]


@cache
def _signature() -> Any:
    """Return numba's type of a user's law, a function of three floats; numba is loaded only when a law needs it."""
    types = import_module("numba").types
    types.WrapperAddressProtocol.register(_Callback)
    return types.float64(types.float64, types.float64, types.float64)


class LawError(SeatfemError, ValueError):
    """A contact law with an impossible parameter, or one that the step rule cannot treat."""


class Law(Protocol):
    """A contact law as the solver needs it."""

    @property
    def code(self) -> int:
        """Return the code by which `impact.march.loop.forces.law_force` selects the law."""

    @property
    def parameters(self) -> Parameters:
        """Return the parameters of the law in the order of the time loop."""

    @property
    def elastic(self) -> bool:
        """Return whether the time loop knows a potential whose derivative is the force without damping."""

    def potential(self, penetration: Array) -> Array:
        """Return the stored energy Psi [J] along a history of penetrations (n,) [m]; 0 where none is stored."""

    def closure(self, force: float) -> float:
        """Return the penetration [m] under a static ``force`` [N]; zero for a rigid law."""


class _NoPotential:
    """A law whose potential, if there is one, the time loop does not know."""

    elastic: ClassVar[bool] = False
    parameters: ClassVar[Parameters] = (0.0, 0.0, 0.0)

    def potential(self, penetration: Array) -> Array:
        """Return zero, as none is declared."""
        return np.zeros_like(penetration)

    def closure(self, force: float) -> float:
        """Return zero, as the static penetration is not known."""
        return 0.0


@dataclass(frozen=True)
class Signorini(_NoPotential):
    """Rigid unilateral contact: gap >= 0, N >= 0, N gap = 0. Source: Signorini 1933.

    Passive rule only, N = max(0, pen_free)/W0: the force acts only at gap_end = 0, from a gap_start >= 0, so that its
    work N (gap_end - gap_start) <= 0. The energy loss of a contact occurs in its first step. It needs bodies with an
    instantaneous response: W0/dt must not vanish with dt.
    """

    code: ClassVar[int] = SIGNORINI


class _PowerLaw:
    """Common base of the elastic laws N = k max(0, pen)^n; ``stiffness`` is k, ``exponent`` n."""

    elastic: ClassVar[bool] = True
    stiffness: float
    exponent: float

    def __post_init__(self) -> None:
        if not (self.stiffness > 0 and math.isfinite(self.stiffness)):
            raise LawError(f"{type(self).__name__}.stiffness = {self.stiffness:g} must be positive and finite")

    @property
    def parameters(self) -> Parameters:
        """Return k."""
        return (self.stiffness, 0.0, 0.0)

    def potential(self, penetration: Array) -> Array:
        """Return k pen^(n + 1)/(n + 1) [J]."""
        return np.asarray(self.stiffness * np.maximum(penetration, 0.0) ** (self.exponent + 1) / (self.exponent + 1))

    def closure(self, force: float) -> float:
        """Return (N/k)^(1/n) [m]."""
        return float((force / self.stiffness) ** (1 / self.exponent))


@dataclass(frozen=True)
class LinearSpring(_PowerLaw):
    """N = k max(0, pen); ``stiffness`` k [N/m].

    The potential k pen^2/2 is convex. Passive rule: N = k pen_free/(1 + k W0); conserving rule, while closed: N = k
    times the mean penetration of the step. Raises `LawError` for a stiffness that is not positive and finite.
    """

    stiffness: float
    code: ClassVar[int] = SPRING
    exponent: ClassVar[float] = 1.0  # type: ignore[misc]


@dataclass(frozen=True)
class Hertz(_PowerLaw):
    """N = k max(0, pen)^(3/2); ``stiffness`` k [N/m^1.5], (4/3) E* sqrt(R) for a sphere. Source: Hertz 1882.

    The potential (2/5) k pen^(5/2) is convex. The law includes the local compliance of both surfaces: with a Green's
    function that also includes it, use `HertzOnPatch` (or `impact.exact.half_space.without_patch`). Raises `LawError`
    for a stiffness that is not positive and finite.
    """

    stiffness: float
    code: ClassVar[int] = HERTZ
    exponent: ClassVar[float] = 1.5  # type: ignore[misc]

    @staticmethod
    def from_sphere(
        *, radius: float, young: float, poisson: float, young_2: float = math.inf, poisson_2: float = 0.0
    ) -> Hertz:
        """Return the law of a sphere of this ``radius`` [m] on a flat face.

        The moduli [Pa] and Poisson's ratios are those of both bodies; the second one is rigid unless given. Two spheres
        have the radius R_1 R_2/(R_1 + R_2). Raises `ContactStressError` for a radius or a modulus that is not positive.
        """
        modulus = contact_stress.reduced_modulus(young=young, poisson=poisson, young_2=young_2, poisson_2=poisson_2)
        return Hertz(contact_stress.hertz_stiffness(reduced_modulus=modulus, radius=radius))


@dataclass(frozen=True)
class HuntCrossley(_PowerLaw):
    """N = k pen^n (1 + d pen'), never below zero, with the rate pen' of the penetration over the step.

    No step rule gains energy: the potential is convex, the damping dissipates as d (pen')^2 >= 0, and where the bracket
    would be negative the force is zero while the potential decreases. On a rigid seat the restitution e at the speed V
    follows from (1 + e) d V = ln((1 + d V)/(1 - e d V)) for any n and mass, e = 1 - (2/3) d V + O(d V)^2. Source: Hunt
    & Crossley, J. Appl. Mech. 42 (1975) 440.

    Attributes:
        stiffness: k [N/m^n].
        damping: d [s/m] >= 0; d = 3 (1 - e)/(2 V) for a coefficient of restitution e near 1 at the speed V.
        exponent: n >= 1.

    Raises:
        LawError: a stiffness that is not positive, a negative damping, an exponent below 1, or one that is not finite.
    """

    stiffness: float
    damping: float = 0.0
    exponent: float = 1.5
    code: ClassVar[int] = HUNT_CROSSLEY

    def __post_init__(self) -> None:
        super().__post_init__()
        if not (self.damping >= 0 and math.isfinite(self.damping)):
            raise LawError(f"HuntCrossley.damping = {self.damping:g} s/m must be >= 0 and finite")
        if not (self.exponent >= 1 and math.isfinite(self.exponent)):
            raise LawError(f"HuntCrossley.exponent = {self.exponent:g} must be >= 1 (a convex potential) and finite")

    @property
    def parameters(self) -> Parameters:
        return (self.stiffness, self.damping, self.exponent)


@dataclass(frozen=True)
class HertzOnPatch:
    """Hertz's law, or Hunt and Crossley's, between bodies whose Green's functions include the local compliance c.

    Hertz's indentation is the approach of remote points of both bodies. The Green's function of a patch of a solid
    includes its local displacement c N under uniform pressure, too. In series it is subtracted from the law,

        pen(N) = (N/k)^(2/3) - c N,   Psi = (2/5) k h^5 - c N^2/2,   N = k h^3,

    with the damping factor 1 + d times the rate of the indentation. c of a round patch of radius a on a half-space is
    16 (1 - nu^2)/(3 pi^2 E a), or the sum for both bodies if both have patches. The law increases and its potential is
    convex for N < (2/(3 c))^3/k^2, that is while the patch is not smaller than the contact. Beyond `largest`, 0.73 of
    that force, it follows its tangent. The tangent serves the iteration for the force of a step and is no model of a
    contact: a run that reaches it must be refused.

    The damping is exact to first order in d times the speed: the rate of the indentation is that of the law without
    damping at the start of the step.

    Attributes:
        stiffness: k [N/m^1.5].
        local: c [m/N] > 0.
        damping: d [s/m] >= 0.

    Raises:
        LawError: a stiffness or a local compliance that is not positive, a negative damping, or one that is not finite.

    Source: docs/methods.md, "Local compliance once"; Johnson, Contact Mechanics, 3.4 and 4.2.
    """

    stiffness: float
    local: float
    damping: float = 0.0
    code: ClassVar[int] = ON_PATCH
    elastic: ClassVar[bool] = True

    def __post_init__(self) -> None:
        for name, unit in (("stiffness", "N/m^1.5"), ("local", "m/N")):
            value = getattr(self, name)
            if not (value > 0 and math.isfinite(value)):
                raise LawError(f"HertzOnPatch.{name} = {value:g} {unit} must be positive and finite")
        if not (self.damping >= 0 and math.isfinite(self.damping)):
            raise LawError(f"HertzOnPatch.damping = {self.damping:g} s/m must be >= 0 and finite")

    @property
    def parameters(self) -> Parameters:
        """Return k, d and c."""
        return (self.stiffness, self.damping, self.local)

    @property
    def largest(self) -> float:
        """Return the largest static force for which the law is a model of the contact [N]."""
        return self.stiffness * (FIRMEST * self._unit) ** 3

    @property
    def _unit(self) -> float:
        """Return 2/(3 c k), the square root of the indentation at which a patch is firmer than the contact [m^0.5]."""
        return 2 / (3 * self.local * self.stiffness)

    def potential(self, penetration: Array) -> Array:
        """Return Psi [J]."""
        depth = np.maximum(penetration, 0.0) / self._unit**2
        beyond = np.maximum(depth - FIRMEST_PENETRATION, 0.0)
        third = np.arcsin(np.sqrt(3 * (depth - beyond))) / 3
        y = 2 * np.sin(third) * np.sin(third + np.pi / 3)
        work = y**5 * (0.4 - y / 3) + beyond * (FIRMEST**3 + FIRMEST_SLOPE * beyond / 2)
        return np.asarray(self.stiffness * self._unit**5 * work)

    def closure(self, force: float) -> float:
        """Return (N/k)^(2/3) - c N [m], or the value on the tangent beyond `largest`."""
        curved = min(force, self.largest)
        slope = 2 / (3 * self.local) * FIRMEST_SLOPE
        return float((curved / self.stiffness) ** (2 / 3) - self.local * curved + (force - curved) / slope)


@dataclass(frozen=True)
class CompiledLaw(_NoPotential):
    """A user's law at full speed: ``force(pen, pen_start, dt)`` [m, m, s -> N], which numba can compile.

    The function is called for pen > 0; a negative force counts as zero. Only the passive rule applies. The law is
    dissipative if the force does not decrease with pen and its elastic part has a convex potential. The user ensures
    this; the energy ledger shows a violation as a ``contact_loss`` below zero beyond round-off, and the run advises on
    it. All work of the law counts as lost, as it declares no potential.

    Attributes:
        compiled: the law as a numba C callback, made by `compiled_law`.
    """

    compiled: Any
    code: ClassVar[int] = USER

    def potential(self, penetration: Array) -> Array:
        """Return zero, as none is declared; raises `LawError` if the force of a run was not finite."""
        if not np.all(np.isfinite(penetration)):
            raise LawError(
                f"a compiled law's force must be finite, {np.sum(~np.isfinite(penetration))} of its run are not"
            )
        return super().potential(penetration)


def compiled_law(force: Callable[[float, float, float], float]) -> CompiledLaw:
    """Compile ``force(pen, pen_start, dt)`` [N]; raises `LawError` with numba's message if it cannot be compiled."""
    try:
        return CompiledLaw(import_module("numba").cfunc(_signature())(force))
    except Exception as problem:
        name = getattr(force, "__name__", repr(force))
        raise LawError(
            f"the law {name} cannot be compiled, make it a PlainLaw: {str(problem).strip().splitlines()[0]}"
        ) from problem


class _Callback:
    """A Python function behind a C function pointer that the compiled time loop can call.

    As C cannot raise exceptions, the first one is stored, and the force is zero from then on until `check` raises it.
    """

    def __init__(self, force: Callable[[float, float, float], float]) -> None:
        self.failure: BaseException | None = None
        self._force = force
        number = ctypes.c_double
        _signature()
        self._pointer = ctypes.CFUNCTYPE(number, number, number, number)(self._call)

    def _call(self, pen: float, pen_start: float, dt: float) -> float:
        if self.failure is not None:
            return 0.0
        try:
            force = float(self._force(pen, pen_start, dt))
            if not math.isfinite(force):
                raise ValueError(f"its force is {force} N at the penetration {pen:g} m, and must be finite")
        except BaseException as failure:  # also an interrupt must not be lost
            self.failure = failure
            return 0.0
        return force

    def check(self) -> None:
        failure, self.failure = self.failure, None
        if failure is None:
            return
        if not isinstance(failure, Exception):
            raise failure
        name = getattr(self._force, "__name__", repr(self._force))
        raise LawError(f"the law {name} failed, mend it: {type(failure).__name__}: {failure}") from failure

    def __wrapper_address__(self) -> int:
        return ctypes.cast(self._pointer, ctypes.c_void_p).value or 0

    def signature(self) -> Any:
        return _signature()


@dataclass(frozen=True)
class PlainLaw(_NoPotential):
    """Any law as an ordinary Python callable ``force(pen, pen_start, dt)`` [m, m, s -> N].

    It is called like a `CompiledLaw`, with the same conditions and bit-identical results. It may have a state, read
    tables or call other programs; it must not assume one call per step, as the solver calls it a dozen times to find
    the force. A short Python function costs about 0.4 us per call and 5 us per step in contact; a compiled law 0.5 us
    per step.

    Attributes:
        force: the law. `impact.collect`, and so `impact.solve`, raises `LawError` after an exception in it or a force
            that is not finite; in a loop of one's own, `check` raises it at once.
    """

    force: Callable[[float, float, float], float]
    compiled: _Callback = field(init=False, repr=False, compare=False)
    code: ClassVar[int] = USER

    def __post_init__(self) -> None:
        if not callable(self.force):
            raise LawError(f"PlainLaw.force = {self.force!r} must be a callable force(pen, pen_start, dt)")
        object.__setattr__(self, "compiled", _Callback(self.force))

    def check(self) -> None:
        """Raise the first failure since the last check, if any, as a `LawError` that names it."""
        self.compiled.check()

    def potential(self, penetration: Array) -> Array:
        """Return zero, as none is declared; raises the first failure, as `check` does."""
        self.check()
        return super().potential(penetration)


FAR: Final = 1000.0
"""Gap over the floor beyond which the film is neglected."""
NO_FILM: Final[Parameters] = (0.0, 0.0, 0.0)
"""`SqueezeFilm.parameters` of a contact without a film."""


@dataclass(frozen=True)
class SqueezeFilm:
    """The film force N = -k/(g + f)^3 dg/dt in the open gap g of a contact, in addition to its law.

    Attributes:
        coefficient: k [N s m^2] > 0, mu l w^3 of a long strip.
        floor: f [m] > 0.
        tension: largest pull [N] >= 0; infinite: the film never breaks.

    Raises:
        LawError: a coefficient or floor that is not positive and finite, a negative tension.
    """

    coefficient: float
    floor: float
    tension: float = math.inf

    def __post_init__(self) -> None:
        for name, unit in (("coefficient", "N s m^2"), ("floor", "m")):
            value = getattr(self, name)
            if not (value > 0 and math.isfinite(value)):
                raise LawError(f"SqueezeFilm.{name} = {value:g} {unit} must be positive and finite")
        if not self.tension >= 0:
            raise LawError(f"SqueezeFilm.tension = {self.tension:g} N must be >= 0")

    @staticmethod
    def strip(
        *, viscosity: float, length: float, width: float, floor: float, underpressure: float = 1e5
    ) -> SqueezeFilm:
        """Return the film under a long strip, or under a narrow ring of this length; raises as the class does.

        It cavitates at an ``underpressure`` [Pa], by default one bar, for a fluid at ambient pressure that bears no
        tension.
        """
        return SqueezeFilm(viscosity * length * width**3, floor, underpressure * length * width)

    @property
    def parameters(self) -> Parameters:
        """Return k, f and the largest pull."""
        return (self.coefficient, self.floor, self.tension)

    def part(self, share: float) -> SqueezeFilm:
        """Return the film under a ``share`` of the strip's length."""
        return SqueezeFilm(share * self.coefficient, self.floor, share * self.tension)


MOST_KNOTS: Final = 500
"""Largest number of rows of a joint by table, of which each contact has a copy."""
_SAME: Final = 1e-9  # relative tolerance of slopes; force, over the largest one, that counts as zero


def deepest_so_far(penetration: Array) -> Array:
    """Return the (n,) deepest closures since the joint last opened, for a history of penetrations (n,) [m]."""
    deepest = np.zeros(len(penetration))
    edges = np.flatnonzero(np.diff(np.concatenate([[False], penetration > 0, [False]])))
    for first, end in edges.reshape(-1, 2):
        deepest[first:end] = np.maximum.accumulate(penetration[first:end])
    return deepest


@dataclass(frozen=True)
class RoughJoint:
    """Rough faces with N = k pen^n when loaded and u(N) = r (N/k)^(1/n): unloading is 1/r times as stiff at each force.

    A cycle to the closure m loses the fraction 1 - r of its work k m^(n + 1)/(n + 1); r = 1 is elastic.

    Attributes:
        stiffness: k [N/m^n].
        exponent: n >= 1; 2 for machined faces.
        recovery: r, fraction of the closure that is elastic, 0 < r <= 1.

    Raises:
        LawError: a stiffness that is not positive, an exponent below 1, a recovery outside (0, 1].
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
    """A joint by table, with forces while it is loaded up to the last row and while it is unloaded from there.

    Forces are linear between the rows, starting from zero force at zero closure, and extrapolated beyond the last row.

    Attributes:
        closures: rising closures [m]; the first may be 0.
        loading: rising forces [N].
        unloading: forces [N], at most ``loading``, equal in the last row; 0 up to the remaining closure.

    Raises:
        LawError: columns of unequal length, fewer than 2 rows or more than `MOST_KNOTS`, numbers that do not rise, two
            forces in the last row, an unloading branch softer than the loading one at some force.
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
        """Return (l, N) of the loading branch and (u, N) of the unloading one [m, N], each starting from (0, 0)."""
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
        return float(_interpolate_branch(*self.branches[0][::-1], np.array([force]))[0])

    def potential(self, penetration: Array) -> Array:
        """Return the recoverable energy int N du [J]."""
        (x, up), (back, down) = self.branches
        deepest = deepest_so_far(penetration)
        at = penetration - deepest + _interpolate_branch(down, back, _interpolate_branch(x, up, deepest))
        at = np.maximum(at, 0.0)
        works = np.append(0.0, np.cumsum((down[1:] + down[:-1]) / 2 * np.diff(back)))
        below = np.minimum(np.searchsorted(back, at, side="right") - 1, len(back) - 2)
        start = down[below]
        return np.asarray(works[below] + (start + _interpolate_branch(back, down, at)) / 2 * (at - back[below]))

    def scaled(self, share: float) -> TableJoint:
        """Return the joint for a ``share`` of the area."""
        loading, unloading = (tuple(share * force for force in column) for column in (self.loading, self.unloading))
        return TableJoint(self.closures, loading, unloading)


def _interpolate_branch(x: Array, y: Array, at: Array) -> Array:
    """Return the values at ``at`` of the piecewise linear ``y`` over ``x``, extrapolated beyond its end."""
    beyond = np.maximum(at - x[-1], 0.0) * (y[-1] - y[-2]) / (x[-1] - x[-2])
    return np.asarray(np.interp(at, x, y) + beyond)
