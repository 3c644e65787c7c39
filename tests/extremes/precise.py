"""Oracles in 50 decimal digits: the damped oscillator, and powers of 2 x 2 matrices."""

from collections.abc import Sequence
from decimal import Decimal, localcontext

DIGITS = 50
Matrix = Sequence[Sequence[Decimal]]


def cosine_sine(x: Decimal) -> tuple[Decimal, Decimal]:
    """Return (cos x, sin x) by Taylor's series after halving the argument and doubling the angle."""
    with localcontext() as context:
        context.prec = DIGITS + 20
        halvings = max(0, x.adjusted() * 4 + 8) if x else 0
        y = x / (Decimal(2) ** halvings)
        c, s, term, k = Decimal(0), Decimal(0), Decimal(1), 0
        while abs(term) > Decimal(10) ** -(DIGITS + 18) or k < 4:
            if k % 2 == 0:
                c += term if k % 4 == 0 else -term
            else:
                s += term if k % 4 == 1 else -term
            k += 1
            term = term * y / k
        for _ in range(halvings):
            c, s = c * c - s * s, 2 * s * c
    return c, s


def impulse_response(t: float, omega: float, zeta: float) -> float:
    """Return h(t) of q'' + 2 zeta w q' + w^2 q = f [s]."""
    with localcontext() as context:
        context.prec = DIGITS
        return float(_pair(Decimal(t), Decimal(omega), Decimal(zeta))[1])


def step_response(t: float, omega: float, zeta: float) -> float:
    """Return the integral of h from 0 to t [s^2]."""
    with localcontext() as context:
        context.prec = DIGITS
        time, w, z = Decimal(t), Decimal(omega), Decimal(zeta)
        if w == 0:
            return float(time * time / 2)
        c, s = _pair(time, w, z)
        return float((1 - c - z * w * s) / (w * w))


def _pair(t: Decimal, w: Decimal, z: Decimal) -> tuple[Decimal, Decimal]:
    """Return exp(-z w t) times cos(wd t) and sin(wd t)/wd, hyperbolic for z > 1."""
    decay = (-z * w * t).exp()
    if w == 0 or z == 1:
        return decay, decay * t
    wd = w * abs(1 - z * z).sqrt()
    if z < 1:
        c, s = cosine_sine(wd * t)
        return decay * c, decay * s / wd
    up, down = (wd * t - z * w * t).exp(), (-wd * t - z * w * t).exp()
    return (up + down) / 2, (up - down) / (2 * wd)


def affine_power(matrix: Matrix, offset: Sequence[Decimal], start: Sequence[Decimal], n: int) -> tuple[float, float]:
    """Return x_n of x <- A x + b (two components), by squaring the affine map."""
    with localcontext() as context:
        context.prec = DIGITS
        power, shift = matrix, tuple(offset)
        x = tuple(start)
        while n:
            if n & 1:
                x = _apply(power, x, shift)
            shift = _apply(power, shift, shift)
            power = [[sum((power[i][k] * power[k][j] for k in (0, 1)), Decimal(0)) for j in (0, 1)] for i in (0, 1)]
            n >>= 1
        return float(x[0]), float(x[1])


def _apply(matrix: Matrix, x: Sequence[Decimal], shift: Sequence[Decimal]) -> tuple[Decimal, Decimal]:
    first, second = (matrix[i][0] * x[0] + matrix[i][1] * x[1] + shift[i] for i in (0, 1))
    return first, second
