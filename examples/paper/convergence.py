"""What steps and modes leave in the numbers of the page: a quarter of the step, twice the modes at half of it.

    python examples/paper/convergence.py

For the six cases: the means over 1 µs and the error of the constant stiffness in them; for the area, too, that error in
means over 0.2 to 20 µs.
"""

import numpy as np
from paper_case import CASES, FILTER_WIDTH, MODES, SHEETS, TIME_STEP, strike, strike_spring

from impact.after.measures import filtered_peak_force

WIDTHS = (FILTER_WIDTH, 0.2e-6, 0.5e-6, 1.5e-6, 2e-6, 5e-6, 10e-6, 20e-6)  # s


def means(case, dt: float, n_modes: int) -> np.ndarray:  # type: ignore[no-untyped-def]
    """Return the largest means over each width on the rod and on K = EA/l, (2, W) [N]."""
    runs = (strike(case.rod, dt=dt, n_modes=n_modes), strike_spring(case.stiffness, dt=dt, n_modes=n_modes))
    return np.array([[filtered_peak_force(run, width) for width in WIDTHS] for run in runs])


def main() -> None:
    print("reading    l [mm]  mean over 1 µs, modes x 2: rod, K   error of K: step / 4, modes x 2 and step / 2")
    for case in (*CASES, *SHEETS):
        plain = means(case, TIME_STEP, MODES)
        fine, half, twice = (means(case, *way) for way in ((6.25e-9, MODES), (12.5e-9, MODES), (12.5e-9, 2 * MODES)))
        by_modes, moved = twice[:, 0] / half[:, 0] - 1, [one[1] / one[0] - plain[1] / plain[0] for one in (fine, twice)]
        print(
            f"{case.reading:9s} {1e3 * case.length:6g} {by_modes[0]:+26.2%} {by_modes[1]:+9.2%}"
            f" {100 * moved[0][0]:+25.2f} {100 * moved[1][0]:+20.2f} points"
        )
        assert np.all(np.abs(by_modes) < (0.008 if case in SHEETS else 0.002))
        assert abs(moved[0][0]) < 0.013
        if case.reading == "area":
            worst = np.max(np.abs(moved), axis=0)
            each = (f"{1e6 * width:g} µs: {100 * most:.2f}" for width, most in zip(WIDTHS, worst, strict=True))
            print(f"  at most, in means over {', '.join(each)} points")
            assert max(worst) < 0.015
            assert max(worst[5:]) < 0.003


if __name__ == "__main__":
    main()
