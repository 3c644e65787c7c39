"""Equations (11)-(12), with the damping of Table 1, at small steps, and why `impact.solve` does not use them.

    python examples/paper/discretised.py [FOLDER]

(11) and (12) are sums dt sum_k F(t_k) g(t_i - t_k) in which the newest force acts with g(dt), for g(0) = 0 in a sum of
modes: W_0 = W_1 = dt g(dt), W_m = dt g(m dt). A free mass, g = t/m, has then W(z) = (dt^2/m) (1 - z + z^2)/(1 - z)^2
with its zeros on the unit circle: an error of the force comes back every six steps. Boxes with exact weights have
the zero -1 (a sawtooth), hat functions grow by 2 + sqrt(3) a step.
"""

import sys
from pathlib import Path

import numpy as np
from paper_case import CASES, strike, table_1_reed

from impact import ModalGreens, Residual
from impact.after.rods import fixed_rod_modes
from impact.pictures.drawing import BLUE, GREEN, GREY, ORANGE, sheet

CASE = CASES[3]  # rod of 30 mm, area
START, STEPS = 650e-6, 400


def weights(greens: ModalGreens, h: float, n: int, rule: str) -> np.ndarray:
    """Displacement at the end of step m after a unit force on the first one [m/N], by the rule for the force."""
    if rule == "printed":
        return h * greens.impulse_response(h * np.maximum(np.arange(n), 1))
    if rule == "box":
        return np.diff(greens.step_response(h * np.arange(n + 1)))
    nodes, gauss = np.polynomial.legendre.leggauss(8)
    means = greens.step_response(h * (np.arange(n + 1)[:, None] + (nodes + 1) / 2)) @ gauss / 2
    return np.diff(means, prepend=0.0)[:n]


def march(h: float, rule: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(time, force, weights): N >= 0 that closes the gap at each step, solved step by step as figure 4 has it."""
    reed = table_1_reed()
    modal, start = reed.greens, reed.state.displacement
    bare = ModalGreens(modal.omega, modal.zeta, modal.shapes, Residual.none())
    w = weights(bare, h, STEPS, rule) + weights(fixed_rod_modes(CASE.rod, 20), h, STEPS, rule)
    time = START + h * np.arange(1, STEPS + 1)
    wd = modal.omega * np.sqrt(1 - modal.zeta**2)
    ring = np.cos(np.outer(time, wd)) + modal.zeta * modal.omega / wd * np.sin(np.outer(time, wd))
    free = np.exp(-np.outer(time, modal.zeta * modal.omega)) * ring @ (modal.shapes[:, 0] * start)
    force = np.zeros(STEPS)
    for n in range(STEPS):
        force[n] = max(0.0, -(free[n] + w[1 : n + 1] @ force[:n][::-1]) / w[0])
    return time, force, w


def growth(w: np.ndarray) -> float:
    """Factor per step of an error of the force in lasting contact: 1/|z| of the smallest zero of W(z)."""
    error = np.eye(1, 120)[0]
    for n in range(1, 120):
        error[n] = -(w[1 : n + 1] @ error[:n][::-1]) / w[0]
    return float((np.abs(error[108:120]).max() / np.abs(error[48:60]).max()) ** (1 / 60))


def main(folder: Path) -> None:
    runs = {(rule, h): march(h, rule) for rule in ("printed", "box", "hat") for h in (50e-9, 25e-9)}
    rates = {key: growth(run[2]) for key, run in runs.items()}
    for (rule, h), rate in rates.items():
        print(f"{rule}, step {1e9 * h:g} ns: x{rate:.4f} per step, largest force {runs[rule, h][1].max():.4g} N")
    assert abs(rates["hat", 25e-9] - (2 + 3**0.5)) < 0.05  # the limits for small steps
    assert all(abs(rates[rule, 25e-9] - 1.0) < 0.02 for rule in ("printed", "box"))
    result = strike(CASE.rod)
    with sheet(folder / "paper_discretised.png", 7.2, 3.4) as figure:
        axes = figure.subplots()
        for (rule, h), colour in ((("printed", 25e-9), ORANGE), (("printed", 50e-9), GREEN), (("box", 25e-9), GREY)):
            label = f"(11)-(12), {1e9 * h:g} ns" if rule == "printed" else f"boxes, {1e9 * h:g} ns"
            axes.plot(1e6 * runs[rule, h][0], runs[rule, h][1], color=colour, linewidth=0.7, label=label)
        axes.plot(1e6 * result.time, result.force, color=BLUE, label="impact.solve, 25 ns")
        axes.set(xlim=(652.5, 658), ylim=(0, 160), xlabel="time [µs]", ylabel="contact force [N]")
        axes.set_title("First contact, rod of 30 mm (area), truncated modes: an error of the force hardly dies")
        axes.legend(loc="upper right")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "paper"))
