"""What moves a striker to its ends: valve springs, films, moving bases, balls; each in closed form."""

import math

import numpy as np

from tests.extremes.cell import Cell, Finding, swept
from tests.extremes.plates_axes import DENSITY, POISSON, YOUNG, bounced, swing
from tests.extremes.scene_run import FIRST, Known, judge, run_tables, run_text, same
from tests.extremes.scene_text import Table, csv_text, material, run_table, scene_text, si

MASS, SPEED = 2e-3, 1.0
STIFF = 1e8  # N/m, of seats that springs and gravity press on: the blow is short beside their motion


def moved_cells() -> tuple[Cell, ...]:
    """Return cells of springs, films, bases and balls."""
    return (
        *swept("valve spring, stiffness, N/m", [10.0**k for k in (-6, -3, 0, 2, 3, 4, 5, 6)], lambda k: sprung(k, 6.0)),
        *swept("valve spring, preload, N", [0.0, *(10.0**k for k in (-9, -3, 0, 1, 2, 3, 4, 6))], preloaded),
        *swept(
            "film, viscosity / stopping",
            [10.0**k for k in (-9, -4, -3, -2, -1)] + [0.5, 0.9, 1.5, 10.0, 1e3, 1e6],
            film,
        ),
        *swept("film, floor / gap", [10.0**k for k in (-4, -3, -2, -1, 0, 1, 3, 6)], lambda f: film(0.5, f)),
        *swept("base, amplitude / gap", [1e-3, 0.4, 0.51, 0.6, 1.0, 3.0, 10.0, 1e3], shaken),
        *swept("base, frequency, Hz", [10.0**k for k in (-2, 0, 1, 2, 3, 4, 5)], lambda f: shaken(1.0, f)),
        *swept("base, speed of the seat, m/s", [10.0**k for k in (-9, -6, -3, -1, 0, 1, 2)], carried),
        *swept("base, acceleration of both, m/s^2", [10.0**k for k in (-6, -3, 0, 2, 3, 4, 5)], accelerated),
        *swept("ball, diameter, m", [10.0**k for k in (-6, -5, -4, -3, -1, 0, 1)], lambda d: ball(diameter=d)),
        *swept("ball, Young's modulus, Pa", [10.0**k for k in (5, 7, 9, 11, 13, 14)], lambda e: ball(young=e)),
        *swept("ball, speed, m/s", [10.0**k for k in (-9, -6, -3, 0, 1, 2)], lambda v: ball(speed=v)),
        *swept("ball, facet / diameter", [0.003, 0.01, 0.03, 0.0625, 0.12, 0.3], lambda f: ball(facet=f)),
        *swept("Hertz, speed, m/s", [10.0**k for k in (-9, -6, -4, -2, -1, 0, 1, 2)], hertz),
    )


def preloaded(preload: float) -> Finding:
    """Return the springs' force on the closed reed."""
    return sprung(4e3, preload)


def sprung(stiffness: float, preload: float, *, lift: float = 1e-3) -> Finding:
    """A mass falls under springs from its lift: m v'^2/2 = m v^2/2 + P h + k h^2/2, and when.

    With no preload and a spring that goes to zero: as without one.
    """
    omega, centre = math.sqrt(stiffness / MASS), preload / stiffness + lift  # from the place without force
    landing = math.sqrt(SPEED**2 + (2 * preload * lift + stiffness * lift**2) / MASS)
    fall = preload / MASS + stiffness * lift / MASS  # acceleration at the start
    if stiffness * lift**2 < 1e-3 * MASS * SPEED**2:
        mean = preload / MASS + stiffness * lift / MASS / 2
        time = 2 * lift / (SPEED + math.sqrt(SPEED**2 + 2 * mean * lift))
    else:
        swing_ = math.hypot(centre, SPEED / omega)
        time = (math.acos((centre - lift) / swing_) - math.atan2(SPEED / omega, centre)) / omega
    blow = math.pi / math.sqrt(STIFF / MASS)
    run = run_tables(
        seat={"kind": "spring", "stiffness": si(STIFF, "N/m")},
        reed=_mass(),
        spring=[{"stiffness": si(stiffness, "N/m"), "preload": si(preload, "N")}],
        contact={"gap": si(lift, "m")},
        run=run_table(time + 2 * blow, 1e-6),
        accuracy={"target": "1 %"},
    )
    return judge(
        run,
        Known("landing_closing_speed_m_per_s", landing, 1e-4),
        Known("landing_time_s", time, 1e-3 if fall * time > 1e-3 else 1e-4),
        Known("energy_residual", 0.0, 1e-9),
    )


def film(viscosity: float, floor: float = 0.2) -> Finding:
    """A film on a rigid seat leaves v(g) = v - c/(2 m) (1/(g + f)^2 - 1/(h + f)^2), c = mu l w^3.

    ``viscosity`` is over that which stops the mass as it touches: beyond it, it never lands, and the film takes m v.
    """
    gap, width, length, speed = 5e-6, 1e-3, 35e-3, 0.05
    rough = floor * gap
    stopping = 2 * MASS * speed / (1 / rough**2 - 1 / (gap + rough) ** 2) / (length * width**3)
    keys = {"viscosity": si(viscosity * stopping, "Pa s"), "floor": si(rough, "m"), "width": si(width, "m")}
    run = run_tables(
        seat={"kind": "spring", "stiffness": "1e15 N/m"},
        reed=_mass(speed),
        contact={
            "gap": si(gap, "m"),
            "film": {**keys, "length": si(length, "m")},
            "law": {"kind": "spring", "stiffness": "1e8 N/m"},
        },
        run=run_table(5 * gap / speed, 1e-6),
        accuracy={"target": "1 %"},
    )
    ledger = Known("energy_residual", 0.0, 1e-9)
    if viscosity > 1:
        return judge(run, Known("impulse_Ns", MASS * speed, 1e-3), ledger)
    return judge(run, Known("landing_closing_speed_m_per_s", speed * (1 - viscosity), 1e-3), ledger)


def shaken(amplitude: float, frequency: float = 1e3) -> Finding:
    """The seat rises by A (1 - cos w t) to a reed at rest: when that is the gap, and at what speed, if ever.

    The reed's record has 2,000 points a turn: a spline between them errs by 1e-11.
    """
    gap, turn = 40e-6, 1 / frequency
    omega, rise = 2 * math.pi * frequency, amplitude * gap
    t = np.linspace(0.0, 1.1 * turn, 2201)
    meets = gap <= 2 * rise
    angle = math.acos(1 - gap / rise) if meets else math.pi
    run = run_tables(
        {"base.csv": csv_text("time [s],displacement [m]", t, rise * (1 - np.cos(omega * t)))},
        seat={"kind": "spring", "stiffness": "1e4 N/m"},
        reed=_beam(),
        base=[{"of": "seat", "displacement": "base.csv"}],
        contact={"gap": si(gap, "m")},
        run=run_table(min(angle / omega + 0.15 * turn, turn), 1e-3 * turn),
        accuracy={"target": "1 %"},
    )
    ledger = Known("energy_residual", 0.0, 1e-9)
    if not meets:
        return judge(run, Known("impulse_Ns", 0.0, 1e-12), ledger)
    if not run.summary["landings"]:  # so slow that it presses and does not strike
        return judge(run, Known("first_contact_s", angle / omega, 1e-2), ledger)
    return judge(
        run,
        Known(f"{FIRST}time_s", angle / omega, 1e-3),
        Known(f"{FIRST}closing_speed_m_per_s", rise * omega * math.sin(angle), 5e-3),
        ledger,
    )


def carried(speed: float) -> Finding:
    """A seat that is carried towards a mass strikes it with the sum of both speeds (Galilei)."""
    omega = 1e4
    end = 1.3 * math.pi / omega
    records = {"base.csv": csv_text("time [s],velocity [m/s]", [0.0, 2 * end], [speed, speed])}
    text = bounced(_mass(1e-3), MASS, omega, base=[{"of": "seat", "velocity": "base.csv"}])
    return judge(run_text(text, records), *swing(MASS, 1e-3 + speed, omega))


def accelerated(value: float) -> Finding:
    """Reed and seat on one base that accelerates move as under a gravity of the same size, the other way round."""
    way = {"reed": _beam("1 mm"), "contact": {"gap": "0.1 mm"}, "run": run_table(6e-3, 2e-5)}
    seat: Table = {"kind": "spring", "stiffness": "1e5 N/m"}
    records = {"base.csv": csv_text("time [s],acceleration [m/s^2]", [0.0, 1.0], [value, value])}
    base = [{"of": of, "acceleration": "base.csv"} for of in ("reed", "seat")]
    accuracy = {"target": "2 %"}
    run = run_text(scene_text(seat=seat, base=base, accuracy=accuracy, **way), records)  # type: ignore[arg-type]
    heavy = {**way, "reed": {**_beam("1 mm"), "gravity": si(-value, "m/s^2")}}
    exact = run_text(scene_text(seat=seat, accuracy=accuracy, **heavy))  # type: ignore[arg-type]
    return judge(run, *same(run, exact, "impulse_Ns", "filtered_peak_force_N", theory=1e-6, barred=False))


def ball(*, diameter: float = 0.01, young: float = YOUNG, speed: float = 0.5, facet: float = 0.0625) -> Finding:
    """A ball of finite elements on a soft spring swings as a rigid sphere."""
    mass = DENSITY * math.pi / 6 * diameter**3
    waves = math.sqrt(young / DENSITY) / diameter
    reed: Table = {
        "kind": "ball", "diameter": si(diameter, "m"), "contact_radius": si(facet * diameter, "m"),
        "material": material(young, DENSITY, POISSON), "velocity": si(-speed, "m/s"),
        "greens": {"bandwidth": si(2.0 * waves, "Hz")},
    }  # fmt: skip
    slow = waves * min(facet, 0.1) / 3  # the facet's own compliance, 0.26 (1 - nu^2) slow^2/facet of the spring's: 2e-3
    return judge(run_text(bounced(reed, mass, slow, "2 %")), *swing(mass, speed, slow))


def hertz(speed: float) -> Finding:
    """A rigid ball meets a rigid flat by Hertz' law: k d^2.5/2.5 = m v^2/2, F = k d^1.5, lasting 2.9432 d/v."""
    radius, reduced = 5e-3, YOUNG / (1 - POISSON**2) / 2
    stiffness = 4 / 3 * reduced * math.sqrt(radius)
    depth = (1.25 * MASS * speed**2 / stiffness) ** 0.4
    lasts = 2.943275 * depth / speed
    run = run_tables(
        seat={"kind": "spring", "stiffness": "1e12 N/m"},
        reed=_mass(speed),
        contact={"law": {"kind": "hertz", "stiffness": si(stiffness, "N/m^1.5")}},
        run=run_table(1.3 * lasts, lasts / 100),
        accuracy={"target": "1 %"},
    )
    return judge(
        run,
        Known("landing_impulse_Ns", 2 * MASS * speed, 2e-3),
        Known("landing_filtered_peak_force_N", stiffness * depth**1.5, 2e-3),
        Known("landing_duration_s", lasts, 5e-3),
        Known("energy_residual", 0.0, 1e-9),
    )


def _mass(speed: float = SPEED) -> Table:
    return {"kind": "rigid_mass", "mass": si(MASS, "kg"), "velocity": si(-speed, "m/s")}


def _beam(released: str = "") -> Table:
    """Return a steel reed at rest, or let go."""
    start = {"release": {"tip_deflection": released}} if released else {}
    size = {"length": "25 mm", "width": "10 mm", "thickness": "0.3 mm"}
    return {"kind": "cantilever", **size, "material": material(YOUNG, DENSITY), "damping_ratio": 0.01, **start}
