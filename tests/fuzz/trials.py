"""Trials under limits: a damaged copy of a sound folder is read; and the verdicts."""

import faulthandler
import io
import json
import math
import os
import re
import resource
import shutil
import signal
import sys
import traceback
from collections.abc import Callable, Sequence
from contextlib import ExitStack, redirect_stderr, redirect_stdout
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from random import Random
from typing import Final
from unittest.mock import patch

import numpy as np

from impact.storage.hdf5 import seal_holds
from seatfem.faces.cli import run_command
from seatfem.jobs.crew import Lost, crew
from seatfem.jobs.processes import limit_process
from seatfem.machine.resources import forget_peak, peak_memory
from seatfem.structures.cache import VARIABLE
from seatfem.structures.mesh.gmsh_process import GmshSession, MeshingError
from seatfem.study.impacts import contact

from .mutations import BYTES, TEXT, TOML
from .samples import Sample, build

SECONDS: Final = 150.0  # of a trial; gmsh may try to read a file for 100 s
MEMORY: Final = 4 << 30  # bytes of address space beyond what the libraries map
PEAK: Final = 1.5e9  # bytes beyond what the program takes at rest
FLOOD: Final = 20_000  # characters of a message that nobody reads to its end
STEPS: Final = 200_000  # in place of the 2e7 that a run may store: a trial shall end
STOPPED: Final = "stopped before gmsh"
PASSED: Final = ("ran", "refused")
_NAMED: Final = re.compile(r"\b(seat|reed|run|contact|accuracy|life|title|load)\b")


@dataclass(frozen=True)
class Verdict:
    """How a trial ended.

    Attributes:
        word: one of `PASSED`, or the defect.
        said: the beginning of the message, or the end of the traceback.
        seconds: of the processor, with those of helping processes.
        peak: bytes beyond those at rest.
    """

    word: str
    said: str
    seconds: float
    peak: float


def trials_of(samples: dict[str, Sample], total: int, seed: int) -> list[str]:
    """Return at least ``total`` trials, "SAMPLE MUTATION NUMBER SEED" each: every sample with every mutation that suits
    it, by the samples' shares, in an order that mixes them."""
    weight = sum(sample.share for sample in samples.values())
    found = []
    for name, sample in samples.items():
        names = {"toml": (*TOML, *BYTES), "text": (*TEXT, *BYTES), "bytes": (*BYTES,)}[sample.form]
        count = max(1, round(total * sample.share / weight))
        found += [f"{name} {names[k % len(names)]} {k // len(names)} {seed}" for k in range(count)]
    Random(seed).shuffle(found)
    return found


def run_trials(trials: Sequence[str], folder: Path, tell: Callable[[str], None]) -> dict[str, Verdict]:
    """Return the verdicts; a trial that ends its process, or does not end, fails alone."""
    verdicts: dict[str, Verdict] = {}
    with crew("tests.fuzz.trials:reply", renew=300) as ask:
        for number, answer in ask([json.dumps([trial, str(folder.resolve())]) for trial in trials], SECONDS):
            if isinstance(answer, Lost):
                verdict = Verdict("hang" if answer.hung else "crash", answer.log[:1100], answer.seconds, 0.0)
            else:
                verdict = Verdict(**json.loads(answer))
            verdicts[trials[number]] = verdict
            if verdict.word not in PASSED:
                tell(f"{verdict.word}: {trials[number]} ({verdict.seconds:.3g} s): {verdict.said.strip()}")
    return verdicts


def reply(text: str) -> str:
    """Answer the crew: carry out a trial."""
    trial, folder = json.loads(text)
    _limit(folder)
    faulthandler.dump_traceback_later(0.9 * SECONDS)  # what it is at when its time is nearly over
    verdict = carry_out(trial, Path(folder))
    faulthandler.cancel_dump_traceback_later()
    return json.dumps(asdict(verdict))


@cache
def _limit(folder: str) -> None:
    os.chdir(folder)
    limit_process(memory=MEMORY)
    resource.setrlimit(resource.RLIMIT_FSIZE, (256 << 20, resource.RLIM_INFINITY))
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # a longer write raises an `OSError`
    faulthandler.enable()


def carry_out(trial: str, folder: Path) -> Verdict:
    """Damage a fresh copy of a sample's folder, read it and judge."""
    name, mutation, _, _ = trial.split(" ")
    sample, case = build(folder / "samples")[name], folder / "case"
    shutil.rmtree(case, ignore_errors=True)
    shutil.copytree(folder / "samples" / sample.name, case)
    target, random = case / sample.target, Random(trial)
    target.write_bytes({**BYTES, **TEXT, **TOML}[mutation](target.read_bytes(), random))
    return judged(sample, case)


def judged(sample: Sample, case: Path) -> Verdict:
    """Read the sample in a folder, within which it may write, and judge."""
    (case / "tmp").mkdir(exist_ok=True)
    before, at_rest, start = {path.name for path in case.iterdir()}, forget_peak(), _seconds()
    kept = case if sample.name == "store" else case / "kept"
    said = io.StringIO()
    with ExitStack() as stack:
        stack.enter_context(patch.dict(os.environ, {VARIABLE: str(kept), "TMPDIR": str(case / "tmp")}))
        stack.enter_context(patch.object(contact, "MAX_STEPS", STEPS))
        if sample.read == "draw":
            stack.enter_context(patch.object(GmshSession, "__call__", _stop))
        stack.enter_context(redirect_stdout(io.StringIO()))
        stack.enter_context(redirect_stderr(said))
        code, escaped = _read(sample, case)
    message, peak = said.getvalue(), peak_memory() - at_rest
    defect = _defect(sample, case, code, message, escaped, before) or ("memory" if peak > PEAK else "")
    text = (escaped or message).replace(str(case), "")
    text = text if len(text) < 1200 else f"{text[:300]} ... {text[-900:]}"
    word = defect or ("refused" if code == 2 or STOPPED in message or (code == 1 and message) else "ran")
    return Verdict(word, text, round(_seconds() - start, 3), max(peak, 0.0))


def _seconds() -> float:
    used = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(each.ru_utime + each.ru_stime for each in used)


def _stop(*_: object) -> None:
    raise MeshingError(STOPPED)


def _read(sample: Sample, case: Path) -> tuple[int, str]:
    """Return the exit code, 2 for a file that a reader refuses, and the traceback of what should not have escaped."""
    try:
        if not isinstance(sample.read, str):
            with np.errstate(all="ignore"):
                sample.read(case / sample.target)
            return 0, ""
        verb = "run" if sample.read == "draw" else sample.read
        out = case / "out" / ("seat.h5" if verb == "greens" else "")
        options = ["--no-pictures"] if verb == "run" else []
        return run_command([verb, str(case / "scene.toml"), "-o", str(out), "--quiet", *options]), ""
    except Exception as error:
        if isinstance(sample.read, str) or type(error).__module__.partition(".")[0] not in ("seatfem", "impact"):
            return 1, traceback.format_exc()
        sys.stderr.write(f"{error}\n")
        return 2, ""
    except BaseException:
        return 1, traceback.format_exc()


def _defect(sample: Sample, case: Path, code: int, message: str, escaped: str, before: set[str]) -> str:
    """Return the defect in a word; "" without any."""
    for word, holds in (
        ("traceback", escaped or "Traceback" in message),
        ("unexpected", "this is a bug" in message),
        ("out of memory", "out of memory" in message),
        ("exit code", code not in (0, 1, 2)),
        ("flood", len(message) > FLOOD),
    ):
        if holds:
            return word
    if files := _left_behind(case, before):
        return files
    lines = [line for line in message.splitlines() if line.strip() and not line.startswith("warning: ")]
    summary = case / "out" / "summary.json"
    if code == 0 or (code == 1 and not lines and summary.exists()):  # a target that was missed, as the summary says
        return _not_finite(summary) if summary.exists() else ""
    if not lines:
        return "silent"
    return "" if _NAMED.search(message) or any(name in message for name in before) or STOPPED in message else "vague"


def _left_behind(case: Path, before: set[str]) -> str:
    """Return in words which files are temporary, not whole, or where none belong."""
    if any((case / "tmp").iterdir()):
        return "temporary files"
    if {path.name for path in case.iterdir()} - before - {"out", "kept"}:
        return "stray files"
    for path in (p for name in ("out", "kept") for p in (case / name).rglob("*") if p.is_file()):
        if path.name.startswith("."):
            return "temporary files"
        if path.stat().st_size == 0 or (path.suffix == ".h5" and not seal_holds(path)):
            return "half-written"
    return ""


def _not_finite(summary: Path) -> str:
    data = json.loads(summary.read_text(encoding="utf-8"), parse_constant=lambda _: math.nan)
    bad = [key for key, value in data.items() if isinstance(value, float) and not math.isfinite(value)]
    return f"not finite: {', '.join(bad[:3])}" if bad else ""
