"""Bodies in motion: a surface in frames, for pictures, reports and other programs."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from impact.after.histories import Pieces
from impact.greens.base import Array
from impact.pictures.drawing import PictureError
from impact.quantities import scaled, text
from seatfem.pictures import rendering, skins
from seatfem.structures.elements.mindlin import PlateMesh

Integers = NDArray[np.int64]

FROM_THE_SEAT: Final[rendering.View] = (0.5, -1.0, -0.42)  # view in which the plate does not hide the lip below it
MODE, WAVE, LANDING = 0.08, 0.05, 0.16
"""Largest drawn displacement over the size of the body: of modes, stress waves, landings."""
ALMOST: Final = 0.98  # quantile of the stress over all times that ends the colour scale
FULL: Final = 0.5  # force per length at the end of the lip's colour scale, over the largest
CLEAR: Final = 0.01  # distance, over the plate's size, by which the lip is drawn lower, to be visible
MARGIN_SPAN: Final = 4.0  # end of the scale of margins over the least margin


@dataclass(frozen=True, eq=False)
class Overlay:
    """Quadrilaterals beside a body, such as the lip below a plate.

    Attributes:
        points: corners (4 m, 3), four per quadrilateral, without their heights [m].
        height: height (4 m,) of each corner, exaggerated like the displacement of the body [m].
        values: values (F, m) of the colours.
        full: end of the colour scale, which begins at 0.
        words: meaning of the colours.
    """

    points: Array
    height: Array
    values: Array
    full: float
    words: str


@dataclass(frozen=True, eq=False)
class Frames:
    """Body in F frames: modes, times of a run, or a single state.

    Attributes:
        title: title of the picture.
        points: points at rest (n, 3) [m].
        triangles: point numbers (m, 3).
        displacement: displacements (F, n, 3) [m]; modes have a largest one of 1.
        labels: label of each frame (F,).
        time: times (F,) [s]; ``None`` for modes.
        values: values (F, n) of the colours, nan where unknown; ``None``: the magnitude of displacement.
        quantity, unit: name and unit of the values.
        low, high: ends of the colour scale.
        note: sentence below the picture.
        before: number of triangles before decimation.
        frequency, modal_mass: frequencies (F,) of modes [Hz], modal masses for these shapes [kg]; ``None``: unknown.
        overlay: quadrilaterals beside the body, or ``None``.
        view: direction to the camera.
        drawn: largest drawn displacement over the size of the body.
        logarithmic: whether the colour scale of pictures is logarithmic, the darkest colour at its low end.
    """

    title: str
    points: Array
    triangles: Integers
    displacement: Array
    labels: tuple[str, ...]
    time: Array | None = None
    values: Array | None = None
    quantity: str = ""
    unit: str = ""
    low: float = 0.0
    high: float = 1.0
    note: str = ""
    before: int = 0
    frequency: Array | None = None
    modal_mass: Array | None = None
    overlay: Overlay | None = None
    view: rendering.View = rendering.ABOVE
    drawn: float = MODE
    logarithmic: bool = False

    def check(self) -> None:
        """Raise `PictureError` if the shapes of the arrays are inconsistent."""
        frames, count = len(self.labels), len(self.points) if self.points.ndim == 2 else -1
        whole = self.points.shape == (count, 3) and self.triangles.ndim == 2 and self.triangles.shape[1] == 3
        inside = self.triangles.size == 0 or (self.triangles.min() >= 0 and self.triangles.max() < count)
        each = all(one is None or one.shape == (frames,) for one in (self.time, self.frequency, self.modal_mass))
        fits = self.displacement.shape == (frames, count, 3) and each
        if not whole or not inside or not fits or not frames or not len(self.triangles):
            raise PictureError(
                f"{frames} frames of {count} points need as many displacements, not {self.displacement.shape}"
            )
        if self.values is not None and self.values.shape != (frames, count):
            raise PictureError(f"{frames} frames of {count} points need as many values, not {self.values.shape}")

    @property
    def size(self) -> float:
        """Return the largest extent along an axis [m]."""
        return float(np.ptp(self.points, axis=0).max())

    @property
    def largest(self) -> float:
        """Return the largest displacement in all frames; 1 if nothing moves."""
        return float(np.linalg.norm(self.displacement, axis=2).max()) or 1.0

    @property
    def exaggeration(self) -> float:
        """Return the factor of drawn over true displacements; for times of a run one of 1, 2, 5, 10, 20, ..."""
        farthest = max(self.largest, 0.0 if self.overlay is None else float(np.abs(self.overlay.height).max()))
        factor = self.drawn * self.size / farthest
        if self.time is None:
            return factor
        steps = np.outer(10.0 ** np.arange(-3, 12), [1, 2, 5]).ravel()
        return float(steps[max(0, int(np.searchsorted(steps, factor, side="right")) - 1)])

    @property
    def colours(self) -> Array:
        """Return the values (F, n) of the colours; without values the magnitude of displacement over the largest."""
        if self.values is not None:
            return self.values
        return np.asarray(np.linalg.norm(self.displacement, axis=2) / self.largest)

    @property
    def colour_scale(self) -> tuple[float, str]:
        """Return the factor on the values and the label of the colour scale."""
        if self.values is None:
            return 1.0, "magnitude of displacement, largest = 1"
        factor, unit = scaled(max(abs(self.low), abs(self.high)), self.unit)
        return factor, f"{self.quantity} [{unit}]" if unit else self.quantity

    def footer(self) -> str:
        """Return the text below a picture."""
        if self.time is None:
            return self.note
        words = f"displacements {self.exaggeration:g} times" + (
            "" if self.overlay is None else f"; {self.overlay.words}"
        )
        return f"{self.note}\n{words}"


def mode_frames(
    skin: skins.Skin, shapes: Sequence[Array], labels: Sequence[str], title: str, frequency: Array | None = None
) -> Frames:
    """Return frames of mode shapes (n, 3) at the skin's points, scaled to 1; with ``frequency`` [Hz] and modal
    masses."""
    largest = np.array([float(np.linalg.norm(shape, axis=1).max()) or 1.0 for shape in shapes])
    masses = None if frequency is None else largest**-2.0
    moved = np.array(shapes) / largest[:, None, None]
    frames = Frames(title, skin.points, skin.triangles, moved, tuple(labels))
    return replace(frames, frequency=frequency, modal_mass=masses)


def wave_frames(
    title: str,
    skin: skins.Skin,
    mises: Array,
    displacement: Array,
    time: Array,
    touch: float,
    known: NDArray[np.bool_],
    note: str = "",
) -> Frames:
    """Return frames of a stress wave in the surface of a body.

    Args:
        skin: visible surface, with S nodes.
        mises: von Mises stress (F, S) [Pa]; nan where unknown.
        displacement: displacements (F, S, 3) of the nodes [m].
        time: times (F,) [s].
        touch: time of the first touch [s].
        known: mask (S,) of nodes away from singular edges, which determine the colour scale.
        note: text added below the picture.

    Raises:
        PictureError: no stress is known anywhere, or shapes of arrays are inconsistent.
    """
    frames = len(time)
    if mises.shape != (frames, len(skin.nodes)) or displacement.shape != (*mises.shape, 3):
        raise PictureError(
            f"{frames} frames of {len(skin.nodes)} nodes need as many values, not {mises.shape}, {displacement.shape}"
        )
    if not known.any() or not np.isfinite(mises[:, known]).any():
        raise PictureError("no stress is computed anywhere on this body: lower stress.distance")
    end = float(np.nanquantile(mises[:, known], ALMOST)) or 1.0  # beyond it: the short first touch
    since = (f"touch {'+' if now >= touch else '-'} {text(abs(float(now) - touch), 's')}" for now in time)
    return Frames(
        title, skin.points, skin.triangles, np.array([skin.moved(each) for each in displacement]),
        tuple(f"{text(float(now), 's', 5)} ({words})" for now, words in zip(time, since, strict=True)),
        time, mises[:, skin.which], "von Mises", "Pa", 0.0, end,
        f"The scale ends at {text(end, 'Pa')}, below which 98 % of all stress lies{note}.", drawn=WAVE,
    )  # fmt: skip


def peak_frames(skin: skins.Skin, mises: Array, words: str) -> Frames:
    """Return a frame of the largest von Mises stress (S,) of a run at the nodes of a body's skin, nan where unknown;
    ``words``: its label."""
    return Frames(
        "", skin.points, skin.triangles, np.zeros((1, *skin.points.shape)), (words,), None, mises[None, skin.which],
        "largest von Mises", "Pa", 0.0, float(np.nanmax(mises)) or 1.0, "grey: no stress is reported",
    )  # fmt: skip


def landing_frames(
    mesh: PlateMesh,
    deflection: Array,
    time: Array,
    edges: tuple[Array, Array],
    height: Array,
    force: Array,
    total: Array,
    *,
    averaged: str = "",
    pieces: Pieces = (),
) -> Frames:
    """Return frames of a landing plate, coloured by its deflection away from the seat, and of the lip below it.

    Args:
        mesh: mesh of the plate.
        deflection: deflection (F, n) of its nodes away from the seat [m].
        time: times (F,) [s].
        edges: ends (m N, 2, 2) of the m segments in each of N arcs, on the lip's inner and outer edge [m].
        height: height (N,) of the arcs relative to the undeformed plate, negative [m].
        force: force per length (F, N) on each arc [N/m]; ``total``: total force (F,) [N].
        averaged: averaging of the forces, in words.
        pieces: pieces of the lip, as in `impact.after.histories`.

    Raises:
        PictureError: shapes of arrays are inconsistent.
    """
    frames, arcs = force.shape
    if not len(time) == len(total) == len(deflection) == frames or len(height) != arcs:
        raise PictureError(
            f"{frames} pictures of {arcs} arcs need as many times and heights, not {len(time)} and {len(height)}"
        )
    skin = skins.skin_of_plate(mesh)
    shown, full = deflection[:, skin.nodes], FULL * float(force.max()) or 1.0
    moved = np.zeros((*shown.shape, 3))
    moved[..., 2] = shown
    lip = Overlay(
        *_lip(edges, height, CLEAR * skin.size, pieces),
        np.repeat(force, len(edges[0]) // arcs, axis=1), full, f"lip orange from {text(full, 'N/m')} on",
    )  # fmt: skip
    times = zip(time, total, strict=True)
    return Frames(
        "The plate as it lands", skin.points, skin.triangles, moved,
        tuple(f"{text(float(now), 's', 5)}, force {text(float(sum_), 'N')}" for now, sum_ in times),
        time, shown, "deflection", "m", float(shown.min()), float(shown.max()),
        f"Positive away from the seat; {averaged}.", overlay=lip, view=FROM_THE_SEAT, drawn=LANDING,
    )  # fmt: skip


def _lip(edges: tuple[Array, Array], height: Array, clear: float, pieces: Pieces) -> tuple[Array, Array]:
    """Return corners and heights of a lip; heights are interpolated linearly between the arc centres of each piece."""
    inner, outer = edges
    arcs, count = len(height), len(inner)
    places = (np.arange(count)[:, None] + (0, 1)) / count
    middles, heights, first = (np.arange(arcs) + 0.5) / arcs, np.empty(places.shape), 0
    for number, closed in pieces or ((arcs, True),):
        members, cells = slice(first, first + number), slice(first * count // arcs, (first + number) * count // arcs)
        around = {"period": number / arcs} if closed else {}
        heights[cells] = np.interp(places[cells], middles[members], height[members], **around)
        first += number
    corners = np.concatenate([inner, outer[:, ::-1]], axis=1).reshape(-1, 2)
    return np.column_stack([corners, np.full(len(corners), -clear)]), heights[:, [0, 1, 1, 0]].ravel()


def margin_frames(body: str, skin: skins.Skin, margins: Array) -> Frames:
    """Return a frame of fatigue margins (S,) at the nodes of a body's skin, inf without damage, nan where not assessed,
    in a logarithmic colour scale from the least margin to `MARGIN_SPAN` times it."""
    finite, label, least = np.isfinite(margins), "", 1.0
    if finite.any():
        k = int(np.nanargmin(margins))
        least, place = float(margins[k]), skin.points[int(np.flatnonzero(skin.which == k)[0])]
        if skin.angles is not None and len(skin.nodes) < len(skin.points):
            place = np.array([np.hypot(place[0], place[1]), place[2]])
        label = f"{body}: least margin {least:.3g}, at ({', '.join(f'{1e3 * x:.3g}' for x in place)}) mm"
    return Frames(
        body, skin.points, skin.triangles, np.zeros((1, *skin.points.shape)), (label,), None, margins[None, skin.which],
        "margin", low=least, high=MARGIN_SPAN * least, logarithmic=True,
    )  # fmt: skip
