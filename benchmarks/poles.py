"""Pole recursion: time per pole and step, beside a loop that only moves the same memory."""

from __future__ import annotations

import numpy as np
from numba import njit
from scenes import DT, throw
from table import Table, best, publish

import impact
from impact.march.prepared import prepare
from impact.march.stepper import ContactStepper

STEPS = 100_000


@njit(fastmath=True)
def stream(rows, q, p, steps):  # type: ignore[no-untyped-def]
    """Read what the recursion reads, write what it writes, add what must be added to use it."""
    a, b, c, d, e = rows[0], rows[1], rows[2], rows[3], rows[4]
    for _ in range(steps):
        for k in range(q.size):
            q[k] = q[k] + a[k] + b[k]
            p[k] = p[k] + c[k] + d[k] + e[k]


def main() -> None:
    """One core."""
    rows = []
    for poles in (10, 50, 100, 400, 1000):
        prepared = prepare(throw(poles), DT, STEPS * DT, engine="poles")
        warm = ContactStepper(prepared)
        warm.advance(10)
        coefficients, q, p = prepared.poles.folded(), np.zeros(poles), np.zeros(poles)
        stream(coefficients, q, p, 10)
        march, moved = np.inf, np.inf
        for _ in range(15):  # interleaved, so that both see the same machine
            stepper = ContactStepper(prepared)
            march = min(march, best(lambda s=stepper: s.advance(STEPS), 1))
            moved = min(moved, best(lambda r=coefficients, q=q, p=p: stream(r, q, p, STEPS), 1))
        scale = 1e9 / STEPS / poles
        rows.append((str(poles), f"{march * scale:.2f}", f"{moved * scale:.2f}", f"{march / moved:.1f}"))
    long = prepare(throw(400), DT, 1.0, engine="poles")
    seconds = min(best(lambda: ContactStepper(long).advance(10**6), 1) for _ in range(5))
    whole = best(lambda: impact.solve(throw(400), dt=DT, duration=1.0), 1)
    notes = (
        f"A rigid mass on a modal seat with a Hertz law, one core, {STEPS} steps, the shortest of 15 interleaved runs.",
        "Aim at 400 poles: at most 0.6 ns per pole and step, within 3 times the streaming loop.",
        f"10^6 steps with 400 poles: march {seconds:.2f} s (aim: below 0.5 s); all of `solve`, with free motion and",
        f"energy ledger replayed pole by pole: {whole:.1f} s.",
    )
    columns = ("poles", "march, ns per pole and step", "streaming loop, ns", "ratio")
    publish("poles", Table("Pole recursion", notes, columns, tuple(rows)))


if __name__ == "__main__":
    main()
