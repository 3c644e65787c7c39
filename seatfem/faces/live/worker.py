"""The process that computes for a live page: requests come as lines of JSON, the newest counts; answers go as lines.

The server starts it (`seatfem.jobs.processes.start_worker`) and ends it; it ends with the server in any case.
"""

from __future__ import annotations

import json
import math
import queue
import sys
import threading
import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final, TextIO

from impact.files.safe_files import OutputError, write_whole
from seatfem.faces.live.quick import Reference, march_of, reference_of, rows, with_bars
from seatfem.faces.live.sliders import LiveError, Slider, candidates, changed_file, taken
from seatfem.faces.report.asked import keep_asked
from seatfem.faces.verdict import judged_words, standing, verdict
from seatfem.jobs.folders import private_folder
from seatfem.jobs.processes import answers_to_parent, lines_from_parent
from seatfem.structures.cache import Cache
from seatfem.structures.mesh.gmsh_process import gmsh_session
from seatfem.study.runs.pipeline import run_scene
from seatfem.study.runs.rounds import SEAT_FILE
from seatfem.study.safety import FAILURES
from seatfem.study.scene import Scene, load_scene
from seatfem.study.scene.parcel import files_of
from seatfem.study.scene.tables import changed_data

EVERY: Final = 0.1  # least time between two reports of progress [s]
MOST_FILES: Final = 1000  # most scenes that a live page writes beside one

Request = Mapping[str, Any]


class Superseded(Exception):
    """A newer request has come while this one was computed."""


@dataclass
class Desk:
    """Requests that come from the page, and answers that go to it.

    Attributes:
        answers: stream of the answers.
        waiting: requests that have come.
        is_held: whether what is computed goes on even if a newer request comes.
    """

    answers: TextIO
    waiting: queue.SimpleQueue[Request] = field(default_factory=queue.SimpleQueue)
    is_held: bool = False
    _told: float = -math.inf

    def listen(self) -> None:
        """Take the requests from the server, from now on."""
        lines = lines_from_parent()

        def take() -> None:
            for line in lines:
                self.waiting.put(json.loads(line))

        threading.Thread(target=take, name="requests", daemon=True).start()

    def newest(self) -> Request:
        """Return the newest request; wait for one."""
        request = self.waiting.get()
        while not self.waiting.empty():
            request = self.waiting.get()
        return request

    def tell(self, kind: str, **content: Any) -> None:
        """Send an answer, as one line."""
        self.answers.write(json.dumps({"kind": kind, **_finite(content)}) + "\n")
        self.answers.flush()

    def progress(self, stage: str, done: float) -> None:
        """Report progress; raise `Superseded` if a newer request waits."""
        if not self.is_held and not self.waiting.empty():
            raise Superseded
        if (now := time.monotonic()) - self._told > EVERY:
            self._told = now
            self.tell("progress", stage=stage, done=done)


def _finite(value: Any) -> Any:
    """Return a value without numbers that JSON lacks."""
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, Mapping):
        return {key: _finite(each) for key, each in value.items()}
    return [_finite(each) for each in value] if isinstance(value, list | tuple) else value


@dataclass
class Session:
    """A scene that is moved by sliders: its file, changes by the command line, the last full run."""

    desk: Desk
    path: Path
    given: Mapping[str, object]
    sliders: Mapping[str, Slider] = field(default_factory=dict)
    known: Reference | None = None

    def serve(self) -> None:
        """Compute the scene of the file in full, and then answer requests without end."""
        self._answer({"full": True, "values": {}, "first": True})
        while True:
            self._answer(self.desk.newest())

    def _answer(self, request: Request) -> None:
        number = request.get("number", 0)
        try:
            changes = self._changes(request.get("values", {}))
            scene = load_scene(self.path, {**self.given, **changes})
            if request.get("full") is True:
                answer = self._in_full(scene, changes, is_first=request.get("first") is True, number=number)
            else:
                answer = self._quick(scene, number)
            self.desk.tell(number=number, values=request.get("values"), **answer)
        except Superseded:
            self.desk.tell("superseded", number=number)
        except FAILURES as problem:
            self.desk.tell("failed", number=number, words=str(problem) or type(problem).__name__)

    def _changes(self, values: object) -> dict[str, object]:
        """Return the values of sliders that differ from the file, as it would have them. Raises `LiveError`."""
        if not isinstance(values, Mapping):
            raise LiveError("values: is no table; reload the page")
        changes = dict[str, object]()
        for key, number in values.items():
            if (slider := self.sliders.get(key)) is None or not isinstance(number, int | float):
                raise LiveError(f"{key[:80]}: is no slider of this scene; reload the page")
            if number != slider.number:
                changes[key] = slider.written(number)
        return changes

    def _quick(self, scene: Scene, number: int) -> dict[str, Any]:
        if self.known is None:
            raise LiveError("the scene has not been computed; see the message before, and mend the file")
        begun, is_quick = time.perf_counter(), self.known.is_quick(scene)
        if not is_quick:
            self.desk.tell("computing", number=number)
        numbers, curves = march_of(self.known, scene, self.desk.progress)
        is_alike = self.known.plan_for(scene) is not None
        summary = with_bars(self.known, numbers, is_known=is_alike)
        table = rows(summary, self.known.summary)
        about = {"is_quick": is_quick, "is_alike": is_alike, "seconds": time.perf_counter() - begun, "standing": standing(summary)}
        return {"kind": "answer", "rows": table, "curves": curves, **about}

    def _in_full(self, scene: Scene, changes: Mapping[str, object], *, is_first: bool, number: int) -> dict[str, Any]:
        """Run a scene, and write it with its results beside the file, but for that of the file itself."""
        self.desk.is_held = is_first
        plan = None if self.known is None else self.known.plan_for(scene)
        self.desk.tell("running", number=number, first=is_first)

        def tell(sentence: str) -> None:
            self.desk.tell("round", words=sentence)

        try:
            with private_folder("live") as private:
                target, folder = (self.path, private) if is_first else self._free_names()
                content = changed_file(self.path, {**self.given, **changes})
                listen = self.desk.progress
                outcome = run_scene(scene, folder, listen, tell=tell, pictures=False, plan=plan, histories=not is_first)
                assert outcome.plan is not None
                if not is_first:
                    write_whole(target, content)
                    keep_asked(content, files_of(scene), target.parent, outcome.plan, folder)
                known = reference_of(outcome.plan, outcome.summary, Cache(folder / SEAT_FILE), self.desk.progress)
        finally:
            self.desk.is_held = False
        self.known = known
        if is_first:
            self._find_sliders(scene)
        return {
            "kind": "full",
            "rows": rows(outcome.summary, outcome.summary),
            "curves": known.curves,
            "standing": verdict(outcome.summary),
            "met": outcome.met,
            "target": scene.accuracy.target,
            "judged": judged_words(outcome.summary),
            "longer": known.time_step / float(str(outcome.summary["time_step_s"])),
            "written": [] if is_first else [target.name, f"{folder.name}/"],
        }

    def _find_sliders(self, scene: Scene) -> None:
        assert self.known is not None
        data = changed_data(self.path.read_text(encoding="utf-8"), self.path, self.given)
        for each in candidates(data, scene):
            if (close := taken(self.path, self.given, each)) is not None:
                self.sliders = {**self.sliders, each.key: replace(each, is_quick=self.known.is_quick(close))}
        shown = sorted(self.sliders.values(), key=lambda each: not each.is_quick)
        name = scene.title or self.path.stem
        self.desk.tell("sliders", sliders=[each.as_json() for each in shown], title=name, file=self.path.name)

    def _free_names(self) -> tuple[Path, Path]:
        """Return names of a scene and of a folder beside the file that do not exist."""
        for number in range(1, MOST_FILES):
            stem = f"{self.path.stem}-live-{number}"
            names = self.path.with_name(f"{stem}.toml"), self.path.with_name(f"{stem}-result")
            if not any(each.exists() or each.is_symlink() for each in names):
                return names
        raise OutputError(f"{self.path.parent}: has {MOST_FILES - 1} files of live pages; remove some")


def main() -> None:
    """Serve the scene that the only argument names, with changes, as JSON."""
    start = json.loads(sys.argv[1])
    desk = Desk(answers_to_parent())
    desk.listen()
    with gmsh_session():
        Session(desk, Path(start["scene"]), start["changes"]).serve()


if __name__ == "__main__":
    main()
