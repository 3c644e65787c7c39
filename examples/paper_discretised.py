"""The paper's discretised equations (11)-(12), in our reading, and why `impact.solve` does not use them.

    python examples/paper_discretised.py [FOLDER]

The force is a box or hat function on each step, the gap closes at the nodes, both bodies are truncated sums of damped
modes (3 % and 10 %): g(0) = 0. Boxes are marginally stable: a sawtooth, and a first force that grows like 1/step.
Hats are unstable: an error grows by 2 + sqrt(3) = 3.73 in each step.
"""

import sys
from pathlib import Path

import numpy as np

from impact import ModalGreens, Residual
from impact.drawing import BLUE, GREEN, GREY, ORANGE, sheet
from impact.paper import CASES, strike, table_1_reed
from impact.rods import fixed_rod_modes

CASE = CASES[3]  # rod of 30 mm, area
START, STEPS = 650e-6, 400


def weights(greens: ModalGreens, h: float, n: int, basis: str) -> np.ndarray:
    """Displacement at node j + 1 of a unit force function on the first step (box) or around its end (hat) [m/N]."""
    if basis == "box":
        return np.diff(greens.step_response(h * np.arange(n + 1)))
    nodes, gauss = np.polynomial.legendre.leggauss(8)
    inside = (
        greens.step_response(h * (np.arange(n + 1)[:, None] + (nodes + 1) / 2)) @ gauss / 2
    )  # mean of S over each step
    return np.diff(inside, prepend=0.0)[:n]


def march(h: float, basis: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """(time, force, weights): N >= 0 that closes the gap at each node, solved node by node."""
    reed = table_1_reed()
    modal, start = reed.greens, reed.state.displacement
    bare = ModalGreens(modal.omega, modal.zeta, modal.shapes, Residual.none())
    w = weights(bare, h, STEPS, basis) + weights(fixed_rod_modes(CASE.rod, 20), h, STEPS, basis)
    time = START + h * np.arange(1, STEPS + 1)
    wd = modal.omega * np.sqrt(1 - modal.zeta**2)
    ring = np.cos(np.outer(time, wd)) + modal.zeta * modal.omega / wd * np.sin(np.outer(time, wd))
    free = np.exp(-np.outer(time, modal.zeta * modal.omega)) * ring @ (modal.shapes[:, 0] * start)
    force = np.zeros(STEPS)
    for n in range(STEPS):
        force[n] = max(0.0, -(free[n] + w[1 : n + 1] @ force[:n][::-1]) / w[0])
    return time, force, w


def growth(w: np.ndarray) -> float:
    """Factor per step of an error of the force in lasting contact."""
    error = np.eye(1, 41)[0]
    for n in range(1, 41):
        error[n] = -(w[1 : n + 1] @ error[:n][::-1]) / w[0]
    return float(abs(error[40] / error[20]) ** (1 / 20))


def main(folder: Path) -> None:
    runs = {(b, h): march(h, b) for b in ("box", "hat") for h in (50e-9, 25e-9)}
    for (b, h), rate in (rates := {key: growth(w) for key, (_, _, w) in runs.items()}).items():
        print(f"{b}, step {1e9 * h:g} ns: x{rate:.4f} per step, largest force {runs[b, h][1].max():.4g} N")
    assert abs(rates["hat", 25e-9] - (2 + 3**0.5)) < 0.05  # the limit for small steps
    assert abs(rates["box", 25e-9] - 1.0) < 0.02
    result = strike(CASE.rod)
    with sheet(folder / "paper_discretised.png", 7.2, 3.2) as figure:
        axes = figure.subplots()
        axes.plot(1e6 * runs["hat", 25e-9][0], runs["hat", 25e-9][1], color=GREY, linewidth=0.6, label="hats, 25 ns")
        for h, colour in ((25e-9, ORANGE), (50e-9, GREEN)):
            axes.plot(
                1e6 * runs["box", h][0], runs["box", h][1], color=colour, linewidth=0.7, label=f"boxes, {1e9 * h:g} ns"
            )
        axes.plot(1e6 * result.time, result.force, color=BLUE, label="impact.solve, 25 ns")
        axes.set(xlim=(652, 660), ylim=(0, 120), xlabel="time [µs]", ylabel="force [N]")
        axes.set_title("Equations (11)-(12), truncated modes, 30 mm rod, area: marginal with boxes, unstable with hats")
        axes.legend(loc="upper right")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "paper"))
