"""How the reed's residual decides the contact force: a bare spring against the relaxing exponential.

    .venv/bin/python benchmarks/reed_residual.py

The demo's reed on a seat of impedance 1 kN s/m that sends nothing back, first millisecond; writes
benchmarks/results/reed_residual.md.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import impact
from impact import measures
from impact.files.atomic import whole_file
from impact.greens.modal import ModalGreens, Residual

REED = {"young": 200e9, "density": 7850.0, "length": 25.4e-3, "width": 10e-3, "thickness": 0.305e-3}
SEAT = impact.semi_infinite_rod(young=200e9, density=7850.0, area=2.52e-5)
DT, DURATION = 5e-9, 1e-3
RESULT = Path(__file__).parent / "results" / "reed_residual.md"


def reed(n_modes: int, *, bare: bool) -> impact.Body:
    body = impact.cantilever_reed(**REED, damping_ratio=0.03, tip_deflection=1e-3, n_modes=n_modes)
    greens = body.greens
    assert isinstance(greens, ModalGreens)
    if bare:
        greens = replace(greens, residual=Residual.spring(greens.residual.static()))
    return replace(body, greens=greens)


def row(n_modes: int, *, bare: bool) -> str:
    problem = impact.ContactProblem(reed(n_modes, bare=bare), impact.Body(SEAT))
    result = impact.solve(problem, dt=DT, duration=DURATION)
    values = [measures.peak_force(result), *(measures.filtered_peak_force(result, w) for w in (1e-6, 5e-6, 2e-5))]
    impulse, raw = 1e3 * measures.impulse(result), len(measures.contact_intervals(result))
    name = "bare spring" if bare else "relaxing"
    return f"| {n_modes} | {name} | " + " | ".join(f"{v:.2f}" for v in values) + f" | {impulse:.5f} | {raw} |"


def main() -> None:
    head = ["modes", "residual", "peak [N]", "1 us mean", "5 us mean", "20 us mean", "impulse [mN s]", "contacts, raw"]
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    for n in (10, 20, 40, 80, 160):
        lines += [row(n, bare=True), row(n, bare=False)]
    impedance = 1 / SEAT.initial_value()[0, 0]
    note = f"# The residual of a reed\n\nSeat: Z = {impedance:.4g} N s/m; step {DT:g} s, {DURATION:g} s.\n\n"
    with whole_file(RESULT) as temporary:
        temporary.write_text(note + "\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
