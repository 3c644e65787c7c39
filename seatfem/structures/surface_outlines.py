"""Outlines of a body that is known by the triangles of its surface: parts from CAD, and meshes."""

from collections.abc import Iterable, Sequence
from typing import Final

import numpy as np

from impact.greens.base import Array
from seatfem.structures import errors, lands
from seatfem.structures.inspection.cad import Integers, Shape
from seatfem.structures.outlines import BESIDE, BodyViews, Loops, Size, length_text
from seatfem.structures.shapes.loops import are_holes, chained, rim

MOST_TRIANGLES: Final = 60_000
"""Most triangles of a surface that are filled in a plan; of a finer one the edges alone are drawn."""
SAME: Final = 1e-7  # distance of ends of lines that count as one point, over a body's size
PARALLEL: Final = 0.99  # least cosine between the normals of faces that count as parallel
LEVEL: Final = 1e-4  # distance of faces that count as in one plane, over a body's size: coordinates have few digits
ABOVE: Final = 0.5  # depth below the struck face, over the body's, down to which edges are shown in plan


def draw_surface(
    name: str,
    shape: Shape,
    rows: tuple[Integers, ...],
    struck: str,
    normal: Sequence[float] | None,
    held: tuple[str, ...] = (),
    bedded: tuple[str, ...] = (),
    along: Sequence[float] = (),
) -> BodyViews:
    """Return the views of a body from CAD or of a mesh: the section of its surface through the middle of the struck
    face, its faces and edges in plan.

    Args:
        name: name of the body.
        shape: triangles of its surface; ``rows``: those of each face.
        struck: name of the struck group; ``normal`` (3,): its outward normal, ``None`` where only its direction is
            known.
        held, bedded: groups that are clamped, and held by springs.
        along: direction that is drawn as x; (): as of `seatfem.structures.lands.axes_along`.

    Raises:
        ModelError: the struck group has no triangles.
    """
    if struck not in shape.groups or not len(shape.groups[struck]):
        raise errors.ModelError(f"drawing: the body has no face {struck!r} that could be struck; name one")
    axes, middle = _frame(shape, struck, normal, along)
    points, size = (shape.points - middle) @ axes.T, float(np.linalg.norm(shape.extent))
    seen, used = points[:, :2], points[np.unique(shape.triangles)]
    (left, _, base), (right, _, _) = used.min(axis=0).tolist(), used.max(axis=0).tolist()

    def cut_group(names: Iterable[str]) -> Loops:
        cut = [shape.groups[each] for each in names if each in shape.groups]
        return tuple(_cut(points[shape.triangles[np.concatenate(cut)]], size)) if cut else ()

    outline = chained(seen[shape.outline(struck)], SAME * size)
    rims = (rim(shape.triangles[part]) for part in rows)  # of its faces
    edges = np.unique(np.concatenate([np.zeros((0, 2), dtype=np.int64), *rims]), axis=0)
    clamp = [
        seen[shape.outline(each)]
        for each in held
        if each in shape.groups and points[shape.triangles[shape.groups[each]], 2].mean() > ABOVE * base
    ]
    (first, low), (last, high) = (end(np.concatenate(outline), axis=0).tolist() for end in (np.min, np.max))
    return BodyViews(
        name,
        note=_turned_words(axes),
        section=tuple(chained(_cut(points[shape.triangles], size), SAME * size)),
        struck=cut_group([struck]),
        held=cut_group(held),
        bedded=cut_group(bedded),
        triangles=seen[shape.triangles] if len(shape.triangles) <= MOST_TRIANGLES else None,
        edges=tuple(seen[edges[points[edges][:, :, 2].mean(axis=1) > ABOVE * base]]),
        contact=tuple(outline),
        port=tuple(loop for loop, is_hole in zip(outline, are_holes(outline), strict=True) if is_hole),
        clamp=tuple(line for lines in clamp for line in lines),
        sizes=(
            Size("section", 1, base, 0.0, right),
            Size("section", 0, left, right, base),
            Size("section", 0, first, last, 0.0, f"struck face {{}} x {length_text(high - low)}"),
        ),
    )


def _frame(shape: Shape, struck: str, given: Sequence[float] | None, along: Sequence[float]) -> tuple[Array, Array]:
    """Return the (3, 3) directions x, y, z of the drawing in the body's axes, and (3,) the struck face's middle [m].

    As of a land (`seatfem.structures.lands.axes_along`). A normal of unknown sign points away from the body's middle.
    """
    rows = shape.groups[struck]
    areas = shape.areas[rows]
    middle = np.average(shape.points[shape.triangles[rows]].mean(axis=1), axis=0, weights=areas)
    if given is None:
        normal = shape.normal(struck)
        z = np.array([0.0, 0.0, 1.0]) if normal is None else np.array(normal)
        inner = shape.points[np.unique(shape.triangles)].mean(axis=0)
        z = z if (middle - inner) @ z >= 0 else -z
    else:
        z = np.array(given)
    return lands.axes_along(z, along), middle


def _turned_words(axes: Array) -> str:
    """Return how the drawing turns a file whose struck face does not look along its z axis."""
    z = float(axes[2, 2])
    if z > PARALLEL:
        return ""
    if z < -PARALLEL:
        return "is drawn upside down: its contact face looks along -z of its file"
    words = ", ".join(f"{each:.2g}" for each in axes[2] + 0.0)
    return f"is turned for the drawing: its contact face looks along ({words}) of its file"


def _cut(corners: Array, size: float) -> Array:
    """Return (s, 2, 2) lines x, z in which triangles (m, 3, 3) meet y = 0, beside which it is taken by `BESIDE`."""
    height = corners[:, :, 1] - BESIDE * size
    over = height > 0
    met = over.any(axis=1) & ~over.all(axis=1)
    corners, height, over = corners[met], height[met], over[met]
    alone = np.where(over.sum(axis=1) == 1, over.argmax(axis=1), (~over).argmax(axis=1))
    each = np.arange(len(corners))
    ends = []
    for step in (1, 2):
        other = (alone + step) % 3
        a, b = height[each, alone], height[each, other]
        share = (a / (a - b))[:, None]
        ends.append(corners[each, alone] + share * (corners[each, other] - corners[each, alone]))
    return np.stack(ends, axis=1)[:, :, [0, 2]]


def struck_side_problem(
    normals: Array, shape: Shape, struck: str, held: Sequence[str], bedded: Sequence[str] = ()
) -> str:
    """Return why no reed can lie before what is struck, "" where nothing speaks against it.

    Args:
        normals: (k, 3) outward normals of the flat parts of the struck face.
        shape: the body's surface.
        struck: name of the struck group.
        held, bedded: groups that are clamped, and that springs hold; what is struck and clamped is checked with a mesh.
    """
    aligned = normals @ normals[0]
    if np.abs(aligned).min() > PARALLEL and aligned.min() < 0:
        return (
            "its faces look to opposite sides of the body, a reed lies on one: name the faces of the side on which the "
            "reed lies"
        )
    if np.abs(aligned).min() < PARALLEL or struck not in shape.groups:
        return ""
    plane = shape.points[np.unique(shape.triangles[shape.groups[struck]])]
    height, size = float((plane @ normals[0]).mean()), float(np.linalg.norm(shape.extent))
    border = {tuple(edge) for edge in shape.outline(struck).tolist()}
    for name in (*held, *bedded):
        if name not in shape.groups:
            continue
        if len(np.intersect1d(shape.groups[name], shape.groups[struck])):
            if name not in bedded:
                continue
            return (
                f"a part of {name!r}, which is held, is struck: the reed would lie on what holds the body; name another"
            )
        away = np.abs(shape.points[np.unique(shape.triangles[shape.groups[name]])] @ normals[0] - height).max()
        if away < LEVEL * size and border & {tuple(edge) for edge in shape.outline(name).tolist()}:
            return (
                f"it lies in the plane of {name!r}, which is held, and ends where that begins, as on the underside "
                "of a seat: the reed would lie on what holds the body; name the face on the reed's side"
            )
    return ""
