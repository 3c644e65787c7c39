"""Valves as their users write them, with the contact not stated and stated by hand, and the same for `points`.

Reeds are thrown in their first mode, so that the other program needs no gas. Steel plates with ports have modes from
the matrices of CalculiX and yield at once beyond them, seats of revolution yield at once: rigid points take energy from
a flat plate as it touches, and a fifth to a third of its peak. Other seats are rigid to it. A ball has a closed form.
"""

from __future__ import annotations

import itertools
import math
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, Final

import numpy as np
from drawn_regions import MESHES, RIGID, RegionLanding
from drawn_regions import OF_STEEL as STEEL_OF_DRAWN
from drawn_regions import STEEL as OF_DRAWN
from points.gll import Array
from points.march import filtered_peak, impulse
from points.outlines import Flapper, Outline, Ring, Sheet
from points.plate import Material
from points.region_landing import Fall, Fineness, Stop, hardest_landing, march_region
from points.regions import Cells, Rectangle, Region, RoundLand
from points.solid_seat import PointSeat, SolidSeat
from scipy.special import gamma
from valve_parts import GAP, LIFT, LIP, REED, STOPPER

MM: Final = 1e-3
STEEL: Final = Material(200e9, 0.3, 7850.0)  # "steel" of scenes
DAMPING: Final = 0.02
OF_STEEL: Final = f'material = "steel"\ndamping_ratio = {DAMPING}\n'
PARTS: Final = Path(tempfile.gettempdir()) / "seatfem-valve-parts"
NOT_STATED: Final = "not stated"
OF_SEATS: Final = 250
"""Modes of plates with ports in the other program: up to some 0.5 MHz."""
OF_THE_BLOCK: Final = 2e-3
"""Share of Hertz's values that may be the block's own: it yields 1.1e-11 m/N (as a column), .4 % of the indentation,
about half of which is lost to a force or a duration. What it keeps of the impulse is not computed."""
Measures = Mapping[str, float]


@dataclass(frozen=True)
class Valve:
    """A scene, its measures on a grid of the other program, or by a closed form, keys by which the contact is stated,
    by how it is, what the reference neglects at least, over its values, and the number of the grid by which it is
    computed; how far the one before is from it is its doubt."""

    text: str
    reference: Callable[[Fineness], Measures]
    stated: Mapping[str, str]
    neglected: float = 0.0
    grid: int = 1


@dataclass(frozen=True)
class Thrown:
    """A plate reed in the words of the other program."""

    outline: Outline
    thickness: float
    lands: tuple[RoundLand, ...]
    fall: Fall
    stop: Stop | None = None
    seat: Callable[[list[Cells]], PointSeat] | None = None

    def __call__(self, grid: Fineness) -> Measures:
        """Return impulse and largest mean force of the hardest landing on the seat, and on what limits the lift."""
        marched, cells = march_region(
            self.outline, STEEL, self.thickness, Region(self.lands), self.fall, grid, self.stop, self.seat
        )
        seat = sum(each.areas.size for each in cells)
        measured: dict[str, float] = {}
        for body, forces in (("", marched.forces[:, :seat]), ("stopper ", marched.forces[:, seat:])):
            force = forces.sum(axis=1)
            if force.any():
                first, last = hardest_landing(force, grid.dt, self.fall.filter_width)
                landing = force[first : last + 1]
                measured[f"{body}impulse"] = impulse(landing, grid.dt)
                measured[f"{body}peak"] = filtered_peak(landing, grid.dt, self.fall.filter_width)
        return measured


def plate_of(ports: int, more: str = "") -> str:
    """Return a steel plate with ports of 8 mm in a row, and lands of 1 mm."""
    return (
        f'[seat]\nkind = "plate"\nports = {ports}\nlayout = "row"\nport_radius = "4 mm"\npitch = "12 mm"\n'
        f'margin = "6 mm"\nthickness = "6 mm"\nland_width = "1 mm"\nclamp_width = "2 mm"\n{OF_STEEL}{more}'
    )


def flapper(root: float, taper: float, neck: float, length: float, paddle: float, thickness: float) -> str:
    """Return a flapper of these dimensions [mm], without its start."""
    return (
        f'[reed]\nkind = "flapper"\nroot_width = "{root} mm"\ntaper_length = "{taper} mm"\nneck_width = "{neck} mm"\n'
        f'neck_length = "{length} mm"\npaddle_diameter = "{paddle} mm"\nthickness = "{thickness} mm"\n{OF_STEEL}'
    )


@cache
def plate_seat(ports: int) -> SolidSeat:
    """Return the seat of `plate_of`, whose ports lie about the origin."""
    half, middles = 6.0 * (ports - 1) + 10, [12.0 * k - 6 * (ports - 1) for k in range(ports)]

    def draw(occ: Any) -> None:
        holes = [(3, occ.addCylinder(x, 0, 0, 0, 0, 6, 4)) for x in middles]
        faces = [(2, occ.addDisk(x, 0, 6, 5, 5)) for x in middles]
        faces.append((2, occ.addRectangle(2 - half, -8, 0, 2 * half - 4, 16)))
        body = occ.cut([(3, occ.addBox(-half, -10, 0, 2 * half, 20, 6))], holes, removeTool=False)[0]
        occ.fragment(body, occ.cut(faces, holes)[0])  # elements end at the edges of the lands and of the clamp

    def held(nodes: Array) -> Array:
        rim = (np.abs(nodes[:, 0]) > half - 2 - 1e-6) | (np.abs(nodes[:, 1]) > 8 - 1e-6)
        return np.asarray((nodes[:, 2] < 1e-6) & rim)

    def struck(places: Array) -> Array:
        return np.min([np.hypot(places[:, 0] - x, places[:, 1]) for x in middles], axis=0) < 5

    circles = [(x, 0.0, 4.5) for x in middles]
    return SolidSeat(draw, held, struck, 6.0, circles, STEEL, (0.5, 2.0), OF_SEATS)


def turned_seat(outer: float, lips: tuple[float, ...], *lower: tuple[tuple[float, float], float]) -> SolidSeat:
    """Return an `annular` seat 8 mm thick with lips 0.5 mm high, held at its underside: ``outer`` radius, mean radii of
    the ``lips``, and inner and outer radii of what is ``lower``, with the height of each [mm]."""

    def draw(occ: Any) -> None:
        body = [(3, occ.addCylinder(0, 0, 0, 0, 0, 8.5, outer))]
        for (inner, rim), floor in lower:
            tube = [(3, occ.addCylinder(0, 0, floor, 0, 0, 9, rim))]
            if inner:
                tube = occ.cut(tube, [(3, occ.addCylinder(0, 0, floor, 0, 0, 9, inner))])[0]
            body = occ.cut(body, tube)[0]

    circles = [(0.0, 0.0, radius) for radius in lips]
    return SolidSeat(
        draw,
        lambda nodes: nodes[:, 2] < 1e-6,
        lambda middles: np.full(len(middles), True),
        8.5,
        circles,
        STEEL,
        (0.6, 3.0),
    )


def straight(length: float, width: float, at: float, thickness: float) -> str:
    """Return a straight reed of these dimensions [mm], whose contact lies ``at`` from its clamp."""
    corners = [[f"{x} mm", f"{y} mm"] for x, y in ((0, -1), (length, -1), (length, 1), (0, 1)) for y in [y * width / 2]]
    return (
        f'[reed]\nkind = "sheet"\noutline = {corners}\nclamped = {[corners[3], corners[0]]}\n'
        f'contact_at = ["{at} mm", "0 mm"]\nthickness = "{thickness} mm"\n{OF_STEEL}'
    )


def thrown(speed: float) -> str:
    return f'release = {{ mode = 1, velocity = "{-speed} m/s" }}\n'


def asked(duration: str, filter_width: str, target: str = "10 %") -> str:
    return (
        f'[run]\nduration = "{duration}"\nfilter_width = "{filter_width}"\n[accuracy]\ntarget = "{target}"\n'
        'measures = ["impulse", "filtered_peak"]\n'
    )


def fall(speed: float, duration: float, width: float, gap: float = 0.0) -> Fall:
    """Return how a flat reed comes down on a rigid seat [SI]."""
    return Fall(gap, 0.0, 0.0, speed, math.inf, duration, width, DAMPING)


def port(x: float = 0.0) -> RoundLand:
    return RoundLand((MM * x, 0.0), 4 * MM, 5 * MM)


@cache
def drawn_parts() -> str:
    """Draw the parts of `valve_parts`, and return the assembly with its stopper."""
    PARTS.mkdir(exist_ok=True)
    script = Path(__file__).with_name("valve_parts.py")
    subprocess.run([sys.executable, str(script), str(PARTS)], check=True, stdout=subprocess.DEVNULL)
    return (
        f'[assembly]\nplaced = "as drawn"\n[seat]\nkind = "cad"\nfile = "{PARTS}/plate.step"\n'
        f"contact = {{ number = 9 }}\nfixed = {{ number = 5 }}\n{OF_STEEL}"
        f'[stopper]\nkind = "cad"\nfile = "{PARTS}/stopper.step"\ncontact = {{ number = 5 }}\n'
        f'fixed = {{ number = 6 }}\ngap = "{LIFT} mm"\n{OF_STEEL}'
        f'[reed]\nkind = "sheet"\nfile = "{PARTS}/reed.step"\nclamped = {{ number = 1 }}\n{OF_STEEL}'
    )


def hertz(_: Fineness) -> Measures:
    """Return impulse, largest force and duration of a rigid ball on a half-space: 1 kg, 3.132 m/s, 25.9 GN/m^1.5."""
    mass, speed, stiffness = 1.0, 3.132, 25.9e9
    deepest = (1.25 * mass * speed**2 / stiffness) ** 0.4
    share = 2 * math.sqrt(math.pi) * gamma(0.4) / (5 * gamma(0.9))  # 1.4716
    return {"impulse": 2 * mass * speed, "peak": stiffness * deepest**1.5, "duration": 2 * share * deepest / speed}


def retainer(places: Array) -> Array:
    """Return the openings (n,) [m] at places from the contact, 18 mm from the clamp: 50 um and a radius of 200 mm."""
    x = places[:, 0] + 18 * MM
    return np.asarray(0.05 * MM + 0.2 - np.sqrt(0.2**2 - x**2))


def ball(radius: str) -> str:
    return (
        f'[seat]\nkind = "stopper"\nmaterial = "steel"\nradius = "150 mm"\nthickness = "150 mm"\n'
        f'contact_radius = "{radius}"\n[reed]\nkind = "rigid_mass"\nmass = "1 kg"\nvelocity = "-3.132 m/s"\n'
        '[contact]\nlaw = { kind = "hertz", stiffness = "25.9 GN/m^1.5" }\n' + asked("0.4 ms", "1 us", "1 %")
    )


RING: Final = '[reed]\nkind = "ring_plate"\nouter_diameter = "27 mm"\ninner_diameter = "13 mm"\nthickness = "1.2 mm"\n'
RINGS: Final = (
    '[seat]\nkind = "annular"\nbore_radius = "7 mm"\nlip_width = "1 mm"\nlip_edge_radius = "0 mm"\n'
    f'second_lip_radius = "12 mm"\nport_depth = "1 mm"\nouter_radius = "16 mm"\nthickness = "8 mm"\n{OF_STEEL}'
)
ANNULAR: Final = (
    f'[seat]\nkind = "annular"\nbore_radius = "3 mm"\nlip_width = "1 mm"\nlip_edge_radius = "0 mm"\n{OF_STEEL}'
)
CURVED: Final = '[stopper]\nkind = "spring"\nstiffness = "500 N/um"\ngap = "0.05 mm"\nprofile = { radius = "200 mm" }\n'
ASSEMBLY: Final = (
    f'[assembly]\nplaced = "as drawn"\n[seat]\nkind = "cad"\nfile = "{MESHES}/assembly_plate.step"\n'
    'contact = { number = 13 }\nfixed = { radius = "2.25 mm", several = true }\nmaterial = "cast iron"\n'
    f'damping_ratio = {DAMPING}\n[reed]\nkind = "sheet"\nfile = "{MESHES}/assembly_flapper.step"\n'
    f"clamped = {{ number = 1 }}\n{OF_STEEL}"
)
RING_OF_ONE: Final = {"reed.contact_radius": "4.5 mm", "reed.contact_width": "1 mm"}


def valves() -> dict[str, Valve]:
    """Return the valves by their names."""
    parts, (begin, end, width, thickness) = drawn_parts(), REED
    return {
        "flapper on one port": Valve(
            plate_of(2, "struck = 1\n") + flapper(9, 3, 7, 20, 13, 0.25) + thrown(2) + asked("1 ms", "5 us"),
            Thrown(
                Flapper(*(MM * x for x in (9, 3, 7, 20, 13))), 0.25 * MM, (port(-6),), fall(2.0, 0.3e-3, 5e-6),
                seat=plate_seat(2),
            ),
            RING_OF_ONE,
            grid=2,
        ),
        "tutorial's assembly": Valve(
            ASSEMBLY + thrown(1) + asked("300 us", "10 us"),
            Thrown(
                Flapper(*(MM * x for x in (8, 2, 8, 22 - math.sqrt(15**2 - 8**2) / 2, 15))), 0.3 * MM,
                (RoundLand((0.0, 0.0), 4 * MM, 5.2 * MM),), fall(1.0, 300e-6, 10e-6, 20e-6),
            ),
            {"reed.contact_radius": "4.6 mm", "reed.contact_width": "1.2 mm"},
        ),
        "paddle over two ports": Valve(
            plate_of(2) + flapper(12, 3, 10, 20, 24, 0.2) + thrown(2) + asked("0.4 ms", "5 us"),
            Thrown(
                Flapper(*(MM * x for x in (12, 3, 10, 20, 24))), 0.2 * MM, (port(-6), port(6)),
                fall(2.0, 0.4e-3, 5e-6), seat=plate_seat(2),
            ),
            {"contact.ports": "32"},
        ),
        "straight reed over one port of three": Valve(
            plate_of(3, "struck = 3\n") + straight(30, 12, 23, 0.3) + thrown(1.5) + '[contact]\ngap = "10 um"\n'
            + asked("0.3 ms", "10 us"),
            Thrown(
                Sheet(30 * MM, 12 * MM, 23 * MM), 0.3 * MM, (port(12),), fall(1.5, 0.3e-3, 10e-6, 10e-6),
                seat=plate_seat(3),
            ),
            RING_OF_ONE,
        ),
        "straight reed over two ports": Valve(
            plate_of(2) + straight(38, 13, 24, 0.4) + thrown(1.5) + '[contact]\ngap = "10 um"\n'
            + asked("0.3 ms", "10 us"),
            Thrown(
                Sheet(38 * MM, 13 * MM, 24 * MM), 0.4 * MM, (port(-6), port(6)), fall(1.5, 0.3e-3, 10e-6, 10e-6),
                seat=plate_seat(2),
            ),
            {"contact.ports": "32"},
        ),
        "assembly with a stopper": Valve(
            parts + thrown(-1.5) + asked("1.5 ms", "10 us"),
            Thrown(
                Sheet(MM * (end - begin), MM * width, MM * -begin), MM * thickness,
                (RoundLand((0.0, 0.0), LIP[0] * MM, LIP[1] * MM),), fall(-1.5, 1.5e-3, 10e-6, MM * GAP),
                Stop(
                    Rectangle((-STOPPER * MM, -STOPPER * MM), (STOPPER * MM, STOPPER * MM)),
                    lambda places: np.full(len(places), LIFT * MM),
                ),
            ),
            {"reed.contact_radius": "3.5 mm", "reed.contact_width": "1 mm"},
        ),
        "discharge valve, curved retainer": Valve(
            ANNULAR + straight(25, 10, 18, 0.25) + thrown(-2) + CURVED + asked("1.5 ms", "10 us"),
            Thrown(
                Sheet(25 * MM, 10 * MM, 18 * MM), 0.25 * MM, (RoundLand((0.0, 0.0), 3 * MM, 4 * MM),),
                fall(-2.0, 1.5e-3, 10e-6), Stop(Rectangle((-18 * MM, -5 * MM), (7 * MM, 5 * MM)), retainer, 5e8),
                turned_seat(12, (3.5,), ((0, 3), 0), ((4, 13), 8)),
            ),
            {"stopper.arcs": "64"},
            grid=2,
        ),
        "ring valve with two rings": Valve(
            RINGS + RING + OF_STEEL + 'velocity = "-1.5 m/s"\n[contact]\ngap = "5 um"\n' + asked("0.15 ms", "10 us"),
            Thrown(
                Ring(6.5 * MM, 13.5 * MM), 1.2 * MM,
                (RoundLand((0.0, 0.0), 7 * MM, 8 * MM), RoundLand((0.0, 0.0), 12 * MM, 13 * MM)),
                fall(1.5, 0.15e-3, 10e-6, 5e-6),
                seat=turned_seat(16, (7.5, 12.5), ((0, 7), 0), ((8, 12), 7), ((13, 17), 8)),
            ),
            {"contact.ports": "24"},
        ),
        **{
            f"ball of 1 kg, patch {radius}": Valve(ball(radius), hertz, {}, OF_THE_BLOCK)
            for radius in ("2.4 mm", "5 mm", "10 mm", "20 mm", "40 mm")
        },
    }  # fmt: skip


TWO_RINGS: Final = ((0.0, 7.0, 8.0), (0.0, 12.0, 13.0))
TWO_PORTS: Final = ((-6.0, 4.0, 5.0), (6.0, 4.0, 5.0))
"""Place along x, inner and outer radius of each land [mm]."""


def lands() -> dict[str, tuple[RegionLanding, tuple[str, str]]]:
    """Return seats with two lands, flat and tilted, by names, and the names of the lands.

    Springs act between the bodies, so that a flat landing is determined and each land has its share.
    """
    on_ports = (
        plate_of(2).replace(OF_STEEL, RIGID).replace("thickness = \"6 mm\"", "thickness = \"8 mm\"")
        + flapper(12, 3, 10, 20, 24, 0.3).replace(OF_STEEL, STEEL_OF_DRAWN) + thrown(1), 16, TWO_PORTS,
        Flapper(*(MM * x for x in (12, 3, 10, 20, 24))), 0.3 * MM, ("port 1", "port 2"),
    )  # fmt: skip
    on_rings = (
        RINGS.replace(OF_STEEL, RIGID) + RING.replace("1.2 mm", "1 mm") + STEEL_OF_DRAWN + 'velocity = "-1 m/s"\n', 24,
        TWO_RINGS, Ring(6.5 * MM, 13.5 * MM), 1 * MM, ("inner land", "outer land"),
    )  # fmt: skip
    both: dict[str, tuple[RegionLanding, tuple[str, str]]] = {}
    for name, (table, segments, at, outline, thickness, names), tilt, axis in (
        ("two ports, flat", on_ports, 0.0, 0.0), ("two ports, tilted", on_ports, 0.1, -90.0),
        ("ring valve, flat", on_rings, 0.0, 0.0), ("ring valve, tilted", on_rings, 0.1, 0.0),
    ):  # fmt: skip
        landing = Fall(5e-6, math.radians(tilt), math.radians(axis), 1.0, 1e8, 80e-6, 10e-6)  # one landing
        text = (
            f'{table}[contact]\ngap = "5 um"\ntilt = "{tilt} deg"\ntilt_axis = "{axis} deg"\nports = {segments}\n'
            'law = { kind = "spring", stiffness = "1e8 N/m" }\n' + asked("80 us", "10 us", "25 %")
        )
        region = Region([RoundLand((MM * x, 0.0), MM * inner, MM * outer) for x, inner, outer in at])
        both[name] = RegionLanding(name, text, outline, thickness, region, landing), names
    return both


def by_lands(landing: RegionLanding, names: tuple[str, str], grid: Fineness) -> dict[tuple[str, str], float]:
    """Return the numbers of each land, of all touches in the time, by the other program."""
    marched, cells = march_region(landing.outline, OF_DRAWN, landing.thickness, landing.region, landing.fall, grid)
    ends = np.cumsum([0, *(each.areas.size for each in cells)])
    forces = [marched.forces[:, a:b].sum(axis=1) for a, b in itertools.pairwise(ends)]
    touches = [grid.dt * int(np.argmax(force > 0)) for force in forces]
    total = impulse(sum(forces), grid.dt)
    return {
        (name, measure): value
        for name, touch, force in zip(names, touches, forces, strict=True)
        for measure, value in {
            "first touch": touch, "after the first": touch - min(touches),
            "peak": filtered_peak(force, grid.dt, landing.fall.filter_width), "impulse": impulse(force, grid.dt),
            "share": impulse(force, grid.dt) / total,
        }.items()
    }  # fmt: skip
