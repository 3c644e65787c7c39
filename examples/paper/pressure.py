"""The pressure p(x, t) of equations (1) and (2): a wave of gas runs along the reed while it closes.

    python examples/paper/pressure.py [FOLDER]

p = p0 exp(-t/tau) cos(k x - w t) does not separate. `PressureField` takes it at 8 Gauss points, constant over each
step; beside it the sum (2) in closed form (`printed_march`), and the article's march under it at the same step.
"""

import sys
from pathlib import Path

import numpy as np
from paper_case import CASES, Numbers, table_1_reed
from paper_pictures import plot_pressure
from printed_march import free_motion, march, pressed_motion, reed_modes, rod_modes
from scipy.optimize import brentq

import impact

PEAK, DECAY, SPEED, RATE = -5e3, 1e-3, 150.0, 4e3 * np.pi  # Pa, s, m/s, rad/s; first towards the seat
COUNT, STEP, DURATION = 40, 25e-9, 3e-3
HEAD = """| | arrival [µs] | speed [m/s] | 3 mm: mean over 1 µs [N] | impulse [mN s] | 30 mm [N] | [mN s] |
|---|---|---|---|---|---|---|
"""


def pressure(x: float, t: np.ndarray) -> np.ndarray:
    """Return p(x, t) [Pa], positive away from the seat."""
    return PEAK * np.exp(-t / DECAY) * np.cos(RATE / SPEED * x - RATE * t)


def tip(time: np.ndarray, peak: float = PEAK) -> np.ndarray:
    """Return the tip's motion without contact by the closed sum (2) [m]."""
    reed, rate = reed_modes(COUNT), -1 / DECAY + 1j * RATE
    return free_motion(reed, time) + pressed_motion(reed, time, peak, rate, RATE / SPEED)


def flight(step: float, points: int = 8) -> float:
    """Return by how much a free flight of 1 ms by `impact.solve` is off the closed sum at most [m]."""
    reed = table_1_reed(COUNT, [impact.PressureField(pressure, points=points)])
    result = impact.solve(impact.ContactProblem(reed, impact.spring(stiffness=1e6), gap=1.0), dt=step, duration=1e-3)
    return float(np.abs(result.striker_displacement - tip(result.time)).max())


def arrival(peak: float) -> tuple[float, float]:
    """Return when the tip reaches the seat [s] and how fast [m/s], by the closed sum (2)."""
    first = brentq(lambda t: float(tip(np.array([t]), peak)[0]), 0.5e-3, 0.7e-3, xtol=1e-15)
    return first, -float(np.diff(tip(first + np.array([-1e-9, 1e-9]), peak))[0]) / 2e-9


def row(words: str, peak: float) -> tuple[str, impact.ImpactResult]:
    """Return two rows of the table, of the project and of the article's equations, and the run on the longer rod."""
    first, speed = arrival(peak)
    time, reed = STEP * np.arange(1, round(DURATION / STEP) + 1), reed_modes(COUNT)
    body = table_1_reed(COUNT, [impact.PressureField(pressure)] if peak else [])
    ours, closed = [], [f"{words}, (2) and (12)", f"{1e6 * first:.3f}", f"{speed:.4f}"]
    for case in CASES[2:]:
        result = impact.solve(impact.ContactProblem(body, impact.Body(case.rod)), dt=STEP, duration=DURATION)
        numbers, touch = Numbers.of(result), impact.measures.contact_groups(result)[0, 0]
        force = march(tip(time, peak), STEP, reed, rod_modes(COUNT, case.length, case.area))
        head = [f"{words}, `impact.solve`", f"{1e6 * touch:.3f}", f"{impact.measures.impact_velocity(result):.4f}"]
        ours += [*(head if not ours else []), f"{numbers.filtered_peak:.4g}", f"{1e3 * numbers.impulse:.4f}"]
        closed += ["", f"{1e3 * STEP * force.sum():.4f}"]
        assert 0 <= first - touch + 1e-12 < STEP  # a touch is dated to the start of its step
        assert abs(STEP * force.sum() / numbers.impulse - 1) < 1e-3  # what 40 modes leave of the rod: 3e-4
    return f"| {' | '.join(ours)} |\n| {' | '.join(closed)} |\n", result


def main(folder: Path) -> None:
    (calm, still), (pressed, run), errors = row("no pressure", 0.0), row("p(x, t)", PEAK), [flight(2e-6), flight(1e-6)]
    words = f"off the closed sum by {1e9 * errors[0]:.2f} nm at most in steps of 2 µs, {1e9 * errors[1]:.2f} nm of 1 µs"
    print(text := f"{HEAD}{calm}{pressed}\nIn a free flight of 1 ms `impact.solve` is {words}.\n")
    runs = {"no pressure": (still, tip(still.time, 0.0)), "p(x, t)": (run, tip(run.time))}
    plot_pressure(pressure, runs, folder / "paper_pressure.png")
    (folder / "paper_pressure.md").write_text(text, encoding="utf-8")
    assert abs(errors[0] / errors[1] - 4) < 0.1  # second order in the step: nothing else is left


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "paper"))
