"""The process that computes for a live page: requests come as lines of JSON, of which the newest counts; so do answers.

The server starts it (`seatfem.jobs.processes.start_worker`), and it ends with the server.
"""

from __future__ import annotations

import itertools
import json
import math
import queue
import shutil
import sys
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final, TextIO

from impact.files.safe_files import write_whole
from seatfem.faces.live.quick import Reference, march_of, reference_of, rows, with_bars
from seatfem.faces.live.sliders import LiveError, Slider, candidates, changed_file, taken
from seatfem.faces.report.asked import keep_asked
from seatfem.jobs.folders import private_folder
from seatfem.jobs.processes import answers_to_parent, lines_from_parent
from seatfem.structures.cache import Cache
from seatfem.structures.mesh.gmsh_process import gmsh_session
from seatfem.study.answers.decision import decide
from seatfem.study.answers.verdict import standing, static_seat, verdict
from seatfem.study.runs.pipeline import run_scene
from seatfem.study.runs.rounds import SEAT_FILE
from seatfem.study.safety import FAILURES
from seatfem.study.scene import Scene, load_scene
from seatfem.study.scene.files import files_of
from seatfem.study.scene.tables import changed_data

EVERY: Final = 0.1  # least time between two reports of progress [s]
FIRST: Final[Mapping[str, Any]] = {"full": True}
"""The request with which a page begins: the scene as its file states it."""


class Superseded(BaseException):
    """A newer request has come while this one was computed: no error, which a round might take for its own."""


@dataclass
class Session:
    """A scene that is moved by sliders.

    Attributes:
        path: file of the scene.
        given: changes by the command line.
        answers: stream of the answers, one line each.
        waiting: requests that have come.
        sliders: sliders by their keys.
        known: the last full run; ``None`` during the first one, which no request ends.
    """

    path: Path
    given: Mapping[str, object]
    answers: TextIO
    waiting: queue.SimpleQueue[Mapping[str, Any]] = field(default_factory=queue.SimpleQueue)
    sliders: dict[str, Slider] = field(default_factory=dict)
    known: Reference | None = None
    _told: float = -math.inf

    def serve(self) -> None:
        """Compute the scene of the file in full, and then answer requests without end."""
        request = FIRST
        while True:
            number = request.get("number", 0)
            try:
                changes = self._changes(request.get("values", {}))
                scene = load_scene(self.path, {**self.given, **changes})
                answer = self._quick(scene) if request.get("full") is not True else self._full(scene, changes)
                self.tell(number=number, values=request.get("values", {}), **answer)
            except Superseded:
                self.tell("superseded")
            except FAILURES as problem:
                self.tell("failed", words=str(problem) or type(problem).__name__)
            request = self.waiting.get()
            while not self.waiting.empty():
                request = self.waiting.get()

    def tell(self, kind: str, **content: Any) -> None:
        """Send an answer."""
        self.answers.write(json.dumps({"kind": kind, **_finite(content)}) + "\n")
        self.answers.flush()

    def progress(self, stage: str, done: float) -> None:
        """Report progress; raise `Superseded` if a newer request waits."""
        if self.known is not None and not self.waiting.empty():
            raise Superseded
        if (now := time.monotonic()) - self._told > EVERY:
            self._told = now
            self.tell("progress", done=done)

    def _changes(self, values: object) -> dict[str, object]:
        """Return the values of sliders that differ from the file, as it would have them. Raises `LiveError`."""
        changes = dict[str, object]()
        for key, number in values.items() if isinstance(values, dict) else ():
            if (slider := self.sliders.get(key)) is None or not isinstance(number, int | float):
                raise LiveError(f"{key[:80]}: is no slider of this scene; reload the page")
            changes[key] = slider.written(number)
        return changes

    def _quick(self, scene: Scene) -> dict[str, Any]:
        if (known := self.known) is None:
            raise LiveError(f"{self.path}: the scene could not be computed; mend it, and start seatfem live again")
        is_quick, is_alike = known.is_quick(scene), known.plan_for(scene) is not None
        if not is_quick:
            self.tell("computing")
        numbers, curves = march_of(known, scene, self.progress)
        summary = with_bars(known, numbers, is_known=is_alike)
        shown = {
            "rows": rows(summary, known.summary),
            "curves": curves,
            "standing": f"{standing(summary)} {static_seat(summary)}".strip(),
        }
        return {"kind": "answer", **shown, "is_quick": is_quick, "is_alike": is_alike}

    def _full(self, scene: Scene, changes: Mapping[str, object]) -> dict[str, Any]:
        """Run a scene, and write it with its results beside the file, but for the first one, that of the file."""
        self.tell("running")
        first = self.known is None
        plan = None if self.known is None else self.known.plan_for(scene)
        content = changed_file(self.path, {**self.given, **changes})
        target, folder = self._free_names()
        with private_folder("live") if first else _removed_if_stopped(folder) as folder:
            outcome = run_scene(
                scene, folder, self.progress, tell=lambda words: self.tell("round", words=words), pictures=False,
                plan=plan, histories=not first,
            )  # fmt: skip
            summary, ended = outcome.summary, outcome.plan
            known = reference_of(ended, summary, Cache(folder / SEAT_FILE), self.progress)
            if not first:
                keep_asked(content, files_of(scene), target.parent, ended, folder)
                write_whole(target, content)
        self.known = known
        if first:
            self._tell_sliders(scene)
        decision = decide(summary)
        state = f"Decision: {decision.word}. {' '.join(decision.reasons)}"
        written = f"Written: {target.name}, {folder.name}/. seatfem view {folder.name} shows the run."
        longer = known.time_step / float(str(summary["time_step_s"]))
        shown = {"rows": rows(summary, summary), "curves": known.curves, "standing": verdict(summary)}
        about = {"met": outcome.met, "state": state, "longer": longer, "written": "" if first else written}
        return {"kind": "full", **shown, **about}

    def _tell_sliders(self, scene: Scene) -> None:
        assert self.known is not None
        data = changed_data(self.path.read_text(encoding="utf-8"), self.path, self.given)
        for each in candidates(data, scene):
            if (close := taken(self.path, self.given, each)) is not None:
                self.sliders[each.key] = replace(each, is_quick=self.known.is_quick(close))
        self.tell(
            "sliders", sliders=[each.as_json() for each in self.sliders.values()], title=scene.title or self.path.stem
        )

    def _free_names(self) -> tuple[Path, Path]:
        """Return names of a scene and of a folder beside the file that do not exist."""
        for number in itertools.count(1):
            stem = f"{self.path.stem}-live-{number}"
            names = self.path.with_name(f"{stem}.toml"), self.path.with_name(f"{stem}-result")
            if not any(each.exists() or each.is_symlink() for each in names):
                break
        return names


@contextmanager
def _removed_if_stopped(folder: Path) -> Iterator[Path]:
    """Yield a new folder's path; remove it if the block does not end as it should."""
    try:
        yield folder
    except BaseException:
        shutil.rmtree(folder, ignore_errors=True)
        raise


def _finite(value: Any) -> Any:
    """Return a value without numbers that JSON lacks."""
    if isinstance(value, Mapping):
        return {key: _finite(each) for key, each in value.items()}
    if isinstance(value, list):
        return [_finite(each) for each in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def main() -> None:
    """Serve the scene that the only argument names, with changes, as JSON."""
    start = json.loads(sys.argv[1])
    session = Session(Path(start["scene"]), start["changes"], answers_to_parent())

    def take() -> None:
        for line in lines_from_parent():
            session.waiting.put(json.loads(line))

    threading.Thread(target=take, name="requests", daemon=True).start()
    with gmsh_session():
        session.serve()


if __name__ == "__main__":
    main()
