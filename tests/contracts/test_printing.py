"""Whatever is public prints in a few lines what it is, and never its arrays."""

import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import impact
import seatfem
from impact.greens.base import ErrorEstimate
from tests.rod_model import rod_model

LARGEST, LINES = 1500, 14


@cache
def examples() -> dict[str, object]:
    many = 5000
    greens = impact.ModalGreens(
        np.linspace(1e3, 1e6, many), np.full(many, 0.01), np.ones((many, 2)), impact.Residual.spring(np.eye(2)),
        ("left", "right"), ErrorEstimate(0.01), {"method": "krylov", "list": list(range(many)), "text": "x" * many},
    )  # fmt: skip
    ball = impact.rigid_mass(mass=1e-3, velocity=-1.0)
    reed = impact.cantilever_reed(
        young=2e11, density=7850.0, length=25e-3, width=1e-2, thickness=3e-4, n_modes=200, tip_deflection=1e-3
    )
    contacts = [impact.Contact(greens, port=p, law=impact.LinearSpring(1e6)) for p in ("left", "right")] * 30
    problem = impact.ContactProblem(ball, contacts=contacts[:2])
    result = impact.solve(problem, dt=1e-7, duration=1e-4)
    prepared = impact.prepare(problem, 1e-7, 1e-4)
    stepper = impact.ContactStepper(prepared)
    model = rod_model(young=2e11, density=7850.0, area=1e-4, length=0.03, elements=100)
    single = impact.ContactProblem(ball, impact.spring(stiffness=1e6))
    return {
        "modal": greens, "poles": impact.PoleGreens.from_modal(greens),
        "samples": impact.SampledGreens(np.zeros(many), 1e-6, "zero"), "sum": impact.SumGreens((greens,) * 20),
        "multiple": impact.ScaledGreens(impact.ScaledGreens(greens, 2.0), 2.0),
        "half-space": impact.half_space_patch(young=2e11, poisson=0.3, density=7850.0, radius=1e-3),
        "residual": greens.residual, "kernel": greens.step_kernel(1e-6, 10), "ball": ball, "reed": reed,
        "state": reed.state, "load": impact.Load(np.ones(many), np.zeros_like), "contact": contacts[0],
        "problem": problem, "problem of many": impact.ContactProblem(ball, contacts=contacts), "result": result,
        "energy": result.energy, "prepared": prepared, "stepper": stepper, "step": stepper.step(),
        "batch": impact.solve_many(single, dt=1e-6, duration=1e-4, velocities=np.linspace(-2, -1, 40), record="force"),
        "series": impact.TimeSeries(np.arange(many, dtype=float), np.zeros(many)),
        "passivity": impact.passivity(impact.spring(stiffness=1.0), 1e-6, 100), "model": model,
        "port": model.ports["contact"], "modes": seatfem.solve_modes(model, 20),
        "reduction": seatfem.reduce_model(model, bandwidth=1e5, duration=1e-5, tolerance=0.05),
        "store": seatfem.Store(Path("folder")),
    }  # fmt: skip


@pytest.mark.slow
def test_it_prints_in_a_few_lines() -> None:
    for name, thing in examples().items():
        for text in (str(thing), repr(thing)):
            assert len(text) <= LARGEST, name
            assert len(text.splitlines()) <= LINES, name
            assert "array([" not in text, name
            assert max(map(len, text.splitlines())) <= 700, name


@pytest.mark.slow
def test_what_is_printed_says_what_it_is() -> None:
    """A text names what one would ask first: ports, number and band of modes, errors, masses."""
    things = {name: str(thing) for name, thing in examples().items()}
    for name, words in (
        ("modal", "2 ports left, right"), ("modal", "5000 modes, 159.15 ... 1.5915e+05 Hz"),
        ("modal", "reduction 0.01"), ("modal", "'krylov'"), ("ball", "0.001 kg"), ("ball", "-1 m/s"),
        ("result", "1000 steps of 100 ns"), ("problem of many", "60 contacts"), ("modes", "Modes, 20, "),
        ("model", "200 unknowns, ports: contact"),
    ):  # fmt: skip
        assert words in things[name], name


def test_a_result_says_in_four_lines_what_happened() -> None:
    """Four lines give peak, impulse, contacts and the balance of energy, or that nothing touches."""
    problem = impact.ContactProblem(impact.rigid_mass(mass=1e-3, velocity=-1.0), impact.spring(stiffness=1e7))
    lines = repr(impact.solve(problem, dt=1e-7, duration=1e-4)).splitlines()
    assert re.search(r"99\.\d+ N at 15\.7 us, .*1\.99\d? mN s", lines[1])
    assert re.search(r"once, .*0 s to 31\.[45] us", lines[2])
    assert len(lines) == 4
    away = impact.ContactProblem(impact.rigid_mass(mass=1e-3, velocity=1.0), impact.spring(stiffness=1e7))
    assert "no contact" in repr(impact.solve(away, dt=1e-7, duration=1e-5))
