"""Writes docs/images/badge_*.svg from pyproject.toml and the table of damaged files (`make docs`)."""

from __future__ import annotations

import csv
import sys
import tomllib
from html import escape
from pathlib import Path
from typing import Final

from impact.files.safe_files import write_whole

ROOT: Final = Path(__file__).parents[1]
LETTER, PAD = 6.0, 7.0  # pixels
_BADGE: Final = """\
<svg xmlns="http://www.w3.org/2000/svg" width="{width:g}" height="20" role="img" aria-label="{name}: {value}">
<title>{name}: {value}</title>
<rect width="{width:g}" height="20" rx="3" fill="#0072B2"/>
<path d="M3 0h{rest:g}v20H3a3 3 0 0 1-3-3V3a3 3 0 0 1 3-3z" fill="#4A4A4A"/>
<g fill="#FFFFFF" font-family="DejaVu Sans, Verdana, sans-serif" font-size="11">
<text x="{pad:g}" y="14" textLength="{first:g}">{name}</text>
<text x="{second:g}" y="14" textLength="{last:g}">{value}</text>
</g>
</svg>
"""


def badges() -> dict[str, str]:
    """The SVG text of each, by its name."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    told = [each.rpartition(" ")[2] for each in project["classifiers"] if "Python :: 3." in each]
    with (ROOT / "benchmarks" / "results" / "fuzz.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    files, defects = (sum(int(row[key]) for row in rows) for key in ("cases", "defects"))
    return {
        "python": badge("Python", ", ".join(told)),
        "licence": badge("licence", project["license"]),
        "fuzz": badge("damaged files", f"{files:,}, {defects} defects"),
    }


def badge(name: str, value: str) -> str:
    """A name on grey, its value on blue."""
    first, last = (LETTER * len(words) for words in (name, value))
    left = first + 2 * PAD
    sizes = {"width": left + last + 2 * PAD, "rest": left - 3, "pad": PAD, "second": left + PAD}
    return _BADGE.format(name=escape(name), value=escape(value), first=first, last=last, **sizes)


if __name__ == "__main__":
    for name, text in badges().items():
        write_whole(Path(sys.argv[1]) / f"badge_{name}.svg", text.encode("utf-8"))
