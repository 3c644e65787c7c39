"""Consoles, progress bars and files of a verb: how it reads its scene and tells what it has done."""

from __future__ import annotations

from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING

from seatfem.faces.options import Common
from seatfem.faces.terminal import Console

if TYPE_CHECKING:
    from impact.progress import Progress
    from seatfem.study.runs.pipeline import RunOutcome
    from seatfem.study.scene import Scene

# Imports inside functions: `seatfem --help` must not wait for compilers and finite elements.


def console() -> Console:
    """For tables: as wide as the terminal; in a file or a pipe as wide as no number is cut."""
    terminal = Console(markup=False)
    return terminal if terminal.is_terminal else Console(width=200, markup=False)


def lines(*, stderr: bool = False, quiet: bool = False) -> Console:
    """For sentences, one a line, as they are: what a file says, and [uff], is no markup."""
    return Console(stderr=stderr, quiet=quiet, soft_wrap=True, highlight=False, markup=False)


def progress_of(common: Common, console: Console | None = None) -> AbstractContextManager[Progress]:
    """Bars on the ``console``, by default that of errors; none where the verb is to be quiet."""
    from seatfem.faces.progress_bars import progress_bars

    return progress_bars(console or lines(stderr=True), quiet=common.quiet)


def load(path: Path) -> Scene:
    """The scene, once it is known that what it needs can run here."""
    from seatfem.machine.libraries import require_gmsh_libraries
    from seatfem.study.scene import load_scene

    scene = load_scene(path)
    if any(body.needs_gmsh for body in scene.bodies.values()):
        require_gmsh_libraries()
    return scene


def tell(outcome: RunOutcome, common: Common) -> None:
    """What is worth knowing, what was written, and where the time went."""
    if common.quiet:
        return
    from seatfem.faces.tables import time_line

    told = lines()
    for message in outcome.messages:
        told.print(f"note: {message}")
    for file in outcome.files:
        told.print(f"wrote {file}")
    told.print(f"time: {time_line(outcome.stages)}")
