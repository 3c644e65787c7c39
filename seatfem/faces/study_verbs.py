"""Verbs of studies: sweep and optimise, which take a study, and trade, which takes a scene."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final, TypeVar

from cyclopts import Parameter

from impact.pictures import drawing
from seatfem.faces import study_view
from seatfem.faces.scene_verbs import SceneFile
from seatfem.faces.terminal import (
    COMMON,
    DONE,
    FAILED,
    Common,
    Console,
    Output,
    Seconds,
    console,
    lines,
    load,
    print_outcome,
    progress_of,
)
from seatfem.faces.wings import FileKind
from seatfem.study.sweep import answers, best, charts
from seatfem.study.sweep import study as study_tables
from seatfem.study.sweep import sweep as study_runs
from seatfem.study.sweep import table as study_results
from seatfem.study.sweep.effort import Effort
from seatfem.study.trade import report as trade_report
from seatfem.study.trade import trade as trades

Result = TypeVar("Result")


@Parameter(name="*")
@dataclass(frozen=True)
class Work(Effort):
    """Limits on the effort of a study, as options of a verb."""

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
        str,
        Parameter(help="Address of a scheduler of dask, whose workers run the scenes: tcp://HOST:8786 or tls://..."),
    ] = Effort.cluster
    no_pictures: Annotated[bool, Parameter(negative="", help="Tables only.")] = False


USUAL: Final = Work()


def _run_study(
    study: Path, folder: Path, work: Work, common: Common, carry_out: Callable[..., Result]
) -> tuple[Result, Console]:
    """Return the result of ``carry_out``, the table or the search of a study, in a folder; and where to print it."""
    definition, messages = study_tables.load_study(study), lines(stderr=True, quiet=common.quiet)
    with progress_of(common) as progress:
        result = carry_out(definition, folder, work, progress=progress, tell=messages.print)
    return result, lines(quiet=common.quiet)


def _print_table(table: study_results.StudyTable, common: Common) -> None:
    if not common.quiet:
        console().print(study_view.scenes_table(table))


def sweep(
    study: Annotated[Path, Parameter(help="The study file (TOML): a scene and the values of its varied keys.")],
    /,
    *,
    output: Output = None,
    work: Work = USUAL,
    common: Common = COMMON,
) -> int:
    """Run a scene over many values of its keys: one table, where its limits hold, and what follows from it; goes on
    where it stopped.

    Parameters
    ----------
    output:
        Folder for table, report, charts and journal [default: the study's name + "-sweep"].
    """
    folder = output or Path(f"{study.stem}-sweep")
    table, terminal = _run_study(study, folder, work, common, study_runs.run_study)
    files, gaps = charts.write_reports(table, folder, pictures=not work.no_pictures)
    files.append(study_view.write_page(table, folder, gaps))
    _print_table(table, common)
    tables = (folder / study_runs.TABLE, *filter(Path.exists, [folder / study_runs.PARQUET]))
    print_outcome(terminal, answers.describe_study(table), gaps, (*tables, *files))
    return DONE if table.has_numbers.all() and not table.unanswered() else FAILED


def optimise(
    study: Annotated[Path, Parameter(help="The study file (TOML) with the table [optimise].")],
    /,
    *,
    output: Output = None,
    work: Work = USUAL,
    common: Common = COMMON,
) -> int:
    """Find the values, of lists or in ranges, whose scene has the least or greatest measure; goes on where it stopped.

    Parameters
    ----------
    output:
        Folder for tables, picture and journal [default: the study's name + "-optimum"].
    """
    folder = output or Path(f"{study.stem}-optimum")
    optimum, terminal = _run_study(study, folder, work, common, study_runs.run_optimum)
    files, picture = [folder / name for name in study_runs.OF_SEARCH], folder / "search.png"
    gap = "" if work.no_pictures else best.draw_search(optimum, picture)
    files += [] if work.no_pictures or gap else [picture]
    _print_table(optimum.table(optimum.confirmed), common)
    print_outcome(terminal, optimum.sentences(), [gap], files)
    return DONE if optimum.is_met else FAILED


def trade(
    scene: SceneFile,
    /,
    *,
    output: Output = None,
    quick: Annotated[bool, Parameter(negative="")] = False,
    limit: Seconds = 20.0,
    cluster: str = "",
    common: Common = COMMON,
) -> int:
    """Measure speed against accuracy: the scene at every fidelity, as a chart and a table; goes on where it stopped.

    Parameters
    ----------
    output:
        Folder for chart, tables and journal [default: the scene's name + "-trade"].
    quick:
        Without the points in which one key is varied.
    limit:
        Processor time for one point, in seconds or with a unit (1 min); the
        reference and the loop's choice may take four times as many.
    cluster:
        Address of a scheduler of dask, whose workers carry out the points: tcp://HOST:8786 or tls://...
    """
    load(scene, terminal=lines(stderr=True, quiet=common.quiet))
    folder = output or Path(f"{scene.stem}-trade")
    with progress_of(common) as progress:
        result = trades.measure_trade(
            scene, folder / "trade.jsonl", quick=quick, time_limit=limit, cluster=cluster, progress=progress
        )
    files = [folder / "trade.csv", folder / "trade.json"]
    trade_report.write_trade(result, *files)
    terminal = lines(quiet=common.quiet)
    terminal.print(trade_report.describe_trade(result))
    gap = drawing.try_draw(lambda path: trade_report.draw_trade(result, path), folder / "trade.png")
    print_outcome(terminal, (), [gap], files if gap else [*files, folder / "trade.png"])
    return DONE


def study_ahead(path: Path) -> study_runs.Ahead | study_runs.SearchAhead:
    """Return the expected cost of a study."""
    study = study_tables.load_study(path)
    if study.optimise is not None:
        return study_runs.ahead_of(study)
    if study.number_of_scenes > study_runs.LOOKED_AT and study.error_bars == "every":
        return study_runs.ahead_of_many(study)
    return study_runs.ahead(study, study_runs.scenes_of(study)[0])


class StudyFile(FileKind):
    """Many scenes of one."""

    name, table, schema_file = "study", "vary", "seatfem-study.schema.json"

    def template(self, file: str) -> str:
        return study_tables.study_template(file=file)

    def schema(self) -> Mapping[str, Any]:
        return study_tables.study_schema()

    def expected_cost(self, path: Path, *, as_json: bool) -> str:
        ahead = study_ahead(path)
        return ahead.as_json() if as_json else ahead.in_words(ahead.workers())


VERBS: Final = (sweep, optimise, trade)
