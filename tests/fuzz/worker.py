"""The fuzzer's worker: answers a case with its verdict, both in JSON. Started by `tests.fuzz.runner` only."""

import faulthandler
import json
import os
import resource
import signal
from dataclasses import asdict
from functools import cache
from pathlib import Path
from typing import Final

from seatfem.jobs.processes import limit_process

from .corpus import Specimen
from .trial import Case, carry_out

MEMORY: Final = 4 << 30  # bytes of address space beyond what the libraries map
FILE_SIZE: Final = 256 << 20  # bytes of one file


def reply(text: str) -> str:
    """A job has the case, the corpus, the working folder and the seconds for a case; what it is at when they are nearly
    over is printed to the standard error."""
    case, corpus, folder, limit = json.loads(text)
    _begin(folder)
    faulthandler.dump_traceback_later(0.9 * limit)
    case = Case(**case | {"specimen": Specimen(**case["specimen"])})
    verdict = carry_out(case, Path(corpus), Path(folder, "case"))
    faulthandler.cancel_dump_traceback_later()
    return json.dumps(asdict(verdict))


@cache
def _begin(folder: str) -> None:
    """Once in a process."""
    os.chdir(folder)
    limit_process(memory=MEMORY)
    resource.setrlimit(resource.RLIMIT_FSIZE, (FILE_SIZE, resource.RLIM_INFINITY))
    signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # a longer write raises an `OSError`
    faulthandler.enable()
