"""Verbs that take no scene: faces, init, verify, doctor; report, view and export, which take the folder of a run."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final, Literal

from cyclopts import Parameter

from impact.files.safe_files import OutputError, check_writable, whole_file, write_whole
from impact.pictures import drawing
from seatfem import verify as verify_cases
from seatfem.faces import exchange
from seatfem.faces import tables as terminal_tables
from seatfem.faces.report import page
from seatfem.faces.terminal import COMMON, DONE, FAILED, Common, Output, console, lines, print_outcome, progress_of
from seatfem.faces.wings import file_kinds
from seatfem.machine import doctor as doctor_checks
from seatfem.machine import libraries
from seatfem.pictures import faces_picture
from seatfem.structures.inspection import mesh_file
from seatfem.study.scene import files as scene_files
from seatfem.study.scene import keys

if TYPE_CHECKING:
    from rich.console import Console

# Verbs reach the modules that they run by lazy names: `seatfem --help` must not load compilers and finite elements.


def faces(
    part: Path,
    /,
    *,
    output: Output = None,
    unit: Literal["m", "mm", "um", "inch"] | None = None,
    common: Common = COMMON,
) -> int:
    """Show the faces of a part: a table, and a picture with their numbers, by which scenes may select them.

    Parameters
    ----------
    part:
        A STEP, BREP or mesh file, or a scene (TOML), whose groups are shown then.
    output:
        File of the picture (.png, .pdf, .svg) or of the table (.csv) [default: the part's name + "-faces.png"].
    unit:
        Length unit of a file that states none [default: of BREP files mm, of meshes m].
    """
    libraries.require_gmsh_libraries()
    path, gap = output or Path(f"{part.stem}-faces.png"), ""
    try:
        check_writable(path)
    except OutputError as problem:
        if output:
            raise
        gap = str(problem)  # the table is printed nevertheless
    with progress_of(common) as progress:
        progress("reading the part", 0.0)
        geometry = (
            scene_files.part_of_scene(part) if part.suffix.lower() == ".toml" else mesh_file.open_part(part, unit)
        )
        progress("reading the part", 1.0)
    if path.suffix.lower() == ".csv":
        with whole_file(path) as temporary:
            temporary.write_text(terminal_tables.faces_csv(geometry), encoding="utf-8")
    else:
        gap = gap or drawing.try_draw(lambda file: faces_picture.draw_faces(geometry, file), path)
    if common.quiet:
        return FAILED if gap and output else DONE
    console().print(terminal_tables.faces_table(geometry))
    terminal = lines()
    if len(geometry.solids) > 1:
        console().print(terminal_tables.solids_table(geometry))
    elif len(geometry.regions) > 1:
        terminal.print(f"solids: {', '.join(geometry.regions)}")
    how = "contact = { number = 7 } or { numbers = [7, 9] }" if geometry.numbered else "the names of groups"
    terminal.print(f"scenes select by {how}, and as docs/scene.md says")
    print_outcome(terminal, (), (*geometry.notes, gap), [] if gap else [path])
    return FAILED if gap and output else DONE


def init(
    kind: str | None = None,
    /,
    *,
    output: Output = None,
    schema: Annotated[bool, Parameter(negative="")] = False,
    common: Common = COMMON,
) -> int:
    """Write a scene to begin with: a reed or a seat of this kind and what suits it.

    Needed keys have values, all others of these tables and what else may stand beside them ([stopper], [[load]], [life]
    ...) stand behind # as they would be written, with their meaning; docs/scene.md has every key of every table.

    Parameters
    ----------
    kind:
        Of a reed or a seat: flapper, cantilever, ball, annular, plate, cad ...; or of another file. Without a kind all
        are listed: reeds, seats, strikers, what other programs and measurements give, and other files.
    output:
        The file [default: the kind + ".toml"].
    schema:
        Write a JSON schema beside it, too, by which editors complete and check its keys.
    """
    if kind is None:
        console().print(terminal_tables.kinds_table())
        lines().print("next: seatfem init KIND")
        return DONE
    path, others = output or Path(f"{kind}.toml"), {each.name: each for each in file_kinds()}
    name_in_shell = shlex.quote("".join(letter if letter.isprintable() else "?" for letter in path.name))
    other = others.get(kind)
    text = other.template(name_in_shell) if other else keys.scene_template(kind, file=name_in_shell)
    if path.exists():
        raise keys.NoTemplate(f"{path}: exists already; remove it, or name another file (--output)")
    name = other.schema_file if other else keys.SCHEMA_FILE
    written = {path: f"#:schema {name}\n{text}" if schema else text}
    if schema:
        written[path.with_name(name)] = keys.schema_text(other.schema() if other else keys.scene_schema())
    check_writable(*written)
    for file, content in written.items():
        write_whole(file, content.encode("utf-8"))
    if not common.quiet:
        follows = "plan" if other else "draw"
        lines().print(f"wrote {', '.join(map(str, written))}; next: seatfem {follows} {shlex.quote(str(path))}")
    return DONE


def verify(*, measured: Annotated[bool, Parameter(negative="")] = False, common: Common = COMMON) -> int:
    """Compare with exact solutions: case, exact value, ours, error, verdict.

    Parameters
    ----------
    measured:
        Instead compare with what others measured: measured number, ours with its bar, whether both overlap.
    """
    if measured:
        return _verify_measured(common)
    with progress_of(common) as progress:
        rows = verify_cases.verification_table(progress)
    if not common.quiet:
        console().print(verify_cases.verification_table_view(rows))
    return DONE if all(row.verdict for row in rows) else FAILED


def _verify_measured(common: Common) -> int:
    with progress_of(common) as progress:
        compared = verify_cases.measured_table(progress)
    if not common.quiet:
        console().print(verify_cases.measured_table_view(compared))
    return DONE if all(row.as_stated for each in compared for row in each.rows) else FAILED


def doctor(*, common: Common = COMMON) -> int:
    """Report what is installed, what is missing, and the exact command that mends it."""
    checks = doctor_checks.doctor_report()
    gaps = [check for check in checks if check.required and not check.ok]
    if not common.quiet:
        console().print(terminal_tables.doctor_table(checks))
    for gap in gaps:
        lines(stderr=True).print(f"{gap.name}: {gap.detail}; {gap.remedy}")
    return FAILED if gaps else DONE


def report(folder: Path, /, *, output: Output = None, common: Common = COMMON) -> int:
    """Write a run as one web page, to be opened without a network: numbers, reasons, curves to zoom into, pictures.

    Parameters
    ----------
    folder:
        Of a run (seatfem run -o).
    output:
        The file [default: report.html in that folder].
    """
    _write_page(folder, output, lines(quiet=common.quiet))
    return DONE


def _write_page(folder: Path, output: Path | None, terminal: Console) -> Path:
    path = output or folder / "report.html"
    page.write_report(folder, path)
    terminal.print(f"wrote {path}")
    return path


def view(
    folder: Path,
    /,
    *,
    output: Output = None,
    no_browser: Annotated[bool, Parameter(negative="", help="Write the page only.")] = False,
    common: Common = COMMON,
) -> int:
    """Write a run as one web page, as report does, and open it in the browser.

    Modes, stress waves and landings can be turned, scrubbed, cut and pointed at. Where no browser opens, the file is
    named that is to be opened elsewhere.

    Parameters
    ----------
    folder:
        Of a run (seatfem run -o).
    output:
        The file [default: report.html in that folder].
    """
    terminal = lines(quiet=common.quiet)
    path = _write_page(folder, output, terminal)
    if not no_browser and not page.open_in_browser(path):
        terminal.print(f"no browser opens here; open {path.resolve()} in one")
    return DONE


def export(
    source: Path,
    /,
    *,
    to: Annotated[
        str,
        Parameter(
            help="; ".join(
                f"{name}: {each.words}{' (of a scene, too)' * each.takes_scenes}"
                for name, each in exchange.FORMATS.items()
            )
            + "."
        ),
    ],
    output: Output = None,
    common: Common = COMMON,
) -> int:
    """Write a scene, or the folder of a run, in the formats of other programs (docs/exchange.md).

    Parameters
    ----------
    source:
        The folder of a run (seatfem run -o) or of modes; a scene (TOML), too, where that is said.
    output:
        Folder for the files [default: that of the run; of a scene its name + "-" + the format].
    """
    terminal = lines(quiet=common.quiet)
    with progress_of(common) as progress:
        written = exchange.export(source, to, output, progress)
    for each in written:
        terminal.print(f"wrote {each}" if isinstance(each, Path) else f"note: {each}")
    return DONE


VERBS: Final = (faces, init, verify, doctor, report, view, export)
