"""Outlines of one body, in section and in plan, for technical drawings: plain arrays of metres, and labels.

All bodies are described alike, whatever role they play: the middle of the struck face is the origin, z is its outward
normal, so that the body lies at z < 0, and x is the direction along which sections are cut. A body that strikes, or
that is met from below, is turned over by who places it. Loops are polygons (n, 2) without a repeated end; what lies
in an odd number of them is inside.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final, Literal

import numpy as np

from impact.greens.base import Array
from impact.quantities import in_units
from seatfem.structures.shapes.flat import Flat
from seatfem.structures.shapes.loops import inside, polygon
from seatfem.structures.shapes.profile import Edge, Profile

Loops = tuple[Array, ...]
View = Literal["section", "plan"]

CHORD: Final = math.radians(3.0)
"""Angle of the chords of a drawn arc: they deviate from it by 0.03 % of its radius."""
BESIDE: Final = 1.7e-6  # distance of a section from the middle plane, on which meshes have corners, over a body's size
SAMPLES: Final = 80
"""Points along the longer side of a struck face's box, of which those on it are looked for under a reed."""
IN_SECTION: Final = ("section", "struck", "held", "bedded")
IN_PLAN: Final = ("plan", "edges", "contact", "port", "clamp")
"""Fields of `BodyViews` that hold loops or lines."""
CORNERS: Final = 8  # fewest corners of a loop that is a circle in chords


@dataclass(frozen=True)
class Size:
    """A dimension: what it is called, its value as text, and between which places of a view it is drawn.

    Attributes:
        view: in which it is drawn.
        axis: 0 along x, 1 along the height of a section or across a plan.
        low, high: its ends along that axis [m].
        at: where its lines begin on the other axis [m].
        text: name and value with unit.
    """

    view: View
    axis: Literal[0, 1]
    low: float
    high: float
    at: float
    text: str

    @property
    def value(self) -> float:
        """Return the length [m]."""
        return self.high - self.low


@dataclass(frozen=True, eq=False)
class BodyViews:
    """A body in section and in plan.

    Attributes:
        name: of its kind, for labels.
        symbol: what stands for a body without a shape: "spring", "mass" or "box"; "" of one that has outlines.
        section: loops (n, 2) of x and z around the material that the plane y = 0 cuts [m].
        struck: lines (n, 2) of the struck face in the section.
        held, bedded: lines in the section that are clamped, or that springs hold.
        plan: loops of x and y around what is seen against z.
        triangles: (m, 3, 2) of the plan of a body whose surface is a mesh; its loops are unknown.
        edges: lines in plan beside the loops.
        contact: loops around the struck face in plan.
        port: loops around the openings that it closes.
        clamp: lines in plan that are clamped.
        sizes: dimensions that count.
        note: what the drawing does not show by itself, as a sentence without its subject.
        mirrored: whether the plan is already that of the body turned over, as of reeds, which are drawn as they lie.
    """

    name: str
    symbol: str = ""
    section: Loops = ()
    struck: Loops = ()
    held: Loops = ()
    bedded: Loops = ()
    plan: Loops = ()
    triangles: Array | None = None
    edges: Loops = ()
    contact: Loops = ()
    port: Loops = ()
    clamp: Loops = ()
    sizes: tuple[Size, ...] = ()
    note: str = ""
    mirrored: bool = False

    @property
    def depth(self) -> float:
        """Return how far the body reaches below its struck face [m]; 0 of a symbol."""
        return max((-float(loop[:, 1].min()) for loop in self.section), default=0.0)

    @property
    def extent(self) -> tuple[Array, Array]:
        """Return the (2,) lowest and (2,) highest corner of the plan [m]; both at the origin of a symbol."""
        loops = [*self.plan, *self.contact, *self.edges]
        if self.triangles is not None:
            loops.append(self.triangles.reshape(-1, 2))
        points = np.concatenate([np.zeros((1, 2)), *loops])
        return points.min(axis=0), points.max(axis=0)

    def moved(self, x: float) -> BodyViews:
        """Return the body at another place along x [m]."""
        sizes = tuple(
            replace(size, low=size.low + x, high=size.high + x) if size.axis == 0 else replace(size, at=size.at + x)
            for size in self.sizes
        )
        return self._changed((*IN_SECTION, *IN_PLAN), lambda points: points + np.array([x, 0.0]), sizes)

    def turned_over(self) -> BodyViews:
        """Return the body turned over about its x axis, its struck face below: z and y change their signs."""
        sizes = tuple(_mirrored(size, self.mirrored) for size in self.sizes)
        keys = IN_SECTION if self.mirrored else (*IN_SECTION, *IN_PLAN)
        return self._changed(keys, lambda points: points * (1.0, -1.0), sizes)

    def _changed(self, keys: Sequence[str], change: Callable[[Array], Array], sizes: tuple[Size, ...]) -> BodyViews:
        """Return the views with other points in fields of these names; the triangles are a field in plan."""
        changed: dict[str, Any] = {key: tuple(map(change, getattr(self, key))) for key in keys}
        if self.triangles is not None and keys != IN_SECTION:
            changed["triangles"] = change(self.triangles)
        return replace(self, **changed, sizes=sizes)


def _mirrored(size: Size, lies: bool) -> Size:
    if size.view == "plan" and lies:
        return size
    if size.axis == 1:
        return replace(size, low=-size.high, high=-size.low)
    return replace(size, at=-size.at)


def round_sizes(loops: Loops) -> tuple[float, ...]:
    """Return the diameters of loops about the origin, in rising order [m]; none where one is no circle."""
    away = [np.hypot(*loop.T) for loop in loops]
    if not all(len(radii) > CORNERS and np.ptp(radii) < 1e-3 * radii.max() for radii in away):
        return ()
    return tuple(sorted(2 * float(radii.mean()) for radii in away))


def length_text(value: float) -> str:
    """Return a length as on drawings: in mm, below a tenth of a millimetre in um."""
    return f"{1e3 * value:.4g} mm" if abs(value) >= 0.999e-4 or value == 0 else in_units(value, "m")


def arc(radius: float, start: float = 0.0, turn: float = 2 * math.pi, centre: tuple[float, float] = (0, 0)) -> Array:
    """Return (n, 2) points of an arc [m]; of a whole circle without its repeated end."""
    count = max(2, math.ceil(abs(turn) / CHORD))
    closed = abs(turn) > 2 * math.pi * (1 - 1e-9)
    angles = start + turn * np.arange(count + (not closed)) / count
    return np.asarray(centre) + radius * np.column_stack([np.cos(angles), np.sin(angles)])


def box(low: Sequence[float], high: Sequence[float]) -> Array:
    """Return the (4, 2) corners of a rectangle [m]."""
    (a, b), (c, d) = low, high
    return np.array([(a, b), (c, b), (c, d), (a, d)])


def crossings(loops: Iterable[Array], y: float) -> Array:
    """Return the (2 k,) places x where the line at a height y enters and leaves the loops, in rising order [m]."""
    places: list[float] = []
    for loop in loops:
        for (x0, y0), (x1, y1) in zip(loop, np.roll(loop, -1, axis=0), strict=True):
            if (y0 > y) != (y1 > y):
                places.append(x0 + (y - y0) * (x1 - x0) / (y1 - y0))
    return np.sort(np.array(places))


def covered_share(face: BodyViews, over: BodyViews, offset: tuple[float, float]) -> float | None:
    """Return the share of one body's struck face that lies below another one in plan, by sampled points.

    Args:
        face: the body that is struck.
        over: the other one, turned over.
        offset: of the middle of the struck face from the other body's contact [m].

    Returns:
        The share; ``None`` where one of both has no outline.
    """
    if not face.contact or not over.plan:
        return None
    corners = np.concatenate(face.contact)
    low, high = corners.min(axis=0), corners.max(axis=0)
    count = np.maximum(2, np.ceil(SAMPLES * (high - low) / max(float((high - low).max()), 1e-12))).astype(int)
    axes = [low[k] + (high[k] - low[k]) * (np.arange(count[k]) + 0.5) / count[k] for k in range(2)]
    points = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
    points = points[inside(face.contact, points)]
    return float(inside(over.plan, points + np.array(offset)).mean()) if len(points) else None


def of_profile(name: str, profile: Profile, *, struck_arc: float | None = None, held: bool = True) -> BodyViews:
    """Return the views of a solid of revolution.

    Args:
        name: of the body.
        profile: its half section; the edges "contact" are struck, "fixed" clamped.
        struck_arc: angle of the part of the ring that is struck, in the direction of x [rad]; ``None``: all of it.
        held: whether anything is clamped.
    """
    corners = [edge.start for edge in profile.edges]
    struck = [edge for edge in profile.edges if edge.name == "contact"]
    lines = [_points(edge) for edge in struck]
    top = max(float(line[:, 1].max()) for line in lines)
    bore, outer = min(r for r, _ in corners), profile.outer_radius
    inner_struck = min(float(line[:, 0].min()) for line in lines)
    inner_struck = 0.0 if inner_struck < 1e-9 * outer else inner_struck
    outer_struck = max(float(line[:, 0].max()) for line in lines)
    mirror = (-1.0, 1.0)
    on_axis = bore == 0.0
    clamped = [_points(edge) - (0.0, top) for edge in profile.edges if edge.name == "fixed"] if held else []
    struck_lines = [line - (0.0, top) for line in lines]
    whole = struck_arc is None
    port = () if on_axis else (arc(bore),)
    base = min(z for _, z in corners) - top
    around = max(z for r, z in corners if r > outer * (1 - 1e-9)) - top
    sizes = [
        Size("section", 0, -outer, outer, base, f"Ø {length_text(2 * outer)}"),
        Size("section", 1, base, 0.0, outer, length_text(-base)),
    ]
    if not on_axis:
        sizes.append(Size("section", 0, -bore, bore, base, f"port Ø {length_text(2 * bore)}"))
    if inner_struck > 0:
        text = f"contact {length_text(outer_struck - inner_struck)}"
        sizes.append(Size("section", 0, inner_struck, outer_struck, 0.0, text))
    else:
        sizes.append(Size("section", 0, -outer_struck, outer_struck, 0.0, f"struck Ø {length_text(2 * outer_struck)}"))
    if inner_struck > 0 and -1e-9 > around > base:
        sizes.append(Size("section", 1, around, 0.0, outer_struck, f"lip {length_text(-around)} high"))
    edges = [arc(r) for r in sorted({round(r, 9) for r, z in corners if r > 0 and z - top > base + 1e-9})]
    contact: Loops = (arc(outer_struck), *((arc(inner_struck),) if inner_struck else ()))
    if struck_arc is not None:
        ends = arc(outer_struck, -struck_arc / 2, struck_arc), arc(inner_struck, struck_arc / 2, -struck_arc)
        contact = (np.concatenate(ends),)
    views = BodyViews(
        name,
        section=_section(profile, top),
        struck=(*struck_lines, *(line * mirror for line in struck_lines if whole)),
        held=(*clamped, *(line * mirror for line in clamped)),
        plan=(arc(outer), *(() if on_axis else (arc(bore),))),
        edges=tuple(np.concatenate([edge, edge[:1]]) for edge in edges),
        contact=contact,
        port=port,
        sizes=tuple(sizes),
    )
    return views if whole else views.moved(-(inner_struck + outer_struck) / 2)


def _section(profile: Profile, top: float) -> Loops:
    """Return the loops of both half sections, of one with a side on the axis a single loop."""
    mirror, edges = (-1.0, 1.0), list(profile.edges)
    on_axis = [k for k, edge in enumerate(edges) if edge.start[0] == edge.end[0] == 0.0]
    if not on_axis:
        half = np.concatenate([_points(edge)[:-1] for edge in edges]) - (0.0, top)
        return half, half * mirror
    after = edges[on_axis[-1] + 1 :] + edges[: on_axis[0]]
    side = np.concatenate([*(_points(edge)[:-1] for edge in after), [after[-1].end]]) - (0.0, top)
    return (np.concatenate([side, side[-2:0:-1] * mirror]),)


def _points(edge: Edge) -> Array:
    """Return (n, 2) r and z along an edge, both ends among them [m]."""
    if edge.centre is None:
        return np.array([edge.start, edge.end])
    start, turn = edge.angles
    return arc(math.dist(edge.centre, edge.start), start, turn, edge.centre)


def of_prism(name: str, sides: tuple[float, float], patch: tuple[float, float] | None, height: float) -> BodyViews:
    """Return the views of an upright block of half ``sides`` along x and y [m], struck on all of its top or on a patch
    of half the sides ``patch``, clamped below."""
    x, y = sides
    px, py = sides if patch is None else patch
    sizes = [
        Size("section", 0, -x, x, -height, length_text(2 * x)),
        Size("section", 1, -height, 0.0, x, length_text(height)),
        Size("plan", 1, -y, y, x, length_text(2 * y)),
    ]
    if patch is not None:
        sizes.append(Size("section", 0, -px, px, 0.0, f"struck {length_text(2 * px)} x {length_text(2 * py)}"))
    plan, contact = (box((-half[0], -half[1]), half) for half in (sides, (px, py)))
    held = (np.array([(-x, -height), (x, -height)]),)
    return _extruded(name, (plan,), (contact,), height, BESIDE * x, held=held, sizes=tuple(sizes))


def _extruded(name: str, plan: Loops, contact: Loops, thickness: float, y: float, **others: Any) -> BodyViews:
    """Return the views of what is as thick everywhere, cut at ``y`` [m]; ``others``: fields of the views."""
    cut, touching = (crossings(loops, y).reshape(-1, 2).tolist() for loops in (plan, contact))
    section = tuple(box((low, -thickness), (high, 0.0)) for low, high in cut)
    struck = tuple(np.array([(low, 0.0), (high, 0.0)]) for low, high in touching)
    return BodyViews(name, section=section, struck=struck, plan=plan, contact=contact, **others)


def of_sheet(name: str, flat: Flat, contact: Loops) -> BodyViews:
    """Return the views of a flat sheet that touches with what lies in ``contact``, loops about its own centre [m]."""
    centre = np.array(flat.centre)
    loops = tuple(polygon(loop)[0] - centre for loop in flat.drawn)
    t = flat.thickness
    ends = _clamped_ends(flat) - centre
    low, high = loops[0].min(axis=0), loops[0].max(axis=0)
    sizes = [Size("section", 1, -t, 0.0, float(high[0]), f"t {length_text(t)}")]
    sizes.append(Size("plan", 1, float(low[1]), float(high[1]), float(high[0]), length_text(float(high[1] - low[1]))))
    sizes.append(Size("plan", 0, float(low[0]), float(high[0]), float(low[1]), length_text(float(high[0] - low[0]))))
    if len(ends):
        root = float(ends[:, 0].mean())
        sizes.append(Size("plan", 0, min(root, 0.0), max(root, 0.0), 0.0, length_text(abs(root))))
    held: Loops = ()
    if len(ends) and ends[0, 1] * ends[1, 1] < 0:  # the clamp crosses the section
        x = float(np.interp(0.0, *(ends[np.argsort(ends[:, 1])].T[::-1])))
        held = (np.array([(x, -t), (x, 0.0)]),)
    clamp = (ends,) if len(ends) else ()
    if (edge := flat.held_loop) is not None:
        corners = polygon(edge)[0] - centre
        clamp = (np.vstack([corners, corners[:1]]),)
        held = tuple(np.array([(x, -t), (x, 0.0)]) for x in crossings(clamp, 0.0))
    y = BESIDE * float(np.ptp(loops[0]))
    return _extruded(name, loops, contact, t, y, held=held, clamp=clamp, sizes=tuple(sizes), mirrored=True)


def _clamped_ends(flat: Flat) -> Array:
    """Return the (2, 2) ends of the straight line along which a sheet is clamped [m]; (0, 2) of a free one."""
    corners = polygon(flat.around[0])[0]
    held = corners[flat.clamped(corners)] if flat.is_clamped and flat.held_loop is None else corners[:0]
    if len(held) < 2:
        return np.zeros((0, 2))
    along = held[:, int(np.ptp(held[:, 1]) >= np.ptp(held[:, 0]))]
    return np.asarray(held[[int(np.argmin(along)), int(np.argmax(along))]])


def of_ported_plate(
    outline: Array,
    rim: Array,
    ports: Array,
    radii: tuple[float, float],
    struck: Sequence[int],
    thickness: float,
) -> BodyViews:
    """Return the views of a flat plate with round ports, lands around them and a clamped rim below.

    Args:
        outline, rim: loops around it and within its clamped rim [m].
        ports: (n, 2) centres [m]; of those whose land is struck, by their places ``struck``, the mean is the origin.
        radii: of a port and of its land [m].
        thickness: of the plate [m].
    """
    hole, land = radii
    middle = ports[list(struck)].mean(axis=0)
    openings = tuple(arc(hole) + centre - middle for centre in ports)
    lands = tuple(arc(land) + centre - middle for centre in ports)
    whole, within = outline - middle, rim - middle
    y = BESIDE * float(np.ptp(whole)) + (0.0 if len(struck) == 1 else float((ports[struck[0]] - middle)[1]))
    cut = crossings((whole, *openings), y)
    first, last = float(cut[0]), float(cut[-1])
    inner = crossings((within,), y)
    own = ports[struck[0]] - middle
    sizes = (
        Size("section", 0, first, last, -thickness, length_text(last - first)),
        Size("section", 1, -thickness, 0.0, last, length_text(thickness)),
        Size("section", 0, own[0] - hole, own[0] + hole, -thickness, f"port Ø {length_text(2 * hole)}"),
        Size("section", 0, own[0] + hole, own[0] + land, 0.0, f"land {length_text(land - hole)}"),
    )
    sides = (first, inner[0]), (inner[-1], last)
    return _extruded(
        "valve plate",
        (whole, *openings),
        tuple(loop for k in struck for loop in (lands[k], openings[k])),
        thickness,
        y,
        held=tuple(np.array([(low, -thickness), (high, -thickness)]) for low, high in sides),
        edges=tuple(np.concatenate([each, each[:1]]) for each in lands),
        port=tuple(openings[k] for k in struck),
        sizes=sizes,
    )


def of_beam(
    name: str, widths: Sequence[tuple[float, float]], thickness: float, at: float, *, both_ends: bool = False
) -> BodyViews:
    """Return the views of a beam of ``widths`` [position, width] from its clamp on, met at the position ``at`` [m]."""
    x, half = np.array(widths).T
    x, half = x - at, half / 2
    loop = np.concatenate([np.column_stack([x, -half]), np.column_stack([x, half])[::-1]])
    first, last, t = float(x[0]), float(x[-1]), thickness
    clamped = (0, -1) if both_ends else (0,)
    middle = float(half.max())
    sizes = [
        Size("section", 1, -t, 0.0, last, f"t {length_text(t)}"),
        Size("plan", 0, first, last, -middle, length_text(last - first)),
        Size("plan", 1, -middle, middle, last, length_text(2 * middle)),
    ]
    if last > 1e-9 * (last - first):
        sizes.append(Size("plan", 0, first, 0.0, -middle, length_text(-first)))
    return BodyViews(
        name,
        section=(box((first, -t), (last, 0.0)),),
        held=tuple(np.array([(x[k], -t), (x[k], 0.0)]) for k in clamped),
        plan=(loop,),
        clamp=tuple(np.array([(x[k], -half[k]), (x[k], half[k])]) for k in clamped),
        sizes=tuple(sizes),
        mirrored=True,
    )
