"""Joints that remember how far they were closed since they last opened (see `impact.march.laws`): their force, its mean
over a step, its slope. Row ``i`` of ``numbers`` holds three parameters of contact i, its deepest closure so far, and
the two branches of a joint by table. (Laws without a memory take scalars, as arrays would halve their speed.)
"""

from __future__ import annotations

import numpy as np

from impact.march.laws import BLENDED, DEEPEST, FIRST_KNOT, PASSIVE, ROUGH
from impact.march.loop.compiled import compiled
from impact.march.loop.forces import RIGID, narrow_bracket, step_force, stiffness

NEAR = 1e-3  # (x - y)/(x + y) below which secants of powers are taken from their series: its next term is 1e-18


@compiled()
def update_deepest(numbers, i, pen):
    """Store the deepest closure so far at the end of a step, zero for an open joint."""
    numbers[i, DEEPEST] = 0.0 if pen <= 0.0 else max(numbers[i, DEEPEST], pen)


@compiled()
def share_at_end(rule, unresolved):
    """Return the share of the law's force at the end of a step in the force of the step; the rest is its mean over the
    path. ``unresolved``: Psi'' W0, which exceeds 1 where the step does not resolve the contact's own oscillation."""
    if rule != BLENDED:
        return 1.0 if rule == PASSIVE else 0.0
    return 1.0 if unresolved >= RIGID else unresolved**2 / (1.0 + unresolved**2)


@compiled()
def joint_step(code, rule, numbers, i, pen, pen_start, w0, together, dt):
    """Return N >= 0 of one step, with the arguments of `impact.march.loop.forces.contact_force`: the force F(p) at the
    root p of p + w0 F(p) = pen, by guarded regula falsi (Illinois), with F the `_mixed_force`."""
    share = share_at_end(rule, joint_stiffness(code, numbers, i, pen_start) * together if rule == BLENDED else 0.0)
    force = _mixed_force(code, numbers, i, pen, pen_start, share)
    if force <= 0.0 or w0 <= 0.0:
        return force
    low, high, r_high, side = pen - w0 * force, pen, w0 * force, 0
    if pen_start <= 0.0 or share == 1.0:
        low = max(low, 0.0)
    r_low = low + w0 * _mixed_force(code, numbers, i, low, pen_start, share) - pen
    for count in range(200):
        p = (low * r_high - high * r_low) / (r_high - r_low) if count % 4 < 3 and r_high > r_low else 0.5 * (low + high)
        force = _mixed_force(code, numbers, i, p, pen_start, share)
        r = p + w0 * force - pen
        if abs(r) <= 2e-16 * max(abs(pen), w0 * force) or high - low <= 2e-16 * max(abs(low), abs(high)):
            break
        low, high, r_low, r_high, side = narrow_bracket(low, high, r_low, r_high, side, p, r)
    return force


@compiled()
def _mixed_force(code, numbers, i, p, p0, share):
    """Return the force of a step from ``p0`` to ``p``: ``share`` times the law's at ``p``, 1 - share times its mean."""
    force = share * joint_force(code, numbers, i, p) if share > 0.0 else 0.0
    return force + (1.0 - share) * joint_secant(code, numbers, i, p, p0) if share < 1.0 else force


@compiled()
def joint_force(code, numbers, i, pen):
    """Return N [N] at the closure ``pen``, on the loading branch beyond the deepest so far, else on the other one."""
    if pen <= 0.0:
        return 0.0
    deepest = numbers[i, DEEPEST]
    if pen >= deepest:
        return _branch_force(code, numbers, i, 0, pen)
    return _branch_force(code, numbers, i, 1, pen - _residual_closure(code, numbers, i, deepest))


@compiled()
def joint_secant(code, numbers, i, p, p0):
    """Return the work between the closures ``p0`` and ``p`` over their difference. ``p0`` is not beyond the deepest
    closure so far; beyond it the path follows the loading branch."""
    if p <= 0.0 and p0 <= 0.0:
        return 0.0
    deepest = numbers[i, DEEPEST]
    if deepest <= 0.0:
        return _branch_secant(code, numbers, i, 0, p, p0)
    rest = _residual_closure(code, numbers, i, deepest)
    if p <= deepest:
        return _branch_secant(code, numbers, i, 1, p - rest, p0 - rest)
    work = _branch_secant(code, numbers, i, 0, p, deepest) * (p - deepest)
    if p0 < deepest:
        work += _branch_secant(code, numbers, i, 1, deepest - rest, p0 - rest) * (deepest - p0)
    return work / (p - p0)


@compiled()
def joint_stiffness(code, numbers, i, pen):
    """Return dN/dpen [N/m] at the closure ``pen``, on the branch that `joint_force` follows."""
    if pen <= 0.0:
        return 0.0
    deepest = numbers[i, DEEPEST]
    which, at = (0, pen) if pen >= deepest else (1, pen - _residual_closure(code, numbers, i, deepest))
    if at <= 0.0:
        return 0.0
    if code == ROUGH:
        k, n, share = _power_parameters(numbers, i, which)
        return n * k / share * (at / share) ** (n - 1.0)
    first, count = _find_knots(numbers, i, which)
    return _find_slope(numbers, i, first, count, _find_interval(numbers, i, first, count, at))


@compiled()
def _residual_closure(code, numbers, i, deepest):
    """Return the closure that remains when the joint is unloaded from the deepest one [m]."""
    if code == ROUGH:
        return (1.0 - numbers[i, 2]) * deepest
    force = _branch_force(code, numbers, i, 0, deepest)
    first, count = _find_knots(numbers, i, 1)
    k = 1
    while k < count - 1 and numbers[i, first + count + k] < force:
        k += 1
    back = force - numbers[i, first + count + k]
    return deepest - numbers[i, first + k] - back / _find_slope(numbers, i, first, count, k)


@compiled()
def _power_parameters(numbers, i, which):
    """Return k, n and r of N = k (x/r)^n on the loading branch (0), where r = 1, or on the unloading one (1)."""
    return numbers[i, 0], numbers[i, 1], 1.0 if which == 0 else numbers[i, 2]


@compiled()
def _find_knots(numbers, i, which):
    """Return the column at which the closures of a branch begin, and their number; as many forces follow them."""
    loading = int(numbers[i, 0])
    return (FIRST_KNOT, loading) if which == 0 else (FIRST_KNOT + 2 * loading, int(numbers[i, 1]))


@compiled()
def _branch_force(code, numbers, i, which, x):
    """Return the force [N] of a branch at the closure ``x`` [m] from the point at which its force begins."""
    if x <= 0.0:
        return 0.0
    if code == ROUGH:
        k, n, share = _power_parameters(numbers, i, which)
        return k * (x / share) ** n
    first, count = _find_knots(numbers, i, which)
    k = _find_interval(numbers, i, first, count, x)
    return numbers[i, first + count + k] + _find_slope(numbers, i, first, count, k) * (x - numbers[i, first + k])


@compiled()
def _find_interval(numbers, i, first, count, x):
    """Return the number of the knot at the upper end of the piece that contains ``x`` > 0; beyond, of the last knot."""
    low, high = 0, count - 1
    while high - low > 1:
        middle = (low + high) // 2
        if numbers[i, first + middle] < x:
            low = middle
        else:
            high = middle
    return high


@compiled()
def _find_slope(numbers, i, first, count, k):
    """Return the slope [N/m] of the piece below knot ``k`` >= 1."""
    rise = numbers[i, first + count + k] - numbers[i, first + count + k - 1]
    return rise / (numbers[i, first + k] - numbers[i, first + k - 1])


@compiled()
def _branch_secant(code, numbers, i, which, x, y):
    """Return the work on a branch between ``y`` and ``x`` over x - y, without cancellation for x near y."""
    if x < y:
        x, y = y, x
    if x <= 0.0:
        return 0.0
    if code == ROUGH:
        k, n, share = _power_parameters(numbers, i, which)
        if y > 0.0:
            return k * _power_mean(n, x / share, y / share)
        return k * (x / share) ** n * x / ((n + 1.0) * (x - y))
    top = _branch_force(code, numbers, i, which, x)
    if x == y:
        return top
    first, count = _find_knots(numbers, i, which)
    k, work, at = _find_interval(numbers, i, first, count, x), 0.0, x
    while at > max(y, 0.0):
        down = max(numbers[i, first + k - 1], y, 0.0)
        force = _branch_force(code, numbers, i, which, down)
        work += 0.5 * (top + force) * (at - down)
        top, at, k = force, down, max(k - 1, 1)
    return work / (x - y)


@compiled()
def _power_mean(n, x, y):
    """Return (x^(n+1) - y^(n+1))/((n + 1) (x - y)) for x, y > 0, by its series for x near y."""
    apart = (x - y) / (x + y)
    if abs(apart) < NEAR:
        square = apart * apart
        series = 1.0 + n * (n - 1.0) / 6.0 * square * (1.0 + (n - 2.0) * (n - 3.0) / 20.0 * square)
        return (0.5 * (x + y)) ** n * series
    return (x ** (n + 1.0) - y ** (n + 1.0)) / ((n + 1.0) * (x - y))


@compiled()
def forces_along(code, rule, numbers, i, ends, starts, deepest, together, dt):
    """Return the (n,) forces of steps from the penetrations ``starts`` to ``ends``, as the march computes them, for
    laws with and without a memory. ``deepest`` (n,): deepest closure before each step; ``together``: as in
    `joint_step`."""
    forces = np.zeros(ends.size)
    a, b, c = numbers[i, 0], numbers[i, 1], numbers[i, 2]
    for k in range(ends.size):
        if code >= ROUGH:
            numbers[i, DEEPEST] = deepest[k]
            slope = joint_stiffness(code, numbers, i, starts[k]) if rule == BLENDED else 0.0
            forces[k] = _mixed_force(code, numbers, i, ends[k], starts[k], share_at_end(rule, slope * together))
        else:
            slope = stiffness(code, a, b, c, starts[k]) if rule == BLENDED else 0.0
            forces[k] = step_force(code, a, b, c, ends[k], starts[k], dt, share_at_end(rule, slope * together))
    return forces
