"""Beams and the paper's reed and rods: frequencies, stiffness, free flight, early response."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from scipy.optimize import brentq

import impact
from impact.beams.euler_bernoulli import Cantilever
from impact.exact.closed_form import ExactRod
from impact.greens.modal import ModalGreens, Residual
from seatfem.verify import Case

_TEXTBOOK = "Blevins, Formulas for Natural Frequency and Mode Shape"
_DUHAMEL = "modal superposition, 5000 modes"
_CLOSED = "closed form"
REED = Cantilever(young=200e9, density=7850.0, length=25.4e-3, width=10e-3, thickness=0.305e-3)
_LIFT = 1e-3  # tip deflection at release [m]
_ROOTS = (1.875104069, 4.694091133, 7.854757438, 10.995540735, 14.137168391, 17.278759532)
_REED_HZ = (385.472, 2415.7118, 6764.0629, 13254.8637, 21911.2395, 32731.5978)
# damping ratio: first contact [s], its closing velocity [m/s]
_FLIGHT = {0.0: (6.3772594e-4, 2.375248), 0.03: (6.5332463e-4, 2.13317)}
# length [m], area [m^2]: Z [N s/m], K [N/m], f1 [Hz], round trip [s]
_ROD = {
    (3e-3, 4.17e-9): (0.16522885, 2.78e5, 420628.721, 1.18869677e-6),
    (3e-3, 4.17e-7): (16.522885, 2.78e7, 420628.721, 1.18869677e-6),
    (30e-3, 4.17e-9): (0.16522885, 2.78e4, 42062.8721, 1.18869677e-5),
    (30e-3, 4.17e-7): (16.522885, 2.78e6, 42062.8721, 1.18869677e-5),
}


def beam_cases() -> tuple[Case, ...]:
    """Beams and the paper's reed and rods: frequencies, stiffness, free flight, early response."""
    roots = lowest("Euler-Bernoulli cantilever", "k_{} L", _ROOTS, 1e-9, _TEXTBOOK, _root)
    frequencies = lowest("paper's reed", "f_{} [Hz]", _REED_HZ, 3e-7, _CLOSED, _reed_hz)
    flights = tuple(case for damping_ratio in _FLIGHT for case in _flight(damping_ratio))
    rods = tuple(case for size in _ROD for case in _paper_rod(*size))
    return (*roots, *frequencies, _reed_stiffness(), *flights, *rods, _tip_kernel(), _infinite_beam_kernel())


def lowest(
    name: str, quantity: str, exact: Sequence[float], rtol: float, source: str, value: Callable[[int, float], float]
) -> tuple[Case, ...]:
    """Return a case for each of the lowest modes; ``value`` takes how many there are below it, and the factor."""
    return tuple(
        Case(name, quantity.format(n + 1), each, rtol, source, partial(value, n)) for n, each in enumerate(exact)
    )


def _root(n: int, factor: float) -> float:
    """Return k L from the frequency of a unit cantilever (EI = rho A = L = 1), its rigidity multiplied."""
    unit = Cantilever(young=12.0 * factor, density=1.0, length=1.0, width=1.0, thickness=1.0)
    return math.sqrt(float(unit.frequencies(n + 1)[n]))


def _reed_hz(n: int, factor: float) -> float:
    return float(replace(REED, young=REED.young * factor).frequencies(n + 1)[n]) / (2 * math.pi)


def _reed_stiffness() -> Case:
    """Return the case of the reed's stiffness from the modes and their residual compliance."""

    def compute(coefficient: float) -> float:
        compliance = _released(0.0, 40, young_factor=coefficient).greens.static_compliance()
        return 1.0 / float(compliance[0, 0])

    return Case("paper's reed", "tip stiffness 3 EI/L^3 [N/m]", 865.701904, 1e-8, _CLOSED, compute)


def _released(damping_ratio: float, n_modes: int, young_factor: float = 1.0) -> impact.Body:
    reed, release = replace(REED, young=REED.young * young_factor), impact.StaticShape(_LIFT)
    return impact.reed(reed, damping_ratio=damping_ratio, n_modes=n_modes, release=release)


def _flight(damping_ratio: float) -> tuple[Case, Case]:
    """Return the cases of free flight from the static shape: a step of tip force, u = F (S(inf) - S(t)), u' = -F
    g(t)."""
    name = f"paper's reed released from 1 mm, damping ratio {damping_ratio:g}"
    time, velocity = _FLIGHT[damping_ratio]

    def first_contact(young_factor: float) -> tuple[float, float]:
        greens = _released(damping_ratio, 5000, young_factor).greens
        static = float(greens.static_compliance()[0, 0])
        zero = brentq(lambda t: static - float(greens.step_response(t)), 0.5e-3, 0.8e-3, xtol=1e-15)
        return float(zero), _LIFT / static * float(greens.impulse_response(zero))

    return (
        Case(name, "first contact [s]", time, 1e-5, _DUHAMEL, lambda k: first_contact(k)[0]),
        Case(name, "closing velocity [m/s]", velocity, 1e-5, _DUHAMEL, lambda k: first_contact(k)[1]),
    )


def _paper_rod(length: float, area: float) -> tuple[Case, ...]:
    name = f"paper's rod, l = {1e3 * length:g} mm, A = {area:g} m^2"

    def case(quantity: str, exact: float, measure: Callable[[ExactRod], float]) -> Case:
        def compute(coefficient: float) -> float:
            rod = impact.fixed_rod(young=200e9 * coefficient, density=7850.0, area=area, length=length)
            return measure(rod)

        return Case(name, quantity, exact, 1e-8, _CLOSED, compute)

    impedance, stiffness, frequency, round_trip = _ROD[length, area]
    return (
        case("impedance Z [N s/m]", impedance, lambda rod: 1.0 / float(rod.initial_value()[0, 0])),
        case("stiffness K [N/m]", stiffness, lambda rod: 1.0 / float(rod.static_compliance()[0, 0])),
        case("f_1 [Hz]", frequency, _first_frequency),
        case("round trip 2 l/c [s]", round_trip, _first_return),
    )


def _first_frequency(rod: ExactRod) -> float:
    """Return the first frequency from the period of g: the undamped rod's step response is zero again."""
    static = float(rod.static_compliance()[0, 0])
    top = brentq(lambda t: float(rod.step_response(t)) - static, 0.0, 1.8 * rod.rod.transit, xtol=1e-20, rtol=1e-12)
    return 1.0 / (4.0 * float(top))


def _first_return(rod: ExactRod) -> float:
    """Return the time where g changes sign, by bisection from transit to three transits."""
    low, high = rod.rod.transit, 3 * rod.rod.transit
    for _ in range(50):
        middle = (low + high) / 2
        low, high = (middle, high) if float(rod.impulse_response(middle)) > 0 else (low, middle)
    return high


def _tip_kernel() -> Case:
    """Return the case of the tip: g before any reflection is that of a semi-infinite beam's end."""

    def compute(coefficient: float) -> float:
        speed = math.sqrt(REED.rigidity / REED.line_density)
        time = 1e-3 * REED.length**2 / speed
        start = 2 * math.sqrt(2 * speed * time / math.pi) / math.sqrt(REED.rigidity * REED.line_density)
        return float(_released(0.0, 4000, coefficient).greens.impulse_response(time)) / start

    quantity = "modal g/2 (2 a t/pi)^(1/2) (EI rho A)^(1/2) at a t/L^2 = 1e-3"
    return Case("cantilever's tip, early", quantity, 1.0, 1e-3, "Laplace transform", compute)


def _infinite_beam_kernel() -> Case:
    """Return the case of the closed form against the modes of a long simply supported beam struck at mid-span."""

    def compute(coefficient: float) -> float:
        k = np.pi * np.arange(1, 8000, 2, dtype=np.float64)
        modes = ModalGreens(k**2, np.zeros(len(k)), np.full((len(k), 1), math.sqrt(2.0)), Residual.none())
        time = 1e-3  # a t/L^2
        beam = impact.infinite_beam(young=coefficient, density=1.0, area=1.0, second_moment=1.0)
        return float(beam.step_response(time)) / float(modes.step_response(time))

    return Case("infinite beam, struck across", "S/modal S of a long beam", 1.0, 1e-3, "modal superposition", compute)
