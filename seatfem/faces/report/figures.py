"""Interactive figures of a run: curves by plotly that can be zoomed, and moving bodies in WebGL that can be turned."""

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
from impact.pictures.lip_plots import BODIES, COLOUR, NAMES, LandingMark, landing_marks, shown_contact, value_at
from impact.pictures.plots import sampled_filter
from impact.quantities import scaled
from seatfem.pictures import frames, moving, skins
from seatfem.structures.rings import join_all_parts

if TYPE_CHECKING:
    from plotly.graph_objects import Figure


MOST_OF_BODIES: Final = 3 * MB  # largest size of the arrays of all bodies [bytes], before base64 adds a third
HINT: Final = (
    "Drag or use the arrow keys to turn, Shift and drag to move, + and - (or the wheel, once clicked) to zoom, 0 to "
    "reset, the space bar to play; a click on the body tells the values there; a section takes away "
    "the half that faces you when it is chosen, and shows the inside of the surface in the colour of sand."
)

UNDRAWN: Final = "This browser does not draw it (no WebGL 2); the pictures below show it at rest."


def body_figure(name: str, motion: frames.Frames, most: int = MOST_OF_BODIES) -> str:
    """Return canvas, controls and arrays of a body as HTML, ``most`` bytes before base64; all its text is escaped."""
    shown = _thinned(motion, most)
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
        title=html.escape(motion.title),
        picked=picked,
        coloured=coloured,
        axes=_axes(motion),
        hint=html.escape(HINT),
        undrawn=UNDRAWN,
        notes=html.escape(" ".join(_notes(motion, shown))),
        data=json.dumps(_numbers(shown)).replace("<", "\\u003c"),
    )


def part_of_page(name: str) -> str:
    """Return a file of markup, style or script of the page, stored beside this module."""
    return resources.files(__package__).joinpath(name).read_text(encoding="utf-8")


def _axes(motion: frames.Frames) -> str:
    """Return the axes across which a body can be cut: those along which it has an extent."""
    extents = np.ptp(motion.points, axis=0)
    across = (f'<option value="{k}">{name}</option>' for k, name in enumerate("xyz") if extents[k] > 0)
    return "".join(('<option value="">off</option>', *across))


def _thinned(motion: frames.Frames, most: int) -> frames.Frames:
    """Return every k-th frame, with the smallest k whose frames fit in ``most`` bytes."""
    each = len(motion.points) * (6 + 2 * (motion.values is not None))
    room = max(each, most - 12 * (len(motion.points) + len(motion.triangles)))
    stride = math.ceil(each * len(motion.labels) / room)
    if stride == 1:
        return motion
    chosen = slice(None, None, stride)
    return replace(
        motion,
        displacement=motion.displacement[chosen],
        labels=motion.labels[chosen],
        time=None if motion.time is None else motion.time[chosen],
        values=None if motion.values is None else motion.values[chosen],
    )


def _notes(body: frames.Frames, shown: frames.Frames) -> Iterator[str]:
    if body.time is None:
        yield "Displacements are relative, the largest is 1."
    if body.note:
        yield body.note
    count = len(body.triangles)
    if body.before > count:
        yield f"Of {body.before:,} triangles of the surface {count:,} are drawn, on corners of the mesh."
    if len(shown.labels) < len(body.labels):
        yield f"Of {len(body.labels)} frames {len(shown.labels)} are in this page; seatfem export --to vtk writes all."
    if body.values is not None and np.isnan(body.values).any():
        yield "Grey: no value was computed."


def _numbers(body: frames.Frames) -> dict[str, Any]:
    """Return the data for the script: arrays in base64, little-endian."""
    outward = skins.wound_outward(body.points, body.triangles)
    factor, unit = scaled(max(abs(body.low), abs(body.high)), body.unit) if body.values is not None else (1.0, "")
    rate, moved = (1.0, "") if body.time is None else scaled(body.largest, "m")
    return {
        "points": _coded(body.points - (body.points.min(axis=0) + body.points.max(axis=0)) / 2, "<f4"),
        "centre": ((body.points.min(axis=0) + body.points.max(axis=0)) / 2).tolist(),
        "triangles": _coded(body.triangles if outward is None else outward, "<u4"),
        "closed": outward is not None,
        "displacement": _coded(moving.steps_of_displacement(body), "<i2"),
        "values": None if body.values is None else _coded(moving.steps_of_values(body), "<u2"),
        "finest": moving.FINEST,
        "untold": moving.UNTOLD,
        "labels": list(body.labels),
        "modes": body.time is None,
        "first": 0 if body.time is None else int(np.linalg.norm(body.displacement, axis=2).max(axis=1).argmax()),
        "largest": body.largest,
        "size": body.size,
        "quantity": body.quantity,
        "low": factor * body.low,
        "high": factor * body.high,
        "unit": unit,
        "moved": rate * body.largest if body.time is not None else 1.0,
        "moved_unit": moved,
    }


def _coded(values: NDArray[Any], kind: str) -> str:
    return base64.b64encode(np.ascontiguousarray(values, dtype=kind).tobytes()).decode("ascii")


Landings = Sequence[Mapping[str, object]]  # landings as listed in summary.json
MOST: Final = 6000  # largest number of points of a curve in contact, and also outside: smallest and largest of each bin
MARGIN: Final = 0.05  # time shown before and after all contacts, over their duration
CELLS: Final = 400  # number of columns of a map along time
PULSES: Final = 60  # time over which a Green's function is shown, in widths of the pulse
LINES: Final[Mapping[str, tuple[str, str]]] = {"wave": (NAMES[0], BLUE), "spring": (NAMES[1], ORANGE)}
SOURCES: Final = (BLUE, ORANGE, GREEN, PURPLE, SKY, GREY, "#E69F00", "#000000")


def force_figure(runs: Mapping[str, ImpactResult], width: float, landings: Landings = ()) -> Figure:
    """Draw the contact force averaged over ``width`` [s], and raw, of seat and spring; landings on the seat marked, the
    hardest shown first."""
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
    """Draw displacements of reed and seat and the gap between them; landings on seat and stopper are marked."""
    figure, (factor, unit) = _Along(runs), scaled(_largest(runs, "striker_displacement"), "m")
    for name, (label, colour) in LINES.items():
        if name in runs:
            run = runs[name]
            on = f", {label}" if "spring" in runs else ""
            figure.line(run, factor * run.striker_displacement, f"reed{on}", colour)
            figure.line(run, factor * run.gap, f"gap{on}", colour, dash="dot", hidden=True)
    if "wave" in runs:
        wave = runs["wave"]
        figure.line(wave, factor * wave.target_displacement, "seat", GREEN)
        course = factor * wave.striker_displacement
        for body in BODIES:
            figure.mark(landing_marks(landings, body), lambda mark: (mark.start, value_at(wave, course, mark.start)))
    return figure.figure(f"displacement [{unit}]", zoomed=False)


def energy_figure(run: ImpactResult) -> Figure:
    """Draw the terms of the energy balance, each integrated independently."""
    figure, ledger = _Along({"wave": run}), run.energy
    terms = (
        ("energy input", ledger.input, GREY), ("reed", ledger.striker, ORANGE), ("seat", ledger.target, BLUE),
        ("dissipated", ledger.dissipated, PURPLE),
    )  # fmt: skip
    factor, unit = scaled(np.concatenate([term for _, term, _ in terms]), "J")
    for label, term, colour in terms:
        figure.line(run, factor * term, label, colour)
    return figure.figure(f"energy [{unit}]", zoomed=False)


def lip_figure(run: ImpactResult, arcs: int = 0) -> Figure:
    """Draw a map of the force on each segment of the lip over time, averaged over intervals, during contact.

    ``arcs``: number of segments, each of equally many parts across; 0: each part is a segment.
    """
    first, last = _pressed([run])
    parts = run.rows.force[1:].reshape(len(run.rows.ends) - 1, arcs or run.rows.force.shape[1], -1).sum(axis=2)
    impulse = np.concatenate([np.zeros((1, parts.shape[1])), np.cumsum(parts * run.rows.spans[:, None], axis=0)])
    size = max(1, math.ceil((last - first) / CELLS))
    edges = np.arange(max(first - 1, 0), last, size)
    mean = np.diff(run.rows.find_motions(impulse, edges), axis=0) / (size * run.dt)
    time = np.asarray(run.dt * (edges[:-1] + 1), dtype=np.float64)
    factor, unit = scaled(float(mean.max(initial=0.0)), "N")
    rate, time_unit = scaled(run.dt * float(last), "s")
    figure = _empty(f"time [{time_unit}]")
    names = [f"{k + 1}" for k in range(parts.shape[1])]
    colours = {"colorscale": "Cividis", "colorbar": {"title": f"force [{unit}]"}}
    figure.add_heatmap(x=_short(rate * time), y=names, z=_short(factor * mean.T), **colours)
    figure.update_layout(hovermode="closest")
    figure.update_yaxes(title="segment of the lip", showgrid=False)
    return figure


def greens_figure(greens: GreensFunction, width: float) -> Figure:
    """Draw the driving-point Green's function after a unit Hann pulse of ``width`` [s], over `PULSES` widths."""
    time, curve = sampled_filter(join_all_parts(greens), 48 * PULSES, width)
    (factor, unit), (rate, time_unit) = scaled(float(np.abs(curve).max()), "m/(N s)"), scaled(float(time[-1]), "s")
    figure = _empty(f"time [{time_unit}]")
    label = f"after a {1e6 * width:g} µs pulse"
    figure.add_scatter(x=_short(rate * time), y=_short(factor * curve), name=label, mode="lines", line={"color": BLUE})
    figure.update_yaxes(title=f"g [{unit}]")
    return figure


def budget_figure(shares: Mapping[str, Mapping[str, float]], target: float = 0.0) -> Figure:
    """Draw the uncertainty of each measure by source, relative [%]; ``shares``: source -> measure -> fraction. A line
    marks a ``target`` above zero that was asked for, and the axis reaches beyond it and the largest uncertainty."""
    figure = _empty("")
    for (source, parts), colour in zip(shares.items(), SOURCES, strict=False):
        names, values = list(parts), [100 * value for value in parts.values()]
        figure.add_bar(y=names, x=_short(np.array(values)), name=source, marker={"color": colour}, orientation="h")
    bars = 60 + 40 * max(map(len, shares.values()), default=1)  # besides 36 px above them and the legend below
    figure.update_layout(barmode="stack", height=bars + 156, margin={"b": 120}, legend={"y": -60 / bars})
    figure.update_xaxes(title="uncertainty [% of the value]")
    figure.update_yaxes(automargin=True, autorange="reversed")
    if target:
        measured = {name for parts in shares.values() for name in parts}
        largest = max((sum(parts.get(name, 0.0) for parts in shares.values()) for name in measured), default=0.0)
        end = max(1.2 * target, 1.05 * largest)
        line = {"color": GREY, "dash": "dash", "width": 2}
        figure.add_vline(x=100 * target, line=line, opacity=1, annotation_text="asked")
        figure.update_xaxes(range=[0.0, 100 * end])
    return figure


class _Along:
    """Figure over the time of runs; the hardest landing, or without landings all contacts, is shown first and in most
    detail."""

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
        picks = np.concatenate([low + _envelope(values[low:high]) for low, high in parts])
        line = {"color": colour, "dash": dash, "width": 1.6}
        shown = {"visible": "legendonly" if hidden else True, "name": name, "mode": "lines", "line": line}
        self._curves.append((run.time[picks], {"y": _short(values[picks]), **shown}))

    def mark(self, marks: Sequence[LandingMark], place: Callable[[LandingMark], tuple[float, float]]) -> None:
        """Add numbered triangles at the ``place`` (s, value) of each landing on one body, the hardest filled."""
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
        """Return the figure; ``zoomed``: limited to the contacts at first, if they are short."""
        start, end = self._window
        near = zoomed and end - start < 0.5 * self._end
        rate, unit = scaled(end - start if near else self._end, "s")
        figure = _empty(f"time [{unit}]")
        for time, curve in self._curves:
            figure.add_scatter(x=_short(rate * time), **curve)
        if near:
            figure.update_xaxes(range=[rate * start, rate * end])
            figure.update_yaxes(range=self._heights(start, end))
        figure.update_yaxes(title=quantity)
        return figure

    def _heights(self, start: float, end: float) -> tuple[float, float]:
        """Return the lowest and highest value of the curves that are shown between two times, with a margin."""
        parts = [
            np.asarray(curve["y"])[(time >= start) & (time <= end)]
            for time, curve in self._curves
            if curve.get("visible") != "legendonly"
        ]
        values = np.concatenate([*parts, [0.0]])
        margin = 0.12 * (float(np.ptp(values)) or 1.0)
        return float(values.min()) - margin / 3, float(values.max()) + margin


def _pressed(runs: Sequence[ImpactResult]) -> tuple[int, int]:
    """Return the first step with force in any run, and the one after the last; all steps if no run has any."""
    each = [np.any(run.rows.force.reshape(len(run.rows.ends), -1) != 0, axis=1) for run in runs]
    begins = [run.rows.ends[:-1][pressed[1:]] for run, pressed in zip(runs, each, strict=True)]
    ends = np.concatenate([run.rows.ends[pressed] for run, pressed in zip(runs, each, strict=True)])
    if not len(ends):
        return 0, int(runs[0].rows.ends[-1]) + 1
    return int(min(np.append(np.concatenate(begins) + 1, ends))), int(ends.max()) + 1


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
    """Return the indices of the points to draw: all, or the smallest and largest of each bin and both ends."""
    if len(values) <= MOST:
        return np.arange(len(values), dtype=np.int64)
    edges = np.linspace(0, len(values), MOST // 2 + 1).astype(np.int64)
    bins = [(low, values[low:high]) for low, high in itertools.pairwise(edges)]
    picks = [low + int(pick) for low, part in bins for pick in (part.argmin(), part.argmax())]
    return np.unique(np.array([0, *picks, len(values) - 1], dtype=np.int64))


def _short(values: Array) -> list[Any]:
    """Return the values to six digits: the resolution of a screen at a third of the size."""
    rounded = np.array([float(f"{value:.6g}") for value in np.ravel(values)]).reshape(np.shape(values))
    return list(rounded.tolist())


def _largest(runs: Mapping[str, ImpactResult], name: str) -> float:
    peaks: Sequence[float] = [float(np.abs(getattr(runs[key], name)).max()) for key in LINES if key in runs]
    return max(peaks, default=0.0)
