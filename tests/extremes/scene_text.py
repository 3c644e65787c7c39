"""Text of scene files from tables of values."""

import json
from collections.abc import Mapping, Sequence

Value = str | float | bool | Sequence[object] | Mapping[str, object]
Table = Mapping[str, Value]


def si(value: float, unit: str) -> str:
    """Return a quantity as scenes write it."""
    return f"{value!r} {unit}" if unit else repr(value)


def scene_text(**tables: Table | Sequence[Table] | None) -> str:
    """Return a scene file: a table for each name, [[name]] for a list of them, nothing for ``None``."""
    parts = []
    for name, content in tables.items():
        if isinstance(content, Mapping):
            parts.append(_lines(f"[{name}]", content))
        elif content is not None:
            parts.extend(_lines(f"[[{name}]]", each) for each in content)
    return "\n".join(parts) + "\n"


def run_table(duration: float, width: float, step: float | None = None) -> Table:
    """Return [run]."""
    stated = {} if step is None else {"time_step": si(step, "s")}
    return {"duration": si(duration, "s"), "filter_width": si(width, "s"), **stated}


def material(young: float, density: float, poisson: float | None = None) -> Mapping[str, object]:
    """Return a material."""
    stated = {} if poisson is None else {"poisson": poisson}
    return {"young": si(young, "Pa"), "density": si(density, "kg/m^3"), **stated}


def csv_text(head: str, *columns: Sequence[float]) -> str:
    """Return a record: its header, then a line for each row."""
    return "\n".join([head, *(",".join(f"{x:.15g}" for x in row) for row in zip(*columns, strict=True))]) + "\n"


def _lines(head: str, table: Table) -> str:
    return "\n".join([head, *(f"{key} = {_written(value)}" for key, value in table.items())])


def _written(value: object) -> str:
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{key} = {_written(each)}" for key, each in value.items()) + " }"
    if isinstance(value, str | bool):
        return json.dumps(value)
    if isinstance(value, Sequence):
        return "[" + ", ".join(_written(each) for each in value) + "]"
    return repr(value)
