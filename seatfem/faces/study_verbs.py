"""The verbs that take a study: sweep, optimise; and what plan tells of one."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Final

from cyclopts import Parameter

from seatfem.faces.output import (
    COMMON,
    DONE,
    FAILED,
    Common,
    Output,
    Seconds,
    lines,
    print_outcome,
    progress_of,
)
from seatfem.study.sweep.effort import Effort

if TYPE_CHECKING:
    from seatfem.study.sweep.ahead import Ahead
    from seatfem.study.sweep.optimum import SearchAhead

# Verbs import what they run: `seatfem --help` must not wait for compilers and finite elements.


@Parameter(name="*")
@dataclass(frozen=True)
class Work(Effort):
    """Limits on what a study may take, as options."""

    workers: Annotated[
        int | None, Parameter(help="Processes that run scenes [default: one a core, as far as the memory does].")
    ] = Effort.workers
    rounds: Annotated[
        int, Parameter(help="At most so many rounds of refinement of each scene, the first included.")
    ] = Effort.rounds
    limit: Annotated[Seconds, Parameter(help="Time of the clock for one scene: seconds, or with a unit (10 min).")] = (
        Effort.limit
    )
    retry: Annotated[bool, Parameter(negative="", help="Try scenes again that have failed before.")] = Effort.retry
    cluster: Annotated[
        str | None,
        Parameter(help="Address of a scheduler of dask, whose workers run the scenes: tcp://HOST:8786 or tls://..."),
    ] = Effort.cluster
    no_pictures: Annotated[bool, Parameter(negative="", help="Tables only.")] = False


USUAL: Final = Work()


def sweep(
    study: Annotated[Path, Parameter(help="The study file (TOML): a scene and the values of its varied keys.")],
    /,
    *,
    output: Output = None,
    work: Work = USUAL,
    common: Common = COMMON,
) -> int:
    """Run a scene over many values of its keys: one table, and what follows from it; goes on where it stopped.

    Parameters
    ----------
    output:
        Folder for table, reports and journal [default: the study's name + "-sweep"].
    """
    from seatfem.study.sweep.reports import write_reports
    from seatfem.study.sweep.study import load_study
    from seatfem.study.sweep.sweep import PARQUET, TABLE, run_study

    definition = load_study(study)
    folder, terminal = output or Path(f"{study.stem}-sweep"), lines(quiet=common.quiet)
    spoken = lines(stderr=True, quiet=common.quiet)
    with progress_of(common) as progress:
        table = run_study(definition, folder, work, file=study, progress=progress, tell=spoken.print)
    files, gaps = write_reports(table, folder, pictures=not work.no_pictures)
    states = list(table.columns["status"])
    counts = ", ".join(f"{states.count(state)} {state}" for state in dict.fromkeys(states))
    terminal.print(f"{definition.heading}: {len(table)} scenes, {counts}")
    sentences = (table.left_out_in_words(), *table.ranges(), *table.empty_in_words(), *table.failures())
    print_outcome(terminal, sentences, gaps, (folder / TABLE, *filter(Path.exists, [folder / PARQUET]), *files))
    return DONE if table.has_numbers.all() and not table.unanswered() else FAILED


def optimise(
    study: Annotated[Path, Parameter(help="The study file (TOML) with the table [optimise].")],
    /,
    *,
    output: Output = None,
    work: Work = USUAL,
    common: Common = COMMON,
) -> int:
    """Find the values within their ranges whose scene has the least or greatest measure; goes on where it stopped.

    Parameters
    ----------
    output:
        Folder for tables, picture and journal [default: the study's name + "-optimum"].
    """
    from seatfem.study.sweep.best import draw_search
    from seatfem.study.sweep.optimum import run_optimum
    from seatfem.study.sweep.study import load_study

    definition = load_study(study)
    folder, terminal = output or Path(f"{study.stem}-optimum"), lines(quiet=common.quiet)
    spoken = lines(stderr=True, quiet=common.quiet)
    with progress_of(common) as progress:
        optimum = run_optimum(definition, folder, work, file=study, progress=progress, tell=spoken.print)
    numbers = optimum.as_json()
    counts = f"{numbers['searched']} scenes searched, {numbers['failed']} failed, {numbers['confirmed']} confirmed"
    terminal.print(f"{definition.heading}: {counts}")
    files, picture = [folder / name for name in ("optimum.json", "optimum.csv", "search.csv")], folder / "search.png"
    gap = "" if work.no_pictures else draw_search(optimum, picture)
    files += [] if work.no_pictures or gap else [picture]
    sentences = (numbers["left_out"], *optimum.table(optimum.searched).failures(), optimum.in_words())
    print_outcome(terminal, sentences, [gap], files)
    return DONE if optimum.is_met else FAILED


def study_ahead(path: Path) -> Ahead | SearchAhead | None:
    """Return what a study would take; ``None`` for other files."""
    from seatfem.study.scene.load import has_table

    if not has_table(path, "vary"):
        return None
    from seatfem.study.sweep.ahead import LOOKED_AT, ahead, ahead_of_many
    from seatfem.study.sweep.optimum import ahead_of
    from seatfem.study.sweep.study import load_study
    from seatfem.study.sweep.sweep import scenes_of

    study = load_study(path)
    if study.optimise is not None:
        return ahead_of(study, file=path)
    if study.number_of_scenes > LOOKED_AT and study.error_bars == "every":
        return ahead_of_many(study, file=path)
    return ahead(study.scene, scenes_of(study, file=path)[0])
