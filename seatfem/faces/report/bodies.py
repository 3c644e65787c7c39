"""Bodies in motion in a page: modes and waves to turn, drawn by a script of ours from numbers in the page."""

from __future__ import annotations

import base64
import html
import json
import math
from collections.abc import Iterator
from dataclasses import replace
from importlib import resources
from string import Template
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from impact.files.input_files import MB
from impact.quantities import scaled
from seatfem.pictures.frames import Frames
from seatfem.pictures.moving import FINEST, UNTOLD, steps_of_displacement, steps_of_values
from seatfem.pictures.skin import wound_outward

MOST_OF_BODIES: Final = 3 * MB  # of numbers, before base64 makes them a third longer
HINT: Final = (
    "Drag or use the arrow keys to turn, Shift and drag to move, + and - (or the wheel, once clicked) to zoom, 0 to "
    "reset, the space bar to play; a click on the body tells the values there; a section takes away "
    "the half that faces you when it is chosen, and shows the inside of the surface in the colour of sand."
)

UNDRAWN: Final = "This browser does not draw it (no WebGL 2); the pictures below show it at rest."


def body_figure(name: str, made: Frames, most: int = MOST_OF_BODIES) -> str:
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


def _axes(made: Frames) -> str:
    """Return the axes across which a body can be cut: those along which it has an extent."""
    extents = np.ptp(made.points, axis=0)
    across = (f'<option value="{k}">{name}</option>' for k, name in enumerate("xyz") if extents[k] > 0)
    return "".join(('<option value="">off</option>', *across))


def _thinned(made: Frames, most: int) -> Frames:
    """Return every second frame, every third ..., until they fit."""
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


def _notes(made: Frames, shown: Frames) -> Iterator[str]:
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


def _numbers(made: Frames) -> dict[str, Any]:
    """Return what the script draws: arrays in base64, little-endian."""
    outward = wound_outward(made.points, made.triangles)
    factor, unit = scaled(max(abs(made.low), abs(made.high)), made.unit) if made.values is not None else (1.0, "")
    rate, moved = (1.0, "") if made.time is None else scaled(made.largest, "m")
    return {
        "points": _coded(made.points - (made.points.min(axis=0) + made.points.max(axis=0)) / 2, "<f4"),
        "centre": ((made.points.min(axis=0) + made.points.max(axis=0)) / 2).tolist(),
        "triangles": _coded(made.triangles if outward is None else outward, "<u4"),
        "closed": outward is not None,
        "displacement": _coded(steps_of_displacement(made), "<i2"),
        "values": None if made.values is None else _coded(steps_of_values(made), "<u2"),
        "finest": FINEST,
        "untold": UNTOLD,
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
