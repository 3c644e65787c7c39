"""Equations (11)-(12) as they are printed, undamped, beside the same with the damping of Table 1 and `impact.solve`.

    python examples/paper/undamped.py [FOLDER]

Largest force with 10 modes of the reed and 10 of the rod at steps of 1 µs; of `impact.solve`, always damped, the
largest mean over 1 µs. One undamped mode that is held in contact has step weights with the generating function
sin(w dt) (1 + (1 - 2 cos(w dt)) z + z^2)/(1 - 2 cos(w dt) z + z^2): beyond w dt = 2 pi/3, fewer than three steps a
period, a zero lies inside the unit circle, and an error of the force grows.
"""

import sys
from pathlib import Path

import numpy as np
from paper_case import CASES, SHEETS, Case, strike
from printed_march import REED_DAMPING, ROD_DAMPING, free_motion, march, reed_modes, rod_modes

from impact.after.measures import filtered_force, filtered_peak_force
from impact.pictures.drawing import BLUE, GREEN, ORANGE, sheet

STEP, DURATION, LANDING = 1e-6, 3e-3, 1e-3  # s
HEAD = """| reading | rod | undamped, 1 ms [N] | 3 ms [N] | damped, 1 ms [N] | 3 ms [N] | `impact.solve` [N] |
|---|---|---|---|---|---|---|
"""


def force(case: Case, damped: bool, count: int = 10) -> np.ndarray:
    """Return the force of the article's scheme at the ends of its steps [N]."""
    reed = reed_modes(count, REED_DAMPING if damped else 0.0)
    rod = rod_modes(count, case.length, case.area, ROD_DAMPING if damped else 0.0)
    return march(free_motion(reed, STEP * np.arange(1, round(DURATION / STEP) + 1)), STEP, reed, rod)


def growth(forces: np.ndarray) -> float:
    """Return the factor per step by which the largest force grows from 1 ms to the end."""
    first = round(LANDING / STEP)
    return float((forces.max() / forces[:first].max()) ** (1 / (len(forces) - first)))


def number(value: float) -> str:
    """Return a force for people."""
    return f"{value:.3g}" if value < 1e4 else f"{value:.1e}"


def main(folder: Path) -> None:
    text, landing = HEAD, round(LANDING / STEP)
    for case in (*CASES, *SHEETS):
        cells = [case.reading, f"{1e3 * case.length:g} mm"]
        for damped in (False, True):
            forces = force(case, damped)
            cells += [number(forces[:landing].max()), number(forces.max())]
        text += f"| {' | '.join([*cells, f'{filtered_peak_force(strike(case.rod), STEP):.3g}'])} |\n"
    strip = CASES[0]
    bare, worn, result = force(strip, False), force(strip, True), strike(strip.rod)
    text += f"\nThe undamped force on the strip of 3 mm grows by a factor of {growth(bare):.3f} a step.\n"
    print(text)
    with sheet(folder / "paper_undamped.png", 7.2, 3.0) as figure:
        axes = figure.subplots()
        time = 1e6 * STEP * np.arange(1, len(bare) + 1)
        for forces, colour, label in ((bare, ORANGE, "as printed, undamped"), (worn, GREEN, "damped")):
            label = f"(11)-(12) {label}, step 1 µs"
            axes.plot(time[forces > 0], forces[forces > 0], ".", markersize=3, color=colour, label=label)
        axes.plot(1e6 * result.time, filtered_force(result, STEP), color=BLUE, label="impact.solve, mean over 1 µs")
        axes.set(xlim=(630, 760), yscale="log", ylim=(0.03, 1e13), xlabel="time [µs]", ylabel="contact force [N]")
        axes.set_title("Rod of 3 mm (strip), first touch")
        axes.legend(loc="upper left")
    (folder / "paper_undamped.md").write_text(text, encoding="utf-8")
    assert bare.max() > 1e100 > worn.max()


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "paper"))
