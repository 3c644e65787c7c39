"""What comes after the blow, to its ends: stress, life, gas and measured seats."""

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from scipy.optimize import brentq

import impact
from impact.storage.hdf5 import save_greens
from tests.extremes.cell import Cell, Finding, swept
from tests.extremes.plates_axes import DENSITY, YOUNG
from tests.extremes.scene_run import Known, SceneRun, judge, run_tables, run_text, same
from tests.extremes.scene_text import Table, csv_text, material, run_table, scene_text, si

LENGTH, THICKNESS, BENT = 25e-3, 0.3e-3, 0.5e-3  # of a reed, and its deflection at the start
ROOT = 1.8751040687  # first root of cos(x) cosh(x) = -1
FREQUENCY = (ROOT / LENGTH) ** 2 * THICKNESS * math.sqrt(YOUNG / 12 / DENSITY) / (2 * math.pi)
AMPLITUDE = YOUNG * THICKNESS / 2 * (ROOT / LENGTH) ** 2 * BENT  # of the stress at the root of that mode [Pa]
ULTIMATE, KNEE, SLOPE, CYCLES = 1800e6, 400e6, 12.0, 1e7
HEATS, GAS_CONSTANT, TEMPERATURE = 1.4, 8.314462618, 293.15
PORT = 12e-3  # m, diameter


def lasting_cells() -> tuple[Cell, ...]:
    """Return cells of stress, life, gas and measured seats."""
    return (
        *swept("reed stress, deflection, m", [10.0**k for k in (-12, -9, -6, -4, -3, -2)], reed_stress),
        *swept("seat stress, speed, m/s", [10.0**k for k in (-6, -3, -1, 0, 1, 2)], seat_stress),
        *swept("life, design cycles", [10.0**k for k in (0, 3, 6, 7, 9, 12, 15, 18)], lambda n: life(cycles=n)),
        *swept("life, endurance, Pa", [10.0**k for k in (0, 3, 6, 8, 9, 10)], lambda s: life(knee=s)),
        *swept("life, knee, cycles", [10.0**k for k in (0, 3, 5, 7, 9, 12)], lambda n: life(knee_cycles=n)),
        *swept("life, slope of the S-N curve", [1.0, 3.0, 10.0, 30.0, 100.0, 1000.0], lambda k: life(slope=k)),
        *swept("life, load ratio", [-1.0, -0.9, -0.5, 0.0, 0.5, 0.9, 0.99], load_ratio),
        *swept("gas, cylinder / suction pressure", [0.001, 0.01, 0.1, 0.5, 0.528, 0.6, 0.9, 0.999, 1.0], flow),
        *swept("gas, rpm", [10.0**k for k in (0, 1, 2, 3, 4, 5, 6)], lambda n: compressed(rpm=n)),
        *swept(
            "gas, clearance / swept volume", [10.0**k for k in (-6, -4, -3, -2, -1, 0, 1, 3)], lambda c: compressed(c)
        ),
        *swept("gas, stroke / rod", [1e-4, 0.01, 0.1, 0.5, 1.0, 1.9, 2.0], lambda r: compressed(stroke=r)),
        *swept(
            "frf, noise / signal",
            [0.0, *(10.0**k for k in (-9, -6, -4, -3, -2, -1, 0, 1))],
            lambda n: measured(noise=n),
        ),
        *swept("frf, lines", [2, 5, 10, 30, 100, 300, 3000, 20_000], lambda n: measured(lines=int(n))),
        *swept(
            "frf, band / highest frequency", [0.1, 0.3, 0.6, 0.9, 1.1, 2.0, 10.0, 100.0], lambda b: measured(band=b)
        ),
    )


def reed_stress(bent: float) -> Finding:
    """A reed released from a force at its tip has 3 E h d/(2 l^2) at the root, by the modes of the run.

    In modes this is a sum of terms 4 (-1)^(n + 1)/x_n^2, cos(x) cosh(x) = -1, which is 1 in the end and 0.4 % more
    after seven terms. The run takes the modes that its plan finds enough for impulse and force.
    """
    run = _reed({"tip_deflection": si(bent, "m")}, 0.5 / FREQUENCY, 4 * bent)
    number = np.arange(int(str(run.summary["plan_reed_n_modes"])))
    roots = [brentq(lambda x: math.cos(x) + 1 / math.cosh(x), n * math.pi, (n + 1) * math.pi) for n in number]
    seen = float(np.sum(4 * (-1.0) ** number / np.square(roots)))
    stress = 3 * YOUNG * THICKNESS * bent / (2 * LENGTH**2) * seen
    return judge(run, Known("reed_stress_at_start_Pa", stress, 1e-9), Known("energy_residual", 0.0, 1e-9))


def seat_stress(speed: float) -> Finding:
    """A pillar of Poisson's ratio 0, pressed slowly all over its top, bears the force over the area at its middle."""
    radius, height, mass, stiffness = 2e-3, 4e-3, 5e-3, 2e5
    omega = math.sqrt(stiffness / mass)
    seat: Table = {
        "kind": "stopper", "radius": si(radius, "m"), "thickness": si(height, "m"),
        "contact_radius": si(0.999 * radius, "m"), "material": material(YOUNG, DENSITY, 0.0), "damping_ratio": 0.05,
        "mesh": {"size": "0.4 mm"}, "greens": {"bandwidth": "300 kHz"}, "model": "axisymmetric",
    }  # fmt: skip
    run = run_tables(
        seat=seat,
        reed={"kind": "rigid_mass", "mass": si(mass, "kg"), "velocity": si(-speed, "m/s")},
        contact={"law": {"kind": "spring", "stiffness": si(stiffness, "N/m")}},
        run=run_table(1.1 * math.pi / omega, 1e-6),
        accuracy={"target": "2 %"},
        stress={"points": [["0 m", "0 m", si(height / 2, "m")]], "surface": False, "distance": "0.2 mm"},
    )
    pressure = mass * speed * omega / (math.pi * radius**2)
    return judge(run, Known("peak_seat_stress_Pa", pressure, 1e-2), Known("peak_force_N", mass * speed * omega, 1e-2))


def life(*, cycles: float = 1e9, knee: float = KNEE, knee_cycles: float = CYCLES, slope: float = SLOPE) -> Finding:
    """Three fully reversed swings of the first mode are a block: margin S(3 n)/amplitude on Basquin's line, Haibach's
    2 k - 1 below its knee. Steps meet the ends of every swing: what is left is round-off of the modes."""
    run = _lasting(3.0 / FREQUENCY, cycles, knee, knee_cycles, slope)
    n = 3 * cycles / knee_cycles
    allowed = knee * n ** (-1 / slope if n < 1 else -1 / (2 * slope - 1))
    return judge(run, Known("life_margin", min(allowed, ULTIMATE) / AMPLITUDE, 1e-6, barred=False))


def load_ratio(ratio: float) -> Finding:
    """A part of a swing is the block, closed upon itself: from the amplitude down to its ``ratio``, by Goodman."""
    turned = math.acos(ratio)
    run = _lasting(turned / (2 * math.pi * FREQUENCY), 1e7, KNEE, CYCLES, SLOPE)
    swing, mean = AMPLITUDE * (1 - ratio) / 2, AMPLITUDE * (1 + ratio) / 2
    return judge(run, Known("life_margin", 1 / (swing / KNEE + mean / ULTIMATE), 1e-6, barred=False))


def _lasting(duration: float, cycles: float, knee: float, knee_cycles: float, slope: float) -> SceneRun:
    """Return the run of the first mode alone, far above its seat, whose life is asked for."""
    strength = (
        f'source = "invented for tests"\nultimate = "{ULTIMATE!r} Pa"\n[curve]\nknee_stress = "{knee!r} Pa"\n'
        f"knee_cycles = {knee_cycles!r}\nslope = {slope!r}\n"
    )
    wanted: Table = {"strength": "strength.toml", "cycles": cycles}
    return _reed({"mode": 1, "deflection": si(BENT, "m")}, duration, 4 * BENT, {"strength.toml": strength}, life=wanted)


def _reed(
    release: Mapping[str, object], duration: float, gap: float, files: Mapping[str, str] | None = None, **more: Table
) -> SceneRun:
    """Return the run of a reed in free swing; 1/6000 of its duration a step."""
    size = {"length": si(LENGTH, "m"), "width": "10 mm", "thickness": si(THICKNESS, "m")}
    return run_tables(
        files,
        seat={"kind": "spring", "stiffness": "1e7 N/m"},
        reed={"kind": "cantilever", **size, "material": material(YOUNG, DENSITY), "release": release},
        contact={"gap": si(gap, "m")},
        run=run_table(duration, duration / 1000, duration / 6000),
        accuracy={"target": "1 %"},
        **more,
    )


def flow(ratio: float) -> Finding:
    """A valve of constant area between two constant pressures has the nozzle's flow, choked below 0.528; none without a
    difference.

    It opens at once, but for the first step of the gas: 1/360 of the run.
    """
    area, duration, lift = 30e-6, 2e-3, 0.5e-3
    expanded = max(ratio, (2 / (HEATS + 1)) ** (HEATS / (HEATS - 1)))
    term = expanded ** (2 / HEATS) - expanded ** ((HEATS + 1) / HEATS)
    specific = GAS_CONSTANT / 28.96546e-3
    rate = area * 1e5 * math.sqrt(2 * HEATS / ((HEATS - 1) * specific * TEMPERATURE) * max(term, 0.0))
    table: Table = {"area": [["0 m", si(area, "m^2")], ["1 mm", si(area, "m^2")]], "source": "stated"}
    gas = {"cylinder_pressure": "p.csv", "rpm": 3000, "flow": {"forward": table}}
    run = _valve(gas, duration, lift, {"p.csv": csv_text("time [ms],pressure [Pa]", [0, 10], [1e5 * ratio] * 2)})
    masses = run.summary["gas_mass_forward_kg"]
    total = float(masses[0]) if isinstance(masses, list) else math.nan
    scale = area * 1e5 * duration / 600
    flown = Known("gas_mass_forward_kg", rate * duration, 5e-3, scale=scale, value=total, barred=False)
    return judge(run, flown)


def compressed(clearance: float = 0.05, *, rpm: float = 3000.0, stroke: float = 0.5) -> Finding:
    """Both valves stay shut from the bottom to the top dead centre: p V^k is constant, and no mass is lost."""
    bore, rod = 50e-3, 80e-3
    way = stroke * rod
    dead = clearance * math.pi / 4 * bore**2 * way
    gas: Table = {
        "bore": si(bore, "m"), "stroke": si(way, "m"), "rod": si(rod, "m"), "clearance": si(dead, "m^3"),
        "angle": "180 deg", "rpm": rpm,
    }  # fmt: skip
    run = _valve(gas, 30 / rpm, 0.0, preload=True)
    ratio = 1 + 1 / clearance
    return judge(
        run,
        Known("gas_largest_pressure_Pa", 1e5 * ratio**HEATS, 1e-3),
        Known("gas_mass_residual", 0.0, 1e-9),
        Known("gas_energy_residual", 0.0, 1e-9),
    )


def _valve(
    gas: Table, duration: float, lift: float, files: Mapping[str, str] | None = None, *, preload: bool = False
) -> SceneRun:
    """Return the run of a stiff suction reed on a stiff seat."""
    plenums: Table = {
        "suction": {"pressure": "1 bar", "temperature": si(TEMPERATURE, "K")},
        "discharge": {"pressure": "1e6 bar", "temperature": si(TEMPERATURE, "K")},
    }
    size = {"length": "40 mm", "width": "14 mm", "thickness": "3 mm", "n_modes": 4}
    return run_tables(
        files,
        seat={"kind": "spring", "stiffness": "1e11 N/m"},
        reed={"kind": "cantilever", **size, "material": material(YOUNG, DENSITY), "damping_ratio": 0.05},
        contact={"gap": si(lift, "m"), "preload": preload},
        gas={"valve": "suction", **plenums, "port_diameter": si(PORT, "m"), **gas},
        run=run_table(duration, duration / 100),
        accuracy={"target": "5 %"},
    )


def measured(*, noise: float = 1e-3, lines: int = 600, band: float = 2.0) -> Finding:
    """A mass strikes a seat that a record describes as it does the body that was recorded: three modes and a spring.

    ``noise`` is over the signal's root mean square, ``band`` over the highest frequency.
    """
    body, exact = _body(), _struck('kind = "greens"\nfile = "seat.h5"\n', {"seat.h5": _save})
    f = np.linspace(0, band * 6.1e3, lines + 1)[1:]
    h = body.transfer(2j * np.pi * f)[:, 0, 0]
    draw = np.random.default_rng(7).normal(size=(2, lines))
    h = h + noise * math.sqrt(float(np.mean(np.abs(h) ** 2)) / 2) * (draw[0] + 1j * draw[1])
    head = "frequency [Hz],receptance real [m/N],receptance imag [m/N]"
    record = csv_text(head, f.tolist(), h.real.tolist(), h.imag.tolist())
    run = _struck('kind = "frf"\nfile = "seat.csv"\n', {"seat.csv": record})
    keys = ("landing_impulse_Ns", "landing_filtered_peak_force_N", "seat_static_stiffness_N_per_m")
    return judge(run, *same(run, exact, *keys, theory=1e-3))


def _body() -> impact.ModalGreens:
    """Return three modes of 1.1 to 6.1 kHz and a spring."""
    hertz = np.array([1.1e3, 2.3e3, 6.1e3])
    shapes = (2 * np.pi * hertz * np.array([1.5e-4, 1.1e-4, 7e-5]))[:, None]
    return impact.ModalGreens(2 * np.pi * hertz, np.array([0.03, 0.02, 0.015]), shapes, impact.Residual.spring(2e-9))


def _save(path: Path) -> None:
    save_greens(_body(), path)


def _struck(seat: str, files: Mapping[str, object]) -> SceneRun:
    """Return the run of a mass that strikes through a spring."""
    rest = scene_text(
        reed={"kind": "rigid_mass", "mass": "400 g", "velocity": "-1 m/s"},
        contact={"law": {"kind": "spring", "stiffness": "5e7 N/m"}},
        run=run_table(3e-3, 2e-4),
        accuracy={"target": "2 %"},
    )
    return run_text(f"[seat]\n{seat}{rest}", files)  # type: ignore[arg-type]
