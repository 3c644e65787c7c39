"""Landings on whole regions of contact, drawn at random: scenes that state no contact, and the same for `points`.

Every one has a plate reed that covers all of what it strikes: the land of one port and of
two ports, a kidney, the lip of the tutorial's assembly; free rings and discs land on one land and on several. Seats are
a hundred times as stiff as steel, so that they are rigid to the other program, and known by their statics.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np
from points.outlines import Flapper, Outline, Ring, Sheet
from points.plate import Material
from points.region_landing import Fall
from points.regions import KidneyLand, Region, RoundLand

SEED, SCENES = 46001, 27
MESHES: Final = Path(__file__).parents[1] / "meshes"
RIGID: Final = """material = { young = "20000 GPa", poisson = 0.3, density = "7850 kg/m^3" }
damping_ratio = 0.02
model = "spring"
mesh = { size = "4 mm", contact_size = "0.7 mm" }
"""
STEEL: Final = Material(206e9, 0.3, 7800.0)
OF_STEEL: Final = 'material = { young = "206 GPa", poisson = 0.3, density = "7800 kg/m^3" }\n'
MM: Final = 1e-3


@dataclass(frozen=True)
class RegionLanding:
    """A scene, and the same landing in the other program's words.

    Attributes:
        kind: what lands on what.
        text: of scene.toml.
        outline, thickness: of the reed [m].
        region: that it strikes, whose centroid lies at the reed's contact.
        fall: how.
    """

    kind: str
    text: str
    outline: Outline
    thickness: float
    region: Region
    fall: Fall


@dataclass(frozen=True)
class Struck:
    """A seat: lines of [seat], its region, and how far that reaches from its centroid along x and in all [mm]."""

    table: str
    region: Region
    reach: float
    across: float


def ports_of(ports: int, rng: np.random.Generator) -> Struck:
    """The land of the only port of a round plate, of two in a row along the reed, or of three on a circle."""
    port, land = rng.uniform(2.0, 4.0) / math.sqrt(ports), rng.uniform(0.6, 1.2)
    pitch = 2 * (port + land) + rng.uniform(0.5, 2.0)
    layout = "row" if ports == 2 else "circle"
    off = {1: 0.0, 2: pitch / 2, 3: pitch / (2 * math.sin(math.pi / 3))}[ports]
    turns = {1: [0.0], 2: [math.pi, 0.0], 3: [0.0, 2 * math.pi / 3, 4 * math.pi / 3]}[ports]
    lands = [
        RoundLand((off * MM * math.cos(turn), off * MM * math.sin(turn)), port * MM, (port + land) * MM)
        for turn in turns
    ]
    table = (
        f'[seat]\nkind = "plate"\nports = {ports}\nlayout = "{layout}"\nport_radius = "{port!r} mm"\n'
        f'pitch = "{pitch!r} mm"\nmargin = "{land + 3!r} mm"\nthickness = "8 mm"\nland_width = "{land!r} mm"\n'
        f'clamp_width = "2 mm"\n{RIGID}'
    )
    return Struck(table, Region(lands), off + port + land, port + land if layout == "row" else off + port + land)


def kidney(rng: np.random.Generator) -> Struck:
    """The lip of meshes/kidney_seat.step."""
    region = Region([KidneyLand(4.5e-3, math.radians(75), 1.2e-3, 2.2e-3)])
    table = f'[seat]\nkind = "cad"\nfile = "{MESHES / "kidney_seat.step"}"\n{RIGID}'
    reach = max(float(np.hypot(*cells.places.reshape(-1, 2).T).max()) for cells in region.cells(96, 8)) / MM + 0.1
    return Struck(table, region, reach, reach)


def tutorial_lip(rng: np.random.Generator) -> Struck:
    """The lip of meshes/assembly_plate.step."""
    table = (
        f'[seat]\nkind = "cad"\nfile = "{MESHES / "assembly_plate.step"}"\ncontact = {{ number = 13 }}\n'
        f'fixed = {{ radius = "2.25 mm", several = true }}\n{RIGID}'
    )
    return Struck(table, Region([RoundLand((0.0, 0.0), 4.0e-3, 5.2e-3)]), 5.2, 5.2)


def flapper(struck: Struck, rng: np.random.Generator) -> tuple[str, Outline, float]:
    """A flapper whose paddle covers the region: lines of [reed] without the start, outline, thickness [m]."""
    paddle = 2 * (struck.reach + rng.uniform(0.4, 1.5))
    neck = paddle * rng.uniform(0.4, 0.8)
    root, length = neck * rng.uniform(1.0, 1.4), paddle * rng.uniform(0.8, 1.4)
    thickness = rng.uniform(0.2, 0.5)
    table = (
        f'[reed]\nkind = "flapper"\nroot_width = "{root!r} mm"\ntaper_length = "2 mm"\nneck_width = "{neck!r} mm"\n'
        f'neck_length = "{length!r} mm"\npaddle_diameter = "{paddle!r} mm"\nthickness = "{thickness!r} mm"\n{OF_STEEL}'
    )
    sizes = (root, 2.0, neck, length, paddle)
    return table, Flapper(*(MM * size for size in sizes)), MM * thickness


def sheet(struck: Struck, rng: np.random.Generator) -> tuple[str, Outline, float]:
    """A rectangle that covers the region; as `flapper`."""
    end, side = struck.reach + rng.uniform(0.4, 1.5), struck.across + rng.uniform(0.4, 1.5)
    at = struck.reach + rng.uniform(0.8, 1.6) * end
    length, thickness = at + end, rng.uniform(0.2, 0.5)
    corners = ((0.0, -side), (length, -side), (length, side), (0.0, side))
    outline = ", ".join(f'["{x!r} mm", "{y!r} mm"]' for x, y in corners)
    table = (
        f'[reed]\nkind = "sheet"\noutline = [{outline}]\n'
        f'clamped = [["0 mm", "{side!r} mm"], ["0 mm", "{-side!r} mm"]]\ncontact_at = ["{at!r} mm", "0 mm"]\n'
        f'thickness = "{thickness!r} mm"\n{OF_STEEL}'
    )
    return table, Sheet(MM * length, 2 * MM * side, MM * at), MM * thickness


def drawn_flapper(struck: Struck, rng: np.random.Generator) -> tuple[str, Outline, float]:
    """The tutorial's flapper as it is drawn, 20 um above the lip; as `flapper`."""
    table = (
        f'[assembly]\nplaced = "as drawn"\n[reed]\nkind = "sheet"\nfile = "{MESHES / "assembly_flapper.step"}"\n'
        f"clamped = {{ number = 1 }}\n{OF_STEEL}"
    )
    neck, paddle, root = 8.0, 15.0, 22.0  # mm, its widths, and from its root to the centre of the lip
    sizes = (neck, 2.0, neck, root - math.sqrt(paddle**2 - neck**2) / 2, paddle)
    return table, Flapper(*(MM * size for size in sizes)), 0.3e-3


def disc(struck: Struck, rng: np.random.Generator) -> tuple[str, Outline, float]:
    """A free disc that covers the region; as `flapper`."""
    outer, thickness = struck.reach + rng.uniform(0.4, 1.5), rng.uniform(0.6, 1.2)
    table = f'[reed]\nkind = "disc"\ndiameter = "{2 * outer!r} mm"\nthickness = "{thickness!r} mm"\n{OF_STEEL}'
    return table, Ring(0.0, MM * outer), MM * thickness


def ring(struck: Struck, rng: np.random.Generator) -> tuple[str, Outline, float]:
    """A free ring that covers one round land; as `flapper`."""
    land = struck.region.lands[0]
    assert isinstance(land, RoundLand)
    outer, thickness = struck.reach + rng.uniform(0.4, 1.5), rng.uniform(0.6, 1.0)
    inner = land.inner / MM * rng.uniform(0.4, 0.85)
    table = (
        f'[reed]\nkind = "ring_plate"\nouter_diameter = "{2 * outer!r} mm"\ninner_diameter = "{2 * inner!r} mm"\n'
        f'thickness = "{thickness!r} mm"\n{OF_STEEL}'
    )
    return table, Ring(MM * inner, MM * outer), MM * thickness


Seats = Callable[[np.random.Generator], Struck]
Reeds = Callable[[Struck, np.random.Generator], tuple[str, Outline, float]]
KINDS: Final[Mapping[str, tuple[Reeds, Seats]]] = {
    "flapper on one land": (flapper, partial(ports_of, 1)), "sheet on two lands": (sheet, partial(ports_of, 2)),
    "flapper on a kidney": (flapper, kidney), "flapper on the assembly's lip": (flapper, tutorial_lip),
    "ring on one land": (ring, partial(ports_of, 1)), "disc on three lands": (disc, partial(ports_of, 3)),
    "flapper on two lands": (flapper, partial(ports_of, 2)), "disc on one land": (disc, partial(ports_of, 1)),
    "the tutorial's assembly": (drawn_flapper, tutorial_lip),
}  # fmt: skip
"""By turns: twice those of even places flat and those of odd ones tilted, then the other way round.

The last lies as it is drawn, flat.
"""


def draw_region(index: int, seed: int = SEED) -> RegionLanding:
    """Return scene number ``index`` of a seed."""
    rng = np.random.default_rng([seed, index])
    kind = list(KINDS)[index % len(KINDS)]
    reeds, seats = KINDS[kind]
    drawn = reeds is drawn_flapper
    tilted = (index % len(KINDS) + index // (2 * len(KINDS))) % 2 == 1 and not drawn
    struck = seats(rng)
    reed, outline, thickness = reeds(struck, rng)
    rise = 10 ** rng.uniform(0.3, 1.3) * 1e-6 if tilted else 0.0  # m, over the region
    spring = rng.random() < 0.5
    stiffness = float(10 ** rng.uniform(7.5, 9.0)) if spring else math.inf
    fall = Fall(
        gap=20e-6 if drawn else 1e-6 * rng.uniform(1, 4), tilt=math.atan(rise / (2 * MM * struck.reach)),
        axis=math.radians(rng.uniform(0, 360)) if tilted else 0.0, speed=rng.uniform(0.5, 3.0), stiffness=stiffness,
        duration=1e-6 * rng.uniform(120, 200), filter_width=1e-6 * rng.uniform(4, 10),
    )  # fmt: skip
    text = struck.table + reed + _start(outline, fall) + _contact(fall, drawn)
    return RegionLanding(f"{kind}, {'tilted' if tilted else 'flat'}", text, outline, thickness, struck.region, fall)


def _start(outline: Outline, fall: Fall) -> str:
    if isinstance(outline, Ring):
        return f'velocity = "-{fall.speed!r} m/s"\n'
    return f'release = {{ mode = 1, velocity = "-{fall.speed!r} m/s" }}\n'


def _contact(fall: Fall, drawn: bool) -> str:
    lines = ["[contact]\n", "" if drawn else f'gap = "{1e6 * fall.gap!r} um"\n']
    if fall.tilt:
        lines.append(f'tilt = "{math.degrees(fall.tilt)!r} deg"\ntilt_axis = "{math.degrees(fall.axis)!r} deg"\n')
    if math.isfinite(fall.stiffness):
        lines.append(f'law = {{ kind = "spring", stiffness = "{fall.stiffness!r} N/m" }}\n')
    lines.append(f'[run]\nduration = "{1e6 * fall.duration!r} us"\nfilter_width = "{1e6 * fall.filter_width!r} us"\n')
    lines.append('[accuracy]\ntarget = "10 %"\nmeasures = ["impulse", "filtered_peak"]\nlanding = "run"\n')
    return "".join(lines)
