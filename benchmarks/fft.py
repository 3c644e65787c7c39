"""Step weights: the blocked FFT against the direct sum, inside the contact march."""

from __future__ import annotations

import numpy as np
from scenes import DT, modal_seat, throw, throw_on_rod
from table import Table, best, publish

from impact.march import engines
from impact.march.engines import Engine
from impact.march.history import Poles
from impact.march.prepared import prepare
from impact.march.stepper import ContactStepper

LONG, SHORT = 1_000_000, 40_000


def march(steps: int, engine: Engine, repeats: int) -> tuple[float, float]:
    """Seconds, and those predicted by the cost model."""
    prepared = prepare(throw_on_rod(), DT, steps * DT, engine=engine)
    seconds = best(lambda: ContactStepper(prepared).advance(steps), repeats)
    return seconds, prepared.plan.seconds


def poles_or_weights(poles: int, n: int = 200_000) -> tuple[str, ...]:
    """March by poles against forming their step weights and marching by FFT."""
    by_poles, by_fft = (prepare(throw(poles), DT, n * DT, engine=engine) for engine in ("poles", "fft"))
    greens = modal_seat(poles)
    seen, own = Poles.from_modes([(greens, np.ones((1, 1)))], DT, 1), greens.step_matrix(DT)
    recursion = best(lambda: ContactStepper(by_poles).advance(n), 3)
    forming = best(lambda: seen.weights(own, n), 3)
    folding = best(lambda: ContactStepper(by_fft).advance(n), 3)
    chosen = engines.choose([b.kernel for b in by_poles.bodies], 1, n)
    choice = "poles" if all(chosen.by_poles) else "FFT"
    times = (recursion, forming + folding, by_poles.plan.seconds, by_fft.plan.seconds)
    return (str(poles), *(f"{seconds:.3g}" for seconds in times), choice)


def main() -> None:
    """One core for the sums; NumPy's FFT uses one too."""
    ContactStepper(prepare(throw_on_rod(), DT, 100 * DT)).advance(100)
    direct, direct_predicted = march(SHORT, "direct", 3)
    rows: list[tuple[str, ...]] = [(str(SHORT), "direct sum", f"{direct:.3g}", f"{direct_predicted:.3g}", "")]
    for steps in (SHORT, 200_000, LONG):
        seconds, predicted = march(steps, "fft", 3)
        extrapolated = direct * (steps / SHORT) ** 2
        ratio = f"{extrapolated / seconds:.0f}"
        rows.append((str(steps), "FFT in blocks", f"{seconds:.3g}", f"{predicted:.3g}", ratio))
    notes = (
        "A rigid mass on an undamped rod given by exact step weights. The direct sum costs n^2/2 multiply-adds; its",
        f"time is measured at {SHORT} steps and extrapolated. Aim at 10^6 steps: at least 100 times.",
    )
    columns = ("steps", "engine", "march [s]", "predicted by the cost model [s]", "times faster than the direct sum")
    publish("fft", Table("Blocked FFT", notes, columns, tuple(rows)))

    notes = (
        "A modal body can be run by its poles or, after forming its step weights, by FFT: 200,000 steps, seconds.",
        '`engine="auto"` leaves the poles when the cost model predicts a gain of more than 20 %.',
    )
    columns = ("poles", "pole recursion", "weights and FFT", "predicted, poles", "predicted, FFT", "auto takes")
    rows = [poles_or_weights(poles) for poles in (100, 1000, 4000)]
    publish("engines", Table("Poles or FFT", notes, columns, tuple(rows)))


if __name__ == "__main__":
    main()
