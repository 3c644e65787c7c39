"""The verb `seatfem report`: the files of a run as one web page that needs no network."""

from __future__ import annotations

import html
import json
import math
import os
import sys
import webbrowser
from collections.abc import Iterator, Mapping
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any, Final

from impact.files.safe_files import write_whole
from impact.names import how_to_mend
from impact.storage.hdf5 import load_greens, load_results
from seatfem import readings, results
from seatfem.faces.plan_view import table_of
from seatfem.faces.report import figures as draw
from seatfem.faces.report import fragments
from seatfem.faces.report.asked import PLAN_FILE, SCENE_COPY
from seatfem.faces.report.figures import MOST_OF_BODIES, body_figure, part_of_page
from seatfem.faces.report.fragments import ReportError, html_list, html_rows, html_table
from seatfem.faces.tables import SHOWN, is_baseline, landings_of, landings_tables, lands_tables, result_table
from seatfem.pictures.moving import KEPT, moving_bodies
from seatfem.study.answers.decision import Decision, decide, not_modelled, omissions
from seatfem.study.answers.verdict import against_spring, is_static, sentences
from seatfem.study.plan import Choice
from seatfem.study.runs.pipeline import RESULT_FILE
from seatfem.study.runs.rounds import SEAT_FILE
from seatfem.study.safety import source_in_words

if TYPE_CHECKING:
    from plotly.graph_objects import Figure


GUARD: Final = (
    "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:; base-uri 'none'"
)
"""Content security policy of the page: it loads nothing from a network."""
CURVES: Final = "Drag to zoom, double-click to zoom out; a click in the legend shows or hides a curve. "


def write_report(folder: Path, path: Path) -> None:
    """Write the run in ``folder`` to the HTML file ``path``, complete or not at all.

    The page contains plotly and requests nothing from a network. All text of scenes is escaped.

    Raises:
        ReportError: summary.json is missing or incomplete; plotly is missing.
        StorageError: a damaged HDF5 file of the run.
        OutputError, OSError: ``path`` cannot be written.
    """
    write_whole(path, report_page(folder).encode("utf-8"))


def report_page(folder: Path) -> str:
    """Return the page as text; raises as `write_report`."""
    summary = fragments.run_summary(folder)
    decision = decide(summary)
    sections = list(_sections(folder, summary, decision))
    links = "".join(f'<a href="#s{k}">{html.escape(title)}</a>' for k, (title, _) in enumerate(sections))
    content = "".join(
        f'<section id="s{k}" aria-labelledby="h{k}"><h2 id="h{k}">{html.escape(title)}</h2>{inner}</section>'
        for k, (title, inner) in enumerate(sections)
    )
    return Template(part_of_page("page.html")).substitute(
        {name.partition(".")[0]: part_of_page(name) for name in ("style.css", "body_parts.js", "body.js")},
        guard=GUARD,
        title=html.escape(str(summary.get("title") or folder.resolve().name)),
        plotly=_plotly(),
        first=_first_screen(folder, decision),
        links=links,
        content=content,
        versions=fragments.versions(),
    )


def _sections(folder: Path, summary: Mapping[str, Any], decision: Decision) -> Iterator[tuple[str, str]]:
    """Yield heading and content of the sections below the first screen, whose sentences they do not repeat."""
    spring, *others = (f"<p>{html.escape(line)}</p>" for line in (against_spring(summary), *sentences(summary)))
    tables = html_table(result_table(summary)) + _landings(summary)
    yield "Result", f"{spring}{tables}{''.join(others)}{_notes(summary)}"
    before = (*decision.reasons, *decision.left_out)
    if left_out := html_list(each for each in omissions(summary) if each not in before):
        yield "Also left out", left_out
    if drawing := fragments.first_picture(folder):
        yield "Drawing", drawing
    figures = _figures(folder, summary)
    for name, (caption, figure) in figures.items():
        text = html.escape(caption).replace(CURVES, f'<span class="screen">{CURVES}</span>')
        yield name, f'<figure class="plot">{_div(figure, name)}<figcaption>{text}</figcaption></figure>'
    bodies = moving_bodies(folder)
    for name, motion in bodies.items():
        yield KEPT[name], body_figure(name, motion, MOST_OF_BODIES // len(bodies))
    if spots := fragments.hot_spots(summary):
        yield "Hot spots of the seat", spots
    for prefix, title in results.all_sections():
        if table := fragments.keys_table(summary, prefix):
            yield title, table
    if shown := fragments.kept_pictures(folder, without=("greens.png",) if is_static(summary) else ()):
        yield "Pictures", shown
    if plan := fragments.text_of(folder / PLAN_FILE):
        yield from _plan(plan)
    if scene_text := fragments.text_of(folder / SCENE_COPY):
        yield "What was asked", f"<details><summary>scene file</summary><pre>{html.escape(scene_text)}</pre></details>"
    yield "How it was computed", fragments.provenance(folder, summary)


def _notes(summary: Mapping[str, Any]) -> str:
    """Return the notes of a run that are not among what was left out, as a list; "" without any."""
    notes, before = summary.get("notes"), not_modelled(summary)
    items = html_list(str(note) for note in notes if note not in before) if isinstance(notes, list) else ""
    return f"<h3>Notes</h3>{items}" if items else ""


def _first_screen(folder: Path, decision: Decision) -> str:
    """Return what happens, the decision with its reasons, and what was left out, beside the drawing of the valve."""
    drawing = fragments.first_picture(folder, caption=False)
    left_out = f"<h2>Left out</h2>{html_list(decision.left_out)}" if decision.left_out else ""
    return (
        f'<div class="first"><div><p class="event">{html.escape(decision.happens)}</p>'
        f'<p class="decision {decision.word}">{decision.word}</p>{html_list((*decision.reasons, decision.checked))}'
        f"{left_out}</div>{drawing}</div>"
    )


def _landings(summary: Mapping[str, Any]) -> str:
    """Return a table of the hardest landings, and if there are more, one of all that can be unfolded."""
    records = landings_of(summary)
    if not records:
        return ""
    shown, whole = ("".join(map(html_table, landings_tables(records, most))) for most in (SHOWN, len(records)))
    hardest = f"<h3>Landings</h3>{shown}"
    if len(records) > SHOWN:
        hardest += f"<details><summary>all {len(records)} landings</summary>{whole}</details>"
    lands = "".join(map(html_table, lands_tables(summary)))
    return f"{hardest}<h3>Lands</h3>{lands}" if lands else hardest


def _figures(folder: Path, summary: Mapping[str, Any]) -> dict[str, tuple[str, Figure]]:
    figures: dict[str, tuple[str, Figure]] = {}
    width = readings.as_number(summary.get("filter_width_s")) or 1e-6
    if (folder / RESULT_FILE).is_file():
        runs, landings = load_results(folder / RESULT_FILE), landings_of(summary)
        if is_baseline(summary):
            runs = {name: run for name, run in runs.items() if name != "spring"}  # its curves are the seat's
        step = "The raw force depends on the time step; its mean over the filter width hardly does."
        first = "The picture opens at the hardest landing; a double-click shows the whole run. " if landings else ""
        figures["Contact force"] = (CURVES + first + step, draw.force_figure(runs, width, landings))
        if "lip" in runs:
            words = "Each row is a segment of the lip, counted from the direction of the reed's tip."
            arcs = int(readings.as_number(summary.get(results.PORTS)) or 0)
            figures["Along the lip"] = (words, draw.lip_figure(runs["lip"], arcs))
        figures["Motion"] = (CURVES + "Positive away from the seat.", draw.motion_figure(runs, landings))
        words = "The energy input is the work of the loads and of the release."
        figures["Energy"] = (CURVES + words, draw.energy_figure(runs["wave"]))
    if (folder / SEAT_FILE).is_file() and not is_static(summary):  # a spring gives way at once: a spike says nothing
        words = (
            "Displacement of the contact face after a unit impulse on it; the run computes the seat's motion from it."
        )
        figures["Green's function of the seat"] = (words, draw.greens_figure(load_greens(folder / SEAT_FILE), width))
    if shares := _shares(summary):
        words = (
            "Uncertainty of what the accuracy was asked for, divided among its sources as their estimated errors. The "
            "dashed line is the accuracy asked for."
        )
        target = readings.as_number(summary.get("accuracy_target")) or 0.0
        figures["Error budget"] = (words, draw.budget_figure(shares, target))
    return figures


def _shares(summary: Mapping[str, Any]) -> dict[str, dict[str, float]]:
    """Return source of error -> measure in words -> its part of the relative uncertainty, for the measures that the
    accuracy was asked for, from the keys error_<source>_<measure> of summary.json."""
    bars = {key.removeprefix("error_bar_") for key in summary if key.startswith("error_bar_")}
    shares: dict[str, dict[str, float]] = {}
    for key in summary:
        ends = (measure for measure in bars if key.endswith(f"_{measure}") and not key.startswith("error_bar_"))
        measure = max(ends, key=len, default="")
        share, value = readings.as_number(summary[key]), readings.as_number(summary.get(measure))
        if key.startswith("error_") and measure in results.asked(summary) and share and value:
            source = source_in_words(key.removeprefix("error_").removesuffix(f"_{measure}"))
            shares.setdefault(source, {})[measure] = abs(share / value)
    sums = {measure: sum(parts.get(measure, 0.0) for parts in shares.values()) for measure in results.asked(summary)}
    scales = {  # independent errors are combined and have a safety factor: the uncertainty is not their sum
        measure: (readings.bar_of(summary, measure) or 0.0)
        / abs(readings.as_number(summary[measure]) or math.inf)
        / whole
        for measure, whole in sums.items()
        if whole > 0
    }
    return {
        source: {results.name_of(measure, summary): scales[measure] * share for measure, share in parts.items()}
        for source, parts in shares.items()
    }


def _plan(text: str) -> Iterator[tuple[str, str]]:
    """Yield the sections on a plan: the files read, which plans of earlier versions lack, and the choices."""
    try:
        plan = json.loads(text)
        read = [[str(name), str(words)] for name, words in dict(plan.get("read", {})).items()]
        choices = table_of(Choice(**each) for each in plan["choices"])
        notes = [str(note) for note in plan.get("notes", [])]
    except (ValueError, LookupError, TypeError, AttributeError) as error:
        yield "Plan and its reasons", f"<p>{PLAN_FILE} cannot be read: {html.escape(str(error))}</p>"
        return
    if read:
        yield "What was read", html_rows(("", ""), read)
    yield "Plan and its reasons", html_table(choices) + html_list(notes)


def _div(figure: Figure, name: str) -> str:
    from plotly.io import to_html

    config = {"displaylogo": False, "responsive": True, "toImageButtonOptions": {"filename": name, "scale": 2}}
    markup = to_html(figure, include_plotlyjs=False, full_html=False, config=config)
    return f'<div role="group" aria-label="{html.escape(name)}">{markup}</div>'


def _plotly() -> str:
    try:
        from plotly.offline import get_plotlyjs
    except ImportError as missing:
        raise ReportError(f"reports are drawn by plotly: {how_to_mend('plotly', 'report', missing)}") from None
    return str(get_plotlyjs()).replace("</script", "<\\/script")


SCREENS: Final = ("DISPLAY", "WAYLAND_DISPLAY", "BROWSER")
"""Environment variables; one of them is set if a browser with its own window can open."""


def open_in_browser(page: Path) -> bool:
    """Open a page in the user's browser; return whether a browser was found."""
    if sys.platform not in ("win32", "darwin") and not any(os.environ.get(name) for name in SCREENS):
        return False  # else a text-mode browser would take over the terminal
    try:
        return webbrowser.open(page.resolve().as_uri())
    except (webbrowser.Error, OSError, ValueError):  # the variable BROWSER cannot be parsed
        return False
