"""The case of Table 1: a steel reed strikes a thin rod, once as a spring K = EA/l, once with the rod's waves.

Equation and figure numbers are the article's own ("Analysis of impact force in compressor valves").
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import impact
from impact import measures
from impact.after.result import ImpactResult
from impact.bodies.loads import ReedLoad
from impact.exact.closed_form import DampedFixedRod
from impact.greens.base import GreensFunction

YOUNG, DENSITY = 200e9, 7850.0  # both bodies [Pa, kg/m^3]
ROD_DAMPING = 0.10
# The table prints a rod "thickness" of 4.17e-7 m beside a width of 10 mm: a strip that thin, an area in m^2, or a slip
# of the exponent and a sheet of 0.417 mm.
AREAS = {"strip": 4.17e-9, "area": 4.17e-7, "sheet": 4.17e-6}
LENGTHS = (3e-3, 30e-3)
TIME_STEP, DURATION, FILTER_WIDTH = 25e-9, 3e-3, 1e-6
MODES = 40  # of the reed; with 80 the filtered peaks change by less than 0.2 %


@dataclass(frozen=True)
class Case:
    """One reading of Table 1 and one rod length [m]; ``reading`` is a key of `AREAS`."""

    reading: str
    length: float

    @property
    def area(self) -> float:
        """A [m^2]."""
        return AREAS[self.reading]

    @property
    def stiffness(self) -> float:
        """K = EA/l [N/m]."""
        return YOUNG * self.area / self.length

    @property
    def impedance(self) -> float:
        """Z = A sqrt(E rho) [N s/m]."""
        return self.area * math.sqrt(YOUNG * DENSITY)

    @property
    def rod(self) -> DampedFixedRod:
        """The rod with its waves, every mode damped by 10 %."""
        rod = impact.fixed_rod(
            young=YOUNG, density=DENSITY, area=self.area, length=self.length, damping_ratio=ROD_DAMPING
        )
        assert isinstance(rod, DampedFixedRod)
        return rod


CASES = tuple(Case(reading, length) for reading in ("strip", "area") for length in LENGTHS)
SHEETS = tuple(Case("sheet", length) for length in LENGTHS)  # in the table beside the others, not in the pictures


@dataclass(frozen=True)
class Numbers:
    """What one run leaves: largest force of a step, of a mean over the filter width [N], impulse of the run [N s]."""

    peak: float
    filtered_peak: float
    impulse: float

    @staticmethod
    def of(result: ImpactResult, filter_width: float = FILTER_WIDTH) -> Numbers:
        """Read off a result."""
        return Numbers(
            measures.peak_force(result), measures.filtered_peak_force(result, filter_width), measures.impulse(result)
        )


def table_1_reed(n_modes: int = MODES, loads: Sequence[ReedLoad] = ()) -> impact.Body:
    """The reed of (1) by its damped modes, as in (2), let go from its static shape: y(L, 0) = 1 mm, y'(x, 0) = 0."""
    return impact.cantilever_reed(
        young=YOUNG,
        density=DENSITY,
        length=25.4e-3,
        width=10e-3,
        thickness=0.305e-3,
        damping_ratio=0.03,
        n_modes=n_modes,
        tip_deflection=1e-3,
        loads=loads,
    )


def strike(
    seat: GreensFunction, *, dt: float = TIME_STEP, duration: float = DURATION, n_modes: int = MODES
) -> ImpactResult:
    """The reed on any seat: (2) and (9) with u(l, t) = y(x*, t) and -F = N while they touch."""
    problem = impact.ContactProblem(table_1_reed(n_modes), impact.Body(seat))
    return impact.solve(problem, dt=dt, duration=duration)


def strike_spring(
    stiffness: float, *, dt: float = TIME_STEP, duration: float = DURATION, n_modes: int = MODES
) -> ImpactResult:
    """The reed on a constant stiffness [N/m], equation (3): N = K (h - y) while y < h, here h = 0."""
    return strike(impact.spring(stiffness=stiffness), dt=dt, duration=duration, n_modes=n_modes)


def over_estimates(wave: Numbers, spring: Numbers) -> tuple[float, float, float]:
    """spring/wave - 1 of peak, filtered peak and impulse; > 0 where the constant stiffness over-estimates."""
    return (
        spring.peak / wave.peak - 1,
        spring.filtered_peak / wave.filtered_peak - 1,
        spring.impulse / wave.impulse - 1,
    )


def comparison(case: Case, wave: ImpactResult, spring: ImpactResult) -> dict[str, object]:
    """One row of the table: the case, both answers, the spring's error, units in the keys."""
    ours, theirs = Numbers.of(wave), Numbers.of(spring)
    peak, filtered, total = over_estimates(ours, theirs)
    return {
        "reading": case.reading,
        "length_mm": round(1e3 * case.length, 9),
        "area_m2": case.area,
        "stiffness_N_per_m": round(case.stiffness, 6),
        "wave_peak_N": ours.peak,
        "spring_peak_N": theirs.peak,
        "peak_error_percent": 100 * peak,
        "wave_filtered_peak_N": ours.filtered_peak,
        "spring_filtered_peak_N": theirs.filtered_peak,
        "filtered_peak_error_percent": 100 * filtered,
        "wave_impulse_Ns": ours.impulse,
        "spring_impulse_Ns": theirs.impulse,
        "impulse_error_percent": 100 * total,
        "first_contact_s": float(measures.contact_groups(wave)[0, 0]),
    }


def markdown(rows: Sequence[Mapping[str, object]]) -> str:
    """The rows of `comparison` as a table for people."""
    head = (
        "| reading | rod | K [N/m] | peak [N] wave / K | | mean over 1 µs [N] wave / K | | impulse [mN s] wave / K | |"
    )
    lines = [head, "|---|---|---|---|---|---|---|---|---|"]
    for row in rows:
        v = {k: float(str(x)) for k, x in row.items() if k != "reading"}
        lines.append(
            f"| {row['reading']} | {v['length_mm']:g} mm | {v['stiffness_N_per_m']:.3g} "
            f"| {v['wave_peak_N']:.3g} / {v['spring_peak_N']:.3g} | {v['peak_error_percent']:+.1f} % "
            f"| {v['wave_filtered_peak_N']:.4g} / {v['spring_filtered_peak_N']:.4g} "
            f"| {v['filtered_peak_error_percent']:+.1f} % "
            f"| {1e3 * v['wave_impulse_Ns']:.4f} / {1e3 * v['spring_impulse_Ns']:.4f} "
            f"| {v['impulse_error_percent']:+.2f} % |"
        )
    return "\n".join(lines) + "\n"
