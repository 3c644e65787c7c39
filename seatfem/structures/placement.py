"""Where a flat reed lies over the lip of its seat, from the coordinates that both files have in common."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from impact.greens.base import Array
from seatfem.structures.inspection.outline import DrawnOutline
from seatfem.structures.inspection.shape import Shape
from seatfem.structures.lands import Land, axes_along
from seatfem.structures.lip import AnyLip, tilted
from seatfem.structures.shapes import loops
from seatfem.structures.shapes.faces import Frame, Vector
from seatfem.structures.shapes.inspect import triple

ROUND_OFF: Final = 1e-6  # [m], [rad]: what coordinates of exchange files are good for
EDGE_POINTS: Final = 721  # of each edge of a lip
BESIDE: Final = 1e-5  # [m]; what touches the reed's edge no further cuts into nothing


@dataclass(frozen=True)
class Placement:
    """A reed over a lip.

    Attributes:
        frame: of the reed, on the side that faces the lip: x from its clamp towards the lip, the normal away from it.
        lip: centre of the lip, seen in this frame [m].
        height: of the reed's side over that centre, along the normal [m].
        tilt, axis: angle between both planes, and the direction about which the reed is tilted, from x on [rad].
    """

    frame: Frame
    lip: tuple[float, float]
    height: float
    tilt: float
    axis: float


def facing_side(drawn: DrawnOutline, normal: Vector) -> tuple[Vector, Vector]:
    """Return a point on the side of a plate that faces a lip with this outward normal [m], and the plate's own normal
    away from the lip."""
    assert drawn.frame is not None
    assert drawn.normal is not None
    own, point = np.array(drawn.normal), np.array(drawn.frame.origin)
    up = own if own @ np.array(normal) > 0 else -own
    thickness = drawn.thickness or 0.0
    return triple(point - thickness * own if own @ up > 0 else point), triple(up)


def placed(land: Land, side: tuple[Vector, Vector], clamp: Array) -> Placement:
    """Return where a reed lies.

    Args:
        land: the lip's; seen in any directions.
        side: a point and the normal, as of `facing_side`.
        clamp: (2, 3) two points on the clamped line [m].
    """
    point, up = (np.array(each) for each in side)
    centre, lip_normal = np.array(land.centre), np.cross(land.x, land.y)
    line = (clamp[1] - clamp[0]) - (clamp[1] - clamp[0]) @ up * up
    foot = clamp.mean(axis=0)
    x = np.cross(line, up)
    x *= np.sign(x @ (centre - foot)) or 1.0
    x /= np.linalg.norm(x)
    frame = Frame(triple(foot - ((foot - point) @ up) * up), triple(x), triple(np.cross(up, x)))
    lip_axes = axes_along(lip_normal, triple(x))
    rise = -lip_axes[:2] @ up / (lip_normal @ up)  # of the opening, along the lip's x and y
    tilt = math.atan(float(np.hypot(*rise)))
    axis = math.atan2(-float(rise[0]), float(rise[1])) if tilt > ROUND_OFF else 0.0
    u, v = frame.seen(centre).tolist()
    return Placement(frame, (u, v), float((point - centre) @ up), tilt if tilt > ROUND_OFF else 0.0, axis)


def opening(lip: AnyLip, placement: Placement) -> tuple[float, float]:
    """Return the smallest opening between a reed and the centre lines of a lip, seen along its x axis, and how much
    smaller it is at the edges of the lip [m]."""
    middle, edges = (
        float(tilted(points, placement.tilt, placement.axis).min())
        for points in (lip.lines(), np.stack(lip.cuts(np.linspace(0.0, 1.0, EDGE_POINTS))))
    )
    return placement.height + middle, max(0.0, middle - edges)


def cut_by(shape: Shape, outline: Sequence[Array], placement: Placement, allowed: float) -> Vector | None:
    """Return a point at which a body rises through the reed's side that faces it [m]; ``None`` where it does nowhere.

    Args:
        shape: the body's surface.
        outline: loops (n, 3) around the reed and its holes, seen in the placement's frame.
        allowed: height by which it may [m].
    """
    frame = placement.frame
    height = (shape.points - np.array(frame.origin)) @ frame.normal - ROUND_OFF - allowed
    edges = shape.triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    edges = edges[(height[edges] > 0).sum(axis=1) == 1]
    if not len(edges):
        return None
    a, b = height[edges].T
    share = (a / (a - b))[:, None]
    met = shape.points[edges[:, 0]] + share * (shape.points[edges[:, 1]] - shape.points[edges[:, 0]])
    places = frame.seen(met)
    for point in met[loops.inside([loops.polygon(loop)[0] for loop in outline], places)]:
        if min(loops.nearest(loop, frame.seen(point)) for loop in outline) > BESIDE:
            return triple(point)
    return None
