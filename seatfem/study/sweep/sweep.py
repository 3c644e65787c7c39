"""A study carried out: checked, run in workers, one table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any, Final

import numpy as np
from pydantic import ValidationError

from impact.progress import Progress, Tell, silent, untold
from seatfem.jobs.folders import private_folder
from seatfem.machine.libraries import require_gmsh_libraries
from seatfem.study.safety import MOST_ROUNDS
from seatfem.study.scene import Scene, SceneError, load_scene, located
from seatfem.study.scene.problems import explain
from seatfem.study.sweep.ahead import LOOKED_AT, ahead, ahead_of_many
from seatfem.study.sweep.cases import Case, cases_of
from seatfem.study.sweep.effort import USUAL, Effort
from seatfem.study.sweep.runner import Runner, StudyError, check_effort, crew_of, folder_of_ours
from seatfem.study.sweep.sampled import divided, settings
from seatfem.study.sweep.study import Study
from seatfem.study.sweep.table import (
    StudyTable,
    as_frame,
    check_measures,
    is_usable,
    measures_of,
    table_of,
    write_columns,
    write_parquet,
)

TABLE: Final = "study.csv"
PARQUET: Final = "study.parquet"
Measures = tuple[str, ...]


def run_study(
    study: Study,
    folder: Path,
    effort: Effort = USUAL,
    *,
    file: Path | None = None,
    progress: Progress = silent,
    tell: Tell = untold,
) -> StudyTable:
    """Run every scene of a study, and write its table in study.csv (study.parquet where pyarrow is there).

    Outcomes go to a journal in ``folder`` one by one and are taken from there: a study that was stopped at any moment
    goes on where it was, with the same numbers. Scenes that fail stand in the table with their message.

    Args:
        effort: workers, and what each scene may take.
        file: of the study, for messages.
        tell: hears how many scenes there are to compute, and what is predicted of them.

    Raises:
        SceneError: all that is wrong with the scenes, before anything runs.
        StudyError: measures that no summary has, another sweep in the folder, numbers without meaning, an optional
            package for tables that is installed and cannot be imported.
        OutputError: ``folder`` cannot be written to. Also what plans raise.
        ClusterError: of the cluster.
    """
    workers = check_effort(effort)
    is_usable("pyarrow")  # not first when its file is written, after the last scene
    if study.optimise is not None:
        words = "this study asks for one best scene; run it by seatfem optimise, or remove the table"
        raise StudyError(f"optimise: {words}")
    if study.number_of_scenes > LOOKED_AT and study.error_bars == "every":
        predicted = ahead_of_many(study, file)
        tell(predicted.in_words(workers or predicted.workers()))
    cases, scene, measures = scenes_of(study, effort.rounds, file, progress)
    if any(body.traits.needs_gmsh for body in scene.bodies.values()):
        require_gmsh_libraries()
    with folder_of_ours(folder) as journal:
        runner = Runner(study, journal, effort, partial(check_measures, measures))
        if pending := runner.pending(cases):
            predicted = ahead(study.scene, pending)
            workers = workers or predicted.workers()
            tell(predicted.in_words(workers))
        if any(case.key in runner.known for case in cases):
            tell(f"{len(cases) - len(pending)} of {len(cases)} scenes are in {journal} already")
        with crew_of(workers or 1, effort.cluster) as ask:
            outcomes = runner.carry_out(cases, ask, progress)
        table = table_of(study, cases, outcomes, measures)
        write_columns(folder / TABLE, table.columns)
        write_parquet(folder / PARQUET, table.columns)
    return table


def scenes_of(
    study: Study, rounds: int = MOST_ROUNDS, file: Path | None = None, progress: Progress = silent
) -> tuple[list[Case], Scene, Measures]:
    """Return all scenes of a study as they are going to be carried out, the first of them, and the measures asked for.

    Raises `SceneError` of what is wrong; ``file``: of the study, for messages.
    """
    cases = cases_of(study, rounds, file, progress=progress)
    scene = load_scene(study.scene, cases[0].changed)
    measures = measures_of(study, scene.accuracy.judged)
    if study.error_bars == "every":
        return cases, scene, measures
    changes = [{**each.changed, **settings(scene)} for each in cases]
    try:
        return divided(study, cases_of(study, rounds, file, changes), scene, measures), scene, measures
    except SceneError as error:
        raise located(error, file) from None


def sweep(
    scene: Path | str,
    vary: Mapping[str, object],
    *,
    design: str = "grid",
    number: int | None = None,
    seed: int = 1,
    limit: int = 10_000,
    measures: Sequence[str] = (),
    error_bars: str = "every",
    folder: Path | str | None = None,
    workers: int = 1,
    rounds: int = MOST_ROUNDS,
    cluster: str | None = None,
    progress: Progress = silent,
) -> Any:
    """Run a study; return its table: a pandas DataFrame if pandas is there, else lists by names of columns.

        seatfem.sweep("scene.toml", {"contact.gap": ["0 mm", "0.1 mm"], "reed.n_modes": [10, 20]})

    Args:
        scene: its file.
        vary: by dotted key a list of values as the file would have them, or a table as in [vary] (docs/studies.md).
        design: "grid", "zip", "latin_hypercube", "sobol", "monte_carlo" or "sobol_indices".
        number, seed: of what is drawn.
        limit: scenes that are allowed at most.
        measures: keys of summary.json; where none those that the scene is judged by, of its accuracy.measures.
        error_bars: "every", or "sampled" of scenes that differ in contact data alone.
        folder: of the journal, by which a stopped study goes on, and of study.csv; none is kept where absent.
        workers: processes.
        rounds: of refinement of each scene, at most.
        cluster: address of a scheduler of dask (docs/cluster.md), in place of ``workers``.

    Returns:
        One row a scene: "scene" (its number), what varies, the measures [SI] and their error bars, "landing_status"
        (landed, no landing, cut off, never opened), "status" (done, missed, stopped, failed), "wall_time_s", "message",
        "notes" (of the run, divided by " | ").

    Raises `SceneError`, `StudyError`, `OutputError`: as `run_study`.
    """
    values = {key: each.tolist() if isinstance(each, np.ndarray) else each for key, each in vary.items()}
    content = {"scene": str(scene), "vary": values, "design": design, "seed": seed, "limit": limit}
    content |= {"error_bars": error_bars, "outputs": {"measures": list(measures)}}
    content |= {} if number is None else {"number": number}
    try:
        study = Study.model_validate(content, context={"folder": Path()})
    except ValidationError as error:
        raise SceneError(explain(error, Study, content, Path(scene), {})) from None
    for package in ("pyarrow", "pandas"):  # pandas imports the other one
        is_usable(package)
    with ExitStack() as ours:
        place = ours.enter_context(private_folder("study")) if folder is None else Path(folder)
        effort = Effort(None if cluster else workers, rounds, cluster=cluster)
        table = run_study(study, place, effort, progress=progress)
        return as_frame(table.columns)
