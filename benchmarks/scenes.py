"""The problems that the benchmarks march."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

import impact

DT = 1e-6
SLEEVE: Final = Path(__file__).parents[1] / "examples" / "flapper_on_peek_sleeve.toml"


def modal_seat(modes: int, ports: int = 1) -> impact.ModalGreens:
    """Random modes between 1 kHz and 80 kHz, 1 % damping, a passive exponential residual."""
    rng = np.random.default_rng(modes)
    omega = np.sort(rng.uniform(6e3, 5e5, modes))
    residual = impact.Residual.exponential(1e-8 * np.eye(ports), 1e-3 * np.eye(ports))
    names = tuple(str(k) for k in range(ports))
    return impact.ModalGreens(omega, np.full(modes, 0.01), rng.normal(size=(modes, ports)), residual, names)


def throw(poles: int) -> impact.ContactProblem:
    """A rigid mass on a modal seat: ``poles`` poles in all."""
    striker = impact.rigid_mass(mass=0.01, velocity=-1.0)
    return impact.ContactProblem(striker, impact.Body(modal_seat(poles - 2)), law=impact.Hertz(stiffness=1e9), gap=1e-4)


def throw_on_ports(poles: int, ports: int) -> impact.ContactProblem:
    """A rigid mass that meets one seat at several ports."""
    seat = impact.Body(modal_seat(poles - 1 - ports, ports))
    contacts = [impact.Contact(seat, port=k, gap=1e-4, law=impact.Hertz(stiffness=1e9)) for k in range(ports)]
    return impact.ContactProblem(impact.rigid_mass(mass=0.01, velocity=-1.0), contacts=contacts)


def throw_on_rod(steps_per_pass: int = 1000) -> impact.ContactProblem:
    """A rigid mass on an undamped rod, which has no poles: exact step weights."""
    rod = impact.fixed_rod(young=2e11, density=7850.0, area=1e-4, length=5047.5 * DT * steps_per_pass)
    return impact.ContactProblem(impact.rigid_mass(mass=0.01, velocity=-1.0), impact.Body(rod))
