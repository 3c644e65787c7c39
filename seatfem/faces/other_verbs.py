"""Verbs that take no scene: init, faces of a part, verify, doctor."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated, Literal

from cyclopts import Parameter

from seatfem.faces.output import COMMON, DONE, FAILED, Common, Output, console, lines, print_outcome, progress_of

# Verbs import what they run: `seatfem --help` must not wait for compilers and finite elements.


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
        Length unit of a BREP or mesh file, which state none [default: mm, m].
    """
    from impact.files.atomic import OutputError, check_writable, whole_file
    from impact.pictures.drawing import gap_of
    from seatfem.faces.faces_table import faces_csv, faces_table
    from seatfem.machine.libraries import require_gmsh_libraries
    from seatfem.pictures.faces_picture import draw_faces
    from seatfem.structures.inspection.parts import open_part
    from seatfem.study.scene.files import part_of_scene

    require_gmsh_libraries()
    path, gap = output or Path(f"{part.stem}-faces.png"), ""
    try:
        check_writable(path)
    except OutputError as problem:
        if output:
            raise
        gap = str(problem)  # the table is told all the same
    with progress_of(common) as progress:
        progress("reading the part", 0.0)
        geometry = part_of_scene(part) if part.suffix.lower() == ".toml" else open_part(part, unit)
        progress("reading the part", 1.0)
    if path.suffix.lower() == ".csv":
        with whole_file(path) as temporary:
            temporary.write_text(faces_csv(geometry), encoding="utf-8")
    else:
        gap = gap or gap_of(lambda file: draw_faces(geometry, file), path)
    if common.quiet:
        return FAILED if gap and output else DONE
    console().print(faces_table(geometry))
    terminal = lines()
    if len(geometry.regions) > 1:
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
    """Write a scene to begin with: a reed or a seat of this kind and what suits it. Needed keys have values, all others
    of these tables and what else may stand beside them ([stopper], [[load]], [life] ...) stand behind # as they would
    be written, with their meaning; docs/scene.md has every key of every table.

    Parameters
    ----------
    kind:
        Of a reed or a seat: flapper, cantilever, ball, annular, plate, cad ...; or study: many scenes of one. Without a
        kind all are listed: reeds, seats, strikers, and what other programs and measurements give.
    output:
        The file [default: the kind + ".toml"].
    schema:
        Write a JSON schema beside it, too, by which editors complete and check its keys.
    """
    from impact.files.atomic import check_writable, write_whole
    from seatfem.faces.tables import kinds_table
    from seatfem.study.scene.schema import SCHEMA_FILE, scene_schema, schema_text
    from seatfem.study.scene.template import NoTemplate, scene_template
    from seatfem.study.sweep.study_template import STUDY, STUDY_SCHEMA_FILE, study_schema, study_template

    if kind is None:
        console().print(kinds_table())
        lines().print("next: seatfem init KIND")
        return DONE
    path, of_study = output or Path(f"{kind}.toml"), kind == STUDY
    name_in_shell = shlex.quote("".join(letter if letter.isprintable() else "?" for letter in path.name))
    text = study_template(file=name_in_shell) if of_study else scene_template(kind, file=name_in_shell)
    if path.exists():
        raise NoTemplate(f"{path}: exists already; remove it, or name another file (--output)")
    name = STUDY_SCHEMA_FILE if of_study else SCHEMA_FILE
    written = {path: f"#:schema {name}\n{text}" if schema else text}
    if schema:
        written[path.with_name(name)] = schema_text(study_schema() if of_study else scene_schema())
    check_writable(*written)
    for file, content in written.items():
        write_whole(file, content.encode("utf-8"))
    if not common.quiet:
        follows = "plan" if of_study else "draw"
        lines().print(f"wrote {', '.join(map(str, written))}; next: seatfem {follows} {shlex.quote(str(path))}")
    return DONE


def verify(*, common: Common = COMMON) -> int:
    """Compare with exact solutions: case, exact value, ours, error, verdict."""
    from seatfem.verify import verification_table, verification_table_view

    with progress_of(common) as progress:
        rows = verification_table(progress)
    if not common.quiet:
        console().print(verification_table_view(rows))
    return DONE if all(row.verdict for row in rows) else FAILED


def doctor(*, calibrate: Annotated[bool, Parameter(negative="")] = False, common: Common = COMMON) -> int:
    """Report what is installed, what is missing, and the exact command that mends it.

    Parameters
    ----------
    calibrate:
        Instead measure how fast this computer is, for the predicted times of plans; best while it is idle.
    """
    if calibrate:
        return _calibrate(common)
    from seatfem.faces.tables import doctor_table
    from seatfem.machine.doctor import doctor_report

    checks = doctor_report()
    gaps = [check for check in checks if check.required and not check.ok]
    if not common.quiet:
        console().print(doctor_table(checks))
    for gap in gaps:
        lines(stderr=True).print(f"{gap.name}: {gap.detail}; {gap.remedy}")
    return FAILED if gaps else DONE


def _calibrate(common: Common) -> int:
    from seatfem.faces.tables import rates_table
    from seatfem.machine.calibration import calibrate
    from seatfem.machine.libraries import require_gmsh_libraries
    from seatfem.machine.rates import calibration_file

    require_gmsh_libraries()
    with progress_of(common) as progress:
        machine = calibrate(progress)
    path = calibration_file()
    machine.save(path)
    if not common.quiet:
        console().print(rates_table(machine.rates(), type(machine)().rates()))
        lines().print(f"wrote {path}")
    return DONE
