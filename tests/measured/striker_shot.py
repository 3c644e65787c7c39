"""A pulse that goes to and fro along a bar: dispersion of the waves of the axisymmetric model, and its crests."""

import math
from collections.abc import Mapping
from typing import Any, Final

import numpy as np
import skfem

from impact.greens.base import Array
from seatfem.structures.elements.axisymmetric import assemble_axisymmetric
from seatfem.structures.model import Material
from seatfem.structures.reduction.modes import solve_modes
from seatfem.units import parse_quantity
from seatfem.verify import Estimate

CRESTS: Final = ("first", "second", "third", "fourth")
WAVES: Final = 30
"""Half waves along the bar that stands for all: wave numbers times radius up to 1.5, some 120 kHz here."""
LENGTH: Final = 20 * math.pi  # radii
SAMPLES: Final = 4096  # us
HALF: Final = 4  # us, of the parabola through a crest


def predict(record: Any) -> Mapping[str, Estimate]:
    """Return when the crests come back [us].

    Bars: what a mesh of half the elements changes, and the spread of the modulus.
    """
    own = crests(record, speeds(record, 2))
    coarse, stiffer = crests(record, speeds(record, 1)), crests(record, speeds(record, 2), 1 + _spread(record))
    bars = np.hypot(own - coarse, own - stiffer)
    return {f"{name} crest that comes back": Estimate(own[k], bars[k]) for k, name in enumerate(CRESTS)}


def speeds(record: Any, elements: int) -> Array:
    """Return (WAVES + 1, 2) wave number times radius, and phase velocity over c_0, of the axisymmetric model of a bar
    whose ends slide: standing waves of k = m pi/length are exact; ``elements`` across its radius."""
    across, along = np.linspace(0.0, 1.0, elements + 1), np.linspace(0.0, LENGTH, round(elements * LENGTH) + 1)
    material = Material(1.0, float(record.geometry["poisson"]), 1.0)
    ends = {"bottom": lambda x: x[1] == 0.0, "top": lambda x: x[1] == along[-1]}
    mesh = skfem.MeshQuad.init_tensor(across, along).with_boundaries(ends)
    model = assemble_axisymmetric(mesh, material, fixed=(), sliding=("bottom", "top"), ports={}, order=2)
    omega = solve_modes(model, WAVES, shift_hz=0.01).omega
    numbers = math.pi / LENGTH * np.arange(1, WAVES + 1)
    return np.column_stack([np.append(0.0, numbers), np.append(1.0, omega / numbers)])


def crests(record: Any, known: Array, modulus: float = 1.0) -> Array:
    """Return when the first four crests come back [us], with the ``known`` phase velocities and so many times the
    modulus that is stated."""
    geometry, pulse = record.geometry, record.data["incident"]
    young, density = parse_quantity(geometry["young"], "pressure"), parse_quantity(geometry["density"], "density")
    radius = parse_quantity(geometry["diameter"], "length") / 2
    distance, plain = 2 * parse_quantity(geometry["distance"], "length"), math.sqrt(modulus * young / density)
    strain = np.zeros(SAMPLES)
    strain[: len(pulse["microstrain"])] = -np.array(pulse["microstrain"], dtype=float)
    omega = 2 * math.pi * np.fft.rfftfreq(SAMPLES, 1e-6)
    numbers = known[:, 0] / radius
    wave = np.interp(omega, plain * known[:, 1] * numbers, numbers)
    wave = np.maximum(wave, omega / (plain * known[0, 1]))  # beyond what is known nothing is sent: no wave is faster
    back = np.fft.irfft(np.fft.rfft(strain) * np.exp(-1j * wave * distance), SAMPLES)
    time = pulse["first_us"] + np.arange(SAMPLES, dtype=float)
    after = (time > time[0] + 1e6 * distance / plain + 30) & (time < time[0] + 1e6 * distance / plain + 90)
    top = np.flatnonzero(after & (back >= np.roll(back, 1)) & (back > np.roll(back, -1)))
    return np.array([_top(time, back, int(k)) for k in top[: len(CRESTS)]])


def _top(time: Array, values: Array, k: int) -> float:
    """Return the top of the parabola through the neighbours of a crest."""
    near = slice(k - HALF, k + HALF + 1)
    bend, slope, _ = np.polyfit(time[near] - time[k], values[near], 2)
    return float(time[k] - slope / (2 * bend))


def _spread(record: Any) -> float:
    return float(record.geometry["spread_of_young"])
