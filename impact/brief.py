"""Objects in a few words: what `repr` says of data that hold arrays, and what notebooks show."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import fields
from html import escape

import numpy as np

WIDTH = 70  # characters of one value
MOST = 6  # values of a sequence


def brief(thing: object) -> str:
    """Return ``Name(field=value, ...)`` of a dataclass, arrays by shape and range; set it as ``__repr__``."""
    shown = [f for f in fields(thing) if f.repr]  # type: ignore[arg-type]
    values = ", ".join(f"{f.name}={brief_value(getattr(thing, f.name))}" for f in shown)
    return f"{type(thing).__name__}({values})"


def as_html(thing: object) -> str:
    """Return ``str(thing)`` as a small table: its first line the caption, a row a line, split at ": "; for
    ``_repr_html_``."""
    caption, *lines = str(thing).splitlines() or [""]
    rows = "".join(f"<tr>{_cells(line.strip())}</tr>" for line in lines)
    return f"<table><caption style='text-align:left'><b>{escape(caption)}</b></caption>{rows}</table>"


def _cells(line: str) -> str:
    name, colon, value = line.partition(": ")
    style = "style='text-align:left'"
    if not colon:
        return f"<td colspan='2' {style}>{escape(line)}</td>"
    return f"<th scope='row' {style}>{escape(name)}</th><td {style}>{escape(value)}</td>"


def brief_value(value: object) -> str:
    """Return one value in at most `WIDTH` characters."""
    if isinstance(value, np.ndarray):
        if value.size <= 1 or value.dtype.kind not in "fiu":
            return f"array {value.shape}" + (f" {value.ravel()[0]}" if value.size == 1 else "")
        return f"array {value.shape} {np.min(value):.4g} ... {np.max(value):.4g}"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, str):
        return cut(repr(value))
    if isinstance(value, Mapping):
        return f"{{{cut(some([f'{key}: {brief_value(item)}' for key, item in value.items()]))}}}"
    if isinstance(value, tuple | list):
        return f"({cut(some([brief_value(item) for item in value]))})"
    return cut(repr(value))


def some(items: Iterable[str], most: int = MOST) -> str:
    """Return the first ``most`` of them as text, and how many there are more."""
    listed = list(items)
    return ", ".join(listed[:most]) + (f", ... ({len(listed) - most} more)" if len(listed) > most else "")


def cut(text: str, width: int = WIDTH) -> str:
    """Return one line of at most ``width`` characters."""
    line = " ".join(text.split())
    return line if len(line) <= width else f"{line[: width - 4]} ..."
