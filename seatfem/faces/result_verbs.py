"""Verbs that take the folder of a run: report, view, export, which takes scenes, too."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from cyclopts import Parameter

from seatfem.faces.output import COMMON, DONE, Common, Output, lines, progress_of

# Verbs import what they run: `seatfem --help` must not wait for compilers and finite elements.


def report(folder: Path, /, *, output: Output = None, common: Common = COMMON) -> int:
    """Write a run as one web page, to be opened without a network: numbers, reasons, curves to zoom into, pictures.

    Parameters
    ----------
    folder:
        Of a run (seatfem run -o).
    output:
        The file [default: report.html in that folder].
    """
    from seatfem.faces.report.page import write_report

    path = output or folder / "report.html"
    write_report(folder, path)
    lines(quiet=common.quiet).print(f"wrote {path}")
    return DONE


def view(
    folder: Path,
    /,
    *,
    output: Output = None,
    no_browser: Annotated[bool, Parameter(negative="", help="Write the page only.")] = False,
    common: Common = COMMON,
) -> int:
    """Write a run as one web page, as report does, and open it in the browser: modes, stress waves and landings to
    turn, scrub, cut and point at. Where no browser opens, the file is named that is to be opened elsewhere.

    Parameters
    ----------
    folder:
        Of a run (seatfem run -o).
    output:
        The file [default: report.html in that folder].
    """
    from seatfem.faces.report.browser import open_in_browser
    from seatfem.faces.report.page import write_report

    path = output or folder / "report.html"
    write_report(folder, path)
    terminal = lines(quiet=common.quiet)
    terminal.print(f"wrote {path}")
    if not no_browser and not open_in_browser(path):
        terminal.print(f"no browser opens here; open {path.resolve()} in one")
    return DONE


def export(
    source: Path, /, *, to: Annotated[str, Parameter(name="--to")], output: Output = None, common: Common = COMMON
) -> int:
    """Write a scene, or the folder of a run, in the formats of other programs (docs/exchange.md).

    Parameters
    ----------
    source:
        The folder of a run (seatfem run -o) or of modes; for calculix, reduced and dxf a scene (TOML), too.
    to:
        csv: force.csv and summary.csv for spreadsheets; uff: the seat's receptance (universal file, dataset 58) and
        modes (55); vtk: modes, stress waves and landings for ParaView; calculix: decks for ccx on the seat's mesh, our
        answers beside them; reduced: the seat's M, C, K and state space, .npz, .mat and .mtx; dxf: the reed's outline.
    output:
        Folder for the files [default: that of the run; of a scene its name + "-" + the format].
    """
    from seatfem.faces.exchange import export as write

    terminal = lines(quiet=common.quiet)
    with progress_of(common) as progress:
        written = write(source, to, output, progress)
    for each in written:
        terminal.print(f"wrote {each}" if isinstance(each, Path) else f"note: {each}")
    return DONE
