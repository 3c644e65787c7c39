"""Writes docs/scenes.md, the gallery: what the examples say of themselves, and their pictures."""

from __future__ import annotations

import ast
import re
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from impact.files.safe_files import write_whole

DOCS = Path(__file__).resolve().parent
EXAMPLES = DOCS.parent / "examples"
PICTURES: Final = {
    "flapper_on_peek_sleeve": "force.png",
    "tilted_landing": "lip.png",
    "impact_stress": "stress_wave.gif",
    "paper_table1_3mm_area": "paper_figure_5.png",
    "paper_table1_30mm_area": "paper_figure_6.png",
}
"""In docs/images, kept by docs/refresh.py and examples/paper/figures.py."""
HEAD: Final = """\
# Gallery

The scenes, studies and scripts of `examples/`; the comments of the files say more. `make docs` writes this page.

"""


@dataclass(frozen=True)
class Example:
    """Attributes:
    path: of the file.
    title, words: what it says of itself.
    verb: of the program, that runs it; "" of Python.
    """

    path: Path
    title: str
    words: str
    verb: str = ""

    @property
    def sentence(self) -> str:
        """Return the first one of its words."""
        return re.split(r"(?<=[.?])\s", self.words, maxsplit=1)[0]

    @property
    def entry(self) -> str:
        """Return the link of its card: a section of the page, or the script."""
        if not self.verb:
            return f"../examples/{self.path.name}"
        return "#" + re.sub(r"[^\w\- ]", "", self.title.lower()).replace(" ", "-")


def scenes_page() -> str:
    """Return the page as Markdown: cards of all examples, then a section for each scene."""
    cards = "\n".join([_cards(scenes()), "## In Python\n", _cards(scripts())])
    return "".join([HEAD, cards, *(_section(example) for example in scenes())])


def scenes() -> list[Example]:
    """Return the scenes and studies of examples/."""
    found = []
    for path in sorted(EXAMPLES.glob("*.toml")):
        text = path.read_text(encoding="utf-8")
        given = tomllib.loads(text)
        first = [line for line in text.partition("\n\n")[0].splitlines() if line.startswith("#")]
        verb = "optimise" if "optimise" in given else "sweep" if "vary" in given else "run"
        title = given.get("title") or path.stem.replace("_", " ").capitalize()
        found.append(Example(path, title, "\n".join(line.removeprefix("#").strip() for line in first), verb))
    return found


def scripts() -> list[Example]:
    """Return the Python scripts of examples/."""
    found = []
    for path in sorted(EXAMPLES.glob("*.py")):
        written = str(ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))))
        title, words = re.split(r"\n(?:=+\n)?\n", written, maxsplit=1)
        found.append(Example(path, title, words))
    return found


def _cards(examples: list[Example]) -> str:
    cards = "\n".join(
        f"- [![{each.path.stem}](images/scenes/{each.path.stem}.png)]({each.entry})\n  **[{each.title}]({each.entry})**"
        for each in examples
    )
    return f'<div class="cards">\n\n{cards}\n\n</div>\n'


def _section(example: Example) -> str:
    name, picture = example.path.name, PICTURES.get(example.path.stem)
    shown = f"\n![{example.path.stem}](images/{picture})\n" if picture else ""
    command = f"[`seatfem {example.verb} examples/{name}`](../examples/{name})"
    return f"\n## {example.title}\n\n{example.sentence}\n\n{command}\n{shown}"


if __name__ == "__main__":
    write_whole(DOCS / "scenes.md", scenes_page().encode("utf-8"))
