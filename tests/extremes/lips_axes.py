"""Lips to their ends: arcs, parts across, tilt and offset, against a rigid ring on springs around the lip."""

import math
from functools import cache

import numpy as np
from scipy.integrate import solve_ivp

from impact.greens.base import Array
from tests.extremes.cell import Cell, Finding, swept
from tests.extremes.plates_axes import DENSITY, POISSON, YOUNG
from tests.extremes.scene_run import Known, SceneRun, judge, run_text, same
from tests.extremes.scene_text import Table, material, run_table, scene_text, si

OUTER, INNER, THICKNESS, SPEED = 10e-3, 5e-3, 4e-3, 0.2
RADIUS, LAW = 7.5e-3, 1e6  # of the lip; of the law of contact, 500 times as soft as seat and ring
MASS = DENSITY * math.pi * (OUTER**2 - INNER**2) * THICKNESS
TURNING = MASS * ((OUTER**2 + INNER**2) / 4 + THICKNESS**2 / 12)
WATCHED, LONGEST, WIDTH = 5e-4, 2e-3, 5e-6
QUIET = 1.2e-4  # s without contact, in the middle of which a run may end: nothing is cut
RIGID = 1e-2  # of the blow: what seat and ring give way beside the law, and the means over each arc
ARCS, AROUND, ACROSS = 16, 256, 8  # segments of the lip in the scene, and springs in their place


def lip_cells() -> tuple[Cell, ...]:
    """Return cells of arcs around a lip, parts across it, tilt, its axis, offset."""
    return (
        *swept("arcs of a lip", [1, 2, 3, 4, 8, 16, 64, 128, 256, 100_000], lambda n: flat(ports=int(n))),
        *swept("parts across a lip", [1, 2, 3, 4, 8, 16, 64, 100_000], lambda n: flat(rings=int(n))),
        *swept("tilt, deg", [0.0, *(10.0**k for k in (-8, -5, -3, -2, -1.5, -1, -0.5, 0, 0.5, 1, 1.5))], tilted),
        *swept("tilt axis, deg", [0.0, 1e-6, 0.1, 11.25, 45.0, 123.0, 359.0, 720.0], turned),
        *swept("offset of a lip / its radius", [0.0, 1e-6, 1e-3, 0.01, 0.03, 0.1, 0.3, 1.0], beside),
    )


def flat(*, ports: int | None = None, rings: int | None = None) -> Finding:
    """A ring flat on its lip, however divided, has m v (1 + e), e = 1 of a law without loss, and half a swing.

    A step holds the force of its end: of a ramp over n steps 1/n too much, which the error bars know.
    """
    keys = {"ports": ports, "rings": rings}
    run = run_text(landing(**{key: value for key, value in keys.items() if value is not None}))
    omega = math.sqrt(LAW / MASS)
    rebound = 1 + run.number("restitution")
    return judge(
        run,
        Known("landing_impulse_Ns", 2 * MASS * SPEED, RIGID),
        Known("landing_impulse_Ns", MASS * SPEED * rebound, 1e-3, run.bar("restitution") * MASS * SPEED),
        Known("landing_duration_s", math.pi / omega, RIGID, barred=False),
        Known("landing_filtered_peak_force_N", MASS * SPEED * omega, RIGID, barred=False),
        Known("energy_residual", 0.0, 1e-9),
    )


def tilted(angle: float) -> Finding:
    """A tilted ring has impulse and peak of a rigid one on 16 springs, by another integration."""
    return on_springs(tilt=math.radians(angle))


def beside(share: float) -> Finding:
    """The same ring beside its centre turns as it is pressed back."""
    return on_springs(offset=share * RADIUS)


def on_springs(*, tilt: float = 0.0, offset: float = 0.0) -> Finding:
    """Return impulse and peak force of a rigid ring on 16 springs, each of which presses while it is shortened."""
    middle = 90.0 - 180.0 / ARCS  # deg: an axis about which the lowest place is the middle of an arc
    watched, impulse, peak = rigid_ring(tilt, math.radians(middle), offset)
    run = run_text(
        landing(
            watched,
            ports=ARCS,
            tilt=si(math.degrees(tilt), "deg"),
            tilt_axis=si(middle, "deg"),
            offset=[si(offset, "m"), "0 m"],
        )
    )
    return judge(
        run,
        Known("impulse_Ns", impulse, RIGID),
        Known("filtered_peak_force_N", peak, 2 * RIGID),
        Known("energy_residual", 0.0, 1e-9),
    )


def rigid_ring(tilt: float, axis: float, offset: float) -> tuple[float, float, float]:
    """Return a time without contact [s], and the impulse [N s] and largest mean force [N] of the ring until then.

    The law is spread over the whole face of the lip, by `AROUND` times `ACROSS` springs of equal areas.
    """
    angle = 2 * np.pi * (np.arange(AROUND) + 0.5) / AROUND
    inner, outer = RADIUS - 5e-4, RADIUS + 5e-4
    radius = np.sqrt(inner**2 + (outer**2 - inner**2) * (np.arange(ACROSS) + 0.5) / ACROSS)
    x, y = (offset + np.outer(np.cos(angle), radius)).ravel(), np.outer(np.sin(angle), radius).ravel()
    height = math.tan(tilt) * (x * math.sin(axis) - y * math.cos(axis))
    gap = 1e-6 + height - height.min()

    def forces(state: Array) -> Array:
        opening = gap + state[0] + state[1] * y + state[2] * x
        return np.asarray(LAW / (AROUND * ACROSS) * np.maximum(-opening, 0.0))

    def rate(_: float, state: Array) -> list[float]:
        n = forces(state)
        return [state[3], state[4], state[5], n.sum() / MASS, float(n @ y) / TURNING, float(n @ x) / TURNING]

    times = np.linspace(0.0, LONGEST, 20_001)
    solution = solve_ivp(
        rate, (0.0, LONGEST), [0.0, 0.0, 0.0, -SPEED, 0.0, 0.0], t_eval=times, rtol=1e-8, atol=1e-14, max_step=1e-6
    )
    total = np.array([forces(state).sum() for state in solution.y.T])
    width, quiet = (round(span / (times[1] - times[0])) for span in (WIDTH, QUIET))
    mean, calm = (np.convolve(total, np.ones(count) / count, "same") for count in (width, quiet))
    last = int(np.flatnonzero((calm < 1e-9 * mean.max()) & (times > WATCHED / 2) & (np.cumsum(total) > 0))[0])
    return float(times[last]), float(np.trapezoid(total[:last], times[:last])), float(mean[:last].max())


def turned(axis: float) -> Finding:
    """Ring and lip are round: about whatever axis it is tilted, all measures are those of 0 deg."""
    run, exact = _about(axis), _about(0.0)
    keys = ("impulse_Ns", "filtered_peak_force_N", "max_seat_displacement_m")
    return judge(run, *same(run, exact, *keys, theory=1e-3))


@cache
def _about(axis: float) -> SceneRun:
    return run_text(landing(ports=ARCS, tilt="0.05 deg", tilt_axis=si(axis, "deg")))


def landing(watched: float = WATCHED, **contact: object) -> str:
    """Return the scene of a thick steel ring that lands through a soft law on a lip of steel."""
    seat: Table = {
        "kind": "annular", "bore_radius": si(RADIUS - 5e-4, "m"), "lip_width": "1 mm", "lip_edge_radius": "0 mm",
        "outer_radius": "10 mm", "thickness": "6 mm", "material": material(YOUNG, DENSITY, POISSON),
        "mesh": {"size": "1.5 mm", "contact_size": "0.6 mm"},
    }  # fmt: skip
    reed: Table = {
        "kind": "ring_plate", "outer_diameter": si(2 * OUTER, "m"), "inner_diameter": si(2 * INNER, "m"),
        "thickness": si(THICKNESS, "m"), "material": material(YOUNG, DENSITY, POISSON), "velocity": si(-SPEED, "m/s"),
        "greens": {"bandwidth": "50 kHz"},
    }  # fmt: skip
    law = {"kind": "spring", "stiffness": si(LAW, "N/m")}
    return scene_text(
        seat=seat,
        reed=reed,
        contact={"gap": "1 um", "law": law, **contact},  # type: ignore[dict-item]
        run=run_table(watched, WIDTH),
        accuracy={"target": "2 %"},
    )
