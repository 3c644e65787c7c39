"""Tables of small scenes, a scene of some of them, and files that scenes of bodies name."""

import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from seatfem.study.scene import Scene, load
from tests import gallery
from tests.steps import Limits, Plan, Round, Stopwatch, rounds, silent

STEEL = 'material = { young = "200 GPa", poisson = 0.3, density = "7850 kg/m^3" }'
ANNULAR = f"""
seat = {{ kind = "annular", bore_radius = "4 mm", lip_width = "1 mm", damping_ratio = 0.05, {STEEL} }}
"""
BAR = f"""
seat = {{ kind = "bar", length = "40 mm", width = "4 mm", height = "4 mm", damping_ratio = 0.02, {STEEL} }}
"""
PLATE = f"""
seat = {{ kind = "plate", ports = 4, port_radius = "3 mm", pitch = "10 mm", margin = "5 mm", thickness = "3 mm", \
    land_width = "1 mm", clamp_width = "2 mm", damping_ratio = 0.02, {STEEL} }}
"""
TWO_PORTS = f"""
seat = {{ kind = "plate", ports = 2, layout = "row", port_radius = "4 mm", pitch = "12 mm", margin = "6 mm", \
    thickness = "6 mm", land_width = "1 mm", clamp_width = "2 mm", damping_ratio = 0.02, model = "3d", \
    mesh = {{ size = "4 mm", contact_size = "2 mm" }}, {STEEL} }}
reed = {{ kind = "flapper", root_width = "12 mm", taper_length = "3 mm", neck_width = "10 mm", neck_length = "20 mm", \
    paddle_diameter = "24 mm", thickness = "0.2 mm", damping_ratio = 0.02, greens = {{ bandwidth = "60 kHz" }}, \
    release = {{ mode = 1, velocity = "-2 m/s" }}, {STEEL} }}
contact = {{ ports = 16, rings = 1 }}
run = {{ duration = "0.1 ms", filter_width = "10 us", time_step = "100 ns" }}
accuracy = {{ target = "1 %", measures = ["impulse"] }}
"""
SPRING = 'seat = { kind = "spring", stiffness = "27.8 N/um" }'
REED = """
reed = { kind = "cantilever", length = "25.4 mm", damping_ratio = 0.03, release = { tip_deflection = "1 mm" } }
run = { duration = "1 ms" }
"""
MASS = """
reed = { kind = "rigid_mass", mass = "5 g", velocity = "-1 m/s" }
run = { duration = "0.1 ms", filter_width = "4 us" }
"""


PRESSED = f"""
[seat]{gallery.BAR}[reed]
{gallery.mass(1, "-0.5 m/s")}[contact]
law = {{ kind = "spring", stiffness = "1e5 N/m" }}
[run]
duration = "330 us"
time_step = "200 ns"
[accuracy]
target = "20 %"
[stress]
distance = "3 mm"
"""
"""A mass on a soft spring presses a bar, which follows it as if at rest; what else is asked of its stress follows."""
PRESSURE = 0.5 * np.sqrt(1e5 * 1e-3) / (2e-3 * 3e-3)
"""The largest in the bar [Pa]: of a mass on a spring; the bar's own gives way by 1e-3 of it."""


def scene_of(*parts: str, **changes: object) -> Scene:
    """Return tables put together; ``changes``: dotted keys with _ for the dot between table and key."""
    data: dict[str, Any] = tomllib.loads("\n".join(parts))
    for dotted, value in changes.items():
        *tables, key = dotted.split("__")
        table = data
        for name in tables:
            table = table.setdefault(name, {})
        table[key] = value
    return load.scene_of().model_validate(data)


def rounds_of(plan: Plan, folder: Path, **limits: Any) -> list[Round]:
    """Return the rounds of a plan, each as it was yielded last; ``limits``: as of `Limits`."""
    every = rounds(plan, folder, Stopwatch(), silent, limits=Limits(**limits))
    return list({done.number: done for done in every}.values())


def write_oscillator(folder: Path, unit: float = 1.0) -> None:
    """Write 20 g on 40 N/um, damped by 5 %, as matrices in ``unit`` of kg and of N/m, and as its receptance."""
    mass, stiffness = 0.02, 4e7
    for name, value in (("m", unit * mass), ("k", unit * stiffness)):
        head = "%%MatrixMarket matrix coordinate real symmetric\n1 1 1\n1 1 "
        (folder / f"{name}.mtx").write_text(f"{head}{value!r}\n", encoding="utf-8")
    (folder / "port.csv").write_text("dof,weight\n1,1\n", encoding="utf-8")
    w = 2 * np.pi * (f := np.arange(50.0, 20e3, 50.0))
    g = 1 / (stiffness - mass * w**2 + 0.1j * np.sqrt(mass * stiffness) * w)
    rows = [f"{a:.17g},{b.real:.17g},{b.imag:.17g}" for a, b in zip(f, g, strict=True)]
    head = "frequency [Hz],receptance real [m/N],receptance imag [m/N]"
    (folder / "frf.csv").write_text("\n".join([head, *rows]) + "\n", encoding="utf-8")
