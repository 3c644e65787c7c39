"""One case: a copy of a sound folder, one file of it mutated, read by the program; and the verdict."""

import io
import json
import math
import os
import re
import shutil
import sys
import time
import traceback
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import Any, Final

import numpy as np

from impact.bodies.time_series import read_time_series
from impact.files.hdf5_structure import seal_holds
from impact.measured.reading import read_impulse_response
from impact.storage.hdf5 import load_results, restore_checkpoint
from seatfem.faces.cli import run_command
from seatfem.faces.report.figures import body_figure
from seatfem.pictures.moving import load_moving
from seatfem.structures.cache import VARIABLE, Store
from seatfem.structures.formats.uff import read_impulse_response_uff
from seatfem.structures.mesh.gmsh_process import GmshSession, MeshingError
from seatfem.study.impacts import contact
from seatfem.study.runs import pictures
from seatfem.study.sweep.runner import read_journal

from .corpus import KEY, Specimen, fresh_march
from .hdf5 import HDF5, mutate
from .mutations import BYTES, TEXT, TOML

FLOOD: Final = 20_000  # characters of a message that nobody reads to its end
PEAK: Final = 1.5e9  # bytes beyond what the program takes at rest
STEPS: Final = 200_000  # in place of the 2e7 that a run may store: a case shall end
DRAWN_ONE_IN: Final = 25  # runs that draw their pictures too
STOPPED: Final = "stopped before gmsh"
PASSED: Final = ("ran", "refused", "drawn")
_KEY_NAMED: Final = re.compile(r"\b(seat|reed|run|contact|accuracy|life|title)\.\w+|\bthe seat has no\b")
_PROGRAM: Final = ("run", "draw", "greens", "plan")


@dataclass(frozen=True)
class Case:
    """A specimen, what is done to it, and which of the draws."""

    specimen: Specimen
    mutation: str
    number: int
    seed: int

    @property
    def name(self) -> str:
        """Unique; the random numbers of the case follow from it."""
        specimen = self.specimen
        return f"{specimen.entry} {specimen.name}/{specimen.target} {self.mutation} {self.number} seed {self.seed}"


@dataclass(frozen=True)
class Verdict:
    """How a case ended.

    Attributes:
        word: one of `PASSED`, or the defect.
        code: exit code of the program; -1 for a reader that raised.
        said: the beginning of the message, or the end of the traceback.
        seconds: wall time.
        peak: bytes beyond those at rest.
    """

    word: str
    code: int
    said: str
    seconds: float
    peak: float = 0.0


def mutations_of(specimen: Specimen) -> tuple[str, ...]:
    """Names of the mutations that suit the file."""
    if specimen.form == "hdf5":
        return (*HDF5, *BYTES)
    return {"toml": (*TOML, *BYTES), "text": (*TEXT, *BYTES), "bytes": tuple(BYTES)}[specimen.form]


def prepare(case: Case, corpus: Path, folder: Path) -> Path:
    """The mutated file, in a fresh copy of the specimen's folder."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(corpus / case.specimen.name, folder)
    target, random = folder / case.specimen.target, Random(case.name)
    if case.mutation in HDF5:
        mutate(target, case.mutation, random)
    else:
        change = {**BYTES, **TEXT, **TOML}[case.mutation]
        data = target.read_bytes()
        with suppress(UnicodeDecodeError):
            target.write_bytes(change(data, random))
    return target


def carry_out(case: Case, corpus: Path, folder: Path) -> Verdict:
    """Prepare, read, judge."""
    try:
        target = prepare(case, corpus, folder)
    except (OSError, ValueError, TypeError) as error:  # HDF5 does not let itself be broken in every way
        return Verdict("refused", 0, f"not written: {error}", 0.0)
    temporary = folder / "tmp"
    temporary.mkdir()
    os.environ[VARIABLE] = str(folder if case.specimen.entry == "store" else folder / "kept")
    os.environ["TMPDIR"] = str(temporary)
    before = {path.name for path in folder.iterdir()}
    at_rest = _peak(reset=True)
    start = time.perf_counter()
    with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()) as said, _pictures(case):
        code, escaped = _read(case, folder, target)
    seconds, peak = time.perf_counter() - start, _peak() - at_rest
    message = said.getvalue()
    found = _judged(case, code, message, escaped, folder, target, before) or ("memory" if peak > PEAK else "")
    if found in ("unexpected", "out of memory") and case.specimen.entry in _PROGRAM:
        escaped = _traceback(case, folder, target)
    word = found or _passed(code, message)
    return Verdict(word, code, _shortened(escaped or message, folder), round(seconds, 3), peak)


def _read(case: Case, folder: Path, target: Path) -> tuple[int, str]:
    """Exit code (-1: refused by a reader), and the traceback of what should not have escaped."""
    try:
        if case.specimen.entry in _PROGRAM:
            return run_command(_arguments(case, folder)), ""
        with np.errstate(all="ignore"):
            _READERS[case.specimen.entry](target)
    except Exception as error:
        ours = type(error).__module__.partition(".")[0] in ("seatfem", "impact")
        if case.specimen.entry in _PROGRAM or not ours:
            return -1, traceback.format_exc()
        sys.stderr.write(f"{error}\n")
        return -1, ""
    except BaseException:
        return -1, traceback.format_exc()
    return 0, ""


def _arguments(case: Case, folder: Path) -> list[str]:
    scene, verb = str(folder / "scene.toml"), case.specimen.entry
    if verb == "plan":
        return [verb, scene, "--quiet"]
    verb = "run" if verb == "draw" else verb
    out = folder / "out" / ("seat.h5" if verb == "greens" else "")
    return [verb, scene, "-o", str(out), "--quiet"]


def _judged(case: Case, code: int, message: str, escaped: str, folder: Path, target: Path, before: set[str]) -> str:
    """The defect in a word; empty: none."""
    if escaped or "Traceback" in message:
        return "traceback"
    if "this is a bug" in message:
        return "unexpected"
    if "out of memory" in message:
        return "out of memory"
    if code not in (0, 1, 2, -1):
        return "exit code"
    if left := _left_behind(folder, before):
        return left
    if len(message) > FLOOD:
        return "flood"
    lines = [line for line in message.splitlines() if line.strip() and not line.startswith("warning: ")]
    missed = code == 1 and not lines and (folder / "out" / "summary.json").exists()
    if code == 0 or missed:  # exit code 1 beside a summary: the target is missed, which the summary says
        return _numbers(folder / "out" / "summary.json")
    if not lines:
        return "silent"
    named = any(name in message for name in before) or _KEY_NAMED.search(message) or STOPPED in message
    return "" if named else "vague"


def _passed(code: int, message: str) -> str:
    if STOPPED in message:
        return "drawn"
    return "ran" if code == 0 or all(line.startswith("warning: ") for line in message.splitlines()) else "refused"


def _left_behind(folder: Path, before: set[str]) -> str:
    """Temporary files, files that are not whole, files where none belong."""
    if any((folder / "tmp").iterdir()):
        return "temporary files"
    if {path.name for path in folder.iterdir()} - before - {"out", "kept"}:
        return "stray files"
    for path in (p for name in ("out", "kept") for p in (folder / name).rglob("*") if p.is_file()):
        if path.name.startswith("."):
            return "temporary files"
        if path.stat().st_size == 0 or (path.suffix == ".h5" and seal_holds(path) is not True):
            return "half-written"
    return ""


def _numbers(summary: Path) -> str:
    if not summary.exists():
        return ""

    def refuse(_: str) -> float:
        return math.nan

    data = json.loads(summary.read_text(encoding="utf-8"), parse_constant=refuse)
    bad = [key for key, value in data.items() if isinstance(value, float) and not math.isfinite(value)]
    return f"not finite: {', '.join(bad[:3])}" if bad else ""


def _traceback(case: Case, folder: Path, target: Path) -> str:
    """The same again, with the traceback let through."""
    shutil.rmtree(folder / "out", ignore_errors=True)
    try:
        with redirect_stderr(io.StringIO()), _pictures(case):
            run_command([*_arguments(case, folder), "--debug"])
    except BaseException:
        return traceback.format_exc()
    return ""


def _shortened(text: str, folder: Path) -> str:
    text = text.replace(str(folder), "")
    return text if len(text) < 1200 else f"{text[:300]} ... {text[-900:]}"


def _peak(*, reset: bool = False) -> float:
    """Largest resident memory since the last reset [bytes]; 0 where the system does not tell."""
    try:
        if reset:
            Path("/proc/self/clear_refs").write_text("5")
        text = Path("/proc/self/status").read_text(encoding="ascii")
    except OSError:
        return 0.0
    found = re.search(r"VmHWM:\s+(\d+) kB", text)
    return 1024.0 * int(found[1]) if found else 0.0


@contextmanager
def _pictures(case: Case) -> Iterator[None]:
    """Pictures for some runs only; fewer steps; no gmsh for scenes that are carried out up to it."""
    drawn = Random(case.name + " pictures").randrange(DRAWN_ONE_IN) == 0
    changes: list[tuple[Any, str, Any]] = [(contact, "MAX_STEPS", STEPS)]
    if not drawn:
        changes.append((pictures, "draw_run", lambda *_: ((), ())))
    if case.specimen.entry == "draw":
        changes.append((GmshSession, "__call__", _stop))
    kept = [(owner, name, getattr(owner, name)) for owner, name, _ in changes]
    for owner, name, value in changes:
        setattr(owner, name, value)
    try:
        yield
    finally:
        for owner, name, value in kept:
            setattr(owner, name, value)


def _stop(*_: object) -> None:
    raise MeshingError(STOPPED)


def _store(path: Path) -> None:
    """A damaged entry is as good as none."""
    found = Store(path.parent).get(KEY)
    if found is not None:
        found.impulse_response(np.linspace(0.0, 1e-4, 10))


def _march(path: Path) -> None:
    stepper = fresh_march()
    restore_checkpoint(stepper, path)
    stepper.advance(50)


def _body(path: Path) -> None:
    """As a report has it: numbers that its script can read."""
    made = load_moving(path)
    told = body_figure(path.name, made).partition('<script type="application/json">')[2].partition("</script>")[0]

    def refuse(number: str) -> float:
        raise AssertionError(f"{number} is no JSON")

    assert json.loads(told, parse_constant=refuse)["labels"]


_READERS: Final[dict[str, Callable[[Path], object]]] = {
    "results": load_results,
    "checkpoint": _march,
    "series": lambda path: read_time_series(path, "pressure"),
    "impulse": read_impulse_response,
    "impulse-uff": lambda path: read_impulse_response_uff(path, ports={"contact": (7, "+z")}),
    "store": _store,
    "journal": read_journal,
    "moving": _body,
}
