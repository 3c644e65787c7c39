"""Draws docs/images/rooms.svg: which room of the code imports which, read from the imports (`make docs`).

A row imports the columns with a dot. Rooms stand in their order: a dot above the diagonal would be an arrow upwards.
"""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator
from pathlib import Path

from impact.files.safe_files import write_whole

ROOT = Path(__file__).resolve().parent.parent
GROUPS = {
    "impact": (
        *("small modules", "files", "greens", "exact", "beams", "bodies", "measured", "march", "gas", "after", "life"),
        *("runs", "storage", "pictures"),
    ),
    "seatfem": (
        *("units", "fields", "readings", "results", "machine", "jobs", "structures", "pictures"),
        *(
            f"study/{room}"
            for room in ("safety", "answers", "scene", "method", "plan", "impacts", "ladders", "error_budget")
        ),
        *(f"study/{room}" for room in ("runs", "sweep", "identify", "trade")),
        *("life", "wings"),
        *("verify, doctor", "faces"),
    ),
}
ROOMS = [(package, room) for package, rooms in GROUPS.items() for room in rooms]
LEAVES = ("verify", "machine/doctor")
"""What verbs alone import."""
IMPORT = re.compile(r"^ *from ([\w.]+) import (.*)", re.MULTILINE)
CELL, LEFT, TOP = 19, 200, 120
BLUE, ORANGE, GREY, PALE = "#0072B2", "#D55E00", "#3F454C", "#E4E7EA"


def rooms_svg() -> str:
    """The picture."""
    size = CELL * len(ROOMS)
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {LEFT + size + 70} {TOP + size + 40}" '
        f'font-family="sans-serif" font-size="12" fill="{GREY}">',
        '<rect width="100%" height="100%" fill="white"/>',
    ]
    start = 0
    for package, rooms in GROUPS.items():
        at, width = CELL * start, CELL * len(rooms)
        parts.append(
            f'<rect x="{LEFT + at}" y="{TOP + at}" width="{width}" height="{width}" fill="{PALE}"/>'
            f'<text x="8" y="{TOP + at + width / 2}" font-size="15" font-weight="bold">{package}</text>'
        )
        start += len(rooms)
    arrows = sorted(imports())
    for k, (_, room) in enumerate(ROOMS):
        middle = CELL * k + CELL / 2
        parts.append(f'<text x="{LEFT - 6}" y="{TOP + middle + 4}" text-anchor="end">{room}</text>')
        parts.append(f'<text transform="translate({LEFT + middle + 4} {TOP - 6}) rotate(-60)">{room}</text>')
        parts.append(f'<circle cx="{LEFT + middle}" cy="{TOP + middle}" r="2" fill="{GREY}"/>')
    for row, column in arrows:
        colour = BLUE if column < row else ORANGE
        x, y = LEFT + CELL * column + CELL / 2, TOP + CELL * row + CELL / 2
        parts.append(f'<circle cx="{x}" cy="{y}" r="5.5" fill="{colour}"/>')
    legend = "a row imports the columns with a dot; an arrow upwards would be a dot above the diagonal"
    parts.append(f'<text x="{LEFT}" y="{TOP + size + 24}">{legend}</text></svg>')
    return "\n".join(parts) + "\n"


def imports() -> set[tuple[int, int]]:
    """(room that imports, room imported), by their places; those for type checkers count, too."""
    found = set()
    for package in GROUPS:
        for path in (ROOT / package).rglob("*.py"):
            importer = place_of(path.relative_to(ROOT).with_suffix("").parts)
            for module in _imported(path.read_text(encoding="utf-8")):
                imported = place_of(tuple(module.split(".")))
                if importer is not None and imported is not None and imported != importer:
                    found.add((importer, imported))
    return found


def _imported(text: str) -> Iterator[str]:
    """Modules and names that a file imports, and modules that it asks for as attributes of their rooms."""
    if re.search(r"^import seatfem$", text, re.MULTILINE):
        yield from re.findall(r"\bseatfem\.\w+\.\w+", text)
    for module, names in IMPORT.findall(text):
        for name, alias in re.findall(r"(\w+)(?: as (\w+))?", names) or [("", "")]:
            full = f"{module}.{name}"
            if name and (ROOT / full.replace(".", "/")).is_dir():
                yield from (f"{full}.{each}" for each in re.findall(rf"\b{alias or name}\.(\w+)\.", text))
            else:
                yield full if (ROOT / f"{full.replace('.', '/')}.py").exists() else module


def place_of(parts: tuple[str, ...]) -> int | None:
    """Of the room that a module is in; ``None`` for the packages themselves, and for other people's."""
    package, *inner = parts
    if package not in GROUPS or not inner or inner == ["__init__"]:
        return None
    if "/".join(inner).startswith(LEAVES):
        return ROOMS.index((package, "verify, doctor"))
    rooms = [(package, "/".join(inner[:2])), (package, inner[0]), (package, "small modules")]
    return next((ROOMS.index(room) for room in rooms if room in ROOMS), None)


if __name__ == "__main__":
    write_whole(sys.argv[1], rooms_svg().encode("utf-8"))
