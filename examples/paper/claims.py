"""Two remarks of the article, put to numbers: the wave through the reed's thickness, and why longer rods differ more.

    python examples/paper/claims.py

The article neglects the wave through the reed, as it is thinner than the rod is long. Here the thickness is added as a
rod of its own, of the same area and damping, in series with the seat: its Green's function adds to the seat's. The
article's reason for the larger error of the longer rod is the time that the full static deflection takes to develop:
the round trip 2 l/c is set beside the time to the largest mean force on the constant stiffness.
"""

import math

import numpy as np
from paper_case import CASES, DENSITY, FILTER_WIDTH, ROD_DAMPING, YOUNG, Numbers, over_estimates, strike, strike_spring

import impact
from impact.greens.base import SumGreens

THICKNESS = 0.305e-3  # of the reed [m]


def main() -> None:
    print("reading   l [mm]   wave through the reed: mean peak, impulse   round trip / rise   K over waves, mean peak")
    changes, errors = {}, {}
    for case in CASES:
        layer = impact.fixed_rod(
            young=YOUNG, density=DENSITY, area=case.area, length=THICKNESS, damping_ratio=ROD_DAMPING
        )
        wave, spring = strike(case.rod), strike_spring(case.stiffness)
        alone, both = Numbers.of(wave), Numbers.of(strike(SumGreens((case.rod, layer))))
        changes[case] = (both.filtered_peak / alone.filtered_peak - 1, both.impulse / alone.impulse - 1)
        errors[case] = over_estimates(alone, Numbers.of(spring))[1]
        mean = impact.measures.filtered_force(spring, FILTER_WIDTH)
        rise = spring.time[int(np.argmax(mean))] - impact.measures.contact_groups(spring)[0, 0]
        trip = 2 * case.length / math.sqrt(YOUNG / DENSITY)
        print(
            f"{case.reading:8s} {1e3 * case.length:6g} {changes[case][0]:+22.2%} {changes[case][1]:+12.3%}"
            f" {trip / rise:23.3f} {errors[case]:+20.1%}"
        )
    # the layer adds a tenth of the short rod's compliance and a hundredth of the long one's: half as much in the peak
    assert all(abs(peak) < 0.5 * THICKNESS / case.length + 0.005 for case, (peak, _) in changes.items())
    assert all(abs(changes[case][0]) > abs(errors[case]) for case in CASES[:1])
    assert errors[CASES[2]] > 0 > errors[CASES[3]]


if __name__ == "__main__":
    main()
