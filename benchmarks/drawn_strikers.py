"""Strikers drawn at random, of every kind that a scene may have, in every way of being moved: text of [reed]."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from drawn_seats import Seat, Write

STEEL: Final = 5047.5  # m/s, sqrt(E/rho) of the reeds
BEAMS: Final = ("cantilever", "clamped_clamped", "timoshenko", "tip_mass", "stepped")
PLATES: Final = ("flapper", "sheet", "ring_plate", "disc")
WAYS: Final[Mapping[str, float]] = {
    "thrown": 0.25, "deflected": 0.25, "pressed": 0.12, "loaded": 0.12, "pushed": 0.1, "valve": 0.16,
}  # fmt: skip
"""How beams are moved, and how often: in a mode with a velocity, let go, let go and pressed on, from rest by a pressure
or by a force, and held shut until a pressure lets go of them."""


@dataclass(frozen=True)
class Striker:
    """A striker.

    Attributes:
        kind, way: of [reed], and how it is moved.
        table: its lines, the head included.
        gap: of [contact] [mm].
        duration: of [run] [ms].
        preload: whether it begins in equilibrium with its loads.
        above: height at its contact at the start [mm].
        in_arcs: whether it is a plate that meets the lip of a seat where that lies.
        stated: whether keys are stated that the loop would choose.
        files: by name, what writes them.
    """

    kind: str
    way: str
    table: str
    gap: float
    duration: float
    preload: bool = False
    above: float = 0.0
    in_arcs: bool = False
    stated: bool = False
    files: Mapping[str, Write] = field(default_factory=dict)


def draw_striker(kind: str, seat: Seat, rng: np.random.Generator, *, stated: bool) -> Striker:
    """A striker of a kind, of a size that suits the seat."""
    if kind in BEAMS:
        return _beam(kind, rng, stated)
    if kind in PLATES:
        return _plate(kind, seat, rng, stated)
    return OTHERS[kind](rng)


def course(head: str, rows: list[tuple[float, float]]) -> Write:
    """What writes a record of two columns."""
    text = "\n".join([head, *(f"{t:.9g},{value:.9g}" for t, value in rows)]) + "\n"
    return lambda path: path.write_text(text, encoding="utf-8") and None


def _beam(kind: str, rng: np.random.Generator, stated: bool) -> Striker:
    length, width = rng.uniform(10, 28), rng.uniform(4, 12)
    thickness = rng.uniform(0.2, 0.6) * (3.0 if kind == "timoshenko" else 1.0)
    tip = 10 ** rng.uniform(-1.3, -0.2) * (0.2 if kind == "clamped_clamped" else 1.0)
    omega = (22.37 if kind == "clamped_clamped" else 3.516) * STEEL / np.sqrt(12) * 1e3 * thickness / length**2
    own = f'length = "{length:.5f} mm"\nwidth = "{width:.5f} mm"\n'
    if kind == "tip_mass":
        share = rng.uniform(0.05, 0.6)
        own += f'tip_mass = "{7850e-6 * share * length * width * thickness:.6g} g"\n'
        omega /= np.sqrt(1 + 4 * share)
    if kind == "stepped":
        wide = width * rng.uniform(1.0, 2.0)
        places = ((0, width), (0.5 * length, width), (0.5 * length, wide), (length, wide))
        own = f'widths = [{", ".join(f"""["{x:.4f} mm", "{w:.4f} mm"]""" for x, w in places)}]\n'
    way = str(rng.choice(list(WAYS), p=list(WAYS.values())))
    quarter = 1e3 * np.pi / 2 / omega  # ms
    stiff = 7850e-9 * thickness * 1e3 * omega**2 * tip  # Pa that opens it by about the deflection of its tip
    press = stiff * 1e-6 * length * width  # N
    moved, gap, above, duration, files = _ways(way, rng, tip, quarter, stiff, press)
    modes = f"n_modes = {rng.integers(6, 50)}\n" if stated else ""
    gravity = f'gravity = "{rng.choice([-9.81, 9.81])} m/s^2"\n' if rng.random() < 0.15 else ""
    text = (
        f'[reed]\nkind = "{kind}"\n{own}thickness = "{thickness:.5f} mm"\n'
        f"damping_ratio = {rng.uniform(0.003, 0.05):.5f}\n{modes}{moved}{gravity}"
    )
    return Striker(kind, way, text, gap, duration, way == "valve", above, stated=stated, files=files)


def _ways(
    way: str, rng: np.random.Generator, tip: float, quarter: float, stiff: float, press: float
) -> tuple[str, float, float, float, Mapping[str, Write]]:
    """Lines, gap [mm], height at the start [mm], duration [ms] and files of a beam that is moved in one of `WAYS`."""
    let_go, late = f'release = {{ tip_deflection = "{tip:.6f} mm" }}\n', quarter * rng.uniform(1.25, 2.0)
    if way == "thrown":
        speed, mode = rng.uniform(0.3, 3), int(rng.integers(1, 3))
        moved = f'release = {{ mode = {mode}, velocity = "-{speed:.4f} m/s" }}\n'
        return moved, rng.uniform(0.3, 10) * 1e-3, 0.0, rng.uniform(0.08, 0.25), {}
    if way == "deflected":
        return let_go, tip * rng.uniform(0, 0.2), tip, late, {}
    if way == "pressed":
        return f'{let_go}pressure = "-{rng.uniform(0.1, 0.5) * stiff:.5g} Pa"\n', 0.1 * tip, tip, late, {}
    if way == "loaded":
        return f'pressure = "-{stiff:.5g} Pa"\n', tip * rng.uniform(0.1, 0.5), 0.0, late, {}
    if way == "pushed":
        return f'point_force = "-{rng.uniform(0.3, 0.8) * press:.5g} N"\n', 0.1 * tip, 0.0, late, {}
    opens, shuts, end = 0.5 * quarter, 1.5 * quarter, 3.5 * quarter
    rows = [(0, -3.0), (0.6 * opens, -3.0), (opens, 1.0), (shuts, 1.0), (1.2 * shuts, -3.0), (end, -3.0)]
    files = {"pressure.csv": course("time [ms],pressure [Pa]", [(t, stiff * p) for t, p in rows])}
    return 'pressure = { file = "pressure.csv" }\n', 0.0, 0.0, end, files


def _plate(kind: str, seat: Seat, rng: np.random.Generator, stated: bool) -> Striker:
    """A plate that touches with a ring of its own, or where the lip of the seat is."""
    radius, width = (seat.radius, seat.width) if seat.radius else (rng.uniform(2.0, 3.5), rng.uniform(0.4, 0.8))
    reach, thickness = radius + width / 2 + rng.uniform(0.5, 2.0), rng.uniform(0.3, 0.8)
    in_arcs = bool(seat.radius) and (not seat.is_ring or rng.random() < 0.7)
    speed = rng.uniform(0.3, 3)
    thrown = f'release = {{ velocity = "-{speed:.4f} m/s" }}\n'
    if kind == "flapper":
        neck = rng.uniform(0.5, 0.9) * reach
        own = (
            f'root_width = "{neck * rng.uniform(1, 1.4):.4f} mm"\ntaper_length = "1.5 mm"\n'
            f'neck_width = "{neck:.4f} mm"\n'
            f'neck_length = "{reach * rng.uniform(1.5, 2.5):.4f} mm"\npaddle_diameter = "{2 * reach:.4f} mm"\n{thrown}'
        )
    elif kind == "sheet":
        end, side = reach * rng.uniform(3.0, 4.0), reach * rng.uniform(1.0, 1.2)
        corners = ((0, -side), (end, -side), (end, side), (0, side))
        outline = ", ".join(f'["{x:.4f} mm", "{y:.4f} mm"]' for x, y in corners)
        root = f'[["0 mm", "{side:.4f} mm"], ["0 mm", "{-side:.4f} mm"]]'
        own = f'outline = [{outline}]\nclamped = {root}\ncontact_at = ["{end - 1.02 * reach:.4f} mm", "0 mm"]\n{thrown}'
    else:
        thickness *= 2
        sizes = f'diameter = "{2 * reach:.4f} mm"\n'
        if kind == "ring_plate":
            inner = max(0.2, radius - width / 2 - rng.uniform(0.5, 1.5))
            sizes = f'outer_diameter = "{2 * reach:.4f} mm"\ninner_diameter = "{2 * inner:.4f} mm"\n'
        own = f'{sizes}velocity = "-{speed:.4f} m/s"\n'
    band = f'greens = {{ bandwidth = "{rng.uniform(60, 120):.2f} kHz" }}\n' if stated else ""
    touches = "" if in_arcs else f'contact_radius = "{radius:.5f} mm"\ncontact_width = "{0.98 * width:.5f} mm"\n'
    extra, pressed = "", kind in ("flapper", "sheet") and rng.random() < 0.3
    if pressed:
        extra = f'pressure = "-{rng.uniform(0.05, 0.3):.4f} bar"\n'
    if kind in ("flapper", "sheet") and in_arcs and rng.random() < 0.2:
        extra += f'curvature = {{ deflection = "{rng.uniform(1, 6):.3f} um" }}\n'
    text = (
        f'[reed]\nkind = "{kind}"\n{own}thickness = "{thickness:.4f} mm"\n'
        f"damping_ratio = {rng.uniform(0.003, 0.03):.5f}\n{touches}{band}{extra}"
    )
    duration = rng.uniform(0.08, 0.15)
    way = "thrown, pressed" if pressed else "thrown"
    return Striker(kind, way, text, rng.uniform(0.3, 3) * 1e-3, duration, in_arcs=in_arcs, stated=stated)


def _mass(rng: np.random.Generator) -> Striker:
    text = (
        f'[reed]\nkind = "rigid_mass"\nmass = "{10 ** rng.uniform(-1, 1):.5f} g"\n'
        f'velocity = "-{10 ** rng.uniform(-0.7, 0.6):.5f} m/s"\n'
    )
    return Striker("rigid_mass", "thrown", text, rng.uniform(0, 5) * 1e-3, rng.uniform(0.06, 0.25))


def _rod(rng: np.random.Generator) -> Striker:
    young, density = rng.uniform(70, 220), rng.uniform(2600, 8000)
    text = f"""[reed]
kind = "rod"
young = "{young:.4f} GPa"
density = "{density:.2f} kg/m^3"
length = "{rng.uniform(5, 30):.5f} mm"
area = "{10 ** rng.uniform(-0.3, 1.3):.5g} mm^2"
damping_ratio = {rng.uniform(0.0, 0.05):.5f}
far_end = "free"
velocity = "-{10 ** rng.uniform(-0.7, 0.5):.5f} m/s"
"""
    return Striker("rod", "thrown", text, rng.uniform(0, 5) * 1e-3, rng.uniform(0.06, 0.15))


def _ball(rng: np.random.Generator) -> Striker:
    """Elastic, with a facet."""
    diameter = rng.uniform(4, 9)
    text = f"""[reed]
kind = "ball"
diameter = "{diameter:.4f} mm"
contact_radius = "{diameter * rng.uniform(0.06, 0.12):.4f} mm"
material = "steel"
damping_ratio = {rng.uniform(0.005, 0.02):.5f}
greens = {{ bandwidth = "{rng.uniform(300, 500):.2f} kHz" }}
velocity = "-{rng.uniform(0.2, 1.5):.5f} m/s"
"""
    return Striker("ball", "thrown", text, rng.uniform(0, 2) * 1e-3, rng.uniform(0.05, 0.12), stated=True)


def _bar(rng: np.random.Generator) -> Striker:
    """A clamped bar of finite elements, let go from a deflection along its axis."""
    length, side, opening = rng.uniform(8, 20), rng.uniform(2, 4), rng.uniform(0.5, 4)
    text = f"""[reed]
kind = "bar"
length = "{length:.4f} mm"
width = "{side:.4f} mm"
height = "{side:.4f} mm"
material = "steel"
damping_ratio = {rng.uniform(0.01, 0.08):.5f}
model = "sector"
mesh = {{ size = "{side * rng.uniform(0.4, 0.6):.4f} mm" }}
greens = {{ bandwidth = "{rng.uniform(150, 300):.2f} kHz", tolerance = {rng.uniform(0.005, 0.02):.5f} }}
deflection = "{opening:.5f} um"
"""
    duration = rng.uniform(1.5, 4) * 2 * length / 5100
    return Striker("bar", "deflected", text, 1e-3 * opening * rng.uniform(0, 0.5), max(duration, 0.012), stated=True)


OTHERS: Final[Mapping[str, Callable[[np.random.Generator], Striker]]] = {
    "rigid_mass": _mass, "rod": _rod, "ball": _ball, "bar": _bar,
}  # fmt: skip
