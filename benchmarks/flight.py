"""Flight in long strides: the same march with and without them, its forces, and what they leave of a whole run."""

from __future__ import annotations

import numpy as np
from table import Table, best, publish

import impact
from impact.greens.modal import ModalGreens, Residual
from impact.march.prepared import prepare
from impact.march.stepper import ContactStepper
from impact.runs.solver import collect

DT, CYCLE = 50e-9, 20e-3  # 3000 rpm


def seat(poles: int, ports: int) -> impact.Body:
    """Modes from 20 kHz to 2 MHz that add up to 28 N/um, somewhat different from port to port."""
    omega = 2 * np.pi * np.linspace(20e3, 2e6, poles)
    shapes = np.abs(np.random.default_rng(0).normal(1, 0.3, (poles, ports)))
    shapes *= np.sqrt(1 / (27.8e6 * np.sum(1 / omega**2)))
    rest = Residual.relaxing(np.eye(ports) * 2e-9, 2 * np.pi * 3e6)
    names = tuple(f"port {k + 1}" for k in range(ports))
    return impact.Body(ModalGreens(omega, np.full(poles, 0.02), shapes, rest, port_names=names))


def cycle(modes: int, poles: int, ports: int, gap: float) -> impact.ContactProblem:
    """A reed under a pressure that opens and closes it once a cycle."""
    wave = impact.Pressure(lambda t: 2000 * np.cos(2 * np.pi * t / CYCLE))
    reed = impact.cantilever_reed(
        young=200e9, density=7850, length=25.4e-3, width=10e-3, thickness=0.305e-3, damping_ratio=0.02,
        n_modes=modes, tip_deflection=1e-3, loads=[wave],
    )  # fmt: skip
    body = seat(poles, ports)
    return impact.ContactProblem(reed, contacts=[impact.Contact(body, port=k, gap=gap) for k in range(ports)])


def row(modes: int, poles: int, ports: int, gap: float) -> tuple[str, ...]:
    prepared = prepare(cycle(modes, poles, ports, gap), DT, CYCLE, engine="poles")
    found: dict[bool, ContactStepper] = {}
    seconds = {False: np.inf, True: np.inf}
    for flying in (False, True) * 3:
        found[flying] = stepper = ContactStepper(prepared, flying=flying)
        if gap > 0:  # as after a blow: every mode rings
            for part in stepper._state:
                part[:] = 1e-8 * np.random.default_rng(1).normal(size=part.size)
        seconds[flying] = min(seconds[flying], best(lambda s=stepper: s.advance(s.prepared.steps), 1))
    every, flown = found[False], found[True]
    apart = np.abs(flown.force - every.force).max() / max(every.force.max(), 1e-300)
    closed = np.any(every.force > 0, axis=1).mean()
    beside = best(lambda: prepare(cycle(modes, poles, ports, gap), DT, CYCLE, engine="poles"), 1)
    beside += best(lambda: collect(flown), 1)
    whole = (beside + seconds[False]) / (beside + seconds[True])
    return (
        str(modes),
        str(poles),
        str(ports),
        f"{closed:.0%}",
        f"{seconds[False]:.3f}",
        f"{seconds[True]:.3f}",
        f"{seconds[False] / seconds[True]:.1f}",
        f"{apart:.0e}",
        f"{whole:.2f}",
    )


def main() -> None:
    """One core."""
    short = prepare(cycle(5, 5, 2, 0.0), DT, 2000 * DT, engine="poles")
    for flying in (False, True):
        ContactStepper(short, flying=flying).advance(2000)
    cases = [(40, 300, 1, 0.0), (120, 1000, 1, 0.0), (120, 300, 8, 0.0)]
    rows = [row(*case) for case in [*cases, *((modes, poles, ports, 5e-3) for modes, poles, ports, _ in cases)]]
    notes = (
        f"One cycle of {1e3 * CYCLE:g} ms in {CYCLE / DT:.0f} steps of {1e9 * DT:g} ns, one core. The last three are",
        "flight alone, every mode ringing as after a blow.",
        "Apart: largest difference of the forces over the largest force. Whole: all of a run, with free motion before",
        "and displacements and energies after the march, which go through every step for every mode.",
    )
    columns = ("reed modes", "seat modes", "ports", "closed", "every step, s", "strides, s", "ratio", "apart", "whole")
    publish("flight", Table("Flight in long strides", notes, columns, tuple(rows)))


if __name__ == "__main__":
    main()
