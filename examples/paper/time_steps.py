"""The article's own scheme at many time steps, and converged forces averaged over as long.

    python examples/paper/time_steps.py [FOLDER]

Equations (3), (11), (12) with Table 1's damping, as written (`printed_march`): by how much the peak on K is above
that on the rod, and for how many of 16 pairs of numbers of modes it is, and more so for the longer rod. Beside it the
same of `impact.solve` (40 modes, step 25 ns) for the largest mean over one such step.
"""

import sys
from itertools import product
from pathlib import Path

import numpy as np
from paper_case import CASES, LENGTHS, Case, strike, strike_spring
from paper_pictures import plot_time_steps
from printed_march import largest_force, reed_modes, rod_modes

from impact.after.measures import filtered_peak_force

STEPS = (0.2e-6, 0.5e-6, 1e-6, 1.5e-6, 2e-6, 5e-6, 10e-6, 20e-6)  # in the table [s]
BETWEEN = (2.5e-6, 3e-6, 4e-6, 6e-6, 7e-6, 8e-6, 9e-6, 12e-6, 15e-6)  # besides, in counts and picture
WAYS = {"area": ("area", True), "area undamped": ("area", False), "strip": ("strip", True), "sheet": ("sheet", True)}
PAIRS = tuple(product((3, 5, 10, 20), repeat=2))  # modes of the reed and of the rod
PLAIN = PAIRS.index((10, 10))
HEAD = """| step [µs] | 3 mm: rod / K [N] | K is off | 30 mm: rod / K [N] | K is off | pairs | mean: 3 mm | 30 mm |
|---|---|---|---|---|---|---|---|
"""


def peaks(step: float, reading: str, damped: bool = True) -> np.ndarray:
    """Return the largest forces of the article's scheme by pair, length, and seat (rod, stiffness), (16, 2, 2) [N]."""
    found, damping = np.zeros((len(PAIRS), len(LENGTHS), 2)), {} if damped else {"damping_ratio": 0.0}
    for (k, (of_reed, of_rod)), (m, length) in product(enumerate(PAIRS), enumerate(LENGTHS)):
        case = Case(reading, length)
        reed, rod = reed_modes(of_reed, **damping), rod_modes(of_rod, length, case.area, **damping)
        found[k, m] = largest_force(step, reed, rod), largest_force(step, reed, case.stiffness)
    return found


def errors(found: np.ndarray) -> np.ndarray:
    """Return stiffness/rod - 1, nan where the scheme finds no contact with the rod."""
    rod = np.where(found[..., 0] > 0, found[..., 0], np.nan)
    return found[..., 1] / rod - 1


def agreeing(found: np.ndarray) -> int:
    """Return for how many pairs the stiffness over-estimates, and more so for the longer rod."""
    short, longer = errors(found).T
    return int(np.sum((short > 0) & (longer > short)))


def tables(scheme: dict[float, np.ndarray], means: dict[float, list[float]]) -> str:
    """Return what each time step gives, and for how many pairs each reading agrees with the article."""
    text = HEAD
    for step in STEPS:
        of_lengths = zip(scheme[step][PLAIN], errors(scheme[step])[PLAIN], strict=True)
        cells = [f"{1e6 * step:g}", *(f"{rod:.3g} / {k:.3g} | {100 * e:+.1f} %" for (rod, k), e in of_lengths)]
        cells += [str(agreeing(scheme[step])), *(f"{100 * e:+.1f} %" for e in means[step])]
        text += f"| {' | '.join(cells)} |\n"
    text += f"\n| step [µs] | {' | '.join(f'{1e6 * step:g}' for step in scheme)} |\n|{'---|' * (1 + len(scheme))}\n"
    for words, way in WAYS.items():
        counts = [agreeing(scheme[step] if words == "area" else peaks(step, *way)) for step in scheme]
        text += f"| {words} | {' | '.join(map(str, counts))} |\n"
    return text


def main(folder: Path) -> None:
    runs = [(strike(case.rod), strike_spring(case.stiffness)) for case in CASES if case.reading == "area"]
    widths = sorted({*STEPS, *np.geomspace(STEPS[0], STEPS[-1], 61)})
    means = {w: [filtered_peak_force(k, w) / filtered_peak_force(rod, w) - 1 for rod, k in runs] for w in widths}
    scheme = {step: peaks(step, "area") for step in sorted(STEPS + BETWEEN)}
    print(text := tables(scheme, means))
    plot_time_steps({s: errors(f) for s, f in scheme.items()}, means, folder / "paper_time_steps.png", PLAIN)
    (folder / "paper_time_steps.md").write_text(text, encoding="utf-8")
    assert [agreeing(scheme[step]) for step in STEPS] == [0, 0, 0, 0, 0, 16, 16, 0]


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "paper"))
