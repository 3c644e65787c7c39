"""The sheet of mistakes (`tests/faces/mistakes.toml`): scenes and commands of users gone wrong, and their answers."""

import re
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from io import StringIO
from pathlib import Path
from unittest.mock import patch

from seatfem.faces.cli import run_command
from seatfem.study.impacts import layout
from seatfem.study.impacts.contact import check_step
from seatfem.study.runs import forecast, pipeline
from seatfem.study.scene import Scene, files
from seatfem.study.sweep import sweep

SHEET = tomllib.loads((Path(__file__).parent / "faces" / "mistakes.toml").read_text(encoding="utf-8"))


@dataclass(frozen=True)
class Mistake:
    """A scene or command that is wrong, and what the answer must name.

    Attributes:
        name: what the user got wrong.
        key, value, remedy: texts of its line of the answer: the key or option, its value or the limit, what to do.
        at: file and line of the key; "" of a command.
        scene: name of the scene that is changed, in the sheet.
        change, swap: pairs of old and new text, in the scene and in the file of strength.
        files: further files by name; ``folders``: further folders.
        command: arguments of the command line.
        warned: whether the scene may be as it is: it is computed after a warning.
    """

    name: str
    key: str
    value: str
    remedy: list[str]
    at: str = ""
    scene: str = "valve"
    change: list[list[str]] = field(default_factory=list)
    swap: list[list[str]] = field(default_factory=list)
    files: dict[str, str] = field(default_factory=dict)
    folders: list[str] = field(default_factory=list)
    command: tuple[str, ...] = ("plan", "scene.toml")
    warned: bool = False

    def texts(self) -> dict[str, str]:
        """Return all files by name: the scene with its mistake, and those that it names."""
        texts = {"scene.toml": SHEET["scene"][self.scene], **SHEET["files"]}
        for file, changes in (("scene.toml", self.change), ("strength.toml", self.swap)):
            for old, new in changes:
                assert old in texts[file], old
                texts[file] = texts[file].replace(old, new, 1)
        return texts | self.files

    def write(self) -> set[str]:
        """Write all files and folders into the working directory, and return their names."""
        for folder in self.folders:
            Path(folder).mkdir()
        for name, text in self.texts().items():
            Path(name).write_text(text, encoding="utf-8")
        return {*self.folders, *self.texts()}

    def answer(self, verb: str = "") -> tuple[int, str]:
        """Return exit code and what the command line says, run in the working directory; ``verb``: in place of that of
        the command. What would be computed of a scene whose files are right is left out."""
        said = StringIO()
        with nothing_computed(), redirect_stdout(said), redirect_stderr(said):
            code = run_command([verb or self.command[0], *self.command[1:]])
        return code, said.getvalue().replace(f"{Path.cwd()}/", "")

    def line_of(self, answer: str) -> str:
        """Return the line of an answer that names file, line and key; all of it, unwrapped, for a command."""
        if not self.at:
            return " ".join(re.sub("[╭╮╰╯│─]", " ", answer).split())
        return next((line for line in answer.splitlines() if f"{self.at}: {self.key}" in line), "")


class Computed(Exception):
    """A scene would be computed from here on."""


@contextmanager
def nothing_computed() -> Iterator[None]:
    """Raise `Computed` where a scene would be computed or drawn, after its files are checked."""

    def stop(scene: Scene, *_: object, **__: object) -> None:
        check_step(scene)
        files.check_files(scene)
        raise Computed

    assert sweep.ahead_of  # loaded now, as it takes `look_at` by its name
    with (
        patch.object(forecast, "look_at", stop),
        patch.object(pipeline, "run_scene", stop),
        patch.object(layout.scene_drawing, "draw_layout", side_effect=Computed),
    ):
        yield


MISTAKES = [Mistake(**each) for each in SHEET["mistake"]]
