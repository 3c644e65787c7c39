"""Carries out cases in processes under limits: what hangs or crashes ends as a verdict, not the run."""

import json
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Final

from seatfem.jobs import folders
from seatfem.jobs.crew import Lost, crew

from .trial import Case, Verdict

TIME: Final = 150.0  # s of a case; gmsh may try to read a file for 100 s
CASES_A_PROCESS: Final = 300


def run_cases(
    cases: Sequence[Case], corpus: Path, folder: Path, log: Path, tell: Callable[[str], None], limit: float = TIME
) -> dict[str, Verdict]:
    """Verdicts by the name of the case; each is appended to ``log`` at once, and what that holds is not done again."""
    known = folders.outcomes(log, "case", Verdict)
    todo = [case for case in cases if case.name not in known]
    start = time.monotonic()
    folder.mkdir(parents=True, exist_ok=True)
    jobs = [json.dumps([asdict(case), str(corpus.resolve()), str(folder.resolve()), limit]) for case in todo]
    with crew("tests.fuzz.worker:reply", renew=CASES_A_PROCESS) as ask:
        for number, answer in ask(jobs, limit):
            case = todo[number]
            known[case.name] = _lost(answer) if isinstance(answer, Lost) else Verdict(**json.loads(answer))
            folders.append(log, {"case": case.name, **asdict(known[case.name])})
            if number % 250 == 249 or number + 1 == len(todo):
                tell(f"{number + 1} of {len(todo)} cases, {time.monotonic() - start:.0f} s")
    return {case.name: known[case.name] for case in cases}


def _lost(job: Lost) -> Verdict:
    """The case that ended its process, or did not end."""
    return Verdict("hang" if job.hung else "crash", job.code or 0, job.log[:1100], round(job.seconds, 3))
