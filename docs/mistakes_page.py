"""Write docs/mistakes.md: what users get wrong, and what the program answers, from the sheet of the tests."""

import os
import sys
import tempfile
from contextlib import chdir
from pathlib import Path

PAGE = Path(__file__).with_name("mistakes.md")
sys.path.insert(0, str(PAGE.parents[1]))

from tests.mistakes import MISTAKES, Mistake  # noqa: E402

HEAD = """\
# Mistakes and their answers

<!-- written by docs/mistakes_page.py -->

An answer names the file, the line, the key, its value, and what to do. A refused scene ends with exit code 2. A scene
with unusual values is computed, but `draw`, `plan` and `run` print a warning first.

The scenes and commands are in `tests/faces/mistakes.toml`.
"""


def answered(mistake: Mistake) -> str:
    """Return a mistake and its answer in Markdown."""
    with tempfile.TemporaryDirectory() as folder, chdir(folder):
        mistake.write()
        _, answer = mistake.answer()
    return f"**{mistake.name[:1].upper()}{mistake.name[1:]}**\n\n```text\n{mistake.line_of(answer)}\n```\n"


def main() -> None:
    os.environ["COLUMNS"] = "200"
    PAGE.write_text("\n".join([HEAD, *map(answered, MISTAKES)]), encoding="utf-8")


if __name__ == "__main__":
    main()
