"""HTML fragments of the page of a run, which page.py orders in sections: tables, hot spots, omissions,
provenance, pictures; and the reading of a run's folder."""

from __future__ import annotations

import base64
import html
import json
import shlex
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from rich.table import Table

from impact.files.safe_files import MB, read_bytes, read_text
from impact.notices import SeatfemError
from impact.quantities import text
from seatfem import readings, results
from seatfem.faces.report.asked import SCENE_COPY, changes_in
from seatfem.faces.tables import time_line
from seatfem.machine.doctor import installed_version
from seatfem.results import IMPULSE, SEAT_STRESS
from seatfem.structures.cache import content_hash
from seatfem.study.runs.pipeline import SUMMARY_FILE

MOST_TEXT: Final = 4 * MB


class ReportError(SeatfemError, ValueError):
    """Error of a folder without a run, or with files that cannot be read; the message names the file and the remedy."""


def run_summary(folder: Path) -> dict[str, Any]:
    """Return summary.json of a run. Raises `ReportError` for a folder without one, or if it is incomplete."""
    path = folder / SUMMARY_FILE
    if folder.is_file():
        raise ReportError(f"{folder}: is a file; give the folder of a run (seatfem run -o), as {folder.stem}-result")
    try:
        summary = json.loads(read_text(path, MOST_TEXT, ReportError))
    except FileNotFoundError:
        of_study = "; the page of a study is its report.html, open that" if (folder / "report.html").is_file() else ""
        words = f"{folder}: holds no {SUMMARY_FILE}; give the folder of a run (seatfem run -o){of_study}"
        raise ReportError(words) from None
    except ValueError as error:
        raise (
            error
            if isinstance(error, ReportError)
            else ReportError(f"{path}: is no JSON ({error}); run the scene again")
        ) from None
    if not isinstance(summary, dict) or IMPULSE not in summary:
        raise ReportError(f"{path}: is no summary of a run; give the folder of a run (seatfem run -o)")
    return summary


def text_of(path: Path) -> str:
    """Return the text of a file beside the results; "" if there is none."""
    return read_text(path, MOST_TEXT, ReportError) if path.is_file() else ""


def html_table(table: Table) -> str:
    """Return a table as HTML: cells of text, sections, bold rows as headings, and the caption."""
    attributes = [' class="number"' if column.justify == "right" else "" for column in table.columns]

    def row(tag: str, cells: Iterable[object], kind: str = "") -> str:
        pairs = zip(cells, attributes, strict=True)
        inside = "".join(f"<{tag}{with_}>{html.escape(str(cell))}</{tag}>" for cell, with_ in pairs)
        return f'<tr class="{kind}">{inside}</tr>'

    head, rows, begins = row("th", (column.header for column in table.columns)), list[str](), False
    for each, cells in zip(table.rows, zip(*(column.cells for column in table.columns), strict=True), strict=True):
        kinds = (("section", begins), ("heading", each.style == "bold"))
        rows.append(row("td", cells, " ".join(name for name, is_so in kinds if is_so)))
        begins = each.end_section
    lines = "<br>".join(map(html.escape, str(table.caption or "").splitlines()))
    caption = f'<p class="soft">{lines}</p>' if lines else ""
    whole = f"<table><thead>{head}</thead><tbody>{''.join(rows)}</tbody></table>"
    return f'<div class="scroll">{whole}</div>{caption}'


def html_list(sentences: Iterable[str]) -> str:
    """Return sentences as an HTML list; "" without any."""
    items = "".join(f"<li>{html.escape(sentence)}</li>" for sentence in sentences)
    return f"<ul>{items}</ul>" if items else ""


def html_rows(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return an HTML table of rows of text under their headers."""
    table = Table(*heads)
    for row in rows:
        table.add_row(*row)
    return html_table(table)


def hot_spots(summary: Mapping[str, Any]) -> str:
    """Return a table of hot spots, largest first: stress, time, place, distance to the nearest sharp edge; or ""."""
    spots = summary.get("seat_stress_hot_spots")
    if not isinstance(spots, list) or not spots:
        return ""
    rows = [
        (_in(spot, "von_mises_Pa", "Pa"), _in(spot, "time_s", "s"), _place(spot), _in(spot, "edge_distance_m", "m"))
        for spot in spots
        if isinstance(spot, dict)
    ]
    words = "Largest von Mises stress at its places on the surface; places of a half section are r, z."
    largest = readings.reading(summary, SEAT_STRESS, "Pa")
    if readings.BAR + SEAT_STRESS in summary:
        words += f" The largest with its uncertainty there: {largest}."
    return html_rows(("von Mises", "time", "place [mm]", "from a sharp edge"), rows) + f'<p class="soft">{words}</p>'


def keys_table(summary: Mapping[str, Any], prefix: str) -> str:
    """Return a table of all keys with a ``prefix`` and a value, each number with its error bar; "" without any."""
    keys = [key for key, value in summary.items() if key.startswith(prefix) and value is not None]
    return html_rows(("", "value"), [(_words(key, prefix), _plain(summary, key)) for key in keys]) if keys else ""


def _words(key: str, prefix: str) -> str:
    """Return the words of a result; of another key the key itself, without the ``prefix`` and its unit."""
    if (known := results.all_results().get(key)) is not None:
        return known.words
    ending = next((ending for ending in readings.UNITS if key.endswith(f"_{ending}")), "")
    return key.removeprefix(prefix).removesuffix(f"_{ending}").replace("_", " ")


def _in(spot: Mapping[str, Any], key: str, unit: str) -> str:
    return "" if (value := readings.as_number(spot.get(key))) is None else text(value, unit)


def _place(spot: Mapping[str, Any]) -> str:
    place = spot.get("at_m")
    numbers = [readings.as_number(x) for x in place] if isinstance(place, list) else []
    return ", ".join("?" if x is None else f"{1e3 * x:.4g}" for x in numbers)


def _plain(summary: Mapping[str, Any], key: str) -> str:
    value = summary[key]
    return readings.reading(summary, key, readings.unit_of(key)) if isinstance(value, float) else str(value)


def provenance(folder: Path, summary: Mapping[str, Any]) -> str:
    """Return an HTML table of bodies, time, and the command that repeats the run; and of the files with checksums."""
    stages = summary.get("stages_s")
    times = stages if isinstance(stages, dict) else {}
    spent = {str(name): seconds for name, value in times.items() if (seconds := readings.as_number(value)) is not None}
    wall, command = readings.as_number(summary.get("wall_time_s")), ["seatfem", "run", "SCENE"]
    if text := text_of(folder / SCENE_COPY):
        command[2:] = [SCENE_COPY, *(word for change in changes_in(text) for word in ("--set", change))]
    facts = [
        ("seat", f"{summary.get('seat_kind')}: {summary.get('seat_model')}"),
        ("reed", str(summary.get("reed_kind"))),
        ("time", f"{'' if wall is None else f'{wall:.3g} s'}: {time_line(spent)}"),
        ("to reproduce", shlex.join(command)),
    ]
    files = [
        (file.name, f"{file.stat().st_size:,} bytes, SHA-256 {content_hash(file)}")
        for file in sorted(folder.iterdir())
        if file.is_file() and not file.is_symlink() and file.suffix in (".json", ".h5", ".toml", ".csv")
    ]
    return html_rows(("", ""), facts) + "<h3>Files</h3>" + html_rows(("file", ""), files)


def versions() -> str:
    """Return the versions of this program and of the numerical libraries."""
    names = ("seatfem", "numpy", "scipy", "scikit-fem", "gmsh", "numba")
    return "Made by " + ", ".join(f"{name} {number}" for name in names if (number := installed_version(name)))


MOST_OF_A_PICTURE: Final = 3 * MB
MOST_OF_PICTURES: Final = 7 * MB // 2  # largest size of all pictures [bytes]: with all else the page stays below 15 MB
DRAWING: Final = "drawing.png"
"""File of the picture at the top of a page."""
CAPTIONS: Final[Mapping[str, str]] = {
    DRAWING: "The scene as it was computed: section along the reed through the contact, and plan, with sizes.",
    "force.png": "Contact force, seat and spring baseline.",
    "stopper_force.png": "Contact force on the stopper.",
    "lip.png": "Force per length along the lip over angle and time, impulse, gaps and tilt.",
    "landing.gif": "The plate as it lands, its deflection exaggerated.",
    "mesh.png": "The seat's mesh; the contact face and the clamped faces are coloured.",
    "modes.png": "Modes of the seat.",
    "mode_1.gif": "The first mode of the seat.",
    "greens.png": "The driving-point Green's function: impulse response, step response, receptance.",
    "seat_stress.png": "Largest von Mises stress of the run at each place of the seat.",
    "stress_histories.png": "Stress over time at the hot spots of reed and seat.",
    "gauges.png": "Strain at the gauges.",
    "fit.png": "The measured response and what was fitted to it.",
    "stabilisation.png": "The poles of each number of modes that was tried, and which of them stay.",
}
INTERACTIVE: Final = ("motion.png", "energy.png")
"""Pictures whose curves are all on the page as interactive figures."""
INSTEAD: Final[Mapping[str, str]] = {
    "mode_1.gif": "modes.h5",
    "stress_wave.gif": "stress_wave.h5",
    "reed_stress_wave.gif": "reed_stress_wave.h5",
    "landing.gif": "landing.h5",
}
"""Pictures that a page with moving bodies omits, and the files of these bodies."""
STILLS: Final = ("landing.gif",)
"""Pictures of `INSTEAD` that are included nevertheless, for browsers without WebGL, and for prints."""


def kept_pictures(folder: Path, without: Collection[str] = ()) -> str:
    """Return the pictures that no other section shows, with captions; one that is too large is only named."""
    shown, room = [], MOST_OF_PICTURES
    files = sorted(file for pattern in ("*.png", "*.gif") for file in folder.glob(pattern) if not file.is_symlink())
    for file in sorted(files, key=lambda file: file.name in STILLS):
        if file.name == DRAWING or file.name in without:
            continue
        size = file.stat().st_size
        drawn = (folder / INSTEAD.get(file.name, file.name + "?")).is_file()
        if file.name in INTERACTIVE or (drawn and (file.name not in STILLS or size > min(room, MOST_OF_A_PICTURE))):
            continue
        caption = {**CAPTIONS, **results.all_captions()}.get(file.name, file.stem.replace("_", " "))
        if size > MOST_OF_A_PICTURE or size > room:
            shown.append(f"<p>{html.escape(file.name)} is too large for this page; it lies beside the results.</p>")
            continue
        room -= size
        shown.append(_figure(file, caption, ' class="still"' if drawn else ""))
    return "".join(shown)


def first_picture(folder: Path, *, caption: bool = True) -> str:
    """Return the drawing of the scene, with or without its caption; "" if the run has none."""
    file = folder / DRAWING
    if not file.is_file() or file.is_symlink() or file.stat().st_size > MOST_OF_A_PICTURE:
        return ""
    return _figure(file, CAPTIONS[DRAWING]) if caption else _image(file, "The valve as it was computed.")


def _figure(file: Path, caption: str, style: str = "") -> str:
    words = f"<figcaption>{html.escape(caption)}</figcaption>"
    return f"<figure{style}>{_image(file, caption)}{words}</figure>"


def _image(file: Path, alternative: str) -> str:
    """Return an image with its data in the page, and the words for those who do not see it."""
    data = base64.b64encode(read_bytes(file, MOST_OF_A_PICTURE, ReportError)).decode("ascii")
    kind = file.suffix.removeprefix(".").lower()
    return f'<img src="data:image/{kind};base64,{data}" alt="{html.escape(alternative)}" loading="lazy">'
