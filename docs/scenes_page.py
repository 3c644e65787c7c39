"""Writes docs/scenes.md from the scenes of examples/: what each says of itself, and its picture where one is kept."""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

from impact.files.atomic import write_whole

ROOT = Path(__file__).resolve().parent.parent
PICTURES = {
    "flapper_on_peek_sleeve": "force.png",
    "tilted_landing": "lip.png",
    "impact_stress": "stress_wave.gif",
    "paper_table1_3mm_area": "paper_figure_5.png",
    "paper_table1_30mm_area": "paper_figure_6.png",
}
"""In docs/images, kept by docs/refresh.py and examples/paper/figures.py; others have their trade there."""
HEAD = """\
# Scenes

What `examples/` holds as scenes, in their own words; made from them by `make docs`. Each runs by `seatfem run FILE`.
"""


def scenes_page() -> str:
    """The whole page, as Markdown."""
    return "".join([HEAD, *(_section(path) for path in sorted((ROOT / "examples").glob("*.toml")))])


def _section(path: Path) -> str:
    text = path.read_text(encoding="utf-8")
    title = tomllib.loads(text).get("title") or path.stem.replace("_", " ").capitalize()
    first = text.partition("\n\n")[0].splitlines()
    words = "\n".join(line.removeprefix("#").strip() for line in first if line.startswith("#"))
    picture = PICTURES.get(path.stem, f"trade_{path.stem}.png")
    shown = f"\n![{title}](images/{picture})\n" if (ROOT / "docs" / "images" / picture).exists() else ""
    return f"\n## {title}\n\n{words}\n\n[`{path.name}`](../examples/{path.name})\n{shown}"


if __name__ == "__main__":
    write_whole(sys.argv[1], scenes_page().encode("utf-8"))
