"""Steps of the time integration: the effect of earlier forces on the gap, and the contact force over a step.

Earlier forces act through poles, oscillators and weighted sums over many steps; the force of one contact follows from
its law, its film and the step rule (see `impact.march.laws`). The compiler would load the coefficients of oscillators,
and store and reload their states, at every step; `oscillate` keeps both in registers over all steps.

Hertz's law on a patch whose Green's function includes the local compliance c (`impact.march.laws.HertzOnPatch`): with
h = sqrt(indentation), its limit h* = 2/(3 c k), y = h/h*, and q = pen/h*^2,

    q = y^2 - (2/3) y^3,   N = k h*^3 y^3,   Psi = k h*^5 y^5 (2/5 - y/3),   dN/dpen = k h* 3 y/(2 (1 - y)),

up to y = `FIRMEST`, and along the tangent beyond. The root is y = 2 sin(a) sin(a + pi/3), a = asin(sqrt(3 q))/3, free
of cancellation for small q.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from llvmlite import ir  # type: ignore[import-untyped]
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from impact.greens.base import Array
from impact.march.laws import (
    BLENDED,
    FAR,
    FIRMEST,
    FIRMEST_PENETRATION,
    FIRMEST_SLOPE,
    HERTZ,
    HUNT_CROSSLEY,
    ON_PATCH,
    PASSIVE,
    SIGNORINI,
    SPRING,
    USER,
)
from impact.march.loop.compiled import compiled


@compiled()
def firmness(k, c, pen):
    """Return y, at most `FIRMEST`, at a penetration ``pen`` > 0, and by how much q exceeds its value at `FIRMEST`."""
    q = pen * (1.5 * c * k) ** 2
    if q >= FIRMEST_PENETRATION:
        return FIRMEST, q - FIRMEST_PENETRATION
    a = math.asin(math.sqrt(3.0 * q)) / 3.0
    return 2.0 * math.sin(a) * math.sin(a + math.pi / 3.0), 0.0


@compiled()
def patch_force(k, c, pen):
    """Return the elastic force N [N] at ``pen`` > 0."""
    y, beyond = firmness(k, c, pen)
    return k / (1.5 * c * k) ** 3 * (y**3 + FIRMEST_SLOPE * beyond)


@compiled()
def patch_potential(k, c, pen):
    """Return Psi [J] at ``pen`` > 0."""
    y, beyond = firmness(k, c, pen)
    further = beyond * (FIRMEST**3 + 0.5 * FIRMEST_SLOPE * beyond)
    return k / (1.5 * c * k) ** 5 * (y**5 * (0.4 - y / 3.0) + further)


@compiled()
def patch_stiffness(k, c, pen):
    """Return d2Psi/dpen2 [N/m] at ``pen`` > 0."""
    y, _ = firmness(k, c, pen)
    return k / (1.5 * c * k) * 1.5 * y / (1.0 - y)


@compiled()
def patch_damping(k, c, pen):
    """Return the factor 1/(1 - y)^2 of the damping in terms of the rate of penetration: the indentation changes by
    1/(1 - y) times that rate, and the patch also yields to the damping force."""
    if pen <= 0.0:
        return 1.0
    y, _ = firmness(k, c, pen)
    return 1.0 / (1.0 - y) ** 2


@compiled()
def patch_secant(k, c, p, p0):
    """Return (Psi(p) - Psi(p0))/(p - p0) for p, p0 > 0, without cancellation for p near p0."""
    low, high = min(p, p0), max(p, p0)
    x, beyond = firmness(k, c, high)
    y, before = firmness(k, c, low)
    scale = k / (1.5 * c * k) ** 3
    line = scale * (FIRMEST**3 + 0.5 * FIRMEST_SLOPE * (beyond + before))
    if before > 0.0:
        return line
    squares = x * x + x * y + y * y
    work = 0.4 * (x**4 + x**3 * y + x * x * y * y + x * y**3 + y**4) - (x**3 + y**3) * squares / 3.0
    curve = scale * work / (x + y - squares / 1.5)
    if beyond == 0.0:
        return curve
    share = beyond / (1.5 * c * k) ** 2 / (high - low)
    return share * line + (1.0 - share) * curve


FLOOR = 1e-140  # value added to every state at every step, so that decayed modes never become slow denormal numbers


@compiled(fastmath={"reassoc", "contract", "nsz"})
def advance(rows, q, p, force):
    """Advance all poles of one contact by a step under the ``force`` of the step before; return the sum of their
    displacements, a part of the gap."""
    a11, a21, a22, c1, c2 = rows
    u = 0.0
    for k in range(q.size):
        qk, pk = q[k], p[k]
        r = a11[k] * qk + (pk + c1[k] * force)
        q[k] = r
        p[k] = a21[k] * qk + (a22[k] * pk + (c2[k] * force + FLOOR))
        u += r
    return u


@compiled(fastmath={"reassoc", "contract", "nsz"})
def add_gaps(psi, moved, opening):
    """Add to the gaps ``opening`` (p,) the displacements ``moved`` (K,) of poles times their shapes ``psi`` (p, K).
    Four contacts share a pass: with many of them the shapes come from the second-level cache."""
    fours = opening.size - opening.size % 4
    for c in range(0, fours, 4):
        one, two, three, four = psi[c], psi[c + 1], psi[c + 2], psi[c + 3]
        u, v, w, z = 0.0, 0.0, 0.0, 0.0
        for k in range(moved.size):
            x = moved[k]
            u += one[k] * x
            v += two[k] * x
            w += three[k] * x
            z += four[k] * x
        opening[c] += u
        opening[c + 1] += v
        opening[c + 2] += w
        opening[c + 3] += z
    for c in range(fours, opening.size):
        one, u = psi[c], 0.0
        for k in range(moved.size):
            u += one[k] * moved[k]
        opening[c] += u


@compiled(fastmath={"reassoc", "contract", "nsz"})
def load_poles(psi, force, pushed):
    """Write into ``pushed`` (K,) the modal loads of poles by contact forces (p,), most of which are zero."""
    pushed[:] = 0.0
    for c in range(force.size):
        if force[c] != 0.0:
            seen, f = psi[c], force[c]
            for k in range(pushed.size):
                pushed[k] += seen[k] * f


@compiled(fastmath={"reassoc", "contract", "nsz"})
def advance_many(rows, psi, along, q, p, drive, force, opening):
    """Advance the poles of several contacts by a step, and add their part of the gaps to ``opening`` (p,); ``along`` as
    in `Poles.along`."""
    a11, a21, a22, c1, c2 = rows
    group, size, directions = along
    if group.size == 0:
        directions = psi
    total = drive[: directions.shape[1]]
    load_poles(directions, force, total)
    if group.size == 0:
        for k in range(q.size):
            qk, pk, f = q[k], p[k], drive[k]
            q[k] = a11[k] * qk + (pk + c1[k] * f)
            p[k] = a21[k] * qk + (a22[k] * pk + (c2[k] * f + FLOOR))
        total = q
    else:
        for k in range(q.size):
            qk, pk, f = q[k], p[k], size[k] * total[group[k]]
            q[k] = a11[k] * qk + (pk + c1[k] * f)
            p[k] = a21[k] * qk + (a22[k] * pk + (c2[k] * f + FLOOR))
        total[:] = 0.0
        for k in range(q.size):
            total[group[k]] += size[k] * q[k]
    add_gaps(directions, total, opening)


@compiled(fastmath={"reassoc", "contract", "nsz"})
def sum_past(recent, force, rest, first, n):
    """Return the displacement at the end of step ``n`` by the forces of steps ``first`` to ``n`` - 1, less the static
    force ``rest``. ``recent``: step weights of one block in reverse order, so that both arrays are read forwards."""
    stop = recent.size - 1
    w, f = recent[stop - (n - first) : stop], force[first:n]
    u = 0.0
    for m in range(f.size):
        u += w[m] * (f[m] - rest)
    return u


WIDE = 16


def pad_columns(values: Array) -> Array:
    """Return an array (..., K) with columns of zeros, oscillators at rest, added up to a multiple of `WIDE`."""
    more = -values.shape[-1] % WIDE
    return np.pad(values, [(0, 0)] * (values.ndim - 1) + [(0, more)])


class Vectors:
    """Vectors of doubles in registers: loads from arrays, products and sums, as LLVM instructions."""

    def __init__(self, builder: Any, width: int) -> None:
        self._builder, self._vector = builder, ir.VectorType(ir.DoubleType(), width)

    def full(self, value: float) -> Any:
        return ir.Constant(self._vector, [value] * self._vector.count)

    def address(self, array: Any, index: Any) -> Any:
        return self._builder.bitcast(self._builder.gep(array.data, [index]), self._vector.as_pointer())

    def load(self, array: Any, index: Any) -> Any:
        value = self._builder.load(self.address(array, index))
        value.align = 8
        return value

    def times(self, x: Any, y: Any) -> Any:
        return self._builder.fmul(x, y, flags=("contract",))

    def fused(self, x: Any, y: Any, z: Any) -> Any:
        return self._builder.fadd(self.times(x, y), z, flags=("contract",))


@intrinsic
def _oscillate(typing: Any, first: Any, steps: Any, form: Any, q: Any, p: Any, pushed: Any, energies: Any) -> Any:
    """Emit the code of `oscillate` for the `WIDE` oscillators from ``first`` on; ``form`` and ``energies`` (2, m) may
    be ``None``."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        kinds = zip(signature.args[1:], arguments[1:], strict=True)
        arrays: list[Any] = [None if t is types.none else context.make_array(t)(context, builder, a) for t, a in kinds]
        rates, gram, places, speeds, forces, energies = arrays
        start, number, lane = arguments[0], arguments[0].type, ir.IntType(32)
        row, count = builder.extract_value(forces.shape, 1), builder.extract_value(forces.shape, 0)
        vectors = Vectors(builder, WIDE)
        times, fused = vectors.times, vectors.fused

        def index(line: Any) -> Any:
            return builder.add(builder.mul(line, row), start)

        def load(array: Any, line: Any) -> Any:
            return vectors.load(array, index(line))

        def add_up(x: Any, line: int, step: Any) -> None:
            half = WIDE // 2
            while half:
                low, high = (ir.Constant(ir.VectorType(lane, half), list(range(k, k + half))) for k in (0, half))
                x = builder.fadd(builder.shuffle_vector(x, x, low), builder.shuffle_vector(x, x, high))
                half //= 2
            place = builder.gep(energies.data, [builder.add(builder.mul(number(line), count), step)])
            builder.store(builder.fadd(builder.load(place), builder.extract_element(x, lane(0))), place)

        a11, a12, a21, a22, b1, b2, squares = (load(rates, number(i)) for i in range(7))
        d = [] if gram is None else [load(gram, number(i)) for i in range(6)]
        floor, a_half = vectors.full(FLOOR), vectors.full(0.5)
        now = [cgutils.alloca_once_value(builder, load(array, number(0))) for array in (places, speeds)]
        with cgutils.for_range(builder, count) as loop:
            (x, v), y = (builder.load(place) for place in now), load(forces, loop.index)
            r = fused(a11, x, fused(a12, v, fused(b1, y, floor)))
            s = fused(a21, x, fused(a22, v, fused(b2, y, floor)))
            for value, place in zip((r, s), now, strict=True):
                builder.store(value, place)
            builder.store(r, vectors.address(forces, index(loop.index)), align=8)
            if d:
                kept = fused(s, s, times(times(squares, r), r))
                gone = fused(x, fused(d[0], x, fused(d[1], v, times(d[2], y))), times(times(d[5], y), y))
                gone = fused(v, fused(d[3], v, times(d[4], y)), gone)
                add_up(times(a_half, kept), 0, loop.index)
                add_up(gone, 1, loop.index)
        for place, array in zip(now, (places, speeds), strict=True):
            builder.store(builder.load(place), vectors.address(array, index(number(0))), align=8)
        return context.get_dummy_value()

    return types.void(first, steps, form, q, p, pushed, energies), build


@compiled(nogil=True)
def oscillate(steps, form, q, p, pushed, energies):
    """Advance oscillators under known modal forces ``pushed`` (m, K), which are replaced by their coordinates.

    steps: rows (7, K) a11, a12, a21, a22, b1, b2, w^2 of [q, p] <- A [q, p] + b f; K a multiple of `WIDE`. To energies
    (2, m) the energy stored after each step and that dissipated in it are added, by the (6, K) quadratic ``form``; both
    arguments may be ``None``.
    """
    for first in range(0, q.size, WIDE):
        _oscillate(first, steps, form, q, p, pushed, energies)  # type: ignore[call-arg]


RIGID = 1e4  # Psi'' W0 above which the blended rule equals the passive one, to 1e-8 of the force


@compiled()
def law_force(code, a, b, c, user, pen, pen_start, dt):
    """Return N >= 0 [N] at the penetration ``pen``; ``pen_start``: penetration at the start of the step."""
    if pen <= 0.0:
        return 0.0
    if code == SPRING:
        return a * pen
    if code == HERTZ:
        return a * pen * math.sqrt(pen)
    if code == HUNT_CROSSLEY:
        return a * pen**c * max(0.0, 1.0 + b * (pen - pen_start) / dt)
    if code == ON_PATCH:
        return patch_force(a, c, pen) * max(0.0, 1.0 + b * patch_damping(a, c, pen_start) * (pen - pen_start) / dt)
    if code == USER and user is not None:  # None for built-in laws: its type is inferred faster than a function's
        force = user(pen, pen_start, dt)
        return 0.0 if force <= 0.0 else force  # nan is returned, and refused after the run
    return math.inf


@compiled()
def law_potential(code, a, b, c, pen):
    """Return the potential Psi [J] of a law that has one."""
    if pen <= 0.0:
        return 0.0
    if code == SPRING:
        return 0.5 * a * pen * pen
    if code == HERTZ:
        return 0.4 * a * pen * pen * math.sqrt(pen)
    if code == ON_PATCH:
        return patch_potential(a, c, pen)
    return a * pen ** (c + 1.0) / (c + 1.0)


@compiled()
def contact_force(code, rule, a, b, c, user, pen, pen_start, w0, together, dt):
    """Return N >= 0 of one step by one of the rules of `impact.march.laws`.

    Each rule is one increasing scalar equation in N with one root. ``pen``: penetration at the end of the step without
    N; ``w0``: displacement at the end of the step per unit of N [m/N]; ``together``: the same if all contacts press.
    """
    unresolved = stiffness(code, a, b, c, pen_start) * together if rule == BLENDED else 0.0
    if rule != PASSIVE and unresolved < RIGID:
        share = unresolved**2 / (1.0 + unresolved**2)
        return _solve_step(code, a, b, c, pen, pen_start, w0, dt, share)
    if pen <= 0.0:
        return 0.0
    if code == SIGNORINI:
        return pen / w0
    if code == SPRING:
        return a * pen / (1.0 + a * w0)
    if code == HERTZ:
        return _hertz_force(a, pen, w0)
    return _solve_law(code, a, b, c, user, pen, pen_start, w0, dt)


@compiled()
def _hertz_force(k, pen, w0):
    """Return the root N of k (pen - w0 N)^1.5 = N in [0, pen/w0], by Newton's method for d = sqrt(pen - w0 N), which
    solves d^2 + w0 k d^3 = pen.

    The polynomial is increasing and convex for d > 0, so that iterates from above decrease monotonically. d^2 <= pen
    and w0 k d^3 <= pen bound the root; the smaller bound is the start.
    """
    d = math.sqrt(pen)
    if w0 > 0.0:
        d = min(d, (pen / (w0 * k)) ** (1.0 / 3.0))
    for _ in range(60):
        step = (d * d + w0 * k * d * d * d - pen) / (2.0 * d + 3.0 * w0 * k * d * d)
        d -= step
        if step <= 1e-16 * d:
            break
    return k * d * d * d


@compiled()
def _solve_law(code, a, b, c, user, pen, pen_start, w0, dt):
    """Return the root N of N = law(pen - w0 N), by regula falsi (Illinois) with bisection as a safeguard."""
    high = law_force(code, a, b, c, user, pen, pen_start, dt)
    if high <= 0.0 or w0 <= 0.0 or math.isnan(high):
        return high
    high = min(high, pen / w0)
    low, r_low = 0.0, -law_force(code, a, b, c, user, pen, pen_start, dt)
    r_high = high - law_force(code, a, b, c, user, pen - w0 * high, pen_start, dt)
    if r_high <= 0.0:
        return high
    n, top, side = high, high, np.int64(0)  # a literal zero would have its own type and be compiled again
    for count in range(200):
        n = (low * r_high - high * r_low) / (r_high - r_low) if count % 4 < 3 else 0.5 * (low + high)
        r = n - law_force(code, a, b, c, user, pen - w0 * n, pen_start, dt)
        if r == 0.0 or high - low <= 4e-16 * top:
            break
        if math.isnan(r):
            return r
        low, high, r_low, r_high, side = narrow_bracket(low, high, r_low, r_high, side, n, r)
    return n


@compiled()
def _solve_step(code, a, b, c, pen, pen_start, w0, dt, share):
    """Return the force F(p) at the root p of p + w0 F(p) = pen, with F the `step_force`, by guarded regula falsi
    (Illinois).

    F does not decrease with p, hence N >= 0 and one root. As p is the unknown, N keeps its relative accuracy for laws
    much stiffer than 1/w0.
    """
    force = step_force(code, a, b, c, pen, pen_start, dt, share)
    if force <= 0.0 or w0 <= 0.0:
        return force
    low, high, r_high, side = pen - w0 * force, pen, w0 * force, np.int64(0)
    if pen_start <= 0.0:
        low = max(low, 0.0)  # pen > 0, and an open end has no force
    r_low = low + w0 * step_force(code, a, b, c, low, pen_start, dt, share) - pen
    for count in range(200):
        p = (low * r_high - high * r_low) / (r_high - r_low) if count % 4 < 3 and r_high > r_low else 0.5 * (low + high)
        force = step_force(code, a, b, c, p, pen_start, dt, share)
        r = p + w0 * force - pen
        if abs(r) <= 2e-16 * max(abs(pen), w0 * force) or high - low <= 2e-16 * max(abs(low), abs(high)):
            break
        low, high, r_low, r_high, side = narrow_bracket(low, high, r_low, r_high, side, p, r)
    return force


@compiled()
def narrow_bracket(low, high, r_low, r_high, side, p, r):
    """Return the bracket of a root, its residuals and the end that moved last, after the residual ``r`` at ``p``; the
    residual of an end that stays twice in a row is halved (Illinois)."""
    if r > 0.0:
        return low, p, 0.5 * r_low if side == 1 else r_low, r, 1
    return p, high, r, 0.5 * r_high if side == -1 else r_high, -1


@compiled()
def step_force(code, a, b, c, p, p0, dt, share):
    """Return the force of a step from ``p0`` to ``p``: the secant slope of Psi, or, of a ``share`` of it, the slope at
    the end, times the damping factor of the law."""
    force = _law_secant(code, a, b, c, p, p0)
    if share > 0.0:
        force += share * (_elastic_force(code, a, b, c, p) - force)
    if code == HUNT_CROSSLEY:
        force *= max(0.0, 1.0 + b * (p - p0) / dt)
    if code == ON_PATCH and b > 0.0:
        force *= max(0.0, 1.0 + b * patch_damping(a, c, p0) * (p - p0) / dt)
    return force


@compiled()
def _law_secant(code, a, b, c, p, p0):
    """Return (Psi(p) - Psi(p0))/(p - p0), without cancellation for p near p0."""
    if p <= 0.0 and p0 <= 0.0:
        return 0.0
    if p > 0.0 and p0 > 0.0:
        if code == SPRING:
            return 0.5 * a * (p + p0)
        if code == HERTZ:
            x, y = math.sqrt(p), math.sqrt(p0)  # (x^5 - y^5)/(x^2 - y^2)
            return 0.4 * a * (x**4 + x**3 * y + x * x * y * y + x * y**3 + y**4) / (x + y)
        if code == ON_PATCH:
            return patch_secant(a, c, p, p0)
        middle, apart = 0.5 * (p + p0), (p - p0) / (p + p0)
        if abs(apart) < 1e-3:
            square = apart * apart
            series = 1.0 + c * (c - 1.0) / 6.0 * square * (1.0 + (c - 2.0) * (c - 3.0) / 20.0 * square)
            return a * middle**c * series
    return (law_potential(code, a, b, c, p) - law_potential(code, a, b, c, p0)) / (p - p0)


@compiled()
def _elastic_force(code, a, b, c, pen):
    """Return dPsi/dpen [N]."""
    if pen <= 0.0:
        return 0.0
    if code == ON_PATCH:
        return patch_force(a, c, pen)
    return a * pen if code == SPRING else a * pen ** (1.5 if code == HERTZ else c)


@compiled()
def stiffness(code, a, b, c, pen):
    """Return d2Psi/dpen2 [N/m]; for a spring also before contact."""
    if code == SPRING:
        return a
    if pen <= 0.0:
        return 0.0
    if code == ON_PATCH:
        return patch_stiffness(a, c, pen)
    exponent = 1.5 if code == HERTZ else c
    return exponent * a * pen ** (exponent - 1.0)


@compiled()
def filmed_force(code, rule, a, b, c, user, film, pen, pen_start, w0, together, dt):
    """Return the forces of law and film over one step, solved together; arguments as in `contact_force`.

    If the gap is closed at the end of the step, the film is squeezed down to its floor, so that its force is known. If
    it is open there, the law has no force, unless a conserving step starts from a penetration.
    """
    k, floor, tension = film
    squeezed = _film(k, floor, tension, -pen_start, 0.0, dt)
    pressed = contact_force(code, rule, a, b, c, user, pen - w0 * squeezed, pen_start, w0, together, dt)
    leaving = rule != PASSIVE and pen_start > 0.0
    if pen > w0 * (squeezed + pressed if leaving else squeezed):
        return pressed, squeezed
    if leaving:
        return _solve_leaving(code, rule, a, b, c, film, pen, pen_start, w0, together, dt)
    return 0.0, _film_alone(k, floor, tension, -pen, -pen_start, w0, dt)


@compiled()
def _solve_leaving(code, rule, a, b, c, film, pen, pen_start, w0, together, dt):
    """Return the forces of `filmed_force` for a step from ``pen_start`` > 0 to an open gap, at the root p of p + w0
    times their sum = pen, by guarded regula falsi (Illinois) between the largest forces and p = 0."""
    k, floor, tension = film
    stiff = stiffness(code, a, b, c, pen_start) * together if rule == BLENDED else 0.0
    share = stiff * stiff / (1.0 + stiff * stiff)
    pressed, pulled, side = step_force(code, a, b, c, 0.0, pen_start, dt, share), 0.0, np.int64(0)
    low, high, r_low, r_high = pen - w0 * pressed, 0.0, 0.0, w0 * pressed - pen
    for count in range(200):
        p = (low * r_high - high * r_low) / (r_high - r_low) if count % 4 < 3 else 0.5 * (low + high)
        pressed = step_force(code, a, b, c, p, pen_start, dt, share)
        pulled = _film(k, floor, tension, -pen_start, -p, dt)
        r = p + w0 * (pressed + pulled) - pen
        if abs(r) <= 4e-16 * max(abs(pen), w0 * (pressed - pulled)) or high - low <= 2e-16 * abs(low):
            break
        low, high, r_low, r_high, side = narrow_bracket(low, high, r_low, r_high, side, p, r)
    if w0 > 0.0:
        pulled = max((pen - p) / w0 - pressed, -tension)  # to round-off of the gap, as for a film alone
    return pressed, pulled


@compiled()
def _film_alone(k, floor, tension, opening, gap_start, w0, dt):
    """Return the force of a film that keeps the gap open; ``opening``: gap at the end of the step without the film.

    G - a/G^2 is increasing and concave in G = gap + floor, so that Newton's iterates rise from below to the only root.
    """
    far = FAR * floor
    x, free, a = min(max(gap_start, 0.0) + floor, far), opening + floor, 0.5 * w0 * k / dt
    aim, y = free - a / (x * x), a ** (1.0 / 3.0)
    if aim >= 0.0:
        y = max(y, aim)
    else:
        y = math.sqrt(a / (min(y, math.sqrt(-a / aim)) - aim))
    if a > 0.0:
        for _ in range(60):
            step = (aim - y + a / (y * y)) / (1.0 + 2.0 * a / (y * y * y))
            y += step
            if step <= 1e-16 * y:
                break
    if y < far and 2.0 * a > y * y * y:  # the film dominates: its force follows from the gap
        return max((y - free) / w0, -tension)
    return _film(k, floor, tension, gap_start, y - floor, dt)


@compiled()
def _film(k, floor, tension, gap_start, gap, dt):
    """Return the force of a film over a step between two gaps (see `impact.march.laws`)."""
    x, y = min(max(gap_start, 0.0) + floor, FAR * floor), min(max(gap, 0.0) + floor, FAR * floor)
    return max(0.5 * k / dt * ((x - y) * (x + y)) / (x * y) ** 2, -tension)
