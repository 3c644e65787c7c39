"""A seat as a spring gives whatever its stiffness asks for: K over seven decades beside the rods with waves.

python examples/paper/stiffness_sweep.py [FOLDER]
"""

import sys
from pathlib import Path

import numpy as np
from paper_case import CASES, Numbers, strike, strike_spring
from paper_pictures import plot_stiffness_sweep

from impact.files.csv_table import write_csv

STEP = 40e-9  # 1/25 of the filter, 0.42 radian of the reed's highest mode


def main(folder: Path) -> None:
    stiffness = np.geomspace(1e3, 1e10, 57)
    springs = [Numbers.of(strike_spring(k, dt=STEP)) for k in stiffness]
    waves = {case: Numbers.of(strike(case.rod)) for case in CASES}
    rows = [
        {
            "seat": seat,
            "stiffness_N_per_m": float(k),
            "peak_N": n.peak,
            "filtered_peak_N": n.filtered_peak,
            "impulse_Ns": n.impulse,
        }
        for seat, k, n in (
            *(("spring", k, n) for k, n in zip(stiffness, springs, strict=True)),
            *((f"rod with waves, {c.reading}, {1e3 * c.length:g} mm", c.stiffness, n) for c, n in waves.items()),
        )
    ]
    write_csv(folder / "stiffness_sweep.csv", rows[0], (row.values() for row in rows), digits=7)
    plot_stiffness_sweep(stiffness, springs, waves, folder / "paper_stiffness_sweep.png")
    for name in ("peak", "filtered_peak", "impulse"):
        values = [getattr(n, name) for n in springs]
        print(f"{name}: {min(values):.4g} ... {max(values):.4g}, a factor of {max(values) / min(values):.3g}")
    # From the soft to the stiff end the filtered peak grows more than 40-fold; a stiff stop leaves the impulse alone.
    peaks, impulses = [n.filtered_peak for n in springs], [n.impulse for n in springs]
    assert max(peaks) > 40 * min(peaks), peaks
    assert abs(impulses[-1] - impulses[-17]) < 0.01 * impulses[-1], impulses  # K = 1e8 and 1e10 N/m


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "paper"))
