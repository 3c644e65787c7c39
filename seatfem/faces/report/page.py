"""`seatfem report`: the files of a run as one web page that opens without a network."""

from __future__ import annotations

import base64
import hashlib
import html
import json
import math
from collections.abc import Iterator, Mapping
from importlib import metadata, resources
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from impact.files.atomic import write_whole
from impact.files.input_files import MB, read_bytes, read_text
from impact.storage.hdf5 import load_greens, load_results
from seatfem.faces.report.asked import PLAN_FILE, SCENE_COPY
from seatfem.faces.report.html_tables import html_rows, html_table
from seatfem.faces.result_table import result_table
from seatfem.faces.tables import time_line
from seatfem.faces.verdict import as_number, lasting, simpler, verdict
from seatfem.study.runs.pipeline import RESULT_FILE, SUMMARY_FILE
from seatfem.study.runs.rounds import SEAT_FILE

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

MOST_TEXT: Final = 4 * MB
MOST_OF_A_PICTURE: Final = 3 * MB
MOST_OF_PICTURES: Final = 8 * MB  # with plotly's 5 MB and the curves the page stays below 15 MB
CAPTIONS: Final[Mapping[str, str]] = {
    "force.png": "Contact force, seat and spring baseline.",
    "lip.png": "Force per length along the lip over angle and time, impulse, gaps and tilt.",
    "landing.gif": "The plate as it lands, its deflection exaggerated.",
    "mesh.png": "The seat's mesh; the struck patch and the clamped faces are coloured.",
    "modes.png": "Modes of the seat.",
    "mode_1.gif": "The first mode of the seat.",
    "greens.png": "The driving-point Green's function: impulse response, step response, receptance.",
    "seat_stress.png": "Largest stress on the seat, and its histories.",
    "stress_histories.png": "Stress over time at the hot spots of reed and seat.",
    "margin.png": "Margin against speed.",
    "gas.png": "Pressures, lift and flow over the cycle.",
    "fit.png": "The measured response and what was fitted to it.",
}
INTERACTIVE: Final = ("motion.png", "energy.png")
"""Pictures whose curves are all in the page as figures."""


class ReportError(ValueError):
    """A folder that holds no run, or files of one that cannot be read; the message names the file and the remedy."""


def write_report(folder: Path, path: Path) -> None:
    """Write the run in ``folder`` to the HTML file ``path``: whole or absent.

    The page runs plotly, which it contains; it asks for nothing from anywhere. All text of scenes is escaped.

    Raises:
        ReportError: no summary.json of a run, or one that is not whole; plotly is missing.
        StorageError: a damaged result.h5 or seat.h5.
        OutputError, OSError: ``path`` cannot be written.
    """
    write_whole(path, report_page(folder).encode("utf-8"))


def report_page(folder: Path) -> str:
    """The page as text; raises as `write_report`."""
    summary = run_summary(folder)
    sections = list(_sections(folder, summary))
    links = "".join(f'<a href="#s{k}">{html.escape(title)}</a>' for k, (title, _) in enumerate(sections))
    body = "".join(
        f'<section id="s{k}" aria-labelledby="h{k}"><h2 id="h{k}">{html.escape(title)}</h2>{content}</section>'
        for k, (title, content) in enumerate(sections)
    )
    title = html.escape(str(summary.get("title") or folder.resolve().name))
    style = resources.files(__package__).joinpath("style.css").read_text(encoding="utf-8")
    return (
        '<!doctype html><html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1">'
        f"<title>{title}</title><style>{style}</style><script>{_plotly()}</script></head><body>"
        f'<header><div><h1>{title}</h1><p class="verdict">{html.escape(verdict(summary))}</p>{_state(summary)}'
        f'<nav aria-label="sections">{links}</nav></div></header><main>{body}</main>'
        f"<footer>{_versions()}</footer></body></html>"
    )


def run_summary(folder: Path) -> dict[str, Any]:
    """summary.json of a run. Raises `ReportError` of a folder that holds none, or one that is not whole."""
    path = folder / SUMMARY_FILE
    try:
        found = json.loads(read_text(path, MOST_TEXT, ReportError))
    except FileNotFoundError:
        raise ReportError(f"{folder}: holds no {SUMMARY_FILE}; give the folder of a run (seatfem run -o)") from None
    except ValueError as error:
        raise error if isinstance(error, ReportError) else ReportError(f"{path}: is no JSON: {error}") from None
    if not isinstance(found, dict) or "impulse_Ns" not in found:
        raise ReportError(f"{path}: is no summary of a run; give the folder of a run (seatfem run -o)")
    return found


def _sections(folder: Path, summary: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    sentences = [f"<p>{html.escape(line)}</p>" for line in (simpler(summary), lasting(summary)) if line]
    yield "Result", html_table(result_table(summary)) + "".join(sentences)
    figures = _figures(folder, summary)
    for name, (caption, figure) in figures.items():
        yield name, f'<figure class="plot">{_div(figure, name)}<figcaption>{html.escape(caption)}</figcaption></figure>'
    if shown := _pictures(folder):
        yield "Pictures", shown
    if plan := _text(folder / PLAN_FILE):
        yield "Plan and its reasons", _plan(plan)
    if asked := _text(folder / SCENE_COPY):
        yield "What was asked", f"<details><summary>scene file</summary><pre>{html.escape(asked)}</pre></details>"
    yield "How it was computed", _provenance(folder, summary)


def _figures(folder: Path, summary: Mapping[str, Any]) -> dict[str, tuple[str, Figure]]:
    from seatfem.faces.report import figures as draw

    found: dict[str, tuple[str, Figure]] = {}
    width = as_number(summary.get("filter_width_s")) or 1e-6
    curves = "Drag to zoom, double-click to zoom out; a click in the legend shows or hides a curve. "
    if (folder / RESULT_FILE).is_file():
        runs = load_results(folder / RESULT_FILE)
        step = "The raw force follows the time step, its mean over the filter's width hardly."
        found["Contact force"] = (curves + step, draw.force_figure(runs, width))
        if "lip" in runs:
            words = "Each row is an arc of the lip, counted from the direction of the reed's tip."
            found["Along the lip"] = (words, draw.lip_figure(runs["lip"]))
        found["Motion"] = (curves + "Positive away from the seat.", draw.motion_figure(runs))
        words = "What is put in is the work of loads and releases."
        found["Energy"] = (curves + words, draw.energy_figure(runs["wave"]))
    if (folder / SEAT_FILE).is_file():
        words = "Displacement of the struck patch after a unit impulse on it: what stands for the seat."
        found["Green's function of the seat"] = (words, draw.greens_figure(load_greens(folder / SEAT_FILE), width))
    if shares := _shares(summary):
        words = "What each part of the model may change; the error bar is made of these, with safety factors."
        found["Error budget"] = (words, draw.budget_figure(shares))
    return found


def _shares(summary: Mapping[str, Any]) -> dict[str, dict[str, float]]:
    """Source of error -> measure -> share of its value, of what summary.json has as error_<source>_<measure>."""
    bars = [key.removeprefix("error_bar_") for key in summary if key.startswith("error_bar_")]
    found: dict[str, dict[str, float]] = {}
    for measure in bars:
        value = as_number(summary.get(measure))
        for key, of in summary.items():
            source = key.removeprefix("error_").removesuffix(f"_{measure}")
            share = as_number(of)
            if key == f"error_{source}_{measure}" and source != "bar" and share and value:
                found.setdefault(source.replace("_", " "), {})[measure] = abs(share / value)
    return found


def _plan(text: str) -> str:
    try:
        plan = json.loads(text)
        rows = [[str(each[key]) for key in ("key", "value", "reason")] for each in plan["choices"]]
        notes = [str(note) for note in plan["notes"]]
    except (ValueError, LookupError, TypeError) as error:
        return f"<p>{PLAN_FILE} cannot be read: {html.escape(str(error))}</p>"
    told = "".join(f"<li>{html.escape(note)}</li>" for note in notes)
    return html_rows(("key", "value", "why"), rows) + (f"<ul>{told}</ul>" if told else "")


def _state(summary: Mapping[str, Any]) -> str:
    if (target := as_number(summary.get("accuracy_target"))) is None or "accuracy_met" not in summary:
        return ""
    met = summary["accuracy_met"] is True
    words = f"accuracy of {100 * target:.3g} % {'met' if met else 'missed'}"
    return f'<p class="state {"met" if met else "missed"}">{html.escape(words)}</p>'


def _pictures(folder: Path) -> str:
    shown, left = [], MOST_OF_PICTURES
    files = sorted(file for pattern in ("*.png", "*.gif") for file in folder.glob(pattern) if not file.is_symlink())
    for file in files:
        size = file.stat().st_size
        if file.name in INTERACTIVE:
            continue
        caption = CAPTIONS.get(file.name, file.stem.replace("_", " "))
        if size > MOST_OF_A_PICTURE or size > left:
            shown.append(f"<p>{html.escape(file.name)} is too large for this page; it lies beside the results.</p>")
            continue
        left -= size
        data = base64.b64encode(read_bytes(file, MOST_OF_A_PICTURE, ReportError)).decode("ascii")
        kind = file.suffix.removeprefix(".").lower()
        image = f'<img src="data:image/{kind};base64,{data}" alt="{html.escape(caption)}" loading="lazy">'
        shown.append(f"<figure>{image}<figcaption>{html.escape(caption)}</figcaption></figure>")
    return "".join(shown)


def _provenance(folder: Path, summary: Mapping[str, Any]) -> str:
    stages = summary.get("stages_s")
    spent = {str(k): float(v) for k, v in stages.items()} if isinstance(stages, dict) else {}
    facts = [
        ("seat", f"{summary.get('seat_kind')}: {summary.get('seat_model')}"),
        ("reed", str(summary.get("reed_kind"))),
        ("time", f"{_time(summary.get('wall_time_s'))}: {time_line(spent)}"),
        ("to reproduce", f"seatfem run {SCENE_COPY}" if (folder / SCENE_COPY).is_file() else "seatfem run SCENE"),
    ]
    files = [
        (file.name, f"{file.stat().st_size:,} bytes, SHA-256 {_digest(file)}")
        for file in sorted(folder.iterdir())
        if file.is_file() and not file.is_symlink() and file.suffix in (".json", ".h5", ".toml", ".csv")
    ]
    return html_rows(("", ""), facts) + "<h3>Files</h3>" + html_rows(("file", ""), files)


def _time(seconds: object) -> str:
    return "" if (value := as_number(seconds)) is None or not math.isfinite(value) else f"{value:.3g} s"


def _digest(file: Path) -> str:
    with file.open("rb") as opened:
        return hashlib.file_digest(opened, "sha256").hexdigest()


def _text(path: Path) -> str:
    """Of a file beside the results; "" where there is none."""
    return read_text(path, MOST_TEXT, ReportError) if path.is_file() else ""


def _div(figure: Figure, name: str) -> str:
    from plotly.io import to_html

    config = {"displaylogo": False, "responsive": True, "toImageButtonOptions": {"filename": name, "scale": 2}}
    made = to_html(figure, include_plotlyjs=False, full_html=False, config=config)
    return f'<div role="group" aria-label="{html.escape(name)}">{made}</div>'


def _plotly() -> str:
    try:
        from plotly.offline import get_plotlyjs
    except ImportError:
        raise ReportError("plotly is missing, which reports are drawn by; pip install 'seatfem[report]'") from None
    return str(get_plotlyjs()).replace("</script", "<\\/script")


def _versions() -> str:
    names = ("seatfem", "numpy", "scipy", "scikit-fem", "gmsh", "numba")
    return "Made by " + ", ".join(f"{name} {metadata.version(name)}" for name in names if _is_there(name))


def _is_there(name: str) -> bool:
    try:
        metadata.version(name)
    except metadata.PackageNotFoundError:
        return False
    return True
