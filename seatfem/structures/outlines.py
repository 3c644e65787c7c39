"""Outlines of one body, in section and in plan, for technical drawings: plain arrays of metres, and dimensions.

All bodies are described alike, whatever role they play: the middle of the struck face is the origin, z is its outward
normal, so that the body lies at z < 0, and x is the direction along which sections are cut. A drawing turns over what
strikes, or is met from below, and moves each body to its place. Loops are polygons (n, 2) without a repeated end; what
lies in an odd number of them is inside.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
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
LINES: Final[Mapping[View, tuple[str, ...]]] = {
    "section": ("section", "struck", "held", "bedded"), "plan": ("plan", "edges", "contact", "port", "clamp"),
}  # fmt: skip
"""Fields of `BodyViews` that hold loops or lines, by view."""
CORNERS: Final = 8  # fewest corners of a loop that is a circle in chords
MIRROR: Final = np.array([-1.0, 1.0])


@dataclass(frozen=True)
class Size:
    """A dimension: between which places of a view it is drawn, and its words.

    Attributes:
        view: in which it is drawn.
        axis: 0 along x, 1 along the height of a section or across a plan.
        low, high: its ends along that axis [m].
        at: where its lines begin on the other axis [m].
        words: its text, with {} in place of its value.
    """

    view: View
    axis: Literal[0, 1]
    low: float
    high: float
    at: float
    words: str = "{}"

    @property
    def value(self) -> float:
        """Return the length [m]."""
        return self.high - self.low

    @property
    def text(self) -> str:
        """Return the words with the value and its unit."""
        return self.words.format(length_text(self.value))

    def placed(self, sign: float, by: Array) -> Size:
        """Return the dimension with the ``sign`` of its second axis, moved ``by`` (2,) [m]."""
        if self.axis == 0:
            return replace(self, low=self.low + by[0], high=self.high + by[0], at=sign * self.at + by[1])
        low, high = sorted((sign * self.low, sign * self.high))
        return replace(self, low=low + by[1], high=high + by[1], at=self.at + by[0])


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
        origin: x, y and z of the middle of its struck face in a drawing [m].
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
    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)

    @property
    def heights(self) -> tuple[float, float]:
        """Return the lowest and the highest z of the section [m]; both at the origin of a symbol."""
        z = np.concatenate([loop[:, 1] for loop in self.section] or [np.array(self.origin[2:])])
        return float(z.min()), float(z.max())

    @property
    def extent(self) -> tuple[Array, Array]:
        """Return the (2,) lowest and (2,) highest corner of the plan [m], its origin among it."""
        loops = [*self.plan, *self.contact, *self.edges]
        if self.triangles is not None:
            loops.append(self.triangles.reshape(-1, 2))
        points = np.concatenate([np.array([self.origin[:2]]), *loops])
        return points.min(axis=0), points.max(axis=0)

    def moved(self, x: float, y: float = 0.0, z: float = 0.0) -> BodyViews:
        """Return the body at another place [m]."""
        return self._placed({"section": 1.0, "plan": 1.0}, np.array([x, y, z]))

    def turned_over(self) -> BodyViews:
        """Return the body turned over about its x axis, its struck face below: z and y change their signs."""
        return self._placed({"section": -1.0, "plan": 1.0 if self.mirrored else -1.0}, np.zeros(3))

    def _placed(self, signs: Mapping[View, float], by: Array) -> BodyViews:
        """Return the body with the ``signs`` of the second axis of each view, then moved ``by`` (3,) [m]."""
        ways = {view: (np.array([1.0, sign]), by[[0, 1 if view == "plan" else 2]]) for view, sign in signs.items()}
        lines: dict[str, Any] = {
            name: tuple(line * sign + away for line in getattr(self, name))
            for view, (sign, away) in ways.items()
            for name in LINES[view]
        }
        if self.triangles is not None:
            lines["triangles"] = self.triangles * ways["plan"][0] + ways["plan"][1]
        sizes = tuple(size.placed(signs[size.view], ways[size.view][1]) for size in self.sizes)
        origin = tuple((np.array(self.origin) * (1.0, signs["plan"], signs["section"]) + by).tolist())
        return replace(self, **lines, sizes=sizes, origin=origin)


def round_sizes(loops: Loops) -> tuple[float, ...]:
    """Return the diameters of loops about one centre, in rising order [m]; none where one is no circle."""
    if not loops:
        return ()
    centre = (loops[0].min(axis=0) + loops[0].max(axis=0)) / 2
    away = [np.hypot(*(loop - centre).T) for loop in loops]
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


def closed(loops: Iterable[Array]) -> Loops:
    """Return loops with their first corner repeated at their end."""
    return tuple(np.concatenate([loop, loop[:1]]) for loop in loops)


def crossings(loops: Iterable[Array], y: float) -> Array:
    """Return the (2 k,) places x where the line at a height y enters and leaves the loops, in rising order [m]."""
    places: list[float] = []
    for loop in loops:
        for (x0, y0), (x1, y1) in zip(loop, np.roll(loop, -1, axis=0), strict=True):
            if (y0 > y) != (y1 > y):
                places.append(x0 + (y - y0) * (x1 - x0) / (y1 - y0))
    return np.sort(np.array(places))


def covered_share(face: BodyViews, over: BodyViews, offset: tuple[float, float] = (0.0, 0.0)) -> float | None:
    """Return the share of one body's struck face that lies below another one in plan, by sampled points.

    Args:
        face: the body that is struck.
        over: the other one, turned over.
        offset: of the middle of the struck face from the other body's contact, where they are not placed [m].

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


def draw_profile(name: str, profile: Profile, *, struck_arc: float | None = None, held: bool = True) -> BodyViews:
    """Return the views of a solid of revolution.

    Args:
        name: of the body.
        profile: its half section; the edges "contact" are struck, "fixed" clamped.
        struck_arc: angle of the part of the ring that is struck, in the direction of x [rad]; ``None``: all of it.
        held: whether anything is clamped.
    """
    lines = {key: [_points(edge) for edge in profile.edges if edge.name == key] for key in ("contact", "fixed")}
    top = np.array([0.0, np.concatenate(lines["contact"])[:, 1].max()])
    struck, clamped = ([line - top for line in lines[key]] for key in ("contact", "fixed"))
    corners, outer = np.array([edge.start for edge in profile.edges]) - top, profile.outer_radius
    (bore, base), (first, _) = corners.min(axis=0).tolist(), np.concatenate(struck).min(axis=0).tolist()
    last, around = (
        float(np.concatenate(struck)[:, 0].max()),
        float(corners[corners[:, 0] > outer * (1 - 1e-9), 1].max()),
    )
    first = 0.0 if first < 1e-9 * outer else first
    port = (arc(bore),) if bore else ()
    sizes = [Size("section", 0, -outer, outer, base, "Ø {}"), Size("section", 1, base, 0.0, outer)]
    if bore:
        sizes.append(Size("section", 0, -bore, bore, base, "port Ø {}"))
    rings = profile.rings("contact")
    if first:
        sizes += [Size("section", 0, low, high, 0.0, "contact {}") for low, high in rings]
    else:
        sizes.append(Size("section", 0, -last, last, 0.0, "struck Ø {}"))
    if first and -1e-9 > around > base:
        sizes.append(Size("section", 1, around, 0.0, last, "lip {} high"))
    contact: Loops = tuple(arc(radius) for ring in reversed(rings) for radius in ring[::-1] if radius > 1e-9 * outer)
    if struck_arc is not None:
        contact = (np.concatenate([arc(last, -struck_arc / 2, struck_arc), arc(first, struck_arc / 2, -struck_arc)]),)
    raised = corners[(corners[:, 0] > 0) & (corners[:, 1] > base + 1e-9), 0]
    views = BodyViews(
        name,
        section=_section(profile, top),
        struck=(*struck, *(line * MIRROR for line in struck if struck_arc is None)),
        held=tuple(line * way for way in (1.0, MIRROR) for line in clamped if held),
        plan=(arc(outer), *port),
        edges=closed(arc(radius) for radius in np.unique(raised.round(9)).tolist()),
        contact=contact,
        port=port,
        sizes=tuple(sizes),
    )
    return views if struck_arc is None else replace(views.moved(-(first + last) / 2), origin=views.origin)


def _section(profile: Profile, top: Array) -> Loops:
    """Return the loops of both half sections, of one with a side on the axis a single loop."""
    edges = list(profile.edges)
    on_axis = [k for k, edge in enumerate(edges) if edge.start[0] == edge.end[0] == 0.0]
    if not on_axis:
        half = np.concatenate([_points(edge)[:-1] for edge in edges]) - top
        return half, half * MIRROR
    after = edges[on_axis[-1] + 1 :] + edges[: on_axis[0]]
    side = np.concatenate([*(_points(edge)[:-1] for edge in after), [after[-1].end]]) - top
    return (np.concatenate([side, side[-2:0:-1] * MIRROR]),)


def _points(edge: Edge) -> Array:
    """Return (n, 2) r and z along an edge, both ends among them [m]."""
    if edge.centre is None:
        return np.array([edge.start, edge.end])
    start, turn = edge.angles
    return arc(math.dist(edge.centre, edge.start), start, turn, edge.centre)


def _extruded(name: str, plan: Loops, thickness: float, y: float = 0.0, **others: Any) -> BodyViews:
    """Return the views of what is as thick everywhere, cut beside the height ``y`` [m]: clamped where the section
    crosses lines ``clamp`` in plan; ``others``: fields of the views."""
    y += BESIDE * float(np.ptp(plan[0]))
    cut, touching = (crossings(loops, y).reshape(-1, 2).tolist() for loops in (plan, others.get("contact", ())))
    return BodyViews(
        name,
        section=tuple(box((low, -thickness), (high, 0.0)) for low, high in cut),
        struck=tuple(np.array([(low, 0.0), (high, 0.0)]) for low, high in touching),
        plan=plan,
        **{
            "held": tuple(
                np.array([(x, -thickness), (x, 0.0)]) for x in np.unique(crossings(others.get("clamp", ()), y))
            )
        }
        | others,
    )


def draw_prism(name: str, sides: tuple[float, float], patch: tuple[float, float] | None, height: float) -> BodyViews:
    """Return the views of an upright block of half ``sides`` along x and y [m], struck on all of its top or on a patch
    of half the sides ``patch``, clamped below."""
    (x, y), (px, py) = sides, patch or sides
    sizes = [Size("section", 0, -x, x, -height), Size("section", 1, -height, 0.0, x), Size("plan", 1, -y, y, x)]
    if patch is not None:
        sizes.append(Size("section", 0, -px, px, 0.0, f"struck {{}} x {length_text(2 * py)}"))
    plan, contact = (box((-a, -b), (a, b)) for a, b in (sides, (px, py)))
    below = (np.array([(-x, -height), (x, -height)]),)
    return _extruded(name, (plan,), height, contact=(contact,), held=below, sizes=tuple(sizes))


def draw_flat(name: str, plan: Loops, thickness: float, clamp: Loops = (), contact: Loops = ()) -> BodyViews:
    """Return the views of a reed with loops ``plan`` about the place at which it touches [m], clamped along lines."""
    (left, low), (right, high) = plan[0].min(axis=0).tolist(), plan[0].max(axis=0).tolist()
    sizes = [
        Size("section", 1, -thickness, 0.0, right, "t {}"),
        Size("plan", 1, low, high, right),
        Size("plan", 0, left, right, low),
    ]
    if len(clamp) and not np.array_equal(clamp[0][0], clamp[0][-1]):  # a straight edge
        root = float(clamp[0][:, 0].mean())
        if 1e-9 < abs(root) / (right - left) < 1 - 1e-9:
            sizes.append(Size("plan", 0, min(root, 0.0), max(root, 0.0), 0.0))
    return _extruded(name, plan, thickness, clamp=clamp, contact=contact, sizes=tuple(sizes), mirrored=True)


def draw_sheet(name: str, flat: Flat, contact: Loops) -> BodyViews:
    """Return the views of a flat sheet that touches with what lies in ``contact``, loops about its own centre [m]."""
    centre, edge = np.array(flat.centre), flat.held_loop
    ends = _clamped_ends(flat) - centre
    clamp = ((ends,) if len(ends) else ()) if edge is None else closed([polygon(edge)[0] - centre])
    return draw_flat(name, tuple(polygon(loop)[0] - centre for loop in flat.drawn), flat.thickness, clamp, contact)


def _clamped_ends(flat: Flat) -> Array:
    """Return the (2, 2) ends of the straight line along which a sheet is clamped [m]; (0, 2) of a free one."""
    corners = polygon(flat.around[0])[0]
    held = corners[flat.clamped(corners)] if flat.is_clamped and flat.held_loop is None else corners[:0]
    if len(held) < 2:
        return np.zeros((0, 2))
    along = held[:, int(np.ptp(held[:, 1]) >= np.ptp(held[:, 0]))]
    return np.asarray(held[[int(np.argmin(along)), int(np.argmax(along))]])


def draw_beam(
    name: str, widths: Sequence[tuple[float, float]], thickness: float, at: float, *, both_ends: bool = False
) -> BodyViews:
    """Return the views of a beam of ``widths`` [position, width] from its clamp on, met at the position ``at`` [m]."""
    low, high = (np.array(widths) * (1.0, side) - (at, 0.0) for side in (-0.5, 0.5))
    clamp = tuple(np.array([low[k], high[k]]) for k in ((0, -1) if both_ends else (0,)))
    return draw_flat(name, (np.concatenate([low, high[::-1]]),), thickness, clamp)


def draw_ported_plate(
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
    centres = ports - ports[list(struck)].mean(axis=0)
    whole, within = (loop - ports[list(struck)].mean(axis=0) for loop in (outline, rim))
    openings, lands = (tuple(arc(radius) + centre for centre in centres) for radius in radii)
    x, y = (0.0, 0.0) if len(struck) == 1 else centres[struck[0]].tolist()
    cut, inner = (crossings([loop], y + BESIDE * float(np.ptp(whole))) for loop in (whole, within))
    first, last = float(cut[0]), float(cut[-1])
    sides = (first, inner[0]), (inner[-1], last)
    return _extruded(
        "valve plate",
        (whole, *openings),
        thickness,
        y,
        contact=tuple(loop for k in struck for loop in (lands[k], openings[k])),
        held=tuple(np.array([(low, -thickness), (high, -thickness)]) for low, high in sides),
        edges=closed(lands),
        port=tuple(openings[k] for k in struck),
        sizes=(
            Size("section", 0, first, last, -thickness),
            Size("section", 1, -thickness, 0.0, last),
            Size("section", 0, x - hole, x + hole, -thickness, "port Ø {}"),
            Size("section", 0, x + hole, x + land, 0.0, "land {}"),
        ),
    )
