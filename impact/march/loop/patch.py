"""Hertz's law beside a patch that brings its own local compliance c (`impact.march.laws.HertzOnPatch`).

With h = sqrt(indentation) over its limit h* = 2/(3 c k), y = h/h*, and q = pen/h*^2:

    q = y^2 - (2/3) y^3,   N = k h*^3 y^3,   Psi = k h*^5 y^5 (2/5 - y/3),   dN/dpen = k h* 3 y/(2 (1 - y)),

up to y = `FIRMEST`, along the tangent beyond. The root is y = 2 sin(a) sin(a + pi/3), a = asin(sqrt(3 q))/3: without
cancellation for small q.
"""

from __future__ import annotations

import math

from impact.march.laws import FIRMEST, FIRMEST_PENETRATION, FIRMEST_SLOPE
from impact.march.loop.compiled import compiled


@compiled()
def firmness(k, c, pen):
    """Return y and how far q lies beyond the end of the curve, at a penetration ``pen`` > 0."""
    q = pen * (1.5 * c * k) ** 2
    if q >= FIRMEST_PENETRATION:
        return FIRMEST, q - FIRMEST_PENETRATION
    a = math.asin(math.sqrt(3.0 * q)) / 3.0
    return 2.0 * math.sin(a) * math.sin(a + math.pi / 3.0), 0.0


@compiled()
def patch_force(k, c, pen):
    """Return N without damping [N] at ``pen`` > 0."""
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
def patch_quickness(k, c, pen):
    """Return by how much the law's damping acts on the rate of the penetration, 1/(1 - y)^2: once as the indentation
    changes faster than the penetration, once as the patch gives way to the damping's force, too."""
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
