"""Whole scenes at the extremes, from the TOML file to summary.json: rod and spring seats in closed form."""

import math
from collections.abc import Mapping

from tests.extremes import scenes
from tests.extremes.cell import Cell, Finding, chosen, swept
from tests.extremes.scene_run import Known, SceneRun, judge, run_text
from tests.extremes.scene_text import Table, material, run_table, scene_text, si

YOUNG, DENSITY = 2e11, 8000.0  # waves at 5000 m/s
SPEED = math.sqrt(YOUNG / DENSITY)
SIZES = {"1 nm": 1e-9, "1 um": 1e-6, "1 mm": 1e-3, "1 m": 1.0, "1 km": 1e3}


def scene_file_cells() -> tuple[Cell, ...]:
    """Return sizes, speeds, stiffnesses, durations, gaps and steps of scenes."""
    speeds = [10.0**k for k in (-13, -12, -9, -6, -3, 0, 3, 5, 6)]
    return (
        *chosen("scene file, rod of length", rod_of_size, tuple(SIZES)),
        *chosen("scene file, reed of length", reed_of_size, tuple(SIZES)),
        *swept("scene file, impact speed, m/s", speeds, rod_at_speed),
        *swept("scene file, stiffness of the seat, N/m", [10.0**k for k in (-13, -12, -6, 0, 6, 12, 15)], on_spring),
        *swept("scene file, duration / half swing", [10.0**k for k in (-3, -2, -1, 0, 1, 2, 3, 5, 8)], watched),
        *swept("scene file, gap / way flown", [0.0, *(10.0**k for k in (-8, -6, -3, 0, 3, 6, 8))], flown),
        *swept("scene file, time step / transit", [10.0**k for k in (-7, -5, -4, -3, -2, -1, 0, 1, 2)], stepped),
    )


def rod_of_size(size: str) -> Finding:
    """A mass strikes a rod of its own weight, all in proportion: impulse m v (1 + 2 exp(-1 - exp(-2)/2))."""
    length = SIZES[size]
    mass, transit = DENSITY * length**3, length / SPEED
    result = _rod(1.0, length, duration=4 * transit, width=transit / 10)
    return _against(result, {"impulse_Ns": mass * scenes.FIRST_BLOW, "seat_static_stiffness_N_per_m": YOUNG * length})


def reed_of_size(size: str) -> Finding:
    """A reed and its seat are in proportion to one of 10 mm: times go like the length, forces like its square.

    Step and modes are stated: both are the same march, whatever its error bar.
    """
    scale = SIZES[size] / 0.01
    ours, exact = _reed(SIZES[size]), _reed(0.01)
    return _against(
        ours,
        {
            "impulse_Ns": exact.number("impulse_Ns") * scale**3,
            "filtered_peak_force_N": exact.number("filtered_peak_force_N") * scale**2,
        },
        stated=1e-6,
        barred=False,
    )


def rod_at_speed(speed: float) -> Finding:
    """The same rod is 1 m long: the impulse is proportional to the speed."""
    result = _rod(speed, duration=0.8e-3, width=0.02e-3)
    return _against(result, {"impulse_Ns": DENSITY * speed * scenes.FIRST_BLOW})


def on_spring(stiffness: float) -> Finding:
    """A mass of 1 kg strikes a spring: half a swing pi sqrt(m/k), impulse 2 m v, peak v sqrt(k m)."""
    half = math.pi / math.sqrt(stiffness)
    result = _spring(stiffness, 1.2 * half, half / 100)
    return _against(
        result, {"impulse_Ns": 2.0, "peak_force_N": math.sqrt(stiffness), "contact_duration_s": half}, stated=1e-2
    )


def watched(share: float) -> Finding:
    """The mass on a spring is watched for a part of its half swing, or long after: 1 - cos(w t), then 2.

    A step holds the force of its end: of a ramp over 200 steps, 1/200 too much.
    """
    half = 1e-3
    stiffness = (math.pi / half) ** 2
    result = _spring(stiffness, share * half, half / 100)
    seen = 2 * math.sin(math.pi / 2 * min(share, 1.0)) ** 2
    return _against(result, {"impulse_Ns": seen}, stated=6e-3)


def flown(gap: float) -> Finding:
    """The mass flies 0.01 m and swings back in the run's time; a wider gap is not crossed: no contact, no force."""
    half, way = 1e-3, 0.01
    result = _spring((math.pi / half) ** 2, way + 1.5 * half, half / 100, gap=gap * way)
    return _against(result, {"impulse_Ns": 2.0 if gap <= 1.0 else 0.0}, stated=5e-3)


def stepped(share: float) -> Finding:
    """A time step stated in the file, in transits of the rod, is right, advised, or refused."""
    transit = 1.0 / SPEED
    duration, width = max(4.0, 8 * share) * transit, max(0.1, 4 * share) * transit
    result = _rod(1.0, duration=duration, width=width, step=share * transit)
    return _against(result, {"impulse_Ns": DENSITY * scenes.FIRST_BLOW}, stated=max(1e-4, min(share / 10, 1e-2)))


def _rod(speed: float, length: float = 1.0, *, duration: float, width: float, step: float | None = None) -> SceneRun:
    """Return a rod, as thick as it is long, struck by its own mass."""
    size = {"length": si(length, "m"), "area": si(length**2, "m^2")}
    seat = {"kind": "rod", "young": si(YOUNG, "Pa"), "density": si(DENSITY, "kg/m^3"), **size}
    return _run(seat, _ball(DENSITY * length**3, speed), run_table(duration, width, step))


def _reed(length: float) -> SceneRun:
    time = length / 0.01 * 1e-3
    size = {"length": si(length, "m"), "width": si(length / 4, "m"), "thickness": si(length / 40, "m")}
    start = {"n_modes": 8, "damping_ratio": 0.03, "release": {"tip_deflection": si(length / 20, "m")}}
    reed = {"kind": "cantilever", **size, "material": material(YOUNG, DENSITY), **start}
    seat = {"kind": "spring", "stiffness": si(length / 0.01 * 1e6, "N/m")}
    return _run(seat, reed, run_table(time, time / 100, time / 6400))


def _spring(stiffness: float, duration: float, width: float, gap: float = 0.0) -> SceneRun:
    seat = {"kind": "spring", "stiffness": si(stiffness, "N/m")}
    return _run(seat, _ball(1.0, 1.0), run_table(duration, width), contact={"gap": si(gap, "m")})


def _ball(mass: float, speed: float) -> Table:
    return {"kind": "rigid_mass", "mass": si(mass, "kg"), "velocity": si(-speed, "m/s")}


def _run(seat: Table, reed: Table, run: Table, **more: Table) -> SceneRun:
    """Return what a run leaves, pictures included."""
    return run_text(scene_text(seat=seat, reed=reed, run=run, **more), pictures=True)


def _against(run: SceneRun, exact: Mapping[str, float], stated: float = 1e-4, *, barred: bool = True) -> Finding:
    """Return the worst of the measures; ``stated``: what theory and step leave beside the error bars that count."""
    numbers = (Known(key, value, stated, barred=barred) for key, value in exact.items())
    return judge(run, *numbers, note=" and ".join(exact))
