"""HTML fragments of the page of a run, which page.py orders in sections: tables, hot spots, life, omissions,
provenance, pictures; and the reading of a run's folder."""

from __future__ import annotations

import base64
import html
import json
import math
import shlex
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from rich.table import Table

from impact.files.safe_files import MB, read_bytes, read_text
from impact.quantities import text
from seatfem import readings, results
from seatfem.faces.report.asked import SCENE_COPY, changes_in
from seatfem.faces.tables import time_line
from seatfem.machine.doctor import installed_version
from seatfem.results import IMPULSE, SEAT_STRESS, Group, name_of, rows_of, words_of
from seatfem.structures.cache import content_hash
from seatfem.study.runs.pipeline import SUMMARY_FILE
from seatfem.study.safety import source_in_words

MOST_TEXT: Final = 4 * MB


class ReportError(ValueError):
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


def life_table(summary: Mapping[str, Any]) -> str:
    """Return a table of all results on fatigue, each number with its error bar; "" without any."""
    results = [(key, value) for key, value in summary.items() if key.startswith("life_") and value is not None]
    if not results:
        return ""
    rows = [(key.removeprefix("life_").replace("_", " "), _plain(summary, key)) for key, _ in results]
    return html_rows(("", "value"), rows)


def _in(spot: Mapping[str, Any], key: str, unit: str) -> str:
    return "" if (value := readings.as_number(spot.get(key))) is None else text(value, unit)


def _place(spot: Mapping[str, Any]) -> str:
    place = spot.get("at_m")
    numbers = [readings.as_number(x) for x in place] if isinstance(place, list) else []
    return ", ".join("?" if x is None else f"{1e3 * x:.4g}" for x in numbers)


def _plain(summary: Mapping[str, Any], key: str) -> str:
    value = summary[key]
    if readings.bar_of(summary, key) is not None:
        return readings.reading(summary, key, "")
    return f"{value:.4g}" if isinstance(value, float) else str(value)


BAR_UNKNOWN: Final = "Uncertainty not known"
TOO_WIDE: Final = "Not known, since the uncertainty is above half of the value"
NO_BAR: Final = "Without an uncertainty"
STATES: Final = (BAR_UNKNOWN, TOO_WIDE, NO_BAR)
BESIDE: Final = ("time_s", "_at_deg", "_at_m", "_over_rho_c0_v", "tilt_deg")
"""Suffixes of keys that state the time or place of another number, a multiple of it, or an input of the scene."""


def omissions(summary: readings.Summary) -> Iterator[str]:
    """Yield a sentence for each thing that the numbers of a run omit."""
    if unknown := str(summary.get("error_unknown") or ""):
        left_out = ", ".join(source_in_words(source) for source in unknown.split(", "))
        yield f"Not included in the uncertainty: {left_out}."
    for (words, group), names in _numbers_without_bar(summary).items():
        yield f"{words} ({results.HEADINGS[group].replace('{step}', '')}): {'; '.join(names)}."
    if empty := results.without_value(summary):
        yield f"Asked for, but without a value in this run: {', '.join(name_of(key, summary) for key in empty)}."
    if summary.get("accuracy_met") is False and (reason := str(summary.get("accuracy_stopped_because") or "")):
        yield f"The accuracy asked for was missed, and no further round followed: {reason}."
    yield from _not_computed(summary)
    if missing := str(summary.get("pictures_missing") or ""):
        yield f"Pictures that could not be drawn: {missing}."


def _numbers_without_bar(summary: readings.Summary) -> dict[tuple[str, Group], list[str]]:
    """Return the names of numbers whose error is unknown or too large, by reason and by group of rows."""
    open_numbers: dict[tuple[str, Group], list[str]] = {}
    for group, rows in rows_of(summary).items():
        parent = ""
        for row in rows:
            words = words_of(row, summary)
            parent = parent if words.startswith(" ") else words
            value, bar = readings.as_number(summary.get(row.key)), readings.bar_of(summary, row.key)
            if not value or isinstance(summary[row.key], int) or row.key.endswith(BESIDE):
                continue
            if not readings.is_known(row.key, value, bar):
                state = NO_BAR if bar is None else TOO_WIDE if math.isfinite(bar) else BAR_UNKNOWN
                name = f"{parent}: {words.strip()}" if words.startswith(" ") else words
                open_numbers.setdefault((state, group), []).append(name)
    return dict(sorted(open_numbers.items(), key=lambda each: STATES.index(each[0][0])))


def _not_computed(summary: readings.Summary) -> Iterator[str]:
    """Yield the stresses and the fatigue that were not computed, and the keys of the scene that request them."""
    if readings.as_number(summary.get(results.SEAT_STRESS)) is None:
        yield "Stress in the seat was not computed; [stress] in the scene asks for that of a seat of finite elements."
    if readings.as_number(summary.get(results.REED_STRESS)) is None:
        yield "Stress in the reed was not computed; [stress] in the scene asks for that of a plate."
    if not any(key.startswith("life_") for key in summary):
        yield "Fatigue was not judged; [life] in the scene asks for it."


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
    "seat_stress.png": "Largest stress on the seat, and its histories.",
    "stress_histories.png": "Stress over time at the hot spots of reed and seat.",
    "margin.png": "Margin against speed.",
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


def kept_pictures(folder: Path) -> str:
    """Return the pictures that no other section shows, with captions; one that is too large is only named."""
    shown, room = [], MOST_OF_PICTURES
    files = sorted(file for pattern in ("*.png", "*.gif") for file in folder.glob(pattern) if not file.is_symlink())
    for file in sorted(files, key=lambda file: file.name in STILLS):
        if file.name == DRAWING:
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


def first_picture(folder: Path) -> str:
    """Return the drawing of the scene with its caption; "" if the run has none."""
    file = folder / DRAWING
    if not file.is_file() or file.is_symlink() or file.stat().st_size > MOST_OF_A_PICTURE:
        return ""
    return _figure(file, CAPTIONS[DRAWING])


def _figure(file: Path, caption: str, style: str = "") -> str:
    data = base64.b64encode(read_bytes(file, MOST_OF_A_PICTURE, ReportError)).decode("ascii")
    kind = file.suffix.removeprefix(".").lower()
    image = f'<img src="data:image/{kind};base64,{data}" alt="{html.escape(caption)}" loading="lazy">'
    return f"<figure{style}>{image}<figcaption>{html.escape(caption)}</figcaption></figure>"
