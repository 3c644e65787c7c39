"""Figures of a run to be zoomed into, by plotly, and bodies in motion to be turned, in a browser."""

from __future__ import annotations

import base64
import html
import itertools
import json
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from importlib import resources
from string import Template
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from impact import measures
from impact.after.result import ImpactResult
from impact.files.safe_files import MB
from impact.greens.base import Array, GreensFunction
from impact.pictures.drawing import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY
from impact.pictures.greens_plots import sampled_filter
from impact.pictures.lip_plots import BODIES, COLOUR, LandingMark, landing_marks, shown_contact, value_at
from impact.quantities import scaled
from seatfem.pictures import cell_grid, frames, moving
from seatfem.structures.rings import as_a_whole

if TYPE_CHECKING:
    from plotly.graph_objects import Figure


MOST_OF_BODIES: Final = 3 * MB  # most bytes of numbers of bodies, before base64 makes them a third longer
HINT: Final = (
    "Drag or use the arrow keys to turn, Shift and drag to move, + and - (or the wheel, once clicked) to zoom, 0 to "
    "reset, the space bar to play; a click on the body tells the values there; a section takes away "
    "the half that faces you when it is chosen, and shows the inside of the surface in the colour of sand."
)

UNDRAWN: Final = "This browser does not draw it (no WebGL 2); the pictures below show it at rest."


def body_figure(name: str, made: frames.Frames, most: int = MOST_OF_BODIES) -> str:
    """Return canvas, controls and numbers of a body, ``most`` bytes before coding; all its text is escaped."""
    shown = _thinned(made, most)
    labels = "".join(f'<option value="{k}">{html.escape(label)}</option>' for k, label in enumerate(shown.labels))
    picked, coloured = f'<label>mode <select data-of="frame">{labels}</select></label>', ""
    if shown.time is not None:
        steps = f'value="0" step="1" max="{len(shown.labels) - 1}"'
        picked = (
            f'<label>time <input type="range" data-of="frame" min="0" {steps}></label><output data-of="label"></output>'
        )
    if shown.values is not None:
        choices = f'<option value="1">{html.escape(shown.quantity)}</option><option value="0">displacement</option>'
        coloured = f'<label>colour <select data-of="colour">{choices}</select></label>'
    return Template(" ".join(part_of_page("body.html").split())).substitute(
        name=html.escape(name),
        title=html.escape(made.title),
        picked=picked,
        coloured=coloured,
        axes=_axes(made),
        hint=html.escape(HINT),
        undrawn=UNDRAWN,
        notes=html.escape(" ".join(_notes(made, shown))),
        data=json.dumps(_numbers(shown)).replace("<", "\\u003c"),
    )


def part_of_page(name: str) -> str:
    """Return markup, style or script of pages, which lie beside this module."""
    return resources.files(__package__).joinpath(name).read_text(encoding="utf-8")


def _axes(made: frames.Frames) -> str:
    """Return the axes across which a body can be cut: those along which it has an extent."""
    extents = np.ptp(made.points, axis=0)
    across = (f'<option value="{k}">{name}</option>' for k, name in enumerate("xyz") if extents[k] > 0)
    return "".join(('<option value="">off</option>', *across))


def _thinned(made: frames.Frames, most: int) -> frames.Frames:
    """Return every k-th frame, with the least k whose frames fit."""
    each = len(made.points) * (6 + 2 * (made.values is not None))
    room = max(each, most - 12 * (len(made.points) + len(made.triangles)))
    stride = math.ceil(each * len(made.labels) / room)
    if stride == 1:
        return made
    kept = slice(None, None, stride)
    return replace(
        made,
        displacement=made.displacement[kept],
        labels=made.labels[kept],
        time=None if made.time is None else made.time[kept],
        values=None if made.values is None else made.values[kept],
    )


def _notes(made: frames.Frames, shown: frames.Frames) -> Iterator[str]:
    if made.time is None:
        yield "Displacements are relative, the largest is 1."
    if made.note:
        yield made.note
    count = len(made.triangles)
    if made.before > count:
        yield f"Of {made.before:,} triangles of the surface {count:,} are drawn, on corners of the mesh."
    if len(shown.labels) < len(made.labels):
        yield f"Of {len(made.labels)} frames {len(shown.labels)} are in this page; seatfem export --to vtk writes all."
    if made.values is not None and np.isnan(made.values).any():
        yield "Grey: no value was computed."


def _numbers(made: frames.Frames) -> dict[str, Any]:
    """Return what the script draws: arrays in base64, little-endian."""
    outward = cell_grid.wound_outward(made.points, made.triangles)
    factor, unit = scaled(max(abs(made.low), abs(made.high)), made.unit) if made.values is not None else (1.0, "")
    rate, moved = (1.0, "") if made.time is None else scaled(made.largest, "m")
    return {
        "points": _coded(made.points - (made.points.min(axis=0) + made.points.max(axis=0)) / 2, "<f4"),
        "centre": ((made.points.min(axis=0) + made.points.max(axis=0)) / 2).tolist(),
        "triangles": _coded(made.triangles if outward is None else outward, "<u4"),
        "closed": outward is not None,
        "displacement": _coded(moving.steps_of_displacement(made), "<i2"),
        "values": None if made.values is None else _coded(moving.steps_of_values(made), "<u2"),
        "finest": moving.FINEST,
        "untold": moving.UNTOLD,
        "labels": list(made.labels),
        "modes": made.time is None,
        "first": 0 if made.time is None else int(np.linalg.norm(made.displacement, axis=2).max(axis=1).argmax()),
        "largest": made.largest,
        "size": made.size,
        "quantity": made.quantity,
        "low": factor * made.low,
        "high": factor * made.high,
        "unit": unit,
        "moved": rate * made.largest if made.time is not None else 1.0,
        "moved_unit": moved,
    }


def _coded(values: NDArray[Any], kind: str) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode("ascii")


Landings = Sequence[Mapping[str, object]]  # landings as summary.json lists them
MOST: Final = 6000  # most points of a curve in contact, and as many beside: the smallest and largest of each bin
MARGIN: Final = 0.05  # time shown before and after all contacts, over their duration
CELLS: Final = 400  # columns of a map along time
PULSES: Final = 60  # time over which a Green's function is shown, in widths of the pulse
LINES: Final[Mapping[str, tuple[str, str]]] = {"wave": ("elastic seat", BLUE), "spring": ("spring baseline", ORANGE)}
SOURCES: Final = (BLUE, ORANGE, GREEN, PURPLE, SKY, GREY, "#E69F00", "#000000")


def force_figure(runs: Mapping[str, ImpactResult], width: float, landings: Landings = ()) -> Figure:
    """Draw contact force averaged over ``width`` [s], and raw, of seat and spring; the landings on the seat marked, the
    hardest of them shown first."""
    marks = landing_marks(landings)
    figure, (factor, unit) = _Along(runs, width, landings), scaled(_largest(runs, "force"), "N")
    for name, (label, colour) in LINES.items():
        if name in runs:
            mean = measures.filtered_force(runs[name], width)
            figure.line(runs[name], factor * mean, f"{label}, mean over {1e6 * width:g} µs", colour)
            figure.line(runs[name], factor * runs[name].force, f"{label}, raw", colour, hidden=True)
    figure.mark(marks, lambda mark: (mark.peak_time, factor * mark.peak))
    return figure.figure(f"contact force [{unit}]")


def motion_figure(runs: Mapping[str, ImpactResult], landings: Landings = ()) -> Figure:
    """Draw displacements of reed and seat, and the gap between them; landings on seat and stopper marked."""
    figure, (factor, unit) = _Along(runs), scaled(_largest(runs, "striker_displacement"), "m")
    for name, (label, colour) in LINES.items():
        if name in runs:
            run = runs[name]
            figure.line(run, factor * run.striker_displacement, f"reed, {label}", colour)
            figure.line(run, factor * run.gap, f"gap, {label}", colour, dash="dot", hidden=True)
    if "wave" in runs:
        wave = runs["wave"]
        figure.line(wave, factor * wave.target_displacement, "seat", GREEN)
        course = factor * wave.striker_displacement
        for body in BODIES:
            figure.mark(landing_marks(landings, body), lambda mark: (mark.start, value_at(wave, course, mark.start)))
    return figure.figure(f"displacement [{unit}]", zoomed=False)


def energy_figure(run: ImpactResult) -> Figure:
    """Draw where the energy is, each term integrated by itself."""
    figure, ledger = _Along({"wave": run}), run.energy
    terms = (
        ("energy input", ledger.input, GREY), ("reed", ledger.striker, ORANGE), ("seat", ledger.target, BLUE),
        ("dissipated", ledger.dissipated, PURPLE),
    )  # fmt: skip
    factor, unit = scaled(np.concatenate([term for _, term, _ in terms]), "J")
    for label, term, colour in terms:
        figure.line(run, factor * term, label, colour)
    return figure.figure(f"energy [{unit}]", zoomed=False)


def lip_figure(run: ImpactResult, arcs: int | None = None) -> Figure:
    """Draw force on each segment of the lip over time, the mean of each interval, while anything is pressed.

    ``arcs``: number of segments, each of equally many parts across; absent: each part is one.
    """
    first, last = _pressed([run])
    parts, time = run.force[first:last], run.time[first:last]
    force = parts.reshape(len(parts), arcs or parts.shape[1], -1).sum(axis=2)
    size = max(1, math.ceil(len(time) / CELLS))
    whole = len(time) // size * size
    mean = force[:whole].reshape(-1, size, force.shape[1]).mean(axis=1)
    factor, unit = scaled(float(mean.max(initial=0.0)), "N")
    rate, time_unit = scaled(float(time[-1]), "s")
    figure = _empty(f"time [{time_unit}]")
    names = [f"{k + 1}" for k in range(force.shape[1])]
    colours = {"colorscale": "Cividis", "colorbar": {"title": f"force [{unit}]"}}
    figure.add_heatmap(x=_short(rate * time[:whole:size]), y=names, z=_short(factor * mean.T), **colours)
    figure.update_layout(hovermode="closest")
    figure.update_yaxes(title="segment of the lip", showgrid=False)
    return figure


def greens_figure(greens: GreensFunction, width: float) -> Figure:
    """Draw the driving-point Green's function after a unit Hann pulse of ``width`` [s], over `PULSES` of it."""
    time, curve = sampled_filter(as_a_whole(greens), 48 * PULSES, width)
    (factor, unit), (rate, time_unit) = scaled(float(np.abs(curve).max()), "m/(N s)"), scaled(float(time[-1]), "s")
    figure = _empty(f"time [{time_unit}]")
    label = f"after a {1e6 * width:g} µs pulse"
    figure.add_scatter(x=_short(rate * time), y=_short(factor * curve), name=label, mode="lines", line={"color": BLUE})
    figure.update_yaxes(title=f"g [{unit}]")
    return figure


def budget_figure(shares: Mapping[str, Mapping[str, float]]) -> Figure:
    """Draw the error of each measure by source, relative [%]: source -> measure -> share."""
    figure = _empty("")
    for (source, of), colour in zip(shares.items(), SOURCES, strict=False):
        names, values = list(of), [100 * value for value in of.values()]
        figure.add_bar(y=names, x=_short(np.array(values)), name=source, marker={"color": colour}, orientation="h")
    bars = 60 + 40 * max(map(len, shares.values()), default=1)  # with 36 above them, and the legend below
    figure.update_layout(barmode="stack", height=bars + 156, margin={"b": 120}, legend={"y": -60 / bars})
    figure.update_xaxes(title="share of the error [% of the value]")
    figure.update_yaxes(automargin=True, autorange="reversed")
    return figure


class _Along:
    """A figure along time, of runs whose hardest landing is shown first, and in most detail; without landings, all
    contacts."""

    def __init__(self, runs: Mapping[str, ImpactResult], width: float = 0.0, landings: Landings = ()) -> None:
        shown = [runs[name] for name in LINES if name in runs]
        self._dense = _pressed(shown)
        if landing_marks(landings):
            (start, end), _ = shown_contact(shown, width, MARGIN, landings)
            first, last = np.searchsorted(shown[0].time, (start, end))
            self._dense = (int(first), max(int(last), int(first) + 1))
        time = shown[0].time
        margin = max(MARGIN * (time[self._dense[1] - 1] - time[self._dense[0]]), 20 * shown[0].dt)
        self._window = (time[self._dense[0]] - margin, time[self._dense[1] - 1] + margin)
        self._end = float(time[-1])
        self._curves: list[tuple[Array, dict[str, Any]]] = []

    def line(
        self, run: ImpactResult, values: Array, name: str, colour: str, *, dash: str = "solid", hidden: bool = False
    ) -> None:
        """Add a curve over the time of a run."""
        first, last = self._dense
        parts = [(0, first), (first, last), (last, len(values))]
        kept = np.concatenate([low + _envelope(values[low:high]) for low, high in parts])
        line = {"color": colour, "dash": dash, "width": 1.6}
        shown = {"visible": "legendonly" if hidden else True, "name": name, "mode": "lines", "line": line}
        self._curves.append((run.time[kept], {"y": _short(values[kept]), **shown}))

    def mark(self, marks: Sequence[LandingMark], place: Callable[[LandingMark], tuple[float, float]]) -> None:
        """Add numbered triangles at the ``place`` of each landing [s, value], the hardest filled; all of one body."""
        for hardest in (True, False):
            shown = [mark for mark in marks if mark.hardest is hardest]
            if not shown:
                continue
            time, values = np.transpose([place(mark) for mark in shown])
            shape = {"seat": "triangle-down", "stopper": "triangle-up"}[shown[0].body] + ("" if hardest else "-open")
            name = ("hardest " if hardest else "") + f"landing on the {shown[0].body}"
            texts = [f"<b>{mark.number}</b>" if hardest else f"{mark.number}" for mark in shown]
            style: dict[str, Any] = {"mode": "markers+text", "text": texts, "textposition": "top center", "name": name}
            look = {"symbol": shape, "size": 13 if hardest else 9, "color": COLOUR}
            style |= {"marker": look, "textfont": {"color": COLOUR}, "cliponaxis": False}
            self._curves.append((np.asarray(time), {"y": _short(values), **style}))

    def figure(self, quantity: str, *, zoomed: bool = True) -> Figure:
        """Return the figure; ``zoomed``: on the contacts, where they are short."""
        start, end = self._window
        near = zoomed and end - start < 0.5 * self._end
        rate, unit = scaled(end - start if near else self._end, "s")
        figure = _empty(f"time [{unit}]")
        for time, curve in self._curves:
            figure.add_scatter(x=_short(rate * time), **curve)
        if near:
            figure.update_xaxes(range=[rate * start, rate * end])
        figure.update_yaxes(title=quantity)
        return figure


def _pressed(runs: Sequence[ImpactResult]) -> tuple[int, int]:
    """Return the first step with force in any run, and the one after the last; all steps where none has."""
    steps = np.concatenate([np.flatnonzero(np.abs(run.force).reshape(len(run.time), -1).sum(axis=1)) for run in runs])
    return (int(steps.min()), int(steps.max()) + 1) if len(steps) else (0, len(runs[0].time))


def _empty(along: str) -> Figure:
    from plotly.graph_objects import Figure

    figure = Figure()
    legend = {"orientation": "h", "y": -0.22, "yanchor": "top"}
    font = {"family": "system-ui, sans-serif", "size": 13}
    margin = {"l": 70, "r": 20, "t": 36, "b": 60}
    figure.update_layout(template="simple_white", height=400, margin=margin, hovermode="x unified", legend=legend)
    figure.update_layout(font=font)
    figure.update_xaxes(title=along)
    return figure


def _envelope(values: Array) -> NDArray[np.int64]:
    """Return the indices of the values that are kept: all, or the smallest and largest of each bin and both ends."""
    if len(values) <= MOST:
        return np.arange(len(values), dtype=np.int64)
    edges = np.linspace(0, len(values), MOST // 2 + 1).astype(np.int64)
    bins = [(low, values[low:high]) for low, high in itertools.pairwise(edges)]
    kept = [low + int(pick) for low, part in bins for pick in (part.argmin(), part.argmax())]
    return np.unique(np.array([0, *kept, len(values) - 1], dtype=np.int64))


def _short(values: Array) -> list[Any]:
    """Return the values to six digits: what a screen can show, at a third of the size."""
    rounded = np.array([float(f"{value:.6g}") for value in np.ravel(values)]).reshape(np.shape(values))
    return list(rounded.tolist())


def _largest(runs: Mapping[str, ImpactResult], name: str) -> float:
    peaks: Sequence[float] = [float(np.abs(getattr(runs[key], name)).max()) for key in LINES if key in runs]
    return max(peaks, default=0.0)
