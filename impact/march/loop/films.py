"""The force of a film in the gap over one step, with its contact's (`impact.march.film`)."""

from __future__ import annotations

import math

from impact.march.film import FAR
from impact.march.laws import BLENDED, PASSIVE
from impact.march.loop.compiled import compiled
from impact.march.loop.forces import contact_force, narrowed, step_force, stiffness


@compiled()
def filmed_force(code, rule, a, b, c, user, film, pen, pen_start, w0, together, dt):
    """Return (the law's force, the film's) of one step, found together; the arguments as in `contact_force`.

    Closed at the end, the film is squeezed down to its floor, a known force; open, the law has none, unless a step that
    conserves leaves a penetration.
    """
    k, floor, tension = film
    squeezed = _film(k, floor, tension, -pen_start, 0.0, dt)
    pressed = contact_force(code, rule, a, b, c, user, pen - w0 * squeezed, pen_start, w0, together, dt)
    leaving = rule != PASSIVE and pen_start > 0.0
    if pen > w0 * (squeezed + pressed if leaving else squeezed):
        return pressed, squeezed
    if leaving:
        return _leaving(code, rule, a, b, c, film, pen, pen_start, w0, together, dt)
    return 0.0, _film_alone(k, floor, tension, -pen, -pen_start, w0, dt)


@compiled()
def _leaving(code, rule, a, b, c, film, pen, pen_start, w0, together, dt):
    """Return the same of a step from a penetration ``pen_start`` > 0 to an open gap: the root p of p + w0 (both) = pen,
    by guarded regula falsi (Illinois) between what the largest forces leave and p = 0."""
    k, floor, tension = film
    stiff = stiffness(code, a, b, c, pen_start) * together if rule == BLENDED else 0.0
    share = stiff * stiff / (1.0 + stiff * stiff)
    pressed, pulled, side = step_force(code, a, b, c, 0.0, pen_start, dt, share), 0.0, 0
    low, high, r_low, r_high = pen - w0 * pressed, 0.0, 0.0, w0 * pressed - pen
    for count in range(200):
        p = (low * r_high - high * r_low) / (r_high - r_low) if count % 4 < 3 else 0.5 * (low + high)
        pressed = step_force(code, a, b, c, p, pen_start, dt, share)
        pulled = _film(k, floor, tension, -pen_start, -p, dt)
        r = p + w0 * (pressed + pulled) - pen
        if abs(r) <= 4e-16 * max(abs(pen), w0 * (pressed - pulled)) or high - low <= 2e-16 * abs(low):
            break
        low, high, r_low, r_high, side = narrowed(low, high, r_low, r_high, side, p, r)
    if w0 > 0.0:
        pulled = max((pen - p) / w0 - pressed, -tension)  # to round-off of the gap, as where a film acts alone
    return pressed, pulled


@compiled()
def _film_alone(k, floor, tension, opening, gap_start, w0, dt):
    """Return its force where it keeps the gap open that would be ``opening`` without it.

    G - a/G^2 is increasing and concave in G = gap + floor, so that Newton from below rises to the one root.
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
    if y < far and 2.0 * a > y * y * y:  # where the film rules, its force follows from the gap
        return max((y - free) / w0, -tension)
    return _film(k, floor, tension, gap_start, y - floor, dt)


@compiled()
def _film(k, floor, tension, gap_start, gap, dt):
    """Return the film's force over a step between two gaps, see `impact.march.film`."""
    x, y = min(max(gap_start, 0.0) + floor, FAR * floor), min(max(gap, 0.0) + floor, FAR * floor)
    return max(0.5 * k / dt * ((x - y) * (x + y)) / (x * y) ** 2, -tension)
